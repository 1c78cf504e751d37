//! The way of the arm in a form that a page can evaluate: few points with their velocities, between which a cubic curve is the
//! motion to within [`TOLERANCE`].
//!
//! A motion is a function of time in closed form, so a copy of the controller tells where the arm is at any time until the
//! course changes. A course that comes again, as in a program that repeats its cycle, is the same course.

use serde::Serialize;
use std::collections::HashMap;
use std::time::Duration;
use ts3100_controller::{ArmPose, Controller, Time};

/// Largest distance between curve and motion, in mm and degrees.
pub const TOLERANCE: f64 = 0.05;
/// Most halvings of a stretch.
const MAX_DEPTH: u32 = 9;
/// Half of the time over which a velocity is measured.
const INSTANT: Duration = Duration::from_micros(50);
/// Values are rounded to this many parts of a mm or degree.
const PARTS: f64 = 1_000.0;
/// Most different courses of a run; later motions have none.
const MAX_COURSES: usize = 4_000;

/// A point of a course: microseconds since its begin, the values, and their velocities per second.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Knot(u64, Vec<f64>, Vec<f64>);

/// A course under way.
struct Begun {
    event: u64,
    at: Time,
    /// The controller at its begin.
    controller: Controller,
    /// The last time at which it held.
    until: Time,
}

/// A motion: the event after which it began, its begin and its end in microseconds, and the number of its course.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Motion(u64, Time, Time, usize);

/// Collects the motions of a run.
#[derive(Default)]
pub struct Courses {
    begun: Option<Box<Begun>>,
    known: HashMap<String, usize>,
    courses: Vec<Vec<Knot>>,
    motions: Vec<Motion>,
}

/// The motions of a run. The values of a knot are the joints, the tool point in world, in work where that is
/// another, and the percentage.
#[derive(Debug, Default, Serialize)]
pub struct Motions {
    pub courses: Vec<Vec<Knot>>,
    pub motions: Vec<Motion>,
}

fn values(pose: &ArmPose, percent: f64) -> Vec<f64> {
    let mut values = pose.joint_values();
    values.extend(pose.world_values());
    values.extend(pose.work_values());
    values.push(percent);
    values
}

impl Courses {
    /// Takes the controller after a step; whether a motion tells where the arm is now.
    pub fn step(&mut self, event: u64, at: Time, controller: &Controller) -> bool {
        let now = values(&controller.arm_pose(), controller.motion_percent());
        let holds = self.begun.as_mut().is_some_and(|begun| {
            let (pose, percent) = begun.controller.arm_pose_at(at);
            let expected = values(&pose, percent);
            let is_near = |(expected, found): (&f64, &f64)| (expected - found).abs() < TOLERANCE / 10.0;
            let last = now.len() - 1;
            let is_there = at >= begun.until && expected.iter().zip(&now).take(last).all(is_near);
            if is_there {
                begun.until = at;
            }
            // Where it ends another may begin: the arm is there, and its percentage begins again.
            is_there && expected.iter().zip(&now).skip(last).all(is_near)
        });
        if holds && controller.is_arm_moving() {
            return true;
        }
        self.end();
        if controller.is_arm_moving() && self.courses.len() < MAX_COURSES {
            self.begun = Some(Box::new(Begun {
                event,
                at,
                controller: controller.clone(),
                until: at,
            }));
        }
        self.begun.is_some()
    }

    /// The course under way ends where it was known last.
    fn end(&mut self) {
        let Some(begun) = self.begun.take() else {
            return;
        };
        let duration = begun.until.since(begun.at);
        if duration.is_zero() {
            return;
        }
        let knots = knots(&begun, duration);
        let key = serde_json::to_string(&knots).unwrap_or_default();
        let next = self.courses.len();
        let course = *self.known.entry(key).or_insert(next);
        if course == next {
            self.courses.push(knots);
        }
        self.motions
            .push(Motion(begun.event, begun.at, begun.until, course));
    }

