//! Which file is executed: SL, RS,SEL and the selection at the start. The selected file itself is `executor::selection`.

use crate::executor::selection::{Selected, render};
use crate::output::Event;
use crate::prelude::*;
use crate::refusal::SelectError;
use crate::robot::Robot;
use alloc::sync::Arc;
use scol_mini::{Program, Severity, compile_call};
use ts3100_proto::name::{FileName, NameError};

impl Robot {
    /// Selects the file, which must compile, and sets its first step.
    ///
    /// # Errors
    /// See [`SelectError`].
    pub(crate) fn select_file(&mut self, name: &FileName) -> Result<(), SelectError> {
        if self.executor.is_running() {
            return Err(SelectError::Running);
        }
        let (source, program) = self.compile_file(name)?;
        self.take_selected(name, source, program);
        Ok(())
    }

    /// Selects the file to run one call of its programs instead of the main program.
    ///
    /// # Errors
    /// See [`SelectError`].
    pub(crate) fn select_call(&mut self, name: &FileName, call: &str) -> Result<(), SelectError> {
        if self.executor.is_running() {
            return Err(SelectError::Running);
        }
        let (source, program) = self.compile_file(name)?;
        let program = compile_call(call, &program).map_err(|found| SelectError::Errors {
            name: name.as_str().to_string(),
            rendered: render(found.iter(), call, "the call"),
        })?;
        self.take_selected(name, source, program);
        Ok(())
    }

    fn take_selected(&mut self, name: &FileName, source: String, program: Arc<Program>) {
        let name = name.as_str().to_string();
        self.context.outputs.event(Event::Selected(Some(name.clone())));
        let selected = Selected::new(name, source, program);
        self.executor.select(selected, self.context.now);
    }

    /// The text and the program of a file of the drive.
    fn compile_file(&self, name: &FileName) -> Result<(String, Arc<Program>), SelectError> {
        let label = || name.as_str().to_string();
        if name.is_parameter() {
            return Err(SelectError::Parameter(label()));
        }
        let content = self.drive.get(name.as_str());
        let content = content.ok_or_else(|| SelectError::Missing(label()))?;
        let source = String::from_utf8_lossy(content).into_owned();
        let compilation = self.context.config.compile(&source);
        if let Some(program) = compilation.program {
            return Ok((source, program));
        }
        let found = compilation.diagnostics.iter();
        let errors = found.filter(|found| found.severity == Severity::Error);
        let (name, rendered) = (label(), render(errors, &source, name.as_str()));
        Err(SelectError::Errors { name, rendered })
    }

    /// The program that the next start runs, compiled from the file on the drive (CMD-DL-07).
    ///
    /// # Errors
    /// See [`SelectError`].
    pub(crate) fn next_program(&self) -> Result<Arc<Program>, SelectError> {
        match self.stale_file()? {
            Some(name) => Ok(self.compile_file(&name)?.1),
            None => Ok(Arc::clone(self.executor.program())),
        }
    }

    /// Takes the new content of a file that was downloaded again since it was selected.
    ///
    /// # Errors
    /// See [`SelectError`].
    pub(crate) fn renew_stale(&mut self) -> Result<(), SelectError> {
        let stale = self.stale_file()?;
        stale.map_or(Ok(()), |name| self.select_file(&name))
    }

    /// The selected file, if it was downloaded again since.
    fn stale_file(&self) -> Result<Option<FileName>, NameError> {
        let stale = self.executor.selected().filter(|selected| selected.is_stale());
        stale.map(|stale| FileName::parse(stale.name())).transpose()
    }

    /// No file is selected any more (RS,SEL).
    pub(crate) fn deselect(&mut self) {
        self.executor.deselect(self.context.now);
        self.context.outputs.event(Event::Selected(None));
    }
}
