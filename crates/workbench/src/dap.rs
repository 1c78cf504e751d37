//! The debugger of SCOL (Debug Adapter Protocol 1.68) as a value: messages of an editor in, messages to it out.
//!
//! [`Server`] knows the messages and their order. [`Debuggee`] is the program that is debugged: a [`Timeline`] of a program that
//! was launched, or of a recording, or a running emulator. [`Launcher`] makes one. Requests about a program that has stopped are in
//! `inspect`, its rows in `variables`, the files of the editor in `files`. Reading stdin, and calling [`Server::work`] between two messages, is left to the subcommand.

mod arguments;
mod breakpoints;
mod debuggee;
mod files;
mod inspect;
mod timeline;
mod variables;

pub use arguments::{AttachArguments, LaunchArguments};
pub use debuggee::{
    Abilities, Debuggee, Goal, MAIN_TASK, Progress, Refusal, Said, Scene, Source, Stop, StopReason, placed,
};
pub use timeline::{Afterwards, Change, Course, Ending, Timeline};

use arguments::{Attributes, Request};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::mem;
use std::path::{Path, PathBuf};
use std::time::Duration;
use variables::Container;

/// Number under which the text of the program is asked for.
const SOURCE: i64 = 1;
/// The filter of stops on alarms.
const ALARMS: &str = "alarms";

/// A program that was launched or attached to.
pub struct Launched {
    pub debuggee: Box<dyn Debuggee>,
    /// The file of the editor that is the selected one; without it that of its name, or the text of the RAM drive.
    pub path: Option<PathBuf>,
    pub origin: Origin,
}

/// Where the text comes from that runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// A file that was started.
    Program,
    Recording,
    /// An emulator, whose program runs already and does not wait for the editor.
    Robot,
}

/// Makes the program that is debugged.
pub trait Launcher {
    /// A program in virtual time, or a recording.
    ///
    /// # Errors
    /// What is wrong, where, and what helps.
    fn launch(&mut self, arguments: LaunchArguments) -> Result<Launched, Refusal>;

    /// A running emulator.
    ///
    /// # Errors
    /// As of `launch`.
    fn attach(&mut self, arguments: AttachArguments) -> Result<Launched, Refusal>;

    /// The text of a file of the editor; `None` if it cannot be read.
    fn text(&self, path: &Path) -> Option<String>;

    /// Whether a file of the editor has this name on the RAM drive.
    fn is_named(&self, path: &Path, name: &str) -> bool;
}

/// How the editor counts, and whether it draws.
#[derive(Debug, Clone, Copy)]
struct Client {
    lines_from_1: bool,
    columns_from_1: bool,
}

impl Client {
    fn line(self, line: u32) -> u32 {
        if self.lines_from_1 {
            line
        } else {
            line.saturating_sub(1)
        }
    }

    fn line_of_editor(self, line: u32) -> u32 {
        if self.lines_from_1 {
            line
        } else {
            line.saturating_add(1)
        }
    }

    /// The line that an editor has written, from 1.
    fn line_in(self, written: &Value) -> Result<u32, Refusal> {
        let line = written.as_u64().and_then(|line| u32::try_from(line).ok());
        let line = line
            .map(|line| self.line_of_editor(line))
            .filter(|line| *line > 0);
        let first = self.line(1);
        line.ok_or_else(|| Refusal::new(format!("expected a line from {first} on, found {written}")))
    }

    fn first_column(self) -> u32 {
        u32::from(self.columns_from_1)
    }
}

/// Progress of the conversation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Before `launch` or `attach`.
    Begun,
    /// The editor sends its breakpoints.
    Configuring {
        stops_on_entry: bool,
    },
    Running {
        enters: bool,
    },
    Stopped,
    /// The program is over.
    Over,
    Ended,
}

/// The debugger.
pub struct Server<L> {
    launcher: L,
    launched: Option<Launched>,
    /// Whether the file of the editor shows the text that runs.
    compared: Result<(), Refusal>,
    client: Client,
    phase: Phase,
    /// Number of the next message.
    seq: u64,
    /// Breakpoints stop nothing.
    no_debug: bool,
    /// Number of the breakpoint that is set next.
    next_breakpoint: usize,
    /// Numbers of those that stop the program, as it counts them.
    breakpoints: Vec<usize>,
    /// The source for which they were set.
    breakpoints_of: Value,
    /// What is shown since the last stop.
    scene: Scene,
    /// Task and call of each frame that was shown, by its number less 1.
    frames: Vec<(u16, usize)>,
    /// What can be opened, by its number less 1.
    containers: Vec<Container>,
    /// The last stop was an alarm: its number and words.
    alarm: Option<(String, String)>,
    out: Vec<Value>,
}

