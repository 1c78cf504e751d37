//! What somebody at the teach pendant does by the control interface: jogging, breakpoints, steps, running to a line.

use serde_json::{Value, json};
use std::io::Write as _;
use std::thread::yield_now;
use ts3100_tests::bench::{Bench, running};
use ts3100_tests::host::Host as _;

/// Statements are in the lines 6 to 9.
const LOOP: &str = "GLOBAL\nN = 0\nEND\nPROGRAM TEST\nLOOP:\nN = N + 1\nDOUT(5)\nREMARK here\nDOUT(-5)\nIF N < 3 THEN GOTO LOOP\n\
    END\n";

fn line(robot: &Bench) -> Value {
    let program = robot.get("/program");
    assert_ne!(program["status"], "running");
    program["line"].clone()
}

fn variable(robot: &Bench, name: &str) -> f64 {
    let variable = robot.get(&format!("/variables/{name}"));
    variable["value"][0]
        .as_f64()
        .unwrap_or_else(|| panic!("{variable}"))
}

fn first_joint(robot: &Bench) -> f64 {
    robot.get("/arm/pose")["joints"][0].as_f64().unwrap()
}

#[test]
fn the_program_stops_before_each_breakpoint() {
    let robot = running(LOOP);
    let set = robot.put("/breakpoints", r#"{"lines":[8, 6]}"#);
    assert_eq!(
        set,
        json!({"lines": [6, 9]}),
        "a line without a statement stands for the next"
    );
    robot.post("/program/start", "");
    assert_eq!(
        (line(&robot), variable(&robot, "N")),
        (json!(9), 1.0),
        "not at the line where it stood"
    );
    assert_eq!(robot.get("/outputs/5")["on"], true, "line 9 is still to come");
    robot.post("/program/start", "");
    assert_eq!((line(&robot), variable(&robot, "N")), (json!(6), 1.0));
    robot.put("/breakpoints", r#"{"lines":[]}"#);
    robot.post("/program/start", "");
    assert_eq!(variable(&robot, "N"), 3.0);
    assert_eq!(robot.get("/program")["status"], "stop (reset)");
}

#[test]
fn a_start_leaves_a_breakpoint_in_what_a_monitor_runs() {
    let robot =
        running("PROGRAM TEST\nON DIN(1) DO HANDLER\nDELAY 3\nEND\nPROGRAM HANDLER\nDOUT(5)\nDOUT(6)\nEND\n");
    robot.put("/breakpoints", r#"{"lines":[6, 7]}"#);
    robot.post("/program/start", "");
    robot.put("/inputs/1", r#"{"on":true}"#);
    let outputs = || [5, 6].map(|output| robot.get(&format!("/outputs/{output}"))["on"] == true);
    // At a breakpoint the statement under way ends first.
    let mut found = Vec::new();
    for _ in 0..3 {
        robot.post("/clock/advance", r#"{"seconds":4}"#);
        found.push(outputs());
        robot.post("/program/start", "");
    }
    assert_eq!(found, [[false, false], [true, false], [true, true]]);
}

#[test]
fn a_breakpoint_stops_a_task_too() {
    let robot =
        running("PROGRAM TEST\nI = TASK(\"SUB\")\nDELAY 1\nEND\nPROGRAM SUB\nDOUT(5)\nDOUT(6)\nEND\n");
    robot.put("/breakpoints", r#"{"lines":[7]}"#);
    let outputs = || [5, 6].map(|output| robot.get(&format!("/outputs/{output}"))["on"] == true);
    robot.post("/program/start", "");
    robot.post("/clock/advance", r#"{"seconds":4}"#);
    assert_ne!(robot.get("/program")["status"], "running");
    assert_eq!(outputs(), [true, false]);
    robot.post("/program/start", "");
    robot.post("/clock/advance", r#"{"seconds":4}"#);
    assert_eq!(outputs(), [true, true]);
}

/// RESTORE of one task inserts a line above the breakpoint at which another stands since the last start.
#[test]
fn a_start_leaves_a_breakpoint_whose_line_moves_before_the_task_goes_on() {
    let robot = running(
        "GLOBAL\nDIM T(3) AS INTEGER\nN = 0\nEND\nPROGRAM TEST\nI = TASK(\"SUB\")\nN = 1\nDOUT(5)\nEND\n\
         PROGRAM SUB\nT(2) = 9\nRESTORE T\nSWITCH\nEND\n",
    );
    robot.put("/breakpoints", r#"{"lines":[7, 12]}"#);
    robot.post("/program/start", "");
    assert_eq!(variable(&robot, "N"), 0.0);
    assert_eq!(
        robot.get("/breakpoints"),
        json!({"lines": [7, 12]}),
        "before RESTORE"
    );
    robot.post("/program/start", "");
    robot.post("/clock/advance", r#"{"seconds":4}"#);
    assert_eq!(robot.get("/breakpoints"), json!({"lines": [8, 13]}));
    assert_eq!(variable(&robot, "N"), 1.0);
}

#[test]
fn a_host_learns_of_a_breakpoint_as_of_a_stop() {
    let robot = running(LOOP);
    let mut host = robot.host();
    robot.put("/breakpoints", r#"{"lines":[7]}"#);
    assert_eq!(host.command("RN"), "OK");
    robot.post("/clock/advance", r#"{"seconds":1}"#);
    assert_eq!(host.text(), b"SP\r");
    assert_eq!(line(&robot), 7);
}

#[test]
fn breakpoints_are_of_the_selected_file() {
    let robot = running(LOOP);
    let words = robot.refused(409, "PUT", "/breakpoints", r#"{"lines":[99]}"#);
    assert!(
        words.contains("no statement is in line 99 or after it"),
        "{words}"
    );
    robot.put("/breakpoints", r#"{"lines":[7]}"#);
    robot.put("/files/OTHER", &json!({"text": LOOP}).to_string());
    robot.post("/files/TEST/select", "");
    assert_eq!(robot.get("/breakpoints"), json!({"lines": [7]}), "the same file");
    robot.post("/files/OTHER/select", "");
    assert_eq!(robot.get("/breakpoints"), json!({"lines": []}));
}

#[test]
fn breakpoints_stay_at_their_statements_when_a_line_is_inserted_into_the_file() {
    // Statements are in the lines 7, 8, 10 and 11, and one line further down after the insertion.
    let robot = running(&LOOP.replace("N = 0\n", "N = 0\nDIM T(3) AS INTEGER\n"));
    robot.put("/breakpoints", r#"{"lines":[8, 10]}"#);
    robot.post("/program/start", "");
    assert_eq!(line(&robot), 8);
    robot.put("/variables/T(2)", r#"{"value":[9],"restore":true}"#);
    assert_eq!(robot.get("/breakpoints"), json!({"lines": [9, 11]}));
    assert_eq!(line(&robot), 9);
    robot.post("/program/start", "");
    assert_eq!((line(&robot), variable(&robot, "N")), (json!(11), 1.0));
    robot.post("/program/start", "");
    assert_eq!((line(&robot), variable(&robot, "N")), (json!(9), 2.0));
}

#[test]
fn a_program_that_restores_its_data_stops_at_its_breakpoints_and_where_it_runs_to() {
    let source = "GLOBAL\nDIM T(3) AS INTEGER\nN = 0\nEND\nPROGRAM TEST\nGOTO BEGIN\nAGAIN:\nN = N + 1\nBEGIN:\nT(2) = 9\n\
        RESTORE T\nGOTO AGAIN\nEND\n";
    let robot = running(source);
    robot.put("/breakpoints", r#"{"lines":[8, 11]}"#);
    robot.post("/program/start", "");
    assert_eq!(line(&robot), 11, "before RESTORE, which inserts a line");
    robot.post("/program/start", "");
    assert_eq!((line(&robot), variable(&robot, "N")), (json!(9), 0.0));
    assert_eq!(robot.get("/breakpoints"), json!({"lines": [9, 12]}));
    let robot = running(source);
    robot.post("/program/run-to", r#"{"line":8}"#);
    assert_eq!((line(&robot), variable(&robot, "N")), (json!(9), 0.0));
}

#[test]
fn breakpoints_of_a_file_that_was_downloaded_again_are_set_in_its_new_lines() {
    let robot = running(LOOP);
    robot.post("/program/start", "");
    let put = |text: &str| robot.put("/files/TEST", &json!({"text": text}).to_string());
    put(&format!("REMARK one more line\n{LOOP}"));
    let set = robot.put("/breakpoints", r#"{"lines":[6, 9]}"#);
    assert_eq!(set, json!({"lines": [7, 10]}));
    assert_eq!(variable(&robot, "N"), 3.0, "the file is taken by the next start");
    robot.post("/program/start", "");
    assert_eq!((line(&robot), variable(&robot, "N")), (json!(10), 1.0));
    put("PROGRAM TEST\nN = 1\nEND\n");
    let set = robot.put("/breakpoints", r#"{"lines":[2, 10]}"#);
    assert_eq!(set, json!({"lines": [2]}), "line 10 is behind the end by now");
    put("PROGRAM TEST\nNOPE\nEND\n");
    let words = robot.refused(409, "PUT", "/breakpoints", r#"{"lines":[2]}"#);
    assert!(
        words.starts_with("cannot set the breakpoints: file TEST has errors"),
        "{words}"
    );
}

#[test]
fn breakpoints_and_steps_survive_a_snapshot() {
    let robot = running(LOOP);
    robot.put("/breakpoints", r#"{"lines":[7]}"#);
    robot.post("/program/start", "");
    robot.put("/snapshots/here", "");
    robot.put("/breakpoints", r#"{"lines":[]}"#);
    robot.post("/snapshots/here/restore", "");
    assert_eq!(robot.get("/breakpoints"), json!({"lines": [7]}));
    robot.post("/program/start", "");
    assert_eq!((line(&robot), variable(&robot, "N")), (json!(7), 2.0));
}

#[test]
fn a_step_is_one_statement() {
    let robot = running(LOOP);
    let mut lines = Vec::new();
    for _ in 0..4 {
        robot.post("/program/step", "");
        lines.push(line(&robot));
    }
    assert_eq!(lines, [json!(7), json!(9), json!(10), json!(6)]);
    assert_eq!(
        robot.get("/run-mode")["mode"],
        "cycle",
        "the operation mode stays"
    );
    robot.put("/feed-hold", r#"{"on":true}"#);
    let words = robot.refused(409, "POST", "/program/step", "");
    assert_eq!(words, "cannot run a step: feed hold is on; release it first");
}

#[test]
fn the_program_runs_to_a_line_once() {
    let robot = running(LOOP);
    robot.post("/program/run-to", r#"{"line":10}"#);
    assert_eq!((line(&robot), variable(&robot, "N")), (json!(10), 1.0));
    robot.post("/program/run-to", r#"{"line":10}"#);
    assert_eq!(
        (line(&robot), variable(&robot, "N")),
        (json!(10), 2.0),
        "the next time it comes there"
    );
    robot.post("/program/start", "");
    assert_eq!(variable(&robot, "N"), 3.0, "once");
    robot.refused(409, "POST", "/program/run-to", r#"{"line":99}"#);
    robot.refused(422, "POST", "/program/run-to", r#"{"line":0}"#);
    let before = robot.get("/breakpoints");
    for lines in ["[0]", "[8,0]"] {
        let body = format!(r#"{{"lines":{lines}}}"#);
        let problem = robot.refused(422, "PUT", "/breakpoints", &body);
        assert!(
            problem.contains("lines") && problem.contains("1 or more"),
            "{problem}"
        );
    }
    assert_eq!(robot.get("/breakpoints"), before);
}

#[test]
fn the_arm_is_jogged_in_teaching() {
    let robot = running(LOOP);
    let plus = r#"{"axis":1,"direction":"plus","coordinates":"joint","speed":"mid"}"#;
    let words = robot.refused(409, "POST", "/jog", plus);
    assert_eq!(
        words,
        "cannot jog axis 1: the key switch is not in TEACHING; turn it first"
    );
    robot.put("/key-switch", r#"{"position":"teaching"}"#);
    let before = first_joint(&robot);
    assert_eq!(robot.post("/jog", plus)["moving"], true);
    robot.post("/clock/advance", r#"{"seconds":1}"#);
    robot.post("/jog/stop", "");
    robot.post("/clock/advance", r#"{"seconds":1}"#);
    let there = first_joint(&robot);
    assert!(there > before + 5.0, "{before} {there}");
    assert_eq!(robot.get("/arm/pose")["moving"], false);
    let guide = &robot.get("/state")["guide"];
    assert_eq!(
        *guide,
        json!({"coordinate": 0, "rate": 1, "mode": 0}),
        "shown by SF as well"
    );
    let inch = r#"{"axis":3,"direction":"minus","coordinates":"world","speed":"fast","inching":true}"#;
    let z = |robot: &Bench| robot.get("/arm/pose")["world"][2].as_f64().unwrap();
    let high = z(&robot);
    robot.post("/jog", inch);
    robot.post("/clock/advance", r#"{"seconds":5}"#);
    assert!((high - z(&robot) - 10.0).abs() < 1e-6, "one step of 10 mm");
    robot.put("/servo", r#"{"on":false}"#);
    let words = robot.refused(409, "POST", "/jog", plus);
    assert_eq!(words, "cannot jog axis 1: servo power is off");
}

#[test]
fn no_jog_exceeds_250_mm_a_second() {
    let robot = running(LOOP);
    robot.put("/key-switch", r#"{"position":"teaching"}"#);
    robot.post(
        "/jog",
        r#"{"axis":1,"direction":"plus","coordinates":"joint","speed":"fast"}"#,
    );
    let point = |robot: &Bench| {
        let arm = robot.get("/arm");
        [0, 1, 2].map(|at| arm["tool_point"][at].as_f64().unwrap())
    };
    let mut last = point(&robot);
    let mut fastest = 0.0_f64;
    for _ in 0..20 {
        robot.post("/clock/advance", r#"{"seconds":0.05}"#);
        let next = point(&robot);
        let way: f64 = next
            .iter()
            .zip(last)
            .map(|(next, last)| (next - last).powi(2))
            .sum();
        fastest = fastest.max(way.sqrt() / 0.05);
        last = next;
    }
    assert!(fastest > 100.0 && fastest < 250.5, "{fastest} mm/s");
}

#[test]
fn a_key_that_is_held_is_let_go_when_the_call_ends() {
    let robot = running(LOOP);
    robot.put("/key-switch", r#"{"position":"teaching"}"#);
    let body = r#"{"axis":1,"direction":"plus","coordinates":"joint","speed":"slow","hold":true}"#;
    let mut held = ts3100_tests::host::dial_address(robot.emulator.control().unwrap());
    let head = "POST /jog HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n";
    write!(held, "{head}Content-Length: {}\r\n\r\n{body}", body.len()).unwrap();
    let moves = |robot: &Bench| robot.get("/arm/pose")["moving"].as_bool().unwrap();
    while !moves(&robot) {
        yield_now();
    }
    robot.post("/clock/advance", r#"{"seconds":1}"#);
    assert!(moves(&robot), "the key is still held");
    drop(held);
    while moves(&robot) {
        robot.post("/clock/advance", r#"{"seconds":0.1}"#);
    }
    assert!(
        first_joint(&robot) < 90.0,
        "it rests long before the limit of the axis"
    );
}

#[test]
fn the_key_switch_ends_a_jog() {
    let robot = running(LOOP);
    robot.put("/key-switch", r#"{"position":"teaching"}"#);
    robot.post(
        "/jog",
        r#"{"axis":1,"direction":"plus","coordinates":"joint","speed":"slow"}"#,
    );
    robot.post("/clock/advance", r#"{"seconds":0.5}"#);
    robot.put("/key-switch", r#"{"position":"ext"}"#);
    robot.post("/clock/advance", r#"{"seconds":1}"#);
    assert_eq!(robot.get("/arm/pose")["moving"], false);
}
