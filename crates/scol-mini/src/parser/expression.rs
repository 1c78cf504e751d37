//! Parses expressions, tightest first: parentheses, sign and `NOT`, `^`, `* / MOD`, `+ -`, relations, `AND`, `OR`; operators
//! of one level from the left.
//!
//! Names are resolved later (`compile::names`), kinds checked later (`compile::kinds`).

use crate::prelude::*;

use super::Cursor;
use crate::builtin::{self, Builtin, System};
use crate::diagnostic::{Diagnostic, Span};
use crate::fix::Edit;
use crate::lexer::{Sign, Token, too_large};
use crate::options::Arm;
use crate::tree::{Binary, Expression, Node, Unary, Variable};
use crate::value::Number;

/// The operator a token is and how tightly it binds.
fn operator(token: Option<&Token>) -> Option<(Binary, u8)> {
    Some(match token? {
        Token::Word(word) => match word.as_str() {
            "OR" => (Binary::Or, 1),
            "AND" => (Binary::And, 2),
            "MOD" => (Binary::Modulo, 5),
            _ => return None,
        },
        Token::Sign(Sign::Relation(relation)) => (Binary::Relation(*relation), 3),
        Token::Sign(Sign::Plus) => (Binary::Add, 4),
        Token::Sign(Sign::Minus) => (Binary::Subtract, 4),
        Token::Sign(Sign::Star) => (Binary::Multiply, 5),
        Token::Sign(Sign::Slash) => (Binary::Divide, 5),
        Token::Sign(Sign::Caret) => (Binary::Power, 6),
        Token::Sign(_) | Token::Integer(_) | Token::Real(_) | Token::Text(_) => return None,
    })
}

