//! The values of all variables and the motion conditions of one selected file, shared by its tasks but for the
//! variables of the programs, of which each task has its own (`locals`).
//! Who may read or write them over the protocol, and in which form, is left to the controller.

mod locals;

use alloc::collections::BTreeMap;
use alloc::string::{String, ToString};
use alloc::sync::Arc;
use alloc::vec::Vec;

use crate::conditions::{Conditions, Frame};
use crate::program::{Owner, Program, Slot};
use crate::value::{Kind, Value};

/// Why a variable could not be reached from outside.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AccessError {
    /// No variable has this name.
    #[error("no variable is called {0}")]
    Unknown(String),
    /// The name is a variable of a program only.
    #[error("{0} is a variable of a program, not of GLOBAL or DATA")]
    NotGlobal(String),
    /// The value is of another kind.
    #[error("{name} holds {}, found {}", expected.word(), found.word())]
    KindMismatch {
        /// The variable.
        name: String,
        /// Its kind.
        expected: Kind,
        /// The kind of the value given.
        found: Kind,
    },
    /// Wrong number of subscripts, or one out of bounds.
    #[error("{0} has no such element")]
    Subscript(String),
    /// Subscripts on something that is no array.
    #[error("{0} is not an array")]
    NotArray(String),
    /// An array without subscripts.
    #[error("{0} is an array: a subscript is missing")]
    IsArray(String),
    /// It has not been given a value yet.
    #[error("{0} has no value yet")]
    Undefined(String),
    /// `rewrite_value`: the source is not the one of the program.
    #[error("the source does not declare {0}")]
    NotInSource(String),
    /// `rewrite_value`: a number is not finite or beyond the range of a real.
    #[error("a number for {0} is too large to be written down")]
    TooLarge(String),
}

/// The variables and conditions of one selected file, shared by all its tasks. Variables of the programs are there
/// once for each task that has run; [`forget`](Memory::forget) drops those of a task that has ended.
///
/// Made for one [`Program`]; programs of [`compile_direct`](crate::compile_direct) with that base share it.
#[derive(Debug, Clone, PartialEq)]
pub struct Memory {
    /// GLOBAL and DATA, then the variables of the programs as the present task has them.
    cells: Vec<Cell>,
    /// The task whose variables those are.
    task: u16,
    /// The variables of the programs as the other tasks have them.
    parked: BTreeMap<u16, Vec<Cell>>,
    conditions: Conditions,
}

/// The values of one slot.
#[derive(Debug, Clone, PartialEq)]
struct Cell {
    /// Fixed by a declaration or the first assignment.
    kind: Option<Kind>,
    values: Vec<Option<Value>>,
}

impl Memory {
    /// Initial values of GLOBAL and DATA, everything else without a value, default conditions.
    #[must_use]
    pub fn new(program: &Program) -> Self {
        let cells = program.symbols.slots.iter().map(Cell::new).collect();
        Self {
            cells,
            task: crate::machine::MAIN_TASK,
            parked: BTreeMap::new(),
            conditions: Conditions::default(),
        }
    }

    /// Reads a variable of GLOBAL or DATA; `subscripts` is empty for a plain variable. Case does not matter.
    ///
    /// # Errors
    /// See [`AccessError`]; a variable without a value is `Undefined`.
    pub fn global(&self, program: &Program, name: &str, subscripts: &[i32]) -> Result<Value, AccessError> {
        let (slot, index) = shared(program, name, subscripts)?;
        let value = self
            .cells
            .get(slot)
            .and_then(|cell| cell.values.get(index))
            .cloned()
            .flatten();
        value.ok_or_else(|| AccessError::Undefined(name.to_ascii_uppercase()))
    }

