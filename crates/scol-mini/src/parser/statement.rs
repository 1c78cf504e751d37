//! Parses statements, one a line; `IF` holds one or two more.
//!
//! The place of each statement is checked here; names are resolved later. Statements that ask for something outside are
//! in `ask`.

use crate::prelude::*;

use super::Cursor;
use crate::builtin::{self, System};
use crate::diagnostic::{Diagnostic, Span};
use crate::fix::Edit;
use crate::lexer::{Sign, Token};
use crate::tree::{
    Assignment, Change, Counting, Expression, Name, Node, PerAxis, Relation, Simple, Statement, Unary,
    Variable,
};

impl Cursor<'_> {
    /// A statement up to the end of the line.
    pub fn statement_line(&mut self) -> Result<Statement, Diagnostic> {
        let statement = self.statement()?;
        self.end_of_line()?;
        Ok(statement)
    }

    pub(super) fn statement(&mut self) -> Result<Statement, Diagnostic> {
        let (word, span) = (self.peek_word(), self.span());
        if word.is_empty() {
            return Err(self.expected("a statement"));
        }
        if word == "IF" {
            return self.nested(Self::branch);
        }
        self.advance();
        let assigned = self.is_next(Sign::Assign);
        if let Some(condition) = builtin::condition(word).filter(|_| assigned) {
            let value = self.setting(Some(condition))?;
            return Ok(Statement::Simple(Simple::Change(Change::Set(condition, value))));
        }
        let simple = match word {
            "FOR" => return self.for_loop(),
            "NEXT" => return self.next(),
            "GOTO" => return self.goto(),
            "WAIT" => return self.expression().map(Statement::Wait),
            "RETURN" => return Ok(Statement::Return),
            "ON" => return self.monitor(),
            "IGNORE" => Simple::Ignore,
            "FREELOAD" => Simple::Change(Change::FreeLoad),
            "ENABLE" | "DISABLE" => self.switch(word == "ENABLE")?,
            "SETGAIN" => Simple::Change(Change::SetGain(self.operands(word)?)),
            "GAIN" if assigned => self.per_axis(PerAxis::Gain)?,
            "TORQUE" if assigned => self.per_axis(PerAxis::Torque)?,
            _ => match self.ask(word, assigned)? {
                Some(ask) => Simple::Ask(ask),
                None if builtin::is_reserved(word, self.arm) => return Err(misplaced(word, span)),
                None => return self.named(Name::new(word, span)),
            },
        };
        Ok(Statement::Simple(simple))
    }

    fn branch(&mut self) -> Result<Statement, Diagnostic> {
        self.advance();
        let condition = self.expression()?;
        self.expect_word("THEN")?;
        let then = Box::new(self.inner()?);
        let otherwise = self.word("ELSE").then(|| self.inner().map(Box::new));
        Ok(Statement::If {
            condition,
            then,
            otherwise: otherwise.transpose()?,
        })
    }

    /// The statement after THEN or ELSE.
    fn inner(&mut self) -> Result<Statement, Diagnostic> {
        let span = self.span();
        if self.peek().is_none() {
            let problem = self.expected("a statement");
            return Err(problem.help("write an IF on one line, with a statement after THEN and ELSE"));
        }
        let statement = self.statement()?;
        if matches!(statement, Statement::For(_) | Statement::Next(_)) {
            let problem = Diagnostic::new("E0103", span, "FOR and NEXT cannot depend on an IF");
            return Err(problem.help("jump over the loop, or out of it, with GOTO"));
        }
        Ok(statement)
    }

    fn for_loop(&mut self) -> Result<Statement, Diagnostic> {
        let variable = Variable::new(self.name("a variable")?, Vec::new());
        self.expect_sign(Sign::Assign)?;
        let from = self.expression()?;
        self.expect_word("TO")?;
        Ok(Statement::For(Counting {
            variable,
            from,
            to: self.expression()?,
            step: self.word("STEP").then(|| self.expression()).transpose()?,
        }))
    }

    fn next(&mut self) -> Result<Statement, Diagnostic> {
        let name = self.peek().map(|_| self.name("the variable of the FOR"));
        name.transpose().map(Statement::Next)
    }

    fn goto(&mut self) -> Result<Statement, Diagnostic> {
        if !self.sign(Sign::Open) {
            return self.label().map(Statement::Goto);
        }
        let selector = self.expression()?;
        self.expect_sign(Sign::Close)?;
        Ok(Statement::Select(selector, self.separated(Self::label)?))
    }

    fn label(&mut self) -> Result<Name, Diagnostic> {
        let number = matches!(self.peek(), Some(Token::Integer(_)));
        self.name("a label").map_err(|problem| match number {
            true => {
                problem.help("use a name for the label: NAME: at the beginning of a line, then GOTO NAME")
            }
            false => problem,
        })
    }

    /// `ON condition DO statement`.
    fn monitor(&mut self) -> Result<Statement, Diagnostic> {
        let condition = self.expression()?;
        self.expect_word("DO")?;
        let span = self.span();
        let action = Box::new(self.nested(Self::statement)?);
        match *action {
            Statement::Simple(_) | Statement::Goto(_) | Statement::Select(..) | Statement::Call(..) => {
                Ok(Statement::On { condition, action })
            }
            Statement::Wait(_)
            | Statement::If { .. }
            | Statement::For(_)
            | Statement::Next(_)
            | Statement::Return
            | Statement::On { .. } => {
                let problem = Diagnostic::new("E0103", span, "this statement is not allowed after DO");
                Err(problem.help("GOTO, a call, or a statement that does one thing"))
            }
        }
    }

    /// An argument; a variable in parentheses is an expression (scol.md 2.2) and is passed by value.
    fn by_value(&self, argument: Expression) -> Expression {
        let span = argument.span;
        if !span.text(self.source).starts_with('(') || !matches!(argument.node, Node::Variable(_)) {
            return argument;
        }
        Expression::new(Node::Unary(Unary::Value, Box::new(argument)), span)
    }

    /// A line that begins with this name: an assignment or a call.
    fn named(&mut self, name: Name) -> Result<Statement, Diagnostic> {
        let list = self.subscripts()?;
        let component = self.sign(Sign::Dot).then(|| self.component()).transpose()?;
        if self.sign(Sign::Assign) {
            if list.as_ref().is_some_and(Vec::is_empty) {
                let message = "expected a subscript between ( and )";
                return Diagnostic::fail("E0101", self.before(), message);
            }
            let target = Variable::new(name, list.unwrap_or_default());
            if component.is_none() && self.word("TASK") {
                return Ok(Statement::Simple(Simple::Ask(self.task(Some(target))?)));
            }
            return Ok(Statement::Simple(Simple::Assign(Assignment {
                target,
                component,
                value: self.expression()?,
            })));
        }
        if component.is_some() {
            return Err(self.expected("\"=\""));
        }
        if self.is_next(Sign::Relation(Relation::Equal)) {
            let problem = Diagnostic::new("E0101", self.span(), "expected \"=\", found \"==\"");
            let problem = problem.help("\"==\" compares; assign with \"=\"");
            return Err(problem.fix(Edit::replace(self.span(), "=")));
        }
        if list.is_none() && self.peek().is_some() {
            match self.peek_word() {
                "" => return Err(self.expected("\"=\" or the end of the line")),
                "ELSE" => {}
                _ => {
                    let message = format!("{} is not a statement", name.text);
                    return Diagnostic::fail("E0103", name.span, message);
                }
            }
        }
        let arguments = list.unwrap_or_default().into_iter();
        let arguments = arguments.map(|argument| self.by_value(argument)).collect();
        Ok(Statement::Call(name, arguments))
    }
}

/// The problem of a word of the language that is not a statement.
fn misplaced(word: &str, span: Span) -> Diagnostic {
    let problem = Diagnostic::new("E0103", span, format!("expected a statement, found {word}"));
    match word {
        "DIM" => problem.help("put DIM in GLOBAL or before the first statement of a program"),
        "TIMER" => problem.help("set it with TIMER = seconds"),
        _ if builtin::condition(word).is_some() => problem.help(format!("set it with {word} = value")),
        _ if System::from_word(word).is_some() => problem.help(format!("{word} can only be read")),
        "DIN" | "BCDIN" => problem.help(format!("{word}(...) is a value, as in WAIT DIN(1) == ON")),
        _ => problem.help(format!(
            "{word} is a word of the language; choose another name for a variable"
        )),
    }
}
