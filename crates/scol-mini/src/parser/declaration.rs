//! Parses lines of GLOBAL, and `DIM` in GLOBAL and in programs.
//!
//! Bounds and initial values are checked by `compile::declare`.

use alloc::format;
use alloc::vec::Vec;

use super::{Cursor, Declaration};
use crate::MAX_SUBSCRIPTS;
use crate::diagnostic::Problem;
use crate::lexer::{Sign, Token};
use crate::value::ValueKind;

impl Cursor<'_> {
    /// A line of GLOBAL: `DIM`, `name = value` or a bare name.
    pub(super) fn global_line(&mut self, into: &mut Vec<Declaration>) -> Result<(), Problem> {
        let line = self.span();
        if self.word("DIM") {
            return self.dim(into);
        }
        let name = self.name("a variable, DIM or END")?;
        let mut subscripts = Vec::new();
        if self.sign(Sign::Open) {
            subscripts = self.bounds()?;
        }
        let value = if self.sign(Sign::Assign) {
            Some(self.expression()?)
        } else if subscripts.is_empty() {
            None
        } else {
            return Err(self.expected("\"=\"").help("an array is declared with DIM"));
        };
        self.end_of_line()?;
        let line = line.to(self.before());
        into.push(Declaration {
            name,
            subscripts,
            dim: false,
            kind: None,
            value,
            line,
        });
        Ok(())
    }

    /// `DIM name(n, m) AS kind, ...` with the cursor after DIM.
    pub(super) fn dim(&mut self, into: &mut Vec<Declaration>) -> Result<(), Problem> {
        let line = self.before();
        let mut list = Vec::new();
        loop {
            let name = self.name("a variable")?;
            let subscripts = if self.sign(Sign::Open) {
                self.bounds()?
            } else {
                Vec::new()
            };
            let kind = if self.word("AS") { Some(self.kind()?) } else { None };
            list.push(Declaration {
                name,
                subscripts,
                dim: true,
                kind,
                value: None,
                line,
            });
            if !self.sign(Sign::Comma) {
                break;
            }
        }
        self.end_of_line()?;
        let line = line.to(self.before());
        into.extend(
            list.into_iter()
                .map(|declaration| Declaration { line, ..declaration }),
        );
        Ok(())
    }

    fn bounds(&mut self) -> Result<Vec<u32>, Problem> {
        let start = self.span();
        let mut list = Vec::new();
        loop {
            let Some(bound) = (match self.peek() {
                Some(Token::Integer(value)) => u32::try_from(*value).ok(),
                _ => None,
            }) else {
                return Err(self.expected("a subscript"));
            };
            self.advance();
            list.push(bound);
            if self.sign(Sign::Close) {
                break;
            }
            self.expect_sign(Sign::Comma, ",")?;
        }
        if list.len() > MAX_SUBSCRIPTS {
            let message = format!(
                "an array has at most {MAX_SUBSCRIPTS} subscripts, found {}",
                list.len()
            );
            return Err(Problem::new("E0213", start.to(self.before()), message));
        }
        Ok(list)
    }

    fn kind(&mut self) -> Result<ValueKind, Problem> {
        let kind = match self.peek() {
            Some(Token::Word(word)) => match word.as_str() {
                "INTEGER" => Some(ValueKind::Integer),
                "REAL" => Some(ValueKind::Real),
                "PAYLOAD" => Some(ValueKind::Load),
                "TRANS" => Some(ValueKind::Coordinate),
                "POINT" => Some(ValueKind::Position),
                _ => None,
            },
            _ => None,
        };
        let kind = kind.ok_or_else(|| self.expected("INTEGER, REAL, POINT, TRANS or PAYLOAD"))?;
        self.advance();
        Ok(kind)
    }
}