    /// Writes a variable of GLOBAL or DATA. The kind must fit exactly; nothing is converted.
    ///
    /// A position without a coordinate system of its own keeps that of the position it replaces.
    ///
    /// # Errors
    /// See [`AccessError`].
    pub fn set_global(
        &mut self,
        program: &Program,
        name: &str,
        subscripts: &[i32],
        value: Value,
    ) -> Result<(), AccessError> {
        let (slot, index) = shared(program, name, subscripts)?;
        let old = self.value(slot, index);
        let expected = self.kind(slot).unwrap_or_else(|| value.kind());
        if expected != value.kind() {
            let name = name.to_ascii_uppercase();
            return Err(AccessError::KindMismatch {
                name,
                expected,
                found: value.kind(),
            });
        }
        let value = match (value, old) {
            (Value::Position(mut new), Some(Value::Position(old))) => {
                new.work = new.work.take().or_else(|| old.work.clone());
                Value::Position(new)
            }
            (value, _) => value,
        };
        self.store(program, slot, index, value);
        Ok(())
    }

    /// The motion conditions.
    #[must_use]
    pub fn conditions(&self) -> &Conditions {
        &self.conditions
    }

    /// The motion conditions, to change.
    pub fn conditions_mut(&mut self) -> &mut Conditions {
        &mut self.conditions
    }

    pub(crate) fn value(&self, slot: usize, index: usize) -> Option<&Value> {
        self.cells.get(slot)?.values.get(index)?.as_ref()
    }

    pub(crate) fn kind(&self, slot: usize) -> Option<Kind> {
        self.cells.get(slot)?.kind
    }

    /// Stores a value that fits the kind; the first one fixes it. A slot this memory lacks is left alone.
    pub(crate) fn store(&mut self, program: &Program, slot: usize, index: usize, value: Value) {
        let Some(cell) = self.cells.get_mut(slot) else {
            return;
        };
        cell.kind = Some(value.kind());
        let frame = match (&value, program.symbols.slots.get(slot)) {
            (Value::Coordinate(trans), Some(slot)) if slot.is_work => Some(Frame {
                name: Some(slot.name.clone()),
                trans: trans.clone(),
            }),
            _ => None,
        };
        if let Some(place) = cell.values.get_mut(index) {
            *place = Some(value);
        }
        if let Some(frame) = frame {
            self.move_work(&Arc::new(frame));
        }
    }

    /// Positions that stand in a coordinate system follow when it is changed.
    fn move_work(&mut self, frame: &Arc<Frame>) {
        let parked = self.parked.values_mut().flatten();
        for value in self
            .cells
            .iter_mut()
            .chain(parked)
            .flat_map(|cell| cell.values.iter_mut())
            .flatten()
        {
            if let Value::Position(position) = value
                && position.work.as_ref().is_some_and(|work| work.name == frame.name)
            {
                position.work = Some(Arc::clone(frame));
            }
        }
    }
}

impl Cell {
    fn new(slot: &Slot) -> Self {
        let zero = slot.kind.filter(|_| slot.zeroed).map(Kind::zero);
        let mut values: Vec<Option<Value>> = (0..slot.length()).map(|_| zero.clone()).collect();
        for (index, value) in &slot.initial {
            if let Some(place) = values.get_mut(*index) {
                *place = Some(value.clone());
            }
        }
        Self {
            kind: slot.kind,
            values,
        }
    }
}

/// Slot and flat index of a variable that all programs share.
pub(crate) fn shared(
    program: &Program,
    name: &str,
    subscripts: &[i32],
) -> Result<(usize, usize), AccessError> {
    let name = name.to_ascii_uppercase();
    let symbols = &program.symbols;
    let Some((at, slot)) = symbols
        .shared
        .get(&name)
        .and_then(|at| Some((*at, symbols.slots.get(*at)?)))
    else {
        let local = symbols
            .slots
            .iter()
            .any(|slot| slot.owner == Owner::Local && slot.name == name);
        return Err(if local {
            AccessError::NotGlobal(name)
        } else {
            AccessError::Unknown(name)
        });
    };
    match (slot.bounds.is_some(), subscripts.is_empty()) {
        (true, true) => return Err(AccessError::IsArray(name)),
        (false, false) => return Err(AccessError::NotArray(name)),
        _ => {}
    }
    let index = slot
        .index(subscripts)
        .ok_or_else(|| AccessError::Subscript(name.to_string()))?;
    Ok((at, index))
}
