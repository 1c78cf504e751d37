//! Parses statements about pulses and BCD signals, gains, monitors and tasks.
//!
//! What they ask of the world is in `machine::request_values`; plain motions are in `motion`.

use crate::prelude::*;

use super::Cursor;
use crate::conditions::AXES;
use crate::diagnostic::Problem;
use crate::lexer::{Sign, Token};
use crate::tree::{Ask, Change, Expression, Name, PerAxis, Simple, Variable};

impl Cursor<'_> {
    /// `(a, b)` with exactly so many operands, the cursor after the word.
    pub(super) fn operands<const COUNT: usize>(
        &mut self,
        word: &str,
    ) -> Result<[Expression; COUNT], Problem> {
        let start = self.before();
        self.expect_sign(Sign::Open)?;
        let list = self.list(Sign::Close)?;
        let found = list.len();
        list.try_into().map_err(|_| {
            let message = format!("{word} takes {COUNT} operands, found {found}");
            Problem::new("E0206", start.to(self.before()), message)
        })
    }

    /// `= {a, b, ...}` after the word, axis 1 first.
    pub(super) fn per_axis(&mut self, condition: PerAxis) -> Result<Simple, Problem> {
        let start = self.before();
        self.expect_sign(Sign::Assign)?;
        self.expect_sign(Sign::OpenBrace)?;
        let values = self.list(Sign::CloseBrace)?;
        if values.is_empty() || values.len() > AXES {
            let message = format!("expected 1 to {AXES} axes, found {}", values.len());
            return Problem::fail("E0206", start.to(self.before()), message);
        }
        Ok(Simple::Change(Change::PerAxis(condition, values)))
    }

    /// `RESTORE`, or with names of GLOBAL and DATA.
    pub(super) fn restore(&mut self) -> Result<Ask, Problem> {
        let names = match self.peek() {
            None => Vec::new(),
            Some(_) if self.peek_word() == "ELSE" => Vec::new(),
            Some(_) => self.separated(|cursor| cursor.name("a name of GLOBAL or DATA"))?,
        };
        Ok(Ask::Restore(names))
    }

    /// What ENABLE and DISABLE switch; without a word the monitors.
    pub(super) fn switch(&mut self, on: bool) -> Result<Simple, Problem> {
        let change = match self.peek_word() {
            "PASS" => Change::Pass(on),
            "NOWAIT" => Change::Nowait(on),
            "" | "ELSE" => return Ok(Simple::Monitors(on)),
            _ => return Err(self.expected("PASS, NOWAIT or the end of the line")),
        };
        self.advance();
        Ok(Simple::Change(change))
    }

    /// `("NAME")` after TASK; blanks in the name are ignored.
    pub(super) fn task(&mut self, target: Option<Variable>) -> Result<Ask, Problem> {
        self.expect_sign(Sign::Open)?;
        let span = self.span();
        let Some(Token::Text(text)) = self.peek() else {
            let problem = self.expected("the name of a program between quotes");
            return Err(problem.help("I = TASK(\"NAME\")"));
        };
        self.advance();
        self.expect_sign(Sign::Close)?;
        let letters = text.chars().filter(|letter| *letter != ' ');
        let text = letters.collect::<String>().to_ascii_uppercase();
        Ok(Ask::Task {
            target,
            name: Name { text, span },
            block: 0,
        })
    }
}
