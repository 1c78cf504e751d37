//! Everything that happens by itself: when it is due, and what serves it. Nothing else makes the controller ask to be
//! called.
//!
//! The moments are kept by whom they concern; this table only collects them.

use crate::endpoint::Endpoints;
use crate::robot::Robot;
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
    /// The program, a task or the statement of DO goes on.
    Program,
    /// A host is told of a stop.
    UnsolicitedSp,
}

/// Served when their time comes, in this order. It shows on the wire: an action of a fault comes before a text that
/// leaves late, characters come off a line before the limit of their host is looked at.
const AT_PORTS: [Timer; 5] = [
    Timer::FaultAction,
    Timer::SendQueue,
    Timer::SerialLines,
    Timer::HostTimeout,
    Timer::Watchdog,
];

/// Served after those, in this order, and after every input too, which can make them due at once.
const BEHIND_PORTS: [Timer; 5] = [
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
            Timer::SerialLines => endpoints.line_deadline(robot),
            Timer::HostTimeout => endpoints.host_deadline(),
            Timer::Watchdog => robot.panel.state().watchdog.map(|watchdog| watchdog.deadline()),
            Timer::Motion => robot.arm.ends_at(),
            Timer::Lines => robot.signals.deadline(),
            Timer::Servo => robot.panel.state().servo_due,
            Timer::Program => robot.executor.deadline(&robot.arm, robot.now),
            Timer::UnsolicitedSp => endpoints.sp_deadline(robot),
        }
    }

    fn serve(self, endpoints: &mut Endpoints, robot: &mut Robot) {
        match self {
            // A change of a file is awaited: the robot stands still at this instant.
            Timer::Motion | Timer::Lines | Timer::Servo | Timer::Program
                if robot.persistence.is_pending() => {}
            Timer::FaultAction => endpoints.run_scheduled(robot),
            Timer::SendQueue => endpoints.send_due(robot),
            Timer::SerialLines => endpoints.serve_lines(robot),
            Timer::HostTimeout => endpoints.expire_sessions(robot),
            Timer::Watchdog => endpoints.expire_watchdog(robot),
            Timer::Motion => robot.arm.finish_due(robot.now),
            Timer::Lines => robot.change_due_lines(),
            Timer::Servo => robot.end_servo_interval(),
            Timer::Program => robot.run(endpoints),
            Timer::UnsolicitedSp => endpoints.tell_of_stops(robot),
        }
    }
}

impl Endpoints {
    /// When something happens by itself.
    pub(crate) fn deadline(&self, robot: &Robot) -> Option<Time> {
        let timers = AT_PORTS.into_iter().chain(BEHIND_PORTS);
        timers.filter_map(|timer| timer.due(self, robot)).min()
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
            for timer in AT_PORTS {
                timer.serve(self, robot);
            }
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

    /// Runs the robot as far as it goes at this instant, then tells the hosts.
    pub(crate) fn settle(&mut self, robot: &mut Robot) {
        for timer in BEHIND_PORTS {
            timer.serve(self, robot);
        }
        self.find_due(robot);
    }
}
