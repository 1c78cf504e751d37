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

/// The lines of a file: CR, LF and CR LF end a line (RAM-05), the code 1A ends the file (RAM-06).
pub(crate) fn lines(source: &str) -> Vec<Line> {
    let text = source.split('\u{1A}').next().unwrap_or_default();
    let (mut start, mut number, mut lines) = (0, 1, Vec::new());
    while let Some(rest) = text.get(start..).filter(|rest| !rest.is_empty()) {
        let length = rest.find(['\r', '\n']).unwrap_or(rest.len());
        let span = Span::new(start, start + length);
        lines.push(Line { number, span });
        let pair = rest.get(length..).is_some_and(|tail| tail.starts_with("\r\n"));
        start = span.end + if pair { 2 } else { 1 };
        number += 1;
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
