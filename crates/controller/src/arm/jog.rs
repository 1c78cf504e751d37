//! Jogging: moves the arm by hand, axis by axis or along and about the axes of a coordinate system, by a step or as far
//! as limits and reach allow.
//!
//! Who may jog the arm, and for how long, is decided in `ops`.

use super::{ActiveMotion, Arm, Frames, MotionSettings, SpeedLimits, axis_index, torque, transform};
use crate::limits::{JOG_BISECTIONS, MAX_JOG_ANGLE, MAX_JOG_DISTANCE};
use crate::model::Joints;
use crate::motion::{Limits, Motion, MotionError, NO_LOAD, Pose, Route, Target, Transform, plan};
use crate::port::Port;
use crate::time::Time;
use scol_mini::Conditions;

/// The coordinate system of a jog (SF-14).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JogFrame {
    /// One axis of the arm.
    Joint,
    /// Along and about the axes of the tool coordinate system.
    Tool,
    /// Along and about the axes of the work coordinate system.
    Work,
    /// Along and about the axes of the world.
    World,
}

impl JogFrame {
    /// The coordinate system by its number in SC and SF.
    pub fn from_number(number: u16) -> JogFrame {
        match number {
            0 => JogFrame::Joint,
            1 => JogFrame::Tool,
            2 => JogFrame::Work,
            _ => JogFrame::World,
        }
    }
}

/// Who guides the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Guide {
    /// Somebody at the teach pendant.
    Pendant,
    /// The host at this port, by JG.
    #[serde(untagged)]
    Host(Port),
}

/// A request to jog the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jog {
    /// Who asks for it.
    pub by: Guide,
    /// Axis from 1; in a coordinate system 1-3 go along X Y Z, 4-6 turn about them.
    pub axis: u8,
    /// +1 or -1.
    pub sign: f64,
    /// Inching: so far in mm or degrees; otherwise as far as it goes.
    pub step: Option<f64>,
    /// Percent of full speed.
    pub speed: f64,
    /// The coordinate system.
    pub frame: JogFrame,
}

/// Place of C among X Y Z A B C.
const C_INDEX: usize = 5;
/// The axis T of a five-axis SCARA.
const HAND_AXIS: usize = 4;
/// Shortest jog, in mm or degrees: less counts as standing at the limit.
const MIN_TRAVEL: f64 = 1e-6;

impl Arm {
    /// Starts a jog: by a step, or as far as limits and reach allow.
    ///
    /// # Errors
    /// The arm cannot move in that direction; it then stays where it is.
    pub fn jog(
        &mut self,
        now: Time,
        jog: &Jog,
        conditions: &Conditions,
        pace: SpeedLimits,
        locked: bool,
    ) -> Result<(), MotionError> {
        let settings = MotionSettings {
            speed: jog.speed,
            accel: 100.0,
            decel: 100.0,
            torque: torque(conditions),
            load_part: NO_LOAD,
        };
        let limits = settings.limits(pace);
        let jog = &self.in_joint_if_hand(jog);
        let frames = Frames::new(conditions);
        let (start, from) = self.next_start(now);
        let way = jog.step.unwrap_or(self.max_travel(jog, &from));
        if way < MIN_TRAVEL {
            let axis = usize::from(jog.axis);
            return Err(MotionError::AtLimit { axis });
        }
        let mut planned = self.plan_jog(jog, way, &frames, &from, &limits);
        if planned.is_err() && jog.step.is_none() {
            // Any shorter jog along the same line is reachable if a longer one is, so bisect for the limit of the
            // reach. 16 halvings of 2000 mm leave 0.03 mm.
            let (mut reachable, mut unreachable) = (0.0, way);
            for _ in 0..JOG_BISECTIONS {
                let middle = 0.5 * (reachable + unreachable);
                match self.plan_jog(jog, middle, &frames, &from, &limits) {
                    Ok(shorter) => {
                        reachable = middle;
                        planned = Ok(shorter);
                    }
                    Err(_) => unreachable = middle,
                }
            }
        }
        let jogged = ActiveMotion {
            motion: planned?,
            start,
            settings,
            locked,
            frames: None,
            next: None,
        };
        self.set_off(now, jogged, from);
        self.guide = Some(jog.by);
        Ok(())
    }

