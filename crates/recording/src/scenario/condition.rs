//! The conditions and actions of a scenario: their text forms, and when a condition occurs. Actions on the controller have
//! the text form of transcripts ([`Action`]).

use std::fmt;
use ts3100_controller::input::{Input, PanelAction};
use ts3100_controller::output::{Event, Output};
use ts3100_controller::port::Port;
use ts3100_controller::signals::{IoKind, Signals};
use ts3100_controller::{ACTION_FORMS, Action, ActionParseError, Controller, alarm};
use ts3100_driver::cell::PlannedAction;
use ts3100_proto::escape::{self, EscapeError, Escaped};
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::words::{UnexpectedWord, Word as _, did_you_mean};

/// Every form of a condition.
pub const CONDITIONS: [&str; 18] = [
    "command TEXT",
    "answer TEXT",
    "refused COMMAND",
    "printed CHANNEL TEXT",
    "received CHANNEL TEXT",
    "connected PORT",
    "disconnected PORT",
    "alarm",
    "alarm NUMBER",
    "alarms reset",
    "status WORDS",
    "servo on|off",
    "selected NAME",
    "stored NAME",
    "erased NAME",
    "finding RULE",
    "input LINE on|off",
    "output LINE on|off",
];

/// Every form of an action beside those of [`ts3100_controller::ACTION_FORMS`].
pub const CHANNEL_ACTIONS: [&str; 2] = ["channel CHANNEL inject TEXT", "channel PORT drop"];

/// The teach pendant, as `printed` names it.
const PENDANT: &str = "TP";

/// Words that are no condition and no action.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WordsError {
    /// A word.
    #[error(transparent)]
    Word(#[from] UnexpectedWord),
    /// The end.
    #[error("expected {0}, found nothing")]
    Nothing(String),
    /// A line that the controller does not have.
    #[error("expected line 1-64, 101-164 or 201-264, found {0}")]
    Line(u16),
    /// Bytes.
    #[error(transparent)]
    Bytes(#[from] EscapeError),
    /// No condition and no action begins so.
    #[error("unknown {kind} `{words}`{hint}")]
    Unknown {
        /// `condition` or `action`.
        kind: &'static str,
        /// The words.
        words: String,
        /// What may be meant, as the end of the message.
        hint: String,
    },
    /// An action that goes on in a way that it cannot.
    #[error("cannot read the action `{words}`: {reason}")]
    Action {
        /// The words.
        words: String,
        /// What is wrong with them.
        reason: ActionParseError,
    },
}

/// The error for words that none of these forms begins like.
fn unknown<'a>(kind: &'static str, words: &str, forms: impl Iterator<Item = &'a str>) -> WordsError {
    let first = |form: &'a str| form.split(' ').next().unwrap_or_default();
    let name = words.split(' ').next().unwrap_or_default();
    let hint = match did_you_mean(name, forms.map(first)) {
        hint if hint.is_empty() => format!("; docs/reference/scenarios.md lists every {kind}"),
        hint => hint,
    };
    let words = words.to_owned();
    WordsError::Unknown { kind, words, hint }
}

/// Something that may happen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ScenarioCondition {
    /// A host sends a text that begins so.
    Command(Vec<u8>),
    /// A text of the robot begins so.
    Answer(Vec<u8>),
    /// A command with these letters gets NG.
    Refused(String),
    /// A program prints something with this in it, on a port or on the teach pendant.
    Printed(Option<Port>, Vec<u8>),
    /// A peer sends something with this in it.
    Received(Port, Vec<u8>),
    /// A peer comes.
    Connected(Port),
    /// A peer goes.
    Disconnected(Port),
    /// An alarm is raised, this one or any.
    Alarm(Option<String>),
    /// Alarms are reset.
    AlarmsReset,
    /// The status becomes this.
    Status(ExecutionStatus),
    /// Servo power goes on or off.
    Servo(bool),
    /// A file is selected; none for an empty name.
    Selected(String),
    /// A file is stored.
    Stored(String),
    /// A file is erased.
    Erased(String),
    /// A rule is broken.
    Finding(String),
    /// An input or an output becomes so.
    Line(IoKind, u16, bool),
}

