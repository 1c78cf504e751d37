//! Reports kinds of values that cannot fit, as far as they are known before the program runs.
//!
//! A variable without a declaration gets its kind from its first assignment, so most kinds are checked by the machine
//! (`machine::evaluate`, `machine::place`). Start with [`check_block`].

use alloc::format;

use crate::builtin::{Builtin, Numeric, System};
use crate::conditions::Condition;
use crate::diagnostic::Problem;
use crate::parser::Block;
use crate::program::Symbols;
use crate::sink::Sink;
use crate::tree::{Binary, Expression, Node, Reference, Simple, Statement, Takes, Unary, Variable};
use crate::value::ValueKind;

/// Checks the statements of a block.
pub(super) fn check_block(block: &mut Block, symbols: &Symbols, sink: &mut Sink) {
    for located in &mut block.statements {
        check_statement(&mut located.statement, symbols, sink);
    }
}

/// Checks one statement.
pub(super) fn check_statement(statement: &mut Statement, symbols: &Symbols, sink: &mut Sink) {
    statement.expressions(&mut |e, takes| match takes {
        Takes::Number | Takes::Exactly(_) => expect(e, takes, symbols, sink),
        Takes::Any => drop(known(e, symbols, sink)),
        Takes::Assigned => {}
    });
    statement.each(&mut |statement| {
        if let Statement::Simple(simple) = statement {
            check_targets(simple, symbols, sink);
        }
    });
}

/// Checks the variables that the statement gives a value to.
fn check_targets(simple: &Simple, symbols: &Symbols, sink: &mut Sink) {
    let no_number = |target: &Variable| variable_kind(target, symbols).is_some_and(|kind| !kind.is_number());
    if let Simple::Assign {
        target,
        component,
        value,
    } = simple
    {
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
    } else if let Simple::Input { targets, .. } = simple {
        for target in targets.iter().filter(|target| no_number(target)) {
            let message = format!("INPUT takes numbers only, {} is none", target.name.text);
            sink.error(Problem::new("E0207", target.name.span, message));
        }
    } else if let Simple::Task {
        target: Some(target), ..
    } = simple
        && no_number(target)
    {
        let message = format!("a task ID is a number, {} is none", target.name.text);
        sink.error(Problem::new("E0207", target.name.span, message));
    }
}

fn expect(expression: &Expression, expected: Takes, symbols: &Symbols, sink: &mut Sink) {
    let Some(found) = known(expression, symbols, sink) else {
        return;
    };
    let (fits, word) = match expected {
        Takes::Number => (found.is_number(), "a number"),
        Takes::Exactly(kind) => (found == kind, kind.description()),
        Takes::Any | Takes::Assigned => return,
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
                expect(subscript, Takes::Number, symbols, sink);
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
            expect(of, Takes::Number, symbols, sink);
            None
        }
        Node::Binary(operator, left, right) => binary(*operator, left, right, symbols, sink),
        Node::Function(builtin, arguments) => {
            for argument in arguments {
                expect(argument, Takes::Number, symbols, sink);
            }
            match builtin {
                Builtin::Point => Some(ValueKind::Position),
                Builtin::Trans => Some(ValueKind::Coordinate),
                Builtin::Payload => Some(ValueKind::Load),
                Builtin::Din | Builtin::Dout | Builtin::Bcdin => Some(ValueKind::Integer),
                Builtin::Gain | Builtin::Torque => Some(ValueKind::Real),
                Builtin::Numeric(Numeric::Int | Numeric::Sgn) => Some(ValueKind::Integer),
                Builtin::Numeric(_) | Builtin::Max | Builtin::Min => None,
            }
        }
        Node::System(system) => Some(match system {
            System::Motion | System::Timer | System::MotionTime | System::Remain | System::RemainTime => {
                ValueKind::Real
            }
            System::Here | System::Dest => ValueKind::Position,
            System::Mode | System::TaskId | System::MaxTask => ValueKind::Integer,
            System::Condition(Condition::Config | Condition::Accur) => ValueKind::Integer,
            System::Condition(condition) => match condition.takes() {
                Takes::Exactly(kind) => kind,
                Takes::Number | Takes::Any | Takes::Assigned => ValueKind::Real,
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
        expect(left, Takes::Number, symbols, sink);
        expect(right, Takes::Number, symbols, sink);
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
