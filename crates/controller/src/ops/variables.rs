//! MR and MW: the global variables and the data of the selected file.

use crate::alarm;
use crate::drive::DriveError;
use crate::listed::numbers;
use crate::outcome::Outcome;
use crate::persistence::Change;
use crate::prelude::*;
use crate::refusal::VariableError;
use crate::robot::Robot;
use crate::robot::scheduler::{RunEffect, Turn};
use core::fmt::Display;
use scol_mini::{Arm, Payload, Position, Trans, Value, ValueKind};
use ts3100_proto::command::{Number, VariableKind, VariableRead, VariableWrite};
use ts3100_proto::name::{FileName, VariableName};
use ts3100_proto::status::mr::encode_values;

type VariableResult<T> = Result<T, VariableError>;

impl Robot {
    /// MR (CMD-MR-01 to CMD-MR-06, MR-01 to MR-05).
    pub(super) fn op_read_variable(&mut self, read: &VariableRead) -> Outcome {
        match self.read_variable(&read.variable, read.kind) {
            Ok(value) => Outcome::file(encode_values(&numbers(&value, self.arm.kind()))),
            Err(reason) => Outcome::Ng(reason.into()),
        }
    }

    fn read_variable(&self, variable: &VariableName, kind: VariableKind) -> VariableResult<Value> {
        self.executor.selected().ok_or(VariableError::NoFile)?;
        let value = self.executor.global(variable)?;
        check_kind(variable, kind, value.kind())?;
        Ok(value)
    }

    /// MW (CMD-MW-01 to CMD-MW-06): acts at once, or when the file that it changes is on the drive.
    ///
    /// # Errors
    /// Why it has no effect.
    pub(crate) fn write_variable(
        &mut self,
        write: &VariableWrite,
        room: Option<usize>,
    ) -> VariableResult<Option<Change>> {
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
            let variable = Some((write.variable.clone(), value));
            return Ok(Some(Change {
                variable,
                ..self.rewrite(source, room)?
            }));
        }
        self.executor.set_global(&write.variable, value)?;
        Ok(None)
    }

    /// RESTORE of a program: the values go into the file as those of MW do (scol.md 13.4).
    pub(crate) fn restore_data(&mut self, names: &[String], direct: bool) -> Turn {
        match self.restored(names) {
            Ok(change) => {
                let change = Box::new(change);
                Turn::Asks(RunEffect::Restore { change, direct })
            }
            Err(reason) => {
                self.end_restore(direct, Err(reason));
                Turn::Taken
            }
        }
    }

    /// RESTORE has ended, and the program continues.
    pub(crate) fn end_restore(&mut self, direct: bool, restored: Result<(), impl Display>) {
        if let Err(reason) = restored {
            self.raise(alarm::NOT_RESTORED, format!("RESTORE: {reason}"));
        }
        if !direct {
            self.between_steps(false);
        }
    }

    fn restored(&self, names: &[String]) -> VariableResult<Change> {
        let selected = self.executor.selected().ok_or(VariableError::NoFile)?;
        let source = selected.restored(names)?;
        self.rewrite(source, None)
    }

    /// The selected file with new initial values, to be stored on the drive.
    fn rewrite(&self, source: String, room: Option<usize>) -> VariableResult<Change> {
        let selected = self.executor.selected().ok_or(VariableError::NoFile)?;
        if selected.is_stale() {
            return Err(VariableError::Stale);
        }
        let file = FileName::parse(selected.name()).map_err(DriveError::from)?;
        let program = self.context.config.compile(&source).program;
        let program = program.ok_or(VariableError::Compile)?;
        let (name, size) = (file.as_str().to_string(), source.len());
        if let Some(free) = room.filter(|free| size > *free) {
            return Err(DriveError::Full { name, size, free }.into());
        }
        let staged = self.drive.stage(&file, source.into())?;
        Ok(Change {
            program: Some(program),
            ..staged.into()
        })
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

/// Whether each is a number that a real of the controller can hold.
pub(super) fn in_range(numbers: &[f64]) -> bool {
    let largest = f64::from(f32::MAX);
    numbers.iter().all(|number| (-largest..=largest).contains(number))
}

/// The value that the numbers of MW make, their count as the arm's positions have it (CMD-MW-04).
fn value(kind: ValueKind, numbers: &[Number], arm: Arm) -> VariableResult<Value> {
    let reals: Vec<f64> = numbers.iter().map(|number| number.as_f64()).collect();
    let width = kind.width(arm);
    let listed: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    let listed = listed.join(" ");
    let found = match numbers.len() == width {
        true => format!("`{listed}`"),
        false => format!("{} numbers: `{listed}`", numbers.len()),
    };
    // A host whose language writes 1,5 sends two values.
    // With one in a position short of its configuration the count is right.
    let may_be_too_long = numbers.len() > width;
    let wrong = |expected: String| VariableError::Value {
        expected,
        found,
        hint: match may_be_too_long {
            true => "; a comma separates values: write decimals with a point",
            false => "",
        },
    };
    if !in_range(&reals) {
        return Err(wrong("numbers in the range of a real".to_string()));
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
    value.ok_or_else(|| {
        wrong(match width {
            1 => expected.to_string(),
            _ => format!("{expected} of {width} numbers"),
        })
    })
}
