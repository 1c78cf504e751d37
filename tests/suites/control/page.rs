//! The calls that the page for people adds: tables of lines, decoded texts, coverage, the scenario, checked programs.

use serde_json::{Value, json};
use ts3100_tests::bench::{Bench, builder};

/// The entry of an array whose `key` has this value.
fn entry<'a>(list: &'a Value, key: &str, value: impl Into<Value>) -> &'a Value {
    let value = value.into();
    let mut entries = list.as_array().unwrap().iter();
    let found = entries.find(|entry| entry[key] == value);
    found.unwrap_or_else(|| panic!("{key}={value}: {list}"))
}

#[test]
fn every_line_has_its_number_its_name_and_its_state() {
    let robot = Bench::start(builder());
    robot.put("/inputs/3", r#"{"on":true}"#);
    robot.put("/outputs/250/force", r#"{"on":true}"#);
    let lines = robot.get("/lines");
    for direction in ["inputs", "outputs"] {
        let numbers: Vec<u64> = lines[direction]
            .as_array()
            .unwrap()
            .iter()
            .map(|line| line["line"].as_u64().unwrap())
            .collect();
        let all: Vec<u64> = [1, 101, 201, 301, 401]
            .into_iter()
            .flat_map(|first| first..first + 64)
            .collect();
        assert_eq!(numbers, all, "{direction}");
    }
    let (inputs, outputs) = (&lines["inputs"], &lines["outputs"]);
    assert_eq!(
        entry(inputs, "line", 3),
        &json!({"line": 3, "on": true, "forced": false})
    );
    assert_eq!(
        entry(inputs, "name", "STROBE"),
        &json!({"line": 249, "name": "STROBE", "on": false, "forced": false})
    );
    assert_eq!(
        entry(outputs, "name", "SV_RDY"),
        &json!({"line": 250, "name": "SV_RDY", "on": true, "forced": true})
    );
    assert_eq!(robot.get("/outputs/201")["name"], "OPEN1");
    assert_eq!(entry(outputs, "name", "SYS_RDY")["on"], true);
}
