//! The text form of a fault: `KIND` or `KIND:key=value,key=value`, with the same keys as in a file and a request.
//!
//! Values with a comma are in double quotes. A fault that is written and parsed again is the same fault. Whether it can
//! ever fire is checked in `reachability`.

use super::kind::{FaultKind, Parameter, ParameterType, ParameterValues, parse_escaped};
use super::rng::MILLION;
use super::{Fault, FaultError, FaultFilter, KINDS};
use crate::alarm::AlarmCode;
use crate::port::Port;
use crate::prelude::*;
use crate::time::parse_duration_in;
use alloc::collections::{BTreeMap, BTreeSet};
use core::fmt;
use core::str::FromStr;
use ts3100_proto::command::COMMANDS;
use ts3100_proto::escape::Escaped;
use ts3100_proto::words::did_you_mean_or;

/// Longest specification in bytes.
const MAX_SPEC: usize = 2_048;
/// Largest value of `id`, `block`, `after` and `times`.
pub const MAX_COUNT: u32 = 1_000_000;
/// The keys that every kind has.
pub const COMMON_KEYS: [&str; 7] = [
    "id",
    "command",
    "channel",
    "block",
    "after",
    "times",
    "probability",
];

impl ParameterType {
    /// The phrase for error messages, after "expected".
    pub fn description(&self) -> String {
        match self {
            ParameterType::Number { unit: "ms", min, max } => {
                format!("a duration of whole ms from {min} to {max}, for example 500 or 1.5 s")
            }
            ParameterType::Number { unit, min, max } => {
                format!("a whole number of {unit} from {min} to {max}")
            }
            ParameterType::Word(words) => words.join(" or "),
            ParameterType::Text { most } => {
                format!("at most {most} bytes, control codes as <CR> or <1A>")
            }
            ParameterType::Alarm => "the number of an alarm of the controller, for example 2-046".to_string(),
        }
    }

    /// The value as it is kept and written.
    fn parse(&self, text: &str) -> Option<String> {
        match self {
            ParameterType::Number { unit, min, max } => {
                let number = match *unit {
                    "ms" => parse_millis(text)?,
                    _ => text.parse().ok()?,
                };
                (*min..=*max).contains(&number).then(|| number.to_string())
            }
            ParameterType::Word(words) => {
                let mut words = words.iter().copied();
                let word = words.find(|word| word.eq_ignore_ascii_case(text));
                word.map(ToString::to_string)
            }
            ParameterType::Text { most } => {
                let bytes = parse_escaped(text).filter(|bytes| bytes.len() <= *most)?;
                Some(Escaped::within_quotes(&bytes).to_string())
            }
            ParameterType::Alarm => AlarmCode::from_number(text).as_ref().map(AlarmCode::number),
        }
    }
}

/// Parses a duration of whole milliseconds: `1500`, `500ms`, `1.5 s`.
fn parse_millis(text: &str) -> Option<u64> {
    let micros = parse_duration_in("ms", text).ok()?.as_micros();
    u64::try_from(micros / 1_000).ok().filter(|_| micros % 1_000 == 0)
}

impl FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Fault, FaultError> {
        let fault = parse(text)?;
        fault.check_can_fire()?;
        Ok(fault)
    }
}

/// Parses a fault without checking that it can fire.
pub(super) fn parse(text: &str) -> Result<Fault, FaultError> {
    let form = |found: &str| FaultError::Syntax {
        found: found.chars().take(80).collect(),
    };
    if text.len() > MAX_SPEC {
        return Err(form(text));
    }
    let (kind, rest) = text.split_once(':').unwrap_or((text, ""));
    let mut pairs = Vec::new();
    for part in split_pairs(rest).ok_or_else(|| form(rest))? {
        let (key, value) = part.split_once('=').ok_or_else(|| form(part))?;
        let value = value.trim();
        let quoted = value.strip_prefix('"').and_then(|value| value.strip_suffix('"'));
        pairs.push((key.trim().to_string(), quoted.unwrap_or(value).to_string()));
    }
    from_pairs(kind.trim(), &pairs)
}

/// Splits at the commas outside of quotes; `None` if a quote is not closed.
fn split_pairs(text: &str) -> Option<Vec<&str>> {
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
        let counts = [
            ("after", (self.after != 0).then(|| self.after.to_string())),
            ("times", (self.times != 1).then(|| self.times.to_string())),
            (
                "probability",
                (self.probability != MILLION).then(|| self.chance().to_string()),
            ),
        ];
        let counts = counts.into_iter().filter_map(|(key, value)| Some((key, value?)));
        let texts = self.kind.parameters.iter();
        let texts = texts.filter(|own| matches!(own.value_type, ParameterType::Text { .. }));
        let texts: Vec<&str> = texts.map(|own| own.name).collect();
        let own = self.values.iter().map(|(key, value)| match texts.contains(&key) {
            true => (key, format!("\"{value}\"")),
            false => (key, value.to_string()),
        });
        let mut between = ":";
        for (key, value) in self.active_filters().chain(counts).chain(own) {
            write!(f, "{between}{key}={value}")?;
            between = ",";
        }
        Ok(())
    }
}

