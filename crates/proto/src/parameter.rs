//! Parameter files (`.PAR`): their common syntax, and reports about values that do not take effect.
//!
//! [`EthernetParameters`], [`UserParameters`] and [`parse_strings`] are the three files the controller reads. Opening
//! sockets and serial ports is left to the emulator, and when new values take effect to the controller. Start with
//! [`ParameterFile`], the tolerant reader below the first two.

mod ethernet;
mod reader;
mod strings;
mod user;

pub use ethernet::{EthernetParameters, OpenMode};
pub use reader::{Assignment, MAX_ASSIGNMENTS, MAX_SECTIONS, ParameterFile, Section};
pub use strings::{MAX_STRING, MAX_STRINGS, StringRow, parse_strings};
pub use user::{Edition, Parity, SerialSettings, StringRule, UserParameters};

use crate::prelude::*;
use crate::text::{CR, LF};
use core::fmt;

/// Most problems reported of one file; further ones are dropped.
pub const MAX_PROBLEMS: usize = 32;

/// Longest piece of a file that a problem quotes, in characters.
const MAX_QUOTE: usize = 40;

/// Line end of the parameter files that the controller writes (option `parameter.line_end`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum LineEnd {
    /// LF, as real hosts write it (hosts 1.7).
    Lf,
    /// CR, as the manual has it (RAM-05).
    Cr,
}

impl LineEnd {
    /// LF or CR as a byte.
    pub const fn byte(self) -> u8 {
        match self {
            LineEnd::Lf => LF,
            LineEnd::Cr => CR,
        }
    }
}

/// A value in a parameter file that does not take effect; the previous one stays.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParameterProblem {
    /// Tag of the section without brackets, for example `E05`; empty when it concerns the file.
    pub section: &'static str,
    /// Which value of the section, for example `IP1`; empty when there is one only.
    pub key: String,
    /// The values that are allowed.
    pub expected: String,
    /// The value found, in backquotes; `nothing` if it is missing.
    pub found: String,
    /// Line of the file, from 1; 0 when the value is missing.
    pub line: u32,
}

impl fmt::Display for ParameterProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.section.is_empty() {
            write!(f, "[{}] ", self.section)?;
        }
        if !self.key.is_empty() {
            write!(f, "{{{}}} ", self.key)?;
        }
        if self.line > 0 {
            write!(f, "line {}: ", self.line)?;
        }
        write!(f, "expected {}, found {}", self.expected, self.found)
    }
}

impl core::error::Error for ParameterProblem {}

/// Problems as they are found, bounded.
#[derive(Debug, Default)]
struct Problems(Vec<ParameterProblem>);

impl Problems {
    fn add(&mut self, section: &'static str, key: &str, expected: &str, found: &str, line: u32) {
        if self.0.len() < MAX_PROBLEMS {
            let (key, expected, found) = (key.to_string(), expected.to_string(), quote(found));
            self.0.push(ParameterProblem {
                section,
                key,
                expected,
                found,
                line,
            });
        }
    }
}

/// A quotation from a file for a problem: cut to [`MAX_QUOTE`] and in backquotes.
fn quote(found: &str) -> String {
    match found {
        "" => String::from("nothing"),
        found => format!("`{}`", found.chars().take(MAX_QUOTE).collect::<String>()),
    }
}

/// A file that is being read, and the problems found in it so far.
struct FileValues<'a> {
    file: &'a ParameterFile,
    problems: Problems,
}

impl<'a> FileValues<'a> {
    /// No value is read yet; of the file as a whole only its size is checked.
    fn new(file: &'a ParameterFile) -> FileValues<'a> {
        let mut problems = Problems::default();
        if file.truncated {
            let expected = format!("{MAX_SECTIONS} sections of {MAX_ASSIGNMENTS} values at most");
            problems.add("", "", &expected, "more", 0);
        }
        FileValues { file, problems }
    }

    /// The only value of a section.
    fn read<T>(
        &mut self,
        section: &'static str,
        target: &mut T,
        expected: &str,
        parse: impl Fn(&str) -> Option<T>,
    ) {
        self.section(section).read(None, target, expected, parse);
    }

    /// The first section of a name; further ones are problems.
    fn section(&mut self, name: &'static str) -> SectionValues<'_> {
        let mut sections = self.file.sections.iter().filter(|section| section.tag == name);
        let section = sections.next();
        for surplus in sections {
            self.problems
                .add(name, "", "the section once", "a second one", surplus.line);
        }
        SectionValues {
            name,
            section,
            problems: &mut self.problems,
        }
    }
}

/// Reads the values of one section and reports those that are bad.
struct SectionValues<'a> {
    name: &'static str,
    section: Option<&'a Section>,
    problems: &'a mut Problems,
}

impl<'a> SectionValues<'a> {
    fn assignments(&self) -> &'a [Assignment] {
        self.section.map_or(&[], |section| &section.assignments)
    }

    /// The value of a key in braces. Without a key it is the only value of the section: there braces hold comments.
    fn read<T>(
        &mut self,
        key: Option<&str>,
        target: &mut T,
        expected: &str,
        parse: impl Fn(&str) -> Option<T>,
    ) {
        let named = |assignment: &&Assignment| key.is_none_or(|key| assignment.key == key);
        let mut assignments = self.assignments().iter().filter(named);
        let first = assignments.next();
        let key = key.unwrap_or_default();
        for surplus in assignments {
            self.problems
                .add(self.name, key, "one value", &surplus.value, surplus.line);
        }
        let (value, line) = match (first, self.section) {
            (Some(assignment), _) => (assignment.value.as_str(), assignment.line),
            (None, Some(section)) => ("", section.line),
            (None, None) => ("", 0),
        };
        match parse(value) {
            Some(value) => *target = value,
            None => self.problems.add(self.name, key, expected, value, line),
        }
    }

    /// Reports values whose key is none of `keys`.
    fn refuse_other_keys(&mut self, keys: &[&str]) {
        let assignments = self.assignments().iter();
        for assignment in assignments.filter(|assignment| !keys.contains(&assignment.key.as_str())) {
            let expected = format!("a value for {}", keys.join(", "));
            let found = format!("{{{}}}", assignment.key);
            self.problems
                .add(self.name, "", &expected, &found, assignment.line);
        }
    }
}

/// Blank-separated words, if there are exactly `N`.
fn split_words<const N: usize>(value: &str) -> Option<[&str; N]> {
    let words: Vec<&str> = value.split_whitespace().collect();
    words.try_into().ok()
}

/// A text, in which LF ends a line, with this line end.
fn with_line_end(text: &str, line_end: LineEnd) -> Vec<u8> {
    let byte = |byte| if byte == LF { line_end.byte() } else { byte };
    text.bytes().map(byte).collect()
}
