//! The bodies of the fuzz targets: each takes the bytes that a peer or a file could say, and panics if what must hold does
//! not.
//!
//! `fuzz_targets/` gives them to libFuzzer; `tests/suites/fuzzing.rs` includes this file and replays `corpus/` in
//! `cargo test`. `README.md` lists the targets; `shared` is what several of them use.

pub mod canary;
pub mod cell;
pub mod control;
pub mod dap;
pub mod front;
pub mod lsp;
pub mod parameters;
pub mod program_test;
pub mod protocol;
pub mod recording;
pub mod rfc2217;
pub mod run;
mod shared;
pub mod snapshot;
pub mod survey;
pub mod trace;
