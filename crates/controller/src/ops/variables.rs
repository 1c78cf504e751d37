//! MR and MW: the global variables and the data of the selected file.

use super::Outcome;
use crate::alarm;
use crate::drive::DriveError;
use crate::output::Output;
use crate::persistence::PendingChange;
use crate::prelude::*;
use crate::robot::Robot;
use alloc::sync::Arc;
use bytes::Bytes;
use scol_mini::{AccessError, Arm, Payload, Position, Program, Trans, Value, ValueKind};
use ts3100_proto::command::{Number, VariableKind, VariableRead, VariableWrite};
use ts3100_proto::error_text;
use ts3100_proto::name::VariableName;
use ts3100_proto::status::mr::encode_values;

/// Why a variable was not read or written.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum VariableError {
    NoFile,
    Unknown(String),
    UnknownKind(String),
    Kind {
        name: String,
        found: ValueKind,
        asked: ValueKind,
    },
    Subscripts {
        code: i32,
        name: String,
    },
    Value {
        expected: &'static str,
        found: String,
    },
    Stale,
    Compile,
    Access(AccessError),
    Drive(DriveError),
}

error_text! {
    VariableError: Access from AccessError, Drive from DriveError;
    Self::NoFile => "no file is selected";
    Self::Unknown(name) => "there is no variable {name}";
    Self::UnknownKind(name) => "the type of {name} is unknown";
    Self::Kind { name, found, asked } => "{name} is {}, not {}", found.description(), asked.description();
    Self::Subscripts { code, name } => "type {code} does not match the subscripts of {name}";
    Self::Value { expected, found } => "expected {expected}, found `{found}`";
    Self::Stale => "the file has been downloaded again; select it first";
    Self::Compile => "the file does not compile with that value";
    Self::Access(error) => "{error}";
    Self::Drive(error) => "{error}";
}

type VariableResult<T> = Result<T, VariableError>;

impl Robot {
    /// MR (CMD-MR-01 to CMD-MR-06, MR-01 to MR-05).
    pub(super) fn op_read_variable(&mut self, read: &VariableRead) -> Outcome {
        match self.read_variable(&read.variable, read.kind) {
            Ok(value) => Outcome::file(encode_values(&numbers(&value, self.arm.kind()))),
            Err(reason) => Outcome::Ng(reason.to_string()),
        }
    }

    fn read_variable(&self, variable: &VariableName, kind: VariableKind) -> VariableResult<Value> {
        self.executor.selected().ok_or(VariableError::NoFile)?;
        let value = self.executor.global(variable)?;
        check_kind(variable, kind, value.kind())?;
        Ok(value)
    }

    /// MW (CMD-MW-01 to CMD-MW-06).
    pub(crate) fn write_variable(
        &mut self,
        write: &VariableWrite,
        room: Option<usize>,
    ) -> VariableResult<()> {
        let arm = self.arm.kind();
        let name = &write.variable.name;
        self.executor.selected().ok_or(VariableError::NoFile)?;
        let info = self.executor.program().variable(name);
        let info = info.ok_or_else(|| VariableError::Unknown(name.clone()))?;
        let kind = kind_of(write.kind).or(info.kind);
        let kind = kind.ok_or_else(|| VariableError::UnknownKind(name.clone()))?;
        check_kind(&write.variable, write.kind, info.kind.unwrap_or(kind))?;
        let value = value(kind, &write.values, arm)?;
        // The file is on the drive before the value counts (CMD-MW-02).
        let changed = match self.executor.selected().filter(|_| write.restore) {
            Some(selected) => {
                let source = selected.rewritten(&write.variable, &value)?;
                let program = self.stored(&source, room)?;
                Some((source, program))
            }
            None => None,
        };
        self.executor.set_global(&write.variable, value)?;
        if let Some((source, program)) = changed {
            self.take_rewritten(source, program);
        }
        Ok(())
    }

    /// RESTORE of a program: the values go into the file as those of MW do (scol.md 13.4).
    pub(crate) fn restore_data(&mut self, names: Vec<String>, direct: bool) {
        let restored = self.restored(&names);
        if self.persistence.is_pending() {
            return self.persistence.hold(PendingChange::Restore { names, direct });
        }
        if let Err(reason) = restored {
            self.raise(alarm::NOT_RESTORED, format!("RESTORE: {reason}"));
        }
        if !direct {
            self.between_steps(false);
        }
    }

    fn restored(&mut self, names: &[String]) -> VariableResult<()> {
        let selected = self.executor.selected().ok_or(VariableError::NoFile)?;
        let source = selected.restored(names)?;
        let program = self.stored(&source, None)?;
        self.take_rewritten(source, program);
        Ok(())
    }

