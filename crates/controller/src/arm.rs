//! The arm in time: its posture, the motion under way, and the coordinate systems of its position.
//!
//! [`Arm`] starts, holds, resumes and stops motions; submodules add PASS (`append`), jogging (`jog`), retry after a stop
//! (`retry`), the questions of a program (`trajectory`) and the maintenance counters (`wear`). The geometry is in
//! `crate::model`, the calculation of a motion in `crate::motion`.

mod trajectory;

use crate::model::{ArmModel, Joints};
use crate::motion::{Gate, Motion, MotionError, Pose, Route, Target, Transform, pairwise};
use crate::prelude::*;
use crate::snapshot_error::{SnapshotError, check};
use crate::time::Time;
use core::time::Duration;
use scol_mini::{Conditions, Configuration, FULL, Frame, Path, Position};

mod append;
mod jog;
mod load;
mod memo;
mod reach;
mod retry;
mod settings;
mod wear;

pub use jog::{Guide, Jog, JogFrame};
use memo::Memo;
use settings::{MotionSettings, load_part};
pub use trajectory::PATH_POINTS;
pub use wear::Wear;

/// Bounds on the speed of every motion, besides its own conditions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedLimits {
    /// Speed override in percent.
    pub override_percent: u8,
    /// Highest speed of the tool point in mm/s, if one holds (PRM-SPD-01).
    pub tool_speed_cap: Option<f64>,
}

/// A motion under way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ActiveMotion {
    motion: Motion,
    start: Time,
    settings: MotionSettings,
    /// The machine lock was on: time passes but the arm stays.
    locked: bool,
    /// The coordinate systems named by its WITH, in force while it is under way.
    frames: Option<Frames>,
    /// Frames from the moment at which the motion queued by PASS begins.
    next: Option<NextFrames>,
}

/// The coordinate systems of a motion that has been put after another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct NextFrames {
    /// Those named by its WITH.
    frames: Option<Frames>,
    /// That of the position it leads to.
    work: Option<Frame>,
}

impl ActiveMotion {
    /// The coordinate systems of the motion put after this one, if it has begun by `now`.
    fn next_begun(&self, now: Time) -> Option<&NextFrames> {
        let next = self.next.as_ref();
        next.filter(|_| self.motion.last_has_begun(now.since(self.start)))
    }
}

/// The three coordinate systems of a motion or of a program, with their names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frames {
    /// BASE: the place of the robot in the world.
    pub base: Frame,
    /// WORK: the workpiece, in BASE.
    pub work: Frame,
    /// TOOL: the tool point, as seen from the flange.
    pub tool: Frame,
}

impl Frames {
    /// The coordinate systems that the motion conditions set.
    pub fn new(conditions: &Conditions) -> Frames {
        Frames {
            base: conditions.base.clone(),
            work: conditions.work.clone(),
            tool: conditions.tool.clone(),
        }
    }

    /// Where a work coordinate system is in the world.
    fn origin(&self, work: &Frame) -> Transform {
        transform(&self.base).compose(&transform(work))
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arm {
    #[serde(skip, default = "ArmModel::tv800")]
    model: ArmModel,
    /// Posture while no motion is under way.
    rest: Joints,
    active: Option<Box<ActiveMotion>>,
    /// The motion before it, which slows until the active one begins. Earlier snapshots have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    slowing: Option<Box<ActiveMotion>>,
    /// The motion that a stop (retry) interrupted.
    interrupted: Option<Box<ActiveMotion>>,
    /// Work coordinate of the position last moved to, if the position has its own.
    position_work: Option<Frame>,
    /// Who guides the arm; a snapshot has it apart.
    #[serde(skip)]
    guide: Option<Guide>,
    /// Counters of the axes.
    wear: Wear,
    #[serde(skip)]
    memo: Memo,
}

/// The posture of the arm at one moment, in joints and in coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmPose {
    /// Kind of arm, which decides the coordinates of a position.
    pub kind: scol_mini::Arm,
    /// Number of axes the model has.
    pub axes: usize,
    /// Joint values: degrees, mm for axis 3 of a SCARA arm.
    pub joints: Joints,
    /// Tool point in world coordinates.
    pub world: Pose,
    /// Tool point in work coordinates.
    pub work: Pose,
    /// Configuration digits (DATA-04).
    pub configuration: [u8; 5],
}

impl ArmPose {
    /// Values of the axes that the model has.
    pub fn joint_values(&self) -> Vec<f64> {
        self.joints.iter().take(self.axes).copied().collect()
    }

