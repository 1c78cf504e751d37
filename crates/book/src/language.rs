//! What the book says about a word of SCOL or an alarm, in the form in which an editor shows it beside a program.

use crate::page::cells;
use crate::{Book, Passage};
use std::collections::BTreeMap;
use ts3100_proto::words::shortened;

/// Pages that say what a word of the language does.
const LANGUAGE: &str = "reference/scol/";
/// Page with a list of all words, which says little.
const WORDS: &str = "reference/scol/limits";
/// Pages with rows about groups of statements: what DO refuses, where a stop leaves them.
const GROUPS: [&str; 2] = ["reference/scol/do", "reference/scol/running"];
const ALARMS: &str = "reference/alarms";
/// Rank of rows that mention a word.
const MENTION: u8 = 2;
/// Most rows about a word.
const MAX_ROWS: usize = 3;
/// Most characters of an explanation; the rest is in the documentation.
const MAX_EXPLANATION: usize = 4_000;

impl Book {
    /// The rows and sections about a word of the language, in upper case, as Markdown without links.
    pub fn language_word(&self, word: &str) -> Option<String> {
        let passages = self.explain(word);
        let language = passages
            .iter()
            .filter(|passage| passage.page.path.starts_with(LANGUAGE));
        let mut rated: Vec<(u8, &Passage<'_>)> =
            language.map(|passage| (rank(passage, word), passage)).collect();
        rated.sort_by_key(|(rank, _)| *rank);
        let best = rated.first()?.0;
        // A row that only leads to another, or mentions the word, says nothing beside one about it.
        let shown = rated
            .iter()
            .take_while(|(rank, _)| *rank < MENTION || *rank == best);
        let texts: Vec<String> = shown
            .take(MAX_ROWS)
            .map(|(_, passage)| paragraph(passage))
            .collect();
        Some(shortened(texts.join("\n\n---\n\n").trim(), MAX_EXPLANATION).into_owned())
    }

    /// The forms of a function or a statement with operands, each with its effect: `BCDIN(first, digits)`.
    pub fn call_forms(&self, word: &str) -> Vec<(String, String)> {
        let passages = self.explain(word);
        let rows = passages
            .iter()
            .filter(|passage| passage.page.path.starts_with(LANGUAGE));
        let mut forms: Vec<(String, String)> = Vec::new();
        for cells in rows.map(Passage::cells) {
            let Some((_, subject)) = cells.first() else {
                continue;
            };
            for form in subject.split('`').skip(1).step_by(2) {
                let has_operands = form
                    .strip_prefix(word)
                    .is_some_and(|rest| rest.starts_with(['(', ' ']));
                if has_operands && !forms.iter().any(|(known, _)| known == form) {
                    let effect = cells.get(1).map_or("", |(_, cell)| cell.as_str());
                    forms.push((form.to_owned(), effect.to_owned()));
                }
            }
        }
        forms
    }

    /// The first form of each word that has operands, as [`Book::call_forms`] has them, in one pass.
    pub fn first_forms(&self) -> BTreeMap<String, String> {
        let mut forms = BTreeMap::new();
        for page in self.pages.iter().filter(|page| page.path.starts_with(LANGUAGE)) {
            for row in &page.rows {
                let cells = cells(page.line(row));
                let subject = cells.first().map_or("", String::as_str);
                for form in subject.split('`').skip(1).step_by(2) {
                    let end = form.find(['(', ' ']);
                    let word = end
                        .and_then(|end| form.get(..end))
                        .filter(|word| !word.is_empty());
                    if let Some(word) = word {
                        forms.entry(word.to_owned()).or_insert_with(|| form.to_owned());
                    }
                }
            }
        }
        forms
    }

    /// Cause and remedy of an alarm by its number, `2-046`, as Markdown without links.
    pub fn alarm(&self, number: &str) -> Option<String> {
        let passages = self.explain(number);
        let found = passages.iter().find(|passage| passage.page.path == ALARMS)?;
        Some(shortened(found.without_links().trim(), MAX_EXPLANATION).into_owned())
    }
}

/// Order of passages about a word: a section or a row about it, one that has it in its first cell, the list of words, one that
/// leads elsewhere or is a rule.
fn rank(passage: &Passage<'_>, word: &str) -> u8 {
    let cells = passage.cells();
    let Some((heading, subject)) = cells.first() else {
        return 0;
    };
    let effect = cells.get(1).map_or("", |(_, cell)| cell.as_str());
    let begins = subject.split('`').skip(1).step_by(2).any(|form| {
        let rest = form.strip_prefix(word);
        rest.is_some_and(|rest| {
            !rest.starts_with(|letter: char| letter.is_ascii_alphanumeric() || letter == '_')
        })
    });
    let has = subject.split('`').skip(1).step_by(2).any(|form| {
        form.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_')
            .any(|found| found == word)
    });
    match begins {
        _ if passage.page.path == WORDS => MENTION,
        _ if GROUPS.contains(&passage.page.path.as_str()) => MENTION + 1,
        _ if heading == "Rule" || !has || effect.starts_with("see ") || effect.contains(", see ") => {
            MENTION + 1
        }
        true => 0,
        false => 1,
    }
}

/// A row as a paragraph: what it is about, what it says, and where that is known from.
fn paragraph(passage: &Passage<'_>) -> String {
    let cells = passage.cells();
    let Some(((_, subject), further)) = cells.split_first() else {
        return passage.without_links().trim().to_owned();
    };
    let mut text = format!("{subject}  \n");
    for (at, (heading, cell)) in further.iter().filter(|(_, cell)| !cell.is_empty()).enumerate() {
        text += &match heading.as_str() {
            "Source" => format!("\n*Source: {cell}*"),
            _ if at == 0 => format!("{cell}\n"),
            heading => format!("\n{heading}: {cell}\n"),
        };
    }
    text
}

#[cfg(test)]
mod tests {
    use crate::book;

    #[test]
    fn a_row_becomes_a_paragraph_with_its_source() {
        assert_eq!(
            book()
                .language_word("MOVES")
                .unwrap()
                .split("\n\n---")
                .next()
                .unwrap(),
            "`MOVES p`  \nthe tool point moves on a straight line\n\n*Source: observed*"
        );
        assert!(
            book()
                .language_word("PASS")
                .unwrap()
                .contains("\nDefault: 50, off\n")
        );
        assert!(book().language_word("TO").is_some());
        assert_eq!(book().language_word("XYZZY"), None);
    }

    #[test]
    fn forms_have_operands() {
        let forms: Vec<String> = book()
            .call_forms("BCDOUT")
            .into_iter()
            .map(|(form, _)| form)
            .collect();
        assert_eq!(forms, ["BCDOUT(first, digits, value)"]);
        assert_eq!(book().call_forms("STOP"), []);
        let first = book().first_forms();
        for word in ["BCDOUT", "MOVES", "DELAY", "POINT", "MAX"] {
            assert_eq!(first[word], book().call_forms(word)[0].0);
        }
        assert!(book().alarm("2-046").unwrap().starts_with("### Alarm 2-046\n"));
        assert_eq!(book().alarm("9-999"), None);
    }
}
