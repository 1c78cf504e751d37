//! Collects the diagnostics of one compilation and finds the line of each.
//!
//! It keeps at most [`MAX_DIAGNOSTICS`]. Suggestions are added afterwards (`suggest`).

use crate::prelude::*;

use crate::diagnostic::{Diagnostic, MAX_DIAGNOSTICS, Severity};

/// Collects the remarks of one compilation, bounded by [`MAX_DIAGNOSTICS`].
#[derive(Debug)]
pub(crate) struct Sink {
    /// Where each line begins.
    starts: Vec<usize>,
    list: Vec<Diagnostic>,
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
        }
        let line = self.starts.partition_point(|start| *start <= remark.span.start);
        let begin = line.checked_sub(1).and_then(|line| self.starts.get(line));
        let column = remark.span.start - begin.copied().unwrap_or(0) + 1;
        remark.line = u32::try_from(line).unwrap_or(u32::MAX);
        remark.column = u32::try_from(column).unwrap_or(u32::MAX);
        self.list.push(remark);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Span;

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
