//! Records of what reaches the controller besides bytes, connections and actions: the state of a serial line, a second
//! connection, a peer that does not read, a restored snapshot, a reset.
//!
//! Also their text form: after `!` in a text transcript, in `link` of a JSON line.

use super::LineError;
use std::fmt;
use std::str::FromStr;
use ts3100_controller::{Bytes, Controller, HostEnd, HostSettings, Input, Port, Time};
use ts3100_driver::snapshot;
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::escape::{self, Escaped};
use ts3100_proto::parameter::Parity;
use ts3100_proto::words::Word as _;

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
    /// A snapshot replaces the controller; times continue from `at`.
    Restored {
        /// The time of the snapshot.
        at: Time,
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

    /// The time from which later records continue, if this record changes time.
    pub fn new_time(&self) -> Option<Time> {
        if let LinkRecord::Restored { at, .. } = self {
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
            | LinkRecord::Restored { .. }
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
            LinkRecord::Restored { at, snapshot } => write!(f, "restore {}us {snapshot}", at.as_micros()),
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
            "restore" => {
                let micros = first.strip_suffix("us").and_then(|micros| micros.parse().ok());
                let at = micros.map(Time::from_micros);
                let at = at.ok_or_else(|| LineError::expected("the time of the snapshot in us", first))?;
                let snapshot = behind.to_owned();
                LinkRecord::Restored { at, snapshot }
            }
            "reset" if rest.is_empty() => LinkRecord::Reset { calendar: None },
            "reset" => LinkRecord::Reset {
                calendar: Some(rest.parse()?),
            },
            _ => return Err(LineError::NoLink(words.to_owned())),
        })
    }
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
            LinkRecord::Restored {
                at: Time::from_micros(7),
                snapshot: "{\"a\": [1]}".to_owned(),
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
            "restore",
            "restore 5ms {}",
            "reset now",
        ] {
            assert!(words.parse::<LinkRecord>().is_err(), "{words}");
        }
        let other = "servo on".parse::<LinkRecord>();
        assert!(matches!(other, Err(LineError::NoLink(_))));
    }
}
