//! What a debugger does by the control interface: rules of breakpoints, steps of a task, calls with their variables, assignments.

use serde_json::{Value, json};
use ts3100_emulator::embed::Event;
use ts3100_tests::bench::{Bench, running};

/// Calls PART three times; its statements are in the lines 10 to 12, those of the main program in 5 to 8.
const CALLS: &str = "GLOBAL\nN = 0\nEND\nPROGRAM TEST\nLOOP:\nN = N + 1\nPART(N)\nIF N < 3 THEN GOTO LOOP\nEND\n\
    PROGRAM PART(K)\nM = K * 2\nDOUT(5)\nRETURN\nEND\n";

/// Reason of the stop, and the line of the innermost call of the main program.
fn stop(robot: &Bench) -> (String, u64) {
    let stack = robot.get("/program/stack");
    let reason = stack["stopped"]["reason"].as_str().unwrap_or_default().to_owned();
    (reason, stack["stopped"]["line"].as_u64().unwrap_or_default())
}

fn evaluate(robot: &Bench, expression: &str) -> Value {
    let body = json!({ "expression": expression });
    robot.post("/program/evaluate", &body.to_string())["value"].clone()
}

/// Starts the program, and sees that it stops for this reason in this line.
fn goes_to(robot: &Bench, reason: &str, line: u64) {
    robot.post("/program/start", "");
    assert_eq!(stop(robot), (reason.to_owned(), line));
}

fn steps_to(robot: &Bench, kind: &str, line: u64) {
    robot.post("/program/step-task", &json!({ "kind": kind }).to_string());
    assert_eq!(stop(robot), ("step".to_owned(), line), "{kind}");
}

#[test]
fn a_breakpoint_stops_where_its_condition_is_true() {
    let robot = running(CALLS);
    let rules = json!({"lines": [12], "rules": [{"line": 5, "condition": "N == 2"}]});
    let set = robot.put("/breakpoints", &rules.to_string());
    let rule = json!({"line": 6, "condition": "N == 2"});
    assert_eq!(set, json!({"lines": [6, 12], "rules": [rule]}));
    goes_to(&robot, "breakpoint", 12);
    goes_to(&robot, "breakpoint", 12);
    goes_to(&robot, "breakpoint", 6);
    assert_eq!(evaluate(&robot, "N"), json!([2]));
    goes_to(&robot, "breakpoint", 12);
    robot.post("/program/start", "");
    assert_eq!(stop(&robot).0, "end");
}

#[test]
fn a_condition_without_a_value_stops_and_says_why() {
    let robot = running(CALLS);
    robot.put(
        "/breakpoints",
        r#"{"lines":[],"rules":[{"line":7,"condition":"1 / (N - 1) > 0"}]}"#,
    );
    goes_to(&robot, "breakpoint", 7);
    let fault = robot.get("/program/stack")["stopped"]["fault"].clone();
    assert!(fault.as_str().unwrap().contains("`1 / (N - 1) > 0`"), "{fault}");
}

