//! `ts3100 host` and the table of commands: the help of each command, and a word for every command that has no
//! arguments of its own in [`super::args`] or [`super::extensions`].
//!
//! So a new row of the table can be sent at once, with its operands as on the wire and its answer as it comes.

use super::args::{ExchangeKind, HostCommand};
use clap::error::ErrorKind;
use clap::{Arg, ArgMatches, Command, Error, FromArgMatches, Subcommand};
use ts3100_proto::command::{Answer, COMMANDS, CommandRow, Sender};

/// Name of the argument that takes all operands.
const OPERANDS: &str = "operands";

/// The help of the command with these letters.
pub(super) fn help(letters: &str) -> String {
    let row = COMMANDS.iter().find(|row| row.letters == letters);
    row.map(about).unwrap_or_default()
}

fn about(row: &CommandRow) -> String {
    let prefix = if row.is_extension() { "Extension: " } else { "" };
    format!("{prefix}{}", row.help)
}

/// The word of a command: its letters in lower case.
fn word(row: &CommandRow) -> String {
    row.letters.to_ascii_lowercase()
}

/// The commands that a host begins an exchange with: all but FL, OK and NG.
fn rows() -> impl Iterator<Item = &'static CommandRow> {
    let begins = |row: &&CommandRow| row.permission.is_some() || row.sender == Sender::Host;
    COMMANDS.iter().filter(begins)
}

/// A command as its row describes it.
#[derive(Debug)]
pub(super) struct TableCommand {
    row: &'static CommandRow,
    operands: Vec<String>,
}

impl TableCommand {
    /// The message: letters, and the operands with blanks between them.
    pub(super) fn message(&self) -> String {
        let letters = self.row.letters;
        if self.operands.is_empty() {
            letters.to_owned()
        } else {
            format!("{letters},{}", self.operands.join(" "))
        }
    }

    /// The exchange; a file goes to stdout as it is.
    pub(super) fn exchange_kind(&self) -> ExchangeKind {
        match self.row.answer {
            Answer::Acknowledge => ExchangeKind::Plain,
            Answer::File | Answer::Status => ExchangeKind::Upload { output: None },
        }
    }
}

impl Subcommand for TableCommand {
    /// Adds the rows that have no word yet.
    fn augment_subcommands(command: Command) -> Command {
        rows().fold(command, |command, row| {
            if command.find_subcommand(word(row)).is_some() {
                return command;
            }
            let operands = row.form.split_once(',').map(|(_, operands)| {
                let operands = operands.to_owned();
                let argument = Arg::new(OPERANDS).help(operands).required(true);
                argument.num_args(1..).allow_hyphen_values(true)
            });
            command.subcommand(Command::new(word(row)).about(about(row)).args(operands))
        })
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        TableCommand::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        !HostCommand::has_subcommand(name) && rows().any(|row| word(row) == name)
    }
}

impl FromArgMatches for TableCommand {
    fn from_arg_matches(matches: &ArgMatches) -> Result<TableCommand, Error> {
        let (name, arguments) = matches
            .subcommand()
            .ok_or_else(|| Error::new(ErrorKind::MissingSubcommand))?;
        let row = rows()
            .find(|row| word(row) == name)
            .ok_or_else(|| Error::new(ErrorKind::InvalidSubcommand))?;
        let operands = arguments.try_get_many::<String>(OPERANDS).ok().flatten();
        let operands = operands.into_iter().flatten().cloned().collect();
        Ok(TableCommand { row, operands })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = TableCommand::from_arg_matches(matches)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::args::HostSubcommand;
    use super::*;

    #[test]
    fn every_command_of_the_table_has_a_word_and_its_help() {
        let words = HostSubcommand::augment_subcommands(Command::new("host"));
        for row in rows() {
            let found = words.find_subcommand(word(row)).map(Command::get_about);
            let about = found.flatten().map(ToString::to_string);
            assert_eq!(about, Some(help(row.letters)), "{}", row.name);
        }
        assert!(words.find_subcommand("ok").is_none());
    }

    #[test]
    fn a_row_without_arguments_of_its_own_takes_its_operands() {
        let command = TableCommand::augment_subcommands(Command::new("host"));
        for (words, message) in [
            (&["host", "su"][..], "SU"),
            (&["host", "hi", "1", "8"], "HI,1 8"),
            (&["host", "jg", "1", "-"], "JG,1 -"),
        ] {
            let matches = command.clone().try_get_matches_from(words).unwrap();
            let command = TableCommand::from_arg_matches(&matches).unwrap();
            assert_eq!(command.message(), message);
        }
        assert!(command.try_get_matches_from(["host", "hi"]).is_err());
    }
}
