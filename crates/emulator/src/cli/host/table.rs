//! `ts3100 host` and the table of commands: a word for every command, with its help and its operands.
//!
//! Operands are passed on as they were typed, so a new row of the table can be sent at once. Commands whose arguments
//! are more than operands are in [`super::args`].

use clap::builder::{PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser};
use clap::{Arg, ArgAction, ArgMatches, Command};
use ts3100_proto::command::{COMMANDS, CommandRow, Sender, ZsFrame};

/// The order of the words in the help: those of the manual that people use most come first.
const ORDER: [&str; 40] = [
    "SU", "SF", "CA", "VR", "EU", "UL", "DL", "ER", "SL", "RN", "SP", "SO", "BR", "RS", "MR", "MW", "IW",
    "DO", "EC", "FD", "SM", "WD", "AC", "AH", "IO", "HI", "HO", "PR", "PS", "VL", "ZS", "MN", "RM", "ZC",
    "EM", "MD", "RT", "SC", "JG", "MP",
];
/// Words for the numbers of MD.
const MODES: &[&str] = &["jog", "inching", "free"];
/// Words for the numbers of RT.
const RATES: &[&str] = &["slow", "mid", "fast"];
/// Words for the numbers of SC.
const SYSTEMS: &[&str] = &["joint", "tool", "work", "world"];

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
pub(super) fn word(row: &CommandRow) -> String {
    row.letters.to_ascii_lowercase()
}

/// The commands that a host begins an exchange with, in the order of the help: all but FL, OK and NG.
pub(super) fn rows() -> Vec<&'static CommandRow> {
    let begins = |row: &&CommandRow| row.permission.is_some() || row.sender == Sender::Host;
    let mut rows: Vec<&CommandRow> = COMMANDS.iter().filter(begins).collect();
    rows.sort_by_key(|row| {
        let place = ORDER.iter().position(|letters| *letters == row.letters);
        place.unwrap_or(ORDER.len())
    });
    // RS and RS,ERR are one word.
    rows.dedup_by_key(|row| row.letters);
    rows
}

/// One operand, which the user must give.
fn operand(name: &'static str, help: impl Into<String>) -> Arg {
    let argument = Arg::new(name).value_name(name.to_ascii_uppercase());
    argument.help(help.into()).required(true)
}

/// One or more operands.
fn operands(name: &'static str, help: impl Into<String>) -> Arg {
    operand(name, help).num_args(1..).action(ArgAction::Append)
}

/// A number that may be given by a word; proto knows which numbers there are.
fn number_or_word(name: &'static str, words: &'static [&str]) -> Arg {
    let number = |typed: String| {
        let place = words.iter().position(|word| typed.eq_ignore_ascii_case(word));
        place.map_or(typed, |place| place.to_string())
    };
    operand(name, "Word or number").value_parser(StringValueParser::new().map(number))
}

/// The coordinate system of ZS by its word.
fn frame() -> impl TypedValueParser<Value = String> {
    let words = PossibleValuesParser::new([
        PossibleValue::new("work").help("The work coordinate system"),
        PossibleValue::new("tool").help("The tool"),
    ]);
    // The word is as it was typed, in whatever case.
    words.map(|word| match word.eq_ignore_ascii_case("tool") {
        true => ZsFrame::Tool.code().to_string(),
        false => ZsFrame::Work.code().to_string(),
    })
}

/// The operands of a command, in the order of its message.
fn operands_of(row: &CommandRow) -> Vec<Arg> {
    let first = || operand("first", "Number of the first line, which is bit 0");
    let count = || operand("count", "Number of lines, 1 to 16");
    match row.letters {
        "ER" | "SL" => vec![operand("name", "File of the RAM drive")],
        "RS" => vec![operand("what", "Part to reset")],
        "IW" => vec![operands("pairs", "Line number and 0 or 1, in turn")],
        "DO" => {
            let statement = operands("statement", "The statement; everything after it belongs to it");
            vec![statement.trailing_var_arg(true).allow_hyphen_values(true)]
        }
        "EC" => vec![operands("words", "The command and its operand")],
        "WD" => vec![
            operand(
                "timeout_ms",
                "Longest silence in milliseconds, after which the alarm follows; 0 ends the watchdog. Each text on HOST \
                 or IP0 feeds it",
            ),
            operand("level", "Level of the alarm: 1, 2 or 8; 0 for no alarm"),
        ],
        "HI" => vec![first(), count()],
        "HO" => vec![first(), count(), operand("value", "Value of the lines")],
        "PR" => vec![operand("which", "Number of the position")],
        "VL" => vec![operand("which", "Number of the speed")],
        "ZS" => vec![
            operand("frame", "Coordinate system")
                .value_parser(frame())
                .ignore_case(true),
            operand("name", "Name of the coordinate variable"),
            operands("values", "X Y Z C of a SCARA, X Y Z A B C of a six-axis arm")
                .allow_negative_numbers(true),
        ],
        "MD" => vec![number_or_word("mode", MODES)],
        "RT" => vec![number_or_word("rate", RATES)],
        "SC" => vec![number_or_word("system", SYSTEMS)],
        "JG" => vec![
            operand("axis", "Axis, 1 to 8"),
            operand("motion", "+ - or !").allow_hyphen_values(true),
        ],
        _ => match row.form.split_once(',') {
            // The form is the whole message when nothing in it varies, as in `SM,1`.
            Some((_, form)) if row.form != row.example => {
                vec![operands("operands", form).allow_hyphen_values(true)]
            }
            _ => Vec::new(),
        },
    }
}

/// The subcommand of a row, with its operands as arguments.
pub(super) fn subcommand(row: &CommandRow) -> Command {
    Command::new(word(row)).about(about(row)).args(operands_of(row))
}

/// The message of a row with the operands of the command line.
pub(super) fn message(row: &CommandRow, arguments: &ArgMatches) -> String {
    let names = operands_of(row);
    let typed = names
        .iter()
        .filter_map(|operand| arguments.get_many::<String>(operand.get_id().as_str()));
    let typed: Vec<&str> = typed.flatten().map(String::as_str).collect();
    if typed.is_empty() {
        row.form.to_owned()
    } else {
        format!("{},{}", row.letters, typed.join(" "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operands_become_the_message_in_their_order() {
        let command = Command::new("host").subcommands(rows().into_iter().map(subcommand));
        for (typed, expected) in [
            (&["host", "su"][..], "SU"),
            (&["host", "sm"], "SM,1"),
            (&["host", "hi", "1", "8"], "HI,1 8"),
            (&["host", "jg", "1", "-"], "JG,1 -"),
            (&["host", "md", "Free"], "MD,2"),
            (&["host", "zs", "Tool", "T", "1", "-2"], "ZS,2 T 1 -2"),
        ] {
            let matches = command.clone().try_get_matches_from(typed).unwrap();
            let (name, arguments) = matches.subcommand().unwrap();
            let row = rows().into_iter().find(|row| word(row) == name).unwrap();
            assert_eq!(message(row, arguments), expected);
        }
        assert!(command.try_get_matches_from(["host", "hi"]).is_err());
    }

    #[test]
    fn a_row_without_operands_of_its_own_takes_those_of_its_form() {
        let mut row = COMMANDS[0];
        (row.letters, row.form, row.example) = ("ZZ", "ZZ,<0-5> <name>", "ZZ,1 A");
        let command = subcommand(&row);
        let matches = command.try_get_matches_from(["zz", "1", "A"]).unwrap();
        assert_eq!(message(&row, &matches), "ZZ,1 A");
    }
}
