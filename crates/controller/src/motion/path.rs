//! The geometry of a motion as a function of the part done, 0 to 1: all joints together, or the tool point along a line
//! or an arc.
//!
//! `profile` says how fast a path is followed; `plan` checks whether it can be followed at all.

mod chain;

use super::arch::Arch;
use super::courses::AxisCourses;
use super::kinematics::{Place, follow, place};
use super::pose::{
    Transform, cross, degrees, dot, minus, norm, pairwise, plus, plus_times, product, sin_cos, transposed,
};
use crate::model::{ArmKind, ArmModel, Joints};
use crate::prelude::*;
pub(super) use chain::{Chain, ChainedMotion, SAMPLED_SPEED_MARGIN};
use core::f64::consts::PI;
use libm::{atan2, floor};

/// Below this sine, the three points of an arc count as lying on a line.
const MIN_ARC_SINE: f64 = 1e-6;
/// Below this sine a turn is by nothing or by half a turn, and its axis is read from the other half of the matrix.
const MIN_TURN_SINE: f64 = 1e-6;

/// The curve of the tool point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) enum Shape {
    Line {
        from: [f64; 3],
        to: [f64; 3],
    },
    Arc {
        centre: [f64; 3],
        radius: f64,
        first: [f64; 3],
        second: [f64; 3],
        angle: f64,
    },
    /// Follows a function of time instead of distance.
    Arch(Box<Arch>),
}

impl Shape {
    pub(super) fn line(from: [f64; 3], to: [f64; 3]) -> Shape {
        Shape::Line { from, to }
    }

    /// The arc from one point through another to a third; `None` if they lie on one line.
    pub(super) fn arc(from: [f64; 3], via: [f64; 3], to: [f64; 3]) -> Option<Shape> {
        let (to_via, to_end) = (minus(via, from), minus(to, from));
        let normal = cross(to_via, to_end);
        let area = norm(normal);
        let smallest = MIN_ARC_SINE * norm(to_via) * norm(to_end).max(norm(minus(to, via)));
        if area.is_nan() || area <= smallest || norm(to_end) <= MIN_ARC_SINE * norm(to_via) {
            return None;
        }
        // Circumcentre, seen from `from`.
        // With a and b the ways to via point and end, n = a x b: centre = (b² (n x a) + a² (b x n)) / 2n².
        let lean = cross(normal, to_via).map(|part| part * dot(to_end, to_end));
        let reach = cross(to_end, normal).map(|part| part * dot(to_via, to_via));
        let to_centre = plus(lean, reach).map(|part| part / (2.0 * area * area));
        let (centre, radius) = (plus(from, to_centre), norm(to_centre));
        let first = to_centre.map(|part| -part / radius);
        // A turn about n leads from the start past the via point to the end, so the angle of the end alone decides the
        // length: 0 to a whole turn, and the via point is on the way.
        let second = cross(normal.map(|part| part / area), first);
        let last = minus(to, centre);
        let angle = atan2(dot(last, second), dot(last, first));
        let angle = if angle <= 0.0 { angle + 2.0 * PI } else { angle };
        Some(Shape::Arc {
            centre,
            radius,
            first,
            second,
            angle,
        })
    }

    /// Length in mm.
    pub(super) fn length(&self) -> f64 {
        match self {
            Shape::Line { from, to } => norm(minus(*to, *from)),
            Shape::Arc { radius, angle, .. } => radius * angle,
            Shape::Arch(arch) => arch.length,
        }
    }

    /// Place of the tool point, and the part of its turn that is done.
    fn at(&self, part: f64) -> ([f64; 3], f64) {
        match self {
            Shape::Line { from, to } => (plus_times(*from, minus(*to, *from), part), part),
            Shape::Arc {
                centre,
                radius,
                first,
                second,
                angle,
            } => {
                let (sin, cos) = sin_cos(degrees(angle * part));
                let on_first = plus_times(*centre, *first, radius * cos);
                (plus_times(on_first, *second, radius * sin), part)
            }
            Shape::Arch(arch) => arch.at(part),
        }
    }
}

/// A turn about a fixed axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AxisAngle {
    axis: [f64; 3],
    /// Degrees, 0 to 180.
    pub(super) angle: f64,
}

