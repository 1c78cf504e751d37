//! Parses expressions, tightest first: parentheses, sign and `NOT`, `^`, `* / MOD`, `+ -`, relations, `AND`, `OR`; operators
//! of one level from the left.
//!
//! Names are resolved later (`compile::names`), kinds checked later (`compile::kinds`).

use alloc::boxed::Box;
use alloc::format;
use alloc::vec::Vec;

use super::Cursor;
use crate::builtin::{self, Builtin, System};
use crate::diagnostic::{Problem, Span};
use crate::lexer::{Sign, Token, too_large};
use crate::options::Arm;
use crate::tree::{Binary, Expression, Node, Reference, Relation, Unary, Variable};
use crate::value::{Value, coordinates};

/// The operator a token is and how tightly it binds.
fn operator(token: Option<&Token>) -> Option<(Binary, u8)> {
    Some(match token? {
        Token::Word(word) => match word.as_str() {
            "OR" => (Binary::Or, 1),
            "AND" => (Binary::And, 2),
            "MOD" => (Binary::Modulo, 5),
            _ => return None,
        },
        Token::Sign(sign) => match sign {
            Sign::Equal => (Binary::Relation(Relation::Equal), 3),
            Sign::NotEqual => (Binary::Relation(Relation::NotEqual), 3),
            Sign::Less => (Binary::Relation(Relation::Less), 3),
            Sign::LessEqual => (Binary::Relation(Relation::LessEqual), 3),
            Sign::Greater => (Binary::Relation(Relation::Greater), 3),
            Sign::GreaterEqual => (Binary::Relation(Relation::GreaterEqual), 3),
            Sign::Plus => (Binary::Add, 4),
            Sign::Minus => (Binary::Subtract, 4),
            Sign::Star => (Binary::Multiply, 5),
            Sign::Slash => (Binary::Divide, 5),
            Sign::Caret => (Binary::Power, 6),
            Sign::Open
            | Sign::Close
            | Sign::OpenBrace
            | Sign::CloseBrace
            | Sign::Comma
            | Sign::Dot
            | Sign::Colon
            | Sign::Assign => return None,
        },
        Token::Integer(_) | Token::Real(_) | Token::Text(_) => return None,
    })
}

