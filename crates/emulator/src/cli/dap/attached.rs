//! A running emulator that is debugged by its control interface, as `ts3100 ctl` reaches it.
//!
//! The debugger sets breakpoints and asks whether the program has stopped; everything else of the robot continues, and its hosts
//! notice the stop alone. A program that is at its first step waits for a start, of a host or of the debugger. The calls are in
//! `ts3100_control`, the messages of the editor in `ts3100_workbench::dap`.

use crate::cli::ctl::call::Call;
use crate::cli::ctl::target::{self, TargetArgs};
use scol_mini::ValueKind;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::io::{BufRead as _, BufReader};
use std::mem;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};
use ts3100_control::client::{Body, Client, DEFAULT_TIMEOUT};
use ts3100_controller::inspection::Breakpoint;
use ts3100_controller::queries::{CallView, TaskStack, VariableView};
use ts3100_proto::command::Number;
use ts3100_proto::words::Word as _;
use ts3100_recording::uri::percent_encoded;
use ts3100_workbench::dap::{
    Abilities, AttachArguments, Debuggee, Goal, Progress, Refusal, Said, Scene, Source, Stop, StopReason,
    placed,
};

/// Time between two looks at the status.
const POLL: Duration = Duration::from_millis(50);
/// Longest wait for the end of a step when the debugger leaves: editors wait little longer.
const LONGEST_STEP: Duration = Duration::from_secs(2);
/// Longest wait for an event that has happened.
const LONGEST_STREAM: Duration = Duration::from_secs(1);
/// Status of a program at its first step.
const RESET: &str = "stop (reset)";
const RUNNING: &str = "running";

/// A robot of a running emulator.
pub(super) struct Attached {
    calls: Calls,
    /// The selected file, as it was when the breakpoints were set.
    source: Source,
    statement_lines: Vec<u32>,
    breakpoints: Vec<Breakpoint>,
    going: Going,
    /// The debugger has stopped the program, so it lets it continue when it leaves.
    is_own_stop: bool,
    /// Where it stopped last.
    stopped_at: Option<ProgramStatus>,
    /// From the stream of events.
    told: Receiver<Told>,
    /// The program runs, so an event will tell its stop.
    has_run: bool,
    said: Vec<Said>,
}

/// What the debugger waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Going {
    /// A stop; the end of the program is none, since a host starts it again.
    Run,
    /// A stop, or the end of the program.
    Step,
    /// A stop for which it has asked.
    Pause,
    /// Nothing: it has stopped.
    Stopped,
}

/// What the stream of events tells.
enum Told {
    /// The message of a breakpoint, or a PRINT.
    Said(Said),
    /// The program has stopped: everything before it has been told.
    Stop,
}

/// The calls of one robot.
struct Calls {
    client: Client,
    robot: Option<String>,
}

/// The answer of `/program`.
#[derive(PartialEq, Eq, Deserialize)]
struct ProgramStatus {
    file: String,
    status: String,
    line: u32,
}

/// The answer of `/program/stack`.
#[derive(Deserialize)]
struct ProgramStack {
    file: String,
    status: String,
    stopped: Option<ProgramStop>,
    tasks: Vec<StackTask>,
    statement_lines: Vec<u32>,
}

#[derive(Deserialize)]
struct ProgramStop {
    reason: String,
    task: u16,
    line: u32,
    fault: Option<String>,
}

#[derive(Deserialize)]
struct StackTask {
    id: u16,
    calls: Vec<StackCall>,
    interrupted: Option<usize>,
}

#[derive(Deserialize)]
struct StackCall {
    program: String,
    line: u32,
    locals: Vec<Variable>,
}

#[derive(Deserialize)]
struct Variable {
    name: String,
    kind: Option<String>,
    bounds: Vec<u32>,
    value: Option<Vec<Number>>,
}

/// What is shown of `/state`.
#[derive(Deserialize)]
struct State {
    t: f64,
    variables: Vec<Variable>,
    inputs: Lines,
    outputs: Lines,
    channels: Vec<Channel>,
    alarms: Vec<Alarm>,
}

#[derive(Deserialize)]
struct Lines {
    on: Vec<u16>,
}

#[derive(Deserialize)]
struct Channel {
    port: String,
    exchange: Option<String>,
    buffer_hex: String,
}

