//! The values of all variables and the motion conditions of one selected file.
//!
//! All tasks share GLOBAL, DATA and the conditions; each task has its own variables of the programs (`locals`). Who may read
//! or write variables over the protocol, and in which form, is left to the controller.

mod locals;
mod snapshot;

use crate::prelude::*;
use alloc::collections::BTreeMap;
use alloc::sync::Arc;

use crate::cell::{Cell, Held};
use crate::conditions::Conditions;
use crate::program::{Owner, Program, STATE_VERSION, Slot, Symbols};
use crate::value::{Frame, Trans, Value, ValueKind};
use locals::Locals;

/// Task ID of the main program (M-58762 p.2-27).
pub(crate) const MAIN_TASK: u16 = 1;

/// Why a variable could not be reached from outside.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AccessError {
    /// No variable has this name.
    #[error("no variable has the name {0}")]
    Unknown(String),
    /// The name is a variable of a program only.
    #[error("{0} is a variable of a program, not of GLOBAL or DATA")]
    NotGlobal(String),
    /// The value is of another kind.
    #[error("{name} holds {}, found {}", .expected.description(), .found.description())]
    KindMismatch {
        /// Name of the variable.
        name: String,
        expected: ValueKind,
        /// The kind of the value given.
        found: ValueKind,
    },
    /// Wrong number of subscripts, or one out of bounds.
    #[error("{0} has no such element")]
    Subscript(String),
    /// Subscripts on a variable that is not an array.
    #[error("{0} is not an array")]
    NotArray(String),
    /// An array without subscripts.
    #[error("{0} is an array: a subscript is missing")]
    IsArray(String),
    /// The variable has no value yet.
    #[error("{0} has no value yet")]
    Undefined(String),
    /// `rewrite_value`: the source is not the one of the program.
    #[error("the source does not declare {0}")]
    NotInSource(String),
    /// `rewrite_value`: a number is not finite or beyond the range of a real.
    #[error("a number for {0} is too large for the source")]
    TooLarge(String),
}

/// The variables and conditions of one selected file, shared by all its tasks. Variables of the programs are there
/// once for each task that has run; [`drop_task`](Memory::drop_task) drops those of a task that has ended.
///
/// Made for one [`Program`]; programs of [`compile_direct`](crate::compile_direct) with that base share it.
///
/// A memory that was read back has to be given to `relink` before it is used.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Memory {
    /// [`STATE_VERSION`].
    #[serde(deserialize_with = "crate::snapshot::version")]
    version: u32,
    /// Fingerprint of the program.
    source: u64,
    cells: Cells,
    /// The type of each slot, fixed by a declaration or the first assignment.
    kinds: Vec<Option<ValueKind>>,
    /// The values that are not numbers.
    vectors: Vec<Value>,
    /// Unused places among them.
    free: Vec<u32>,
    /// The task whose variables of programs are in the cells.
    task: u16,
    /// Local variables of the other tasks.
    parked: BTreeMap<u16, Locals>,
    conditions: Conditions,
}

/// The cells of a memory: GLOBAL and DATA, then the variables of the programs as the present task has them, then
/// constants and temporaries of the code that runs. Those hold nothing beyond their statement, so they do not count in
/// comparisons and are not written.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(from = "Vec<Cell>", into = "Vec<Cell>")]
struct Cells {
    all: Vec<Cell>,
    /// Number of the cells that are variables.
    variables: usize,
    /// Fingerprint of the program whose constants are there: a statement of DO has others than its file.
    working_for: Option<u64>,
}

impl Cells {
    fn variables(&self) -> &[Cell] {
        self.all.get(..self.variables).unwrap_or_default()
    }
}

impl PartialEq for Cells {
    fn eq(&self, other: &Self) -> bool {
        self.variables() == other.variables()
    }
}

impl From<Vec<Cell>> for Cells {
    fn from(all: Vec<Cell>) -> Self {
        let variables = all.len();
        Self {
            all,
            variables,
            working_for: None,
        }
    }
}

impl From<Cells> for Vec<Cell> {
    fn from(mut cells: Cells) -> Self {
        cells.all.truncate(cells.variables);
        cells.all
    }
}