impl<L: Launcher> Server<L> {
    pub fn new(launcher: L) -> Server<L> {
        Server {
            launcher,
            launched: None,
            compared: Ok(()),
            client: Client {
                lines_from_1: true,
                columns_from_1: true,
            },
            phase: Phase::Begun,
            seq: 1,
            no_debug: false,
            next_breakpoint: 1,
            breakpoints: Vec::new(),
            breakpoints_of: Value::Null,
            scene: Scene::default(),
            frames: Vec::new(),
            containers: Vec::new(),
            alarm: None,
            out: Vec::new(),
        }
    }

    /// Whether the program runs: call `work` when no message waits.
    pub fn is_running(&self) -> bool {
        matches!(self.phase, Phase::Running { .. })
    }

    /// How long to wait for a message while the program runs.
    pub fn patience(&self) -> Duration {
        let launched = self.launched.as_ref();
        launched.map_or(Duration::ZERO, |launched| launched.debuggee.patience())
    }

    /// The editor has gone without a word.
    pub fn abandoned(&mut self) -> Vec<Value> {
        if let Some(launched) = &mut self.launched {
            launched.debuggee.release();
        }
        Vec::new()
    }

    /// Whether the conversation is over.
    pub fn has_ended(&self) -> bool {
        self.phase == Phase::Ended
    }

    /// Answers a message.
    pub fn receive(&mut self, message: &[u8]) -> Vec<Value> {
        // A key that is there twice counts once, so that each request has its response.
        let message = serde_json::from_slice::<Value>(message);
        match message.and_then(serde_json::from_value::<Request>) {
            Ok(request) if request.kind == "request" => self.answer(request),
            // A response to something that was never asked.
            Ok(_) => {}
            Err(error) => {
                let text = format!("a message is not a request of the protocol: {error}\n");
                self.event("output", &json!({ "category": "important", "output": text }));
            }
        }
        mem::take(&mut self.out)
    }

    /// Whether `work` is to be called from time to time.
    pub fn wants_work(&self) -> bool {
        let is_stopped = self.phase == Phase::Stopped;
        self.is_running() || is_stopped && !self.patience().is_zero()
    }

    /// Lets the program run for a moment; of one that has stopped, looks at what others have done to it.
    pub fn work(&mut self) -> Vec<Value> {
        let Some(launched) = &mut self.launched else {
            return Vec::new();
        };
        let (progress, enters) = match self.phase {
            Phase::Running { enters } => (launched.debuggee.work(), enters),
            Phase::Stopped => match launched.debuggee.look_again().transpose() {
                Some(progress) => (progress, false),
                None => return Vec::new(),
            },
            Phase::Begun | Phase::Configuring { .. } | Phase::Over | Phase::Ended => return Vec::new(),
        };
        self.tell_said();
        match progress {
            Ok(Progress::Going) if self.phase == Phase::Stopped => {
                self.resume();
                let body = json!({ "threadId": MAIN_TASK, "allThreadsContinued": true });
                self.event("continued", &body);
            }
            Ok(Progress::Going) => {}
            Ok(Progress::Stopped(Stop {
                reason: StopReason::End { code, words },
                ..
            })) if self.no_debug => self.exited(code, &words),
            Ok(Progress::Stopped(stop)) => self.stopped(stop, enters),
            Ok(Progress::Ended { code, words }) => self.exited(code, &words),
            Err(reason) => {
                self.event(
                    "output",
                    &json!({ "category": "important", "output": format!("{reason}\n") }),
                );
                self.over();
            }
        }
        mem::take(&mut self.out)
    }

    fn exited(&mut self, code: u8, words: &str) {
        self.console(&format!("{words}\n"));
        self.event("exited", &json!({ "exitCode": code }));
        self.over();
    }