#[derive(Deserialize)]
struct Alarm {
    number: String,
    text: String,
}

/// An event of the stream.
#[derive(Deserialize)]
struct StreamedEvent {
    event: String,
    line: Option<u32>,
    text: Option<String>,
    status: Option<String>,
}

/// A refusal: its sentence, and the place that it is about.
#[derive(Deserialize)]
struct Problem {
    error: String,
    #[serde(rename = "where")]
    place: Option<String>,
}

impl Problem {
    /// The line of the breakpoint that is refused.
    fn line(&self) -> Option<u32> {
        self.place.as_deref()?.strip_prefix("line ")?.parse().ok()
    }
}

impl Calls {
    fn of_robot(&self, method: &'static str, path: &str, body: Option<Value>) -> Call {
        let path = path.to_owned();
        Call { method, path, body }.of_robot(self.robot.clone())
    }

    fn call<T: DeserializeOwned>(
        &self,
        method: &'static str,
        path: &str,
        body: Option<Value>,
    ) -> Result<T, Refusal> {
        let answer = self.answer(method, path, body)?;
        answer.map_err(|problem| Refusal::new(problem.error))
    }

    /// The answer to a call, or the reason for which the emulator refuses it.
    fn answer<T: DeserializeOwned>(
        &self,
        method: &'static str,
        path: &str,
        body: Option<Value>,
    ) -> Result<Result<T, Problem>, Refusal> {
        let call = self.of_robot(method, path, body);
        let body = call.body.as_ref().map(Value::to_string);
        let answer = self.client.call(call.method, &call.path, body.as_deref());
        let (status, text) = answer
            .map_err(|error| Refusal::new(format!("{error}{}", target::advice(&error, "`address`"))))?;
        if status >= 400 {
            let problem = serde_json::from_str::<Problem>(&text);
            let problem =
                problem.map_err(|_| Refusal::new(format!("{path} was answered with status {status}")));
            return Ok(Err(problem?));
        }
        serde_json::from_str(&text).map(Ok).map_err(|error| {
            Refusal::new(format!(
                "cannot read the answer of {path}: {error}. Use a `ts3100` of the version of the emulator"
            ))
        })
    }

    fn get<T: DeserializeOwned>(&self, path: &str) -> Result<T, Refusal> {
        self.call("GET", path, None)
    }

    fn post<T: DeserializeOwned>(&self, path: &str, body: Value) -> Result<T, Refusal> {
        self.call("POST", path, Some(body))
    }

    /// Opens the stream of events from now on.
    fn events(&self) -> Result<Body, Refusal> {
        let call = self.of_robot("GET", "/events", None);
        let answer = self.client.send(call.method, &call.path, None);
        let mut answer = answer
            .map_err(|error| Refusal::new(format!("{error}{}", target::advice(&error, "`address`"))))?;
        if answer.status >= 400 {
            return Err(Refusal::new(format!(
                "the stream of events was answered with status {}",
                answer.status
            )));
        }
        answer.body.set_size_limit(u64::MAX);
        answer.body.lift_deadline();
        Ok(answer.body)
    }
}

/// Passes on the messages of breakpoints and stops of the program, until the emulator ends or the debugger has left.
fn follow(events: Body, teller: &Sender<Told>) {
    for line in BufReader::new(events).lines() {
        let Ok(line) = line else { return };
        let event = line
            .strip_prefix("data: ")
            .and_then(|data| serde_json::from_str::<StreamedEvent>(data).ok());
        let Some(event) = event else { continue };
        let text = event.text.unwrap_or_default();
        let told = match event.event.as_str() {
            "breakpoint" => Told::Said(Said {
                line: event.line,
                text,
            }),
            "pendant" => Told::Said(Said {
                line: None,
                text: text.replace('\r', "\n"),
            }),
            "status" if event.status.as_deref() != Some(RUNNING) => Told::Stop,
            _ => continue,
        };
        if teller.send(told).is_err() {
            return;
        }
    }
}

impl From<Variable> for VariableView {
    fn from(variable: Variable) -> VariableView {
        let kind = |word: &str| ValueKind::ALL.into_iter().find(|kind| kind.word() == word);
        VariableView {
            kind: variable.kind.as_deref().and_then(kind),
            name: variable.name,
            bounds: variable.bounds,
            value: variable.value,
        }
    }
}

