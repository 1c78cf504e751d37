//! The other end of a port: a host, or the partner of a program, over a socket or a terminal.
//!
//! A robot in virtual time needs none of this: [`Robot`](crate::Robot) takes and gives bytes itself.

use crate::frame;
use std::fmt::Debug;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;
use ts3100_controller::Port;
use ts3100_emulator::embed::Emulator;
use ts3100_host::{Conversation, Event, Expected, Options, Response};
use ts3100_proto::command::Command;
use ts3100_proto::reply::STOP;

/// Longest wait for anything; reached only when a test fails.
pub const LONG: Duration = Duration::from_secs(30);

/// Connects to an address.
///
/// # Panics
/// When nobody listens there.
pub fn dial_address(address: impl ToSocketAddrs + Debug) -> TcpStream {
    let stream = TcpStream::connect(&address).unwrap_or_else(|error| panic!("{address:?}: {error}"));
    stream.set_nodelay(true).unwrap();
    stream.set_read_timeout(Some(LONG)).unwrap();
    stream
}

/// Connects to a port of an emulator.
///
/// # Panics
/// When the port is not open.
pub fn dial(robot: &Emulator, port: Port) -> TcpStream {
    dial_address(
        robot
            .address(port)
            .unwrap_or_else(|| panic!("{port} is not open")),
    )
}

/// What a host does with a connection. Whatever does not come as expected panics.
pub trait Host: Read + Write {
    /// Sends bytes and reads exactly what is expected.
    fn exchange(&mut self, bytes: &[u8], expected: &[u8]) {
        self.write_all(bytes).unwrap();
        let found = self.read_count(expected.len());
        assert_eq!(
            found.escape_ascii().to_string(),
            expected.escape_ascii().to_string()
        );
    }

    /// Reads so many bytes.
    fn read_count(&mut self, count: usize) -> Vec<u8> {
        let mut found = vec![0; count];
        self.read_exact(&mut found).unwrap();
        found
    }

    /// Reads up to and with a byte.
    fn read_until(&mut self, end: u8) -> Vec<u8> {
        let mut found = Vec::new();
        while found.last() != Some(&end) {
            let mut byte = [0];
            self.read_exact(&mut byte)
                .unwrap_or_else(|error| panic!("{error} after {}", found.escape_ascii()));
            found.push(byte[0]);
        }
        found
    }

    /// The data section of the next text with STX.
    fn text(&mut self) -> Vec<u8> {
        let mut host = unhurried();
        host.expect(Duration::ZERO, Expected::Text);
        match converse(self, &mut host) {
            Event::Text(text) => text.data.to_vec(),
            Event::Stopped => STOP.to_vec(),
            other => panic!("a text with STX expected, {other:?} found"),
        }
    }

    /// Sends a command and reads its answer.
    fn command(&mut self, command: &str) -> String {
        self.write_all(&frame(format!("{command}\r").as_bytes())).unwrap();
        self.answer()
    }

    /// The next text without its CR. An FL text is acknowledged.
    fn answer(&mut self) -> String {
        let text = self.text();
        if text.starts_with(b"FL,") {
            self.write_all(&frame(b"OK\r")).unwrap();
        }
        String::from_utf8_lossy(&text).trim_end_matches('\r').to_owned()
    }

    /// The 276 bytes of SF.
    fn sf(&mut self) -> Vec<u8> {
        let mut host = unhurried();
        host.request(&Command::Sf);
        match converse(self, &mut host) {
            Event::Response(Response::Content(content)) => content,
            other => panic!("the content of SF expected, {other:?} found"),
        }
    }

    /// What comes until the connection ends, and how it ends: `None` for an orderly end.
    fn rest(&mut self) -> (Vec<u8>, Option<ErrorKind>) {
        let mut found = Vec::new();
        let end = self.read_to_end(&mut found).err();
        (found, end.map(|error| error.kind()))
    }

    /// Whether the connection has ended.
    fn has_ended(&mut self) -> bool {
        matches!(self.rest().1, None | Some(ErrorKind::ConnectionReset))
    }
}

impl<S: Read + Write + ?Sized> Host for S {}

/// A conversation without pauses.
pub(crate) fn unhurried() -> Conversation {
    Conversation::new(Options {
        pause: Duration::ZERO,
        ..Options::with_stx()
    })
}

/// Sends what a conversation has to send and reads until its next event. No byte after it is read.
fn converse(stream: &mut (impl Read + Write + ?Sized), host: &mut Conversation) -> Event {
    loop {
        if let Some(bytes) = host.poll_transmit(Duration::ZERO) {
            stream.write_all(&bytes).unwrap();
        }
        if let Some(event) = host.poll_event() {
            return event;
        }
        let mut byte = [0];
        stream
            .read_exact(&mut byte)
            .unwrap_or_else(|error| panic!("{error} instead of {}", host.expected()));
        host.receive(Duration::ZERO, &byte);
    }
}
