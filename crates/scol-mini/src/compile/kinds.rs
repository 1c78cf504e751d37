//! Reports kinds of values that cannot fit, as far as they are known before the program runs.
//!
//! A variable without a declaration gets its kind from its first assignment, so most kinds are checked by the machine
//! (`machine::evaluate`, `machine::place`). Start with [`check_block`].

use alloc::format;

use crate::builtin::{Builtin, System};
use crate::diagnostic::Problem;
use crate::parser::Block;
use crate::program::Symbols;
use crate::sink::Sink;
use crate::tree::{
    Binary, Condition, Expression, Item, MotionKind, Node, Reference, Simple, Statement, Unary, Variable,
};
use crate::value::ValueKind;

/// What a statement takes.
#[derive(Clone, Copy)]
enum Expected {
    Number,
    Exactly(ValueKind),
}

/// Checks the statements of a block.
pub(super) fn check_block(block: &Block, symbols: &Symbols, sink: &mut Sink) {
    for located in &block.statements {
        check_statement(&located.statement, symbols, sink);
    }
}

/// Checks one statement.
pub(super) fn check_statement(statement: &Statement, symbols: &Symbols, sink: &mut Sink) {
    let mut number = |e: &Expression| expect(e, Expected::Number, symbols, sink);
    match statement {
        Statement::Simple(simple) => check_simple(simple, symbols, sink),
        Statement::Wait(e) | Statement::Select(e, _) => number(e),
        Statement::If {
            condition,
            then,
            otherwise,
        } => {
            number(condition);
            check_statement(then, symbols, sink);
            if let Some(otherwise) = otherwise {
                check_statement(otherwise, symbols, sink);
            }
        }
        Statement::For { from, to, step, .. } => {
            number(from);
            number(to);
            step.iter().for_each(number);
        }
        Statement::Call(_, arguments) => {
            for argument in arguments {
                let _ = known(argument, symbols, sink);
            }
        }
        Statement::Next(_) | Statement::Goto(_) | Statement::Return => {}
        Statement::On { condition, action } => {
            number(condition);
            check_statement(action, symbols, sink);
        }
    }
}

fn check_simple(simple: &Simple, symbols: &Symbols, sink: &mut Sink) {
    let position = Expected::Exactly(ValueKind::Position);
    match simple {
        Simple::Assign {
            target,
            component,
            value,
        } => {
            let found = known(value, symbols, sink);
            let kind = variable_kind(target, symbols);
            let number = component.is_some() || kind.is_some_and(ValueKind::is_number);
            if let Some(found) = found
                && let Some(kind) = kind.or(component.map(|_| ValueKind::Real))
                && (if number { !found.is_number() } else { found != kind })
            {
                let expected = if number { "a number" } else { kind.description() };
                let message = format!(
                    "{} takes {expected}, found {}",
                    target.name.text,
                    found.description()
                );
                sink.error(Problem::new("E0207", value.span, message));
            }
        }
        Simple::Set(condition, value) => expect(value, condition_kind(*condition), symbols, sink),
        Simple::Move { motion, with } => {
            match motion {
                MotionKind::Ptp(a) | MotionKind::Line(a) => expect(a, position, symbols, sink),
                MotionKind::Arc(a, b) | MotionKind::Arch(a, b) => {
                    expect(a, position, symbols, sink);
                    expect(b, position, symbols, sink);
                }
                MotionKind::Axis(a, b) | MotionKind::AxisBy(a, b) => {
                    expect(a, Expected::Number, symbols, sink);
                    expect(b, Expected::Number, symbols, sink);
                }
                MotionKind::Ready => {}
            }
            for (condition, value) in with {
                expect(value, condition_kind(*condition), symbols, sink);
            }
        }
        Simple::Print { items, .. } => {
            for item in items {
                if let Item::Value(value) = item {
                    expect(value, Expected::Number, symbols, sink);
                }
            }
        }
        Simple::Input { targets, .. } => {
            for target in targets {
                if variable_kind(target, symbols).is_some_and(|kind| !kind.is_number()) {
                    let message = format!("INPUT takes numbers only, {} is none", target.name.text);
                    sink.error(Problem::new("E0207", target.name.span, message));
                }
            }
        }
        other => check_devices(other, symbols, sink),
    }
}

/// Statements whose operands are numbers only.
fn check_devices(simple: &Simple, symbols: &Symbols, sink: &mut Sink) {
    let mut number = |e: &Expression| expect(e, Expected::Number, symbols, sink);
    match simple {
        Simple::Delay(e) | Simple::Timer(e) | Simple::Kill(e) => number(e),
        Simple::Outputs(list) | Simple::PerAxis(_, list) => list.iter().for_each(number),
        Simple::Bcd(list) => list.iter().for_each(number),
        Simple::Pulse(a, b) | Simple::SetGain(a, b) => {
            number(a);
            number(b);
        }
        Simple::Task {
            target: Some(target), ..
        } if variable_kind(target, symbols).is_some_and(|kind| !kind.is_number()) => {
            let message = format!("a task ID is a number, {} is none", target.name.text);
            sink.error(Problem::new("E0207", target.name.span, message));
        }
        _ => {}
    }
}

