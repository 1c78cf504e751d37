//! The debugger as an editor sees it: requests in, responses and events out, over programs and a recording.

use super::*;
use crate::testing::TempDir;
use serde_json::{Value, json};
use std::fs;
use std::path::PathBuf;

const PALLET: &str = "\
GLOBAL
  COUNT = 0
  DIM GRID(2,1) AS INTEGER
END
PROGRAM MAIN
  N = 3
  FOR I = 1 TO N
    PUT(I, 12.5)
  NEXT I
  PRINT COM1, \"DONE\", COUNT, CR
  MOVEA 1, 1 / (COUNT - 3)
END
PROGRAM PUT(ROW, DX)
  D = ROW * DX
  MOVE PLACE + POINT(D, 0, 0, 0, 0, 0, 0, 0, 0)
  COUNT = COUNT + 1
  GRID(0,1) = ROW
  RETURN
END
DATA
  POINT PLACE = 300, 0, 50, 0, 0, 0, 0, 0
END
";

/// An editor that debugs.
struct Editor {
    server: Server<Programs>,
    seq: u64,
    events: Vec<Value>,
    folder: TempDir,
}

impl Editor {
    fn new() -> Editor {
        let mut editor = Editor {
            server: Server::new(Programs),
            seq: 0,
            events: Vec::new(),
            folder: TempDir::new("debugger"),
        };
        editor.ask("initialize", &json!({ "adapterID": "scol" }));
        editor
    }

    fn file(&self, name: &str, content: &str) -> PathBuf {
        let path = self.folder.path().join(name);
        fs::write(&path, content).unwrap();
        path
    }

    /// Sends a request and returns its response.
    fn request(&mut self, command: &str, arguments: &Value) -> Value {
        self.seq += 1;
        let message =
            json!({ "seq": self.seq, "type": "request", "command": command, "arguments": arguments });
        let answers = self.server.receive(message.to_string().as_bytes());
        let (responses, events): (Vec<Value>, Vec<Value>) = answers
            .into_iter()
            .partition(|answer| answer["type"] == "response");
        self.events.extend(events);
        let [response] = responses.as_slice() else {
            panic!("{command}: {responses:?}");
        };
        assert_eq!(response["request_seq"], self.seq);
        response.clone()
    }

    fn ask(&mut self, command: &str, arguments: &Value) -> Value {
        let response = self.request(command, arguments);
        assert_eq!(response["success"], true, "{command}: {response}");
        response["body"].clone()
    }

    fn refused(&mut self, command: &str, arguments: &Value) -> String {
        let response = self.request(command, arguments);
        assert_eq!(response["success"], false, "{command}");
        response["message"].as_str().unwrap().to_owned()
    }

    /// Lets the program run until it stops or ends; the event.
    fn run(&mut self) -> Value {
        while self.server.is_running() {
            let events = self.server.work();
            self.events.extend(events);
        }
        let ends = |event: &&Value| event["event"] == "stopped" || event["event"] == "terminated";
        self.events.iter().rfind(ends).unwrap().clone()
    }

    fn go(&mut self, command: &str) -> Value {
        self.ask(command, &json!({ "threadId": 1 }));
        self.run()
    }

    /// Starts a program with breakpoints and runs to the first stop.
    fn start(&mut self, launch: &Value, path: &Path, breakpoints: &Value) -> Value {
        self.ask("launch", launch);
        self.ask(
            "setBreakpoints",
            &json!({ "source": { "path": path }, "breakpoints": breakpoints }),
        );
        self.ask("setExceptionBreakpoints", &json!({ "filters": ["alarms"] }));
        self.ask("configurationDone", &json!({}));
        self.run()
    }

    /// Program and line of each call of a task, innermost first.
    fn calls(&mut self, task: u16) -> Vec<(String, u64)> {
        let stack = self.ask("stackTrace", &json!({ "threadId": task }));
        let frames = stack["stackFrames"].as_array().unwrap().iter();
        frames
            .map(|frame| {
                (
                    frame["name"].as_str().unwrap().to_owned(),
                    frame["line"].as_u64().unwrap(),
                )
            })
            .collect()
    }

    fn line(&mut self) -> u64 {
        self.calls(1)[0].1
    }

    /// Names and values of a scope of the innermost call.
    fn scope(&mut self, name: &str) -> Vec<(String, String)> {
        let stack = self.ask("stackTrace", &json!({ "threadId": 1 }));
        let frame = &stack["stackFrames"][0]["id"];
        let scopes = self.ask("scopes", &json!({ "frameId": frame }));
        let scopes = scopes["scopes"].as_array().unwrap();
        let scope = scopes.iter().find(|scope| scope["name"] == name).unwrap();
        let variables = self.ask(
            "variables",
            &json!({ "variablesReference": scope["variablesReference"] }),
        );
        let rows = variables["variables"].as_array().unwrap().iter();
        let text = |value: &Value| value.as_str().unwrap().to_owned();
        rows.map(|row| (text(&row["name"]), text(&row["value"])))
            .collect()
    }

