//! Parses motion statements and their `WITH` clause.
//!
//! Where a motion leads is evaluated by `machine::request_values`; moving is left to the controller.

use crate::prelude::*;

use super::Cursor;
use crate::builtin::{self, Builtin, Condition};
use crate::diagnostic::Problem;
use crate::lexer::Sign;
use crate::tree::{Ask, Expression, MotionKind};

impl Cursor<'_> {
    pub(super) fn motion(&mut self, word: &str) -> Result<Ask, Problem> {
        let motion = match word {
            "READY" => MotionKind::Ready,
            "MOVE" => MotionKind::Ptp(self.position()?),
            "MOVES" => MotionKind::Line(self.position()?),
            "MOVEC" => MotionKind::Arc(self.positions()?),
            "MOVEJ" => MotionKind::Arch(self.positions()?),
            "MOVEA" => MotionKind::Axis(self.axis_and_value()?),
            _ => MotionKind::AxisBy(self.axis_and_value()?),
        };
        let with = self.word("WITH").then(|| self.with()).transpose()?;
        Ok(Ask::Move {
            motion,
            with: with.unwrap_or_default(),
        })
    }

    fn position(&mut self) -> Result<Expression, Problem> {
        self.expression_of(Builtin::Point)
    }

    /// Two positions; the comma between them may be left out.
    fn positions(&mut self) -> Result<[Expression; 2], Problem> {
        let first = self.position()?;
        self.sign(Sign::Comma);
        Ok([first, self.position()?])
    }

    fn axis_and_value(&mut self) -> Result<[Expression; 2], Problem> {
        let axis = self.expression()?;
        self.expect_sign(Sign::Comma)?;
        Ok([axis, self.expression()?])
    }

    fn with(&mut self) -> Result<Vec<(Condition, Expression)>, Problem> {
        let mut known = Vec::new();
        self.separated(|cursor| {
            let (word, span) = (cursor.peek_word(), cursor.span());
            if word.is_empty() {
                return Err(cursor.expected("a motion condition"));
            }
            let condition = builtin::condition(word).ok_or_else(|| {
                cursor.expected("SPEED, ACCEL, DECEL, CONFIG, PASS, ACCUR, PAYLOAD, TOOL, WORK or BASE")
            })?;
            if known.contains(&condition) {
                return Problem::fail("E0205", span, format!("{word} stands twice in one WITH"));
            }
            known.push(condition);
            cursor.advance();
            Ok((condition, cursor.setting(Some(condition))?))
        })
    }

    /// `= value` after a name, that of a motion condition if there is one.
    pub(super) fn setting(&mut self, of: Option<Condition>) -> Result<Expression, Problem> {
        self.expect_sign(Sign::Assign)?;
        match of {
            Some(Condition::Config) => self.configuration(),
            Some(condition) if condition.is_frame() => self.expression_of(Builtin::Trans),
            _ => self.expression(),
        }
    }
}
