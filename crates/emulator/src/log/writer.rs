//! Writes log lines to stderr from a thread of its own, through a bounded queue. A pipe without a reader, a full disk
//! or a closed terminal can therefore neither block nor end the emulator.
//!
//! Lines that do not fit into the queue are dropped and counted, and the count is logged as soon as stderr takes
//! lines again. Repeated lines are folded by [`super::fold`]. The content of the lines is decided in [`super`].

use super::fold::{LineFolder, LineKey, line_key};
use crate::color;
use crate::config::args::LogFormat;
use anstream::AutoStream;
use serde_json::json;
use std::fmt::Display;
use std::io::{self, Write};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};
use tokio::runtime::Handle;
use tracing::callsite::Identifier;
use tracing::{Level, Metadata};
use tracing_subscriber::fmt::MakeWriter;
use ts3100_control::printable::{escape_line, escape_lines, printable};

/// Lines that may wait to be written; more are dropped.
const QUEUE_LENGTH: usize = 4_096;
/// Delay between the first line and the start of the thread.
const THREAD_DELAY: Duration = Duration::from_millis(1);
/// Time in which stderr has to take a line for [`flush`] to wait on.
const FLUSH_STEP: Duration = Duration::from_millis(250);
/// Longest wait in [`flush`] for lines that are not written yet.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(10);

/// The queue of the process: tracing has one global subscriber, too. It is made for the first line.
static QUEUE: OnceLock<Queue> = OnceLock::new();
/// Lines in the queue.
static WAITING: AtomicUsize = AtomicUsize::new(0);
/// The form of the log, once it is started.
static FORMAT: OnceLock<LogFormat> = OnceLock::new();
/// Lines lost since the last notice about lost lines.
static DROPPED: AtomicU64 = AtomicU64::new(0);

enum Entry {
    /// A line, and its key if it may be folded.
    Line(Vec<u8>, Option<LineKey>),
    /// Reports when all lines before it are written.
    Flush(SyncSender<()>),
}

/// Lines on their way to the thread that writes them.
struct Queue {
    sender: Sender<Entry>,
    /// Until the thread has started.
    receiver: Mutex<Option<Receiver<Entry>>>,
}

/// The writer given to tracing. It never waits and never fails.
#[derive(Debug, Clone)]
pub(super) struct LogWriter {
    format: LogFormat,
    /// The call site of the line, if lines from there may be folded.
    callsite: Option<Identifier>,
}

impl LogWriter {
    /// Sets the form of the log; the second and later calls change nothing.
    pub(super) fn start(format: LogFormat) -> LogWriter {
        FORMAT.get_or_init(|| format);
        LogWriter {
            format,
            callsite: None,
        }
    }

    /// The line with control characters spelled out. Further lines of a message are indented, so that none looks like a
    /// log line of its own; in JSON line feeds are escaped already.
    fn escaped(&self, line: &[u8]) -> Vec<u8> {
        let text = String::from_utf8_lossy(line);
        let message = text.strip_suffix('\n').unwrap_or(&text);
        let lines = match self.format {
            LogFormat::Text => escape_lines(message).replace('\n', "\n    "),
            LogFormat::Json => escape_line(message),
        };
        format!("{lines}\n").into_bytes()
    }
}

impl<'a> MakeWriter<'a> for LogWriter {
    type Writer = LogWriter;

    fn make_writer(&'a self) -> LogWriter {
        self.clone()
    }

    /// Levels debug and trace are never folded: who asks for every text and byte gets all of them.
    fn make_writer_for(&'a self, meta: &Metadata<'_>) -> LogWriter {
        LogWriter {
            callsite: (*meta.level() <= Level::INFO).then(|| meta.callsite()),
            ..*self
        }
    }
}

impl Write for LogWriter {
    /// Takes a whole line: the subscriber hands over one at a time.
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let kind = self
            .callsite
            .clone()
            .map(|from| line_key(from, line, self.format));
        enqueue(self.escaped(line), kind);
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Queue {
    /// Starts the thread that writes what is in the queue, if it does not run yet.
    fn start_thread(&self) {
        let receiver = self.receiver.lock().ok().and_then(|mut receiver| receiver.take());
        if let Some(receiver) = receiver {
            let format = FORMAT.get().copied().unwrap_or_default();
            let named = std::thread::Builder::new().name("ts3100-log".to_owned());
            // Without a thread the receiver is gone, and all lines count as dropped.
            let _ = named.spawn(move || write_all(&receiver, format));
        }
    }
}

/// The queue. Its thread starts a little later where that is possible: the first line says that somebody has connected,
/// who waits for his answer.
fn queue() -> &'static Queue {
    let mut is_new = false;
    let queue = QUEUE.get_or_init(|| {
        is_new = true;
        let (sender, receiver) = channel();
        let receiver = Mutex::new(Some(receiver));
        Queue { sender, receiver }
    });
    if is_new {
        match Handle::try_current() {
            Ok(runtime) => drop(runtime.spawn(async {
                tokio::time::sleep(THREAD_DELAY).await;
                queue.start_thread();
            })),
            Err(_) => queue.start_thread(),
        }
    }
    queue
}

