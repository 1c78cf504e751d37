//! The keys of the configuration file.

use super::{code, table};
use ts3100_emulator::config::schema::{Key, Kind, keys};

/// Every key with type, default and variable.
pub fn all() -> String {
    let headings = ["Key", "Type", "Default", "Variable", "Meaning"];
    table(headings, keys().iter().map(row))
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

/// The JSON schema, as a file.
pub fn schema() -> String {
    format!("{:#}\n", ts3100_emulator::config::schema::schema())
}
