//! Reads the layers of the configuration: environment variables and TOML keys are turned into flags, which clap
//! then parses.
//!
//! What a key means is defined in [`super::args`]. This module only knows which keys are lists and which are paths
//! relative to the file.

use super::ServeArgs;
use super::model::ModelChoice;
use super::options::OptionError;
use clap::{Args, FromArgMatches};
use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::io;
use std::path::{Path, PathBuf};
use toml::Value;
use ts3100_control::ControlError;
use ts3100_driver::files;

/// Prefix of the environment variables that set flags.
const PREFIX: &str = "TS3100_";
/// Variables with the prefix that other subcommands read; they cause no warning.
const OTHER_VARIABLES: [&str; 1] = [ts3100_control::URL_VARIABLE];
/// Largest configuration file in bytes.
const MAX_FILE: u64 = 1024 * 1024;
/// Deepest nesting of tables under `[options]`; `text.stx` needs two levels.
const MAX_DEPTH: usize = 4;

/// Environment variables by name: those of the process, or those of a test.
pub type Environment = BTreeMap<OsString, OsString>;

/// Why the configuration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read {}: {reason}", path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// The error of the operating system.
        reason: io::Error,
    },
    /// The file is not TOML.
    #[error("{}: {reason}", path.display())]
    Toml {
        /// Path of the file.
        path: PathBuf,
        /// The message of the TOML parser, with line and column.
        reason: String,
    },
    /// A key that is not a flag of `serve`.
    #[error("{origin}: unknown key `{key}`; known are {known}")]
    UnknownKey {
        /// The file or variable with the key.
        origin: String,
        /// The key as written.
        key: String,
        /// The known keys, separated by commas.
        known: String,
    },
    /// A value that the flag does not accept.
    #[error("{origin}: {reason}")]
    Value {
        /// The file or variable with the value.
        origin: String,
        /// What was expected and found.
        reason: String,
    },
    /// `--set` without `=`.
    #[error("expected KEY=VALUE after --set, found `{0}`")]
    Pair(String),
    /// A named option is unknown or its value does not fit.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// The permission tables are not valid.
    #[error("{}: {reason}", path.display())]
    Permissions {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong, and in which line.
        reason: String,
    },
    /// The arm model is not valid.
    #[error("{}: {reason}", path.display())]
    Model {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong, and in which table.
        reason: String,
    },
    /// The table of points is not valid.
    #[error("{}:{reason}", path.display())]
    Points {
        /// Path of the file.
        path: PathBuf,
        /// Line, column, what was expected and found.
        reason: scol_mini::PointsError,
    },
    /// The settings of the control interface are not valid.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// Two ways to one serial port.
    #[error("{port} can be reached in one way only: choose {first} or {second}")]
    SerialTwice {
        /// HOST or COM1.
        port: ts3100_controller::Port,
        /// The first flag given for the port.
        first: String,
        /// The second flag given for the port.
        second: String,
    },
    /// A fault on the command line is not valid.
    #[error("--fault: {0}")]
    Fault(ts3100_controller::faults::FaultError),
    /// Two faults have the same number.
    #[error("faults: expected a number of its own for each, found id={0} twice")]
    FaultTwice(u32),
    /// A file of faults is not valid.
    #[error(transparent)]
    FaultFile(#[from] ts3100_recording::faults::FaultFileError),
    /// `--restore` together with flags that configure the controller.
    #[error("--restore brings the whole controller: expected nothing beside it that makes one, found {0}")]
    Restore(String),
    /// The scenario is not valid.
    #[error(transparent)]
    Scenario(#[from] ts3100_recording::scenario::ScenarioError),
    /// `--junit` without a scenario.
    #[error("--junit writes the results of a scenario: expected --scenario FILE too, found none")]
    JunitAlone,
    /// Key position INTERNAL on a controller that does not have it (GEN-05).
    #[error("the {0} has no key position INTERNAL (GEN-05): choose --key teaching or --key ext")]
    NoInternal(&'static str),
}

impl From<ts3100_controller::faults::FaultError> for ConfigError {
    fn from(error: ts3100_controller::faults::FaultError) -> ConfigError {
        ConfigError::Fault(error)
    }
}

/// Merges flags over environment over the TOML file that either of them names. The second value lists unknown variables
/// with the prefix `TS3100_`. They deserve a warning only, because another program may use the prefix too.
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

#[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
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

/// Makes a path in the TOML file relative to the directory of that file.
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

#[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
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

/// Parses the values of one key as the flag of that name.
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

/// The part of clap's message that names the error. Its usage hints are about a command line, not a file.
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

/// Reads a CSV table of taught points for this arm.
///
/// # Errors
/// The file cannot be read or is not such a table, with line and column.
pub fn read_points(path: &Path, arm: scol_mini::Arm) -> Result<Vec<scol_mini::TaughtPoint>, ConfigError> {
    let text = read_text(path)?;
    scol_mini::parse_points(&text, arm).map_err(|reason| ConfigError::Points {
        path: path.to_path_buf(),
        reason,
    })
}

/// Reads a text file of at most [`MAX_FILE`] bytes.
pub(super) fn read_text(path: &Path) -> Result<String, ConfigError> {
    files::read_text(path, MAX_FILE).map_err(|reason| ConfigError::File {
        path: path.to_path_buf(),
        reason,
    })
}
