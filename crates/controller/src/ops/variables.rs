//! MR and MW: the global variables and the data of the selected file.

use super::Outcome;
use crate::alarm;
use crate::drive::DriveError;
use crate::output::Output;
use crate::persistence::PendingChange;
use crate::prelude::*;
use crate::robot::Robot;
use bytes::Bytes;
use scol_mini::{AccessError, Arm, Payload, Position, Trans, Value, ValueKind};
use ts3100_proto::command::{Number, VariableKind, VariableRead, VariableWrite};
use ts3100_proto::error_text;
use ts3100_proto::name::{FileName, VariableName};
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
        if let Some(selected) = self.executor.selected().filter(|_| write.restore) {
            let source = selected.rewritten(&write.variable, &value)?;
            self.rewrite(source, room)?;
        }
        self.executor.set_global(&write.variable, value)?;
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
        self.rewrite(source, None)
    }

    /// Stores the selected file with new initial values on the drive; what runs of it goes on in there.
    fn rewrite(&mut self, source: String, room: Option<usize>) -> VariableResult<()> {
        let selected = self.executor.selected().ok_or(VariableError::NoFile)?;
        if selected.is_stale() {
            return Err(VariableError::Stale);
        }
        let file = FileName::parse(selected.name()).map_err(DriveError::from)?;
        let program = self.config.compile(&source).program;
        let program = program.ok_or(VariableError::Compile)?;
        let (name, size) = (file.as_str().to_string(), source.len());
        if let Some(free) = room.filter(|free| size > *free) {
            return Err(DriveError::Full { name, size, free }.into());
        }
        let content = Bytes::copy_from_slice(source.as_bytes());
        self.drive.check(&file, &content)?;
        self.persist(&name, Some(&content))?;
        self.drive.store_checked(&file, content.clone());
        self.executor.take_rewritten(source, program);
        self.outputs.push(Output::Stored { name, content });
        Ok(())
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
