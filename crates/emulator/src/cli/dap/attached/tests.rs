//! An editor attaches to an emulator in this process while a host talks to it.

use crate::cli::dap::Programs;
use crate::embed::{ControlSettings, Emulator, Port, TimeMode};
use crate::testing::TempDir;
use serde_json::{Value, json};
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::Duration;
use ts3100_workbench::dap::Server;

const PROGRAM: &str = "GLOBAL\nN = 0\nEND\nPROGRAM TEST\nLOOP:\nN = N + 1\nPART(N)\nDELAY 1\nGOTO LOOP\nEND\n\
    PROGRAM PART(K)\nM = K * 2\nDOUT(5)\nRETURN\nEND\n";
/// Longest wait for something that comes from another thread.
const LIMIT: Duration = Duration::from_secs(20);

/// A robot in stepped time with a host on IP0, which has started the program.
struct Cell {
    emulator: Emulator,
    host: TcpStream,
}

impl Cell {
    fn new() -> Cell {
        Cell::with(PROGRAM)
    }

    fn with(program: &str) -> Cell {
        let emulator = Emulator::builder()
            .file("TEST", program)
            .select("TEST")
            .servo_on(true)
            .time(TimeMode::Stepped)
            .control(ControlSettings::free())
            .start()
            .unwrap();
        let host = TcpStream::connect(emulator.address(Port::Ip0).unwrap()).unwrap();
        host.set_read_timeout(Some(LIMIT)).unwrap();
        let mut cell = Cell { emulator, host };
        assert_eq!(cell.ask("RN"), "OK\r");
        cell
    }

    /// The next text of the robot.
    fn text(&mut self) -> String {
        let mut text = Vec::new();
        loop {
            let mut byte = [0];
            self.host.read_exact(&mut byte).unwrap();
            match byte[0] {
                2 => text.clear(),
                3 => return String::from_utf8(text).unwrap(),
                byte => text.push(byte),
            }
        }
    }

    /// The reply to a command; a text with content is acknowledged.
    fn ask(&mut self, command: &str) -> String {
        write!(self.host, "\x02{command}\r\x03").unwrap();
        let reply = self.text();
        if reply.starts_with("FL,") {
            write!(self.host, "\x02OK\r\x03").unwrap();
        }
        reply
    }

    fn advance(&self, seconds: f64) {
        self.emulator.advance(Duration::from_secs_f64(seconds)).unwrap();
    }
}

/// The editor.
struct Editor {
    server: Server<Programs>,
    events: Vec<Value>,
    seq: u64,
}

impl Editor {
    fn new() -> Editor {
        Editor {
            server: Server::new(Programs),
            events: Vec::new(),
            seq: 0,
        }
    }

    /// The response of a request.
    fn request(&mut self, command: &str, arguments: &Value) -> Value {
        self.seq += 1;
        let message = json!({"seq": self.seq, "type": "request", "command": command, "arguments": arguments});
        let answers = self.server.receive(message.to_string().as_bytes());
        let (mut responses, events): (Vec<Value>, Vec<Value>) = answers
            .into_iter()
            .partition(|answer| answer["type"] == "response");
        self.events.extend(events);
        responses.pop().unwrap()
    }

    /// The body of a response that is no refusal.
    fn done(&mut self, command: &str, arguments: &Value) -> Value {
        let response = self.request(command, arguments);
        assert_eq!(response["success"], true, "{response}");
        response["body"].clone()
    }

    fn attach(&mut self, cell: &Cell) {
        let address = cell.emulator.control().unwrap().to_string();
        self.done("initialize", &json!({}));
        self.done("attach", &json!({"address": address}));
    }

    /// Sets breakpoints, and returns their lines.
    fn breakpoints(&mut self, breakpoints: &Value) -> Vec<Value> {
        let source = json!({"sourceReference": 1});
        let body = self.done(
            "setBreakpoints",
            &json!({"source": source, "breakpoints": breakpoints}),
        );
        let set = body["breakpoints"].as_array().unwrap().iter();
        set.map(|set| set["line"].clone()).collect()
    }

