//! Fields whose form in a snapshot differs from that in memory: a map as a list, letters as one of the commands, an alarm
//! as its number.
//!
//! They are for `serde(with = ...)` and `serde(deserialize_with = ...)`.

use crate::alarm::AlarmCode;
use crate::prelude::*;
use alloc::collections::BTreeMap;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use ts3100_proto::command::COMMANDS;

/// A map whose keys are not strings, as a list of pairs.
pub mod pairs {
    use super::{BTreeMap, Deserialize, Deserializer, Serialize, Serializer, Vec};

    pub fn serialize<K: Serialize, V: Serialize, S: Serializer>(
        map: &BTreeMap<K, V>,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        to.collect_seq(map)
    }

    pub fn deserialize<'de, K, V, D>(from: D) -> Result<BTreeMap<K, V>, D::Error>
    where
        K: Deserialize<'de> + Ord,
        V: Deserialize<'de>,
        D: Deserializer<'de>,
    {
        Ok(Vec::<(K, V)>::deserialize(from)?.into_iter().collect())
    }
}

/// The letters of a command, none for no command.
pub fn letters<'de, D: Deserializer<'de>>(from: D) -> Result<&'static str, D::Error> {
    let found = String::deserialize(from)?;
    let mut known = COMMANDS.iter().map(|row| row.letters).chain([""]);
    known
        .find(|letters| *letters == found)
        .ok_or_else(|| D::Error::custom(format!("expected the letters of a command, found `{found}`")))
}

impl Serialize for AlarmCode {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&self.number())
    }
}

impl<'de> Deserialize<'de> for AlarmCode {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<AlarmCode, D::Error> {
        let number = String::deserialize(from)?;
        // Recordings of others may have a number that the table of today replaces.
        let current = AlarmCode::replacement(&number).unwrap_or(&number);
        AlarmCode::from_number(current).ok_or_else(|| {
            D::Error::custom(format!(
                "expected the number of an alarm of the table, found `{number}`"
            ))
        })
    }
}
