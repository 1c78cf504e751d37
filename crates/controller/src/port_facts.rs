//! Facts about the ports for programs: when a line has room. The channels of the robot know whether a peer is
//! connected.

use crate::port::Port;
use crate::time::Time;

/// The ports, as a program sees them.
pub(crate) trait PortFacts {
    /// When the robot's buffer of a serial line will have room for this many bytes more; `None` if it has.
    fn line_free_at(&self, port: Port, bytes: usize) -> Option<Time>;
}
