//! The syntax that parameter files share: sections in brackets, keys in braces, values after `=`.
//!
//! The reader is tolerant and never fails. The modules `ethernet` and `user` know which sections and values a file must
//! have.

use crate::prelude::*;

/// Sections that are read of a file; further ones are dropped.
pub const MAX_SECTIONS: usize = 64;
/// Values that are read of a section; further ones are dropped.
pub const MAX_ASSIGNMENTS: usize = 256;

/// A parameter file, read without regard to headings, comments and line ends (PAR-FILE-02).
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ParameterFile {
    /// Sections in the order of the file, `[END]` not among them.
    pub sections: Vec<Section>,
    /// Line of `[END]`, from 1; `None` if it is missing.
    pub end: Option<u32>,
    /// The file has more than [`MAX_SECTIONS`] or [`MAX_ASSIGNMENTS`], and something was dropped.
    pub truncated: bool,
}

/// One section, for example `[E05]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// Tag without brackets and blanks, in upper case; empty for values before the first tag.
    pub tag: String,
    /// Line of the tag, from 1.
    pub line: u32,
    /// Values in the order of the file.
    pub assignments: Vec<Assignment>,
}

impl Section {
    fn new(tag: String, line: u32) -> Section {
        let assignments = Vec::new();
        Section {
            tag,
            line,
            assignments,
        }
    }
}

/// One assignment, `{KEY} = value`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assignment {
    /// Content of the last braces before the `=`, without blanks, in upper case; empty if there are none.
    pub key: String,
    /// Line of the `=`, from 1.
    pub line: u32,
    /// The value after the `=`, trimmed, with its quotes.
    pub value: String,
}

impl ParameterFile {
    /// Reads a file; it never fails. A value ends with its line or before the next
    /// `{`, `[` or `=`, so that a listing run together on one line reads the same.
    pub fn parse(content: &[u8]) -> ParameterFile {
        let text = String::from_utf8_lossy(content);
        let mut reader = Reader { rest: &text, line: 1 };
        let mut file = ParameterFile::default();
        let mut key = String::new();
        let mut keep = true;
        while let Some(char) = reader.next() {
            match char {
                '[' => {
                    let line = reader.line;
                    let Some(tag) = reader.tag() else { continue };
                    if tag == END {
                        file.end = Some(line);
                        return file;
                    }
                    keep = file.sections.len() < MAX_SECTIONS;
                    file.truncated |= !keep;
                    if keep {
                        file.sections.push(Section::new(tag, line));
                    }
                    key = String::new();
                }
                '{' => key = reader.braces(),
                '=' => {
                    let line = reader.line;
                    reader.skip_blanks();
                    let value = reader.value();
                    let key = core::mem::take(&mut key);
                    if keep {
                        file.assign(Assignment { key, line, value });
                    }
                }
                _ => {}
            }
        }
        file
    }

    fn assign(&mut self, assignment: Assignment) {
        if self.sections.is_empty() {
            self.sections.push(Section::new(String::new(), 1));
        }
        match self.sections.last_mut().map(|section| &mut section.assignments) {
            Some(assignments) if assignments.len() < MAX_ASSIGNMENTS => assignments.push(assignment),
            _ => self.truncated = true,
        }
    }
}

/// The tag that ends a file.
const END: &str = "END";

/// The rest of the file, and the number of its first line.
struct Reader<'a> {
    rest: &'a str,
    line: u32,
}

impl<'a> Reader<'a> {
    /// The next character; CR, LF and CRLF all come as one `\n`.
    fn next(&mut self) -> Option<char> {
        let mut chars = self.rest.chars();
        let char = chars.next()?;
        self.rest = chars.as_str();
        if char == '\r' {
            self.rest = self.rest.strip_prefix('\n').unwrap_or(self.rest);
        }
        let ends = matches!(char, '\r' | '\n');
        self.line = self.line.saturating_add(u32::from(ends));
        Some(if ends { '\n' } else { char })
    }