    fn value(&mut self, expression: &str) -> String {
        let stack = self.ask("stackTrace", &json!({ "threadId": 1 }));
        let frame = &stack["stackFrames"][0]["id"];
        let found = self.ask(
            "evaluate",
            &json!({ "expression": expression, "frameId": frame, "context": "watch" }),
        );
        found["result"].as_str().unwrap().to_owned()
    }

    fn said(&mut self) -> String {
        let texts = self.events.iter().filter(|event| event["event"] == "output");
        let text = texts
            .map(|event| event["body"]["output"].as_str().unwrap())
            .collect();
        self.events.clear();
        text
    }
}

fn named(rows: &[(&str, &str)]) -> Vec<(String, String)> {
    rows.iter()
        .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()))
        .collect()
}

fn call(name: &str, line: u64) -> (String, u64) {
    (name.to_owned(), line)
}

#[test]
fn a_condition_stops_in_the_call_for_which_it_is_true() {
    let mut editor = Editor::new();
    let path = editor.file("pallet.scol", PALLET);
    let stop = editor.start(
        &json!({ "program": path }),
        &path,
        &json!([{ "line": 16, "condition": "ROW == 2" }]),
    );
    assert_eq!(stop["body"]["reason"], "breakpoint");
    assert_eq!(stop["body"]["hitBreakpointIds"], json!([1]));
    assert_eq!(editor.calls(1), [call("PUT", 16), call("MAIN", 8)]);
    let locals = named(&[("ROW", "2"), ("DX", "12.500"), ("D", "25.000")]);
    assert_eq!(editor.scope("Local"), locals);
    assert_eq!(editor.scope("Global")[0], ("COUNT".to_owned(), "1".to_owned()));
    assert_eq!(editor.value("ROW * 2 + DX"), "16.500");
    assert_eq!(editor.value("PLACE.X"), "300.000");
}

#[test]
fn an_expression_that_does_not_compile_is_told_when_its_breakpoint_is_set() {
    let mut editor = Editor::new();
    let path = editor.file("pallet.scol", PALLET);
    editor.ask("launch", &json!({ "program": path }));
    let breakpoints = json!([
        { "line": 8, "condition": "ROW == 2" },
        { "line": 16, "condition": "ROW == 2" },
        { "line": 9, "condition": "I = 2" },
        { "line": 15, "logMessage": "row {ROW}, {COUTN}" },
        { "line": 17, "hitCondition": "3x" },
    ]);
    let source = json!({ "path": path });
    let set = editor.ask(
        "setBreakpoints",
        &json!({ "source": source, "breakpoints": breakpoints }),
    );
    let told = |at: usize| {
        (
            &set["breakpoints"][at]["verified"],
            &set["breakpoints"][at]["message"],
        )
    };
    // ROW is a parameter of PUT.
    let unknown = "the condition `ROW == 2`: ROW is never given a value";
    assert_eq!(told(0), (&json!(false), &json!(unknown)));
    assert_eq!(told(1), (&json!(true), &Value::Null));
    let assigns = "the condition `I = 2`: \"=\" assigns; compare with \"==\"";
    assert_eq!(told(2), (&json!(false), &json!(assigns)));
    let unknown = "`{COUTN}` in the message: COUTN is never given a value";
    assert_eq!(told(3), (&json!(false), &json!(unknown)));
    assert_eq!(told(4).0, &json!(false));
    editor.ask("configurationDone", &json!({}));
    assert_eq!(editor.run()["body"]["hitBreakpointIds"], json!([2]));
}

#[test]
fn steps_go_over_into_and_out_of_calls() {
    let mut editor = Editor::new();
    let path = editor.file("pallet.scol", PALLET);
    let stop = editor.start(
        &json!({ "program": path, "stopOnEntry": true }),
        &path,
        &json!([]),
    );
    assert_eq!(stop["body"]["reason"], "entry");
    assert_eq!(editor.line(), 6);
    editor.go("next");
    editor.go("next");
    assert_eq!(editor.line(), 8);
    editor.go("stepIn");
    assert_eq!(editor.calls(1), [call("PUT", 14), call("MAIN", 8)]);
    editor.go("stepOut");
    assert_eq!(editor.calls(1), [call("MAIN", 9)]);
    editor.go("next");
    assert_eq!(editor.line(), 8);
    editor.go("next");
    assert_eq!(editor.line(), 9, "a call is one step");
    editor.events.clear();
    editor.go("stepMotion");
    assert_eq!(editor.calls(1), [call("PUT", 16), call("MAIN", 8)]);
    // An editor knows of its own requests alone that they continue the program.
    assert_eq!(editor.events[0]["event"], "continued");
}

