//! How the values of an [`Event`](crate::Event) are written: its serde form is that of the stream of events of the control
//! interface, so keys and words here are published.

use crate::prelude::*;
use crate::time::Time;
use bytes::Bytes;
use core::fmt::Display;
use serde::ser::{SerializeMap as _, Serializer};
use ts3100_proto::escape::{Escaped, hex_digits};
use ts3100_proto::words::Word;

/// For `serde(flatten)`: bytes as the keys `text` (control codes by name), `hex` and `bytes` (their number).
///
/// # Errors
/// Those of the serializer.
pub fn bytes<S: Serializer>(bytes: &Bytes, serializer: S) -> Result<S::Ok, S::Error> {
    let mut keys = serializer.serialize_map(Some(3))?;
    keys.serialize_entry("text", &Escaped::for_reading(bytes).to_string())?;
    keys.serialize_entry("hex", &hex_digits(bytes))?;
    keys.serialize_entry("bytes", &bytes.len())?;
    keys.end()
}

pub(crate) fn word<T: Word, S: Serializer>(value: &T, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(value.word())
}

pub(crate) fn text<T: Display, S: Serializer>(value: &T, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(value)
}

/// The kind of the event about a fault.
pub(crate) fn fault<S: Serializer>(fired: &bool, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(if *fired { "fault" } else { "fault-armed" })
}

pub(crate) fn servo<S: Serializer>(on: &bool, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map([("on", on)])
}

pub(crate) fn servo_delayed<S: Serializer>(until: &Time, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map([("until", until.as_seconds())])
}

/// Without a key if no file is selected.
pub(crate) fn selected<S: Serializer>(file: &Option<String>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(file.iter().map(|file| ("file", file)))
}