    fn over(&mut self) {
        self.phase = Phase::Over;
        self.event("terminated", &json!({}));
    }

    fn next_seq(&mut self) -> u64 {
        let seq = self.seq;
        self.seq += 1;
        seq
    }

    fn event(&mut self, event: &str, body: &Value) {
        let seq = self.next_seq();
        self.out
            .push(json!({ "seq": seq, "type": "event", "event": event, "body": body }));
    }

    fn console(&mut self, text: &str) {
        self.event("output", &json!({ "category": "console", "output": text }));
    }

    fn answer(&mut self, request: Request) {
        let Request {
            seq: request_seq,
            command,
            arguments,
            ..
        } = request;
        let result = self.carry_out(&command, arguments);
        let seq = self.next_seq();
        let mut response = json!({
            "seq": seq,
            "type": "response",
            "request_seq": request_seq,
            "command": command,
            "success": result.is_ok(),
        });
        match result {
            Ok(Value::Null) => {}
            Ok(body) => response["body"] = body,
            Err(reason) => {
                // VS Code shows `format`; braces in it name variables.
                let shown = matches!(
                    command.as_str(),
                    "launch" | "attach" | "setVariable" | "setExpression"
                );
                response["message"] = json!(reason);
                response["body"] = json!({ "error": {
                    "id": 1,
                    "format": "{reason}",
                    "variables": { "reason": reason },
                    "showUser": shown,
                }});
            }
        }
        let after = mem::take(&mut self.out);
        self.out.push(response);
        self.out.extend(after);
    }

    fn carry_out(&mut self, command: &str, arguments: Value) -> Result<Value, Refusal> {
        match command {
            "initialize" => Ok(self.initialize(&arguments)),
            "launch" => self.launch(arguments),
            "attach" => self.attach(arguments),
            "disconnect" | "terminate" => Ok(self.leave(command)),
            "setBreakpoints" => self.set_breakpoints(parsed(arguments)?),
            "setExceptionBreakpoints" => self.set_exceptions(&arguments),
            "breakpointLocations" => self.breakpoint_locations(&arguments),
            "configurationDone" => self.configured(),
            "threads" => Ok(json!({ "threads": self.threads() })),
            "source" => self.source(),
            "continue" => self.go(&arguments, |_| Goal::Run),
            "next" => self.go(&arguments, Goal::Over),
            "stepIn" => self.go(&arguments, Goal::Into),
            "stepOut" => self.go(&arguments, Goal::Out),
            "stepMotion" => {
                let body = self.go(&arguments, Goal::Motion)?;
                // Only of its own requests does an editor know that the program runs again.
                let thread = thread(&arguments)?;
                self.event(
                    "continued",
                    &json!({ "threadId": thread, "allThreadsContinued": true }),
                );
                Ok(body)
            }
            "stepBack" => self.go(&arguments, Goal::Back),
            "reverseContinue" => self.go(&arguments, |_| Goal::RunBack),
            "pause" => {
                self.debuggee()?.pause();
                Ok(Value::Null)
            }
            "stackTrace" => self.stack_trace(&arguments),
            "scopes" => self.scopes(&arguments),
            "variables" => self.variables(&arguments),
            "setVariable" => self.set_variable(&arguments),
            "setExpression" => self.set_expression(&arguments),
            "evaluate" => self.evaluate(&arguments),
            "exceptionInfo" => self.exception_info(),
            _ => Err(Refusal::new(format!(
                "`{command}` is not served by this debugger"
            ))),
        }
    }

    fn debuggee(&mut self) -> Result<&mut Box<dyn Debuggee>, Refusal> {
        let launched = self.launched.as_mut();
        launched
            .map(|launched| &mut launched.debuggee)
            .ok_or_else(|| Refusal::new("no program is debugged yet: send `launch` or `attach` first"))
    }

    fn stopped_debuggee(&mut self) -> Result<&mut Box<dyn Debuggee>, Refusal> {
        if self.is_running() {
            return Err(Refusal::new("the program is running: pause it first"));
        }
        self.debuggee()
    }

