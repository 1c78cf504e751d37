//! Flags in groups: those under one heading of the help are one struct, and a command line that has none of them is read
//! without their definition. Building all definitions takes longer than everything else a robot starts with.
//!
//! The definition of a flag says all that other modules ask about it: its type, whether it is a list and names files; a
//! [`Mark`] after the type, what no type says.

use super::args::{ListenAt, LogFormat, PortSource};
use super::model::ModelChoice;
use super::seed::Seed;
use clap::{ArgMatches, Command};
use std::ffi::{OsStr, OsString};
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use ts3100_control::ControlChoice;
use ts3100_controller::{ControlRight, ControllerType, Dialect, KeySwitch};
use ts3100_driver::clock::{TimeGap, TimeMode};
use ts3100_recording::reports::{Deny, FindingsFormat};
use ts3100_recording::transcript::TranscriptFile;

/// Facts about a flag beyond its type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// Belongs to the process, not to a robot.
    Process,
    /// Several robots may use the same file: it is only read, or has the state of each.
    Shared,
    /// A device of the computer; its name is not relative to a file.
    Device,
    /// Not a key of the file: it is the file, or a table there has its values.
    NotInFile,
    /// The environment variable has `;` between the values, because they have commas.
    Semicolons,
}

/// Separator of the values in an environment variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Separator {
    /// That of the variable `PATH`.
    OfPaths,
    Char(char),
}

/// One flag.
#[derive(Debug)]
pub struct Flag {
    field: &'static str,
    marks: &'static [Mark],
    separator: Option<Separator>,
}

impl Flag {
    /// A flag by its field of this type.
    pub(super) const fn new<V: FlagValue>(field: &'static str, marks: &'static [Mark]) -> Flag {
        let separator = match (V::IS_LIST, V::HAS_PATHS, marks) {
            (false, _, _) => None,
            (true, true, _) => Some(Separator::OfPaths),
            (true, false, [Mark::Semicolons]) => Some(Separator::Char(';')),
            (true, false, _) => Some(Separator::Char(',')),
        };
        Flag {
            field,
            marks,
            separator,
        }
    }

    /// Its name on the command line and in the file.
    pub fn key(&self) -> String {
        self.field.replace('_', "-")
    }

    /// Whether it is marked so.
    pub fn is(&self, mark: Mark) -> bool {
        self.marks.contains(&mark)
    }

    /// Values of its environment variable.
    pub fn split(&self, value: &OsStr) -> Vec<OsString> {
        match self.separator {
            None => vec![value.to_owned()],
            Some(Separator::OfPaths) => std::env::split_paths(value)
                .map(PathBuf::into_os_string)
                .collect(),
            Some(Separator::Char(separator)) => {
                let value = value.to_string_lossy();
                value.split(separator).map(OsString::from).collect()
            }
        }
    }

    /// Whether a word is this flag, `--like-this` or `--like-this=VALUE`, or one of a single letter.
    fn is_word(&self, word: &OsStr) -> bool {
        let word = word.as_encoded_bytes();
        let Some(name) = word.strip_prefix(b"--") else {
            return word.starts_with(b"-");
        };
        let name = name.split(|byte| *byte == b'=').next().unwrap_or_default();
        let dashed = |byte: u8| if byte == b'_' { b'-' } else { byte };
        name.iter().copied().eq(self.field.bytes().map(dashed))
    }
}

/// A value that may be given in several layers of the configuration.
pub trait FlagValue: Sized {
    /// Whether it has several.
    const IS_LIST: bool = false;
    /// Whether files or devices are named in it.
    const HAS_PATHS: bool = false;

    /// This value if it is given, otherwise that of the layer below.
    #[must_use]
    fn or_below(self, below: Self) -> Self;

    /// The files or devices.
    fn paths(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        std::iter::empty()
    }
}

/// One value of a flag. A new type does not compile until it says whether it names a file.
pub trait OneValue {
    /// Whether it may.
    const IS_PATH: bool = true;

    /// The file or device, if it names one.
    fn path(&mut self) -> Option<&mut PathBuf>;
}

impl<T: OneValue> FlagValue for Option<T> {
    const HAS_PATHS: bool = T::IS_PATH;

    fn or_below(self, below: Option<T>) -> Option<T> {
        self.or(below)
    }

    fn paths(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        self.iter_mut().filter_map(T::path)
    }
}

impl<T: OneValue> FlagValue for Vec<T> {
    const IS_LIST: bool = true;
    const HAS_PATHS: bool = T::IS_PATH;

    fn or_below(self, below: Vec<T>) -> Vec<T> {
        if self.is_empty() { below } else { self }
    }

    fn paths(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        self.iter_mut().filter_map(T::path)
    }
}

/// Number of times that a flag was given.
impl FlagValue for u8 {
    fn or_below(self, below: u8) -> u8 {
        if self == 0 { below } else { self }
    }
}