    /// Looks at the program until an event has come that `fits`: in stepped time one look is enough.
    fn event(&mut self, fits: impl Fn(&Value) -> bool) -> Value {
        self.events.extend(self.server.work());
        let place = self.events.iter().position(fits);
        let place = place.unwrap_or_else(|| panic!("{:?}", self.events));
        self.events.remove(place)["body"].clone()
    }

    /// Reason of the stop, then program and line of each open call, innermost first.
    fn stop(&mut self) -> (String, Vec<String>) {
        let stopped = self.event(|event| event["event"] == "stopped");
        let body = self.done("stackTrace", &json!({"threadId": stopped["threadId"]}));
        let frames = body["stackFrames"].as_array().unwrap().iter();
        let places = frames.map(|frame| format!("{} {}", frame["name"].as_str().unwrap(), frame["line"]));
        (stopped["reason"].as_str().unwrap().to_owned(), places.collect())
    }

    /// The rows of a scope of the innermost call.
    fn scope(&mut self, name: &str) -> Vec<String> {
        let scopes = self.done("scopes", &json!({"frameId": 1}));
        let scopes = scopes["scopes"].as_array().unwrap();
        let scope = scopes.iter().find(|scope| scope["name"] == name).unwrap();
        let reference = scope["variablesReference"].clone();
        let rows = self.done("variables", &json!({"variablesReference": reference}));
        let rows = rows["variables"].as_array().unwrap().iter();
        rows.map(|row| {
            format!(
                "{} = {}",
                row["name"].as_str().unwrap(),
                row["value"].as_str().unwrap()
            )
        })
        .collect()
    }

    fn value(&mut self, expression: &str) -> Value {
        let arguments = json!({"expression": expression, "frameId": 1, "context": "watch"});
        self.done("evaluate", &arguments)["result"].clone()
    }
}

fn stopped(reason: &str, places: &[&str]) -> (String, Vec<String>) {
    (
        reason.to_owned(),
        places.iter().map(|place| (*place).to_owned()).collect(),
    )
}

#[test]
fn a_program_is_debugged_while_a_host_talks_to_its_robot() {
    let mut cell = Cell::new();
    let mut editor = Editor::new();
    editor.attach(&cell);
    let content = editor.done("source", &json!({}))["content"].clone();
    assert_eq!(content, PROGRAM);
    let rules = json!([{"line": 7, "condition": "N == 2"}, {"line": 9, "logMessage": "round {N}"}]);
    assert_eq!(editor.breakpoints(&rules), [7, 9]);
    editor.done("configurationDone", &json!({}));
    assert!(editor.server.work().is_empty(), "the program runs");
    assert!(cell.ask("SU").starts_with("FL"));
    cell.advance(1.0);
    let said = editor.event(|event| event["event"] == "output" && event["body"]["line"] == 9);
    assert_eq!(said["output"], "round 1\n");
    assert_eq!(editor.stop(), stopped("breakpoint", &["TEST 7"]));
    assert_eq!(cell.text(), "SP\r", "the host notices an ordinary stop");
    assert_eq!(editor.scope("Global"), ["N = 2"]);
    editor.done("next", &json!({"threadId": 1}));
    assert_eq!(editor.stop(), stopped("step", &["TEST 8"]));
    assert_eq!(cell.text(), "SP\r");
    assert_eq!(editor.value("N * 3"), "6");
    let set = json!({"expression": "N", "value": "10", "frameId": 1});
    assert_eq!(editor.done("setExpression", &set)["value"], "10");
    let set = json!({"expression": "DIN(30)", "value": "1", "frameId": 1});
    assert_eq!(editor.done("setExpression", &set)["value"], "1");

    assert_eq!(editor.breakpoints(&json!([{"line": 11}])), [12]);
    editor.done("continue", &json!({"threadId": 1}));
    assert!(cell.ask("SU").starts_with("FL"));
    cell.advance(1.0);
    assert_eq!(editor.stop(), stopped("breakpoint", &["PART 12", "TEST 7"]));
    assert_eq!(cell.text(), "SP\r");
    assert_eq!(editor.scope("Local").first().map(String::as_str), Some("K = 11"));
    editor.done("stepOut", &json!({"threadId": 1}));
    assert_eq!(editor.stop(), stopped("step", &["TEST 8"]));
    assert_eq!(cell.text(), "SP\r");
    let back = editor.request("stepBack", &json!({"threadId": 1}));
    assert_eq!(back["success"], false);

    editor.done("disconnect", &json!({}));
    assert!(editor.server.has_ended());
    let left = cell.emulator.read(|controller| controller.breakpoints().len());
    assert_eq!(left.unwrap(), 0);
    cell.advance(3.0);
    let status = cell.emulator.status().unwrap();
    assert_eq!(status.as_str(), "running", "it continues without the debugger");
    assert!(cell.ask("SU").starts_with("FL"), "no stop was told since");
}

