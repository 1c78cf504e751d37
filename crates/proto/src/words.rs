//! Words of small sets of values, as files, requests and command lines have them: `on` and `off`, `teaching`, `ether`.
//!
//! A type says its words once, by [`Word`]. Readers and writers of all forms use them.

use crate::prelude::*;
use alloc::borrow::Cow;

/// The first characters of a text, at most so many, with `...` where there are more.
pub fn shortened(text: &str, most: usize) -> Cow<'_, str> {
    // No character is shorter than a byte, so most texts need not be counted.
    let end = Some(text).filter(|text| text.len() > most);
    match end.and_then(|text| text.char_indices().nth(most)) {
        Some((end, _)) => Cow::Owned(format!("{}...", text.get(..end).unwrap_or_default())),
        None => Cow::Borrowed(text),
    }
}

/// A value of a small set, each with a word.
pub trait Word: Copy + 'static {
    /// All values.
    const ALL: &'static [Self];

    /// The word of this value.
    fn word(self) -> &'static str;

    /// The value of a word.
    fn from_word(word: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|value| value.word() == word)
    }

    /// The value of a word.
    ///
    /// # Errors
    /// It is none of the words, of which each was expected.
    fn read(word: &str) -> Result<Self, UnexpectedWord> {
        Self::from_word(word).ok_or_else(|| {
            let words: Vec<String> = Self::ALL.iter().map(|value| value.word().to_string()).collect();
            UnexpectedWord::new(one_of(&words), word)
        })
    }
}

/// The words as one may be chosen of them: `on or off`, `teaching, internal or ext`.
#[must_use]
pub fn one_of(words: &[String]) -> String {
    match words {
        [others @ .., last] if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        words => words.concat(),
    }
}

impl Word for bool {
    const ALL: &'static [bool] = &[true, false];

    fn word(self) -> &'static str {
        if self { "on" } else { "off" }
    }
}

/// A word where another was expected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected {expected}, found `{found}`{hint}")]
pub struct UnexpectedWord {
    expected: Cow<'static, str>,
    found: String,
    hint: String,
}

impl UnexpectedWord {
    /// This was expected, and that was found.
    pub fn new(expected: impl Into<Cow<'static, str>>, found: &str) -> UnexpectedWord {
        UnexpectedWord {
            expected: expected.into(),
            found: found.to_string(),
            hint: String::new(),
        }
    }

    /// The same with this end of the message.
    #[must_use]
    pub fn hinting(self, hint: String) -> UnexpectedWord {
        UnexpectedWord { hint, ..self }
    }

    /// The same, with a suggestion if some of these words are near to the one found.
    #[must_use]
    pub fn suggesting<'a>(self, known: impl IntoIterator<Item = &'a str>) -> UnexpectedWord {
        UnexpectedWord {
            hint: did_you_mean(&self.found, known),
            ..self
        }
    }
}

/// Most words that are suggested for one.
const MAX_SUGGESTIONS: usize = 3;
/// Longest word that is compared with others, in bytes.
const MAX_COMPARED: usize = 64;

/// The end of a message about an unknown word: `; did you mean "x"?` with the known words nearest to it, in backquotes.
/// Empty if none is near.
pub fn did_you_mean<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let near = nearest(found, known).into_iter();
    let near: Vec<String> = near.map(|word| format!("`{word}`")).collect();
    match near.is_empty() {
        true => String::new(),
        false => format!("; did you mean {}?", one_of(&near)),
    }
}

/// The same; something else that helps if none is near.
pub fn did_you_mean_or<'a>(
    found: &str,
    known: impl IntoIterator<Item = &'a str>,
    otherwise: impl Into<String>,
) -> String {
    let hint = did_you_mean(found, known);
    if hint.is_empty() { otherwise.into() } else { hint }
}

