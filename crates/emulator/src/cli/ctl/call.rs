//! Maps each command of `ts3100 ctl` to one HTTP call: method, path and JSON body.
//!
//! It only checks what the server could not report well, for example unreadable files. Validation of values is left to
//! the control interface. Sending the call is in [`super`].

use super::args::{
    AlarmsCommand, CallArgs, ChannelCommand, ClockCommand, Command, DecodeArgs, EventsArgs, FaultsCommand,
    FileCommand, JogCommand, LineArgs, LineCommand, METHODS, PendantCommand, ProgramCommand, SnapshotCommand,
    WaitArgs, WaitLimits,
};
use crate::cli::controls::{self, ButtonCommand, QueryCommand, SwitchCommand};
use crate::cli::input;
use anyhow::{Context as _, anyhow};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Duration;
use ts3100_control::{DEFAULT_WALL, MAX_WALL};
use ts3100_controller::Condition;
use ts3100_controller::controls::{BUTTONS, Button};
use ts3100_controller::faults::Fault;
use ts3100_controller::limits;
use ts3100_controller::time::parse_duration_in;
use ts3100_driver::pc_file;
use ts3100_proto::escape::{self, EscapeError, Escaped, hex_byte, hex_digits};
use ts3100_proto::text::EOF;
use ts3100_proto::words::{UnexpectedWord, plain_message};
use ts3100_recording::faults::fault_json;
use ts3100_recording::transcript::{Format, TranscriptFile};
use ts3100_recording::uri::percent_encoded;

/// Largest file of this computer that is sent, in bytes: one of the drive, with an EOF at its end.
const MAX_FILE: u64 = limits::MAX_FILE as u64 + 1;
/// Largest snapshot that is sent, in bytes: the interface takes no larger one.
const MAX_SNAPSHOT: u64 = ts3100_control::MAX_SNAPSHOT as u64;

/// The calls that wait; their body may have a limit, `wall`.
const WAITING_PATHS: [&str; 3] = ["/wait", "/clock/advance", "/clock/advance-until"];

/// A call.
#[derive(Debug)]
pub struct Call {
    /// `GET`, `PUT`, `POST` or `DELETE`.
    pub method: &'static str,
    /// Path and query.
    pub path: String,
    /// JSON.
    pub body: Option<Value>,
}

fn call(method: &'static str, path: impl Into<String>, body: Option<Value>) -> Call {
    let path = path.into();
    Call { method, path, body }
}

fn get(path: impl Into<String>) -> Call {
    call("GET", path, None)
}

fn put(path: impl Into<String>, body: Value) -> Call {
    call("PUT", path, Some(body))
}

fn post(path: impl Into<String>, body: Value) -> Call {
    call("POST", path, Some(body))
}

fn delete(path: impl Into<String>) -> Call {
    call("DELETE", path, None)
}

/// A switch that is shown or set, or a button of its name.
fn switch(SwitchCommand { switch, word }: &SwitchCommand) -> Result<Call, UnexpectedWord> {
    let Some(word) = word else {
        return Ok(get(switch.path));
    };
    let form = format!("{} {word}", switch.name());
    let button = BUTTONS.iter().find(|button| button.form == form);
    Ok(match button {
        Some(button) => press(button),
        None => put(switch.path, controls::body(switch, word)?),
    })
}

fn press(button: &Button) -> Call {
    post(button.path, json!({}))
}

/// Something shown, or one of the actions on it.
fn button(path: &str, action: Option<&String>) -> Call {
    action.map_or_else(|| get(path), |action| post(format!("{path}/{action}"), json!({})))
}

fn program(action: &ProgramCommand) -> Call {
    match action {
        ProgramCommand::Button(ButtonCommand(button, _)) => press(button),
        ProgramCommand::RunTo { line } => post("/program/run-to", json!({"line": line})),
        ProgramCommand::Stack => get("/program/stack"),
        ProgramCommand::Evaluate { expression, place } => {
            let CallArgs { task, call } = place;
            let body = json!({"expression": expression, "task": task, "call": call});
            post("/program/evaluate", body)
        }
        ProgramCommand::Assign { assignment, place } => {
            let CallArgs { task, call } = place;
            let body = json!({"assignment": assignment, "task": task, "call": call});
            post("/program/assign", body)
        }
        ProgramCommand::StepTask { kind, task } => {
            let body = json!({"kind": kind.as_str(), "task": task});
            post("/program/step-task", body)
        }
    }
}

