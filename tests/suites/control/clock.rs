//! Time in the hand of the test: advance, advance until, wait, the modes.

use serde_json::json;
use std::io::Write as _;
use ts3100_controller::port::Port;
use ts3100_tests::bench::{Bench, builder, running};
use ts3100_tests::host::Host;

const SLOW: &str = "PROGRAM TEST\nDELAY 3600\nDOUT(4)\nDELAY 10\nPRINT IP1, \"DONE\", CR\nDOUT(-4)\nEND\n";

#[test]
fn stepped_time_passes_only_by_advance() {
    let robot = running(SLOW);
    robot.post("/program/start", "");
    let clock = robot.get("/clock");
    assert_eq!(
        (&clock["mode"], &clock["now"], &clock["next"]),
        (&json!("stepped"), &json!(0.0), &json!(3600.0))
    );
    let ended = robot.post("/clock/advance", r#"{"seconds":3599.999999}"#);
    assert_eq!(
        ended,
        json!({"reached":true,"now":3599.999999,"passed":3599.999999})
    );
    assert_eq!(robot.get("/outputs/4")["on"], false);
    robot.post("/clock/advance", r#"{"seconds":0.000001}"#);
    assert_eq!(robot.get("/outputs/4")["on"], true);
}

/// What ends before its time has not reached it: here everything is reset while time moves through more than could ever
/// be served.
#[test]
fn an_advance_that_is_cut_short_has_not_reached_its_end() {
    let robot = running("PROGRAM TEST\nAGAIN:\nDELAY 0.001\nGOTO AGAIN\nEND\n");
    robot.post("/program/start", "");
    std::thread::scope(|scope| {
        let advance = scope.spawn(|| robot.post("/clock/advance", r#"{"seconds":2000000,"wall":600}"#));
        let moves = (0..100_000).any(|_| robot.get("/clock")["now"] != json!(0.0));
        assert!(moves, "time stands");
        robot.post("/reset", "");
        let ended = advance.join().unwrap();
        assert_eq!(ended, json!({"reached":false,"now":0.0,"passed":0.0}));
    });
    let over = robot.post("/clock/advance", r#"{"seconds":1}"#);
    assert_eq!(over, json!({"reached":true,"now":1.0,"passed":1.0}));
}

/// What the fixture of a test asks for with one call.
#[test]
fn a_reset_sets_the_mode_of_the_clock_if_it_is_told_one() {
    let robot = running(SLOW);
    robot.post("/clock/advance", r#"{"seconds":2}"#);
    robot.post("/reset", r#"{"mode":"auto"}"#);
    assert_eq!(robot.get("/clock")["mode"], json!("auto"));
    robot.post("/reset", r#"{"mode":"stepped"}"#);
    robot.post("/reset", "");
    robot.post("/reset", "{}");
    robot.post("/reset", "null");
    let clock = robot.get("/clock");
    assert_eq!((&clock["mode"], &clock["now"]), (&json!("stepped"), &json!(0.0)));
    robot.post("/clock/advance", r#"{"seconds":2}"#);
    let reason = robot.refused(422, "POST", "/reset", r#"{"mode":"sometimes"}"#);
    assert!(reason.contains("`real`, `stepped`, `auto`"), "{reason}");
    assert_eq!(robot.get("/clock")["now"], json!(2.0), "nothing was reset");
}

#[test]
fn time_advances_until_something_happens() {
    let robot = running(SLOW);
    let _peer = robot.dial(Port::Ip1);
    let _host = robot.host();
    robot.post("/program/start", "");
    let until = |condition: &str, within: f64| {
        let body = format!("{{\"condition\":{condition},\"within\":{within}}}");
        robot.post("/clock/advance-until", &body)
    };
    let at = until(r#"{"output":{"line":4,"on":true}}"#, 10_000.0);
    assert_eq!(at, json!({"reached":true,"now":3600.0,"passed":3600.0}));
    let late = until(r#"{"output":{"line":4,"on":false}}"#, 9.5);
    assert_eq!(late, json!({"reached":false,"now":3609.5,"passed":9.5}));
    let printed = until(r#"{"printed":{"channel":"IP1","text":"ONE"}}"#, 100.0);
    assert_eq!(printed["now"], 3610.0);
    let idle = until(r#"{"idle":{}}"#, 1.0);
    assert_eq!(idle["reached"], true);
    robot.post("/program/start", "");
    assert_eq!(until(r#"{"status":"running"}"#, 0.0)["reached"], true);
    let line = until(r#"{"line":5}"#, 4_000.0);
    assert_eq!(
        (&line["reached"], &line["passed"]),
        (&json!(true), &json!(3610.0))
    );
    assert_eq!(until(r#"{"alarm":"any"}"#, 5.0)["reached"], false);
    robot.post("/alarms", r#"{"number":"1-102"}"#);
    assert_eq!(until(r#"{"alarm":"1-102"}"#, 5.0)["reached"], true);
}

#[test]
fn a_wait_does_not_move_time() {
    let robot = running(SLOW);
    let words = robot.refused(
        408,
        "POST",
        "/wait",
        r#"{"condition":{"output":{"line":4,"on":true}},"within":1,"wall":0.1}"#,
    );
    assert_eq!(
        words,
        "the wait for `output 4 on` has not ended within 0.1 s of wall-clock time: the clock is stepped and shows 0 s; \
         advance it, or wait with POST /clock/advance-until"
    );
    assert_eq!(robot.get("/clock")["now"], 0.0);
    std::thread::scope(|scope| {
        let waits = scope.spawn(|| {
            robot.post(
                "/wait",
                r#"{"condition":{"input":{"line":9,"on":true}},"within":1}"#,
            )
        });
        robot.put("/inputs/9", r#"{"on":true}"#);
        assert_eq!(waits.join().unwrap()["reached"], true);
    });
    robot.put("/clock", r#"{"mode":"x1000"}"#);
    let over = robot.post("/wait", r#"{"condition":{"alarm":"any"},"within":1}"#);
    assert_eq!(over["reached"], false);
    assert!(over["passed"].as_f64().unwrap() >= 1.0, "{over}");
}

#[test]
fn an_advance_that_takes_too_long_says_how_far_it_came() {
    let robot = running("PROGRAM P\nLOOP:\nN=1\nGOTO LOOP\nEND\n");
    robot.post("/program/start", "");
    for (path, body) in [
        ("/clock/advance", r#"{"seconds":1000000,"wall":0.02}"#),
        (
            "/clock/advance-until",
            r#"{"condition":{"alarm":"any"},"within":1000000,"wall":0.02}"#,
        ),
    ] {
        let words = robot.refused(408, "POST", path, body);
        let now = robot.get("/clock")["now"].as_f64().unwrap();
        let (told, hint) = words.split_once("the clock is stepped and shows ").unwrap();
        assert!(
            told.ends_with("has not ended within 0.02 s of wall-clock time: "),
            "{words}"
        );
        let (shown, hint) = hint.split_once(" s; ").unwrap();
        assert_eq!(hint, "call again for the rest, or allow a longer `wall`");
        let shown: f64 = shown.parse().unwrap();
        assert!(
            (0.0..=now).contains(&shown) && now < 1_000_000.0,
            "{words}, {now}"
        );
    }
}

#[test]
fn the_mode_is_changed_without_a_jump() {
    let robot = Bench::start(builder());
    robot.post("/clock/advance", r#"{"seconds":100}"#);
    for mode in ["real", "x2", "auto", "stepped"] {
        let clock = robot.put("/clock", &format!("{{\"mode\":\"{mode}\"}}"));
        assert_eq!(clock["mode"], mode);
        let now = clock["now"].as_f64().unwrap();
        assert!((100.0..130.0).contains(&now), "{clock}");
    }
    let stands = robot.get("/clock")["now"].clone();
    assert_eq!(robot.get("/clock")["now"], stands);
    for mode in ["fast", "x0", "x-1", ""] {
        robot.refused(422, "PUT", "/clock", &format!("{{\"mode\":\"{mode}\"}}"));
    }
}

#[test]
fn what_cannot_be_waited_for_is_refused() {
    let robot = Bench::start(builder());
    for (status, body) in [
        (404, r#"{"condition":{"output":{"line":0,"on":true}},"within":1}"#),
        (404, r#"{"condition":{"alarm":"7-777"},"within":1}"#),
        (422, r#"{"condition":{"printed":{"text":""}},"within":1}"#),
        (422, r#"{"condition":{"moon":{}},"within":1}"#),
        (422, r#"{"condition":["idle"],"within":1}"#),
        (409, r#"{"condition":"moon","within":1}"#),
        (409, r#"{"condition":"output 0 on","within":1}"#),
        (422, r#"{"condition":{"idle":{}}}"#),
        (422, r#"{"condition":{"idle":{}},"within":-1}"#),
        (422, r#"{"condition":{"idle":{}},"within":1,"wall":1000}"#),
    ] {
        robot.refused(status, "POST", "/clock/advance-until", body);
        robot.refused(status, "POST", "/wait", body);
    }
}

#[test]
fn a_condition_is_text_as_in_scenarios() {
    let robot = running(SLOW);
    let _peer = robot.dial(Port::Ip1);
    let mut host = robot.host();
    let until = |condition: &str, within: f64| {
        let body = json!({"condition": condition, "within": within}).to_string();
        robot.post("/clock/advance-until", &body)["reached"] == true
    };
    // A state that holds already is enough; what has happened before the call is not.
    write!(host, "\x02SU\r\x03").unwrap();
    for (condition, reached) in [
        ("servo on", true),
        ("servo off", false),
        ("connected IP1", true),
        ("connected IP2", false),
        ("disconnected IP2", true),
        ("command SU", false),
        ("answer SU", false),
        ("alarm", false),
        // The host has not acknowledged the answer.
        ("idle", false),
    ] {
        assert_eq!(until(condition, 0.0), reached, "{condition}");
    }
    robot.post("/program/start", "");
    assert!(until("status running", 0.0));
    assert!(until("output 4 on", 10_000.0));
    assert!(until("printed IP1 ONE", 100.0));
    let error = robot.refused(409, "POST", "/wait", r#"{"condition":"comand RN","within":1}"#);
    assert_eq!(error, "unknown condition `comand RN`; did you mean `command`?");
}

/// Each is done until the wait, which another thread began at some time, has seen it.
#[test]
fn a_wait_sees_what_is_done_since_it_began() {
    let robot = running(SLOW);
    let _peer = robot.dial(Port::Ip1);
    let _host = robot.host();
    for (condition, method, path, body) in [
        (
            "received IP1 4<CR>",
            "POST",
            "/channels/IP1/inject",
            r#"{"text":"4\r"}"#,
        ),
        (
            "command SU",
            "POST",
            "/channels/IP0/inject",
            r#"{"hex":"0253550d03024f4b0d03"}"#,
        ),
        ("stored A", "PUT", "/files/A", r#"{"text":"A"}"#),
    ] {
        let waited = json!({"condition": condition, "within": 1}).to_string();
        std::thread::scope(|scope| {
            let wait = scope.spawn(|| robot.post("/wait", &waited));
            while !wait.is_finished() {
                robot.ok(method, path, body);
            }
            assert_eq!(wait.join().unwrap()["reached"], true, "{condition}");
        });
    }
}

/// Two connections, one order: what a test has sent to the robot is there before the clock moves, also behind an OK that
/// nothing answers and that a host without `TCP_NODELAY` therefore waits to see acknowledged.
#[test]
fn what_was_sent_before_time_moves_is_heard_before() {
    let robot = running(SLOW);
    let mut host = robot.host();
    for second in 1_u64..=30 {
        host.write_all(b"\x02SU\r\x03").unwrap();
        robot.post("/clock/advance", r#"{"seconds":1}"#);
        host.text();
        host.write_all(b"\x02OK\r\x03").unwrap();
        let lines = robot.call_text("GET", "/transcript?format=jsonl", "").1;
        let hosts = |line: &&str| line.contains("\"from-host\"") && line.contains("SU<CR>");
        let received = lines.lines().rfind(hosts).unwrap();
        let received: serde_json::Value = serde_json::from_str(received).unwrap();
        assert_eq!(received["t_us"], (second - 1) * 1_000_000, "{received}");
    }
}

#[test]
fn a_line_that_no_file_has_is_refused_with_those_that_it_can_have() {
    let robot = running(SLOW);
    let error = robot.refused(422, "POST", "/wait", r#"{"condition":{"line":0},"within":1}"#);
    assert!(
        error.contains("expected a line of a file, 1 to 99999, found 0"),
        "{error}"
    );
}