    fn initialize(&mut self, arguments: &Value) -> Value {
        let is_set = |key: &str| arguments.get(key) != Some(&Value::Bool(false));
        self.client = Client {
            lines_from_1: is_set("linesStartAt1"),
            columns_from_1: is_set("columnsStartAt1"),
        };
        json!({
            "supportsConfigurationDoneRequest": true,
            "supportsConditionalBreakpoints": true,
            "supportsHitConditionalBreakpoints": true,
            "supportsLogPoints": true,
            "supportsBreakpointLocationsRequest": true,
            "supportsEvaluateForHovers": true,
            "supportsSetVariable": true,
            "supportsSetExpression": true,
            "supportsExceptionInfoRequest": true,
            "supportsTerminateRequest": true,
            "supportsStepBack": true,
            "exceptionBreakpointFilters": [{
                "filter": ALARMS,
                "label": "Alarms",
                "description": "Stop when the controller raises an alarm",
                "default": true,
            }],
        })
    }

    fn launch(&mut self, arguments: Value) -> Result<Value, Refusal> {
        self.may_begin()?;
        let no_debug = arguments.get("noDebug") == Some(&Value::Bool(true));
        let arguments: LaunchArguments = self.attributes(arguments, "launch")?;
        // Of a recording the place comes first, and then the question where to go.
        let stops_on_entry = arguments.stop_on_entry.unwrap_or(arguments.recording.is_some());
        let stops_on_entry = stops_on_entry && !no_debug;
        self.no_debug = no_debug;
        let launched = self.launcher.launch(arguments)?;
        self.begin(launched, stops_on_entry);
        Ok(Value::Null)
    }

    fn attach(&mut self, arguments: Value) -> Result<Value, Refusal> {
        self.may_begin()?;
        let arguments = self.attributes(arguments, "attach")?;
        let launched = self.launcher.attach(arguments)?;
        self.begin(launched, false);
        Ok(Value::Null)
    }

    /// The attributes of a request; warnings about them go to the console.
    fn attributes<T: Attributes>(&mut self, arguments: Value, request: &str) -> Result<T, Refusal> {
        let mut warnings = Vec::new();
        let read = T::read(arguments, request, |warning| warnings.push(warning));
        for warning in warnings {
            self.console(&format!("warning: {warning}\n"));
        }
        read
    }

    fn may_begin(&self) -> Result<(), Refusal> {
        match self.launched {
            None => Ok(()),
            Some(_) => Err(Refusal::new("a program is debugged already: end it first")),
        }
    }

    fn begin(&mut self, launched: Launched, stops_on_entry: bool) {
        let Abilities { goes_back, assigns } = launched.debuggee.abilities();
        self.launched = Some(launched);
        self.phase = Phase::Configuring { stops_on_entry };
        let changed = json!({
            "supportsStepBack": goes_back,
            "supportsSetVariable": assigns,
            "supportsSetExpression": assigns,
        });
        self.event("capabilities", &json!({ "capabilities": changed }));
        self.event("initialized", &json!({}));
        self.look_at_file();
    }

    fn leave(&mut self, command: &str) -> Value {
        if let Some(launched) = &mut self.launched {
            launched.debuggee.release();
        }
        if self.phase != Phase::Over && self.phase != Phase::Begun {
            self.event("terminated", &json!({}));
        }
        self.phase = match command {
            "terminate" => Phase::Over,
            _ => Phase::Ended,
        };
        Value::Null
    }

    fn configured(&mut self) -> Result<Value, Refusal> {
        let Phase::Configuring { stops_on_entry } = self.phase else {
            return Err(Refusal::new(
                "`configurationDone` comes once, after `launch` or `attach`",
            ));
        };
        let goal = if stops_on_entry { Goal::Enter } else { Goal::Run };
        let origin = self.launched.as_ref().map(|launched| launched.origin);
        if origin != Some(Origin::Robot) {
            self.debuggee()?.go(goal)?;
        }
        self.phase = Phase::Running {
            enters: stops_on_entry,
        };
        Ok(Value::Null)
    }

    fn go(&mut self, arguments: &Value, goal: impl Fn(u16) -> Goal) -> Result<Value, Refusal> {
        if self.phase == Phase::Over {
            return Err(Refusal::new("the program is over"));
        }
        if matches!(self.phase, Phase::Configuring { .. }) {
            return Err(Refusal::new("send `configurationDone` first"));
        }
        let goal = goal(thread(arguments)?);
        let debuggee = self.stopped_debuggee()?;
        if matches!(goal, Goal::Back(_) | Goal::RunBack) && !debuggee.abilities().goes_back {
            return Err(Refusal::new(
                "a running emulator does not go back; debug its recording for that",
            ));
        }
        debuggee.go(goal)?;
        self.resume();
        Ok(if goal == Goal::Run {
            json!({ "allThreadsContinued": true })
        } else {
            Value::Null
        })
    }

