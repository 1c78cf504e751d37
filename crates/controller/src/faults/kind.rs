//! What a kind of fault is: its name, its parameters with units and bounds, where it bites, and what it does there.
//! The kinds themselves are in `kinds`, one a file; which of them are armed is `mod`'s.

use crate::Controller;
use crate::faults::FaultError;
use crate::output::DisconnectMode;
use crate::port::Port;
use alloc::collections::BTreeMap;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt;
use core::time::Duration;

/// Where a fault can bite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Point {
    /// A command, or an FL text of a download, has come whole on HOST or IP0 and is about to be served.
    Command,
    /// A text is about to leave on HOST or IP0.
    Reply,
    /// What PRINT sends is about to leave on COM1, IP1 or IP2.
    Print,
    /// Bytes have come in, on any port.
    Bytes,
    /// Characters have come off a serial line.
    Character,
    /// A record for INPUT begins on COM1, IP1 or IP2.
    Record,
}

impl Point {
    /// In words, for lists.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Point::Command => "a command or an FL text that came in",
            Point::Reply => "a text that goes out",
            Point::Print => "what PRINT sends",
            Point::Bytes => "bytes that came in",
            Point::Character => "a character that came off a serial line",
            Point::Record => "a record for INPUT",
        }
    }
}

/// What a parameter takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Takes {
    /// A whole number.
    Number {
        /// What it counts: `ms`, `bytes`, ...; durations also take `2s` and `500ms`.
        unit: &'static str,
        /// The least.
        least: u64,
        /// The most.
        most: u64,
    },
    /// One of these words.
    Word(&'static [&'static str]),
    /// The data section of a text; control codes as `<CR>`, `<1A>`.
    Text {
        /// Most bytes of it.
        most: usize,
    },
    /// The number of an alarm of the table, as `2-046`.
    Alarm,
}

/// A parameter of a kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parameter {
    /// Its key.
    pub name: &'static str,
    /// What it takes.
    pub takes: Takes,
    /// Its value when nothing is said; `None`: drawn, or as `what` says.
    pub default: Option<&'static str>,
    /// What it is.
    pub what: &'static str,
}

/// A value of a parameter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Value {
    /// Of [`Takes::Number`].
    Number(u64),
    /// Of the others, as written.
    Word(String),
    /// Of [`Takes::Text`].
    Text(Vec<u8>),
}

/// The parameters of a fault: those given, and the defaults of the others.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Values(pub(super) BTreeMap<&'static str, Value>);

impl Values {
    /// A number, if it is set.
    #[must_use]
    pub fn number(&self, name: &str) -> Option<u64> {
        match self.0.get(name) {
            Some(Value::Number(number)) => Some(*number),
            _ => None,
        }
    }

    /// A number of milliseconds as a duration; none at all when it is not set.
    #[must_use]
    pub fn millis(&self, name: &str) -> Duration {
        Duration::from_millis(self.number(name).unwrap_or(0))
    }

    /// A number of bytes, if it is set.
    #[must_use]
    pub fn bytes(&self, name: &str) -> Option<usize> {
        usize::try_from(self.number(name)?).ok()
    }

    /// A word; empty when it is not set.
    #[must_use]
    pub fn word(&self, name: &str) -> &str {
        match self.0.get(name) {
            Some(Value::Word(word)) => word,
            _ => "",
        }
    }

    /// A text, if it is set.
    #[must_use]
    pub fn text(&self, name: &str) -> Option<&[u8]> {
        match self.0.get(name) {
            Some(Value::Text(text)) => Some(text),
            _ => None,
        }
    }

    /// All that are set.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        self.0.iter().map(|(name, value)| (*name, value))
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Number(number) => write!(f, "{number}"),
            Value::Word(word) => f.write_str(word),
            Value::Text(text) => super::spec::write_text(f, text),
        }
    }
}

/// One part of what leaves in place of a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// How long behind the part before it.
    pub after: Duration,
    /// What.
    pub what: Departure,
}

