//! External operation by signals: the system inputs Din249-261 and the system outputs Dout249-262. The
//! manual gives their names only (`line_names`); which of them ACK answers, and where EX_SVON acts, the TSL3000E's
//! interface manual says (S40, S41). Edges, levels and pulses here are assumed and written down in docs/reference/protocol/signals.md.

use crate::executor::StopCause;
use crate::finding::rules;
use crate::io::line_names::{din, dout};
use crate::io::signals::LINE_NUMBERS;
use crate::limits::PULSE;
use crate::options::Strobe;
use crate::panel::{ControlRight, KeySwitch};
use crate::prelude::*;
use crate::refusal::OperateError;
use crate::robot::Robot;
use ts3100_proto::command::{Reset, RunMode};
use ts3100_proto::status::MasterMode;

/// Inputs that ACK answers when they are processed, in every master mode; of several at once the first alone is
/// processed (S40).
const RESETS: [u16; 4] = [din::PRG_RST, din::STEP_RST, din::CYC_RST, din::DO_RST];

/// Inputs that ACK does not answer; they act in EXT (SIG) only (PRM-LEG-08, S40, S41). EX_SVON before RUN: with
/// `sig.strobe = required` one STROBE can do both.
const UNANSWERED: [u16; 3] = [din::ALM_RST, din::EX_SVON, din::RUN];

impl Robot {
    /// Ends expired pulses of outputs, and drives the inputs that are due.
    pub(crate) fn change_due_lines(&mut self) {
        self.signals.end_due_pulses(self.context.now);
        for (line, on) in self.signals.take_due_inputs(self.context.now) {
            self.drive_input(line, on);
        }
    }

    /// An input line is driven from outside.
    pub(crate) fn drive_input(&mut self, line: u16, on: bool) {
        let was = self.signals.input(line);
        if !self.signals.drive_input(line, on) {
            let message = format!("there is no input {line}; inputs are {LINE_NUMBERS}");
            self.context.report(&rules::NO_SUCH_LINE, None, &[], message);
            return;
        }
        self.input_is_now(line, was);
    }

    /// An input that showed `was` may show something else now.
    pub(crate) fn input_is_now(&mut self, line: u16, was: bool) {
        let on = self.signals.input(line);
        if was == on || !self.panel.state().powered {
            return;
        }
        match line {
            din::LOW_SPD => self.arm.set_speed_limits(self.context.now, self.pace()),
            // A level, unlike the others: on is CYCLE, off is CONTINUOUS.
            din::CYCLE if self.by_signals() => {
                self.panel
                    .set_run_mode(if on { RunMode::Cycle } else { RunMode::Continuous });
            }
            // Inputs that stop act in every master mode (PRM-LEG-08), without STROBE.
            din::STOP if on => self.stop_by_hand(),
            din::BREAK if on => {
                self.panel.note_break_request();
                self.interrupt(StopCause::Other);
            }
            din::SVOFF if on => self.servo_off(StopCause::Other),
            din::STROBE if on => self.strobe(),
            _ if on && self.context.config.options.strobe == Strobe::Free => self.signal(line),
            _ => {}
        }
    }

    fn by_signals(&self) -> bool {
        self.panel.state().key == KeySwitch::Ext && self.panel.state().control_right == ControlRight::Sig
    }

    /// STROBE: with `sig.strobe = required` it is what makes the command inputs that are on count. It is acknowledged,
    /// unless a reset beside it was refused.
    fn strobe(&mut self) {
        let required = self.context.config.options.strobe == Strobe::Required;
        let is_on = |line: &u16| required && self.signals.input(*line);
        // Resets first: they need a program that stands, and RUN may be on beside them.
        let resets: Vec<u16> = RESETS.into_iter().filter(is_on).collect();
        let others: Vec<u16> = UNANSWERED.into_iter().filter(is_on).collect();
        if resets.is_empty() {
            let result = self.first_at_once();
            self.answer_signal(din::STROBE, result);
        }
        for line in resets.into_iter().chain(others) {
            self.signal(line);
        }
    }

