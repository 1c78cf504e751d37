//! Records of what reaches the controller besides bytes, connections and actions: the state of a serial line, a second
//! connection, a peer that does not read, a restored snapshot, a reset.
//!
//! Also their text form: after `!` in a text transcript, in `edge` of a JSON line.

use super::notation;
use super::text::{format_date, parse_date};
use crate::snapshot;
use ts3100_controller::{Controller, HostEnd, HostSettings, Input, Port, Time};
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::parameter::Parity;

/// A record about a connection or about the replaced state of the controller.
#[derive(Debug, Clone, PartialEq)]
pub enum LinkRecord {
    /// Settings of the host's end of a serial line.
    Settings {
        /// The port.
        port: Port,
        /// What is known.
        host: HostEnd,
    },
    /// The host has purged bytes that are not yet on the line.
    Purged {
        /// The port.
        port: Port,
    },
    /// Characters with a parity or framing error on the line.
    SerialErrors {
        /// The port.
        port: Port,
        /// The characters as read.
        bytes: Vec<u8>,
    },
    /// A second peer came to a port that has one.
    SecondPeer {
        /// The port.
        port: Port,
        /// Its address without the port number.
        peer: String,
        /// Whether it replaces the first peer.
        replaces: bool,
    },
    /// The emulator ends a connection because its peer has left too much unread.
    Backlogged {
        /// The port.
        port: Port,
    },
    /// A change of a file could not be saved and is rejected.
    NotPersisted {
        /// The file.
        name: String,
        /// Why.
        reason: String,
    },
    /// The emulator ends a connection on request.
    Dropped {
        /// The port.
        port: Port,
    },
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
    #[must_use]
    pub fn from_restored(controller: &Controller) -> LinkRecord {
        LinkRecord::Restored {
            at: controller.now(),
            snapshot: snapshot::to_json_line(controller),
        }
    }

    /// The time from which later records continue, if this record changes time.
    #[must_use]
    pub fn new_time(&self) -> Option<Time> {
        match self {
            LinkRecord::Restored { at, .. } => Some(*at),
            LinkRecord::Reset { .. } => Some(Time::ZERO),
            LinkRecord::Settings { .. }
            | LinkRecord::Purged { .. }
            | LinkRecord::SerialErrors { .. }
            | LinkRecord::SecondPeer { .. }
            | LinkRecord::Backlogged { .. }
            | LinkRecord::NotPersisted { .. }
            | LinkRecord::Dropped { .. } => None,
        }
    }

    /// The input of the controller that this record stands for, if any.
    #[must_use]
    pub fn input(&self) -> Option<Input> {
        Some(match self {
            LinkRecord::Settings { port, host } => Input::SerialOpened {
                port: *port,
                host: *host,
            },
            LinkRecord::Purged { port } => Input::SerialPurged { port: *port },
            LinkRecord::SerialErrors { port, bytes } => Input::SerialErrors {
                port: *port,
                bytes: bytes.clone(),
            },
            LinkRecord::SecondPeer { port, peer, replaces } => Input::SecondPeer {
                port: *port,
                peer: peer.clone(),
                kept: *replaces,
            },
            LinkRecord::Backlogged { port } => Input::Backlogged { port: *port },
            // The answer to a question that the controller has to put first.
            LinkRecord::NotPersisted { .. } => return None,
            LinkRecord::Dropped { .. } | LinkRecord::Restored { .. } | LinkRecord::Reset { .. } => {
                return None;
            }
        })
    }
}

/// Text form of the record.
#[must_use]
pub fn write(link: &LinkRecord) -> String {
    match link {
        LinkRecord::Settings { port, host } => format!("line {port} {}", host_settings_text(host)),
        LinkRecord::Purged { port } => format!("purge {port}"),
        LinkRecord::SerialErrors { port, bytes } => format!("garbled {port} {}", notation::write(bytes)),
        LinkRecord::SecondPeer { port, peer, replaces } => {
            let what = if *replaces { "replaces" } else { "refused" };
            format!("second-peer {port} {what} {peer}").trim_end().to_owned()
        }
        LinkRecord::Backlogged { port } => format!("unread {port}"),
        LinkRecord::NotPersisted { name, reason } => {
            format!("unkept {name} {}", notation::write(reason.as_bytes()))
        }
        LinkRecord::Dropped { port } => format!("drop {port}"),
        LinkRecord::Restored { at, snapshot } => format!("restore {}us {snapshot}", at.as_micros()),
        LinkRecord::Reset { calendar: None } => "reset".to_owned(),
        LinkRecord::Reset {
            calendar: Some(calendar),
        } => format!("reset {}", format_date(*calendar)),
    }
}