fn views(variables: Vec<Variable>) -> Vec<VariableView> {
    variables.into_iter().map(VariableView::from).collect()
}

impl From<StackTask> for TaskStack {
    fn from(task: StackTask) -> TaskStack {
        let call = |call: StackCall| CallView {
            program: call.program,
            line: call.line,
            locals: views(call.locals),
        };
        TaskStack {
            id: task.id,
            state: "stopped",
            calls: task.calls.into_iter().map(call).collect(),
            interrupted: task.interrupted,
        }
    }
}

impl Attached {
    /// Attaches to a robot; the program continues.
    ///
    /// # Errors
    /// There is no such emulator or robot, or it does not answer.
    pub fn attach(arguments: &AttachArguments) -> Result<Attached, Refusal> {
        let target = TargetArgs::of_parts(
            arguments.address.clone(),
            arguments.robot.clone(),
            arguments.token.clone(),
        );
        let url = target.url().map_err(Refusal::new)?;
        let client = target.client(&url, DEFAULT_TIMEOUT).map_err(Refusal::new)?;
        let calls = Calls {
            client,
            robot: target.robot(),
        };
        let status: ProgramStatus = calls.get("/program")?;
        let events = calls.events()?;
        let (teller, told) = channel();
        let reading = thread::Builder::new().name("events".to_owned());
        let started = reading.spawn(move || follow(events, &teller));
        started.map_err(Refusal::new)?;
        let mut attached = Attached {
            calls,
            source: Source::default(),
            statement_lines: Vec::new(),
            breakpoints: Vec::new(),
            going: Going::Run,
            is_own_stop: false,
            stopped_at: None,
            told,
            has_run: false,
            said: Vec::new(),
        };
        attached.read_source(status.file)?;
        Ok(attached)
    }

    /// Reads the selected file.
    fn read_source(&mut self, name: String) -> Result<(), Refusal> {
        let stack: ProgramStack = self.calls.get("/program/stack")?;
        self.read_text(name, &stack)
    }

    /// Reads the text of the selected file; its lines are those of this stack.
    fn read_text(&mut self, name: String, stack: &ProgramStack) -> Result<(), Refusal> {
        #[derive(Deserialize)]
        struct File {
            text: Option<String>,
        }
        let text = match name.is_empty() {
            true => None,
            false => {
                let path = format!("/files/{}", percent_encoded(&name));
                self.calls.get::<File>(&path)?.text
            }
        };
        self.statement_lines.clone_from(&stack.statement_lines);
        self.source = Source {
            name,
            text: text.unwrap_or_default(),
        };
        Ok(())
    }

    fn say(&mut self, text: String) {
        self.said.push(Said { line: None, text });
    }

    /// Takes what was told so far.
    fn listen(&mut self) {
        let said = self.told.try_iter().filter_map(|told| match told {
            Told::Said(said) => Some(said),
            Told::Stop => None,
        });
        self.said.extend(said);
    }

    /// Takes what was told before the stop that has come: the stream may be later than the status.
    fn listen_until_stop(&mut self) {
        while let Ok(Told::Said(said)) = self.told.recv_timeout(LONGEST_STREAM) {
            self.said.push(said);
        }
    }

    /// Tells the emulator its breakpoints.
    fn put_breakpoints(&self) -> Result<Result<(), Problem>, Refusal> {
        let lines: Vec<u32> = self.breakpoints.iter().map(|set| set.line).collect();
        let ruled = self.breakpoints.iter().filter(|set| !set.is_plain());
        let rules = ruled.map(|set| {
            json!({
                "line": set.line,
                "condition": set.condition,
                "hits": set.hits.map(|rule| rule.to_string()),
                "message": set.message,
            })
        });
        let body = json!({ "lines": lines, "rules": rules.collect::<Vec<_>>() });
        let answer = self.calls.answer::<Value>("PUT", "/breakpoints", Some(body))?;
        Ok(answer.map(drop))
    }

    /// Waits until a stop that was asked for has come, since a start before it has no effect.
    fn await_stop(&self) {
        let asked = Instant::now();
        while asked.elapsed() < LONGEST_STEP {
            let status = self.calls.get::<ProgramStatus>("/program");
            if status.is_ok_and(|status| status.status == RUNNING) {
                thread::sleep(POLL);
            } else {
                return;
            }
        }
    }