    /// The tool point in world: X Y Z A B C U V, of a SCARA X Y Z C T; mm and degrees.
    pub fn world_values(&self) -> Vec<f64> {
        self.values(&self.world)
    }

    /// The tool point in the work coordinate system, in the same order.
    pub fn work_values(&self) -> Vec<f64> {
        self.values(&self.work)
    }

    fn values(&self, pose: &Pose) -> Vec<f64> {
        let count = self.kind.coordinates().len();
        pose.coords(self.kind).into_iter().take(count).collect()
    }
}

fn transform(frame: &Frame) -> Transform {
    Transform::from_coords(frame.trans.coords)
}

impl Arm {
    /// The arm in its ready posture.
    pub fn new(model: ArmModel) -> Arm {
        let rest = model.ready;
        Arm::with_posture(model, rest)
    }

    /// The arm at rest in this posture.
    pub fn with_posture(model: ArmModel, rest: Joints) -> Arm {
        Arm {
            model,
            rest,
            active: None,
            slowing: None,
            interrupted: None,
            position_work: None,
            guide: None,
            wear: Wear::default(),
            memo: Memo::default(),
        }
    }

    /// The same arm with this model, guided so: a snapshot has both apart.
    pub(crate) fn with_model(self, model: ArmModel, guide: Option<Guide>) -> Arm {
        Arm { model, guide, ..self }
    }

    /// Validates an arm read from a snapshot.
    ///
    /// # Errors
    /// The field, and what is wrong with it.
    pub(crate) fn validate(&self, now: Time) -> Result<(), SnapshotError> {
        let posture = |place, joints: &Joints| {
            let checked = self.model.check_limits(joints);
            checked.map_err(|reason| SnapshotError::value(place, "a posture of the arm", reason))
        };
        posture("arm.rest", &self.rest)?;
        let worn = self.wear.is_valid(now);
        check(
            worn,
            "arm.wear",
            "a posture of the arm",
            "numbers that a motion can reach",
        )?;
        let motions = [
            ("arm.active", &self.active),
            ("arm.slowing", &self.slowing),
            ("arm.interrupted", &self.interrupted),
        ];
        for (place, active) in motions {
            let Some(active) = active else { continue };
            let valid = active.motion.is_valid(&self.model);
            check(
                valid,
                place,
                "a posture of the arm",
                "a motion with finite times and places",
            )?;
            posture(place, &active.motion.joints_at(now.since(active.start)))?;
            posture(place, &active.motion.end())?;
        }
        Ok(())
    }

    /// The model, which never changes.
    pub fn model(&self) -> &ArmModel {
        &self.model
    }

    /// Kind of arm, which decides how positions are written.
    pub fn kind(&self) -> scol_mini::Arm {
        self.model.language()
    }

    /// Joint values at `now`.
    pub fn joints(&self, now: Time) -> Joints {
        let slows = self.active.as_deref().is_some_and(|active| now < active.start);
        let slowing = self.slowing.as_deref().filter(|_| slows);
        let moving = slowing.or_else(|| self.unlocked());
        moving.map_or(self.rest, |active| {
            active.motion.joints_at(now.since(active.start))
        })
    }

    /// The motion under way, unless the machine lock keeps the arm where it is.
    fn unlocked(&self) -> Option<&ActiveMotion> {
        self.active.as_deref().filter(|active| !active.locked)
    }

