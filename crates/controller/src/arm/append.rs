//! PASS: appends a motion to the one under way, so that the arm does not rest between them.
//!
//! `Motion::blend` calculates how two motions overlap. When a program may read ahead is decided by the executor.

use super::{ActiveMotion, Arm, NextFrames, SpeedLimits, destination_work, transform};
use crate::motion::MotionError;
use crate::time::Time;

impl Arm {
    /// Appends a motion to the current one, overlapping it by `pass` percent of the shorter ramp. Returns whether it
    /// was appended: the arm then passes through, and `ends_at` and `percent` are those of the two together and of the
    /// one begun last. False when the two cannot be blended (none under way, held, an arch, machine lock, out of an
    /// axis limit on the rounded corner): nothing has changed, and the motion has to be started when the arm rests.
    ///
    /// # Errors
    /// The target or the path cannot be reached; the motion under way continues as it was.
    pub fn append(
        &mut self,
        now: Time,
        motion: &scol_mini::Motion,
        pass: f64,
        pace: SpeedLimits,
    ) -> Result<bool, MotionError> {
        self.finish_due(now);
        let Some(active) = self.unlocked() else {
            return Ok(false);
        };
        let (start, end) = (active.start, active.motion.end());
        let planned = self.plan_motion(motion, start, &end, pace, false)?;
        let tool = transform(&motion.conditions.tool);
        let blend = |active: &ActiveMotion| {
            let at = now.since(start);
            active.motion.blend(&self.model, at, &planned.motion, pass, &tool)
        };
        let Some(blended) = self.active.as_deref().and_then(blend) else {
            return Ok(false);
        };
        self.add_wear_until(now);
        self.take_next(now);
        if let Some(active) = &mut self.active {
            active.motion = blended;
            active.settings = planned.settings;
            active.next = Some(NextFrames {
                frames: planned.frames,
                work: destination_work(&motion.path),
            });
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::{Arm, SpeedLimits};
    use crate::model::ArmModel;
    use crate::time::Time;
    use core::time::Duration;
    use scol_mini::{Conditions, Motion, Path};

    const PACE: SpeedLimits = SpeedLimits {
        override_percent: 100,
        tool_speed_cap: None,
    };

    fn turn(value: f64) -> Motion {
        Motion {
            path: Path::Axis { axis: 1, value },
            conditions: Conditions::default(),
            over_full: None,
            own_frames: false,
        }
    }

    fn at(millis: u64) -> Time {
        Time::default() + Duration::from_millis(millis)
    }

    #[test]
    fn an_appended_motion_follows_without_rest() {
        let mut arm = Arm::new(ArmModel::tv800());
        assert_eq!(arm.append(at(0), &turn(60.0), 100.0, PACE), Ok(false));
        arm.start(at(0), &turn(60.0), PACE, false).unwrap();
        assert_eq!(arm.append(at(100), &turn(120.0), 100.0, PACE), Ok(true));
        assert_eq!(arm.ends_at(), Some(at(750)));
        assert!((arm.joints(at(400))[0] - 66.0).abs() < 1e-3);
        // Half the override for what is left, then the end.
        arm.set_speed_limits(
            at(400),
            SpeedLimits {
                override_percent: 50,
                ..PACE
            },
        );
        assert!(arm.ends_at().is_some_and(|end| end > at(900)));
        assert!(arm.is_moving());
        arm.finish_due(at(2_000));
        assert!(!arm.is_moving());
        assert!((arm.joints(at(2_000))[0] - 120.0).abs() < 1e-9);
    }

    #[test]
    fn what_cannot_be_appended_changes_nothing() {
        let mut arm = Arm::new(ArmModel::tv800());
        arm.start(at(0), &turn(60.0), PACE, false).unwrap();
        let before = arm.clone();
        assert!(arm.append(at(100), &turn(500.0), 100.0, PACE).is_err());
        assert_eq!(arm.append(at(100), &turn(120.0), 0.0, PACE), Ok(false));
        assert_eq!(arm, before);
    }
}
