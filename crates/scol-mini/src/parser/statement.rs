//! Parses statements, one a line; `IF` holds one or two more.
//!
//! Which statements may stand where is checked here; their names are resolved later. Statements about motions, devices and
//! channels have their own files.

use alloc::boxed::Box;
use alloc::format;
use alloc::vec::Vec;

use super::Cursor;
use crate::builtin;
use crate::diagnostic::{Problem, Span};
use crate::lexer::{Sign, Token};
use crate::tree::{Expression, Name, Node, Reference, Simple, Statement, Unary, Variable};

impl Cursor<'_> {
    /// A statement up to the end of the line.
    pub fn statement_line(&mut self) -> Result<Statement, Problem> {
        let statement = self.statement()?;
        self.end_of_line()?;
        Ok(statement)
    }

    pub(super) fn statement(&mut self) -> Result<Statement, Problem> {
        let span = self.span();
        let Some(Token::Word(word)) = self.peek() else {
            return Err(self.expected("a statement"));
        };
        if self.peek_at(1) == Some(&Token::Sign(Sign::Assign))
            && let Some(condition) = builtin::condition(word)
        {
            let value = self.setting(Some(condition))?;
            return Ok(Statement::Simple(Simple::Set(condition, value)));
        }
        let control_flow = match word.as_str() {
            "MOVE" | "MOVES" | "MOVEC" | "MOVEA" | "MOVEI" | "MOVEJ" | "READY" => return self.motion(word),
            _ => self.flow(word)?,
        };
        if let Some(statement) = control_flow {
            return Ok(statement);
        }
        if let Some(simple) = self.device(word)? {
            return Ok(Statement::Simple(simple));
        }
        let simple = match word.as_str() {
            "PRINT" => self.print()?,
            "INPUT" => self.input()?,
            "DOUT" => self.outputs()?,
            "DELAY" => {
                self.advance();
                Simple::Delay(self.expression()?)
            }
            "FREELOAD" => self.bare(Simple::FreeLoad),
            "STOP" => self.bare(Simple::Stop),
            "ON" => return self.monitor(),
            _ if builtin::is_reserved(word, self.arm) => return Err(self.misplaced(word, span)),
            _ => return self.named(),
        };
        Ok(Statement::Simple(simple))
    }

    fn bare(&mut self, simple: Simple) -> Simple {
        self.advance();
        simple
    }

    fn misplaced(&self, word: &str, span: Span) -> Problem {
        let problem = Problem::new("E0103", span, format!("expected a statement, found {word}"));
        match word {
            "DIM" => problem.help("DIM stands in GLOBAL or before the first statement of a program"),
            "HERE" | "DEST" | "MOTION" | "MOTIONT" | "REMAIN" | "REMAINT" | "MODE" | "TID" | "MAXTASK" => {
                problem.help(format!("{word} can only be read"))
            }
            _ if builtin::condition(word).is_some() => problem.help(format!("set it with {word} = value")),
            _ => problem,
        }
    }

    /// Control flow; `None` when the word does not begin any.
    fn flow(&mut self, word: &str) -> Result<Option<Statement>, Problem> {
        Ok(Some(match word {
            "IF" => self.nested(Self::branch)?,
            "FOR" => self.for_loop()?,
            "NEXT" => {
                self.advance();
                let named = self.peek().is_some();
                Statement::Next(if named {
                    Some(self.name("the variable of the FOR")?)
                } else {
                    None
                })
            }
            "GOTO" => self.goto()?,
            "WAIT" => {
                self.advance();
                Statement::Wait(self.expression()?)
            }
            "RETURN" => {
                self.advance();
                Statement::Return
            }
            _ => return Ok(None),
        }))
    }

    fn branch(&mut self) -> Result<Statement, Problem> {
        self.advance();
        let condition = self.expression()?;
        self.expect_word("THEN")?;
        let then = Box::new(self.inner()?);
        let otherwise = if self.word("ELSE") {
            Some(Box::new(self.inner()?))
        } else {
            None
        };
        Ok(Statement::If {
            condition,
            then,
            otherwise,
        })
    }

    /// The statement after THEN or ELSE.
    fn inner(&mut self) -> Result<Statement, Problem> {
        let span = self.span();
        if self.peek().is_none() {
            let problem = self.expected("a statement");
            return Err(problem.help("an IF stands on one line, with a statement after THEN and ELSE"));
        }
        let statement = self.statement()?;
        if matches!(statement, Statement::For { .. } | Statement::Next(_)) {
            let problem = Problem::new("E0103", span, "FOR and NEXT cannot depend on an IF");
            return Err(problem.help("jump over the loop, or out of it, with GOTO"));
        }
        Ok(statement)
    }

    fn for_loop(&mut self) -> Result<Statement, Problem> {
        self.advance();
        let name = self.name("a variable")?;
        self.expect_sign(Sign::Assign, "=")?;
        let from = self.expression()?;
        self.expect_word("TO")?;
        let to = self.expression()?;
        let step = if self.word("STEP") {
            Some(self.expression()?)
        } else {
            None
        };
        let variable = Variable {
            name,
            reference: Reference::Unresolved,
            subscripts: Vec::new(),
        };
        Ok(Statement::For {
            variable,
            from,
            to,
            step,
        })
    }

    fn goto(&mut self) -> Result<Statement, Problem> {
        self.advance();
        if !self.sign(Sign::Open) {
            return Ok(Statement::Goto(self.label()?));
        }
        let selector = self.expression()?;
        self.expect_sign(Sign::Close, ")")?;
        let mut labels = Vec::new();
        loop {
            labels.push(self.label()?);
            if !self.sign(Sign::Comma) {
                return Ok(Statement::Select(selector, labels));
            }
        }
    }

    fn label(&mut self) -> Result<Name, Problem> {
        let number = matches!(self.peek(), Some(Token::Integer(_)));
        self.name("a label").map_err(|problem| match number {
            true => problem.help("a label is a name: NAME: at the beginning of a line, GOTO NAME"),
            false => problem,
        })
    }

    /// An argument; a variable in parentheses is an expression (scol.md 2.2) and is passed by value.
    fn by_value(&self, argument: Expression) -> Expression {
        let enclosed = self
            .source
            .get(argument.span.start..)
            .is_some_and(|text| text.starts_with('('));
        if !enclosed || !matches!(argument.node, Node::Variable(_)) {
            return argument;
        }
        let span = argument.span;
        Expression {
            node: Node::Unary(Unary::Value, Box::new(argument)),
            span,
        }
    }

    /// A line that begins with a name: an assignment or a call.
    fn named(&mut self) -> Result<Statement, Problem> {
        let name = self.name("a statement")?;
        let list = if self.sign(Sign::Open) {
            Some(self.list(Sign::Close, ")")?)
        } else {
            None
        };
        let component = if self.sign(Sign::Dot) {
            Some(self.component()?)
        } else {
            None
        };
        if self.sign(Sign::Assign) {
            if list.as_ref().is_some_and(Vec::is_empty) {
                return Err(Problem::new(
                    "E0101",
                    self.before(),
                    "expected a subscript between ( and )",
                ));
            }
            let target = Variable {
                name,
                reference: Reference::Unresolved,
                subscripts: list.unwrap_or_default(),
            };
            if component.is_none() && self.word("TASK") {
                return Ok(Statement::Simple(self.task(Some(target))?));
            }
            let value = self.expression()?;
            return Ok(Statement::Simple(Simple::Assign {
                target,
                component,
                value,
            }));
        }
        if component.is_some() {
            return Err(self.expected("\"=\""));
        }
        if self.peek() == Some(&Token::Sign(Sign::Equal)) {
            let problem = Problem::new("E0101", self.span(), "expected \"=\", found \"==\"");
            return Err(problem.help("\"==\" compares; a value is assigned with \"=\""));
        }
        if list.is_none() && !matches!(self.peek(), None | Some(Token::Word(_))) {
            return Err(self.expected("\"=\" or the end of the line"));
        }
        if let (None, Some(Token::Word(next))) = (&list, self.peek())
            && next != "ELSE"
        {
            let message = format!("{} begins no statement", name.text);
            return Err(Problem::new("E0103", name.span, message));
        }
        let arguments = list.unwrap_or_default();
        Ok(Statement::Call(
            name,
            arguments.into_iter().map(|e| self.by_value(e)).collect(),
        ))
    }
}
