//! Reads and writes variables: cells of the memory, elements of arrays, and arguments of a call.
//!
//! A parameter stands for a variable of the caller, or for a value of its own. Instructions read cells themselves (`vm`); here
//! every kind of value is handled, with the faults.

use alloc::boxed::Box;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

use super::arithmetic::{as_number, as_value, convert};
use super::evaluate::Context;
use super::{Machine, RuntimeError};
use crate::memory::Memory;
use crate::program::{Program, Slot};
use crate::request::{FaultKind, Number};
use crate::tree::{Expression, Node, Reference, Variable};
use crate::value::Value;

/// A place that holds one value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) enum ValuePlace {
    /// A variable, or an element of an array: its slot, and its cell in the memory.
    Cell { slot: usize, cell: usize },
    /// An argument passed by value, by its index in the stack of arguments.
    Argument(usize),
}

/// What a parameter stands for.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) enum Argument {
    /// The caller's variable.
    Place(ValuePlace),
    /// The value of an expression.
    Number(Number),
    /// The same, when it is no number.
    Vector(Box<Value>),
    /// No value yet; the first one fixes the kind.
    Unset,
}

impl Context<'_> {
    /// The place of a variable; its subscripts are evaluated.
    pub fn place(&self, variable: &Variable) -> Result<ValuePlace, RuntimeError> {
        let name = &variable.name.text;
        match variable.reference {
            Reference::Slot(slot) => match self.program.symbols.slots.get(slot) {
                Some(info) if info.bounds.is_none() && variable.subscripts.is_empty() => {
                    Ok(ValuePlace::Cell {
                        slot,
                        cell: info.base,
                    })
                }
                info => self.element(slot, info, variable),
            },
            Reference::Parameter(index) => match self.arguments.get(self.base + index) {
                Some(Argument::Place(place)) => Ok(*place),
                Some(Argument::Number(_) | Argument::Vector(_) | Argument::Unset) => {
                    Ok(ValuePlace::Argument(self.base + index))
                }
                None => Err(RuntimeError::new(
                    FaultKind::Undefined,
                    format!("{name} was not handed over"),
                )),
            },
            Reference::Unresolved => Err(RuntimeError::new(
                FaultKind::Undefined,
                format!("{name} has no value"),
            )),
        }
    }

    /// The place of an element of an array.
    fn element(
        &self,
        slot: usize,
        info: Option<&Slot>,
        variable: &Variable,
    ) -> Result<ValuePlace, RuntimeError> {
        let subscripts: Vec<i32> = variable
            .subscripts
            .iter()
            .map(|e| self.integer(e))
            .collect::<Result<_, _>>()?;
        let cell = info.and_then(|info| Some(info.base + info.index(&subscripts)?));
        cell.map(|cell| ValuePlace::Cell { slot, cell }).ok_or_else(|| {
            let list: Vec<String> = subscripts.iter().map(ToString::to_string).collect();
            let message = format!("{}({}) is outside the array", variable.name.text, list.join(","));
            RuntimeError::new(FaultKind::Subscript, message)
        })
    }

    /// The value that is there; `None` where there is none yet.
    pub fn read(&self, place: ValuePlace) -> Option<Value> {
        match place {
            ValuePlace::Cell { cell, .. } => self.memory.value(cell),
            ValuePlace::Argument(at) => match self.arguments.get(at)? {
                Argument::Number(number) => Some(as_value(*number)),
                Argument::Vector(value) => Some(Value::clone(value)),
                Argument::Place(_) | Argument::Unset => None,
            },
        }
    }

    /// The value of a variable.
    pub fn fetch(&self, variable: &Variable) -> Result<Value, RuntimeError> {
        let place = self.place(variable)?;
        self.read(place).ok_or_else(|| {
            let message = format!("{} is read before it has a value", variable.name.text);
            RuntimeError::new(FaultKind::Undefined, message)
        })
    }

    /// The argument that an expression passes: a variable by reference, everything else by value.
    pub fn argument(&self, expression: &Expression) -> Result<Argument, RuntimeError> {
        match &expression.node {
            Node::Variable(variable) => self.place(variable).map(Argument::Place),
            _ => self.evaluate(expression).map(Argument::from_value),
        }
    }
}

impl Argument {
    /// An argument passed by value.
    fn from_value(value: Value) -> Self {
        match as_number(&value) {
            Some(number) => Argument::Number(number),
            None => Argument::Vector(Box::new(value)),
        }
    }
}

impl Machine {
    /// Stores a value, converted to the kind of its place; the first value of a variable fixes the kind.
    pub(super) fn write(
        &mut self,
        program: &Program,
        memory: &mut Memory,
        place: ValuePlace,
        value: Value,
    ) -> Result<(), RuntimeError> {
        match place {
            ValuePlace::Cell { slot, cell } => {
                let kind = memory.kind(slot).unwrap_or_else(|| value.kind());
                memory.store(program, slot, cell, convert(value, kind)?);
            }
            ValuePlace::Argument(at) => match self.arguments.get_mut(at) {
                Some(held @ Argument::Number(Number::Integer(_))) => {
                    *held = Argument::from_value(convert(value, crate::ValueKind::Integer)?);
                }
                Some(held @ Argument::Number(Number::Real(_))) => {
                    *held = Argument::from_value(convert(value, crate::ValueKind::Real)?);
                }
                Some(held @ Argument::Unset) => *held = Argument::from_value(value),
                Some(Argument::Vector(held)) => **held = convert(value, held.kind())?,
                Some(Argument::Place(_)) | None => {}
            },
        }
        Ok(())
    }
}
