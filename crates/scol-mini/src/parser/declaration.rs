//! Parses what declares variables: lines of GLOBAL, `DIM` in GLOBAL and in programs, and lines of DATA, which are positions,
//! coordinates and loads.
//!
//! Bounds and initial values are checked by `compile::declare`, which makes the variables; the table of taught points has its
//! own reader (`points`).

use crate::prelude::*;

use super::{Cursor, Datum, Declaration};
use crate::builtin;
use crate::diagnostic::Diagnostic;
use crate::lexer::{Sign, Token};
use crate::options::Arm;
use crate::value::{Configuration, ValueKind};
use crate::{MAX_DATA_NAME, MAX_SUBSCRIPTS};

impl Cursor<'_> {
    /// A line of GLOBAL: `DIM`, `name = value` or a bare name.
    pub(super) fn global_line(&mut self, into: &mut Vec<Declaration>) -> Result<(), Diagnostic> {
        let line = self.span();
        if self.word("DIM") {
            return self.dim(into);
        }
        let name = self.name("a variable, DIM or END")?;
        let subscripts = self.sign(Sign::Open).then(|| self.bounds()).transpose()?;
        let value = self.sign(Sign::Assign).then(|| self.expression()).transpose()?;
        if value.is_none() && subscripts.is_some() {
            return Err(self.expected("\"=\"").help("declare an array with DIM"));
        }
        self.end_of_line()?;
        let line = line.to(self.before());
        into.push(Declaration {
            name,
            subscripts: subscripts.unwrap_or_default(),
            dim: false,
            kind: None,
            value,
            line,
        });
        Ok(())
    }

    /// `DIM name(n, m) AS kind, ...` with the cursor after DIM.
    pub(super) fn dim(&mut self, into: &mut Vec<Declaration>) -> Result<(), Diagnostic> {
        let start = self.before();
        let list = self.separated(|cursor| {
            let name = cursor.name("a variable")?;
            let subscripts = cursor.sign(Sign::Open).then(|| cursor.bounds()).transpose()?;
            Ok(Declaration {
                name,
                subscripts: subscripts.unwrap_or_default(),
                dim: true,
                kind: cursor.word("AS").then(|| cursor.kind()).transpose()?,
                value: None,
                line: start,
            })
        })?;
        self.end_of_line()?;
        let line = start.to(self.before());
        let list = list.into_iter();
        into.extend(list.map(|declaration| Declaration { line, ..declaration }));
        Ok(())
    }

    fn bounds(&mut self) -> Result<Vec<u32>, Diagnostic> {
        let start = self.span();
        let list = self.separated(|cursor| {
            let bound = match cursor.peek() {
                Some(Token::Integer(value)) => u32::try_from(*value).ok(),
                _ => None,
            };
            let bound = bound.ok_or_else(|| cursor.expected("a subscript"))?;
            cursor.advance();
            Ok(bound)
        })?;
        self.close(Sign::Close)?;
        if list.len() > MAX_SUBSCRIPTS {
            let found = list.len();
            let message = format!("an array has at most {MAX_SUBSCRIPTS} subscripts, found {found}");
            return Diagnostic::fail("E0213", start.to(self.before()), message);
        }
        Ok(list)
    }

    fn kind(&mut self) -> Result<ValueKind, Diagnostic> {
        let kind = match self.peek_word() {
            "INTEGER" => ValueKind::Integer,
            "REAL" => ValueKind::Real,
            "PAYLOAD" => ValueKind::Load,
            "TRANS" => ValueKind::Coordinate,
            "POINT" => ValueKind::Position,
            _ => return Err(self.expected("INTEGER, REAL, POINT, TRANS or PAYLOAD")),
        };
        self.advance();
        Ok(kind)
    }

    /// A line of DATA other than WORK.
    pub(super) fn datum(&mut self) -> Result<Datum, Diagnostic> {
        // Tools of the maker leave the word POINT out (scol.md 13.15).
        let bare = self.peek_at(1) == Some(&Token::Sign(Sign::Assign));
        let word = self.peek_word();
        let reserved = builtin::is_reserved(word, self.arm);
        let kind = match word {
            "POINT" => ValueKind::Position,
            "TRANS" => ValueKind::Coordinate,
            "PAYLOAD" => ValueKind::Load,
            _ if bare && !reserved && !word.is_empty() => ValueKind::Position,
            _ => return Err(self.expected("POINT, TRANS, PAYLOAD, WORK or END")),
        };
        if reserved {
            self.advance();
        }
        let name = self.name("a name")?;
        if name.text.len() > MAX_DATA_NAME {
            let found = name.text.len();
            let message = format!("a name of DATA has at most {MAX_DATA_NAME} characters, found {found}");
            return Diagnostic::fail("E0403", name.span, message);
        }
        self.expect_sign(Sign::Assign)?;
        let start = self.span();
        let braced = kind == ValueKind::Load && self.sign(Sign::OpenBrace);
        let numbers = self.numbers(kind)?;
        if braced {
            self.expect_sign(Sign::CloseBrace)?;
        }
        let posture = (kind == ValueKind::Position).then(|| self.posture());
        let config = posture.transpose()?.unwrap_or_default();
        self.end_of_line()?;
        Ok(Datum {
            name,
            kind,
            numbers,
            config,
            work: None,
            value: start.to(self.before()),
        })
    }

    /// Numbers separated by commas, each of which may be left out and then is 0 (DATA-03).
    fn numbers(&mut self, kind: ValueKind) -> Result<Vec<f64>, Diagnostic> {
        let (start, most) = (self.span(), kind.width(self.arm));
        let numbers = self.separated(|cursor| Ok(cursor.number()?.unwrap_or(0.0)))?;
        if numbers.len() > most {
            let (data, found) = (kind.description(), numbers.len());
            let message = format!("{data} takes at most {most} numbers, found {found}");
            return Diagnostic::fail("E0401", start.to(self.before()), message);
        }
        Ok(numbers)
    }

    fn number(&mut self) -> Result<Option<f64>, Diagnostic> {
        let negative = self.sign(Sign::Minus);
        let signed = negative || self.sign(Sign::Plus);
        let span = self.span();
        match self.peek() {
            Some(Token::Integer(_) | Token::Real(_)) => self.advance(),
            _ if signed => return Err(self.expected("a number")),
            _ => return Ok(None),
        }
        // The digits are read again: DATA holds more of them than a real of 32 bits keeps.
        let text = span.text(self.source);
        let Ok(value) = text.parse::<f64>() else {
            return Diagnostic::fail("E0007", span, format!("{text} is not a number"));
        };
        Ok(Some(if negative { -value } else { value }))
    }

    /// Reads the configuration of a position after its slash: nothing, digits, or on a SCARA a word.
    fn posture(&mut self) -> Result<Configuration, Diagnostic> {
        let slash = self.sign(Sign::Slash);
        let span = self.span();
        let number = match self.peek() {
            None => return Ok(Configuration::default()),
            Some(_) if !slash => return Err(self.expected("\",\", \"/\" or the end of the line")),
            Some(Token::Integer(number)) => Some(*number).filter(|_| span.end - span.start <= 5),
            Some(Token::Word(word)) => builtin::configuration(word, self.arm).map(i64::from),
            Some(_) => None,
        };
        let config = number.and_then(|number| Configuration::listed(self.arm, number));
        let config = config.ok_or_else(|| {
            let expected = match self.arm {
                Arm::SixAxis => "a configuration of up to five digits 0 to 2",
                Arm::Scara => "LEFTY, RIGHTY, FREE or a digit 0 to 2",
            };
            Diagnostic {
                code: "E0402",
                ..self.expected(expected)
            }
        })?;
        self.advance();
        Ok(config)
    }
}