impl OneValue for PathBuf {
    fn path(&mut self) -> Option<&mut PathBuf> {
        Some(self)
    }
}

impl OneValue for TranscriptFile {
    fn path(&mut self) -> Option<&mut PathBuf> {
        Some(&mut self.path)
    }
}

impl OneValue for ModelChoice {
    fn path(&mut self) -> Option<&mut PathBuf> {
        self.path_mut()
    }
}

macro_rules! no_paths {
    ($($value:ty)*) => {$(
        impl OneValue for $value {
            const IS_PATH: bool = false;

            fn path(&mut self) -> Option<&mut PathBuf> {
                None
            }
        }
    )*};
}

no_paths! {
    bool u16 u32 u64 f64 String IpAddr
    ControlChoice ControlRight ControllerType Deny Dialect FindingsFormat KeySwitch ListenAt LogFormat PortSource Seed
    TimeGap TimeMode
}

/// The flags under one heading.
pub trait FlagGroup {
    /// Its flags, in the order of their definition.
    fn flags(&self) -> &'static [Flag];

    /// Adds its flags to a command.
    fn define(&self, command: Command) -> Command;

    /// Takes the values of its flags.
    ///
    /// # Errors
    /// As [`clap::FromArgMatches`].
    fn take(&mut self, matches: &ArgMatches) -> Result<(), clap::Error>;

    /// The files and devices of its flags.
    fn paths(&mut self) -> Vec<(&'static Flag, &mut PathBuf)>;

    /// Makes its files relative to the directory of the file that names them.
    fn resolve(&mut self, file: &Path) {
        let Some(directory) = file.parent() else {
            return;
        };
        for (flag, path) in self.paths() {
            if !flag.is(Mark::Device) {
                *path = directory.join(&*path);
            }
        }
    }
}

/// Reads these words by the definitions of the groups whose flags they have: a value that looks like a flag may bring a
/// further group in. The other groups stay as they are.
///
/// # Errors
/// An error in the words; a flag of none of the groups, `--help` too.
pub fn read<const N: usize>(words: &[OsString], groups: [&mut dyn FlagGroup; N]) -> Result<(), clap::Error> {
    let is_given = |flag: &Flag| words.iter().any(|word| flag.is_word(word));
    let given = groups
        .into_iter()
        .filter(|group| group.flags().iter().any(is_given));
    let given: Vec<&mut dyn FlagGroup> = given.collect();
    let command = Command::new("serve").disable_help_flag(true).no_binary_name(true);
    let command = given.iter().fold(command, |command, group| group.define(command));
    let matches = command.try_get_matches_from(words)?;
    given.into_iter().try_for_each(|group| group.take(&matches))
}

/// Defines the struct of a group: fields and attributes as those of a struct that derives [`clap::Args`], and after the
/// type of a field the [`Mark`]s of the flag: `Option<PathBuf> [Shared]`.
macro_rules! flag_group {
    ($(#[$of_group:meta])* pub struct $group:ident {
        $($(#[$of_field:meta])* pub $field:ident: $value:ty $([$($mark:ident),*])?,)*
    }) => {
        #[derive(Debug, Clone, Default, clap::Args)]
        $(#[$of_group])*
        pub struct $group {
            $($(#[$of_field])* pub $field: $value,)*
        }

        impl $group {
            /// These values; those not given are taken from the layer below.
            #[must_use]
            pub fn or_below(self, below: $group) -> $group {
                $group {
                    $($field: $crate::config::flag_group::FlagValue::or_below(self.$field, below.$field),)*
                }
            }
        }

        impl $crate::config::flag_group::FlagGroup for $group {
            fn flags(&self) -> &'static [$crate::config::flag_group::Flag] {
                const FLAGS: &[$crate::config::flag_group::Flag] = &[$(
                    $crate::config::flag_group::Flag::new::<$value>(
                        stringify!($field),
                        &[$($($crate::config::flag_group::Mark::$mark),*)?],
                    ),
                )*];
                FLAGS
            }

            fn define(&self, command: clap::Command) -> clap::Command {
                <$group as clap::Args>::augment_args(command)
            }

            fn take(&mut self, matches: &clap::ArgMatches) -> Result<(), clap::Error> {
                *self = <$group as clap::FromArgMatches>::from_arg_matches(matches)?;
                Ok(())
            }

            fn paths(&mut self) -> Vec<(&'static $crate::config::flag_group::Flag, &mut std::path::PathBuf)> {
                let mut flags = self.flags().iter();
                let mut paths = Vec::new();
                $(if let Some(flag) = flags.next() {
                    let of_flag = $crate::config::flag_group::FlagValue::paths(&mut self.$field);
                    paths.extend(of_flag.map(|path| (flag, path)));
                })*
                paths
            }
        }
    };
}

pub(super) use flag_group;
