//! Cuts a file into lines, each with its number and its span.
//!
//! A line ends with CR, LF or CR LF (RAM-05). What is in the lines is left to `lexer`.

use crate::prelude::*;

use crate::diagnostic::Span;

/// A line of the file without its line end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Line {
    /// Counted from 1.
    pub number: u32,
    pub span: Span,
}

impl Line {
    /// A text of one line.
    pub fn only(text: &str) -> Line {
        Line::new(1, 0, text.len())
    }

    fn new(number: u32, start: usize, end: usize) -> Line {
        let span = Span::new(start, end);
        Line { number, span }
    }
}

/// The lines of a file: CR, LF and CR LF end a line (RAM-05), the code 1A ends the file (RAM-06).
pub(crate) fn lines(source: &str) -> Vec<Line> {
    let bytes = source.as_bytes();
    let length = bytes.iter().position(|b| *b == 0x1A).unwrap_or(bytes.len());
    let mut lines = Vec::new();
    let (mut start, mut at, mut number) = (0, 0, 1);
    while at < length {
        let byte = bytes.get(at).copied().unwrap_or(b'\n');
        if matches!(byte, b'\r' | b'\n') {
            lines.push(Line::new(number, start, at));
            number += 1;
            if byte == b'\r' && at + 1 < length && bytes.get(at + 1) == Some(&b'\n') {
                at += 1;
            }
            start = at + 1;
        }
        at += 1;
    }
    if start < length {
        lines.push(Line::new(number, start, length));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    // clause: RAM-05 RAM-06 S7
    #[test]
    fn cr_lf_and_both_end_a_line_and_1a_ends_the_file() {
        let spans: Vec<(u32, &str)> = lines("a\rb\r\nc\n\nd\x1Ae\r")
            .iter()
            .map(|l| (l.number, &"a\rb\r\nc\n\nd"[l.span.start..l.span.end]))
            .collect();
        assert_eq!(spans, vec![(1, "a"), (2, "b"), (3, "c"), (4, ""), (5, "d")]);
    }
}
