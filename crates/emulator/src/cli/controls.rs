//! The table of controls on the command line: `ts3100 ctl servo on`, `ts3100 ctl program start`; and the JSON body that sets a
//! switch, for assistants too.
//!
//! The rows are in [`ts3100_controller::controls`]; a new row is a command without a line here.

use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use clap::error::ErrorKind;
use clap::{Arg, ArgMatches, Command, Error, FromArgMatches, Subcommand};
use serde_json::{Value, json};
use std::fmt;
use std::marker::PhantomData;
use ts3100_controller::controls::{BUTTONS, Button, QUERIES, Query, SWITCHES, Switch, ValueType, number_in};
use ts3100_proto::words::UnexpectedWord;

/// The argument of a switch.
const WORD: &str = "value";

/// The body that sets the switch to the value of a word.
///
/// # Errors
/// A word that this switch does not have.
pub fn body(switch: &Switch, word: &str) -> Result<Value, UnexpectedWord> {
    let value = match &switch.value {
        ValueType::State => json!(switch.position(word)? == 0),
        ValueType::Choice => switch.position(word).map(|_| json!(word))?,
        ValueType::Number(range) => json!(number_in(range, word)?),
    };
    Ok(json!({ switch.field: value }))
}

/// Lines of a documentation comment as a help text: without the blank before each, a paragraph on one line.
fn help(doc: &[&str]) -> String {
    let lines = doc.iter().map(|line| line.trim());
    lines.fold(String::new(), |mut text, line| {
        text.push_str(match line {
            "" => "\n\n",
            _ if text.is_empty() || text.ends_with('\n') => "",
            _ => " ",
        });
        text + line
    })
}

