//! Inputs and outputs of the robot besides the protocol: the digital lines, the lines that have a meaning for the
//! controller itself, and the ring buffers of INPUT. `robot` and `ops` use them; `robot::system_signals` has the effect of a
//! system signal.

pub mod channel;
pub(crate) mod channels;
pub mod line_names;
pub mod signals;
