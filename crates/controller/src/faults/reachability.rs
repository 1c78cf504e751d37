//! Rejects a fault that can never fire: no site matches its filter and parameters.
//!
//! Without this check a misspelled fault would pass unnoticed in a test run. `spec` parses faults; the bounds used here
//! are those of the protocol and of `crate::limits`.

use super::kind::{InjectionPoint, ParameterType};
use super::kinds::key_turned;
use super::{Fault, FaultError, FaultFilter};
use crate::limits::{MAX_ALARMS, MAX_FILE, MAX_FILES, MAX_HISTORY, MAX_VARIED_BLANKS, MIN_VARIED_TEXT};
use crate::options::ControllerType;
use crate::panel::KeySwitch;
use crate::port::Port;
use crate::prelude::*;
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::command::{Answer, COMMANDS, Number};
use ts3100_proto::name::MAX_FILE_NAME;
use ts3100_proto::status::AlarmLevel;
use ts3100_proto::status::ac::{AlarmRecord, MAX_MESSAGE, encode_alarms};
use ts3100_proto::status::ca::{DirectoryEntry, encode_directory};
use ts3100_proto::status::eu::{ErrorEntry, YearDigits, encode_history};
use ts3100_proto::status::mr::encode_values;
use ts3100_proto::status::sf::SfLayout;
use ts3100_proto::text::MAX_DATA;
use ts3100_proto::words::Word as _;

/// Bytes of an FL file besides its content: `FL,` and EOF.
const FL_EXTRA: usize = 4;

impl InjectionPoint {
    /// Whether a port has this point.
    #[must_use]
    pub fn is_on(self, port: Port) -> bool {
        match self {
            InjectionPoint::Command | InjectionPoint::Reply => port.protocol().is_some(),
            InjectionPoint::Print | InjectionPoint::Record => port.is_scol_channel(),
            InjectionPoint::Bytes => true,
            InjectionPoint::Character => matches!(port, Port::Host | Port::Com1),
        }
    }

    /// Whether a site at this point can match the filter.
    fn can_match(self, filter: &FaultFilter) -> bool {
        let command = filter.command.as_deref();
        let last_block = match self {
            InjectionPoint::Command if matches!(command, Some("DL") | None) => u32::MAX,
            InjectionPoint::Command => 0,
            InjectionPoint::Reply => command.map_or(u32::MAX, max_texts),
            // Received bytes have no command letters yet; the data of PRINT and INPUT never has.
            InjectionPoint::Print
            | InjectionPoint::Record
            | InjectionPoint::Bytes
            | InjectionPoint::Character => match command {
                Some(_) => return false,
                None => 0,
            },
        };
        filter.channel.is_none_or(|port| self.is_on(port))
            && filter.block.is_none_or(|block| block <= last_block)
    }
}

/// Most FL texts in one exchange of this command; 0 if it has none.
fn max_texts(command: &str) -> u32 {
    let at = CalendarTime::MAX;
    let alarms = |count: usize, year| {
        let (number, message) = ("8-999".to_string(), "x".repeat(MAX_MESSAGE));
        let record = AlarmRecord { number, message, at };
        encode_alarms(&vec![record; count], year).len()
    };
    match command {
        // The host decides into how many texts it cuts its file.
        "DL" => u32::MAX,
        "UL" => texts(MAX_FILE),
        "CA" => {
            let entry = DirectoryEntry {
                name: "X".repeat(MAX_FILE_NAME),
                size: u32::try_from(MAX_FILE).unwrap_or(u32::MAX),
                attribute: None,
            };
            let blanks = " ".repeat(usize::try_from(MAX_VARIED_BLANKS).unwrap_or(1));
            texts(encode_directory(&vec![entry; MAX_FILES], &blanks).len())
        }
        "EU" => {
            let (level, code) = (AlarmLevel::L8, 999);
            let entry = ErrorEntry { level, code, at };
            texts(encode_history(&[entry; MAX_HISTORY]).len())
        }
        "AC" => texts(alarms(MAX_ALARMS, YearDigits::Four)),
        "AH" => texts(alarms(MAX_HISTORY, YearDigits::Two)),
        "SF" => texts(SfLayout::Eight.len()),
        "MR" => texts(encode_values(&longest_position()).len()),
        // The content of the others always fits into one text.
        letters => {
            let rows = COMMANDS.iter();
            let mut answers = rows.filter(|row| row.letters == letters).map(|row| row.answer);
            u32::from(answers.any(|answer| answer != Answer::Acknowledge))
        }
    }
}