/// Breakpoints in these lines, all with the same rules.
fn breakpoints(lines: &[u32], rules: [&Option<String>; 3]) -> Call {
    if rules.iter().all(|rule| rule.is_none()) {
        return put("/breakpoints", json!({"lines": lines}));
    }
    let [condition, hits, message] = rules;
    let rule = |line| json!({"line": line, "condition": condition, "hits": hits, "message": message});
    let rules: Vec<Value> = lines.iter().map(rule).collect();
    put("/breakpoints", json!({"lines": lines, "rules": rules}))
}

fn jog(key: &JogCommand) -> Call {
    let (direction, key) = match key {
        JogCommand::Plus(key) => ("plus", key),
        JogCommand::Minus(key) => ("minus", key),
        JogCommand::Button(ButtonCommand(button, _)) => return press(button),
    };
    let body = json!({
        "axis": key.axis,
        "direction": direction,
        "coordinates": key.coordinates,
        "speed": key.speed,
        "inching": key.inching,
    });
    post("/jog", body)
}

fn decode(text: &DecodeArgs) -> Call {
    let body = json!({
        "direction": text.direction,
        "hex": text.hex.join(" "),
        "command": text.command,
    });
    post("/decode", body)
}

/// The wires, or one that is set from outside.
fn wire(outside: Option<&str>, on: bool) -> Call {
    let Some(name) = outside else {
        return get("/wires");
    };
    put(
        format!("/wires/outside/{}", percent_encoded(name)),
        json!({"on": on}),
    )
}

/// Calls about all robots of a process, whichever is named.
const OF_ALL: [&str; 2] = ["/robots", "/wires"];

impl Call {
    /// Turns the call into one of the robot of this name.
    pub fn of_robot(mut self, robot: Option<String>) -> Call {
        if let Some(name) = robot
            && !OF_ALL.iter().any(|path| self.path.starts_with(path))
        {
            self.path
                .insert_str(0, &format!("/robots/{}", percent_encoded(&name)));
        }
        self
    }

    /// Time that the interface may take on purpose, by the system clock.
    pub fn longest_wait(&self) -> Duration {
        if !WAITING_PATHS.iter().any(|path| self.path.ends_with(path)) || self.method != "POST" {
            return Duration::ZERO;
        }
        let wall = self.body.as_ref().and_then(|body| body.get("wall")?.as_f64());
        let wall = wall.and_then(|wall| Duration::try_from_secs_f64(wall).ok());
        wall.unwrap_or(DEFAULT_WALL).min(MAX_WALL)
    }

    /// The call of a command.
    ///
    /// # Errors
    /// Unknown words, or a file that cannot be read.
    pub fn from_command(command: &Command, json: bool) -> anyhow::Result<Call> {
        Ok(match command {
            Command::State => get("/state"),
            Command::Robots => get("/robots"),
            Command::Wires { outside, state } => wire(outside.as_deref(), state.unwrap_or_default()),
            Command::Switch(command) => switch(command)?,
            Command::Query(QueryCommand(query)) => get(query.path),
            Command::Program { action: None } => get("/program"),
            Command::Program { action: Some(action) } => program(action),
            Command::Breakpoints {
                lines, none: false, ..
            } if lines.is_empty() => get("/breakpoints"),
            Command::Breakpoints {
                lines,
                condition,
                hits,
                say,
                ..
            } => breakpoints(lines, [condition, hits, say]),
            Command::Jog { key } => jog(key),
            Command::Pendant { action: None } => get("/pendant"),
            Command::Pendant {
                action: Some(PendantCommand::Keys { text }),
            } => post("/pendant/keys", json!({"keys": keys(text)?})),
            Command::Alarms { action } => alarms(action.as_ref()),
            Command::Faults { action } => faults(action.as_ref()),
            Command::Inputs(line) => line_call("input", line)?,
            Command::Outputs(line) => line_call("output", line)?,
            Command::Variables { name, value, restore } => {
                value_call("/variables", name.as_deref(), value, *restore)?
            }
            Command::Positions { name, value, restore } => position(name.as_deref(), value, *restore)?,
            Command::Files { action } => file(action.as_ref())?,
            Command::Channels { port, action } => channel(port.as_deref(), action.as_ref())?,
            Command::Decode(text) => decode(text),
            Command::Clock { action } => clock(action.as_ref())?,
            Command::Wait(until) => post("/wait", until_body(until)?),
            Command::Power { action } => button("/power", action.as_ref()),
            Command::Reset => post("/reset", json!({})),
            Command::Snapshots { action } => snapshot(action.as_ref())?,
            Command::Transcript { file } => transcript(file.as_ref(), json),
            Command::Events(events) => get(events_path(*events)),
            Command::Findings => get("/findings"),
            Command::Coverage => get("/coverage"),
            Command::Scenario => get("/scenario"),
            Command::Metrics => get("/metrics"),
            Command::Health => get("/health"),
            Command::Version => get("/version"),
            Command::Call { method, path, body } => raw(method, path, body.as_deref())?,
        })
    }
}

