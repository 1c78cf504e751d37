//! PASS: consecutive motions that overlap. While one brakes, the next accelerates.
//!
//! The movements of both are added axis by axis, so the joints round the corner and neither speed is exceeded. Like an
//! arch, a chain is a function of time. This module decides whether two motions can be blended; `run` executes the chain.
//!
//! ```text
//!  speed   ______                ______
//!         /      \              /      \        overlap = PASS % of the shorter of the two ramps
//! motion /        \  motion 2   /        \
//!   1   +----------+   +      +----------+
//!                 |<-->| no overlap (PASS 0)             >|--|<   100 %: one ramp
//! ```

use super::Path;
use crate::model::{ArmModel, Joints};
use crate::motion::kinematics::place;
use crate::motion::pose::{Transform, minus, norm, plus};
use crate::motion::profile::{PathState, Profile, Rates};
use crate::prelude::*;
use libm::sqrt;

/// Points of the overlap at which limits and tool speed are checked.
const CHECKED_POINTS: u32 = 64;
/// Rounding allowed when one motion ends and another brakes, s: a few microseconds.
const ROUNDING: f64 = 1e-5;
/// Rounding of a time of the chain that was a part of its duration, s: a motion that begins now has begun.
const INSTANT: f64 = 1e-9;
/// Part of a path over which its direction at an end is measured.
const END_PART: f64 = 1e-3;
/// Factor by which the tool may be faster between two of these points, and in the overlap than in either motion.
pub(in crate::motion) const SAMPLED_SPEED_MARGIN: f64 = 1.05;
/// Largest distance between the end of a motion and the start of the next, degrees or mm.
const MAX_JOIN_GAP: f64 = 1e-6;
/// Motions kept: one that ends, one that begins, and the one added after it.
const MAX_MOTIONS: usize = 3;

/// One motion of a chain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::motion) struct ChainedMotion {
    pub(in crate::motion) path: Path,
    /// Its course as its own SPEED, ACCEL and DECEL ask for it.
    pub(in crate::motion) profile: Profile,
    /// Seconds after the beginning of the chain.
    pub(in crate::motion) begins: f64,
    rates: Rates,
    /// Most the tool point moves, mm per whole path.
    tool_way: f64,
}

impl ChainedMotion {
    /// Whether its numbers are possible, for one that was read.
    fn is_valid(&self) -> bool {
        let Rates { speed, accel, decel } = self.rates;
        let is_rate = |rate: f64| rate > 0.0 && rate.is_finite();
        let is_amount = |amount: f64| amount >= 0.0 && amount.is_finite();
        self.profile.is_valid()
            && self.profile.duration().is_finite()
            && [speed, accel, decel].into_iter().all(is_rate)
            && [self.begins, self.tool_way].into_iter().all(is_amount)
    }

    /// A motion from a state on its path.
    pub(in crate::motion) fn new(
        path: Path,
        state: PathState,
        rates: &Rates,
        tool_way: f64,
        begins: f64,
    ) -> ChainedMotion {
        ChainedMotion {
            path,
            profile: Profile::to_end(state, 1.0, rates),
            begins,
            rates: *rates,
            tool_way,
        }
    }

    /// Fastest the tool point is on it, mm/s.
    pub(in crate::motion) fn top_speed(&self) -> f64 {
        self.tool_way * self.rates.speed
    }

    /// The same, not begun yet, with an acceleration divided by this factor.
    fn with_slower_start(self, times: f64) -> ChainedMotion {
        let accel = self.rates.accel / times;
        let rates = Rates { accel, ..self.rates };
        let start = PathState::at_rest(0.0);
        ChainedMotion::new(self.path, start, &rates, self.tool_way, self.begins)
    }

    /// The same from `now` on, with a deceleration divided by this factor, and not before `busy`, when the motion
    /// before it rests; `None` when there is no room left for that at the rate of time given.
    fn with_slower_end(self, now: f64, rate: f64, times: f64, busy: f64) -> Option<ChainedMotion> {
        let begins = self.begins.max(now);
        let state = self.profile.state_at(begins - self.begins);
        let decel = self.rates.decel / times;
        let speed = state.speed * rate;
        // It could no longer rest at its end.
        if speed * speed > 2.0 * decel * (1.0 - state.place) {
            return None;
        }
        let mut rates = Rates { decel, ..self.rates };
        rates.speed = rates.speed.min(peak_speed_before(&rates, state, busy - begins));
        let motion = ChainedMotion::new(self.path, state, &rates, self.tool_way, begins);
        let (_, brakes) = motion.profile.ramps();
        (motion.end_time() - brakes >= busy - ROUNDING).then_some(motion)
    }

