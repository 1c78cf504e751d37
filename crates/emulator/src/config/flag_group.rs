//! Flags in groups: those under one heading of the help are one struct, and a command line that has none of them is read
//! without their definition. Building all definitions takes longer than everything else a robot starts with.

use clap::{ArgMatches, Command};
use std::ffi::OsString;

/// A value that may be given in several layers of the configuration.
pub trait Layered {
    /// This value if it is given, otherwise that of the layer below.
    #[must_use]
    fn or_below(self, below: Self) -> Self;
}

impl<T> Layered for Option<T> {
    fn or_below(self, below: Option<T>) -> Option<T> {
        self.or(below)
    }
}

impl<T> Layered for Vec<T> {
    fn or_below(self, below: Vec<T>) -> Vec<T> {
        if self.is_empty() { below } else { self }
    }
}

/// Number of times that a flag was given.
impl Layered for u8 {
    fn or_below(self, below: u8) -> u8 {
        if self == 0 { below } else { self }
    }
}

/// The flags under one heading.
pub trait FlagGroup {
    /// Whether one of its flags is among these words. It may say so of a value that looks like a flag.
    fn is_in(&self, words: &[OsString]) -> bool;

    /// Adds its flags to a command.
    fn define(&self, command: Command) -> Command;

    /// Takes the values of its flags.
    ///
    /// # Errors
    /// As [`clap::FromArgMatches`].
    fn take(&mut self, matches: &ArgMatches) -> Result<(), clap::Error>;
}

/// Reads these words by the definitions of the groups whose flags they have. The other groups stay as they are.
///
/// # Errors
/// An error in the words; a flag of none of the groups, `--help` too.
pub fn read<const N: usize>(words: &[OsString], groups: [&mut dyn FlagGroup; N]) -> Result<(), clap::Error> {
    let given = groups.into_iter().filter(|group| group.is_in(words));
    let given: Vec<&mut dyn FlagGroup> = given.collect();
    let command = Command::new("serve").disable_help_flag(true).no_binary_name(true);
    let command = given.iter().fold(command, |command, group| group.define(command));
    let matches = command.try_get_matches_from(words)?;
    given.into_iter().try_for_each(|group| group.take(&matches))
}

/// Whether a word is the flag of this field, `--like-this` or `--like-this=VALUE`, or one of a single letter.
pub(super) fn is_flag(word: &OsString, field: &str) -> bool {
    let word = word.as_encoded_bytes();
    let Some(name) = word.strip_prefix(b"--") else {
        return word.starts_with(b"-");
    };
    let name = name.split(|byte| *byte == b'=').next().unwrap_or_default();
    let dashed = |byte: u8| if byte == b'_' { b'-' } else { byte };
    name.iter().copied().eq(field.bytes().map(dashed))
}

/// Defines the struct of a group: fields and attributes as those of a struct that derives [`clap::Args`].
macro_rules! flag_group {
    ($(#[$of_group:meta])* pub struct $group:ident {
        $($(#[$of_field:meta])* pub $field:ident: $value:ty,)*
    }) => {
        #[derive(Debug, Clone, Default, clap::Args)]
        $(#[$of_group])*
        pub struct $group {
            $($(#[$of_field])* pub $field: $value,)*
        }

        impl $crate::config::flag_group::Layered for $group {
            fn or_below(self, below: $group) -> $group {
                $group {
                    $($field: $crate::config::flag_group::Layered::or_below(self.$field, below.$field),)*
                }
            }
        }

        impl $crate::config::flag_group::FlagGroup for $group {
            fn is_in(&self, words: &[std::ffi::OsString]) -> bool {
                let fields = [$(stringify!($field)),*];
                words
                    .iter()
                    .any(|word| fields.iter().any(|field| $crate::config::flag_group::is_flag(word, field)))
            }

            fn define(&self, command: clap::Command) -> clap::Command {
                <$group as clap::Args>::augment_args(command)
            }

            fn take(&mut self, matches: &clap::ArgMatches) -> Result<(), clap::Error> {
                *self = <$group as clap::FromArgMatches>::from_arg_matches(matches)?;
                Ok(())
            }
        }
    };
}

pub(super) use flag_group;
