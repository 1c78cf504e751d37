//! Compiles one statement for the host command DO and refuses statements that need a program around them (CMD-DO-04).
//!
//! The result is a [`Program`] of that one statement, which shares the memory of the selected file. Sending the reply is left
//! to the controller. Start with [`compile_direct`].

use crate::prelude::*;
use alloc::sync::Arc;

use super::{kinds, names, single};
use crate::diagnostic::{Diagnostic, Sink, Span};
use crate::lexer::leading_word;
use crate::parser::parse_direct;
use crate::program::{Operation, Program, Symbols};
use crate::request::Request;
use crate::tree::{Ask, Simple, Statement};

/// Compiles one statement for direct execution.
///
/// Names resolve in GLOBAL and DATA of `base`, so the [`Memory`](crate::Memory) of `base` fits the result. Control
/// flow, labels, calls and names `base` does not have are errors; but INPUT makes a variable of its own for such a name.
///
/// # Errors
/// The diagnostics, at least one of them an error; lines count from 1 within `statement`.
pub fn compile_direct(statement: &str, base: &Program) -> Result<Arc<Program>, Vec<Diagnostic>> {
    let mut sink = Sink::new(statement);
    let mut symbols = Symbols::clone(&base.symbols);
    match parse(statement, base) {
        Ok(mut parsed) => {
            let created = names::resolve_direct(&mut parsed, &mut symbols, &mut sink);
            kinds::check_statement(&mut parsed, &symbols, &mut sink);
            if let (Statement::Simple(simple), false) = (parsed, sink.has_errors()) {
                return Ok(Arc::new(Program {
                    created,
                    ..single(statement, base, Operation::Simple(simple), false)
                }));
            }
        }
        Err(problem) => sink.push(problem),
    }
    let mut diagnostics = sink.finish();
    crate::suggest::attach_direct(statement, base, &mut diagnostics);
    Err(diagnostics)
}

fn parse(statement: &str, base: &Program) -> Result<Statement, Diagnostic> {
    let whole = Span::new(0, statement.len());
    let refused =
        |what: &str| Diagnostic::fail("E0501", whole, format!("{what} cannot be executed directly"));
    match parse_direct(statement, &base.options)? {
        None => Diagnostic::fail("E0101", whole, "expected a statement, found nothing"),
        Some(Statement::Simple(Simple::Ask(Ask::Task { .. }))) => refused("TASK"),
        // There is no program that it could stop, nor a task.
        Some(
            Statement::Simple(
                Simple::Ask(Ask::Kill(_) | Ask::Fixed(Request::Stop | Request::Switch))
                | Simple::Monitors(_)
                | Simple::Ignore,
            )
            | Statement::On { .. }
            | Statement::Wait(_)
            | Statement::If { .. }
            | Statement::For(_)
            | Statement::Next(_)
            | Statement::Goto(_)
            | Statement::Select(..)
            | Statement::Return,
        ) => refused(&leading_word(statement.trim_start()).0.to_ascii_uppercase()),
        Some(parsed @ Statement::Simple(_)) => Ok(parsed),
        Some(Statement::Call(name, _)) => {
            let message = format!("{} cannot be executed directly", name.text);
            Diagnostic::fail("E0501", name.span, message)
        }
    }
}
