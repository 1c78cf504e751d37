//! The TS3100 robot controller as a pure value.
//!
//! Bytes, panel actions and virtual time go in by [`Controller::handle`]; what is to be done outside comes
//! out of [`Controller::poll_output`], and [`Controller::poll_deadline`] says when the controller wants to
//! be called again though nothing happens. One input, drain, next; [`Controller::feed`] does both. There is
//! no socket, file, thread, clock or randomness in here: same inputs, same outputs, byte for byte.
//!
//! Text framing, commands and bodies are `ts3100-proto`'s, the robot language is `scol-mini`'s.
//!
//! ```
//! use ts3100_controller::{Config, Controller, Dialect, Input, Output, Port, Time};
//! let mut robot = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
//! robot.feed(Time::ZERO, Input::Connected { port: Port::Ip0, peer: "a test".into() });
//! let bytes = b"\x02SO\r\x03".to_vec();
//! let outputs = robot.feed(Time::from_millis(1), Input::Received { port: Port::Ip0, bytes });
//! assert!(outputs.contains(&Output::Send { port: Port::Ip0, bytes: b"\x02OK\r\x03".to_vec() }));
//! ```
#![no_std]
extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod alarm;
mod arm;
pub mod channel;
mod controller;
pub mod coverage;
pub mod deed;
pub mod display;
pub mod drive;
pub mod executed;
mod execution;
pub mod faults;
pub mod findings;
mod hand;
pub mod input;
mod inspect;
mod keeping;
pub mod limits;
pub mod line;
pub mod look;
pub mod model;
mod monitors;
pub mod motion;
pub mod network;
mod ops;
pub mod options;
mod outbox;
pub mod output;
mod panel;
mod parameters;
mod peers;
pub mod port;
mod run;
mod sending;
mod serial;
mod serve;
mod session;
mod sig;
pub mod signals;
#[cfg(feature = "serde")]
mod snapshot;
pub mod state;
mod stop;
mod talk;
mod tasks;
pub mod time;
mod upkeep;
pub mod vary;
mod view;

pub use controller::{Controller, SelectError};
pub use coverage::Coverage;
pub use deed::{Deed, Refusal, RefusalKind, Side};
pub use drive::DriveError;
pub use executed::Executed;
pub use findings::{Findings, Rule, Severity};
pub use input::{ControlRight, Input, KeySwitch, Panel};
pub use inspect::Whereabouts;
pub use line::{HostLine, HostSettings};
pub use network::{ChannelPlan, NetworkPlan};
pub use options::{Config, ControllerType, Dialect, Options};
pub use output::{Event, Output, Verdict};
pub use parameters::ParameterError;
pub use port::Port;
#[cfg(feature = "serde")]
pub use snapshot::{SNAPSHOT_FORMAT, SNAPSHOT_VERSION, Snapshot, SnapshotError, SnapshotHead};
pub use time::Time;
