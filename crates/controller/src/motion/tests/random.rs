//! Seeded random motions with random things event to them: whatever the override, feed hold, resume and BREAK do,
//! the joints go on without a jump, stay on the path and within the limits, and end exactly at the target.

use super::{KEEP, distance, down, scara};
use crate::model::{ArmModel, Joints};
use crate::motion::pose::{dot, minus};
use crate::motion::{Gate, Limits, Motion, Pose, Route, Target, Transform, plan};
use core::time::Duration;

const NO_TOOL: Transform = Transform::IDENTITY;
/// Motions of each model.
const MOTIONS: u32 = 120;
/// Between two looks.
const LOOK: Duration = Duration::from_millis(1);
/// Most the tool point may be off its path, mm.
const OFF: f64 = 1e-3;

/// A seeded generator: every run sees the same motions.
struct Rng(u64);

impl Rng {
    fn between(&mut self, min: f64, max: f64) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        min + (max - min) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }

    fn one_of(&mut self, count: u32) -> u32 {
        (self.between(0.0, f64::from(count)) as u32).min(count - 1)
    }

    /// A place in front of the arm, tool down.
    fn place(&mut self, model: &ArmModel) -> Pose {
        let (out, up) = if model.axes.len() == 6 {
            ([250.0, 550.0], [100.0, 500.0])
        } else {
            ([130.0, 350.0], [-100.0, 80.0])
        };
        let mut pose = down(
            self.between(out[0], out[1]),
            self.between(-200.0, 200.0),
            self.between(up[0], up[1]),
        );
        pose.abc[2] = self.between(-60.0, 60.0);
        pose
    }

    fn limits(&mut self) -> Limits {
        Limits {
            speed: self.between(0.05, 1.0),
            override_part: self.between(0.05, 1.0),
            accel: self.between(0.1, 1.0),
            decel: self.between(0.1, 1.0),
            ..Limits::FULL
        }
    }
}

#[derive(Debug, Clone, Copy)]
enum Way {
    Joint(Joints, Joints),
    Line([f64; 3], [f64; 3]),
    Circle([f64; 3], f64),
    Arch([f64; 3], [f64; 3], f64),
    /// Two that overlap: the corner is rounded.
    Free,
}

impl Way {
    /// How far off it the arm is, mm; in a joint motion how far an axis is outside its way, in parts of it.
    fn off(&self, model: &ArmModel, joints: &Joints) -> f64 {
        let at = model.forward(joints).0.xyz;
        match self {
            Way::Joint(from, to) => {
                let parts = joints.iter().zip(from).zip(to);
                let parts = parts
                    .filter(|((_, from), to)| (*to - *from).abs() > 1e-3)
                    .map(|((joint, from), to)| (joint - from) / (to - from));
                parts.map(|part| (-part).max(part - 1.0)).fold(0.0, f64::max)
            }
            Way::Line(from, to) => off_line(at, *from, *to),
            Way::Circle(centre, radius) => {
                let flat = distance([at[0], at[1], centre[2]], *centre);
                (flat - radius).abs().max((at[2] - centre[2]).abs())
            }
            Way::Arch(from, to, top) => {
                let flat = |place: &[f64; 3]| [place[0], place[1], 0.0];
                let (here, from_flat, to_flat) = (flat(&at), flat(from), flat(to));
                let across = off_line(here, from_flat, to_flat);
                let lowest = from[2].min(to[2]);
                across.max(at[2] - top).max(lowest - at[2])
            }
            Way::Free => 0.0,
        }
    }
}

/// How far a place is from the line between two.
fn off_line(at: [f64; 3], from: [f64; 3], to: [f64; 3]) -> f64 {
    let (way, gone) = (minus(to, from), minus(at, from));
    let part = (dot(gone, way) / dot(way, way)).clamp(0.0, 1.0);
    distance(gone, way.map(|along| along * part))
}

