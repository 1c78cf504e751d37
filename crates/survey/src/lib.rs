//! What a controller answers where the manual leaves it open.
//!
//! A [`Probe`] is one question: what is sent, which readings of the manual the answers tell apart, and what the question
//! may do to the robot ([`Class`]). [`catalogue::probes`] has them all. [`survey`] asks a controller through a [`Peer`],
//! [`Report`] is the file with the answers, [`passive`] finds the same answers in recorded texts. [`ledger`] counts what
//! is known.

pub mod catalogue;
mod delays;
mod forms;
pub mod ledger;
pub mod passive;
mod peer;
mod probe;
mod report;
mod run;
mod session;

pub use peer::{Connection, Peer, PeerError, SerialPeer, TcpPeer};
pub use probe::{Ask, Class, Probe, Verdict};
pub use report::{Answer, Comparison, Difference, MAX_REPORT, Report, ReportError, compare};
pub use run::{Plan, survey};
pub use session::{ProbeError, Reply};
