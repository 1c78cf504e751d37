//! How a fault is written: `KIND` or `KIND:key=value,key=value`, the same keys as in a file and in a request. Values
//! with a comma stand in double quotes. Written and read again it is the same fault.

use super::kind::{Kind, Parameter, Takes, Value, Values};
use super::rng::MILLION;
use super::{Fault, KINDS, On};
use crate::alarm::ALARMS;
use crate::port::Port;
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt;
use core::str::FromStr;
use thiserror::Error;
use ts3100_proto::command::COMMANDS;
use ts3100_proto::command::EXTENSIONS;
use ts3100_proto::text::{CR, EOF, ETX, LF, STX};

/// Longest specification in bytes.
const MAX_SPEC: usize = 2_048;
/// Most of `after` and `times`.
const MAX_COUNT: u64 = 1_000_000;
/// The keys every kind has.
const COMMON: [&str; 7] = [
    "id",
    "command",
    "channel",
    "block",
    "after",
    "times",
    "probability",
];

/// Why a fault is none.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum FaultError {
    /// No kind has this name.
    #[error("kind of fault expected, `{found}` found; known are {known}")]
    Kind {
        /// What stood there.
        found: String,
        /// All names.
        known: String,
    },
    /// The kind has no such key.
    #[error("{kind}: unknown key `{key}`; known are {known}")]
    Key {
        /// The kind.
        kind: &'static str,
        /// What stood there.
        key: String,
        /// All keys.
        known: String,
    },
    /// A key was given twice.
    #[error("{kind}: key `{key}` given once expected, twice found")]
    Twice {
        /// The kind.
        kind: &'static str,
        /// The key.
        key: String,
    },
    /// A value does not fit.
    #[error("{kind}: {key}: {expected} expected, `{found}` found")]
    Value {
        /// The kind.
        kind: &'static str,
        /// The key.
        key: String,
        /// What it takes.
        expected: String,
        /// What was given.
        found: String,
    },
    /// What it waits for never comes.
    #[error("cannot arm {kind}: {reason}; {advice}")]
    Never {
        /// The kind.
        kind: &'static str,
        /// What it waits for, and why that never comes.
        reason: String,
        /// What to give or to leave out.
        advice: String,
    },
    /// The specification is not of the form.
    #[error("KIND:key=value,key=value expected, `{found}` found")]
    Form {
        /// What stood there.
        found: String,
    },
}

impl Takes {
    /// What it takes, in words.
    #[must_use]
    pub fn words(&self) -> String {
        match self {
            Takes::Number { unit, least, most } => format!("a whole number of {unit} from {least} to {most}"),
            Takes::Word(words) => words.join(" or "),
            Takes::Text { most } => format!("a text of at most {most} bytes, control codes as <CR> or <1A>,"),
            Takes::Alarm => "the number of an alarm the controller has, as 2-046,".to_string(),
        }
    }

    fn read(&self, text: &str) -> Option<Value> {
        match self {
            Takes::Number { unit, least, most } => {
                let number = match *unit {
                    "ms" => millis(text)?,
                    _ => text.parse().ok()?,
                };
                (*least..=*most)
                    .contains(&number)
                    .then_some(Value::Number(number))
            }
            Takes::Word(words) => words
                .iter()
                .find(|word| word.eq_ignore_ascii_case(text))
                .map(|word| Value::Word((*word).to_string())),
            Takes::Text { most } => read_text(text)
                .filter(|bytes| bytes.len() <= *most)
                .map(Value::Text),
            Takes::Alarm => ALARMS
                .iter()
                .any(|row| row.number() == text)
                .then(|| Value::Word(text.to_string())),
        }
    }
}

/// `1500`, `500ms`, `1.5s`.
fn millis(text: &str) -> Option<u64> {
    let (number, factor) = match (text.strip_suffix("ms"), text.strip_suffix('s')) {
        (Some(number), _) => (number, 1.0),
        (None, Some(number)) => (number, 1_000.0),
        (None, None) => return text.parse().ok(),
    };
    let millis = number.trim().parse::<f64>().ok()? * factor;
    let whole = libm::round(millis);
    let fits = (0.0..1e15).contains(&whole) && libm::fabs(whole - millis) < 1e-6;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "whole, not negative, and below 1e15"
    )]
    fits.then_some(whole as u64)
}

/// Names of control codes, as the log writes them.
const CODES: [(&str, u8); 5] = [("STX", STX), ("ETX", ETX), ("CR", CR), ("LF", LF), ("EOF", EOF)];

