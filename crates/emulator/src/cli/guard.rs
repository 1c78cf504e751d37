//! Ends the command of `ts3100 exec` when exec is killed before it can do so itself (SIGKILL, out of memory).
//!
//! The guard is a process of its own, `ts3100 __guard`. It reads a pipe whose writing end only exec holds. When the
//! pipe closes, exec is gone and the guard kills the command with all its descendants.

use std::io::{self, BufRead as _, Read as _, Write as _};
use std::process::{Child, ChildStdin, Command, ExitCode, Stdio};

/// The word of the command line that makes the process a guard.
pub(super) const SUBCOMMAND: &str = "__guard";
/// Longest word it is told: the number of a process.
const MAX_PROCESS_ID: u64 = 32;

/// The guard, as exec holds it: gone when this is dropped.
pub(super) struct Guard {
    process: Child,
    pipe: ChildStdin,
}

impl Guard {
    /// Starts it.
    pub(super) fn start() -> io::Result<Guard> {
        // On Linux this leads to the program even when its file has been replaced meanwhile.
        let mut guard = if cfg!(target_os = "linux") {
            Command::new("/proc/self/exe")
        } else {
            Command::new(std::env::current_exe()?)
        };
        guard.arg(SUBCOMMAND).stdin(Stdio::piped());
        guard.stdout(Stdio::null()).stderr(Stdio::null());
        // What the terminal sends to everybody is not meant for it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut guard, 0);
        let mut process = guard.spawn()?;
        let pipe = process.stdin.take().ok_or(io::ErrorKind::BrokenPipe)?;
        Ok(Guard { process, pipe })
    }

    /// Watches a process: when exec is gone, the guard ends it with everything that it has started.
    pub(super) fn watch(&mut self, process: u32) -> io::Result<()> {
        writeln!(self.pipe, "{process}")
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        // It may have ended by itself; either way it is gone then.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Runs the guard: waits for the end of `exec`, and then ends its command.
pub(super) fn run() -> ExitCode {
    let mut pipe = io::stdin().lock();
    let mut word = String::new();
    // An error and an end come to the same: exec is gone.
    let _ = pipe.by_ref().take(MAX_PROCESS_ID).read_line(&mut word);
    let Ok(process) = word.trim().parse() else {
        return ExitCode::SUCCESS;
    };
    let watched = WatchedProcess::new(process);
    let _ = io::copy(&mut pipe, &mut io::sink());
    watched.kill();
    ExitCode::SUCCESS
}

#[cfg(unix)]
struct WatchedProcess {
    process: i32,
    /// Means this process, and none that is given its number later.
    #[cfg(target_os = "linux")]
    handle: Option<std::os::fd::OwnedFd>,
}

#[cfg(unix)]
impl WatchedProcess {
    fn new(process: i32) -> WatchedProcess {
        WatchedProcess {
            process,
            // Old kernels have none.
            #[cfg(target_os = "linux")]
            handle: rustix::process::Pid::from_raw(process)
                .and_then(|id| rustix::process::pidfd_open(id, rustix::process::PidfdFlags::empty()).ok()),
        }
    }

    fn kill(self) {
        use rustix::process::{Pid, Signal, kill_process};
        // Found first: they lose their parent when it ends.
        let mut doomed = descendants(self.process);
        #[cfg(target_os = "linux")]
        match &self.handle {
            Some(handle) if rustix::process::pidfd_send_signal(handle, Signal::KILL).is_ok() => {}
            // It has ended before, and its number may be another's.
            Some(_) => return,
            None => doomed.insert(0, self.process),
        }
        #[cfg(not(target_os = "linux"))]
        doomed.insert(0, self.process);
        for id in doomed {
            if let Some(id) = Pid::from_raw(id) {
                // It may have ended just now.
                let _ = kill_process(id, Signal::KILL);
            }
        }
    }
}

/// The processes that `ancestor` has started, and those that they have.
#[cfg(target_os = "linux")]
fn descendants(ancestor: i32) -> Vec<i32> {
    let parents: Vec<(i32, i32)> = std::fs::read_dir("/proc")
        .into_iter()
        .flatten()
        .filter_map(|entry| {
            let entry = entry.ok()?;
            let id = entry.file_name().to_str()?.parse().ok()?;
            let stat = std::fs::read_to_string(entry.path().join("stat")).ok()?;
            // `ID (NAME) STATE PARENT ...`; the name may hold anything.
            let parent = stat.rsplit_once(')')?.1.split_whitespace().nth(1)?;
            Some((id, parent.parse().ok()?))
        })
        .collect();
    let mut found = vec![ancestor];
    let mut next = 0;
    while let Some(parent) = found.get(next).copied() {
        let children = parents.iter().filter(|(_, of)| *of == parent);
        found.extend(children.map(|(id, _)| *id));
        next += 1;
    }
    found.split_off(1)
}

/// Elsewhere the system does not say it in a file.
#[cfg(all(unix, not(target_os = "linux")))]
fn descendants(_: i32) -> Vec<i32> {
    Vec::new()
}

#[cfg(windows)]
struct WatchedProcess(u32);

#[cfg(windows)]
impl WatchedProcess {
    fn new(process: u32) -> WatchedProcess {
        WatchedProcess(process)
    }

    fn kill(self) {
        let id = self.0.to_string();
        // It may have ended just now.
        let _ = Command::new("taskkill").args(["/T", "/F", "/PID", &id]).status();
    }
}
