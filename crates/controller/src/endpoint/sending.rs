//! Texts and bytes on their way out: framed like the host's last text, then passed through faults and variation.
//!
//! `exchange` and `ops` decide what is answered. `send_queue` holds what leaves later, `serial_lines` what takes time on the
//! line.

use crate::endpoint::Endpoints;
use crate::faults::InjectionPoint;
use crate::faults::kind::{Effect, FaultSite, Segment};
use crate::limits::MAX_SEND;
use crate::output::Event;
use crate::port::Port;
use crate::robot::Robot;
use crate::time::Time;
use crate::variation::Variation;
use alloc::vec::Vec;
use bytes::Bytes;
use core::time::Duration;
use ts3100_proto::reply::Reply;
use ts3100_proto::text::{Framing, encode_text};

impl Endpoints {
    /// Sends a text of the command that is being served.
    pub(crate) fn send_text(&mut self, robot: &mut Robot, port: Port, data: &[u8]) {
        let Some(session) = self.sessions.get(&port) else {
            return;
        };
        let (asked, block) = (session.asked, session.block);
        let delay = self.variation.as_mut().map(Variation::reply_delay);
        self.send_as(robot, port, data, (asked, block), delay.unwrap_or_default());
    }

    /// Sends a text that nobody has asked for: SP.
    pub(crate) fn send_unsolicited(&mut self, robot: &mut Robot, port: Port, data: &[u8]) {
        self.send_as(robot, port, data, ("SP", 0), Duration::ZERO);
    }

    /// Sends a text in the form of the host's last one.
    fn send_as(
        &mut self,
        robot: &mut Robot,
        port: Port,
        data: &[u8],
        (command, block): (&str, u32),
        delay: Duration,
    ) {
        let checksum = robot.config.options.text.checksum;
        let Some(session) = self.sessions.get(&port).filter(|session| session.peer.is_some()) else {
            return;
        };
        let framing: Framing = session.framing;
        let bytes: Vec<u8> = encode_text(data, framing, checksum);
        debug_assert!(bytes.len() <= MAX_SEND);
        robot.event(Event::TextOut {
            port,
            framing,
            data: Bytes::copy_from_slice(data),
        });
        let site = FaultSite {
            point: InjectionPoint::Reply,
            port,
            command,
            block,
            bytes: &bytes,
            data,
        };
        let sent = self.leave(robot, &site, delay);
        if let Some(session) = self.sessions.get_mut(&port) {
            session.sent_at = Some(sent);
            session.history.unsolicited_sp_sent = data == Reply::Sp.encode();
            if matches!(Reply::parse(data), Ok(Reply::Ok | Reply::Ng)) {
                session.replied_at = Some(sent);
            }
        }
    }

    /// Bytes of PRINT leave.
    pub(crate) fn send_bytes(&mut self, robot: &mut Robot, port: Port, bytes: &[u8]) {
        let site = FaultSite {
            point: InjectionPoint::Print,
            port,
            command: "",
            block: 0,
            bytes,
            data: bytes,
        };
        self.leave(robot, &site, Duration::ZERO);
    }

    /// Something leaves, as faults and variation make it. Returns when the last of it has left.
    fn leave(&mut self, robot: &mut Robot, site: &FaultSite<'_>, delay: Duration) -> Time {
        let port = site.port;
        if self.faults.is_stalled(port) {
            return robot.now;
        }
        let segments = match (self.apply_fault(robot, site), &mut self.variation) {
            (Effect::Lost, _) => return robot.now,
            (Effect::ReplaceOutput(segments), _) => segments,
            (_, Some(variation)) => variation.segments(delay, site.bytes),
            (_, None) => [Segment::bytes(site.bytes.to_vec())].into(),
        };
        self.enqueue(robot, port, segments)
    }
}
