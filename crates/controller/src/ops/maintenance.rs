//! MN, the maintenance information (S29), and the current position file (S28). What is counted is in
//! `crate::maintenance` and `crate::arm`.

use crate::model::{ArmKind, Joints};
use crate::robot::Robot;
use libm::round;
use ts3100_proto::status::mn::Maintenance;
use ts3100_proto::status::position::{CurrentPosition, POSITION_AXES};

impl Robot {
    /// Takes note of the state that holds from now on.
    pub(crate) fn update_maintenance(&mut self) {
        let (state, fault) = (self.panel.state(), self.alarms.blocks_start());
        self.maintenance
            .update(self.now, state.powered, state.servo, fault);
    }

    /// The maintenance information now.
    pub(super) fn maintenance(&self) -> Maintenance {
        let slides = matches!(self.arm.model().kind, ArmKind::Scara(_));
        self.maintenance
            .information(self.now, &self.arm.wear(self.now), slides)
    }

    /// What the current position file of the SCARA edition holds now (S28); no command is known that asks for it.
    pub(crate) fn current_position(&self) -> CurrentPosition {
        let joints = truncated(&self.arm.joints(self.now));
        let (line, _) = self.steps();
        CurrentPosition {
            status: self.executor.shown_status(),
            line: u16::try_from(line).unwrap_or(u16::MAX),
            joints,
            // The servo follows exactly.
            measured: joints,
            torques: truncated(&self.arm.torques(self.now).map(round)),
        }
    }
}

/// The integer parts of the first axes.
fn truncated(joints: &Joints) -> [i32; POSITION_AXES] {
    // The cast saturates; what is behind the point is left out.
    core::array::from_fn(|axis| joints[axis] as i32)
}
