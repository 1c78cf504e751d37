//! Whether the arm can be where a motion leads, for the check of programs; and the arm placed there, for their tests.
//!
//! How it gets there is left to the planner, which also knows the posture that the motion begins in.

use super::{Arm, Frames, transform};
use crate::model::{ArmKind, Joints};
use crate::motion::{MotionError, Pose, Target, Transform, Unreachable, with_axis};
use scol_mini::Position;

impl Arm {
    /// Checks the place that a motion leads to: of a position in any posture that it leaves open, of an axis alone
    /// whatever the others do. A difference of 0 asks whether the arm has the axis.
    ///
    /// # Errors
    /// The reason for the posture next to the present one.
    pub(crate) fn reaches(&self, motion: &scol_mini::Motion) -> Result<(), MotionError> {
        let (model, near) = (&self.model, &self.rest);
        let frames = Frames::new(&motion.conditions);
        match self.target(motion, &frames, near) {
            Target::Pose(pose, config, _) => {
                self.posture_at(&pose, config, &transform(&frames.tool))?;
            }
            Target::Axis { axis, value } => return with_axis(model, near, axis, value).map(drop),
            Target::Joints(joints) => return Ok(model.check_limits(&joints)?),
        }
        Ok(())
    }

    /// Places the arm at rest with its tool point at these world coordinates, without a motion.
    ///
    /// # Errors
    /// The arm cannot be there; it stays where it is.
    pub(crate) fn place(&mut self, world: &Position, frames: &Frames) -> Result<(), Unreachable> {
        let pose = Pose::from_coords(self.kind(), world.coords);
        let joints = self.posture_at(&pose, world.config.digits, &transform(&frames.tool))?;
        (self.rest, self.interrupted, self.position_work) = (joints, None, None);
        Ok(())
    }

    /// The posture next to the present one in which the tool point has this pose, or any that the digits leave open.
    fn posture_at(&self, pose: &Pose, config: [u8; 5], tool: &Transform) -> Result<Joints, Unreachable> {
        let (model, near) = (&self.model, &self.rest);
        let flange = pose.transform().compose(&tool.inverse());
        let flange = Pose::from_transform(&flange, pose.uv);
        let nearest = model.inverse(&flange, config, near);
        if nearest.is_ok() {
            return nearest;
        }
        // Shoulder, elbow and wrist; an open turn of axes 4 and 6 takes whatever fits.
        let postures = match model.kind {
            ArmKind::SixAxis(_) => 3,
            ArmKind::Scara(_) => 1,
        };
        let mut others = (0..1_u8 << postures).filter_map(|bits| {
            let mut digits = config;
            for (place, digit) in digits.iter_mut().enumerate().take(postures) {
                if *digit == 0 {
                    *digit = 1 + (bits >> place & 1);
                }
            }
            model.inverse(&flange, digits, near).ok()
        });
        others.next().map_or(nearest, Ok)
    }
}
