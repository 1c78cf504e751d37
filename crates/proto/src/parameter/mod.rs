//! Parameter files (`.PAR`): their common syntax, and reports about values that do not take effect.
//!
//! [`EthernetParameters`] and [`UserParameters`] are the two files the controller reads. Opening sockets and serial
//! ports is left to the emulator, and when new values take effect to the controller. Start with [`ParameterFile`], the
//! tolerant reader below both.

mod ethernet;
mod reader;
mod rewrite;
mod user;

pub use ethernet::{EthernetParameters, OpenMode};
pub use reader::{Assignment, MAX_ASSIGNMENTS, MAX_SECTIONS, ParameterFile, Section};
pub use rewrite::{RewriteError, rewrite};
pub use user::{Edition, Parity, SerialSettings, UserParameters};

use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt;

/// Most problems reported of one file; further ones are dropped.
pub const MAX_PROBLEMS: usize = 32;

/// Longest piece of a file that a problem quotes, in characters.
const MAX_QUOTE: usize = 40;

/// What ends a line of a parameter file that the controller writes (option `parameter.line_end`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum LineEnd {
    /// LF, as real hosts write it (hosts 1.7).
    Lf,
    /// CR, as the manual has it (RAM-05).
    Cr,
}

impl LineEnd {
    /// LF or CR as a byte.
    #[must_use]
    pub const fn byte(self) -> u8 {
        match self {
            LineEnd::Lf => crate::text::LF,
            LineEnd::Cr => crate::text::CR,
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
        found => alloc::format!("`{}`", found.chars().take(MAX_QUOTE).collect::<String>()),
    }
}

/// Reads the values of one section and reports those that are bad.
struct SectionValues<'a> {
    name: &'static str,
    section: Option<&'a Section>,
    problems: &'a mut Problems,
}

impl<'a> SectionValues<'a> {
    /// The first section of a name; further ones are problems.
    fn new(file: &'a ParameterFile, name: &'static str, problems: &'a mut Problems) -> SectionValues<'a> {
        let mut sections = file.sections.iter().filter(|section| section.tag == name);
        let section = sections.next();
        for surplus in sections {
            problems.add(name, "", "the section once", "a second one", surplus.line);
        }
        SectionValues {
            name,
            section,
            problems,
        }
    }

    /// The only value of a section. Its key is ignored: in such sections braces hold comments.
    fn read_single<T>(&mut self, target: &mut T, expected: &str, parse: impl Fn(&str) -> Option<T>) {
        let assignments = self.section.map_or(&[][..], |section| &section.assignments);
        for surplus in assignments.iter().skip(1) {
            self.problems
                .add(self.name, "", "one value", &surplus.value, surplus.line);
        }
        self.read_assignment(assignments.first(), "", target, expected, parse);
    }

    /// The value of a key in braces.
    fn read_keyed<T>(
        &mut self,
        key: &str,
        target: &mut T,
        expected: &str,
        parse: impl Fn(&str) -> Option<T>,
    ) {
        let assignments = self.section.map_or(&[][..], |section| &section.assignments);
        let mut assignments = assignments.iter().filter(|assignment| assignment.key == key);
        let first = assignments.next();
        for surplus in assignments {
            self.problems
                .add(self.name, key, "one value", &surplus.value, surplus.line);
        }
        self.read_assignment(first, key, target, expected, parse);
    }

    /// Reports values whose key is none of `keys`.
    fn refuse_other_keys(&mut self, keys: &[&str]) {
        let assignments = self.section.map_or(&[][..], |section| &section.assignments);
        for assignment in assignments
            .iter()
            .filter(|assignment| !keys.contains(&assignment.key.as_str()))
        {
            let expected = alloc::format!("a value for {}", keys.join(", "));
            let found = alloc::format!("{{{}}}", assignment.key);
            self.problems
                .add(self.name, "", &expected, &found, assignment.line);
        }
    }

    fn read_assignment<T>(
        &mut self,
        assignment: Option<&Assignment>,
        key: &str,
        target: &mut T,
        expected: &str,
        parse: impl Fn(&str) -> Option<T>,
    ) {
        let (value, line) = match (assignment, self.section) {
            (Some(assignment), _) => (assignment.value.as_str(), assignment.line),
            (None, Some(section)) => ("", section.line),
            (None, None) => ("", 0),
        };
        match parse(value) {
            Some(value) => *target = value,
            None => self.problems.add(self.name, key, expected, value, line),
        }
    }
}

/// Problems of the file as a whole.
fn check_size(file: &ParameterFile, problems: &mut Problems) {
    if file.truncated {
        let expected = alloc::format!("{MAX_SECTIONS} sections of {MAX_ASSIGNMENTS} values at most");
        problems.add("", "", &expected, "more", 0);
    }
}

/// A decimal number without sign.
fn number<N: core::str::FromStr>(word: &str) -> Option<N> {
    word.bytes()
        .all(|byte| byte.is_ascii_digit())
        .then(|| word.parse().ok())
        .flatten()
}

/// Blank-separated words, if there are exactly `N`.
fn split_words<const N: usize>(value: &str) -> Option<[&str; N]> {
    let mut words = value.split_whitespace();
    let mut found = [""; N];
    for word in &mut found {
        *word = words.next()?;
    }
    words.next().is_none().then_some(found)
}

/// Lines with their line end.
fn join_lines(lines: &[String], line_end: LineEnd) -> Vec<u8> {
    let mut out = Vec::new();
    for line in lines {
        out.extend_from_slice(line.as_bytes());
        out.push(line_end.byte());
    }
    out
}
