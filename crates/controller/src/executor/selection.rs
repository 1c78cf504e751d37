//! Which file is executed: SL, RS,SEL and the selection at the start. What runs of it is the scheduler's.

use crate::executor::{Selected, Standstill};
use crate::output::Event;
use crate::robot::Robot;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use scol_mini::{Diagnostic, Memory, Severity};
use thiserror::Error;
use ts3100_proto::name::{FileName, NameError};

/// Why a file was not selected.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SelectError {
    /// Not a file name.
    #[error("file name: {0}")]
    Name(NameError),
    /// Not on the RAM drive.
    #[error("file {0} is not on the RAM drive")]
    Missing(String),
    /// A parameter file.
    #[error("file {0} is a parameter file, not a program")]
    Parameter(String),
    /// A program runs.
    #[error("a program is running; stop it first")]
    Running,
    /// It does not compile; the diagnostics rendered.
    #[error("file {name} has errors\n{rendered}")]
    Errors {
        /// The file.
        name: String,
        /// Its diagnostics with carets.
        rendered: String,
    },
}

impl From<NameError> for SelectError {
    fn from(error: NameError) -> SelectError {
        SelectError::Name(error)
    }
}

impl Robot {
    /// Selects the file, which must compile; the program stands at its first step then.
    ///
    /// # Errors
    /// See [`SelectError`].
    pub(crate) fn select_file(&mut self, name: &FileName) -> Result<(), SelectError> {
        let label = || name.as_str().to_string();
        if self.executor.status() == ts3100_proto::status::ExecutionStatus::Running {
            return Err(SelectError::Running);
        }
        if name.is_parameter() {
            return Err(SelectError::Parameter(label()));
        }
        let content = self
            .drive
            .get(name.as_str())
            .ok_or_else(|| SelectError::Missing(label()))?;
        let source = String::from_utf8_lossy(content).into_owned();
        let compilation = self.config.compile(&source);
        let Some(program) = compilation.program else {
            return Err(SelectError::Errors {
                name: label(),
                rendered: render(&compilation.diagnostics, &source, name),
            });
        };
        let memory = Memory::new(&program);
        self.executor.selected = Some(Selected {
            name: label(),
            source,
            program,
            memory,
            stale: false,
        });
        self.executor.rewind(self.now);
        self.event(Event::Selected(Some(label())));
        Ok(())
    }

    /// A file that was downloaded anew since it was selected is taken now.
    ///
    /// # Errors
    /// See [`SelectError`].
    pub(crate) fn renew_stale(&mut self) -> Result<(), SelectError> {
        if let Some(stale) = self.executor.selected().filter(|selected| selected.is_stale()) {
            let name = FileName::parse(stale.name())?;
            return self.select_file(&name);
        }
        Ok(())
    }

    /// No file is selected any more (RS,SEL).
    pub(crate) fn deselect(&mut self) {
        self.executor.selected = None;
        self.executor.main = None;
        self.executor.drop_tasks();
        self.executor.operation.stand(Standstill::FirstStep);
        self.event(Event::Selected(None));
    }
}

fn render(diagnostics: &[Diagnostic], source: &str, name: &FileName) -> String {
    let errors = diagnostics
        .iter()
        .filter(|diagnostic| diagnostic.severity == Severity::Error);
    errors
        .map(|diagnostic| diagnostic.render(source, name.as_str()))
        .collect::<Vec<_>>()
        .join("\n")
}
