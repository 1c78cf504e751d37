//! A controller put in the place of another: who is on its lines. The edge keeps its links; what the newcomer knew of
//! its own peers is gone as with a cable that was cut, and those that are there now are met as new ones.

use crate::Controller;
use crate::port::Port;
use crate::serial_line::SerialLine;

impl Controller {
    /// Takes over the peers of the controller that was here before, and what the edge records of it.
    pub fn adopt_peers(&mut self, before: &Controller) {
        self.traced = before.traced;
        for port in Port::ALL {
            let there = before.peer(port);
            let knew = self.peer(port).is_some();
            if knew && self.jogging == Some(port) {
                self.stop_jog();
            }
            if let Some(line) = self.lines.get_mut(&port) {
                // How the far end is opened is the edge's knowledge.
                *line = SerialLine {
                    host: before.lines.get(&port).map(|line| line.host).unwrap_or_default(),
                    ..SerialLine::default()
                };
            }
            match there {
                Some(peer) => {
                    if let Some(channel) = self.channels.get_mut(&port) {
                        channel.disconnect_peer();
                    }
                    self.connected(port, alloc::string::String::from(peer));
                }
                None if knew => self.disconnected(port),
                None => {}
            }
        }
        self.settle();
    }

    /// The peer of a port, while there is one.
    #[must_use]
    pub fn peer(&self, port: Port) -> Option<&str> {
        let session = self.sessions.get(&port).map(|session| &session.peer);
        let channel = self.channels.get(&port).map(|channel| &channel.peer);
        session.or(channel)?.as_deref()
    }
}
