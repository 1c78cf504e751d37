//! Places in a source, and its lines.
//!
//! The content of a line is left to `lexer`.

use crate::prelude::*;

/// A range of bytes of the source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Span {
    /// Index of the first byte in the source.
    pub start: usize,
    /// Offset after the last byte.
    pub end: usize,
}

impl Span {
    pub(crate) fn new(start: usize, end: usize) -> Span {
        Span { start, end }
    }

    /// The place before this byte.
    pub(crate) fn at(byte: usize) -> Span {
        Span::new(byte, byte)
    }

    /// Text of `source` at this place; empty where the place is outside of it.
    pub(crate) fn text(self, source: &str) -> &str {
        source.get(self.start..self.end).unwrap_or_default()
    }

    /// Span from the beginning of this one to the end of the other.
    #[must_use]
    pub fn to(self, other: Span) -> Span {
        Span::new(self.start, other.end)
    }
}

/// A line of the file without its line end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Line {
    /// Counted from 1.
    pub number: u32,
    pub span: Span,
}

/// Mark of the encoding that some editors put in front of a file.
pub(crate) const BYTE_ORDER_MARK: char = '\u{FEFF}';

/// The lines of a file without its byte order mark: CR, LF and CR LF end a line (RAM-05), the code 1A ends the file (RAM-06).
pub(crate) fn lines(source: &str) -> Vec<Line> {
    let text = source.split('\u{1A}').next().unwrap_or_default();
    let unmarked = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
    let (mut start, mut number, mut lines) = (text.len() - unmarked.len(), 1, Vec::new());
    while start < text.len() {
        let (at, end) = line_end(text, start);
        let span = Span::new(start, at);
        lines.push(Line { number, span });
        start = at + end.len();
        number += 1;
    }
    lines
}

/// End of the line that holds `from`, and its line ending; LF where there is none.
pub(crate) fn line_end(source: &str, from: usize) -> (usize, &'static str) {
    let rest = source.get(from..).unwrap_or_default();
    let length = rest.find(['\r', '\n']).unwrap_or(rest.len());
    let tail = rest.get(length..).unwrap_or_default();
    let mut ends = ["\r\n", "\r"].into_iter();
    let end = ends.find(|end| tail.starts_with(end)).unwrap_or("\n");
    (from + length, end)
}
