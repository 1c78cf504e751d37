//! `ts3100 host ADDR COMMAND`: sends one command of the simple protocol and shows the decoded answer.
//!
//! The bytes are `ts3100-proto`'s. The arguments are in [`args`] and [`table`], the connection in [`session`], file
//! transfer in [`transfer`], the output in [`render`].

mod address;
mod args;
mod render;
mod session;
mod table;
mod transfer;
mod variable_type;

pub(super) use args::{HostArgs, seconds};

use super::exit::{NEGATIVE, NO_ANSWER};
use super::output;
use crate::log::print_error;
use address::NoAnswer;
use anyhow::anyhow;
use args::{HostCommand, HostSubcommand};
use serde_json::Value;
use session::{Session, unreadable};
use ts3100_control::printable::escape_lines;
use ts3100_proto::command::{Answer, Command};

/// Does one command and shows its answer.
pub(super) fn run(args: &HostArgs) -> anyhow::Result<u8> {
    match exchange(args) {
        Ok(true) => Ok(0),
        Ok(false) => output::print("NG\n").map(|()| NEGATIVE),
        Err(error) if error.is::<NoAnswer>() => {
            print_error(format_args!("{error:#}"));
            Ok(NO_ANSWER)
        }
        Err(error) => Err(error),
    }
}

/// Whether the controller did it; false for NG.
fn exchange(args: &HostArgs) -> anyhow::Result<bool> {
    // Before anything is sent: wrong words are the caller's mistake, not the controller's answer.
    let message = args.command.message()?;
    let command =
        Command::parse(message.as_bytes()).map_err(|error| anyhow!("cannot send `{message}`: {error}"))?;
    let mut content = Vec::new();
    if let HostSubcommand::Own(HostCommand::Dl { file, .. }) = &args.command {
        content = transfer::read(file)?;
    }
    let mut session = Session::connect(&args.address, args.no_stx, args.timeout, args.total)?;
    match &args.command {
        HostSubcommand::Own(HostCommand::Ul { output, .. }) => {
            transfer::upload(&mut session, &command, output.as_deref())
        }
        HostSubcommand::Own(HostCommand::Dl { .. }) => transfer::download(&mut session, &command, content),
        HostSubcommand::Own(HostCommand::Rn { wait: Some(limit) }) => {
            let started = plain(&mut session, &command)?;
            if started {
                output::print(session.wait_for_stop(*limit)?.to_owned() + "\n")?;
            }
            Ok(started)
        }
        HostSubcommand::Own(
            HostCommand::Rn { wait: None } | HostCommand::Mr { .. } | HostCommand::Mw { .. },
        )
        | HostSubcommand::Row(_) => match command.row().answer {
            Answer::Acknowledge => plain(&mut session, &command),
            Answer::File | Answer::Status => show(&mut session, &command, args.json),
        },
    }
}

fn plain(session: &mut Session, command: &Command) -> anyhow::Result<bool> {
    let done = session.plain(command)?;
    if done {
        output::print("OK\n")?;
    }
    Ok(done)
}

/// Shows a decoded answer; one without a decoder as it comes.
fn show(session: &mut Session, command: &Command, json: bool) -> anyhow::Result<bool> {
    let decoded = match command.letters() {
        "SF" => session
            .system_status(command)?
            .map(|status| render::system_status(&status)),
        "IO" => session.lines(command)?.map(|lines| render::lines(&lines)),
        letters => {
            let Some(decode) = render::decoder(letters) else {
                return transfer::upload(session, command, None);
            };
            let decode =
                |content: Vec<u8>| decode(&content).map_err(|error| unreadable(letters, &error, &content));
            session.file(command)?.map(decode).transpose()?
        }
    };
    decoded.as_ref().map_or(Ok(()), |decoded| print(decoded, json))?;
    Ok(decoded.is_some())
}

fn print(decoded: &Value, json: bool) -> anyhow::Result<()> {
    let text = if json {
        format!("{decoded}\n")
    } else {
        escape_lines(&render::table(decoded))
    };
    output::print(text)
}
