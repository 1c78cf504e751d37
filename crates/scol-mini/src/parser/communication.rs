//! Parses `PRINT`, `INPUT` and `DOUT`: what a program sends to and receives from the outside.
//!
//! Channels and items are checked here; the bytes of a PRINT are in `machine::print`.

use alloc::format;
use alloc::vec::Vec;

use super::Cursor;
use crate::builtin::{Builtin, MAX_ARGUMENTS};
use crate::diagnostic::Problem;
use crate::lexer::{Sign, Token};
use crate::request::Channel;
use crate::tree::{Item, Reference, Simple, Variable};

impl Cursor<'_> {
    /// The channel of PRINT or INPUT; `COM1` and its kin are reserved, so one word decides.
    fn channel(&mut self) -> Option<Channel> {
        let Some(Token::Word(word)) = self.peek() else {
            return None;
        };
        let channel = match word.as_str() {
            "TP" => Channel::Tp,
            "COM1" => Channel::Com1,
            "IP1" => Channel::Ip1,
            "IP2" => Channel::Ip2,
            _ => return None,
        };
        self.advance();
        Some(channel)
    }

    pub(super) fn print(&mut self) -> Result<Simple, Problem> {
        self.advance();
        let channel = self.channel();
        if channel.is_some() {
            self.expect_sign(Sign::Comma, ",")?;
        }
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
                    if self.peek() == Some(&Token::Sign(Sign::Comma)) {
                        return Err(Problem::new("E0102", span, "CR is the last item of a PRINT"));
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
        Ok(Simple::Print {
            channel: channel.unwrap_or(Channel::Tp),
            items,
            cr,
        })
    }

    pub(super) fn input(&mut self) -> Result<Simple, Problem> {
        self.advance();
        let channel = self.channel();
        if channel.is_some() {
            self.expect_sign(Sign::Comma, ",")?;
        }
        let mut targets = Vec::new();
        loop {
            let name = self.name("a variable")?;
            let subscripts = if self.sign(Sign::Open) {
                self.list(Sign::Close, ")")?
            } else {
                Vec::new()
            };
            targets.push(Variable {
                name,
                reference: Reference::Unresolved,
                subscripts,
            });
            if !self.sign(Sign::Comma) {
                return Ok(Simple::Input {
                    channel: channel.unwrap_or(Channel::Tp),
                    targets,
                });
            }
        }
    }

    pub(super) fn outputs(&mut self) -> Result<Simple, Problem> {
        let start = self.span();
        self.advance();
        self.expect_sign(Sign::Open, "(")?;
        let lines = self.list(Sign::Close, ")")?;
        if lines.is_empty() || lines.len() > MAX_ARGUMENTS {
            let message = format!("{} takes 1 to {MAX_ARGUMENTS} outputs", Builtin::Dout.keyword());
            return Err(Problem::new("E0206", start.to(self.before()), message));
        }
        Ok(Simple::Outputs(lines))
    }
}