#[test]
fn back_leads_to_the_same_places_with_the_same_values() {
    let mut editor = Editor::new();
    let path = editor.file("pallet.scol", PALLET);
    editor.start(
        &json!({ "program": path, "stopOnEntry": true }),
        &path,
        &json!([]),
    );
    let mut seen = Vec::new();
    loop {
        seen.push((editor.calls(1), editor.scope("Local"), editor.scope("Global")));
        if editor.go("stepIn")["event"] == "terminated" || editor.line() == 11 {
            break;
        }
    }
    assert_eq!(seen.len(), 2 + 3 * 7 + 1, "{seen:#?}");
    for there in seen.iter().rev() {
        let stop = editor.go("stepBack");
        assert_eq!(stop["event"], "stopped");
        // A step back goes over what a call has done, as a step forward does.
        let here = (editor.calls(1), editor.scope("Local"), editor.scope("Global"));
        if there.0.len() == 1 {
            assert!(seen.contains(&here), "{here:?}");
        }
    }
    assert_eq!(editor.go("stepBack")["body"]["reason"], "entry");
    assert_eq!(editor.line(), 6);
    editor.ask(
        "setBreakpoints",
        &json!({ "source": { "path": path }, "breakpoints": [{ "line": 17 }] }),
    );
    for count in ["1", "2", "3"] {
        editor.go("continue");
        assert_eq!(editor.value("COUNT"), count);
    }
    for count in ["2", "1"] {
        editor.go("reverseContinue");
        assert_eq!(editor.value("COUNT"), count);
    }
}

#[test]
fn an_alarm_stops_with_its_cause() {
    let mut editor = Editor::new();
    let path = editor.file("pallet.scol", PALLET);
    let stop = editor.start(&json!({ "program": path }), &path, &json!([]));
    assert_eq!(stop["body"]["reason"], "exception");
    let info = editor.ask("exceptionInfo", &json!({ "threadId": 1 }));
    assert_eq!(info["exceptionId"], "2-101");
    assert_eq!(editor.calls(1), [call("MAIN", 11)], "the statement at fault");
    assert!(editor.said().contains("DONE           3"));
    assert_eq!(editor.go("continue")["event"], "terminated");
}

#[test]
fn an_alarm_of_a_task_stops_in_its_statement() {
    let mut editor = Editor::new();
    let program = "PROGRAM MAIN\n  T = TASK(\"BELT\")\n  DELAY 5\nEND\nPROGRAM BELT\n  N = 0\n  PART(N)\nEND\nPROGRAM PART(N)\n  \
                   M = 1 / N\n\n  M = 2\n  RETURN\nEND\n";
    let path = editor.file("belt.scol", program);
    let stop = editor.start(&json!({ "program": path }), &path, &json!([]));
    assert_eq!(
        (&stop["body"]["reason"], &stop["body"]["threadId"]),
        (&json!("exception"), &json!(2))
    );
    assert_eq!(editor.calls(2), [call("PART", 10), call("BELT", 7)]);
    assert_eq!(editor.calls(1), [call("MAIN", 3)]);
}

#[test]
fn a_changed_variable_makes_another_future_and_stays_on_the_way_back() {
    let mut editor = Editor::new();
    let path = editor.file("pallet.scol", PALLET);
    editor.start(
        &json!({ "program": path }),
        &path,
        &json!([{ "line": 16, "hitCondition": "2" }]),
    );
    let stack = editor.ask("stackTrace", &json!({ "threadId": 1 }));
    let frame = &stack["stackFrames"][0]["id"];
    for assignment in [
        "COUNT = 10",
        "ROW = 7",
        "PLACE = (300, 0, 60, 0, 0, 0, 0, 0, 0)",
        "PLACE.X = 310",
    ] {
        editor.ask(
            "evaluate",
            &json!({ "expression": assignment, "frameId": frame, "context": "repl" }),
        );
    }
    assert_eq!(editor.scope("Local")[0], ("ROW".to_owned(), "7".to_owned()));
    editor.go("next");
    assert_eq!(editor.value("COUNT"), "11");
    editor.go("stepBack");
    assert_eq!(
        (
            editor.value("COUNT"),
            editor.value("ROW"),
            editor.value("PLACE.X")
        ),
        ("10".to_owned(), "7".to_owned(), "310.000".to_owned())
    );
    editor.go("stepBack");
    assert_eq!(
        (editor.value("COUNT"), editor.value("ROW")),
        ("1".to_owned(), "2".to_owned())
    );
    editor.go("continue");
    // ROW is the I of the loop, which ends; the alarm of a count of 3 does not come.
    let events = editor.said();
    assert!(events.contains("DONE          11"), "{events}");
}

