//! Reads the layers of the configuration: environment variables and TOML keys are turned into flags, which clap
//! then parses.
//!
//! [`super::args`] defines what a key means, which keys are lists, and which name files.

use super::ServeArgs;
use super::args::{RobotTable, WireTable};
use super::error::{ConfigError, line_after, read_text};
use super::exported;
use super::flag_group::{Flag, Mark};
use super::options::set_pair;
use clap::Args as _;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use std::collections::BTreeMap;
use std::error::Error as _;
use std::ffi::OsString;
use std::path::Path;
use toml::de::DeTable;
use toml::{Table, Value};
use ts3100_controller::faults::Fault;
use ts3100_controller::{Dialect, Options};
use ts3100_driver::tcp::LinkOptions;
use ts3100_proto::words::did_you_mean;
use ts3100_recording::scenario::is_program;

/// Prefix of the environment variables that set flags.
const PREFIX: &str = "TS3100_";
/// Deepest nesting of tables under `[options]`; `text.stx` needs two levels.
const MAX_DEPTH: usize = 4;

/// Keys whose values are refused only when they are used: the places of these are kept.
const PLACED: [&str; 3] = ["load", "select", "model"];

/// Environment variables by name: those of the process, or those of a test.
pub type Environment = BTreeMap<OsString, OsString>;

/// The variables of the process that may be settings.
pub fn environment() -> Environment {
    let is_ours = |name: &OsString| name.as_encoded_bytes().starts_with(PREFIX.as_bytes());
    std::env::vars_os().filter(|(name, _)| is_ours(name)).collect()
}

/// Merges flags over environment over the TOML file that either of them names. The second value is a warning for each
/// unknown variable with the prefix `TS3100_`: another program may use the prefix too.
///
/// # Errors
/// See [`ConfigError`].
pub fn read(flags: ServeArgs, environment: &Environment) -> Result<(ServeArgs, Vec<String>), ConfigError> {
    let (from_environment, unknown) = read_environment(environment)?;
    let above = flags.with_fallback(from_environment);
    let merged = match above.files.config.clone() {
        Some(path) => above.with_fallback(read_file(&path)?),
        None => above,
    };
    Ok((merged, unknown))
}

fn read_environment(environment: &Environment) -> Result<(ServeArgs, Vec<String>), ConfigError> {
    let mut merged = ServeArgs::default();
    let mut unknown = Vec::new();
    for (name, value) in environment {
        let Some(name) = name.to_str().filter(|name| name.starts_with(PREFIX)) else {
            continue;
        };
        let key = name[PREFIX.len()..].to_ascii_lowercase().replace('_', "-");
        if exported::is_exported(name) {
            continue;
        }
        match ServeArgs::flags().find(|flag| flag.key() == key) {
            Some(flag) => merged = read_key(name, &key, &flag.split(value))?.with_fallback(merged),
            None => unknown.push(unknown_variable(name)),
        }
    }
    Ok((merged, unknown))
}

fn unknown_variable(name: &str) -> String {
    let variables: Vec<String> = ServeArgs::flags().map(|flag| variable(&flag.key())).collect();
    let hint = did_you_mean(name, variables.iter().map(String::as_str));
    format!("ignoring unknown environment variable {name}{hint}")
}

/// The environment variable of a flag of `serve`.
pub fn variable(flag: &str) -> String {
    format!("{PREFIX}{}", flag.to_ascii_uppercase().replace('-', "_"))
}

/// A file and the line of a key in it; a key of a nested table has dots.
fn place(path: &Path, text: &str, key: &str) -> String {
    let table = DeTable::parse(text).ok();
    let start = table.and_then(|table| start_of(table.get_ref(), key));
    line_after(path, text.get(..start.unwrap_or_default()).unwrap_or_default())
}

/// Where a key begins in the text.
fn start_of(table: &DeTable<'_>, key: &str) -> Option<usize> {
    table.iter().find_map(|(known, value)| {
        let inner = match key.strip_prefix(known.get_ref().as_ref())? {
            "" => None,
            inner => Some(inner.strip_prefix('.')?),
        };
        inner.map_or(Some(known.span().start), |inner| {
            start_of(value.get_ref().as_table()?, inner)
        })
    })
}

