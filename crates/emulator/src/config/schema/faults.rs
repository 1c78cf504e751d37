//! The JSON schema of fault files, from the table of kinds.

use super::{DRAFT, described};
use serde_json::{Map, Value, json};
use ts3100_controller::alarm::{ALARMS, AlarmCode};
use ts3100_controller::faults::{FaultKind, KINDS, MAX_COUNT, Parameter, ParameterType};
use ts3100_controller::port::Port;
use ts3100_proto::command::COMMANDS;

/// Pattern of a number of milliseconds as a text.
const MILLIS: &str = r"^[0-9]+(\.[0-9]+)?\s*(ms|s|min)$|^[0-9]+$";
/// Pattern of a whole number as a text.
const WHOLE: &str = "^[0-9]+$";

/// A key that every kind has.
#[derive(Debug, Clone, Copy)]
pub struct CommonKey {
    /// Name of the robot.
    pub name: &'static str,
    pub meaning: &'static str,
    /// The default.
    pub default: &'static str,
    schema: fn(&FaultKind) -> Value,
}

/// The keys that every kind has, as the page of faults lists them.
pub const COMMON_KEYS: [CommonKey; 7] = [
    CommonKey {
        name: "id",
        meaning: "its number, 1 to 1,000,000. At run time a fault replaces one of the same number; two from the start are rejected",
        default: "the next free one",
        schema: |_| whole(1, u64::from(MAX_COUNT)),
    },
    CommonKey {
        name: "command",
        meaning: "letters of a command: the command, the texts of its exchange, its answers. `SP` also means the unsolicited SP",
        default: "any, unless the kind says otherwise",
        schema: |_| {
            let rows = COMMANDS.iter().filter(|row| row.permission.is_some());
            json!({ "enum": rows.map(|row| row.letters).collect::<Vec<_>>() })
        },
    },
    CommonKey {
        name: "channel",
        meaning: "HOST, COM1, IP0, IP1, IP2",
        default: "any",
        schema: |kind| {
            let ports = Port::ALL.into_iter();
            let ports = ports.filter(|port| kind.points.iter().any(|point| point.is_on(*port)));
            json!({ "enum": ports.map(Port::name).collect::<Vec<_>>() })
        },
    },
    CommonKey {
        name: "block",
        meaning: "number of the FL text in its exchange, from 1, or of the OK to it; 0: any other text",
        default: "any, unless the kind says otherwise",
        schema: |_| whole(0, u64::from(MAX_COUNT)),
    },
    CommonKey {
        name: "after",
        meaning: "number of occasions to skip first",
        default: "0",
        schema: |_| whole(0, u64::from(MAX_COUNT)),
    },
    CommonKey {
        name: "times",
        meaning: "maximum number of times it fires; 0: no limit",
        default: "1",
        schema: |_| whole(0, u64::from(MAX_COUNT)),
    },
    CommonKey {
        name: "probability",
        meaning: "probability of firing at an occasion, 0.000001 to 1",
        default: "1",
        schema: |_| json!({ "type": "number", "minimum": 0.000_001, "maximum": 1 }),
    },
];

/// The JSON schema of a fault file (draft 2020-12).
pub fn schema() -> Value {
    let kinds: Vec<&str> = KINDS.iter().map(|kind| kind.name).collect();
    let definitions: Map<String, Value> = KINDS
        .iter()
        .map(|kind| (kind.name.to_owned(), keys(kind)))
        .collect();
    // Not `oneOf`: an editor should name the key that is wrong, not say that no kind fits.
    let each: Vec<Value> = kinds
        .iter()
        .map(|name| {
            json!({
                "if": { "properties": { "kind": { "const": name } } },
                "then": { "$ref": format!("#/$defs/{name}") },
            })
        })
        .collect();
    json!({
        "$schema": DRAFT,
        "title": "Faults of ts3100",
        "type": "object",
        "additionalProperties": false,
        "properties": {
            "fault": {
                "type": "array",
                "description": "One fault each",
                "items": {
                    "type": "object",
                    "required": ["kind"],
                    "properties": { "kind": { "enum": kinds, "description": "Effect of the fault" } },
                    "allOf": each,
                },
            },
        },
        "$defs": definitions,
    })
}

/// The keys of a kind.
fn keys(kind: &FaultKind) -> Value {
    let mut properties = json!({ "kind": true });
    for key in &COMMON_KEYS {
        properties[key.name] = described((key.schema)(kind), key.meaning, Some(key.default));
    }
    for parameter in kind.parameters {
        let Parameter {
            name,
            description,
            default,
            ..
        } = *parameter;
        properties[name] = described(value(parameter), description, default);
    }
    json!({
        "description": kind.summary,
        "additionalProperties": false,
        "properties": properties,
    })
}

fn value(parameter: &Parameter) -> Value {
    match &parameter.value_type {
        ParameterType::Number { unit: "ms", min, max } => {
            json!({ "anyOf": [whole(*min, *max), { "type": "string", "pattern": MILLIS }] })
        }
        ParameterType::Number { min, max, .. } => {
            json!({ "anyOf": [whole(*min, *max), { "type": "string", "pattern": WHOLE }] })
        }
        ParameterType::Word(words) => json!({ "enum": words }),
        ParameterType::Text { .. } => json!({ "type": ["string", "number"] }),
        ParameterType::Alarm => {
            let numbers: Vec<String> = ALARMS.iter().map(AlarmCode::number).collect();
            json!({ "enum": numbers })
        }
    }
}

fn whole(min: u64, max: u64) -> Value {
    json!({ "type": "integer", "minimum": min, "maximum": max })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_the_common_keys_in_this_order() {
        for kind in KINDS {
            let names: Vec<&str> = COMMON_KEYS.iter().map(|key| key.name).collect();
            assert!(kind.keys().starts_with(&names), "{}", kind.name);
        }
    }
}
