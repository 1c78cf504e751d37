//! Statement coverage: which lines of the user files were executed, and how often.
//!
//! Statements are reported only after [`Controller::trace`](crate::Controller::trace). The emulator writes the reports.

use crate::output::{Event, Output};
use crate::prelude::*;
use alloc::collections::BTreeMap;

/// Contents of files that are told apart: a host that downloads a new program for each cycle makes many. Beyond
/// that the oldest are forgotten.
pub const MAX_VERSIONS: usize = 256;

/// One content of a user file, and how often its lines were executed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileVersion {
    /// Name of the file.
    pub name: String,
    /// Counts the contents the file has had, from 1.
    pub number: u32,
    /// The content without EOF.
    pub content: Vec<u8>,
    /// Executions by file line, from 1.
    pub lines: BTreeMap<u32, u64>,
}

/// The lines executed in a run.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StatementCoverage {
    versions: Vec<FileVersion>,
    /// The version that was selected last.
    selected: Option<usize>,
}

impl StatementCoverage {
    /// Takes note of what a controller has put out: files stored, the selection, statements.
    pub fn record(&mut self, output: &Output) {
        if let Output::Stored { name, content } = output {
            self.note_stored(name, content);
        } else if let Output::Event(Event::Selected(name)) = output {
            self.selected = name.as_deref().and_then(|name| self.latest(name));
        } else if let Output::Event(Event::Statement { line, task: 1.., .. }) = output
            && let Some(version) = self.selected.and_then(|index| self.versions.get_mut(index))
        {
            let count = version.lines.entry(*line).or_default();
            *count = count.saturating_add(1);
        }
    }

    /// A file is on the RAM drive; the same content again is not a new version.
    pub fn note_stored(&mut self, name: &str, content: &[u8]) {
        let latest = self.latest(name).and_then(|index| self.versions.get(index));
        if latest.is_some_and(|version| version.content == content) {
            return;
        }
        let number = latest.map_or(1, |version| version.number.saturating_add(1));
        if self.versions.len() >= MAX_VERSIONS {
            self.forget_oldest();
        }
        self.versions.push(FileVersion {
            name: name.to_string(),
            number,
            content: content.to_vec(),
            lines: BTreeMap::new(),
        });
    }

    /// The versions in the order in which they came.
    pub fn versions(&self) -> &[FileVersion] {
        &self.versions
    }

    /// Forgets what was executed; the files stay known.
    pub fn clear(&mut self) {
        for version in &mut self.versions {
            version.lines.clear();
        }
    }

    fn latest(&self, name: &str) -> Option<usize> {
        self.versions.iter().rposition(|version| version.name == name)
    }

    /// The oldest that is not selected.
    fn forget_oldest(&mut self) {
        let index = usize::from(self.selected == Some(0));
        if index < self.versions.len() {
            self.versions.remove(index);
            let behind = |selected: usize| selected - usize::from(selected > index);
            self.selected = self.selected.map(behind);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stored(name: &str, content: &str) -> Output {
        Output::Stored {
            name: name.to_string(),
            content: content.as_bytes().to_vec().into(),
        }
    }

    fn selected(name: &str) -> Output {
        Output::Event(Event::Selected(Some(name.to_string())))
    }

    fn statement(line: u32, task: u16) -> Output {
        let (seen, detail) = (None, None);
        Output::Event(Event::Statement {
            line,
            task,
            seen,
            detail,
        })
    }

    #[test]
    fn each_content_of_a_file_has_its_own_lines() {
        let mut executed = StatementCoverage::default();
        for output in [
            stored("A", "one"),
            selected("A"),
            statement(2, 1),
            statement(2, 2),
            // The statement of DO stands in no file.
            statement(1, 0),
            stored("A", "one"),
            stored("A", "two"),
            statement(3, 1),
            selected("A"),
            statement(4, 1),
        ] {
            executed.record(&output);
        }
        let seen: Vec<_> = executed
            .versions()
            .iter()
            .map(|version| (version.number, version.lines.clone()))
            .collect();
        let lines = |pairs: &[(u32, u64)]| pairs.iter().copied().collect::<BTreeMap<u32, u64>>();
        assert_eq!(seen, [(1, lines(&[(2, 2), (3, 1)])), (2, lines(&[(4, 1)]))]);
    }

    #[test]
    fn the_oldest_versions_are_forgotten_but_never_the_selected_one() {
        let mut executed = StatementCoverage::default();
        executed.record(&stored("KEEP", "0"));
        executed.record(&selected("KEEP"));
        for number in 0..2 * MAX_VERSIONS {
            executed.record(&stored("A", &format!("{number}")));
            executed.record(&statement(7, 1));
        }
        assert_eq!(executed.versions().len(), MAX_VERSIONS);
        let kept = &executed.versions()[0];
        assert_eq!(
            (kept.name.as_str(), kept.lines[&7]),
            ("KEEP", 2 * MAX_VERSIONS as u64)
        );
        assert_eq!(executed.versions()[1].number, MAX_VERSIONS as u32 + 2);
    }
}
