//! Parses statements about hands, pulses and BCD signals, motions under way, monitors and tasks.
//!
//! What they ask of the world is in `machine::request_values`; plain motions are in `motion`.

use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use super::Cursor;
use crate::conditions::AXES;
use crate::diagnostic::Problem;
use crate::lexer::{Sign, Token};
use crate::tree::{Expression, Feature, Name, PerAxis, Simple, Statement, Variable};

impl Cursor<'_> {
    /// The statement that begins with this word; `None` when it is none of these.
    pub(super) fn device(&mut self, word: &str) -> Result<Option<Simple>, Problem> {
        let simple = match word {
            "BREAK" => Simple::Break,
            "PAUSE" => Simple::Pause,
            "RESUME" => Simple::Resume,
            "IGNORE" => Simple::Ignore,
            "SWITCH" => Simple::Yield,
            _ => match hand(word) {
                Some(hand) => hand,
                None => return self.with_operands(word),
            },
        };
        self.advance();
        Ok(Some(simple))
    }

    fn with_operands(&mut self, word: &str) -> Result<Option<Simple>, Problem> {
        let assigned = self.peek_at(1) == Some(&Token::Sign(Sign::Assign));
        Ok(Some(match word {
            "PULOUT" => {
                let [line, seconds] = self.operands(word)?;
                Simple::Pulse(line, seconds)
            }
            "SETGAIN" => {
                let [axis, value] = self.operands(word)?;
                Simple::SetGain(axis, value)
            }
            "BCDOUT" => Simple::Bcd(self.operands(word)?),
            "ENABLE" | "DISABLE" => self.switch(word == "ENABLE")?,
            "TASK" => {
                self.advance();
                self.task(None)?
            }
            "RESTORE" => self.restore()?,
            "KILL" => {
                self.advance();
                Simple::Kill(self.expression()?)
            }
            "TIMER" if assigned => Simple::Timer(self.setting(None)?),
            "GAIN" if assigned => self.per_axis(PerAxis::Gain)?,
            "TORQUE" if assigned => self.per_axis(PerAxis::Torque)?,
            _ => return Ok(None),
        }))
    }

    /// `WORD(a, b)` with exactly so many operands, the cursor on the word.
    fn operands<const COUNT: usize>(&mut self, word: &str) -> Result<[Expression; COUNT], Problem> {
        let start = self.span();
        self.advance();
        self.expect_sign(Sign::Open, "(")?;
        let list = self.list(Sign::Close, ")")?;
        let found = list.len();
        list.try_into().map_err(|_| {
            let message = format!("{word} takes {COUNT} operands, found {found}");
            Problem::new("E0206", start.to(self.before()), message)
        })
    }

    fn per_axis(&mut self, condition: PerAxis) -> Result<Simple, Problem> {
        let start = self.span();
        self.advance();
        self.expect_sign(Sign::Assign, "=")?;
        self.expect_sign(Sign::OpenBrace, "{")?;
        let values = self.list(Sign::CloseBrace, "}")?;
        if values.is_empty() || values.len() > AXES {
            let message = format!("expected 1 to {AXES} axes, found {}", values.len());
            return Err(Problem::new("E0206", start.to(self.before()), message));
        }
        Ok(Simple::PerAxis(condition, values))
    }

    /// `RESTORE`, or with names of GLOBAL and DATA.
    fn restore(&mut self) -> Result<Simple, Problem> {
        self.advance();
        let mut names = Vec::new();
        if self.peek().is_none() || matches!(self.peek(), Some(Token::Word(word)) if word == "ELSE") {
            return Ok(Simple::Restore(names));
        }
        loop {
            names.push(self.name("a name of GLOBAL or DATA")?);
            if !self.sign(Sign::Comma) {
                return Ok(Simple::Restore(names));
            }
        }
    }

    fn switch(&mut self, on: bool) -> Result<Simple, Problem> {
        self.advance();
        let feature = if self.word("PASS") {
            Feature::Pass
        } else if self.word("NOWAIT") {
            Feature::Nowait
        } else if matches!(self.peek(), Some(Token::Word(word)) if word != "ELSE") {
            return Err(self.expected("PASS, NOWAIT or the end of the line"));
        } else {
            Feature::Monitors
        };
        Ok(Simple::Switch(feature, on))
    }

    /// `("NAME")` after TASK; blanks in the name are ignored.
    pub(super) fn task(&mut self, target: Option<Variable>) -> Result<Simple, Problem> {
        self.expect_sign(Sign::Open, "(")?;
        let span = self.span();
        let Some(Token::Text(text)) = self.peek() else {
            let problem = self.expected("the name of a program between quotes");
            return Err(problem.help("I = TASK(\"NAME\")"));
        };
        self.advance();
        self.expect_sign(Sign::Close, ")")?;
        let letters = text.chars().filter(|letter| *letter != ' ');
        let text = letters.collect::<String>().to_ascii_uppercase();
        Ok(Simple::Task {
            target,
            name: Name { text, span },
            block: 0,
        })
    }

    /// `ON condition DO statement`.
    pub(super) fn monitor(&mut self) -> Result<Statement, Problem> {
        self.advance();
        let condition = self.expression()?;
        self.expect_word("DO")?;
        let span = self.span();
        let action = self.nested(Self::statement)?;
        let fits = matches!(
            action,
            Statement::Simple(_) | Statement::Goto(_) | Statement::Select(..) | Statement::Call(..)
        );
        if !fits {
            let problem = Problem::new("E0103", span, "this statement cannot stand behind DO");
            return Err(problem.help("GOTO, a call, or a statement that does one thing"));
        }
        Ok(Statement::On {
            condition,
            action: Box::new(action),
        })
    }
}

/// `OPEN1` and its sisters.
fn hand(word: &str) -> Option<Simple> {
    let (verb, hand) = match word.split_at_checked(word.len().checked_sub(1)?)? {
        (verb, "1") => (verb, 1),
        (verb, "2") => (verb, 2),
        _ => return None,
    };
    let (open, at_once) = match verb {
        "OPEN" => (true, false),
        "OPENI" => (true, true),
        "CLOSE" => (false, false),
        "CLOSEI" => (false, true),
        _ => return None,
    };
    Some(Simple::Hand { hand, open, at_once })
}
