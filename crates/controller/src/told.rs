//! What a statement did, told with its event after [`Controller::tell_effects`](crate::Controller::tell_effects).
//!
//! `scol-mini` finds it out; here its values become numbers in the order of MR, as texts.

use crate::listed::listed;
use crate::prelude::*;
use core::fmt;
pub use scol_mini::Way;
use scol_mini::{Arm, Effect, Path, Position, Value};
use ts3100_proto::command::Number;

/// The detail of a statement that is told, besides its line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StatementDetail {
    /// What the statement before it in its task got: an INPUT its values, a TASK the number of the task.
    pub received: Vec<StatementEffect>,
    /// What it did, in order.
    pub effects: Vec<StatementEffect>,
}

/// One thing that a statement did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StatementEffect {
    /// A variable, a coordinate, a condition or a parameter has this value now.
    Assigned { name: String, values: Vec<String> },
    /// The part of an IF that is executed.
    Branch(Way),
    /// A motion was asked for.
    Target(MotionTarget),
    /// It is the action of a monitor, which acts.
    Monitor,
}

/// Where a motion leads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MotionTarget {
    /// To this position; of MOVEC through another one.
    Position {
        via: Option<Vec<String>>,
        end: Vec<String>,
    },
    /// An axis to a value, or by a difference.
    Axis { axis: u8, value: String, by: bool },
    /// To the origin posture.
    Origin,
}

impl StatementEffect {
    pub(crate) fn new(effect: Effect, arm: Arm) -> StatementEffect {
        match effect {
            Effect::Assigned { name, value } => {
                let values = texts(&value, arm);
                StatementEffect::Assigned { name, values }
            }
            Effect::Branch(way) => StatementEffect::Branch(way),
            Effect::Target(path) => StatementEffect::Target(MotionTarget::new(&path, arm)),
            Effect::Monitor => StatementEffect::Monitor,
        }
    }
}

impl MotionTarget {
    fn new(path: &Path, arm: Arm) -> MotionTarget {
        let numbers = |position: &Position| texts(&position.clone().into(), arm);
        let number = |value: f64| number(&Number::Real(value));
        match path {
            Path::Ptp(end) | Path::Line(end) | Path::Arch { end, .. } => MotionTarget::Position {
                via: None,
                end: numbers(end),
            },
            Path::Arc { via, end } => MotionTarget::Position {
                via: Some(numbers(via)),
                end: numbers(end),
            },
            Path::Axis { axis, value } => MotionTarget::Axis {
                axis: *axis,
                value: number(*value),
                by: false,
            },
            Path::AxisBy { axis, delta } => MotionTarget::Axis {
                axis: *axis,
                value: number(*delta),
                by: true,
            },
            Path::Ready => MotionTarget::Origin,
        }
    }
}

/// `COUNT = 3`, `then`, `to 400 0 200 0 0 1`, `monitor`.
impl fmt::Display for StatementEffect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            StatementEffect::Assigned { name, values } => write!(f, "{name} = {}", values.join(" ")),
            StatementEffect::Branch(way) => f.write_str(way_word(*way)),
            StatementEffect::Target(target) => target.fmt(f),
            StatementEffect::Monitor => f.write_str("monitor acts"),
        }
    }
}

impl fmt::Display for MotionTarget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MotionTarget::Position { via: None, end } => write!(f, "to {}", end.join(" ")),
            MotionTarget::Position { via: Some(via), end } => {
                write!(f, "through {} to {}", via.join(" "), end.join(" "))
            }
            MotionTarget::Axis { axis, value, by } => {
                let word = if *by { "by" } else { "to" };
                write!(f, "axis {axis} {word} {value}")
            }
            MotionTarget::Origin => f.write_str("to the origin"),
        }
    }
}

/// The part of an IF as a word: `then`, `else`, or `not` if neither is executed.
pub fn way_word(way: Way) -> &'static str {
    match way {
        Way::Then => "then",
        Way::Else => "else",
        Way::Neither => "not",
    }
}

/// Reals of the language are single: 0.1 is the shortest text of one.
fn number(number: &Number) -> String {
    match number {
        Number::Integer(_) => number.to_string(),
        Number::Real(real) if f64::from(*real as f32) == *real => format!("{:?}", *real as f32),
        Number::Real(real) => format!("{real:?}"),
    }
}

fn texts(value: &Value, arm: Arm) -> Vec<String> {
    listed(value, arm).iter().map(number).collect()
}
