//! Jogging from the host (MD RT SC JG) and by the keys of the teach pendant. The arm moves until JG ! or the key that is
//! let go ends it, or the host disconnects or loses the control right.

use super::refuse_if;
use crate::arm::{Guide, Jog, JogFrame};
use crate::limits::{INCHING_STEP, JOG_SPEED};
use crate::outcome::Outcome;
use crate::panel::{JogMode, KeySwitch};
use crate::port::Port;
use crate::refusal::OperateError;
use crate::robot::Robot;
use ts3100_proto::command::JogDirection;

impl Robot {
    /// MD, RT, SC: mode, rate and coordinate system of jogging (SF-14 to SF-16).
    pub(super) fn op_guide(&mut self, change: impl Fn(&mut JogMode)) -> Outcome {
        self.panel.change_jog_mode(change);
        Outcome::Ok
    }

    /// JG.
    pub(super) fn op_jog(&mut self, port: Port, axis: u8, motion: JogDirection) -> Outcome {
        let positive = match motion {
            JogDirection::Plus => true,
            JogDirection::Minus => false,
            JogDirection::Stop => {
                self.arm.stop_jog(self.context.now);
                return Outcome::Ok;
            }
        };
        let mode = self.panel.state().jog_mode;
        Outcome::from_result(self.jog(Guide::Host(port), axis, positive, mode))
    }

    /// Jogging by the keys of the teach pendant, in TEACHING only; the settings are shown by SF from then on.
    pub(crate) fn jog_by_key(&mut self, axis: u8, positive: bool, mode: JogMode) -> Result<(), OperateError> {
        if self.panel.state().key != KeySwitch::Teaching {
            return Err(OperateError::NotTeaching);
        }
        self.jog(Guide::Pendant, axis, positive, mode)?;
        self.panel.change_jog_mode(|present| *present = mode);
        Ok(())
    }

    fn jog(&mut self, by: Guide, axis: u8, positive: bool, mode: JogMode) -> Result<(), OperateError> {
        let running = self.executor.is_running();
        refuse_if([
            (running, OperateError::Busy),
            (!self.panel.state().servo, OperateError::ServoOff),
            (self.panel.state().feed_hold, OperateError::FeedHold),
            (mode.mode == JogMode::FREE, OperateError::Free),
            (self.arm.is_jogging(), OperateError::Guided),
        ])?;
        let rate = usize::from(mode.rate).min(JOG_SPEED.len() - 1);
        let jog = Jog {
            by,
            axis,
            sign: if positive { 1.0 } else { -1.0 },
            step: (mode.mode == JogMode::INCHING).then_some(INCHING_STEP[rate]),
            speed: JOG_SPEED[rate],
            frame: JogFrame::from_number(mode.coordinate),
        };
        let (now, pace) = (self.context.now, self.pace());
        let conditions = self.executor.memory().conditions();
        let locked = self.panel.state().machine_lock;
        Ok(self.arm.jog(now, &jog, conditions, pace, locked)?)
    }
}
