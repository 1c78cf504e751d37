//! PRINT as lines: the bytes of a channel up to each CR.

use std::collections::BTreeMap;
use std::time::Duration;

/// Longest line held back for its CR, in bytes.
const MAX_LINE: usize = 65_536;

/// Output of each channel since its last CR, and when it began to come.
#[derive(Debug, Clone, Default)]
pub(crate) struct PrintedLines(BTreeMap<&'static str, (Duration, Vec<u8>)>);

impl PrintedLines {
    /// Takes the bytes of a PRINT and returns the lines that are complete now.
    pub(crate) fn add(&mut self, at: Duration, channel: &'static str, bytes: &[u8]) -> Vec<String> {
        let (_, mut rest) = self.0.remove(channel).unwrap_or_default();
        rest.extend_from_slice(bytes);
        let mut lines = Vec::new();
        while let Some(end) = rest.iter().position(|byte| *byte == b'\r') {
            let line: Vec<u8> = rest.drain(..=end).take(end).collect();
            lines.push(text(&line));
        }
        if rest.len() > MAX_LINE {
            lines.push(text(&rest));
            rest.clear();
        }
        if !rest.is_empty() {
            self.0.insert(channel, (at, rest));
        }
        lines
    }

    /// What has no CR, at the end.
    pub(crate) fn take(&mut self) -> Vec<(&'static str, Duration, String)> {
        let rest = std::mem::take(&mut self.0).into_iter();
        rest.map(|(channel, (at, rest))| (channel, at, text(&rest)))
            .collect()
    }
}

fn text(line: &[u8]) -> String {
    String::from_utf8_lossy(line).into_owned()
}
