//! The way of log lines to stderr: through a bounded queue and a thread of its own, so that a pipe that nobody reads, a
//! full disk or a closed terminal neither stops nor ends the emulator. Lines for which there is no room are dropped,
//! counted, and told of as soon as there is room again; a storm of lines is folded by [`super::fold`]. What a line says
//! is `log`'s.

use super::fold::{Folds, Kind, kind};
use crate::config::args::LogFormat;
use crate::visible::{shown, visible, visible_lines};
use std::io::{self, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::time::{Duration, Instant};
use tracing::callsite::Identifier;
use tracing::{Level, Metadata};
use tracing_subscriber::fmt::MakeWriter;

/// Lines that may wait to be written.
const QUEUE: usize = 4_096;
/// Longest wait at the end for lines that are not written yet, and the pause between two looks for room.
const FAREWELL: Duration = Duration::from_millis(250);
const LOOK: Duration = Duration::from_millis(1);

/// The one queue of the process.
static QUEUED: OnceLock<SyncSender<Entry>> = OnceLock::new();
/// Lines lost since that was last told.
static DROPPED: AtomicU64 = AtomicU64::new(0);

enum Entry {
    /// A line; its kind, if it may be folded.
    Line(Vec<u8>, Option<Kind>),
    /// Everything before it is written: tell so.
    Mark(SyncSender<()>),
}

/// Where log lines are written to; never waits, never fails.
#[derive(Debug, Clone)]
pub(super) struct Lines {
    format: LogFormat,
    /// Where the line comes from, if it may be folded.
    from: Option<Identifier>,
}

impl Lines {
    /// Starts the thread that writes; the second and later calls change nothing.
    pub(super) fn start(format: LogFormat) -> Lines {
        QUEUED.get_or_init(|| {
            let (sender, receiver) = sync_channel(QUEUE);
            let named = std::thread::Builder::new().name("ts3100-log".to_owned());
            // Without a thread the receiver is gone, and all lines count as dropped.
            let _ = named.spawn(move || write_all(&receiver, format));
            sender
        });
        Lines { format, from: None }
    }
}

impl Lines {
    /// The line without control characters of others. Further lines of a message are indented, so that none can be
    /// taken for a line of the log; JSON has none.
    fn plain(&self, line: &[u8]) -> Vec<u8> {
        let text = String::from_utf8_lossy(line);
        let message = text.strip_suffix('\n').unwrap_or(&text);
        let lines = match self.format {
            LogFormat::Text => visible_lines(message).replace('\n', "\n    "),
            LogFormat::Json => visible(message),
        };
        format!("{lines}\n").into_bytes()
    }
}

impl<'a> MakeWriter<'a> for Lines {
    type Writer = Lines;

    fn make_writer(&'a self) -> Lines {
        self.clone()
    }

    /// Whoever asks for every text and byte gets every one.
    fn make_writer_for(&'a self, meta: &Metadata<'_>) -> Lines {
        Lines {
            from: (*meta.level() <= Level::INFO).then(|| meta.callsite()),
            ..*self
        }
    }
}

impl Write for Lines {
    /// Takes a whole line: the subscriber hands over one at a time.
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let kind = self.from.clone().map(|from| kind(from, line, self.format));
        put(self.plain(line), kind);
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn put(line: Vec<u8>, kind: Option<Kind>) {
    let queue = QUEUED.get();
    if queue.is_none_or(|queue| queue.try_send(Entry::Line(line, kind)).is_err()) {
        DROPPED.fetch_add(1, Ordering::Relaxed);
    }
}

fn write_all(entries: &Receiver<Entry>, format: LogFormat) {
    let mut folds = Folds::new(format);
    loop {
        let patience = folds
            .next()
            .map(|at| at.saturating_duration_since(Instant::now()));
        let entry = match patience {
            None => entries.recv().map_err(RecvTimeoutError::from),
            Some(patience) => entries.recv_timeout(patience),
        };
        let (line, done) = match entry {
            Ok(Entry::Line(line, None)) => (Some(line), None),
            Ok(Entry::Line(line, Some(kind))) => (folds.take(Instant::now(), kind, line), None),
            Ok(Entry::Mark(done)) => (None, Some(done)),
            Err(RecvTimeoutError::Timeout) => (None, None),
            Err(RecvTimeoutError::Disconnected) => return,
        };
        // What it stands for came before the line.
        for told in folds.told(Instant::now()) {
            write(&told, format);
        }
        if let Some(line) = line {
            write(&line, format);
        }
        if let Some(done) = done {
            for told in folds.end() {
                write(&told, format);
            }
            // Fails only when nobody waits for it any more.
            let _ = done.send(());
        }
    }
}

fn write(line: &[u8], format: LogFormat) {
    let mut stderr = io::stderr();
    let dropped = DROPPED.swap(0, Ordering::Relaxed);
    let told = dropped == 0 || stderr.write_all(words(dropped, format).as_bytes()).is_ok();
    let lost = u64::from(stderr.write_all(line).is_err()) + if told { 0 } else { dropped };
    DROPPED.fetch_add(lost, Ordering::Relaxed);
}

fn words(dropped: u64, format: LogFormat) -> String {
    match format {
        LogFormat::Text => format!("WARN lines dropped: {dropped}\n"),
        LogFormat::Json => {
            format!("{{\"level\":\"WARN\",\"message\":\"lines dropped: {dropped}\",\"dropped\":{dropped}}}\n")
        }
    }
}

/// Waits until the lines so far are written, or for a moment at most.
pub(crate) fn finish() {
    let Some(queue) = QUEUED.get() else { return };
    let until = Instant::now() + FAREWELL;
    let (done, written) = sync_channel(1);
    let mut mark = Entry::Mark(done);
    loop {
        match queue.try_send(mark) {
            Ok(()) => break,
            Err(TrySendError::Full(back)) if Instant::now() < until => {
                mark = back;
                std::thread::sleep(LOOK);
            }
            Err(_) => return,
        }
    }
    // Fails when they could not be written in time.
    let _ = written.recv_timeout(until.saturating_duration_since(Instant::now()));
}

/// A line of the program itself, after the log lines before it. A stderr that takes nothing is not an error.
pub(crate) fn say(line: &str) {
    let line = format!("ts3100: {}\n", shown(line)).into_bytes();
    if QUEUED.get().is_some() {
        put(line, None);
        finish();
    } else {
        let _ = io::stderr().write_all(&line);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_line_of_the_log_can_be_made_up_by_others() {
        let of = |format, line: &str| {
            let from = None;
            String::from_utf8(Lines { format, from }.plain(line.as_bytes())).unwrap()
        };
        let line = "2026  INFO \x1b[1mpick\r\n2026  INFO all is well\n";
        let expected = "2026  INFO <1B>[1mpick<CR>\n    2026  INFO all is well\n";
        assert_eq!(of(LogFormat::Text, line), expected);
        assert_eq!(
            of(LogFormat::Json, "{\"a\":\"\u{7f}\u{9b}\"}\n"),
            "{\"a\":\"<7F><9B>\"}\n"
        );
    }
}
