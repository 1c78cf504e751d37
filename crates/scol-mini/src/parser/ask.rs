//! Parses statements that ask for something outside: motions with their `WITH` clause, `PRINT` and `INPUT`, signals, hands
//! and tasks; and those that change gains and monitors.
//!
//! Channels and items are checked here; what a statement asks for, with its values, is made by `machine::request_values`.

use crate::prelude::*;

use super::Cursor;
use crate::builtin::{self, Builtin, Condition, MAX_ARGUMENTS};
use crate::conditions::AXES;
use crate::diagnostic::Diagnostic;
use crate::fix::Edit;
use crate::lexer::{Sign, Token};
use crate::outline::task_name;
use crate::request::{Channel, Request};
use crate::tree::{Ask, Change, Expression, Item, MotionKind, Name, PerAxis, Simple, Variable};

impl Cursor<'_> {
    /// The statement that begins with this word and asks for something; `None` when there is none.
    pub(super) fn ask(&mut self, word: &str, assigned: bool) -> Result<Option<Ask>, Diagnostic> {
        Ok(Some(match word {
            "MOVE" | "MOVES" | "MOVEC" | "MOVEA" | "MOVEI" | "MOVEJ" | "READY" => self.motion(word)?,
            "PRINT" => self.print()?,
            "INPUT" => self.input()?,
            "DOUT" => self.outputs()?,
            "BCDOUT" => Ask::Bcd(self.operands(word)?),
            "PULOUT" => Ask::Pulse(self.operands(word)?),
            "OPEN1" | "OPEN2" | "OPENI1" | "OPENI2" | "CLOSE1" | "CLOSE2" | "CLOSEI1" | "CLOSEI2" => {
                Ask::Fixed(Request::Hand {
                    hand: if word.ends_with('1') { 1 } else { 2 },
                    open: word.starts_with("OPEN"),
                    at_once: word.contains('I'),
                })
            }
            "DELAY" => Ask::Delay(self.expression()?),
            "TIMER" if assigned => Ask::Timer(self.setting(None)?),
            "TASK" => self.task(None)?,
            "KILL" => Ask::Kill(self.expression()?),
            "RESTORE" => self.restore()?,
            "BREAK" => Ask::Fixed(Request::Break),
            "PAUSE" => Ask::Fixed(Request::Pause),
            "RESUME" => Ask::Fixed(Request::Resume),
            "SWITCH" => Ask::Fixed(Request::Switch),
            "STOP" => Ask::Fixed(Request::Stop),
            _ => return Ok(None),
        }))
    }

    fn motion(&mut self, word: &str) -> Result<Ask, Diagnostic> {
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

    fn position(&mut self) -> Result<Expression, Diagnostic> {
        self.expression_of(Builtin::Point)
    }

    /// Two positions; the comma between them may be left out.
    fn positions(&mut self) -> Result<[Expression; 2], Diagnostic> {
        let first = self.position()?;
        self.sign(Sign::Comma);
        Ok([first, self.position()?])
    }

    fn axis_and_value(&mut self) -> Result<[Expression; 2], Diagnostic> {
        let axis = self.expression()?;
        self.expect_sign(Sign::Comma)?;
        Ok([axis, self.expression()?])
    }

    fn with(&mut self) -> Result<Vec<(Condition, Expression)>, Diagnostic> {
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
                return Diagnostic::fail("E0205", span, format!("{word} appears twice in one WITH"));
            }
            known.push(condition);
            cursor.advance();
            Ok((condition, cursor.setting(Some(condition))?))
        })
    }

    /// `= value` after a name, that of a motion condition if there is one.
    pub(super) fn setting(&mut self, of: Option<Condition>) -> Result<Expression, Diagnostic> {
        self.expect_sign(Sign::Assign)?;
        match of {
            Some(Condition::Config) => self.configuration(),
            Some(condition) if condition.is_frame() => self.expression_of(Builtin::Trans),
            _ => self.expression(),
        }
    }

    /// The channel of PRINT or INPUT and its comma; the names of channels are reserved, so one word decides.
    fn channel(&mut self) -> Result<Channel, Diagnostic> {
        let channel = match self.peek_word() {
            "TP" => Channel::Tp,
            "COM1" => Channel::Com1,
            "IP1" => Channel::Ip1,
            "IP2" => Channel::Ip2,
            _ => return Ok(Channel::Tp),
        };
        self.advance();
        self.expect_sign(Sign::Comma)?;
        Ok(channel)
    }

    fn print(&mut self) -> Result<Ask, Diagnostic> {
        let channel = self.channel()?;
        let (mut items, mut cr) = (Vec::new(), false);
        loop {
            let span = self.span();
            match self.peek() {
                Some(Token::Text(text)) => {
                    self.advance();
                    items.push(Item::Text(text.clone()));
                }
                Some(Token::Word(word)) if word == "CR" => {
                    self.advance();
                    cr = true;
                    if self.is_next(Sign::Comma) {
                        return Diagnostic::fail("E0102", span, "CR must be the last item of a PRINT");
                    }
                    break;
                }
                Some(Token::Word(word)) if word == "CRE" => {
                    let problem = Diagnostic::new("E0106", span, "CRE is not a constant");
                    return Err(problem
                        .help("end the record with CR")
                        .fix(Edit::replace(span, "CR")));
                }
                _ => items.push(Item::Value(self.expression()?)),
            }
            if !self.sign(Sign::Comma) {
                break;
            }
        }
        Ok(Ask::Print { channel, items, cr })
    }

    fn input(&mut self) -> Result<Ask, Diagnostic> {
        let channel = self.channel()?;
        let targets = self.separated(|cursor| cursor.variable("a variable"))?;
        Ok(Ask::Input(channel, targets))
    }

    fn outputs(&mut self) -> Result<Ask, Diagnostic> {
        let start = self.before();
        self.expect_sign(Sign::Open)?;
        let lines = self.list(Sign::Close)?;
        if lines.is_empty() || lines.len() > MAX_ARGUMENTS {
            let message = format!("{} takes 1 to {MAX_ARGUMENTS} outputs", Builtin::Dout.keyword());
            return Diagnostic::fail("E0206", start.to(self.before()), message);
        }
        Ok(Ask::Outputs(lines))
    }

    /// `(a, b)` with exactly `COUNT` operands, the cursor after the word.
    pub(super) fn operands<const COUNT: usize>(
        &mut self,
        word: &str,
    ) -> Result<[Expression; COUNT], Diagnostic> {
        let start = self.before();
        self.expect_sign(Sign::Open)?;
        let list = self.list(Sign::Close)?;
        let found = list.len();
        list.try_into().map_err(|_| {
            let message = format!("{word} takes {COUNT} operands, found {found}");
            Diagnostic::new("E0206", start.to(self.before()), message)
        })
    }

    /// `= {a, b, ...}` after the word, axis 1 first.
    pub(super) fn per_axis(&mut self, condition: PerAxis) -> Result<Simple, Diagnostic> {
        let start = self.before();
        self.expect_sign(Sign::Assign)?;
        self.expect_sign(Sign::OpenBrace)?;
        let values = self.list(Sign::CloseBrace)?;
        if values.is_empty() || values.len() > AXES {
            let message = format!("expected 1 to {AXES} axes, found {}", values.len());
            return Diagnostic::fail("E0206", start.to(self.before()), message);
        }
        Ok(Simple::Change(Change::PerAxis(condition, values)))
    }

    /// `RESTORE`, or with names of GLOBAL and DATA.
    fn restore(&mut self) -> Result<Ask, Diagnostic> {
        let names = match self.peek() {
            None => Vec::new(),
            Some(_) if self.peek_word() == "ELSE" => Vec::new(),
            Some(_) => self.separated(|cursor| cursor.name("a name of GLOBAL or DATA"))?,
        };
        Ok(Ask::Restore(names))
    }

    /// Reads the word after ENABLE or DISABLE; without a word they switch the monitors.
    pub(super) fn switch(&mut self, on: bool) -> Result<Simple, Diagnostic> {
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
    pub(super) fn task(&mut self, target: Option<Variable>) -> Result<Ask, Diagnostic> {
        self.expect_sign(Sign::Open)?;
        let span = self.span();
        let Some(Token::Text(text)) = self.peek() else {
            let problem = self.expected("the name of a program between quotes");
            return Err(problem.help("I = TASK(\"NAME\")"));
        };
        self.advance();
        self.expect_sign(Sign::Close)?;
        let text = task_name(text);
        Ok(Ask::Task {
            target,
            name: Name { text, span },
            block: 0,
        })
    }
}
