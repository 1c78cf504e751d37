//! `ts3100 dap`: the debugger of SCOL on stdin and stdout.
//!
//! The server is `ts3100-workbench`'s. Here the program continues between two messages, and what is debugged is made: a run without
//! sockets, or a recording. A running emulator is in `attached`.

mod attached;
#[cfg(test)]
mod tests;

use super::check::CheckedFile;
use super::editor::{self, Message};
use super::exit::{NEGATIVE, UNUSABLE};
use super::run::{self, RunArgs};
use super::serve::stop_signal;
use crate::debugged::ProgramRun;
use crate::embed::single_threaded;
use crate::log::print_error;
use crate::recorded;
use anyhow::{Context, anyhow, bail};
use attached::Attached;
use clap::{Args, FromArgMatches};
use scol_mini::Severity;
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf, absolute};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread;
use ts3100_driver::files;
use ts3100_driver::pc_file::{MAX_PC_FILE, drive_name};
use ts3100_recording::replay::Playback;
use ts3100_recording::transcript::Recording;
use ts3100_workbench::dap::{
    AttachArguments, LaunchArguments, Launched, Launcher, Origin, Refusal, Server, Timeline,
};
use ts3100_workbench::framing;

/// Serve the debugger of SCOL to an editor (Debug Adapter Protocol over stdin and stdout).
///
/// Configure your editor to start `ts3100 dap`, or use the extension for VS Code. It runs a program in virtual time, opens a
/// recording, or attaches to a running emulator; it stops at breakpoints, shows tasks, calls, variables, lines and channels, and
/// steps forward and back. docs: how-to/debug-scol
///
/// Exit codes: 0 the editor ended the conversation; 1 it left without a word; 2 wrong usage, or it sends something else.
#[derive(Debug, Args)]
pub(super) struct DapArgs {}

/// Serves until the editor disconnects or closes the stream.
pub(super) fn run(_: &DapArgs) -> anyhow::Result<u8> {
    let (ended, messages) = editor::messages()?;
    // A robot that was attached to keeps no breakpoints of a debugger that is ended.
    thread::Builder::new().name("signals".to_owned()).spawn(move || {
        let wait = async {
            stop_signal()?.await;
            io::Result::Ok(())
        };
        if single_threaded().is_ok_and(|runtime| runtime.block_on(wait).is_ok()) {
            // Where the server has ended, nothing waits for it.
            let _ = ended.send(Ok(None));
        }
    })?;
    Ok(serve(&mut Server::new(Programs), &messages))
}

fn serve(server: &mut Server<impl Launcher>, messages: &Receiver<Message>) -> u8 {
    loop {
        let message = if server.wants_work() {
            messages
                .recv_timeout(server.patience())
                .map_err(|error| error == RecvTimeoutError::Timeout)
        } else {
            messages.recv().map_err(|_| false)
        };
        let (answers, end) = match message {
            Ok(Ok(Some(message))) => (server.receive(&message), None),
            Ok(Ok(None)) | Err(false) => (server.abandoned(), Some(NEGATIVE)),
            Ok(Err(error)) => {
                print_error(format_args!("{:#}", anyhow::Error::new(error)));
                (server.abandoned(), Some(UNUSABLE))
            }
            Err(true) => (server.work(), None),
        };
        let mut stdout = io::stdout().lock();
        for answer in answers {
            // An editor that has gone takes no answer.
            if framing::write(&mut stdout, &answer.to_string()).is_err() {
                server.abandoned();
                return NEGATIVE;
            }
        }
        if server.has_ended() {
            return 0;
        }
        if let Some(code) = end {
            return code;
        }
    }
}

/// Makes programs that are debugged.
struct Programs;

impl Launcher for Programs {
    fn launch(&mut self, arguments: LaunchArguments) -> Result<Launched, Refusal> {
        let launched = match (&arguments.recording, &arguments.program) {
            (Some(recording), program) => open(recording, program.clone()),
            (None, Some(program)) => start(&arguments, program),
            (None, None) => Err(anyhow!(
                "expected `program`, a file of SCOL, or `recording`, a transcript or a trace"
            )),
        };
        launched.map_err(|error| Refusal::new(format!("{error:#}")))
    }

