//! Computes the operands of statements; what system variables are; sums and products of positions.
//!
//! An operand is a formula: instructions that `vm` runs, and the register with the result. Functions are in `functions`,
//! arithmetic of numbers in `arithmetic`.

use crate::prelude::*;

use super::arithmetic::{binary, double, real, truth};
use super::{Machine, Result, compose};
use crate::MAX_TASKS;
use crate::builtin::{Condition, System};
use crate::conditions::Accuracy;
use crate::memory::Memory;
use crate::options::Arm;
use crate::program::Program;
use crate::request::{Fault, FaultKind, Inputs};
use crate::tree::{Binary, Expression};
use crate::value::{Number, Value};

/// How much less than 100 `MOTION` is at least while the arm moves, in percent: a real of 100 has steps of 0.000008.
const STILL_MOVING: f64 = 0.001;

/// A machine at work: its program, the values of the variables, and what is outside.
pub(super) struct Execution<'a> {
    pub machine: &'a mut Machine,
    pub program: &'a Program,
    pub memory: &'a mut Memory,
    pub inputs: &'a dyn Inputs,
    /// Values of the temporaries that are not numbers.
    pub vectors: Vec<Value>,
}

impl Execution<'_> {
    /// The value of an operand.
    pub fn evaluate(&mut self, expression: &Expression) -> Result<Value> {
        let register = self.result(expression.formula)?;
        self.value_in(register)
    }

    pub fn system(&self, system: System) -> Value {
        match system {
            System::Motion => Value::Real(self.motion_percent() as f32),
            System::Here => self.inputs.here().into(),
            System::Mode => Value::Integer(self.inputs.mode()),
            System::Timer => Value::Real(self.inputs.timer() as f32),
            System::MotionTime => Value::Real(self.inputs.motion_seconds() as f32),
            System::Remain => Value::Real((100.0 - self.motion_percent()) as f32),
            System::RemainTime => Value::Real(self.inputs.remaining_seconds() as f32),
            System::Dest => self.inputs.destination().into(),
            System::TaskId => Value::Integer(i32::from(self.machine.task)),
            System::MaxTask => Value::Integer(i32::try_from(MAX_TASKS).unwrap_or(i32::MAX)),
            System::Condition(condition) => self.condition(condition),
        }
    }

    /// Percent of the motion that is done, kept below 100 until the motion ends.
    fn motion_percent(&self) -> f64 {
        let percent = self.inputs.motion_percent();
        let most = 100.0 - f64::from(self.program.options.equal_within) - STILL_MOVING;
        if percent < 100.0 {
            percent.min(most.max(0.0))
        } else {
            percent
        }
    }

    pub fn condition(&self, condition: Condition) -> Value {
        let conditions = self.memory.conditions();
        match condition {
            Condition::Speed => Value::Real(conditions.speed as f32),
            Condition::Accel => Value::Real(conditions.accel as f32),
            Condition::Decel => Value::Real(conditions.decel as f32),
            Condition::Config => {
                let number = conditions.config.number_on(self.program.options.arm);
                Value::Integer(i32::try_from(number).unwrap_or(0))
            }
            Condition::Payload => {
                let load = conditions.payload.as_ref().map(|(_, load)| load.clone());
                load.unwrap_or_default().into()
            }
            Condition::Work => conditions.work.trans.clone().into(),
            Condition::Tool => conditions.tool.trans.clone().into(),
            Condition::Base => conditions.base.trans.clone().into(),
            Condition::Pass => Value::Real(conditions.pass as f32),
            Condition::Accur => Value::Integer(i32::from(conditions.accuracy == Accuracy::Fine)),
        }
    }

    /// A sum, a difference or a product of numbers, positions and coordinates. Positions and coordinates are added
    /// component by component, the left one giving posture and work; a factor on the right is relative to the left one.
    pub fn combined(&self, operator: Binary, left: Value, right: Value) -> Result<Value> {
        if let (Some(left), Some(right)) = (left.number(), right.number()) {
            return Ok(binary(operator, left, right, &self.program.options)?.into());
        }
        let sign = if operator == Binary::Subtract { -1.0 } else { 1.0 };
        fitting(match (operator, left, right) {
            (Binary::Multiply, Value::Position(left), Value::Coordinate(right)) => {
                compose::position(self.program.options.arm, &left, &right).into()
            }
            (Binary::Multiply, Value::Coordinate(left), Value::Coordinate(right)) => {
                compose::trans(&left, &right).into()
            }
            (Binary::Add | Binary::Subtract, Value::Position(mut left), Value::Position(right)) => {
                add(&mut left.coords, sign, &right.coords);
                Value::Position(left)
            }
            (Binary::Add | Binary::Subtract, Value::Coordinate(mut left), Value::Coordinate(right)) => {
                add(&mut left.coords, sign, &right.coords);
                Value::Coordinate(left)
            }
            (operator, left, right) => {
                let done = match operator == Binary::Multiply {
                    true => "multiplied",
                    false => "added or subtracted",
                };
                let (left, right) = (left.kind().description(), right.kind().description());
                return FaultKind::Type.fail(format!("{left} and {right} cannot be {done}"));
            }
        })
    }

    /// The operand as a number.
    pub fn number(&mut self, expression: &Expression) -> Result<Number> {
        let register = self.result(expression.formula)?;
        self.number_in(register)
    }

    /// The operand as a double.
    pub fn double(&mut self, expression: &Expression) -> Result<f64> {
        self.number(expression).map(double)
    }

    /// The operand as an integer; a real is cut toward zero.
    pub fn integer(&mut self, expression: &Expression) -> Result<i32> {
        let register = self.result(expression.formula)?;
        self.integer_in(register)
    }

    /// The operand as a truth value: everything but 0 is true.
    pub fn truth(&mut self, expression: &Expression) -> Result<bool> {
        self.number(expression).map(truth)
    }
}

/// A value whose coordinates fit reals, as all numbers of the language do.
fn fitting(value: Value) -> Result<Value> {
    let coords: &[f64] = match &value {
        Value::Position(position) => &position.coords,
        Value::Coordinate(trans) => &trans.coords,
        Value::Integer(_) | Value::Real(_) | Value::Load(_) => &[],
    };
    let mut coords = coords.iter();
    coords.try_for_each(|coordinate| real(*coordinate as f32).map(drop))?;
    Ok(value)
}

fn add(to: &mut [f64], sign: f64, from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += sign * from);
}

/// The coordinate of this letter.
pub(super) fn component(arm: Arm, value: &mut Value, letter: u8) -> Option<&mut f64> {
    let (coords, letters): (&mut [f64], _) = match value {
        Value::Position(position) => (&mut position.coords, arm.coordinates()),
        Value::Coordinate(trans) => match arm {
            Arm::SixAxis => (&mut trans.coords, "XYZABC"),
            // The two rotations a SCARA does not have are never named.
            Arm::Scara => (&mut trans.coords, "XYZ--C"),
        },
        Value::Integer(_) | Value::Real(_) | Value::Load(_) => return None,
    };
    coords.get_mut(letters.bytes().position(|known| known == letter)?)
}

pub(super) fn no_component(value: &Value, letter: u8) -> Box<Fault> {
    let (kind, letter) = (value.kind().description(), char::from(letter));
    FaultKind::Type.error(format!("{kind} has no coordinate {letter}"))
}
