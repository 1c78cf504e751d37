//! A serial line as a value: two directions in time, what the far end is known to have been opened with, and
//! what of it has been told. Which bytes are texts, and who is told, is `talk`'s and `serial`'s.

mod clock;
pub mod direction;
pub mod uart;

use crate::time::Time;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt;
use direction::Direction;
use ts3100_proto::parameter::{Parity, SerialSettings};

/// What is known of the settings of the host's port. What is not known counts as matching.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct HostSettings {
    /// Speed in bit/s.
    pub speed: Option<u32>,
    /// Character length, 5 to 8 bits.
    pub length: Option<u8>,
    /// Parity.
    pub parity: Option<Parity>,
    /// Stop bits, 1 or 2.
    pub stop: Option<u8>,
}

/// What is between the controller and its peer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum HostLine {
    /// Nothing real: characters take their time, and are garbled, in here.
    Modelled(HostSettings),
    /// A cable between two real ports, which does all that itself.
    Wire,
}

impl Default for HostLine {
    fn default() -> HostLine {
        HostLine::Modelled(HostSettings::default())
    }
}

impl From<SerialSettings> for HostSettings {
    fn from(line: SerialSettings) -> HostSettings {
        HostSettings {
            speed: Some(line.speed),
            length: Some(line.length),
            parity: Some(line.parity),
            stop: Some(line.stop),
        }
    }
}

impl HostSettings {
    /// These settings, and where nothing is known those of the robot. Values no port can have count as unknown.
    #[must_use]
    pub fn over(&self, robot: SerialSettings) -> SerialSettings {
        SerialSettings {
            speed: self.speed.filter(|speed| *speed > 0).unwrap_or(robot.speed),
            length: self
                .length
                .filter(|length| (5..=8).contains(length))
                .unwrap_or(robot.length),
            parity: self.parity.unwrap_or(robot.parity),
            stop: self
                .stop
                .filter(|stop| (1..=2).contains(stop))
                .unwrap_or(robot.stop),
        }
    }

    /// What differs from the robot's settings and what to do about it, for the author of the host program;
    /// `None` if nothing does.
    #[must_use]
    pub fn difference(&self, port: &str, robot: SerialSettings) -> Option<String> {
        let host = self.over(robot);
        if host == robot {
            return None;
        }
        let pairs = [
            ("speed", words_speed(robot.speed), words_speed(host.speed)),
            (
                "character length",
                words_length(robot.length),
                words_length(host.length),
            ),
            ("parity", words_parity(robot.parity), words_parity(host.parity)),
            ("stop bits", words_stop(robot.stop), words_stop(host.stop)),
        ];
        let differences: Vec<String> = pairs
            .into_iter()
            .filter(|(_, robot, host)| robot != host)
            .map(|(what, robot, host)| {
                format!("{what}: [U06] says {robot}, the host opened the port with {host}")
            })
            .collect();
        let stop_alone = SerialSettings {
            stop: robot.stop,
            ..host
        } == robot;
        let effect = if stop_alone {
            "receivers look at the first stop bit alone, so the bytes arrive, but not on every port"
        } else {
            "the bytes arrive garbled"
        };
        Some(format!(
            "{}; {effect}. Open the host's port with {}, or set {{{port}}} = {} {} {} {} in [U06] of USER.PAR and \
             switch the power off and on",
            differences.join("; "),
            Words(robot),
            host.speed,
            host.length,
            host.parity.number(),
            host.stop,
        ))
    }
}

/// Settings in words: `9600 bps, 8 bits, no parity, 1 stop bit`.
pub struct Words(pub SerialSettings);

impl fmt::Display for Words {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Words(line) = self;
        write!(
            f,
            "{}, {}, {}, {}",
            words_speed(line.speed),
            words_length(line.length),
            words_parity(line.parity),
            words_stop(line.stop)
        )
    }
}

fn words_speed(speed: u32) -> String {
    format!("{speed} bps")
}

fn words_length(length: u8) -> String {
    format!("{length} bits")
}

fn words_parity(parity: Parity) -> String {
    match parity {
        Parity::None => "no parity",
        Parity::Odd => "odd parity",
        Parity::Even => "even parity",
    }
    .to_string()
}

fn words_stop(stop: u8) -> String {
    match stop {
        1 => "1 stop bit".to_string(),
        other => format!("{other} stop bits"),
    }
}

/// The line of a serial port.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct SerialLine {
    /// What is at its far end.
    pub host: HostLine,
    /// Settings of the host that have been told to differ.
    pub told: Option<HostSettings>,
    /// From the host to the robot.
    pub inbound: Direction,
    /// From the robot to the host.
    pub outbound: Direction,
    /// From when to when the robot sends, or sent last.
    pub sending: Option<(Time, Time)>,
    /// The peer is gone, but what it sent is still on the line.
    pub leaving: Option<Leaving>,
}

/// A peer that is gone.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Leaving {
    /// Bytes of it that have not passed; those behind them are the next one's.
    pub left: usize,
    /// The next one, if it is there.
    pub next: Option<String>,
}

impl SerialLine {
    /// Settings of the host's port on a modelled line.
    #[must_use]
    pub fn far_end(&self, robot: SerialSettings) -> Option<SerialSettings> {
        match self.host {
            HostLine::Modelled(host) => Some(host.over(robot)),
            HostLine::Wire => None,
        }
    }

    /// When something has to be handed over.
    #[must_use]
    pub fn deadline(&self, robot: SerialSettings) -> Option<Time> {
        let far = self.far_end(robot).unwrap_or(robot);
        let inbound = self.inbound.deadline(robot);
        inbound.into_iter().chain(self.outbound.deadline(far)).min()
    }

    /// Characters are under way in either direction.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.inbound.is_busy() || self.outbound.is_busy()
    }

    /// Whether the robot sent at any time between these two.
    #[must_use]
    pub fn was_sending(&self, begin: Time, end: Time) -> bool {
        self.sending
            .is_some_and(|(first, last)| begin < last && end > first)
    }

    /// The robot sends from `begin` to `end`, right behind what it sent before or later.
    pub fn sends(&mut self, begin: Time, end: Time) {
        self.sending = match self.sending {
            Some((first, last)) if last >= begin => Some((first, last.max(end))),
            _ => Some((begin, end)),
        };
    }
}

#[cfg(test)]
mod tests;
