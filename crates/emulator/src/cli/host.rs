//! `ts3100 host ADDR COMMAND`: sends one command of the simple protocol and shows the decoded reply.
//!
//! The exchanges are `ts3100-host`'s. The arguments are in [`args`] and [`table`], the connection in [`session`], file
//! transfer in [`transfer`], the output in [`render`].

mod address;
mod args;
mod render;
mod session;
mod table;
mod transfer;
mod variable_type;

pub(super) use args::HostArgs;

use super::exit::{NEGATIVE, NO_ANSWER};
use super::output;
use crate::log::print_error;
use address::NoAnswer;
use anyhow::anyhow;
use args::{HostCommand, HostSubcommand};
use serde_json::{Value, json};
use session::Session;
use std::time::Duration;
use ts3100_control::printable::escape_lines;
use ts3100_host::{ClientError, Response};
use ts3100_proto::command::{Answer, Command};
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::text::Framing;

/// Does one command and shows its reply.
pub(super) fn run(args: &HostArgs) -> anyhow::Result<u8> {
    match exchange(args) {
        Ok(true) => Ok(0),
        Ok(false) => say("NG", args.json).map(|()| NEGATIVE),
        Err(error) if error.is::<NoAnswer>() => {
            print_error(format_args!("{error:#}"));
            Ok(NO_ANSWER)
        }
        Err(error) => Err(error),
    }
}

/// Whether the controller did it; false for NG.
fn exchange(args: &HostArgs) -> anyhow::Result<bool> {
    // Before anything is sent: wrong words are the caller's mistake, not the controller's reply.
    let message = args.command.message()?;
    let command =
        Command::parse(message.as_bytes()).map_err(|error| anyhow!("cannot send `{message}`: {error}"))?;
    let mut content = Vec::new();
    if let HostSubcommand::Own(HostCommand::Dl { file, .. }) = &args.command {
        content = transfer::read(file)?;
    }
    let mut session = session::connect(&args.address, args.no_stx, args.timeout, args.total)?;
    let done = perform(&mut session, &command, args, content);
    session::warn(&mut session);
    done.map_err(|error| match error.downcast::<ClientError>() {
        Ok(error) => session::with_address(&args.address, &error).into(),
        Err(error) => error,
    })
}

fn perform(
    session: &mut Session,
    command: &Command,
    args: &HostArgs,
    content: Vec<u8>,
) -> anyhow::Result<bool> {
    match &args.command {
        HostSubcommand::Own(HostCommand::Ul { output, .. }) => {
            transfer::upload(session, command, output.as_deref(), args.json)
        }
        HostSubcommand::Own(HostCommand::Dl { .. }) => {
            transfer::download(session, command, content, args.json)
        }
        HostSubcommand::Own(HostCommand::Rn { wait: Some(limit) }) => {
            let started = plain(session, command, args.json)?;
            if started {
                say(wait_for_stop(session, *limit)?, args.json)?;
            }
            Ok(started)
        }
        HostSubcommand::Own(
            HostCommand::Rn { wait: None } | HostCommand::Mr { .. } | HostCommand::Mw { .. },
        )
        | HostSubcommand::Row(_) => match command.row().answer {
            Answer::Acknowledge => plain(session, command, args.json),
            Answer::File | Answer::Status => show(session, command, args.json),
        },
    }
}

fn plain(session: &mut Session, command: &Command, json: bool) -> anyhow::Result<bool> {
    let done = session.request(command)? == Response::Ok;
    if done {
        say("OK", json)?;
    }
    Ok(done)
}

/// Prints a reply without content.
fn say(reply: &str, json: bool) -> anyhow::Result<()> {
    output::print(match json {
        true => format!("{}\n", json!({ "reply": reply })),
        false => format!("{reply}\n"),
    })
}

/// Waits until the program has stopped: for the SP by which the controller says so, or, as it says nothing to hosts
/// that send no STX (D7), by asking for its status. Returns what to print of it.
fn wait_for_stop(session: &mut Session, limit: Option<Duration>) -> anyhow::Result<&'static str> {
    session.set_total(None);
    if session.conversation().options().framing == Framing::Stx {
        session.wait_for_stop(limit)?;
        return Ok("SP");
    }
    let status = session.poll_until_stopped(limit)?;
    if status.execution == ExecutionStatus::Running {
        let seconds = limit.unwrap_or_default().as_secs_f64();
        return Err(NoAnswer::new(format_args!("the program is still running after {seconds} s")).into());
    }
    Ok("stopped")
}

/// Shows a decoded reply; one without a decoder as it comes.
fn show(session: &mut Session, command: &Command, json: bool) -> anyhow::Result<bool> {
    let letters = command.letters();
    let Some(decode) = render::decoder(letters) else {
        return transfer::upload(session, command, None, json);
    };
    let Response::Content(content) = session.request(command)? else {
        return Ok(false);
    };
    let decoded = decode(&content).map_err(|error| session::unreadable(letters, &error, &content))?;
    print(&decoded, json)?;
    Ok(true)
}

fn print(decoded: &Value, json: bool) -> anyhow::Result<()> {
    let text = if json {
        format!("{decoded}\n")
    } else {
        escape_lines(&render::table(decoded))
    };
    output::print(text)
}
