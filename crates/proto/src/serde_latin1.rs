//! Bytes on paper: a snapshot writes them as text, one character U+0000 to U+00FF a byte, so that what was sent can be
//! read and nothing is lost. For the fields of snapshots alone; the wire knows nothing of it.

use core::fmt;
use core::marker::PhantomData;
use serde::de::{Deserializer, Error, Visitor};
use serde::ser::Serializer;

/// Writes bytes as text.
///
/// # Errors
/// The serializer's.
pub fn serialize<'a, T, S>(bytes: &'a T, to: S) -> Result<S::Ok, S::Error>
where
    &'a T: IntoIterator<Item = &'a u8>,
    S: Serializer,
{
    to.collect_str(&Text(bytes))
}

/// Reads them back.
///
/// # Errors
/// A character above U+00FF, which stands for no byte.
pub fn deserialize<'de, T, D>(from: D) -> Result<T, D::Error>
where
    T: FromIterator<u8>,
    D: Deserializer<'de>,
{
    from.deserialize_str(Bytes(PhantomData))
}

/// Bytes that are shown as text.
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
