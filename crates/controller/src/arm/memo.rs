//! Plans and efforts that have been calculated before.
//!
//! A cell in production repeats the same few motions for hours, and planning a line costs more than everything else of
//! its statement. [`Memo`] returns the result for exactly the same numbers, bit by bit, so no result depends on it. It
//! is not part of the state: copies and snapshots begin without it.

use crate::model::{ArmModel, Joints};
use crate::motion::{Effort, Limits, Motion, MotionError, Pose, Route, Target, Transform, plan};
use crate::prelude::*;
use alloc::collections::BTreeMap;
use core::fmt;
use core::time::Duration;

/// Most motions that are kept, enough for a pallet of 200 places: usually 3 MB, with the longest lines 17 MB.
const CAPACITY: usize = 1_024;

/// Everything a plan depends on besides the model, which never changes. Bits and not numbers, because 0 and -0 are
/// equal and lead to different results.
type Key = Vec<u64>;

/// Motions planned before, of one arm model.
#[derive(Default)]
pub(super) struct Memo {
    /// Each with the effort of the whole motion with the load of the key, once it was asked for.
    plans: BTreeMap<Key, (Motion, Option<Effort>)>,
    /// The motion planned last.
    last: Key,
    /// The motion that ended last and the part of its path that was done, for a picture of it.
    pub ended: Option<(Motion, f64)>,
}

impl Memo {
    /// Plans a motion as [`plan`] does. `load` is the part of their acceleration that the load leaves the axes.
    pub fn plan(
        &mut self,
        model: &ArmModel,
        from: &Joints,
        target: &Target,
        tool: &Transform,
        limits: &Limits,
        load: f64,
    ) -> Result<Motion, MotionError> {
        let key = key(from, target, tool, limits, load);
        let motion = match self.plans.get(&key) {
            Some((known, _)) => known.clone(),
            None => {
                let motion = plan(model, from, target, tool, limits)?;
                if self.plans.len() >= CAPACITY {
                    self.plans.clear();
                }
                self.plans.insert(key.clone(), (motion.clone(), None));
                motion
            }
        };
        self.last = key;
        Ok(motion)
    }

    /// Effort of the axes between two times after the start of a motion: [`Motion::effort`].
    pub fn effort(
        &mut self,
        model: &ArmModel,
        motion: &Motion,
        load: f64,
        from: Duration,
        to: Duration,
    ) -> Effort {
        let calculate = || motion.effort(model, load, from, to);
        let is_whole = from.is_zero() && to == motion.duration();
        // A motion that was held, slowed or blended is another one than the one that was planned.
        let known = is_whole && self.last.last() == Some(&load.to_bits());
        let known = known.then(|| self.plans.get_mut(&self.last)).flatten();
        match known.filter(|(known, _)| known == motion) {
            Some((_, effort)) => *effort.get_or_insert_with(calculate),
            None => calculate(),
        }
    }
}

impl Clone for Memo {
    /// A copy begins empty, so that copying a controller stays cheap.
    fn clone(&self) -> Memo {
        Memo::default()
    }
}

impl PartialEq for Memo {
    /// It changes no result.
    fn eq(&self, _other: &Memo) -> bool {
        true
    }
}

impl fmt::Debug for Memo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Memo")
    }
}

