//! The selected file: SL, RS,SEL and the selection at the start. `scheduler` runs it.

use crate::executor::{Breakpoints, Executor};
use crate::output::Event;
use crate::prelude::*;
use crate::robot::Robot;
use crate::time::Time;
use alloc::sync::Arc;
use scol_mini::{
    AccessError, Diagnostic, Memory, Program, Severity, Value, compile_direct, restore_values, rewrite_value,
};
use ts3100_proto::name::{FileName, NameError, VariableName};

/// Why a file was not selected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
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

/// The selected file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Selected {
    /// Its name.
    pub(super) name: String,
    /// Its text.
    pub(super) source: String,
    /// Its program.
    #[serde(skip, default = "super::no_program")]
    pub(super) program: Arc<Program>,
    /// Its data.
    pub(super) memory: Memory,
    /// The file was downloaded anew; the next start takes it (CMD-DL-07).
    pub(super) stale: bool,
}

impl Selected {
    /// Its name.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// The file was downloaded anew since it was selected.
    pub(crate) fn is_stale(&self) -> bool {
        self.stale
    }

    /// Its text with another initial value for a variable.
    ///
    /// # Errors
    /// See [`AccessError`].
    pub(crate) fn rewritten(&self, variable: &VariableName, value: &Value) -> Result<String, AccessError> {
        let VariableName { name, subscripts } = variable;
        // What a variable of no declared kind takes depends on what it holds.
        let mut memory = self.memory.clone();
        memory.set_global(&self.program, name, subscripts, value.clone())?;
        rewrite_value(&self.source, &self.program, name, subscripts, value)
    }

    /// Its text with the present values of these variables as initial values; none: of all.
    ///
    /// # Errors
    /// See [`AccessError`].
    pub(crate) fn restored(&self, names: &[String]) -> Result<String, AccessError> {
        restore_values(&self.source, &self.program, &self.memory, names)
    }
}

impl Executor {
    /// Takes the selected file as it was rewritten with another initial value (MW, RESTORE). Its tasks go on in the new program,
    /// so that their lines are lines of the file (SF-24).
    pub(crate) fn take_rewritten(&mut self, source: String, program: Arc<Program>) {
        let tasks = self.main.iter_mut().chain(self.tasks.values_mut());
        tasks.for_each(|task| task.relocate(&program));
        if let Some(direct) = &mut self.direct
            && let Ok(program) = compile_direct(&direct.statement, &program)
        {
            direct.task.relocate(&program);
        }
        if let Some(selected) = &mut self.selected {
            // Lines are found by way of the old program, which is replaced last.
            let old = &selected.program;
            self.motion_line = old.line_in(&program, self.motion_line);
            self.breakpoints.relocate(|line| old.line_in(&program, line));
            selected.source = source;
            selected.memory.relocate(&program);
            selected.program = program;
        }
    }

    /// The selected file.
    pub(crate) fn selected(&self) -> Option<&Selected> {
        self.selected.as_ref()
    }

    /// Name of the selected file, empty if none.
    pub(crate) fn file(&self) -> &str {
        self.selected.as_ref().map_or("", Selected::name)
    }

    /// A variable of GLOBAL or DATA of the selected file.
    ///
    /// # Errors
    /// See [`AccessError`].
    pub(crate) fn global(&self, variable: &VariableName) -> Result<Value, AccessError> {
        let VariableName { name, subscripts } = variable;
        self.memory().global(self.program(), name, subscripts)
    }

    /// The variable of GLOBAL or DATA becomes this.
    ///
    /// # Errors
    /// See [`AccessError`].
    pub(crate) fn set_global(&mut self, variable: &VariableName, value: Value) -> Result<(), AccessError> {
        let VariableName { name, subscripts } = variable;
        let program = Arc::clone(self.program());
        self.memory_mut().set_global(&program, name, subscripts, value)
    }

    /// A file was downloaded: if it is the selected one, the next start takes it (CMD-DL-07).
    pub(crate) fn mark_stale(&mut self, name: &str, now: Time) {
        if let Some(selected) = self.selected.as_mut().filter(|selected| selected.name == name) {
            selected.stale = true;
            if !self.program_runs() {
                self.rewind(now);
            }
        }
    }
}

impl Robot {
    /// Selects the file, which must compile; the program stands at its first step then.
    ///
    /// # Errors
    /// See [`SelectError`].
    pub(crate) fn select_file(&mut self, name: &FileName) -> Result<(), SelectError> {
        if self.executor.is_running() {
            return Err(SelectError::Running);
        }
        let (source, program) = self.compile_file(name)?;
        let memory = Memory::new(&program);
        // The same file selected again, or downloaded anew, keeps its breakpoints.
        if self.executor.file() != name.as_str() {
            self.executor.breakpoints = Breakpoints::default();
        }
        let name = name.as_str().to_string();
        self.context.outputs.event(Event::Selected(Some(name.clone())));
        self.executor.selected = Some(Selected {
            name,
            source,
            program,
            memory,
            stale: false,
        });
        self.executor.rewind(self.context.now);
        Ok(())
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

    /// A file that was downloaded anew since it was selected is taken now.
    ///
    /// # Errors
    /// See [`SelectError`].
    pub(crate) fn renew_stale(&mut self) -> Result<(), SelectError> {
        let stale = self.stale_file()?;
        stale.map_or(Ok(()), |name| self.select_file(&name))
    }

    /// The selected file, if it was downloaded anew since.
    fn stale_file(&self) -> Result<Option<FileName>, NameError> {
        let stale = self.executor.selected().filter(|selected| selected.is_stale());
        stale.map(|stale| FileName::parse(stale.name())).transpose()
    }

    /// No file is selected any more (RS,SEL).
    pub(crate) fn deselect(&mut self) {
        self.executor.selected = None;
        self.executor.breakpoints = Breakpoints::default();
        self.executor.rewind(self.context.now);
        self.context.outputs.event(Event::Selected(None));
    }
}

/// Diagnostics with carets, one below the other.
pub(crate) fn render<'a>(found: impl Iterator<Item = &'a Diagnostic>, source: &str, name: &str) -> String {
    let rendered: Vec<String> = found.map(|found| found.render(source, name)).collect();
    rendered.join("\n")
}
