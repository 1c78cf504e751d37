//! The selected file: its text, its program, its data. Who selects it is in `robot::selection`.

use crate::executor::{Breakpoints, Executor};
use crate::prelude::*;
use crate::time::Time;
use alloc::sync::Arc;
use scol_mini::{
    AccessError, Diagnostic, Memory, Program, Value, compile_direct, restore_values, rewrite_value,
};
use ts3100_proto::name::VariableName;

/// The selected file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Selected {
    pub(crate) name: String,
    /// Its text.
    pub(crate) source: String,
    #[serde(skip, default = "super::no_program")]
    pub(crate) program: Arc<Program>,
    /// Its data.
    pub(crate) memory: Memory,
    /// The file was downloaded again; the next start takes the new one (CMD-DL-07).
    pub(crate) stale: bool,
}

impl Selected {
    /// A file with its text and its program; its data is as the program gives it.
    pub(crate) fn new(name: String, source: String, program: Arc<Program>) -> Selected {
        Selected {
            memory: Memory::new(&program),
            name,
            source,
            program,
            stale: false,
        }
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Whether the file was downloaded again since it was selected.
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
    /// Takes the selected file as it was rewritten with another initial value (MW, RESTORE). Its tasks continue in the
    /// new program, so that their lines are lines of the file (SF-24).
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

    /// Selects a file and sets its first step. The same file selected again, or downloaded again, keeps its
    /// breakpoints.
    pub(crate) fn select(&mut self, selected: Selected, now: Time) {
        if self.file() != selected.name {
            self.breakpoints = Breakpoints::default();
        }
        self.selected = Some(selected);
        self.rewind(now);
    }

    /// No file is selected any more.
    pub(crate) fn deselect(&mut self, now: Time) {
        self.selected = None;
        self.breakpoints = Breakpoints::default();
        self.rewind(now);
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

/// Diagnostics with carets, one below the other.
pub(crate) fn render<'a>(found: impl Iterator<Item = &'a Diagnostic>, source: &str, name: &str) -> String {
    let rendered: Vec<String> = found.map(|found| found.render(source, name)).collect();
    rendered.join("\n")
}