    fn attach(&mut self, arguments: AttachArguments) -> Result<Launched, Refusal> {
        let debuggee = Attached::attach(&arguments)?;
        let path = arguments
            .program
            .map(absolute)
            .transpose()
            .map_err(Refusal::new)?;
        Ok(Launched {
            path,
            debuggee: Box::new(debuggee),
            origin: Origin::Robot,
        })
    }

    fn text(&self, path: &Path) -> Option<String> {
        // In whatever code its comments are: they do not count.
        let content = files::read(path, MAX_PC_FILE).ok()?;
        Some(String::from_utf8_lossy(&content).into_owned())
    }

    fn is_named(&self, path: &Path, name: &str) -> bool {
        drive_name(path).is_ok_and(|drive| drive.eq_ignore_ascii_case(name))
    }
}

/// The words of `ts3100 run` that say the same.
fn words(arguments: &LaunchArguments, program: &Path) -> Vec<OsString> {
    let mut words = vec![OsString::from("ts3100 run"), program.into()];
    let mut flag = |name: &str, value: OsString| {
        words.push(format!("--{name}").into());
        words.push(value);
    };
    for (name, path) in [("points", &arguments.points), ("scenario", &arguments.scenario)] {
        if let Some(path) = path {
            flag(name, path.into());
        }
    }
    for (name, text) in [("model", &arguments.model), ("max-time", &arguments.max_time)] {
        if let Some(text) = text {
            flag(name, text.into());
        }
    }
    for pair in &arguments.set {
        flag("set", pair.into());
    }
    for (channel, path) in &arguments.input {
        let mut pair = OsString::from(format!("{channel}="));
        pair.push(path);
        flag("input", pair);
    }
    for line in &arguments.din {
        flag("din", line.to_string().into());
    }
    for step in &arguments.at {
        flag("at", step.into());
    }
    words
}

/// A program before its first statement.
fn start(arguments: &LaunchArguments, program: &Path) -> anyhow::Result<Launched> {
    let command = RunArgs::augment_args(clap::Command::new("ts3100 run"));
    let matches = command
        .try_get_matches_from(words(arguments, program))
        .map_err(|error| anyhow!("{}", run::reason(&error)))?;
    let args = RunArgs::from_arg_matches(&matches)?;
    let config = run::config(&args)?;
    let checked = CheckedFile::check(program, &config);
    let (source, remarks) = checked
        .result
        .with_context(|| format!("cannot read {}", checked.name))?;
    let errors = || remarks.iter().filter(|remark| remark.severity == Severity::Error);
    if let Some(first) = errors().next() {
        let more = match errors().count() - 1 {
            0 => String::new(),
            more => format!("\nand {more} more"),
        };
        bail!("{}{more}", first.render(&source, &checked.name).trim_end());
    }
    let run = ProgramRun::new(run::request(&args, &source, &config)?)?;
    Ok(Launched {
        debuggee: Box::new(Timeline::new(run)),
        path: Some(absolute(program)?),
        origin: Origin::Program,
    })
}

/// A recorded run before its first statement.
fn open(path: &Path, program: Option<PathBuf>) -> anyhow::Result<Launched> {
    let recording = Recording::read(path)?;
    recording.has_beginning(path)?;
    if recording.header.is_of_robot() {
        bail!(
            "{}: a recording of a real robot has its traffic alone, so it has no statements to stop at",
            path.display()
        );
    }
    let candidate = recorded::candidate(&recording.header)?;
    let playback = Playback::new(Arc::new(recording), candidate);
    let mut timeline = Timeline::new(playback);
    if !timeline.enter() {
        bail!("{}: no program runs in this recording", path.display());
    }
    Ok(Launched {
        debuggee: Box::new(timeline),
        path: program.map(absolute).transpose()?,
        origin: Origin::Recording,
    })
}