#[test]
fn a_message_is_said_and_does_not_stop() {
    let mut editor = Editor::new();
    let path = editor.file("pallet.scol", PALLET);
    let breakpoints = json!([
        { "line": 15, "logMessage": "row {ROW}: {D}" },
        { "line": 17, "hitCondition": ">=3" },
    ]);
    editor.start(&json!({ "program": path }), &path, &breakpoints);
    assert_eq!(editor.value("ROW"), "3");
    assert_eq!(editor.said(), "row 1: 12.500\nrow 2: 25.000\nrow 3: 37.500\n");
}

#[test]
fn values_have_the_digits_that_matter_and_arrays_their_subscripts() {
    let mut editor = Editor::new();
    let program = "GLOBAL\n  DIM GRID(2,1) AS INTEGER\nEND\nPROGRAM MAIN\n  R = 0.1\n  MOVE PLACE\n  N = 1\nEND\nDATA\n  \
                   POINT PLACE = 300.1, 10.7, 50, 0, 0, 0, 0, 0\nEND\n";
    let path = editor.file("digits.scol", program);
    let breakpoints = json!([{ "line": 7, "logMessage": "{HERE}" }, { "line": 8 }]);
    editor.start(&json!({ "program": path }), &path, &breakpoints);
    let place = "300.100, 10.700, 50.000, 0.000, 0.000, 0.000, 0.000, 0.000, ";
    let here = editor.value("HERE");
    assert!(here.starts_with(&format!("POINT({place}")), "{here}");
    let said = editor.said();
    assert!(said.starts_with(place), "{said}");
    assert_eq!(editor.value("R"), "0.100");
    let array = ("GRID".to_owned(), "array (0 to 2, 0 to 1)".to_owned());
    assert!(editor.scope("Global").contains(&array));
    assert_eq!(editor.scope("Points")[0].0, "PLACE");
    assert!(editor.scope("Points")[0].1.starts_with(&format!("POINT({place}")));
}

#[test]
fn tasks_are_threads_and_a_step_is_of_one_of_them() {
    let mut editor = Editor::new();
    let program = "PROGRAM MAIN\n  T = TASK(\"BELT\")\n  DELAY 1\n  N = 1\nEND\nPROGRAM BELT\n  M = 1\n  M = 2\n  DELAY 5\nEND\n";
    let path = editor.file("tasks.scol", program);
    let stop = editor.start(&json!({ "program": path }), &path, &json!([{ "line": 8 }]));
    assert_eq!(stop["body"]["threadId"], 2);
    let threads = editor.ask("threads", &json!({}));
    assert_eq!(
        threads["threads"],
        json!([{ "id": 1, "name": "MAIN" }, { "id": 2, "name": "BELT (task 2)" }])
    );
    assert_eq!(editor.calls(2), [call("BELT", 8)]);
    editor.ask("next", &json!({ "threadId": 1 }));
    let stop = editor.run();
    assert_eq!(
        (&stop["body"]["threadId"], editor.calls(1)),
        (&json!(1), vec![call("MAIN", 3)])
    );
}

#[test]
fn a_program_that_waits_for_nothing_continues_after_a_change() {
    let mut editor = Editor::new();
    let program = "GLOBAL\n  FLAG = 0\nEND\nPROGRAM MAIN\n  WAIT FLAG == 1\n  FLAG = FLAG + 0\n  PRINT COM1, \"ON\", CR\nEND\n";
    let path = editor.file("wait.scol", program);
    let stop = editor.start(&json!({ "program": path }), &path, &json!([]));
    assert!(
        stop["body"]["text"]
            .as_str()
            .unwrap()
            .contains("can no longer become true"),
        "{stop}"
    );
    let stack = editor.ask("stackTrace", &json!({ "threadId": 1 }));
    editor.ask(
        "evaluate",
        &json!({ "expression": "FLAG = 1", "frameId": stack["stackFrames"][0]["id"], "context": "repl" }),
    );
    editor.ask(
        "setBreakpoints",
        &json!({ "source": { "path": path }, "breakpoints": [{ "line": 7 }] }),
    );
    editor.go("continue");
    assert_eq!((editor.line(), editor.value("FLAG")), (7, "1".to_owned()));
    // On the way back to a place after it, the change is made again.
    editor.go("stepBack");
    assert_eq!((editor.line(), editor.value("FLAG")), (6, "1".to_owned()));
    assert_eq!(editor.go("continue")["body"]["reason"], "breakpoint");
    assert_eq!(editor.go("continue")["event"], "terminated");
    assert!(editor.said().contains("ON\n"));
}

