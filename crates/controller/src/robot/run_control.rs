//! Starts and stops: the end of a step, BREAK, servo off, emergency stop, and what an alarm of each level does.
//!
//! Panel, commands and system signals call this module. The state itself is in `executor::run_state`; hosts learn of a stop from
//! `endpoint::notices`.

use crate::alarm::{Alarm, AlarmCode};
use crate::executor::{Standstill, StopCause};
use crate::inspection::StopReason;
use crate::io::line_names::dout;
use crate::output::Event;
use crate::prelude::*;
use crate::robot::{Robot, RunNotice};
use ts3100_proto::status::AlarmLevel;

impl Robot {
    /// Starts or continues automatic operation.
    pub(crate) fn run_program(&mut self) {
        // First: it asks whether the program stands at step 1, which `start()` changes.
        self.take_up_motion();
        self.executor.start();
        self.notices.push(RunNotice::Started);
        self.panel.run_begins(self.context.now);
        self.signals.set_output(dout::CYC_END, false);
        self.report_status();
    }

    /// Continues the motion that a stop (retry) cut short, and its statement waits for it again; if the arm was moved
    /// since, the statement is repeated from the present posture.
    fn take_up_motion(&mut self) {
        let locked = self.panel.state().machine_lock;
        if self.executor.is_reset() || locked || !self.arm.resume_interrupted(self.context.now, self.pace()) {
            self.arm.drop_interrupted();
            self.executor.redo_motions();
        }
    }

    /// Automatic operation stops here. `by` decides whether hosts get an SP.
    pub(crate) fn stop_program(&mut self, place: Standstill, by: StopCause) {
        self.executor.stop(place, self.arm.is_interrupted());
        self.panel.run_ends(self.context.now);
        self.report_status();
        if by == StopCause::Other {
            self.notices.push(RunNotice::Stopped);
        }
    }

    /// Stops the program after the present step. A motion guided by hand ends immediately.
    pub(crate) fn stop_after_step(&mut self, by: StopCause) {
        self.arm.stop_jog(self.context.now);
        self.executor.request_stop(by);
    }

    /// STOP of the panel or of input STOP: a request that SM shows, also when nothing is left to stop (T1).
    pub(crate) fn stop_by_hand(&mut self) {
        self.panel.note_stop_request();
        self.stop_after_step(StopCause::Other);
    }

    /// Everything stops at once: the motion is given up, the step will be done again (CMD-EC-04, CMD-BR-02).
    /// An INPUT that waits is cancelled all the same (INP-09).
    pub(crate) fn interrupt(&mut self, by: StopCause) {
        self.executor.hide_run();
        if !self.executor.program_runs() {
            self.arm.stop(self.context.now);
            let rest = self.arm.ends_at().unwrap_or(self.context.now);
            self.executor.end_direct(rest, self.context.now);
            return;
        }
        self.arm.interrupt(self.context.now);
        // The arm first: whether its motion can go on decides which statements keep waiting for it.
        let place = self.executor.abort_steps(self.arm.is_interrupted());
        self.stop_program(place, by);
    }

    /// Servo power goes off, and with it everything that moves.
    pub(crate) fn servo_off(&mut self, by: StopCause) {
        self.interrupt(by);
        self.context.outputs.event(self.panel.servo_off());
    }

    /// Raises the alarm of a task of the program, of the statement on this file line.
    pub(crate) fn raise_in(&mut self, task: u16, line: Option<u32>, code: AlarmCode, detail: String) {
        if code.level != AlarmLevel::L1 {
            self.executor.note_alarm(task, line);
        }
        self.raise(code, detail);
    }

    /// Raises an alarm and lets its level act (D6). Events come in the order of cause and effect: alarm, stop, servo off.
    pub(crate) fn raise(&mut self, code: AlarmCode, detail: String) {
        let at = self.context.calendar();
        let alarm = Alarm { code, detail, at };
        self.context.outputs.event(Event::Alarm {
            number: code.number(),
            text: alarm.message(),
        });
        self.alarms.raise(alarm);
        if code.level != AlarmLevel::L1 {
            self.executor.note_stop(StopReason::Alarm);
        }
        match code.level {
            AlarmLevel::L8 => self.servo_off(StopCause::Other),
            AlarmLevel::L4 => self.interrupt(StopCause::Other),
            AlarmLevel::L2 => self.stop_after_step(StopCause::Other),
            AlarmLevel::L1 => {}
        }
    }

    /// Ends all alarms but those whose cause persists.
    pub(crate) fn reset_alarms(&mut self) {
        // The battery is left out: its alarm can be reset while the battery is low, and comes again at power-on.
        let [stop, fence, _] = self.panel.alarm_causes();
        let persists = |code: &AlarmCode| [stop, fence].contains(&(true, *code));
        if self.alarms.reset(persists) {
            self.context.outputs.event(Event::AlarmsReset);
        }
    }

    /// Logs the place of the program.
    pub(crate) fn report_status(&mut self) {
        self.context.outputs.event(Event::Status {
            status: self.executor.shown_status(),
            line: self.executor.line(),
        });
    }
}
