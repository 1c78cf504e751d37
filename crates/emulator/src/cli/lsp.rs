//! `ts3100 lsp`: the language server of SCOL on stdin and stdout.
//!
//! The server is `ts3100-workbench`'s. Here all messages that have arrived reach it together, and files are read for it.

use super::editor::{self, Message};
use super::exit::{NEGATIVE, UNUSABLE};
use super::input;
use super::programs::{self, FolderError};
use crate::config::model::ModelChoice;
use crate::config::read_points;
use crate::instances;
use crate::log::print_error;
use clap::Args;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;
use tracing::debug;
use ts3100_book::{Passage, book};
use ts3100_controller::model::ArmModel;
use ts3100_driver::files;
use ts3100_driver::pc_file::MAX_PC_FILE;
use ts3100_recording::uri;
use ts3100_workbench::framing;
use ts3100_workbench::lsp::{Project, Server, Settings, SettingsError};

/// Time between two looks at the process of the editor: one that was killed may leave the stream open to others.
const LOOK: Duration = Duration::from_secs(3);

/// Serve SCOL to an editor (Language Server Protocol over stdin and stdout).
///
/// Configure your editor to start `ts3100 lsp` for SCOL files. It shows errors while you type and fixes them, completes,
/// explains words, alarms and lines, finds and renames what programs name, and formats. docs: how-to/write-scol
///
/// Exit codes: 0 the editor ended the conversation; 1 it left without a word, or its process ended; 2 wrong usage, or it sends something else.
#[derive(Debug, Args)]
pub(super) struct LspArgs {
    /// Arm, by name or .toml file: it decides how many values a position has
    #[arg(long, value_name = "MODEL", default_value = "ts3100-tv800")]
    model: ModelChoice,
    /// Points taught on the controller, a CSV file [default: points.csv beside each program]
    #[arg(long, value_name = "FILE")]
    points: Option<PathBuf>,
    /// Speak over stdin and stdout, which is the only way; editors pass it
    #[arg(long)]
    stdio: bool,
}

/// Serves until the editor says `exit` or closes the stream.
pub(super) fn run(args: &LspArgs) -> anyhow::Result<u8> {
    let model = args.model.read()?;
    let points = args.points.as_ref().map(std::path::absolute).transpose()?;
    if let Some(points) = &points {
        // Whoever names a table wants its points.
        read_points(points, model.language())?;
    }
    let settings = Settings { model, points };
    let (_, messages) = editor::messages()?;
    let mut server = Server::new(Disk::default(), settings);
    let mut stdout = io::stdout().lock();
    Ok(serve(&mut server, &messages, &mut stdout, LOOK, is_running))
}

/// Serves until the conversation ends, or the editor is no longer one of the processes that run.
fn serve(
    server: &mut Server<impl Project>,
    messages: &Receiver<Message>,
    stream: &mut impl Write,
    look: Duration,
    mut is_running: impl FnMut(u32) -> bool,
) -> u8 {
    let (mut editor, mut is_known) = (None, false);
    loop {
        let mut batch = Vec::new();
        let mut end = None;
        let first = match editor {
            None => messages.recv().map_err(RecvTimeoutError::from),
            Some(_) => messages.recv_timeout(look),
        };
        let first = match (first, editor) {
            (Ok(message), _) => message,
            (Err(RecvTimeoutError::Timeout), Some(process)) if is_running(process) => continue,
            (Err(_), _) => return NEGATIVE,
        };
        for message in std::iter::once(first).chain(messages.try_iter()) {
            match message {
                Ok(Some(message)) => batch.push(message),
                Ok(None) => end = Some(NEGATIVE),
                Err(error) => {
                    print_error(format_args!("{:#}", anyhow::Error::new(error)));
                    end = Some(UNUSABLE);
                }
            }
        }
        let answers = server.receive(batch.iter().map(Vec::as_slice));
        for answer in answers {
            // An editor that has gone takes no answer.
            if framing::write(stream, &answer.to_string()).is_err() {
                return NEGATIVE;
            }
        }
        if let Some(is_orderly) = server.ended() {
            return if is_orderly { 0 } else { NEGATIVE };
        }
        if let Some(code) = end {
            return code;
        }
        if let Some(process) = server.editor().filter(|_| !is_known) {
            is_known = true;
            // One that cannot be seen, as from a container, is no reason to end.
            editor = Some(process).filter(|process| is_running(*process));
        }
    }
}

