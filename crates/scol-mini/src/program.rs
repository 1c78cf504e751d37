//! skeleton
use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;

use crate::options::LanguageOptions;
use crate::value::Kind;

/// A compiled file.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    options: LanguageOptions,
}

/// What is known about a variable that all programs share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VariableInfo {
    /// Its kind; `None` when the first assignment will fix it.
    pub kind: Option<Kind>,
    /// It is an array, of which only elements can be read and written.
    pub array: bool,
}

impl Program {
    /// A program without anything.
    #[must_use]
    pub fn empty(options: &LanguageOptions) -> Arc<Program> {
        Arc::new(Program { options: *options })
    }
    /// The options it was compiled with.
    #[must_use]
    pub fn options(&self) -> &LanguageOptions {
        &self.options
    }
    /// The names of the PROGRAM blocks in file order, upper case; the first is the main program.
    #[must_use]
    pub fn program_names(&self) -> Vec<String> {
        Vec::new()
    }
    /// The main program has the label `RCYCLE`.
    #[must_use]
    pub fn has_rcycle(&self) -> bool {
        false
    }
    /// File line of step 1.
    #[must_use]
    pub fn first_line(&self) -> u32 {
        1
    }
    /// A variable of GLOBAL or a name of DATA; `None` when there is no such. Case does not matter.
    #[must_use]
    pub fn variable(&self, _name: &str) -> Option<VariableInfo> {
        None
    }
}
