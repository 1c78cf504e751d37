//! The arm guided by hand: along and about the axes of a coordinate system, or axis by axis, by a step or as far
//! as it goes. Who may guide it, and how long, is decided in `ops`.

use super::{Active, Arm, Asked, Frames, Pace, axis_index, torque};
use crate::limits::{GUIDE_HALVINGS, GUIDE_REACH, GUIDE_TURN};
use crate::model::Joints;
use crate::motion::{Limits, Motion, MotionError, NO_LOAD, Pose, Target, Transform, plan};
use crate::time::Time;
use scol_mini::Conditions;
use thiserror::Error;

/// In which coordinate system the arm is guided by hand (SF-14).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GuideFrame {
    /// Single axes.
    Joint,
    /// Along and about the axes of the tool.
    Tool,
    /// Of the work coordinate system.
    Work,
    /// Of the world.
    World,
}

impl GuideFrame {
    /// As SC and SF number it.
    #[must_use]
    pub fn of(number: u16) -> GuideFrame {
        match number {
            0 => GuideFrame::Joint,
            1 => GuideFrame::Tool,
            2 => GuideFrame::Work,
            _ => GuideFrame::World,
        }
    }
}

/// A motion guided by hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guidance {
    /// Axis from 1; in a coordinate system 1-3 go along X Y Z, 4-6 turn about them.
    pub axis: u8,
    /// +1 or -1.
    pub sign: f64,
    /// Inching: so far in mm or degrees; otherwise as far as it goes.
    pub step: Option<f64>,
    /// Percent of full speed.
    pub speed: f64,
    /// The coordinate system.
    pub frame: GuideFrame,
}

/// Why the arm cannot be guided.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum GuideError {
    /// The axis stands at its limit.
    #[error("axis {axis} is at its limit in that direction")]
    AtLimit {
        /// The axis.
        axis: u8,
    },
    /// There is no way in that direction.
    #[error(transparent)]
    Motion(#[from] MotionError),
}

/// Place of C among X Y Z A B C.
const TURN_ABOUT_Z: usize = 5;
/// Shortest way a guided motion may have, in mm or degrees.
const SMALLEST_WAY: f64 = 1e-6;

impl Arm {
    /// Starts a motion guided by hand: by a step, or as far as limits and reach allow.
    ///
    /// # Errors
    /// There is no way to go in that direction.
    pub fn guide(
        &mut self,
        now: Time,
        guidance: &Guidance,
        conditions: &Conditions,
        pace: Pace,
        locked: bool,
    ) -> Result<(), GuideError> {
        let asked = Asked {
            speed: guidance.speed,
            accel: 100.0,
            decel: 100.0,
            torque: torque(conditions),
            load_part: NO_LOAD,
        };
        let limits = asked.limits(pace);
        let frames = Frames::of(conditions);
        let (start, from) = self.next_start(now);
        let way = guidance.step.unwrap_or(self.farthest(guidance, &from));
        if way < SMALLEST_WAY {
            return Err(GuideError::AtLimit { axis: guidance.axis });
        }
        let mut planned = self.plan_guided(guidance, way, &frames, &from, &limits);
        if planned.is_err() && guidance.step.is_none() {
            // What can be gone is a beginning of what cannot: the end of the reach lies between the two.
            let (mut near, mut far) = (0.0, way);
            for _ in 0..GUIDE_HALVINGS {
                let middle = 0.5 * (near + far);
                match self.plan_guided(guidance, middle, &frames, &from, &limits) {
                    Ok(shorter) => {
                        near = middle;
                        planned = Ok(shorter);
                    }
                    Err(_) => far = middle,
                }
            }
        }
        let planned = planned?;
        self.account(start);
        self.active = Some(Active {
            motion: planned,
            start,
            asked,
            locked,
            frames: None,
        });
        self.rest = from;
        self.forget_interrupted();
        Ok(())
    }

    fn farthest(&self, guidance: &Guidance, from: &Joints) -> f64 {
        let index = axis_index(guidance.axis);
        match (guidance.frame, self.model.axes.get(index), from.get(index)) {
            (GuideFrame::Joint, Some(axis), Some(present)) if guidance.sign > 0.0 => axis.max - present,
            (GuideFrame::Joint, Some(axis), Some(present)) => present - axis.min,
            _ if index < 3 => GUIDE_REACH,
            _ => GUIDE_TURN,
        }
    }

    fn plan_guided(
        &self,
        guidance: &Guidance,
        way: f64,
        frames: &Frames,
        from: &Joints,
        limits: &Limits,
    ) -> Result<Motion, MotionError> {
        let index = self.guided_index(guidance);
        if guidance.frame == GuideFrame::Joint {
            let present = from.get(index).copied().unwrap_or_default();
            let target = Target::Axis {
                axis: index,
                value: present + guidance.sign * way,
            };
            return plan(&self.model, from, &target, &frames.tool, limits);
        }
        let (flange, digits) = self.model.forward(from);
        let here = flange.transform().compose(&frames.tool);
        let mut step = [0.0; 6];
        *step.get_mut(index).ok_or(MotionError::NoSuchAxis {
            axis: usize::from(guidance.axis),
            axes: 6,
        })? = guidance.sign * way;
        let step = Transform::from_coords(step);
        let system = match guidance.frame {
            GuideFrame::Tool => here,
            GuideFrame::Work => frames.base.compose(&frames.work),
            GuideFrame::World | GuideFrame::Joint => Transform::IDENTITY,
        };
        // Along the axes of the system, about the tool point.
        let turn = Transform {
            origin: [0.0; 3],
            ..system
        };
        let centre = Transform {
            origin: here.origin,
            ..Transform::IDENTITY
        };
        let moved = turn.compose(&step).compose(&turn.inverse());
        let there = centre.compose(&moved).compose(&centre.inverse()).compose(&here);
        plan(
            &self.model,
            from,
            &Target::Line(Pose::from_transform(&there, flange.uv), digits),
            &frames.tool,
            limits,
        )
    }

    /// Place of a guided axis: in a coordinate system the fourth of a SCARA is C, a turn about Z.
    fn guided_index(&self, guidance: &Guidance) -> usize {
        match (self.kind(), guidance.frame, guidance.axis) {
            (_, GuideFrame::Joint, axis) | (scol_mini::Arm::SixAxis, _, axis) => axis_index(axis),
            (scol_mini::Arm::Scara, _, axis @ 1..=3) => axis_index(axis),
            (scol_mini::Arm::Scara, _, 4) => TURN_ABOUT_Z,
            (scol_mini::Arm::Scara, _, _) => usize::MAX,
        }
    }
}
