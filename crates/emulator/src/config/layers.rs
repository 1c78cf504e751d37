//! Reads the layers of the configuration: environment variables and TOML keys are turned into flags, which clap
//! then parses.
//!
//! What a key means is defined in [`super::args`]. This module only knows which keys are lists and which are paths
//! relative to the file.

use super::ServeArgs;
use super::error::{ConfigError, read_text};
use super::exported;
use super::model::ModelChoice;
use clap::{Args, FromArgMatches};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Prefix of the environment variables that set flags.
pub(super) const PREFIX: &str = "TS3100_";
/// Deepest nesting of tables under `[options]`; `text.stx` needs two levels.
const MAX_DEPTH: usize = 4;

/// Environment variables by name: those of the process, or those of a test.
pub type Environment = BTreeMap<OsString, OsString>;

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
        if exported::is_exported(name) {
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
    let table: Table = text
        .parse()
        .map_err(|error: toml::de::Error| ConfigError::invalid(path.display(), error))?;
    let origin = path.display().to_string();
    let mut merged = ServeArgs::default();
    let known = known_keys();
    for (key, value) in &table {
        if key == "options" {
            let table = value.as_table().ok_or_else(|| {
                let reason = format!("options: expected a table, found {}", value.type_str());
                ConfigError::invalid(&origin, reason)
            })?;
            merged.set.extend(flatten(&origin, "", table, 1)?);
            continue;
        }
        let flag = key.replace('_', "-");
        if !known.contains(&flag) || flag == "config" || flag == "set" {
            let known = known.iter().map(String::as_str);
            let known: Vec<&str> = known.filter(|key| !["config", "set"].contains(key)).collect();
            let known = format!("{}, and the table options", known.join(", "));
            return Err(ConfigError::invalid(
                origin,
                format!("unknown key `{key}`; known are {known}"),
            ));
        }
        let values = value
            .as_array()
            .map_or(std::slice::from_ref(value), Vec::as_slice);
        let values = values.iter().map(|value| scalar(&origin, key, value));
        let values = values.map(|value| Ok(resolve_path(path, &flag, value?)));
        let values: Vec<OsString> = values.collect::<Result<_, ConfigError>>()?;
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
        Value::Datetime(_) | Value::Array(_) | Value::Table(_) => {
            let found = value.type_str();
            let reason = format!("{key}: expected a text, a number or true/false, found {found}");
            Err(ConfigError::invalid(origin, reason))
        }
    }
}

/// The values of a table and of the tables in it as `key=value`; keys of nested tables are joined by dots.
fn flatten(origin: &str, prefix: &str, table: &Table, depth: usize) -> Result<Vec<String>, ConfigError> {
    let mut pairs = Vec::new();
    for (key, value) in table {
        let name = format!("{prefix}{key}");
        match value.as_table().filter(|_| depth < MAX_DEPTH) {
            Some(table) => pairs.extend(flatten(origin, &format!("{name}."), table, depth + 1)?),
            None => pairs.push(format!("{name}={}", scalar(origin, &name, value)?)),
        }
    }
    Ok(pairs)
}

/// Parses the values of one key as the flag of that name.
fn read_key(origin: &str, key: &str, values: &[OsString]) -> Result<ServeArgs, ConfigError> {
    let wrong = |reason: String| ConfigError::invalid(origin, reason);
    if key == "verbose" {
        let text = values.first().cloned().unwrap_or_default();
        let text = text.to_string_lossy();
        let verbose = text
            .parse()
            .map_err(|_| wrong(format!("verbose: expected 0, 1 or 2, found `{text}`")))?;
        return Ok(ServeArgs {
            verbose,
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
        .try_get_matches_from(arguments);
    matches
        .and_then(|matches| ServeArgs::from_arg_matches(&matches))
        .map_err(|error| wrong(first_paragraph(&error.to_string())))
}

pub(super) fn serve_command() -> clap::Command {
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
    let paragraph = message.trim_start().trim_start_matches("error: ").lines();
    let paragraph = paragraph.take_while(|line| !line.starts_with("For more"));
    let words: Vec<&str> = paragraph.flat_map(str::split_whitespace).collect();
    words.join(" ")
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
