//! Common parts of the written states of machines and memories: version, checks, and the error of restoring.
//!
//! A state holds what changes while a program runs, and of the program its fingerprint. What is read back is validated
//! against a program of the same source: `machine::snapshot` and `memory::snapshot` do the two halves. The names in the
//! written form are fixed by `fixtures/snapshots`.

use crate::prelude::*;
use serde::{Deserialize, Deserializer};

use crate::conditions::{Conditions, FULL, MAX_ACCEL};
use crate::options::Arm;
use crate::program::{Program, STATE_VERSION};
use crate::value::{Position, Value};

/// Why a state cannot be restored.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RestoreError {
    /// Written by another version.
    #[error("expected a state of version {STATE_VERSION}, found version {0}")]
    Version(u32),
    /// The state is of another source, or of other options.
    #[error("expected a state of the program {expected:016x}, found one of {found:016x}")]
    Program {
        /// Fingerprint of the program given.
        expected: u64,
        /// Fingerprint in the state.
        found: u64,
    },
    /// No run of the program leads to this state.
    #[error("the state does not match the program: {0}")]
    Invalid(String),
}

/// Fails unless `holds`, saying what was expected.
pub(crate) fn expect(holds: bool, expected: &str) -> Result<(), RestoreError> {
    let holds = holds.then_some(());
    holds.ok_or_else(|| RestoreError::Invalid(format!("expected {expected}")))
}

/// Reads the field `version` of a state: no other than [`STATE_VERSION`] is read.
pub(crate) fn version<'de, D: Deserializer<'de>>(from: D) -> Result<u32, D::Error> {
    match u32::deserialize(from)? {
        STATE_VERSION => Ok(STATE_VERSION),
        found => Err(serde::de::Error::custom(RestoreError::Version(found))),
    }
}

/// Whether a state was written for this program.
pub(crate) fn belongs(source: u64, program: &Program) -> Result<(), RestoreError> {
    let (expected, found) = (program.fingerprint(), source);
    let same = (expected == found).then_some(());
    same.ok_or(RestoreError::Program { expected, found })
}

/// Whether a value is one the language can have.
pub(crate) fn value(value: &Value) -> Result<(), RestoreError> {
    match value {
        Value::Integer(_) => Ok(()),
        Value::Real(real) => expect(real.is_finite(), "reals that are finite"),
        Value::Load(load) => numbers(&load.listed(Arm::SixAxis)),
        Value::Coordinate(trans) => numbers(&trans.coords),
        Value::Position(place) => position(place),
    }
}

/// Whether a position is one the language can have.
pub(crate) fn position(position: &Position) -> Result<(), RestoreError> {
    numbers(&position.coords)?;
    expect(position.config.is_valid(), "configurations of digits 0 to 2")?;
    let frame = position.work.as_deref();
    frame.map_or(Ok(()), |frame| numbers(&frame.trans.coords))
}

/// Whether all numbers are finite.
pub(crate) fn numbers(numbers: &[f64]) -> Result<(), RestoreError> {
    let finite = numbers.iter().all(|number| number.is_finite());
    expect(finite, "numbers that are finite")
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
    expect((1.0..=FULL).contains(speed), "SPEED of 1 to 100")?;
    let mut accels = [accel, decel].into_iter();
    let accels = accels.all(|percent| (1.0..=MAX_ACCEL).contains(percent));
    expect(accels, "ACCEL and DECEL of 1 to 100000")?;
    let mut others = gain.iter().chain(torque).chain([pass]);
    let others = others.all(|number| (0.0..=FULL).contains(number));
    expect(others, "PASS, GAIN and TORQUE of 0 to 100")?;
    expect(config.is_valid(), "a CONFIG of digits 0 to 2")?;
    for frame in [base, tool, work] {
        numbers(&frame.trans.coords)?;
    }
    let load = load.as_ref().map(|(_, load)| load.listed(Arm::SixAxis));
    numbers(&load.unwrap_or_default())
}

/// A program is written as its fingerprint, and read back as one without steps that has it.
pub(crate) mod source {
    use alloc::sync::Arc;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::program::Program;

    pub fn serialize<S: Serializer>(program: &Arc<Program>, to: S) -> Result<S::Ok, S::Error> {
        program.fingerprint().serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Arc<Program>, D::Error> {
        let fingerprint = u64::deserialize(from)?;
        Ok(Arc::new(Program::without_steps(fingerprint, &Default::default())))
    }
}
