//! Compiles an expression or an assignment as a program of the file would contain it, for a debugger.
//!
//! The result is a program of one step that shares variables with its file. Executing it is left to `crate::probe`.

use alloc::sync::Arc;

use super::{names, single};
use crate::MAX_DIRECT;
use crate::diagnostic::{Diagnostic, Sink, Span};
use crate::lexer::{self, Sign, Token};
use crate::parser::Cursor;
use crate::program::{Entry, Operation, Program, Symbols};
use crate::tree::{Expression, Simple, Statement};

/// An expression or an assignment, compiled.
pub(crate) enum Probe {
    /// The value of this expression.
    Value(Expression),
    /// The step of the program is an assignment.
    Assignment,
}

/// Compiles `text` with the names that the block sees; without a block, those of GLOBAL and DATA.
///
/// # Errors
/// It is neither an expression nor an assignment, or names something that the block does not know.
pub(crate) fn compile_probe(
    text: &str,
    base: &Program,
    block: Option<&Entry>,
) -> Result<(Arc<Program>, Probe), Diagnostic> {
    let mut sink = Sink::new(text);
    let mut symbols = Symbols::clone(&base.symbols);
    let mut statement = parse(text, base)?;
    names::resolve_in_block(&mut statement, block, &mut symbols, &mut sink);
    if let Some(problem) = sink.finish().into_iter().next() {
        return Err(problem);
    }
    let operation = if let Statement::Wait(expression) = statement {
        Operation::Wait(expression)
    } else if let Statement::Simple(simple) = statement {
        Operation::Simple(simple)
    } else {
        return not_for_a_probe(text);
    };
    // The end would leave the call.
    let program = single(text, base, operation, true);
    let probe = match program.steps.first().map(|step| &step.operation) {
        Some(Operation::Wait(expression)) => Probe::Value(expression.clone()),
        _ => Probe::Assignment,
    };
    Ok((Arc::new(program), probe))
}

fn not_for_a_probe<T>(text: &str) -> Result<T, Diagnostic> {
    Diagnostic::fail("E0501", whole(text), "expected an expression or an assignment")
}

fn whole(text: &str) -> Span {
    Span::new(0, text.len())
}

/// A WAIT carries an expression: it has one operand, of which the value is asked.
fn parse(text: &str, base: &Program) -> Result<Statement, Diagnostic> {
    let tokens = lexer::tokens(text, whole(text), MAX_DIRECT)?;
    let mut cursor = Cursor::new(text, base.options.arm, &tokens);
    if tokens.is_empty() {
        return Diagnostic::fail("E0101", whole(text), "expected an expression, found nothing");
    }
    if tokens
        .iter()
        .any(|lexeme| lexeme.token == Token::Sign(Sign::Assign))
    {
        let statement = cursor.statement_line()?;
        if let Statement::Simple(Simple::Assign(_)) = statement {
            return Ok(statement);
        }
        return not_for_a_probe(text);
    }
    let expression = cursor.expression()?;
    cursor.end_of_line()?;
    Ok(Statement::Wait(expression))
}
