//! Arithmetic of numbers. Integers are checked 32-bit arithmetic, reals are 32-bit floats, and one real operand makes an
//! operation real. A result that does not fit is a fault.
//!
//! Positions and coordinates are left to `evaluate`.

use crate::prelude::*;

use super::Result;
use crate::options::{IntDivision, LanguageOptions};
use crate::request::{Fault, FaultKind};
use crate::tree::{Binary, Relation, Unary};
use crate::value::{Number, Value, ValueKind};

#[inline(always)]
pub(super) fn double(number: Number) -> f64 {
    match number {
        Number::Integer(value) => f64::from(value),
        Number::Real(value) => f64::from(value),
    }
}

#[inline(always)]
pub(super) fn single(number: Number) -> f32 {
    match number {
        Number::Integer(value) => value as f32,
        Number::Real(value) => value,
    }
}

#[inline(always)]
pub(super) fn truth(number: Number) -> bool {
    match number {
        Number::Integer(value) => value != 0,
        Number::Real(value) => value != 0.0,
    }
}

/// A real cut toward zero, if it fits 32 bits.
pub(super) fn truncated(value: f32) -> Result<i32> {
    let whole = libm::trunc(f64::from(value));
    if whole >= f64::from(i32::MIN) && whole <= f64::from(i32::MAX) {
        return Ok(whole as i32);
    }
    FaultKind::Overflow.fail(format!("{whole} does not fit an integer of 32 bits"))
}

/// A value as another kind: numbers convert, everything else must be of that kind already.
pub(crate) fn convert(value: Value, kind: ValueKind) -> Result<Value> {
    match (value, kind) {
        (Value::Integer(value), ValueKind::Real) => Ok(Value::Real(value as f32)),
        (Value::Real(value), ValueKind::Integer) => truncated(value).map(Value::Integer),
        (value, kind) if value.kind() == kind => Ok(value),
        (value, kind) => Err(unexpected(kind.description(), &value)),
    }
}

/// A value of another kind than the statement takes.
pub(super) fn unexpected(expected: &str, found: &Value) -> Box<Fault> {
    let found = found.kind().description();
    FaultKind::Type.error(format!("expected {expected}, found {found}"))
}

/// A finite real.
#[inline(always)]
pub(super) fn real(value: f32) -> Result<Number> {
    if value.is_finite() {
        return Ok(Number::Real(value));
    }
    Err(real_overflow())
}

#[cold]
fn real_overflow() -> Box<Fault> {
    FaultKind::Overflow.error("the result does not fit a real")
}

#[inline(always)]
pub(super) fn integer(value: Option<i32>) -> Result<Number> {
    value.map(Number::Integer).ok_or_else(integer_overflow)
}

#[cold]
pub(super) fn integer_overflow() -> Box<Fault> {
    FaultKind::Overflow.error("the result does not fit an integer of 32 bits")
}

pub(super) fn unary(operator: Unary, of: Number) -> Result<Number> {
    match (operator, of) {
        (Unary::Not, of) => Ok(Number::Integer(i32::from(!truth(of)))),
        (Unary::Minus, Number::Integer(value)) => integer(value.checked_neg()),
        (Unary::Minus, Number::Real(value)) => Ok(Number::Real(-value)),
        (Unary::Plus | Unary::Value, value) => Ok(value),
    }
}

/// Two numbers; one real makes the operation real.
#[inline(always)]
pub(super) fn binary(
    operator: Binary,
    left: Number,
    right: Number,
    options: &LanguageOptions,
) -> Result<Number> {
    match (left, right) {
        (Number::Integer(left), Number::Integer(right)) => integers(operator, left, right, options),
        _ => reals(operator, single(left), single(right), options.equal_within),
    }
}

