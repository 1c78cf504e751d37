//! The arguments of `ts3100 host`. A command and its operands are turned into a protocol message, which
//! `ts3100-proto` parses again, so operands obey the same grammar as on the wire.
//!
//! Here are the options, and the commands whose arguments are more than operands. All others are in
//! [`super::table`]; the exchange itself is in [`super::session`].

use super::table::{help, message, rows, subcommand, word};
use super::variable_type::VariableType;
use crate::config::args::seconds;
use clap::error::ErrorKind;
use clap::{ArgMatches, Args, Command, Error, FromArgMatches, Subcommand};
use std::path::PathBuf;
use std::time::Duration;
use ts3100_driver::pc_file::{self, NameError};

/// Send one command to a robot and print the reply.
///
/// Works with emulators and real controllers.
///
/// Exit codes: 0 OK; 1 NG; 2 wrong usage; 3 no reply.
#[derive(Debug, Args)]
pub(in crate::cli) struct HostArgs {
    /// Port IP0 of the controller, NAME:PORT or ADDRESS:PORT
    #[arg(value_name = "ADDR")]
    pub(super) address: String,
    #[command(subcommand)]
    pub(super) command: HostSubcommand,
    /// Send messages without STX
    #[arg(long, global = true)]
    pub(super) no_stx: bool,
    /// Print the decoded reply as JSON
    #[arg(long, global = true)]
    pub(super) json: bool,
    /// Longest wait for each text of a reply
    #[arg(long, global = true, value_name = "TIME", default_value = "5s", value_parser = seconds("1us", "1440min"))]
    pub(super) timeout: Duration,
    /// Longest time for the whole exchange, without the wait of `rn --wait`
    #[arg(long, global = true, value_name = "TIME", default_value = "600s", value_parser = seconds("1us", "1440min"))]
    pub(super) total: Duration,
}

/// Any command of the table.
#[derive(Debug)]
pub(super) enum HostSubcommand {
    /// One with arguments of its own.
    Own(HostCommand),
    /// A row of the table: the message with its operands.
    Row(String),
}

impl Subcommand for HostSubcommand {
    fn augment_subcommands(command: Command) -> Command {
        let own = HostCommand::augment_subcommands(Command::new("own"));
        command.subcommands(rows().into_iter().map(|row| {
            let known = own.find_subcommand(word(row)).cloned();
            // Its place in the help is the one it gets here, not the one among its own. The manual writes upper case.
            known
                .unwrap_or_else(|| subcommand(row))
                .display_order(None)
                .alias(row.letters)
        }))
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        HostSubcommand::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        rows().into_iter().any(|row| word(row) == name)
    }
}

impl FromArgMatches for HostSubcommand {
    fn from_arg_matches(matches: &ArgMatches) -> Result<HostSubcommand, Error> {
        let (name, arguments) = matches
            .subcommand()
            .ok_or_else(|| Error::new(ErrorKind::MissingSubcommand))?;
        if HostCommand::has_subcommand(name) {
            return HostCommand::from_arg_matches(matches).map(HostSubcommand::Own);
        }
        let row = rows().into_iter().find(|row| word(row) == name);
        let row = row.ok_or_else(|| Error::new(ErrorKind::InvalidSubcommand))?;
        Ok(HostSubcommand::Row(message(row, arguments)))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = HostSubcommand::from_arg_matches(matches)?;
        Ok(())
    }
}

/// A command with arguments that are not operands.
#[derive(Debug, Subcommand)]
pub(super) enum HostCommand {
    #[command(about = help("UL"))]
    Ul {
        /// File of the RAM drive
        name: String,
        /// Write the content to this file [default: stdout]
        #[arg(long, short, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    #[command(about = help("DL"))]
    Dl {
        /// File of this computer
        file: PathBuf,
        /// Name on the RAM drive [default: from the file name; pick.scol becomes PICK]
        name: Option<String>,
    },
    #[command(about = help("RN"))]
    Rn {
        /// Wait until the controller reports the stop by SP, at most TIME
        #[arg(long, value_name = "TIME", num_args = 0..=1, value_parser = seconds("1us", "1440min"))]
        wait: Option<Option<Duration>>,
    },
    #[command(about = help("MR"))]
    Mr {
        /// Name of the variable
        name: String,
        /// Type: integer, real, load, coordinate, position; or the manual's code: 0-4 these, 5-9 elements of arrays of
        /// these, -1 any
        #[arg(value_name = "TYPE", allow_negative_numbers = true)]
        kind: Option<VariableType>,
        /// Same as TYPE
        #[arg(
            long = "type",
            value_name = "TYPE",
            allow_negative_numbers = true,
            conflicts_with = "kind"
        )]
        named_kind: Option<VariableType>,
    },
    #[command(about = help("MW"))]
    Mw {
        /// Name of the variable
        name: String,
        /// Type, as for mr [default: -1, any]
        #[arg(long = "type", value_name = "TYPE", allow_negative_numbers = true)]
        kind: Option<VariableType>,
        /// Also write the value into the program file
        #[arg(long)]
        restore: bool,
        /// Values, as many as the type has
        #[arg(required = true, allow_negative_numbers = true)]
        values: Vec<String>,
    },
}

impl HostSubcommand {
    /// The message it makes.
    pub(super) fn message(&self) -> Result<String, NameError> {
        match self {
            HostSubcommand::Own(command) => command.message(),
            HostSubcommand::Row(message) => Ok(message.clone()),
        }
    }
}

impl HostCommand {
    fn message(&self) -> Result<String, NameError> {
        Ok(match self {
            HostCommand::Ul { name, .. } => format!("UL,{name}"),
            HostCommand::Dl { file, name: None } => format!("DL,{}", pc_file::drive_name(file)?),
            HostCommand::Dl { name: Some(name), .. } => format!("DL,{name}"),
            HostCommand::Rn { .. } => "RN".to_owned(),
            HostCommand::Mr {
                name,
                kind,
                named_kind,
            } => {
                let kind = kind.or(*named_kind).unwrap_or_default();
                format!("MR,{name} {}", kind.code(name))
            }
            HostCommand::Mw {
                name,
                kind,
                restore,
                values,
            } => {
                let kind = kind.unwrap_or_default().code(name);
                format!("MW,{} {name} {kind} {}", u8::from(*restore), values.join(" "))
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_of_the_table_has_a_word_and_its_help() {
        let words = HostSubcommand::augment_subcommands(Command::new("host"));
        for row in rows() {
            let found = words.find_subcommand(word(row)).map(Command::get_about);
            let about = found.flatten().map(ToString::to_string);
            assert_eq!(about, Some(help(row.letters)), "{}", row.name);
            let upper = words.find_subcommand(row.letters).map(Command::get_name);
            assert_eq!(upper, Some(word(row).as_str()));
        }
        assert!(words.find_subcommand("ok").is_none());
    }
}
