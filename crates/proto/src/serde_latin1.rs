//! Serde for byte strings in snapshots: one character U+0000 to U+00FF for each byte (Latin-1), so that ASCII stays
//! readable and every byte survives.
//!
//! Use it as `#[serde(with = "ts3100_proto::serde_latin1")]`. The wire has its own encodings, see [`crate::text`].

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
    to.collect_str(&Text(bytes))
}

/// Deserializes the string of [`serialize`].
///
/// # Errors
/// A character above U+00FF, which is no byte.
pub fn deserialize<'de, T, D>(from: D) -> Result<T, D::Error>
where
    T: FromIterator<u8>,
    D: Deserializer<'de>,
{
    from.deserialize_str(Bytes(PhantomData))
}

/// Displays bytes as characters without collecting them in a string first.
struct Text<'a, T>(&'a T);

impl<'a, T> fmt::Display for Text<'a, T>
where
    &'a T: IntoIterator<Item = &'a u8>,
{
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use fmt::Write as _;
        self.0
            .into_iter()
            .try_for_each(|&byte| f.write_char(char::from(byte)))
    }
}

struct Bytes<T>(PhantomData<T>);

impl<T: FromIterator<u8>> Visitor<'_> for Bytes<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("bytes as text, characters U+0000 to U+00FF")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<T, E> {
        let byte = |letter| {
            u8::try_from(letter).map_err(|_| {
                let found = alloc::format!("character U+{:04X}", u32::from(letter));
                E::custom(format_args!(
                    "expected bytes as text, characters U+0000 to U+00FF, found {found}"
                ))
            })
        };
        text.chars().map(byte).collect()
    }
}
