//! Expressions: numbers, comparisons, sums of positions. Integers are checked 32-bit arithmetic, reals 32-bit
//! floats; a result that does not fit is a fault.

use alloc::format;

use super::{Frame, Trouble};
use crate::memory::Memory;
use crate::options::{Arm, IntDivision};
use crate::program::Program;
use crate::request::{FaultKind, Inputs, Number};
use crate::tree::{Binary, Condition, Expression, Node, Unary};
use crate::builtin::System;
use crate::value::{Kind, Value};

/// Everything an expression can look at.
pub(super) struct Context<'a> {
    pub program: &'a Program,
    pub memory: &'a Memory,
    pub inputs: &'a dyn Inputs,
    pub frames: &'a [Frame],
}

impl Context<'_> {
    pub fn evaluate(&self, expression: &Expression) -> Result<Value, Trouble> {
        match &expression.node {
            Node::Literal(value) => Ok(value.clone()),
            Node::Variable(variable) => self.fetch(variable),
            Node::Component(of, letter) => {
                let value = self.evaluate(of)?;
                let found = component(self.program.options.arm, &value, *letter);
                found.map(|value| Value::Real(value as f32)).ok_or_else(|| no_component(&value, *letter))
            }
            Node::Unary(operator, of) => unary(*operator, self.number(of)?),
            Node::Binary(operator @ (Binary::Add | Binary::Subtract), left, right) => {
                self.sum(*operator, self.evaluate(left)?, self.evaluate(right)?)
            }
            Node::Binary(operator, left, right) => {
                let (left, right) = (self.number(left)?, self.number(right)?);
                binary(*operator, left, right, self.program.options.int_division)
            }
            Node::Function(builtin, arguments) => self.function(*builtin, arguments),
            Node::System(system) => Ok(self.system(*system)),
        }
    }

    fn system(&self, system: System) -> Value {
        let conditions = self.memory.conditions();
        match system {
            System::Motion => Value::Real(self.inputs.motion_percent() as f32),
            System::Here => Value::Position(self.inputs.here()),
            System::Mode => Value::Integer(self.inputs.mode()),
            System::Condition(Condition::Speed) => Value::Real(conditions.speed as f32),
            System::Condition(Condition::Accel) => Value::Real(conditions.accel as f32),
            System::Condition(Condition::Decel) => Value::Real(conditions.decel as f32),
            System::Condition(Condition::Config) => {
                let number = conditions.config.number_on(self.program.options.arm);
                Value::Integer(i32::try_from(number).unwrap_or(0))
            }
            System::Condition(Condition::Payload) => {
                Value::Load(conditions.payload.as_ref().map(|(_, load)| load.clone()).unwrap_or_default())
            }
            System::Condition(Condition::Work) => Value::Coordinate(conditions.work.trans.clone()),
            System::Condition(Condition::Tool) => Value::Coordinate(conditions.tool.trans.clone()),
            System::Condition(Condition::Base) => Value::Coordinate(conditions.base.trans.clone()),
        }
    }

    /// Numbers, positions or coordinates, component by component; the left one gives posture and work.
    fn sum(&self, operator: Binary, left: Value, right: Value) -> Result<Value, Trouble> {
        let sign = if operator == Binary::Add { 1.0 } else { -1.0 };
        match (left, right) {
            (Value::Position(mut left), Value::Position(right)) => {
                for (to, from) in left.coords.iter_mut().zip(right.coords) {
                    *to += sign * from;
                }
                Ok(Value::Position(left))
            }
            (Value::Coordinate(mut left), Value::Coordinate(right)) => {
                for (to, from) in left.coords.iter_mut().zip(right.coords) {
                    *to += sign * from;
                }
                Ok(Value::Coordinate(left))
            }
            (left, right) => match (as_number(&left), as_number(&right)) {
                (Some(a), Some(b)) => binary(operator, a, b, self.program.options.int_division),
                _ => {
                    let (left, right) = (left.kind().word(), right.kind().word());
                    let message = format!("{left} and {right} cannot be added or subtracted");
                    Err(Trouble::new(FaultKind::Type, message))
                }
            },
        }
    }

    /// The expression as a number.
    pub fn number(&self, expression: &Expression) -> Result<Number, Trouble> {
        let value = self.evaluate(expression)?;
        as_number(&value).ok_or_else(|| {
            Trouble::new(FaultKind::Type, format!("expected a number, found {}", value.kind().word()))
        })
    }

    /// The expression as a double.
    pub fn double(&self, expression: &Expression) -> Result<f64, Trouble> {
        self.number(expression).map(double)
    }

    /// The expression as an integer; a real is cut toward zero.
    pub fn integer(&self, expression: &Expression) -> Result<i32, Trouble> {
        match self.number(expression)? {
            Number::Integer(value) => Ok(value),
            Number::Real(value) => truncated(value),
        }
    }

    /// The expression as a truth value: everything but 0 is true.
    pub fn truth(&self, expression: &Expression) -> Result<bool, Trouble> {
        self.number(expression).map(truth)
    }
}