fn summary(doc: &[&'static str]) -> &'static str {
    doc.first().map(|line| line.trim()).unwrap_or_default()
}

/// A switch that is shown or set, or a button of its name.
#[derive(Debug)]
pub struct SwitchCommand {
    pub switch: &'static Switch,
    /// A word of its values, or of a button.
    pub word: Option<String>,
}

impl FromArgMatches for SwitchCommand {
    fn from_arg_matches(matches: &ArgMatches) -> Result<SwitchCommand, Error> {
        let (name, matches) = matches.subcommand().unwrap_or(("", matches));
        let switch = SWITCHES.iter().find(|switch| switch.name() == name);
        let word = matches.try_get_one::<String>(WORD).ok().flatten().cloned();
        let switch = switch.ok_or_else(|| Error::new(ErrorKind::InvalidSubcommand))?;
        Ok(SwitchCommand { switch, word })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = SwitchCommand::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Subcommand for SwitchCommand {
    fn augment_subcommands(command: Command) -> Command {
        SWITCHES.iter().fold(command, |command, switch| {
            let name = match switch.value {
                ValueType::State => "STATE".to_owned(),
                ValueType::Choice | ValueType::Number(_) => switch.field.to_ascii_uppercase(),
            };
            let word = Arg::new(WORD)
                .value_name(name)
                .help("New value; without one the switch is shown");
            let word = match &switch.value {
                ValueType::State | ValueType::Choice => {
                    let words: Vec<&str> = switch.all_words().collect();
                    word.value_parser(PossibleValuesParser::new(words).map(String::from))
                }
                ValueType::Number(range) => word
                    .value_parser(move |word: &str| number_in(range, word).map(|number| number.to_string())),
            };
            let described = Command::new(switch.name())
                .about(format!("{}; without a value, show it", summary(switch.doc)))
                .long_about(format!(
                    "{}\n\nWithout a value, the command shows it.",
                    help(switch.doc)
                ));
            command.subcommand(described.arg(word))
        })
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        SwitchCommand::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        SWITCHES.iter().any(|switch| switch.name() == name)
    }
}

/// A document that is shown. Where there is more below its name, another command shows it.
#[derive(Debug)]
pub struct QueryCommand(pub &'static Query);

/// The query whose path these words are.
fn query(words: &[&str]) -> Option<&'static Query> {
    let has_these = |query: &&Query| query.path.split('/').skip(1).eq(words.iter().copied());
    QUERIES.iter().find(has_these)
}

/// The first words of these queries, each with the word after it.
fn query_words() -> impl Iterator<Item = (&'static str, Option<&'static str>, &'static Query)> {
    let alone = QUERIES.iter().filter(|query| !query.has_more);
    alone.filter_map(|query| {
        let mut words = query.path.split('/').skip(1);
        Some((words.next()?, words.next(), query))
    })
}

impl FromArgMatches for QueryCommand {
    fn from_arg_matches(matches: &ArgMatches) -> Result<QueryCommand, Error> {
        let (first, below) = matches.subcommand().unwrap_or(("", matches));
        let words: Vec<&str> = [first].into_iter().chain(below.subcommand_name()).collect();
        query(&words)
            .map(QueryCommand)
            .ok_or_else(|| Error::new(ErrorKind::InvalidSubcommand))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = QueryCommand::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Subcommand for QueryCommand {
    fn augment_subcommands(command: Command) -> Command {
        query_words().fold(command, |command, (first, below, query)| {
            let described = |name| {
                let about = summary(query.doc).replacen("Get ", "Show ", 1);
                let more = help(query.doc.get(1..).unwrap_or_default());
                Command::new(name).long_about(about.clone() + &more).about(about)
            };
            match below {
                Some(below) => command.mut_subcommand(first, |command| command.subcommand(described(below))),
                None => command.subcommand(described(first)),
            }
        })
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        QueryCommand::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        query_words().any(|(first, ..)| first == name)
    }
}

/// The first word of buttons.
pub trait Group {
    const NAME: &'static str;
}

/// A button whose form begins with the name of the group.
pub struct ButtonCommand<G>(pub &'static Button, pub PhantomData<G>);

impl<G> fmt::Debug for ButtonCommand<G> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

fn buttons<G: Group>() -> impl Iterator<Item = (&'static str, &'static Button)> {
    BUTTONS.iter().filter_map(|button| {
        let (group, word) = button.form.split_once(' ')?;
        (group == G::NAME).then_some((word, button))
    })
}

impl<G: Group> FromArgMatches for ButtonCommand<G> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<ButtonCommand<G>, Error> {
        let name = matches.subcommand_name();
        let button = buttons::<G>().find(|(word, _)| Some(*word) == name);
        let (_, button) = button.ok_or_else(|| Error::new(ErrorKind::InvalidSubcommand))?;
        Ok(ButtonCommand(button, PhantomData))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = ButtonCommand::from_arg_matches(matches)?;
        Ok(())
    }
}

impl<G: Group> Subcommand for ButtonCommand<G> {
    fn augment_subcommands(command: Command) -> Command {
        buttons::<G>().fold(command, |command, (word, button)| {
            let described = Command::new(word)
                .about(summary(button.doc))
                .long_about(help(button.doc));
            command.subcommand(described)
        })
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        ButtonCommand::<G>::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        buttons::<G>().any(|(word, _)| word == name)
    }
}

macro_rules! groups {
    ($($name:ident = $word:literal;)*) => { $(
        #[doc = concat!("The buttons of `", $word, "`.")]
        #[derive(Debug)]
        pub enum $name {}

        impl Group for $name {
            const NAME: &'static str = $word;
        }
    )* };
}

groups! {
    ProgramButtons = "program";
    AlarmButtons = "alarms";
    JogButtons = "jog";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_is_the_value_in_the_document_of_its_switch() {
        let of = |name: &str, word: &str| {
            let mut rows = SWITCHES.iter();
            let switch = rows.find(|switch| switch.name() == name).unwrap();
            body(switch, word).map_err(|error| error.to_string())
        };
        assert_eq!(of("emergency-stop", "press"), Ok(json!({"pressed": true})));
        assert_eq!(of("safety-switch", "close"), Ok(json!({"open": false})));
        assert_eq!(of("key-switch", "teaching"), Ok(json!({"position": "teaching"})));
        assert_eq!(of("override", "35"), Ok(json!({"percent": 35})));
        let error = of("override", "150").unwrap_err();
        assert_eq!(error, "expected a whole number from 1 to 100, found `150`");
        let error = of("battery", "full").unwrap_err();
        assert_eq!(error, "expected low or ok, found `full`");
    }
}
