//! The serial lines HOST and COM1 as [U06] sets them: what the edge is to open, and what seven data bits do
//! to the bytes (SER-01, SER-02, SER-10). Speed, parity and pacing are the edge's.

use crate::Controller;
use crate::port::Port;
use alloc::vec::Vec;
use ts3100_proto::parameter::SerialLine;

/// Data bits at which the top bit of a byte does not travel.
const SEVEN_BITS: u8 = 7;
/// What remains of a byte then.
const SEVEN_BIT_MASK: u8 = 0x7F;

impl Controller {
    /// Settings of a serial port as of the last power-on; `None` for the Ethernet channels.
    #[must_use]
    pub fn serial_line(&self, port: Port) -> Option<SerialLine> {
        match port {
            Port::Host => Some(self.user.host),
            Port::Com1 => Some(self.user.com1),
            Port::Ip0 | Port::Ip1 | Port::Ip2 | Port::Ip3 => None,
        }
    }

    /// The bytes as they come through the line of this port, in either direction.
    pub(crate) fn through_line(&self, port: Port, bytes: Vec<u8>) -> Vec<u8> {
        match self.serial_line(port) {
            Some(line) if line.length == SEVEN_BITS => {
                bytes.into_iter().map(|byte| byte & SEVEN_BIT_MASK).collect()
            }
            _ => bytes,
        }
    }
}