fn as_number(value: &Value) -> Option<Number> {
    match value {
        Value::Integer(value) => Some(Number::Integer(*value)),
        Value::Real(value) => Some(Number::Real(*value)),
        Value::Load(_) | Value::Coordinate(_) | Value::Position(_) => None,
    }
}

pub(super) fn double(number: Number) -> f64 {
    match number {
        Number::Integer(value) => f64::from(value),
        Number::Real(value) => f64::from(value),
    }
}

fn single(number: Number) -> f32 {
    match number {
        Number::Integer(value) => value as f32,
        Number::Real(value) => value,
    }
}

fn truth(number: Number) -> bool {
    match number {
        Number::Integer(value) => value != 0,
        Number::Real(value) => value != 0.0,
    }
}

/// A real cut toward zero, if it fits 32 bits.
pub(super) fn truncated(value: f32) -> Result<i32, Trouble> {
    let whole = libm::trunc(f64::from(value));
    if whole >= f64::from(i32::MIN) && whole <= f64::from(i32::MAX) {
        return Ok(whole as i32);
    }
    Err(Trouble::new(FaultKind::Overflow, format!("{value} does not fit an integer of 32 bits")))
}

/// A value as another kind: numbers convert, everything else must be of that kind already.
pub(crate) fn convert(value: Value, kind: Kind) -> Result<Value, Trouble> {
    match (value, kind) {
        (Value::Integer(value), Kind::Real) => Ok(Value::Real(value as f32)),
        (Value::Real(value), Kind::Integer) => truncated(value).map(Value::Integer),
        (value, kind) if value.kind() == kind => Ok(value),
        (value, kind) => {
            let message = format!("expected {}, found {}", kind.word(), value.kind().word());
            Err(Trouble::new(FaultKind::Type, message))
        }
    }
}

/// A finite real.
pub(super) fn real(value: f32) -> Result<Value, Trouble> {
    if value.is_finite() {
        return Ok(Value::Real(value));
    }
    Err(Trouble::new(FaultKind::Overflow, "the result does not fit a real"))
}

fn integer(value: Option<i32>) -> Result<Value, Trouble> {
    let overflow = || Trouble::new(FaultKind::Overflow, "the result does not fit an integer of 32 bits");
    value.map(Value::Integer).ok_or_else(overflow)
}

fn unary(operator: Unary, of: Number) -> Result<Value, Trouble> {
    match (operator, of) {
        (Unary::Not, of) => Ok(Value::Integer(i32::from(!truth(of)))),
        (Unary::Minus, Number::Integer(value)) => integer(value.checked_neg()),
        (Unary::Minus, Number::Real(value)) => Ok(Value::Real(-value)),
        (Unary::Plus, Number::Integer(value)) => Ok(Value::Integer(value)),
        (Unary::Plus, Number::Real(value)) => Ok(Value::Real(value)),
    }
}

