//! Fuzzes the access server of RFC 2217: the bytes of a telnet client, cut anywhere, and bytes of the robot in between.
//!
//! The server never panics, decides the same however the stream is cut, answers no more than in proportion, and says only
//! settings that a port can have. Its stream carries the robot's bytes unchanged. What it makes of the client's bytes goes
//! on to the line of a controller.

use super::shared::{Choices, Robot};
use ts3100_controller::{HostEnd, Input, Port};
use ts3100_driver::serial::rfc2217::{Event, Server};
use ts3100_proto::parameter::{Parity, SerialSettings};

/// Most bytes that one byte of the client leads to: an option that is refused or accepted, or a command with its answer.
const MOST_ANSWERED: usize = 16;

/// Those of the robot.
const SETTINGS: SerialSettings = SerialSettings {
    speed: 9_600,
    length: 8,
    parity: Parity::None,
    stop: 1,
};

/// Events with neighbouring data joined: where data is cut says nothing.
fn joined(events: Vec<Event>) -> Vec<Event> {
    let mut all: Vec<Event> = Vec::new();
    for event in events {
        match (all.last_mut(), event) {
            (Some(Event::Data(before)), Event::Data(bytes)) => before.extend(bytes),
            (_, event) => all.push(event),
        }
    }
    all
}

/// Lets a server read the bytes.
///
/// # Panics
/// When what must hold does not.
pub fn check(data: &[u8]) {
    let settings = SETTINGS;
    let mut choices = Choices(data);
    let (mut server, mut cut) = (Server::new(settings), Vec::new());
    let (mut whole, mut answers) = (Vec::new(), Vec::new());
    while !choices.is_empty() {
        let piece = choices.chunk();
        whole.extend_from_slice(piece);
        cut.extend(server.receive(piece));
        answers.extend(server.take_output());
    }
    let mut other = Server::new(settings);
    let events = joined(other.receive(&whole));
    assert_eq!(joined(cut), events, "{}", whole.escape_ascii());
    assert_eq!(other.take_output(), answers, "{}", whole.escape_ascii());
    assert!(answers.len() <= MOST_ANSWERED * whole.len());
    let mut reader = Server::new(settings);
    let mut sender = Server::new(settings);
    sender.send(&whole);
    let expected = Some(Event::Data(whole.clone())).filter(|_| !whole.is_empty());
    assert_eq!(joined(reader.receive(&sender.take_output())).pop(), expected);
    let mut robot = Robot::new(true);
    let port = Port::Host;
    for event in events {
        robot.feed(match event {
            Event::Data(bytes) => Input::received(port, bytes),
            Event::Settings(host) => {
                assert!(host.speed.is_none_or(|speed| speed > 0), "{host:?}");
                assert!(
                    host.length.is_none_or(|length| (5..=8).contains(&length)),
                    "{host:?}"
                );
                assert!(host.stop.is_none_or(|stop| (1..=2).contains(&stop)), "{host:?}");
                let host = HostEnd::Modelled(host);
                Input::SerialOpened { port, host }
            }
            Event::PurgeToRobot => Input::SerialPurged { port },
            Event::Break => Input::SerialErrors { port, bytes: vec![0] },
            Event::PurgeToClient | Event::Suspended(_) => Input::Tick,
        });
        robot.advance(5);
    }
    robot.advance(2_000);
}