fn enqueue(line: Vec<u8>, kind: Option<LineKey>) {
    let is_full = WAITING.fetch_add(1, Ordering::Relaxed) >= QUEUE_LENGTH;
    if is_full || queue().sender.send(Entry::Line(line, kind)).is_err() {
        WAITING.fetch_sub(1, Ordering::Relaxed);
        DROPPED.fetch_add(1, Ordering::Relaxed);
    }
}

fn write_all(entries: &Receiver<Entry>, format: LogFormat) {
    let mut stderr = Stderr::open(format);
    let mut folds = LineFolder::new(format);
    loop {
        let timeout = folds
            .next_window_end()
            .map(|at| at.saturating_duration_since(Instant::now()));
        let entry = match timeout {
            None => entries.recv().map_err(RecvTimeoutError::from),
            Some(timeout) => entries.recv_timeout(timeout),
        };
        if let Ok(Entry::Line(..)) = entry {
            WAITING.fetch_sub(1, Ordering::Relaxed);
        }
        let (line, done) = match entry {
            Ok(Entry::Line(line, None)) => (Some(line), None),
            Ok(Entry::Line(line, Some(kind))) => (folds.admit(Instant::now(), kind, line), None),
            Ok(Entry::Flush(done)) => (None, Some(done)),
            Err(RecvTimeoutError::Timeout) => (None, None),
            Err(RecvTimeoutError::Disconnected) => return,
        };
        // A summary stands for lines that came before this one.
        for summary in folds.due_summaries(Instant::now()) {
            stderr.write(&summary);
        }
        if let Some(line) = line {
            stderr.write(&line);
        }
        if let Some(done) = done {
            for summary in folds.final_summaries() {
                stderr.write(&summary);
            }
            // Fails only when the waiting side has given up.
            let _ = done.send(());
        }
    }
}

/// Standard error, with colours where it shows them.
struct Stderr {
    stream: AutoStream<io::Stderr>,
    paints: bool,
    format: LogFormat,
}

impl Stderr {
    fn open(format: LogFormat) -> Stderr {
        let (stream, paints) = color::stream(io::stderr());
        Stderr {
            stream,
            paints: paints && format == LogFormat::Text,
            format,
        }
    }

    /// Writes a line, after the number of those that were lost before it.
    fn write(&mut self, line: &[u8]) {
        let dropped = DROPPED.swap(0, Ordering::Relaxed);
        let noticed = dropped == 0 || self.put(dropped_notice(dropped, self.format).as_bytes()).is_ok();
        let lost = u64::from(self.put(line).is_err()) + if noticed { 0 } else { dropped };
        DROPPED.fetch_add(lost, Ordering::Relaxed);
    }

    fn put(&mut self, line: &[u8]) -> io::Result<()> {
        match str::from_utf8(line) {
            Ok(text) if self.paints => self.stream.write_all(color::log_line(text).as_bytes()),
            _ => self.stream.write_all(line),
        }
    }
}

fn dropped_notice(dropped: u64, format: LogFormat) -> String {
    match format {
        LogFormat::Text => format!("WARN lines dropped: {dropped}\n"),
        LogFormat::Json => {
            format!("{{\"level\":\"WARN\",\"message\":\"lines dropped: {dropped}\",\"dropped\":{dropped}}}\n")
        }
    }
}

/// Whether people see every byte: a line for each text would repeat them. In JSON programs choose by the event.
pub(super) fn shows_bytes() -> bool {
    FORMAT.get() == Some(&LogFormat::Text) && tracing::enabled!(Level::TRACE)
}

/// Waits until all lines so far are written, at most [`FLUSH_TIMEOUT`], and as long as somebody reads them.
pub(crate) fn flush() {
    let Some(queue) = QUEUE.get() else { return };
    queue.start_thread();
    let (done, written) = sync_channel(1);
    if queue.sender.send(Entry::Flush(done)).is_err() {
        return;
    }
    let (end, mut before) = (Instant::now() + FLUSH_TIMEOUT, usize::MAX);
    while written.recv_timeout(FLUSH_STEP).is_err() {
        let left = WAITING.load(Ordering::Relaxed);
        if left >= before || Instant::now() >= end {
            return;
        }
        before = left;
    }
}

/// Prints a message to stderr, after the log lines before it, with the prefix `error: `.
pub(crate) fn print_error(error: impl Display) {
    print("error", "ERROR", error);
}

/// As [`print_error`], with the prefix `warning: `.
pub(crate) fn print_warning(warning: impl Display) {
    print("warning", "WARN", warning);
}

/// As [`print_error`], with the prefix `note: `.
pub(crate) fn print_note(note: impl Display) {
    print("note", "INFO", note);
}

/// A line with this prefix, in JSON with this level. Errors of stderr are ignored: they cannot be reported.
fn print(prefix: &str, level: &str, message: impl Display) {
    let message = printable(message);
    let line = match FORMAT.get() {
        Some(LogFormat::Json) => format!("{}\n", json!({"level": level, "message": message})),
        Some(LogFormat::Text) | None => format!("{prefix}: {message}\n"),
    };
    if QUEUE.get().is_some() {
        enqueue(line.into_bytes(), None);
        flush();
    } else {
        let _ = Stderr::open(LogFormat::Text).put(line.as_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_line_of_the_log_can_be_made_up_by_others() {
        let of = |format, line: &str| {
            let from = None;
            String::from_utf8(
                LogWriter {
                    format,
                    callsite: from,
                }
                .escaped(line.as_bytes()),
            )
            .unwrap()
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
