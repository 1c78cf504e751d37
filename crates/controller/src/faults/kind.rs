//! Definition of a kind of fault: its name, its parameters with units and bounds, its occasions, and its effect.
//!
//! [`FaultKind`] is one row of the table in `kinds`, which has one file a kind. `mod` decides which fault fires at a
//! [`FaultSite`]; `spec` parses and writes faults.

use super::rng::Rng;
use crate::alarm::AlarmCode;
use crate::controls::PanelAction;
use crate::faults::error::FaultError;
use crate::port::Port;
use crate::prelude::*;
use crate::segment::Segment;
use alloc::collections::BTreeMap;
use bytes::Bytes;
use core::fmt;
use core::time::Duration;
use ts3100_proto::escape::{Unit, control_code, hex_byte, units};

ts3100_proto::codes! {
    /// Where a fault can be injected.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum InjectionPoint {
        /// A command, or an FL text of a download, was received whole on HOST or IP0 and is about to be served.
        Command = "an incoming command or FL text",
        /// A text is about to be sent on HOST or IP0.
        Reply = "an outgoing text",
        /// The output of PRINT is about to be sent on COM1, IP1 or IP2.
        Print = "what PRINT sends",
        /// Bytes were received, on any port.
        Bytes = "incoming bytes",
        /// Characters were received on a serial line.
        Character = "a character received on a serial line",
        /// A record for INPUT begins on COM1, IP1 or IP2.
        Record = "a record for INPUT",
    }
    /// The phrase for lists and messages.
    fn description -> &'static str;
}

/// Type of a parameter, with its bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterType {
    /// A whole number.
    Number {
        /// Unit: `ms`, `bytes`, ... A value in `ms` can also be written `2s` or `500ms`.
        unit: &'static str,
        /// Smallest value.
        min: u64,
        /// Largest value.
        max: u64,
    },
    /// One of these words, in any case.
    Word(&'static [&'static str]),
    /// The data section of a text; control codes are written `<CR>` or `<1A>`.
    Text {
        /// Longest data section in bytes.
        most: usize,
    },
    /// The number of an alarm of [`crate::alarm::ALARMS`], for example `2-046`.
    Alarm,
}

/// A parameter of a kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parameter {
    /// Key in a specification.
    pub name: &'static str,
    /// Accepted values.
    pub value_type: ParameterType,
    /// Default; `None` if it is chosen at random or as `description` says.
    pub default: Option<&'static str>,
    /// One line for help.
    pub description: &'static str,
}

/// The parameters of a fault: the given ones, and the defaults of the others, each as [`ParameterType`] writes it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ParameterValues(pub(super) BTreeMap<&'static str, String>);

impl ParameterValues {
    /// A number, if it is set.
    pub fn number(&self, name: &str) -> Option<u64> {
        self.0.get(name)?.parse().ok()
    }

    /// A number of milliseconds as a duration; zero if it is not set.
    pub fn millis(&self, name: &str) -> Duration {
        Duration::from_millis(self.number(name).unwrap_or(0))
    }

    /// A number of bytes, if it is set.
    pub fn bytes(&self, name: &str) -> Option<usize> {
        usize::try_from(self.number(name)?).ok()
    }

    /// A word; empty if it is not set.
    pub fn word(&self, name: &str) -> &str {
        self.0.get(name).map_or("", String::as_str)
    }

    /// A data section, if it is set.
    pub fn text(&self, name: &str) -> Option<Vec<u8>> {
        parse_escaped(self.0.get(name)?)
    }

    /// Every parameter that is set, by key.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.0.iter().map(|(name, value)| (*name, value.as_str()))
    }
}

/// Parses bytes in the readable notation. A person writes them: names in any case, bytes with or without a leading zero.
pub(super) fn parse_escaped(text: &str) -> Option<Vec<u8>> {
    let byte = |unit| match unit {
        Unit::Char(char) => u8::try_from(char).ok().filter(u8::is_ascii),
        Unit::Code(code) => control_code(code).or_else(|| hex_byte(code)),
    };
    units(text).map(|unit| byte(unit.ok()?)).collect()
}

