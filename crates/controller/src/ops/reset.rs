//! RS and SL: back to a step, the reset of signals, the selection of a file.

use super::{OperateError, Outcome};
use crate::SelectError;
use crate::executor::Standstill;
use crate::findings::rules;
use crate::port::Port;
use crate::prelude::*;
use crate::robot::Robot;
use ts3100_proto::command::Reset;
use ts3100_proto::name::FileName;

impl Robot {
    /// RS, and RS,ERR with no reset of the program, in stop mode only (CMD-RS-01 to CMD-RS-10, decision D6).
    pub(super) fn op_reset(&mut self, reset: Option<Reset>) -> Outcome {
        if self.executor.is_running() {
            return Outcome::ng("RS is accepted only in stop mode");
        }
        if let Some(reset) = reset {
            return Outcome::of(self.reset_program(reset));
        }
        self.reset_alarms();
        Outcome::Ok
    }

    /// A reset, by RS or by a signal.
    ///
    /// # Errors
    /// Why it had no effect.
    pub(crate) fn reset_program(&mut self, reset: Reset) -> Result<(), OperateError> {
        match reset {
            Reset::Program => {
                self.set_feed_hold(false);
                self.reset_alarms();
                // A file that does not compile stays stale; the next start says why.
                let _still_stale = self.renew_stale();
                self.executor.initialise(self.now);
                self.report_status();
            }
            Reset::Step => {
                self.executor.rewind(self.now);
                self.report_status();
            }
            Reset::Cycle => return self.cycle_reset(),
            Reset::Signal => self.signals.reset_outputs(),
            Reset::Select => {
                self.deselect();
                self.report_status();
            }
        }
        Ok(())
    }

    /// RS,CYC: to the label RCYCLE (CMD-RS-05, CMD-RS-06).
    fn cycle_reset(&mut self) -> Result<(), OperateError> {
        self.executor.selected().ok_or(OperateError::NoFile)?;
        // The next start runs the file as it is on the drive.
        self.renew_stale()?;
        if !self.executor.go_to_rcycle() {
            return Err(OperateError::NoRcycle);
        }
        self.arm.drop_interrupted();
        self.executor.stand(Standstill::BetweenSteps);
        self.report_status();
        Ok(())
    }

    /// SL (CMD-SL-01 to CMD-SL-03).
    pub(super) fn op_select(&mut self, port: Port, name: &FileName) -> Outcome {
        match self.select_file(name) {
            Ok(()) => {
                self.report_status();
                Outcome::Ok
            }
            Err(error) => {
                let reason = error.to_string();
                if let SelectError::Errors { .. } = &error {
                    let name = name.as_str().as_bytes();
                    self.report(&rules::PROGRAM_ERRORS, port, name, reason.as_str());
                }
                Outcome::Ng(reason)
            }
        }
    }
}
