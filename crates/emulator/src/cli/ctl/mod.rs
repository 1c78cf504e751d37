//! `ts3100 ctl`: the control interface on the command line. One command makes one HTTP call.
//!
//! The arguments are in [`args`], their mapping to calls in [`call`], the formatting of responses in [`show`]. Here
//! the call is sent with [`ts3100_control::client`] and its result becomes an exit code.

mod args;
pub(super) mod call;
mod show;
pub(super) mod target;

pub use args::CtlArgs;

use super::exit::{NEGATIVE, NO_ANSWER, NOT_REACHED, UNUSABLE};
use crate::log::print_error;
use args::{Command, FileCommand, SnapshotCommand};
use call::Call;
use serde_json::Value;
use std::io::{self, BufRead as _, Write as _};
use std::path::Path;
use std::process::ExitCode;
use ts3100_control::client::{Client, ClientError, DEFAULT_TIMEOUT, Response};
use ts3100_control::printable::escape_lines;
use ts3100_driver::files;

/// Makes the call and shows the answer.
pub fn run(args: &CtlArgs) -> ExitCode {
    let call = Call::from_command(&args.command, args.json);
    let call = call.and_then(|call| Ok((args.target.url()?, call)));
    let call = call.map(|(url, call)| (url, call.of_robot(args.target.robot())));
    let (url, call) = match call {
        Ok(call) => call,
        Err(error) => {
            print_error(format_args!("{error:#}"));
            return ExitCode::from(UNUSABLE);
        }
    };
    let limit = args
        .timeout
        .unwrap_or_else(|| DEFAULT_TIMEOUT + call.longest_wait());
    let client = args.target.client(&url, limit);
    match client.and_then(|client| perform(&client, &call, args)) {
        Ok(code) => code,
        Err(error) => {
            print_error(format_args!("{error}{}", target::advice(&error)));
            ExitCode::from(match error {
                ClientError::Url(_) | ClientError::Token => UNUSABLE,
                ClientError::Unreachable { .. }
                | ClientError::Late { .. }
                | ClientError::Robot { .. }
                | ClientError::InvalidResponse { .. } => NO_ANSWER,
            })
        }
    }
}

fn perform(client: &Client, call: &Call, args: &CtlArgs) -> Result<ExitCode, ClientError> {
    let file = if let Command::Transcript { file } = &args.command {
        file.as_ref()
    } else {
        None
    };
    let events = if let Command::Events(events) = &args.command {
        Some(events.count)
    } else {
        None
    };
    if file.is_some() || events.is_some() {
        let mut answer = client.send(call.method, &call.path, None)?;
        if answer.status >= 400 {
            let mut text = String::new();
            // What cannot be read is shown as far as it came.
            let _ = io::Read::read_to_string(&mut answer.body, &mut text);
            return Ok(refused(args.json, &text));
        }
        return Ok(match file {
            Some(file) => save(answer, &file.path),
            None => follow(answer, events.flatten(), args),
        });
    }
    let body = call.body.as_ref().map(ToString::to_string);
    let (status, text) = client.call(call.method, &call.path, body.as_deref())?;
    if status >= 400 {
        return Ok(refused(args.json, &text));
    }
    let answer = serde_json::from_str::<Value>(&text).ok();
    // A transcript and a snapshot are shown as they come, a file by its text.
    let shown = match (&answer, &args.command) {
        (
            _,
            Command::Transcript { .. }
            | Command::Snapshot {
                action: Some(SnapshotCommand::Show { .. }),
            },
        ) => text,
        (
            Some(answer),
            Command::File {
                action: Some(FileCommand::Get { .. }),
            },
        ) if !args.json => show::file_text(answer),
        (Some(answer), _) if !args.json => escape_lines(&show::format_document(answer)),
        (Some(answer), _) => format!("{answer}\n"),
        (None, _) => text,
    };
    print(&shown);
    let reached = answer
        .as_ref()
        .and_then(|answer| answer.get("reached")?.as_bool());
    Ok(match reached {
        Some(false) => ExitCode::from(NOT_REACHED),
        _ => ExitCode::SUCCESS,
    })
}

fn refused(json: bool, text: &str) -> ExitCode {
    if json {
        eprintln!("{}", escape_lines(text.trim_end()));
    } else {
        print_error(words_of_refusal(text));
    }
    ExitCode::from(NEGATIVE)
}

/// Why a call was refused, from its answer.
pub(super) fn words_of_refusal(text: &str) -> String {
    let answer = serde_json::from_str::<Value>(text).unwrap_or_default();
    let words = answer.get("error").and_then(Value::as_str);
    words.unwrap_or(text).trim_end().to_owned()
}

/// The answer as it comes, to a file.
fn save(mut answer: Response, path: &Path) -> ExitCode {
    answer.body.lift_size_limit();
    let written = files::replace_with(path, |file| io::copy(&mut answer.body, file).map(drop));
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            print_error(format_args!("cannot write {}: {error}", path.display()));
            ExitCode::from(UNUSABLE)
        }
    }
}

/// Events as they come, one a line: until there are as many as wanted, for at most `--timeout`, or without an end.
fn follow(mut answer: Response, wanted: Option<u64>, args: &CtlArgs) -> ExitCode {
    answer.body.lift_size_limit();
    if args.timeout.is_none() {
        answer.body.lift_deadline();
    }
    let (mut kind, mut count, mut is_late) = (String::new(), 0, false);
    for line in io::BufReader::new(answer.body).lines() {
        let line = match line {
            Ok(line) => line,
            // Otherwise the interface has ended.
            Err(error) => {
                is_late = error.kind() == io::ErrorKind::TimedOut;
                break;
            }
        };
        if let Some(name) = line.strip_prefix("event: ") {
            name.clone_into(&mut kind);
        }
        let Some(data) = line.strip_prefix("data: ") else {
            continue;
        };
        let event = serde_json::from_str::<Value>(data).ok();
        let shown = match event {
            Some(event) if !args.json => escape_lines(&show::format_event(&kind, &event)),
            _ => format!("{data}\n"),
        };
        if !print(&shown) {
            return ExitCode::SUCCESS;
        }
        // The number of events that a slow reader has missed is none of them.
        count += u64::from(kind != "missed");
    }
    match wanted.filter(|wanted| count < *wanted) {
        None => ExitCode::SUCCESS,
        Some(wanted) if is_late => {
            print_error(format_args!("{count} of {wanted} events came within --timeout"));
            ExitCode::from(NOT_REACHED)
        }
        Some(wanted) => {
            print_error(format_args!(
                "{count} of {wanted} events came before the emulator ended"
            ));
            ExitCode::from(NO_ANSWER)
        }
    }
}

/// False when the reader has closed the pipe.
fn print(text: &str) -> bool {
    let mut stdout = io::stdout().lock();
    stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
        .is_ok()
}
