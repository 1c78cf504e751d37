//! Makes the variables of GLOBAL and DATA with their initial values, and those of `DIM`.
//!
//! Implicit variables, which an assignment makes, are left to `names`. The values that variables have while a program runs
//! are in `memory`.

use crate::prelude::*;
use alloc::collections::BTreeSet;
use alloc::sync::Arc;

use crate::diagnostic::{Diagnostic, Sink};
use crate::machine::{NoInputs, convert, try_value};
use crate::options::LanguageOptions;
use crate::parser::{Datum, Declaration, File};
use crate::points::TaughtPoint;
use crate::program::{Owner, Slot, Symbols, flat_length};
use crate::request::Fault;
use crate::tree::{Expression, Name};
use crate::value::{Frame, Payload, Position, Trans, Value, ValueKind};
use crate::{MAX_ARRAY, MAX_DATA_NAME};

/// Makes the variables of GLOBAL. One that cannot be made is suppressed: its uses are not reported.
pub(super) fn globals(file: &mut File, options: &LanguageOptions, symbols: &mut Symbols, sink: &mut Sink) {
    for declaration in &file.globals {
        if let Err(problem) = global(declaration, options, symbols) {
            sink.push(problem);
            file.suppressed.insert(declaration.name.text.clone());
        } else if declaration.name.text.len() > MAX_DATA_NAME {
            let name = &declaration.name;
            let message = format!("{} is too long to be read or written by a host", name.text);
            let problem = Diagnostic::new("W0209", name.span, message);
            sink.push(problem.help(format!("hosts reach names of at most {MAX_DATA_NAME} characters")));
        }
    }
}

fn global(
    declaration: &Declaration,
    options: &LanguageOptions,
    symbols: &mut Symbols,
) -> Result<(), Diagnostic> {
    let name = &declaration.name;
    if declaration.dim {
        let slot = dim_slot(declaration, Owner::Global, symbols)?;
        return add(symbols, name, slot);
    }
    let initial = |expression: &Expression| match expression.is_constant() {
        true => constant(expression, options)
            .map_err(|error| Diagnostic::new("E0207", expression.span, error.message)),
        false => {
            let message = "an initial value can only use constants";
            Diagnostic::fail("E0210", expression.span, message)
        }
    };
    let value = declaration.value.as_ref().map(initial).transpose()?;
    if declaration.subscripts.is_empty() {
        let plain = || Slot::plain(&name.text, Owner::Global);
        let slot = value.map_or_else(plain, |value| Slot::with_value(&name.text, Owner::Global, value));
        return add(symbols, name, slot);
    }
    let Some(value) = value else { return Ok(()) };
    element(declaration, value, symbols)
}

/// The value of an expression without variables.
fn constant(expression: &Expression, options: &LanguageOptions) -> Result<Value, Box<Fault>> {
    try_value(expression, options, &NoInputs)
}

/// `name(i) = value` in GLOBAL: the initial value of one element.
fn element(declaration: &Declaration, value: Value, symbols: &mut Symbols) -> Result<(), Diagnostic> {
    let name = &declaration.name;
    let slot = symbols.find_mut(&name.text).filter(|slot| slot.bounds.is_some());
    let Some(slot) = slot else {
        let problem = Diagnostic::new("E0212", name.span, format!("{} is not an array", name.text));
        return Err(problem.help("declare it first, with DIM"));
    };
    let Some(index) = slot.index(&declaration.subscripts) else {
        return Diagnostic::fail("E0213", name.span, format!("{} has no such element", name.text));
    };
    let kind = *slot.kind.get_or_insert(value.kind());
    // Numbers convert, reals toward zero.
    let Ok(value) = convert(value, kind) else {
        let message = format!("{} holds {}", name.text, kind.description());
        return Diagnostic::fail("E0207", name.span, message);
    };
    slot.initial.retain(|(known, _)| *known != index);
    slot.initial.push((index, value));
    Ok(())
}

