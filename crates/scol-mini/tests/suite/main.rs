//! The tests of the language from outside, in one program: fixtures, examples of the manual, DATA, statements of DO,
//! snapshots, broken input.

mod common;
mod data;
mod direct;
mod examples;
mod fixtures;
mod mutations;
mod snapshot;
mod vectors;
