//! The courses of the axes in a motion of all joints together: each axis has a trapezoid of its own (T21).
//!
//! The axis that takes longest leads, and the path is followed as its trapezoid says. The trapezoids of the others are
//! stretched to its time. So where an axis is depends on the part of its way that the leading axis has done, and not on
//! time: feed hold, a new override and PASS change how fast the path is followed, and the axes stay together.

use super::profile::Profile;
use crate::model::AXES;
use crate::model::Joints;
use crate::prelude::*;

/// The part of the time next to an end at which the ratio of two speeds is taken for that at the end, where both are 0.
const END_PART: f64 = 1e-6;

/// The courses of the axes beside the leading one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AxisCourses {
    /// The course of the leading axis, in parts of its way.
    lead: Profile,
    others: Vec<AxisCourse>,
    /// Change of speed along the path, 1/s², at which no axis needs more acceleration than it has, anywhere on the path.
    pub(super) most_accel: f64,
}

/// The course of one axis, in parts of its way, as it would be without the others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisCourse {
    axis: usize,
    profile: Profile,
}

impl AxisCourse {
    /// The state when the leading axis is at this time of its course.
    fn part_at(&self, lead: &Profile, time: f64) -> f64 {
        self.profile.state_at(time * self.stretch(lead)).place
    }

    /// By how much the course is stretched, 1 or less.
    fn stretch(&self, lead: &Profile) -> f64 {
        self.profile.duration() / lead.duration()
    }

    /// Times of the leading course at which either course changes its acceleration.
    fn bends(&self, lead: &Profile) -> Vec<f64> {
        let stretch = self.stretch(lead);
        let of_lead = lead.stretches(0.0, lead.duration()).map(|(_, end)| end);
        let own = self.profile.stretches(0.0, self.profile.duration());
        let own = own.map(|(_, end)| end / stretch);
        of_lead.chain(own).chain([0.0]).collect()
    }

    /// How much faster than the leading axis it is at most, both in parts of their ways. Between two bends the ratio of
    /// the speeds only rises or only falls.
    fn steepest(&self, lead: &Profile) -> f64 {
        let (whole, stretch) = (lead.duration(), self.stretch(lead));
        let slope = |time: f64| {
            let time = time.clamp(whole * END_PART, whole * (1.0 - END_PART));
            let own = self.profile.state_at(time * stretch).speed * stretch;
            own / lead.state_at(time).speed
        };
        self.bends(lead).into_iter().map(slope).fold(1.0, f64::max)
    }
}

impl AxisCourses {
    /// The courses of the axes that move: each with its index, its course, and the highest acceleration it has in parts
    /// of its way. Returns the index of the leading axis too; `None` if no axis moves.
    pub(super) fn new(moving: &[(usize, Profile, f64)]) -> Option<(usize, AxisCourses)> {
        let longer = |best: &(usize, Profile, f64), next: &(usize, Profile, f64)| {
            // Of axes that take equally long the first leads.
            if next.1.duration() > best.1.duration() {
                *next
            } else {
                *best
            }
        };
        let (leading, lead, accel) = moving.iter().copied().reduce(|best, next| longer(&best, &next))?;
        let mut courses = AxisCourses {
            lead,
            others: Vec::new(),
            most_accel: accel,
        };
        for &(axis, profile, accel) in moving.iter().filter(|(axis, ..)| *axis != leading) {
            let course = AxisCourse { axis, profile };
            // An axis that is k times as steep as the leading one gets k times its acceleration.
            courses.most_accel = courses.most_accel.min(accel / course.steepest(&lead));
            courses.others.push(course);
        }
        Some((leading, courses))
    }

    /// Whether the leading axis moves alone.
    pub(super) fn is_alone(&self) -> bool {
        self.others.is_empty()
    }

    /// Puts each axis where it is when the leading one has done this part of its way.
    pub(super) fn place(&self, from: &Joints, to: &Joints, part: f64, joints: &mut Joints) {
        // From the part back to the time at which the leading axis would be there, undisturbed. Feed hold and override
        // change how fast `part` grows, and not this relation.
        let time = self.lead.time_at(part);
        for course in &self.others {
            let done = course.part_at(&self.lead, time);
            if let (Some(joint), Some(from), Some(to)) = (
                joints.get_mut(course.axis),
                from.get(course.axis),
                to.get(course.axis),
            ) {
                *joint = from + (to - from) * done;
            }
        }
    }

    /// The parts of the path at which an axis changes its acceleration.
    pub(super) fn bends(&self) -> Vec<f64> {
        let bends = self.others.iter().flat_map(|course| course.bends(&self.lead));
        bends.map(|time| self.lead.state_at(time).place).collect()
    }

    /// How much faster than the leading axis any axis is at most, in parts of their ways.
    pub(super) fn steepest(&self) -> f64 {
        let slopes = self.others.iter().map(|course| course.steepest(&self.lead));
        slopes.fold(1.0, f64::max)
    }

    /// Whether a planner can have made them; for a snapshot.
    pub(super) fn is_valid(&self) -> bool {
        let fits = |course: &AxisCourse| course.axis < AXES && course.profile.is_whole();
        self.lead.is_whole()
            && !self.others.is_empty()
            && self.others.len() < AXES
            && self.others.iter().all(fits)
            && self.most_accel > 0.0
            && self.most_accel.is_finite()
    }
}