/// The slot of a `DIM`.
pub(super) fn dim_slot(
    declaration: &Declaration,
    owner: Owner,
    symbols: &mut Symbols,
) -> Result<Slot, Diagnostic> {
    let name = &declaration.name;
    let mut slot = Slot {
        kind: declaration.kind,
        zeroed: declaration.kind.is_some(),
        ..Slot::plain(&name.text, owner)
    };
    if declaration.subscripts.is_empty() {
        if slot.zeroed {
            return Ok(slot);
        }
        let problem = Diagnostic::new("E0101", name.span, "expected bounds or a type after the name");
        return Err(problem.help("DIM TABLE(10) AS INTEGER"));
    }
    let length = flat_length(&declaration.subscripts);
    if length > MAX_ARRAY.saturating_sub(symbols.elements) {
        let message = format!("the arrays of a file have at most {MAX_ARRAY} elements together");
        return Diagnostic::fail("E0214", name.span, message);
    }
    symbols.elements += length;
    slot.bounds = Some(declaration.subscripts.clone());
    Ok(slot)
}

/// Makes the names of DATA, and the taught points that the file does not define. Coordinate data comes first, because
/// WORK may name data of a later line; then the names of the points in their order, so that a variable keeps its place
/// when a point is written into the file.
pub(super) fn data(
    file: &File,
    points: &[TaughtPoint],
    options: &LanguageOptions,
    symbols: &mut Symbols,
    sink: &mut Sink,
) {
    let data = file.data.iter();
    let (frames, others): (Vec<&Datum>, Vec<&Datum>) =
        data.partition(|datum| datum.kind == ValueKind::Coordinate);
    let taught: BTreeSet<&str> = points.iter().map(|point| point.name.as_str()).collect();
    let is_taught = |datum: &&Datum| taught.contains(datum.name.text.as_str());
    let (first, last): (Vec<&Datum>, Vec<&Datum>) = others.into_iter().partition(is_taught);
    for datum in frames {
        add_datum(datum, options, symbols, sink);
    }
    for point in points {
        let own = first.iter().filter(|datum| datum.name.text == point.name);
        if own.clone().next().is_none() && !symbols.shared.contains_key(&point.name) {
            let position = point.position.clone().into();
            symbols.share(Slot::with_value(&point.name, Owner::Data, position));
        }
        own.for_each(|datum| add_datum(datum, options, symbols, sink));
    }
    for datum in last {
        add_datum(datum, options, symbols, sink);
    }
}

fn add_datum(datum: &Datum, options: &LanguageOptions, symbols: &mut Symbols, sink: &mut Sink) {
    // A position in a frame that does not exist is still a name: what uses it is not wrong.
    let work = work(datum, symbols).unwrap_or_else(|problem| {
        sink.push(problem);
        None
    });
    let value = match datum.kind {
        ValueKind::Position => Position {
            config: datum.config,
            work,
            ..Position::from_leading(&datum.numbers)
        }
        .into(),
        ValueKind::Coordinate => Trans::from_leading(options.arm, &datum.numbers).into(),
        ValueKind::Load | ValueKind::Integer | ValueKind::Real => {
            Payload::from_leading(&datum.numbers).into()
        }
    };
    let slot = Slot::with_value(&datum.name.text, Owner::Data, value);
    if let Err(problem) = add(symbols, &datum.name, slot) {
        sink.push(problem);
    }
}

/// The coordinate system a WORK line names (DATA-09, DATA-11).
fn work(datum: &Datum, symbols: &mut Symbols) -> Result<Option<Arc<Frame>>, Diagnostic> {
    let Some(name) = &datum.work else { return Ok(None) };
    if let Some(slot) = symbols.find_mut(&name.text)
        && let Some((_, Value::Coordinate(trans))) = slot.initial.first()
    {
        slot.is_work = true;
        let frame = Frame {
            name: Some(name.text.clone()),
            trans: Trans::clone(trans),
        };
        return Ok(Some(Arc::new(frame)));
    }
    let message = format!("expected the name of coordinate data, found {}", name.text);
    Err(Diagnostic::new("E0404", name.span, message).help(format!("add TRANS {}=... to DATA", name.text)))
}

fn add(symbols: &mut Symbols, name: &Name, slot: Slot) -> Result<(), Diagnostic> {
    if symbols.shared.contains_key(&name.text) {
        let message = format!("{} appears twice in GLOBAL and DATA", name.text);
        return Diagnostic::fail("E0205", name.span, message);
    }
    symbols.share(slot);
    Ok(())
}