    /// Whether somebody guides the arm right now.
    pub(crate) fn is_jogging(&self) -> bool {
        self.guide.is_some() && self.is_moving()
    }

    /// Who guides the arm, or did and has not ended that.
    pub(crate) fn guide(&self) -> Option<Guide> {
        self.guide
    }

    /// Whether that is the host at this port.
    pub(crate) fn is_guided_from(&self, port: Port) -> bool {
        self.guide == Some(Guide::Host(port))
    }

    /// A guided motion ends: the arm slows and rests.
    pub(crate) fn stop_jog(&mut self, now: Time) {
        if self.guide.is_some() {
            self.stop(now);
        }
    }

    /// The same, if it is the host at this port that guides it.
    pub(crate) fn stop_jog_from(&mut self, port: Port, now: Time) {
        if self.is_guided_from(port) {
            self.stop(now);
        }
    }

    fn max_travel(&self, jog: &Jog, from: &Joints) -> f64 {
        let index = axis_index(jog.axis);
        match (jog.frame, self.model.axes.get(index), from.get(index)) {
            (JogFrame::Joint, Some(axis), Some(present)) if jog.sign > 0.0 => axis.max - present,
            (JogFrame::Joint, Some(axis), Some(present)) => present - axis.min,
            _ if index < 3 => MAX_JOG_DISTANCE,
            _ => MAX_JOG_ANGLE,
        }
    }

    fn plan_jog(
        &self,
        jog: &Jog,
        way: f64,
        frames: &Frames,
        from: &Joints,
        limits: &Limits,
    ) -> Result<Motion, MotionError> {
        let index = self.jog_axis_index(jog);
        if jog.frame == JogFrame::Joint {
            let present = from.get(index).copied().unwrap_or_default();
            let target = Target::Axis {
                axis: index,
                value: present + jog.sign * way,
            };
            return plan(&self.model, from, &target, &transform(&frames.tool), limits);
        }
        let (flange, digits) = self.model.forward(from);
        let here = flange.transform().compose(&transform(&frames.tool));
        let mut step = [0.0; 6];
        *step.get_mut(index).ok_or(MotionError::NoSuchAxis {
            axis: usize::from(jog.axis),
            axes: 6,
        })? = jog.sign * way;
        let step = Transform::from_coords(step);
        let system = match jog.frame {
            JogFrame::Tool => here,
            JogFrame::Work => frames.origin(&frames.work),
            JogFrame::World | JogFrame::Joint => Transform::IDENTITY,
        };
        // Along the axes of the system, about the tool point.
        // A step along the axes of the system is turn . step . turn'. Its rotation has to leave the tool point where it
        // is, hence the detour by `centre`.
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
        let target = Target::Pose(Pose::from_transform(&there, flange.uv), digits, Route::Line);
        plan(&self.model, from, &target, &transform(&frames.tool), limits)
    }

    /// A position of a five-axis SCARA is X Y Z C T: T is the joint in every coordinate system (T20).
    fn in_joint_if_hand(&self, jog: &Jog) -> Jog {
        let has_hand = self.model.axes.len() > HAND_AXIS;
        let is_hand = self.kind() == scol_mini::Arm::Scara && axis_index(jog.axis) == HAND_AXIS;
        let frame = if has_hand && is_hand {
            JogFrame::Joint
        } else {
            jog.frame
        };
        Jog { frame, ..*jog }
    }

    /// Index of the jogged axis. In a coordinate system the fourth axis of a SCARA is C, the turn about Z.
    fn jog_axis_index(&self, jog: &Jog) -> usize {
        match (self.kind(), jog.frame, jog.axis) {
            (_, JogFrame::Joint, axis) | (scol_mini::Arm::SixAxis, _, axis) => axis_index(axis),
            (scol_mini::Arm::Scara, _, axis @ 1..=3) => axis_index(axis),
            (scol_mini::Arm::Scara, _, 4) => C_INDEX,
            (scol_mini::Arm::Scara, _, _) => usize::MAX,
        }
    }
}
