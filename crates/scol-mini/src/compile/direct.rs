//! Compiles one statement for the host command DO; what needs a program around it is refused (CMD-DO-04).
//!
//! The result is a [`Program`] of that one statement, which shares the memory of the selected file. Sending the reply is left
//! to the controller. Start with [`compile_direct`].

use alloc::sync::Arc;
use alloc::vec::Vec;

use super::{kinds, lower, names};
use crate::diagnostic::{Diagnostic, Problem, Span};
use crate::parser::parse_direct;
use crate::program::{Operation, Program, Step, Symbols, fingerprint};
use crate::sink::Sink;
use crate::tree::{Feature, Simple, Statement};

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
                let step = |operation, head| Step {
                    line: 1,
                    head,
                    operation,
                };
                let steps = Vec::from([
                    step(Operation::Simple(simple), true),
                    step(Operation::Return, false),
                ]);
                return Ok(Arc::new(Program {
                    fingerprint: fingerprint(base.fingerprint, statement, &base.options),
                    options: base.options,
                    symbols: Arc::clone(&base.symbols),
                    blocks: Vec::new(),
                    code: lower::plain(&steps),
                    steps,
                    rcycle: None,
                    created,
                }));
            }
        }
        Err(problem) => sink.error(problem),
    }
    let mut diagnostics = sink.finish();
    crate::suggest::attach_direct(statement, base, &mut diagnostics);
    Err(diagnostics)
}

fn parse(statement: &str, base: &Program) -> Result<Statement, Problem> {
    let whole = Span {
        start: 0,
        end: statement.len(),
    };
    let refused = |what: &str| {
        let message = alloc::format!("{what} cannot be executed directly");
        Err(Problem::new("E0501", whole, message))
    };
    match parse_direct(statement, &base.options)? {
        None => Err(Problem::new(
            "E0101",
            whole,
            "expected a statement, found nothing",
        )),
        // There is no program that it could stop.
        Some(Statement::Simple(Simple::Stop)) => refused("STOP"),
        Some(Statement::Simple(Simple::Task { .. })) => refused("TASK"),
        Some(Statement::Simple(Simple::Yield)) => refused("SWITCH"),
        Some(Statement::Simple(Simple::Kill(_))) => refused("KILL"),
        Some(Statement::Simple(Simple::Ignore)) => refused("IGNORE"),
        Some(Statement::Simple(Simple::Switch(Feature::Monitors, on))) => {
            refused(if on { "ENABLE" } else { "DISABLE" })
        }
        Some(Statement::On { .. }) => refused("ON"),
        Some(parsed @ Statement::Simple(_)) => Ok(parsed),
        Some(Statement::Wait(_)) => refused("WAIT"),
        Some(Statement::If { .. }) => refused("IF"),
        Some(Statement::For { .. }) => refused("FOR"),
        Some(Statement::Next(_)) => refused("NEXT"),
        Some(Statement::Goto(_) | Statement::Select(..)) => refused("GOTO"),
        Some(Statement::Return) => refused("RETURN"),
        Some(Statement::Call(name, _)) => {
            let message = alloc::format!("{} is no statement that can be executed directly", name.text);
            Err(Problem::new("E0501", name.span, message))
        }
    }
}
