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
//! use ts3100_controller::{Bytes, Config, Controller, Dialect, Input, Output, Port, Time};
//! let mut robot = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
//! robot.feed(Time::ZERO, Input::Connected { port: Port::Ip0, peer: "a test".into() });
//! let bytes = Bytes::from_static(b"\x02SO\r\x03");
//! let outputs = robot.feed(Time::from_millis(1), Input::Received { port: Port::Ip0, bytes });
//! assert!(outputs.contains(&Output::Send { port: Port::Ip0, bytes: Bytes::from_static(b"\x02OK\r\x03") }));
//! ```

// A new variant of an enum of ours is met at every place that tells them apart.
#![cfg_attr(not(test), warn(clippy::wildcard_enum_match_arm))]
#![no_std]
#[macro_use]
extern crate alloc;
#[macro_use]
extern crate serde;
#[cfg(test)]
extern crate std;

pub mod action;
mod action_error;
mod action_text;
pub mod alarm;
mod arm;
mod asked_command;
mod check;
pub mod command_coverage;
mod condition;
mod condition_text;
mod context;
mod controller;
pub mod controls;
mod drive;
mod endpoint;
pub mod event_form;
mod executor;
pub mod faults;
mod finding;
pub mod findings;
pub mod input;
pub mod inspection;
mod io;
pub mod limits;
mod listed;
mod maintenance;
pub mod model;
pub mod motion;
mod network;
mod ops;
pub mod options;
mod outcome;
pub mod output;
mod outputs;
pub mod panel;
mod parameters;
pub mod pendant_pages;
mod persistence;
pub mod port;
mod port_facts;
mod prelude;
pub mod queries;
mod refusal;
mod robot;
mod segment;
mod serde_form;
mod serial_line;
mod snapshot;
mod snapshot_error;
pub mod statement_coverage;
mod text_form;
pub mod time;
pub mod told;
pub mod variation;
pub mod watched;

pub use action::{Accepted, Action, ActionError, ActionErrorKind, IoKind};
pub use action_text::{ActionParseError, action_forms};
pub use arm::{ArmPose, Frames, PATH_POINTS};
pub use bytes::Bytes;
pub use command_coverage::CommandCoverage;
pub use condition::{Condition, ConditionWatch};
pub use condition_text::{CONDITION_FORMS, ConditionForm, ConditionParseError};
pub use controller::Controller;
pub use controls::PanelAction;
pub use drive::{DriveError, PersistError};
pub use findings::{Findings, Rule, Severity};
pub use input::{By, ControlRight, Input, KeySwitch};
pub use io::line_names::line_name;
pub use io::signals;
pub use network::{ChannelConfig, NetworkConfig};
pub use options::{Config, ControllerType, Dialect, Misprint, Options, Permissions};
pub use output::{Event, Output, Verdict};
pub use port::Port;
pub use refusal::SelectError;
pub use serial_line::{HostEnd, HostSettings};
pub use snapshot::{SNAPSHOT_FORMAT, SNAPSHOT_VERSION, Snapshot, SnapshotHeader};
pub use snapshot_error::SnapshotError;
pub use statement_coverage::StatementCoverage;
pub use time::Time;
pub use ts3100_proto::command::RunMode;
pub use watched::Watched;
