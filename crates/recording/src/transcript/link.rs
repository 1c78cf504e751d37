//! Records of what reaches the controller besides bytes, connections and actions: the state of a serial line, a second
//! connection, a peer that does not read, a restored snapshot, a reset; and the controller with which a recording begins.
//!
//! Also their text form: after `!` in a text transcript, in `link` of a JSON line.

use super::LineError;
use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;
use ts3100_controller::{Bytes, Controller, HostEnd, HostSettings, Input, Port, Time};
use ts3100_driver::snapshot;
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::escape::{self, Escaped};
use ts3100_proto::parameter::Parity;
use ts3100_proto::words::Word as _;

/// First word of [`LinkRecord::TimedFindings`].
const TIMED_FINDINGS: &str = "timed-findings";

/// A record about a connection or about the replaced state of the controller.
#[derive(Debug, Clone, PartialEq)]
pub enum LinkRecord {
    /// Settings of the host's end of a serial line.
    Settings { port: Port, host: HostEnd },
    /// The host has purged bytes that are not yet on the line.
    Purged { port: Port },
    /// Characters with a parity or framing error on the line.
    SerialErrors {
        port: Port,
        /// The characters as read.
        bytes: Vec<u8>,
    },
    /// Bytes as if from a peer, without a peer connected.
    Injected { port: Port, bytes: Bytes },
    /// A second peer came to a port that has one.
    SecondPeer {
        port: Port,
        /// Its address without the port number.
        peer: String,
        /// Whether it replaces the first peer.
        replaces: bool,
    },
    /// The emulator ends a connection because its peer has left too much unread.
    Backlogged { port: Port },
    /// A change of a file could not be saved and is rejected.
    NotPersisted {
        /// Name of the file.
        name: String,
        reason: String,
    },
    /// The emulator ends a connection on request.
    Dropped { port: Port },
    /// Whether findings about the host's timing are reported from here on. They are at first.
    TimedFindings { on: bool },
    /// A snapshot replaces the controller; times continue from `at`.
    Restored {
        /// The time of the snapshot.
        at: Time,
        /// The snapshot as JSON on one line.
        snapshot: String,
    },
    /// The recording begins here, with this controller as it is: half-received texts, half-sent replies and peers
    /// included. Times continue from `at`.
    Begin {
        /// The time of the snapshot.
        at: Time,
        /// Ports with a peer.
        connected: BTreeSet<Port>,
        /// The snapshot as JSON on one line.
        snapshot: String,
    },
    /// The controller and its time are reset to the start.
    Reset {
        /// The date then, where it is wall-clock time.
        calendar: Option<CalendarTime>,
    },
}

impl LinkRecord {
    /// A record that this controller replaces the current one.
    pub fn from_restored(controller: &Controller) -> LinkRecord {
        LinkRecord::Restored {
            at: controller.now(),
            snapshot: snapshot::to_json_line(controller),
        }
    }

    /// A record that a recording begins with this controller as it is, and peers at these ports.
    pub fn from_beginning(controller: &Controller, connected: &BTreeSet<Port>) -> LinkRecord {
        LinkRecord::Begin {
            at: controller.now(),
            connected: connected.clone(),
            snapshot: snapshot::to_json_line(controller),
        }
    }

    /// The snapshot in this record, if it has one.
    pub fn snapshot(&self) -> Option<&str> {
        if let LinkRecord::Restored { snapshot, .. } | LinkRecord::Begin { snapshot, .. } = self {
            return Some(snapshot);
        }
        None
    }

    /// The time from which later records continue, if this record changes time.
    pub fn new_time(&self) -> Option<Time> {
        if let LinkRecord::Restored { at, .. } | LinkRecord::Begin { at, .. } = self {
            return Some(*at);
        }
        matches!(self, LinkRecord::Reset { .. }).then_some(Time::ZERO)
    }

    /// The input of the controller that this record describes, if any.
    pub fn input(&self) -> Option<Input> {
        Some(match *self {
            LinkRecord::Settings { port, host } => Input::SerialOpened { port, host },
            LinkRecord::Purged { port } => Input::SerialPurged { port },
            LinkRecord::SerialErrors { port, ref bytes } => Input::SerialErrors {
                port,
                bytes: bytes.clone(),
            },
            LinkRecord::Injected { port, ref bytes } => Input::received(port, bytes.clone()),
            LinkRecord::SecondPeer {
                port,
                ref peer,
                replaces: kept,
            } => Input::SecondPeer {
                port,
                peer: peer.clone(),
                kept,
            },
            LinkRecord::Backlogged { port } => Input::Backlogged { port },
            // That a file was not persisted is the answer to a question that the controller has to put first.
            LinkRecord::NotPersisted { .. }
            | LinkRecord::Dropped { .. }
            | LinkRecord::TimedFindings { .. }
            | LinkRecord::Restored { .. }
            | LinkRecord::Begin { .. }
            | LinkRecord::Reset { .. } => return None,
        })
    }
}

