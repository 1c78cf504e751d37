//! What the saved states of machines and memories share: their version, their checks, the error of restoring.
//!
//! A state holds what changes while a program runs and nothing of the program itself. It is restored against a program of the
//! same source and validated in full. `machine::snapshot` and `memory::snapshot` do the two halves; the serialized form is left to
//! the caller.

use alloc::format;
use alloc::string::String;

use crate::conditions::{Conditions, Frame};
use crate::program::Program;
use crate::value::{Payload, Position, Trans, Value};

pub use crate::machine::snapshot::MachineState;
pub use crate::memory::snapshot::MemoryState;

/// Version of the states this version of the language writes and reads.
pub const STATE_VERSION: u32 = 1;

/// Why a state cannot be restored.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RestoreError {
    /// Written by another version.
    #[error("expected a state of version {STATE_VERSION}, found version {0}")]
    Version(u32),
    /// Of another source, or of other options.
    #[error("expected a state of the program {expected:016x}, found one of {found:016x}")]
    Program {
        /// Fingerprint of the program given.
        expected: u64,
        /// Fingerprint in the state.
        found: u64,
    },
    /// It cannot have come about by running the program.
    #[error("the state does not fit the program: {0}")]
    Invalid(String),
}

/// Fails unless `holds`, saying what was expected.
pub(crate) fn expect(holds: bool, expected: &str) -> Result<(), RestoreError> {
    if holds {
        return Ok(());
    }
    Err(RestoreError::Invalid(format!("expected {expected}")))
}

/// Whether a state was written by this version, for this program.
pub(crate) fn belongs(version: u32, source: u64, program: &Program) -> Result<(), RestoreError> {
    if version != STATE_VERSION {
        return Err(RestoreError::Version(version));
    }
    let expected = program.fingerprint();
    if source != expected {
        return Err(RestoreError::Program {
            expected,
            found: source,
        });
    }
    Ok(())
}

/// Whether a value is one the language can have.
pub(crate) fn value(value: &Value) -> Result<(), RestoreError> {
    match value {
        Value::Integer(_) => Ok(()),
        Value::Real(real) => expect(real.is_finite(), "reals that are finite"),
        Value::Load(load) => payload(load),
        Value::Coordinate(coordinate) => trans(coordinate),
        Value::Position(place) => position(place),
    }
}

/// Whether a position is one the language can have.
pub(crate) fn position(position: &Position) -> Result<(), RestoreError> {
    numbers(&position.coords)?;
    expect(
        position.config.digits.iter().all(|digit| *digit <= 2),
        "configurations of digits 0 to 2",
    )?;
    position.work.as_deref().map_or(Ok(()), frame)
}

fn payload(load: &Payload) -> Result<(), RestoreError> {
    numbers(&[load.mass])?;
    numbers(&load.gravity)?;
    numbers(&load.size)
}

fn trans(coordinate: &Trans) -> Result<(), RestoreError> {
    numbers(&coordinate.coords)
}

fn frame(frame: &Frame) -> Result<(), RestoreError> {
    trans(&frame.trans)
}

/// Whether all numbers are finite.
pub(crate) fn numbers(numbers: &[f64]) -> Result<(), RestoreError> {
    expect(
        numbers.iter().all(|number| number.is_finite()),
        "numbers that are finite",
    )
}

/// Whether a program can have set these conditions.
pub(crate) fn conditions(conditions: &Conditions) -> Result<(), RestoreError> {
    let Conditions {
        speed,
        accel,
        decel,
        config,
        base,
        tool,
        work,
        payload: load,
        nowait: _,
        pass,
        passing: _,
        accuracy: _,
        gain,
        torque,
    } = conditions;
    let percent = |least: f64, number: &f64| (least..=100.0).contains(number);
    expect(
        [speed, accel, decel]
            .into_iter()
            .all(|number| percent(1.0, number)),
        "SPEED, ACCEL and DECEL of 1 to 100",
    )?;
    expect(
        gain.iter()
            .chain(torque)
            .chain([pass])
            .all(|number| percent(0.0, number)),
        "PASS, GAIN and TORQUE of 0 to 100",
    )?;
    expect(
        config.digits.iter().all(|digit| *digit <= 2),
        "a CONFIG of digits 0 to 2",
    )?;
    [base, tool, work].into_iter().try_for_each(frame)?;
    load.as_ref().map_or(Ok(()), |(_, load)| payload(load))
}

/// A frame that several positions share is written down with each.
pub(crate) mod shared {
    use alloc::sync::Arc;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::conditions::Frame;

    pub fn serialize<S: Serializer>(frame: &Option<Arc<Frame>>, to: S) -> Result<S::Ok, S::Error> {
        frame.as_deref().serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Arc<Frame>>, D::Error> {
        Ok(Option::<Frame>::deserialize(from)?.map(Arc::new))
    }
}