/// Whether a process runs. Those of another user do; where it cannot be found out, all do.
fn is_running(process: u32) -> bool {
    #[cfg(unix)]
    {
        use rustix::io::Errno;
        use rustix::process::{Pid, test_kill_process};
        let process = i32::try_from(process).ok().and_then(Pid::from_raw);
        process.is_some_and(|process| test_kill_process(process) != Err(Errno::SRCH))
    }
    #[cfg(not(unix))]
    {
        let _ = process;
        true
    }
}

/// The files of the machine.
#[derive(Debug, Default)]
struct Disk {
    /// Addresses of the pages that have been written, by their codes.
    pages: RefCell<BTreeMap<String, Option<String>>>,
}

impl Project for Disk {
    fn read(&self, path: &Path) -> io::Result<String> {
        let is_table = path
            .extension()
            .is_some_and(|end| end.eq_ignore_ascii_case("csv"));
        if is_table {
            files::read_text(path, MAX_PC_FILE)
        } else {
            input::read_program(path)
        }
    }

    fn programs(&self, folder: &Path) -> Vec<PathBuf> {
        let found = programs::expand(programs::PROGRAMS, &[folder.to_path_buf()]).into_iter();
        let listed = found.inspect(|found| {
            if let Err(FolderError { path, reason }) = found {
                debug!("cannot list {}: {reason}", path.display());
            }
        });
        listed
            .filter_map(Result::ok)
            .chain(programs::without_ending(folder))
            .collect()
    }

    fn model(&self, name: &str) -> Result<ArmModel, SettingsError> {
        let choice = name
            .parse::<ModelChoice>()
            .map_err(|error| SettingsError::Model(error.to_string()))?;
        choice
            .read()
            .map_err(|error| SettingsError::Model(error.to_string()))
    }

    fn explanation(&self, code: &str) -> Option<String> {
        let mut pages = self.pages.borrow_mut();
        let page = pages
            .entry(code.to_owned())
            .or_insert_with_key(|code| write_page(code));
        page.clone()
    }
}

/// Writes what `ts3100 explain` prints to a file that the editor opens, and returns its address.
fn write_page(code: &str) -> Option<String> {
    let passages = book().explain(code);
    let texts: Vec<String> = passages.iter().map(Passage::without_links).collect();
    let folder = instances::private_directory()?.join("explain");
    let path = folder.join(code).with_extension("md");
    fs::create_dir_all(&folder).ok()?;
    fs::write(&path, texts.join("\n")).ok()?;
    Some(uri::of_file(&path))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::editor::AHEAD;
    use std::sync::mpsc::sync_channel;

    /// Serves an editor that has named its process and then says no more, and returns how often its process was looked
    /// at.
    fn looks(mut is_running: impl FnMut(u32) -> bool) -> (u8, u32) {
        let (sender, messages) = sync_channel(AHEAD);
        let initialize =
            r#"{"jsonrpc":"2.0","id":1,"method":"initialize","params":{"processId":77,"capabilities":{}}}"#;
        sender.send(Ok(Some(initialize.into()))).unwrap();
        let settings = Settings {
            model: ArmModel::by_name("ts3100-tv800").unwrap(),
            points: None,
        };
        let mut server = Server::new(Disk::default(), settings);
        let mut count = 0;
        let mut sender = Some(sender);
        let code = serve(
            &mut server,
            &messages,
            &mut Vec::new(),
            Duration::ZERO,
            |process| {
                assert_eq!(process, 77);
                count += 1;
                let running = is_running(count);
                if !running && count == 1 {
                    // Nothing is looked at after this.
                    sender.take();
                }
                running
            },
        );
        (code, count)
    }

    #[test]
    fn the_server_ends_with_the_process_of_the_editor() {
        assert_eq!(looks(|count| count < 4), (NEGATIVE, 4));
    }

    #[test]
    fn an_editor_that_cannot_be_seen_is_served_until_its_stream_ends() {
        assert_eq!(looks(|_| false), (NEGATIVE, 1));
    }

    #[test]
    #[cfg(unix)]
    fn a_process_runs_until_it_has_ended() {
        assert!(is_running(std::process::id()));
        let mut ended = std::process::Command::new("true").spawn().unwrap();
        ended.wait().unwrap();
        assert!(!is_running(ended.id()));
        assert!(!is_running(0));
    }
}
