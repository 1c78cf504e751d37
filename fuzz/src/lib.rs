//! The bodies of the fuzz targets: each takes the bytes that a peer or a file could say, and panics if what must hold does
//! not.
//!
//! `fuzz_targets/` gives them to libFuzzer.
//! `README.md` lists the targets; `shared` is what several of them use.

pub mod cell;
pub mod front;
pub mod parameters;
pub mod protocol;
pub mod run;
mod shared;