impl Cursor<'_> {
    /// An expression; stops at the first token that cannot continue it.
    pub fn expression(&mut self) -> Result<Expression, Problem> {
        self.nested(|cursor| cursor.binary(1))
    }

    fn binary(&mut self, weakest: u8) -> Result<Expression, Problem> {
        let mut left = self.unary()?;
        while let Some((operator, strength)) = operator(self.peek()) {
            if strength < weakest {
                break;
            }
            self.advance();
            let right = self.binary(strength + 1)?;
            let span = left.span.to(right.span);
            left = Expression {
                node: Node::Binary(operator, Box::new(left), Box::new(right)),
                span,
            };
        }
        if weakest == 1 && self.peek() == Some(&Token::Sign(Sign::Assign)) {
            let problem = Problem::new("E0101", self.span(), "expected an operator, found \"=\"");
            return Err(problem.help("\"=\" assigns; two values are compared with \"==\""));
        }
        Ok(left)
    }

    fn unary(&mut self) -> Result<Expression, Problem> {
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
            return Ok(Expression {
                node: Node::Literal(Value::Integer(i32::MIN)),
                span,
            });
        }
        let of = self.nested(Self::unary)?;
        let span = start.to(of.span);
        Ok(Expression {
            node: Node::Unary(operator, Box::new(of)),
            span,
        })
    }

    fn postfix(&mut self) -> Result<Expression, Problem> {
        let mut of = self.primary()?;
        while self.sign(Sign::Dot) {
            let letter = self.component()?;
            let span = of.span.to(self.before());
            of = Expression {
                node: Node::Component(Box::new(of), letter),
                span,
            };
        }
        Ok(of)
    }

    /// The letter after the dot of `P.X`.
    pub fn component(&mut self) -> Result<u8, Problem> {
        let letters: &[u8] = match self.arm {
            Arm::SixAxis => b"XYZABCUV",
            Arm::Scara => b"XYZCT",
        };
        let list = letters
            .iter()
            .map(|l| char::from(*l))
            .collect::<alloc::string::String>();
        let problem = self.expected(&format!("a coordinate, one of {list}"));
        let Some(Token::Word(word)) = self.peek() else {
            return Err(problem);
        };
        match word.as_bytes() {
            [letter] if letters.contains(letter) => {
                self.advance();
                Ok(*letter)
            }
            _ => Err(problem),
        }
    }

    fn primary(&mut self) -> Result<Expression, Problem> {
        let span = self.span();
        let node = match self.peek() {
            Some(Token::Integer(value)) => {
                let Ok(value) = i32::try_from(*value) else {
                    return Err(too_large(
                        self.source.get(span.start..span.end).unwrap_or_default(),
                        span,
                    ));
                };
                Node::Literal(Value::Integer(value))
            }
            Some(Token::Real(value)) => Node::Literal(Value::Real(*value)),
            Some(Token::Sign(Sign::Open)) => {
                self.advance();
                let inner = self.expression()?;
                self.expect_sign(Sign::Close, ")")?;
                return Ok(Expression {
                    node: inner.node,
                    span: span.to(self.before()),
                });
            }
            Some(Token::Sign(Sign::OpenBrace)) => return self.braces(span),
            Some(Token::Word(word)) => return self.word_value(word, span),
            Some(Token::Text(_)) => {
                let problem = Problem::new("E0101", span, "expected a value, found a text");
                return Err(problem.help("a text can only be an item of PRINT"));
            }
            _ => return Err(self.expected("a value")),
        };
        self.advance();
        Ok(Expression { node, span })
    }

    /// `{a, b, ...}`: a vector written in place, of the kind that its statement takes.
    fn braces(&mut self, span: Span) -> Result<Expression, Problem> {
        self.advance();
        let arguments = self.arguments(self.vector, Sign::CloseBrace, "}")?;
        self.function(self.vector, arguments, span)
    }

    /// An expression in which braces make a vector of this kind.
    pub(super) fn expression_of(&mut self, vector: Builtin) -> Result<Expression, Problem> {
        let outer = core::mem::replace(&mut self.vector, vector);
        let expression = self.expression();
        self.vector = outer;
        expression
    }

    /// The arguments of a function. Those of a vector may be left out, and the configuration of a POINT may be a
    /// word.
    fn arguments(
        &mut self,
        builtin: Builtin,
        close: Sign,
        spelling: &str,
    ) -> Result<Vec<Expression>, Problem> {
        self.items(close, spelling, |cursor, before| {
            if builtin.is_vector() && cursor.left_out(close) {
                return Ok(Expression {
                    node: Node::Literal(Value::Integer(0)),
                    span: cursor.before(),
                });
            }
            let config = builtin == Builtin::Point && before == coordinates(cursor.arm);
            match cursor.configuration_word().filter(|_| config) {
                Some(word) => {
                    cursor.advance();
                    Ok(word)
                }
                None => cursor.expression(),
            }
        })
    }

    /// The next word as a configuration, if it is one and no operand of an operator; the cursor stays before it.
    fn configuration_word(&self) -> Option<Expression> {
        let Some(Token::Word(word)) = self.peek() else {
            return None;
        };
        let alone = match self.peek_at(1) {
            None | Some(Token::Word(_)) => true,
            Some(Token::Sign(sign)) => matches!(sign, Sign::Comma | Sign::Close | Sign::CloseBrace),
            Some(_) => false,
        };
        let number = builtin::configuration(word, self.arm).filter(|_| alone)?;
        Some(Expression {
            node: Node::Literal(Value::Integer(number)),
            span: self.span(),
        })
    }

    /// The value of CONFIG: a number, words, five letters, or the digits one by one between braces.
    pub(super) fn configuration(&mut self) -> Result<Expression, Problem> {
        if self.peek() == Some(&Token::Sign(Sign::OpenBrace)) {
            return self.configuration_list();
        }
        match self.configuration_word() {
            Some(word) => {
                self.advance();
                Ok(word)
            }
            None => self.expression(),
        }
    }

    /// `{LEFTY, ABOVE, NFLIP, SINGLE4, SINGLE6}`: words in any order, or digits in the order shoulder, elbow, wrist,
    /// axis 4, axis 6 (hosts 8.6). What is left out is undefined.
    fn configuration_list(&mut self) -> Result<Expression, Problem> {
        let start = self.span();
        self.advance();
        let places: &[i32] = match self.arm {
            Arm::SixAxis => &[10_000, 1_000, 100, 10, 1],
            Arm::Scara => &[1],
        };
        let mut digits: Vec<(i32, i32)> = Vec::new();
        self.items(Sign::CloseBrace, "}", |cursor, before| {
            let span = cursor.span();
            let place = places.get(before).copied().ok_or_else(|| {
                let message = format!("a configuration has {} digits, found more", places.len());
                Problem::new("E0206", span, message)
            })?;
            if cursor.left_out(Sign::CloseBrace) {
                return Ok(());
            }
            let (place, digit) = cursor.configuration_digit(place)?;
            if digits.iter().any(|(known, _)| *known == place) {
                return Err(Problem::new("E0205", span, "this digit of CONFIG stands twice"));
            }
            digits.extend((digit > 0).then_some((place, digit)));
            cursor.advance();
            Ok(())
        })?;
        let number = digits.iter().map(|(place, digit)| place * digit).sum();
        Ok(Expression {
            node: Node::Literal(Value::Integer(number)),
            span: start.to(self.before()),
        })
    }

    /// The next item of a list of digits: its place and its value. A number has the `place` where it is written.
    fn configuration_digit(&self, place: i32) -> Result<(i32, i32), Problem> {
        match self.peek() {
            Some(Token::Integer(0)) => return Ok((place, 0)),
            Some(Token::Integer(1)) => return Ok((place, 1)),
            Some(Token::Integer(2)) => return Ok((place, 2)),
            Some(Token::Word(word)) => {
                let number = builtin::configuration(word, self.arm);
                let places = [1, 10, 100, 1_000, 10_000].into_iter();
                let named = number.and_then(|number| match number {
                    0 => Some((place, 0)),
                    _ => places
                        .map(|place| (place, number / place))
                        .find(|(place, digit)| digit * place == number && matches!(digit, 1 | 2)),
                });
                if let Some(named) = named {
                    return Ok(named);
                }
            }
            _ => {}
        }
        Err(self.expected("a digit 0 to 2 or a word of the configuration"))
    }

    fn word_value(&mut self, word: &str, span: Span) -> Result<Expression, Problem> {
        let call = self.peek_at(1) == Some(&Token::Sign(Sign::Open));
        if let Some(builtin) = Builtin::from_word(word) {
            self.advance();
            self.expect_sign(Sign::Open, "(")?;
            let arguments = self.arguments(builtin, Sign::Close, ")")?;
            return self.function(builtin, arguments, span);
        }
        let node = if let Some(value) = builtin::constant(word, self.arm) {
            self.advance();
            Node::Literal(Value::Integer(value))
        } else if let Some(system) = System::from_word(word) {
            self.advance();
            Node::System(system)
        } else {
            let name = self.name("a value")?;
            let subscripts = if call {
                self.advance();
                self.list(Sign::Close, ")")?
            } else {
                Vec::new()
            };
            Node::Variable(Variable {
                name,
                reference: Reference::Unresolved,
                subscripts,
            })
        };
        Ok(Expression {
            node,
            span: span.to(self.before()),
        })
    }

    fn function(
        &self,
        builtin: Builtin,
        arguments: Vec<Expression>,
        start: Span,
    ) -> Result<Expression, Problem> {
        let span = start.to(self.before());
        let (fewest, most) = builtin.arity(self.arm);
        if arguments.len() < fewest || arguments.len() > most {
            let count = if fewest == most {
                format!("{most}")
            } else if fewest == 0 {
                format!("at most {most}")
            } else {
                format!("{fewest} to {most}")
            };
            let plural = if count == "1" { "" } else { "s" };
            let message = format!(
                "{} takes {count} argument{plural}, found {}",
                builtin.keyword(),
                arguments.len()
            );
            return Err(Problem::new("E0206", span, message));
        }
        Ok(Expression {
            node: Node::Function(builtin, arguments),
            span,
        })
    }

    /// Expressions separated by commas up to the closing sign; may be empty.
    pub fn list(&mut self, close: Sign, spelling: &str) -> Result<Vec<Expression>, Problem> {
        self.items(close, spelling, |cursor, _| cursor.expression())
    }

    /// Whether the next item of a list is left out.
    fn left_out(&self, close: Sign) -> bool {
        matches!(self.peek(), Some(Token::Sign(sign)) if *sign == Sign::Comma || *sign == close)
    }

    /// What `item` reads, called with the number of items before it, separated by commas up to the closing sign; may be empty.
    fn items<T>(
        &mut self,
        close: Sign,
        spelling: &str,
        mut item: impl FnMut(&mut Self, usize) -> Result<T, Problem>,
    ) -> Result<Vec<T>, Problem> {
        let mut list = Vec::new();
        if self.sign(close) {
            return Ok(list);
        }
        loop {
            list.push(item(self, list.len())?);
            if self.sign(close) {
                return Ok(list);
            }
            if !self.sign(Sign::Comma) {
                return Err(self.expected(&format!("\",\" or \"{spelling}\"")));
            }
        }
    }
}
