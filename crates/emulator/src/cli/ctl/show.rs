//! Formats responses of the control interface for people: indented names and values, and one line for each event.
//!
//! With `--json` the documents are printed as they came; only [`metrics`], which are not JSON, are converted here.

use serde_json::{Map, Value};
use ts3100_book::command_of_path;
use ts3100_proto::status::pr::three_decimals;

/// Columns a list of plain values may take before it is broken.
const WIDTH: usize = 100;
/// Smaller numbers are rounding noise.
const NOISE: f64 = 1e-6;
/// Smaller numbers are zero with three decimals.
const HIDDEN: f64 = 0.000_5;

/// A document as names and values, indented.
pub fn format_document(answer: &Value) -> String {
    let mut text = String::new();
    match answer.as_array() {
        Some(list) if list.is_empty() => text.push_str("none\n"),
        _ => write(&mut text, &with_whole_configurations(answer.clone()), 0),
    }
    text
}

/// Counters in the text format of Prometheus as an object of names and values.
pub fn metrics(text: &str) -> Value {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let pairs = lines.filter_map(|line| {
        let (name, value) = line.rsplit_once(' ')?;
        Some((name.to_owned(), serde_json::from_str(value).ok()?))
    });
    Value::Object(pairs.collect())
}

/// The fields of a text with the numbers of alarms as people read them: 2-046, which is `002-046` on the wire.
pub fn with_short_numbers(mut answer: Value) -> Value {
    let fields = answer.get_mut("fields").and_then(Value::as_array_mut);
    for field in fields.into_iter().flatten() {
        let is_alarm = field["key"].as_str().is_some_and(|key| key.ends_with(".alarm"));
        if let Some(number) = field["value"].as_str().filter(|_| is_alarm) {
            let number = number.trim_matches(['`', ',']).trim_start_matches('0').to_owned();
            field["value"] = Value::String(number);
        }
    }
    answer
}

/// The document with the configurations of its positions, their last numbers, as whole numbers.
fn with_whole_configurations(mut answer: Value) -> Value {
    if let Some(list) = answer.as_array_mut() {
        return list.drain(..).map(with_whole_configurations).collect();
    }
    if answer.get("kind").is_some_and(|kind| kind == "position") {
        let lists = answer
            .get("elements")
            .and_then(Value::as_array)
            .map_or(0, Vec::len);
        let mut places: Vec<String> = (0..lists).map(|index| format!("/elements/{index}")).collect();
        places.push("/value".to_owned());
        for place in places {
            let values = answer.pointer_mut(&place).and_then(Value::as_array_mut);
            if let Some(last) = values.and_then(|values| values.last_mut())
                && let Some(number) = last.as_f64()
            {
                *last = format!("{number:.0}").into();
            }
        }
    }
    answer
}

/// Says which file is on the drive now.
pub fn stored_file(answer: &Value) -> String {
    let part = |name: &str| answer.get(name).map(plain).unwrap_or_default();
    format!("stored {}: {} bytes\n", part("name"), part("size"))
}

/// Says which fault of the list was armed: the one of this number, or the last one for 0.
pub fn armed_fault(answer: &Value, id: u32) -> String {
    let faults = answer.get("faults").and_then(Value::as_array);
    let fault = faults.and_then(|faults| match id {
        0 => faults.last(),
        id => faults
            .iter()
            .find(|fault| fault.get("id").is_some_and(|known| *known == id)),
    });
    let part = |name: &str| {
        fault
            .and_then(|fault| fault.get(name))
            .map(plain)
            .unwrap_or_default()
    };
    format!("armed fault {}: {}\n", part("id"), part("spec"))
}

/// The text a file holds, or its digits.
pub fn file_text(answer: &Value) -> String {
    let part = |name: &str| answer.get(name).and_then(Value::as_str);
    match (part("text"), part("hex")) {
        (Some(text), _) => text.to_owned(),
        (None, Some(hex)) => format!("{hex}\n"),
        (None, None) => format_document(answer),
    }
}