/// Something that is done.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenarioAction {
    /// As it was written.
    pub words: String,
    /// What.
    pub action: PlannedAction,
}

impl ScenarioAction {
    /// Reads one.
    ///
    /// # Errors
    /// What was expected and found.
    pub fn parse(words: &str) -> Result<ScenarioAction, WordsError> {
        let action = match words.split_once(' ') {
            Some(("channel", rest)) => channel_action(rest)?,
            _ => {
                let action = action(words)?;
                PlannedAction::Input(if let Action::Panel(panel) = action {
                    Input::Panel(panel)
                } else {
                    Input::Action(action)
                })
            }
        };
        let words = words.to_owned();
        Ok(ScenarioAction { words, action })
    }

    /// One at the panel, in its words.
    pub(super) fn at_panel(panel: &PanelAction) -> ScenarioAction {
        ScenarioAction {
            words: panel.to_string(),
            action: PlannedAction::Input(Input::Panel(panel.clone())),
        }
    }
}

/// `IP1 inject TEXT` or `IP0 drop`.
fn channel_action(words: &str) -> Result<PlannedAction, WordsError> {
    let (name, what) = words.split_once(' ').unwrap_or((words, ""));
    let (verb, text) = what.split_once(' ').unwrap_or((what, ""));
    match (verb, text) {
        ("inject", text) => {
            let input = Input::received(parse_scol_port(name)?, parse_bytes(text)?);
            Ok(PlannedAction::Input(input))
        }
        ("drop", "") => {
            let found = Port::from_word(name).filter(|port| Port::ETHERNET.contains(port));
            let port = found.ok_or_else(|| UnexpectedWord::new("IP0, IP1, IP2 or IP3", name))?;
            Ok(PlannedAction::Drop(port))
        }
        _ => Err(UnexpectedWord::new("inject TEXT or drop", what).into()),
    }
}

fn action(words: &str) -> Result<Action, WordsError> {
    let found = words.parse::<Action>().map_err(|reason| match reason {
        ActionParseError::Unknown(_) => unknown(
            "action",
            words,
            ACTION_FORMS.iter().chain(&CHANNEL_ACTIONS).copied(),
        ),
        ActionParseError::Expected { .. }
        | ActionParseError::Keys(_)
        | ActionParseError::Bytes(_)
        | ActionParseError::Fault(_) => WordsError::Action {
            words: words.to_owned(),
            reason,
        },
    })?;
    match &found {
        Action::Panel(PanelAction::InputLine { line, .. })
        | Action::Pulse { line, .. }
        | Action::SetOutput { line, .. }
        | Action::Force { line, .. }
        | Action::Release { line, .. } => known_line(*line)?,
        Action::RaiseAlarm { number, .. } => drop(alarm_number(number)?),
        Action::Panel(_)
        | Action::FeedHold(_)
        | Action::PowerOff
        | Action::PowerOn
        | Action::SetVariable { .. }
        | Action::Teach { .. }
        | Action::PutFile { .. }
        | Action::EraseFile { .. }
        | Action::Select { .. }
        | Action::Fault(_) => {}
    }
    Ok(found)
}

