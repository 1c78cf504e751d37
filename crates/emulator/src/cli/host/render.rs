//! Turns decoded replies into JSON values, and JSON values into tables for people.
//!
//! Decoding is done by `ts3100-proto`; only field names and layout are chosen here. The field names are a public
//! format of `ts3100 host --json`.

use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use ts3100_controller::alarm::AlarmCode;
use ts3100_proto::command::Number;
use ts3100_proto::status::ac::{self, AlarmRecord};
use ts3100_proto::status::ca::{self, DirectoryEntry};
use ts3100_proto::status::eu::{self, ErrorEntry};
use ts3100_proto::status::io::{self, LineWords};
use ts3100_proto::status::mn::MaintenanceItem;
use ts3100_proto::status::position::CurrentPosition;
use ts3100_proto::status::pr::{self, Position};
use ts3100_proto::status::sf::{self, SfLayout, SystemStatus};
use ts3100_proto::status::sm::QuickStatus;
use ts3100_proto::status::su::StatusBody;
use ts3100_proto::status::vr::{self, VersionRecord};
use ts3100_proto::status::{AlarmLevel, BodyError, ExecutionStatus, mr};

/// Values of a position of a six-axis arm; nothing else has as many.
const POSITION_VALUES: usize = 9;

/// Decodes the content of a reply.
type Decoder = fn(&[u8]) -> Result<Value, BodyError>;

/// The decoder for the reply to a command; `None` if the reply is a file for the user.
pub(super) fn decoder(letters: &str) -> Option<Decoder> {
    Some(match letters {
        "SF" => |content| {
            let layout = if content.len() == SfLayout::Six.len() {
                SfLayout::Six
            } else {
                SfLayout::Eight
            };
            SystemStatus::decode(content, layout).map(|status| system_status(&status))
        },
        "IO" => |content| io::decode_lines(content).map(|words| lines(&words)),
        "SU" => |content| StatusBody::decode(content).map(|body| status(&body)),
        "CA" => |content| ca::decode_directory(content).map(|files| list(&files, directory_entry)),
        "VR" => |content| vr::decode_versions(content).map(|records| list(&records, version)),
        "EU" => |content| eu::decode_history(content).map(|entries| list(&entries, error_entry)),
        "MR" => |content| mr::decode_values(content).map(|values| variable(&values)),
        "HI" => |content| mr::decode_values(content).map(|values| list(&values, number)),
        "SM" => |content| QuickStatus::decode(content).map(|status| quick_status(&status)),
        "AC" | "AH" => |content| ac::decode_alarms(content).map(|alarms| list(&alarms, alarm_record)),
        "PR" | "VL" => |content| pr::decode_position(content).map(|values| position(&values)),
        "MN" => |content| {
            MaintenanceItem::decode(content).map(|item| json!({ "item": item.number, "values": item.values }))
        },
        "PS" => |content| CurrentPosition::decode(content).map(|position| current_position(&position)),
        "ZC" => |content| mr::decode_values(content).map(|values| list(&values, number)),
        _ => return None,
    })
}

fn list<T>(items: &[T], show: fn(&T) -> Value) -> Value {
    Value::Array(items.iter().map(show).collect())
}

fn status(body: &StatusBody) -> Value {
    json!({
        "mode": body.master_mode.as_str(),
        "run_mode": body.run_mode.as_str(),
        "file": body.file,
        "override_percent": body.override_percent,
        "speed_limit_percent": body.speed_limit_percent,
        "machine_lock": body.machine_lock,
        "status": body.execution.as_str(),
    })
}

fn directory_entry(entry: &DirectoryEntry) -> Value {
    json!({ "name": entry.name, "size": entry.size, "attribute": entry.attribute })
}

fn version(record: &VersionRecord) -> Value {
    json!({
        "name": record.name,
        "date": record.date.to_string(),
        "checksum": format!("{:04X}", record.checksum),
    })
}

fn error_entry(entry: &ErrorEntry) -> Value {
    json!({ "alarm": alarm(entry.level, entry.code), "at": entry.at.to_string() })
}