impl fmt::Display for LinkRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LinkRecord::Settings { port, host } => write!(f, "line {port} {}", host_settings_text(host)),
            LinkRecord::Purged { port } => write!(f, "purge {port}"),
            LinkRecord::SerialErrors { port, bytes } => write!(f, "garbled {port} {}", Escaped::new(bytes)),
            LinkRecord::Injected { port, bytes } => write!(f, "inject {port} {}", Escaped::new(bytes)),
            LinkRecord::SecondPeer { port, peer, replaces } => {
                let what = if *replaces { "replaces" } else { "refused" };
                f.write_str(format!("second-peer {port} {what} {peer}").trim_end())
            }
            LinkRecord::Backlogged { port } => write!(f, "unread {port}"),
            LinkRecord::NotPersisted { name, reason } => {
                write!(f, "unkept {name} {}", Escaped::new(reason.as_bytes()))
            }
            LinkRecord::Dropped { port } => write!(f, "drop {port}"),
            LinkRecord::TimedFindings { on } => {
                write!(f, "{TIMED_FINDINGS} {}", if *on { "on" } else { "off" })
            }
            LinkRecord::Restored { at, snapshot } => write!(f, "restore {}us {snapshot}", at.as_micros()),
            LinkRecord::Begin {
                at,
                connected,
                snapshot,
            } => {
                write!(f, "begin {}us", at.as_micros())?;
                connected.iter().try_for_each(|port| write!(f, " {port}"))?;
                write!(f, " {snapshot}")
            }
            LinkRecord::Reset { calendar } => {
                f.write_str("reset")?;
                calendar.iter().try_for_each(|calendar| write!(f, " {calendar}"))
            }
        }
    }
}

fn host_settings_text(host: &HostEnd) -> String {
    let HostEnd::Modelled(known) = host else {
        return "wire".to_owned();
    };
    let pairs = [
        ("speed", known.speed.map(|speed| speed.to_string())),
        ("length", known.length.map(|length| length.to_string())),
        ("parity", known.parity.map(|parity| parity.word().to_owned())),
        ("stop", known.stop.map(|stop| stop.to_string())),
    ];
    let pairs = pairs.into_iter();
    let known: Vec<String> = pairs
        .filter_map(|(key, value)| Some(format!("{key}={}", value?)))
        .collect();
    if known.is_empty() {
        "unknown".to_owned()
    } else {
        known.join(" ")
    }
}

impl FromStr for LinkRecord {
    type Err = LineError;

    fn from_str(words: &str) -> Result<LinkRecord, LineError> {
        let (name, rest) = words.split_once(' ').unwrap_or((words, ""));
        let (first, behind) = rest.split_once(' ').unwrap_or((rest, ""));
        let port = |word: &str| {
            Port::from_word(word).ok_or_else(|| LineError::expected("a port such as HOST", word))
        };
        Ok(match name {
            "line" => LinkRecord::Settings {
                port: port(first)?,
                host: parse_host_line(behind)?,
            },
            "purge" => LinkRecord::Purged { port: port(rest)? },
            "garbled" => LinkRecord::SerialErrors {
                port: port(first)?,
                bytes: escape::parse(behind)?,
            },
            "inject" => LinkRecord::Injected {
                port: port(first)?,
                bytes: escape::parse(behind)?.into(),
            },
            "second-peer" => {
                let (what, peer) = behind.split_once(' ').unwrap_or((behind, ""));
                LinkRecord::SecondPeer {
                    port: port(first)?,
                    peer: peer.to_owned(),
                    replaces: match what {
                        "replaces" => true,
                        "refused" => false,
                        _ => return Err(LineError::expected("replaces or refused", what)),
                    },
                }
            }
            "unread" => LinkRecord::Backlogged { port: port(rest)? },
            "unkept" if !first.is_empty() => LinkRecord::NotPersisted {
                name: first.to_owned(),
                reason: String::from_utf8_lossy(&escape::parse(behind)?).into_owned(),
            },
            "unkept" => return Err(LineError::expected("the name of a file", rest)),
            "drop" => LinkRecord::Dropped { port: port(rest)? },
            TIMED_FINDINGS => LinkRecord::TimedFindings {
                on: match rest {
                    "on" => true,
                    "off" => false,
                    _ => return Err(LineError::expected("on or off", rest)),
                },
            },
            "restore" => {
                let (at, snapshot) = (parse_moment(first)?, behind.to_owned());
                LinkRecord::Restored { at, snapshot }
            }
            "begin" => {
                let place = behind.find('{').unwrap_or(behind.len());
                let (ports, snapshot) = behind.split_at(place);
                LinkRecord::Begin {
                    at: parse_moment(first)?,
                    connected: ports.split_whitespace().map(port).collect::<Result<_, _>>()?,
                    snapshot: snapshot.to_owned(),
                }
            }
            "reset" if rest.is_empty() => LinkRecord::Reset { calendar: None },
            "reset" => LinkRecord::Reset {
                calendar: Some(rest.parse()?),
            },
            _ => return Err(LineError::NoLink(words.to_owned())),
        })
    }
}