impl ScenarioCondition {
    /// Reads one.
    ///
    /// # Errors
    /// What was expected and found.
    pub fn parse(words: &str) -> Result<ScenarioCondition, WordsError> {
        let (name, rest) = words.split_once(' ').unwrap_or((words, ""));
        let whole = || {
            let whole = Some(rest.to_owned()).filter(|rest| !rest.is_empty());
            whole.ok_or_else(|| WordsError::Nothing(format!("something after `{name}`")))
        };
        Ok(match name {
            "command" => ScenarioCondition::Command(parse_bytes(rest)?),
            "answer" => ScenarioCondition::Answer(parse_bytes(rest)?),
            "refused" => ScenarioCondition::Refused(whole()?),
            "printed" => {
                let (place, text) = rest.split_once(' ').unwrap_or((rest, ""));
                let place = match place {
                    PENDANT => None,
                    port => Some(parse_scol_port(port)?),
                };
                ScenarioCondition::Printed(place, parse_bytes(text)?)
            }
            "received" => {
                let (port, text) = rest.split_once(' ').unwrap_or((rest, ""));
                ScenarioCondition::Received(parse_scol_port(port)?, parse_bytes(text)?)
            }
            "connected" => ScenarioCondition::Connected(port(rest)?),
            "disconnected" => ScenarioCondition::Disconnected(port(rest)?),
            "alarm" if rest.is_empty() => ScenarioCondition::Alarm(None),
            "alarm" => ScenarioCondition::Alarm(Some(alarm_number(rest)?)),
            "alarms" if rest == "reset" => ScenarioCondition::AlarmsReset,
            "status" => ScenarioCondition::Status(status(rest)?),
            "servo" => ScenarioCondition::Servo(switch(rest)?),
            "selected" => ScenarioCondition::Selected(if rest == "none" {
                String::new()
            } else {
                whole()?.to_uppercase()
            }),
            "stored" => ScenarioCondition::Stored(whole()?.to_uppercase()),
            "erased" => ScenarioCondition::Erased(whole()?.to_uppercase()),
            "finding" => ScenarioCondition::Finding(rule(rest)?),
            "input" => line(IoKind::Input, rest)?,
            "output" => line(IoKind::Output, rest)?,
            _ => return Err(unknown("condition", words, CONDITIONS.iter().copied())),
        })
    }

    /// Whether this input is it.
    pub(super) fn matches_input(&self, input: &Input) -> bool {
        match (self, input) {
            (ScenarioCondition::Connected(expected), Input::Connected { port, .. })
            | (ScenarioCondition::Disconnected(expected), Input::Disconnected { port }) => expected == port,
            (ScenarioCondition::Received(expected, text), Input::Received { port, bytes }) => {
                expected == port && contains(bytes, text)
            }
            _ => false,
        }
    }

    /// Whether this output is it.
    pub(super) fn matches_output(&self, output: &Output) -> bool {
        match (self, output) {
            (ScenarioCondition::Printed(Some(expected), text), Output::Send { port, bytes }) => {
                expected == port && contains(bytes, text)
            }
            (ScenarioCondition::Printed(None, text), Output::Pendant(shown)) => {
                contains(shown.as_bytes(), text)
            }
            (ScenarioCondition::Stored(expected), Output::Stored { name, .. })
            | (ScenarioCondition::Erased(expected), Output::Erased { name }) => expected == name,
            (_, Output::Event(event)) => self.matches_event(event),
            _ => false,
        }
    }

    fn matches_event(&self, event: &Event) -> bool {
        match (self, event) {
            (ScenarioCondition::Command(text), Event::TextIn { data, .. })
            | (ScenarioCondition::Answer(text), Event::TextOut { data, .. }) => data.starts_with(text),
            (ScenarioCondition::Refused(letters), Event::Refused { command, .. }) => letters == command,
            (ScenarioCondition::Alarm(expected), Event::Alarm { number, .. }) => {
                expected.as_ref().is_none_or(|expected| expected == number)
            }
            (ScenarioCondition::AlarmsReset, Event::AlarmsReset) => true,
            (ScenarioCondition::Status(expected), Event::Status { status, .. }) => expected == status,
            (ScenarioCondition::Servo(expected), Event::Servo(on)) => expected == on,
            (ScenarioCondition::Selected(expected), Event::Selected(file)) => {
                expected == file.as_deref().unwrap_or_default()
            }
            (ScenarioCondition::Finding(expected), Event::Finding { rule, .. }) => expected == rule,
            _ => false,
        }
    }

    /// Whether it is a state that holds now; `None` for what happens and is over.
    pub(super) fn holds(&self, controller: &Controller) -> Option<bool> {
        let ScenarioCondition::Line(side, line, on) = self else {
            return None;
        };
        let signals = controller.signals();
        let is_on = match side {
            IoKind::Input => signals.input(*line),
            IoKind::Output => signals.output(*line),
        };
        Some(is_on == *on)
    }
}

