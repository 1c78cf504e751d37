//! USER.PAR: section [U06], the serial lines (manual 2.3). The real file has further sections, which other
//! manuals describe: they are left alone. Setting the lines is the edge's business.

use super::{LineEnd, ParameterProblem};
use alloc::vec::Vec;

/// Parity of a serial line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Parity {
    /// 0: without.
    None,
    /// 1: odd.
    Odd,
    /// 2: even.
    Even,
}

/// One serial line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SerialLine {
    /// Speed in bit/s: 1200, 2400, 4800, 9600, 19200, 38400; on HOST also 115200.
    pub speed: u32,
    /// Character length in bits, 7 or 8.
    pub length: u8,
    /// Parity.
    pub parity: Parity,
    /// Stop bits, 1 or 2.
    pub stop: u8,
}

/// What the controller reads of USER.PAR.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct UserParameters {
    /// `{COM1}`.
    pub com1: SerialLine,
    /// `{HOST}`.
    pub host: SerialLine,
}

impl UserParameters {
    /// The values the manual lists: 9600 8 0 1 for both (PAR-U06-02).
    #[must_use]
    pub fn factory() -> UserParameters {
        let line = SerialLine { speed: 9600, length: 8, parity: Parity::None, stop: 1 };
        UserParameters { com1: line, host: line }
    }

    /// The file of a fresh RAM drive.
    #[must_use]
    pub fn factory_text(line_end: LineEnd) -> Vec<u8> {
        UserParameters::factory().text(line_end)
    }

    /// These values as a file, comments and `[END]` included, EOF not.
    #[must_use]
    pub fn text(&self, line_end: LineEnd) -> Vec<u8> {
        let _ = line_end;
        Vec::new()
    }

    /// Reads a file. A line whose values are bad or missing stays as in `previous` (PAR-U06-06); each is a
    /// problem.
    #[must_use]
    pub fn parse(content: &[u8], previous: &UserParameters) -> (UserParameters, Vec<ParameterProblem>) {
        let _ = content;
        (*previous, Vec::new())
    }
}
