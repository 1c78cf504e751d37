//! Diagnostics: the errors and warnings about a source, with their place, a stable code and help.
//! The caller decides what an error causes (NG, an alarm). [`Sink`] collects those of one
//! compilation, at most [`MAX_DIAGNOSTICS`], and finds the line of each; `suggest` adds to the help.
//! [`DIAGNOSTICS`](crate::DIAGNOSTICS) lists the codes.
//!
//! W0601 and above come from [`check`](crate::check) alone; a compilation does not look for them.

use crate::fix::Edit;
use crate::lines::lines;
use crate::prelude::*;
use core::ops::Range;

pub use crate::lines::Span;

/// Most diagnostics of one compilation; the last says that more were left out.
pub const MAX_DIAGNOSTICS: usize = 100;

/// Beginning of the message about a point that is not known.
pub(crate) const NO_POINT: &str = "no value for";

/// Severity of a diagnostic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// There will be no program.
    Error,
    /// The program compiles, but is likely wrong here.
    Warning,
}

impl Severity {
    /// `error` or `warning`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
        }
    }
}

/// An error or a warning about a source.
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
    /// Message, with what was expected and what was found.
    pub message: String,
    /// Remedy, if there is one.
    pub help: Option<String>,
    /// Change of the source that carries the remedy out, if it names one.
    pub fix: Option<Box<Edit>>,
}

impl Diagnostic {
    /// A remark whose line the sink will look up. The letter of its code says how bad it is.
    pub(crate) fn new(code: &'static str, span: Span, message: impl Into<String>) -> Self {
        let severity = match code.starts_with('W') {
            true => Severity::Warning,
            false => Severity::Error,
        };
        Self {
            severity,
            code,
            span,
            line: 0,
            column: 0,
            message: message.into(),
            help: None,
            fix: None,
        }
    }

    /// The remark as the result of what fails with it.
    pub(crate) fn fail<T>(
        code: &'static str,
        span: Span,
        message: impl Into<String>,
    ) -> Result<T, Diagnostic> {
        Err(Diagnostic::new(code, span, message))
    }

    pub(crate) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Attaches a change. That of a warning is never certain: it changes a program that compiles.
    pub(crate) fn fix(mut self, fix: Edit) -> Self {
        let fix = match self.severity {
            Severity::Error => fix,
            Severity::Warning => fix.uncertain(),
        };
        self.fix = Some(Box::new(fix));
        self
    }

    /// Whether it is about a point that neither the file nor the table of taught points has.
    pub fn misses_point(&self) -> bool {
        self.code == "E0201" && self.message.starts_with(NO_POINT)
    }

    /// Bytes of the place; they do not go beyond the end of its line.
    ///
    /// `source` is the text that was compiled.
    pub fn bytes(&self, source: &str) -> Range<usize> {
        let (_, after) = self.source_line(source);
        let start = self.span.start.min(source.len());
        start..start + self.marked(after).len()
    }

    /// Columns of the place, from 1, in characters as editors count them; they do not go beyond the end of its line.
    ///
    /// `source` is the text that was compiled.
    pub fn columns(&self, source: &str) -> Range<usize> {
        let (before, after) = self.source_line(source);
        let column = characters(before) + 1;
        column..column + characters(self.marked(after))
    }

    /// Line of the place, cut in two: the part before the place, and the part from there on.
    fn source_line<'a>(&self, source: &'a str) -> (&'a [u8], &'a [u8]) {
        let bytes = source.as_bytes();
        let is_end = |byte: &u8| matches!(byte, b'\r' | b'\n');
        let (before, after) = bytes.split_at_checked(self.span.start).unwrap_or((bytes, &[]));
        let begin = before.iter().rposition(is_end).map_or(0, |end| end + 1);
        let end = after.iter().position(is_end).unwrap_or(after.len());
        let (before, after) = (before.get(begin..), after.get(..end));
        (before.unwrap_or_default(), after.unwrap_or_default())
    }

    /// Part of the rest of its line that the diagnostic is about.
    fn marked<'a>(&self, after: &'a [u8]) -> &'a [u8] {
        let length = self.span.end.saturating_sub(self.span.start);
        after.get(..length).unwrap_or(after)
    }

    /// Writes the remark out: place and message, the source line, a caret line, the help.
    ///
    /// `source` is the text that was compiled, `name` the name of its file.
    pub fn render(&self, source: &str, name: &str) -> String {
        let word = self.severity.as_str();
        let mut text = format!(
            "{name}:{}:{}: {word}[{}]: {}\n",
            self.line, self.column, self.code, self.message
        );
        let (before, after) = self.source_line(source);
        let line = [before, after].concat();
        let shown: String = String::from_utf8_lossy(&line)
            .chars()
            .map(|c| if c.is_control() { ' ' } else { c })
            .collect();
        let number = self.line.to_string();
        let margin = " ".repeat(number.len());
        let lead = " ".repeat(characters(before));
        let carets = "^".repeat(characters(self.marked(after)).max(1));
        text.push_str(&format!("{number} | {shown}\n{margin} | {lead}{carets}\n"));
        if let Some(help) = &self.help {
            text.push_str(&format!("{margin} = help: {help}\n"));
        }
        text
    }
}

fn characters(text: &[u8]) -> usize {
    String::from_utf8_lossy(text).chars().count()
}

/// Collects the remarks of one compilation, bounded by [`MAX_DIAGNOSTICS`].
#[derive(Debug)]
pub(crate) struct Sink {
    /// Offset of the beginning of each line.
    starts: Vec<usize>,
    list: Vec<Diagnostic>,
}

impl Sink {
    pub fn new(source: &str) -> Self {
        let starts = lines(source).iter().map(|line| line.span.start).collect();
        let list = Vec::new();
        Self { starts, list }
    }

    /// Whether there is an error. The first is never left out.
    pub fn has_errors(&self) -> bool {
        self.list.iter().any(|d| d.severity == Severity::Error)
    }

    /// The remarks in source order.
    pub fn finish(mut self) -> Vec<Diagnostic> {
        self.list.sort_by_key(|d| (d.line, d.column));
        self.list
    }

    /// Adds a remark and looks up its line.
    pub fn push(&mut self, mut remark: Diagnostic) {
        let room = MAX_DIAGNOSTICS.saturating_sub(self.list.len());
        // The place before the last is kept for errors, so that warnings cannot hide why there is no program.
        if room == 0 || (room <= 2 && remark.severity == Severity::Warning) {
            return;
        }
        if room == 1 {
            remark.code = "E0009";
            remark.message = "too many errors, the rest is left out".to_string();
            remark.fix = None;
        }
        let line = self
            .starts
            .partition_point(|start| *start <= remark.span.start)
            .max(1);
        let begin = line.checked_sub(1).and_then(|line| self.starts.get(line));
        // A byte order mark is before the first line.
        let column = remark.span.start.saturating_sub(begin.copied().unwrap_or(0)) + 1;
        remark.line = u32::try_from(line).unwrap_or(u32::MAX);
        remark.column = u32::try_from(column).unwrap_or(u32::MAX);
        self.list.push(remark);
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
        sink.push(Diagnostic::new("E0101", span, "expected a value, found \"=\"").help("write one ="));
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
            sink.push(Diagnostic::new("W0001", Span::default(), "w"));
            sink.push(Diagnostic::new("E0001", Span::default(), "e"));
        }
        assert!(sink.has_errors());
        let list = sink.finish();
        assert_eq!(list.len(), MAX_DIAGNOSTICS);
        assert!(list.iter().any(|d| d.code == "E0009"));
    }
}
