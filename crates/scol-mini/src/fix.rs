//! Changes of the source that remove a diagnostic: what an editor offers as a quick fix.
//!
//! A diagnostic has one when its help names one change; [`Edit::is_certain`] says which are carried out unasked. `suggest`
//! makes those of errors; the lexer, the parser and the lints attach their own.

use crate::lines::{BYTE_ORDER_MARK, Span, line_end};
use crate::prelude::*;

/// A change of the source: one place is replaced by a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edit {
    /// The place; without bytes the text is inserted before it.
    pub span: Span,
    /// The new text, with the line endings of the source; may be empty.
    pub text: String,
    /// Whether an editor may make the change without asking. A guessed name of the user is not certain, since another
    /// point may be meant; neither is a change of a program that compiles.
    pub is_certain: bool,
}

impl Edit {
    /// Replaces a place by a text.
    pub(crate) fn replace(span: Span, text: impl Into<String>) -> Edit {
        let text = text.into();
        Edit {
            span,
            text,
            is_certain: true,
        }
    }

    /// The same change, to be made only when the user chooses it.
    pub(crate) fn uncertain(self) -> Edit {
        Edit {
            is_certain: false,
            ..self
        }
    }

    /// Removes a place and the blanks that follow it.
    pub(crate) fn remove(source: &str, span: Span) -> Edit {
        let rest = source.get(span.end..).unwrap_or_default();
        let blanks = rest.len() - rest.trim_start_matches(' ').len();
        Edit::replace(Span::new(span.start, span.end + blanks), "")
    }

    /// Replaces a place by a word, with a blank on each side where a letter or a digit would touch it.
    pub(crate) fn word(source: &str, span: Span, word: &str) -> Edit {
        let joins = |c: Option<char>| c.is_some_and(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '.'));
        let (before, after) = (source.get(..span.start), source.get(span.end..));
        let left = if joins(before.and_then(|text| text.chars().next_back())) {
            " "
        } else {
            ""
        };
        let right = if joins(after.and_then(|text| text.chars().next())) {
            " "
        } else {
            ""
        };
        Edit::replace(span, format!("{left}{word}{right}"))
    }

    /// Inserts a line before the one that holds a byte, with the same indentation.
    pub(crate) fn line_before(source: &str, byte: usize, text: &str) -> Edit {
        let before = source.get(..byte).unwrap_or_default();
        let start = before.rfind(['\r', '\n']).map_or(0, |end| end + 1);
        let (_, ending) = line_end(source, byte);
        let rest = source.get(start..).unwrap_or_default();
        let margin = " ".repeat(rest.len() - rest.trim_start_matches(' ').len());
        Edit::replace(Span::at(start), format!("{margin}{text}{ending}"))
    }

    /// Adds a line at the end of the source, before the code 1A, which ends a file.
    pub(crate) fn last_line(source: &str, text: &str) -> Edit {
        let end = source.find('\u{1A}').unwrap_or(source.len());
        let before = source.get(..end).unwrap_or_default();
        let (_, ending) = line_end(source, 0);
        let open = if before.is_empty() || before.ends_with(['\r', '\n']) {
            ""
        } else {
            ending
        };
        Edit::replace(Span::at(end), format!("{open}{text}{ending}"))
    }

    /// The source after the change; unchanged when the place is not in it.
    pub fn apply(&self, source: &str) -> String {
        let ends = (source.get(..self.span.start), source.get(self.span.end..));
        match ends {
            (Some(before), Some(after)) if self.span.start <= self.span.end => {
                format!("{before}{}{after}", self.text)
            }
            _ => source.to_string(),
        }
    }

    /// The change in words, for a menu: `replace MOVEL by MOVES`, `remove ;`, `insert END`.
    ///
    /// `source` is the text that was compiled.
    pub fn title(&self, source: &str) -> String {
        let (old, new) = (self.span.text(source), self.text.trim());
        match (old.trim(), new) {
            _ if old.contains('\t') => "replace tabs by spaces".to_string(),
            _ if old.starts_with(BYTE_ORDER_MARK) => "remove the byte order mark".to_string(),
            ("", new) => format!("insert {new}"),
            (old, "") => format!("remove {old}"),
            (old, new) => format!("replace {old} by {new}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn titles_and_results() {
        let source = "PROGRAM T\r\n  A=B%C;\r\n";
        let at = |text: &str| {
            let start = source.find(text).unwrap();
            Span::new(start, start + text.len())
        };
        let word = Edit::word(source, at("%"), "MOD");
        assert_eq!(word.title(source), "replace % by MOD");
        assert_eq!(word.apply(source), "PROGRAM T\r\n  A=B MOD C;\r\n");
        let remove = Edit::remove(source, at(";"));
        assert_eq!(remove.title(source), "remove ;");
        assert_eq!(remove.apply(source), "PROGRAM T\r\n  A=B%C\r\n");
        let line = Edit::line_before(source, at("B").start, "BREAK");
        assert_eq!(line.title(source), "insert BREAK");
        assert_eq!(line.apply(source), "PROGRAM T\r\n  BREAK\r\n  A=B%C;\r\n");
        assert_eq!(
            Edit::last_line(source, "END").apply(source),
            format!("{source}END\r\n")
        );
        assert_eq!(
            Edit::last_line("A\u{1A}", "END").apply("A\u{1A}"),
            "A\nEND\n\u{1A}"
        );
        let outside = Edit::replace(Span::new(90, 91), "X");
        assert_eq!(outside.apply(source), source);
    }
}
