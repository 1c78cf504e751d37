//! Codes: what messages, reports and manuals name, and where the book explains it.
//!
//! A code is the anchor or the heading of a section, or a word in the first cell of a table row. The book is the only list: a row
//! that the tests of the tables demand there can be explained here.

use crate::page::{Page, Row, Section, cells, plain};
use crate::{Book, Passage};
use ts3100_proto::words::did_you_mean_or;

/// Pages that explain codes: the reference, the terms, the rules of variation, and the rows of the fidelity page with their clauses.
const PAGES: [&str; 4] = [
    "reference/",
    "glossary",
    "explanation/variation",
    "explanation/fidelity",
];
/// Page of the exit codes. Numbers are in many tables; alone, one of these is what a program ended with.
const EXIT_CODES: &str = "reference/exit-codes";
/// Beginning of the anchors of alarms; their number follows.
const ALARM: &str = "alarm-";
/// Variables of the environment, which rows have in any of their cells.
const VARIABLE: &str = "TS3100_";

/// Most codes in the first cell of a row that is about each of them; a longer list is about what they have in common.
const MAX_SUBJECTS: usize = 3;
/// Most words beside them: a sentence is about something else.
const MAX_WORDS: usize = 3;

/// How well a row fits.
#[derive(PartialEq, Eq)]
enum Fit {
    /// It is about the word.
    Subject,
    /// The word is part of what it is about: THEN in the row of IF.
    Part,
}

impl Book {
    /// Sections and then rows that explain a code, in the order of the book. Capitals matter where that tells two codes apart. Empty if
    /// nothing explains it.
    pub fn explain(&self, code: &str) -> Vec<Passage<'_>> {
        let code = code.trim();
        if let Some(page) = self.exit_codes(code) {
            return vec![page];
        }
        let as_written = self.explained(code, &|word| word == code);
        match as_written.is_empty() {
            true => self.explained(code, &|word| word.eq_ignore_ascii_case(code)),
            false => as_written,
        }
    }

    fn explained(&self, code: &str, is_code: &dyn Fn(&str) -> bool) -> Vec<Passage<'_>> {
        let alarm = alarm_anchor(code);
        // Sections say more than rows.
        let mut found: Vec<Passage<'_>> = Vec::new();
        let mut subjects: Vec<Passage<'_>> = Vec::new();
        let mut parts: Vec<Passage<'_>> = Vec::new();
        for page in self.pages.iter().filter(|page| explains(page)) {
            let is_meant = |section: &&Section| match &alarm {
                Some(anchor) => section.anchor == *anchor,
                None => {
                    let heading = &section.heading;
                    // The sections of subcommands have the whole command as their heading.
                    let command = heading.strip_prefix("ts3100 ").unwrap_or(heading);
                    is_code(command) || section.names().any(is_code)
                }
            };
            let sections: Vec<&Section> = page.sections.iter().filter(is_meant).collect();
            found.extend(sections.iter().map(|section| page.section(section)));
            // A list of the sections says less than they do.
            let leads_to = |row: &&Row| {
                let mut names = sections.iter().flat_map(|section| section.names());
                names.any(|name| page.line(row).contains(&format!("](#{name})")))
            };
            for row in page.rows.iter().filter(|row| !leads_to(row)) {
                match fit(page, row, code, is_code) {
                    Some(Fit::Subject) => subjects.push(page.row(row)),
                    Some(Fit::Part) => parts.push(page.row(row)),
                    None => {}
                }
            }
        }
        if found.is_empty() {
            subjects.append(&mut parts);
        }
        found.append(&mut subjects);
        found
    }

    /// The exit codes, if this is one of them.
    fn exit_codes(&self, code: &str) -> Option<Passage<'_>> {
        let page = self.page(EXIT_CODES)?;
        let has = |row: &Row| subjects(&cells(page.line(row))).iter().any(|word| word == code);
        let is_number = code.bytes().all(|byte| byte.is_ascii_digit());
        (is_number && page.rows.iter().any(has)).then(|| page.passage())
    }

    /// The end of a message about a code that nothing explains.
    pub fn unknown_code_hint(&self, code: &str) -> String {
        let mut codes = self.codes();
        if alarm_anchor(code).is_some() {
            codes.retain(|known| {
                self.page("reference/alarms")
                    .is_some_and(|page| page.at(&format!("{ALARM}{known}")).is_some())
            });
        }
        let known = codes.iter().map(String::as_str);
        did_you_mean_or(
            code,
            known,
            "; `ts3100 docs --search WORD` searches the documentation",
        )
    }

    /// The codes of one word that the book explains: anchors of sections, and subjects of rows.
    pub fn codes(&self) -> Vec<String> {
        let mut codes: Vec<String> = Vec::new();
        for page in self.pages.iter().filter(|page| explains(page)) {
            for section in &page.sections {
                codes.extend(
                    section
                        .names()
                        .map(|name| name.trim_start_matches(ALARM).to_owned()),
                );
                codes.push(section.heading.clone());
            }
            for row in &page.rows {
                codes.extend(subjects(&cells(page.line(row))));
            }
        }
        codes.retain(|code| !code.is_empty() && !code.contains(char::is_whitespace));
        codes.sort();
        codes.dedup();
        codes
    }
}

