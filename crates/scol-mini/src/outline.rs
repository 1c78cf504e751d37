//! A file as rows of tokens, sorted into its blocks: what lints and suggestions look at.
//!
//! It is made of tokens alone, so it also covers lines that do not parse. What a row means is not checked here.

use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::vec::Vec;

use crate::MAX_LINE;
use crate::builtin;
use crate::diagnostic::Span;
use crate::lexer::{self, Lexeme, Sign, Token};
use crate::lines::{Line, lines};
use crate::options::Arm;
use crate::tree::Name;

/// A line that holds more than a comment.
#[derive(Debug)]
pub(crate) struct Row {
    pub line: Line,
    pub label: Option<Name>,
    /// What follows the label.
    pub body: Vec<Lexeme>,
}

/// A PROGRAM block.
#[derive(Debug)]
pub(crate) struct Part {
    pub name: Option<Name>,
    pub parameters: Vec<String>,
    pub rows: Vec<Row>,
    /// Lines of its heading and of its END; a block without END reaches to the next one.
    pub first: u32,
    pub last: u32,
}

/// The blocks of a file.
#[derive(Debug, Default)]
pub(crate) struct Outline {
    pub globals: Vec<Row>,
    pub parts: Vec<Part>,
    pub data: Vec<Row>,
}

#[derive(Clone, Copy, PartialEq)]
enum Place {
    Outside,
    Global,
    Program,
    Data,
}

impl Outline {
    /// Sorts the lines of a file; lines that cannot be cut into words are left out.
    pub fn new(source: &str) -> Outline {
        let mut outline = Outline::default();
        let mut place = Place::Outside;
        for line in lines(source) {
            let Ok(tokens) = lexer::tokens(source, line, MAX_LINE) else {
                continue;
            };
            let row = Row::new(line, tokens);
            match row.head() {
                _ if row.body.is_empty() && row.label.is_none() => {}
                "END" if row.body.len() == 1 => {
                    outline.close(place, line.number);
                    place = Place::Outside;
                }
                "GLOBAL" if row.body.len() == 1 => place = Place::Global,
                "DATA" if row.body.len() == 1 => place = Place::Data,
                "PROGRAM" => {
                    outline.parts.push(Part::new(&row));
                    place = Place::Program;
                }
                _ => match place {
                    Place::Global => outline.globals.push(row),
                    Place::Data => outline.data.push(row),
                    Place::Program => outline.program_row(row),
                    Place::Outside => {}
                },
            }
        }
        outline
    }

    fn program_row(&mut self, row: Row) {
        if let Some(part) = self.parts.last_mut() {
            part.last = row.line.number;
            part.rows.push(row);
        }
    }

    fn close(&mut self, place: Place, line: u32) {
        if let Some(part) = self.parts.last_mut().filter(|_| place == Place::Program) {
            part.last = line;
        }
    }

    /// The program that holds this line.
    pub fn part_of(&self, line: u32) -> Option<&Part> {
        self.parts
            .iter()
            .find(|part| part.first <= line && line <= part.last)
    }

    /// Names of GLOBAL and DATA and where each is declared first.
    pub fn shared(&self) -> BTreeMap<&str, Span> {
        let mut names = BTreeMap::new();
        for name in self.globals.iter().flat_map(Row::declared) {
            names.entry(name.0).or_insert(name.1);
        }
        for (name, span) in self.data.iter().filter_map(Row::datum) {
            names.entry(name).or_insert(span);
        }
        names
    }
}

impl Part {
    fn new(row: &Row) -> Part {
        let mut words = row.body.iter().skip(1).filter_map(|lexeme| {
            let Token::Word(text) = &lexeme.token else {
                return None;
            };
            let (text, span) = (text.clone(), lexeme.span);
            Some(Name { text, span })
        });
        Part {
            name: words.next(),
            parameters: words.map(|name| name.text).collect(),
            rows: Vec::new(),
            first: row.line.number,
            last: row.line.number,
        }
    }

    /// Names that `DIM` declares here.
    pub fn dims(&self) -> impl Iterator<Item = (&str, Span)> {
        self.rows
            .iter()
            .filter(|row| row.head() == "DIM")
            .flat_map(Row::declared)
    }
}

