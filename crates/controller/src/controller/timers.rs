//! Everything that happens by itself: when it is due, and what serves it. Nothing else makes the controller ask to be
//! called.
//!
//! The moments are kept by whom they concern; this table only collects them.

use crate::alarm;
use crate::controller::Controller;
use crate::endpoint::Endpoints;
use crate::finding::rules;
use crate::persistence::Then;
use crate::robot::scheduler::RunEffect;
use crate::robot::{Robot, RunNotice};
use crate::time::Time;

/// Something that happens by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Timer {
    /// A fault acts on the machine later.
    FaultAction,
    /// A segment leaves late.
    SendQueue,
    /// Characters have passed a serial line.
    SerialLines,
    /// A host owes the rest of a text, or an answer.
    HostTimeout,
    /// No host has sent a text within the time of WD.
    Watchdog,
    /// The arm comes to rest.
    Motion,
    /// The pulse of an output ends, or an input changes as scheduled.
    Lines,
    /// Servo power that was held back comes.
    Servo,
    /// The program, a task or the statement of DO continues.
    Program,
    /// A host is told of a stop.
    UnsolicitedSp,
}

/// Served when their time comes, in this order. Of two that are due at one moment the first can change the second: an action
/// of a fault comes before a text that leaves late, the last character of a text saves it from the limit of its host, and
/// any text that has come feeds the watchdog.
const AT_PORTS: [Timer; 5] = [
    Timer::FaultAction,
    Timer::SendQueue,
    Timer::SerialLines,
    Timer::HostTimeout,
    Timer::Watchdog,
];

/// Served after those, in this order, and after every input too, which can make them due at once. An arm that arrives and an
/// input that changes come before the program, which sees both at this instant (`programs.rs` of the suites). SP comes last:
/// the program that ends now has its SP at this instant, after its last PRINT.
const OF_ROBOT: [Timer; 5] = [
    Timer::Motion,
    Timer::Lines,
    Timer::Servo,
    Timer::Program,
    Timer::UnsolicitedSp,
];

impl Timer {
    fn due(self, endpoints: &Endpoints, robot: &Robot) -> Option<Time> {
        match self {
            Timer::FaultAction => endpoints.faults.deadline(),
            Timer::SendQueue => endpoints.send_queue.deadline(),
            Timer::SerialLines => endpoints.line_deadline(),
            Timer::HostTimeout => endpoints.host_deadline(),
            Timer::Watchdog => robot.panel.state().watchdog.map(|watchdog| watchdog.deadline()),
            Timer::Motion => robot.arm.ends_at(),
            Timer::Lines => robot.signals.deadline(),
            Timer::Servo => robot.panel.state().servo_due,
            Timer::Program => robot.executor.deadline(&robot.arm, robot.context.now),
            Timer::UnsolicitedSp => endpoints.sp_deadline(&robot.context),
        }
    }

    fn serve(self, controller: &mut Controller) {
        let Controller { robot, endpoints, .. } = controller;
        match self {
            // A change of a file is awaited: the robot stands still at this instant.
            Timer::Motion | Timer::Lines | Timer::Servo | Timer::Program
                if robot.persistence.is_waiting() => {}
            Timer::FaultAction => controller.perform_scheduled(),
            Timer::SendQueue => endpoints.send_due(&mut robot.context),
            Timer::SerialLines => {
                controller.receive_from_lines();
                controller
                    .endpoints
                    .send_from_lines(&mut controller.robot.context);
            }
            Timer::HostTimeout => controller.expire_sessions(),
            Timer::Watchdog => controller.expire_watchdog(),
            Timer::Motion => robot.arm.finish_due(robot.context.now),
            Timer::Lines => robot.change_due_lines(),
            Timer::Servo => robot.end_servo_interval(),
            Timer::Program => controller.run_program(),
            Timer::UnsolicitedSp => controller.tell_of_stops(),
        }
    }
}

