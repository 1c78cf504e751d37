//! The keys of the configuration file as data, and as a JSON schema for editors. Everything follows from the definition of
//! the flags in [`super::args`] and from the table of options. The schemas of the other files that people write are in
//! [`scenario`] and [`faults`].

pub mod faults;
pub mod scenario;

use super::ServeArgs;
use super::layers::serve_command;
pub use super::layers::variable;
use super::options::{OPTIONS, Values};
use clap::{Arg, ArgAction};
use serde_json::{Map, Value, json};
use std::any::TypeId;
use std::path::PathBuf;
use ts3100_controller::Dialect;

/// The dialect of the schemas.
const DRAFT: &str = "https://json-schema.org/draft/2020-12/schema";
/// Pattern of a duration with its unit.
const DURATION: &str = r"^([0-9]+\.?[0-9]*|\.[0-9]+)\s*(us|ms|s|min)\s*$";
/// Pattern of the value of `drive.open_mode`.
const OPEN_MODES: &str = "^[0-2]([ ,]+[0-2]){3}$";

/// The values of a key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Kind {
    /// `true` or `false`.
    Flag,
    /// A whole number from 0 to this.
    Whole(u64),
    /// A number.
    Number,
    /// One of these words.
    Words(Vec<String>),
    /// A text.
    Text,
    /// A text that may be a bare number, as a port.
    TextOrNumber,
}

/// A key of the configuration file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    /// Its name, also that of the flag.
    pub name: String,
    /// The environment variable.
    pub variable: String,
    /// Values that it accepts.
    pub kind: Kind,
    /// Whether it takes a list, too.
    pub is_list: bool,
    /// Help text.
    pub help: String,
    /// The default; `None` if there is none.
    pub default: Option<String>,
}

/// Every key of the configuration file but the table `options`, in the order of `serve --help`.
pub fn keys() -> Vec<Key> {
    let command = serve_command();
    let keys = command.get_arguments().filter_map(key);
    let is_in_file = |key: &Key| ServeArgs::keys_of_file().any(|flag| flag.key() == key.name);
    keys.filter(is_in_file).collect()
}

fn key(argument: &Arg) -> Option<Key> {
    let name = argument.get_long()?.to_owned();
    let help = argument.get_help().map(ToString::to_string).unwrap_or_default();
    let (help, default) = split_default(&help);
    Some(Key {
        variable: variable(&name),
        kind: kind(argument),
        is_list: matches!(argument.get_action(), ArgAction::Append)
            || argument
                .get_num_args()
                .is_some_and(|count| count.max_values() > 1),
        help,
        default,
        name,
    })
}

/// A help text without its `[default: VALUE]`, and the value.
pub fn split_default(help: &str) -> (String, Option<String>) {
    let Some((before, rest)) = help.split_once("[default: ") else {
        return (help.trim().to_owned(), None);
    };
    let (default, after) = rest.split_once(']').unwrap_or((rest, ""));
    let help = format!("{} {}", before.trim(), after.trim());
    (help.trim().to_owned(), Some(default.to_owned()))
}

fn kind(argument: &Arg) -> Kind {
    if matches!(argument.get_action(), ArgAction::Count) {
        return Kind::Whole(2);
    }
    let words: Vec<String> = argument
        .get_possible_values()
        .iter()
        .map(|value| value.get_name().to_owned())
        .collect();
    if words == ["true", "false"] {
        return Kind::Flag;
    }
    if !words.is_empty() {
        return Kind::Words(words);
    }
    let found = argument.get_value_parser().type_id();
    let whole = [
        (TypeId::of::<u16>(), u64::from(u16::MAX)),
        (TypeId::of::<u64>(), u64::MAX),
    ];
    if let Some((_, most)) = whole.iter().find(|(id, _)| found == *id) {
        return Kind::Whole(*most);
    }
    if found == TypeId::of::<f64>() {
        Kind::Number
    } else if found == TypeId::of::<String>() || found == TypeId::of::<PathBuf>() {
        Kind::Text
    } else {
        Kind::TextOrNumber
    }
}