    /// What was shown at the last stop is over.
    fn resume(&mut self) {
        self.phase = Phase::Running { enters: false };
        self.frames.clear();
        self.containers.clear();
        self.alarm = None;
    }

    fn tell_said(&mut self) {
        let Ok(debuggee) = self.debuggee() else { return };
        let said = debuggee.take_said();
        for Said { line, text } in said {
            let body = match line {
                None => json!({ "category": "stdout", "output": text }),
                Some(line) => json!({
                    "category": "console",
                    "output": format!("{text}\n"),
                    "source": self.source_document(),
                    "line": self.client.line(line),
                }),
            };
            self.event("output", &body);
        }
    }

    fn stopped(&mut self, stop: Stop, enters: bool) {
        self.phase = Phase::Stopped;
        self.look_at_file();
        let Stop { reason, task } = stop;
        match self.debuggee().and_then(|debuggee| debuggee.scene()) {
            Ok(scene) => self.scene = scene,
            Err(reason) => self.console(&format!("{reason}\n")),
        }
        let at = format!("at {} s", seconds(self.scene.time));
        let mut hit = Vec::new();
        let (word, words) = match reason {
            StopReason::Entry => ("entry", "Stopped at the beginning".to_owned()),
            StopReason::Step if enters => ("entry", "Stopped at the beginning".to_owned()),
            StopReason::Step => ("step", format!("Stopped {at}")),
            StopReason::Breakpoints(indices) => {
                hit = indices;
                ("breakpoint", format!("Stopped at a breakpoint {at}"))
            }
            StopReason::Fault(reason) => ("breakpoint", reason),
            StopReason::Alarm { number, text } => {
                let words = format!("Alarm {number} {text}");
                self.alarm = Some((number, text));
                ("exception", words)
            }
            StopReason::Pause => ("pause", format!("Stopped {at}")),
            StopReason::End { words, .. } => ("pause", format!("Stopped: {words}")),
        };
        let hit: Vec<usize> = hit
            .into_iter()
            .filter_map(|index| self.breakpoints.get(index).copied())
            .collect();
        self.event(
            "stopped",
            &json!({
                "reason": word,
                "description": words,
                "text": words,
                "threadId": task,
                "allThreadsStopped": true,
                "hitBreakpointIds": hit,
            }),
        );
    }

    fn threads(&self) -> Vec<Value> {
        let tasks = self.scene.tasks.iter().map(|task| {
            let outermost = task.calls.first();
            let program = outermost.map(|call| call.program.clone()).unwrap_or_default();
            let words = match task.id {
                MAIN_TASK => program,
                id => format!("{program} (task {id})"),
            };
            json!({ "id": task.id, "name": words })
        });
        let tasks: Vec<Value> = tasks.collect();
        if tasks.is_empty() {
            return vec![json!({ "id": MAIN_TASK, "name": "the main program" })];
        }
        tasks
    }

    fn source(&mut self) -> Result<Value, Refusal> {
        let text = self
            .debuggee()?
            .source()
            .text
            .replace("\r\n", "\n")
            .replace('\r', "\n");
        Ok(json!({ "content": text, "mimeType": "text/x-scol" }))
    }
}

/// The arguments of a request; a word that is not expected says which are.
fn parsed<T: DeserializeOwned>(arguments: Value) -> Result<T, Refusal> {
    let arguments = if arguments.is_null() { json!({}) } else { arguments };
    serde_json::from_value(arguments).map_err(Refusal::new)
}

fn thread(arguments: &Value) -> Result<u16, Refusal> {
    let id = arguments.get("threadId").and_then(Value::as_u64);
    let task = id.and_then(|id| u16::try_from(id).ok());
    task.ok_or_else(|| Refusal::new("expected `threadId`, the number of a task"))
}

fn seconds(time: Duration) -> String {
    format!("{:.3}", time.as_secs_f64())
}
