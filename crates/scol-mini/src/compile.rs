//! The compiler: parsed file in, flat program out.
//!
//! Its parts run in this order: `declare` makes the variables of GLOBAL and DATA, `names` resolves names, `kinds`
//! checks kinds, `emit` turns statements into steps, `lower` writes the instructions of the steps. `direct` does the
//! same for the one statement of the host command DO, `call` for the call of a subprogram, `probe` for what somebody asks of a
//! program that has stopped. Running the result is left to `machine`; start with [`compile`].

mod call;
mod declare;
mod direct;
mod emit;
mod kinds;
mod names;
mod probe;

use crate::prelude::*;
use alloc::collections::BTreeSet;
use alloc::sync::Arc;

use crate::MAX_SOURCE;
use crate::diagnostic::{Diagnostic, Sink, Span};
use crate::lower;
use crate::options::LanguageOptions;
use crate::parser::{Block, parse_file};
use crate::points::TaughtPoint;
use crate::program::{Entry, Operation, Program, Step, Symbols, fingerprint, hash};
use crate::tree::Name;

pub use call::compile_call;
pub use direct::compile_direct;
pub(crate) use probe::{Probe, compile_probe};

/// A program of one operation that shares the variables of `base`, and ends after it. Where the end costs fuel, as a statement
/// does, a run of one statement does not come to it.
fn single(text: &str, base: &Program, operation: Operation, end_costs: bool) -> Program {
    let step = |operation, head| Step {
        line: 1,
        head,
        operation,
    };
    let mut steps = Vec::from([step(operation, true), step(Operation::Return, end_costs)]);
    Program {
        symbols: Arc::clone(&base.symbols),
        code: lower::code(&mut steps, &[], &base.symbols),
        steps,
        ..Program::without_steps(fingerprint(base.fingerprint, text, &base.options), &base.options)
    }
}

/// The result of a compilation.
#[derive(Debug, Clone, PartialEq)]
pub struct Compilation {
    /// The program; `None` exactly when there is an error among the diagnostics.
    pub program: Option<Arc<Program>>,
    /// Errors and warnings in the order of the source, at most [`MAX_DIAGNOSTICS`](crate::MAX_DIAGNOSTICS).
    pub diagnostics: Vec<Diagnostic>,
}

/// Compiles a file of at most [`MAX_SOURCE`] bytes; an error in one line does not hide those in others.
pub fn compile(source: &str, options: &LanguageOptions) -> Compilation {
    compile_with_points(source, options, &[])
}

/// As [`compile`]; the programs of the file also see these points, as names of DATA that the file does not contain.
/// GLOBAL and DATA of the file come first.
pub fn compile_with_points(source: &str, options: &LanguageOptions, points: &[TaughtPoint]) -> Compilation {
    let mut sink = Sink::new(source);
    let program = build(source, options, points, &mut sink);
    let program = program.filter(|_| !sink.has_errors()).map(Arc::new);
    let mut diagnostics = sink.finish();
    crate::suggest::attach(source, options.arm, points, &mut diagnostics);
    Compilation { program, diagnostics }
}

fn build(
    source: &str,
    options: &LanguageOptions,
    points: &[TaughtPoint],
    sink: &mut Sink,
) -> Option<Program> {
    if source.len() > MAX_SOURCE {
        let found = source.len();
        let message = format!("a file has at most {MAX_SOURCE} bytes, this one has {found}");
        sink.push(Diagnostic::new("E0001", Span::default(), message));
        return None;
    }
    let mut file = parse_file(source, options, sink);
    let mut symbols = Symbols::default();
    declare::globals(&mut file, options, &mut symbols, sink);
    declare::data(&file, points, options, &mut symbols, sink);
    duplicates(file.blocks.iter().map(|block| &block.name), "program", sink);
    let signature = |block: &Block| (block.name.text.clone(), block.parameters.len());
    let signatures: Vec<Signature> = file.blocks.iter().map(signature).collect();
    let (mut steps, mut blocks, mut rcycle) = (Vec::new(), Vec::new(), None);
    for (number, block) in file.blocks.iter_mut().enumerate() {
        let first_local = symbols.slots.len();
        names::resolve_block(block, &file.suppressed, &mut symbols, options.data_copy, sink);
        for located in &mut block.statements {
            kinds::check_statement(&mut located.statement, &symbols, sink);
        }
        blocks.push(Entry {
            name: block.name.text.clone(),
            step: steps.len(),
            parameters: block
                .parameters
                .iter()
                .map(|parameter| parameter.text.clone())
                .collect(),
            locals: first_local..symbols.slots.len(),
        });
        let label = emit::block(block, &file.suppressed, &signatures, &mut steps, sink);
        if number == 0 {
            rcycle = label;
        }
    }
    let code = lower::code(&mut steps, &blocks, &symbols);
    let fingerprint = fingerprint(points_fingerprint(points), source, options);
    Some(Program {
        symbols: Arc::new(symbols),
        blocks,
        steps,
        code,
        rcycle,
        ..Program::without_steps(fingerprint, options)
    })
}

/// A number that tells a table of points from others; 0 for none.
fn points_fingerprint(points: &[TaughtPoint]) -> u64 {
    points.iter().fold(0, |print, point| {
        let position = &point.position;
        let numbers = position.coords.iter().map(|number| number.to_bits());
        let numbers = numbers.chain([position.config.number().unsigned_abs()]);
        let print = numbers.fold(print, |print, number| hash(print, &number.to_le_bytes()));
        hash(print, point.name.as_bytes())
    })
}

/// Name of a program and number of its parameters, for its calls.
type Signature = (String, usize);

/// Reports names that are declared twice.
fn duplicates<'a>(names: impl Iterator<Item = &'a Name>, what: &str, sink: &mut Sink) {
    let mut seen = BTreeSet::new();
    for name in names.filter(|name| !name.text.is_empty()) {
        if !seen.insert(name.text.as_str()) {
            let message = format!("the {what} {} appears twice", name.text);
            sink.push(Diagnostic::new("E0205", name.span, message));
        }
    }
}