#[inline(always)]
pub(super) fn integers(operator: Binary, left: i32, right: i32, options: &LanguageOptions) -> Result<Number> {
    match operator {
        Binary::Or => Ok(truth_value(left != 0 || right != 0)),
        Binary::And => Ok(truth_value(left != 0 && right != 0)),
        Binary::Relation(relation) => Ok(truth_value(holds(relation, &left, &right))),
        Binary::Add => integer(left.checked_add(right)),
        Binary::Subtract => integer(left.checked_sub(right)),
        Binary::Multiply => integer(left.checked_mul(right)),
        Binary::Divide | Binary::Modulo if right == 0 => Err(division_by_zero()),
        Binary::Divide if options.int_division == IntDivision::Real => real(left as f32 / right as f32),
        Binary::Divide => integer(left.checked_div(right)),
        Binary::Modulo => Ok(Number::Integer(left.wrapping_rem(right))),
        Binary::Power => match u32::try_from(right) {
            Ok(exponent) => integer(left.checked_pow(exponent)),
            Err(_) => reals(operator, left as f32, right as f32, 0.0),
        },
    }
}

#[inline(always)]
pub(super) fn reals(operator: Binary, left: f32, right: f32, within: f32) -> Result<Number> {
    match operator {
        Binary::Or => Ok(truth_value(left != 0.0 || right != 0.0)),
        Binary::And => Ok(truth_value(left != 0.0 && right != 0.0)),
        Binary::Relation(relation) => Ok(truth_value(reals_hold(relation, left, right, within))),
        Binary::Add => real(left + right),
        Binary::Subtract => real(left - right),
        Binary::Multiply => real(left * right),
        Binary::Divide | Binary::Modulo if right == 0.0 => Err(division_by_zero()),
        Binary::Divide => real(left / right),
        Binary::Modulo => real(libm::fmodf(left, right)),
        Binary::Power => {
            let power = libm::powf(left, right);
            if power.is_nan() {
                return FaultKind::Domain.fail(format!("{left} cannot be raised to {right}"));
            }
            real(power)
        }
    }
}

fn truth_value(holds: bool) -> Number {
    Number::Integer(i32::from(holds))
}

#[cold]
fn division_by_zero() -> Box<Fault> {
    FaultKind::DivisionByZero.error("division by zero")
}

/// Whether a relation holds between two reals, of which those that differ by `within` or less are equal.
#[inline(always)]
pub(super) fn reals_hold(relation: Relation, left: f32, right: f32, within: f32) -> bool {
    if within > 0.0 && near(left, right, within) {
        return holds(relation, &left, &left);
    }
    holds(relation, &left, &right)
}

/// Whether a relation holds between two numbers.
#[inline(always)]
pub(super) fn holds<T: PartialOrd>(relation: Relation, left: &T, right: &T) -> bool {
    match relation {
        Relation::Equal => left == right,
        Relation::NotEqual => left != right,
        Relation::Less => left < right,
        Relation::LessEqual => left <= right,
        Relation::Greater => left > right,
        Relation::GreaterEqual => left >= right,
    }
}

/// Whether two reals differ by `within` or less. The last digit of the larger one is allowed for: 1.001 and 1.0 as
/// written in a program differ by 0.001, but as reals by a little more.
fn near(a: f32, b: f32, within: f32) -> bool {
    let (a, b) = (f64::from(a), f64::from(b));
    let digit = libm::fmax(libm::fabs(a), libm::fabs(b)) * f64::from(f32::EPSILON);
    libm::fabs(a - b) <= f64::from(within) + digit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reals_within_the_difference_are_equal_and_neither_less_nor_greater() {
        for (a, b, within, equal) in [
            (1.0, 1.001, 0.001, true),
            (1.001, 1.0, 0.001, true),
            (100.001, 100.0, 0.001, true),
            (1.0, 1.0011, 0.001, false),
            (-0.0005, 0.0005, 0.001, true),
            (0.0, 1e-9, 0.0, false),
            (1.0, 1.0, 0.0, true),
            (1.0, 1.5, 0.5, true),
        ] {
            let holds = |relation| reals_hold(relation, a, b, within);
            assert_eq!(holds(Relation::Equal), equal, "{a} {b}");
            assert_eq!(holds(Relation::NotEqual), !equal, "{a} {b}");
            assert_eq!(holds(Relation::Less), !equal && a < b, "{a} {b}");
            assert_eq!(holds(Relation::Greater), !equal && a > b, "{a} {b}");
            assert_eq!(holds(Relation::LessEqual), equal || a < b, "{a} {b}");
            assert_eq!(holds(Relation::GreaterEqual), equal || a > b, "{a} {b}");
        }
    }
}
