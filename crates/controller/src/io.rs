//! Inputs and outputs of the robot besides the protocol: the digital lines, the lines that have a meaning for the
//! controller itself, the hands on some of them, and the ring buffers of INPUT. `executor` and `ops` use them.

pub mod channel;
pub(crate) mod channels;
pub mod line_names;
pub mod signals;
pub(crate) mod system_signals;