fn number(number: &Number) -> Value {
    match number {
        Number::Integer(value) => json!(value),
        Number::Real(value) => json!(value + 0.0),
    }
}

/// The values of a variable; a position has its configuration last, in figures.
fn variable(values: &[Number]) -> Value {
    let mut shown = list(values, number);
    if let (POSITION_VALUES, Some(last)) = (values.len(), shown.as_array_mut().and_then(|all| all.last_mut()))
        && let Some(configuration) = last.as_f64().filter(|value| value.fract() == 0.0)
    {
        *last = json!(configuration as i64);
    }
    shown
}

fn alarm_record(record: &AlarmRecord) -> Value {
    // The record has the level in three digits.
    let number = record.number.strip_prefix("00").unwrap_or(&record.number);
    let known = AlarmCode::from_number(number);
    json!({
        "alarm": number,
        "message": record.message,
        "at": record.at.to_string(),
        "docs": known.map(|code| ts3100_book::explain_command(&code.number())),
    })
}

/// Values without names: which coordinates they are depends on the query and the arm.
fn position(position: &Position) -> Value {
    json!({ "values": position.values, "configuration": position.configuration })
}

fn current_position(position: &CurrentPosition) -> Value {
    json!({
        "status": position.status.as_str(),
        "line": position.line,
        "joints": position.joints,
        "measured": position.measured,
        "torques": position.torques,
    })
}

fn quick_status(status: &QuickStatus) -> Value {
    json!({
        "emergency_stop": status.emergency_stop,
        "safety_stop": status.safety_stop,
        "stop_command": status.stop_command,
        "break_command": status.break_command,
        "emergency_switch": status.emergency_switch,
        "safety_switch": status.safety_switch,
        "servo": status.servo,
        "master_mode": name_or_number(&QUICK_MODES, status.master_mode.into()),
        "run_mode": name_or_number(&QUICK_RUN_MODES, status.run_mode.into()),
        "status": ExecutionStatus::from_code(status.run_status).map_or(json!(status.run_status), |status| json!(status.as_str())),
        "override_percent": status.override_percent,
        "alarm_level": status.alarm_level,
        "do_ended": status.ended,
        "do_busy": status.busy,
    })
}

/// Master modes in the order of their numbers in SF.
const MODES: [&str; 4] = ["TEACHING", "INTERNAL", "EXT (SIG)", "EXT (HOST)"];
/// Master modes in the order of their numbers in SM.
const QUICK_MODES: [&str; 6] = [
    "TEACHING",
    "INTERNAL",
    "EXT (SIG)",
    "EXT",
    "EXT (RS-232C)",
    "EXT (ETHER)",
];
/// Operation modes in the order of their numbers in SM.
const QUICK_RUN_MODES: [&str; 4] = ["continuous", "cycle", "step", "segment"];

/// The word of a number, or the number if it has none.
fn name_or_number(words: &[&str], number: u16) -> Value {
    let word = words.get(usize::from(number));
    word.map_or(json!(number), |word| json!(word))
}

/// The lines of IO that are on.
fn lines(words: &LineWords) -> Value {
    json!({ "inputs_on": lines_on(&words.inputs), "outputs_on": lines_on(&words.outputs) })
}

/// All of SF; signals as the lists of lines that are on, positions as they came.
fn system_status(status: &SystemStatus) -> Value {
    json!({
        "servo": status.servo,
        "emergency_stop": status.emergency_stop,
        "status": status.execution.as_str(),
        "su_request": status.su_request,
        "alarms": status.alarms.iter().filter_map(|word| sf::alarm_from_word(*word)).map(|(level, code)| alarm(level, code)).collect::<Vec<_>>(),
        "execution_line": status.execution_line,
        "analysis_line": status.analysis_line,
        "execution_task": status.execution_task,
        "analysis_task": status.analysis_task,
        "feed_hold": status.feed_hold,
        "guide_coordinate": status.guide_coordinate,
        "guide_rate": status.guide_rate,
        "guide_mode": status.guide_mode,
        "master_mode": name_or_number(&MODES, status.master_mode),
        "power_on_minutes": status.power_on_minutes,
        "run_minutes": status.run_minutes,
        "inputs_on": lines_on(&status.inputs),
        "outputs_on": lines_on(&status.outputs),
        "joint": rounded(&status.joint),
        "world": rounded(&status.world),
        "work": rounded(&status.work),
        "work_name": status.work_name,
        "tool_name": status.tool_name,
        "base_name": status.base_name,
    })
}

