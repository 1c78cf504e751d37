//! A serial line as a value: two directions in time, the settings of the host's port as far as known, and what has been
//! reported about them.
//!
//! `direction` carries bytes in time, `uart` samples characters as a receiver does. Which bytes form texts is decided
//! by the endpoint that owns the line.

mod clock;
pub mod direction;
pub mod uart;

use crate::prelude::*;
use crate::time::Time;
use direction::Direction;
use ts3100_proto::parameter::{Parity, SerialSettings};

/// The settings of the host's port as far as known. An unknown setting counts as matching.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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

/// The host's end of a serial line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum HostEnd {
    /// A simulated end: this crate models the time of characters and garbles them.
    Modelled(HostSettings),
    /// A real cable, which has its own timing and errors.
    Wire,
}

impl Default for HostEnd {
    fn default() -> HostEnd {
        HostEnd::Modelled(HostSettings::default())
    }
}

impl HostSettings {
    /// These settings; the robot's where one is unknown. Values that no port can have count as unknown.
    pub fn or_robot(&self, robot: SerialSettings) -> SerialSettings {
        let length = self.length.filter(|length| (5..=8).contains(length));
        let stop = self.stop.filter(|stop| (1..=2).contains(stop));
        SerialSettings {
            speed: self.speed.filter(|speed| *speed > 0).unwrap_or(robot.speed),
            length: length.unwrap_or(robot.length),
            parity: self.parity.unwrap_or(robot.parity),
            stop: stop.unwrap_or(robot.stop),
        }
    }

    /// A message for the author of the host program: what differs from the robot's settings and what to do about
    /// it; `None` if nothing differs.
    pub fn difference(&self, port: &str, robot: SerialSettings) -> Option<String> {
        let host = self.or_robot(robot);
        if host == robot {
            return None;
        }
        let names = ["speed", "character length", "parity", "stop bits"];
        let phrases = names.iter().zip(phrases(robot)).zip(phrases(host));
        let others = phrases.filter(|((_, robot), host)| robot != host);
        let differences: Vec<String> = others
            .map(|((what, own), far)| {
                format!("{what}: [U06] says {own}, the host opened the port with {far}")
            })
            .collect();
        let stop_alone = SerialSettings {
            stop: robot.stop,
            ..host
        } == robot;
        let effect = if stop_alone {
            "most ports check the first stop bit only, so the bytes arrive"
        } else {
            "the bytes arrive garbled"
        };
        Some(format!(
            "{}; {effect}. Open the host's port with {}, or set {{{port}}} = {} {} {} {} in [U06] of USER.PAR and \
             switch the power off and on",
            differences.join("; "),
            describe(robot),
            host.speed,
            host.length,
            host.parity.number(),
            host.stop,
        ))
    }
}

/// Settings as a phrase: `9600 bps, 8 bits, no parity, 1 stop bit`.
pub(crate) fn describe(line: SerialSettings) -> String {
    phrases(line).join(", ")
}

fn phrases(line: SerialSettings) -> [String; 4] {
    let parity = match line.parity {
        Parity::None => "no parity",
        Parity::Odd => "odd parity",
        Parity::Even => "even parity",
    };
    let plural = if line.stop == 1 { "" } else { "s" };
    [
        format!("{} bps", line.speed),
        format!("{} bits", line.length),
        parity.to_string(),
        format!("{} stop bit{plural}", line.stop),
    ]
}

/// The line of a serial port (HOST or COM1).
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SerialLine {
    /// The other end.
    pub host: HostEnd,
    /// Settings of the host that were reported as different, so that each mismatch is reported once.
    pub reported_mismatch: Option<HostSettings>,
    /// From the host to the robot.
    pub inbound: Direction,
    /// From the robot to the host.
    pub outbound: Direction,
    /// Begin and end of the transmission under way, or of the last one (half-duplex rule, SER-02).
    pub sending: Option<(Time, Time)>,
    /// A peer that is gone while bytes it sent are still on the line.
    pub departed_peer: Option<DepartedPeer>,
}

/// A peer that is gone, with bytes still on the line.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DepartedPeer {
    /// Its bytes that are still on the line; later bytes belong to the next peer.
    pub bytes_left: usize,
    /// The next peer, if it is connected already.
    pub next_peer: Option<String>,
    /// Earliest and latest time of the SP that waits for the next peer. Earlier snapshots have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_sp: Option<(Time, Time)>,
}

impl SerialLine {
    /// Settings of the host's port; `None` for a real cable, where they are not known.
    pub fn host_settings(&self, robot: SerialSettings) -> Option<SerialSettings> {
        match self.host {
            HostEnd::Modelled(host) => Some(host.or_robot(robot)),
            HostEnd::Wire => None,
        }
    }

    /// When bytes of either direction are next due.
    pub fn deadline(&self, robot: SerialSettings) -> Option<Time> {
        let far = self.host_settings(robot).unwrap_or(robot);
        let inbound = self.inbound.deadline(robot);
        inbound.into_iter().chain(self.outbound.deadline(far)).min()
    }

    /// Whether characters are on the line in either direction.
    pub fn is_busy(&self) -> bool {
        self.inbound.is_busy() || self.outbound.is_busy()
    }

    /// Whether the robot was sending at any time between `begin` and `end`.
    pub fn was_sending(&self, begin: Time, end: Time) -> bool {
        self.sending
            .is_some_and(|(first, last)| begin < last && end > first)
    }

    /// Records that the robot sends from `begin` to `end`. Adjoining transmissions become one.
    pub fn note_sending(&mut self, begin: Time, end: Time) {
        self.sending = match self.sending {
            Some((first, last)) if last >= begin => Some((first, last.max(end))),
            _ => Some((begin, end)),
        };
    }
}

#[cfg(test)]
mod tests;
