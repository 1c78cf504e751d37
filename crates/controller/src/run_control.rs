//! Everything that brings the robot to a stand: the end of a step, BREAK, servo off, emergency stop,
//! alarms; and the SP text that tells the host of it (CMD-SP-05).

use crate::Controller;
use crate::alarm::{self, Alarm, AlarmCode};
use crate::executor::{MAIN_TASK, RunState, StopCause, Task, TaskState};
use crate::limits::MAX_SP_DELAY;
use crate::options::UnsolicitedSp;
use crate::output::Event;
use crate::port::Port;
use crate::state::PanelState;
use crate::system_signals::dout;
use crate::variation::Variation;
use alloc::string::String;
use core::time::Duration;
use scol_mini::Answer;
use ts3100_proto::reply::Reply;
use ts3100_proto::status::{AlarmLevel, ExecutionStatus};

impl Controller {
    /// Automatic operation starts or goes on.
    pub(crate) fn run_program(&mut self) {
        self.take_up_motion();
        self.executor.course = RunState::Running { stop: None };
        self.executor.run_shown_until = None;
        // The stop before this start is history: its SP must not be taken for one of the cycle that begins.
        for session in self.sessions.values_mut() {
            session.waiting_sp = false;
        }
        self.state.running_since = Some(self.now);
        self.signals.set_output(dout::CYC_END, false);
        self.report_status();
    }

    /// The motion that a stop (retry) cut short goes on, and its statement waits for it again; if the arm has been
    /// moved since, the statement is done again from where it stands now.
    fn take_up_motion(&mut self) {
        let locked = self.state.machine_lock;
        if self.executor.course == RunState::Reset
            || locked
            || !self.arm.resume_interrupted(self.now, self.pace())
        {
            self.arm.drop_interrupted();
            self.executor.redo_motions();
        }
    }

    /// Automatic operation has come to a stand.
    pub(crate) fn stop_program(&mut self, course: RunState, by: StopCause) {
        self.executor.course = course;
        self.executor.paused = false;
        if let Some(since) = self.state.running_since.take() {
            self.state.run_total += self.now.since(since);
        }
        self.report_status();
        if by == StopCause::Other {
            self.announce_stop();
        }
    }

    /// An SP waits on every port whose host is to be told of stops (D7).
    fn announce_stop(&mut self) {
        let (now, rule) = (self.now, self.config.options.unsolicited_sp);
        for session in self.sessions.values_mut() {
            let told = match rule {
                UnsolicitedSp::Auto => !session.never_told_of_stops,
                UnsolicitedSp::Always => true,
                UnsolicitedSp::Never => false,
            };
            if told && session.peer.is_some() {
                session.waiting_sp = true;
                session.sp_after = now
                    + self
                        .variation
                        .as_mut()
                        .map_or(Duration::ZERO, Variation::sp_delay);
                session.sp_by = now + MAX_SP_DELAY;
            }
        }
    }

    /// A text has come that only hosts send which take an SP for their next answer: under `auto` this one gets none.
    pub(crate) fn disable_unsolicited_sp(&mut self, port: Port) {
        let auto = self.config.options.unsolicited_sp == UnsolicitedSp::Auto;
        if let Some(session) = self.sessions.get_mut(&port) {
            session.never_told_of_stops = true;
            session.waiting_sp &= !auto;
        }
    }

    /// The program is to stop when the present step has ended.
    /// A motion guided by hand is no step and ends at once.
    pub(crate) fn stop_after_step(&mut self, by: StopCause) {
        self.stop_jog();
        if self.executor.course == (RunState::Running { stop: None }) {
            self.executor.course = RunState::Running { stop: Some(by) };
        }
    }

    /// Everything stops at once: the motion is given up, the step will be done again (CMD-EC-04, CMD-BR-02).
    /// An INPUT that waits is cancelled all the same (INP-09).
    pub(crate) fn interrupt(&mut self, by: StopCause) {
        self.jogging = None;
        self.executor.run_shown_until = None;
        if !self.executor.program_runs() {
            self.arm.stop(self.now);
            self.end_direct();
            return;
        }
        self.arm.interrupt(self.now);
        let mut course = RunState::Retry;
        for id in self.executor.order() {
            let Some(mut task) = self.executor.take_task(id) else {
                continue;
            };
            let cancelled = self.abort_step(&mut task);
            if cancelled && id == MAIN_TASK {
                course = RunState::Continue;
            }
            self.executor.put_task(task);
        }
        self.stop_program(course, by);
    }

