//! Fuzzes the snapshot files: an object is read as a file; anything else is changes of a file of `fixtures/snapshots`, and
//! what happens to the controller afterwards.
//!
//! A snapshot is refused with a message, or the controller is written and read again as it is. It continues without a panic,
//! and a snapshot of what it has become is valid, too. Random bytes hardly ever are a snapshot, hence the changes: what they
//! leave as it was is valid.

use super::shared::{Choices, Robot};
use serde_json::{Value, json};
use std::sync::OnceLock;
use ts3100_controller::{Input, Port};
use ts3100_driver::snapshot::{from_json, to_json_line};

/// The files that are changed; their places are in the inputs, so that more come at the end.
const FILES: [&str; 14] = [
    include_str!("../../fixtures/snapshots/v1/scara-alarm.json"),
    include_str!("../../fixtures/snapshots/v1/scara-do.json"),
    include_str!("../../fixtures/snapshots/v1/scara-download.json"),
    include_str!("../../fixtures/snapshots/v1/scara-off.json"),
    include_str!("../../fixtures/snapshots/v1/scara-step.json"),
    include_str!("../../fixtures/snapshots/v1/scara-variation.json"),
    include_str!("../../fixtures/snapshots/v1/scara-watchdog-input.json"),
    include_str!("../../fixtures/snapshots/v1/six-axis-emergency-stop.json"),
    include_str!("../../fixtures/snapshots/v1/six-axis-fault.json"),
    include_str!("../../fixtures/snapshots/v1/six-axis-jog.json"),
    include_str!("../../fixtures/snapshots/v1/six-axis-running.json"),
    include_str!("../../fixtures/snapshots/v1/six-axis-serial.json"),
    include_str!("../../fixtures/snapshots/v1/six-axis-tasks.json"),
    include_str!("../../fixtures/snapshots/v1/six-axis-upload-host.json"),
];
/// Most changes of a file.
const CHANGES: u8 = 8;
/// Events after a restore.
const EVENTS: u32 = 40;
/// Items of MN.
const MN_ITEMS: u8 = 17;
/// Longest message that refuses a file.
const MAX_MESSAGE: usize = 2_000;
/// Numbers at which types and bounds end.
const INTEGERS: [i64; 12] = [
    0,
    1,
    -1,
    100,
    255,
    256,
    65_535,
    4_294_967_295,
    4_294_967_296,
    9_007_199_254_740_993,
    i64::MAX,
    i64::MIN,
];
const REALS: [f64; 7] = [-0.0, 1e-300, 0.5, 1e9, 1e18, 1e300, -1e300];

fn files() -> &'static [Value] {
    static READ: OnceLock<Vec<Value>> = OnceLock::new();
    READ.get_or_init(|| {
        let read = FILES.iter().map(|text| serde_json::from_str(text));
        read.collect::<Result<_, _>>().expect("the fixtures are JSON")
    })
}

/// Nodes of a document.
fn count(value: &Value) -> usize {
    1 + match value {
        Value::Array(items) => items.iter().map(count).sum(),
        Value::Object(fields) => fields.values().map(count).sum(),
        _ => 0,
    }
}

/// The node of this number; `left` counts down to it.
fn node<'a>(value: &'a mut Value, left: &mut usize) -> Option<&'a mut Value> {
    if *left == 0 {
        return Some(value);
    }
    *left -= 1;
    match value {
        Value::Array(items) => items.iter_mut().find_map(|item| node(item, left)),
        Value::Object(fields) => fields.values_mut().find_map(|field| node(field, left)),
        _ => None,
    }
}

/// Changes one node in the way that the bytes choose.
fn change(document: &mut Value, choices: &mut Choices<'_>) {
    let nodes = count(document);
    let (mut place, mut other) = (usize::from(choices.word()) % nodes, 0);
    let kind = choices.byte() % 11;
    if kind == 10 {
        other = usize::from(choices.word()) % nodes;
    }
    let copied = node(document, &mut other).cloned().unwrap_or_default();
    let Some(place) = node(document, &mut place) else {
        return;
    };
    let which = usize::from(choices.byte());
    *place = match (kind, place.take()) {
        (0, Value::Object(mut fields)) => {
            let name = fields.keys().nth(which % fields.len().max(1)).cloned();
            name.and_then(|name| fields.shift_remove(&name));
            Value::Object(fields)
        }
        (0, Value::Array(mut items)) => {
            items.truncate(which % items.len().max(1));
            Value::Array(items)
        }
        (1, Value::Array(mut items)) => {
            items.extend(items.get(which % items.len().max(1)).cloned());
            Value::Array(items)
        }
        (1, Value::Object(mut fields)) => {
            let name = String::from_utf8_lossy(choices.chunk()).into_owned();
            let value = fields.values().nth(which % fields.len().max(1)).cloned();
            fields.insert(name, value.unwrap_or_default());
            Value::Object(fields)
        }
        (2, _) => json!(INTEGERS[which % INTEGERS.len()]),
        (3, _) => json!(REALS[which % REALS.len()]),
        (4, _) => json!(u64::MAX - u64::from(choices.word())),
        (5, _) => json!(choices.word()),
        (6, Value::Number(number)) => match (number.as_i64(), number.as_f64()) {
            (Some(number), _) => json!(number.wrapping_add(which as i64 - 128)),
            (None, number) => json!(number.unwrap_or_default() + which as f64 - 128.0),
        },
        (6, Value::Bool(on)) => json!(!on),
        (6 | 7, _) => Value::Null,
        (8, _) => json!(which % 2 == 0),
        (9, _) => json!(String::from_utf8_lossy(choices.chunk())),
        (10, _) => copied,
        (_, value) => value,
    };
}

/// Reads a snapshot and lets it continue.
///
/// # Panics
/// When what must hold does not.
pub fn check(data: &[u8]) {
    let mut choices = Choices(data);
    let text = if data.trim_ascii_start().starts_with(b"{") {
        choices = Choices(&[]);
        String::from_utf8_lossy(data).into_owned()
    } else {
        let which = usize::from(choices.byte());
        let mut document = files()[which % FILES.len()].clone();
        for _ in 0..choices.byte() % (CHANGES + 1) {
            change(&mut document, &mut choices);
        }
        document.to_string()
    };
    let controller = match from_json(&text) {
        Ok(controller) => controller,
        Err(refused) => {
            let message = refused.to_string();
            assert!(!message.is_empty() && message.len() < MAX_MESSAGE, "{message}");
            return;
        }
    };
    let written = to_json_line(&controller);
    let again = from_json(&written).unwrap_or_else(|refused| panic!("what is written is refused: {refused}"));
    assert!(again == controller, "another controller is read again");
    assert_eq!(to_json_line(&again), written);
    let mut robot = Robot::resumed(controller);
    for _ in 0..EVENTS {
        if choices.is_empty() {
            break;
        }
        robot.act(&mut choices);
    }
    robot.advance(2_000);
    robot.new_host();
    let commands = ["SU", "SF", "EU", "PR,1"].map(String::from);
    for command in commands
        .into_iter()
        .chain((1..=MN_ITEMS).map(|item| format!("MN,{item}")))
    {
        for text in [command.as_str(), "OK", "OK"] {
            let text = [b"\x02", text.as_bytes(), b"\r\x03"].concat();
            robot.feed(Input::received(Port::Ip0, text));
        }
        robot.advance(300);
    }
    robot.advance(8_000);
    let written = to_json_line(&robot.seat.controller);
    let later = from_json(&written);
    assert!(
        later.is_ok(),
        "what it has become is refused: {}",
        later.unwrap_err()
    );
}
