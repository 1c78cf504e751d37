//! Stop (retry) in the arm: a motion that was interrupted goes on, on its own path, when the program does. Planned anew
//! from where it stopped it would be another one: MOVEI would turn by its whole difference again, MOVEC take the long
//! way round through a point behind it, MOVEJ rise once more. Which statements wait for it is the execution's.

use super::{Arm, Pace};
use crate::time::Time;

impl Arm {
    /// The motion is interrupted: the arm slows at full deceleration and rests, and [`Arm::take_up`] can let it go on.
    /// One that BREAK has given up already, and one of a locked machine, cannot.
    pub fn interrupt(&mut self, now: Time) {
        self.interrupted = self.active.clone().filter(|active| {
            let over = active.start + active.motion.duration() <= now && !active.motion.is_held();
            !active.locked && !active.motion.is_stopped() && !over
        });
        self.stop(now);
        if let Some(interrupted) = &mut self.interrupted {
            interrupted.motion.stop(now.since(interrupted.start));
        }
    }

    /// Whether a motion was interrupted that can go on.
    #[must_use]
    pub fn is_interrupted(&self) -> bool {
        self.interrupted.is_some()
    }

    /// The interrupted motion goes on from where it stopped, or still slows; true if it does. False when none was
    /// interrupted, or the arm has been moved since: nothing has changed then.
    pub fn take_up(&mut self, now: Time, pace: Pace) -> bool {
        self.settle(now);
        let Some(mut interrupted) = self.interrupted.take() else {
            return false;
        };
        self.account(now);
        let limits = interrupted.asked.limits(pace);
        let at = now.since(interrupted.start);
        interrupted.motion.take_up(at, &limits);
        self.active = Some(interrupted);
        true
    }

    /// The interrupted motion will not go on: the program stands elsewhere, or the arm does.
    pub fn forget_interrupted(&mut self) {
        self.interrupted = None;
    }
}