impl Memory {
    /// Initial values of GLOBAL and DATA, everything else without a value, default conditions.
    pub fn new(program: &Program) -> Self {
        let symbols = &program.symbols;
        let mut memory = Self {
            version: STATE_VERSION,
            source: program.fingerprint(),
            cells: alloc::vec![Cell::EMPTY; symbols.cells].into(),
            kinds: symbols.slots.iter().map(|slot| slot.kind).collect(),
            vectors: Vec::new(),
            free: Vec::new(),
            task: MAIN_TASK,
            parked: BTreeMap::new(),
            conditions: Conditions::default(),
        };
        memory.begin(&symbols.slots);
        memory
    }

    /// Gives these variables their first values; they have none yet.
    fn begin(&mut self, slots: &[Slot]) {
        for slot in slots {
            if let Some(zero) = slot.kind.filter(|_| slot.zeroed).map(ValueKind::zero) {
                (0..slot.length()).for_each(|index| self.put(slot.base + index, zero.clone()));
            }
            for (index, value) in &slot.initial {
                self.put(slot.base + index, value.clone());
            }
        }
    }

    /// Begins as [`Memory::new`], but for the arrays of GLOBAL without initial values, which keep what they hold over a
    /// start (scol.md 13.3).
    pub fn start_anew(&mut self, program: &Program) {
        let old = core::mem::replace(self, Memory::new(program));
        for (at, slot) in program.symbols.slots.iter().enumerate() {
            if slot.owner != Owner::Global || slot.bounds.is_none() || !slot.initial.is_empty() {
                continue;
            }
            for cell in slot.base..slot.base + slot.length() {
                if let Some(value) = old.value(cell) {
                    self.store(program, at, cell, value);
                }
            }
        }
    }

    /// Rebinds the memory to `program`, which has the same variables.
    pub fn relocate(&mut self, program: &Program) {
        self.source = program.fingerprint();
    }

    /// Reads a variable of GLOBAL or DATA; `subscripts` is empty for a plain variable. Case does not matter.
    ///
    /// # Errors
    /// See [`AccessError`]; a variable without a value is `Undefined`.
    pub fn global(&self, program: &Program, name: &str, subscripts: &[i32]) -> Result<Value, AccessError> {
        let (_, slot, index) = shared(program, name, subscripts)?;
        let value = self.value(slot.base + index);
        value.ok_or_else(|| AccessError::Undefined(name.to_ascii_uppercase()))
    }

    /// Reads a variable of a program, named `PROGRAM.NAME`: that of the main task, else of the first task in which it has a value.
    ///
    /// # Errors
    /// See [`AccessError`]; a variable without a value is `Undefined`.
    pub fn local(&self, program: &Program, name: &str, subscripts: &[i32]) -> Result<Value, AccessError> {
        let name = name.to_ascii_uppercase();
        let found = name
            .split_once('.')
            .and_then(|(block, name)| program.local(block, name));
        let Some(slot) = found else {
            return Err(AccessError::Unknown(name));
        };
        let cell = slot.base + element(slot, &name, subscripts)?;
        let value = self.value_in_tasks(&program.symbols.slots, cell);
        value.ok_or(AccessError::Undefined(name))
    }