#[test]
fn an_input_is_turned_on_where_the_program_waits_for_it() {
    let mut editor = Editor::new();
    let program = "PROGRAM MAIN\n  WAIT DIN(5)\n  IF DIN(-6) THEN GOTO OUT\n  PRINT COM1, \"SIX\", CR\nOUT:\n  PRINT COM1, \"FIVE\", CR\nEND\n";
    let path = editor.file("inputs.scol", program);
    let breakpoints = json!([{ "line": 3 }]);
    let stop = editor.start(&json!({ "program": path }), &path, &breakpoints);
    assert!(
        stop["body"]["text"].as_str().unwrap().contains("or an input"),
        "{stop}"
    );
    let frame = editor.ask("stackTrace", &json!({ "threadId": 1 }))["stackFrames"][0]["id"].clone();
    let scopes = editor.ask("scopes", &json!({ "frameId": frame }));
    let lines = editor.ask(
        "variables",
        &json!({ "variablesReference": scopes["scopes"][3]["variablesReference"] }),
    );
    assert_eq!(lines["variables"][0]["value"], "none on");
    let inputs = json!({ "variablesReference": lines["variables"][0]["variablesReference"] });
    let rows = editor.ask("variables", &inputs)["variables"].clone();
    let shown = |at: usize| (rows[at]["name"].clone(), rows[at]["value"].clone());
    assert_eq!(
        [shown(0), shown(1)],
        [(json!("DIN(5)"), json!("0")), (json!("DIN(6)"), json!("0"))]
    );
    let set = json!({ "variablesReference": inputs["variablesReference"], "name": "DIN(5)", "value": "1" });
    assert_eq!(editor.ask("setVariable", &set)["value"], "1");
    assert_eq!(editor.go("continue")["body"]["reason"], "breakpoint");

    let give = |editor: &mut Editor, text: &str| {
        let frame = editor.ask("stackTrace", &json!({ "threadId": 1 }))["stackFrames"][0]["id"].clone();
        editor.request(
            "evaluate",
            &json!({ "expression": text, "frameId": frame, "context": "repl" }),
        )
    };
    for (text, reason) in [
        ("DIN(257) = 1", "input 257 is STOP"),
        ("DIN(70) = 1", "there is no such input"),
        ("DIN(5) = 2", "expected 0 or 1 for an input, found 2"),
        ("DIN(N) = 1", "N is never given a value"),
    ] {
        let refused = give(&mut editor, text);
        assert!(refused["message"].as_str().unwrap().contains(reason), "{refused}");
    }
    assert_eq!(give(&mut editor, "DIN(6) = 1")["body"]["result"], "1");
    editor.go("next");
    assert_eq!(editor.line(), 4, "the statement that was next reads it");
    // On the way back it is as it was then, and on again after that.
    editor.go("stepBack");
    editor.go("stepBack");
    assert_eq!((editor.line(), editor.value("DIN(6)")), (2, "0".to_owned()));
    assert_eq!(editor.go("continue")["body"]["reason"], "breakpoint");
    assert_eq!(editor.go("continue")["event"], "terminated");
    assert!(editor.said().contains("SIX\nFIVE\n"));
}

#[test]
fn continue_after_a_stop_of_the_program_is_start() {
    let mut editor = Editor::new();
    let program = "GLOBAL\n  N = 0\nEND\nPROGRAM MAIN\n  PRINT COM1, \"ONE\", CR\n  STOP\n  PRINT COM1, \"TWO\", N, CR\n  N = 2\nEND\n";
    let path = editor.file("stops.scol", program);
    let stop = editor.start(&json!({ "program": path }), &path, &json!([{ "line": 8 }]));
    assert!(
        stop["body"]["text"]
            .as_str()
            .unwrap()
            .ends_with("to continue is START"),
        "{stop}"
    );
    assert_eq!(editor.line(), 7);
    let frame = editor.ask("stackTrace", &json!({ "threadId": 1 }))["stackFrames"][0]["id"].clone();
    editor.ask(
        "setExpression",
        &json!({ "expression": "N", "value": "7", "frameId": frame }),
    );
    editor.go("next");
    assert_eq!(editor.line(), 8);
    assert!(editor.said().contains("TWO           7\n"), "{}", editor.said());
    // The way back leads before the STOP; the change and START are made again on the way.
    editor.go("stepBack");
    editor.go("stepBack");
    assert_eq!((editor.line(), editor.value("N")), (6, "0".to_owned()));
    assert_eq!(editor.go("continue")["body"]["reason"], "breakpoint");
    assert_eq!((editor.line(), editor.value("N")), (8, "7".to_owned()));
    assert_eq!(editor.go("continue")["event"], "terminated");

    let mut editor = Editor::new();
    let path = editor.file("stops.scol", program);
    let end = editor.start(&json!({ "program": path, "noDebug": true }), &path, &json!([]));
    assert_eq!(
        end["event"], "terminated",
        "without debugging a STOP is the end, as of `ts3100 run`"
    );
}

