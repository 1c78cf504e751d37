//! Arithmetic of numbers. Integers are checked 32-bit arithmetic, reals are 32-bit floats, and one real operand makes an
//! operation real. A result that does not fit is a fault.
//!
//! `vm` has the same rules for its instructions and comes here for whatever is special. Positions and coordinates are left to
//! `evaluate`.

use alloc::format;

use super::RuntimeError;
use crate::code::Relation;
use crate::options::{IntDivision, LanguageOptions};
use crate::request::{FaultKind, Number};
use crate::tree::{Binary, Unary};
use crate::value::{Value, ValueKind};

pub(super) fn as_number(value: &Value) -> Option<Number> {
    match value {
        Value::Integer(value) => Some(Number::Integer(*value)),
        Value::Real(value) => Some(Number::Real(*value)),
        Value::Load(_) | Value::Coordinate(_) | Value::Position(_) => None,
    }
}

/// A number as a value.
pub(super) fn as_value(number: Number) -> Value {
    match number {
        Number::Integer(value) => Value::Integer(value),
        Number::Real(value) => Value::Real(value),
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

pub(super) fn truth(number: Number) -> bool {
    match number {
        Number::Integer(value) => value != 0,
        Number::Real(value) => value != 0.0,
    }
}

/// A real cut toward zero, if it fits 32 bits.
pub(super) fn truncated(value: f32) -> Result<i32, RuntimeError> {
    let whole = libm::trunc(f64::from(value));
    if whole >= f64::from(i32::MIN) && whole <= f64::from(i32::MAX) {
        return Ok(whole as i32);
    }
    Err(RuntimeError::new(
        FaultKind::Overflow,
        format!("{value} does not fit an integer of 32 bits"),
    ))
}

/// A value as another kind: numbers convert, everything else must be of that kind already.
pub(crate) fn convert(value: Value, kind: ValueKind) -> Result<Value, RuntimeError> {
    match (value, kind) {
        (Value::Integer(value), ValueKind::Real) => Ok(Value::Real(value as f32)),
        (Value::Real(value), ValueKind::Integer) => truncated(value).map(Value::Integer),
        (value, kind) if value.kind() == kind => Ok(value),
        (value, kind) => {
            let message = format!(
                "expected {}, found {}",
                kind.description(),
                value.kind().description()
            );
            Err(RuntimeError::new(FaultKind::Type, message))
        }
    }
}

/// A finite real.
pub(super) fn real(value: f32) -> Result<Number, RuntimeError> {
    if value.is_finite() {
        return Ok(Number::Real(value));
    }
    Err(RuntimeError::new(
        FaultKind::Overflow,
        "the result does not fit a real",
    ))
}

fn integer(value: Option<i32>) -> Result<Number, RuntimeError> {
    let overflow = || {
        RuntimeError::new(
            FaultKind::Overflow,
            "the result does not fit an integer of 32 bits",
        )
    };
    value.map(Number::Integer).ok_or_else(overflow)
}

pub(super) fn unary(operator: Unary, of: Number) -> Result<Number, RuntimeError> {
    match (operator, of) {
        (Unary::Not, of) => Ok(Number::Integer(i32::from(!truth(of)))),
        (Unary::Minus, Number::Integer(value)) => integer(value.checked_neg()),
        (Unary::Minus, Number::Real(value)) => Ok(Number::Real(-value)),
        (Unary::Plus | Unary::Value, value) => Ok(value),
    }
}

/// Two numbers; one real makes the operation real.
pub(super) fn binary(
    operator: Binary,
    left: Number,
    right: Number,
    options: &LanguageOptions,
) -> Result<Number, RuntimeError> {
    let truth_value = |value: bool| Ok(Number::Integer(i32::from(value)));
    match operator {
        Binary::Or => return truth_value(truth(left) || truth(right)),
        Binary::And => return truth_value(truth(left) && truth(right)),
        Binary::Divide | Binary::Modulo if !truth(right) => {
            return Err(RuntimeError::new(FaultKind::DivisionByZero, "division by zero"));
        }
        _ => {}
    }
    if let Some(relation) = Relation::from_operator(operator) {
        return truth_value(match (left, right) {
            (Number::Integer(left), Number::Integer(right)) => relation.integers(left, right),
            _ => relation.reals(single(left), single(right), options.equal_within),
        });
    }
    match (left, right) {
        (Number::Integer(left), Number::Integer(right)) => {
            integers(operator, left, right, options.int_division)
        }
        _ => reals(operator, single(left), single(right)),
    }
}

fn integers(operator: Binary, left: i32, right: i32, division: IntDivision) -> Result<Number, RuntimeError> {
    match operator {
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
        // Relations and AND, OR have been dealt with before.
        _ => Ok(Number::Integer(0)),
    }
}

fn reals(operator: Binary, left: f32, right: f32) -> Result<Number, RuntimeError> {
    match operator {
        Binary::Add => real(left + right),
        Binary::Subtract => real(left - right),
        Binary::Multiply => real(left * right),
        Binary::Divide => real(left / right),
        Binary::Modulo => real(libm::fmodf(left, right)),
        Binary::Power => {
            let power = libm::powf(left, right);
            if power.is_nan() {
                let message = format!("{left} cannot be raised to {right}");
                return Err(RuntimeError::new(FaultKind::Domain, message));
            }
            real(power)
        }
        // Relations and AND, OR have been dealt with before.
        _ => Ok(Number::Integer(0)),
    }
}
