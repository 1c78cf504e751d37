//! The named options (decision D0) by their keys. [`OPTIONS`] has one row for each, made of the rows of the controller; how
//! a value is read follows from the row (`value`).
//!
//! The presets belong to the dialect. The effects are in the controller and, for the links, in [`ts3100_driver::tcp`] and
//! [`ts3100_driver::store`].

mod table;
mod value;

pub use table::OPTIONS;

use std::fmt;
use ts3100_controller::{Dialect, Options};
use ts3100_driver::tcp::LinkOptions;
use ts3100_proto::words::did_you_mean;
use value::Setting;

/// Why a named option cannot be set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OptionError {
    /// No option has this name.
    #[error("unknown option `{key}`{hint}")]
    Unknown {
        /// The key as given.
        key: String,
        /// The options that may be meant, as the end of the message.
        hint: String,
    },
    /// `--set` without `=`.
    #[error("option: expected KEY=VALUE, found `{0}`")]
    Pair(String),
    /// The value does not fit.
    #[error("option {key}: expected {expected}, found `{found}`")]
    Value {
        /// The key of the option.
        key: &'static str,
        /// The values it accepts.
        expected: String,
        /// The value as given.
        found: String,
    },
}

/// Hint to the list of all options.
const ALL_OPTIONS: &str = "; `ts3100 serve --set help` lists them";

/// The values that an option accepts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Values {
    /// `true` or `false`.
    Flag,
    /// One of these words.
    Words(&'static [&'static str]),
    /// A duration from `least` to an hour.
    Duration {
        /// The shortest.
        least: &'static str,
        /// A usual one.
        example: &'static str,
    },
    /// A whole number.
    Whole {
        unit: &'static str,
        /// Smallest value.
        min: usize,
        /// Largest value.
        max: usize,
    },
    /// A number.
    Number {
        /// Smallest value.
        min: f32,
        /// Largest value.
        max: f32,
    },
    /// Open mode of each of IP0 to IP3, as in `[E00]`.
    OpenModes,
    /// Five durations, or one for all.
    Quartiles,
}

impl Values {
    /// The words it is one of; empty for numbers and times.
    pub fn words(&self) -> &'static [&'static str] {
        match self {
            Values::Flag => &["true", "false"],
            Values::Words(words) => words,
            Values::Duration { .. }
            | Values::Whole { .. }
            | Values::Number { .. }
            | Values::OpenModes
            | Values::Quartiles => &[],
        }
    }
}

impl fmt::Display for Values {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Values::Flag => f.write_str("true or false"),
            Values::Words([words @ .., last]) => write!(f, "{} or {last}", words.join(", ")),
            Values::Words([]) => Ok(()),
            Values::Duration { least: "0s", example } => write!(f, "a duration, for example {example}"),
            Values::Duration { least, example } => {
                write!(f, "a duration from {least} to an hour, for example {example}")
            }
            Values::Whole { unit, min, max } => write!(f, "a whole number of {unit} from {min} to {max}"),
            Values::Number { min, max } => write!(f, "a number from {min} to {max}"),
            Values::Quartiles => f.write_str(
                "five durations that do not fall, for example `2 3 4 6 20` in ms, or one, for example `500 ms`; at most a minute",
            ),
            Values::OpenModes => f.write_str("four digits 0, 1 or 2 as in [E00], for example `1 1 0 0`"),
        }
    }
}

/// One option: a row of [`OPTIONS`].
#[derive(Clone, Copy)]
pub struct OptionRow {
    /// Name in `--set` and in the table `[options]`.
    pub key: &'static str,
    about: &'static str,
    setting: &'static dyn Setting,
}

impl OptionRow {
    /// What it decides, in one sentence.
    pub fn about(&self) -> &'static str {
        self.about.trim()
    }

    /// The values it accepts.
    pub fn values(&self) -> Values {
        self.setting.values()
    }

    /// Its default in a dialect; empty if it depends on the arm.
    pub fn default_in(&self, dialect: Dialect) -> String {
        let (mut options, mut links) = (Options::for_dialect(dialect), LinkOptions::default());
        self.setting.text(&mut options, &mut links)
    }
}

/// Sets one named option from `KEY=VALUE`.
///
/// # Errors
/// Another form, or as [`set_option`].
pub(super) fn set_pair(
    options: &mut Options,
    links: &mut LinkOptions,
    pair: &str,
) -> Result<(), OptionError> {
    let (key, value) = pair
        .split_once('=')
        .ok_or_else(|| OptionError::Pair(pair.to_owned()))?;
    set_option(options, links, key.trim(), value.trim())
}

/// Sets one named option.
///
/// # Errors
/// An unknown key, or a value the option does not accept.
pub fn set_option(
    options: &mut Options,
    links: &mut LinkOptions,
    key: &str,
    value: &str,
) -> Result<(), OptionError> {
    let Some(row) = OPTIONS.iter().find(|row| row.key == key) else {
        let hint = did_you_mean(key, OPTIONS.iter().map(|row| row.key));
        return Err(OptionError::Unknown {
            key: key.to_owned(),
            hint: if hint.is_empty() {
                ALL_OPTIONS.to_owned()
            } else {
                hint
            },
        });
    };
    let set = row.setting.set(options, links, value);
    set.ok_or_else(|| OptionError::Value {
        key: row.key,
        expected: row.values().to_string(),
        found: value.to_owned(),
    })
}

#[cfg(test)]
mod tests;