    /// Whether a motion is under way or held.
    pub fn is_moving(&self) -> bool {
        self.active.is_some()
    }

    /// Whether a motion is held.
    pub fn is_held(&self) -> bool {
        self.active.as_ref().is_some_and(|active| active.motion.is_held())
    }

    /// When the motion under way ends; `None` while it is held or none is under way.
    pub fn ends_at(&self) -> Option<Time> {
        let active = self.active.as_ref().filter(|active| !active.motion.is_held())?;
        Some(active.start + active.motion.duration())
    }

    /// Ends the motion if its time has come.
    pub fn finish_due(&mut self, now: Time) {
        let Some(end) = self.ends_at().filter(|end| *end <= now) else {
            return;
        };
        // The wear first: it is that of the motion that ends.
        self.add_wear_until(end);
        self.take_next(end);
        if let Some(active) = self.active.take()
            && !active.locked
        {
            self.rest = active.motion.end();
            let part = active.motion.percent_at(end.since(active.start)) / 100.0;
            self.memo.ended = Some((active.motion, part));
        }
        // Whatever moves next is no guided motion any more.
        self.guide = None;
    }

    /// Percentage of the motion completed; 100 when none is under way.
    pub fn percent(&self, now: Time) -> f64 {
        let active = self.active.as_ref();
        active.map_or(100.0, |active| active.motion.percent_at(now.since(active.start)))
    }

    /// Starts a motion at `now`, or, while the arm still slows from the last one, when it rests.
    ///
    /// # Errors
    /// The target or the path cannot be reached; the arm then stays where it is.
    pub fn start(
        &mut self,
        now: Time,
        motion: &scol_mini::Motion,
        pace: SpeedLimits,
        locked: bool,
    ) -> Result<(), MotionError> {
        let (start, from) = self.next_start(now);
        let planned = self.plan_motion(motion, start, &from, pace, locked)?;
        // After planning, because a motion that cannot be planned changes nothing.
        self.position_work = destination_work(&motion.path);
        self.set_off(now, planned, from);
        Ok(())
    }

    /// Begins a planned motion, from this posture.
    fn set_off(&mut self, now: Time, planned: ActiveMotion, from: Joints) {
        // The motion that is replaced may slow until then, and it counts to its end.
        self.add_wear_until(planned.start);
        self.slowing = match self.active.take() {
            // It has not begun: the one before it still slows.
            Some(replaced) if now < replaced.start => self.slowing.take(),
            replaced => replaced.filter(|replaced| !replaced.locked),
        };
        self.rest = from;
        self.drop_interrupted();
        self.active = Some(Box::new(planned));
    }

    /// When and from where the next motion starts: now, or when and where an arm that still slows comes to rest.
    fn next_start(&mut self, now: Time) -> (Time, Joints) {
        self.finish_due(now);
        let start = self.ends_at().unwrap_or(now).max(now);
        let slowing = self.unlocked();
        (start, slowing.map_or(self.rest, |active| active.motion.end()))
    }

    /// Plans a motion from a posture at rest.
    fn plan_motion(
        &mut self,
        motion: &scol_mini::Motion,
        start: Time,
        from: &Joints,
        pace: SpeedLimits,
        locked: bool,
    ) -> Result<ActiveMotion, MotionError> {
        let conditions = &motion.conditions;
        let frames = Frames::new(conditions);
        let target = self.target(motion, &frames, from);
        let mass = conditions.payload.as_ref().map_or(0.0, |(_, load)| load.mass);
        let load_part = load_part(mass, self.model.max_payload);
        let settings = MotionSettings {
            speed: conditions.speed,
            // More than there is has no effect (T15).
            accel: conditions.accel.min(FULL) * load_part,
            decel: conditions.decel.min(FULL) * load_part,
            torque: torque(conditions),
            load_part,
        };
        let (tool, limits) = (transform(&frames.tool), settings.limits(pace));
        let (memo, model) = (&mut self.memo, &self.model);
        Ok(ActiveMotion {
            motion: memo.plan(model, from, &target, &tool, &limits, load_part)?,
            start,
            settings,
            locked,
            frames: motion.own_frames.then_some(frames),
            next: None,
        })
    }

