//! Serde for byte strings in snapshots: one character U+0000 to U+00FF for each byte (Latin-1), so that ASCII stays
//! readable and every byte survives.
//!
//! Use it as `#[serde(with = "ts3100_proto::serde_latin1")]`. The wire has its own encodings, see [`crate::text`].

use crate::prelude::*;
use core::fmt;
use core::marker::PhantomData;
use serde::de::{Deserializer, Error, Visitor};
use serde::ser::Serializer;

/// Serializes bytes as one string.
///
/// # Errors
/// Those of the serializer.
pub fn serialize<'a, T, S>(bytes: &'a T, to: S) -> Result<S::Ok, S::Error>
where
    &'a T: IntoIterator<Item = &'a u8>,
    S: Serializer,
{
    let text: String = bytes.into_iter().copied().map(char::from).collect();
    to.serialize_str(&text)
}

/// Deserializes the string of [`serialize`].
///
/// # Errors
/// A character above U+00FF.
pub fn deserialize<'de, T, D>(from: D) -> Result<T, D::Error>
where
    T: FromIterator<u8>,
    D: Deserializer<'de>,
{
    from.deserialize_str(Bytes(PhantomData))
}

const EXPECTED: &str = "bytes as text, characters U+0000 to U+00FF";

struct Bytes<T>(PhantomData<T>);

impl<T: FromIterator<u8>> Visitor<'_> for Bytes<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(EXPECTED)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<T, E> {
        let byte = |letter| {
            u8::try_from(letter).map_err(|_| {
                let found = format!("character U+{:04X}", u32::from(letter));
                E::custom(format_args!("expected {EXPECTED}, found {found}"))
            })
        };
        text.chars().map(byte).collect()
    }
}