/// The known words that were probably meant, the nearest first, at most three: those with one letter in three wrong at
/// most, and those that begin with the whole word.
pub fn nearest<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    if found.len() > MAX_COMPARED {
        return Vec::new();
    }
    let found = found.to_lowercase();
    let allowed = (found.chars().count() / 3).clamp(1, 3);
    let rate = |word: &'a str| {
        let lower = word.to_lowercase();
        let far = distance(&found, &lower);
        let begins = found.len() >= 3 && lower.starts_with(&found);
        // Two letters that differ in one are no misspelling of each other unless they are swapped.
        let swapped = found.chars().rev().eq(lower.chars());
        if found.len() == 2 && lower.len() == 2 && !swapped && far > 0 {
            return None;
        }
        (far <= allowed && far < found.chars().count() || begins).then_some((far, word))
    };
    let mut near: Vec<(usize, &str)> = known.into_iter().filter_map(rate).collect();
    near.sort_unstable();
    near.dedup();
    near.truncate(MAX_SUGGESTIONS);
    near.into_iter().map(|(_, word)| word).collect()
}

/// Types in the messages of deserializers, and what people call them.
const TYPES: [(&str, &str); 14] = [
    ("u8", "a whole number from 0 to 255"),
    ("u16", "a whole number from 0 to 65535"),
    ("u32", "a whole number, at least 0"),
    ("u64", "a whole number, at least 0"),
    ("usize", "a whole number, at least 0"),
    ("i32", "a whole number"),
    ("i64", "a whole number"),
    ("f32", "a number"),
    ("f64", "a number"),
    ("a boolean", "true or false"),
    ("a map", "an object"),
    ("map", "an object"),
    ("a sequence", "a list"),
    ("sequence", "a list"),
];

fn plain_type(name: &str) -> &str {
    let known = TYPES.iter().find(|(known, _)| *known == name);
    let object = name.starts_with("struct ").then_some("an object");
    known.map(|(_, plain)| *plain).or(object).unwrap_or(name)
}

/// The message of a deserializer without words of Rust: `expected a number, found "x"`.
pub fn plain_message(message: &str) -> String {
    if let Some(rest) = message.strip_prefix("missing field ") {
        let (field, place) = rest.split_once(" at ").unwrap_or((rest, ""));
        // Its place is where the object ends, which says nothing if all of it is in a line.
        return match place.is_empty() || place.starts_with("line 1 ") {
            true => format!("the field {field} is missing"),
            false => format!("the field {field} is missing in the object that ends at {place}"),
        };
    }
    let (message, place) = match message.find(" at line ") {
        Some(at) => message.split_at(at),
        None => (message, ""),
    };
    let message = plain(message).unwrap_or_else(|| message.to_string());
    // A question for the word that was meant ends the message.
    match message.ends_with('?') {
        true => message,
        false => message + place,
    }
}

/// Beginnings of messages of the parsers of JSON and TOML, and what they mean.
const SYNTAX: [(&str, &str); 14] = [
    ("EOF while parsing", "the JSON ends too early"),
    ("expected value", "expected a value"),
    ("expected ident", "expected true, false or null"),
    ("key must be a string", "expected a name in double quotes"),
    ("trailing characters", "expected the end of the JSON"),
    ("trailing comma", "expected a value after the comma"),
    ("invalid number", "expected a number as JSON has it"),
    ("number out of range", "the number is too large"),
    (
        "control character",
        "a string has a control code or a line end; write it as \\u000d or \\n",
    ),
    ("invalid unicode code point", "the text is not UTF-8"),
    ("recursion limit exceeded", "the JSON is nested too deeply"),
    (
        "string values must be quoted",
        "expected a value; a string has quotes",
    ),
    // Of a word without quotes that begins as `true` or `false` does.
    ("invalid boolean", "expected a value; a string has quotes"),
    ("invalid escape", "a string has an unknown escape"),
];

