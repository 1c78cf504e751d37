//! Where values are read and written: cells of the memory, and arguments handed over by value.

use alloc::format;
use alloc::vec::Vec;

use super::arithmetic::convert;
use super::evaluate::Context;
use super::{Machine, Trouble};
use crate::memory::Memory;
use crate::program::Program;
use crate::request::FaultKind;
use crate::tree::{Expression, Node, Reference, Variable};
use crate::value::Value;

/// A place that holds one value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// A variable, or an element of an array by its flat index.
    Cell { slot: usize, index: usize },
    /// An argument that was handed over by value.
    Argument { frame: usize, index: usize },
}

/// What a parameter stands for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Argument {
    /// The caller's variable.
    Place(Place),
    /// The value of an expression.
    Value(Value),
}

impl Context<'_> {
    /// The place of a variable; its subscripts are evaluated.
    pub fn place(&self, variable: &Variable) -> Result<Place, Trouble> {
        let name = &variable.name.text;
        match variable.reference {
            Reference::Slot(slot) => {
                let subscripts: Vec<i32> = variable
                    .subscripts
                    .iter()
                    .map(|e| self.integer(e))
                    .collect::<Result<_, _>>()?;
                let found = self
                    .program
                    .symbols
                    .slots
                    .get(slot)
                    .and_then(|info| info.index(&subscripts));
                let index = found.ok_or_else(|| {
                    let list = subscripts
                        .iter()
                        .map(|s| format!("{s}"))
                        .collect::<Vec<_>>()
                        .join(",");
                    Trouble::new(
                        FaultKind::Subscript,
                        format!("{name}({list}) is outside the array"),
                    )
                })?;
                Ok(Place::Cell { slot, index })
            }
            Reference::Parameter(index) => {
                let frame = self.frames.len().saturating_sub(1);
                match self.frames.last().and_then(|frame| frame.arguments.get(index)) {
                    Some(Argument::Place(place)) => Ok(*place),
                    Some(Argument::Value(_)) => Ok(Place::Argument { frame, index }),
                    None => Err(Trouble::new(
                        FaultKind::Undefined,
                        format!("{name} was not handed over"),
                    )),
                }
            }
            Reference::Unresolved => Err(Trouble::new(FaultKind::Undefined, format!("{name} has no value"))),
        }
    }

    pub fn read(&self, place: Place) -> Option<&Value> {
        match place {
            Place::Cell { slot, index } => self.memory.value(slot, index),
            Place::Argument { frame, index } => match self.frames.get(frame)?.arguments.get(index)? {
                Argument::Value(value) => Some(value),
                Argument::Place(_) => None,
            },
        }
    }

    /// The value of a variable.
    pub fn fetch(&self, variable: &Variable) -> Result<Value, Trouble> {
        let place = self.place(variable)?;
        self.read(place).cloned().ok_or_else(|| {
            let message = format!("{} is read before it has a value", variable.name.text);
            Trouble::new(FaultKind::Undefined, message)
        })
    }

    /// What is handed over for a parameter: a variable by reference, everything else by value.
    pub fn argument(&self, expression: &Expression) -> Result<Argument, Trouble> {
        match &expression.node {
            Node::Variable(variable) => self.place(variable).map(Argument::Place),
            _ => self.evaluate(expression).map(Argument::Value),
        }
    }
}

impl Machine {
    /// Stores a value, converted to the kind of its place; the first value of a variable fixes the kind.
    pub(super) fn write(
        &mut self,
        program: &Program,
        memory: &mut Memory,
        place: Place,
        value: Value,
    ) -> Result<(), Trouble> {
        match place {
            Place::Cell { slot, index } => {
                let kind = memory.kind(slot).unwrap_or_else(|| value.kind());
                memory.store(program, slot, index, convert(value, kind)?);
            }
            Place::Argument { frame, index } => {
                let argument = self
                    .frames
                    .get_mut(frame)
                    .and_then(|frame| frame.arguments.get_mut(index));
                if let Some(Argument::Value(held)) = argument {
                    *held = convert(value, held.kind())?;
                }
            }
        }
        Ok(())
    }
}