/// One event on one line.
pub fn format_event(kind: &str, event: &Value) -> String {
    let empty = Map::new();
    let fields = event.as_object().unwrap_or(&empty);
    let at = fields.get("t").and_then(Value::as_f64).unwrap_or_default();
    let mut text = format!("{at:>12.6} {kind:<13}");
    for (name, value) in fields {
        // The digits say the same as the text.
        if ["seq", "t", "event", "hex"].contains(&name.as_str()) {
            continue;
        }
        text.push_str(&format!(" {name}={}", plain(value)));
    }
    text.push('\n');
    text
}

#[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
fn plain(value: &Value) -> String {
    match value {
        // A path of the interface is for programs and browsers.
        Value::String(text) => command_of_path(text).unwrap_or_else(|| text.clone()),
        Value::Number(number) => match number.as_f64() {
            Some(value) if number.is_f64() => decimal(value),
            _ => number.to_string(),
        },
        other => other.to_string(),
    }
}

/// Three decimals; all digits of a number that three would hide, for example a small probability.
fn decimal(value: f64) -> String {
    let size = value.abs();
    if (NOISE..HIDDEN).contains(&size) {
        value.to_string()
    } else {
        three_decimals(value)
    }
}

/// A plain value, or a list of such, on one line; `None` for what needs several.
#[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
fn on_line(value: &Value) -> Option<String> {
    // Between blanks on one line nobody would see where a text ends.
    let is_word = |value: &Value| match value {
        Value::Array(_) | Value::Object(_) => false,
        value => value.as_str().is_none_or(|text| !text.contains(' ')),
    };
    match value {
        Value::Array(list) if list.is_empty() => Some("none".to_owned()),
        Value::Array(list) if list.iter().all(is_word) => {
            Some(list.iter().map(plain).collect::<Vec<_>>().join(" "))
        }
        Value::Object(fields) if fields.is_empty() => Some(plain(value)),
        Value::Array(_) | Value::Object(_) => None,
        Value::Null => Some("none".to_owned()),
        value => Some(plain(value)),
    }
}

#[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
fn write(text: &mut String, value: &Value, depth: usize) {
    let indent = "  ".repeat(depth);
    match value {
        Value::Object(fields) => {
            for (name, value) in fields {
                match on_line(value).filter(|line| line.len() <= WIDTH && !line.contains('\n')) {
                    Some(line) => text.push_str(&format!("{indent}{name}: {line}\n")),
                    None => {
                        text.push_str(&format!("{indent}{name}:\n"));
                        write(text, value, depth + 1);
                    }
                }
            }
        }
        Value::Array(list) => {
            for value in list {
                if let Some(line) = on_line(value) {
                    text.push_str(&format!("{indent}- {line}\n"));
                } else {
                    let mut item = String::new();
                    write(&mut item, value, depth + 1);
                    let rest = item.get(indent.len() + 2..).unwrap_or_default();
                    text.push_str(&format!("{indent}- {rest}"));
                }
            }
        }
        value => {
            for line in on_line(value).unwrap_or_default().lines() {
                text.push_str(&format!("{indent}{line}\n"));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use ts3100_book::explain_path;

    #[test]
    fn documents_are_names_and_values() {
        let answer = json!({"on": [1, 2], "none": [], "deep": {"a": [{"b": 1, "c": "x\ny"}]}});
        let expected = "on: 1 2\nnone: none\ndeep:\n  a:\n    - b: 1\n      c:\n        x\n        y\n";
        assert_eq!(format_document(&answer), expected);
        let answer = json!({"joints": [-1e-14, 10.0, -0.0], "p": 0.0001, "n": 5, "t": 1.5});
        let expected = "joints: 0.000 10.000 0.000\np: 0.0001\nn: 5\nt: 1.500\n";
        assert_eq!(format_document(&answer), expected);
        assert_eq!(file_text(&json!({"text": "A\n"})), "A\n");
        let answer = json!({"docs": explain_path("8-014")});
        assert_eq!(format_document(&answer), "docs: ts3100 explain 8-014\n");
        let answer = json!({"lines": ["IP0 LISTEN", "IP1"], "names": ["A", "B"]});
        let expected = "lines:\n  - IP0 LISTEN\n  - IP1\nnames: A B\n";
        assert_eq!(format_document(&answer), expected);
        let event = json!({"seq": 1, "t": 0.5, "event": "status", "status": "running", "hex": "00"});
        assert_eq!(
            format_event("status", &event),
            "    0.500000 status        status=running\n"
        );
    }
}
