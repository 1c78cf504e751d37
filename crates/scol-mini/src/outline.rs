//! A file as rows of tokens, sorted into its blocks, for lints and suggestions.
//!
//! It is made of tokens alone, so it also covers lines that do not parse. What a row means is not checked here.

use crate::prelude::*;
use alloc::collections::{BTreeMap, BTreeSet};

use crate::MAX_LINE;
use crate::builtin;
use crate::diagnostic::Span;
use crate::lexer::{self, Lexeme, Line, Sign, Token, lines};
use crate::options::Arm;
use crate::tree::Name;

/// Part of a file to which a line belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Place {
    Outside,
    Global,
    Program,
    Data,
}

/// A line that holds more than a comment.
#[derive(Debug)]
pub(crate) struct Row {
    pub line: Line,
    pub label: Option<Name>,
    /// Lexemes after the label.
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

impl Outline {
    /// Sorts the lines of a file; lines that cannot be cut into words are left out.
    pub fn new(source: &str) -> Outline {
        let mut outline = Outline::default();
        let mut place = Place::Outside;
        for line in lines(source) {
            let Ok(tokens) = lexer::tokens(source, line.span, MAX_LINE) else {
                continue;
            };
            let row = Row::new(line, tokens);
            if row.body.is_empty() && row.label.is_none() {
                continue;
            }
            let part = outline.parts.last_mut().filter(|_| place == Place::Program);
            match row.head() {
                "END" if row.body.len() == 1 => {
                    part.into_iter().for_each(|part| part.last = line.number);
                    place = Place::Outside;
                }
                "GLOBAL" if row.body.len() == 1 => place = Place::Global,
                "DATA" if row.body.len() == 1 => place = Place::Data,
                "PROGRAM" => {
                    outline.parts.push(Part::new(&row));
                    place = Place::Program;
                }
                _ => match (place, part) {
                    (Place::Global, _) => outline.globals.push(row),
                    (Place::Data, _) => outline.data.push(row),
                    (Place::Program, Some(part)) => {
                        part.last = line.number;
                        part.rows.push(row);
                    }
                    (Place::Program, None) | (Place::Outside, _) => {}
                },
            }
        }
        outline
    }

    /// The program that holds this line.
    pub fn part_of(&self, line: u32) -> Option<&Part> {
        let mut parts = self.parts.iter();
        parts.find(|part| (part.first..=part.last).contains(&line))
    }

    /// Names of GLOBAL and DATA and where each is declared first.
    pub fn shared(&self) -> BTreeMap<&str, Span> {
        let globals = self.globals.iter().flat_map(Row::declared);
        let mut names = BTreeMap::new();
        for (name, span) in globals.chain(self.data.iter().filter_map(Row::datum)) {
            names.entry(name).or_insert(span);
        }
        names
    }
}

impl Part {
    fn new(row: &Row) -> Part {
        let words = row.body.iter().skip(1).filter(|lexeme| !lexeme.word().is_empty());
        let mut words = words.map(|lexeme| Name::new(lexeme.word(), lexeme.span));
        Part {
            name: words.next(),
            parameters: words.map(|name| name.text).collect(),
            rows: Vec::new(),
            first: row.line.number,
            last: row.line.number,
        }
    }

    /// Name of the program; empty where the heading has none.
    pub fn name(&self) -> &str {
        self.name.as_ref().map_or("", |name| &name.text)
    }

    pub fn has_parameter(&self, name: &str) -> bool {
        self.parameters.iter().any(|parameter| parameter == name)
    }

    /// Names that `DIM` declares here.
    pub fn dims(&self) -> impl Iterator<Item = (&str, Span)> {
        let dims = self.rows.iter().filter(|row| row.head() == "DIM");
        dims.flat_map(Row::declared)
    }

    /// The row that this label begins.
    pub fn labelled(&self, label: &str) -> Option<&Row> {
        let mut rows = self.rows.iter();
        rows.find(|row| row.label.as_ref().is_some_and(|known| known.text == label))
    }
}

impl Row {
    fn new(line: Line, mut tokens: Vec<Lexeme>) -> Row {
        let mut label = None;
        if let [first, colon, ..] = tokens.as_slice()
            && !first.word().is_empty()
            && colon.is(Sign::Colon)
        {
            label = Some(Name::new(first.word(), first.span));
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
        let joints = |lexeme: &Lexeme| matches!(lexeme.word(), "THEN" | "ELSE" | "DO");
        self.body.split(joints)
    }

    /// Names that a line of GLOBAL, or a `DIM`, declares.
    fn declared(&self) -> Vec<(&str, Span)> {
        let mut depth = 0;
        let mut names = Vec::new();
        for (at, lexeme) in self.body.iter().enumerate() {
            let before = at.checked_sub(1).and_then(|at| self.body.get(at));
            let begins = before.is_none_or(|before| before.word() == "DIM" || before.is(Sign::Comma));
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

    /// Whether it is a line of DATA that begins with the name.
    fn is_bare(&self) -> bool {
        self.body.get(1).is_some_and(|lexeme| lexeme.is(Sign::Assign))
    }

    /// The kind of a line of DATA, as a word; a line that begins with the name is a POINT.
    pub fn datum_word(&self) -> &str {
        if self.is_bare() { "POINT" } else { self.head() }
    }

    /// The name of a line of DATA other than WORK.
    pub fn datum(&self) -> Option<(&str, Span)> {
        let named = self.body.get(usize::from(!self.is_bare()))?;
        let is_datum = self.head() != "WORK" && !named.word().is_empty();
        is_datum.then_some((named.word(), named.span))
    }
}

/// Names of the channels a source prints on, each once; `PRINT` without a channel is on `TP`.
pub fn print_channels(source: &str) -> BTreeSet<&'static str> {
    const CHANNELS: [&str; 3] = ["COM1", "IP1", "IP2"];
    let outline = Outline::new(source);
    let rows = outline.parts.iter().flat_map(|part| &part.rows);
    let segments = rows.flat_map(Row::segments);
    let prints = segments.filter(|segment| word(segment.first()) == "PRINT");
    let named = prints.map(|segment| word(segment.get(1)));
    let channels = named.map(|named| CHANNELS.into_iter().find(|channel| *channel == named));
    channels.map(|channel| channel.unwrap_or("TP")).collect()
}

/// Whether a source starts tasks.
pub fn starts_tasks(source: &str) -> bool {
    let outline = Outline::new(source);
    let mut rows = outline.parts.iter().flat_map(|part| &part.rows);
    rows.any(|row| row.body.iter().any(|lexeme| lexeme.word() == "TASK"))
}

/// The word this is, or nothing.
pub(crate) fn word(lexeme: Option<&Lexeme>) -> &str {
    lexeme.map_or("", Lexeme::word)
}

/// The sign this is.
pub(crate) fn sign(lexeme: Option<&Lexeme>) -> Option<Sign> {
    let Token::Sign(sign) = lexeme?.token else {
        return None;
    };
    Some(sign)
}

/// The names among tokens: words that are neither reserved nor the letter of a coordinate.
pub(crate) fn names(tokens: &[Lexeme], arm: Arm) -> impl Iterator<Item = (&str, Span)> {
    tokens.iter().enumerate().filter_map(move |(at, lexeme)| {
        let letter = at > 0 && sign(tokens.get(at - 1)) == Some(Sign::Dot);
        let text = word(Some(lexeme));
        let named = !text.is_empty() && !letter && !builtin::is_reserved(text, arm);
        named.then_some((text, lexeme.span))
    })
}
