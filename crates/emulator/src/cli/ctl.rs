//! `ts3100 ctl`: the control interface on the command line. One command makes one HTTP call.
//!
//! The arguments are in [`args`], their mapping to calls in [`call`], the formatting of responses in [`show`]. Here
//! the call is sent with [`ts3100_control::client`] and its result becomes an exit code.

mod args;
pub(super) mod call;
mod show;
pub(super) mod target;
#[cfg(test)]
mod tests;

pub use args::CtlArgs;

use super::exit::{NEGATIVE, NO_ANSWER, NOT_REACHED, UNUSABLE};
use super::output;
use crate::log::{print_error, print_warning};
use args::{Command, FaultsCommand, FileCommand, SnapshotCommand};
use call::Call;
use serde_json::Value;
use std::io::{self, BufRead as _, Read as _, Write as _};
use std::path::Path;
use std::time::Duration;
use ts3100_control::client::{Client, ClientError, DEFAULT_TIMEOUT, Response};
use ts3100_control::printable::escape_lines;
use ts3100_driver::files;
use ts3100_proto::name::FileName;

/// The status of a wait whose wall-clock time is over.
const WAIT_ENDED: u16 = 408;

/// Makes the call and shows the answer.
pub fn run(args: &CtlArgs) -> anyhow::Result<u8> {
    let call = Call::from_command(&args.command, args.json)?;
    let url = args.target.url()?;
    let call = call.of_robot(args.target.robot());
    let limit = args
        .timeout
        .unwrap_or_else(|| DEFAULT_TIMEOUT + call.longest_wait());
    let client = args.target.client(&url, limit)?;
    Ok(perform(&client, &call, args).unwrap_or_else(|error| {
        let is_late = matches!(error, ClientError::Late { .. });
        let limit = if is_late { " (--timeout)" } else { "" };
        let advice = match is_late && call.longest_wait() > Duration::ZERO {
            true => ": what is waited for has not come; --wall limits a wait".to_owned(),
            false => target::advice(&error, "--url"),
        };
        print_error(format_args!("{error}{limit}{advice}"));
        NO_ANSWER
    }))
}

fn perform(client: &Client, call: &Call, args: &CtlArgs) -> Result<u8, ClientError> {
    if let Command::Transcript { file: Some(file) } = &args.command {
        return stream(client, call, args.json, |answer| save(answer, &file.path));
    }
    if let Command::Events(events) = &args.command {
        return stream(client, call, args.json, |answer| {
            follow(answer, events.count, args)
        });
    }
    let body = call.body.as_ref().map(ToString::to_string);
    let (status, text) = client.call(call.method, &call.path, body.as_deref())?;
    if status >= 400 {
        let code = refused(args.json, &text);
        return Ok(if status == WAIT_ENDED { NOT_REACHED } else { code });
    }
    let answer = serde_json::from_str::<Value>(&text).ok();
    warn_of_long_name(&args.command);
    // A transcript and a snapshot are shown as they come, a file by its text.
    let shown = match (&answer, &args.command) {
        (
            _,
            Command::Transcript { .. }
            | Command::Snapshots {
                action: Some(SnapshotCommand::Show { .. }),
            },
        ) => text,
        (
            Some(answer),
            Command::Files {
                action: Some(FileCommand::Get { .. }),
            },
        ) if !args.json => show::file_text(answer),
        (
            Some(answer),
            Command::Files {
                action: Some(FileCommand::Put { .. }),
            },
        ) if !args.json => escape_lines(&show::stored_file(answer)),
        (
            Some(answer),
            Command::Faults {
                action: Some(FaultsCommand::Arm { spec }),
            },
        ) if !args.json => escape_lines(&show::armed_fault(answer, spec.id)),
        (Some(answer), Command::Decode(_)) if !args.json => {
            escape_lines(&show::format_document(&show::with_short_numbers(answer.clone())))
        }
        (Some(answer), _) if !args.json => escape_lines(&show::format_document(answer)),
        (Some(answer), _) => format!("{answer}\n"),
        (None, Command::Metrics) if args.json => format!("{}\n", show::metrics(&text)),
        (None, _) => text,
    };
    if let Err(error) = output::print(&shown) {
        print_error(format_args!("{error:#}"));
        return Ok(UNUSABLE);
    }
    let reached = answer
        .as_ref()
        .and_then(|answer| answer.get("reached")?.as_bool());
    Ok(match reached {
        Some(false) => NOT_REACHED,
        _ => 0,
    })
}

