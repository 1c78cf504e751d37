//! What goes in and out of the robot besides the protocol: the digital lines, the lines that have a meaning for the
//! controller itself, the hands on some of them, and the ring buffers of INPUT. Which statement or command uses them is
//! `executor`'s and `ops`'.

pub mod channel;
pub(crate) mod channels;
pub mod line_names;
pub mod signals;
pub(crate) mod system_signals;
