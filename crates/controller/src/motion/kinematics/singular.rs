//! Names the singular posture on a path, for the alarm message.
//!
//! `plan` detects that a path runs through one.

use crate::model::ArmKind;

/// A posture in which the direction of the tool point no longer decides how the axes turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Singularity {
    /// Six axes: the wrist centre is on or near axis 1, which then turns freely.
    #[error("singular posture of the shoulder (wrist centre over axis 1)")]
    Shoulder,
    /// Six axes: axes 4 and 6 turn about nearly the same line.
    #[error("singular posture of the wrist (axes 4 and 6 in line)")]
    Wrist,
    /// The arm is stretched or folded: the elbow would have to turn over.
    #[error("singular posture of the elbow (arm stretched or folded)")]
    Elbow,
    /// SCARA: the shaft is on or near axis 1.
    #[error("singular posture of the first axis (shaft over axis 1)")]
    Shaft,
}

/// The singular posture in which this axis, counted from 0, jumps.
pub(crate) fn singularity(kind: &ArmKind, axis: usize) -> Singularity {
    match (kind, axis) {
        (ArmKind::SixAxis(_), 0) => Singularity::Shoulder,
        (ArmKind::SixAxis(_), 1 | 2) => Singularity::Elbow,
        (ArmKind::SixAxis(_), _) => Singularity::Wrist,
        (ArmKind::Scara(_), 1) => Singularity::Elbow,
        (ArmKind::Scara(_), _) => Singularity::Shaft,
    }
}