/// A random motion from a random posture, where there is one.
fn motion(model: &ArmModel, rng: &mut Rng) -> Option<(Motion, Way, Joints)> {
    let start = rng.place(model);
    let from = model.inverse(&start, KEEP, &model.ready).ok()?;
    let limits = rng.limits();
    let end = rng.place(model);
    let go = |from: &Joints, target: &Target| plan(model, from, target, &NO_TOOL, &limits).ok();
    let (target, way) = match rng.one_of(5) {
        0 => (Target::Pose(end, KEEP, Route::Joint), None),
        1 => (
            Target::Pose(end, KEEP, Route::Line),
            Some(Way::Line(start.xyz, end.xyz)),
        ),
        2 => {
            let (radius, turn) = (rng.between(10.0, 120.0), rng.between(0.5, 5.5));
            let centre = [start.xyz[0] + radius, start.xyz[1], start.xyz[2]];
            let at = |angle: f64| {
                let (sin, cos) = angle.sin_cos();
                down(centre[0] - radius * cos, centre[1] + radius * sin, centre[2])
            };
            let arc = Target::Pose(at(turn), KEEP, Route::Arc(at(turn / 2.0)));
            (arc, Some(Way::Circle(centre, radius)))
        }
        3 => {
            let retreat = rng.between(5.0, 60.0);
            let top = start.xyz[2].max(end.xyz[2]) + retreat;
            let gate = Gate {
                single_axis_1: rng.between(0.0, retreat),
                retreat,
                single_axis_2: rng.between(0.0, retreat),
            };
            let config = KEEP;
            (
                Target::Pose(end, config, Route::Arch(gate)),
                Some(Way::Arch(start.xyz, end.xyz, top)),
            )
        }
        _ => {
            let first = go(&from, &Target::Pose(end, KEEP, Route::Line))?;
            let next = go(&first.end(), &Target::Pose(rng.place(model), KEEP, Route::Line))?;
            let at = first.duration().mul_f64(rng.between(0.0, 0.3));
            let whole = first.blend(model, at, &next, rng.between(10.0, 100.0), &NO_TOOL)?;
            return Some((whole, Way::Free, next.end()));
        }
    };
    let motion = go(&from, &target)?;
    let to = motion.end();
    Some((motion, way.unwrap_or(Way::Joint(from, to)), to))
}

/// Looks at every millisecond from one time to another.
fn walk(model: &ArmModel, motion: &Motion, way: &Way, from: Duration, to: Duration, last: &mut Joints) {
    // A ramp and a bend, each with all there is; on an arch those of two lines.
    let shares = if let Way::Arch(..) = way { 4.2 } else { 2.1 };
    let (mut at, look) = (from, LOOK.as_secs_f64());
    let mut before: Option<Joints> = None;
    while at <= to {
        let joints = motion.joints_at(at);
        assert!(model.check_limits(&joints).is_ok(), "{way:?} at {at:?}");
        let off = way.off(model, &joints);
        assert!(off < OFF, "{off} off {way:?} at {at:?}");
        for (index, axis) in model.axes.iter().enumerate() {
            let step = (joints[index] - last[index]).abs();
            let most = axis.max_speed * look * 1.001;
            assert!(step <= most, "axis {} by {step} at {at:?}: {way:?}", index + 1);
            let Some(before) = before.filter(|_| at > from) else {
                continue;
            };
            let accel = (joints[index] - 2.0 * last[index] + before[index]).abs() / look / look;
            let most = shares * axis.max_accel;
            assert!(
                accel <= most,
                "axis {} with {accel} at {at:?}: {way:?}",
                index + 1
            );
        }
        before = (at > from).then_some(*last);
        *last = joints;
        at += LOOK;
    }
}

/// Random things happen to it at random moments; at last it goes to its end, or is given up.
fn live(model: &ArmModel, rng: &mut Rng, mut motion: Motion, way: &Way, target: &Joints) {
    let known = motion.last_begins().map_or(Duration::ZERO, |at| at / 2);
    let mut now = known;
    let mut last = motion.joints_at(now);
    for _ in 0..rng.one_of(7) {
        let until = now + Duration::from_micros(u64::from(1_000 + rng.one_of(200_000)));
        let before = motion.percent_at(until);
        walk(model, &motion, way, now, until, &mut last);
        now = until;
        let here = motion.joints_at(now);
        match rng.one_of(4) {
            0 => motion.hold(now),
            1 => motion.resume(now),
            _ => motion.set_limits(now, &rng.limits()),
        }
        assert_eq!(motion.joints_at(now), here, "a change moves nothing by itself");
        assert!((motion.percent_at(now) - before).abs() < 1e-9);
        last = here;
    }
    let given_up = rng.one_of(5) == 0 && now < motion.duration();
    if given_up {
        motion.stop(now);
    } else {
        motion.resume(now);
    }
    let end = motion.duration();
    walk(model, &motion, way, now, end + LOOK, &mut last);
    assert_eq!(motion.joints_at(end), motion.end());
    if given_up {
        assert!(way.off(model, &motion.end()) < OFF);
    } else {
        assert_eq!(motion.end(), *target, "{way:?}");
        assert!((motion.percent_at(end) - 100.0).abs() < 1e-12);
    }
}

#[test]
fn whatever_happens_it_stays_on_its_path_without_a_jump_and_ends_at_its_target() {
    for (model, seed) in [(ArmModel::tv800(), 41), (scara(), 42)] {
        let mut rng = Rng(seed);
        let mut kinds = [0_u32; 5];
        let mut done = 0;
        for _ in 0..MOTIONS * 10 {
            let Some((motion, way, target)) = motion(&model, &mut rng) else {
                continue;
            };
            live(&model, &mut rng, motion, &way, &target);
            kinds[match way {
                Way::Joint(..) => 0,
                Way::Line(..) => 1,
                Way::Circle(..) => 2,
                Way::Arch(..) => 3,
                Way::Free => 4,
            }] += 1;
            done += 1;
            if done == MOTIONS {
                break;
            }
        }
        assert!(kinds.iter().all(|count| *count > 5), "{}: {kinds:?}", model.name);
    }
}
