//! From tokens to trees: the cursor that all parsers share, and the entry points.
//!
//! Names are not resolved here. A line with an error is dropped and the next one parsed, so one run finds the errors of all
//! lines. `file` has the layout, `statement` the statements, `expression` the expressions.

mod ask;
mod declaration;
mod expression;
mod file;
mod foreign;
mod statement;

use crate::prelude::*;
use alloc::collections::{BTreeMap, BTreeSet};

use crate::builtin::{self, Builtin};
use crate::diagnostic::{Diagnostic, Span};
use crate::lexer::{Lexeme, Sign, Token};
use crate::options::Arm;
use crate::outline::Place;
use crate::tree::{Expression, Name, Statement};
use crate::value::{Configuration, ValueKind};

pub(crate) use file::{parse_direct, parse_file};

/// A file as parsed.
#[derive(Debug, Default)]
pub(crate) struct File {
    pub globals: Vec<Declaration>,
    pub blocks: Vec<Block>,
    pub data: Vec<Datum>,
    /// The line that opens DATA.
    pub data_heading: Option<Span>,
    /// Lines that did not parse.
    pub unparsed: BTreeMap<u32, Unparsed>,
    /// Words of lines that did not parse: what they would have declared is not known, so they are not reported.
    pub suppressed: BTreeSet<String>,
}

/// A line that did not parse, and its effect on the lines after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unparsed {
    /// A line of a block.
    Inside,
    /// A line outside all blocks.
    Outside,
    /// It opens a block all the same.
    Opens(Place),
    /// It closes its block all the same.
    Closes,
    /// A FOR.
    BeginsLoop,
    /// A NEXT.
    EndsLoop,
}

/// A PROGRAM block.
#[derive(Debug, Default)]
pub(crate) struct Block {
    pub name: Name,
    pub parameters: Vec<Name>,
    pub dims: Vec<Declaration>,
    pub labels: Vec<Label>,
    pub statements: Vec<Located>,
    /// File line of its END.
    pub end_line: u32,
}

/// A label and the number of the statement that follows it.
#[derive(Debug)]
pub(crate) struct Label {
    pub name: Name,
    pub statement: usize,
}

/// A statement, its line, its place.
#[derive(Debug)]
pub(crate) struct Located {
    pub line: u32,
    pub span: Span,
    pub statement: Statement,
}

/// A line of GLOBAL, or a `DIM`.
#[derive(Debug)]
pub(crate) struct Declaration {
    pub name: Name,
    /// Upper bounds of a `DIM`, or the subscripts of an element that gets an initial value.
    pub subscripts: Vec<u32>,
    pub dim: bool,
    pub kind: Option<ValueKind>,
    pub value: Option<Expression>,
    /// The whole line without a comment.
    pub line: Span,
}

/// A line of DATA; a WORK line belongs to the position after it.
#[derive(Debug)]
pub(crate) struct Datum {
    pub name: Name,
    pub kind: ValueKind,
    /// Subscripts as written, in order.
    pub numbers: Vec<f64>,
    pub config: Configuration,
    pub work: Option<Name>,
    /// Span from after the equals sign to the end of the datum.
    pub value: Span,
}

/// Walks over the tokens of one line.
pub(crate) struct Cursor<'a> {
    pub source: &'a str,
    pub arm: Arm,
    tokens: &'a [Lexeme],
    at: usize,
    depth: usize,
    /// Vector that braces make here: load data unless the statement takes another vector.
    vector: Builtin,
}

impl<'a> Cursor<'a> {
    /// A cursor at the first of the `tokens` of one line of `source`.
    pub fn new(source: &'a str, arm: Arm, tokens: &'a [Lexeme]) -> Self {
        Self {
            source,
            arm,
            tokens,
            at: 0,
            depth: 0,
            vector: Builtin::Payload,
        }
    }