    /// Stores the selected file with new initial values on the drive; its program.
    fn stored(&mut self, source: &str, room: Option<usize>) -> VariableResult<Arc<Program>> {
        let selected = self.executor.selected().ok_or(VariableError::NoFile)?;
        if selected.is_stale() {
            return Err(VariableError::Stale);
        }
        let file = ts3100_proto::name::FileName::parse(selected.name()).map_err(DriveError::from)?;
        let compilation = self.config.compile(source);
        let program = compilation.program.ok_or(VariableError::Compile)?;
        if let Some(free) = room.filter(|free| source.len() > *free) {
            let size = source.len();
            let name = selected.name().to_string();
            return Err(DriveError::Full { name, size, free }.into());
        }
        self.drive.check(&file, source.as_bytes())?;
        let source = Bytes::copy_from_slice(source.as_bytes());
        self.persist(file.as_str(), Some(&source))?;
        self.drive.store_checked(&file, source);
        Ok(program)
    }

    /// What runs goes on in the rewritten file, and the edge keeps it.
    fn take_rewritten(&mut self, source: String, program: Arc<Program>) {
        let name = self.executor.file().to_string();
        self.executor.take_rewritten(source.clone(), program);
        self.outputs.push(Output::Stored {
            name,
            content: source.into_bytes().into(),
        });
    }
}

/// The type code must be that of the variable; 0-4 name single variables, 5-9 array elements.
fn check_kind(variable: &VariableName, kind: VariableKind, found: ValueKind) -> VariableResult<()> {
    let Some(asked) = kind_of(kind) else { return Ok(()) };
    if asked != found {
        let name = variable.name.clone();
        return Err(VariableError::Kind { name, found, asked });
    }
    if kind.is_array() == variable.subscripts.is_empty() {
        let (code, name) = (kind.code(), variable.name.clone());
        return Err(VariableError::Subscripts { code, name });
    }
    Ok(())
}

fn kind_of(kind: VariableKind) -> Option<ValueKind> {
    match kind {
        VariableKind::Unclarified => None,
        VariableKind::Integer | VariableKind::IntegerArray => Some(ValueKind::Integer),
        VariableKind::Real | VariableKind::RealArray => Some(ValueKind::Real),
        VariableKind::Load | VariableKind::LoadArray => Some(ValueKind::Load),
        VariableKind::Coordinate | VariableKind::CoordinateArray => Some(ValueKind::Coordinate),
        VariableKind::Position | VariableKind::PositionArray => Some(ValueKind::Position),
    }
}

pub(crate) fn numbers(value: &Value, arm: Arm) -> Vec<Number> {
    let reals = |listed: Vec<f64>| listed.into_iter().map(Number::Real).collect();
    match value {
        Value::Integer(integer) => Vec::from([Number::Integer(*integer)]),
        Value::Real(real) => Vec::from([Number::Real(f64::from(*real))]),
        Value::Load(load) => reals(load.listed(arm)),
        Value::Coordinate(trans) => reals(trans.listed(arm)),
        Value::Position(position) => reals(position.listed(arm)),
    }
}

/// Whether each is a number that a real of the controller can hold.
pub(super) fn in_range(numbers: &[f64]) -> bool {
    let largest = f64::from(f32::MAX);
    numbers.iter().all(|number| (-largest..=largest).contains(number))
}

/// The value that the numbers of MW make, their count as the arm's positions have it (CMD-MW-04).
fn value(kind: ValueKind, numbers: &[Number], arm: Arm) -> VariableResult<Value> {
    let reals: Vec<f64> = numbers.iter().map(|number| number.as_f64()).collect();
    let found: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    let wrong = |expected| VariableError::Value {
        expected,
        found: found.join(" "),
    };
    if !in_range(&reals) {
        return Err(wrong("numbers in the range of a real"));
    }
    let (expected, value) = match (kind, numbers) {
        (ValueKind::Integer, [Number::Integer(integer)]) => ("", Some(Value::Integer(*integer))),
        (ValueKind::Integer, _) => ("one integer", None),
        // Reals of the language are single.
        (ValueKind::Real, [number]) => ("", Some(Value::Real(number.as_f64() as f32))),
        (ValueKind::Real, _) => ("one number", None),
        (ValueKind::Load, _) => ("a load", Payload::from_listed(arm, &reals).map(Value::from)),
        (ValueKind::Coordinate, _) => ("a coordinate", Trans::from_listed(arm, &reals).map(Value::from)),
        (ValueKind::Position, _) => ("a position", Position::from_listed(arm, &reals).map(Value::from)),
    };
    value.ok_or_else(|| wrong(expected))
}