/// Two numbers; one real makes the operation real.
pub(super) fn binary(
    operator: Binary,
    left: Number,
    right: Number,
    division: IntDivision,
) -> Result<Value, Trouble> {
    let truth_value = |value: bool| Ok(Value::Integer(i32::from(value)));
    match operator {
        Binary::Or => return truth_value(truth(left) || truth(right)),
        Binary::And => return truth_value(truth(left) && truth(right)),
        Binary::Divide | Binary::Modulo if !truth(right) => {
            return Err(Trouble::new(FaultKind::DivisionByZero, "division by zero"));
        }
        _ => {}
    }
    match (left, right) {
        (Number::Integer(left), Number::Integer(right)) => integers(operator, left, right, division),
        _ => reals(operator, single(left), single(right)),
    }
}

fn integers(operator: Binary, left: i32, right: i32, division: IntDivision) -> Result<Value, Trouble> {
    let relation = |value: bool| Ok(Value::Integer(i32::from(value)));
    match operator {
        Binary::Equal => relation(left == right),
        Binary::NotEqual => relation(left != right),
        Binary::Less => relation(left < right),
        Binary::LessEqual => relation(left <= right),
        Binary::Greater => relation(left > right),
        Binary::GreaterEqual => relation(left >= right),
        Binary::Add => integer(left.checked_add(right)),
        Binary::Subtract => integer(left.checked_sub(right)),
        Binary::Multiply => integer(left.checked_mul(right)),
        Binary::Divide if division == IntDivision::Real => real(left as f32 / right as f32),
        Binary::Divide => integer(left.checked_div(right)),
        Binary::Modulo => integer(Some(left.wrapping_rem(right))),
        Binary::Power => match u32::try_from(right) {
            Ok(exponent) => integer(left.checked_pow(exponent)),
            Err(_) => reals(operator, left as f32, right as f32),
        },
        Binary::Or | Binary::And => relation(false),
    }
}

fn reals(operator: Binary, left: f32, right: f32) -> Result<Value, Trouble> {
    let relation = |value: bool| Ok(Value::Integer(i32::from(value)));
    match operator {
        Binary::Equal => relation(left == right),
        Binary::NotEqual => relation(left != right),
        Binary::Less => relation(left < right),
        Binary::LessEqual => relation(left <= right),
        Binary::Greater => relation(left > right),
        Binary::GreaterEqual => relation(left >= right),
        Binary::Add => real(left + right),
        Binary::Subtract => real(left - right),
        Binary::Multiply => real(left * right),
        Binary::Divide => real(left / right),
        Binary::Modulo => real(libm::fmodf(left, right)),
        Binary::Power => {
            let power = libm::powf(left, right);
            if power.is_nan() {
                let message = format!("{left} cannot be raised to {right}");
                return Err(Trouble::new(FaultKind::Domain, message));
            }
            real(power)
        }
        Binary::Or | Binary::And => relation(false),
    }
}

/// Where in `coords` the coordinate of this letter is.
pub(super) fn component_index(arm: Arm, kind: Kind, letter: u8) -> Option<usize> {
    let letters: &[u8] = match (kind, arm) {
        (Kind::Position, Arm::SixAxis) => b"XYZABCUV",
        (Kind::Position, Arm::Scara) => b"XYZCT",
        (Kind::Coordinate, Arm::SixAxis) => b"XYZABC",
        // The two rotations a SCARA does not have are never named.
        (Kind::Coordinate, Arm::Scara) => b"XYZ--C",
        _ => return None,
    };
    letters.iter().position(|known| *known == letter)
}

fn component(arm: Arm, value: &Value, letter: u8) -> Option<f64> {
    let index = component_index(arm, value.kind(), letter)?;
    match value {
        Value::Position(position) => position.coords.get(index).copied(),
        Value::Coordinate(trans) => trans.coords.get(index).copied(),
        Value::Integer(_) | Value::Real(_) | Value::Load(_) => None,
    }
}

pub(super) fn no_component(value: &Value, letter: u8) -> Trouble {
    let message = format!("{} has no coordinate {}", value.kind().word(), char::from(letter));
    Trouble::new(FaultKind::Type, message)
}