fn snapshot(action: Option<&SnapshotCommand>) -> anyhow::Result<Call> {
    let named = |name: &str| format!("/snapshots/{}", percent_encoded(name));
    Ok(match action {
        None => get("/snapshots"),
        Some(SnapshotCommand::Show { name: None }) => get("/snapshot"),
        Some(SnapshotCommand::Show { name: Some(name) }) => get(named(name)),
        Some(SnapshotCommand::Load { path }) => put("/snapshot", read_json(path)?),
        Some(SnapshotCommand::Take { name }) => put(named(name), json!({})),
        Some(SnapshotCommand::Restore { name }) => post(format!("{}/restore", named(name)), json!({})),
        Some(SnapshotCommand::Delete { name }) => delete(named(name)),
    })
}

/// A file of JSON.
fn read_json(path: &Path) -> anyhow::Result<Value> {
    let bytes = read(path, MAX_SNAPSHOT)?;
    serde_json::from_slice(&bytes).map_err(|error| {
        let reason = plain_message(&error.to_string());
        anyhow!("{}: expected JSON: {reason}", path.display())
    })
}

fn transcript(file: Option<&TranscriptFile>, json: bool) -> Call {
    let default = if json { Format::Json } else { Format::Text };
    get(match file.map_or(default, |file| file.format) {
        Format::Text => "/transcript",
        Format::Json => "/transcript?format=jsonl",
        Format::Pcapng => "/transcript?format=pcapng",
    })
}

fn raw(method: &str, path: &str, body: Option<&str>) -> anyhow::Result<Call> {
    let plain = path.starts_with('/') && path.bytes().all(|byte| byte.is_ascii_graphic());
    if !plain {
        return Err(UnexpectedWord::new("a path of a URL", path).into());
    }
    let body = body.map(serde_json::from_str).transpose();
    let body = body.map_err(|error| anyhow!("body: {}", plain_message(&error.to_string())))?;
    let mut methods = METHODS.into_iter();
    let method = methods.find(|known| known.eq_ignore_ascii_case(method));
    Ok(call(method.unwrap_or_default(), path, body))
}

fn alarms(action: Option<&AlarmsCommand>) -> Call {
    match action {
        None => get("/alarms"),
        Some(AlarmsCommand::Raise { number, detail }) => {
            let detail = detail.as_deref().unwrap_or_default();
            post("/alarms", json!({"number": number, "detail": detail}))
        }
        Some(AlarmsCommand::Button(ButtonCommand(button, _))) => press(button),
        Some(AlarmsCommand::Table { number: None }) => get("/alarms/table"),
        Some(AlarmsCommand::Table { number: Some(number) }) => {
            get(format!("/alarms/table/{}", percent_encoded(number)))
        }
    }
}

fn faults(action: Option<&FaultsCommand>) -> Call {
    match action {
        None => get("/faults"),
        Some(FaultsCommand::Arm { spec }) => post("/faults", arm_body(spec)),
        Some(FaultsCommand::Disarm { number }) => delete(format!("/faults/{number}")),
        Some(FaultsCommand::Clear) => delete("/faults"),
        Some(FaultsCommand::Kinds) => get("/faults/kinds"),
    }
}

/// A fault as the body that arms it.
fn arm_body(fault: &Fault) -> Value {
    let mut body = fault_json(fault);
    if fault.id == 0
        && let Some(keys) = body.as_object_mut()
    {
        keys.remove("id");
    }
    body
}

