//! Stop (retry): an interrupted motion continues on its own path when the program does.
//!
//! A motion planned again from the stop would be another one: MOVEI would turn by its whole difference again, MOVEC
//! take the long way round through a point that it has passed, MOVEJ rise once more. The executor decides which
//! statements wait.

use super::{Arm, SpeedLimits};
use crate::time::Time;

impl Arm {
    /// Interrupts the motion: the arm slows at full deceleration and rests, and [`Arm::resume_interrupted`] can
    /// continue it. One that BREAK has given up already, and one of a locked machine, cannot.
    pub fn interrupt(&mut self, now: Time) {
        // Asked before `stop`: afterwards every motion is given up, and one that was held or had no speed yet ends now
        // too.
        let over = self.ends_at().is_some_and(|end| end <= now);
        let goes_on = self.unlocked().is_some_and(|active| !active.motion.is_stopped());
        self.stop(now);
        self.interrupted = self.active.clone().filter(|_| goes_on && !over);
    }

    /// Whether an interrupted motion can continue.
    pub fn is_interrupted(&self) -> bool {
        self.interrupted.is_some()
    }

    /// Continues the interrupted motion from where it stopped, or still slows; true if it does. False when none was
    /// interrupted, or the arm has been moved since: nothing has changed then.
    pub fn resume_interrupted(&mut self, now: Time, pace: SpeedLimits) -> bool {
        // If the arm rests by now, `active` is gone and its wear is counted. If it still slows, the copy below takes
        // its place, at the speed it has reached.
        self.finish_due(now);
        let Some(mut interrupted) = self.interrupted.take() else {
            return false;
        };
        self.add_wear_until(now);
        let limits = interrupted.settings.limits(pace);
        let at = now.since(interrupted.start);
        interrupted.motion.continue_from(at, &limits);
        self.active = Some(interrupted);
        true
    }

    /// Forgets the interrupted motion, because the program or the arm has moved on.
    pub fn drop_interrupted(&mut self) {
        self.interrupted = None;
    }
}
