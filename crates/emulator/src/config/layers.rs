//! Reads the layers of the configuration: environment variables and TOML keys are turned into flags, which clap
//! then parses.
//!
//! What a key means is defined in [`super::args`]. This module only knows which keys are lists and which are paths
//! relative to the file.

use super::ServeArgs;
use super::model::ModelChoice;
use super::options::OptionError;
use crate::control::ControlError;
use crate::files;
use clap::{Args, FromArgMatches};
use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::io;
use std::path::{Path, PathBuf};
use toml::Value;

/// Beginning of every environment variable.
const PREFIX: &str = "TS3100_";
/// Variables that other subcommands read.
const OTHER_VARIABLES: [&str; 1] = [crate::control::URL_VARIABLE];
/// Largest configuration file in bytes.
const MAX_FILE: u64 = 1024 * 1024;
/// Deepest nesting of tables under `[options]`: `text.stx` is two.
const MAX_DEPTH: usize = 4;

/// The environment variables of the process, or a test's.
pub type Environment = BTreeMap<OsString, OsString>;

/// Why the configuration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read {}: {reason}", path.display())]
    File {
        /// Which file.
        path: PathBuf,
        /// What the system said.
        reason: io::Error,
    },
    /// The file is no TOML.
    #[error("{}: {reason}", path.display())]
    Toml {
        /// Which file.
        path: PathBuf,
        /// What the TOML parser said, with line and column.
        reason: String,
    },
    /// A key nobody knows.
    #[error("{origin}: unknown key `{key}`; known are {known}")]
    UnknownKey {
        /// File or environment.
        origin: String,
        /// The key.
        key: String,
        /// All that are known.
        known: String,
    },
    /// A value a flag refuses.
    #[error("{origin}: {reason}")]
    Value {
        /// File or variable.
        origin: String,
        /// What was expected and found.
        reason: String,
    },
    /// `--set` without `=`.
    #[error("expected KEY=VALUE after --set, found `{0}`")]
    Pair(String),
    /// A named option.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// The permission file.
    #[error("{}: {reason}", path.display())]
    Permissions {
        /// Which file.
        path: PathBuf,
        /// What is wrong, and in which line.
        reason: String,
    },
    /// The model file.
    #[error("{}: {reason}", path.display())]
    Model {
        /// Which file.
        path: PathBuf,
        /// What is wrong, and in which table.
        reason: String,
    },
    /// The table of points.
    #[error("{}:{reason}", path.display())]
    Points {
        /// Which file.
        path: PathBuf,
        /// Line, column, what was expected and found.
        reason: scol_mini::PointsError,
    },
    /// The control interface.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// Two ways to one serial port.
    #[error("{port} can be reached in one way only: choose {first} or {second}")]
    SerialTwice {
        /// The port.
        port: ts3100_controller::Port,
        /// One flag.
        first: String,
        /// The other.
        second: String,
    },
    /// A fault on the command line.
    #[error("--fault: {0}")]
    Fault(ts3100_controller::faults::FaultError),
    /// Two faults of one number from the start.
    #[error("faults: expected a number of its own for each, found id={0} twice")]
    FaultTwice(u32),
    /// A file of faults.
    #[error(transparent)]
    FaultFile(#[from] crate::faults::FaultFileError),
    /// Flags that would make a controller beside the one of a snapshot.
    #[error("--restore brings the whole controller: expected nothing beside it that makes one, found {0}")]
    Restore(String),
    /// The file of the scenario.
    #[error(transparent)]
    Scenario(#[from] crate::scenario::ScenarioError),
    /// Results of nothing.
    #[error("--junit writes the results of a scenario: expected --scenario FILE too, found none")]
    JunitAlone,
    /// GEN-05.
    #[error("the {0} has no key position INTERNAL (GEN-05): choose --key teaching or --key ext")]
    NoInternal(&'static str),
}

impl From<ts3100_controller::faults::FaultError> for ConfigError {
    fn from(error: ts3100_controller::faults::FaultError) -> ConfigError {
        ConfigError::Fault(error)
    }
}

/// Lays the given flags over the environment, that over the TOML file the two name. The second value is
/// the variables that begin with `TS3100_` and mean nothing here: worth a warning, but a variable of
/// somebody else's may begin so too.
///
/// # Errors
/// See [`ConfigError`].
pub fn read(flags: ServeArgs, environment: &Environment) -> Result<(ServeArgs, Vec<String>), ConfigError> {
    let (from_environment, unknown) = read_environment(environment)?;
    let above = flags.with_fallback(from_environment);
    let merged = match above.config.clone() {
        Some(path) => above.with_fallback(read_file(&path)?),
        None => above,
    };
    Ok((merged, unknown))
}

fn read_environment(environment: &Environment) -> Result<(ServeArgs, Vec<String>), ConfigError> {
    let mut merged = ServeArgs::default();
    let mut unknown = Vec::new();
    let known = known_keys();
    for (name, value) in environment {
        let Some(name) = name.to_str().filter(|name| name.starts_with(PREFIX)) else {
            continue;
        };
        let key = name[PREFIX.len()..].to_ascii_lowercase().replace('_', "-");
        if OTHER_VARIABLES.contains(&name) {
            continue;
        }
        if !known.contains(&key) {
            unknown.push(name.to_owned());
            continue;
        }
        let values = match key.as_str() {
            "load" | "transcript" | "findings" | "coverage" => std::env::split_paths(value)
                .map(PathBuf::into_os_string)
                .collect(),
            "fault" => value.to_string_lossy().split(';').map(OsString::from).collect(),
            "set" | "control-host" => value.to_string_lossy().split(',').map(OsString::from).collect(),
            _ => vec![value.clone()],
        };
        merged = read_key(name, &key, &values)?.with_fallback(merged);
    }
    Ok((merged, unknown))
}

fn read_file(path: &Path) -> Result<ServeArgs, ConfigError> {
    let text = read_text(path)?;
    let table: toml::Table = text.parse().map_err(|error: toml::de::Error| ConfigError::Toml {
        path: path.to_path_buf(),
        reason: error.to_string(),
    })?;
    let origin = path.display().to_string();
    let mut merged = ServeArgs::default();
    let known = known_keys();
    for (key, value) in &table {
        if key == "options" {
            let mut set = Vec::new();
            flatten(&origin, "", value, 0, &mut set)?;
            merged.set.extend(set);
            continue;
        }
        let flag = key.replace('_', "-");
        if !known.contains(&flag) || flag == "config" || flag == "set" {
            let known: Vec<&str> = known
                .iter()
                .map(String::as_str)
                .filter(|key| !["config", "set"].contains(key))
                .collect();
            let known = format!("{}, and the table options", known.join(", "));
            return Err(ConfigError::UnknownKey {
                origin,
                key: key.clone(),
                known,
            });
        }
        let values = match value {
            Value::Array(values) => values
                .iter()
                .map(|value| scalar(&origin, key, value))
                .collect::<Result<_, _>>()?,
            value => vec![scalar(&origin, key, value)?],
        };
        let values: Vec<OsString> = values
            .into_iter()
            .map(|value| resolve_path(path, &flag, value))
            .collect();
        merged = read_key(&origin, &flag, &values)?.with_fallback(merged);
    }
    Ok(merged)
}

/// Paths in the file are seen from the file.
fn resolve_path(file: &Path, flag: &str, value: String) -> OsString {
    match (flag, file.parent()) {
        (
            "drive" | "load" | "permissions" | "points" | "serial-dir" | "transcript" | "findings"
            | "coverage" | "lcov" | "control-token-file" | "faults" | "report" | "scenario" | "junit"
            | "restore" | "snapshot-on-exit",
            Some(directory),
        ) => directory.join(value).into_os_string(),
        // A name is no path.
        ("model", Some(directory)) if matches!(value.parse(), Ok(ModelChoice::File(_))) => {
            directory.join(value).into_os_string()
        }
        _ => value.into(),
    }
}

fn scalar(origin: &str, key: &str, value: &Value) -> Result<String, ConfigError> {
    match value {
        Value::String(text) => Ok(text.clone()),
        Value::Integer(number) => Ok(number.to_string()),
        Value::Float(number) => Ok(number.to_string()),
        Value::Boolean(word) => Ok(word.to_string()),
        Value::Datetime(_) | Value::Array(_) | Value::Table(_) => Err(ConfigError::Value {
            origin: origin.to_owned(),
            reason: format!(
                "{key}: expected a text, a number or true/false, found {}",
                value.type_str()
            ),
        }),
    }
}

fn flatten(
    origin: &str,
    prefix: &str,
    value: &Value,
    depth: usize,
    set: &mut Vec<String>,
) -> Result<(), ConfigError> {
    match value {
        Value::Table(table) if depth < MAX_DEPTH => table.iter().try_for_each(|(key, value)| {
            let name = if prefix.is_empty() {
                key.clone()
            } else {
                format!("{prefix}.{key}")
            };
            flatten(origin, &name, value, depth + 1, set)
        }),
        value if !prefix.is_empty() => {
            set.push(format!("{prefix}={}", scalar(origin, prefix, value)?));
            Ok(())
        }
        value => Err(ConfigError::Value {
            origin: origin.to_owned(),
            reason: format!("options: expected a table, found {}", value.type_str()),
        }),
    }
}

/// Reads one key by the definition of the flags.
fn read_key(origin: &str, key: &str, values: &[OsString]) -> Result<ServeArgs, ConfigError> {
    let wrong = |reason: String| ConfigError::Value {
        origin: origin.to_owned(),
        reason,
    };
    if key == "verbose" {
        let text = values
            .first()
            .map_or(OsStr::new(""), OsString::as_os_str)
            .to_string_lossy()
            .into_owned();
        let count = text
            .parse()
            .map_err(|_| wrong(format!("verbose: expected 0, 1 or 2, found `{text}`")))?;
        return Ok(ServeArgs {
            verbose: count,
            ..ServeArgs::default()
        });
    }
    let arguments = values.iter().map(|value| {
        let mut argument = OsString::from(format!("--{key}="));
        argument.push(value);
        argument
    });
    let matches = serve_command()
        .no_binary_name(true)
        .try_get_matches_from(arguments)
        .map_err(|error| wrong(first_paragraph(&error.to_string())))?;
    ServeArgs::from_arg_matches(&matches).map_err(|error| wrong(first_paragraph(&error.to_string())))
}

fn serve_command() -> clap::Command {
    ServeArgs::augment_args(clap::Command::new("serve").disable_help_flag(true))
}

pub(super) fn known_keys() -> Vec<String> {
    serve_command()
        .get_arguments()
        .filter_map(|argument| argument.get_long().map(str::to_owned))
        .collect()
}

/// The part of clap's message that says what is wrong; usage hints of a command line do not fit a file.
fn first_paragraph(message: &str) -> String {
    let paragraphs: Vec<&str> = message
        .lines()
        .take_while(|line| !line.starts_with("For more"))
        .collect();
    paragraphs
        .join(" ")
        .trim()
        .trim_start_matches("error: ")
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
}

/// The points of a table for this arm.
///
/// # Errors
/// The file cannot be read, or is no such table: file, line, column, what was expected and found.
pub fn read_points(path: &Path, arm: scol_mini::Arm) -> Result<Vec<scol_mini::TaughtPoint>, ConfigError> {
    let text = read_text(path)?;
    scol_mini::parse_points(&text, arm).map_err(|reason| ConfigError::Points {
        path: path.to_path_buf(),
        reason,
    })
}

/// A small text file.
pub(super) fn read_text(path: &Path) -> Result<String, ConfigError> {
    files::read_text(path, MAX_FILE).map_err(|reason| ConfigError::File {
        path: path.to_path_buf(),
        reason,
    })
}