fn line_call(side: &'static str, LineArgs { line, action }: &LineArgs) -> anyhow::Result<Call> {
    let Some(line) = line else {
        return match action {
            None => Ok(get(format!("/{side}s"))),
            Some(_) => Err(anyhow!("the number of the {side} is missing")),
        };
    };
    let path = format!("/{side}s/{line}");
    Ok(match action {
        None => get(path),
        Some(LineCommand::On) => put(path, json!({"on": true})),
        Some(LineCommand::Off) => put(path, json!({"on": false})),
        Some(LineCommand::Pulse { state, time }) => {
            let length = parse_duration_in("s", &time.join(" "))?;
            post(
                format!("{path}/pulse"),
                json!({"on": *state, "seconds": length.as_secs_f64()}),
            )
        }
        Some(LineCommand::Force { state }) => put(format!("{path}/force"), json!({"on": *state})),
        Some(LineCommand::Release) => delete(format!("{path}/force")),
        Some(LineCommand::Wait { state, limits }) => {
            let condition = json!({ side: {"line": line, "on": *state} });
            post("/wait", wait_body(&condition, *limits))
        }
    })
}

fn position(name: Option<&str>, value: &[String], restore: bool) -> anyhow::Result<Call> {
    match (name, value) {
        (Some(name), [word]) if word == "teach" => Ok(post(
            format!("/positions/{}/teach", percent_encoded(name)),
            json!({"restore": restore}),
        )),
        _ => value_call("/positions", name, value, restore),
    }
}

fn value_call(path: &str, name: Option<&str>, value: &[String], restore: bool) -> anyhow::Result<Call> {
    let Some(name) = name else {
        return Ok(get(path));
    };
    let path = format!("{path}/{}", percent_encoded(name));
    if value.is_empty() {
        return Ok(get(path));
    }
    let number = |word: &String| {
        let number: Result<serde_json::Number, _> = serde_json::from_str(word);
        number.map_err(|_| UnexpectedWord::new("a number", word))
    };
    let value = value.iter().map(number).collect::<Result<Vec<_>, _>>()?;
    Ok(put(path, json!({"value": value, "restore": restore})))
}

fn file(action: Option<&FileCommand>) -> anyhow::Result<Call> {
    let path = |name: &str| format!("/files/{}", percent_encoded(name));
    Ok(match action {
        None => get("/files"),
        Some(FileCommand::Get { name }) => get(path(name)),
        Some(FileCommand::Put { name, path: from }) => put(path(name), read_content(from)?),
        Some(FileCommand::Erase { name }) => delete(path(name)),
        Some(FileCommand::Select { name }) => post(format!("{}/select", path(name)), json!({})),
        Some(FileCommand::Check { name }) => post("/check", json!({"file": name})),
    })
}

fn read(path: &Path, most: u64) -> anyhow::Result<Vec<u8>> {
    input::read(path, most).with_context(|| format!("cannot read {}", path.display()))
}

/// The content of a file, as text where it is one. An EOF at its end is not part of it, as for `--load`.
fn read_content(path: &Path) -> anyhow::Result<Value> {
    let content = input::read(path, MAX_FILE).map_err(pc_file::limit_of_the_drive);
    let content = content.and_then(|mut content| {
        content.pop_if(|last| *last == EOF);
        pc_file::check_size(&content).map(|()| content)
    });
    let content = content.with_context(|| format!("cannot read {}", path.display()))?;
    Ok(bytes_json(content))
}

/// Bytes in JSON: as text where they are text.
pub fn bytes_json(bytes: Vec<u8>) -> Value {
    match String::from_utf8(bytes) {
        Ok(text) => json!({ "text": text }),
        Err(error) => json!({"hex": hex_digits(error.as_bytes())}),
    }
}

/// Keys of the teach pendant.
fn keys(text: &str) -> anyhow::Result<String> {
    String::from_utf8(unescape(text)?).map_err(|_| UnexpectedWord::new("keys in UTF-8", text).into())
}

fn channel(port: Option<&str>, action: Option<&ChannelCommand>) -> anyhow::Result<Call> {
    let Some(port) = port else {
        return match action {
            None => Ok(get("/channels")),
            Some(_) => Err(anyhow!("the port is missing")),
        };
    };
    let path = format!("/channels/{}", port.to_ascii_uppercase());
    Ok(match action {
        None => get(path),
        Some(ChannelCommand::Drop) => post(format!("{path}/drop"), json!({})),
        Some(ChannelCommand::Inject { hex: Some(hex), .. }) => {
            post(format!("{path}/inject"), json!({"hex": hex}))
        }
        Some(ChannelCommand::Inject { text, .. }) => {
            let bytes = unescape(text.as_deref().unwrap_or_default())?;
            post(format!("{path}/inject"), bytes_json(bytes))
        }
    })
}

