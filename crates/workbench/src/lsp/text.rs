//! A text as an editor changes it: places by line and column, in the units that both sides have agreed on.

use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A place: line and column, both from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Position {
    pub line: u32,
    pub character: u32,
}

/// A part of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Span {
    pub start: Position,
    pub end: Position,
}

/// Units of columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Units {
    /// Code units of UTF-16, which every editor knows.
    #[default]
    Utf16,
    Utf8,
}

impl Units {
    /// Its name in `positionEncoding`.
    pub fn name(self) -> &'static str {
        match self {
            Units::Utf16 => "utf-16",
            Units::Utf8 => "utf-8",
        }
    }

    fn width(self, letter: char) -> usize {
        match self {
            Units::Utf16 => letter.len_utf16(),
            Units::Utf8 => letter.len_utf8(),
        }
    }

    /// Length of a text in these units.
    pub fn length(self, text: &str) -> usize {
        text.chars().map(|letter| self.width(letter)).sum()
    }
}

/// A text with the beginnings of its lines.
#[derive(Debug, Clone, Default)]
pub struct Text {
    text: String,
    starts: Vec<usize>,
    units: Units,
}

impl Text {
    pub fn new(text: String, units: Units) -> Text {
        let starts = line_starts(&text);
        Text { text, starts, units }
    }

    pub fn units(&self) -> Units {
        self.units
    }

    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// The place of a byte; one beyond the end is the end.
    pub fn position(&self, byte: usize) -> Position {
        let byte = byte.min(self.text.len());
        let line = self
            .starts
            .partition_point(|start| *start <= byte)
            .saturating_sub(1);
        let start = self.starts.get(line).copied().unwrap_or(0);
        let before = self.text.get(start..byte).unwrap_or_default();
        Position {
            line: number(line),
            character: number(self.units.length(before)),
        }
    }

    /// The span of bytes.
    pub fn span(&self, bytes: Range<usize>) -> Span {
        Span {
            start: self.position(bytes.start),
            end: self.position(bytes.end),
        }
    }

    /// The byte of a place. A column beyond its line is the end of the line, a line beyond the text the end of the text.
    pub fn byte(&self, place: Position) -> usize {
        let line = usize::try_from(place.line).unwrap_or(usize::MAX);
        let Some(start) = self.starts.get(line).copied() else {
            return self.text.len();
        };
        let next = self.starts.get(line.saturating_add(1)).copied();
        let line = self
            .text
            .get(start..next.unwrap_or(self.text.len()))
            .unwrap_or_default();
        let line = line.trim_end_matches(['\r', '\n']);
        let mut left = usize::try_from(place.character).unwrap_or(usize::MAX);
        for (at, letter) in line.char_indices() {
            let width = self.units.width(letter);
            if left < width {
                return start + at;
            }
            left -= width;
        }
        start + line.len()
    }

    /// The bytes of a span; one that ends before it begins is empty.
    pub fn bytes(&self, span: Span) -> Range<usize> {
        let start = self.byte(span.start);
        start..self.byte(span.end).max(start)
    }

    /// Replaces a part of the text.
    pub fn replace(&mut self, span: Span, by: &str) {
        let bytes = self.bytes(span);
        self.text.replace_range(bytes, by);
        self.starts = line_starts(&self.text);
    }
}

/// Lines end with LF, CR or CR LF.
fn line_starts(text: &str) -> Vec<usize> {
    let bytes = text.as_bytes();
    let ends = bytes.iter().enumerate().filter(|(at, byte)| match byte {
        b'\n' => true,
        b'\r' => bytes.get(at + 1) != Some(&b'\n'),
        _ => false,
    });
    std::iter::once(0).chain(ends.map(|(at, _)| at + 1)).collect()
}

pub fn number(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "A\u{1F600}B\r\n\u{e9}\rC\n";

    fn place(line: u32, character: u32) -> Position {
        Position { line, character }
    }

    #[test]
    fn a_place_is_a_byte_and_back() {
        for units in [Units::Utf16, Units::Utf8] {
            let text = Text::new(TEXT.into(), units);
            for (byte, _) in TEXT
                .char_indices()
                .filter(|(_, letter)| !"\r\n".contains(*letter))
            {
                assert_eq!(text.byte(text.position(byte)), byte, "{units:?} {byte}");
            }
        }
        let text = Text::new(TEXT.into(), Units::Utf16);
        assert_eq!(text.position(TEXT.find('B').unwrap()), place(0, 3));
        assert_eq!(text.byte(place(0, 99)), TEXT.find('\r').unwrap());
        assert_eq!(text.byte(place(9, 0)), TEXT.len());
        // Within a character.
        assert_eq!(text.byte(place(0, 2)), 1);
        assert_eq!(
            Text::new(TEXT.into(), Units::Utf8).position(TEXT.find('B').unwrap()),
            place(0, 5)
        );
    }

    #[test]
    fn a_replaced_part_moves_the_lines_after_it() {
        let mut text = Text::new(TEXT.into(), Units::Utf16);
        let span = Span {
            start: place(0, 1),
            end: place(2, 0),
        };
        text.replace(span, "\nX\n");
        assert_eq!(text.as_str(), "A\nX\nC\n");
        assert_eq!(text.position(4), place(2, 0));
        text.replace(
            Span {
                start: place(5, 0),
                end: place(1, 0),
            },
            "END",
        );
        assert_eq!(text.as_str(), "A\nX\nC\nEND");
    }
}
