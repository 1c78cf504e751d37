//! The keys of the files that people write: configuration, scenarios, faults.

use super::{code, table};
use ts3100_emulator::config::schema::scenario::{self, KeyValue, TABLES, Table};
use ts3100_emulator::config::schema::{self, Key, Kind, faults, keys};
use ts3100_emulator::config::{Mark, ServeArgs};
use ts3100_recording::program_test;

/// Every key with type, default and variable.
pub fn all() -> String {
    let headings = ["Key", "Type", "Default", "Variable", "Meaning"];
    table(headings, keys().iter().map(row))
}

/// The keys that a table of a robot does not take.
pub fn keys_of_the_process() -> String {
    let keys = ServeArgs::keys_of_file().filter(|flag| flag.is(Mark::Process));
    let keys: Vec<String> = keys.map(|flag| code(&flag.key())).collect();
    keys.join(", ")
}

fn row(key: &Key) -> [String; 5] {
    let kind = match &key.kind {
        Kind::Flag => "true or false".to_owned(),
        Kind::Whole(_) => "whole number".to_owned(),
        Kind::Number => "number".to_owned(),
        Kind::Words(words) => {
            let words: Vec<String> = words.iter().map(|word| code(word)).collect();
            words.join(", ")
        }
        Kind::Text => "text".to_owned(),
        Kind::TextOrNumber => "text or number".to_owned(),
    };
    let kind = match key.is_list {
        true => format!("{kind}, or a list"),
        false => kind,
    };
    let name = &key.name;
    let default = key.default.as_deref().map_or("-".to_owned(), code);
    [
        format!("<a id=\"{name}\"></a>[`{name}`](command-line.md#serve-{name})"),
        kind,
        default,
        code(&key.variable),
        key.help.replace('<', "\\<"),
    ]
}

/// The keys of scenario files.
pub fn scenario_keys() -> String {
    keys_of(&TABLES)
}

/// The keys of files of tests.
pub fn test_keys() -> String {
    keys_of(&program_test::keys::TABLES)
}

fn keys_of(tables: &'static [Table]) -> String {
    let rows = tables.iter().flat_map(|table| {
        table.keys.iter().map(|key| {
            let name = match table.name {
                "" => key.name.to_owned(),
                table => format!("{table}.{}", key.name),
            };
            let words = match key.value {
                KeyValue::Words(words) => {
                    let words: Vec<String> = words.iter().map(|word| code(word)).collect();
                    format!(": {}", words.join(", "))
                }
                _ => String::new(),
            };
            [code(&name), format!("{}{words}", key.meaning)]
        })
    });
    table(["Key", "Meaning"], rows)
}

/// The keys that every kind of fault has.
pub fn fault_keys() -> String {
    let rows = faults::COMMON_KEYS.iter();
    table(
        ["Key", "Meaning", "Default"],
        rows.map(|key| [code(key.name), key.meaning.to_owned(), key.default.to_owned()]),
    )
}

/// The JSON schema of the configuration, as a file.
pub fn schema() -> String {
    format!("{:#}\n", schema::schema())
}

/// The JSON schema of scenarios, as a file.
pub fn scenario_schema() -> String {
    format!("{:#}\n", scenario::schema())
}

/// The JSON schema of faults, as a file.
pub fn faults_schema() -> String {
    format!("{:#}\n", faults::schema())
}

/// The JSON schema of files of tests, as a file.
pub fn test_schema() -> String {
    format!("{:#}\n", scenario::test_schema())
}
