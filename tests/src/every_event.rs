//! One of each event of a controller, and the goldens of what becomes of them in the stream of events, the metrics, the
//! log and the transcript (`fixtures/golden/events`). The crates of these sinks include this file in their unit tests.

use std::path::PathBuf;
use ts3100_controller::findings::{FaultCause, Finding, Message, rules};
use ts3100_controller::output::DisconnectMode;
use ts3100_controller::{ActionError, Bytes, Event, Input, Output, Port, Time, Verdict};
use ts3100_proto::status::{ExecutionStatus, MasterMode};
use ts3100_proto::text::{Framing, Terminator};

/// What is told about a connection.
pub fn inputs() -> Vec<Input> {
    let port = Port::Ip0;
    vec![
        Input::Connected {
            port,
            peer: "192.0.2.7:50123".to_owned(),
        },
        Input::received(port, Bytes::from_static(b"\x02SU\r\x03")),
        Input::Disconnected { port },
    ]
}

/// Every output that is no event.
fn requests() -> Vec<Output> {
    let (port, name, content) = (Port::Ip0, "A".to_owned(), Bytes::from_static(b"PROGRAM A\nEND\n"));
    let disconnect = |how| Output::Disconnect { port, how };
    vec![
        Output::Send {
            port,
            bytes: Bytes::from_static(b"\x02OK\r\x03"),
        },
        Output::Persist {
            name: name.clone(),
            content: Some(content.clone()),
        },
        Output::Stored {
            name: name.clone(),
            content,
        },
        Output::Erased { name },
        Output::PowerCycled,
        disconnect(DisconnectMode::Reset),
        disconnect(DisconnectMode::Close),
        Output::Stall { port },
        Output::PowerOff,
        Output::Pendant("COUNT = 7".to_owned()),
    ]
}

fn texts() -> Vec<Event> {
    let port = Port::Host;
    let (framing, terminator) = (Framing::Stx, Terminator::Etx);
    let received = |framing, data: &'static [u8], terminator| Event::TextIn {
        port,
        framing,
        data: Bytes::from_static(data),
        terminator,
    };
    let answered = |row, mode, verdict| Event::Answered {
        port,
        row,
        mode,
        verdict,
    };
    vec![
        received(framing, b"MW,\"<a>\"\\\x1b\xff\r", terminator),
        received(Framing::Bare, b"SO\r", Terminator::Cr),
        Event::TextOut {
            port,
            framing,
            data: Bytes::from_static(b"OK\r"),
        },
        Event::Dropped {
            port,
            bytes: 3,
            reason: "no text",
        },
        Event::Refused {
            port,
            command: "XX".to_owned(),
            reason: "no \"command\"".to_owned(),
        },
        answered("SU", MasterMode::ExtEther, Verdict::Served),
        answered("RS,ERR", MasterMode::Internal, Verdict::NotValid),
        answered("RN", MasterMode::Teaching, Verdict::Refused),
    ]
}

/// Of a host, of a fault, and of nobody at a port.
fn findings() -> Vec<Event> {
    let finding = Finding {
        rule: &rules::NO_CR,
        port: Some(Port::Ip0),
        at: Time::from_micros(1_250_001),
        bytes: Bytes::from_static(b"SU"),
        message: Message::from("the text ends without CR"),
        caused_by: None,
    };
    let cause = FaultCause {
        id: 3,
        kind: "lost-etx",
    };
    let at_panel = Finding {
        rule: &rules::PANEL_REFUSED,
        port: None,
        bytes: Bytes::new(),
        message: Message::Again {
            command: "SU",
            since: std::time::Duration::from_millis(7),
        },
        ..finding.clone()
    };
    let caused = Finding {
        caused_by: Some(cause),
        ..finding.clone()
    };
    [finding, caused, at_panel].map(Event::Finding).into()
}

fn states() -> Vec<Event> {
    let fault = |port, message: &str, fired| Event::Fault {
        id: 3,
        kind: "lost-etx",
        port,
        message: message.to_owned(),
        fired,
    };
    vec![
        fault(None, "armed: lost-etx", false),
        fault(Some(Port::Ip0), "the ETX is left out", true),
        Event::Alarm {
            number: "2-046".to_owned(),
            text: "Communication error".to_owned(),
        },
        Event::ActionRefused(ActionError::conflict(
            "servo",
            "cannot turn the servo on: the power is off; turn it on first",
        )),
        Event::AlarmsReset,
        Event::Status {
            status: ExecutionStatus::Retry,
            line: 12,
        },
        Event::Statement {
            line: 12,
            task: 1,
            seen: None,
            detail: None,
        },
        Event::Breakpoint {
            line: 7,
            task: 1,
            text: "part 3".to_owned(),
        },
        Event::Servo(true),
        Event::Servo(false),
        Event::ServoDelayed(Time::from_micros(2_500_000)),
        Event::Selected(Some("A".to_owned())),
        Event::Selected(None),
    ]
}

/// Every event.
pub fn events() -> Vec<Event> {
    [texts(), findings(), states()].concat()
}

/// Every output.
pub fn outputs() -> Vec<Output> {
    let events = events().into_iter().map(Output::Event);
    requests().into_iter().chain(events).collect()
}

/// The moment of an event by its place in the list.
pub fn moment(place: usize) -> Time {
    Time::from_micros(1_000_000 + 100_001 * place as u64)
}

fn golden(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../fixtures/golden/events")
        .join(name)
}

/// Compares what a sink wrote with its golden.
///
/// # Panics
/// They differ.
pub fn compare(name: &str, found: &str) {
    let expected = std::fs::read_to_string(golden(name)).unwrap_or_default();
    assert_eq!(found, expected, "{name}");
}

/// Writes the golden of a sink.
///
/// # Panics
/// It cannot be written.
pub fn bless(name: &str, found: &str) {
    std::fs::write(golden(name), found).unwrap();
}