/// A fault from its keys, without checking that it can fire.
pub(super) fn from_pairs(name: &str, pairs: &[(String, String)]) -> Result<Fault, FaultError> {
    let kind = KINDS.iter().copied().find(|kind| kind.name == name);
    let kind = kind.ok_or_else(|| {
        let list = "; `ts3100 faults list` shows the kinds".to_string();
        let hint = did_you_mean_or(name, KINDS.iter().map(|kind| kind.name), list);
        let found = name.to_string();
        FaultError::UnknownKind { found, hint }
    })?;
    let mut fault = Fault {
        id: 0,
        kind,
        filter: FaultFilter::default(),
        after: 0,
        times: 1,
        probability: MILLION,
        values: ParameterValues::default(),
    };
    let mut seen = BTreeSet::new();
    for (key, value) in pairs {
        if !seen.insert(key) {
            let (kind, key) = (kind.name, key.clone());
            return Err(FaultError::DuplicateKey { kind, key });
        }
        fault.set(key, value)?;
    }
    fault.apply_defaults();
    fault.check_channel()?;
    (kind.validate)(&fault.filter, &fault.values)?;
    Ok(fault)
}

impl FaultKind {
    /// The keys of this kind, the common ones first.
    pub fn keys(&self) -> Vec<&'static str> {
        let own = self.parameters.iter().map(|parameter| parameter.name);
        COMMON_KEYS.into_iter().chain(own).collect()
    }

    /// The error for a value that is not accepted.
    pub(super) fn invalid_value(&self, key: &str, expected: impl Into<String>, found: &str) -> FaultError {
        FaultError::InvalidValue {
            kind: self.name,
            key: key.to_string(),
            expected: expected.into(),
            found: found.to_string(),
        }
    }

    /// Whether one of its points exists on this port.
    fn supports(&self, port: Port) -> bool {
        self.points.iter().any(|point| point.is_on(port))
    }
}

impl Fault {
    fn set(&mut self, key: &str, value: &str) -> Result<(), FaultError> {
        let kind = self.kind;
        let count = |least: u32| {
            let number = value.parse().ok();
            let number = number.filter(|number| (least..=MAX_COUNT).contains(number));
            number.ok_or_else(|| {
                kind.invalid_value(key, format!("a whole number from {least} to {MAX_COUNT}"), value)
            })
        };
        match key {
            "id" => self.id = count(1)?,
            "command" => self.filter.command = Some(parse_command(kind, value)?),
            "channel" => {
                let mut ports = Port::ALL.into_iter();
                let port = ports.find(|port| port.name().eq_ignore_ascii_case(value));
                let wrong = || kind.invalid_value(key, "HOST, COM1, IP0, IP1, IP2 or IP3", value);
                self.filter.channel = Some(port.ok_or_else(wrong)?);
            }
            "block" => self.filter.block = Some(count(0)?),
            "after" => self.after = count(0)?,
            "times" => self.times = count(0)?,
            "probability" => self.probability = parse_probability(kind, value)?,
            _ => {
                let parameter = kind.parameters.iter().find(|parameter| parameter.name == key);
                let Some(Parameter { name, value_type, .. }) = parameter else {
                    let list = format!("; it takes {}", kind.keys().join(", "));
                    return Err(FaultError::UnknownKey {
                        kind: kind.name,
                        key: key.to_string(),
                        hint: did_you_mean_or(key, kind.keys(), list),
                    });
                };
                let expected = || match value_type {
                    ParameterType::Alarm => AlarmCode::expected_number(value),
                    ParameterType::Number { .. } | ParameterType::Word(_) | ParameterType::Text { .. } => {
                        value_type.description()
                    }
                };
                let wrong = || kind.invalid_value(key, expected(), value);
                let parsed = value_type.parse(value).ok_or_else(wrong)?;
                self.values.0.insert(name, parsed);
            }
        }
        Ok(())
    }

    /// Fills in the defaults.
    fn apply_defaults(&mut self) {
        for Parameter {
            name,
            value_type,
            default,
            ..
        } in self.kind.parameters
        {
            if let Some(value) = default.and_then(|default| value_type.parse(default)) {
                self.values.0.entry(name).or_insert(value);
            }
        }
        let on = &mut self.filter;
        let on_protocol = on.channel.is_none_or(|port| port.protocol().is_some());
        if on.command.is_none() && on_protocol {
            on.command = self.kind.command.map(ToString::to_string);
            on.block = on.block.or(self.kind.block);
        }
    }

    fn check_channel(&self) -> Result<(), FaultError> {
        let kind = self.kind;
        match self.filter.channel {
            Some(port) if !kind.supports(port) => {
                let reached = Port::ALL.into_iter().filter(|port| kind.supports(*port));
                let reached: Vec<&str> = reached.map(Port::name).collect();
                Err(kind.invalid_value("channel", reached.join(" or "), port.name()))
            }
            _ => Ok(()),
        }
    }

    /// The parameters of the kind in text form, for reports.
    pub fn parameters(&self) -> BTreeMap<&'static str, String> {
        self.values.0.clone()
    }
}

fn parse_command(kind: &'static FaultKind, value: &str) -> Result<String, FaultError> {
    // Parts of an exchange (FL, OK, NG) are no commands that a fault could wait for; they have no permissions either.
    let rows = COMMANDS.iter().filter(|row| row.permission.is_some());
    let mut letters = rows.map(|row| row.letters);
    let found = letters.find(|letters| letters.eq_ignore_ascii_case(value));
    let wrong = || kind.invalid_value("command", "the letters of a command, for example RN", value);
    found.map(ToString::to_string).ok_or_else(wrong)
}

fn parse_probability(kind: &'static FaultKind, value: &str) -> Result<u32, FaultError> {
    let chance = value.parse::<f64>().ok();
    let chance = chance.filter(|chance| (0.0..=1.0).contains(chance));
    let chance = chance.ok_or_else(|| kind.invalid_value("probability", "a number from 0 to 1", value))?;
    // Between 0 and a million.
    Ok(libm::round(chance * f64::from(MILLION)) as u32)
}
