//! The JSON schemas of scenario files and of files of tests, from the rows that the readers know.

use super::{DRAFT, DURATION, described};
use serde_json::{Map, Value, json};
use ts3100_controller::{CONDITION_FORMS, action_forms};
use ts3100_recording::program_test;
use ts3100_recording::scenario::CHANNEL_ACTIONS;
pub use ts3100_recording::scenario::keys::{Key, KeyValue, TABLES, Table};

/// The JSON schema of a scenario file (draft 2020-12).
pub fn schema() -> Value {
    document("Scenario of ts3100", &TABLES)
}

/// The JSON schema of a file of tests (draft 2020-12).
pub fn test_schema() -> Value {
    document("Tests of a SCOL program for ts3100", &program_test::keys::TABLES)
}

fn document(title: &str, tables: &[Table]) -> Value {
    let mut document = table(tables, "", "");
    document["$schema"] = DRAFT.into();
    document["title"] = title.into();
    document["$defs"] = definitions();
    document
}

/// Forms of conditions, actions and times.
fn definitions() -> Value {
    let conditions = CONDITION_FORMS.iter().map(|row| row.form);
    let examples: Vec<&str> = CONDITION_FORMS.iter().map(|row| row.example).collect();
    let actions = action_forms().chain(CHANNEL_ACTIONS);
    json!({
        "condition": {
            "type": "string",
            "pattern": first_words(conditions),
            "examples": examples,
        },
        "action": {
            "type": "string",
            "pattern": first_words(actions.clone()),
            "description": format!("One of: {}", actions.collect::<Vec<_>>().join("; ")),
        },
        "time": { "type": "string", "pattern": DURATION, "examples": ["250 ms", "1.5 s", "3 min"] },
    })
}

/// The pattern of words that begin as one of these forms does.
fn first_words<'a>(forms: impl Iterator<Item = &'a str>) -> String {
    let mut words: Vec<&str> = forms.filter_map(|form| form.split(' ').next()).collect();
    words.sort_unstable();
    words.dedup();
    format!("^({})( |$)", words.join("|"))
}

/// The table of this key of the table `outer`, or the file itself. What a file of tests does not have is a table of scenarios.
fn table(tables: &[Table], outer: &str, key: &str) -> Value {
    let name = match outer {
        "" => key.to_owned(),
        outer => format!("{outer}.{key}"),
    };
    let own = tables.iter().find(|table| table.name == name);
    let found = own.or_else(|| TABLES.iter().find(|table| table.name == key));
    let Some(Table { name, keys, required }) = found else {
        return Value::Bool(false);
    };
    let properties: Map<String, Value> = keys
        .iter()
        .map(|key| (key.name.to_owned(), property(tables, name, key)))
        .collect();
    let mut table = json!({
        "type": "object",
        "additionalProperties": false,
        "required": required,
        "properties": properties,
    });
    if *name == "do" {
        // A step has a time or a condition.
        table["oneOf"] = json!([{ "required": ["at"] }, { "required": ["when"] }]);
        table["dependentRequired"] = json!({ "after": ["when"], "times": ["when"] });
    }
    table
}

fn property(tables: &[Table], outer: &str, key: &Key) -> Value {
    let (text, number) = (json!({ "type": "string" }), json!({ "type": "number" }));
    let schema = match key.value {
        KeyValue::Text => text,
        KeyValue::Texts => json!({ "type": "array", "items": text }),
        KeyValue::Time => json!({ "$ref": "#/$defs/time" }),
        KeyValue::Condition => json!({ "$ref": "#/$defs/condition" }),
        KeyValue::Actions => json!({ "type": "array", "items": { "$ref": "#/$defs/action" } }),
        KeyValue::Flag => json!({ "type": "boolean" }),
        KeyValue::Whole(least) => json!({ "type": "integer", "minimum": least, "maximum": u32::MAX }),
        KeyValue::Lines => json!({ "type": "array", "items": { "type": "integer", "minimum": 1 } }),
        KeyValue::Words(words) => json!({ "enum": words }),
        KeyValue::Number => number,
        KeyValue::Variables => {
            let value = json!({ "oneOf": [number.clone(), { "type": "array", "items": number }] });
            json!({ "type": "object", "additionalProperties": value })
        }
        KeyValue::Place => json!({ "oneOf": [text, { "type": "array", "items": number }] }),
        KeyValue::Table => table(tables, outer, key.name),
        KeyValue::Tables => json!({ "type": "array", "items": table(tables, outer, key.name) }),
    };
    described(schema, key.meaning, None)
}
