//! Everything that happens by itself: when it is due, and what serves it. Nothing else makes the controller ask to be
//! called.
//!
//! The moments are kept by whom they concern; this file only collects them, in the order in which they are served.

use crate::endpoint::Endpoints;
use crate::robot::Robot;
use crate::time::Time;

impl Endpoints {
    /// When something happens by itself.
    pub(crate) fn deadline(&self, robot: &Robot) -> Option<Time> {
        let state = robot.panel.state();
        let timers = [
            // A fault acts on the machine later.
            self.faults.deadline(),
            // A segment leaves late.
            self.send_queue.deadline(),
            // Characters have passed a serial line.
            self.line_deadline(robot),
            // A host owes the rest of a text, or an answer.
            self.host_deadline(),
            // No host has sent a text within the time of WD.
            state.watchdog.map(|watchdog| watchdog.deadline()),
            // The arm comes to rest.
            robot.arm.ends_at(),
            // The pulse of an output ends, or an input changes as scheduled.
            robot.signals.deadline(),
            // Servo power that was held back comes.
            state.servo_due,
            // The program, a task or the statement of DO goes on.
            robot.executor.deadline(&robot.arm, robot.now),
            // A host is told of a stop.
            self.sp_deadline(robot),
        ];
        timers.into_iter().flatten().min()
    }

    /// Finds the deadline anew after a change.
    pub(crate) fn find_due(&mut self, robot: &Robot) {
        self.due = self.deadline(robot);
    }

    /// Serves each timer that is due by `now` at its own time. True if the last was due at `now` itself: nothing more
    /// happens by itself then.
    pub(crate) fn advance_to(&mut self, robot: &mut Robot, now: Time) -> bool {
        let mut settled = false;
        while let Some(due) = self.due.filter(|&due| due <= now) {
            robot.now = robot.now.max(due);
            self.serve_ports(robot);
            self.settle(robot);
            settled = robot.now >= now;
            if robot.persistence.is_pending() {
                return settled;
            }
        }
        if !settled {
            robot.now = robot.now.max(now);
            self.receive_from_lines(robot);
            if robot.persistence.is_pending() {
                self.find_due(robot);
            }
        }
        settled
    }

    /// Served when their time comes, in this order. It shows on the wire: an action of a fault comes before a text that
    /// leaves late, characters come off a line before the limit of their host is looked at.
    fn serve_ports(&mut self, robot: &mut Robot) {
        self.run_scheduled(robot);
        self.send_due(robot);
        self.serve_lines(robot);
        self.expire_sessions(robot);
        self.expire_watchdog(robot);
    }

    /// Runs the robot as far as it goes at this instant, in this order, then tells the hosts: after the ports, and after
    /// every input too, which can make all of it due at once.
    pub(crate) fn settle(&mut self, robot: &mut Robot) {
        // While a change of a file is awaited the robot stands still at this instant.
        if !robot.persistence.is_pending() {
            robot.arm.finish_due(robot.now);
            robot.change_due_lines();
            robot.end_servo_interval();
            robot.run(self);
        }
        self.tell_of_stops(robot);
        self.find_due(robot);
    }
}
