//! Reports values of a wrong type, as far as types are known before the program runs.
//!
//! A variable without a declaration gets its type from its first assignment, so the machine checks most types
//! (`machine::vm`, `machine::place`). Start with [`check_statement`].

use crate::prelude::*;

use crate::builtin::{Builtin, Condition, Numeric, System};
use crate::diagnostic::{Diagnostic, Sink, Span};
use crate::program::Symbols;
use crate::tree::{
    Ask, Assignment, Binary, Expression, Node, Reference, Simple, Statement, Takes, Unary, Variable,
};
use crate::value::{Number, ValueKind};

/// Checks one statement.
pub(super) fn check_statement(statement: &mut Statement, symbols: &Symbols, sink: &mut Sink) {
    let mut checker = Checker { symbols, sink };
    statement.expressions(&mut |e, takes| match takes {
        Takes::Number | Takes::Exactly(_) | Takes::Any => checker.expect(e, takes),
        Takes::Assigned => {}
    });
    statement.each(&mut |statement| {
        if let Statement::Simple(simple) = statement {
            checker.targets(simple);
        }
    });
}

struct Checker<'a> {
    symbols: &'a Symbols,
    sink: &'a mut Sink,
}

impl Checker<'_> {
    fn error(&mut self, span: Span, message: String) {
        self.sink.push(Diagnostic::new("E0207", span, message));
    }

    /// Checks the variables that the statement gives a value to.
    fn targets(&mut self, simple: &Simple) {
        match simple {
            Simple::Assign(assignment) => self.assigned(assignment),
            Simple::Ask(Ask::Input(_, targets)) => self.filled("INPUT takes numbers only", targets),
            Simple::Ask(Ask::Task { target, .. }) => self.filled("a task ID is a number", target.as_slice()),
            Simple::Ask(_) | Simple::Change(_) | Simple::Monitors(_) | Simple::Ignore => {}
        }
    }

    /// Checks variables that become a number, which `rule` says.
    fn filled(&mut self, rule: &str, targets: &[Variable]) {
        for target in targets {
            if self.kind(target).is_some_and(|kind| !kind.is_number()) {
                self.error(target.name.span, format!("{rule}, {} is none", target.name.text));
            }
        }
    }

    fn assigned(&mut self, assignment: &Assignment) {
        let (target, value) = (&assignment.target, &assignment.value);
        let component = assignment.component.is_some();
        let found = self.known(value);
        let kind = self.kind(target);
        let number = component || kind.is_some_and(ValueKind::is_number);
        if let Some(found) = found
            && let Some(kind) = kind.or(component.then_some(ValueKind::Real))
            && (if number { !found.is_number() } else { found != kind })
        {
            let expected = if number { "a number" } else { kind.description() };
            let (name, found) = (&target.name.text, found.description());
            self.error(value.span, format!("{name} takes {expected}, found {found}"));
        }
    }

    fn expect(&mut self, expression: &Expression, expected: Takes) {
        let Some(found) = self.known(expression) else {
            return;
        };
        let (fits, word) = match expected {
            Takes::Number => (found.is_number(), "a number"),
            Takes::Exactly(kind) => (found == kind, kind.description()),
            Takes::Any | Takes::Assigned => return,
        };
        if !fits {
            let message = format!("expected {word}, found {}", found.description());
            self.error(expression.span, message);
        }
    }

    fn kind(&self, variable: &Variable) -> Option<ValueKind> {
        match variable.reference {
            Reference::Slot { slot, .. } => self.symbols.slots.get(slot)?.kind,
            Reference::Parameter(_) | Reference::Unresolved => None,
        }
    }

    /// The kind of an expression where it is certain; reports operands that cannot go together.
    fn known(&mut self, expression: &Expression) -> Option<ValueKind> {
        match &expression.node {
            Node::Literal(Number::Integer(_)) => Some(ValueKind::Integer),
            Node::Literal(Number::Real(_)) => Some(ValueKind::Real),
            Node::Variable(variable) => {
                for subscript in &variable.subscripts {
                    self.expect(subscript, Takes::Number);
                }
                self.kind(variable)
            }
            Node::Component(of, _) => {
                let kind = self.known(of);
                if let Some(kind @ (ValueKind::Integer | ValueKind::Real | ValueKind::Load)) = kind {
                    let expected = "expected positional or coordinate data before the dot";
                    self.error(of.span, format!("{expected}, found {}", kind.description()));
                }
                Some(ValueKind::Real)
            }
            Node::Unary(Unary::Value, of) => self.known(of),
            Node::Unary(_, of) => {
                self.expect(of, Takes::Number);
                None
            }
            Node::Binary(operator, left, right) => self.binary(*operator, left, right),
            Node::Function(builtin, arguments) => {
                for argument in arguments {
                    self.expect(argument, Takes::Number);
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
            Node::System(system) => Some(system_kind(*system)),
        }
    }

    fn binary(&mut self, operator: Binary, left: &Expression, right: &Expression) -> Option<ValueKind> {
        if !matches!(operator, Binary::Add | Binary::Subtract | Binary::Multiply) {
            self.expect(left, Takes::Number);
            self.expect(right, Takes::Number);
            let arithmetic = matches!(operator, Binary::Divide | Binary::Modulo | Binary::Power);
            return (!arithmetic).then_some(ValueKind::Integer);
        }
        let (left_kind, right_kind) = (self.known(left), self.known(right));
        let span = left.span.to(right.span);
        let (Some(a), Some(b)) = (left_kind, right_kind) else {
            // One side positional decides: nothing else can be added to it.
            let vector = left_kind.or(right_kind).filter(|kind| !kind.is_number());
            return vector.filter(|_| operator != Binary::Multiply);
        };
        let names = || format!("{} and {}", a.description(), b.description());
        let numbers = a.is_number() && b.is_number();
        if operator == Binary::Multiply {
            let vector = matches!(a, ValueKind::Position | ValueKind::Coordinate);
            if vector && b == ValueKind::Coordinate {
                return Some(a);
            }
            if !numbers {
                self.error(span, format!("{} cannot be multiplied", names()));
            }
            return None;
        }
        if numbers {
            return Some(if a == b { a } else { ValueKind::Real });
        }
        if a != b || a == ValueKind::Load {
            self.error(span, format!("{} cannot be added or subtracted", names()));
        }
        Some(a)
    }
}

fn system_kind(system: System) -> ValueKind {
    match system {
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
    }
}