    /// The next token; `None` at the end of the line.
    pub fn peek(&self) -> Option<&'a Token> {
        self.tokens.get(self.at).map(|lexeme| &lexeme.token)
    }

    /// The token `ahead` tokens after the next one.
    pub fn peek_at(&self, ahead: usize) -> Option<&'a Token> {
        self.tokens.get(self.at + ahead).map(|lexeme| &lexeme.token)
    }

    /// The next token if it is a word, in upper case as the lexer gives it; nothing if it is none.
    pub fn peek_word(&self) -> &'a str {
        self.tokens.get(self.at).map_or("", Lexeme::word)
    }

    /// Whether the next token is this sign.
    pub fn is_next(&self, sign: Sign) -> bool {
        self.peek() == Some(&Token::Sign(sign))
    }

    /// The place of the next token, or of the end of the line.
    pub fn span(&self) -> Span {
        let end = || Span::at(self.tokens.last().map_or(0, |lexeme| lexeme.span.end));
        let next = self.tokens.get(self.at);
        next.map_or_else(end, |lexeme| lexeme.span)
    }

    /// The place of the token before.
    pub fn before(&self) -> Span {
        let before = self.at.checked_sub(1).and_then(|at| self.tokens.get(at));
        before.map_or_else(|| self.span(), |lexeme| lexeme.span)
    }

    /// Takes the next token, which the caller has looked at.
    pub fn advance(&mut self) {
        self.at += 1;
    }

    /// Takes the next token if it is this sign.
    pub fn sign(&mut self, sign: Sign) -> bool {
        let found = self.is_next(sign);
        self.at += usize::from(found);
        found
    }

    /// Takes the next token if it is this word.
    pub fn word(&mut self, word: &str) -> bool {
        let found = self.peek_word() == word;
        self.at += usize::from(found);
        found
    }

    /// Takes this sign.
    ///
    /// # Errors
    /// E0101.
    pub fn expect_sign(&mut self, sign: Sign) -> Result<(), Diagnostic> {
        let found = self.sign(sign).then_some(());
        found.ok_or_else(|| self.expected(&format!("\"{}\"", sign.spelling())))
    }

    /// Takes this word.
    ///
    /// # Errors
    /// E0101.
    pub fn expect_word(&mut self, word: &str) -> Result<(), Diagnostic> {
        self.word(word).then_some(()).ok_or_else(|| self.expected(word))
    }

    /// A name other than a word of the language. The configuration words of the other arm are free.
    ///
    /// # Errors
    /// E0101 without a word, E0208 for a word of the language; `what` says what the name is for.
    pub fn name(&mut self, what: &str) -> Result<Name, Diagnostic> {
        let (word, span) = (self.peek_word(), self.span());
        if word.is_empty() {
            return Err(self.expected(what));
        }
        if builtin::is_reserved(word, self.arm) {
            let message = format!("expected {what}, found {word}, which is a word of the language");
            return Diagnostic::fail("E0208", span, message);
        }
        self.advance();
        Ok(Name::new(word, span))
    }

    /// Checks that nothing follows.
    ///
    /// # Errors
    /// E0101 at what follows.
    pub fn end_of_line(&self) -> Result<(), Diagnostic> {
        let end = self.peek().is_none().then_some(());
        end.ok_or_else(|| self.expected("the end of the line"))
    }

    /// The problem "expected this, found the next token".
    pub fn expected(&self, what: &str) -> Diagnostic {
        let found = match self.peek() {
            None => "the end of the line".to_string(),
            Some(Token::Word(word)) => word.clone(),
            Some(Token::Text(_)) => "a string".to_string(),
            Some(_) => format!("\"{}\"", self.span().text(self.source)),
        };
        Diagnostic::new("E0101", self.span(), format!("expected {what}, found {found}"))
    }

    /// Reads one or more of `item`, with commas between them.
    ///
    /// # Errors
    /// Those of `item`.
    pub fn separated<T>(
        &mut self,
        mut item: impl FnMut(&mut Self) -> Result<T, Diagnostic>,
    ) -> Result<Vec<T>, Diagnostic> {
        let mut list = Vec::from([item(self)?]);
        while self.sign(Sign::Comma) {
            list.push(item(self)?);
        }
        Ok(list)
    }

    /// Runs `parse` one level deeper.
    ///
    /// # Errors
    /// E0104 beyond the deepest level: parsers call themselves, and a line of parentheses must not exhaust the stack.
    pub fn nested<T>(
        &mut self,
        parse: impl FnOnce(&mut Self) -> Result<T, Diagnostic>,
    ) -> Result<T, Diagnostic> {
        if self.depth >= crate::MAX_EXPRESSION_NESTING {
            let message = format!("nested more than {} deep", crate::MAX_EXPRESSION_NESTING);
            return Diagnostic::fail("E0104", self.span(), message);
        }
        self.depth += 1;
        let result = parse(self);
        self.depth -= 1;
        result
    }
}