/// The robot stores such a file, but its editor could not have made it.
fn warn_of_long_name(command: &Command) {
    if let Command::Files {
        action: Some(FileCommand::Put { name, .. }),
    } = command
        && FileName::parse(name).is_ok_and(|name| !name.fits_editor())
    {
        print_warning(format_args!(
            "the name {name} is longer than the robot's own editor allows: 8 characters and an extension of 3"
        ));
    }
}

/// Makes a call whose answer is taken as it comes.
fn stream(
    client: &Client,
    call: &Call,
    json: bool,
    take: impl FnOnce(Response) -> u8,
) -> Result<u8, ClientError> {
    let mut answer = client.send(call.method, &call.path, None)?;
    if answer.status < 400 {
        return Ok(take(answer));
    }
    let mut text = String::new();
    // What cannot be read is shown as far as it came.
    let _ = io::Read::read_to_string(&mut answer.body, &mut text);
    Ok(refused(json, &text))
}

/// Most characters of a refusal: all diagnostics of a program fit. Another server may send pages.
const MAX_REFUSAL: usize = 65_536;
/// Longest line of the stream of events, in bytes: an event with the largest text, escaped.
const MAX_EVENT: u64 = 1024 * 1024;
/// Largest transcript that is written, in bytes. The emulator keeps 8 MiB, which are more when they are written out.
const MAX_TRANSCRIPT: u64 = 128 * 1024 * 1024;

/// The beginning of a refusal, and how much was left out.
fn shortened(text: &str) -> String {
    match text.char_indices().nth(MAX_REFUSAL) {
        Some((end, _)) => {
            let (begin, rest) = text.split_at(end);
            format!("{begin}... ({} bytes more)", rest.len())
        }
        None => text.to_owned(),
    }
}

fn refused(json: bool, text: &str) -> u8 {
    if json {
        eprintln!("{}", escape_lines(&shortened(text.trim_end())));
    } else {
        print_error(words_of_refusal(text));
    }
    NEGATIVE
}

/// Why a call was refused, from its answer.
pub(super) fn words_of_refusal(text: &str) -> String {
    let answer = serde_json::from_str::<Value>(text).unwrap_or_default();
    let words = answer.get("error").and_then(Value::as_str);
    shortened(words.unwrap_or(text).trim_end())
}

/// The answer as it comes, to a file.
fn save(mut answer: Response, path: &Path) -> u8 {
    answer.body.set_size_limit(MAX_TRANSCRIPT);
    let written = files::replace_with(path, |file| io::copy(&mut answer.body, file).map(drop));
    match written {
        Ok(()) => 0,
        Err(error) => {
            print_error(format_args!("cannot write {}: {error}", path.display()));
            UNUSABLE
        }
    }
}

/// Events as they come, one a line: until there are as many as wanted, for at most `--timeout`, or without an end.
fn follow(mut answer: Response, wanted: Option<u64>, args: &CtlArgs) -> u8 {
    answer.body.set_size_limit(u64::MAX);
    if args.timeout.is_none() {
        answer.body.lift_deadline();
    }
    let (mut kind, mut count, mut is_late) = (String::new(), 0, false);
    let mut body = io::BufReader::new(answer.body);
    loop {
        let line = match read_line(&mut body) {
            Ok(Some(line)) => line,
            Ok(None) => break,
            Err(error) if error.kind() == io::ErrorKind::FileTooLarge => {
                print_error(error);
                return NO_ANSWER;
            }
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
            return 0;
        }
        // The number of events that a slow reader has missed is none of them.
        count += u64::from(kind != "missed");
    }
    match wanted.filter(|wanted| count < *wanted) {
        None => 0,
        Some(wanted) if is_late => {
            print_error(format_args!("{count} of {wanted} events came within --timeout"));
            NOT_REACHED
        }
        Some(wanted) => {
            print_error(format_args!(
                "{count} of {wanted} events came before the emulator ended"
            ));
            NO_ANSWER
        }
    }
}

/// The next line without its end; none after the last one.
fn read_line(source: &mut impl io::BufRead) -> io::Result<Option<String>> {
    let mut line = Vec::new();
    let mut most = source.take(MAX_EVENT + 1);
    if most.read_until(b'\n', &mut line)? == 0 {
        return Ok(None);
    }
    if line.len() as u64 > MAX_EVENT {
        let reason = format!("cannot read the events: a line has more than {MAX_EVENT} bytes");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, reason));
    }
    line.pop_if(|last| *last == b'\n');
    line.pop_if(|last| *last == b'\r');
    Ok(Some(String::from_utf8_lossy(&line).into_owned()))
}

/// False when the reader has closed the pipe.
fn print(text: &str) -> bool {
    let mut stdout = io::stdout().lock();
    stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
        .is_ok()
}