impl fmt::Display for ScenarioCondition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ScenarioCondition::Command(text) => write!(f, "command {}", Escaped::new(text)),
            ScenarioCondition::Answer(text) => write!(f, "answer {}", Escaped::new(text)),
            ScenarioCondition::Refused(letters) => write!(f, "refused {letters}"),
            ScenarioCondition::Printed(port, text) => {
                let place = port.map_or(PENDANT, Port::name);
                write!(f, "printed {place} {}", Escaped::new(text))
            }
            ScenarioCondition::Received(port, text) => write!(f, "received {port} {}", Escaped::new(text)),
            ScenarioCondition::Connected(port) => write!(f, "connected {port}"),
            ScenarioCondition::Disconnected(port) => write!(f, "disconnected {port}"),
            ScenarioCondition::Alarm(None) => f.write_str("alarm"),
            ScenarioCondition::Alarm(Some(number)) => write!(f, "alarm {number}"),
            ScenarioCondition::AlarmsReset => f.write_str("alarms reset"),
            ScenarioCondition::Status(status) => write!(f, "status {status}"),
            ScenarioCondition::Servo(on) => write!(f, "servo {}", on.word()),
            ScenarioCondition::Selected(name) if name.is_empty() => f.write_str("selected none"),
            ScenarioCondition::Selected(name) => write!(f, "selected {name}"),
            ScenarioCondition::Stored(name) => write!(f, "stored {name}"),
            ScenarioCondition::Erased(name) => write!(f, "erased {name}"),
            ScenarioCondition::Finding(rule) => write!(f, "finding {rule}"),
            ScenarioCondition::Line(side, line, on) => write!(f, "{} {line} {}", side.word(), on.word()),
        }
    }
}

fn contains(bytes: &[u8], text: &[u8]) -> bool {
    bytes.windows(text.len().max(1)).any(|window| window == text)
}

fn parse_bytes(text: &str) -> Result<Vec<u8>, WordsError> {
    let bytes = escape::parse(text)?;
    if bytes.is_empty() {
        let expected = "text, with control codes as <CR>";
        return Err(WordsError::Nothing(expected.to_owned()));
    }
    Ok(bytes)
}

fn port(word: &str) -> Result<Port, UnexpectedWord> {
    Port::from_word(word).ok_or_else(|| UnexpectedWord::new("HOST, COM1, IP0, IP1, IP2 or IP3", word))
}

fn parse_scol_port(word: &str) -> Result<Port, UnexpectedWord> {
    let port = Port::from_word(word).filter(|port| matches!(port, Port::Com1 | Port::Ip1 | Port::Ip2));
    port.ok_or_else(|| UnexpectedWord::new("the channel COM1, IP1 or IP2", word))
}

fn alarm_number(word: &str) -> Result<String, UnexpectedWord> {
    let known = alarm::ALARMS.iter().any(|row| row.number() == word);
    known
        .then(|| word.to_owned())
        .ok_or_else(|| UnexpectedWord::new("the number of an alarm, for example 2-046", word))
}

fn status(word: &str) -> Result<ExecutionStatus, UnexpectedWord> {
    let status = ExecutionStatus::from_word(word);
    let expected = "running, stop (reset), stop (retry) or stop (continue)";
    status.ok_or_else(|| UnexpectedWord::new(expected, word))
}

fn switch(word: &str) -> Result<bool, UnexpectedWord> {
    bool::from_word(word).ok_or_else(|| UnexpectedWord::new("on or off", word))
}

fn line(side: IoKind, words: &str) -> Result<ScenarioCondition, WordsError> {
    let (number, state) = words.split_once(' ').unwrap_or((words, ""));
    let line = number
        .parse()
        .map_err(|_| UnexpectedWord::new("the number of a line", number))?;
    known_line(line)?;
    Ok(ScenarioCondition::Line(side, line, switch(state)?))
}

fn known_line(line: u16) -> Result<(), WordsError> {
    let known = Signals::exists(line);
    known.then_some(()).ok_or(WordsError::Line(line))
}

fn rule(word: &str) -> Result<String, WordsError> {
    if word.is_empty() {
        return Err(WordsError::Nothing("the name of a rule".to_owned()));
    }
    Ok(word.to_owned())
}