#[test]
fn continue_after_an_alarm_is_a_start() {
    let mut editor = Editor::new();
    let program = "PROGRAM MAIN\n  N = 0\n  X = 1 / N\n  PRINT COM1, \"AFTER\", CR\nEND\n";
    let path = editor.file("alarm.scol", program);
    let stop = editor.start(&json!({ "program": path }), &path, &json!([]));
    assert_eq!(stop["body"]["reason"], "exception");
    assert_eq!(editor.go("continue")["event"], "terminated");
    assert_eq!(editor.said(), "AFTER\nafter 0.000 s: ended\n");
}

#[test]
fn an_expectation_that_is_not_met_is_told_at_the_end() {
    let mut editor = Editor::new();
    let path = editor.file("pick.scol", "PROGRAM MAIN\n  DELAY 0.5\nEND\n");
    let scenario = editor.file("cell.toml", "[[expect]]\nwhat = \"output 6 on\"\n");
    let launch = json!({ "program": path, "scenario": scenario });
    assert_eq!(editor.start(&launch, &path, &json!([]))["event"], "terminated");
    let exit = editor.events.iter().find(|event| event["event"] == "exited");
    assert_eq!(exit.unwrap()["body"]["exitCode"], 1);
    let (said, told) = (
        editor.said(),
        "after 0.500 s: ended\nscenario: line 1, expect output 6 on: ",
    );
    assert!(said.starts_with(told), "{said}");
}

#[test]
fn refusals_say_what_is_wrong() {
    let mut editor = Editor::new();
    let path = editor.file("wrong.scol", "PROGRAM MAIN\n  MOEV P1\nEND\n");
    let reason = editor.refused("launch", &json!({ "program": path }));
    assert!(reason.contains("did you mean MOVE?"), "{reason}");
    assert!(
        editor
            .refused("launch", &json!({}))
            .contains("expected `program`")
    );
    assert!(
        editor
            .refused("next", &json!({ "threadId": 1 }))
            .contains("no program is debugged yet")
    );
    assert!(
        editor
            .refused("gotoTargets", &json!({}))
            .contains("`gotoTargets` is not served")
    );
    let path = editor.file("pallet.scol", PALLET);
    let reason = editor.refused("launch", &json!({ "program": path, "din": "8" }));
    assert_eq!(
        reason,
        "`din`: expected a list of input lines such as [8, 12], found \"8\""
    );
    editor.refused("launch", &json!({ "progam": path, "preLaunchTask": "build" }));
    let warning = "warning: ignoring unknown attribute `progam` of `launch`; did you mean `program`?\n";
    assert_eq!(editor.said(), warning);
    let reason = editor.refused("launch", &json!({ "program": path, "at": ["1.5 s: inptu 8 on"] }));
    assert!(reason.contains("inptu"), "{reason}");
    let breakpoints = json!([
        { "line": 16, "hitCondition": "often" }, { "line": 99 }, { "line": 0 }, { "line": -3 }, { "line": "7" }, {}, { "line": 7 },
    ]);
    editor.start(
        &json!({ "program": path, "stopOnEntry": true }),
        &path,
        &json!([]),
    );
    let set = editor.ask(
        "setBreakpoints",
        &json!({ "source": { "path": path }, "breakpoints": breakpoints }),
    );
    let messages: Vec<&str> = (0..6)
        .map(|at| set["breakpoints"][at]["message"].as_str().unwrap())
        .collect();
    assert!(
        messages[0].contains("expected a number of hits such as `3`"),
        "{messages:?}"
    );
    assert_eq!(messages[1], "no statement follows in the file");
    assert_eq!(messages[2], "expected a line from 1 on, found 0");
    assert_eq!(messages[3], "expected a line from 1 on, found -3");
    assert_eq!(messages[4], "expected a line from 1 on, found \"7\"");
    assert_eq!(set["breakpoints"][6]["verified"], true, "the others are set");
    let reason = editor.refused(
        "evaluate",
        &json!({ "expression": "COUNT = 3", "context": "watch" }),
    );
    assert_eq!(reason, "\"=\" assigns; compare with \"==\"");
}

