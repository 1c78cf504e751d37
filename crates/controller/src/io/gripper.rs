//! Hands, pulses, and the statements that change a motion under way: BREAK, PAUSE, RESUME.

use crate::alarm;
use crate::executor::requests::no_output;
use crate::executor::step::Step;
use crate::executor::{Task, TaskState};
use crate::io::line_names::dout;
use crate::io::signals::Signals;
use crate::limits::LONGEST_DELAY;
use crate::robot::Robot;
use crate::time::duration_from_seconds;

/// Hand n opens by the first output of its pair and closes by the second (assumed; scol.md 3.3 leaves it open).
pub(crate) const HANDS: [(u16, u16); 2] = [(dout::OPEN1, dout::CLOSE1), (dout::OPEN2, dout::CLOSE2)];

impl Robot {
    /// OPEN, CLOSE: when the arm rests, or at once.
    pub(crate) fn work_hand(&mut self, task: &mut Task, hand: u8, open: bool, at_once: bool) -> Step {
        if !at_once && self.arm.is_moving() {
            task.enter(TaskState::Resting);
            return Step::Blocked;
        }
        let index = usize::from(hand).saturating_sub(1);
        if let Some(&(opens, closes)) = HANDS.get(index) {
            self.signals.set_output(opens, open);
            self.signals.set_output(closes, !open);
        }
        self.executor.done(task)
    }

    /// PULOUT: the output goes on now and off later; the program does not wait.
    pub(crate) fn pulse_output(&mut self, task: &mut Task, output: u16, seconds: f64) -> Step {
        if !Signals::is_user_output(output) {
            return task.give_up(alarm::OUT_OF_RANGE, no_output(output));
        }
        let pulse = duration_from_seconds(seconds, LONGEST_DELAY);
        self.signals.pulse_output(output, self.now + pulse);
        self.executor.done(task)
    }

    /// BREAK: the motion under way is given up. Whoever waits for it goes on when the arm rests, and so does this.
    pub(crate) fn break_motion(&mut self, task: &mut Task) -> Step {
        self.arm.stop(self.now);
        self.end_pause();
        let step = self.executor.done(task);
        if self.arm.is_moving() && matches!(step, Step::Done { .. }) {
            task.enter(TaskState::Resting);
        }
        step
    }

    /// PAUSE: the motion slows along its path; one that has not begun does not begin.
    pub(crate) fn pause_motion(&mut self, task: &mut Task) -> Step {
        if self.executor.pause() {
            self.arm.hold(self.now);
        }
        self.executor.done(task)
    }

    /// RESUME.
    pub(crate) fn resume_motion(&mut self, task: &mut Task) -> Step {
        self.end_pause();
        self.executor.done(task)
    }

    /// What PAUSE held goes on, unless feed hold holds it too.
    pub(crate) fn end_pause(&mut self) {
        if self.executor.end_pause() && !self.panel.state().feed_hold {
            self.arm.resume(self.now);
        }
    }

    /// Whether no motion may go on or begin.
    pub(crate) fn is_held(&self) -> bool {
        self.panel.state().feed_hold || self.executor.is_paused()
    }
}