#[test]
fn an_expression_that_the_robot_cannot_read_is_told_when_its_breakpoint_is_set() {
    let cell = Cell::new();
    let mut editor = Editor::new();
    editor.attach(&cell);
    let breakpoints = json!([
        {"line": 7, "condition": "K == 2"},
        {"line": 8},
        {"line": 9, "logMessage": "{M}"},
        {"line": 12, "condition": "K == 2"},
    ]);
    let source = json!({"sourceReference": 1});
    let set = editor.done(
        "setBreakpoints",
        &json!({"source": source, "breakpoints": breakpoints}),
    );
    let set = set["breakpoints"].as_array().unwrap();
    let verified: Vec<&Value> = set.iter().map(|set| &set["verified"]).collect();
    assert_eq!(verified, [false, true, false, true]);
    assert_eq!(
        set[0]["message"],
        "cannot set the breakpoint of line 7: the condition `K == 2`: K is never given a value"
    );
    let lines = cell
        .emulator
        .read(|controller| controller.breakpoint_lines().collect::<Vec<u32>>());
    assert_eq!(lines.unwrap(), [8, 12]);
    editor.done("disconnect", &json!({}));
}

#[test]
fn a_file_with_another_text_than_the_robot_is_told() {
    let cell = Cell::new();
    let folder = TempDir::new("debugged");
    let path = folder.path().join("test.scol");
    std::fs::write(&path, PROGRAM.replace("N = N + 1", "N = N + 2")).unwrap();
    let mut editor = Editor::new();
    let address = cell.emulator.control().unwrap().to_string();
    editor.done("attach", &json!({"address": address, "program": path}));
    let told = "line 6 differs from TEST on the robot; put the file on its RAM drive, or set breakpoints in the text that is shown";
    let said = editor.event(|event| event["event"] == "output");
    assert_eq!(said["output"], format!("warning: {}: {told}\n", path.display()));
    let breakpoints = json!({"source": {"path": path}, "breakpoints": [{"line": 7}]});
    let set = editor.done("setBreakpoints", &breakpoints);
    assert_eq!(set["breakpoints"][0]["verified"], false);
    assert_eq!(set["breakpoints"][0]["message"], told);
    let own = json!({"source": {"sourceReference": 1}, "breakpoints": [{"line": 7}]});
    assert_eq!(
        editor.done("setBreakpoints", &own)["breakpoints"][0]["verified"],
        true
    );

    // A value that a host has written into the file moves no line.
    std::fs::write(&path, PROGRAM.replace("N = 0", "N = 5")).unwrap();
    assert_eq!(
        editor.done("setBreakpoints", &breakpoints)["breakpoints"][0]["verified"],
        true
    );
    editor.done("configurationDone", &json!({}));
    cell.advance(1.0);
    assert_eq!(editor.stop(), stopped("breakpoint", &["TEST 7"]));
    let stack = editor.done("stackTrace", &json!({"threadId": 1}));
    assert_eq!(stack["stackFrames"][0]["source"]["path"], json!(path));
    editor.done("disconnect", &json!({}));
}

