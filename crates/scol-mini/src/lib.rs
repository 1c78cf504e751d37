//! SCOL, the language of the robot controller: source text in, diagnostics and a compiled program out, and a
//! machine that runs the program step by step.
//!
//! The machine never does anything to the world. It stops and asks: [`Machine::run`] returns a [`Pause`], the outside
//! does what a [`Request`] wants and gives an [`Answer`]. Hosts, ports, clocks, motion, signals and files are left to
//! the driver of the machine.
//!
//! ```
//! use scol_mini::{Answer, Inputs, LanguageOptions, Machine, Memory, Pause, Position, Request, compile};
//!
//! struct Still;
//! impl Inputs for Still {
//!     fn din(&self, _: u16) -> bool { false }
//!     fn dout(&self, _: u16) -> bool { false }
//!     fn motion_percent(&self) -> f64 { 100.0 }
//!     fn here(&self) -> Position { Position::default() }
//!     fn mode(&self) -> i32 { 0 }
//! }
//!
//! let compilation = compile("PROGRAM HELLO\nPRINT COM1,\"HI\",CR\nEND\n", &LanguageOptions::default());
//! let program = compilation.program.unwrap();
//! let mut memory = Memory::new(&program);
//! let mut machine = Machine::main(program);
//! let Pause::Request(Request::Print { data, .. }) = machine.run(&mut memory, &Still, &mut 100) else { panic!() };
//! assert_eq!(data, b"HI\r");
//! machine.answer(&mut memory, Answer::Done).unwrap();
//! assert_eq!(machine.run(&mut memory, &Still, &mut 100), Pause::Ended);
//! ```

// A new variant of an enum of ours is met at every place that tells them apart.
#![cfg_attr(not(test), warn(clippy::wildcard_enum_match_arm))]
#![no_std]
extern crate alloc;
#[cfg(test)]
extern crate std;

mod builtin;
mod cell;
mod code;
mod codes;
mod compile;
mod conditions;
#[cfg(test)]
#[path = "coverage/tests.rs"]
mod coverage;
mod diagnostic;
pub mod editor;
mod fix;
mod format;
pub mod geometry;
#[cfg(test)]
#[path = "grammar/tests.rs"]
mod grammar;
mod lexer;
mod lines;
mod lint;
mod lower;
mod machine;
mod memory;
mod options;
mod outline;
mod parser;
mod points;
mod prelude;
mod probe;
mod program;
mod request;
mod rewrite;
mod snapshot;
mod suggest;
mod tree;
mod value;

pub use builtin::{WordKind, word_kind, words};
pub use codes::{DIAGNOSTICS, DiagnosticKind};
pub use compile::{Compilation, compile, compile_call, compile_direct, compile_with_points};
pub use conditions::{AXES, Accuracy, Conditions, FULL, MAX_ACCEL};
pub use diagnostic::{Diagnostic, MAX_DIAGNOSTICS, Severity, Span};
pub use fix::Edit;
pub use format::format;
pub use lint::{check, check_for, check_with_points};
pub use machine::{Effect, Jump, Local, Machine, MonitorAction, Recipient, Way};
pub use memory::{AccessError, Memory};
pub use options::{Arm, IntDivision, LanguageOptions};
pub use outline::{first_difference, input_lines, print_channels, starts_tasks};
pub use points::{PointsError, TaughtPoint, parse_points};
pub use probe::{ProbeError, split_assignment};
pub use program::{Program, STATE_VERSION, VariableInfo};
pub use request::{
    Answer, Channel, Fault, FaultKind, Inputs, MAX_PRINT, Motion, Path, Pause, Request, Robot,
};
pub use rewrite::{restore_values, rewrite_value};
pub use snapshot::RestoreError;
pub use value::{Configuration, Frame, Number, Payload, Position, Trans, Value, ValueKind};

/// Longest file the language accepts, in bytes: the size field of the protocol has five digits (RAM-03).
pub const MAX_SOURCE: usize = 99_999;
/// Longest line, in bytes without its line end: one record of a RAM file (RAM-01).
pub const MAX_LINE: usize = 252;
/// Longest statement of the host command DO, in characters: as much as a message may carry (TRN-07).
pub const MAX_DIRECT: usize = 1_024;
/// Deepest nesting of an expression or of `IF` within `IF`.
pub const MAX_EXPRESSION_NESTING: usize = 64;
/// Deepest nesting of `FOR` loops in one program.
pub const MAX_FOR_NESTING: usize = 16;
/// Deepest nesting of subprogram calls.
pub const MAX_CALL_NESTING: usize = 16;
/// Most tasks at a time, the main program counted (`MAXTASK`).
pub const MAX_TASKS: usize = 4;
/// Most monitors of `ON ... DO` of one task.
pub const MAX_MONITORS: usize = 16;
/// Most digits of `BCDIN` and `BCDOUT`.
pub const MAX_BCD_DIGITS: usize = 8;
/// Most elements of all arrays of a file together, counting subscript 0.
pub const MAX_ARRAY: usize = 20_000;
/// Most subscripts of an array.
pub const MAX_SUBSCRIPTS: usize = 4;
/// Longest name of a variable that the protocol can reach, and of a DATA name (DATA-13).
pub const MAX_DATA_NAME: usize = 10;
/// Most points of a table of taught points.
pub const MAX_POINTS: usize = 10_000;
