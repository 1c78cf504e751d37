//! Does something again whenever files change: `check --watch` and `run --watch`.
//!
//! Modification time, length and identity of the files are polled. That works on network drives and mounted folders too, where
//! the notifications of the operating system do not arrive, and takes less than 0.5 % of a processor for 100 files.
//! [`Watcher`] decides from what successive polls found, without a clock; [`watch`] runs the rounds.

use super::output;
use super::serve::stop_signal;
use crate::color;
use crate::embed::single_threaded;
use crate::log::print_error;
use anyhow::Context as _;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, Metadata};
use std::io::{self, IsTerminal as _, Write as _};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, SystemTime};
use ts3100_control::printable::printable;

/// Time from one poll to the next.
const INTERVAL: Duration = Duration::from_millis(200);
/// Polls without a difference after which a changed file counts as complete.
const STABLE_POLLS: u32 = 1;
/// The same while a file is missing or empty that had content: editors replace a file by removing or truncating it.
const REPLACED_POLLS: u32 = 5;
/// Most changes that a line names.
const MAX_NAMED: usize = 5;
/// Moves the cursor to the top left and clears the screen.
const CLEAR: &str = "\x1b[H\x1b[2J";

/// State of a file by which a change is noticed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Stamp {
    modified: Option<SystemTime>,
    length: u64,
    /// Device and inode: a file that was replaced by another of the same time and length has another one.
    identity: (u64, u64),
}

impl Stamp {
    fn new(found: &Metadata) -> Stamp {
        #[cfg(unix)]
        let identity = {
            use std::os::unix::fs::MetadataExt as _;
            (found.dev(), found.ino())
        };
        #[cfg(not(unix))]
        let identity = (0, 0);
        Stamp {
            modified: found.modified().ok(),
            length: found.len(),
            identity,
        }
    }
}

/// The files of a poll; `None` for one that is missing.
type Stamps = BTreeMap<PathBuf, Option<Stamp>>;

fn stamps(files: Vec<PathBuf>) -> Stamps {
    let stamp = |path: PathBuf| {
        let found = fs::metadata(&path).ok();
        (path, found.as_ref().map(Stamp::new))
    };
    files.into_iter().map(stamp).collect()
}

/// Decides when a round begins: once the files differ from those of the last round and are stable.
struct Watcher {
    /// Files at the beginning of the last round.
    done: Stamps,
    /// Files of the last poll, and how many polls before found the same.
    last: Stamps,
    polls: u32,
}

impl Watcher {
    fn new(first: Stamps) -> Watcher {
        Watcher {
            done: first.clone(),
            last: first,
            polls: 0,
        }
    }

    /// Takes what a poll found. If a round begins, returns what has changed since the last one.
    fn poll(&mut self, found: Stamps) -> Option<String> {
        if found != self.last {
            (self.last, self.polls) = (found, 0);
            return None;
        }
        self.polls = self.polls.saturating_add(1);
        let needed = match self.is_being_replaced() {
            true => REPLACED_POLLS,
            false => STABLE_POLLS,
        };
        if self.last == self.done || self.polls < needed {
            return None;
        }
        let changes = self.changes();
        self.done.clone_from(&self.last);
        Some(changes)
    }

    fn is_being_replaced(&self) -> bool {
        let had_content = |stamp: &Option<Stamp>| stamp.is_some_and(|stamp| stamp.length > 0);
        let before = self.done.iter().filter(|(_, stamp)| had_content(stamp));
        let mut now = before.map(|(path, _)| self.last.get(path));
        now.any(|stamp| !stamp.is_some_and(had_content))
    }

    /// The differences between the last round and now: `pick.scol changed, old.scol removed`.
    fn changes(&self) -> String {
        let paths: BTreeSet<&PathBuf> = self.done.keys().chain(self.last.keys()).collect();
        let stamp = |stamps: &Stamps, path| stamps.get(path).copied().flatten();
        let changes = paths.into_iter().filter_map(|path| {
            let word = match (stamp(&self.done, path), stamp(&self.last, path)) {
                (before, now) if before == now => return None,
                (None, _) => "added",
                (_, None) => "removed",
                _ => "changed",
            };
            Some(format!("{} {word}", printable(path.display().to_string())))
        });
        let mut changes: Vec<String> = changes.collect();
        let more = changes.len().saturating_sub(MAX_NAMED);
        changes.truncate(MAX_NAMED);
        match more {
            0 => changes.join(", "),
            more => format!("{} and {more} more", changes.join(", ")),
        }
    }
}