#[test]
fn an_expression_that_does_not_compile_in_its_line_is_refused() {
    let robot = running(CALLS);
    robot.put("/breakpoints", r#"{"lines":[12]}"#);
    for (rule, told) in [
        (
            json!({"line": 7, "condition": "K > 1"}),
            "cannot set the breakpoint of line 7: the condition `K > 1`: K is never given a value",
        ),
        (
            json!({"line": 7, "message": "{N} of {NN}"}),
            "cannot set the breakpoint of line 7: `{NN}` in the message: NN is never given a value",
        ),
    ] {
        let body = json!({"lines": [12], "rules": [rule]}).to_string();
        assert_eq!(robot.refused(409, "PUT", "/breakpoints", &body), told);
    }
    assert_eq!(
        robot.get("/breakpoints"),
        json!({"lines": [12]}),
        "nothing has changed"
    );
    let body = json!({"lines": [], "rules": [{"line": 11, "condition": "K > 1"}]});
    robot.put("/breakpoints", &body.to_string());
}

#[test]
fn hits_are_counted_and_setting_the_same_breakpoint_again_restarts_no_count() {
    let robot = running(CALLS);
    let rules = r#"{"lines":[8],"rules":[{"line":7,"hits":"%2"}]}"#;
    robot.put("/breakpoints", rules);
    goes_to(&robot, "breakpoint", 8);
    robot.put("/breakpoints", rules);
    goes_to(&robot, "breakpoint", 7);
    assert_eq!(evaluate(&robot, "N"), json!([2]));
    let words = robot.refused(
        422,
        "PUT",
        "/breakpoints",
        r#"{"lines":[],"rules":[{"line":7,"hits":"x"}]}"#,
    );
    assert!(words.contains("`x`"), "{words}");
}

#[test]
fn a_message_is_an_event_and_stops_nothing() {
    let robot = running(CALLS);
    let body = r#"{"lines":[],"rules":[{"line":7,"message":"part {N * 10}"}]}"#;
    robot.put("/breakpoints", body);
    robot.post("/program/start", "");
    assert_eq!(stop(&robot).0, "end");
    let said = robot
        .emulator
        .events()
        .into_iter()
        .filter_map(|event| match event {
            Event::Breakpoint {
                line: 7,
                task: 1,
                text,
            } => Some(text),
            _ => None,
        });
    let said: Vec<String> = said.collect();
    assert_eq!(said, ["part 10", "part 20", "part 30"]);
}

#[test]
fn a_task_steps_over_into_and_out_of_a_call() {
    let robot = running(CALLS);
    steps_to(&robot, "over", 7);
    steps_to(&robot, "over", 8);
    steps_to(&robot, "into", 6);
    steps_to(&robot, "into", 7);
    steps_to(&robot, "into", 11);
    let stack = robot.get("/program/stack");
    let calls = stack["tasks"][0]["calls"].as_array().unwrap();
    let places: Vec<String> = calls
        .iter()
        .map(|call| format!("{} {}", call["program"], call["line"]))
        .collect();
    assert_eq!(places, ["\"TEST\" 7", "\"PART\" 11"]);
    assert_eq!(calls[1]["locals"][0]["name"], "K");
    assert_eq!(calls[1]["locals"][0]["value"], json!([2]));
    steps_to(&robot, "out", 8);
    robot.put("/breakpoints", r#"{"lines":[12]}"#);
    robot.post("/program/step-task", r#"{"kind":"out"}"#);
    assert_eq!(
        stop(&robot),
        ("breakpoint".to_owned(), 12),
        "a breakpoint on the way"
    );
    let words = robot.refused(409, "POST", "/program/step-task", r#"{"kind":"over","task":7}"#);
    assert!(words.contains("task 7 does not run"), "{words}");
}

#[test]
fn a_step_goes_to_the_statement_after_the_next_motion() {
    let robot =
        running("PROGRAM TEST\nDOUT(5)\nMOVE P1\nDOUT(6)\nEND\nDATA\nPOINT P1 = 300,0,400,0,0,0,0,0\nEND\n");
    robot.post("/program/step-task", r#"{"kind":"motion"}"#);
    assert_eq!(robot.get("/program")["status"], "running");
    robot.post("/clock/advance", r#"{"seconds":20}"#);
    assert_eq!(stop(&robot), ("step".to_owned(), 4));
    assert_eq!(robot.get("/outputs/6")["on"], false);
}

#[test]
fn a_start_gives_up_a_step_that_is_under_way() {
    let robot = running("PROGRAM TEST\nDELAY 1\nDOUT(5)\nEND\n");
    robot.post("/program/step-task", r#"{"kind":"over"}"#);
    robot.post("/program/start", "");
    robot.post("/clock/advance", r#"{"seconds":4}"#);
    assert_eq!(stop(&robot).0, "end");
    assert_eq!(robot.get("/outputs/5")["on"], true);
}

#[test]
fn a_stop_has_its_reason() {
    let robot = running("PROGRAM TEST\nDELAY 1\nDELAY 1\nA = 1 / 0\nEND\n");
    assert_eq!(robot.get("/program/stack").get("stopped"), None);
    robot.post("/program/start", "");
    assert_eq!(robot.get("/program/stack").get("stopped"), None, "while it runs");
    robot.post("/program/stop", "");
    robot.post("/clock/advance", r#"{"seconds":1}"#);
    assert_eq!(stop(&robot), ("stop".to_owned(), 3));
    robot.post("/program/start", "");
    robot.post("/clock/advance", r#"{"seconds":1}"#);
    assert_eq!(stop(&robot).0, "alarm");
    robot.post("/alarms/reset", "");
    robot.post("/program/reset", "");
    assert_eq!(robot.get("/program/stack").get("stopped"), None, "after a reset");
}

#[test]
fn a_variable_of_a_call_is_given_a_value_while_the_program_is_stopped() {
    let robot = running(CALLS);
    robot.put("/breakpoints", r#"{"lines":[12]}"#);
    robot.post("/program/start", "");
    let set = robot.post("/program/assign", r#"{"assignment":"M = K + 40"}"#);
    assert_eq!((&set["name"], &set["value"]), (&json!("M"), &json!([41])));
    let body = r#"{"assignment":"N = 2","call":0}"#;
    robot.post("/program/assign", body);
    let locals = robot.get("/program/stack")["tasks"][0]["calls"][1]["locals"].clone();
    assert_eq!(locals[1]["value"], json!([41]), "{locals}");
    assert_eq!(evaluate(&robot, "N"), json!([2]));
    for (body, told) in [
        (r#"{"assignment":"N"}"#, "expected NAME = VALUE"),
        (r#"{"assignment":"NN = M"}"#, "cannot set NN"),
    ] {
        let words = robot.refused(409, "POST", "/program/assign", body);
        assert!(words.contains(told), "{words}");
    }
    robot.refused(
        404,
        "POST",
        "/program/assign",
        r#"{"assignment":"N = 1","call":2}"#,
    );
    robot.refused(404, "POST", "/program/evaluate", r#"{"expression":"N","task":9}"#);
    robot.refused(409, "POST", "/program/evaluate", r#"{"expression":"N = 1"}"#);
    robot.refused(409, "POST", "/program/evaluate", r#"{"expression":"N +"}"#);
    assert_eq!(evaluate(&robot, "N"), json!([2]));
}

#[test]
fn no_variable_of_a_running_program_is_given_a_value() {
    let robot = running("GLOBAL\nN = 0\nEND\nPROGRAM TEST\nDELAY 1\nEND\n");
    robot.post("/program/start", "");
    let words = robot.refused(409, "POST", "/program/assign", r#"{"assignment":"N = 1"}"#);
    assert_eq!(words, "cannot set N: the program is running; stop it first");
}

#[test]
fn rules_and_steps_survive_a_snapshot() {
    let robot = running(CALLS);
    let rules = r#"{"lines":[],"rules":[{"line":7,"condition":"N > 0","hits":">=2"}]}"#;
    let set = robot.put("/breakpoints", rules);
    goes_to(&robot, "breakpoint", 7);
    robot.put("/snapshots/here", "");
    robot.put("/breakpoints", r#"{"lines":[]}"#);
    robot.post("/program/start", "");
    robot.post("/snapshots/here/restore", "");
    assert_eq!(robot.get("/breakpoints"), set);
    assert_eq!(stop(&robot), ("breakpoint".to_owned(), 7));
    goes_to(&robot, "breakpoint", 7);
    assert_eq!(evaluate(&robot, "N"), json!([3]));
}

#[test]
fn breakpoints_stay_through_a_power_cycle() {
    let robot = running(CALLS);
    let rules = r#"{"lines":[12],"rules":[{"line":6,"condition":"N == 2"}]}"#;
    let set = robot.put("/breakpoints", rules);
    goes_to(&robot, "breakpoint", 12);
    robot.post("/power/cycle", "");
    assert_eq!(robot.get("/breakpoints"), set);
    robot.put("/servo", r#"{"on":true}"#);
    goes_to(&robot, "breakpoint", 12);
}