impl AxisAngle {
    /// The shortest turn that makes this rotation.
    pub(super) fn from_rotation(r: &[[f64; 3]; 3]) -> AxisAngle {
        let skew = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
        // R - R' is 2 sin times the axis, the trace 1 + 2 cos. `atan2` of both is exact at every angle; `acos` loses
        // half its digits near 0 and near half a turn.
        let (sin, cos) = (norm(skew) / 2.0, (r[0][0] + r[1][1] + r[2][2] - 1.0) / 2.0);
        let angle = degrees(atan2(sin, cos));
        if sin > MIN_TURN_SINE || cos > 0.0 {
            let axis = skew.map(|part| if sin > 0.0 { part / (2.0 * sin) } else { 0.0 });
            return AxisAngle { axis, angle };
        }
        // Half a turn: (R + 1) / 2 is axis times axis; its longest column gives the axis.
        let mut columns = pairwise(*r, transposed(r), |row, column| {
            pairwise(row, column, |cell, mirrored| cell / 4.0 + mirrored / 4.0)
        });
        for (index, column) in columns.iter_mut().enumerate() {
            column[index] = (r[index][index] + 1.0) / 2.0;
        }
        // Each column is the axis times one of its components: the longest has the most digits.
        let longer = |best, column| if norm(column) > norm(best) { column } else { best };
        let longest = columns.into_iter().fold([0.0; 3], longer);
        let axis = longest.map(|part| part / norm(longest));
        // The column fixes the axis up to its sign; just below half a turn the sense still counts.
        let sign = if dot(axis, skew) < 0.0 { -1.0 } else { 1.0 };
        let axis = axis.map(|part| sign * part);
        AxisAngle { axis, angle }
    }

    fn partial_rotation(&self, part: f64) -> [[f64; 3]; 3] {
        let (sin, cos) = sin_cos(self.angle * part);
        // Rodrigues' formula.
        let ([x, y, z], rest) = (self.axis, 1.0 - cos);
        // No axis, no turn: the formula below then gives cos on the diagonal, which is 1.
        [
            [cos + x * x * rest, x * y * rest - z * sin, x * z * rest + y * sin],
            [y * x * rest + z * sin, cos + y * y * rest, y * z * rest - x * sin],
            [z * x * rest - y * sin, z * y * rest + x * sin, cos + z * z * rest],
        ]
    }
}

/// The path of the tool: the curve of its point and the turn of its orientation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ToolPath {
    pub(super) kind: ArmKind,
    pub(super) shape: Shape,
    /// Orientation of the tool at the start, and the turn from there in its own axes.
    pub(super) rotation: [[f64; 3]; 3],
    pub(super) turn: AxisAngle,
    /// U and V at the start and at the end.
    pub(super) uv: [[f64; 2]; 2],
    /// Flange as seen from the tool point.
    pub(super) flange: Transform,
    pub(super) digits: [u8; 5],
    /// Joints at equal parts of the path, first at 0, last at 1: they tell which turn of an axis is meant between
    /// them, so that the answer never depends on what was asked before.
    pub(super) samples: Vec<Joints>,
}

impl ToolPath {
    /// Flange and additional axes.
    pub(super) fn flange_at(&self, part: f64) -> Place {
        let (origin, part) = self.shape.at(part);
        let [from, to] = self.uv;
        let uv = plus_times(from, minus(to, from), part);
        let tool = Transform {
            rotation: product(&self.rotation, &self.turn.partial_rotation(part)),
            origin,
        };
        (tool.compose(&self.flange), uv)
    }

    /// Exact joints. Where a point between two samples has no posture, though both samples have one (the arm
    /// fully stretched, within rounding), the value between theirs.
    fn joints_at(&self, part: f64) -> Joints {
        let between = self.between_samples(part);
        follow(&self.kind, &self.flange_at(part), self.digits, &between).unwrap_or(between)
    }

    fn between_samples(&self, part: f64) -> Joints {
        let Some(steps) = self.samples.len().checked_sub(1) else {
            return Joints::default();
        };
        // Only which turn of an axis is meant comes from here, and the samples are fixed when the motion is planned:
        // two questions about the same part have the same answer.
        let position = part.clamp(0.0, 1.0) * steps as f64;
        // In range: `position` is between 0 and the number of steps, which is bounded by `plan`.
        let index = (floor(position) as usize).min(steps.saturating_sub(1));
        let first = self.samples.get(index).copied().unwrap_or_default();
        let second = self.samples.get(index + 1).copied().unwrap_or(first);
        interpolate(&first, &second, position - index as f64)
    }
}

/// The path of a motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) enum Path {
    /// All joints together.
    Joint {
        from: Joints,
        to: Joints,
        /// The courses of the axes; without them, as when one axis moves, every axis does the same part of its way.
        courses: Option<Box<AxisCourses>>,
    },
    /// The tool point along a shape.
    Tool(Box<ToolPath>),
    /// Motions that overlap.
    Chain(Box<Chain>),
}

