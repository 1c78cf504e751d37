//! skeleton
use alloc::sync::Arc;

use crate::memory::Memory;
use crate::program::Program;
use crate::request::{Answer, Fault, Inputs, Pause, Request};

/// A running program.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    program: Arc<Program>,
}

impl Machine {
    /// Stands before step 1 of the main program.
    #[must_use]
    pub fn main(program: Arc<Program>) -> Self {
        Self { program }
    }
    /// Stands before the statement of `compile_direct`.
    #[must_use]
    pub fn direct(program: Arc<Program>) -> Self {
        Self { program }
    }
    /// Runs.
    pub fn run(&mut self, _memory: &mut Memory, _inputs: &dyn Inputs, _fuel: &mut u32) -> Pause {
        Pause::Ended
    }
    /// Answers the pending request.
    ///
    /// # Errors
    /// Fault.
    pub fn answer(&mut self, _memory: &mut Memory, _answer: Answer) -> Result<(), Fault> {
        Ok(())
    }
    /// Back to step 1.
    pub fn restart(&mut self) {}
    /// To the label RCYCLE.
    pub fn go_to_rcycle(&mut self) -> bool {
        false
    }
    /// File line.
    #[must_use]
    pub fn line(&self) -> u32 {
        self.program.first_line()
    }
    /// Abandons the statement under way.
    pub fn skip(&mut self) {}
    /// The pending request.
    #[must_use]
    pub fn pending(&self) -> Option<&Request> {
        None
    }
}
