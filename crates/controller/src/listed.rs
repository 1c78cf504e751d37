//! Values of SCOL as the numbers in which hosts read them.

use crate::prelude::*;
use scol_mini::{Arm, Value};
use ts3100_proto::command::Number;

pub(crate) fn numbers(value: &Value, arm: Arm) -> Vec<Number> {
    let reals = |listed: Vec<f64>| listed.into_iter().map(Number::Real).collect();
    match value {
        Value::Integer(integer) => Vec::from([Number::Integer(*integer)]),
        Value::Real(real) => Vec::from([Number::Real(f64::from(*real))]),
        Value::Load(load) => reals(load.listed(arm)),
        Value::Coordinate(trans) => reals(trans.listed(arm)),
        Value::Position(position) => reals(position.listed(arm)),
    }
}

/// As [`numbers`]; a configuration has its digits and no decimal point.
pub(crate) fn listed(value: &Value, arm: Arm) -> Vec<Number> {
    let mut numbers = numbers(value, arm);
    if let (Value::Position(position), Some(last)) = (value, numbers.last_mut()) {
        *last = Number::Integer(i32::try_from(position.config.number_on(arm)).unwrap_or_default());
    }
    numbers
}
