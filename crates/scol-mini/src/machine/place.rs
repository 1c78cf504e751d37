//! Reads and writes variables: cells of the memory, elements of arrays, and arguments of a call.
//!
//! A parameter refers to a variable of the caller, or has a value of its own.

use crate::prelude::*;

use super::arithmetic::convert;
use super::evaluate::Execution;
use super::{Machine, Result};
use crate::MAX_SUBSCRIPTS;
use crate::request::{Fault, FaultKind};
use crate::tree::{Expression, Node, Reference, Variable};
use crate::value::{Number, Value, ValueKind};

/// A place that holds one value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum ValuePlace {
    /// A variable, or an element of an array: its slot, and its cell in the memory.
    Cell { slot: usize, cell: usize },
    /// An argument passed by value, by its index in the stack of arguments.
    Argument(usize),
}

/// Argument of a call, as the parameter of the subprogram finds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) enum Argument {
    /// The caller's variable.
    Place(ValuePlace),
    /// The value of an expression.
    Number(Number),
    /// The value of an expression that is not a number.
    Vector(Value),
    /// No value yet; the first assignment fixes the type.
    Unset,
}

impl Execution<'_> {
    /// The place of a variable; its subscripts are evaluated.
    pub fn place(&mut self, variable: &Variable) -> Result<ValuePlace> {
        let name = &variable.name.text;
        match variable.reference {
            Reference::Slot { slot, cell } if variable.subscripts.is_empty() => {
                Ok(ValuePlace::Cell { slot, cell })
            }
            Reference::Slot { slot, cell } => {
                let mut subscripts = [0; MAX_SUBSCRIPTS];
                for (to, subscript) in subscripts.iter_mut().zip(&variable.subscripts) {
                    *to = self.integer(subscript)?;
                }
                let count = variable.subscripts.len();
                let cell = self.element(slot, cell, subscripts.get(..count).unwrap_or_default())?;
                Ok(ValuePlace::Cell { slot, cell })
            }
            Reference::Parameter(index) => {
                let place = self.machine.parameter_place(index);
                place.ok_or_else(|| FaultKind::Undefined.error(format!("{name} was not passed")))
            }
            Reference::Unresolved => FaultKind::Undefined.fail(format!("{name} has no value")),
        }
    }

    /// The cell of an element of an array, which begins with the cell `base`.
    pub fn element(&self, slot: usize, base: usize, subscripts: &[i32]) -> Result<usize> {
        let info = self.program.symbols.slots.get(slot);
        let index = info.and_then(|info| info.index(subscripts));
        index.map(|index| base + index).ok_or_else(|| {
            let name = info.map_or("", |info| &info.name);
            outside_array(name, subscripts)
        })
    }

    /// The present value; `None` before the first assignment.
    pub fn read(&self, place: ValuePlace) -> Option<Value> {
        match place {
            ValuePlace::Cell { cell, .. } => self.memory.value(cell),
            ValuePlace::Argument(at) => self.machine.arguments.get(at)?.value(),
        }
    }

    /// The value of a variable.
    pub fn fetch(&mut self, variable: &Variable) -> Result<Value> {
        let place = self.place(variable)?;
        self.read(place).ok_or_else(|| undefined(&variable.name.text))
    }

    /// The argument that an expression passes: a variable by reference, everything else by value.
    pub fn argument(&mut self, expression: &Expression) -> Result<Argument> {
        if let Node::Variable(variable) = &expression.node {
            return self.place(variable).map(Argument::Place);
        }
        self.evaluate(expression).map(Argument::from_value)
    }

    /// Stores a value, converted to the type of its place; the first value of a variable fixes that type.
    pub fn write(&mut self, place: ValuePlace, value: Value) -> Result<()> {
        match place {
            ValuePlace::Cell { slot, cell } => {
                let kind = self.memory.kind(slot).unwrap_or_else(|| value.kind());
                let value = convert(value, kind)?;
                self.memory.store(self.program, slot, cell, value);
            }
            ValuePlace::Argument(at) => {
                let Some(held) = self.machine.arguments.get_mut(at) else {
                    return Ok(());
                };
                let kind = match held {
                    Argument::Number(Number::Integer(_)) => ValueKind::Integer,
                    Argument::Number(Number::Real(_)) => ValueKind::Real,
                    Argument::Vector(held) => held.kind(),
                    Argument::Unset => value.kind(),
                    Argument::Place(_) => return Ok(()),
                };
                *held = Argument::from_value(convert(value, kind)?);
            }
        }
        Ok(())
    }
}

impl Machine {
    /// The place that a parameter of the running program refers to.
    #[inline(always)]
    pub(super) fn parameter_place(&self, parameter: usize) -> Option<ValuePlace> {
        let at = self.frames.last()?.arguments + parameter;
        Some(match self.arguments.get(at)? {
            Argument::Place(place) => *place,
            Argument::Number(_) | Argument::Vector(_) | Argument::Unset => ValuePlace::Argument(at),
        })
    }
}

impl Argument {
    /// The value that was passed; `None` of a variable of the caller, and before the first assignment.
    pub(super) fn value(&self) -> Option<Value> {
        match self {
            Argument::Number(number) => Some((*number).into()),
            Argument::Vector(value) => Some(value.clone()),
            Argument::Place(_) | Argument::Unset => None,
        }
    }

    /// An argument passed by value.
    fn from_value(value: Value) -> Self {
        value.number().map_or(Argument::Vector(value), Argument::Number)
    }
}

/// The fault of an element that an array does not have.
pub(crate) fn outside_array(name: &str, subscripts: &[i32]) -> Box<Fault> {
    let list: Vec<String> = subscripts.iter().map(ToString::to_string).collect();
    FaultKind::Subscript.error(format!("{name}({}) is outside the array", list.join(",")))
}

/// The fault of a variable without a value.
pub(super) fn undefined(name: &str) -> Box<Fault> {
    FaultKind::Undefined.error(format!("{name} is read before it has a value"))
}