/// Where the rounds announce themselves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Announcement {
    /// A line on stdout; a terminal is cleared before.
    Line,
    /// None: stdout has documents alone, one a line.
    None,
}

impl Announcement {
    /// Of rounds that write documents for programs, or text.
    pub(super) fn new(documents: bool) -> Announcement {
        match documents {
            true => Announcement::None,
            false => Announcement::Line,
        }
    }

    fn is_cleared(self) -> bool {
        let is_dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        self == Announcement::Line && io::stdout().is_terminal() && !is_dumb
    }

    /// Begins a round.
    fn begin(self, line: &str) -> io::Result<()> {
        if self == Announcement::None {
            return Ok(());
        }
        let (mut stdout, _) = color::stream(io::stdout().lock());
        let clear = if self.is_cleared() { CLEAR } else { "" };
        writeln!(stdout, "{clear}{line}")?;
        stdout.flush()
    }

    fn end(self) {
        if self.is_cleared() {
            output::tell("Waiting for changes. Press Ctrl-C to end.\n");
        }
    }
}

/// Runs `round` now, and again whenever one of the files changes, until a signal; the exit code is 0 then. `files` is asked at
/// each poll, so it follows what a folder contains. The flag tells a round that its files have changed; its thread is
/// unparked.
///
/// An error of a round is printed, and does not end the others.
///
/// # Errors
/// Signals or threads are not available, or stdout takes no more.
pub(super) fn watch<A: Send + Sync + 'static>(
    args: A,
    announcement: Announcement,
    files: impl Fn(&A) -> Vec<PathBuf> + Send + 'static,
    round: impl Fn(&A, &AtomicBool) -> anyhow::Result<u8> + Send + Sync + 'static,
) -> anyhow::Result<u8> {
    let args = Arc::new(args);
    let watched = Arc::clone(&args);
    let files = move || files(&watched);
    let round = move |outdated: &AtomicBool| round(&args, outdated);
    single_threaded()?.block_on(async {
        let stop = stop_signal().context("cannot listen for signals")?;
        let (sender, ended) = tokio::sync::oneshot::channel();
        // A thread of its own: the signal ends the process also while a round is under way.
        thread::Builder::new().name("watch".to_owned()).spawn(move || {
            // Nobody receives it after a signal.
            let _ = sender.send(run_rounds(files, announcement, round));
        })?;
        tokio::select! {
            () = stop => Ok(0),
            ended = ended => output::written(ended.unwrap_or(Ok(()))).map(|()| 0),
        }
    })
}