fn condition_kind(condition: Condition) -> Expected {
    match condition {
        Condition::Speed
        | Condition::Accel
        | Condition::Decel
        | Condition::Config
        | Condition::Pass
        | Condition::Accur => Expected::Number,
        Condition::Payload => Expected::Exactly(ValueKind::Load),
        Condition::Work | Condition::Tool | Condition::Base => Expected::Exactly(ValueKind::Coordinate),
    }
}

fn expect(expression: &Expression, expected: Expected, symbols: &Symbols, sink: &mut Sink) {
    let Some(found) = known(expression, symbols, sink) else {
        return;
    };
    let (fits, word) = match expected {
        Expected::Number => (found.is_number(), "a number"),
        Expected::Exactly(kind) => (found == kind, kind.description()),
    };
    if !fits {
        sink.error(Problem::new(
            "E0207",
            expression.span,
            format!("expected {word}, found {}", found.description()),
        ));
    }
}

fn variable_kind(variable: &Variable, symbols: &Symbols) -> Option<ValueKind> {
    match variable.reference {
        Reference::Slot { slot, .. } => symbols.slots.get(slot)?.kind,
        Reference::Parameter(_) | Reference::Unresolved => None,
    }
}

/// The kind of an expression where it is certain; reports operands that cannot go together.
fn known(expression: &Expression, symbols: &Symbols, sink: &mut Sink) -> Option<ValueKind> {
    match &expression.node {
        Node::Literal(value) => Some(value.kind()),
        Node::Variable(variable) => {
            for subscript in &variable.subscripts {
                expect(subscript, Expected::Number, symbols, sink);
            }
            variable_kind(variable, symbols)
        }
        Node::Component(of, _) => {
            let kind = known(of, symbols, sink);
            if let Some(kind @ (ValueKind::Integer | ValueKind::Real | ValueKind::Load)) = kind {
                let message = format!(
                    "expected positional or coordinate data before the dot, found {}",
                    kind.description()
                );
                sink.error(Problem::new("E0207", of.span, message));
            }
            Some(ValueKind::Real)
        }
        Node::Unary(Unary::Value, of) => known(of, symbols, sink),
        Node::Unary(_, of) => {
            expect(of, Expected::Number, symbols, sink);
            None
        }
        Node::Binary(operator, left, right) => binary(*operator, left, right, symbols, sink),
        Node::Function(builtin, arguments) => {
            for argument in arguments {
                expect(argument, Expected::Number, symbols, sink);
            }
            match builtin {
                Builtin::Point => Some(ValueKind::Position),
                Builtin::Trans => Some(ValueKind::Coordinate),
                Builtin::Payload => Some(ValueKind::Load),
                Builtin::Int | Builtin::Sgn | Builtin::Din | Builtin::Dout | Builtin::Bcdin => {
                    Some(ValueKind::Integer)
                }
                Builtin::Gain | Builtin::Torque => Some(ValueKind::Real),
                _ => None,
            }
        }
        Node::System(system) => Some(match system {
            System::Motion | System::Timer | System::MotionTime | System::Remain | System::RemainTime => {
                ValueKind::Real
            }
            System::Here | System::Dest => ValueKind::Position,
            System::Mode | System::TaskId | System::MaxTask => ValueKind::Integer,
            System::Condition(condition) => match condition_kind(*condition) {
                Expected::Number if matches!(condition, Condition::Config | Condition::Accur) => {
                    ValueKind::Integer
                }
                Expected::Number => ValueKind::Real,
                Expected::Exactly(kind) => kind,
            },
        }),
    }
}

fn binary(
    operator: Binary,
    left: &Expression,
    right: &Expression,
    symbols: &Symbols,
    sink: &mut Sink,
) -> Option<ValueKind> {
    if operator == Binary::Multiply {
        let (first, second) = (known(left, symbols, sink), known(right, symbols, sink));
        return match (first, second) {
            (Some(kind @ (ValueKind::Position | ValueKind::Coordinate)), Some(ValueKind::Coordinate)) => {
                Some(kind)
            }
            (Some(a), Some(b)) if !a.is_number() || !b.is_number() => {
                let message = format!("{} and {} cannot be multiplied", a.description(), b.description());
                sink.error(Problem::new("E0207", left.span.to(right.span), message));
                None
            }
            _ => None,
        };
    }
    if !matches!(operator, Binary::Add | Binary::Subtract) {
        expect(left, Expected::Number, symbols, sink);
        expect(right, Expected::Number, symbols, sink);
        let arithmetic = matches!(operator, Binary::Divide | Binary::Modulo | Binary::Power);
        return if arithmetic {
            None
        } else {
            Some(ValueKind::Integer)
        };
    }
    let (left_kind, right_kind) = (known(left, symbols, sink), known(right, symbols, sink));
    let (Some(a), Some(b)) = (left_kind, right_kind) else {
        // One side positional decides: nothing else can be added to it.
        return left_kind.or(right_kind).filter(|kind| !kind.is_number());
    };
    if a.is_number() && b.is_number() {
        return Some(if a == b { a } else { ValueKind::Real });
    }
    if a != b || a == ValueKind::Load {
        let message = format!(
            "{} and {} cannot be added or subtracted",
            a.description(),
            b.description()
        );
        sink.error(Problem::new("E0207", left.span.to(right.span), message));
    }
    Some(a)
}