    fn target(&self, motion: &scol_mini::Motion, frames: &Frames, from: &Joints) -> Target {
        let config = motion.conditions.config;
        let world = |position: &Position| self.world_pose(position, frames);
        let (end, way) = match &motion.path {
            Path::Ptp(end) => (end, Route::Joint),
            Path::Line(end) => (end, Route::Line),
            Path::Arc { via, end } => (end, Route::Arc(world(via))),
            Path::Arch {
                end,
                single_axis_1,
                retreat,
                single_axis_2,
            } => {
                let gate = Gate {
                    single_axis_1: *single_axis_1,
                    retreat: *retreat,
                    single_axis_2: *single_axis_2,
                };
                (end, Route::Arch(gate))
            }
            Path::Axis { axis, value } => {
                let (axis, value) = (axis_index(*axis), *value);
                return Target::Axis { axis, value };
            }
            Path::AxisBy { axis, delta } => {
                let axis = axis_index(*axis);
                let value = from.get(axis).copied().unwrap_or_default() + delta;
                return Target::Axis { axis, value };
            }
            Path::Ready => return Target::Joints(self.model.ready),
        };
        Target::Pose(world(end), merge(end.config, config), way)
    }

    /// A motion to a position at the present height of the tool point, in the world, and at its own place otherwise (MP,1).
    pub(crate) fn at_present_height(&self, now: Time, motion: &scol_mini::Motion) -> scol_mini::Motion {
        let mut motion = motion.clone();
        if let Path::Ptp(end) = &mut motion.path {
            let frames = Frames::new(&motion.conditions);
            let work = end.work.as_deref().unwrap_or(&frames.work);
            let here = self.pose_in(self.joints(now), &frames, work).world;
            let target = self.world_pose(end, &frames);
            let mut placed = target.transform();
            placed.origin[2] = here.transform().origin[2];
            // Back into the coordinate system of the position, whose Z may be another axis than that of the world.
            let local = frames.origin(work).inverse().compose(&placed);
            end.coords = Pose::from_transform(&local, target.uv).coords(self.kind());
        }
        motion
    }

    /// World pose of a position: BASE, then the position's own or the set work coordinate, then its values.
    fn world_pose(&self, position: &Position, frames: &Frames) -> Pose {
        let work = position.work.as_deref().unwrap_or(&frames.work);
        let local = Pose::from_coords(self.kind(), position.coords);
        let placed = frames.origin(work).compose(&local.transform());
        Pose::from_transform(&placed, local.uv)
    }

    /// The coordinate systems in force: those of the motion under way if its WITH names one, else those set.
    pub fn frames(&self, now: Time, conditions: &Conditions) -> Frames {
        let own = self.active.as_ref().and_then(|active| {
            let begun = active.next_begun(now).map_or(&active.frames, |next| &next.frames);
            begun.clone()
        });
        own.unwrap_or_else(|| Frames::new(conditions))
    }

    /// A motion put after another that has begun by `now` counts as the one under way from here on.
    fn take_next(&mut self, now: Time) {
        if let Some(active) = &mut self.active
            && let Some(next) = active.next_begun(now).cloned()
        {
            self.position_work = next.work;
            (active.frames, active.next) = (next.frames, None);
        }
    }

    /// The posture at `now`, as SF and PR send it.
    pub fn pose(&self, now: Time, conditions: &Conditions) -> ArmPose {
        let frames = self.frames(now, conditions);
        self.pose_in(self.joints(now), &frames, self.shown_work(now, &frames))
    }