#[test]
fn a_file_that_is_put_on_the_robot_is_its_text_from_then_on() {
    let mut cell = Cell::new();
    assert_eq!(cell.ask("SP"), "OK\r");
    cell.advance(1.0);
    let folder = TempDir::new("debugged");
    let path = folder.path().join("test.scol");
    let text = PROGRAM.replace("N = N + 1", "N = N + 2");
    std::fs::write(&path, &text).unwrap();
    let mut editor = Editor::new();
    let address = cell.emulator.control().unwrap().to_string();
    editor.done("attach", &json!({"address": address, "program": path}));
    let breakpoints = json!({"source": {"path": path}, "breakpoints": [{"line": 7}]});
    for is_there in [false, true] {
        let set = editor.done("setBreakpoints", &breakpoints);
        assert_eq!(set["breakpoints"][0]["verified"], is_there, "{set}");
        cell.emulator.put_file("TEST", &text).unwrap();
        cell.emulator.select_file("TEST").unwrap();
    }
    editor.done("disconnect", &json!({}));
}

#[test]
fn a_program_that_was_paused_continues_when_the_debugger_leaves() {
    let mut cell = Cell::new();
    let mut editor = Editor::new();
    editor.attach(&cell);
    editor.done("configurationDone", &json!({}));
    editor.done("pause", &json!({"threadId": 1}));
    cell.advance(1.0);
    assert_eq!(editor.stop(), stopped("pause", &["TEST 9"]));
    assert_eq!(cell.text(), "SP\r");
    editor.done("disconnect", &json!({}));
    assert_eq!(cell.emulator.status().unwrap().as_str(), "running");
}

#[test]
fn an_alarm_stops_at_the_statement_at_fault() {
    let cell = Cell::with(
        "PROGRAM TEST\nDELAY 1\nN = 0\nPART(N)\nEND\nPROGRAM PART(N)\nM = 1 / N\n\nM = 2\nRETURN\nEND\n",
    );
    let mut editor = Editor::new();
    editor.attach(&cell);
    editor.done("configurationDone", &json!({}));
    cell.advance(1.5);
    assert_eq!(editor.stop(), stopped("exception", &["PART 7", "TEST 4"]));
    editor.done("disconnect", &json!({}));
}

#[test]
fn a_stop_of_the_host_stays_when_the_debugger_leaves() {
    let mut cell = Cell::new();
    let mut editor = Editor::new();
    editor.attach(&cell);
    editor.done("configurationDone", &json!({}));
    assert_eq!(cell.ask("SP"), "OK\r");
    cell.advance(1.0);
    assert_eq!(editor.stop(), stopped("pause", &["TEST 9"]));
    editor.done("disconnect", &json!({}));
    assert_eq!(cell.emulator.status().unwrap().as_str(), "stop (continue)");
}

#[test]
fn the_fate_of_a_stopped_program_is_told() {
    let mut cell = Cell::new();
    let mut editor = Editor::new();
    editor.attach(&cell);
    editor.breakpoints(&json!([{"line": 8}]));
    editor.done("configurationDone", &json!({}));
    cell.advance(1.0);
    assert_eq!(editor.stop(), stopped("breakpoint", &["TEST 8"]));
    assert_eq!(cell.text(), "SP\r");
    assert!(editor.server.work().is_empty());
    assert_eq!(cell.ask("RN"), "OK\r");
    editor.event(|event| event["event"] == "continued");
    cell.advance(1.0);
    assert_eq!(editor.stop(), stopped("breakpoint", &["TEST 8"]));
    assert_eq!(cell.text(), "SP\r");
    assert_eq!(cell.ask("RS,PRG"), "OK\r");
    assert_eq!(editor.stop(), stopped("pause", &["TEST 6"]));
    assert!(editor.server.work().is_empty());
    drop(cell);
    editor.event(|event| event["event"] == "terminated");
}

#[test]
fn a_refusal_says_where_an_emulator_is_found() {
    let mut editor = Editor::new();
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    drop(listener);
    let response = editor.request("attach", &json!({"address": address}));
    let told = response["message"].as_str().unwrap();
    assert!(
        told.contains(&address) && told.contains("Start an emulator with `ts3100 serve`"),
        "{told}"
    );
    let cell = Cell::new();
    let address = cell.emulator.control().unwrap().to_string();
    let response = editor.request("attach", &json!({"address": address, "robot": "left"}));
    assert!(
        response["message"].as_str().unwrap().contains("left"),
        "{response}"
    );
}