/// The JSON schema of the configuration file (draft 2020-12).
pub fn schema() -> Value {
    let mut properties: Map<String, Value> = keys()
        .into_iter()
        .map(|key| (key.name.clone(), key_schema(&key)))
        .collect();
    properties.insert("options".to_owned(), options_schema());
    let mut of_robot = properties.clone();
    of_robot.retain(|key, _| key == "options" || ServeArgs::keys_of_robot().any(|flag| flag.key() == *key));
    of_robot.insert(
        "name".to_owned(),
        json!({ "type": "string", "pattern": "^[A-Za-z0-9_-]{1,32}$", "description": "Its name" }),
    );
    properties.insert(
        "robot".to_owned(),
        tables(
            "A robot of this process: its own settings",
            &["name"],
            &of_robot.into(),
        ),
    );
    let end = |what: &str| json!({ "type": "string", "description": what });
    let ends = json!({
        "from": end("Source of the level: ROBOT.dout.LINE or outside.NAME"),
        "to": end("Line that shows the level: ROBOT.din.LINE or outside.NAME"),
    });
    properties.insert(
        "wire".to_owned(),
        tables("A wire between robots", &["from", "to"], &ends),
    );
    json!({
        "$schema": DRAFT,
        "title": "Configuration of ts3100 serve and ts3100 exec",
        "type": "object",
        "additionalProperties": false,
        "properties": properties,
    })
}

/// Tables of one name, with these properties, some of which they must have.
fn tables(description: &str, required: &[&str], properties: &Value) -> Value {
    json!({
        "type": "array",
        "description": description,
        "items": {
            "type": "object",
            "additionalProperties": false,
            "required": required,
            "properties": properties,
        },
    })
}

fn key_schema(key: &Key) -> Value {
    let one = match &key.kind {
        Kind::Flag => json!({ "type": "boolean" }),
        Kind::Whole(most) => json!({ "type": "integer", "minimum": 0, "maximum": most }),
        Kind::Number => json!({ "type": "number" }),
        Kind::Words(words) => json!({ "enum": words }),
        Kind::Text => json!({ "type": "string" }),
        Kind::TextOrNumber => json!({ "type": ["string", "integer"] }),
    };
    let schema = match key.is_list {
        true => json!({ "anyOf": [one, { "type": "array", "items": one }] }),
        false => one,
    };
    described(schema, &key.help, key.default.as_deref())
}

/// A schema with what it is about, and the default.
fn described(mut schema: Value, description: &str, default: Option<&str>) -> Value {
    schema["description"] = match default {
        Some(default) => format!("{description}. Default: {default}").into(),
        None => description.into(),
    };
    schema
}

/// The table `options`; a dot in the name of an option is a table of its own.
fn options_schema() -> Value {
    let (mut top, mut groups) = (Map::new(), Map::new());
    for row in OPTIONS.iter() {
        let (values, default) = (row.values(), row.default_in(Dialect::Field));
        let default = Some(default.as_str()).filter(|default| !default.is_empty());
        let schema = described(
            option_schema(&values),
            &format!("{} {values}", row.about()),
            default,
        );
        let Some((group, key)) = row.key.split_once('.') else {
            top.insert(row.key.to_owned(), schema);
            continue;
        };
        let group = groups
            .entry(group)
            .or_insert_with(|| json!({ "type": "object", "additionalProperties": false, "properties": {} }));
        group["properties"][key] = schema;
    }
    top.extend(groups);
    json!({
        "type": "object",
        "description": "Named options, as with --set",
        "additionalProperties": false,
        "properties": top,
    })
}

fn option_schema(values: &Values) -> Value {
    match values {
        Values::Flag => json!({ "type": "boolean" }),
        Values::Words(words) if words.contains(&"true") => {
            let mut all = vec![Value::from(true), Value::from(false)];
            all.extend(words.iter().map(|word| Value::from(*word)));
            json!({ "enum": all })
        }
        Values::Words(words) => json!({ "enum": words }),
        Values::Duration { .. } => json!({ "type": "string", "pattern": DURATION }),
        Values::Whole { min, max, .. } => json!({ "type": "integer", "minimum": min, "maximum": max }),
        Values::Number { min, max } => json!({ "type": "number", "minimum": min, "maximum": max }),
        Values::Quartiles => json!({ "type": ["string", "number"] }),
        Values::OpenModes => json!({ "type": "string", "pattern": OPEN_MODES }),
    }
}