    /// The statement under way will be done again, but for an INPUT, which is over: true. One that waits for its
    /// motion keeps waiting.
    fn abort_step(&mut self, task: &mut Task) -> bool {
        if let Some(mut handler) = task.handler.take() {
            self.abort_step(&mut handler);
            task.handler = Some(handler);
        }
        let reading = self.end_reading(task);
        if !(task.doing.is_motion() && self.arm.is_interrupted()) {
            task.doing = TaskState::Ready;
        }
        reading
    }

    /// An INPUT that waits is over with the values that came (INP-09, INP-10); false if none waits.
    pub(crate) fn end_reading(&mut self, task: &mut Task) -> bool {
        let TaskState::Reading { got, .. } = &task.doing else {
            return false;
        };
        let answer = Answer::Cancelled(got.clone());
        // A value the variable cannot hold is lost with the INPUT.
        if task.machine.answer(self.executor.memory_mut(), answer).is_err() {
            task.machine.skip();
        }
        task.doing = TaskState::Ready;
        true
    }

    /// Servo power goes off, and with it everything that moves.
    pub(crate) fn servo_off(&mut self, by: StopCause) {
        self.interrupt(by);
        self.state.servo_due = None;
        if core::mem::take(&mut self.state.servo) {
            self.event(Event::Servo(false));
        }
    }

    /// Raises an alarm and lets its level act (D6).
    pub(crate) fn raise(&mut self, code: AlarmCode, detail: String) {
        let at = self.calendar();
        let alarm = Alarm { code, detail, at };
        self.event(Event::Alarm {
            number: code.number(),
            text: alarm.message(),
        });
        self.alarms.raise(alarm);
        match code.level {
            AlarmLevel::L8 => self.servo_off(StopCause::Other),
            AlarmLevel::L4 => self.interrupt(StopCause::Other),
            AlarmLevel::L2 => self.stop_after_step(StopCause::Other),
            AlarmLevel::L1 => {}
        }
    }

    /// Ends all alarms but those whose cause persists.
    pub(crate) fn reset_alarms(&mut self) {
        let PanelState {
            emergency_stop,
            safety_open,
            ..
        } = self.state;
        let persists = |code: &AlarmCode| {
            emergency_stop && *code == alarm::EMERGENCY_STOP || safety_open && *code == alarm::SAFETY_STOP
        };
        if self.alarms.reset(persists) {
            self.event(Event::AlarmsReset);
        }
    }

    /// The emergency stop button.
    pub(crate) fn emergency_stop(&mut self, pressed: bool) {
        let newly = pressed && !self.state.emergency_stop && self.state.powered;
        self.state.emergency_stop = pressed;
        if newly {
            self.raise(alarm::EMERGENCY_STOP, String::new());
        }
    }

    /// The safety switch.
    pub(crate) fn safety_switch(&mut self, open: bool) {
        let newly = open && !self.state.safety_open && self.state.powered;
        self.state.safety_open = open;
        if newly {
            self.raise(alarm::SAFETY_STOP, String::new());
        }
    }

    /// Tells the log where the program stands.
    pub(crate) fn report_status(&mut self) {
        let status = match self.executor.shown_status() {
            ExecutionStatus::Reset => "stop (reset)",
            ExecutionStatus::Running => "running",
            ExecutionStatus::Retry => "stop (retry)",
            ExecutionStatus::Continue => "stop (continue)",
        };
        self.event(Event::Status {
            status,
            line: self.executor.line(),
        });
    }

    /// Sends the SP texts that no open exchange holds back any more (CMD-SP-07).
    pub(crate) fn release_sp(&mut self) {
        let now = self.now;
        for port in [Port::Host, Port::Ip0] {
            let taken = self.line_is_taken(port);
            let Some(session) = self.sessions.get(&port) else {
                continue;
            };
            if taken {
                continue;
            }
            if session.sp_due().is_some_and(|due| due <= now) {
                self.send_sp(port);
            }
        }
    }

    /// The same between two texts of a host that sends without waiting for answers.
    pub(crate) fn release_overdue_sp(&mut self, port: Port) {
        let now = self.now;
        if self
            .sessions
            .get(&port)
            .is_some_and(|session| session.sp_overdue(now))
        {
            self.send_sp(port);
        }
    }

    fn send_sp(&mut self, port: Port) {
        if let Some(session) = self.sessions.get_mut(&port) {
            session.waiting_sp = false;
        }
        self.send_unsolicited(port, &Reply::Sp.encode());
    }
}
