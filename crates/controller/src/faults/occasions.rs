//! Which occasions there ever are: what a fault may wait for and what it would wait for in vain. A fault that no
//! occasion fits is refused when it is armed; how faults are written is `spec`'s.

use super::kind::{Point, Takes, Value};
use super::{Fault, FaultError, On};
use crate::limits::{MAX_ALARMS, MAX_FILE, MAX_FILES, MAX_HISTORY, VARY_BLANKS};
use crate::port::Port;
use crate::variation::SHORTEST_TEXT;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::command::Number;
use ts3100_proto::name::MAX_FILE_NAME;
use ts3100_proto::status::AlarmLevel;
use ts3100_proto::status::ac::{AlarmRecord, MAX_MESSAGE, encode_alarms};
use ts3100_proto::status::ca::{DirectoryEntry, encode_directory_with};
use ts3100_proto::status::eu::{ErrorEntry, encode_history};
use ts3100_proto::status::mn::Maintenance;
use ts3100_proto::status::mr::encode_values;
use ts3100_proto::status::sf::SfLayout;
use ts3100_proto::text::MAX_DATA;

/// Values of a position of a six-axis arm: the most that MR answers.
const MR_VALUES: usize = 9;
/// What an FL file has besides its content: `FL,` and EOF.
const FL_EXTRA: usize = 4;

impl Point {
    /// The ports on which something passes it.
    pub(super) fn ports(self) -> impl Iterator<Item = Port> {
        Port::ALL.into_iter().filter(move |port| match self {
            Point::Command | Point::Reply => port.protocol().is_some(),
            Point::Print | Point::Record => matches!(port, Port::Com1 | Port::Ip1 | Port::Ip2),
            Point::Bytes => true,
            Point::Character => matches!(port, Port::Host | Port::Com1),
        })
    }

    /// Whether something with these letters and this number of its text ever passes it on such a port.
    fn sees(self, on: &On) -> bool {
        let reach = match (self, on.command.as_deref()) {
            // What comes in has no letters yet; what PRINT sends and INPUT reads never has.
            (Point::Print | Point::Record | Point::Bytes | Point::Character, Some(_)) => return false,
            (Point::Print | Point::Record | Point::Bytes | Point::Character, None) => 0,
            (Point::Command, Some("DL") | None) | (Point::Reply, None) => u32::MAX,
            (Point::Command, Some(_)) => 0,
            (Point::Reply, Some(command)) => most_texts(command),
        };
        let port = on
            .channel
            .is_none_or(|port| self.ports().any(|other| other == port));
        port && on.block.is_none_or(|block| block <= reach)
    }
}

/// More than any counter of MN comes to: ten thousand years in minutes.
const MOST_COUNTED: f64 = 5.3e9;

/// The most FL texts that an exchange of this command has; 0 where it has none.
fn most_texts(command: &str) -> u32 {
    let at = CalendarTime::MAX;
    let alarms = |count: usize| {
        let (number, message) = ("8-999".to_string(), "x".repeat(MAX_MESSAGE));
        let record = AlarmRecord { number, message, at };
        encode_alarms(&alloc::vec![record; count]).len()
    };
    match command {
        // How a host cuts its file is its own affair.
        "DL" => u32::MAX,
        "UL" => texts(MAX_FILE),
        "CA" => {
            let entry = DirectoryEntry {
                name: "X".repeat(MAX_FILE_NAME),
                size: u32::try_from(MAX_FILE).unwrap_or(u32::MAX),
                attribute: None,
            };
            let blanks = " ".repeat(usize::try_from(VARY_BLANKS).unwrap_or(1));
            texts(encode_directory_with(&alloc::vec![entry; MAX_FILES], &blanks).len())
        }
        "EU" => {
            let (level, code) = (AlarmLevel::L8, 999);
            let entry = ErrorEntry { level, code, at };
            texts(encode_history(&[entry; MAX_HISTORY]).len())
        }
        "AC" => texts(alarms(MAX_ALARMS)),
        "AH" => texts(alarms(MAX_HISTORY)),
        "SF" => texts(SfLayout::Eight.len()),
        "MR" => texts(encode_values(&[Number::Real(f64::MIN); MR_VALUES]).len()),
        "MN" => {
            let (axes, information) = ([[MOST_COUNTED; _]; _], [MOST_COUNTED; _]);
            texts(Maintenance { axes, information }.encode().len())
        }
        // Their content fits into one text whatever it is.
        "SU" | "VR" | "SM" | "IO" | "HI" | "PR" | "VL" => 1,
        _ => 0,
    }
}

/// The most texts of a content: legal variation cuts what does not fit into one text shorter than need be.
fn texts(content: usize) -> u32 {
    let shortest = usize::try_from(SHORTEST_TEXT).unwrap_or(1);
    let behind = (content + FL_EXTRA).saturating_sub(MAX_DATA).div_ceil(shortest);
    u32::try_from(behind + 1).unwrap_or(u32::MAX)
}

impl Fault {
    /// Whether it can ever fire.
    ///
    /// # Errors
    /// What it waits for never comes.
    pub(super) fn check_occasions(&self) -> Result<(), FaultError> {
        let never = |reason: String, advice: String| FaultError::Never {
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
        if self.has_occasions() {
            return Ok(());
        }
        let points: Vec<&str> = self.points().map(Point::words).collect();
        let filters: Vec<String> = self
            .filters()
            .map(|(key, value)| format!("{key}={value}"))
            .collect();
        let reason = format!(
            "no occasion has {} (it waits for {})",
            filters.join(" and "),
            points.join(" or ")
        );
        Err(never(reason, self.advice()))
    }

    /// Where it can fire with its parameters.
    fn points(&self) -> impl Iterator<Item = Point> {
        let points = self.kind.points.iter().copied();
        points.filter(|point| (self.kind.bites)(&self.values, *point, self.on.block.unwrap_or(0)))
    }

    fn has_occasions(&self) -> bool {
        self.points().any(|point| point.sees(&self.on))
    }

    fn filters(&self) -> impl Iterator<Item = (&'static str, String)> {
        let On {
            command,
            channel,
            block,
        } = &self.on;
        let pairs = [
            ("command", command.clone()),
            ("channel", channel.map(|port| port.to_string())),
            ("block", block.map(|block| block.to_string())),
        ];
        pairs.into_iter().filter_map(|(key, value)| Some((key, value?)))
    }

    /// The least that makes it one that can fire: a filter less, or another word of a parameter.
    fn advice(&self) -> String {
        let mut ways: Vec<String> = Vec::new();
        for (key, _) in self.filters() {
            let mut other = self.clone();
            match key {
                "command" => other.on.command = None,
                "channel" => other.on.channel = None,
                _ => other.on.block = None,
            }
            if other.has_occasions() {
                ways.push(format!("leave out {key}"));
            }
        }
        for parameter in self.kind.parameters {
            let Takes::Word(words) = parameter.takes else {
                continue;
            };
            for word in words {
                let mut other = self.clone();
                other
                    .values
                    .0
                    .insert(parameter.name, Value::Word((*word).to_string()));
                if other.has_occasions() {
                    ways.push(format!("give {}={word}", parameter.name));
                }
            }
        }
        if ways.is_empty() {
            let keys: Vec<&str> = self.filters().map(|(key, _)| key).collect();
            ways.push(format!("leave out {}", keys.join(" and ")));
        }
        ways.join(", or ")
    }
}