/// Change that a fault makes at its site.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Effect {
    /// Nothing: the command, text or bytes pass unchanged.
    Unchanged,
    /// They are dropped, as if never received or sent.
    Lost,
    /// The command is answered NG, for this reason.
    Refused(String),
    /// This is sent instead.
    ReplaceOutput(Vec<Segment>),
    /// These bytes were received instead.
    ReplaceInput(Bytes),
    /// The character at this index has a parity error.
    ParityError(usize),
}

/// An action of a fault on the machine, at once or later. Panel and alarms take it like any other.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum ScheduledAction {
    /// An operation at the panel.
    Panel(PanelAction),
    /// An alarm is raised.
    Alarm(AlarmCode),
}

/// The command, text or bytes a fault can be applied to.
#[derive(Debug, Clone)]
pub struct FaultSite<'a> {
    /// Where in the controller.
    pub point: InjectionPoint,
    /// The port it was received on, or is sent on.
    pub port: Port,
    /// Letters of the command it belongs to; empty if it belongs to none.
    pub command: &'a str,
    /// Number of the FL text in its exchange, from 1; 0 if it is not an FL text and does not answer one.
    pub block: u32,
    /// Its bytes as transmitted; empty for a command.
    pub bytes: Bytes,
    /// The data section of a text that is sent; empty otherwise.
    pub data: Bytes,
}

impl FaultSite<'_> {
    /// A site that belongs to no command.
    pub(crate) fn new(point: InjectionPoint, port: Port, bytes: Bytes) -> FaultSite<'static> {
        FaultSite {
            point,
            port,
            command: "",
            block: 0,
            bytes,
            data: Bytes::new(),
        }
    }
}

/// The phrase for messages: `the answer to SU`.
impl fmt::Display for FaultSite<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.point, self.command, self.block) {
            (InjectionPoint::Command, command, 0) => f.write_str(command),
            (InjectionPoint::Command, command, block) => write!(f, "text {block} of {command}"),
            (InjectionPoint::Reply, "", _) => f.write_str("the text"),
            // A text of a download is answered OK or NG, never by a text of its own number.
            (InjectionPoint::Reply, "DL", block @ 1..) => write!(f, "the answer to text {block} of DL"),
            (InjectionPoint::Reply, command, 0 | 1) => write!(f, "the answer to {command}"),
            (InjectionPoint::Reply, command, block) => write!(f, "text {block} of the answer to {command}"),
            (InjectionPoint::Print, ..) => f.write_str("what PRINT sends"),
            (InjectionPoint::Bytes, ..) => f.write_str("the bytes that came in"),
            (InjectionPoint::Character, ..) => f.write_str("the characters that came in"),
            (InjectionPoint::Record, ..) => f.write_str("the record"),
        }
    }
}

/// Applies a fault at a site. Returns its change and the message for the log: `the answer to SU is not sent`.
pub(crate) type ApplyFn = fn(&mut FaultContext<'_>, &ParameterValues, &FaultSite<'_>) -> (Effect, String);

/// Access of a kind of fault beyond its site.
#[derive(Debug)]
pub(crate) struct FaultContext<'a> {
    /// The random numbers of faults.
    pub(crate) rng: &'a mut Rng,
    /// Bytes that are left on the RAM drive for the command that is served.
    pub(crate) room: &'a mut Option<usize>,
    /// Actions on the machine, with their delay from now.
    pub(crate) scheduled: Vec<(Duration, ScheduledAction)>,
}

impl FaultContext<'_> {
    pub(super) fn schedule(&mut self, delay: Duration, action: ScheduledAction) {
        self.scheduled.push((delay, action));
    }

    /// An operation at the panel that is undone after `lasts`; zero: it stays.
    pub(super) fn operate(
        &mut self,
        delay: Duration,
        action: PanelAction,
        lasts: Duration,
        undo: PanelAction,
    ) {
        self.schedule(delay, ScheduledAction::Panel(action));
        if !lasts.is_zero() {
            self.schedule(delay + lasts, ScheduledAction::Panel(undo));
        }
    }
}

