//! Evaluates expressions with values of any kind: numbers, comparisons, sums and products of positions, system variables.
//!
//! Operations that an instruction can do on numbers come here only when something is special (`vm`). Functions are in
//! `functions`, variables in `place`, arithmetic in `arithmetic`.

use alloc::format;

use super::arithmetic::{as_number, as_value, binary, double, truncated, truth, unary};
use super::place::Argument;
use super::{RuntimeError, compose};
use crate::MAX_TASKS;
use crate::builtin::System;
use crate::conditions::Accuracy;
use crate::memory::Memory;
use crate::options::Arm;
use crate::program::Program;
use crate::request::{FaultKind, Inputs, Number};
use crate::tree::{Binary, Condition, Expression, Node, Unary};
use crate::value::{Value, ValueKind};

/// Everything an expression can read.
pub(super) struct Context<'a> {
    pub program: &'a Program,
    pub memory: &'a Memory,
    pub inputs: &'a dyn Inputs,
    /// The arguments of all open calls.
    pub arguments: &'a [Argument],
    /// Where those of the running program begin.
    pub base: usize,
    /// ID of the task, for `TID`.
    pub task: u16,
}

impl Context<'_> {
    pub fn evaluate(&self, expression: &Expression) -> Result<Value, RuntimeError> {
        match &expression.node {
            Node::Literal(value) => Ok(value.clone()),
            Node::Variable(variable) => self.fetch(variable),
            Node::Component(of, letter) => {
                let value = self.evaluate(of)?;
                let found = component(self.program.options.arm, &value, *letter);
                found
                    .map(|value| Value::Real(value as f32))
                    .ok_or_else(|| no_component(&value, *letter))
            }
            Node::Unary(Unary::Value, of) => self.evaluate(of),
            Node::Unary(operator, of) => unary(*operator, self.number(of)?).map(as_value),
            Node::Binary(operator @ (Binary::Add | Binary::Subtract), left, right) => {
                self.sum(*operator, self.evaluate(left)?, self.evaluate(right)?)
            }
            Node::Binary(Binary::Multiply, left, right) => {
                self.product(self.evaluate(left)?, self.evaluate(right)?)
            }
            Node::Binary(operator, left, right) => {
                let (left, right) = (self.number(left)?, self.number(right)?);
                binary(*operator, left, right, &self.program.options).map(as_value)
            }
            Node::Function(builtin, arguments) => self.function(*builtin, arguments),
            Node::System(system) => Ok(self.system(*system)),
        }
    }

    fn system(&self, system: System) -> Value {
        match system {
            System::Motion => Value::Real(self.inputs.motion_percent() as f32),
            System::Here => Value::Position(self.inputs.here()),
            System::Mode => Value::Integer(self.inputs.mode()),
            System::Timer => Value::Real(self.inputs.timer() as f32),
            System::MotionTime => Value::Real(self.inputs.motion_seconds() as f32),
            System::Remain => Value::Real((100.0 - self.inputs.motion_percent()) as f32),
            System::RemainTime => Value::Real(self.inputs.remaining_seconds() as f32),
            System::Dest => Value::Position(self.inputs.destination()),
            System::TaskId => Value::Integer(i32::from(self.task)),
            System::MaxTask => Value::Integer(i32::try_from(MAX_TASKS).unwrap_or(i32::MAX)),
            System::Condition(condition) => self.condition(condition),
        }
    }

    fn condition(&self, condition: Condition) -> Value {
        let conditions = self.memory.conditions();
        match condition {
            Condition::Speed => Value::Real(conditions.speed as f32),
            Condition::Accel => Value::Real(conditions.accel as f32),
            Condition::Decel => Value::Real(conditions.decel as f32),
            Condition::Config => {
                let number = conditions.config.number_on(self.program.options.arm);
                Value::Integer(i32::try_from(number).unwrap_or(0))
            }
            Condition::Payload => Value::Load(
                conditions
                    .payload
                    .as_ref()
                    .map(|(_, load)| load.clone())
                    .unwrap_or_default(),
            ),
            Condition::Work => Value::Coordinate(conditions.work.trans.clone()),
            Condition::Tool => Value::Coordinate(conditions.tool.trans.clone()),
            Condition::Base => Value::Coordinate(conditions.base.trans.clone()),
            Condition::Pass => Value::Real(conditions.pass as f32),
            Condition::Accur => Value::Integer(i32::from(conditions.accuracy == Accuracy::Fine)),
        }
    }

    /// Numbers, positions or coordinates, component by component; the left one gives posture and work.
    fn sum(&self, operator: Binary, left: Value, right: Value) -> Result<Value, RuntimeError> {
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
                (Some(a), Some(b)) => binary(operator, a, b, &self.program.options).map(as_value),
                _ => {
                    let (left, right) = (left.kind().description(), right.kind().description());
                    let message = format!("{left} and {right} cannot be added or subtracted");
                    Err(RuntimeError::new(FaultKind::Type, message))
                }
            },
        }
    }

    /// Numbers, or a position or coordinate times a coordinate: the second one is relative to the first.
    fn product(&self, left: Value, right: Value) -> Result<Value, RuntimeError> {
        let arm = self.program.options.arm;
        match (left, right) {
            (Value::Position(left), Value::Coordinate(right)) => {
                Ok(Value::Position(compose::position(arm, &left, &right)))
            }
            (Value::Coordinate(left), Value::Coordinate(right)) => {
                Ok(Value::Coordinate(compose::trans(&left, &right)))
            }
            (left, right) => match (as_number(&left), as_number(&right)) {
                (Some(a), Some(b)) => binary(Binary::Multiply, a, b, &self.program.options).map(as_value),
                _ => {
                    let (left, right) = (left.kind().description(), right.kind().description());
                    let message = format!("{left} and {right} cannot be multiplied");
                    Err(RuntimeError::new(FaultKind::Type, message))
                }
            },
        }
    }

    /// The expression as a number.
    pub fn number(&self, expression: &Expression) -> Result<Number, RuntimeError> {
        let value = self.evaluate(expression)?;
        as_number(&value).ok_or_else(|| {
            RuntimeError::new(
                FaultKind::Type,
                format!("expected a number, found {}", value.kind().description()),
            )
        })
    }

    /// The expression as a double.
    pub fn double(&self, expression: &Expression) -> Result<f64, RuntimeError> {
        self.number(expression).map(double)
    }

    /// The expression as an integer; a real is cut toward zero.
    pub fn integer(&self, expression: &Expression) -> Result<i32, RuntimeError> {
        match self.number(expression)? {
            Number::Integer(value) => Ok(value),
            Number::Real(value) => truncated(value),
        }
    }

    /// The expression as a truth value: everything but 0 is true.
    pub fn truth(&self, expression: &Expression) -> Result<bool, RuntimeError> {
        self.number(expression).map(truth)
    }
}

/// Where in `coords` the coordinate of this letter is.
pub(super) fn component_index(arm: Arm, kind: ValueKind, letter: u8) -> Option<usize> {
    let letters: &[u8] = match (kind, arm) {
        (ValueKind::Position, Arm::SixAxis) => b"XYZABCUV",
        (ValueKind::Position, Arm::Scara) => b"XYZCT",
        (ValueKind::Coordinate, Arm::SixAxis) => b"XYZABC",
        // The two rotations a SCARA does not have are never named.
        (ValueKind::Coordinate, Arm::Scara) => b"XYZ--C",
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

pub(super) fn no_component(value: &Value, letter: u8) -> RuntimeError {
    let message = format!(
        "{} has no coordinate {}",
        value.kind().description(),
        char::from(letter)
    );
    RuntimeError::new(FaultKind::Type, message)
}