/// A host has uploaded a program, started it, and read its variables: all of it is gone through, forward and back.
#[test]
fn a_recording_of_a_host_is_debugged_in_both_directions() {
    let mut editor = Editor::new();
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/transcripts"));
    let recording = folder.join("seq-basic.txt");
    editor.ask("launch", &json!({ "recording": recording }));
    let changed = editor
        .events
        .iter()
        .find(|event| event["event"] == "capabilities")
        .unwrap();
    assert_eq!(changed["body"]["capabilities"]["supportsSetVariable"], false);
    editor.ask("configurationDone", &json!({}));
    let stop = editor.run();
    assert_eq!(stop["body"]["reason"], "entry");
    let stack = editor.ask("stackTrace", &json!({ "threadId": 1 }));
    let source = &stack["stackFrames"][0]["source"];
    let text = editor.ask("source", &json!({ "sourceReference": source["sourceReference"] }));
    assert!(text["content"].as_str().unwrap().contains("PROGRAM"));
    let mut seen = Vec::new();
    let mut stop = stop;
    while !stop["body"]["text"]
        .as_str()
        .unwrap()
        .contains("the end of the recording")
        && seen.len() < 60
    {
        seen.push((editor.calls(1), editor.scope("Global"), editor.scope("Lines")));
        stop = editor.go("stepIn");
    }
    assert!(seen.len() > 5, "{seen:?}");
    for there in seen.iter().rev() {
        editor.go("stepBack");
        let here = (editor.calls(1), editor.scope("Global"), editor.scope("Lines"));
        if there.0.len() == 1 && here.0.len() == 1 {
            assert_eq!(&here, there);
        }
    }
    let refused = editor.refused("setExpression", &json!({ "expression": "COUNT", "value": "1" }));
    assert!(refused.contains("a recording has happened"), "{refused}");
}

#[test]
fn the_file_of_a_recording_is_that_of_its_name_while_it_has_its_text() {
    let mut editor = Editor::new();
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/transcripts"));
    editor.ask("launch", &json!({ "recording": folder.join("seq-basic.txt") }));
    editor.ask("configurationDone", &json!({}));
    editor.run();
    let frame = |editor: &mut Editor| {
        let stack = editor.ask("stackTrace", &json!({ "threadId": 1 }));
        stack["stackFrames"][0].clone()
    };
    let first = frame(&mut editor);
    let content = editor.ask("source", &json!({}))["content"].clone();
    let content = content.as_str().unwrap();
    let name = format!(
        "{}.scol",
        first["source"]["name"].as_str().unwrap().to_lowercase()
    );
    let set = |editor: &mut Editor, path: &Path| {
        let set = editor.ask(
            "setBreakpoints",
            &json!({ "source": { "path": path }, "breakpoints": [{ "line": first["line"] }] }),
        );
        set["breakpoints"][0].clone()
    };
    let other = editor.file("another.scol", content);
    assert_eq!(set(&mut editor, &other)["verified"], false);
    let line = usize::try_from(first["line"].as_u64().unwrap()).unwrap();
    let mut lines: Vec<&str> = content.lines().collect();
    lines.insert(line - 1, "  M = 1");
    let path = editor.file(&name, &lines.join("\n"));
    let refused = set(&mut editor, &path);
    assert_eq!(refused["verified"], false);
    let told = refused["message"].as_str().unwrap();
    assert!(
        told.contains(&format!("line {line} differs from the recorded")),
        "{told}"
    );
    assert_eq!(frame(&mut editor)["source"]["sourceReference"], 1);
    // A remark in another code does not hide that.
    let remark = [b"' \x83\x65\n", lines.join("\n").as_bytes()].concat();
    fs::write(&path, remark).unwrap();
    assert_eq!(set(&mut editor, &path)["verified"], false);

    let path = editor.file(&name, &format!("{content}\n' a remark\n"));
    assert_eq!(set(&mut editor, &path)["verified"], true);
    assert_eq!(frame(&mut editor)["source"]["path"], json!(path));
    assert_eq!(editor.said(), "");
    // It is changed while it is shown.
    editor.file(&name, &lines.join("\n"));
    assert_eq!(set(&mut editor, &path)["verified"], false);
    let said = editor.said();
    assert!(said.starts_with("warning: ") && said.contains(told), "{said}");
    assert_eq!(frame(&mut editor)["source"]["sourceReference"], 1);
    let stop = editor.go("continue");
    assert!(
        stop["body"]["text"]
            .as_str()
            .unwrap()
            .contains("the end of the recording"),
        "breakpoints of other lines stop nothing: {stop}"
    );
}

