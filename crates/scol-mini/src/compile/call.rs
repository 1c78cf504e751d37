//! Compiles a call such as `PLACE(2, 30.5)` to be run instead of the main program: tests of a subprogram begin so.
//!
//! The result is the file's program with a block after its own that makes the call. Its lines are 0: they are none of the file.
//! Start with [`compile_call`].

use crate::prelude::*;
use alloc::sync::Arc;

use super::{kinds, names};
use crate::diagnostic::{Diagnostic, Sink, Span};
use crate::lower;
use crate::parser::parse_direct;
use crate::program::{Entry, Operation, Program, Step, Symbols, fingerprint};
use crate::suggest;
use crate::tree::{Name, Statement};

/// The program `base` with this call as its main program. Names resolve in GLOBAL and DATA of `base`.
///
/// # Errors
/// The diagnostics, at least one of them an error; lines count from 1 within `call`.
pub fn compile_call(call: &str, base: &Program) -> Result<Arc<Program>, Vec<Diagnostic>> {
    let mut sink = Sink::new(call);
    let mut symbols = Symbols::clone(&base.symbols);
    let mut parsed = match parse_direct(call, &base.options) {
        Ok(Some(parsed)) => parsed,
        Ok(None) => {
            let message = "expected a call such as PLACE(2, 30.5), found nothing";
            return Err(Vec::from([Diagnostic::new(
                "E0101",
                Span::new(0, call.len()),
                message,
            )]));
        }
        Err(problem) => {
            sink.push(problem);
            return Err(finish(sink, call, base));
        }
    };
    names::resolve_direct(&mut parsed, &mut symbols, &mut sink);
    kinds::check_statement(&mut parsed, &symbols, &mut sink);
    let Statement::Call(name, arguments) = parsed else {
        let message = "expected a call such as PLACE(2, 30.5), found another statement";
        return Err(Vec::from([Diagnostic::new(
            "E0501",
            Span::new(0, call.len()),
            message,
        )]));
    };
    let block = match find(&name, arguments.len(), base) {
        Ok(block) => block,
        Err(problem) => {
            sink.push(problem);
            return Err(finish(sink, call, base));
        }
    };
    if sink.has_errors() {
        return Err(finish(sink, call, base));
    }
    let step = |operation, head| Step {
        line: 0,
        head,
        operation,
    };
    let (mut steps, mut blocks) = (base.steps.clone(), base.blocks.clone());
    let first = steps.len();
    blocks.push(Entry {
        name: call.trim().to_string(),
        parameters: Vec::new(),
        step: first,
        locals: 0..0,
    });
    steps.push(step(Operation::Call { block, arguments }, true));
    steps.push(step(Operation::Return, false));
    Ok(Arc::new(Program {
        fingerprint: fingerprint(base.fingerprint, call, &base.options),
        options: base.options,
        symbols: Arc::clone(&base.symbols),
        code: lower::code(&mut steps, &blocks, &base.symbols),
        blocks,
        steps,
        first,
        rcycle: None,
        created: 0,
    }))
}

/// The block that a call names, which takes so many arguments.
fn find(name: &Name, arguments: usize, base: &Program) -> Result<usize, Diagnostic> {
    let mut known = base.blocks.iter().enumerate();
    let Some((at, entry)) = known.find(|(_, entry)| entry.name == name.text) else {
        let message = format!("this file has no program {}", name.text);
        let problem = Diagnostic::new("E0203", name.span, message);
        let names = base.blocks.iter().map(|entry| entry.name.as_str());
        return Err(match suggest::nearest(&name.text, names) {
            Some(meant) => problem.help(format!("did you mean {meant}?")),
            None => problem,
        });
    };
    let takes = entry.parameters.len();
    if takes != arguments {
        let message = format!("{} takes {takes} arguments, found {arguments}", name.text);
        return Diagnostic::fail("E0206", name.span, message);
    }
    Ok(at)
}

fn finish(sink: Sink, call: &str, base: &Program) -> Vec<Diagnostic> {
    let mut diagnostics = sink.finish();
    suggest::attach_direct(call, base, &mut diagnostics);
    diagnostics
}