fn read_file(path: &Path) -> Result<ServeArgs, ConfigError> {
    let text = read_text(path)?;
    let mut table: Table = text.parse().map_err(|error| match is_program(&text) {
        true => ConfigError::invalid(
            path.display(),
            "this is a SCOL program, not a configuration: load it with `--load`",
        ),
        false => ConfigError::toml(path, &text, &error),
    })?;
    let robots = fleet_tables(path, &mut table, "robot")?;
    let wires = fleet_tables(path, &mut table, "wire")?;
    let mut merged = read_keys(path, &table, false, |key| place(path, &text, key))?;
    // An unknown key comes before a missing one: it may be the missing one, misspelled.
    for (origin, mut table) in robots {
        let name = table.remove("name");
        let name = name.map(|value| scalar(&origin, "name", &value)).transpose()?;
        let place = match &name {
            Some(name) => format!("{origin} ({name})"),
            None => origin.clone(),
        };
        let args = read_keys(path, &table, true, |_| place.clone())?;
        let name = name.ok_or_else(|| missing_key(&origin, "name"))?;
        merged.robot_tables.push(RobotTable { name, args });
    }
    for (origin, mut table) in wires {
        let known = ["from", "to"];
        if let Some(key) = table.keys().find(|key| !known.contains(&key.as_str())) {
            let hint = did_you_mean(key, known);
            return Err(ConfigError::invalid(origin, format!("unknown key `{key}`{hint}")));
        }
        let (from, to) = (
            text_of(&origin, &mut table, "from")?,
            text_of(&origin, &mut table, "to")?,
        );
        merged.wires.push(WireTable { origin, from, to });
    }
    Ok(merged)
}

/// The tables `[[key]]` of a file, each with its place.
fn fleet_tables(path: &Path, table: &mut Table, key: &str) -> Result<Vec<(String, Table)>, ConfigError> {
    let wrong = || {
        let reason = format!("{key}: expected tables [[{key}]]");
        ConfigError::invalid(path.display(), reason)
    };
    let Some(value) = table.remove(key) else {
        return Ok(Vec::new());
    };
    let Value::Array(values) = value else {
        return Err(wrong());
    };
    let tables = (1..).zip(values).map(|(number, value)| {
        let table = value.try_into().map_err(|_| wrong())?;
        Ok((format!("{}, [[{key}]] {number}", path.display()), table))
    });
    tables.collect()
}

/// A text that a table must have.
fn text_of(origin: &str, table: &mut Table, key: &str) -> Result<String, ConfigError> {
    let value = table.remove(key);
    let value = value.ok_or_else(|| missing_key(origin, key))?;
    scalar(origin, key, &value)
}

fn missing_key(origin: &str, key: &str) -> ConfigError {
    ConfigError::invalid(origin, format!("the key `{key}` is missing"))
}