/// A position of a six-axis arm, the most that MR answers: eight coordinates of the longest real, and a configuration.
fn longest_position() -> [Number; 9] {
    let [long, config] = [f64::from(f32::MIN), 22_222.0].map(Number::Real);
    [long, long, long, long, long, long, long, long, config]
}

/// Most texts for a content of this size. Variation may cut texts shorter than necessary, down to
/// [`MIN_VARIED_TEXT`], if the content does not fit into one.
fn texts(content: usize) -> u32 {
    let shortest = usize::try_from(MIN_VARIED_TEXT).unwrap_or(1);
    let after_first = (content + FL_EXTRA).saturating_sub(MAX_DATA).div_ceil(shortest);
    u32::try_from(after_first + 1).unwrap_or(u32::MAX)
}

impl Fault {
    /// Checks that the fault can fire.
    ///
    /// # Errors
    /// [`FaultError::NeverFires`], with a remedy.
    pub(crate) fn check_can_fire(&self) -> Result<(), FaultError> {
        let never = |reason: String, advice: String| FaultError::NeverFires {
            kind: self.kind.name,
            reason,
            advice,
        };
        if self.probability == 0 {
            return Err(never(
                "with this probability it never fires".to_string(),
                "give one from 0.000001 to 1".to_string(),
            ));
        }
        if self.can_fire() {
            return Ok(());
        }
        let points: Vec<&str> = self.points().map(InjectionPoint::description).collect();
        let filters = self.active_filters().map(|(key, value)| format!("{key}={value}"));
        let filters: Vec<String> = filters.collect();
        let (filters, points) = (filters.join(" and "), points.join(" or "));
        let reason = format!("no occasion matches {filters} (it waits for {points})");
        Err(never(reason, self.advice()))
    }

    /// Checks that the fault can act on a controller of this type.
    ///
    /// # Errors
    /// [`FaultError::NeverFires`], with a remedy.
    pub fn check_possible_on(&self, controller: ControllerType) -> Result<(), FaultError> {
        let turns_key = self.kind.name == key_turned::KIND.name;
        if turns_key && self.values.word("to") == KeySwitch::Internal.word() && !controller.has_internal() {
            return Err(FaultError::NeverFires {
                kind: self.kind.name,
                reason: format!("the {} has no INTERNAL position", controller.name()),
                advice: "give to=teaching or to=ext".to_string(),
            });
        }
        Ok(())
    }

    /// The points where it applies with its parameters.
    fn points(&self) -> impl Iterator<Item = InjectionPoint> {
        let points = self.kind.points.iter().copied();
        points.filter(|point| (self.kind.applies)(&self.values, *point, self.filter.block.unwrap_or(0)))
    }

    fn can_fire(&self) -> bool {
        self.points().any(|point| point.can_match(&self.filter))
    }

    /// The filters that are set, with their keys.
    pub fn active_filters(&self) -> impl Iterator<Item = (&'static str, String)> {
        let filter = &self.filter;
        let pairs = [
            ("command", filter.command.clone()),
            ("channel", filter.channel.map(|port| port.to_string())),
            ("block", filter.block.map(|block| block.to_string())),
        ];
        pairs.into_iter().filter_map(|(key, value)| Some((key, value?)))
    }

    /// The smallest changes after which it can fire: leave out one filter, or give another word for a parameter.
    fn advice(&self) -> String {
        let mut ways: Vec<String> = Vec::new();
        for (key, _) in self.active_filters() {
            let mut other = self.clone();
            match key {
                "command" => other.filter.command = None,
                "channel" => other.filter.channel = None,
                _ => other.filter.block = None,
            }
            if other.can_fire() {
                ways.push(format!("leave out {key}"));
            }
        }
        for parameter in self.kind.parameters {
            let ParameterType::Word(words) = parameter.value_type else {
                continue;
            };
            for word in words {
                let mut other = self.clone();
                other.values.0.insert(parameter.name, (*word).to_string());
                if other.can_fire() {
                    ways.push(format!("give {}={word}", parameter.name));
                }
            }
        }
        if ways.is_empty() {
            let keys: Vec<&str> = self.active_filters().map(|(key, _)| key).collect();
            ways.push(format!("leave out {}", keys.join(" and ")));
        }
        ways.join(", or ")
    }
}
