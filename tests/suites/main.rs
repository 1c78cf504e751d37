//! The whole-system suites: hand-written transcripts, the permission tables, behaviour in virtual time, and the house
//! rules.
//!
//! Unit tests are in their crates and are not repeated here. A suite begins with what it tests and where its neighbours
//! are. `ts3100_tests::Robot` is a controller in virtual time; `embedded` and `control` start emulators in this process,
//! `binary` starts the program itself.

#![expect(
    clippy::panic,
    clippy::unwrap_used,
    reason = "what does not hold in a helper of the suites fails the test"
)]

mod acceleration;
mod alarms;
mod arches;
mod architecture;
mod binary;
mod book;
mod control;
mod cookbook;
mod coverage;
mod cycles;
mod docs;
mod effects;
mod embedded;
mod events;
mod exchange;
mod extensions;
mod faults;
mod field_bus;
mod findings;
mod four_axes;
mod fuzzing;
mod house;
mod jogging;
mod kinematics;
mod language;
mod maintenance;
mod manual_clauses;
mod master_mode;
mod measured_times;
mod models;
mod motion;
mod mutants;
mod network;
mod old_names;
mod options;
mod pass_and_pause;
mod permissions;
mod pieces;
mod polling_independence;
mod ports;
mod power;
mod print_input;
mod profile;
mod programs;
mod prose;
mod purity;
mod replay;
mod resets;
mod scara_edition;
mod serial;
mod settings;
mod signals;
mod simulation;
mod snapshot_files;
mod snapshots;
mod status;
mod strings;
mod survey;
mod text_end;
mod transcripts;
mod variables;
mod view;
mod wire;
mod wireshark;
mod words;