/// Runs the rounds until stdout takes no more.
fn run_rounds(
    files: impl Fn() -> Vec<PathBuf>,
    announcement: Announcement,
    round: impl Fn(&AtomicBool) -> anyhow::Result<u8> + Send + Sync + 'static,
) -> io::Result<()> {
    let round = Arc::new(round);
    let found = stamps(files());
    let mut line = match found.len() {
        1 => "watching 1 file".to_owned(),
        number => format!("watching {number} files"),
    };
    let mut watcher = Watcher::new(found);
    loop {
        announcement.begin(&line)?;
        let is_outdated = Arc::new(AtomicBool::new(false));
        let (round, outdated) = (Arc::clone(&round), Arc::clone(&is_outdated));
        let running = thread::Builder::new().name("round".to_owned()).spawn(move || {
            if let Err(error) = round(&outdated) {
                print_error(format_args!("{error:#}"));
            }
            if !outdated.load(Ordering::Relaxed) {
                announcement.end();
            }
        })?;
        line = loop {
            thread::sleep(INTERVAL);
            if let Some(changes) = watcher.poll(stamps(files())) {
                break changes;
            }
        };
        is_outdated.store(true, Ordering::Relaxed);
        running.thread().unpark();
        // A panic has said so itself.
        let _ = running.join();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A poll in which `a` and `b` have these lengths and this time; no length for a missing file.
    fn poll(files: &[(&str, Option<u64>, u64)]) -> Stamps {
        let stamp = |length, second| Stamp {
            modified: Some(SystemTime::UNIX_EPOCH + Duration::from_secs(second)),
            length,
            identity: (0, 0),
        };
        let files = files.iter();
        files
            .map(|(name, length, second)| (PathBuf::from(name), length.map(|length| stamp(length, *second))))
            .collect()
    }

    #[test]
    fn a_round_begins_once_the_files_are_stable() {
        let before = poll(&[("a", Some(5), 1), ("b", Some(5), 1)]);
        let mut watcher = Watcher::new(before.clone());
        for _ in 0..9 {
            assert_eq!(watcher.poll(before.clone()), None);
        }
        // It grows while it is written.
        for length in 6..9 {
            assert_eq!(
                watcher.poll(poll(&[("a", Some(length), 2), ("b", Some(5), 1)])),
                None
            );
        }
        let after = poll(&[("a", Some(8), 2), ("b", Some(5), 1)]);
        assert_eq!(watcher.poll(after.clone()).as_deref(), Some("a changed"));
        assert_eq!(watcher.poll(after.clone()), None);
        // Written back before a round began: nothing has changed.
        assert_eq!(watcher.poll(before), None);
        assert_eq!(watcher.poll(after.clone()), None);
        assert_eq!(watcher.poll(after), None);
    }

    #[test]
    fn a_file_that_is_being_replaced_is_waited_for() {
        let before = poll(&[("a", Some(5), 1)]);
        for gone in [poll(&[]), poll(&[("a", None, 0)]), poll(&[("a", Some(0), 2)])] {
            let mut watcher = Watcher::new(before.clone());
            // It returns in time.
            for _ in 0..REPLACED_POLLS {
                assert_eq!(watcher.poll(gone.clone()), None);
            }
            let after = poll(&[("a", Some(6), 3)]);
            assert_eq!(watcher.poll(after.clone()), None);
            assert_eq!(watcher.poll(after.clone()).as_deref(), Some("a changed"));
            // It stays away.
            for _ in 0..REPLACED_POLLS {
                assert_eq!(watcher.poll(gone.clone()), None);
            }
            let changes = watcher.poll(gone.clone()).unwrap();
            assert!(["a changed", "a removed"].contains(&&*changes), "{changes}");
            assert_eq!(watcher.poll(gone), None);
            // A file that was missing before is not waited for.
            assert_eq!(watcher.poll(after.clone()), None);
            assert!(watcher.poll(after).is_some());
        }
    }

    #[test]
    fn changes_are_named() {
        let mut watcher = Watcher::new(poll(&[("a", Some(1), 1), ("b", Some(1), 1), ("c", None, 1)]));
        let mut after = poll(&[("b", Some(2), 1), ("c", Some(1), 1), ("d", Some(1), 1)]);
        watcher.poll(after.clone());
        let found = (0..REPLACED_POLLS).find_map(|_| watcher.poll(after.clone()));
        assert_eq!(found.as_deref(), Some("a removed, b changed, c added, d added"));
        for name in 'e'..='z' {
            after.extend(poll(&[(&*name.to_string(), Some(1), 1)]));
        }
        watcher.poll(after.clone());
        assert_eq!(
            watcher.poll(after).as_deref(),
            Some("e added, f added, g added, h added, i added and 17 more")
        );
    }

    #[test]
    fn a_replaced_file_has_another_stamp() {
        let directory = crate::testing::TempDir::new("watch");
        let file = PathBuf::from(directory.file("a", "1"));
        let time = fs::metadata(&file).unwrap().modified().unwrap();
        let before = stamps(vec![file.clone()]);
        assert_eq!(stamps(vec![file.clone()]), before);
        let beside = PathBuf::from(directory.file("b", "2"));
        let options = fs::File::options().write(true).open(&beside).unwrap();
        options.set_modified(time).unwrap();
        drop(options);
        fs::rename(&beside, &file).unwrap();
        let after = stamps(vec![file.clone()]);
        assert_eq!(after != before, cfg!(unix));
        fs::remove_file(&file).unwrap();
        assert_eq!(stamps(vec![file.clone()]), BTreeMap::from([(file, None)]));
    }
}