    fn stop_of(&self, stack: ProgramStack) -> Result<Stop, Refusal> {
        let end = |words: &str| StopReason::End {
            code: 0,
            words: words.to_owned(),
        };
        let Some(stopped) = stack.stopped else {
            let reason = match stack.status.as_str() {
                RESET => end("the program is at its first step; continue starts it"),
                _ => StopReason::Pause,
            };
            return Ok(Stop::of_program(reason));
        };
        let reason = match stopped.reason.as_str() {
            "breakpoint" => match stopped.fault {
                Some(fault) => StopReason::Fault(fault),
                None => {
                    let here = self.breakpoints.iter().enumerate();
                    let here = here.filter(|(_, set)| set.line == stopped.line && set.message.is_none());
                    StopReason::Breakpoints(here.map(|(index, _)| index).collect())
                }
            },
            "step" => StopReason::Step,
            "alarm" => self.alarm()?,
            "end" => end("the end of the program; continue starts it again"),
            _ => StopReason::Pause,
        };
        let task = stopped.task;
        Ok(Stop { reason, task })
    }

    /// The alarm that has stopped the program.
    fn alarm(&self) -> Result<StopReason, Refusal> {
        let state: State = self.calls.get("/state")?;
        let alarm = state.alarms.into_iter().next_back();
        Ok(alarm.map_or(StopReason::Pause, |alarm| StopReason::Alarm {
            number: alarm.number,
            text: alarm.text,
        }))
    }
}

impl Debuggee for Attached {
    fn abilities(&self) -> Abilities {
        Abilities {
            goes_back: false,
            assigns: true,
        }
    }

    fn refresh(&mut self) -> Result<(), Refusal> {
        self.read_source(self.source.name.clone())
    }

    fn source(&self) -> Source {
        self.source.clone()
    }

    fn look_again(&mut self) -> Result<Option<Progress>, Refusal> {
        let status: ProgramStatus = self.calls.get("/program")?;
        if self.stopped_at.as_ref() == Some(&status) {
            return Ok(None);
        }
        if status.status == RUNNING {
            (self.going, self.has_run, self.is_own_stop) = (Going::Run, true, false);
            return Ok(Some(Progress::Going));
        }
        self.work().map(Some)
    }

    fn statement_lines(&self) -> Vec<u32> {
        self.statement_lines.clone()
    }

    fn set_breakpoints(&mut self, breakpoints: Vec<Breakpoint>) -> Vec<Result<u32, Refusal>> {
        let plain: Vec<bool> = breakpoints.iter().map(Breakpoint::is_plain).collect();
        let (set, found) = placed(breakpoints, &self.statement_lines, |_| Ok(()));
        self.breakpoints = set;
        let mut wrong: Vec<(u32, Refusal)> = Vec::new();
        let refused = loop {
            let problem = match self.put_breakpoints() {
                Ok(Ok(())) => break None,
                Ok(Err(problem)) => problem,
                Err(reason) => break Some(reason),
            };
            // The emulator names the line whose expression it cannot read: the others are set without it.
            let (count, line) = (self.breakpoints.len(), problem.line());
            self.breakpoints
                .retain(|set| set.is_plain() || Some(set.line) != line);
            let reason = Refusal::new(problem.error);
            match line {
                Some(line) if self.breakpoints.len() < count => wrong.push((line, reason)),
                _ => break Some(reason),
            }
        };
        if refused.is_some() {
            self.breakpoints.clear();
        }
        let told = found.into_iter().zip(plain).map(|(found, is_plain)| {
            let line = found?;
            if let Some(reason) = &refused {
                return Err(reason.clone());
            }
            let wrong = wrong.iter().find(|(at, _)| *at == line && !is_plain);
            wrong.map_or(Ok(line), |(_, reason)| Err(reason.clone()))
        });
        told.collect()
    }

    /// An alarm that stops the program cannot be kept from doing so.
    fn stop_on_alarm(&mut self, _: bool) {}

    fn go(&mut self, goal: Goal) -> Result<(), Refusal> {
        let (path, body, going) = match goal.step() {
            Some((kind, task)) => {
                let body = json!({ "kind": kind.word(), "task": task });
                ("/program/step-task", body, Going::Step)
            }
            None => ("/program/start", json!({}), Going::Run),
        };
        self.listen();
        self.calls.post::<Value>(path, body)?;
        (self.going, self.is_own_stop, self.has_run) = (going, false, true);
        Ok(())
    }