/// The load comes last.
fn key(from: &Joints, target: &Target, tool: &Transform, limits: &Limits, load: f64) -> Key {
    let mut key = Key::with_capacity(64);
    let mut add = |numbers: &[f64]| key.extend(numbers.iter().map(|number| number.to_bits()));
    add(from);
    // In the order of a six-axis arm a pose has all its numbers.
    let numbers = |pose: &Pose| pose.coords(scol_mini::Arm::SixAxis);
    // The kind first, which says how many numbers follow.
    match target {
        Target::Pose(end, config, route) => {
            match route {
                Route::Joint => add(&[0.0]),
                Route::Line => add(&[1.0]),
                Route::Arc(via) => {
                    add(&[2.0]);
                    add(&numbers(via));
                }
                Route::Arch(gate) => add(&[3.0, gate.retreat, gate.single_axis_1, gate.single_axis_2]),
            }
            add(&numbers(end));
            add(&config.map(f64::from));
        }
        Target::Axis { axis, value } => add(&[4.0, *axis as f64, *value]),
        Target::Joints(to) => {
            add(&[5.0]);
            add(to);
        }
    }
    add(tool.rotation.as_flattened());
    add(&tool.origin);
    let Limits {
        speed,
        override_part,
        accel,
        decel,
        tool_speed_cap,
        torque,
    } = limits;
    // No cap is one that nothing exceeds.
    let cap = tool_speed_cap.unwrap_or(f64::INFINITY);
    add(&[*speed, *override_part, *accel, *decel, cap]);
    add(torque);
    add(&[load]);
    key
}

#[cfg(test)]
mod tests {
    use super::{CAPACITY, Memo};
    use crate::model::ArmModel;
    use crate::motion::{Limits, NO_LOAD, Route, Target, Transform, plan};
    use core::time::Duration;

    fn line(model: &ArmModel, way: f64) -> Target {
        let (mut end, _) = model.forward(&model.ready);
        end.xyz[2] -= way;
        Target::Pose(end, [0; 5], Route::Line)
    }

    #[test]
    fn what_is_known_is_what_would_be_calculated() {
        let (model, tool) = (ArmModel::tv800(), Transform::IDENTITY);
        let mut memo = Memo::default();
        let slow = Limits {
            speed: 0.2,
            ..Limits::FULL
        };
        for _ in 0..2 {
            for (way, limits, load) in [
                (50.0, Limits::FULL, NO_LOAD),
                (50.0, slow, NO_LOAD),
                (50.0, slow, 0.5),
                (60.0, slow, 0.5),
            ] {
                let target = line(&model, way);
                let planned = memo.plan(&model, &model.ready, &target, &tool, &limits, load);
                let expected = plan(&model, &model.ready, &target, &tool, &limits).unwrap();
                let motion = planned.unwrap();
                assert_eq!(motion, expected);
                let whole = (Duration::ZERO, motion.duration());
                let half = (Duration::ZERO, motion.duration() / 2);
                for (from, to) in [whole, half] {
                    let effort = memo.effort(&model, &motion, load, from, to);
                    assert_eq!(effort, expected.effort(&model, load, from, to));
                }
                // Of another load, and of another motion.
                let effort = memo.effort(&model, &motion, 0.25, whole.0, whole.1);
                assert_eq!(effort, expected.effort(&model, 0.25, whole.0, whole.1));
                let mut held = motion.clone();
                held.hold(half.1);
                let effort = memo.effort(&model, &held, load, Duration::ZERO, held.duration());
                assert_eq!(effort, held.effort(&model, load, Duration::ZERO, held.duration()));
            }
        }
        assert_eq!(memo.plans.len(), 4);
    }

    #[test]
    fn no_more_than_its_capacity_is_kept_and_no_refusal() {
        let (model, tool) = (ArmModel::tv800(), Transform::IDENTITY);
        let mut memo = Memo::default();
        for place in 0..2 * CAPACITY + 1 {
            let value = place as f64 / 100.0;
            let target = Target::Axis { axis: 0, value };
            memo.plan(&model, &model.ready, &target, &tool, &Limits::FULL, NO_LOAD)
                .unwrap();
            assert!(memo.plans.len() <= CAPACITY);
        }
        let beyond = Target::Axis { axis: 0, value: 1e6 };
        let known = memo.plans.len();
        memo.plan(&model, &model.ready, &beyond, &tool, &Limits::FULL, NO_LOAD)
            .unwrap_err();
        assert_eq!(memo.plans.len(), known);
        assert_eq!(memo.clone().plans.len(), 0);
    }
}