/// Without the number of the message, which depends on how quickly the editor asks.
fn unnumbered(mut message: Value) -> Value {
    message["seq"] = Value::Null;
    message
}

#[test]
fn a_recorded_session_of_an_editor_is_answered_as_it_was() {
    let folder = Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../fixtures/sessions/debug"
    ));
    let session = fs::read_to_string(folder.join("vscode.jsonl")).unwrap();
    let place = TempDir::new("session");
    let program = place.path().join("pick.scol");
    fs::copy(folder.join("pick.scol"), &program).unwrap();
    let session = session.replace("/cell/pick.scol", &program.to_string_lossy().replace('\\', "/"));
    let mut server = Server::new(Programs);
    let (mut expected, mut found) = (Vec::new(), Vec::new());
    for line in session.lines() {
        let entry: Value = serde_json::from_str(line).unwrap();
        let Some(message) = entry.get("editor") else {
            expected.push(unnumbered(entry["server"].clone()));
            continue;
        };
        found.extend(server.receive(message.to_string().as_bytes()));
        while server.is_running() {
            found.extend(server.work());
        }
    }
    assert!(server.has_ended());
    let of_kind = |messages: &[Value], kind: &str| -> Vec<Value> {
        let messages = messages.iter().filter(|message| message["type"] == kind);
        messages.cloned().map(unnumbered).collect()
    };
    for kind in ["response", "event"] {
        assert_eq!(of_kind(&found, kind), of_kind(&expected, kind));
    }
    assert!(expected.len() > 40);
}

#[test]
fn the_longest_run_ends_in_a_stop_and_goes_on() {
    let mut editor = Editor::new();
    let program = "PROGRAM MAIN\n  N = 0\nLOOP:\n  N = N + 1\n  DELAY 1\n  GOTO LOOP\nEND\n";
    let path = editor.file("long.scol", program);
    let stop = editor.start(&json!({ "program": path, "maxTime": "2.5s" }), &path, &json!([]));
    let told = "Stopped: after 2.500 s: stopped at line 5, since `maxTime` is over; continue runs for as long again, \
                a larger `maxTime` stops later";
    assert_eq!(
        (&stop["event"], &stop["body"]["text"]),
        (&json!("stopped"), &json!(told))
    );
    assert_eq!((editor.line(), editor.value("N")), (5, "3".to_owned()));
    let stop = editor.go("continue");
    assert!(
        stop["body"]["text"].as_str().unwrap().contains("after 5.000 s"),
        "{stop}"
    );
    let second = editor.value("N");
    editor.ask(
        "setBreakpoints",
        &json!({ "source": { "path": path }, "breakpoints": [{ "line": 5, "condition": "N == 2" }] }),
    );
    // Back over the stop before.
    let stop = editor.go("reverseContinue");
    assert_eq!(
        (&stop["body"]["reason"], editor.value("N")),
        (&json!("breakpoint"), "2".to_owned())
    );
    editor.ask("setBreakpoints", &json!({ "source": { "path": path } }));
    editor.go("continue");
    let stop = editor.go("continue");
    assert!(
        stop["body"]["text"].as_str().unwrap().contains("after 5.000 s"),
        "{stop}"
    );
    assert_eq!(editor.value("N"), second);
}

/// Whether a run has ended, or taken its longest time.
fn is_over(event: &Value) -> bool {
    let text = event["body"]["text"].as_str().unwrap_or_default();
    event["event"] == "terminated" || text.contains("`maxTime`")
}

/// Every program of the fixtures that runs by itself: stopped before each of its statements it says the same, and takes as long.
#[test]
fn a_run_that_is_inspected_is_the_same_run() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/scol/run"));
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|end| end != "scol") {
            continue;
        }
        let arguments = |stops: bool| json!({ "program": path, "maxTime": "20s", "stopOnEntry": stops });
        let mut plain = Editor::new();
        if plain.request("launch", &arguments(false))["success"] != true {
            continue;
        }
        plain.ask("configurationDone", &json!({}));
        let mut steps = 0;
        while !is_over(&plain.run()) && steps < 3 {
            plain.go("continue");
            steps += 1;
        }
        let mut stepped = Editor::new();
        stepped.ask("launch", &arguments(true));
        stepped.ask("configurationDone", &json!({}));
        let mut steps = 0;
        while !is_over(&stepped.run()) && steps < 400 {
            stepped.ask("stepIn", &json!({ "threadId": 1 }));
            steps += 1;
        }
        while !is_over(&stepped.run()) && steps < 403 {
            stepped.go("continue");
            steps += 1;
        }
        count += 1;
        assert_eq!(stepped.said(), plain.said(), "{}", path.display());
    }
    assert!(count > 5, "{count}");
}
