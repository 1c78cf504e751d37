//! Parameter files: their common shape, and what is wrong in one. What the values mean for the network
//! and the serial lines is the edge's business, when they take effect is the controller's.

mod ethernet;
mod reader;
mod user;

pub use ethernet::{EthernetParameters, OpenMode};
pub use reader::{Assignment, MAX_SECTIONS, MAX_ASSIGNMENTS, ParameterFile, Section};
pub use user::{Parity, SerialLine, UserParameters};

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

/// Most problems reported of one file; further ones are dropped.
pub const MAX_PROBLEMS: usize = 32;

/// Longest piece of a file that a problem quotes, in characters.
const MAX_QUOTE: usize = 40;

/// What ends a line of a parameter file that the controller writes (option `parameter.line_end`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LineEnd {
    /// LF, as real hosts write it (hosts 1.7).
    Lf,
    /// CR, as the manual has it (RAM-05).
    Cr,
}

impl LineEnd {
    /// The byte.
    #[must_use]
    pub const fn byte(self) -> u8 {
        match self {
            LineEnd::Lf => crate::text::LF,
            LineEnd::Cr => crate::text::CR,
        }
    }
}

/// A value in a parameter file that does not take effect; the previous one stays.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParameterProblem {
    /// Tag of the section without brackets, for example `E05`; empty when it concerns the file.
    pub section: &'static str,
    /// Which value of the section, for example `IP1`; empty when there is one only.
    pub key: String,
    /// What should stand there.
    pub expected: String,
    /// What stands there.
    pub found: String,
    /// Line of the file, from 1; 0 when the value is missing.
    pub line: u32,
}

impl fmt::Display for ParameterProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.section.is_empty() {
            write!(f, "[{}] ", self.section)?;
        }
        if !self.key.is_empty() {
            write!(f, "{{{}}} ", self.key)?;
        }
        if self.line > 0 {
            write!(f, "line {}: ", self.line)?;
        }
        write!(f, "expected {}, found {}", self.expected, self.found)
    }
}

impl core::error::Error for ParameterProblem {}

/// Problems as they are found, bounded.
#[derive(Debug, Default)]
struct Problems(Vec<ParameterProblem>);

impl Problems {
    fn add(&mut self, problem: ParameterProblem) {
        if self.0.len() < MAX_PROBLEMS {
            self.0.push(problem);
        }
    }
}
