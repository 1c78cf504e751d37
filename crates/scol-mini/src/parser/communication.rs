//! Parses `PRINT`, `INPUT` and `DOUT`: what a program sends to and receives from the outside.
//!
//! Channels and items are checked here; the bytes of a PRINT are in `machine::print`.

use crate::prelude::*;

use super::Cursor;
use crate::builtin::{Builtin, MAX_ARGUMENTS};
use crate::diagnostic::Problem;
use crate::lexer::{Sign, Token};
use crate::request::Channel;
use crate::tree::{Ask, Item};

impl Cursor<'_> {
    /// The channel of PRINT or INPUT and its comma; `COM1` and its kin are reserved, so one word decides.
    fn channel(&mut self) -> Result<Channel, Problem> {
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

    pub(super) fn print(&mut self) -> Result<Ask, Problem> {
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
                        return Problem::fail("E0102", span, "CR is the last item of a PRINT");
                    }
                    break;
                }
                Some(Token::Word(word)) if word == "CRE" => {
                    let problem = Problem::new("E0106", span, "CRE is not a constant");
                    return Err(problem.help("the record end is CR"));
                }
                _ => items.push(Item::Value(self.expression()?)),
            }
            if !self.sign(Sign::Comma) {
                break;
            }
        }
        Ok(Ask::Print { channel, items, cr })
    }

    pub(super) fn input(&mut self) -> Result<Ask, Problem> {
        let channel = self.channel()?;
        let targets = self.separated(|cursor| cursor.variable("a variable"))?;
        Ok(Ask::Input(channel, targets))
    }

    pub(super) fn outputs(&mut self) -> Result<Ask, Problem> {
        let start = self.before();
        self.expect_sign(Sign::Open)?;
        let lines = self.list(Sign::Close)?;
        if lines.is_empty() || lines.len() > MAX_ARGUMENTS {
            let message = format!("{} takes 1 to {MAX_ARGUMENTS} outputs", Builtin::Dout.keyword());
            return Problem::fail("E0206", start.to(self.before()), message);
        }
        Ok(Ask::Outputs(lines))
    }
}
