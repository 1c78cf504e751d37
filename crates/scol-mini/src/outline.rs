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
    pub parameters: Vec<Name>,
    pub rows: Vec<Row>,
    /// Lines of its heading and of its END; a block without END reaches to the next one.
    pub first: u32,
    pub last: u32,
}

/// GLOBAL or DATA: the lines of its heading and of its END; a block without END reaches to its last row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Region {
    pub heading: Span,
    pub first: u32,
    pub last: u32,
}

impl Region {
    fn new(heading: &Row) -> Region {
        let Line { number, span } = heading.line;
        let word = heading.body.first();
        Region {
            heading: word.map_or(span, |word| word.span),
            first: number,
            last: number,
        }
    }
}

/// The blocks of a file.
#[derive(Debug, Default)]
pub(crate) struct Outline {
    pub global_region: Option<Region>,
    pub data_region: Option<Region>,
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
            match row.head() {
                "END" if row.body.len() == 1 => {
                    outline.reach(place, line.number);
                    outline.label_at_end(place, row);
                    place = Place::Outside;
                }
                "GLOBAL" if row.body.len() == 1 => {
                    outline.global_region.get_or_insert(Region::new(&row));
                    place = Place::Global;
                }
                "DATA" if row.body.len() == 1 => {
                    outline.data_region.get_or_insert(Region::new(&row));
                    place = Place::Data;
                }
                "PROGRAM" => {
                    outline.parts.push(Part::new(&row));
                    place = Place::Program;
                }
                _ => {
                    outline.reach(place, line.number);
                    if let Some(rows) = outline.rows_of(place) {
                        rows.push(row);
                    }
                }
            }
        }
        outline
    }

    /// The present block holds this line.
    fn reach(&mut self, place: Place, line: u32) {
        let last = match place {
            Place::Outside => None,
            Place::Global => self.global_region.as_mut().map(|region| &mut region.last),
            Place::Data => self.data_region.as_mut().map(|region| &mut region.last),
            Place::Program => self.parts.last_mut().map(|part| &mut part.last),
        };
        if let Some(last) = last {
            *last = line;
        }
    }

    /// The rows of the present block.
    fn rows_of(&mut self, place: Place) -> Option<&mut Vec<Row>> {
        match place {
            Place::Outside => None,
            Place::Global => Some(&mut self.globals),
            Place::Data => Some(&mut self.data),
            Place::Program => self.parts.last_mut().map(|part| &mut part.rows),
        }
    }

    /// Keeps the label of a line like `OUT: END`, which is a place to jump to.
    fn label_at_end(&mut self, place: Place, mut row: Row) {
        if place == Place::Program && row.label.is_some() {
            row.body.clear();
            if let Some(rows) = self.rows_of(place) {
                rows.push(row);
            }
        }
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
            parameters: words.collect(),
            rows: Vec::new(),
            first: row.line.number,
            last: row.line.number,
        }
    }

    /// Its heading without PROGRAM: `NAME(A, B)`.
    pub fn heading(&self) -> String {
        let parameters = self.parameters.iter().map(|parameter| parameter.text.as_str());
        format!("{}({})", self.name(), parameters.collect::<Vec<_>>().join(", "))
    }

    /// Name of the program; empty where the heading has none.
    pub fn name(&self) -> &str {
        self.name.as_ref().map_or("", |name| &name.text)
    }

    pub fn has_parameter(&self, name: &str) -> bool {
        self.parameters.iter().any(|parameter| parameter.text == name)
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
    pub fn declared(&self) -> Vec<(&str, Span)> {
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

/// Name of a program as the string of TASK has it: blanks do not count (scol.md 3.7).
pub(crate) fn task_name(text: &str) -> String {
    let letters = text.chars().filter(|letter| *letter != ' ');
    letters.collect::<String>().to_ascii_uppercase()
}

/// Names of the programs that `TASK("NAME")` starts, and their places within the quotes.
pub(crate) fn tasks(segment: &[Lexeme]) -> impl Iterator<Item = (String, Span)> {
    segment.windows(3).filter_map(|window| match window {
        [
            task,
            _,
            Lexeme {
                token: Token::Text(name),
                span,
            },
        ] if task.word() == "TASK" => Some((
            task_name(name),
            Span::new(span.start + 1, span.end.saturating_sub(1)),
        )),
        _ => None,
    })
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

/// The first file line of the PROGRAM blocks of a source in which another one differs. Comments do not count, nor do the blocks
/// GLOBAL and DATA: a controller writes values into them.
pub fn first_difference(source: &str, other: &str) -> Option<u32> {
    let (these, those) = (code_lines(source), code_lines(other));
    let most = these.len().max(those.len());
    let place = (0..most).find(|at| these.get(*at) != those.get(*at))?;
    let found = these.get(place).or(those.get(place));
    found.map(|(line, _)| *line)
}

/// The lines of the PROGRAM blocks in file order, each with its text from the first word to the last.
fn code_lines(source: &str) -> Vec<(u32, String)> {
    let outline = Outline::new(source);
    let lines = outline.parts.iter().flat_map(|part| {
        let rows = part.rows.iter().map(|row| {
            let first = row.label.as_ref().map(|label| label.span);
            let first = first.or(row.body.first().map(|lexeme| lexeme.span));
            let last = row.body.last().map(|lexeme| lexeme.span).or(first);
            let text = first
                .zip(last)
                .and_then(|(first, last)| source.get(first.start..last.end));
            (row.line.number, String::from(text.unwrap_or_default()))
        });
        let heading = (part.first, part.heading());
        [heading]
            .into_iter()
            .chain(rows)
            .chain([(part.last, String::new())])
    });
    lines.collect()
}

/// Numbers of the inputs that a source reads, where DIN has them as figures.
pub fn input_lines(source: &str) -> BTreeSet<u16> {
    let outline = Outline::new(source);
    let rows = outline.parts.iter().flat_map(|part| &part.rows);
    let bodies: Vec<&[Lexeme]> = rows.map(|row| row.body.as_slice()).collect();
    let heads = bodies.iter().flat_map(|body| {
        let heads = body
            .iter()
            .enumerate()
            .filter(|(_, lexeme)| lexeme.word() == "DIN");
        heads.map(|(at, _)| body.get(at + 1..).unwrap_or_default())
    });
    let listed = heads.flat_map(|rest| rest.iter().take_while(|lexeme| !lexeme.is(Sign::Close)));
    let numbers = listed.filter_map(|lexeme| {
        let Token::Integer(number) = lexeme.token else {
            return None;
        };
        u16::try_from(number).ok()
    });
    numbers.collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str =
        "GLOBAL\n  N = 0\nEND\nPROGRAM MAIN\n  N = 1 ' one\n\n  DELAY N\nEND\nDATA\n  A = 1\nEND\n";

    #[test]
    fn a_difference_is_one_of_statements_and_their_lines() {
        for (from, to, line) in [
            ("N = 0", "N = 7", None),
            ("A = 1", "A = 2\n  B = 3", None),
            ("' one", "' another", None),
            ("\n\n", "\n' between\n", None),
            ("N = 1", "N = 2", Some(5)),
            ("\n\n", "\n", Some(6)),
            ("N = 0", "N = 0\n  M = 0", Some(5)),
            ("MAIN", "PICK", Some(4)),
            ("  DELAY N\n", "", Some(7)),
            ("DELAY N\n", "DELAY N\n  STOP\n", Some(8)),
        ] {
            let other = SOURCE.replacen(from, to, 1);
            assert_eq!(first_difference(&other, SOURCE), line, "{to}");
            assert_eq!(first_difference(&other.replace('\n', "\r"), SOURCE), line, "{to}");
        }
    }
}