    /// Acceleration of each axis and of the tool point at one end of the path, at `rate` along it.
    fn accel_at_end(&self, model: &ArmModel, tool: &Transform, last: bool, rate: f64) -> (Joints, [f64; 3]) {
        // At an end the speed is 0, so the direction of the path there times the change of speed along it is all the
        // acceleration there is; the bend of the path does not count yet.
        let (from, to) = if last {
            (1.0 - END_PART, 1.0)
        } else {
            (0.0, END_PART)
        };
        let (from, to) = (self.path.joints_at(from), self.path.joints_at(to));
        let point = |joints: &Joints| place(&model.kind, joints).0.compose(tool).origin;
        let way = minus(point(&to), point(&from));
        let accel = |way: f64| way * rate / END_PART;
        (minus(to, from).map(accel), way.map(accel))
    }

    fn end_time(&self) -> f64 {
        self.begins + self.profile.duration()
    }

    fn joints_at(&self, time: f64) -> Joints {
        let time = (time - self.begins).max(0.0);
        if time >= self.profile.duration() {
            return self.path.joints_at(1.0);
        }
        self.path.joints_at(self.profile.state_at(time).place)
    }
}

/// Motions that overlap, in seconds from the beginning of the first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::motion) struct Chain {
    motions: Vec<ChainedMotion>,
    pub(in crate::motion) duration: f64,
}

impl Chain {
    pub(in crate::motion) fn new(first: ChainedMotion) -> Chain {
        Chain {
            duration: first.end_time(),
            motions: Vec::from([first]),
        }
    }

    /// Whether this arm can follow it, for a chain that was read.
    pub(in crate::motion) fn is_valid(&self, model: &ArmModel) -> bool {
        let count = 1..=MAX_MOTIONS + 1;
        let fits = |path: &Path| !matches!(path, Path::Chain(_)) && path.is_valid(model);
        let fit = self
            .motions
            .iter()
            .all(|motion| fits(&motion.path) && motion.is_valid());
        let step = self.duration / f64::from(CHECKED_POINTS);
        let mut looks = (0..=CHECKED_POINTS).map(|look| self.joints_at(step * f64::from(look)));
        count.contains(&self.motions.len())
            && self.duration > 0.0
            && self.duration.is_finite()
            && fit
            && looks.all(|joints| model.check_limits(&joints).is_ok())
    }

    /// Fastest the tool point is, mm/s, with a margin for where two motions are added.
    pub(in crate::motion) fn top_speed(&self) -> f64 {
        let speeds = self.motions.iter().map(ChainedMotion::top_speed);
        speeds.fold(0.0, f64::max) * SAMPLED_SPEED_MARGIN
    }

    /// Adds a motion that overlaps the last one by a part of the shorter ramp; both ramps are as much longer as it
    /// takes for the two accelerations together to be no more than the arm has. `None` where there is no room for
    /// that; where the sum would leave the limits, or the tool be faster than on either motion; where nothing is left to
    /// overlap; where the motion does not begin where the last one ends; or where too many are waiting already. `now` and `rate` are the present time of
    /// the chain and how fast it goes by.
    pub(in crate::motion) fn append(
        mut self,
        model: &ArmModel,
        tool: &Transform,
        mut next: ChainedMotion,
        (now, rate): (f64, f64),
        overlap: f64,
    ) -> Option<Chain> {
        let mut last = self.motions.pop()?;
        let joined = last.path.joints_at(1.0);
        let gaps = minus(joined, next.path.joints_at(0.0));
        if gaps.iter().any(|gap| gap.abs() > MAX_JOIN_GAP) {
            return None;
        }
        // Both ramps by the same factor, so the sum of the two accelerations falls by it.
        let times = accel_ratio(model, tool, &last, &next);
        if times > 1.0 {
            let busy = self.motions.last().map_or(now, ChainedMotion::end_time);
            last = last.with_slower_end(now, rate, times, busy)?;
            next = next.with_slower_start(times);
        }
        let (_, brakes) = last.profile.ramps();
        let (gathers, _) = next.profile.ramps();
        // PASS is a share of the shorter ramp, and what has gone by cannot overlap any more.
        let shared = (overlap.clamp(0.0, 1.0) * brakes.min(gathers)).min(last.end_time() - now);
        if shared.is_nan() || shared <= 0.0 {
            return None;
        }
        let (from, to) = (last.end_time() - shared, last.end_time());
        next.begins = from;
        self.duration = next.end_time();
        self.motions.push(last);
        self.motions.push(next);
        // The oldest motion makes room if it is over. One that still moves cannot, because its rest is added to the
        // joints.
        if self.motions.len() > MAX_MOTIONS && self.motions.remove(0).end_time() > now {
            return None;
        }
        self.fits(model, tool, from, to).then_some(self)
    }

