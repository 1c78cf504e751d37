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
use super::pose::{Transform, minus, norm};
use super::profile::{Profile, Rates, State};
use crate::model::{ArmModel, Joints};
use alloc::vec::Vec;

/// Places of the overlap at which limits and tool speed are looked at.
const LOOKS: u32 = 64;
/// By how much the tool may be faster between two of them, and in the overlap than on either leg.
pub(super) const LOOKING_MARGIN: f64 = 1.05;
/// How far the next motion may begin from the end of this one, degrees or mm.
const JOINED: f64 = 1e-6;
/// Legs kept: one that ends, one that begins, and the one added behind it.
const MOST_LEGS: usize = 3;

/// One motion of a chain.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Leg {
    pub(super) path: Path,
    /// Its course as its own SPEED, ACCEL and DECEL ask for it.
    pub(super) profile: Profile,
    /// Seconds after the beginning of the chain.
    pub(super) begins: f64,
    /// Fastest the tool point is on it, mm/s.
    pub(super) top_speed: f64,
}

impl Leg {
    /// A leg from a state on its path.
    pub(super) fn new(path: Path, state: State, rates: &Rates, tool_way: f64, begins: f64) -> Leg {
        Leg {
            path,
            profile: Profile::to_end(state, 1.0, rates),
            begins,
            top_speed: tool_way * rates.speed,
        }
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

    /// Fastest the tool point is, mm/s, with a margin for where two motions are added.
    pub(super) fn top_speed(&self) -> f64 {
        let fastest = self.legs.iter().map(|leg| leg.top_speed).fold(0.0, f64::max);
        fastest * LOOKING_MARGIN
    }

    /// Adds a motion that overlaps the last one by a part of the shorter ramp. `None` where the sum would leave the
    /// limits, or the tool be faster than on either leg; where nothing is left to overlap; where the motion does not
    /// begin where the last one ends; or where too many are waiting already.
    pub(super) fn with(
        mut self,
        model: &ArmModel,
        tool: &Transform,
        mut next: Leg,
        now: f64,
        overlap: f64,
    ) -> Option<Chain> {
        let last = self.legs.last()?;
        let joined = last.path.joints_at(1.0);
        let begins = next.path.joints_at(0.0);
        if joined.iter().zip(begins).any(|(a, b)| (a - b).abs() > JOINED) {
            return None;
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
