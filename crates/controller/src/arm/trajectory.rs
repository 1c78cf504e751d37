//! Facts about the current motion that a program can read besides its percentage: times (MOTIONT, REMAINT) and
//! destination (DEST).
//!
//! `crate::executor::scol_inputs` passes the answers to the program.

use super::{Arm, Frames};
use crate::prelude::*;
use crate::time::Time;
use core::time::Duration;
use scol_mini::Position;

/// Points of the path of a motion, both ends among them.
pub const PATH_POINTS: u16 = 64;

impl Arm {
    /// MOTIONT: how long the motion has gone on, a hold counted; of motions that overlap, the one begun last; zero when none is under way.
    pub fn elapsed(&self, now: Time) -> Duration {
        self.active.as_ref().map_or(Duration::ZERO, |active| {
            active.motion.elapsed_at(now.since(active.start))
        })
    }

    /// REMAINT: remaining time of the motion; zero without a motion, and while it is held.
    pub fn remaining(&self, now: Time) -> Duration {
        self.ends_at().map_or(Duration::ZERO, |end| end.since(now))
    }

    /// When the motion put after another begins; `None` when there is none, or it is held or given up before.
    pub fn last_begins_at(&self) -> Option<Time> {
        let active = self.active.as_ref()?;
        Some(active.start + active.motion.last_begins()?)
    }

    /// DEST: where the motion leads in the frames given, also while it is held; the present position when none is under way.
    pub fn destination(&self, now: Time, frames: &Frames) -> Position {
        match self.unlocked() {
            Some(active) => self.position_of(&active.motion.target(), frames),
            None => self.here(now, frames),
        }
    }

    /// Tool points in world coordinates along the path of the motion under way or else of the last one, in mm; empty
    /// before the first.
    pub fn path(&self, frames: &Frames) -> Vec<[f64; 3]> {
        let active = self.active.as_ref().map(|active| (&active.motion, 1.0));
        let ended = self.memo.ended.as_ref().map(|(motion, part)| (motion, *part));
        let Some((motion, done)) = active.or(ended) else {
            return Vec::new();
        };
        let point = |step: u16| {
            let part = done * f64::from(step) / f64::from(PATH_POINTS - 1);
            let joints = motion.joints_along(part);
            self.pose_in(joints, frames, &frames.work).world.xyz
        };
        (0..PATH_POINTS).map(point).collect()
    }
}