fn host_settings_text(host: &HostEnd) -> String {
    let HostEnd::Modelled(known) = host else {
        return "wire".to_owned();
    };
    let parity = known.parity.map(|parity| match parity {
        Parity::None => "none",
        Parity::Odd => "odd",
        Parity::Even => "even",
    });
    let pairs = [
        ("speed", known.speed.map(|speed| speed.to_string())),
        ("length", known.length.map(|length| length.to_string())),
        ("parity", parity.map(str::to_owned)),
        ("stop", known.stop.map(|stop| stop.to_string())),
    ];
    let known = pairs
        .into_iter()
        .filter_map(|(key, value)| value.map(|value| format!("{key}={value}")));
    let known: Vec<String> = known.collect();
    if known.is_empty() {
        "unknown".to_owned()
    } else {
        known.join(" ")
    }
}

/// Reads a record from its text form; `None` if the first word is not one of these records.
///
/// # Errors
/// What was expected and found.
pub fn read(words: &str) -> Result<Option<LinkRecord>, String> {
    let (name, rest) = words.split_once(' ').unwrap_or((words, ""));
    let (first, behind) = rest.split_once(' ').unwrap_or((rest, ""));
    Ok(Some(match name {
        "line" => LinkRecord::Settings {
            port: parse_port(first)?,
            host: parse_host_line(behind)?,
        },
        "purge" => LinkRecord::Purged {
            port: parse_port(rest)?,
        },
        "garbled" => LinkRecord::SerialErrors {
            port: parse_port(first)?,
            bytes: notation::read_bytes(behind)?,
        },
        "second-peer" => {
            let (what, peer) = behind.split_once(' ').unwrap_or((behind, ""));
            LinkRecord::SecondPeer {
                port: parse_port(first)?,
                peer: peer.to_owned(),
                replaces: match what {
                    "replaces" => true,
                    "refused" => false,
                    _ => return Err(format!("replaces or refused expected, {what:?} found")),
                },
            }
        }
        "unread" => LinkRecord::Backlogged {
            port: parse_port(rest)?,
        },
        "unkept" if !first.is_empty() => LinkRecord::NotPersisted {
            name: first.to_owned(),
            reason: String::from_utf8_lossy(&notation::read_bytes(behind)?).into_owned(),
        },
        "unkept" => return Err(format!("the name of a file expected, {rest:?} found")),
        "drop" => LinkRecord::Dropped {
            port: parse_port(rest)?,
        },
        "restore" => {
            let micros = first.strip_suffix("us").and_then(|micros| micros.parse().ok());
            let at = micros.map(Time::from_micros);
            let at = at.ok_or_else(|| format!("the time of the snapshot in us expected, {first:?} found"))?;
            LinkRecord::Restored {
                at,
                snapshot: behind.to_owned(),
            }
        }
        "reset" if rest.is_empty() => LinkRecord::Reset { calendar: None },
        "reset" => LinkRecord::Reset {
            calendar: Some(parse_date(rest)?),
        },
        _ => return Ok(None),
    }))
}

fn parse_port(word: &str) -> Result<Port, String> {
    let port = Port::ALL.into_iter().find(|port| port.name() == word);
    port.ok_or_else(|| format!("a port expected, for example HOST, {word:?} found"))
}

fn parse_host_line(words: &str) -> Result<HostEnd, String> {
    if words == "wire" {
        return Ok(HostEnd::Wire);
    }
    let mut known = HostSettings::default();
    if words == "unknown" {
        return Ok(HostEnd::Modelled(known));
    }
    let wrong = |pair: &str| {
        format!("speed=, length=, parity= (none, odd, even) or stop= and a value expected, {pair:?} found")
    };
    for pair in words.split(' ') {
        let (key, value) = pair.split_once('=').ok_or_else(|| wrong(pair))?;
        match key {
            "speed" => known.speed = Some(value.parse().map_err(|_| wrong(pair))?),
            "length" => known.length = Some(value.parse().map_err(|_| wrong(pair))?),
            "stop" => known.stop = Some(value.parse().map_err(|_| wrong(pair))?),
            "parity" => {
                known.parity = Some(match value {
                    "none" => Parity::None,
                    "odd" => Parity::Odd,
                    "even" => Parity::Even,
                    _ => return Err(wrong(pair)),
                });
            }
            _ => return Err(wrong(pair)),
        }
    }
    Ok(HostEnd::Modelled(known))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_of_the_edge_reads_back() {
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
            let words = write(&link);
            assert_eq!(read(&words), Ok(Some(link)), "{words}");
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
            "second-peer IP0 comes",
            "unread",
            "unkept",
            "unkept PICK <far>",
            "drop IP0 now",
            "restore",
            "restore 5ms {}",
            "reset now",
        ] {
            assert!(read(words).is_err(), "{words}");
        }
        assert_eq!(read("servo on"), Ok(None));
    }
}
