//! What each call does, and that hosts see it.

use serde_json::json;
use std::io::Write as _;
use ts3100_controller::port::Port;
use ts3100_tests::bench::{Bench, builder, running};
use ts3100_tests::host::Host;

const DATA: &str = "GLOBAL\nCOUNT = 3\nX = 1.5\nDIM A(2) AS INTEGER\nEND\nPROGRAM TEST\nDOUT(5)\nWAIT DIN(7)\nDOUT(-5)\n\
    END\nDATA\nPOINT P1 = 300,0,400,0,0,0,0,0\nEND\n";

#[test]
fn an_emergency_stop_is_seen_by_the_host() {
    let robot = running("PROGRAM TEST\nEND\n");
    let mut host = robot.host();
    assert_eq!(
        (host.sf()[0], robot.get("/servo")["on"].as_bool()),
        (1, Some(true))
    );
    robot.put("/emergency-stop", r#"{"pressed":true}"#);
    let sf = host.sf();
    assert_eq!((sf[0], sf[1]), (0, 1), "servo off, emergency stop");
    assert!(
        host.command("AC")
            .starts_with("FL,1,008-014,Emergency Stop SW ON,")
    );
    assert_eq!(host.command("DO,MOVE HERE"), "NG");
    assert_eq!(robot.get("/alarms")["active"][0]["number"], "8-014");
    let words = robot.refused(409, "PUT", "/servo", r#"{"on":true}"#);
    assert!(words.contains("emergency stop"), "{words}");
    robot.post("/alarms/reset", "");
    assert_eq!(
        robot.get("/alarms")["active"][0]["number"],
        "8-014",
        "its cause persists"
    );
    robot.put("/emergency-stop", r#"{"pressed":false}"#);
    assert_eq!(robot.post("/alarms/reset", "{}")["active"], json!([]));
    assert_eq!(robot.put("/servo", r#"{"on":true}"#)["on"], true);
    assert_eq!(host.sf()[0], 1);
}

#[test]
fn key_and_control_right_decide_what_the_host_may() {
    let robot = running("PROGRAM TEST\nEND\n");
    let mut host = robot.host();
    robot.put("/key-switch", r#"{"position":"teaching"}"#);
    assert_eq!(host.command("RN"), "NG");
    robot.put("/key-switch", r#"{"position":"ext"}"#);
    robot.put("/control-right", r#"{"holder":"rs232c"}"#);
    assert_eq!(host.command("RN"), "NG");
    assert_eq!(robot.get("/state")["master_mode"], "EXT (RS-232C)");
    robot.put("/control-right", r#"{"holder":"ether"}"#);
    assert_eq!(host.command("RN"), "OK");
    assert_eq!(robot.get("/control-right")["holder"], "ether");
    robot.refused(422, "PUT", "/key-switch", r#"{"position":"sideways"}"#);
}

#[test]
fn every_switch_is_read_as_it_was_set() {
    let robot = running("PROGRAM TEST\nEND\n");
    for (path, key) in [
        ("/safety-switch", "open"),
        ("/machine-lock", "on"),
        ("/battery", "low"),
        ("/feed-hold", "on"),
    ] {
        for state in [true, true, false] {
            let body = json!({ key: state }).to_string();
            assert_eq!(robot.put(path, &body)[key], state, "{path}");
            assert_eq!(robot.get(path)[key], state, "{path}");
        }
    }
    let active = robot.get("/alarms");
    let numbers: Vec<_> = active["active"]
        .as_array()
        .unwrap()
        .iter()
        .map(|alarm| alarm["number"].clone())
        .collect();
    assert_eq!(numbers, ["8-017", "1-102"], "fence and battery");
}

#[test]
fn feed_hold_refuses_a_start_and_start_starts() {
    let robot = running(DATA);
    robot.put("/feed-hold", r#"{"on":true}"#);
    robot.refused(409, "POST", "/program/start", "");
    robot.put("/feed-hold", r#"{"on":false}"#);
    assert_eq!(robot.post("/program/start", "")["status"], "running");
    let mut host = robot.host();
    assert!(host.command("SU").starts_with("FL,MODE"));
    assert_eq!(robot.get("/outputs/5")["on"], true);
    assert_eq!(robot.get("/state")["tasks"][0]["doing"], "wait");
    robot.put("/inputs/7", r#"{"on":true}"#);
    assert_eq!(robot.get("/outputs/5")["on"], false);
    assert_eq!(robot.get("/program")["status"], "stop (reset)");
    assert_eq!(host.text(), b"SP\r", "the end of the cycle is told");
}

#[test]
fn stop_ends_the_step() {
    let robot = running(DATA);
    robot.post("/program/start", "");
    assert_eq!(robot.post("/program/stop", "")["status"], "stop (continue)");
}

#[test]
fn a_program_is_reset_at_the_panel() {
    let robot = running(DATA);
    robot.post("/program/start", "");
    let words = robot.refused(409, "POST", "/program/reset", "");
    assert!(
        words.contains("cannot reset the program: the program is running; stop it first"),
        "{words}"
    );
    robot.post("/program/stop", "");
    let program = robot.post("/program/reset", "");
    assert_eq!(
        (&program["status"], &program["line"]),
        (&json!("stop (reset)"), &json!(7))
    );
    robot.post("/power/off", "");
    robot.refused(409, "POST", "/program/reset", "");
}

#[test]
fn variables_of_programs_are_read_by_their_program() {
    let robot = running(
        "GLOBAL\nCOUNT = 3\nEND\nPROGRAM CELL\nDIM HEIGHTS(2) AS REAL\nFOR I = 1 TO 5\nHEIGHTS(1) = 2.5\nP = HERE\n\
         PLACE(I)\nNEXT I\nEND\nPROGRAM PLACE(AT)\nTWICE_AS_MUCH = AT * 2\nWAIT DIN(7)\nEND\n",
    );
    let names = |path: &str| -> Vec<String> {
        let found = robot.get(path);
        let names = found.as_array().unwrap().iter();
        names
            .map(|one| one["name"].as_str().unwrap().to_string())
            .collect()
    };
    assert_eq!(
        names("/variables"),
        ["COUNT", "CELL.HEIGHTS", "CELL.I", "CELL.P", "PLACE.TWICE_AS_MUCH"]
    );
    let value = |name: &str| robot.get(&format!("/variables/{name}"))["value"].clone();
    assert_eq!(value("CELL.I"), json!(null), "nothing has run");
    robot.post("/program/start", "");
    assert_eq!((value("CELL.I"), value("cell.i")), (json!([1]), json!([1])));
    assert_eq!(value("PLACE.TWICE_AS_MUCH"), json!([2]));
    assert_eq!(value("CELL.HEIGHTS(1)"), json!([2.5]));
    assert_eq!(
        robot.get("/variables/CELL.HEIGHTS")["elements"],
        json!([[0.0], [2.5], [0.0]])
    );
    let kind = |name: &str| robot.get(&format!("/variables/{name}"))["kind"].clone();
    assert_eq!(
        (kind("CELL.I"), kind("CELL.P")),
        (json!("integer"), json!("position"))
    );
    robot.put("/inputs/7", r#"{"on":true}"#);
    assert_eq!(value("CELL.I"), json!([6]), "kept after the end of the program");
    for missing in ["CELL.NONE", "NONE.I", "I", "CELL.HEIGHTS(3)", "CELL.AT"] {
        robot.refused(404, "GET", &format!("/variables/{missing}"), "");
    }
    let words = robot.refused(409, "PUT", "/variables/CELL.I", r#"{"value":3}"#);
    assert!(
        words.contains("cannot set CELL.I: variables of programs can only be read"),
        "{words}"
    );
    robot.refused(404, "POST", "/positions/CELL.P/teach", "{}");
    assert_eq!(robot.get("/positions"), json!([]));
}

// clause: T8 T27
#[test]
fn an_alarm_of_the_table_acts_by_its_level() {
    let robot = running(DATA);
    let mut host = robot.host();
    robot.post("/program/start", "");
    let alarms = robot.post("/alarms", r#"{"number":"4-101","detail":"by hand"}"#);
    assert_eq!(alarms["active"][0]["text"], "Position out of reach: by hand");
    assert!(
        alarms["active"][0]["remedy"]
            .as_str()
            .unwrap()
            .starts_with("Correct")
    );
    assert_eq!(robot.get("/program")["status"], "stop (retry)");
    assert_eq!(host.text(), b"SP\r");
    assert!(host.command("EU").contains("004-101"));
    robot.refused(404, "POST", "/alarms", r#"{"number":"4-999"}"#);
    let wait = r#"{"condition":{"alarm":"8-204"},"within":1}"#;
    for (method, path, body, new) in [
        ("POST", "/alarms", r#"{"number":"8-027"}"#, "8-014 replaces it"),
        ("GET", "/alarms/table/8-203", "", "8-017, which replaces"),
        ("POST", "/wait", wait, "8-026, which replaces"),
    ] {
        assert!(robot.refused(404, method, path, body).contains(new));
    }
    robot.refused(422, "POST", "/alarms", r#"{"number":"4-101","detail":"a,b"}"#);
    let table = robot.get("/alarms/table");
    for row in table.as_array().unwrap() {
        let number = row["number"].as_str().unwrap();
        assert_eq!(robot.get(&format!("/alarms/table/{number}")), *row);
    }
    robot.refused(404, "GET", "/alarms/table/0-000", "");
}

#[test]
fn lines_are_driven_forced_and_released() {
    let robot = running(DATA);
    let mut host = robot.host();
    robot.put("/inputs/101", r#"{"on":true}"#);
    assert_eq!(host.command("HI,101 1"), "FL,1\r\u{1a}");
    let forced = robot.put("/inputs/101/force", r#"{"on":false}"#);
    assert_eq!(forced, json!({"line":101,"on":false,"forced":true}));
    assert_eq!(host.command("HI,101 1"), "FL,0\r\u{1a}");
    robot.put("/inputs/101", r#"{"on":true}"#);
    assert_eq!(host.command("HI,101 1"), "FL,0\r\u{1a}", "whatever drives it");
    robot.ok("DELETE", "/inputs/101/force", "");
    assert_eq!(host.command("HI,101 1"), "FL,1\r\u{1a}");
    robot.put("/outputs/3/force", r#"{"on":true}"#);
    assert_eq!(host.command("IW,3 0"), "OK");
    assert_eq!(robot.get("/outputs")["forced"], json!([{"line":3,"on":true}]));
    assert_eq!(robot.get("/outputs/3")["on"], true);
    robot.ok("DELETE", "/outputs/3/force", "");
    assert_eq!(robot.get("/outputs/3")["on"], false);
    robot.put("/outputs/3", r#"{"on":true}"#);
    let lines = robot.get("/outputs");
    assert!(lines["on"].as_array().unwrap().contains(&json!(3)));
    for line in ["0", "65", "265"] {
        robot.refused(404, "PUT", &format!("/inputs/{line}"), r#"{"on":true}"#);
        robot.refused(404, "PUT", &format!("/outputs/{line}/force"), r#"{"on":true}"#);
    }
    robot.refused(404, "PUT", "/outputs/249", r#"{"on":true}"#);
}

#[test]
fn a_forced_system_input_acts_as_a_driven_one() {
    let robot = running(DATA);
    robot.put("/control-right", r#"{"holder":"sig"}"#);
    robot.put("/inputs/255/force", r#"{"on":true}"#);
    assert_eq!(robot.get("/program")["status"], "running");
}

#[test]
fn pulses_last_their_virtual_time() {
    let robot = running(DATA);
    robot.post("/inputs/9/pulse", r#"{"seconds":0.5}"#);
    robot.post("/outputs/9/pulse", r#"{"seconds":0.25}"#);
    robot.post("/clock/advance", r#"{"seconds":0.249999}"#);
    assert_eq!(robot.get("/outputs/9")["on"], true);
    robot.post("/clock/advance", r#"{"seconds":0.000001}"#);
    assert_eq!(robot.get("/outputs/9")["on"], false);
    assert_eq!(robot.get("/inputs/9")["on"], true);
    robot.post("/clock/advance", r#"{"seconds":0.25}"#);
    assert_eq!(robot.get("/inputs/9")["on"], false);
    robot.refused(422, "POST", "/inputs/9/pulse", r#"{"seconds":-1}"#);
    robot.refused(422, "POST", "/inputs/9/pulse", r#"{"seconds":1e300}"#);
    robot.refused(409, "POST", "/outputs/250/pulse", r#"{"seconds":1}"#);
}

#[test]
fn variables_are_those_of_the_host() {
    let robot = running(DATA);
    let mut host = robot.host();
    assert_eq!(robot.get("/variables/count")["value"], json!([3]));
    assert_eq!(
        robot.put("/variables/COUNT", r#"{"value":[-7]}"#)["value"],
        json!([-7])
    );
    assert_eq!(host.command("MR,COUNT 0"), "FL,-7\r\u{1a}");
    assert_eq!(host.command("MW,0 COUNT 0 12"), "OK");
    assert_eq!(robot.get("/variables/COUNT")["value"], json!([12]));
    robot.put("/variables/A(1)", r#"{"value":[5]}"#);
    assert_eq!(robot.get("/variables/A")["elements"][1], json!([5]));
    assert_eq!(robot.get("/variables/A%281%29")["value"], json!([5]));
    robot.refused(409, "PUT", "/variables/COUNT", r#"{"value":[1.5]}"#);
    robot.refused(409, "PUT", "/variables/COUNT", r#"{"value":[1,2]}"#);
    assert_eq!(
        robot.refused(409, "PUT", "/variables/COUNT", r#"{"value":[1,2]}"#),
        "cannot set COUNT: expected one integer, found 2 numbers: `1 2`; a comma separates values: write decimals with a point"
    );
    assert_eq!(
        robot.refused(409, "PUT", "/positions/P1", r#"{"value":[1,2,3]}"#),
        "cannot set P1: expected a position of 8 numbers, found 3 numbers: `1 2 3`"
    );
    robot.refused(404, "PUT", "/variables/NONE", r#"{"value":[1]}"#);
    robot.refused(404, "GET", "/variables/A(3)", "");
    robot.refused(404, "GET", "/variables/1A", "");
    let names = robot.get("/variables");
    let names: Vec<_> = names
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["name"].clone())
        .collect();
    assert_eq!(names, ["A", "COUNT", "P1", "X"]);
    let nothing = Bench::start(builder());
    nothing.refused(404, "GET", "/variables/COUNT", "");
    assert_eq!(nothing.get("/variables"), json!([]));
}

#[test]
fn a_position_is_taught_and_restored() {
    let robot = running(DATA);
    let world = robot.get("/state")["arm"]["world"].clone();
    let taught = robot.post("/positions/P1/teach", r#"{"restore":true}"#);
    for (taught, shown) in taught["value"]
        .as_array()
        .unwrap()
        .iter()
        .zip(world.as_array().unwrap())
    {
        assert!(
            (taught.as_f64().unwrap() - shown.as_f64().unwrap()).abs() < 1e-3,
            "{taught} {shown}"
        );
    }
    let file = robot.get("/files/TEST");
    assert!(
        !file["text"].as_str().unwrap().contains("P1 = 300,0,400"),
        "{file}"
    );
    let figures = |number: &serde_json::Value| number.to_string().split('.').nth(1).unwrap_or_default().len();
    assert!(
        taught["value"]
            .as_array()
            .unwrap()
            .iter()
            .all(|number| figures(number) <= 3),
        "{taught}"
    );
    assert_eq!(
        taught["value"][8].to_string(),
        "11111",
        "five figures, no decimal point"
    );
    let set = robot.put("/positions/P1", r#"{"value":[1,2,3,4,5,6,7,8,0]}"#);
    assert_eq!(set["value"][7], 8.0);
    assert_eq!(
        robot.host().command("MR,P1 4"),
        "FL,1.000 2.000 3.000 4.000 5.000 6.000 7.000 8.000 0.000\r\u{1a}"
    );
    assert_eq!(robot.get("/positions").as_array().unwrap().len(), 1);
    robot.refused(404, "POST", "/positions/COUNT/teach", "{}");
    robot.refused(409, "PUT", "/positions/P1", r#"{"value":[1]}"#);
}

#[test]
fn files_go_to_the_drive_and_come_back() {
    let robot = Bench::start(builder());
    let mut host = robot.host();
    let put = robot.put("/files/pick", r#"{"text":"PROGRAM PICK\nEND\n"}"#);
    assert_eq!(put["name"], "PICK");
    assert_eq!(host.command("UL,PICK"), "FL,PROGRAM PICK\nEND\n\u{1a}");
    assert_eq!(robot.post("/files/PICK/select", "")["file"], "PICK");
    assert!(host.command("SU").contains("FILE:PICK"));
    robot.refused(409, "DELETE", "/files/PICK", "");
    robot.put(
        "/files/HEX",
        r#"{"hex":"50 52 4f 47 52 41 4d 20 48 45 58 0a 45 4e 44 0a"}"#,
    );
    assert_eq!(robot.get("/files/HEX")["text"], "PROGRAM HEX\nEND\n");
    let listed = robot.ok("DELETE", "/files/HEX", "");
    assert!(!listed.to_string().contains("HEX"));
    let words = robot.refused(404, "GET", "/files/HEX", "");
    let listed = "; the drive has DEMO, DIALOG, ETHERNET.PAR, PICK, USER.PAR";
    assert_eq!(
        words,
        format!("cannot read HEX: it is not on the RAM drive{listed}")
    );
    let words = robot.refused(404, "GET", "/files/pik", "");
    assert_eq!(
        words,
        "cannot read pik: it is not on the RAM drive; did you mean `PICK`?"
    );
    robot.refused(404, "DELETE", "/files/HEX", "");
    robot.put("/files/BAD", r#"{"text":"PROGRAM BAD\nMOVE\n"}"#);
    let words = robot.refused(409, "POST", "/files/BAD/select", "");
    assert!(words.contains('^'), "the diagnostics: {words}");
    robot.refused(404, "PUT", "/files/1BAD", r#"{"text":""}"#);
    robot.refused(422, "PUT", "/files/ODD", r#"{"hex":"5"}"#);
    robot.refused(409, "DELETE", "/files/USER.PAR", "");
}

#[test]
fn bytes_are_injected_and_peers_dropped() {
    let robot = running("PROGRAM TEST\nINPUT IP1, N\nPRINT IP1, N, CR\nEND\n");
    let words = robot.refused(409, "POST", "/channels/IP0/inject", r#"{"text":"x"}"#);
    assert!(words.contains("nobody is connected"), "{words}");
    let mut host = robot.host();
    let mut peer = robot.dial(Port::Ip1);
    peer.write_all(b"").unwrap();
    robot.post("/wait", r#"{"condition":{"status":"stop (reset)"},"within":0}"#);
    robot.post("/channels/IP0/inject", r#"{"text":"\u0002SP\r\u0003"}"#);
    assert_eq!(host.text(), b"OK\r");
    robot.post("/channels/IP1/inject", r#"{"hex":"34 32"}"#);
    assert_eq!(robot.get("/channels/IP1")["buffer"], "42");
    assert_eq!(robot.get("/channels").as_array().unwrap().len(), 6);
    robot.post("/channels/IP0/drop", "");
    assert!(host.has_ended());
    assert_eq!(robot.get("/channels/IP0")["peer"], json!(null));
    robot.host();
    robot.refused(409, "POST", "/channels/IP2/drop", "");
    robot.refused(400, "GET", "/channels/IP9", "");
}

/// The pendant as it can be reached: its three pages at once, in the order in which its keys lead through them.
// clause: UI-ETHER-01 UI-ETHER-02
#[test]
fn the_pendant_shows_the_pages_of_the_ethernet_display() {
    let robot = running(DATA);
    let pages = || robot.get("/pendant")["ether_pages"].clone();
    let shown = pages();
    let headings: Vec<_> = (0..3)
        .map(|page| shown[page]["heading"].as_str().unwrap())
        .collect();
    let expected = ["[1/3]", "[2/3]", "[3/3]"].map(|page| format!("ETHERNET STATUS {page}"));
    assert_eq!(headings, expected);
    assert_eq!(shown.as_array().unwrap().len(), 3);
    let line = |page: usize, line: usize| {
        let pages = pages();
        let text = pages[page]["lines"][line].as_str().unwrap();
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    assert_eq!(line(0, 0), "IP ADDRESS 192.168.0.124");
    assert_eq!(line(2, 0), "IP0 HOST TCP/S LISTEN");
    let host = robot.host();
    let port = host.local_addr().unwrap().port();
    assert_eq!(line(1, 0), format!("IP0 01000 {port:05} 127.0.0.1"));
    assert_eq!(line(2, 0), "IP0 HOST TCP/S ESTABLISHED");
}

#[test]
fn the_pendant_takes_keys_and_shows_prints() {
    let robot = running("PROGRAM TEST\nINPUT N\nPRINT \"GOT \", N, CR\nEND\n");
    robot.post("/program/start", "");
    assert_eq!(robot.get("/state")["tasks"][0]["doing"], "input");
    let pendant = robot.post("/pendant/keys", r#"{"keys":"42\r"}"#);
    assert!(pendant["text"].as_str().unwrap().starts_with("GOT"), "{pendant}");
    assert_eq!(pendant["ether_pages"].as_array().unwrap().len(), 3);
    robot.refused(422, "POST", "/pendant/keys", r#"{"keys":""}"#);
}

#[test]
fn without_power_nothing_answers() {
    let robot = running(DATA);
    let mut host = robot.host();
    let before = robot.get("/power");
    let off = robot.post("/power/off", "");
    assert_eq!(off, json!({"on":false,"ports":[]}));
    assert!(host.has_ended());
    let address = robot.emulator.address(Port::Ip0).unwrap();
    assert!(std::net::TcpStream::connect(address).is_err());
    #[cfg(target_os = "linux")]
    assert_eq!(
        std::net::TcpListener::bind(address)
            .map_err(|error| error.kind())
            .err(),
        Some(std::io::ErrorKind::AddrInUse),
        "a free port stays the robot's while its power is off"
    );
    robot.refused(409, "PUT", "/servo", r#"{"on":true}"#);
    robot.refused(409, "PUT", "/files/A", r#"{"text":""}"#);
    robot.put("/emergency-stop", r#"{"pressed":true}"#);
    assert_eq!(robot.get("/alarms")["active"], json!([]));
    assert_eq!(robot.get("/outputs")["on"], json!([]));
    assert_eq!(robot.get("/state")["power"], false);
    assert_eq!(robot.post("/power/on", ""), before, "the ports are the same");
    assert_eq!(robot.get("/alarms")["active"][0]["number"], "8-014");
    let state = robot.get("/state");
    assert_eq!((&state["file"], &state["servo"]), (&json!("TEST"), &json!(false)));
    assert!(robot.host().command("SU").starts_with("FL,MODE:"));
    robot.post("/power/cycle", "");
    assert_eq!(robot.get("/power")["on"], true);
}

#[test]
fn a_reset_leaves_nothing_behind() {
    let robot = running(DATA);
    let mut host = robot.host();
    let clean = |robot: &Bench| {
        let mut state = robot.get("/state");
        state["t"] = json!(0);
        state
    };
    let fresh = {
        robot.post("/reset", "");
        clean(&robot)
    };
    assert!(host.has_ended());
    let mut host = robot.host();
    host.command("NONSENSE");
    robot.post("/program/start", "");
    robot.put("/variables/COUNT", r#"{"value":[99]}"#);
    robot.put("/files/EXTRA", r#"{"text":"PROGRAM E\nEND\n"}"#);
    robot.put("/inputs/3/force", r#"{"on":true}"#);
    robot.put("/emergency-stop", r#"{"pressed":true}"#);
    robot.post("/clock/advance", r#"{"seconds":60}"#);
    assert_ne!(clean(&robot), fresh);
    robot.post("/reset", "");
    assert_eq!(clean(&robot), fresh);
    assert_eq!(robot.get("/state")["t"], 0.0);
    robot.refused(404, "GET", "/files/EXTRA", "");
    assert_eq!(robot.get("/variables/COUNT")["value"], json!([3]));
    assert_eq!(robot.get("/findings"), json!([]));
    assert_eq!(robot.host().command("SO"), "OK");
}

// clause: T27
#[test]
fn findings_name_the_fault_that_has_caused_them_and_no_counter_has_them() {
    let robot = Bench::start(builder());
    let mut host = robot.host();
    robot.post("/faults", r#"{"spec":"wrong-reply:command=SU"}"#);
    assert_eq!(host.command("SU"), "OK");
    // The host has read OK, and the robot awaits one.
    assert_eq!(host.command("SO"), "OK");
    let findings = robot.get("/findings");
    let found = findings.as_array().unwrap().iter();
    let found: Vec<_> = found
        .filter(|found| found["rule"] == "command-in-exchange")
        .collect();
    assert_eq!(found.len(), 1, "{findings}");
    assert_eq!(found[0]["severity"], "note");
    assert_eq!(found[0]["caused-by"], "fault 1 (wrong-reply)");
    assert_eq!(
        robot.get("/state")["findings"]["command-in-exchange"],
        json!(null)
    );
    let (_, text) = robot.client.call("GET", "/metrics", None).unwrap();
    assert!(!text.contains("rule=\"command-in-exchange\""), "{text}");
    // The next one is the host's.
    host.write_all(b"\x02SU\r\x03").unwrap();
    host.text();
    host.write_all(b"\x02SU\r\x03").unwrap();
    host.text();
    let (_, text) = robot.client.call("GET", "/metrics", None).unwrap();
    assert!(
        text.contains("ts3100_findings_total{rule=\"command-in-exchange\"} 1\n"),
        "{text}"
    );
}

#[test]
fn metrics_count_and_findings_are_listed() {
    let robot = Bench::start(builder());
    let mut host = robot.host();
    host.command("SL,NONE");
    host.write_all(b"\x02SO\x03").unwrap();
    host.text();
    let (_, text) = robot.client.call("GET", "/metrics", None).unwrap();
    for line in [
        "ts3100_commands_total{port=\"IP0\",command=\"SU\",outcome=\"served\"} 1\n",
        "ts3100_commands_total{port=\"IP0\",command=\"SL\",outcome=\"refused\"} 1\n",
        "ts3100_connections_total{port=\"IP0\"} 1\n",
        "ts3100_findings_total{rule=\"no-cr\"} 1\n",
        "ts3100_servo 1\n",
        "ts3100_peers 1\n",
    ] {
        assert!(text.contains(line), "{line} is missing in\n{text}");
    }
    let findings = robot.get("/findings");
    let rules: Vec<_> = findings
        .as_array()
        .unwrap()
        .iter()
        .map(|found| found["rule"].clone())
        .collect();
    assert!(rules.contains(&json!("no-cr")), "{findings}");
    assert_eq!(robot.get("/version")["name"], "ts3100");
    assert_eq!(robot.get("/parameters")["ethernet"]["address"], "192.168.0.124");
}

#[test]
fn a_fault_is_armed_fires_and_is_reported() {
    let robot = running(DATA);
    let mut host = robot.host();
    let armed = robot.post("/faults", r#"{"kind":"ng","on":{"command":"FD"},"times":2}"#);
    assert_eq!(armed["never_fired"], json!([1]));
    assert_eq!(armed["faults"][0]["spec"], "ng:command=FD,times=2");
    robot.post(
        "/faults",
        r#"{"kind":"late-reply","id":9,"on":{"channel":"IP1"},"probability":0.5,"parameters":{"delay":"2s"}}"#,
    );
    assert_eq!(robot.get("/faults/9")["parameters"], json!({"delay": "2000"}));
    assert_eq!(robot.get("/faults/9")["probability"], 0.5);
    assert_eq!(host.command("FD"), "NG");
    let fired = robot.get("/faults/1");
    assert_eq!((&fired["fired"], &fired["armed"]), (&json!(1), &json!(true)));
    assert_eq!(robot.ok("DELETE", "/faults/1", "")["armed"], false);
    assert_eq!(host.command("FD"), "OK");
    let metrics = robot.call_text("GET", "/metrics", "").1;
    assert!(
        metrics.contains("ts3100_faults_total{kind=\"ng\"} 1"),
        "{metrics}"
    );
    for (body, place) in [
        (r#"{"kind":"nothing"}"#, "kind"),
        (r#"{"kind":"ng","on":{"command":"XX"}}"#, "command"),
        (r#"{"kind":"ng","parameters":{"delay":1}}"#, "delay"),
        (r#"{"kind":"late-reply","parameters":{"delay":600001}}"#, "delay"),
        (r#"{"kind":"ng","probability":2}"#, "probability"),
    ] {
        let (status, answer) = robot.call("POST", "/faults", body);
        assert_eq!((status, &answer["where"]), (409, &json!(place)), "{answer}");
    }
    robot.refused(422, "POST", "/faults", r#"{"kind":"ng","when":1}"#);
    robot.refused(404, "GET", "/faults/77", "");
    robot.refused(404, "DELETE", "/faults/x", "");
    let kinds = robot.get("/faults/kinds");
    for kind in kinds.as_array().unwrap() {
        robot.post("/faults", &json!({"kind": kind["kind"]}).to_string());
    }
    robot.post("/reset", "");
    assert_eq!(robot.get("/faults")["faults"], json!([]));
    robot.post("/faults", r#"{"kind":"ng"}"#);
    assert_eq!(robot.ok("DELETE", "/faults", "")["faults"], json!([]));
}

#[test]
fn a_fault_has_every_time_at_which_it_was_applied() {
    let robot = running(DATA);
    let mut host = robot.host();
    robot.post("/faults", r#"{"kind":"ng","on":{"command":"FD"},"times":3}"#);
    let mut times = Vec::new();
    for applied in 1..=3 {
        times.push(robot.post("/clock/advance", r#"{"seconds":1.5}"#)["now"].clone());
        assert_eq!(host.command("FD"), "NG");
        for fault in [&robot.get("/faults/1"), &robot.get("/faults")["faults"][0]] {
            assert_eq!((&fault["fired"], &fault["at"]), (&json!(applied), &json!(times)));
        }
    }
}

#[test]
fn the_arm_shows_the_path_of_the_motion_under_way() {
    let robot = Bench::start(
        builder()
            .file(
                "TEST",
                "PROGRAM TEST\nSPEED = 5\nMOVES HERE + POINT(-60, 0, 0)\nEND\n",
            )
            .select("TEST")
            .servo_on(true),
    );
    let arm = robot.get("/arm");
    assert_eq!(
        (&arm["model"]["kind"], &arm["model"]["geometry"]["upper_arm"]),
        (&json!("six-axis"), &json!(370.0))
    );
    assert_eq!((&arm["path"], &arm["moving"]), (&json!([]), &json!(false)));
    let begin = arm["tool_point"][0].as_f64().unwrap();
    robot.post("/program/start", "");
    let arm = robot.get("/arm");
    let path = arm["path"].as_array().unwrap();
    assert_eq!((path.len(), &arm["moving"]), (64, &json!(true)));
    let ends = [&path[0][0], &path[63][0]].map(|x| x.as_f64().unwrap() - begin);
    assert!(ends[0].abs() < 1e-3 && (ends[1] + 60.0).abs() < 1e-3, "{ends:?}");
    assert_eq!(robot.get("/arm/pose")["moving"], true);
}

#[test]
fn override_and_run_mode_are_those_of_the_commands() {
    let robot = Bench::start(builder());
    let mut host = robot.host();
    assert_eq!(robot.put("/override", r#"{"percent":35}"#)["percent"], 35);
    assert_eq!(robot.put("/run-mode", r#"{"mode":"step"}"#)["mode"], "step");
    let text = format!("{:?}", host.command("SU"));
    assert!(text.contains("OVRD:35%") && text.contains("/step"), "{text}");
    robot.refused(422, "PUT", "/override", r#"{"percent":0}"#);
    robot.refused(422, "PUT", "/run-mode", r#"{"mode":"fast"}"#);
}