    /// Writes a variable of GLOBAL or DATA. The type must match exactly; nothing is converted.
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
        let (at, slot, index) = shared(program, name, subscripts)?;
        let cell = slot.base + index;
        check_kind(slot, self.kind(at), &value)?;
        let value = match (value, self.value(cell)) {
            (Value::Position(mut new), Some(Value::Position(old))) => {
                new.work = new.work.take().or(old.work);
                Value::Position(new)
            }
            (value, _) => value,
        };
        self.store(program, at, cell, value);
        Ok(())
    }

    /// The motion conditions.
    pub fn conditions(&self) -> &Conditions {
        &self.conditions
    }

    /// The motion conditions, mutable.
    pub fn conditions_mut(&mut self) -> &mut Conditions {
        &mut self.conditions
    }

    /// The value of a variable.
    pub(crate) fn value(&self, cell: usize) -> Option<Value> {
        self.held(*self.cells.all.get(cell)?)
    }

    fn held(&self, cell: Cell) -> Option<Value> {
        match cell.held() {
            Held::Nothing => None,
            Held::Integer(value) => Some(Value::Integer(value)),
            Held::Real(value) => Some(Value::Real(value)),
            Held::Vector(at) => self.vectors.get(at as usize).cloned(),
        }
    }

    pub(crate) fn kind(&self, slot: usize) -> Option<ValueKind> {
        *self.kinds.get(slot)?
    }

    /// The registers of the code that runs: the variables, then constants and temporaries.
    #[inline(always)]
    pub(crate) fn registers(&mut self) -> &mut [Cell] {
        &mut self.cells.all
    }

    #[inline(always)]
    pub(crate) fn cell(&self, register: usize) -> Cell {
        self.cells.all.get(register).copied().unwrap_or(Cell::EMPTY)
    }

    /// Gives the code of this program its constants and temporaries.
    pub(crate) fn begin_code(&mut self, program: &Program) {
        let fingerprint = Some(program.fingerprint());
        if self.cells.working_for != fingerprint {
            self.cells.all.truncate(self.cells.variables);
            self.cells.all.extend_from_slice(&program.code.working);
            self.cells.working_for = fingerprint;
        }
    }

    /// Stores a value of the right type; the first value fixes the type. A slot that this memory lacks is ignored.
    pub(crate) fn store(&mut self, program: &Program, slot: usize, cell: usize, value: Value) {
        let Some(kind) = self.kinds.get_mut(slot) else {
            return;
        };
        *kind = Some(value.kind());
        let slot = program.symbols.slots.get(slot).filter(|slot| slot.is_work);
        if let (Value::Coordinate(trans), Some(slot)) = (&value, slot) {
            self.move_work(&Arc::new(Frame {
                name: Some(slot.name.clone()),
                trans: Trans::clone(trans),
            }));
        }
        self.put(cell, value);
    }

    fn put(&mut self, cell: usize, value: Value) {
        let Some(place) = self.cells.all.get_mut(cell) else {
            return;
        };
        match (value, place.held()) {
            (Value::Integer(value), _) => *place = Cell::integer(value),
            (Value::Real(value), _) => *place = Cell::real(value),
            (value, Held::Vector(at)) => {
                if let Some(held) = self.vectors.get_mut(at as usize) {
                    *held = value;
                }
            }
            (value, _) => {
                let free = self.free.pop();
                let at = free.unwrap_or(u32::try_from(self.vectors.len()).unwrap_or(u32::MAX));
                *place = Cell::vector(at);
                match self.vectors.get_mut(at as usize) {
                    Some(held) => *held = value,
                    None => self.vectors.push(value),
                }
            }
        }
    }

    /// Positions that refer to a coordinate system follow when it is changed.
    fn move_work(&mut self, frame: &Arc<Frame>) {
        for value in &mut self.vectors {
            if let Value::Position(position) = value
                && position.work.as_ref().is_some_and(|work| work.name == frame.name)
            {
                position.work = Some(Arc::clone(frame));
            }
        }
    }
}

/// Whether a variable of this kind can hold the value as it is.
pub(crate) fn check_kind(slot: &Slot, kind: Option<ValueKind>, value: &Value) -> Result<(), AccessError> {
    let found = value.kind();
    kind.filter(|kind| *kind != found).map_or(Ok(()), |expected| {
        let name = slot.name.clone();
        Err(AccessError::KindMismatch {
            name,
            expected,
            found,
        })
    })
}

/// Slot and flat index of a variable that all programs share.
pub(crate) fn shared<'a>(
    program: &'a Program,
    name: &str,
    subscripts: &[i32],
) -> Result<(usize, &'a Slot, usize), AccessError> {
    let name = name.to_ascii_uppercase();
    let Symbols { slots, shared, .. } = &*program.symbols;
    let found = shared.get(&name).and_then(|at| Some((*at, slots.get(*at)?)));
    let Some((at, slot)) = found else {
        let mut locals = slots.iter().filter(|slot| slot.owner == Owner::Local);
        return Err(match locals.any(|slot| slot.name == name) {
            true => AccessError::NotGlobal(name),
            false => AccessError::Unknown(name),
        });
    };
    let index = element(slot, &name, subscripts)?;
    Ok((at, slot, index))
}

/// The flat index of the element of a variable of this name.
fn element(slot: &Slot, name: &str, subscripts: &[i32]) -> Result<usize, AccessError> {
    let name = || String::from(name);
    match (slot.bounds.is_some(), subscripts.is_empty()) {
        (true, true) => Err(AccessError::IsArray(name())),
        (false, false) => Err(AccessError::NotArray(name())),
        _ => slot
            .index(subscripts)
            .ok_or_else(|| AccessError::Subscript(name())),
    }
}
