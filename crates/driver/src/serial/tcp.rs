//! A serial line as a TCP port with one client at a time: raw bytes, for which no settings are known, or an RFC 2217 access
//! server, whose client reports its settings. The RFC 2217 protocol itself is in `rfc2217`, connections are in
//! [`crate::tcp`].

use super::rfc2217::{Event, Server};
use super::unsent::Unsent;
use super::{Line, SerialError, io_error, opened};
use crate::tcp::{self, Channel, SecondConnection};
use std::net::SocketAddr;
use std::task::{Context, Poll};
use ts3100_controller::{Input, Port};
use ts3100_proto::parameter::SerialSettings;

/// A listening port and its client.
pub(super) struct TcpLine {
    port: Port,
    channel: Channel,
    /// Settings of the robot, for a server of RFC 2217.
    robot: Option<SerialSettings>,
    server: Option<Server>,
    /// Bytes off the line that the client has not been sent.
    unsent: Unsent,
    /// The client takes no bytes for a while.
    suspended: bool,
}

impl TcpLine {
    /// Listens on this address; port 0 asks for a free one. With settings of the robot it serves RFC 2217.
    pub(super) fn open(
        port: Port,
        address: SocketAddr,
        second: SecondConnection,
        robot: Option<SerialSettings>,
    ) -> Result<(TcpLine, SocketAddr), SerialError> {
        let (listener, actual) = tcp::open(address).map_err(io_error(port, "listen on", address))?;
        let line = TcpLine {
            port,
            channel: Channel::accepting(port, second, listener).for_serial_line(),
            robot,
            server: None,
            unsent: Unsent::new(port),
            suspended: false,
        };
        Ok((line, actual))
    }

    /// Sends what comes off the line, and what the access server answers, in this order. One write at a time, so that
    /// a client that does not read loses bytes and keeps its connection.
    fn flush(&mut self) {
        if self.channel.has_unsent() {
            return;
        }
        let mut bytes = Vec::new();
        if !self.suspended {
            bytes = self.unsent.take();
        }
        if let Some(server) = &mut self.server {
            server.send(&bytes);
            bytes = server.take_output();
        }
        if !bytes.is_empty() {
            // It never has many writes unsent.
            self.channel.send(bytes.into());
        }
    }

    /// Turns an event on the channel into inputs of the line.
    fn on_event(&mut self, input: Input, inputs: &mut Vec<Input>) {
        if let Input::Received { bytes, .. } = &input
            && let Some(server) = &mut self.server
        {
            let port = self.port;
            for event in server.receive(bytes) {
                match event {
                    Event::Data(bytes) => inputs.push(Input::received(port, bytes)),
                    Event::Settings(settings) => inputs.push(opened(port, settings)),
                    Event::PurgeToRobot => inputs.push(Input::SerialPurged { port }),
                    Event::PurgeToClient => drop(self.unsent.take()),
                    Event::Break => inputs.push(Input::SerialErrors { port, bytes: vec![0] }),
                    Event::Suspended(suspended) => self.suspended = suspended,
                }
            }
            return;
        }
        if let Input::Connected { .. } = input {
            self.server = self.robot.map(Server::new);
            self.unsent = Unsent::new(self.port);
            self.suspended = false;
        }
        // Whether a second client comes is no matter of a serial line.
        if !matches!(input, Input::SecondPeer { .. }) {
            inputs.push(input);
        }
    }
}

impl Line for TcpLine {
    fn poll(&mut self, most: usize, mut context: Option<&mut Context<'_>>) -> Poll<Vec<Input>> {
        loop {
            self.flush();
            // A client that does not read what it is answered is not read either.
            let unsent = self.channel.has_unsent();
            let most = if unsent { 0 } else { most };
            let Poll::Ready(events) = self.channel.poll(most, context.as_deref_mut()) else {
                // The poll has written the last bytes. Once more: this time the channel reads, and registers for waking
                // when there is nothing to read.
                if unsent && !self.channel.has_unsent() {
                    continue;
                }
                return Poll::Pending;
            };
            let mut inputs = Vec::new();
            for event in events {
                self.on_event(event, &mut inputs);
            }
            self.flush();
            if !inputs.is_empty() {
                return Poll::Ready(inputs);
            }
        }
    }

    fn send(&mut self, bytes: &[u8]) {
        self.unsent.push(bytes);
        self.flush();
    }

    fn set_robot(&mut self, robot: SerialSettings) {
        self.robot = self.robot.map(|_| robot);
        if let Some(server) = &mut self.server {
            server.set_robot(robot);
        }
    }
}
