//! Parses lines of DATA: positions, coordinates, loads, and the coordinate system of the next position.
//!
//! Making variables of them is left to `compile::declare`; the table of taught points has its own reader (`points`).

use alloc::format;
use alloc::vec::Vec;

use super::{Cursor, Datum};
use crate::MAX_DATA_NAME;
use crate::builtin;
use crate::diagnostic::{Problem, Span};
use crate::lexer::{Sign, Token};
use crate::options::Arm;
use crate::tree::Name;
use crate::value::{Configuration, Payload, Trans, ValueKind, coordinates};

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
        let kind = match self.peek() {
            Some(Token::Word(word)) if bare && !builtin::is_reserved(word, self.arm) => ValueKind::Position,
            Some(Token::Word(word)) => match word.as_str() {
                "POINT" => ValueKind::Position,
                "TRANS" => ValueKind::Coordinate,
                "PAYLOAD" => ValueKind::Load,
                "WORK" => {
                    self.advance();
                    let name = self.name("the name of coordinate data")?;
                    self.end_of_line()?;
                    return Ok(DataLine::Work(name));
                }
                _ => return Err(self.expected("POINT, TRANS, PAYLOAD, WORK or END")),
            },
            _ => return Err(self.expected("POINT, TRANS, PAYLOAD, WORK or END")),
        };
        if matches!(self.peek(), Some(Token::Word(word)) if builtin::is_reserved(word, self.arm)) {
            self.advance();
        }
        let name = self.name("a name")?;
        if name.text.len() > MAX_DATA_NAME {
            let message = format!(
                "a name of DATA has at most {MAX_DATA_NAME} characters, found {}",
                name.text.len()
            );
            return Err(Problem::new("E0403", name.span, message));
        }
        self.expect_sign(Sign::Assign, "=")?;
        let start = self.span();
        let braced = kind == ValueKind::Load && self.sign(Sign::OpenBrace);
        let numbers = self.numbers(self.width(kind), kind)?;
        if braced {
            self.expect_sign(Sign::CloseBrace, "}")?;
        }
        let config = if kind == ValueKind::Position {
            self.posture()?
        } else {
            Configuration::default()
        };
        self.end_of_line()?;
        let value = start.to(self.before());
        Ok(DataLine::Datum(Datum {
            name,
            kind,
            numbers,
            config,
            work: None,
            value,
        }))
    }

    fn width(&self, kind: ValueKind) -> usize {
        match kind {
            ValueKind::Position => coordinates(self.arm),
            ValueKind::Coordinate => Trans::order(self.arm).len(),
            ValueKind::Load => Payload::width(self.arm),
            ValueKind::Integer | ValueKind::Real => 1,
        }
    }

    /// Numbers separated by commas, each of which may be left out and then is 0 (DATA-03).
    fn numbers(&mut self, most: usize, kind: ValueKind) -> Result<Vec<f64>, Problem> {
        let start = self.span();
        let mut numbers = Vec::new();
        loop {
            numbers.push(self.number()?.unwrap_or(0.0));
            if !self.sign(Sign::Comma) {
                break;
            }
        }
        if numbers.len() > most {
            let message = format!(
                "{} takes at most {most} numbers, found {}",
                kind.description(),
                numbers.len()
            );
            return Err(Problem::new("E0401", start.to(self.before()), message));
        }
        Ok(numbers)
    }

    fn number(&mut self) -> Result<Option<f64>, Problem> {
        let negative = self.sign(Sign::Minus);
        let signed = negative || self.sign(Sign::Plus);
        if !matches!(self.peek(), Some(Token::Integer(_) | Token::Real(_))) {
            return if signed {
                Err(self.expected("a number"))
            } else {
                Ok(None)
            };
        }
        let span = self.span();
        self.advance();
        // The digits are read again: DATA holds more of them than a real of 32 bits keeps.
        let text = self.source.get(span.start..span.end).unwrap_or_default();
        let Ok(value) = text.parse::<f64>() else {
            return Err(Problem::new("E0007", span, format!("{text} is not a number")));
        };
        Ok(Some(if negative { -value } else { value }))
    }

    /// What follows the slash of a position: nothing, digits, or on a SCARA a word.
    fn posture(&mut self) -> Result<Configuration, Problem> {
        if !self.sign(Sign::Slash) {
            return if self.peek().is_none() {
                Ok(Configuration::default())
            } else {
                Err(self.expected("\",\", \"/\" or the end of the line"))
            };
        }
        let span = self.span();
        let number = match self.peek() {
            None => return Ok(Configuration::default()),
            Some(Token::Integer(number)) => Some(*number),
            Some(Token::Word(word)) => builtin::configuration(word, self.arm).map(i64::from),
            Some(_) => None,
        };
        let short = span.end - span.start <= 5 || matches!(self.peek(), Some(Token::Word(_)));
        match number
            .filter(|_| short)
            .and_then(|number| Configuration::listed(self.arm, number))
        {
            Some(config) => {
                self.advance();
                Ok(config)
            }
            None => Err(self.bad_posture(span)),
        }
    }

    fn bad_posture(&self, span: Span) -> Problem {
        let coordinates = match self.arm {
            Arm::SixAxis => "a configuration of up to five digits 0 to 2",
            Arm::Scara => "LEFTY, RIGHTY, FREE or a digit 0 to 2",
        };
        Problem {
            code: "E0402",
            span,
            ..self.expected(coordinates)
        }
    }
}