    /// Takes everything before the first of `ends`.
    fn until(&mut self, ends: &[char]) -> &'a str {
        let length = self.rest.find(ends).unwrap_or(self.rest.len());
        let (head, rest) = self.rest.split_at_checked(length).unwrap_or((self.rest, ""));
        self.rest = rest;
        head
    }

    /// The tag after `[`; `None` if its line has no `]`: then the bracket is part of a heading.
    fn tag(&mut self) -> Option<String> {
        let (tag, rest) = self.rest.split_once(']')?;
        if tag.contains(['\r', '\n']) {
            return None;
        }
        self.rest = rest;
        Some(normalize(tag))
    }

    /// The key between `{` and `}`, or up to the end of the file.
    fn braces(&mut self) -> String {
        let mut inner = String::new();
        while let Some(char) = self.next().filter(|char| *char != '}') {
            inner.push(char);
        }
        normalize(&inner)
    }

    fn skip_blanks(&mut self) {
        while self.rest.starts_with(char::is_whitespace) {
            self.next();
        }
    }

    /// The value after `=` and any blanks and line ends. Within quotes no character is special.
    fn value(&mut self) -> String {
        let inner = self
            .rest
            .strip_prefix('"')
            .and_then(|inner| inner.split_once('"'));
        let quoted = match inner.filter(|(quoted, _)| !quoted.contains(['\r', '\n'])) {
            Some((quoted, rest)) => {
                self.rest = rest;
                format!("\"{quoted}\"")
            }
            None => String::new(),
        };
        quoted + self.until(&['{', '[', '=', '\r', '\n']).trim()
    }
}

/// Without blanks and line ends, in upper case.
fn normalize(text: &str) -> String {
    let letters = text.chars().filter(|char| !char.is_whitespace());
    letters.map(|char| char.to_ascii_uppercase()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::format;

    fn shape(file: &ParameterFile) -> Vec<String> {
        let mut out = Vec::new();
        for section in &file.sections {
            for assignment in &section.assignments {
                out.push(format!("{} {} {}", section.tag, assignment.key, assignment.value));
            }
        }
        out
    }

    // clause: PAR-FILE-01 PAR-FILE-02
    #[test]
    fn run_together_or_line_by_line_reads_the_same() {
        let one = "[E00] Open mode IP0 { 0: non } = 1 0 0 0 [E02] name = \"N{1}=[x]\" [E05] Own { IP0 } = 1000 \
                   {IP1} = 1001[END]";
        let expected = [
            "E00 0:NON 1 0 0 0",
            "E02  \"N{1}=[x]\"",
            "E05 IP0 1000",
            "E05 IP1 1001",
        ];
        let lines = one
            .replace("] ", "]\n")
            .replace("{IP1} =", "{IP1}\n=\n")
            .replace(" [", "\n[");
        assert!(lines.lines().count() > 6);
        for text in [
            one,
            &lines,
            &lines.replace('\n', "\r"),
            &lines.replace('\n', "\r\n"),
            &lines.to_lowercase(),
        ] {
            let file = ParameterFile::parse(text.as_bytes());
            let found: Vec<String> = shape(&file).iter().map(|row| row.to_uppercase()).collect();
            assert_eq!(found, expected.map(str::to_uppercase), "{text}");
            assert!(file.end.is_some());
        }
    }

    #[test]
    fn lines_are_counted_for_every_line_end() {
        for end in ["\n", "\r", "\r\n"] {
            let text = ["[A]", "{two", "three} =", "", " 5", "= 6", "[B] = 7", "[end] = 8"].join(end);
            let file = ParameterFile::parse(text.as_bytes());
            assert_eq!(file.sections[0].assignments[0].line, 3);
            assert_eq!(file.sections[0].assignments[0].value, "5");
            assert_eq!(file.sections[0].assignments[1].line, 6);
            assert_eq!(file.sections[1].line, 7);
            assert_eq!(file.end, Some(8));
            assert_eq!(file.sections.len(), 2);
        }
    }

    #[test]
    fn odd_files_read_as_something() {
        assert_eq!(shape(&ParameterFile::parse(b"= 1")), ["  1"]);
        assert_eq!(shape(&ParameterFile::parse(b"[A] = [B] =")), ["A  ", "B  "]);
        assert_eq!(
            shape(&ParameterFile::parse(b"[A\n[B] = \"open\n= 2")),
            ["B  \"open", "B  2"]
        );
        assert_eq!(
            shape(&ParameterFile::parse(b"[A]{IP0 = 1 [END]")),
            Vec::<String>::new()
        );
        assert_eq!(
            shape(&ParameterFile::parse(b"[A] = \"x\" y \xFF{")),
            ["A  \"x\"y \u{FFFD}"]
        );
        let many = "[A] = 1 ".repeat(MAX_SECTIONS + 1) + "{lost} = 2";
        let file = ParameterFile::parse(many.as_bytes());
        assert!(file.truncated && file.sections.len() == MAX_SECTIONS);
        let many = format!("[A]{}", " = 1".repeat(MAX_ASSIGNMENTS + 1));
        let file = ParameterFile::parse(many.as_bytes());
        assert!(file.truncated && file.sections[0].assignments.len() == MAX_ASSIGNMENTS);
    }
}