impl Path {
    /// Whether this arm can follow it; for a snapshot.
    pub(super) fn is_valid(&self, model: &ArmModel) -> bool {
        let is_posture = |joints: &Joints| model.check_limits(joints).is_ok();
        match self {
            Path::Joint { from, to, courses } => {
                is_posture(from)
                    && is_posture(to)
                    && courses.as_ref().is_none_or(|courses| courses.is_valid())
            }
            Path::Tool(tool_path) => {
                let steps = tool_path.samples.len().saturating_sub(1).max(1) as f64;
                let mut samples = tool_path.samples.iter().enumerate();
                tool_path.kind == model.kind
                    && !tool_path.samples.is_empty()
                    && samples.all(|(index, sample)| {
                        is_posture(sample) && is_posture(&self.joints_at(index as f64 / steps))
                    })
            }
            Path::Chain(chain) => chain.is_valid(model),
        }
    }

    /// Change of speed along the path that no axis needs more acceleration for than it has; `None` where only the rates
    /// of the path bound it.
    pub(super) fn most_accel(&self) -> Option<f64> {
        match self {
            Path::Joint { courses, .. } => courses.as_ref().map(|courses| courses.most_accel),
            Path::Tool(_) | Path::Chain(_) => None,
        }
    }

    /// Whether the path is a function of time that rests at its end by itself.
    pub(super) fn is_timed(&self) -> bool {
        match self {
            Path::Joint { .. } => false,
            Path::Tool(tool_path) => matches!(tool_path.shape, Shape::Arch(_)),
            Path::Chain(_) => true,
        }
    }

    /// Joints at a part of the path, 0 to 1; at 0 and 1 exactly those planned.
    pub(super) fn joints_at(&self, part: f64) -> Joints {
        match self {
            Path::Joint { from, to, courses } => {
                let mut joints = interpolate(from, to, part);
                if let Some(courses) = courses.as_ref().filter(|_| part > 0.0 && part < 1.0) {
                    courses.place(from, to, part, &mut joints);
                }
                joints
            }
            Path::Tool(tool_path) => match (tool_path.samples.first(), tool_path.samples.last()) {
                (Some(first), _) if part <= 0.0 => *first,
                (_, Some(last)) if part >= 1.0 => *last,
                _ => tool_path.joints_at(part),
            },
            Path::Chain(chain) if part >= 1.0 => chain.end(),
            Path::Chain(chain) => chain.joints_at(part * chain.duration),
        }
    }
}

/// Linear interpolation between two postures; exact at 0 and 1.
fn interpolate(from: &Joints, to: &Joints, part: f64) -> Joints {
    if part < 1.0 {
        plus_times(*from, minus(*to, *from), part)
    } else {
        *to
    }
}

/// Half the part of a path over which the speed of the tool point is measured: short beside a step of the search, long
/// beside rounding.
const SPEED_PART: f64 = 1e-5;

/// Most the tool point moves, in mm per whole path, anywhere on a joint path on which the axes turn by `turning` radians
/// together.
///
/// Between `STEPS` places the speed differs from that at a place by at most half a step times the greatest second
/// derivative, which for turning axes is the reach times the square of the sum of all turns. Where the axes have courses
/// of their own, the speed is looked at where one of them changes its acceleration too: between two such places the speed
/// of each axis along the path only rises or only falls.
pub(super) fn tool_way(kind: &ArmKind, path: &Path, tool: &Transform, turning: f64) -> f64 {
    const STEPS: u32 = 128;
    let reach = super::kinematics::reach(kind) + norm(tool.origin);
    let point = |part: f64| place(kind, &path.joints_at(part)).0.compose(tool).origin;
    let Path::Joint {
        courses: Some(courses),
        ..
    } = path
    else {
        let mut longest: f64 = 0.0;
        let mut last = point(0.0);
        for step in 1..=STEPS {
            let next = point(f64::from(step) / f64::from(STEPS));
            longest = longest.max(norm(minus(next, last)));
            last = next;
        }
        return longest * f64::from(STEPS) + reach * turning * turning / f64::from(STEPS) / 2.0;
    };
    let speed = |part: f64| {
        let (from, to) = ((part - SPEED_PART).max(0.0), (part + SPEED_PART).min(1.0));
        norm(minus(point(to), point(from))) / (to - from)
    };
    let even = (0..=STEPS).map(|step| f64::from(step) / f64::from(STEPS));
    let fastest = even.chain(courses.bends()).map(speed).fold(0.0, f64::max);
    // An axis with a course of its own turns up to so many times as fast along the path as one that follows evenly.
    let turning = turning * courses.steepest();
    fastest + reach * turning * turning / f64::from(STEPS) / 2.0
}