/// Reads the time of a snapshot, such as `1250us`.
fn parse_moment(word: &str) -> Result<Time, LineError> {
    let micros = word.strip_suffix("us").and_then(|micros| micros.parse().ok());
    let at = micros.map(Time::from_micros);
    at.ok_or_else(|| LineError::expected("the time of the snapshot in us", word))
}

fn parse_host_line(words: &str) -> Result<HostEnd, LineError> {
    if words == "wire" {
        return Ok(HostEnd::Wire);
    }
    let mut known = HostSettings::default();
    if words == "unknown" {
        return Ok(HostEnd::Modelled(known));
    }
    for pair in words.split(' ') {
        let mut read = || {
            let (key, value) = pair.split_once('=')?;
            match key {
                "speed" => known.speed = Some(value.parse().ok()?),
                "length" => known.length = Some(value.parse().ok()?),
                "stop" => known.stop = Some(value.parse().ok()?),
                "parity" => known.parity = Some(Parity::from_word(value)?),
                _ => return None,
            }
            Some(())
        };
        let expected = "speed=, length=, parity= (none, odd, even) or stop= and a value";
        read().ok_or_else(|| LineError::expected(expected, pair))?;
    }
    Ok(HostEnd::Modelled(known))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_link_record_reads_back() {
        let port = Port::Host;
        let all = [
            LinkRecord::Settings {
                port,
                host: HostEnd::Wire,
            },
            LinkRecord::Settings {
                port,
                host: HostEnd::default(),
            },
            LinkRecord::Settings {
                port: Port::Com1,
                host: HostEnd::Modelled(HostSettings {
                    speed: Some(19_200),
                    length: Some(7),
                    parity: Some(Parity::Even),
                    stop: Some(2),
                }),
            },
            LinkRecord::Purged { port },
            LinkRecord::SerialErrors {
                port,
                bytes: b"\x00 <\xff".to_vec(),
            },
            LinkRecord::Injected {
                port: Port::Ip1,
                bytes: b"7 <\r".to_vec().into(),
            },
            LinkRecord::SecondPeer {
                port: Port::Ip0,
                peer: "::1".to_owned(),
                replaces: true,
            },
            LinkRecord::SecondPeer {
                port: Port::Ip0,
                peer: String::new(),
                replaces: false,
            },
            LinkRecord::Backlogged { port: Port::Ip1 },
            LinkRecord::NotPersisted {
                name: "PICK".to_owned(),
                reason: "cannot write d\u{e9}p\u{f4}t: full\nby <far>".to_owned(),
            },
            LinkRecord::Dropped { port: Port::Ip0 },
            LinkRecord::TimedFindings { on: true },
            LinkRecord::TimedFindings { on: false },
            LinkRecord::Restored {
                at: Time::from_micros(7),
                snapshot: "{\"a\": [1]}".to_owned(),
            },
            LinkRecord::Begin {
                at: Time::from_micros(7),
                connected: BTreeSet::new(),
                snapshot: "{\"a\": [1]}".to_owned(),
            },
            LinkRecord::Begin {
                at: Time::ZERO,
                connected: [Port::Host, Port::Ip3].into(),
                snapshot: "{\"a b\": {}}".to_owned(),
            },
            LinkRecord::Reset { calendar: None },
            LinkRecord::Reset {
                calendar: Some(CalendarTime {
                    year: 2026,
                    month: 11,
                    day: 21,
                    hour: 10,
                    minute: 0,
                    second: 59,
                }),
            },
        ];
        for link in all {
            let words = link.to_string();
            assert_eq!(words.parse::<LinkRecord>().unwrap(), link, "{words}");
        }
    }

    #[test]
    fn what_does_not_hold_is_refused() {
        for words in [
            "line",
            "line IP9 wire",
            "line HOST",
            "line HOST speed",
            "line HOST speed=fast",
            "line HOST parity=mark",
            "line HOST baud=9600",
            "purge",
            "purge HOST now",
            "garbled HOST <0",
            "inject IP9 7",
            "second-peer IP0 comes",
            "unread",
            "unkept",
            "unkept PICK <far>",
            "drop IP0 now",
            "timed-findings",
            "timed-findings maybe",
            "restore",
            "restore 5ms {}",
            "begin",
            "begin IP0 {}",
            "begin 5us IP9 {}",
            "reset now",
        ] {
            assert!(words.parse::<LinkRecord>().is_err(), "{words}");
        }
        let other = "servo on".parse::<LinkRecord>();
        assert!(matches!(other, Err(LineError::NoLink(_))));
    }
}
