//! The calls that the page for people adds: tables of lines, decoded texts, coverage, the scenario, checked programs.

use serde_json::{Value, json};
use ts3100_tests::bench::{Bench, builder};
use ts3100_tests::host::Host as _;

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

#[test]
fn the_status_frame_is_what_sf_would_tell_this_host() {
    let robot = Bench::start(builder().servo_on(true));
    let field = |key: &str| {
        let fields = robot.get("/status-frame");
        let field = entry(&fields, "key", key);
        (field["value"].clone(), field["meaning"].clone())
    };
    assert_eq!(field("sf.servo"), (json!("on"), Value::Null));
    assert_eq!(field("sf.alarm.1"), (json!("none"), Value::Null));
    let mut host = robot.host();
    assert_eq!(field("sf.su-request").0, "off");
    robot.put("/override", r#"{"percent":35}"#);
    assert_eq!(field("sf.su-request").0, "on");
    assert_eq!(host.sf()[3], 1, "reading it has changed nothing");
    robot.put("/emergency-stop", r#"{"pressed":true}"#);
    assert_eq!(
        field("sf.alarm.1"),
        (json!("8-014"), json!("Emergency Stop SW ON"))
    );
    let (outputs, names) = field("sf.output.system.4");
    assert!(
        outputs.as_str().unwrap().starts_with("Dout249 ") && names.as_str().unwrap().starts_with("EMG_ST "),
        "{outputs} {names}"
    );
    robot.put("/inputs/3", r#"{"on":true}"#);
    assert_eq!(field("sf.input.general.1"), (json!("Din3"), Value::Null));
    assert_eq!(field("sf.joint.1").1, "degrees");
}

#[test]
fn texts_of_both_sides_are_split_into_fields() {
    let robot = Bench::start(builder());
    let decode = |direction: &str, command: Value, hex: &str| {
        let body = json!({"direction": direction, "command": command, "hex": hex});
        robot.post("/decode", &body.to_string())["fields"].clone()
    };
    let host = decode("host", Value::Null, "02 49572C332031 0D 03");
    assert_eq!(
        entry(&host, "key", "iw.line.1"),
        &json!({"key": "iw.line.1", "name": "line 1", "value": "`3`", "start": 4, "end": 5})
    );
    let wrong = decode("host", Value::Null, "0253580d03");
    assert_eq!(
        entry(&wrong, "key", "error"),
        &json!({"key": "error", "name": "what is wrong", "value": "unknown command \"SX\"", "start": 1, "end": 3})
    );
    let mut peer = robot.dial(ts3100_controller::port::Port::Ip0);
    peer.command("SU");
    let sf = peer.sf();
    let hex: String = [b"\x02FL,", sf.as_slice(), b"\x1a\x03"]
        .concat()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    let fields = decode("controller", json!("sf"), &hex);
    assert_eq!(
        entry(&fields, "key", "sf.servo"),
        &json!({"key": "sf.servo", "name": "servo power", "value": "0 (off)", "start": 4, "end": 5})
    );
    let ng = decode("controller", Value::Null, "024e470d03");
    assert_eq!(entry(&ng, "key", "reply")["value"], "`NG\\r`");
    let part = decode("host", json!("DL"), "0258580d03");
    assert_eq!(
        entry(&part, "key", "text.data")["value"],
        "`XX\\r`",
        "a part of a file"
    );
    let opening = decode("host", json!("DL"), "02444c2c410d03");
    assert_eq!(entry(&opening, "key", "dl.file")["value"], "`A`");
    assert_eq!(
        decode("controller", json!("RS,ERR"), "4f4b0d03")[0]["key"],
        "reply"
    );
    assert_eq!(
        decode("controller", json!("\u{e9}"), "4f4b0d03")[0]["key"],
        "reply"
    );
    for body in [
        r#"{"direction":"host","hex":"024"}"#,
        r#"{"direction":"host","hex":"zz"}"#,
        r#"{"direction":"peer","hex":""}"#,
        r#"{"direction":"host"}"#,
    ] {
        robot.refused(422, "POST", "/decode", body);
    }
    let long = json!({"direction": "host", "hex": "41".repeat(4_097)}).to_string();
    let words = robot.refused(422, "POST", "/decode", &long);
    assert!(words.contains("at most 4096 bytes, found 4097"), "{words}");
}

#[test]
fn coverage_counts_from_the_start_or_the_last_reset() {
    let robot = Bench::start(builder());
    let none = robot.get("/coverage");
    assert_eq!((&none["version"], &none["reached"]), (&json!(1), &json!(0)));
    assert!(none["reachable"].as_u64().unwrap() > 100, "{none}");
    let mut host = robot.host();
    host.command("SU");
    host.command("RN");
    let count = |coverage: &Value, command: &str, outcome: &str| {
        let mut cells = coverage["cells"].as_array().unwrap().iter();
        let found = cells.find(|cell| {
            (&cell["command"], &cell["outcome"], &cell["mode"])
                == (&json!(command), &json!(outcome), &json!("EXT (ETHER)"))
        });
        found.map_or(0, |cell| cell["count"].as_u64().unwrap())
    };
    let coverage = robot.get("/coverage");
    assert_eq!(
        (
            count(&coverage, "SU", "served"),
            count(&coverage, "RN", "refused")
        ),
        (2, 1)
    );
    assert_eq!(coverage["reached"], 1, "a refusal is required nowhere");
    robot.post("/reset", "");
    assert_eq!(robot.get("/coverage"), none);
    let mut host = robot.host();
    host.command("SO");
    assert_eq!(count(&robot.get("/coverage"), "SU", "served"), 1);
    let report = robot.emulator.coverage();
    let all = report.cells.iter().filter(|cell| cell.command == "SU");
    let sum: u64 = all.map(|cell| cell.count).sum();
    assert_eq!(sum, 3, "the report of the run forgets nothing");
}

#[test]
fn without_a_scenario_the_call_says_how_to_give_one() {
    let robot = Bench::start(builder());
    let words = robot.refused(404, "GET", "/scenario", "");
    assert!(words.contains("`ts3100 serve --scenario FILE`"), "{words}");
}

#[test]
fn a_text_or_a_file_is_checked_without_being_stored() {
    let robot = Bench::start(builder().file("TEST", "PROGRAM TEST\nMOV P1\nEND\n"));
    let files = robot.get("/files");
    let check = |body: Value| robot.post("/check", &body.to_string());
    assert_eq!(
        check(json!({"text": "PROGRAM T\nPRINT 1\nEND\n"})),
        json!([]),
        "nothing is wrong"
    );
    let wrong = check(json!({"text": "PROGRAM T\nN = 1 ' \u{e9}\n  \u{e9}MOV P1\nEND\n"}));
    let first = entry(&wrong, "line", 2);
    assert_eq!(
        (
            &first["column"],
            &first["length"],
            &first["severity"],
            &first["code"]
        ),
        (&json!(9), &json!(1), &json!("error"), &json!("E0004")),
        "{first}"
    );
    let file = check(json!({"file": "test"}));
    assert_eq!(file[0]["docs"], "/book/explain/E0103", "{file}");
    assert_eq!(robot.get("/files"), files);
    robot.refused(404, "POST", "/check", r#"{"file":"GONE"}"#);
    robot.refused(422, "POST", "/check", r#"{"name":"A","content":""}"#);
    for (body, found) in [("{}", "neither"), (r#"{"text":"END","file":"PICK"}"#, "both")] {
        let problem = robot.refused(422, "POST", "/check", body);
        let expected = format!("expected either `text` or `file`, found {found}");
        assert!(problem.contains(&expected), "{problem}");
    }
    let large = json!({"text": "A".repeat(100_000)});
    assert_eq!(check(large).as_array().unwrap().len(), 1, "too large a program");
    let huge = json!({"text": "A".repeat(300_000)}).to_string();
    robot.refused(413, "POST", "/check", &huge);
}
