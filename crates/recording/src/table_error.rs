//! Error in a TOML file that people write, with its place: scenarios and fault files are parsed by hand, so that
//! messages say what was expected.

use std::ops::Range;
use ts3100_proto::words::plain_message;

/// Something wrong at a place of the text.
pub(crate) struct TableError(pub(crate) Range<usize>, pub(crate) String);

impl From<toml::de::Error> for TableError {
    fn from(error: toml::de::Error) -> TableError {
        TableError(error.span().unwrap_or(0..0), plain_message(error.message()))
    }
}

/// The line of a place of the text, from 1.
pub(crate) fn line_of(text: &str, at: usize) -> usize {
    let before = text.as_bytes().get(..at).unwrap_or(text.as_bytes());
    1 + before.iter().filter(|byte| **byte == b'\n').count()
}

/// The column of a place of the text, from 1, in characters.
pub(crate) fn column_of(text: &str, at: usize) -> usize {
    let before = text.get(..at).unwrap_or(text);
    let line = before.rsplit('\n').next().unwrap_or_default();
    1 + line.chars().count()
}
