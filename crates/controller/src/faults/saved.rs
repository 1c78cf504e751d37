//! A fault in a snapshot: its number, and its specification as `--fault` takes it.

use super::{Fault, spec};
use crate::prelude::*;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A fault: its number, and the rest as `--fault` takes it.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SavedFault {
    id: u32,
    spec: String,
}

impl Serialize for Fault {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let (id, spec) = (self.id, self.to_string());
        SavedFault { id, spec }.serialize(to)
    }
}

impl<'de> Deserialize<'de> for Fault {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Fault, D::Error> {
        let SavedFault { id, spec } = SavedFault::deserialize(from)?;
        // It may be one that can never fire: an earlier version could arm it.
        let fault = spec::parse(&spec).map_err(D::Error::custom)?;
        Ok(Fault { id, ..fault })
    }
}
