//! PASS: consecutive motions that overlap. While one brakes, the next accelerates; what both move is added, axis by
//! axis, so the joints round the corner between them and neither speed is exceeded. Like the arch a function of time.
//! Whether two motions may be blended is decided here; how the whole is run through is left to `run`.
//!
//! ```text
//!  speed   ______                ______
//!         /      \              /      \        overlap = PASS % of the shorter of the two ramps
//!  leg 1 /        \     leg 2  /        \
//!       +----------+   +      +----------+
//!                 |<-->| nothing overlaps (PASS 0)        >|--|<   100 %: one ramp
//! ```

use super::kinematics::place;
use super::path::Path;
use super::pose::{Transform, minus, norm, plus_times};
use super::profile::{Profile, Rates, State};
#[cfg(feature = "serde")]
use crate::model::ArmKind;
use crate::model::{ArmModel, Joints};
use alloc::vec::Vec;
use libm::sqrt;

/// Places of the overlap at which limits and tool speed are looked at.
const LOOKS: u32 = 64;
/// Rounding allowed when one motion ends and another brakes, s: a few microseconds.
const ROUNDING: f64 = 1e-5;
/// Part of a path over which its direction at an end is looked at.
const END: f64 = 1e-3;
/// By how much the tool may be faster between two of them, and in the overlap than on either leg.
pub(super) const LOOKING_MARGIN: f64 = 1.05;
/// How far the next motion may begin from the end of this one, degrees or mm.
const JOINED: f64 = 1e-6;
/// Legs kept: one that ends, one that begins, and the one added behind it.
const MOST_LEGS: usize = 3;

/// One motion of a chain.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub(super) struct Leg {
    pub(super) path: Path,
    /// Its course as its own SPEED, ACCEL and DECEL ask for it.
    pub(super) profile: Profile,
    /// Seconds after the beginning of the chain.
    pub(super) begins: f64,
    rates: Rates,
    /// Most the tool point moves, mm per whole path.
    tool_way: f64,
}

impl Leg {
    /// A leg from a state on its path.
    pub(super) fn new(path: Path, state: State, rates: &Rates, tool_way: f64, begins: f64) -> Leg {
        Leg {
            path,
            profile: Profile::to_end(state, 1.0, rates),
            begins,
            rates: *rates,
            tool_way,
        }
    }

    /// Fastest the tool point is on it, mm/s.
    pub(super) fn top_speed(&self) -> f64 {
        self.tool_way * self.rates.speed
    }

    /// The same, not begun yet, gathering speed so many times as slowly.
    fn gathering(self, times: f64) -> Leg {
        let accel = self.rates.accel / times;
        let rates = Rates { accel, ..self.rates };
        let start = State {
            place: 0.0,
            speed: 0.0,
        };
        Leg::new(self.path, start, &rates, self.tool_way, self.begins)
    }

    /// The same from `now` on, braking so many times as slowly, and not before `busy`, when the motion before it rests;
    /// `None` when there is no room left for that at the rate of time given.
    fn braking(self, now: f64, rate: f64, times: f64, busy: f64) -> Option<Leg> {
        let begins = self.begins.max(now);
        let state = self.profile.state_at(begins - self.begins);
        let decel = self.rates.decel / times;
        let speed = state.speed * rate;
        if speed * speed > 2.0 * decel * (1.0 - state.place) {
            return None;
        }
        let mut rates = Rates { decel, ..self.rates };
        rates.speed = rates.speed.min(top_before_braking(&rates, state, busy - begins));
        let leg = Leg::new(self.path, state, &rates, self.tool_way, begins);
        let (_, brakes) = leg.profile.ramps();
        (leg.ends() - brakes >= busy - ROUNDING).then_some(leg)
    }

    /// Acceleration of each axis and of the tool point at one end of the path, at `rate` along it.
    fn accel_at_end(&self, model: &ArmModel, tool: &Transform, last: bool, rate: f64) -> (Joints, [f64; 3]) {
        let (from, to) = if last { (1.0 - END, 1.0) } else { (0.0, END) };
        let (from, to) = (self.path.joints_at(from), self.path.joints_at(to));
        let point = |joints: &Joints| place(&model.kind, joints).0.compose(tool).origin;
        let way = minus(point(&to), point(&from)).map(|way| way * rate / END);
        let mut joints = to;
        for (joint, from) in joints.iter_mut().zip(from) {
            *joint = (*joint - from) * rate / END;
        }
        (joints, way)
    }

    fn ends(&self) -> f64 {
        self.begins + self.profile.duration()
    }

    fn joints_at(&self, time: f64) -> Joints {
        let time = time - self.begins;
        if time >= self.profile.duration() {
            return self.path.joints_at(1.0);
        }
        self.path.joints_at(self.profile.state_at(time).place)
    }
}

/// Motions that overlap, in seconds from the beginning of the first.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub(super) struct Chain {
    legs: Vec<Leg>,
    pub(super) duration: f64,
}

impl Chain {
    pub(super) fn of(first: Leg) -> Chain {
        Chain {
            duration: first.ends(),
            legs: Vec::from([first]),
        }
    }

    /// Whether it is one of an arm of this kind, for a chain that was read.
    #[cfg(feature = "serde")]
    pub(super) fn is_of(&self, kind: &ArmKind) -> bool {
        let legs = 1..=MOST_LEGS + 1;
        legs.contains(&self.legs.len())
            && self.duration > 0.0
            && self
                .legs
                .iter()
                .all(|leg| !matches!(leg.path, Path::Chain(_)) && leg.path.is_of(kind))
    }

