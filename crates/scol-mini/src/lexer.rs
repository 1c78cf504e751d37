//! Cuts a line into tokens.
//!
//! Numbers get their value here; what words mean is left to the parser. A line that cannot be cut is one problem.

use crate::prelude::*;

use crate::builtin::spelling;
use crate::diagnostic::{Diagnostic, Span};
use crate::fix::Edit;
use crate::tree::Relation;

pub(crate) use crate::lines::{Line, lines};

/// Columns between the stops of a TAB.
const TAB_STOP: usize = 8;

/// A word, a number, a text or a sign.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Token {
    /// Name or keyword in upper case.
    Word(String),
    /// Digits; up to 2147483648, which only a minus sign makes valid.
    Integer(i64),
    /// Digits with a point or an exponent.
    Real(f32),
    /// The text between double quotes.
    Text(String),
    /// An operator or punctuation.
    Sign(Sign),
}

/// Operators and punctuation; an operator of two characters is one sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sign {
    Open,
    Close,
    OpenBrace,
    CloseBrace,
    Comma,
    Dot,
    Colon,
    Plus,
    Minus,
    Star,
    Slash,
    Caret,
    Assign,
    Relation(Relation),
}

/// The spellings of the signs, longer ones first.
pub(crate) const SIGNS: &[(&str, Sign)] = &[
    ("==", Sign::Relation(Relation::Equal)),
    ("<>", Sign::Relation(Relation::NotEqual)),
    ("><", Sign::Relation(Relation::NotEqual)),
    ("!=", Sign::Relation(Relation::NotEqual)),
    ("<=", Sign::Relation(Relation::LessEqual)),
    ("=<", Sign::Relation(Relation::LessEqual)),
    (">=", Sign::Relation(Relation::GreaterEqual)),
    ("=>", Sign::Relation(Relation::GreaterEqual)),
    ("(", Sign::Open),
    (")", Sign::Close),
    ("{", Sign::OpenBrace),
    ("}", Sign::CloseBrace),
    (",", Sign::Comma),
    (".", Sign::Dot),
    (":", Sign::Colon),
    ("+", Sign::Plus),
    ("-", Sign::Minus),
    ("*", Sign::Star),
    ("/", Sign::Slash),
    ("^", Sign::Caret),
    ("=", Sign::Assign),
    ("<", Sign::Relation(Relation::Less)),
    (">", Sign::Relation(Relation::Greater)),
];

/// A token and its place in the file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lexeme {
    pub token: Token,
    pub span: Span,
}

impl Sign {
    pub fn spelling(self) -> &'static str {
        spelling(SIGNS, self)
    }
}

impl Lexeme {
    /// The word this is, or nothing.
    pub fn word(&self) -> &str {
        match &self.token {
            Token::Word(text) => text,
            Token::Integer(_) | Token::Real(_) | Token::Text(_) | Token::Sign(_) => "",
        }
    }

    /// Whether it is this sign.
    pub fn is(&self, sign: Sign) -> bool {
        self.token == Token::Sign(sign)
    }
}

/// Cuts one line into tokens; a comment is left out.
pub(crate) fn tokens(source: &str, line: Span, longest: usize) -> Result<Vec<Lexeme>, Diagnostic> {
    check_characters(source, line, longest)?;
    let mut list = Vec::new();
    let mut at = line.start;
    while at < line.end {
        let rest = Span::new(at, line.end).text(source);
        if rest.starts_with(' ') {
            at += 1;
            continue;
        }
        if rest.starts_with('\'') {
            break;
        }
        let (token, length) = token(rest, at)?;
        if token == Token::Word("REMARK".into()) {
            break;
        }
        let span = Span::new(at, at + length);
        list.push(Lexeme { token, span });
        at += length;
    }
    Ok(list)
}

fn check_characters(source: &str, line: Span, longest: usize) -> Result<(), Diagnostic> {
    let text = line.text(source);
    if text.len() > longest {
        let found = text.len();
        let message = format!("the line has {found} characters; at most {longest} are allowed");
        return Diagnostic::fail("E0005", line, message);
    }
    for (at, c) in text.char_indices() {
        let start = line.start + at;
        let span = Span::new(start, start + c.len_utf8());
        if c == '\t' {
            let problem = Diagnostic::new("E0003", span, "tabs are not allowed");
            return Err(problem.help("use spaces").fix(without_tabs(source, line)));
        }
        if !c.is_ascii() {
            let message = format!("expected an ASCII character, found \"{c}\"");
            return Diagnostic::fail("E0004", span, message);
        }
        if c.is_ascii_control() {
            let message = format!("expected a printable character, found code {:02X}", u32::from(c));
            return Diagnostic::fail("E0002", span, message);
        }
    }
    Ok(())
}

/// Replaces the tabs of a line by spaces up to the next stop.
fn without_tabs(source: &str, line: Span) -> Edit {
    let text = line.text(source);
    let (first, last) = (text.find('\t').unwrap_or(0), text.rfind('\t').unwrap_or(0));
    let mut column = text.get(..first).unwrap_or_default().chars().count();
    let mut spaced = String::new();
    for c in text.get(first..=last).unwrap_or_default().chars() {
        let width = if c == '\t' {
            TAB_STOP - column % TAB_STOP
        } else {
            1
        };
        column += width;
        match c {
            '\t' => spaced.extend(core::iter::repeat_n(' ', width)),
            c => spaced.push(c),
        }
    }
    Edit::replace(Span::new(line.start + first, line.start + last + 1), spaced)
}

