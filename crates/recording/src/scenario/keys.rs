//! The keys of a scenario file: the type and the meaning of each. `read` knows no others; the JSON schema for editors
//! and the table of docs/reference/scenarios.md are made from the same rows.

/// Type of the value of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyValue {
    Text,
    /// A list of texts.
    Texts,
    /// A time with its unit.
    Time,
    Condition,
    /// A list of actions.
    Actions,
    /// `true` or `false`.
    Flag,
    /// A whole number, this one or more.
    Whole(u32),
    /// A list of input lines.
    Lines,
    /// One of these words.
    Words(&'static [&'static str]),
    /// A number.
    Number,
    /// A table of variables, each with a number or a list of numbers.
    Variables,
    /// The name of a point, or a list of numbers.
    Place,
    /// The table of this name.
    Table,
    /// Tables of this name.
    Tables,
}

#[derive(Debug, Clone, Copy)]
pub struct Key {
    pub name: &'static str,
    /// Type of its value.
    pub value: KeyValue,
    pub meaning: &'static str,
}

pub(crate) const fn key(name: &'static str, value: KeyValue) -> Key {
    Key {
        name,
        value,
        meaning: "",
    }
}

impl Key {
    pub(crate) const fn means(self, meaning: &'static str) -> Key {
        Key { meaning, ..self }
    }
}

/// A table of the file.
#[derive(Debug, Clone, Copy)]
pub struct Table {
    /// Its name; empty for the file itself.
    pub name: &'static str,
    pub keys: &'static [Key],
    /// The keys that it must have.
    pub required: &'static [&'static str],
}

/// Key of an expectation of either kind.
const NAME: Key = key("name", KeyValue::Text).means("name of the test case; default: the condition");
/// Key of an expectation of either kind.
const WHAT: Key = key("what", KeyValue::Condition).means("a condition");

/// The tables of a scenario; the first is the file itself.
pub const TABLES: [Table; 5] = [
    Table {
        name: "",
        keys: &[
            key("name", KeyValue::Text)
                .means("name of the test suite in the results; default: the name of the file"),
            key("start", KeyValue::Table).means("the initial state"),
            key("do", KeyValue::Tables).means("entries `[[do]]`: actions"),
            key("expect", KeyValue::Tables).means("entries `[[expect]]`: conditions that have to happen"),
            key("never", KeyValue::Tables).means("entries `[[never]]`: conditions that must not happen"),
        ],
        required: &[],
    },
    Table {
        name: "start",
        keys: &[
            key("restore", KeyValue::Text).means("a snapshot to begin with, as with `--restore`"),
            key("load", KeyValue::Texts).means("files of this computer for the RAM drive, as with `--load`"),
            key("select", KeyValue::Text).means("file to select, as with `--select`, which has precedence"),
            key("servo-on", KeyValue::Flag).means("`true`: servo power on"),
            key("key-switch", KeyValue::Words(&["teaching", "internal", "ext"]))
                .means("position of the key switch"),
            key("control-right", KeyValue::Words(&["sig", "rs232c", "ether"]))
                .means("who commands the robot in EXT"),
            key("inputs", KeyValue::Lines).means("numbers of inputs that are on"),
        ],
        required: &[],
    },
    Table {
        name: "do",
        keys: &[
            key("at", KeyValue::Time).means("a time, or"),
            key("when", KeyValue::Condition).means("a condition"),
            key("after", KeyValue::Time).means("with `when`: delay after the condition; default: none"),
            key("times", KeyValue::Whole(0))
                .means("with `when`: maximum number of times; default 1; 0: every time"),
            key("actions", KeyValue::Actions).means("the actions, in order"),
        ],
        required: &["actions"],
    },
    Table {
        name: "expect",
        keys: &[
            NAME,
            WHAT,
            key("within", KeyValue::Time).means("time limit; default: until the end"),
            key("after", KeyValue::Condition)
                .means("a condition from which occurrences and time are counted; default: the start"),
            key("times", KeyValue::Whole(1)).means("required number of times; default 1"),
        ],
        required: &["what"],
    },
    Table {
        name: "never",
        keys: &[
            NAME,
            WHAT,
            key("after", KeyValue::Condition)
                .means("a condition from which it must not happen; default: the start"),
            key("until", KeyValue::Condition)
                .means("a condition until which it must not happen; default: the end"),
        ],
        required: &["what"],
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;
    use std::path::Path;

    fn read(text: &str) -> Result<Scenario, String> {
        Scenario::parse(Path::new("s.toml"), text).map_err(|error| error.to_string())
    }

    /// A value that a key accepts, and those that it must refuse.
    fn examples(value: KeyValue) -> (&'static str, &'static [&'static str]) {
        match value {
            KeyValue::Text => ("\"A\"", &["3", "[\"A\"]"]),
            KeyValue::Texts => ("[\"A\"]", &["\"A\"", "[3]"]),
            KeyValue::Time => ("\"1.5 s\"", &["3", "\"3\"", "\". s\"", "\" 3 s\""]),
            KeyValue::Condition => ("\"servo on\"", &["3", "\"servos on\""]),
            KeyValue::Actions => ("[\"servo on\"]", &["\"servo on\"", "[\"servos on\"]"]),
            KeyValue::Flag => ("true", &["1", "\"true\""]),
            KeyValue::Whole(0) => ("0", &["-1", "\"1\"", "1.5"]),
            KeyValue::Whole(_) => ("1", &["0", "\"1\""]),
            KeyValue::Lines => ("[5]", &["5", "[\"5\"]", "[65]"]),
            KeyValue::Words(words) => match words.first() {
                Some(&"teaching") => ("\"teaching\"", &["\"Teaching\"", "3"]),
                _ => ("\"sig\"", &["\"SIG\"", "3"]),
            },
            // No scenario has these.
            KeyValue::Number | KeyValue::Variables | KeyValue::Place => ("", &[]),
            KeyValue::Table | KeyValue::Tables => ("", &["3"]),
        }
    }

    /// What the rows say, which the schema is made from, holds for the reader.
    #[test]
    fn a_key_accepts_what_its_row_says() {
        for table in TABLES {
            for key in table.keys {
                let with = |value: &str| {
                    // What the key cannot be without.
                    let trigger = match (table.name, key.name) {
                        ("do", "at" | "when") => "",
                        ("do", "actions") => "at = \"1 s\"\n",
                        ("do", _) => "when = \"servo on\"\n",
                        _ => "",
                    };
                    let needed = table.required.iter().filter(|name| **name != key.name);
                    let needed: String = needed
                        .filter_map(|name| table.keys.iter().find(|key| key.name == *name))
                        .map(|key| format!("{} = {}\n", key.name, examples(key.value).0))
                        .collect();
                    let head = match table.name {
                        "" => String::new(),
                        "start" => "[start]\n".to_owned(),
                        name => format!("[[{name}]]\n"),
                    };
                    read(&format!("{head}{trigger}{needed}{} = {value}\n", key.name))
                };
                let (right, wrong) = examples(key.value);
                if !right.is_empty() {
                    assert!(
                        with(right).is_ok(),
                        "[{}] {} = {right}: {:?}",
                        table.name,
                        key.name,
                        with(right)
                    );
                }
                for wrong in wrong {
                    assert!(with(wrong).is_err(), "[{}] {} = {wrong}", table.name, key.name);
                }
            }
            for name in table.required {
                let trigger = if table.name == "do" { "at = \"1 s\"" } else { "" };
                let error = read(&format!("[[{}]]\n{trigger}\n", table.name)).unwrap_err();
                assert!(error.contains(&format!("expected `{name}`")), "{error}");
            }
        }
    }
}
