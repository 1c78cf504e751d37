//! Parses lines of DATA: positions, coordinates, loads, and the coordinate system of the next position.
//!
//! Making variables of them is left to `compile::declare`; the table of taught points has its own reader (`points`).

use crate::prelude::*;

use super::{Cursor, Datum};
use crate::MAX_DATA_NAME;
use crate::builtin;
use crate::diagnostic::Problem;
use crate::lexer::{Sign, Token};
use crate::options::Arm;
use crate::tree::Name;
use crate::value::{Configuration, ValueKind};

/// What a line of DATA says.
pub(super) enum DataLine {
    Datum(Datum),
    /// The coordinate system of the next position (DATA-09).
    Work(Name),
}

impl Cursor<'_> {
    /// A line of DATA.
    pub(super) fn data_line(&mut self) -> Result<DataLine, Problem> {
        // Tools of the maker leave the word POINT out (scol.md 13.15).
        let bare = self.peek_at(1) == Some(&Token::Sign(Sign::Assign));
        let word = self.peek_word();
        let reserved = builtin::is_reserved(word, self.arm);
        let kind = match word {
            "POINT" => ValueKind::Position,
            "TRANS" => ValueKind::Coordinate,
            "PAYLOAD" => ValueKind::Load,
            "WORK" => {
                self.advance();
                let name = self.name("the name of coordinate data")?;
                self.end_of_line()?;
                return Ok(DataLine::Work(name));
            }
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
            return Problem::fail("E0403", name.span, message);
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
        Ok(DataLine::Datum(Datum {
            name,
            kind,
            numbers,
            config,
            work: None,
            value: start.to(self.before()),
        }))
    }

    /// Numbers separated by commas, each of which may be left out and then is 0 (DATA-03).
    fn numbers(&mut self, kind: ValueKind) -> Result<Vec<f64>, Problem> {
        let (start, most) = (self.span(), kind.width(self.arm));
        let numbers = self.separated(|cursor| Ok(cursor.number()?.unwrap_or(0.0)))?;
        if numbers.len() > most {
            let (data, found) = (kind.description(), numbers.len());
            let message = format!("{data} takes at most {most} numbers, found {found}");
            return Problem::fail("E0401", start.to(self.before()), message);
        }
        Ok(numbers)
    }

    fn number(&mut self) -> Result<Option<f64>, Problem> {
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
            return Problem::fail("E0007", span, format!("{text} is not a number"));
        };
        Ok(Some(if negative { -value } else { value }))
    }

    /// What follows the slash of a position: nothing, digits, or on a SCARA a word.
    fn posture(&mut self) -> Result<Configuration, Problem> {
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
            Problem {
                code: "E0402",
                ..self.expected(expected)
            }
        })?;
        self.advance();
        Ok(config)
    }
}