/// The token at the beginning of `rest` and its length in bytes.
fn token(rest: &str, at: usize) -> Result<(Token, usize), Diagnostic> {
    let first = rest.chars().next().unwrap_or(' ');
    if first.is_ascii_alphabetic() {
        return word(rest, at);
    }
    let fraction = first == '.' && rest.as_bytes().get(1).is_some_and(u8::is_ascii_digit);
    if first.is_ascii_digit() || fraction {
        return number(rest, at);
    }
    if let Some(tail) = rest.strip_prefix('"') {
        let Some((text, _)) = tail.split_once('"') else {
            let message = "expected a closing double quote, found the end of the line";
            return Diagnostic::fail("E0006", Span::new(at, at + rest.len()), message);
        };
        return Ok((Token::Text(text.to_string()), text.len() + 2));
    }
    if rest.starts_with("//") || rest.starts_with("/*") {
        let span = Span::new(at, at + 2);
        return Diagnostic::fail(
            "E0002",
            span,
            format!(
                "the sign \"{}\" has no meaning here",
                rest.get(..2).unwrap_or_default()
            ),
        );
    }
    if let Some((spelling, sign)) = SIGNS.iter().find(|(spelling, _)| rest.starts_with(spelling)) {
        return Ok((Token::Sign(*sign), spelling.len()));
    }
    let message = format!("the character \"{first}\" has no meaning here");
    Diagnostic::fail("E0002", Span::new(at, at + 1), message)
}

/// Whether a word can have this character.
pub(crate) fn is_letter(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// The word a text begins with, and what follows it.
pub(crate) fn leading_word(text: &str) -> (&str, &str) {
    let end = text.find(|c| !is_letter(c));
    text.split_at(end.unwrap_or(text.len()))
}

fn word(rest: &str, at: usize) -> Result<(Token, usize), Diagnostic> {
    let (text, tail) = leading_word(rest);
    let word = text.to_ascii_uppercase();
    if tail.starts_with('$') {
        let span = Span::new(at, at + text.len() + 1);
        let problem = Diagnostic::new("E0107", span, format!("{word}$: there are no string variables"));
        return Err(problem.help("a string between double quotes can only be an item of PRINT"));
    }
    Ok((Token::Word(word), text.len()))
}

fn number(rest: &str, at: usize) -> Result<(Token, usize), Diagnostic> {
    let bytes = rest.as_bytes();
    let digits = |from: usize| bytes.iter().skip(from).take_while(|b| b.is_ascii_digit()).count();
    let mut length = digits(0);
    let mut real = false;
    if bytes.get(length) == Some(&b'.') {
        real = true;
        length += 1;
        length += digits(length);
    }
    if matches!(bytes.get(length), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(length + 1), Some(b'+' | b'-')));
        let exponent = digits(length + 1 + sign);
        if exponent > 0 {
            real = true;
            length += 1 + sign + exponent;
        }
    }
    let text = rest.get(..length).unwrap_or_default();
    let span = Span::new(at, at + length);
    if real {
        return match text.parse::<f32>() {
            Ok(value) if value.is_finite() => Ok((Token::Real(value), length)),
            _ => Diagnostic::fail("E0007", span, format!("{text} is too large for a real")),
        };
    }
    match text.parse::<i64>() {
        Ok(value) if value <= -i64::from(i32::MIN) => Ok((Token::Integer(value), length)),
        _ => Err(too_large(text, span)),
    }
}

/// The problem of an integer beyond 32 bits.
pub(crate) fn too_large(text: &str, span: Span) -> Diagnostic {
    let message = format!("{text} is too large for an integer of 32 bits");
    Diagnostic::new("E0007", span, message).help("write it with a decimal point to make it a real")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    fn tokens_of(text: &str) -> Vec<Token> {
        tokens(text, Span::new(0, text.len()), crate::MAX_LINE)
            .unwrap()
            .into_iter()
            .map(|l| l.token)
            .collect()
    }

    #[test]
    fn numbers_words_and_signs() {
        assert_eq!(tokens_of("00000"), vec![Token::Integer(0)]);
        assert_eq!(tokens_of("1.5E+2"), vec![Token::Real(150.0)]);
        assert_eq!(
            tokens_of("p1.x"),
            vec![
                Token::Word("P1".into()),
                Token::Sign(Sign::Dot),
                Token::Word("X".into())
            ]
        );
        assert_eq!(
            tokens_of("=< ><"),
            vec![
                Token::Sign(Sign::Relation(Relation::LessEqual)),
                Token::Sign(Sign::Relation(Relation::NotEqual))
            ]
        );
        assert_eq!(tokens_of("\"it's\" ' rest"), vec![Token::Text("it's".into())]);
        assert_eq!(tokens_of("A REMARK \" % ~"), vec![Token::Word("A".into())]);
    }

    // clause: RAM-05 RAM-06 S7
    #[test]
    fn cr_lf_and_both_end_a_line_and_1a_ends_the_file() {
        let spans: Vec<(u32, &str)> = lines("a\rb\r\nc\n\nd\x1Ae\r")
            .iter()
            .map(|l| (l.number, &"a\rb\r\nc\n\nd"[l.span.start..l.span.end]))
            .collect();
        assert_eq!(spans, vec![(1, "a"), (2, "b"), (3, "c"), (4, ""), (5, "d")]);
    }
}