/// Reads the keys of a table of the file.
fn read_keys(
    path: &Path,
    table: &Table,
    is_robot: bool,
    origin_of: impl Fn(&str) -> String,
) -> Result<ServeArgs, ConfigError> {
    let mut merged = ServeArgs::default();
    for (key, value) in table {
        let origin = origin_of(key);
        if key == "options" {
            let table = value.as_table().ok_or_else(|| {
                let reason = format!("options: expected a table, found {}", value.type_str());
                ConfigError::invalid(&origin, reason)
            })?;
            for pair in flatten(&origin, "", table, 1)? {
                let name = pair.split('=').next().unwrap_or_default();
                check_option(&origin_of(&format!("options.{name}")), &pair)?;
                merged.robot.set.push(pair);
            }
            continue;
        }
        let name = key.replace('_', "-");
        let flag = ServeArgs::keys_of_file()
            .find(|flag| flag.key() == name)
            .ok_or_else(|| {
                let known: Vec<String> = match is_robot {
                    true => ServeArgs::keys_of_robot().map(Flag::key).collect(),
                    false => ServeArgs::keys_of_file().map(Flag::key).collect(),
                };
                let others: &[&str] = if is_robot { &["name"] } else { &["robot", "wire"] };
                let keys = known.iter().map(String::as_str).chain(["options"]);
                let hint = did_you_mean(&name, keys.chain(others.iter().copied()));
                ConfigError::invalid(&origin, format!("unknown key `{key}`{hint}"))
            })?;
        if is_robot && flag.is(Mark::Process) {
            let reason = format!("`{key}` is for the whole process: put it above the first [[robot]]");
            return Err(ConfigError::invalid(origin, reason));
        }
        let values = value
            .as_array()
            .map_or(std::slice::from_ref(value), Vec::as_slice);
        let values = values
            .iter()
            .map(|value| scalar(&origin, key, value).map(OsString::from));
        let values: Vec<OsString> = values.collect::<Result<_, ConfigError>>()?;
        let mut args = read_key(&origin, &name, &values)?;
        for spec in &args.variation.fault {
            let fault = spec.parse::<Fault>();
            fault.map_err(|reason| ConfigError::invalid(&origin, format!("{key}: {reason}")))?;
        }
        args.resolve(path);
        if let Some(known) = PLACED.into_iter().find(|known| *known == name) {
            args.places.insert(known, origin);
        }
        merged = args.with_fallback(merged);
    }
    Ok(merged)
}

fn scalar(origin: &str, key: &str, value: &Value) -> Result<String, ConfigError> {
    match value {
        Value::String(text) => Ok(text.clone()),
        Value::Integer(number) => Ok(number.to_string()),
        Value::Float(number) => Ok(number.to_string()),
        Value::Boolean(word) => Ok(word.to_string()),
        Value::Datetime(_) | Value::Array(_) | Value::Table(_) => {
            let found = value.type_str();
            let reason = format!("{key}: expected a string, a number or true/false, found {found}");
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
        let mut args = ServeArgs::default();
        args.log.verbose = text
            .parse()
            .map_err(|_| wrong(format!("verbose: expected 0, 1 or 2, found `{text}`")))?;
        return Ok(args);
    }
    let arguments = values.iter().map(|value| {
        let mut argument = OsString::from(format!("--{key}="));
        argument.push(value);
        argument
    });
    let arguments: Vec<OsString> = arguments.collect();
    let args = ServeArgs::from_words(&arguments).map_err(|error| wrong(value_message(key, &error)))?;
    args.robot
        .set
        .iter()
        .try_for_each(|pair| check_option(origin, pair))?;
    Ok(args)
}

/// Checks an option where its place is known.
fn check_option(origin: &str, pair: &str) -> Result<(), ConfigError> {
    let mut options = Options::for_dialect(Dialect::default());
    let set = set_pair(&mut options, &mut LinkOptions::default(), pair);
    set.map_err(|error| ConfigError::invalid(origin, error))
}

/// Describes an error in a value. The words of clap are about a command line, not about a file or a variable.
fn value_message(key: &str, error: &clap::Error) -> String {
    if error.kind() == ErrorKind::InvalidUtf8 {
        return format!("{key}: expected text in UTF-8");
    }
    let found = match error.get(ContextKind::InvalidValue) {
        Some(ContextValue::String(found)) => found,
        _ => return first_paragraph(&error.to_string()),
    };
    match (error.get(ContextKind::ValidValue), error.source()) {
        // Of the values that are no words of a list, only a path must not be empty.
        (Some(ContextValue::Strings(words)), _) if words.is_empty() => {
            format!("{key}: expected a path, found `{found}`")
        }
        (Some(ContextValue::Strings(words)), _) => {
            let hint = did_you_mean(found, words.iter().map(String::as_str));
            format!("{key}: expected {}, found `{found}`{hint}", words.join(", "))
        }
        (_, Some(reason)) if reason.to_string().contains(found.as_str()) => format!("{key}: {reason}"),
        (_, Some(reason)) => format!("{key}: cannot use `{found}`: {reason}"),
        _ => first_paragraph(&error.to_string()),
    }
}

pub(super) fn serve_command() -> clap::Command {
    ServeArgs::augment_args(clap::Command::new("serve").disable_help_flag(true))
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
