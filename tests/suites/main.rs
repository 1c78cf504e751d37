//! The whole-system suites: hand-written transcripts, the permission tables, behaviour that takes a clock, and
//! the house rules. Unit tests stand with their crates and are not repeated here.

mod dialogue;
mod exchange;
mod house;
mod motion;
mod permissions;
mod purity;
mod status;
mod transcripts;
mod variables;