    /// Fastest the tool point is, mm/s, with a margin for where two motions are added.
    pub(super) fn top_speed(&self) -> f64 {
        let fastest = self.legs.iter().map(Leg::top_speed).fold(0.0, f64::max);
        fastest * LOOKING_MARGIN
    }

    /// Adds a motion that overlaps the last one by a part of the shorter ramp; both ramps are as much longer as it
    /// takes for the two accelerations together to be no more than the arm has. `None` where there is no room for
    /// that; where the sum would leave the limits, or the tool be faster than on either leg; where nothing is left to
    /// overlap; where the motion does not begin where the last one ends; or where too many are waiting already. `now` and `rate` are the present time of
    /// the chain and how fast it goes by.
    pub(super) fn with(
        mut self,
        model: &ArmModel,
        tool: &Transform,
        mut next: Leg,
        (now, rate): (f64, f64),
        overlap: f64,
    ) -> Option<Chain> {
        let mut last = self.legs.pop()?;
        let joined = last.path.joints_at(1.0);
        let begins = next.path.joints_at(0.0);
        if joined.iter().zip(begins).any(|(a, b)| (a - b).abs() > JOINED) {
            return None;
        }
        let times = sharpness(model, tool, &last, &next);
        if times > 1.0 {
            let busy = self.legs.last().map_or(now, Leg::ends);
            last = last.braking(now, rate, times, busy)?;
            next = next.gathering(times);
        }
        let (_, brakes) = last.profile.ramps();
        let (gathers, _) = next.profile.ramps();
        let shared = (overlap.clamp(0.0, 1.0) * brakes.min(gathers)).min(last.ends() - now);
        if shared.is_nan() || shared <= 0.0 {
            return None;
        }
        let (from, to) = (last.ends() - shared, last.ends());
        next.begins = from;
        self.duration = next.ends();
        self.legs.push(last);
        self.legs.push(next);
        if self.legs.len() > MOST_LEGS && self.legs.remove(0).ends() > now {
            return None;
        }
        self.fits(model, tool, from, to).then_some(self)
    }

    fn fits(&self, model: &ArmModel, tool: &Transform, from: f64, to: f64) -> bool {
        let step = (to - from) / f64::from(LOOKS);
        let top = self.top_speed();
        let mut last: Option<[f64; 3]> = None;
        (0..=LOOKS).all(|look| {
            let joints = self.joints_at(from + step * f64::from(look));
            let here = place(&model.kind, &joints).0.compose(tool).origin;
            let speed = last.map_or(0.0, |last| norm(minus(here, last)) / step);
            last = Some(here);
            model.check_limits(&joints).is_ok() && speed <= top
        })
    }

    /// The joints: the leg begun last, and what the one before it has still to go.
    pub(super) fn joints_at(&self, time: f64) -> Joints {
        let current = self.current(time);
        let Some(leg) = self.legs.get(current) else {
            return Joints::default();
        };
        let mut joints = leg.joints_at(time);
        let before = current.checked_sub(1).and_then(|index| self.legs.get(index));
        if let Some(before) = before.filter(|before| time < before.ends()) {
            let (at, end) = (before.joints_at(time), before.path.joints_at(1.0));
            for ((joint, at), end) in joints.iter_mut().zip(at).zip(end) {
                *joint += at - end;
            }
        }
        joints
    }

    /// Where the last leg ends, exactly.
    pub(super) fn end(&self) -> Joints {
        self.legs
            .last()
            .map_or(Joints::default(), |leg| leg.path.joints_at(1.0))
    }

    /// When the leg added last begins.
    pub(super) fn last_begins(&self) -> f64 {
        self.legs.last().map_or(0.0, |leg| leg.begins)
    }

    /// Part of the leg begun last that is gone.
    pub(super) fn part_at(&self, time: f64) -> f64 {
        let leg = self.legs.get(self.current(time));
        leg.map_or(1.0, |leg| leg.profile.state_at(time - leg.begins).place)
    }

    fn current(&self, time: f64) -> usize {
        self.legs.iter().rposition(|leg| leg.begins <= time).unwrap_or(0)
    }
}

/// Highest speed at which a path gone through from a state is not braked on before so many seconds have gone.
fn top_before_braking(rates: &Rates, state: State, seconds: f64) -> f64 {
    // As if it had gathered all its speed from rest, which took `seconds` more and a way of its own. What the speed goes
    // through in that time, less what gathering it costs, and the way of braking make up the whole.
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
fn sharpness(model: &ArmModel, tool: &Transform, last: &Leg, next: &Leg) -> f64 {
    let (braking, tool_brakes) = last.accel_at_end(model, tool, true, -last.rates.decel);
    let (gathering, tool_gathers) = next.accel_at_end(model, tool, false, next.rates.accel);
    let axes = braking.iter().zip(gathering).zip(&model.axes);
    let most = axes
        .map(|((braking, gathering), axis)| (braking + gathering).abs() / axis.max_accel)
        .fold(0.0, f64::max);
    match (&last.path, &next.path) {
        (Path::Guided(_), Path::Guided(_)) => {
            most.max(norm(plus_times(tool_brakes, tool_gathers, 1.0)) / model.max_tool_accel)
        }
        _ => most,
    }
}