    /// A command input that counts now; any other input says nothing.
    fn signal(&mut self, line: u16) {
        if UNANSWERED.contains(&line) && !self.by_signals() {
            return;
        }
        let result = match line {
            din::RUN => self.start(),
            din::EX_SVON if self.panel.state().servo => Err(OperateError::ServoOn),
            din::EX_SVON => self.servo_on(),
            din::ALM_RST => {
                self.reset_alarms();
                Ok(())
            }
            din::PRG_RST => self.reset_by_signal(Reset::Program),
            din::STEP_RST => self.reset_by_signal(Reset::Step),
            din::CYC_RST => self.reset_by_signal(Reset::Cycle),
            din::DO_RST => self.reset_by_signal(Reset::Signal),
            _ => return,
        };
        self.answer_signal(line, result);
    }

    fn reset_by_signal(&mut self, reset: Reset) -> Result<(), OperateError> {
        self.first_at_once()?;
        if self.executor.is_running() {
            return Err(OperateError::NotStopped);
        }
        self.carry_out_reset(reset)
    }

    /// Of several inputs at once the first alone is processed (S40). At once is the same instant (assumed): ACK began
    /// at it.
    ///
    /// # Errors
    /// Another was the first.
    fn first_at_once(&self) -> Result<(), OperateError> {
        // No field of its own: an ACK that began at this instant is the only trace that a first one leaves.
        if self.signals.pulse_end(dout::ACK) == Some(self.context.now + PULSE) {
            return Err(OperateError::NotFirst);
        }
        Ok(())
    }

    fn answer_signal(&mut self, line: u16, result: Result<(), OperateError>) {
        match result {
            Ok(()) if UNANSWERED.contains(&line) => {}
            Ok(()) => self.signals.pulse_output(dout::ACK, self.context.now + PULSE),
            Err(reason) => {
                let message = format!("Din{line} had no effect: {reason}");
                self.context.report(&rules::SIGNAL_REFUSED, None, &[], message);
            }
        }
    }

    /// CYC_END: on from END until the next start; in continuous operation a pulse.
    pub(crate) fn show_cycle_end(&mut self) {
        if self.executor.program_runs() {
            self.signals.pulse_output(dout::CYC_END, self.context.now + PULSE);
        } else {
            self.signals.set_output(dout::CYC_END, true);
        }
    }

    /// Whether LOW_SPD holds the speed down.
    pub(crate) fn is_slow(&self) -> bool {
        self.signals.input(din::LOW_SPD) && self.panel.state().key == KeySwitch::Ext
    }

    /// Lets the system outputs show the present state (SF-39).
    pub(crate) fn show_state(&mut self) {
        let state = self.panel.state();
        let mode = state.master_mode();
        let by_host = matches!(mode, MasterMode::ExtRs232c | MasterMode::ExtEther);
        let ready = !state.emergency_stop && !self.alarms.blocks_start();
        let shown = [
            (dout::EMG_ST, state.emergency_stop),
            (dout::SV_RDY, state.servo),
            (dout::TEACH, mode == MasterMode::Teaching),
            (dout::INT, mode == MasterMode::Internal),
            (dout::EXTSIG, mode == MasterMode::ExtSig),
            (dout::EXTHOST, by_host),
            (dout::SYS_RDY, ready),
            (dout::AUTORUN, self.executor.program_runs()),
            (dout::LOW_ST, self.is_slow()),
            (dout::CYC_ST, state.run_mode == RunMode::Cycle),
            (dout::BT_ALM, state.battery_low),
            (dout::ALARM, !self.alarms.active().is_empty()),
        ];
        for (line, on) in shown {
            if self.signals.output(line) != on {
                self.signals.set_output(line, on);
            }
        }
    }
}