impl Row {
    fn new(line: Line, mut tokens: Vec<Lexeme>) -> Row {
        let mut label = None;
        if let [first, colon, ..] = tokens.as_slice()
            && let (Token::Word(text), Token::Sign(Sign::Colon)) = (&first.token, &colon.token)
        {
            label = Some(Name {
                text: text.clone(),
                span: first.span,
            });
            tokens.drain(..2);
        }
        Row {
            line,
            label,
            body: tokens,
        }
    }

    /// The first word after the label, or nothing.
    pub fn head(&self) -> &str {
        word(self.body.first())
    }

    /// The statements of the row: the whole of a plain one; of an `IF` its condition and what depends on it.
    pub fn segments(&self) -> impl Iterator<Item = &[Lexeme]> {
        self.body
            .split(|lexeme| matches!(word(Some(lexeme)), "THEN" | "ELSE" | "DO"))
    }

    /// Names that a line of GLOBAL, or a `DIM`, declares.
    fn declared(&self) -> Vec<(&str, Span)> {
        let mut depth = 0;
        let mut names = Vec::new();
        for (at, lexeme) in self.body.iter().enumerate() {
            let begins = at == 0
                || word(self.body.get(at - 1)) == "DIM"
                || sign(self.body.get(at - 1)) == Some(Sign::Comma);
            match &lexeme.token {
                Token::Sign(Sign::Assign) => break,
                Token::Sign(Sign::Open) => depth += 1,
                Token::Sign(Sign::Close) => depth -= 1,
                Token::Word(text) if depth == 0 && begins && text != "DIM" => {
                    names.push((text.as_str(), lexeme.span));
                }
                Token::Word(_) | Token::Sign(_) | Token::Integer(_) | Token::Real(_) | Token::Text(_) => {}
            }
        }
        names
    }

    /// The kind of a line of DATA, as a word; a line that begins with the name is a POINT.
    pub fn datum_word(&self) -> &str {
        match sign(self.body.get(1)) {
            Some(Sign::Assign) => "POINT",
            _ => self.head(),
        }
    }

    /// The name of a line of DATA that is no WORK.
    pub fn datum(&self) -> Option<(&str, Span)> {
        let bare = sign(self.body.get(1)) == Some(Sign::Assign);
        let named = self
            .body
            .get(usize::from(!bare))
            .filter(|_| self.head() != "WORK")?;
        Some((word(Some(named)), named.span)).filter(|(name, _)| !name.is_empty())
    }
}

/// Names of the channels a source prints on, each once; `PRINT` without a channel is on `TP`.
#[must_use]
pub fn print_channels(source: &str) -> Vec<&'static str> {
    const CHANNELS: &[&str] = &["TP", "COM1", "IP1", "IP2"];
    let outline = Outline::new(source);
    let rows = outline.parts.iter().flat_map(|part| &part.rows);
    let mut found: Vec<&'static str> = Vec::new();
    for segment in rows.flat_map(Row::segments) {
        if word(segment.first()) != "PRINT" {
            continue;
        }
        let named = word(segment.get(1));
        let channel = CHANNELS
            .iter()
            .find(|channel| **channel == named)
            .unwrap_or(&"TP");
        if !found.contains(channel) {
            found.push(channel);
        }
    }
    found
}

/// Whether a source starts tasks.
#[must_use]
pub fn starts_tasks(source: &str) -> bool {
    let outline = Outline::new(source);
    let mut rows = outline.parts.iter().flat_map(|part| &part.rows);
    rows.any(|row| row.body.iter().any(|lexeme| word(Some(lexeme)) == "TASK"))
}

/// The word this is, or nothing.
pub(crate) fn word(lexeme: Option<&Lexeme>) -> &str {
    match lexeme.map(|lexeme| &lexeme.token) {
        Some(Token::Word(text)) => text,
        _ => "",
    }
}

/// The sign this is.
pub(crate) fn sign(lexeme: Option<&Lexeme>) -> Option<Sign> {
    let Token::Sign(sign) = lexeme?.token else {
        return None;
    };
    Some(sign)
}

/// The names among tokens: words that are not reserved and no letter of a coordinate.
pub(crate) fn names(tokens: &[Lexeme], arm: Arm) -> impl Iterator<Item = (&str, Span)> {
    tokens.iter().enumerate().filter_map(move |(at, lexeme)| {
        let letter = at > 0 && sign(tokens.get(at - 1)) == Some(Sign::Dot);
        let text = word(Some(lexeme));
        let named = !text.is_empty() && !letter && !builtin::is_reserved(text, arm);
        named.then_some((text, lexeme.span))
    })
}
