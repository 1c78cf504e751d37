//! Whether the arm can be where a motion leads, for the check of programs.
//!
//! How it gets there is left to the planner, which also knows the posture that the motion begins in.

use super::{Arm, Frames, transform};
use crate::model::ArmKind;
use crate::motion::{MotionError, Pose, Target, with_axis};

impl Arm {
    /// Checks the place that a motion leads to: of a position in any posture that it leaves open, of an axis alone
    /// whatever the others do. A difference of 0 asks whether the arm has the axis.
    ///
    /// # Errors
    /// The reason for the posture next to the present one.
    pub(crate) fn reaches(&self, motion: &scol_mini::Motion) -> Result<(), MotionError> {
        let (model, near) = (&self.model, &self.rest);
        let frames = Frames::new(&motion.conditions);
        let tool = transform(&frames.tool);
        let (pose, config) = match self.target(motion, &frames, near) {
            Target::Pose(pose, config, _) => (pose, config),
            Target::Axis { axis, value } => return with_axis(model, near, axis, value).map(drop),
            Target::Joints(joints) => return Ok(model.check_limits(&joints)?),
        };
        let flange = pose.transform().compose(&tool.inverse());
        let flange = Pose::from_transform(&flange, pose.uv);
        let nearest = model.inverse(&flange, config, near);
        // Shoulder, elbow and wrist; an open turn of axes 4 and 6 takes whatever fits.
        let postures = match model.kind {
            ArmKind::SixAxis(_) => 3,
            ArmKind::Scara(_) => 1,
        };
        let any = (0..1_u8 << postures).any(|bits| {
            let mut digits = config;
            for (place, digit) in digits.iter_mut().enumerate().take(postures) {
                if *digit == 0 {
                    *digit = 1 + (bits >> place & 1);
                }
            }
            model.inverse(&flange, digits, near).is_ok()
        });
        match any {
            true => Ok(()),
            false => nearest.map(drop).map_err(MotionError::from),
        }
    }
}
