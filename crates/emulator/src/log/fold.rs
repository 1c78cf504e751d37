//! Folds floods of similar log lines. Lines are similar when the same statement of the program logs them about the same
//! port or action. In each window of time the first few are written; of the rest only the last one is, with the number of lines
//! that it replaces.
//!
//! The writer thread in [`super::writer`] is the only user and owns the clock.

use crate::config::args::LogFormat;
use std::time::{Duration, Instant};
use tracing::callsite::Identifier;

/// Lines with the same key that are written in a window before the rest is folded. A person cannot read more in a
/// second.
const BURST: u32 = 20;
/// Length of a window of folding.
const WINDOW: Duration = Duration::from_secs(1);
/// Keys that are tracked at once, which bounds the memory. Lines with further keys are not folded.
const MAX_KEYS: usize = 64;

/// The key that similar lines share: the log statement they come from, and the port or the action they are about.
pub(super) type LineKey = (Identifier, String);

/// The key of a formatted line.
pub(super) fn line_key(from: Identifier, line: &[u8], format: LogFormat) -> LineKey {
    let line = String::from_utf8_lossy(line);
    let message = match format {
        // After the time, which has colons of its own.
        LogFormat::Text => line.split_once(' ').map(|(_, rest)| rest.trim_end()),
        LogFormat::Json => line.split_once(r#""message":""#).map(|(_, rest)| rest),
    };
    let mut parts = message.unwrap_or_default().split([':', '"']);
    let first = parts.next().unwrap_or_default();
    // A message begins with its port or with what could not be done; these two name the action after it.
    let about = match first.ends_with("scenario") || first.ends_with("panel-refused") {
        true => format!("{first}:{}", parts.next().unwrap_or_default()),
        false => first.to_owned(),
    };
    (from, about)
}

struct Fold {
    key: LineKey,
    /// End of the current window.
    window_end: Instant,
    /// Lines that may still be written in this window.
    burst_left: u32,
    folded: u64,
    last: Vec<u8>,
}

/// The lines of the current windows, by key.
pub(super) struct LineFolder {
    format: LogFormat,
    folds: Vec<Fold>,
}

impl LineFolder {
    pub(super) fn new(format: LogFormat) -> LineFolder {
        let folds = Vec::new();
        LineFolder { format, folds }
    }

    /// Returns the line if it is to be written now, or counts it as folded.
    pub(super) fn admit(&mut self, now: Instant, kind: LineKey, line: Vec<u8>) -> Option<Vec<u8>> {
        let Some(fold) = self.folds.iter_mut().find(|fold| fold.key == kind) else {
            if self.folds.len() < MAX_KEYS {
                self.folds.push(Fold {
                    key: kind,
                    window_end: now + WINDOW,
                    burst_left: BURST - 1,
                    folded: 0,
                    last: Vec::new(),
                });
            }
            return Some(line);
        };
        if let Some(left) = fold.burst_left.checked_sub(1) {
            fold.burst_left = left;
            return Some(line);
        }
        fold.folded += 1;
        fold.last = line;
        None
    }

    /// Earliest time at which [`Folds::told`] may have a line.
    pub(super) fn next_window_end(&self) -> Option<Instant> {
        self.folds.iter().map(|fold| fold.window_end).min()
    }

    /// The summaries of the windows that are over at `now`.
    pub(super) fn due_summaries(&mut self, now: Instant) -> Vec<Vec<u8>> {
        let format = self.format;
        let mut summaries = Vec::new();
        self.folds.retain_mut(|fold| {
            if fold.window_end > now {
                return true;
            }
            // A flood that goes on gets one line a window, until a window had nothing to fold.
            let goes_on = fold.folded > 0;
            summaries.extend(fold.take_summary(format));
            (fold.window_end, fold.burst_left) = (now + WINDOW, 0);
            goes_on
        });
        summaries
    }

    /// The summaries of all windows, over or not.
    pub(super) fn final_summaries(&mut self) -> Vec<Vec<u8>> {
        let format = self.format;
        self.folds
            .iter_mut()
            .filter_map(|fold| fold.take_summary(format))
            .collect()
    }
}

impl Fold {
    fn take_summary(&mut self, format: LogFormat) -> Option<Vec<u8>> {
        let folded = std::mem::take(&mut self.folded);
        let mut line = std::mem::take(&mut self.last);
        if folded == 0 {
            return None;
        }
        while line.last().is_some_and(u8::is_ascii_whitespace) {
            line.pop();
        }
        match format {
            LogFormat::Text => line.extend(format!(" ... repeated {folded} times\n").bytes()),
            LogFormat::Json => {
                line.pop();
                line.extend(format!(",\"repeated\":{folded}}}\n").bytes());
            }
        }
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tracing::Callsite as _;

    fn key_of(line: &str, format: LogFormat) -> LineKey {
        // The call site does not matter here.
        let from = tracing::callsite!(name: "test", kind: tracing::metadata::Kind::EVENT, fields: message);
        line_key(from.metadata().callsite(), line.as_bytes(), format)
    }

    fn texts(lines: Vec<Vec<u8>>) -> Vec<String> {
        lines
            .into_iter()
            .map(|line| String::from_utf8(line).unwrap())
            .collect()
    }

    #[test]
    fn of_a_storm_the_beginning_is_written_and_then_a_line_a_window_that_counts() {
        let (mut folds, start) = (LineFolder::new(LogFormat::Text), Instant::now());
        let line = |number: u32| format!("2026-01-01T00:00:00Z  INFO IP0: {number} refused\n");
        let take = |folds: &mut LineFolder, now, number| {
            let text = line(number);
            folds
                .admit(now, key_of(&text, LogFormat::Text), text.into_bytes())
                .is_some()
        };
        let written = (0..1_000)
            .filter(|number| take(&mut folds, start, *number))
            .count();
        assert_eq!(written, BURST as usize);
        let other = "2026-01-01T00:00:00Z  INFO HOST: refused\n";
        let kind = key_of(other, LogFormat::Text);
        assert!(folds.admit(start, kind, Vec::new()).is_some(), "another port");
        assert_eq!(texts(folds.due_summaries(start)), Vec::<String>::new());
        assert_eq!(folds.next_window_end(), Some(start + WINDOW));
        let summaries = texts(folds.due_summaries(start + WINDOW));
        assert_eq!(
            summaries,
            [format!("{} ... repeated 980 times\n", line(999).trim_end())]
        );
        assert!(!take(&mut folds, start + WINDOW, 7), "it goes on");
        assert_eq!(texts(folds.final_summaries()).len(), 1, "told at the end");
        assert!(folds.due_summaries(start + 2 * WINDOW).is_empty() && folds.next_window_end().is_none());
        assert!(take(&mut folds, start + 2 * WINDOW, 8), "it was over");
    }

    #[test]
    fn different_actions_are_not_similar() {
        let text = |message: &str| format!("2026-01-01T00:00:00Z  INFO {message}\n");
        let json =
            |message: &str| format!("{{\"level\":\"INFO\",\"message\":\"{message}\",\"event\":\"x\"}}\n");
        let same = |one: &str, other: &str| {
            let text = key_of(&text(one), LogFormat::Text).1 == key_of(&text(other), LogFormat::Text).1;
            let json = key_of(&json(one), LogFormat::Json).1 == key_of(&json(other), LogFormat::Json).1;
            assert_eq!(text, json, "{one} {other}");
            text
        };
        assert!(same("IP0: SU refused: a", "IP0: SO refused: b"));
        assert!(same("teach pendant: 1", "teach pendant: 2"));
        assert!(!same("scenario: servo on", "scenario: servo off"));
        assert!(!same(
            "cannot store A: the power is off",
            "cannot store B: the power is off"
        ));
        assert!(!same(
            "finding panel-refused: cannot turn the servo on: a",
            "finding panel-refused: cannot start the program: a"
        ));
    }

    #[test]
    fn in_json_the_number_is_a_field_and_the_kinds_are_bounded() {
        let (mut folds, now) = (LineFolder::new(LogFormat::Json), Instant::now());
        let line = |port: usize| format!("{{\"message\":\"P{port}: m\",\"port\":\"P{port}\"}}\n");
        for _ in 0..=BURST {
            for port in 0..2 * MAX_KEYS {
                let line = line(port);
                folds.admit(now, key_of(&line, LogFormat::Json), line.into_bytes());
            }
        }
        let summaries = texts(folds.due_summaries(now + WINDOW));
        assert_eq!(summaries.len(), MAX_KEYS);
        assert_eq!(
            summaries[0],
            "{\"message\":\"P0: m\",\"port\":\"P0\",\"repeated\":1}\n"
        );
        let read: serde_json::Value = serde_json::from_str(&summaries[1]).unwrap();
        assert_eq!(read["repeated"], 1);
    }
}
