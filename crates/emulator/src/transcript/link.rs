//! What reaches the controller besides bytes, connections and actions: what the edge knows of a serial line, a second
//! connection, a peer that does not read, and another state put in the controller's place. Here are the words for it:
//! behind `!` in a text, in `edge` of a JSON line.

use super::notation;
use super::text::{date, read_date};
use crate::snapshot;
use ts3100_controller::{Controller, HostEnd, HostSettings, Input, Port, Time};
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::parameter::Parity;

/// Something of the edge.
#[derive(Debug, Clone, PartialEq)]
pub enum LinkRecord {
    /// How the host has opened its end of a serial line.
    Settings {
        /// The port.
        port: Port,
        /// What is known.
        host: HostEnd,
    },
    /// The host has its port forget what is not on the line yet.
    Purged {
        /// The port.
        port: Port,
    },
    /// Characters with a parity or framing error that the line itself brought.
    Garbled {
        /// The port.
        port: Port,
        /// Them, as read.
        bytes: Vec<u8>,
    },
    /// A second peer came to a port that has one.
    Second {
        /// The port.
        port: Port,
        /// Its address without the port number.
        peer: String,
        /// It takes the place of the first.
        kept: bool,
    },
    /// The peer leaves so much unread that the emulator ends its connection.
    Unread {
        /// The port.
        port: Port,
    },
    /// The change of a file that was asked for was not kept, and is refused.
    Unkept {
        /// The file.
        name: String,
        /// Why.
        reason: String,
    },
    /// The emulator ends a connection because somebody has asked it to.
    Dropped {
        /// The port.
        port: Port,
    },
    /// A snapshot takes the controller's place; times go on from `at`.
    Restored {
        /// The time of the snapshot.
        at: Time,
        /// It, as JSON on one line.
        snapshot: String,
    },
    /// The controller is as at the start, and so is time.
    Reset {
        /// The date then, where it is the wall's.
        calendar: Option<CalendarTime>,
    },
}

impl LinkRecord {
    /// The snapshot of this controller takes the place of the present one.
    #[must_use]
    pub fn restored(controller: &Controller) -> LinkRecord {
        LinkRecord::Restored {
            at: controller.now(),
            snapshot: snapshot::to_json_line(controller),
        }
    }

    /// The time from which times go on behind it, if it moves them.
    #[must_use]
    pub fn begins_at(&self) -> Option<Time> {
        match self {
            LinkRecord::Restored { at, .. } => Some(*at),
            LinkRecord::Reset { .. } => Some(Time::ZERO),
            LinkRecord::Settings { .. }
            | LinkRecord::Purged { .. }
            | LinkRecord::Garbled { .. }
            | LinkRecord::Second { .. }
            | LinkRecord::Unread { .. }
            | LinkRecord::Unkept { .. }
            | LinkRecord::Dropped { .. } => None,
        }
    }

    /// The controller's input, where it is one.
    #[must_use]
    pub fn input(&self) -> Option<Input> {
        Some(match self {
            LinkRecord::Settings { port, host } => Input::SerialOpened {
                port: *port,
                host: *host,
            },
            LinkRecord::Purged { port } => Input::SerialPurged { port: *port },
            LinkRecord::Garbled { port, bytes } => Input::SerialErrors {
                port: *port,
                bytes: bytes.clone(),
            },
            LinkRecord::Second { port, peer, kept } => Input::SecondPeer {
                port: *port,
                peer: peer.clone(),
                kept: *kept,
            },
            LinkRecord::Unread { port } => Input::Backlogged { port: *port },
            // The answer to a question that the controller has to put first.
            LinkRecord::Unkept { .. } => return None,
            LinkRecord::Dropped { .. } | LinkRecord::Restored { .. } | LinkRecord::Reset { .. } => {
                return None;
            }
        })
    }
}

/// Its words.
#[must_use]
pub fn write(edge: &LinkRecord) -> String {
    match edge {
        LinkRecord::Settings { port, host } => format!("line {port} {}", host_words(host)),
        LinkRecord::Purged { port } => format!("purge {port}"),
        LinkRecord::Garbled { port, bytes } => format!("garbled {port} {}", notation::write(bytes)),
        LinkRecord::Second { port, peer, kept } => {
            let what = if *kept { "replaces" } else { "refused" };
            format!("second-peer {port} {what} {peer}").trim_end().to_owned()
        }
        LinkRecord::Unread { port } => format!("unread {port}"),
        LinkRecord::Unkept { name, reason } => {
            format!("unkept {name} {}", notation::write(reason.as_bytes()))
        }
        LinkRecord::Dropped { port } => format!("drop {port}"),
        LinkRecord::Restored { at, snapshot } => format!("restore {}us {snapshot}", at.as_micros()),
        LinkRecord::Reset { calendar: None } => "reset".to_owned(),
        LinkRecord::Reset {
            calendar: Some(calendar),
        } => format!("reset {}", date(*calendar)),
    }
}

fn host_words(host: &HostEnd) -> String {
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

/// Reads the words of something of the edge; `None` if they begin like nothing of it.
///
/// # Errors
/// What was expected and found.
pub fn read(words: &str) -> Result<Option<LinkRecord>, String> {
    let (name, rest) = words.split_once(' ').unwrap_or((words, ""));
    let (first, behind) = rest.split_once(' ').unwrap_or((rest, ""));
    Ok(Some(match name {
        "line" => LinkRecord::Settings {
            port: port_of(first)?,
            host: read_host(behind)?,
        },
        "purge" => LinkRecord::Purged { port: port_of(rest)? },
        "garbled" => LinkRecord::Garbled {
            port: port_of(first)?,
            bytes: notation::bytes(behind)?,
        },
        "second-peer" => {
            let (what, peer) = behind.split_once(' ').unwrap_or((behind, ""));
            LinkRecord::Second {
                port: port_of(first)?,
                peer: peer.to_owned(),
                kept: match what {
                    "replaces" => true,
                    "refused" => false,
                    _ => return Err(format!("replaces or refused expected, {what:?} found")),
                },
            }
        }
        "unread" => LinkRecord::Unread { port: port_of(rest)? },
        "unkept" if !first.is_empty() => LinkRecord::Unkept {
            name: first.to_owned(),
            reason: String::from_utf8_lossy(&notation::bytes(behind)?).into_owned(),
        },
        "unkept" => return Err(format!("the name of a file expected, {rest:?} found")),
        "drop" => LinkRecord::Dropped { port: port_of(rest)? },
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
            calendar: Some(read_date(rest)?),
        },
        _ => return Ok(None),
    }))
}

fn port_of(word: &str) -> Result<Port, String> {
    let port = Port::ALL.into_iter().find(|port| port.name() == word);
    port.ok_or_else(|| format!("a port expected, for example HOST, {word:?} found"))
}

fn read_host(words: &str) -> Result<HostEnd, String> {
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
            LinkRecord::Garbled {
                port,
                bytes: b"\x00 <\xff".to_vec(),
            },
            LinkRecord::Second {
                port: Port::Ip0,
                peer: "::1".to_owned(),
                kept: true,
            },
            LinkRecord::Second {
                port: Port::Ip0,
                peer: String::new(),
                kept: false,
            },
            LinkRecord::Unread { port: Port::Ip1 },
            LinkRecord::Unkept {
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
        for edge in all {
            let words = write(&edge);
            assert_eq!(read(&words), Ok(Some(edge)), "{words}");
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
