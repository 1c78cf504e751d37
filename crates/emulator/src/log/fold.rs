//! Folds a storm of log lines: of lines from the same place of the program about the same port, the first few in a
//! window of time are written, of the others only the last, with how many they were.

use crate::config::args::LogFormat;
use std::time::{Duration, Instant};
use tracing::callsite::Identifier;

/// Lines of one kind that are written in a window before they are folded: a person reads no more.
const BURST: u32 = 20;
/// Length of a window.
const WINDOW: Duration = Duration::from_secs(1);
/// Kinds that are told apart; lines of further ones are not folded meanwhile.
const KINDS: usize = 64;

/// What lines are counted by: where in the program they come from, and the port they are about or their first word.
pub(super) type Kind = (Identifier, String);

/// The kind of a line.
pub(super) fn kind(from: Identifier, line: &[u8], format: LogFormat) -> Kind {
    let line = String::from_utf8_lossy(line);
    let about = match format {
        // Behind the time and the level.
        LogFormat::Text => line.split_whitespace().nth(2),
        LogFormat::Json => {
            let port = line.split_once(r#""port":""#).map(|(_, rest)| rest);
            port.and_then(|rest| rest.split('"').next())
        }
    };
    (from, about.unwrap_or_default().to_owned())
}

struct Fold {
    kind: Kind,
    /// End of its window.
    until: Instant,
    /// Lines that may still be written before then.
    left: u32,
    folded: u64,
    last: Vec<u8>,
}

/// The kinds of the lines of the last window.
pub(super) struct Folds {
    format: LogFormat,
    folds: Vec<Fold>,
}

impl Folds {
    pub(super) fn new(format: LogFormat) -> Folds {
        let folds = Vec::new();
        Folds { format, folds }
    }

    /// The line, if it is to be written.
    pub(super) fn take(&mut self, now: Instant, kind: Kind, line: Vec<u8>) -> Option<Vec<u8>> {
        let Some(fold) = self.folds.iter_mut().find(|fold| fold.kind == kind) else {
            if self.folds.len() < KINDS {
                self.folds.push(Fold {
                    kind,
                    until: now + WINDOW,
                    left: BURST - 1,
                    folded: 0,
                    last: Vec::new(),
                });
            }
            return Some(line);
        };
        if let Some(left) = fold.left.checked_sub(1) {
            fold.left = left;
            return Some(line);
        }
        fold.folded += 1;
        fold.last = line;
        None
    }

    /// When [`Folds::told`] may have something.
    pub(super) fn next(&self) -> Option<Instant> {
        self.folds.iter().map(|fold| fold.until).min()
    }

    /// The lines that stand for those folded in the windows that are over by `now`.
    pub(super) fn told(&mut self, now: Instant) -> Vec<Vec<u8>> {
        let format = self.format;
        let mut told = Vec::new();
        self.folds.retain_mut(|fold| {
            if fold.until > now {
                return true;
            }
            // A storm that goes on has a line for each window, until one was without.
            let goes_on = fold.folded > 0;
            told.extend(fold.tell(format));
            (fold.until, fold.left) = (now + WINDOW, 0);
            goes_on
        });
        told
    }

    /// All that is left to be told.
    pub(super) fn end(&mut self) -> Vec<Vec<u8>> {
        let format = self.format;
        self.folds
            .iter_mut()
            .filter_map(|fold| fold.tell(format))
            .collect()
    }
}

impl Fold {
    fn tell(&mut self, format: LogFormat) -> Option<Vec<u8>> {
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

    fn of(line: &str, format: LogFormat) -> Kind {
        // Any place of the program will do.
        let from = tracing::callsite!(name: "test", kind: tracing::metadata::Kind::EVENT, fields: message);
        kind(from.metadata().callsite(), line.as_bytes(), format)
    }

    fn texts(lines: Vec<Vec<u8>>) -> Vec<String> {
        lines
            .into_iter()
            .map(|line| String::from_utf8(line).unwrap())
            .collect()
    }

    #[test]
    fn of_a_storm_the_beginning_is_written_and_then_a_line_a_window_that_counts() {
        let (mut folds, start) = (Folds::new(LogFormat::Text), Instant::now());
        let line = |number: u32| format!("2026-01-01T00:00:00Z  INFO IP0: {number} refused\n");
        let take = |folds: &mut Folds, now, number| {
            let text = line(number);
            folds
                .take(now, of(&text, LogFormat::Text), text.into_bytes())
                .is_some()
        };
        let written = (0..1_000)
            .filter(|number| take(&mut folds, start, *number))
            .count();
        assert_eq!(written, BURST as usize);
        let other = "2026-01-01T00:00:00Z  INFO HOST: refused\n";
        let kind = of(other, LogFormat::Text);
        assert!(folds.take(start, kind, Vec::new()).is_some(), "another port");
        assert_eq!(texts(folds.told(start)), Vec::<String>::new());
        assert_eq!(folds.next(), Some(start + WINDOW));
        let told = texts(folds.told(start + WINDOW));
        assert_eq!(
            told,
            [format!("{} ... repeated 980 times\n", line(999).trim_end())]
        );
        assert!(!take(&mut folds, start + WINDOW, 7), "it goes on");
        assert_eq!(texts(folds.end()).len(), 1, "told at the end");
        assert!(folds.told(start + 2 * WINDOW).is_empty() && folds.next().is_none());
        assert!(take(&mut folds, start + 2 * WINDOW, 8), "it was over");
    }

    #[test]
    fn in_json_the_number_is_a_field_and_the_kinds_are_bounded() {
        let (mut folds, now) = (Folds::new(LogFormat::Json), Instant::now());
        let line = |port: usize| format!("{{\"message\":\"m\",\"port\":\"P{port}\"}}\n");
        for _ in 0..=BURST {
            for port in 0..2 * KINDS {
                let line = line(port);
                folds.take(now, of(&line, LogFormat::Json), line.into_bytes());
            }
        }
        let told = texts(folds.told(now + WINDOW));
        assert_eq!(told.len(), KINDS);
        assert_eq!(told[0], "{\"message\":\"m\",\"port\":\"P0\",\"repeated\":1}\n");
        let read: serde_json::Value = serde_json::from_str(&told[1]).unwrap();
        assert_eq!(read["repeated"], 1);
    }
}
