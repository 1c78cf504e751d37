//! `ts3100 host ADDR COMMAND`: sends one command of the simple protocol and shows the decoded answer.
//!
//! The bytes are `ts3100-proto`'s. The arguments are in [`args`], the connection in [`session`], file transfer in
//! [`transfer`], the output in [`render`].

mod args;
mod extensions;
mod render;
mod session;
mod table;
mod transfer;
mod variable_type;

pub(super) use args::{HostArgs, seconds};

use args::{Decoder, ExchangeKind};
use serde_json::Value;
use session::{HostError, Session};
use std::io::{self, Write};
use std::process::ExitCode;
use ts3100_control::printable::{escape_lines, printable};
use ts3100_proto::command::Command;

/// Exit code of NG.
const NEGATIVE: u8 = 1;
/// Exit code when no answer could be had.
const NO_ANSWER: u8 = 2;

/// How an exchange ended that did not fail.
pub(super) enum Answer {
    /// OK, or a file in its place.
    Positive,
    /// NG.
    Negative,
}

/// Does one command and shows its answer.
pub(super) fn run(args: &HostArgs) -> ExitCode {
    match exchange(args) {
        Ok(Answer::Positive) => ExitCode::SUCCESS,
        Ok(Answer::Negative) => {
            println!("NG");
            ExitCode::from(NEGATIVE)
        }
        Err(error) => {
            eprintln!("ts3100 host: {}", printable(error));
            ExitCode::from(NO_ANSWER)
        }
    }
}

fn exchange(args: &HostArgs) -> Result<Answer, HostError> {
    // Before anything is sent: wrong words are the caller's mistake, not the controller's answer.
    let command = args.command.parse()?;
    let mut session = Session::connect(&args.address, args.no_stx, args.timeout, args.total)?;
    match args.command.exchange_kind() {
        ExchangeKind::Plain => plain(&mut session, &command),
        ExchangeKind::RunAndWait(limit) => run_and_wait(&mut session, &command, limit),
        ExchangeKind::Download { file } => transfer::download(&mut session, &command, &file),
        ExchangeKind::Upload { output } => transfer::upload(&mut session, &command, output.as_deref()),
        ExchangeKind::Status(show) => show_status(&mut session, &command, show, args.json),
        ExchangeKind::SystemStatus => {
            let Some(status) = session.system_status(&command)? else {
                return Ok(Answer::Negative);
            };
            print(&render::system_status(&status), args.json)?;
            Ok(Answer::Positive)
        }
        ExchangeKind::Lines => {
            let Some(lines) = session.lines(&command)? else {
                return Ok(Answer::Negative);
            };
            print(&render::lines(&lines), args.json)?;
            Ok(Answer::Positive)
        }
    }
}

fn plain(session: &mut Session, command: &Command) -> Result<Answer, HostError> {
    let answer = session.plain(command)?;
    if matches!(answer, Answer::Positive) {
        println!("OK");
    }
    Ok(answer)
}

fn run_and_wait(
    session: &mut Session,
    command: &Command,
    limit: Option<std::time::Duration>,
) -> Result<Answer, HostError> {
    let answer = plain(session, command)?;
    if matches!(answer, Answer::Positive) {
        println!("{}", session.wait_for_stop(limit)?);
    }
    Ok(answer)
}

fn show_status(
    session: &mut Session,
    command: &Command,
    show: Decoder,
    json: bool,
) -> Result<Answer, HostError> {
    let Some(content) = session.file(command)? else {
        return Ok(Answer::Negative);
    };
    let decoded = render::decode(show, &content).map_err(|error| HostError::Content {
        letters: command.letters(),
        reason: error.to_string(),
        found: content,
    })?;
    print(&decoded, json)?;
    Ok(Answer::Positive)
}

fn print(decoded: &Value, json: bool) -> Result<(), HostError> {
    let text = if json {
        format!("{decoded}\n")
    } else {
        escape_lines(&render::table(decoded))
    };
    io::stdout()
        .lock()
        .write_all(text.as_bytes())
        .map_err(HostError::Output)
}
