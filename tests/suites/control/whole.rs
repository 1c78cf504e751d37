//! The whole robot at once: its state, its transcript, its snapshots; and other ways to say the same.

use serde_json::json;
use std::io::Write as _;
use ts3100_controller::port::Port;
use ts3100_tests::bench::{Bench, builder, running};
use ts3100_tests::host::Host;

const DATA: &str = "GLOBAL\nCOUNT = 3\nX = 1.5\nDIM A(2) AS INTEGER\nEND\nPROGRAM TEST\nDOUT(5)\nWAIT DIN(7)\nDOUT(-5)\n\
    END\nDATA\nPOINT P1 = 300,0,400,0,0,0,0,0\nEND\n";

#[test]
fn a_snapshot_is_put_back_under_its_name() {
    let robot = running(DATA);
    let mut host = robot.host();
    let state = || (robot.get("/variables/COUNT"), robot.get("/outputs"));
    let before = state();
    let list = robot.put("/snapshots/clean", "");
    assert_eq!(list["snapshots"][0]["name"], "clean");
    robot.put("/variables/COUNT", r#"{"value":[99]}"#);
    robot.put("/outputs/5/force", r#"{"on":true}"#);
    assert_ne!(state(), before);
    robot.post("/snapshots/clean/restore", "");
    assert_eq!(state(), before);
    assert!(host.command("SU").starts_with("FL,MODE:"), "the host has stayed");
    let words = robot.refused(404, "POST", "/snapshots/dirty/restore", "");
    assert!(words.contains("one of clean"), "{words}");
    robot.refused(404, "PUT", "/snapshots/a%20b", "");
    let file = robot.get("/snapshot");
    assert_eq!(
        (&file["format"], &file["version"]),
        (&json!("ts3100-snapshot"), &json!(1))
    );
    assert_eq!(
        robot.ok("DELETE", "/snapshots/clean", ""),
        json!({"snapshots": []})
    );
}

#[test]
fn a_snapshot_goes_out_and_in_as_the_text_of_its_file() {
    let robot = running(DATA);
    robot.put("/snapshots/clean", "");
    robot.put("/variables/COUNT", r#"{"value":99}"#);
    let (status, present) = robot.call_text("GET", "/snapshot", "");
    assert!(
        status == 200 && present.starts_with("{\n  \"format\": \"ts3100-snapshot\""),
        "{present}"
    );
    let (_, clean) = robot.call_text("GET", "/snapshots/clean", "");
    assert_ne!(clean, present);
    robot.put("/snapshot", &clean);
    assert_eq!(robot.get("/variables/COUNT")["value"], json!([3]));
    robot.put("/snapshot", &present);
    assert_eq!(robot.get("/variables/COUNT")["value"], json!([99]));
    let words = robot.refused(404, "GET", "/snapshots/dirty", "");
    assert!(words.contains("one of clean"), "{words}");
    robot.refused(400, "PUT", "/snapshot", "{");
    let words = robot.refused(409, "PUT", "/snapshot", "{}");
    assert!(words.contains("format"), "{words}");
    let broken = present.replacen("\"override_percent\": 100", "\"override_percent\": 130", 1);
    let words = robot.refused(409, "PUT", "/snapshot", &broken);
    assert!(
        words.contains("panel.override_percent: expected 1 to 100, found 130"),
        "{words}"
    );
    assert_eq!(
        robot.get("/variables/COUNT")["value"],
        json!([99]),
        "nothing has changed"
    );
}

#[test]
fn a_snapshot_is_of_the_moment_it_is_taken_at() {
    let robot = Bench::start(builder().time(ts3100_emulator::clock::TimeMode::Scaled(1_000.0)));
    robot.put("/snapshots/early", "");
    robot.post("/wait", r#"{"condition":{"alarm":"any"},"within":60}"#);
    let list = robot.put("/snapshots/late", "");
    let t = |index: usize| list["snapshots"][index]["t"].as_f64().unwrap();
    assert!(t(1) - t(0) >= 60.0, "{list}");
}

#[test]
fn the_state_has_everything_in_it() {
    let robot = running(DATA);
    robot.post("/faults", r#"{"spec":"ng:command=SO,after=2"}"#);
    let mut host = robot.host();
    host.write_all(b"\x02SU\x03").unwrap();
    host.text();
    let state = robot.get("/state");
    assert_eq!(state["variables"], robot.get("/variables"));
    assert_eq!(robot.get("/variables/COUNT")["value"], json!([3]));
    assert!(state["variables"].as_array().unwrap().len() >= 4, "{state}");
    assert_eq!(state["files"], robot.get("/files"));
    assert_eq!(state["faults"], robot.get("/faults"));
    assert_eq!(state["faults"]["faults"][0]["after"], 2);
    let findings = state["findings"].as_object().unwrap();
    let rules: Vec<_> = robot
        .get("/findings")
        .as_array()
        .unwrap()
        .iter()
        .map(|one| one["rule"].clone())
        .collect();
    assert!(!rules.is_empty());
    assert_eq!(
        findings
            .values()
            .filter_map(serde_json::Value::as_u64)
            .sum::<u64>(),
        rules.len() as u64
    );
    assert!(
        rules
            .iter()
            .all(|rule| findings.contains_key(rule.as_str().unwrap())),
        "{findings:?}"
    );
}

#[test]
fn a_fault_is_armed_in_the_words_of_the_command_line() {
    let robot = running(DATA);
    let armed = robot.post("/faults", r#"{"spec":"late-reply:command=SU,delay=2s,id=7"}"#);
    assert_eq!(
        (&armed["faults"][0]["id"], &armed["faults"][0]["kind"]),
        (&json!(7), &json!("late-reply"))
    );
    let words = robot.refused(409, "POST", "/faults", r#"{"spec":"late-replay"}"#);
    assert!(words.contains("late-reply"), "{words}");
    let words = robot.refused(422, "POST", "/faults", r#"{"spec":"ng","after":1}"#);
    assert!(words.contains("remove the other keys"), "{words}");
    let words = robot.refused(422, "POST", "/faults", r#"{"kind":"ng","spec":"ng"}"#);
    assert!(words.contains("remove the other keys"), "{words}");
    for never in [
        r#"{"spec":"flipped-bit:way=in,command=SO"}"#,
        r#"{"kind":"flipped-bit","on":{"command":"SO"},"parameters":{"way":"in"}}"#,
    ] {
        let words = robot.refused(409, "POST", "/faults", never);
        assert!(
            words.contains("cannot arm flipped-bit: no occasion matches command=SO"),
            "{words}"
        );
        assert!(words.contains("leave out command, or give way=out"), "{words}");
    }
    robot.post(
        "/faults",
        r#"{"kind":"slow-line","id":8.0,"after":1.0,"on":{"block":2.0}}"#,
    );
    robot.refused(422, "POST", "/faults", r#"{"kind":"ng","after":1.5}"#);
    robot.refused(422, "POST", "/faults", r#"{"kind":"ng","on":["SU",null,null]}"#);
    robot.refused(422, "PUT", "/battery", "[true]");
    robot.refused(
        422,
        "POST",
        "/clock/advance-until",
        r#"{"condition":{"idle":[]},"within":1}"#,
    );
    let words = robot.refused(422, "POST", "/faults", "{}");
    assert!(words.contains("neither `kind` nor `spec`"), "{words}");
}

#[test]
fn channels_are_called_as_the_ready_line_calls_them() {
    let robot = running(DATA);
    assert_eq!(robot.get("/channels/ip0"), robot.get("/channels/IP0"));
    let _host = robot.host();
    robot.post("/channels/ip0/drop", "");
    assert_eq!(robot.get("/channels/IP0")["peer"], json!(null));
}

#[test]
fn the_transcript_is_there_while_everything_runs() {
    let robot = running(DATA);
    robot.put("/inputs/9", r#"{"on":true}"#);
    // A host that has nothing to acknowledge: its OK and its next command may come in one segment, and stand in one line.
    robot.dial(Port::Ip0).command("SO");
    let (status, text) = robot.call_text("GET", "/transcript", "");
    assert_eq!(status, 200);
    for line in [
        "file TEST\n",
        "! servo on\n",
        "! input 9 on\n",
        "! connect IP0 127.0.0.1\n",
        "> IP0 SO<CR>\n",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    let lines = robot.call_text("GET", "/transcript?format=jsonl", "").1;
    assert!(lines.lines().count() > 5);
    for line in lines.lines() {
        let _: serde_json::Value = serde_json::from_str(line).unwrap();
    }
    let raw = robot.raw(b"GET /transcript?format=pcapng HTTP/1.0\r\nHost: localhost\r\n\r\n");
    assert!(
        raw.contains("application/octet-stream") && raw.contains("\r\n\r\n\n\r\r\n"),
        "{raw}"
    );
    let words = robot.refused(400, "GET", "/transcript?format=xml", "");
    assert!(words.contains("jsonl"), "{words}");
    robot.put("/snapshots/a", "");
    robot.post("/snapshots/a/restore", "");
    let text = robot.call_text("GET", "/transcript", "").1;
    assert!(text.contains("! restore 0us {"), "{text}");
    robot.post("/reset", "");
    let text = robot.call_text("GET", "/transcript", "").1;
    assert!(
        text.contains("! servo on\n") && !text.contains("SO<CR>"),
        "{text}"
    );
}
