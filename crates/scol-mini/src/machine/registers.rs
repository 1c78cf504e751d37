//! Reads and writes registers: the cells of variables, and after them the constants and temporaries of the code.
//!
//! Numbers are in the cells and take the short way, [`Registers`]. Everything else is a [`Value`]: those of variables are in
//! the memory, those of temporaries here in the execution, because nothing of them may be left in a snapshot. Parameters and
//! elements of arrays are in `place`.

use crate::prelude::*;

use super::Result;
use super::arithmetic::{truncated, unexpected};
use super::evaluate::Execution;
use super::place::{ValuePlace, undefined};
use crate::cell::{Cell, Held};
use crate::code::{Array, Register};
use crate::request::Fault;
use crate::value::{Number, Value};

impl Execution<'_> {
    #[inline(always)]
    pub fn cell(&self, register: Register) -> Cell {
        self.memory.cell(register as usize)
    }

    /// The number in a register.
    #[inline(always)]
    pub fn number_in(&self, register: Register) -> Result<Number> {
        match self.cell(register).number() {
            Some(number) => Ok(number),
            None => Err(self.no_number(register)),
        }
    }

    #[cold]
    fn no_number(&self, register: Register) -> Box<Fault> {
        match self.value_in(register) {
            Ok(value) => unexpected("a number", &value),
            Err(fault) => fault,
        }
    }

    /// The value in a register.
    pub fn value_in(&self, register: Register) -> Result<Value> {
        let value = match self.cell(register).held() {
            Held::Vector(at) if self.is_working(register) => self.vectors.get(at as usize).cloned(),
            Held::Nothing | Held::Integer(_) | Held::Real(_) | Held::Vector(_) => {
                self.memory.value(register as usize)
            }
        };
        value.ok_or_else(|| {
            let slot = self.program.symbols.slots.get(self.slot(register));
            undefined(slot.map_or("", |slot| &slot.name))
        })
    }

    /// Stores a number.
    #[inline(always)]
    pub fn put(&mut self, to: Register, number: Number) -> Result<()> {
        match self.registers().put(to, number) {
            Some(()) => Ok(()),
            None => self.store(to, number.into()),
        }
    }

    #[inline(always)]
    pub fn registers(&mut self) -> Registers<'_> {
        Registers {
            variables: self.program.symbols.cells,
            cells: self.memory.registers(),
        }
    }

    /// Stores a value; in a variable it is converted to the kind of the variable.
    #[inline(never)]
    pub fn store(&mut self, to: Register, value: Value) -> Result<()> {
        if !self.is_working(to) {
            let (slot, cell) = (self.slot(to), to as usize);
            return self.write(ValuePlace::Cell { slot, cell }, value);
        }
        let cell = match value.number() {
            Some(number) => number.into(),
            None => self.keep(to as usize - self.program.symbols.cells, value),
        };
        if let Some(place) = self.memory.registers().get_mut(to as usize) {
            *place = cell;
        }
        Ok(())
    }

    /// Stores a value that is not a number for a temporary; each temporary has its own place.
    fn keep(&mut self, at: usize, value: Value) -> Cell {
        if self.vectors.len() <= at {
            self.vectors.resize(at + 1, Value::Integer(0));
        }
        if let Some(place) = self.vectors.get_mut(at) {
            *place = value;
        }
        u32::try_from(at).map_or(Cell::EMPTY, Cell::vector)
    }

    #[inline(never)]
    pub fn copy(&mut self, to: Register, a: Register) -> Result<()> {
        let value = self.value_in(a)?;
        self.store(to, value)
    }

    /// Whether a register is a constant or a temporary.
    #[inline(always)]
    fn is_working(&self, register: Register) -> bool {
        register as usize >= self.program.symbols.cells
    }

    /// The slot of the variable that has this cell. Only a first value, a conversion or a fault asks for it, so it is searched
    /// for instead of being part of each instruction.
    pub fn slot(&self, register: Register) -> usize {
        let slots = &self.program.symbols.slots;
        let after = slots.partition_point(|slot| slot.base <= register as usize);
        after.saturating_sub(1)
    }

    /// The integer in a register; a real is cut toward zero.
    #[inline(always)]
    pub fn integer_in(&self, register: Register) -> Result<i32> {
        match self.number_in(register)? {
            Number::Integer(value) => Ok(value),
            Number::Real(value) => truncated(value),
        }
    }
}

/// The registers as numbers; `None` for other values, which take the slow way.
pub(super) struct Registers<'a> {
    cells: &'a mut [Cell],
    variables: usize,
}

impl Registers<'_> {
    #[inline(always)]
    pub fn cell(&self, register: Register) -> Cell {
        self.cells.get(register as usize).copied().unwrap_or(Cell::EMPTY)
    }

    /// Stores a number where one of its kind is, or in a temporary.
    #[inline(always)]
    pub fn put(&mut self, to: Register, number: Number) -> Option<()> {
        let is_working = to as usize >= self.variables;
        let place = self.cells.get_mut(to as usize)?;
        let fits = match number {
            Number::Integer(_) => place.is_integer(),
            Number::Real(_) => place.is_real(),
        };
        if fits || is_working {
            *place = number.into();
            return Some(());
        }
        None
    }

    #[inline(always)]
    pub fn copy(&mut self, to: Register, a: Register) -> Option<()> {
        let (cell, is_working) = (self.cell(a), to as usize >= self.variables);
        let place = self.cells.get_mut(to as usize)?;
        if cell.is_number() && (is_working || cell.is_like(*place)) {
            *place = cell;
            return Some(());
        }
        None
    }

    /// The register of an element; `None` outside the array.
    #[inline(always)]
    pub fn element(&self, array: Array, index: Register) -> Option<Register> {
        // A negative subscript is beyond any array.
        let index = self.cells.get(index as usize)?.as_integer()? as u32;
        (index < array.length).then(|| array.base + index)
    }
}