impl Controller {
    /// Runs the robot as far as it goes at this instant, and serves the requests of its statements.
    fn run_program(&mut self) {
        // A RESTORE that waits for its file lets nothing go on at this instant, outputs and counters included.
        while !self.robot.persistence.is_waiting()
            && let Some(effect) = self.robot.run(&self.endpoints)
        {
            match effect {
                // The bytes go before the program does: the next PRINT waits for the room that they leave on a serial
                // line.
                RunEffect::Print {
                    port,
                    bytes,
                    by_program,
                } => {
                    let sent = bytes.clone();
                    self.endpoints.send(&mut self.robot.context, port, bytes, &sent);
                    self.robot.printed(by_program);
                }
                RunEffect::Restore { change, direct } => {
                    // A file that is not stored is an alarm of the program, and no result of anybody's.
                    let _ = self.make(*change, Then::Restored { direct });
                }
            }
        }
    }

    /// When something happens by itself.
    pub(crate) fn deadline(&self) -> Option<Time> {
        if self.is_halted() {
            return None;
        }
        let timers = AT_PORTS.into_iter().chain(OF_ROBOT);
        timers
            .filter_map(|timer| timer.due(&self.endpoints, &self.robot))
            .min()
    }

    /// Finds the deadline again after a change.
    pub(crate) fn find_due(&mut self) {
        self.due = self.deadline();
    }

    /// Serves each timer that is due by `now` at its own time. True if the last was due at `now` itself: nothing more
    /// happens by itself then.
    pub(super) fn advance_to(&mut self, now: Time) -> bool {
        let mut settled = false;
        while let Some(due) = self.due.filter(|&due| due <= now) {
            self.robot.context.now = self.robot.context.now.max(due);
            for timer in AT_PORTS {
                timer.serve(self);
            }
            self.settle();
            if self.is_halted() {
                return true;
            }
            settled = self.robot.context.now >= now;
            // Time stands still until the answer: the timers that are left are served afterwards, at their own times.
            if self.robot.persistence.is_waiting() {
                return settled;
            }
        }
        if !settled {
            self.robot.context.now = self.robot.context.now.max(now);
            // Characters have no timer each (`UART_FIFO`): those that have passed by now come before the input.
            self.receive_from_lines();
            if self.robot.persistence.is_waiting() {
                self.find_due();
            }
        }
        settled
    }

    /// Runs the robot as far as it goes at this instant, then tells the hosts.
    pub(super) fn settle(&mut self) {
        for timer in OF_ROBOT {
            timer.serve(self);
        }
        if !self.robot.context.fault_effects.is_empty() {
            let state = self.robot.machine_state();
            let context = &mut self.robot.context;
            context.fault_effects.end_actions(context.now, state);
        }
        self.find_due();
    }

    /// Tells the hosts of stops that they did not ask for.
    fn tell_of_stops(&mut self) {
        // A program that an inspection has halted has not stopped.
        if self.is_halted() {
            return;
        }
        self.take_notices();
        // While a file is stored its download is no open exchange any more, and its OK has not left: SP would come
        // between (`no_sp_leaves_while_a_file_is_being_stored`).
        if self.robot.panel.state().powered && !self.robot.persistence.is_waiting() {
            self.endpoints.release_sp(&mut self.robot.context);
        }
    }

    /// Passes on to the ports that the program has started or stopped.
    pub(super) fn take_notices(&mut self) {
        for notice in core::mem::take(&mut self.robot.notices) {
            match notice {
                RunNotice::Stopped => self.endpoints.announce_stop(&self.robot.context),
                RunNotice::Started => {
                    self.robot.context.fault_effects.program_started();
                    self.endpoints.forget_stops();
                }
            }
        }
    }

    /// Raises the alarm of WD, once, if its time has expired.
    fn expire_watchdog(&mut self) {
        let robot = &mut self.robot;
        if let Some(watchdog) = robot.panel.take_late_watchdog(robot.context.now) {
            self.endpoints
                .report_late_watchdog(&mut robot.context, watchdog.timeout);
            robot.blame_alarm(&rules::WATCHDOG_LATE, None);
            let millis = watchdog.timeout.as_millis();
            let detail = format!("no text of a host within {millis} ms");
            robot.raise(alarm::host_timeout(watchdog.level), detail);
        }
    }
}