    /// A posture, with its position in a work coordinate system.
    fn pose_in(&self, joints: Joints, frames: &Frames, work: &Frame) -> ArmPose {
        let (flange, configuration) = self.model.forward(&joints);
        let world = flange.transform().compose(&transform(&frames.tool));
        let local = frames.origin(work).inverse().compose(&world);
        ArmPose {
            kind: self.kind(),
            axes: self.model.axes.len(),
            joints,
            world: Pose::from_transform(&world, flange.uv),
            work: Pose::from_transform(&local, flange.uv),
            configuration,
        }
    }

    /// The work coordinate system the position is shown in: its own, if it has one.
    fn shown_work<'a>(&'a self, now: Time, frames: &'a Frames) -> &'a Frame {
        let begun = self.active.as_ref().and_then(|active| active.next_begun(now));
        let own = begun.map_or(&self.position_work, |next| &next.work);
        own.as_ref().unwrap_or(&frames.work)
    }

    /// Name of the work coordinate system the position is shown in; empty if it has none.
    pub fn work_name(&self, now: Time, frames: &Frames) -> String {
        self.shown_work(now, frames).name.clone().unwrap_or_default()
    }

    /// HERE: the present position in these coordinate systems.
    pub fn here(&self, now: Time, frames: &Frames) -> Position {
        self.position_of(&self.joints(now), frames)
    }

    /// The position of a posture in these coordinate systems.
    fn position_of(&self, joints: &Joints, frames: &Frames) -> Position {
        let pose = self.pose_in(*joints, frames, &frames.work);
        let digits = pose.configuration;
        Position {
            coords: pose.work.coords(self.kind()),
            config: Configuration { digits },
            work: None,
        }
    }

    /// Feed hold: the arm slows along its path and rests there.
    pub fn hold(&mut self, now: Time) {
        self.change_motion(now, |active, at| active.motion.hold(at));
    }

    /// Feed hold released: the motion continues.
    pub fn resume(&mut self, now: Time) {
        self.change_motion(now, |active, at| active.motion.resume(at));
    }

    /// Applies a new override or speed cap to the motion under way.
    pub fn set_speed_limits(&mut self, now: Time, pace: SpeedLimits) {
        self.change_motion(now, |active, at| {
            active.motion.set_limits(at, &active.settings.limits(pace));
        });
    }

    /// Gives up the motion: the arm slows at full deceleration and rests where it then is.
    pub fn stop(&mut self, now: Time) {
        self.guide = None;
        self.change_motion(now, |active, at| active.motion.stop(at));
    }

    /// Changes the motion under way, at this time after its start.
    fn change_motion(&mut self, now: Time, change: impl FnOnce(&mut ActiveMotion, Duration)) {
        // Before the change, after which the motion no longer knows its course until `now`.
        self.add_wear_until(now);
        self.take_next(now);
        if let Some(active) = &mut self.active {
            let at = now.since(active.start);
            change(active, at);
        }
    }
}

/// The part of its torque each axis may use: TORQUE, and none for an axis whose GAIN is 0, which is free.
fn torque(conditions: &Conditions) -> Joints {
    let part = |percent: f64, gain: f64| if gain <= 0.0 { 0.0 } else { percent / 100.0 };
    pairwise(conditions.torque, conditions.gain, part)
}

/// Index of an axis. Axis numbers begin at 1; 0 gives an axis that does not exist, which the planner rejects.
fn axis_index(axis: u8) -> usize {
    usize::from(axis).checked_sub(1).unwrap_or(usize::MAX)
}

/// The digits of the position; CONFIG supplies those that the position leaves undefined (0).
fn merge(position: Configuration, set: Configuration) -> [u8; 5] {
    let merged = |digit, set| if digit == 0 { set } else { digit };
    pairwise(position.digits, set.digits, merged)
}

/// The work coordinate system of the position a path leads to, if the position has its own.
fn destination_work(path: &Path) -> Option<Frame> {
    match path {
        Path::Ptp(position)
        | Path::Line(position)
        | Path::Arc { end: position, .. }
        | Path::Arch { end: position, .. } => position.work.as_deref().cloned(),
        Path::Axis { .. } | Path::AxisBy { .. } | Path::Ready => None,
    }
}