impl Cursor<'_> {
    /// An expression; stops at the first token that cannot continue it.
    pub fn expression(&mut self) -> Result<Expression, Diagnostic> {
        self.nested(|cursor| cursor.binary(1))
    }

    fn binary(&mut self, weakest: u8) -> Result<Expression, Diagnostic> {
        let mut left = self.unary()?;
        while let Some((operator, strength)) = operator(self.peek()) {
            if strength < weakest {
                break;
            }
            self.advance();
            let right = self.binary(strength + 1)?;
            let span = left.span.to(right.span);
            left = Expression::new(Node::Binary(operator, Box::new(left), Box::new(right)), span);
        }
        if weakest == 1 && self.is_next(Sign::Assign) {
            let problem = Diagnostic::new("E0101", self.span(), "expected an operator, found \"=\"");
            let problem = problem.help("\"=\" assigns; compare with \"==\"");
            return Err(problem.fix(Edit::replace(self.span(), "==")));
        }
        Ok(left)
    }

    fn unary(&mut self) -> Result<Expression, Diagnostic> {
        let start = self.span();
        let operator = match self.peek() {
            Some(Token::Sign(Sign::Minus)) => Unary::Minus,
            Some(Token::Sign(Sign::Plus)) => Unary::Plus,
            Some(Token::Word(word)) if word == "NOT" => Unary::Not,
            _ => return self.postfix(),
        };
        self.advance();
        if operator == Unary::Minus && self.peek() == Some(&Token::Integer(-i64::from(i32::MIN))) {
            let span = start.to(self.span());
            self.advance();
            return Ok(Expression::integer(i32::MIN, span));
        }
        let of = self.nested(Self::unary)?;
        let span = start.to(of.span);
        Ok(Expression::new(Node::Unary(operator, Box::new(of)), span))
    }

    fn postfix(&mut self) -> Result<Expression, Diagnostic> {
        let mut of = self.primary()?;
        while self.sign(Sign::Dot) {
            let letter = self.component()?;
            let span = of.span.to(self.before());
            of = Expression::new(Node::Component(Box::new(of), letter), span);
        }
        Ok(of)
    }

    /// The letter after the dot of `P.X`.
    pub fn component(&mut self) -> Result<u8, Diagnostic> {
        let letters = self.arm.coordinates();
        match *self.peek_word().as_bytes() {
            [letter] if letters.contains(char::from(letter)) => {
                self.advance();
                Ok(letter)
            }
            _ => Err(self.expected(&format!("a coordinate, one of {letters}"))),
        }
    }

    fn primary(&mut self) -> Result<Expression, Diagnostic> {
        let span = self.span();
        let node = match self.peek() {
            Some(Token::Integer(value)) => {
                let value = i32::try_from(*value).map_err(|_| too_large(span.text(self.source), span))?;
                Node::Literal(Number::Integer(value))
            }
            Some(Token::Real(value)) => Node::Literal(Number::Real(*value)),
            Some(Token::Sign(Sign::Open)) => {
                self.advance();
                let inner = self.expression()?;
                self.expect_sign(Sign::Close)?;
                return Ok(Expression::new(inner.node, span.to(self.before())));
            }
            Some(Token::Sign(Sign::OpenBrace)) => return self.braces(span),
            Some(Token::Word(word)) => return self.word_value(word, span),
            Some(Token::Text(_)) => {
                let problem = Diagnostic::new("E0101", span, "expected a value, found a string");
                return Err(problem.help("a string can only be an item of PRINT"));
            }
            _ => return Err(self.expected("a value")),
        };
        self.advance();
        Ok(Expression::new(node, span))
    }

    /// `{a, b, ...}`: a vector written in place, of the kind that its statement takes.
    fn braces(&mut self, span: Span) -> Result<Expression, Diagnostic> {
        self.advance();
        let arguments = self.arguments(self.vector, Sign::CloseBrace)?;
        self.function(self.vector, arguments, span)
    }

    /// An expression in which braces make a vector of this kind.
    pub(super) fn expression_of(&mut self, vector: Builtin) -> Result<Expression, Diagnostic> {
        let outer = core::mem::replace(&mut self.vector, vector);
        let expression = self.expression();
        self.vector = outer;
        expression
    }

    /// The arguments of a function. Those of a vector may be left out, and the configuration of a POINT may be a
    /// word.
    fn arguments(&mut self, builtin: Builtin, close: Sign) -> Result<Vec<Expression>, Diagnostic> {
        self.items(close, |cursor, before| {
            if builtin.is_vector() && cursor.left_out(close) {
                return Ok(Expression::integer(0, cursor.before()));
            }
            match builtin == Builtin::Point && before == cursor.arm.coordinates().len() {
                true => cursor.configuration_or_value(),
                false => cursor.expression(),
            }
        })
    }

    /// The next word as a configuration, if it is one and no operand of an operator; otherwise an expression.
    fn configuration_or_value(&mut self) -> Result<Expression, Diagnostic> {
        let alone = match self.peek_at(1) {
            None | Some(Token::Word(_)) => true,
            Some(Token::Sign(sign)) => matches!(sign, Sign::Comma | Sign::Close | Sign::CloseBrace),
            Some(_) => false,
        };
        let span = self.span();
        match builtin::configuration(self.peek_word(), self.arm).filter(|_| alone) {
            Some(number) => {
                self.advance();
                Ok(Expression::integer(number, span))
            }
            None => self.expression(),
        }
    }

    /// The value of CONFIG: a number, words, five letters, or the digits one by one between braces.
    pub(super) fn configuration(&mut self) -> Result<Expression, Diagnostic> {
        match self.is_next(Sign::OpenBrace) {
            true => self.configuration_list(),
            false => self.configuration_or_value(),
        }
    }

    /// `{LEFTY, ABOVE, NFLIP, SINGLE4, SINGLE6}`: words in any order, or digits in the order shoulder, elbow, wrist,
    /// axis 4, axis 6 (hosts 8.6). What is left out is undefined.
    fn configuration_list(&mut self) -> Result<Expression, Diagnostic> {
        let start = self.span();
        self.advance();
        let places: &[i32] = match self.arm {
            Arm::SixAxis => &[10_000, 1_000, 100, 10, 1],
            Arm::Scara => &[1],
        };
        let mut digits: Vec<(i32, i32)> = Vec::new();
        self.items(Sign::CloseBrace, |cursor, before| {
            let span = cursor.span();
            let place = places.get(before).copied().ok_or_else(|| {
                let message = format!("a configuration has {} digits, found more", places.len());
                Diagnostic::new("E0206", span, message)
            })?;
            if cursor.left_out(Sign::CloseBrace) {
                return Ok(());
            }
            let (place, digit) = cursor.configuration_digit(place)?;
            if digits.iter().any(|(known, _)| *known == place) {
                return Diagnostic::fail("E0205", span, "this digit of CONFIG appears twice");
            }
            digits.extend((digit > 0).then_some((place, digit)));
            cursor.advance();
            Ok(())
        })?;
        let number = digits.iter().map(|(place, digit)| place * digit).sum();
        Ok(Expression::integer(number, start.to(self.before())))
    }

    /// The next item of a list of digits: its place and its value. A number has the `place` where it is written.
    fn configuration_digit(&self, place: i32) -> Result<(i32, i32), Diagnostic> {
        let named = match self.peek() {
            Some(Token::Integer(digit @ 0..=2)) => i32::try_from(*digit).ok().map(|digit| (place, digit)),
            Some(Token::Word(word)) => {
                builtin::configuration(word, self.arm).and_then(|number| match number {
                    0 => Some((place, 0)),
                    _ => [1, 10, 100, 1_000, 10_000]
                        .map(|place| (place, number / place))
                        .into_iter()
                        .find(|(place, digit)| digit * place == number && matches!(digit, 1 | 2)),
                })
            }
            _ => None,
        };
        named.ok_or_else(|| self.expected("a digit 0 to 2 or a word of the configuration"))
    }

    fn word_value(&mut self, word: &str, span: Span) -> Result<Expression, Diagnostic> {
        let node = if let Some(builtin) = Builtin::from_word(word) {
            self.advance();
            self.expect_sign(Sign::Open)?;
            let arguments = self.arguments(builtin, Sign::Close)?;
            return self.function(builtin, arguments, span);
        } else if let Some(value) = builtin::constant(word, self.arm) {
            self.advance();
            Node::Literal(Number::Integer(value))
        } else if let Some(system) = System::from_word(word) {
            self.advance();
            Node::System(system)
        } else {
            Node::Variable(self.variable("a value")?)
        };
        Ok(Expression::new(node, span.to(self.before())))
    }

    /// A variable, or an element of an array; `what` says what it is for.
    pub(super) fn variable(&mut self, what: &str) -> Result<Variable, Diagnostic> {
        let name = self.name(what)?;
        Ok(Variable::new(name, self.subscripts()?.unwrap_or_default()))
    }

    /// Reads the expressions in parentheses; `None` without parentheses.
    pub(super) fn subscripts(&mut self) -> Result<Option<Vec<Expression>>, Diagnostic> {
        let open = self.sign(Sign::Open);
        open.then(|| self.list(Sign::Close)).transpose()
    }

    fn function(
        &self,
        builtin: Builtin,
        arguments: Vec<Expression>,
        start: Span,
    ) -> Result<Expression, Diagnostic> {
        let span = start.to(self.before());
        let (fewest, most) = builtin.arity(self.arm);
        if (fewest..=most).contains(&arguments.len()) {
            return Ok(Expression::new(Node::Function(builtin, arguments), span));
        }
        let count = match fewest {
            _ if fewest == most => format!("{most}"),
            0 => format!("at most {most}"),
            _ => format!("{fewest} to {most}"),
        };
        let plural = if count == "1" { "" } else { "s" };
        let (word, found) = (builtin.keyword(), arguments.len());
        let message = format!("{word} takes {count} argument{plural}, found {found}");
        Diagnostic::fail("E0206", span, message)
    }

    /// Expressions separated by commas up to the closing sign; may be empty.
    pub fn list(&mut self, close: Sign) -> Result<Vec<Expression>, Diagnostic> {
        self.items(close, |cursor, _| cursor.expression())
    }

    /// Whether the next item of a list is left out.
    fn left_out(&self, close: Sign) -> bool {
        self.is_next(Sign::Comma) || self.is_next(close)
    }

    /// Reads a list up to the closing sign, with commas between its items; it may be empty. `item` is called with the
    /// number of items before it.
    fn items<T>(
        &mut self,
        close: Sign,
        mut item: impl FnMut(&mut Self, usize) -> Result<T, Diagnostic>,
    ) -> Result<Vec<T>, Diagnostic> {
        if self.sign(close) {
            return Ok(Vec::new());
        }
        let mut before = 0..;
        let list = self.separated(|cursor| item(cursor, before.next().unwrap_or_default()))?;
        self.close(close)?;
        Ok(list)
    }

    /// Takes the sign that closes a list.
    pub(super) fn close(&mut self, close: Sign) -> Result<(), Diagnostic> {
        let closed = self.sign(close).then_some(());
        closed.ok_or_else(|| self.expected(&format!("\",\" or \"{}\"", close.spelling())))
    }
}
