//! Files of the editor, and whether one of them shows the text that runs.
//!
//! A recording and a running emulator have a text of their own. A file with other statements would show other lines, so the text
//! that runs is shown instead of it, and breakpoints of the file are not set.

use super::{Launched, Launcher, Origin, Refusal, SOURCE, Server, Source};
use serde_json::{Value, json};
use std::ffi::OsStr;
use std::path::Path;

impl<L: Launcher> Server<L> {
    /// Compares the file of the editor again: it can change, and so can the text that runs. The console says what differs.
    pub(super) fn look_at_file(&mut self) {
        let Some(launched) = &self.launched else { return };
        let Some(path) = launched.path.clone() else { return };
        let compared = self.compare(launched, &path, &launched.debuggee.source());
        if let Err(reason) = &compared
            && self.compared != compared
        {
            self.console(&format!("warning: {}: {reason}\n", path.display()));
        }
        self.compared = compared;
    }

    /// Whether a file shows the text that runs; a file that cannot be read is taken for it.
    fn compare(&self, launched: &Launched, path: &Path, source: &Source) -> Result<(), Refusal> {
        let text = self.launcher.text(path).filter(|_| !source.text.is_empty());
        let line = text.and_then(|text| scol_mini::first_difference(&text, &source.text));
        let Some(line) = line else { return Ok(()) };
        let name = &source.name;
        let reason = match launched.origin {
            Origin::Program => {
                format!("line {line} differs from the program that was started; start it again")
            }
            _ if !self.launcher.is_named(path, name) => return Err(other(name)),
            Origin::Recording => {
                format!("line {line} differs from the recorded {name}; open the file as it was recorded")
            }
            Origin::Robot => {
                format!("line {line} differs from {name} on the robot; put the file on its RAM drive")
            }
        };
        Err(Refusal::new(format!(
            "{reason}, or set breakpoints in the text that is shown"
        )))
    }

    /// Whether a source of the editor is the program. The first file that has its name and its text is, where none was named.
    ///
    /// # Errors
    /// Why breakpoints in it stop nothing.
    pub(super) fn recognize(&mut self, source: &Value) -> Result<(), Refusal> {
        if source.get("sourceReference").and_then(Value::as_i64) == Some(SOURCE) {
            return Ok(());
        }
        self.look_at_file();
        let running = self.debuggee()?.source();
        let Some(launched) = &self.launched else {
            return Err(other(&running.name));
        };
        let path = source.get("path").and_then(Value::as_str).map(Path::new);
        let path = path.ok_or_else(|| other(&running.name))?;
        if let Some(own) = &launched.path {
            if is_same_file(path, own) {
                return self.compared.clone();
            }
            if self.compared.is_ok() {
                return Err(other(&running.name));
            }
        }
        if !self.launcher.is_named(path, &running.name) {
            return Err(other(&running.name));
        }
        self.compare(launched, path, &running)?;
        if let Some(launched) = &mut self.launched {
            launched.path = Some(path.to_owned());
        }
        self.compared = Ok(());
        Ok(())
    }

    /// The source of a frame: the file of the editor, or the text that runs.
    pub(super) fn source_document(&mut self) -> Value {
        let launched = self.launched.as_ref();
        let path = launched.and_then(|launched| launched.path.clone());
        let name = self.debuggee().map(|debuggee| debuggee.source().name);
        let name = name.unwrap_or_default();
        match path.filter(|_| self.compared.is_ok()) {
            // A file with a long name is MAIN on the drive.
            Some(path) => {
                let name = path.file_name().map_or(name.into(), OsStr::to_string_lossy);
                json!({ "name": name, "path": path })
            }
            None => json!({ "name": name, "sourceReference": SOURCE }),
        }
    }
}

/// The file is not the one that runs.
fn other(name: &str) -> Refusal {
    if name.is_empty() {
        return Refusal::new("no program is selected");
    }
    Refusal::new(format!("the program that is debugged is {name}"))
}

fn is_same_file(one: &Path, other: &Path) -> bool {
    one == other
        || one
            .canonicalize()
            .is_ok_and(|one| other.canonicalize().is_ok_and(|other| one == other))
}