/// Printable ASCII as it is, control codes of the protocol by name, other bytes in hexadecimal.
pub(super) fn write_text(f: &mut fmt::Formatter<'_>, text: &[u8]) -> fmt::Result {
    text.iter().try_for_each(|&byte| {
        if let Some((name, _)) = CODES.iter().find(|(_, code)| *code == byte) {
            return write!(f, "<{name}>");
        }
        match byte {
            b'"' | b'<' => write!(f, "<{byte:02X}>"),
            b' '..=b'~' => write!(f, "{}", char::from(byte)),
            other => write!(f, "<{other:02X}>"),
        }
    })
}

fn read_text(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        if first != '<' {
            bytes.push(u8::try_from(first).ok().filter(u8::is_ascii)?);
            rest = rest.get(1..)?;
            continue;
        }
        let (code, behind) = rest.get(1..)?.split_once('>')?;
        let named = CODES.iter().find(|(name, _)| name.eq_ignore_ascii_case(code));
        bytes.push(match named {
            Some((_, byte)) => *byte,
            None => u8::from_str_radix(code, 16).ok()?,
        });
        rest = behind;
    }
    Some(bytes)
}

impl FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Fault, FaultError> {
        let fault = read(text)?;
        fault.check_occasions()?;
        Ok(fault)
    }
}

/// A fault as it is written, whether it can ever fire or not.
pub(super) fn read(text: &str) -> Result<Fault, FaultError> {
    let form = |found: &str| FaultError::Form {
        found: found.chars().take(80).collect(),
    };
    if text.len() > MAX_SPEC {
        return Err(form(text));
    }
    let (kind, rest) = text.split_once(':').unwrap_or((text, ""));
    let mut pairs = Vec::new();
    for part in parts(rest).ok_or_else(|| form(rest))? {
        let (key, value) = part.split_once('=').ok_or_else(|| form(part))?;
        let value = value.trim();
        let quoted = value.strip_prefix('"').and_then(|value| value.strip_suffix('"'));
        pairs.push((key.trim().to_string(), quoted.unwrap_or(value).to_string()));
    }
    build(kind.trim(), &pairs)
}

/// Cuts at the commas outside of quotes; `None` when a quote is left open.
fn parts(text: &str) -> Option<Vec<&str>> {
    let mut parts = Vec::new();
    let (mut start, mut quoted) = (0, false);
    for (at, character) in text.char_indices() {
        match character {
            '"' => quoted = !quoted,
            ',' if !quoted => {
                parts.push(text.get(start..at)?);
                start = at + 1;
            }
            _ => {}
        }
    }
    let last = text.get(start..)?;
    if !last.trim().is_empty() || !parts.is_empty() {
        parts.push(last);
    }
    (!quoted).then_some(parts)
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.name)?;
        let mut between = ":";
        let mut pair = |f: &mut fmt::Formatter<'_>, key: &str, value: &dyn fmt::Display| {
            write!(f, "{between}{key}={value}")?;
            between = ",";
            Ok(())
        };
        if let Some(command) = &self.on.command {
            pair(f, "command", command)?;
        }
        if let Some(channel) = self.on.channel {
            pair(f, "channel", &channel)?;
        }
        if let Some(block) = self.on.block {
            pair(f, "block", &block)?;
        }
        if self.after != 0 {
            pair(f, "after", &self.after)?;
        }
        if self.times != 1 {
            pair(f, "times", &self.times)?;
        }
        if self.probability != MILLION {
            pair(f, "probability", &self.chance())?;
        }
        for (key, value) in self.values.iter() {
            match value {
                Value::Text(_) => pair(f, key, &format!("\"{value}\""))?,
                other => pair(f, key, other)?,
            }
        }
        Ok(())
    }
}

/// A fault from its keys, whether it can ever fire or not.
pub(super) fn build(name: &str, pairs: &[(String, String)]) -> Result<Fault, FaultError> {
    let known = || KINDS.iter().map(|kind| kind.name).collect::<Vec<_>>().join(", ");
    let kind = KINDS.iter().copied().find(|kind| kind.name == name);
    let kind = kind.ok_or_else(|| FaultError::Kind {
        found: name.to_string(),
        known: known(),
    })?;
    let mut fault = Fault {
        id: 0,
        kind,
        on: On::default(),
        after: 0,
        times: 1,
        probability: MILLION,
        values: Values::default(),
    };
    let mut seen: Vec<&str> = Vec::new();
    for (key, value) in pairs {
        if seen.contains(&key.as_str()) {
            return Err(FaultError::Twice {
                kind: kind.name,
                key: key.clone(),
            });
        }
        seen.push(key);
        fault.set(key, value)?;
    }
    fault.complete();
    fault.check_channel()?;
    (kind.check)(&fault.on, &fault.values)?;
    Ok(fault)
}