fn plain(message: &str) -> Option<String> {
    let syntax = SYNTAX.iter().find(|(known, _)| message.starts_with(known));
    if let Some((_, plain)) = syntax {
        return Some((*plain).to_string());
    }
    if message.contains("hex escape") {
        return Some("a string has a `\\u` that is not a character".to_string());
    }
    if let Some(rest) = message.strip_prefix("duplicate field ") {
        return Some(format!("the field {rest} is given twice"));
    }
    if let Some(field) = message.strip_suffix("invalid digit found in string") {
        return Some(format!("{field}expected a whole number"));
    }
    // Of a part of a path: Cannot parse `line` with value `x` to a `u16`.
    if let Some(rest) = message.strip_prefix("Cannot parse ") {
        let (found, name) = rest.rsplit_once(" to a ")?;
        let found = found.rsplit(' ').next()?;
        return Some(format!(
            "expected {}, found {found}",
            plain_type(name.trim_matches('`'))
        ));
    }
    if let Some(rest) = message.strip_prefix("unknown ") {
        let (kind, rest) = rest.split_once(" `")?;
        let (found, _) = rest.split_once('`')?;
        let known = backquoted(message);
        let kind = if kind == "variant" { "value" } else { kind };
        let known: Vec<String> = known.map(ToString::to_string).collect();
        let listed = match known.is_empty() {
            true => String::new(),
            false => format!("; expected {}", one_of(&known)),
        };
        let hint = did_you_mean_or(found, known.iter().map(String::as_str), listed);
        return Some(format!("unknown {kind} `{found}`{hint}"));
    }
    let rest = message
        .strip_prefix("invalid type: ")
        .or_else(|| message.strip_prefix("invalid value: "))?;
    let (found, expected) = rest.split_once(", expected ")?;
    let prefixes = ["string ", "integer ", "floating point ", "boolean "];
    let found = prefixes
        .iter()
        .find_map(|prefix| found.strip_prefix(prefix))
        .unwrap_or(found);
    Some(format!(
        "expected {}, found {}",
        plain_type(expected),
        plain_type(found)
    ))
}

/// The words in backquotes after the first, each in one case only.
pub fn backquoted(message: &str) -> impl Iterator<Item = &str> {
    let words: Vec<&str> = message.split('`').skip(3).step_by(2).collect();
    let mut known: Vec<&str> = Vec::new();
    for word in words {
        if !known.iter().any(|known| known.eq_ignore_ascii_case(word)) {
            known.push(word);
        }
    }
    known.into_iter()
}

/// Fewest letters to insert, remove, replace or swap with their neighbour (optimal string alignment).
fn distance(one: &str, other: &str) -> usize {
    let other: Vec<char> = other.chars().collect();
    let at = |row: &[usize], place: usize| row.get(place).copied().unwrap_or(usize::MAX / 2);
    let mut older: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=other.len()).collect();
    let mut before = None;
    for (i, letter) in one.chars().enumerate() {
        let mut row = Vec::from([i + 1]);
        let mut left = None;
        for (j, against) in other.iter().copied().enumerate() {
            let replaced = at(&last, j) + usize::from(letter != against);
            let mut best = replaced.min(at(&last, j + 1) + 1).min(at(&row, j) + 1);
            if before == Some(against) && left == Some(letter) {
                best = best.min(at(&older, j.saturating_sub(1)) + 1);
            }
            row.push(best);
            left = Some(against);
        }
        older = core::mem::replace(&mut last, row);
        before = Some(letter);
    }
    last.last().copied().unwrap_or_default()
}