/// Fate of the reply in an exchange in which a fault fires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReplyArrival {
    /// The host has one in time.
    InTime,
    /// It comes whole, after the delays of the fault.
    Delayed,
    /// None comes, or not the robot's: the safe reading of a new kind, which excuses the most.
    Missing,
}

/// A kind of fault.
#[derive(Debug)]
pub struct FaultKind {
    /// Name in a specification; stays the same from release to release.
    pub name: &'static str,
    /// Effect, in one sentence.
    pub summary: &'static str,
    /// How a host copes with it, in one sentence.
    pub remedy: &'static str,
    /// Its parameters, besides the keys every kind has.
    pub parameters: &'static [Parameter],
    /// Where it can be injected.
    pub points: &'static [InjectionPoint],
    /// Default of the key `command`; `None`: any command.
    pub command: Option<&'static str>,
    /// Default of the key `block`; `None`: any block.
    pub block: Option<u32>,
    /// Whether it applies at this point, to the FL text of this number, with these parameters. Called only for the
    /// points of `points`.
    pub applies: fn(&ParameterValues, InjectionPoint, u32) -> bool,
    /// Whether the host still has a reply with which it can continue; it decides about the findings that the fault
    /// excuses (`effects`).
    pub reply: ReplyArrival,
    /// Rejects combinations of filter and parameters that make no sense.
    pub validate: fn(&super::FaultFilter, &ParameterValues) -> Result<(), FaultError>,
    /// Applies it.
    pub(crate) apply: ApplyFn,
}

impl FaultKind {
    /// Defaults of a row: no parameters, applies at each of its points, every combination is accepted.
    pub(super) const DEFAULT: FaultKind = FaultKind {
        name: "",
        summary: "",
        remedy: "",
        parameters: &[],
        points: &[],
        command: None,
        block: None,
        reply: ReplyArrival::Missing,
        applies: |_, _, _| true,
        validate: |_, _| Ok(()),
        apply: |_, _, _| (Effect::Unchanged, String::new()),
    };
}

impl PartialEq for FaultKind {
    /// Kinds are equal if their names are.
    fn eq(&self, other: &FaultKind) -> bool {
        self.name == other.name
    }
}

impl Eq for FaultKind {}

/// Points of faults in sent bytes.
pub(super) const OUTGOING: &[InjectionPoint] = &[InjectionPoint::Reply, InjectionPoint::Print];
/// Points that can trigger a fault of the machine.
pub(super) const MACHINE: &[InjectionPoint] = &[InjectionPoint::Command, InjectionPoint::Record];
/// Longest duration of a parameter: ten minutes, in ms.
const LONGEST: u64 = 600_000;

/// This is sent instead; the message says so.
pub(super) fn sends(segments: impl IntoIterator<Item = Segment>, message: String) -> (Effect, String) {
    (Effect::ReplaceOutput(segments.into_iter().collect()), message)
}

/// A parameter without a default.
pub(super) const fn parameter(name: &'static str, value_type: ParameterType) -> Parameter {
    Parameter {
        name,
        value_type,
        default: None,
        description: "",
    }
}

/// A whole number, at least the first and at most the second of the bounds.
pub(super) const fn number(name: &'static str, unit: &'static str, (min, max): (u64, u64)) -> Parameter {
    parameter(name, ParameterType::Number { unit, min, max })
}

/// A duration.
pub(super) const fn millis(name: &'static str, default: &'static str) -> Parameter {
    number(name, "ms", (0, LONGEST)).or(default)
}

/// One of some words, the first if the fault does not say which.
pub(super) const fn word(name: &'static str, words: &'static [&'static str]) -> Parameter {
    Parameter {
        default: words.first().copied(),
        ..parameter(name, ParameterType::Word(words))
    }
}

impl Parameter {
    /// The same with a default.
    pub(super) const fn or(self, default: &'static str) -> Parameter {
        let default = Some(default);
        Parameter { default, ..self }
    }

    /// The same with its line for help.
    pub(super) const fn help(self, description: &'static str) -> Parameter {
        Parameter { description, ..self }
    }
}

/// Delay between the triggering site and a fault of the machine.
pub(super) const DELAY: Parameter = millis("delay", "0").help("delay after the occasion");
