//! The whole-system suites: hand-written transcripts, the permission tables, behaviour that takes a clock, and
//! the house rules. Unit tests stand with their crates and are not repeated here.

#![expect(
    clippy::panic,
    clippy::unwrap_used,
    reason = "what does not hold in a helper of the suites fails the test"
)]

mod courses;
mod coverage;
mod dialogue;
mod docs;
mod effects;
mod exchange;
mod extended;
mod faults;
mod findings;
mod four_axes;
mod guiding;
mod house;
mod kinematics;
mod language;
mod lines;
mod maintenance;
mod measured;
mod motion;
mod network;
mod options;
mod overlooked;
mod permissions;
mod programs;
mod proofs;
mod purity;
mod recordings;
mod scara_edition;
mod serial;
mod settings;
mod signals;
mod simulation;
mod snapshot_files;
mod snapshots;
mod status;
mod transcripts;
mod variables;
mod wire;