    /// All of them.
    pub fn finish(mut self) -> Motions {
        self.end();
        Motions {
            courses: self.courses,
            motions: self.motions,
        }
    }
}

/// A course at a time, with the velocities.
#[derive(Clone)]
struct Sample {
    since: Duration,
    values: Vec<f64>,
    velocities: Vec<f64>,
}

fn knots(begun: &Begun, duration: Duration) -> Vec<Knot> {
    let value = |since: Duration| {
        let (pose, percent) = begun.controller.arm_pose_at(begun.at + since);
        values(&pose, percent)
    };
    let sample = |since: Duration| {
        let (from, to) = (since.saturating_sub(INSTANT), (since + INSTANT).min(duration));
        let (before, after) = (value(from), value(to));
        let span = (to - from).as_secs_f64().max(f64::MIN_POSITIVE);
        Sample {
            since,
            values: value(since),
            velocities: before
                .iter()
                .zip(&after)
                .map(|(before, after)| (after - before) / span)
                .collect(),
        }
    };
    let first = sample(Duration::ZERO);
    let mut samples = vec![first.clone()];
    divide(
        &first,
        &sample(duration),
        MAX_DEPTH,
        &value,
        &sample,
        &mut samples,
    );
    let rounded = |values: Vec<f64>| {
        let round = |value: f64| (value * PARTS).round() / PARTS + 0.0;
        values.into_iter().map(round).collect()
    };
    let knot = |sample: Sample| {
        let micros = u64::try_from(sample.since.as_micros()).unwrap_or(u64::MAX);
        Knot(micros, rounded(sample.values), rounded(sample.velocities))
    };
    let mut knots: Vec<Knot> = samples.into_iter().map(knot).collect();
    let work = begun.controller.arm_pose().work_values().len();
    let own = |values: &[f64]| {
        let (world, rest) = values.split_at(values.len() - 1 - work);
        let is_same = world.ends_with(rest.get(..work).unwrap_or_default());
        is_same.then(|| [world, rest.get(work..).unwrap_or_default()].concat())
    };
    let shorter = |Knot(at, values, velocities): &Knot| Some(Knot(*at, own(values)?, own(velocities)?));
    if let Some(shorter) = knots.iter().map(shorter).collect() {
        knots = shorter;
    }
    knots
}

/// Appends the samples after `from`, up to `to`, so that a cubic curve between two is near enough.
fn divide(
    from: &Sample,
    to: &Sample,
    depth: u32,
    value: &impl Fn(Duration) -> Vec<f64>,
    sample: &impl Fn(Duration) -> Sample,
    samples: &mut Vec<Sample>,
) {
    let span = to.since.saturating_sub(from.since);
    let is_near = (1..4).all(|quarter| {
        let part = f64::from(quarter) / 4.0;
        let found = value(from.since + span.mul_f64(part));
        let curve = curve(from, to, part);
        curve
            .iter()
            .zip(found)
            .all(|(curve, found)| (curve - found).abs() <= TOLERANCE)
    });
    if depth == 0 || is_near || span < 4 * INSTANT {
        samples.push(to.clone());
        return;
    }
    let middle = sample(from.since + span / 2);
    divide(from, &middle, depth - 1, value, sample, samples);
    divide(&middle, to, depth - 1, value, sample, samples);
}

/// The cubic curve between two samples (Hermite).
fn curve(from: &Sample, to: &Sample, part: f64) -> Vec<f64> {
    let span = (to.since - from.since).as_secs_f64();
    let (square, cube) = (part * part, part * part * part);
    let weights = [
        2.0 * cube - 3.0 * square + 1.0,
        (cube - 2.0 * square + part) * span,
        3.0 * square - 2.0 * cube,
        (cube - square) * span,
    ];
    let begin = from.values.iter().zip(&from.velocities);
    let end = to.values.iter().zip(&to.velocities);
    begin
        .zip(end)
        .map(|((from, leaving), (to, coming))| {
            weights[0] * from + weights[1] * leaving + weights[2] * to + weights[3] * coming
        })
        .collect()
}
