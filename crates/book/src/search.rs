//! Search: the sections that contain all words, those first that have them in their headings.

use crate::page::{Page, Section, plain};
use crate::{Book, Passage};

/// Weight of a whole word at a place in the section; the beginning of a longer one has 1.
const WHOLE: usize = 2;
/// Weights of a word in the heading of its section, in the title of its page, and at each of a few places in a short section.
const IN_HEADING: usize = 2_000;
const IN_TITLE: usize = 800;
const IN_TEXT: usize = 100;
const MAX_PLACES: usize = 10;
/// Bytes of a section in which a place counts half: in a long one a word is nothing special.
const LONG: usize = 1_000;

/// A section with all words that were searched for.
#[derive(Debug)]
pub struct Hit<'a> {
    pub passage: Passage<'a>,
    /// The line that has most of the words, without marks.
    pub line: String,
}

impl Book {
    /// The sections with all of these words, the best first. A word also matches the beginning of a longer one.
    pub fn search(&self, words: &str) -> Vec<Hit<'_>> {
        let words: Vec<String> = words.split_whitespace().map(str::to_lowercase).collect();
        if words.is_empty() {
            return Vec::new();
        }
        let sections = self
            .pages
            .iter()
            .flat_map(|page| page.sections.iter().map(move |section| (page, section)));
        let mut found: Vec<(usize, Hit<'_>)> = sections
            .filter_map(|(page, section)| rated(page, section, &words))
            .collect();
        // The order of the book decides between equals.
        found.sort_by_key(|(score, _)| std::cmp::Reverse(*score));
        found.into_iter().map(|(_, hit)| hit).collect()
    }
}

fn rated<'a>(page: &'a Page, section: &'a Section, words: &[String]) -> Option<(usize, Hit<'a>)> {
    let own = page.slice(&section.own);
    let (text, heading, title) = (
        own.to_lowercase(),
        section.heading.to_lowercase(),
        page.title.to_lowercase(),
    );
    // The words beside each other mean more than the same words apart.
    let phrases = [words.join(" "), words.join("-")];
    let has_phrase = |text: &str| words.len() > 1 && phrases.iter().any(|phrase| places(text, phrase) > 0);
    let mut score = usize::from(has_phrase(&text)) * IN_HEADING;
    for word in words {
        let places = places(&text, word);
        if places == 0 {
            return None;
        }
        let exact = usize::from(heading == *word || section.has_anchor(word)) * IN_HEADING;
        score += exact
            + usize::from(self::places(&heading, word) > 0) * IN_HEADING
            + usize::from(self::places(&title, word) > 0) * IN_TITLE
            + places.min(MAX_PLACES) * IN_TEXT * LONG / (LONG + own.len());
    }
    // The first of the lines that have most of the words.
    let rate = |line: &str| {
        let line = line.to_lowercase();
        let found = words.iter().map(|word| places(&line, word).min(WHOLE));
        found.sum::<usize>() + usize::from(has_phrase(&line))
    };
    let below: Vec<&str> = own.lines().skip(1).filter(|line| !line.is_empty()).collect();
    let best = below.into_iter().rev().max_by_key(|line| rate(line));
    let line = best.map(line_of_text).unwrap_or_default();
    let passage = page.section(section);
    Some((score, Hit { passage, line }))
}

/// A line without marks; of a table row its cells.
fn line_of_text(line: &str) -> String {
    match line.starts_with('|') {
        true => crate::page::cells(line)
            .iter()
            .map(|cell| plain(cell))
            .collect::<Vec<_>>()
            .join(" | "),
        false => plain(line.trim()),
    }
}

/// How often a word is in a text: [`WHOLE`] for each place, 1 where a longer word begins with it.
fn places(text: &str, word: &str) -> usize {
    let is_letter = |letter: Option<char>| letter.is_some_and(char::is_alphanumeric);
    let begins = |at: usize| !is_letter(text.get(..at).and_then(|before| before.chars().next_back()));
    let is_whole = |at: usize| !is_letter(text.get(at + word.len()..).and_then(|after| after.chars().next()));
    let found = text.match_indices(word).filter(|(at, _)| begins(*at));
    found.map(|(at, _)| if is_whole(at) { WHOLE } else { 1 }).sum()
}

#[cfg(test)]
mod tests {
    use crate::book;

    #[test]
    fn a_heading_comes_before_a_mention() {
        let topics = |words: &str| -> Vec<String> {
            let hits = book().search(words);
            hits.iter().map(|hit| hit.passage.topic()).collect()
        };
        assert_eq!(topics("no-stx")[0], "reference/findings#no-stx");
        assert_eq!(topics("TEXT.END")[0], "reference/options#textend");
        assert!(topics("snapshot restore").len() > 1);
        assert!(topics("xyzzy").is_empty() && topics(" ").is_empty());
    }

    #[test]
    fn a_hit_shows_a_line_that_has_the_word() {
        let hits = book().search("half-duplex");
        assert!(!hits.is_empty());
        assert!(
            hits.iter()
                .all(|hit| hit.line.contains("half-duplex") || hit.passage.title.contains("half-duplex"))
        );
    }

    #[test]
    fn whole_words_beside_each_other_come_first() {
        let hits = book().search("feed hold");
        let first: Vec<String> = hits.iter().take(5).map(|hit| hit.line.to_lowercase()).collect();
        assert!(
            first
                .iter()
                .all(|line| line.contains("feed hold") || line.contains("feed-hold")),
            "{first:?}"
        );
    }
}