fn clock(action: Option<&ClockCommand>) -> anyhow::Result<Call> {
    Ok(match action {
        None => get("/clock"),
        Some(ClockCommand::Mode { mode }) => put("/clock", json!({"mode": mode.to_string()})),
        Some(ClockCommand::Advance { time, wall }) => {
            let time = parse_duration_in("s", &time.join(" "))?;
            let wall = wall.map(|wall| wall.as_secs_f64());
            let body = json!({"seconds": time.as_secs_f64(), "wall": wall});
            post("/clock/advance", body)
        }
        Some(ClockCommand::AdvanceUntil(until)) => post("/clock/advance-until", until_body(until)?),
    })
}

fn until_body(until: &WaitArgs) -> anyhow::Result<Value> {
    Ok(wait_body(&condition(&until.condition)?, until.limits))
}

fn wait_body(condition: &Value, limits: WaitLimits) -> Value {
    let WaitLimits { within, wall } = limits;
    let wall = wall.map(|wall| wall.as_secs_f64());
    json!({"condition": condition, "within": within.as_secs_f64(), "wall": wall})
}

/// The words of a condition, as the controller writes them. Backslashes are escapes, as in the other commands.
fn condition(words: &[String]) -> anyhow::Result<Value> {
    let condition: Condition = notation(&words.join(" ")).parse()?;
    Ok(json!(condition.to_string()))
}

fn events_path(events: EventsArgs) -> String {
    let since = events.since.map(|since| format!("since={since}"));
    let count = events.count.map(|count| format!("count={count}"));
    let query: Vec<String> = since.into_iter().chain(count).collect();
    format!("/events?{}", query.join("&"))
}

/// The bytes of a text with control codes, as traffic and transcripts print them (`<CR>`) or with backslashes (`\r`).
fn unescape(text: &str) -> Result<Vec<u8>, EscapeError> {
    escape::parse(&notation(text))
}

/// Replaces the escapes `\r`, `\n`, `\t`, `\\` and `\xNN` by the notation of [`escape`].
fn notation(text: &str) -> String {
    let mut shown = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('\\') {
        shown += &Escaped::for_reading(before.as_bytes()).to_string();
        let byte = after
            .strip_prefix('x')
            .and_then(|digits| digits.get(..2))
            .and_then(hex_byte);
        let (byte, length) = match (after.chars().next(), byte) {
            (Some('r'), _) => (b'\r', 1),
            (Some('n'), _) => (b'\n', 1),
            (Some('t'), _) => (b'\t', 1),
            (Some('x'), Some(byte)) => (byte, 3),
            (Some('\\'), _) => (b'\\', 1),
            _ => (b'\\', 0),
        };
        shown += &Escaped::new(&[byte]).to_string();
        rest = after.get(length..).unwrap_or_default();
    }
    shown + &Escaped::for_reading(rest.as_bytes()).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_codes_may_be_written() {
        for (text, bytes) in [
            (r"1,2\r\n", "1,2\r\n"),
            (r"\x02SO\r\x03", "\x02SO\r\x03"),
            (r"a\\b\q\", r"a\b\q\"),
            ("<STX>SO<CR><03>", "\x02SO\r\x03"),
            (r"a\x3Cb\xFF<é", ""),
            (r"a\x3Cbé", "a<bé"),
        ] {
            let found = unescape(text).unwrap_or_default();
            assert_eq!(found, bytes.as_bytes(), "{text}");
        }
    }

    #[test]
    fn conditions_are_words_with_control_codes_as_in_other_commands() {
        let read = |words: &str| {
            let words: Vec<String> = words.split(' ').map(str::to_owned).collect();
            condition(&words).map_err(|error| error.to_string())
        };
        for (words, expected) in [
            ("output 5 on", "output 5 on"),
            ("printed ip1 DONE", "printed IP1 DONE"),
            (r"printed A\r\x41", "printed TP A<CR>A"),
            ("printed A<CR>", "printed TP A<CR>"),
            ("status stop (retry)", "status stop (retry)"),
            ("alarm any", "alarm"),
            ("idle", "idle"),
        ] {
            assert_eq!(read(words), Ok(json!(expected)));
        }
        let error = read("comand SU").unwrap_err();
        assert_eq!(error, "unknown condition `comand SU`; did you mean `command`?");
    }
}
