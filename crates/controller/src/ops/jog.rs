//! MD RT SC JG: jogging from the host. The arm moves until JG ! ends it or the host disconnects.

use super::{Outcome, first_reason};
use crate::arm::{Jog, JogFrame};
use crate::limits::{INCHING_STEP, JOG_SPEED};
use crate::port::Port;
use crate::robot::Robot;
use ts3100_proto::command::JogDirection;
use ts3100_proto::status::ExecutionStatus;

/// Guide mode in which the arm is moved by hand alone.
const FREE: u16 = 2;
/// Guide mode of steps.
const INCHING: u16 = 1;

impl Robot {
    /// MD, RT, SC: mode, rate and coordinate system of jogging (SF-14 to SF-16).
    pub(super) fn op_guide(&mut self, change: impl Fn(&mut crate::panel::JogMode)) -> Outcome {
        self.panel.change_jog_mode(change);
        Outcome::Ok
    }

    /// JG.
    pub(super) fn op_jog(&mut self, port: Port, axis: u8, motion: JogDirection) -> Outcome {
        let sign = match motion {
            JogDirection::Plus => 1.0,
            JogDirection::Minus => -1.0,
            JogDirection::Stop => {
                self.arm.stop_jog(self.now);
                return Outcome::Ok;
            }
        };
        let guide = self.panel.state().jog_mode;
        let running = self.executor.status() == ExecutionStatus::Running;
        if let Some(reason) = first_reason([
            (running, "a program or a DO statement is under way"),
            (!self.panel.state().servo, "servo power is off"),
            (self.panel.state().feed_hold, "feed hold is on"),
            (guide.mode == FREE, "the guide mode is FREE"),
            (self.arm.is_jogging(), "the arm is being guided; JG ! ends that"),
        ]) {
            return Outcome::ng(reason);
        }
        let rate = usize::from(guide.rate).min(JOG_SPEED.len() - 1);
        let jog = Jog {
            port,
            axis,
            sign,
            step: (guide.mode == INCHING).then_some(INCHING_STEP[rate]),
            speed: JOG_SPEED[rate],
            frame: JogFrame::from_number(guide.coordinate),
        };
        let (now, pace) = (self.now, self.pace());
        let conditions = self.executor.memory().conditions();
        let locked = self.panel.state().machine_lock;
        Outcome::of(self.arm.jog(now, &jog, conditions, pace, locked))
    }
}