/// A decimal number without sign.
pub(crate) fn number<N: core::str::FromStr>(word: &str) -> Option<N> {
    let digits = word.bytes().all(|byte| byte.is_ascii_digit());
    word.parse().ok().filter(|_| digits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_is_cut_after_a_character() {
        assert_eq!(shortened("", 0), "");
        assert_eq!(shortened("d\u{e9}p\u{f4}t", 5), "d\u{e9}p\u{f4}t");
        assert_eq!(shortened("d\u{e9}p\u{f4}t", 4), "d\u{e9}p\u{f4}...");
    }

    #[test]
    fn letters_that_are_missing_wrong_or_swapped_are_counted() {
        for (one, other, expected) in [
            ("press", "press", 0),
            ("perss", "press", 1),
            ("pres", "press", 1),
            ("", "press", 5),
            ("ofset", "offset", 1),
            ("kitten", "sitting", 3),
        ] {
            assert_eq!(distance(one, other), expected, "{one} {other}");
            assert_eq!(distance(other, one), expected, "{one} {other}");
        }
    }

    #[test]
    fn messages_of_deserializers_are_plain() {
        for (message, plain) in [
            (
                "invalid type: string \"x\", expected f64 at line 1 column 14",
                "expected a number, found \"x\" at line 1 column 14",
            ),
            (
                "invalid type: integer `1`, expected a boolean",
                "expected true or false, found `1`",
            ),
            (
                "invalid value: integer `-1`, expected u16",
                "expected a whole number from 0 to 65535, found `-1`",
            ),
            (
                "invalid type: map, expected a sequence",
                "expected a list, found an object",
            ),
            (
                "invalid type: null, expected struct SetLine",
                "expected an object, found null",
            ),
            (
                "Cannot parse `99999` to a `u16`",
                "expected a whole number from 0 to 65535, found `99999`",
            ),
            (
                "Cannot parse `line` with value `x` to a `u16`",
                "expected a whole number from 0 to 65535, found `x`",
            ),
            (
                "since: invalid digit found in string",
                "since: expected a whole number",
            ),
            (
                "unknown variant `IP9`, expected one of `COM1`, `com1`, `HOST`, `host`",
                "unknown value `IP9`; expected COM1 or HOST",
            ),
            (
                "unknown field `press`, expected `pressed` at line 1 column 8",
                "unknown field `press`; did you mean `pressed`?",
            ),
            ("unknown field `x`, there are no fields", "unknown field `x`"),
            (
                "EOF while parsing a value at line 1 column 0",
                "the JSON ends too early at line 1 column 0",
            ),
            ("missing field `percent`", "the field `percent` is missing"),
            (
                "missing field `on` at line 1 column 2",
                "the field `on` is missing",
            ),
            (
                "duplicate field `on` at line 1 column 15",
                "the field `on` is given twice at line 1 column 15",
            ),
            (
                "expected ident at line 1 column 10",
                "expected true, false or null at line 1 column 10",
            ),
            (
                "key must be a string at line 1 column 2",
                "expected a name in double quotes at line 1 column 2",
            ),
            (
                "lone leading surrogate in hex escape at line 1 column 9",
                "a string has a `\\u` that is not a character at line 1 column 9",
            ),
            (
                "string values must be quoted, expected literal string",
                "expected a value; a string has quotes",
            ),
            (
                "invalid boolean, expected `true`",
                "expected a value; a string has quotes",
            ),
        ] {
            assert_eq!(plain_message(message), plain);
        }
    }

    #[test]
    fn near_words_are_suggested_the_nearest_first_and_three_at_most() {
        let of = |word: &str, known: &[&'static str]| did_you_mean(word, known.iter().copied());
        assert_eq!(
            of("pres", &["pressed", "press"]),
            "; did you mean `press` or `pressed`?"
        );
        assert_eq!(of("SERVO", &["servo", "feed-hold"]), "; did you mean `servo`?");
        assert_eq!(of("moon", &["servo", "feed-hold"]), "");
        assert_eq!(nearest("ip", ["ip3", "ip1", "ip2", "ip0"]), ["ip0", "ip1", "ip2"]);
        assert_eq!(nearest("x", ["on", "y"]), [""; 0]);
        assert_eq!(nearest(&"x".repeat(300), ["x"]), [""; 0]);
    }
}