/// Numbers of the lines that are on: four words each from line 1, 101 and 201; the rest is reserved.
fn lines_on(words: &[u16]) -> Vec<usize> {
    let on = words.iter().enumerate().flat_map(|(index, word)| {
        let first = index / 4 * 100 + index % 4 * 16 + 1;
        let bits = (0..16).filter(move |bit| word & (1 << bit) != 0);
        bits.map(move |bit| first + bit)
    });
    on.collect()
}

/// Single precision shown without the digits it does not have.
fn rounded(values: &[f32; 8]) -> Vec<f64> {
    values
        .iter()
        // The sum with zero makes -0.0 positive.
        .map(|value| (f64::from(*value) * 1_000.0).round() / 1_000.0 + 0.0)
        .collect()
}

fn alarm(level: AlarmLevel, code: u16) -> String {
    format!("{}-{code:03}", level.number())
}

/// The value for people: an object as one `name  value` line a field (none for null), a list of objects as one line each
/// under a heading, a list of numbers as one line.
#[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
pub(super) fn table(value: &Value) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    match value {
        Value::Object(fields) => {
            let width = fields.keys().map(String::len).max().unwrap_or(0);
            for (name, value) in fields.iter().filter(|(_, value)| !value.is_null()) {
                let _ = writeln!(text, "{:<width$}  {}", name.replace('_', " "), cell_text(value));
            }
        }
        Value::Array(items) => match items.first() {
            None => text.push_str("(none)\n"),
            Some(Value::Object(first)) => text.push_str(&rows(items, first)),
            Some(_) => {
                let _ = writeln!(text, "{}", cell_text(value));
            }
        },
        other => {
            let _ = writeln!(text, "{}", cell_text(other));
        }
    }
    text
}

fn rows(items: &[Value], first: &Map<String, Value>) -> String {
    let columns: Vec<Vec<String>> = first
        .keys()
        .map(|name| {
            let cells = items.iter().map(|item| cell_text(&item[name.as_str()]));
            std::iter::once(name.clone()).chain(cells).collect()
        })
        .collect();
    let mut text = String::new();
    for row in 0..=items.len() {
        let cells = columns.iter().map(|column| {
            let width = column.iter().map(String::len).max().unwrap_or(0);
            format!("{:<width$}", column[row])
        });
        text.push_str(cells.collect::<Vec<_>>().join("  ").trim_end());
        text.push('\n');
    }
    text
}

fn cell_text(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::Bool(true) => "on".to_owned(),
        Value::Bool(false) => "off".to_owned(),
        Value::String(text) if text.is_empty() => "-".to_owned(),
        Value::String(text) => text.clone(),
        Value::Number(number) => number.to_string(),
        Value::Array(items) if items.is_empty() => "-".to_owned(),
        Value::Array(items) => items.iter().map(cell_text).collect::<Vec<_>>().join(" "),
        Value::Object(_) => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_numbered_as_in_the_manual() {
        let mut words = [0; 16];
        words[0] = 1;
        words[3] = 0x8000;
        words[4] = 1;
        words[11] = 0x8000;
        assert_eq!(lines_on(&words), [1, 64, 101, 264]);
    }

    #[test]
    fn tables_have_a_heading_and_one_line_each() {
        let files = json!([{ "name": "PICK", "size": 120 }, { "name": "USER.PAR", "size": 7 }]);
        assert_eq!(table(&files), "name      size\nPICK      120\nUSER.PAR  7\n");
        assert_eq!(table(&json!([1, 2.5])), "1 2.5\n");
        assert_eq!(table(&json!([])), "(none)\n");
        assert_eq!(
            table(&json!({ "file": "", "machine_lock": false })),
            "file          -\nmachine lock  off\n"
        );
    }
}
