//! skeleton
use alloc::string::String;

use crate::conditions::Conditions;
use crate::program::Program;
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
    #[error("{name} holds {expected:?}, found {found:?}", expected = expected, found = found)]
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
    #[error("the source has no initial value of {0}")]
    NotInSource(String),
}

/// The variables and conditions of one selected file, shared by all its tasks.
#[derive(Debug, Clone, PartialEq)]
pub struct Memory {
    conditions: Conditions,
}

impl Memory {
    /// Initial values of GLOBAL and DATA, everything else without a value, default conditions.
    #[must_use]
    pub fn new(_program: &Program) -> Self {
        Self { conditions: Conditions::default() }
    }
    /// Reads a variable of GLOBAL or DATA.
    ///
    /// # Errors
    /// See [`AccessError`].
    pub fn global(&self, _program: &Program, name: &str, _subscripts: &[i32]) -> Result<Value, AccessError> {
        Err(AccessError::Unknown(name.into()))
    }
    /// Writes a variable of GLOBAL or DATA.
    ///
    /// # Errors
    /// See [`AccessError`].
    pub fn set_global(
        &mut self,
        _program: &Program,
        name: &str,
        _subscripts: &[i32],
        _value: Value,
    ) -> Result<(), AccessError> {
        Err(AccessError::Unknown(name.into()))
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
}
