//! Parses motion statements and their `WITH` clause.
//!
//! Where a motion leads is evaluated by `machine::request_values`; moving is left to the controller.

use alloc::format;
use alloc::vec::Vec;

use super::Cursor;
use crate::builtin::{self, Builtin};
use crate::conditions::Condition;
use crate::diagnostic::Problem;
use crate::lexer::{Sign, Token};
use crate::tree::{Expression, MotionKind, Simple, Statement};

impl Cursor<'_> {
    pub(super) fn motion(&mut self, word: &str) -> Result<Statement, Problem> {
        self.advance();
        let motion = match word {
            "READY" => MotionKind::Ready,
            "MOVE" => MotionKind::Ptp(self.position()?),
            "MOVES" => MotionKind::Line(self.position()?),
            "MOVEC" => {
                let via = self.position()?;
                self.sign(Sign::Comma);
                MotionKind::Arc(via, self.position()?)
            }
            "MOVEJ" => {
                let end = self.position()?;
                self.sign(Sign::Comma);
                MotionKind::Arch(end, self.position()?)
            }
            _ => {
                let axis = self.expression()?;
                self.expect_sign(Sign::Comma, ",")?;
                let value = self.expression()?;
                if word == "MOVEA" {
                    MotionKind::Axis(axis, value)
                } else {
                    MotionKind::AxisBy(axis, value)
                }
            }
        };
        let with = if self.word("WITH") {
            self.with()?
        } else {
            Vec::new()
        };
        Ok(Statement::Simple(Simple::Move { motion, with }))
    }

    fn position(&mut self) -> Result<Expression, Problem> {
        self.expression_of(Builtin::Point)
    }

    fn with(&mut self) -> Result<Vec<(Condition, Expression)>, Problem> {
        let mut list: Vec<(Condition, Expression)> = Vec::new();
        loop {
            let span = self.span();
            let Some(Token::Word(word)) = self.peek() else {
                return Err(self.expected("a motion condition"));
            };
            let Some(condition) = builtin::condition(word) else {
                return Err(
                    self.expected("SPEED, ACCEL, DECEL, CONFIG, PASS, ACCUR, PAYLOAD, TOOL, WORK or BASE")
                );
            };
            if list.iter().any(|(known, _)| *known == condition) {
                return Err(Problem::new(
                    "E0205",
                    span,
                    format!("{word} stands twice in one WITH"),
                ));
            }
            list.push((condition, self.setting(Some(condition))?));
            if !self.sign(Sign::Comma) {
                return Ok(list);
            }
        }
    }

    /// `NAME = value` with the cursor on the name, that of a motion condition if there is one.
    pub(super) fn setting(&mut self, of: Option<Condition>) -> Result<Expression, Problem> {
        self.advance();
        self.expect_sign(Sign::Assign, "=")?;
        match of {
            Some(Condition::Config) => self.configuration(),
            Some(condition) if condition.is_frame() => self.expression_of(Builtin::Trans),
            _ => self.expression(),
        }
    }
}