impl Kind {
    /// Keys it takes, the common ones first.
    #[must_use]
    pub fn keys(&self) -> Vec<&'static str> {
        let own = self.parameters.iter().map(|parameter| parameter.name);
        COMMON.into_iter().chain(own).collect()
    }

    /// Something that does not fit.
    pub(super) fn wrong(&self, key: &str, expected: impl Into<String>, found: &str) -> FaultError {
        FaultError::Value {
            kind: self.name,
            key: key.to_string(),
            expected: expected.into(),
            found: found.to_string(),
        }
    }

    /// Whether it bites on this port at all.
    fn reaches(&self, port: Port) -> bool {
        let mut ports = self.points.iter().flat_map(|point| point.ports());
        ports.any(|other| other == port)
    }
}

impl Fault {
    fn set(&mut self, key: &str, value: &str) -> Result<(), FaultError> {
        let kind = self.kind;
        let count = |least: u64, most: u64| {
            let number = value.parse::<u64>().ok();
            let number = number.filter(|number| (least..=most).contains(number));
            number
                .and_then(|number| u32::try_from(number).ok())
                .ok_or_else(|| kind.wrong(key, format!("a whole number from {least} to {most}"), value))
        };
        match key {
            "id" => self.id = count(1, MAX_COUNT)?,
            "command" => self.on.command = Some(command(kind, value)?),
            "channel" => {
                let port = Port::ALL
                    .into_iter()
                    .find(|port| port.name().eq_ignore_ascii_case(value));
                let port = port.ok_or_else(|| kind.wrong(key, "HOST, COM1, IP0, IP1, IP2 or IP3", value))?;
                self.on.channel = Some(port);
            }
            "block" => self.on.block = Some(count(0, MAX_COUNT)?),
            "after" => self.after = count(0, MAX_COUNT)?,
            "times" => self.times = count(0, MAX_COUNT)?,
            "probability" => self.probability = probability(kind, value)?,
            _ => {
                let parameter = kind.parameters.iter().find(|parameter| parameter.name == key);
                let Some(Parameter { name, takes, .. }) = parameter else {
                    return Err(FaultError::Key {
                        kind: kind.name,
                        key: key.to_string(),
                        known: kind.keys().join(", "),
                    });
                };
                let read = takes
                    .read(value)
                    .ok_or_else(|| kind.wrong(key, takes.words(), value))?;
                self.values.0.insert(name, read);
            }
        }
        Ok(())
    }

    /// What was not said.
    fn complete(&mut self) {
        for Parameter {
            name, takes, default, ..
        } in self.kind.parameters
        {
            if let Some(value) = default.and_then(|default| takes.read(default)) {
                self.values.0.entry(name).or_insert(value);
            }
        }
        let on = &mut self.on;
        let on_protocol = on.channel.is_none_or(|port| port.protocol().is_some());
        if on.command.is_none() && on_protocol {
            on.command = self.kind.command.map(ToString::to_string);
            on.block = on.block.or(self.kind.block);
        }
    }

    fn check_channel(&self) -> Result<(), FaultError> {
        match self.on.channel {
            Some(port) if !self.kind.reaches(port) => {
                let reached = Port::ALL.into_iter().filter(|port| self.kind.reaches(*port));
                let reached: Vec<&str> = reached.map(Port::name).collect();
                Err(self.kind.wrong("channel", reached.join(" or "), port.name()))
            }
            _ => Ok(()),
        }
    }

    /// The parameters of the kind as they are written, for reports.
    #[must_use]
    pub fn parameters(&self) -> BTreeMap<&'static str, String> {
        let pairs = self.values.iter();
        pairs.map(|(key, value)| (key, value.to_string())).collect()
    }
}

fn command(kind: &'static Kind, value: &str) -> Result<String, FaultError> {
    let rows = COMMANDS.iter().chain(EXTENSIONS);
    let mut letters: Vec<&str> = rows.map(|row| row.letters).collect();
    letters.retain(|letters| !matches!(*letters, "FL" | "OK" | "NG"));
    let found = letters.iter().find(|letters| letters.eq_ignore_ascii_case(value));
    found.map(ToString::to_string).ok_or_else(|| {
        letters.dedup();
        kind.wrong(
            "command",
            format!("the letters of a command ({})", letters.join(" ")),
            value,
        )
    })
}

fn probability(kind: &'static Kind, value: &str) -> Result<u32, FaultError> {
    let chance = value
        .parse::<f64>()
        .ok()
        .filter(|chance| (0.0..=1.0).contains(chance));
    let chance = chance.ok_or_else(|| kind.wrong("probability", "a number from 0 to 1", value))?;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and a million"
    )]
    Ok(libm::round(chance * f64::from(MILLION)) as u32)
}
