//! STRING.PAR, the numbers that a program gets for strings (STE 80722 p. 32): reader.
//!
//! A host writes the file; there is none at first. Whether strings are looked up in it says \[U25\] of USER.PAR
//! ([`super::StringRule`]), and INPUT does the looking up.

use super::{ParameterProblem, Problems};
use crate::prelude::*;
use crate::text::{CR, LF};
use crate::words::number;

/// Rows that count; further ones are cut off (S91).
pub const MAX_STRINGS: usize = 128;
/// Longest text of a row, in characters (S91).
pub const MAX_STRING: usize = 32;
/// Largest number of a row (S91).
const MAX_NUMBER: u16 = 32_767;

/// A row: a string and its number.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StringRow {
    /// The number that INPUT gets instead of the text, at most 32767.
    pub number: u16,
    /// Printable ASCII, at most [`MAX_STRING`] characters.
    pub text: String,
}

impl StringRow {
    /// Whether a file can have this row.
    pub fn is_valid(&self) -> bool {
        let fits = |char: char| matches!(char, ' '..='~') && char != '"';
        self.number <= MAX_NUMBER && self.text.len() <= MAX_STRING && self.text.chars().all(fits)
    }

    /// Reads what follows the `=` of a line: `0 "OK"`.
    fn parse(value: &str) -> Option<StringRow> {
        let (digits, rest) = value.trim().split_once('"')?;
        let row = StringRow {
            number: number(digits.trim())?,
            text: rest.strip_suffix('"')?.to_string(),
        };
        Some(row).filter(StringRow::is_valid)
    }
}

/// Reads a file. A bad row is skipped and counts towards the [`MAX_STRINGS`] all the same; the problem names the first
/// and how many there are. Headings in `[]` and comments in `{}` have lines of their own.
pub fn parse_strings(content: &[u8]) -> (Vec<StringRow>, Option<ParameterProblem>) {
    const EXPECTED: &str = "= N \"TEXT\", N from 0 to 32767, at most 32 characters";
    let text = String::from_utf8_lossy(content);
    let mut lines = numbered_lines(&text).take_while(|(_, line)| !line.eq_ignore_ascii_case("[END]"));
    let rows = lines
        .by_ref()
        .filter(|(_, line)| !line.is_empty() && !line.starts_with(['[', '{']));
    let (mut strings, mut bad) = (Vec::new(), Vec::new());
    for (number, line) in rows.take(MAX_STRINGS) {
        match line.strip_prefix('=').and_then(StringRow::parse) {
            Some(row) => strings.push(row),
            None => bad.push((number, line)),
        }
    }
    let mut problems = Problems::default();
    if let Some((number, line)) = bad.first() {
        problems.add("", "", EXPECTED, line, *number);
    }
    let mut problem = problems.0.pop();
    if let Some(problem) = problem.as_mut().filter(|_| bad.len() > 1) {
        problem.found += &format!("; {} such rows", bad.len());
    }
    (strings, problem)
}

/// The lines of a text without the blanks around them, numbered from 1; CR, LF and CR LF end one.
fn numbered_lines(text: &str) -> impl Iterator<Item = (u32, &str)> {
    let (cr, lf) = (char::from(CR), char::from(LF));
    let lines = text
        .split(lf)
        .flat_map(move |line| line.strip_suffix(cr).unwrap_or(line).split(cr));
    (1..).zip(lines.map(str::trim))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(content: &str) -> Vec<(u16, String)> {
        let (rows, problem) = parse_strings(content.as_bytes());
        assert_eq!(problem, None, "{content:?}");
        rows.into_iter().map(|row| (row.number, row.text)).collect()
    }

    fn problem(content: &str) -> String {
        parse_strings(content.as_bytes()).1.unwrap().to_string()
    }

    // clause: S91 T13
    #[test]
    fn a_row_is_a_number_and_a_text() {
        let expected = [
            (0, "OK".to_string()),
            (32_767, "a B=[c]{d}".to_string()),
            (7, String::new()),
        ];
        for end in ["\n", "\r", "\r\n"] {
            let lines = [
                "[S] Strings",
                "{number text}",
                "= 0 \"OK\"",
                "",
                " =32767  \"a B=[c]{d}\" ",
                "= 7 \"\"",
                "[END]",
                "x",
            ];
            assert_eq!(texts(&lines.join(end)), expected, "{end:?}");
        }
        assert_eq!(texts(""), []);
        let longest = "x".repeat(32);
        assert_eq!(texts(&format!("= 1 \"{longest}\"")), [(1, longest)]);
    }

    // clause: S91 T13 T27
    #[test]
    fn a_bad_row_is_skipped_and_told() {
        let long = format!("= 1 \"{}\"", "x".repeat(33));
        for bad in [
            "= 32768 \"A\"",
            "= -1 \"A\"",
            "= +1 \"A\"",
            "= 1.0 \"A\"",
            "= X \"A\"",
            "= \"A\"",
            "= 1 A",
            "= 1 \"A",
            "= 1 A\"",
            "= 1 \"A\"B\"",
            "= 1 \"A\" B",
            "= 1 2 \"A\"",
            "1 \"A\"",
            "= 1 \"\u{e4}\"",
            "= 1 \"A\tB\"",
            "=",
            long.as_str(),
        ] {
            let (rows, problem) = parse_strings(format!("= 5 \"B\"\r{bad}\r= 6 \"C\"\r").as_bytes());
            assert_eq!(rows.len(), 2, "{bad}");
            assert_eq!(problem.unwrap().line, 2, "{bad}");
        }
        assert_eq!(
            problem("= 1 \"A\"\n= 40000 \"B\"\n"),
            "line 2: expected = N \"TEXT\", N from 0 to 32767, at most 32 characters, found `= 40000 \"B\"`"
        );
        assert!(problem("= A\n= 1 \"B\"\n= C\n").ends_with("line 1: expected = N \"TEXT\", N from 0 to 32767, at most 32 characters, found `= A`; 2 such rows"));
    }

    // clause: S91 T27
    #[test]
    fn rows_beyond_128_are_cut_off_and_bad_ones_count() {
        let rows = |count: usize| {
            (0..count)
                .map(|n| format!("= {n} \"T{n}\"\n"))
                .collect::<String>()
        };
        assert_eq!(texts(&rows(128)).len(), 128);
        let cut = texts(&rows(129));
        assert_eq!(cut.len(), 128);
        assert_eq!(cut[127], (127, "T127".to_string()));
        let (found, problem) = parse_strings(format!("= bad\n{}", rows(128)).as_bytes());
        assert_eq!((found.len(), problem.is_some()), (127, true));
        // What is cut off is not read.
        assert_eq!(texts(&format!("{}= bad\n", rows(128))).len(), 128);
    }
}