fn explains(page: &Page) -> bool {
    PAGES.iter().any(|begin| page.path.starts_with(begin))
}

/// The anchor of an alarm by its number in one of the forms that hosts see: 2-046, 2-46, 002-046.
fn alarm_anchor(code: &str) -> Option<String> {
    let (level, number) = code.split_once('-')?;
    let (level, number) = (level.parse::<u8>().ok()?, number.parse::<u16>().ok()?);
    Some(format!("{ALARM}{level}-{number:03}"))
}

fn fit(page: &Page, row: &Row, code: &str, is_code: &dyn Fn(&str) -> bool) -> Option<Fit> {
    if row.ids.iter().any(|id| is_code(id)) {
        return Some(Fit::Subject);
    }
    let line = page.line(row);
    // A search for the letters first: most rows have none of them.
    if !line.to_ascii_lowercase().contains(&code.to_ascii_lowercase()) {
        return None;
    }
    let cells = cells(line);
    let first = cells.first()?;
    if is_name(first) && subjects(&cells).iter().any(|word| is_code(word)) {
        return Some(Fit::Subject);
    }
    let parts = spans(first).any(|span| is_code(span) || words(span).any(is_code));
    parts.then_some(Fit::Part)
}

/// Subjects of a row: the code in its first cell and the first word of that, or the whole cell if it has no code; and the
/// variables in any cell.
fn subjects(cells: &[String]) -> Vec<String> {
    let first = cells.first().map_or("", String::as_str);
    let mut subjects: Vec<String> = Vec::new();
    for span in spans(first) {
        subjects.push(span.to_owned());
        let word = span.split([' ', ',', '(', '=', '[', '<', ':']).next();
        subjects.extend(word.map(str::to_owned));
    }
    if subjects.is_empty() {
        let cell = plain(first);
        let words = cell.split(", ").map(|word| word.trim_start_matches("+ "));
        subjects.extend(words.map(str::to_owned));
    }
    let variables = cells.iter().flat_map(|cell| spans(cell));
    let variables = variables.filter(|span| span.starts_with(VARIABLE));
    subjects.extend(variables.map(str::to_owned));
    subjects
}

/// Whether a cell names something, rather than say something about it.
fn is_name(cell: &str) -> bool {
    let beside = cell
        .split('`')
        .step_by(2)
        .map(plain)
        .collect::<Vec<_>>()
        .join(" ");
    spans(cell).count() <= MAX_SUBJECTS && beside.split_whitespace().count() <= MAX_WORDS
}

/// The code in a cell.
fn spans(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

fn words(span: &str) -> impl Iterator<Item = &str> {
    span.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_' && letter != '-')
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::book;

    fn topics(code: &str) -> Vec<String> {
        let found = book().explain(code);
        found.iter().map(Passage::topic).collect()
    }

    #[test]
    fn a_code_is_a_section_or_a_row() {
        for (code, topic) in [
            ("E0101", "reference/diagnostics#unexpected-token"),
            ("left-in-exchange", "reference/findings#left-in-exchange"),
            ("2-046", "reference/alarms#alarm-2-046"),
            ("002-046", "reference/alarms#alarm-2-046"),
            ("2-46", "reference/alarms#alarm-2-046"),
            ("text.end", "reference/options#textend"),
            ("movej", "reference/scol/motion#motion-statements"),
            ("TS3100_LISTEN", "reference/command-line#ts3100-serve"),
            ("--listen", "reference/command-line#ts3100-serve"),
            ("text-1", "explanation/fidelity#texts-and-exchanges"),
            ("FRM-10", "explanation/fidelity#clauses-of-findings"),
        ] {
            assert!(
                topics(code).iter().any(|found| found == topic),
                "{code}: {:?}",
                topics(code)
            );
        }
        assert_eq!(
            topics("RN"),
            [
                "reference/protocol/commands#rn",
                "reference/protocol/commands#all-commands"
            ]
        );
        assert!(topics("xyzzy").is_empty());
    }

    #[test]
    fn a_number_alone_is_an_exit_code() {
        for code in ["0", "3", "5", "64", "125", "127"] {
            assert_eq!(topics(code), ["reference/exit-codes"], "{code}");
        }
        assert!(!topics("6").contains(&"reference/exit-codes".to_owned()));
    }

    #[test]
    fn a_part_of_a_subject_counts_where_there_is_no_section() {
        assert_eq!(
            topics("THEN"),
            [
                "reference/scol/limits#reserved-words",
                "reference/scol/statements#jumps-and-conditions",
                "reference/scol/statements#jumps-and-conditions"
            ]
        );
    }

    #[test]
    fn an_unknown_code_is_answered_with_the_nearest() {
        assert_eq!(
            book().unknown_code_hint("left-in-exchnge"),
            "; did you mean `left-in-exchange`?"
        );
        assert_eq!(book().unknown_code_hint("2-064"), "; did you mean `2-046`?");
        assert!(book().unknown_code_hint("xyzzyxyzzy").contains("--search"));
    }
}
