//! Parses lines of GLOBAL, and `DIM` in GLOBAL and in programs.
//!
//! Bounds and initial values are checked by `compile::declare`.

use crate::prelude::*;

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
        let subscripts = self.sign(Sign::Open).then(|| self.bounds()).transpose()?;
        let value = self.sign(Sign::Assign).then(|| self.expression()).transpose()?;
        if value.is_none() && subscripts.is_some() {
            return Err(self.expected("\"=\"").help("an array is declared with DIM"));
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
    pub(super) fn dim(&mut self, into: &mut Vec<Declaration>) -> Result<(), Problem> {
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

    fn bounds(&mut self) -> Result<Vec<u32>, Problem> {
        let start = self.span();
        let mut list = Vec::new();
        loop {
            let bound = match self.peek() {
                Some(Token::Integer(value)) => u32::try_from(*value).ok(),
                _ => None,
            };
            list.push(bound.ok_or_else(|| self.expected("a subscript"))?);
            self.advance();
            if self.sign(Sign::Close) {
                break;
            }
            self.expect_sign(Sign::Comma)?;
        }
        if list.len() > MAX_SUBSCRIPTS {
            let found = list.len();
            let message = format!("an array has at most {MAX_SUBSCRIPTS} subscripts, found {found}");
            return Problem::fail("E0213", start.to(self.before()), message);
        }
        Ok(list)
    }

    fn kind(&mut self) -> Result<ValueKind, Problem> {
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
}