    fn fits(&self, model: &ArmModel, tool: &Transform, from: f64, to: f64) -> bool {
        let step = (to - from) / f64::from(CHECKED_POINTS);
        let top = self.top_speed();
        let mut last: Option<[f64; 3]> = None;
        (0..=CHECKED_POINTS).all(|look| {
            let joints = self.joints_at(from + step * f64::from(look));
            let here = place(&model.kind, &joints).0.compose(tool).origin;
            let speed = last.map_or(0.0, |last| norm(minus(here, last)) / step);
            last = Some(here);
            model.check_limits(&joints).is_ok() && speed <= top
        })
    }

    /// The joints: the motion begun last, plus the remaining way of the one before it.
    pub(in crate::motion) fn joints_at(&self, time: f64) -> Joints {
        let current = self.current(time);
        let Some(motion) = self.motions.get(current) else {
            return Joints::default();
        };
        let joints = motion.joints_at(time);
        let before = current.checked_sub(1).and_then(|index| self.motions.get(index));
        match before.filter(|before| time < before.end_time()) {
            // The next motion was planned from the end of the one before. What that one has still to go is added axis
            // by axis, and is 0 when it ends: the sum has no jump.
            Some(before) => plus(joints, minus(before.joints_at(time), before.path.joints_at(1.0))),
            None => joints,
        }
    }

    /// Where the last motion ends, exactly.
    pub(in crate::motion) fn end(&self) -> Joints {
        let last = self.motions.last();
        last.map_or(Joints::default(), |motion| motion.path.joints_at(1.0))
    }

    /// When the motion added last begins.
    pub(in crate::motion) fn last_begins(&self) -> f64 {
        self.motions.last().map_or(0.0, |motion| motion.begins)
    }

    /// Part of the motion begun last that is gone.
    pub(in crate::motion) fn part_at(&self, time: f64) -> f64 {
        let motion = self.motions.get(self.current(time));
        motion.map_or(1.0, |motion| {
            motion.profile.state_at((time - motion.begins).max(0.0)).place
        })
    }

    fn current(&self, time: f64) -> usize {
        let begun = { self.motions.iter() }.rposition(|motion| motion.begins <= time + INSTANT);
        begun.unwrap_or(0)
    }
}

/// Highest speed at which a path gone through from a state is not braked on before so many seconds have gone.
fn peak_speed_before(rates: &Rates, state: PathState, seconds: f64) -> f64 {
    // From speed v to the peak p at acceleration a, on at p until `seconds` have gone, then braking at d:
    // (p² - v²) / 2a + p (seconds - (p - v) / a) + p² / 2d = what is left of the path. With the names below that is
    // bend p² + time p - way = 0. The root is written so that it holds for bend = 0, where a and d are equal.
    let way = 1.0 - state.place + 0.5 * state.speed * state.speed / rates.accel;
    let time = seconds + state.speed / rates.accel;
    let bend = 0.5 / rates.decel - 0.5 / rates.accel;
    let root = time * time + 4.0 * bend * way;
    if seconds <= 0.0 || root < 0.0 {
        return rates.speed;
    }
    2.0 * way / (time + sqrt(root))
}

/// How many times as much as the arm has the two accelerations ask for together, while one motion brakes and the next
/// gathers speed: of any axis, and of the tool point between two motions that guide it.
fn accel_ratio(model: &ArmModel, tool: &Transform, last: &ChainedMotion, next: &ChainedMotion) -> f64 {
    let (braking, tool_brakes) = last.accel_at_end(model, tool, true, -last.rates.decel);
    let (gathering, tool_gathers) = next.accel_at_end(model, tool, false, next.rates.accel);
    let axes = braking.iter().zip(gathering).zip(&model.axes);
    let most = axes
        .map(|((braking, gathering), axis)| (braking + gathering).abs() / axis.max_accel)
        .fold(0.0, f64::max);
    match (&last.path, &next.path) {
        (Path::Tool(_), Path::Tool(_)) => {
            most.max(norm(plus(tool_brakes, tool_gathers)) / model.max_tool_accel)
        }
        _ => most,
    }
}
