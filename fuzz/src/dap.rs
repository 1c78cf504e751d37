//! Fuzzes a session of an editor with the debugger: the first byte says what happens to its messages, the rest are the
//! messages, one a line. The program is always the same; the file that `launch` names is not read.
//!
//! Whatever an editor sends, cut, in another order, or twice: each request has one response, nothing else has one, what is
//! running ends, and the server answers `disconnect` at the end.

use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;
use ts3100_controller::{Config, Dialect};
use ts3100_driver::clock::TimeMode;
use ts3100_emulator::debugged::ProgramRun;
use ts3100_emulator::headless::RunRequest;
use ts3100_workbench::dap::{
    AttachArguments, LaunchArguments, Launched, Launcher, Origin, Refusal, Server, Timeline,
};

/// Most messages of a session.
const MAX_MESSAGES: usize = 40;
/// Most turns of a program that runs, after each message.
const MAX_TURNS: usize = 8;

/// Calls, an array, a task, a monitor, motions, and an alarm at the end.
const PROGRAM: &str = "GLOBAL\r  COUNT = 0\r  DIM GRID(2,1) AS INTEGER\rEND\rPROGRAM MAIN\r  ON COUNT == 2 DO GRID(1,1) = 5\r  \
    T = TASK(\"BELT\")\r  FOR I = 1 TO 3\r    PUT(I, 12.5)\r  NEXT I\r  X = 1 / (COUNT - 3)\r  MOVEA 1, X\rEND\rPROGRAM PUT(ROW, DX)\r  \
    D = ROW * DX\r  MOVE PLACE + POINT(D, 0, 0, 0, 0, 0, 0, 0, 0)\r  COUNT = COUNT + 1\r  GRID(0,1) = ROW\r  RETURN\rEND\r\
    PROGRAM BELT\r  DELAY 1\rEND\rDATA\r  POINT PLACE = 300, 0, 50, 0, 0, 0, 0, 0\rEND\r";

/// What happens to the messages, by the bits of the first byte.
const REVERSED: u8 = 1;
const TWICE: u8 = 2;
const CUT: u8 = 8;

struct Programs;

impl Launcher for Programs {
    fn launch(&mut self, _: LaunchArguments) -> Result<Launched, Refusal> {
        let run = ProgramRun::new(RunRequest {
            config: Config::new(Dialect::default()),
            name: "MAIN".to_owned(),
            source: PROGRAM.into(),
            records: BTreeMap::new(),
            lines_on: Vec::new(),
            position: None,
            scenario: None,
            call: None,
            trace: false,
            profile: false,
            record_lines: false,
            time: TimeMode::Auto,
            max_time: Duration::from_secs(60),
        });
        Ok(Launched {
            debuggee: Box::new(Timeline::new(run.map_err(Refusal::new)?)),
            path: Some("/work/main.scol".into()),
            origin: Origin::Program,
        })
    }

    fn attach(&mut self, _: AttachArguments) -> Result<Launched, Refusal> {
        Err(Refusal::new("there is no emulator"))
    }

    fn text(&self, _: &Path) -> Option<String> {
        Some(PROGRAM.to_owned())
    }

    fn is_named(&self, _: &Path, _: &str) -> bool {
        true
    }
}

/// Plays a session.
///
/// # Panics
/// When what must hold does not.
pub fn check(data: &[u8]) {
    let [choice, content @ ..] = data else {
        return;
    };
    let lines = content
        .split(|byte| *byte == b'\n')
        .filter(|line| !line.is_empty());
    let mut messages: Vec<Vec<u8>> = lines.take(MAX_MESSAGES).map(<[u8]>::to_vec).collect();
    let place = usize::from(choice >> 4);
    if choice & REVERSED != 0
        && let Some(rest) = messages.get_mut(place..)
    {
        rest.reverse();
    }
    if choice & CUT != 0
        && let Some(message) = messages.get_mut(place)
    {
        message.truncate(message.len() / 2);
    }
    if choice & TWICE != 0 {
        let again: Vec<Vec<u8>> = messages.iter().skip(place).cloned().collect();
        messages.extend(again);
    }
    let mut server = Server::new(Programs);
    for message in &messages {
        let answers = server.receive(message);
        let responses = answers
            .iter()
            .filter(|answer| answer["type"] == "response")
            .count();
        assert_eq!(
            responses,
            usize::from(is_request(message)),
            "{}",
            String::from_utf8_lossy(message)
        );
        for _ in 0..MAX_TURNS {
            if !server.is_running() {
                break;
            }
            let events = server.work();
            assert!(events.iter().all(|event| event["type"] == "event"));
        }
        if server.has_ended() {
            return;
        }
    }
    let last = json!({ "seq": 1, "type": "request", "command": "disconnect" }).to_string();
    let answers = server.receive(last.as_bytes());
    assert!(
        answers
            .iter()
            .any(|answer| answer["command"] == "disconnect" && answer["success"] == true)
    );
    assert!(server.has_ended());
}

fn is_request(message: &[u8]) -> bool {
    let message = serde_json::from_slice::<Value>(message).unwrap_or_default();
    let is_text = |key: &str| message.get(key).is_none_or(Value::is_string);
    message["type"] == "request" && message["seq"].is_u64() && is_text("command")
}
