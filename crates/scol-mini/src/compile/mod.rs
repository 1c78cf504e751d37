//! skeleton
use alloc::sync::Arc;
use alloc::vec::Vec;

use crate::diagnostic::Diagnostic;
use crate::options::LanguageOptions;
use crate::program::Program;

/// What became of a source.
#[derive(Debug, Clone, PartialEq)]
pub struct Compilation {
    /// The program; `None` exactly when there is an error among the diagnostics.
    pub program: Option<Arc<Program>>,
    /// Errors and warnings in the order of the source.
    pub diagnostics: Vec<Diagnostic>,
}

/// Compiles a file.
#[must_use]
pub fn compile(_source: &str, options: &LanguageOptions) -> Compilation {
    Compilation { program: Some(Program::empty(options)), diagnostics: Vec::new() }
}

/// Compiles one statement.
///
/// # Errors
/// Diagnostics.
pub fn compile_direct(_statement: &str, base: &Program) -> Result<Arc<Program>, Vec<Diagnostic>> {
    Ok(Program::empty(base.options()))
}
