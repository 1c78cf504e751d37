//! RS and SL: back to a step, the reset of signals, the selection of a file.

use crate::SelectError;
use crate::executor::Standstill;
use crate::finding::rules;
use crate::options::CycleWithoutLabel;
use crate::outcome::Outcome;
use crate::port::Port;
use crate::prelude::*;
use crate::refusal::{OperateError, Refusal};
use crate::robot::Robot;
use ts3100_proto::command::Reset;
use ts3100_proto::name::FileName;

impl Robot {
    /// RS, and RS,ERR with no reset of the program, in stop mode only (CMD-RS-01 to CMD-RS-10, decision D6).
    pub(super) fn op_reset(&mut self, reset: Option<Reset>) -> Outcome {
        if self.executor.is_running() {
            return Outcome::Ng(Refusal::NotStopped);
        }
        if let Some(reset) = reset {
            return Outcome::from_result(self.carry_out_reset(reset));
        }
        self.reset_alarms();
        Outcome::Ok
    }

    /// A reset of the program at the panel.
    ///
    /// # Errors
    /// The program runs.
    pub(crate) fn reset_program(&mut self) -> Result<(), OperateError> {
        if self.executor.is_running() {
            return Err(OperateError::ProgramRuns);
        }
        self.carry_out_reset(Reset::Program)
    }

    /// A reset, by RS, by a signal or at the panel.
    ///
    /// # Errors
    /// Why it had no effect.
    pub(crate) fn carry_out_reset(&mut self, reset: Reset) -> Result<(), OperateError> {
        match reset {
            Reset::Program => {
                self.set_feed_hold(false);
                self.reset_alarms();
                // A file that does not compile stays stale; the next start says why.
                let _still_stale = self.renew_stale();
                self.executor.initialise(self.context.now);
                self.report_status();
            }
            Reset::Step => self.step_reset(),
            Reset::Cycle => return self.cycle_reset(),
            Reset::Signal => self.signals.reset_outputs(),
            Reset::Select => {
                self.deselect();
                self.report_status();
            }
        }
        Ok(())
    }

    /// RS,STP: to step 1 (CMD-RS-04).
    fn step_reset(&mut self) {
        self.executor.rewind(self.context.now);
        self.reset_locals();
        self.report_status();
    }

    /// RS,CYC: to the label RCYCLE (CMD-RS-05, CMD-RS-06).
    fn cycle_reset(&mut self) -> Result<(), OperateError> {
        if self.executor.selected().is_none() {
            return self.reset_without_label(OperateError::NoFile);
        }
        // The next start runs the file as it is on the drive.
        self.renew_stale()?;
        if !self.executor.go_to_rcycle() {
            return self.reset_without_label(OperateError::NoRcycle);
        }
        self.reset_locals();
        self.arm.drop_interrupted();
        self.executor.stand(Standstill::BetweenSteps);
        self.report_status();
        Ok(())
    }

    /// RS,CYC without a label to go to. Real hosts send RS,ERR, RS,CYC, RS,PRG and RS,STP and give up at the first
    /// NG (T19).
    ///
    /// # Errors
    /// `reason`, with `rs.cycle_without_label = ng`.
    fn reset_without_label(&mut self, reason: OperateError) -> Result<(), OperateError> {
        match self.context.config.options.cycle_without_label {
            CycleWithoutLabel::AsStep => {
                self.step_reset();
                Ok(())
            }
            CycleWithoutLabel::Ng => Err(reason),
        }
    }

    /// Both communication manuals keep all variables (CMD-RS-04, CMD-RS-05, S46); the library's manual keeps the global
    /// ones only (L60, L61), which `scol.reset_locals` does.
    fn reset_locals(&mut self) {
        if self.context.config.options.reset_locals {
            self.executor.reset_locals();
        }
    }

    /// SL (CMD-SL-01 to CMD-SL-03).
    pub(super) fn op_select(&mut self, port: Port, name: &FileName) -> Outcome {
        match self.select_file(name) {
            Ok(()) => {
                self.report_status();
                Outcome::Ok
            }
            Err(error) => {
                if let SelectError::Errors { .. } = &error {
                    let name = name.as_str().as_bytes();
                    self.context
                        .report(&rules::PROGRAM_ERRORS, port, name, error.to_string());
                }
                Outcome::Ng(error.into())
            }
        }
    }
}
