//! Counters of the work of the axes, for the maintenance information (MN, S29).
//!
//! The counters are brought up to date whenever a motion changes or ends; reading them changes nothing. `maintenance`
//! turns them into the numbers of MN.

use super::Arm;
use super::load::LoadHistory;
use crate::model::Joints;
use crate::motion::Effort;
use crate::time::Time;
use core::time::Duration;

/// Time over which the present torque is averaged.
const TORQUE_SPAN: Duration = Duration::from_millis(1);

/// The highest number that is counted: more than any arm does in the time there is.
const MOST: f64 = 1e18;

/// Totals of the axes, and their load of late.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wear {
    /// Since the controller was made.
    pub total: Effort,
    /// The last time, for the load factors.
    pub loads: LoadHistory,
    /// Until when the motion under way is counted.
    until: Time,
}

impl Wear {
    fn add(&mut self, effort: &Effort, until: Time) {
        self.total.add(effort);
        // A snapshot may begin right at the bound.
        self.total = self.total.within(MOST);
        self.loads
            .add(self.until, until, effort.within(MOST).square, MOST);
        self.until = until;
    }

    /// Whether the numbers are possible; for a snapshot.
    pub(crate) fn is_valid(&self, now: Time) -> bool {
        let numbers = self.total.numbers().all(|number| (0.0..=MOST).contains(&number));
        numbers && self.loads.is_valid(now, MOST)
    }
}

impl Arm {
    /// Counters of the axes at `now`.
    pub fn wear(&self, now: Time) -> Wear {
        let mut wear = self.wear.clone();
        wear.add(&self.effort_between(self.wear.until, now), now);
        wear
    }

    /// Torque of each axis from `now` on, percent: the mean over [`TORQUE_SPAN`]. What was before may belong to another
    /// motion.
    pub fn torques(&self, now: Time) -> Joints {
        let effort = self.effort_between(now, now + TORQUE_SPAN);
        effort.mean(effort.torque)
    }

    /// Counts the work of the current motion until `now`. Call it before the motion changes.
    pub(super) fn add_wear_until(&mut self, until: Time) {
        let from = self.wear.until;
        let (memo, model) = (&mut self.memo, &self.model);
        let effort = match self.active.as_ref().filter(|active| !active.locked) {
            Some(active) => {
                let (from, to) = (from.since(active.start), until.since(active.start));
                memo.effort(model, &active.motion, active.settings.load_part, from, to)
            }
            None => Effort::default(),
        };
        self.wear.add(&effort, until);
    }

    /// Adds work of the axes to every counter.
    #[cfg(test)]
    pub(crate) fn age(&mut self, much: f64) {
        let numbers: Joints = [much; _];
        let effort = Effort {
            way: numbers,
            torque: numbers,
            square: numbers,
            peak: numbers,
            seconds: much,
        };
        let until = self.wear.until;
        self.wear.add(&effort, until);
    }

    fn effort_between(&self, from: Time, until: Time) -> Effort {
        let Some(active) = self.unlocked() else {
            return Effort::default();
        };
        let (from, to) = (from.since(active.start), until.since(active.start));
        let load = active.settings.load_part;
        active.motion.effort(&self.model, load, from, to)
    }

    /// The highest torque counts from now on (MN,5 and RM,5).
    pub(crate) fn clear_peak(&mut self, now: Time) {
        self.add_wear_until(now);
        self.wear.total.peak = Joints::default();
    }

    /// The load factor of this index counts from now on (RM,6 to RM,9).
    pub(crate) fn clear_load(&mut self, index: usize, now: Time) {
        self.add_wear_until(now);
        self.wear.loads.clear(index);
    }

    /// Power off: the arm rests where it is. Time before the power comes on counts as one without torque.
    pub fn power_off(&mut self, now: Time) {
        self.add_wear_until(now);
        let mut arm = Arm::with_posture(self.model.clone(), self.joints(now));
        arm.wear = self.wear.clone();
        arm.wear.loads = LoadHistory::default();
        *self = arm;
    }
}