    fn work(&mut self) -> Result<Progress, Refusal> {
        let status: ProgramStatus = self.calls.get("/program")?;
        if status.file != self.source.name {
            let name = status.file.clone();
            self.read_source(name)?;
            self.breakpoints.clear();
            let name = &self.source.name;
            let words = format!(
                "another file is selected: `{name}`; set breakpoints in it, those of the file before are gone\n"
            );
            self.say(words);
        }
        self.has_run |= status.status == RUNNING;
        let waits = self.going == Going::Run && status.status == RESET;
        if status.status == RUNNING || waits {
            return Ok(Progress::Going);
        }
        let stack: ProgramStack = self.calls.get("/program/stack")?;
        if stack.status == RUNNING || stack.file != self.source.name {
            // A host has been faster.
            return Ok(Progress::Going);
        }
        if mem::take(&mut self.has_run) {
            self.listen_until_stop();
            // A file that was downloaded since has other lines.
            self.read_text(self.source.name.clone(), &stack)?;
        }
        let stop = self.stop_of(stack)?;
        let is_own = match stop.reason {
            StopReason::Breakpoints(_) | StopReason::Fault(_) | StopReason::Step => true,
            StopReason::Pause => self.going == Going::Pause,
            StopReason::Entry | StopReason::Alarm { .. } | StopReason::End { .. } => false,
        };
        (self.going, self.is_own_stop, self.stopped_at) = (Going::Stopped, is_own, Some(status));
        Ok(Progress::Stopped(stop))
    }

    fn patience(&self) -> Duration {
        POLL
    }

    fn pause(&mut self) {
        match self.calls.post::<Value>("/program/stop", json!({})) {
            Ok(_) => self.going = Going::Pause,
            Err(reason) => self.say(format!("cannot stop the program: {reason}\n")),
        }
    }

    fn take_said(&mut self) -> Vec<Said> {
        self.listen();
        mem::take(&mut self.said)
    }

    fn scene(&self) -> Result<Scene, Refusal> {
        let stack: ProgramStack = self.calls.get("/program/stack")?;
        let state: State = self.calls.get("/state")?;
        let channels = state
            .channels
            .into_iter()
            .filter(|channel| channel.exchange.is_none());
        let buffer = |channel: Channel| {
            let digits = channel.buffer_hex.as_bytes().chunks(2);
            let bytes = digits.filter_map(|pair| u8::from_str_radix(str::from_utf8(pair).ok()?, 16).ok());
            (channel.port, bytes.collect())
        };
        Ok(Scene {
            time: Duration::try_from_secs_f64(state.t).unwrap_or_default(),
            tasks: stack.tasks.into_iter().map(TaskStack::from).collect(),
            variables: views(state.variables),
            inputs: state.inputs.on,
            outputs: state.outputs.on,
            channels: channels.map(buffer).collect(),
        })
    }

    fn evaluate(&self, task: u16, call: usize, text: &str) -> Result<VariableView, Refusal> {
        let body = json!({ "expression": text, "task": task, "call": call });
        let found = self.calls.post::<Variable>("/program/evaluate", body);
        found.map(VariableView::from)
    }

    fn assign(&mut self, task: u16, call: usize, text: &str) -> Result<VariableView, Refusal> {
        let body = json!({ "assignment": text, "task": task, "call": call });
        let assigned = self.calls.post::<Variable>("/program/assign", body);
        assigned.map(VariableView::from)
    }

    /// Takes its breakpoints away; a program that the debugger has stopped continues. An emulator that is gone needs neither.
    fn release(&mut self) {
        if !self.breakpoints.is_empty() {
            self.breakpoints.clear();
            let _ = self.put_breakpoints();
        }
        if self.going == Going::Pause {
            self.await_stop();
        }
        // A start makes a run of a step that is under way.
        if self.is_own_stop || matches!(self.going, Going::Pause | Going::Step) {
            let _ = self.calls.post::<Value>("/program/start", json!({}));
        }
        (self.going, self.is_own_stop) = (Going::Run, false);
    }
}

#[cfg(test)]
mod tests;