/// What leaves a port.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Departure {
    /// These bytes, in one write.
    Bytes(#[cfg_attr(feature = "serde", serde(with = "ts3100_proto::serde_latin1"))] Vec<u8>),
    /// These bytes, in one write with what is sent next, if that comes before their time.
    Held(#[cfg_attr(feature = "serde", serde(with = "ts3100_proto::serde_latin1"))] Vec<u8>),
    /// The connection ends.
    Cut(DisconnectMode),
    /// From now on nothing is read or written, until the connection ends.
    Deaf,
}

impl Departure {
    /// Bytes of it.
    #[must_use]
    pub fn length(&self) -> usize {
        match self {
            Departure::Bytes(bytes) | Departure::Held(bytes) => bytes.len(),
            Departure::Cut(_) | Departure::Deaf => 0,
        }
    }
}

impl Segment {
    /// Bytes without a pause before them.
    #[must_use]
    pub fn bytes(bytes: Vec<u8>) -> Segment {
        Segment::after(Duration::ZERO, Departure::Bytes(bytes))
    }

    /// Something behind a pause.
    #[must_use]
    pub fn after(after: Duration, what: Departure) -> Segment {
        Segment { after, what }
    }
}

/// What has become of the thing that was bitten.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Effect {
    /// It goes on as it is.
    Pass,
    /// It is as if it had never come, or been sent.
    Lost,
    /// A command: NG, for this reason.
    Refused(String),
    /// What leaves in its place.
    Sent(Vec<Segment>),
    /// What came in in its place.
    Came(Vec<u8>),
    /// The character at this place has a parity error.
    Garbled(usize),
}

/// What a fault did, and the words for it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Applied {
    /// What has become of the thing.
    pub effect: Effect,
    /// What happened, for the log: `the answer to SU is not sent`.
    pub words: String,
}

impl Applied {
    pub(super) fn new(effect: Effect, words: impl Into<String>) -> Applied {
        let words = words.into();
        Applied { effect, words }
    }
}

/// The thing that is bitten.
#[derive(Debug, Clone, Copy)]
pub struct FaultSite<'a> {
    /// Where.
    pub point: Point,
    /// On which port.
    pub port: Port,
    /// Letters of the command it belongs to; empty if to none.
    pub command: &'a str,
    /// Number of the FL text in its exchange, from 1; 0 for what is none and acknowledges none.
    pub block: u32,
    /// Its bytes as they are on the line; none of a command.
    pub bytes: &'a [u8],
    /// What comes in on a record or a command has none; of a text that goes out, its data section.
    pub data: &'a [u8],
}

impl FaultSite<'_> {
    /// What it is, in words.
    #[must_use]
    pub fn words(&self) -> String {
        match (self.point, self.command, self.block) {
            (Point::Command, command, 0) => command.to_string(),
            (Point::Command, command, block) => alloc::format!("text {block} of {command}"),
            (Point::Reply, "", _) => "the text".to_string(),
            // What answers a text of a download is OK or NG.
            (Point::Reply, "DL", 1..) => alloc::format!("the answer to text {} of DL", self.block),
            (Point::Reply, command, 0 | 1) => alloc::format!("the answer to {command}"),
            (Point::Reply, command, block) => alloc::format!("text {block} of the answer to {command}"),
            (Point::Print, ..) => "what PRINT sends".to_string(),
            (Point::Bytes, ..) => "the bytes that came in".to_string(),
            (Point::Character, ..) => "the characters that came in".to_string(),
            (Point::Record, ..) => "the record".to_string(),
        }
    }
}

/// What a kind does when it bites.
pub type Act = fn(&mut Controller, &Values, &FaultSite<'_>) -> Applied;

/// A kind of fault.
#[derive(Debug)]
pub struct Kind {
    /// Its name.
    pub name: &'static str,
    /// What it does, in one sentence.
    pub what: &'static str,
    /// What a host that lives with it does, in one sentence.
    pub remedy: &'static str,
    /// Its parameters.
    pub parameters: &'static [Parameter],
    /// Where it can bite.
    pub points: &'static [Point],
    /// The command it waits for when nothing is said; it alone when the kind means nothing elsewhere.
    pub command: Option<&'static str>,
    /// The block it waits for when nothing is said.
    pub block: Option<u32>,
    /// Whether it bites at this point, on the FL text of this number, with these parameters; asked for points of the
    /// list alone.
    pub bites: fn(&Values, Point, u32) -> bool,
    /// What cannot be meant.
    pub check: fn(&super::On, &Values) -> Result<(), FaultError>,
    /// What it does.
    pub act: Act,
}

impl Kind {
    /// What most kinds have: no parameters, every point of the list, nothing that cannot be meant.
    pub(super) const PLAIN: Kind = Kind {
        name: "",
        what: "",
        remedy: "",
        parameters: &[],
        points: &[],
        command: None,
        block: None,
        bites: |_, _, _| true,
        check: |_, _| Ok(()),
        act: |_, _, _| Applied {
            effect: Effect::Pass,
            words: String::new(),
        },
    };
}

impl PartialEq for Kind {
    /// Kinds are told apart by their names.
    fn eq(&self, other: &Kind) -> bool {
        self.name == other.name
    }
}

impl Eq for Kind {}
