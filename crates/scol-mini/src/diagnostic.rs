//! What the compiler has to say about a source: errors and warnings with place, stable code and help.
//! What follows from an error (NG, an alarm) is left to the caller.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// Most diagnostics of one compilation; the last says that more were left out.
pub const MAX_DIAGNOSTICS: usize = 100;

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// There will be no program.
    Error,
    /// The program runs, but look here.
    Warning,
}

/// A range of bytes of the source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Span {
    /// First byte.
    pub start: usize,
    /// One past the last.
    pub end: usize,
}

impl Span {
    /// From the beginning of one to the end of the other.
    #[must_use]
    pub fn to(self, other: Span) -> Span {
        Span { start: self.start, end: other.end }
    }
}

/// One remark.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// Stable code, `E` or `W` and four digits.
    pub code: &'static str,
    /// The place in the source.
    pub span: Span,
    /// Line, from 1.
    pub line: u32,
    /// Column, from 1, in bytes.
    pub column: u32,
    /// What was expected and what was found.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
}

impl Diagnostic {
    /// Writes the remark out: place and message, the source line, a caret line, the help.
    ///
    /// `source` is the text that was compiled, `name` the name of its file.
    #[must_use]
    pub fn render(&self, source: &str, name: &str) -> String {
        let word = match self.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        let mut text =
            format!("{name}:{}:{}: {word}[{}]: {}\n", self.line, self.column, self.code, self.message);
        let bytes = source.as_bytes();
        let start = self.span.start.min(bytes.len());
        let begin = line_begin(bytes, start);
        let end = line_end(bytes, start);
        let shown: String = String::from_utf8_lossy(bytes.get(begin..end).unwrap_or_default())
            .chars()
            .map(|c| if c.is_control() { ' ' } else { c })
            .collect();
        let number = self.line.to_string();
        let margin = " ".repeat(number.len());
        let lead = String::from_utf8_lossy(bytes.get(begin..start).unwrap_or_default()).chars().count();
        let length = self.span.end.min(end).saturating_sub(start).max(1);
        text.push_str(&format!("{number} | {shown}\n{margin} | {}{}\n", " ".repeat(lead), "^".repeat(length)));
        if let Some(help) = &self.help {
            text.push_str(&format!("{margin} = help: {help}\n"));
        }
        text
    }
}

fn line_begin(bytes: &[u8], at: usize) -> usize {
    let before = bytes.get(..at).unwrap_or_default();
    before.iter().rposition(|b| matches!(b, b'\r' | b'\n')).map_or(0, |end| end + 1)
}

fn line_end(bytes: &[u8], at: usize) -> usize {
    let after = bytes.get(at..).unwrap_or_default();
    at + after.iter().position(|b| matches!(b, b'\r' | b'\n')).unwrap_or(after.len())
}

/// An error or warning whose line is not looked up yet.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Problem {
    pub code: &'static str,
    pub span: Span,
    pub message: String,
    pub help: Option<String>,
}

impl Problem {
    pub fn new(code: &'static str, span: Span, message: impl Into<String>) -> Self {
        Self { code, span, message: message.into(), help: None }
    }

    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// Collects the remarks of one compilation, bounded by [`MAX_DIAGNOSTICS`].
#[derive(Debug)]
pub(crate) struct Sink {
    /// Where each line begins.
    starts: Vec<usize>,
    list: Vec<Diagnostic>,
    errors: bool,
}

impl Sink {
    pub fn new(source: &str) -> Self {
        let bytes = source.as_bytes();
        let mut starts = Vec::from([0]);
        for (at, byte) in bytes.iter().enumerate() {
            let pair = *byte == b'\r' && bytes.get(at + 1) == Some(&b'\n');
            if matches!(byte, b'\r' | b'\n') && !pair {
                starts.push(at + 1);
            }
        }
        Self { starts, list: Vec::new(), errors: false }
    }

    pub fn error(&mut self, problem: Problem) {
        self.errors = true;
        self.push(Severity::Error, problem);
    }

    pub fn warning(&mut self, problem: Problem) {
        self.push(Severity::Warning, problem);
    }

    pub fn has_errors(&self) -> bool {
        self.errors
    }

    /// The remarks in source order.
    pub fn finish(mut self) -> Vec<Diagnostic> {
        self.list.sort_by_key(|d| (d.line, d.column));
        self.list
    }

    fn push(&mut self, severity: Severity, problem: Problem) {
        let room = MAX_DIAGNOSTICS.saturating_sub(self.list.len());
        // The place before the last is kept for errors, so that warnings cannot hide why there is no program.
        if room == 0 || (room <= 2 && severity == Severity::Warning) {
            return;
        }
        let line = self.starts.partition_point(|start| *start <= problem.span.start);
        let begin = line.checked_sub(1).and_then(|l| self.starts.get(l)).copied().unwrap_or(0);
        let message = match room {
            1 => "too many errors, the rest is left out".to_string(),
            _ => problem.message,
        };
        self.list.push(Diagnostic {
            severity,
            code: if room == 1 { "E0009" } else { problem.code },
            span: problem.span,
            line: u32::try_from(line).unwrap_or(u32::MAX),
            column: u32::try_from(problem.span.start - begin + 1).unwrap_or(u32::MAX),
            message,
            help: problem.help,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rendering_shows_the_line_and_points_at_the_place() {
        let source = "PROGRAM T\r\nN = = 1\r\nEND\r\n";
        let mut sink = Sink::new(source);
        let span = Span { start: 15, end: 16 };
        sink.error(Problem::new("E0101", span, "expected a value, found \"=\"").help("write one ="));
        let list = sink.finish();
        assert_eq!(
            list[0].render(source, "T"),
            "T:2:5: error[E0101]: expected a value, found \"=\"\n2 | N = = 1\n  |     ^\n  = help: write one =\n"
        );
    }

    #[test]
    fn the_list_is_bounded_and_says_so() {
        let mut sink = Sink::new("X\n");
        for _ in 0..10_000 {
            sink.warning(Problem::new("W0001", Span::default(), "w"));
            sink.error(Problem::new("E0001", Span::default(), "e"));
        }
        assert!(sink.has_errors());
        let list = sink.finish();
        assert_eq!(list.len(), MAX_DIAGNOSTICS);
        assert!(list.iter().any(|d| d.code == "E0009"));
    }
}
