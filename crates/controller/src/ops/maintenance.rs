//! MN and RM, the maintenance information (S29, S74, S75), and the current position file of PS (S28). What is counted is in
//! `crate::maintenance` and `crate::arm`.

use crate::model::{ArmKind, Joints};
use crate::outcome::Outcome;
use crate::robot::Robot;
use libm::round;
use ts3100_proto::status::mn::MaintenanceItem;
use ts3100_proto::status::position::{CurrentPosition, POSITION_AXES};

/// Peak torque, which MN clears when it has shown it.
const PEAK_ITEM: u8 = 5;
/// Load factors of 3 s, 1 min, 15 min and 2 h.
const LOAD_ITEM: u8 = 6;
const LAST_LOAD_ITEM: u8 = 9;

impl Robot {
    /// Takes note of the state that holds from now on.
    pub(crate) fn update_maintenance(&mut self) {
        let (state, fault) = (self.panel.state(), self.alarms.blocks_start());
        self.maintenance
            .update(self.context.now, state.powered, state.servo, fault);
    }

    /// MN: one item. Showing the peak torque as item 5 clears it, as item 17 it does not (S74).
    pub(super) fn op_maintenance(&mut self, number: u8) -> Outcome {
        let wear = self.arm.wear(self.context.now);
        let values = self
            .maintenance
            .item(number, self.context.now, &wear, self.has_sliding_axis());
        if number == PEAK_ITEM {
            self.arm.clear_peak(self.context.now);
        }
        Outcome::file(MaintenanceItem { number, values }.encode())
    }

    /// RM: one item begins at 0 again, while a program runs too (T27).
    pub(super) fn op_reset_maintenance(&mut self, item: u8) -> Outcome {
        match item {
            PEAK_ITEM => self.arm.clear_peak(self.context.now),
            LOAD_ITEM..=LAST_LOAD_ITEM => self
                .arm
                .clear_load(usize::from(item - LOAD_ITEM), self.context.now),
            item => {
                let wear = self.arm.wear(self.context.now);
                let slides = self.has_sliding_axis();
                self.maintenance.reset(item, self.context.now, &wear, slides);
            }
        }
        Outcome::Ok
    }

    fn has_sliding_axis(&self) -> bool {
        matches!(self.arm.model().kind, ArmKind::Scara(_))
    }

    /// The current position file, which PS answers (S28, S72).
    pub(crate) fn current_position(&self) -> CurrentPosition {
        let joints = truncated(&self.arm.joints(self.context.now));
        let (line, _) = self.steps();
        CurrentPosition {
            status: self.executor.shown_status(),
            line: u16::try_from(line).unwrap_or(u16::MAX),
            joints,
            // The servo follows exactly.
            measured: joints,
            torques: truncated(&self.arm.torques(self.context.now).map(round)),
        }
    }
}

/// The integer parts of the first axes.
fn truncated(joints: &Joints) -> [i32; POSITION_AXES] {
    // The cast saturates; digits after the point are left out.
    core::array::from_fn(|axis| joints[axis] as i32)
}
