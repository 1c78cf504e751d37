//! A motion in time: where its joints are, and how feed hold, BREAK and a new override change its course.
//! How it came about is `plan`'s; times count from its own start, the clock is the caller's.

use super::path::Path;
use super::profile::{Profile, Rates, State};
use super::{Limits, MIN_FRACTION, MIN_TOOL_SPEED};
use crate::model::{ArmModel, Joints};
use core::time::Duration;
use libm::ceil;

/// Rounding allowed before a duration counts as the next microsecond, in microseconds.
const MICROSECOND_SLACK: f64 = 1e-3;

/// ```text
/// Moving --hold--> Held --resume--> Moving
///   |               |
///   +-----stop------+--> Stopped (final)
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// On the way to the end.
    Moving,
    /// Feed hold: slowing on the path, or at rest on it.
    Held,
    /// Given up: slowing on the path, or at rest on it for good.
    Stopped,
}

/// A motion under way: a value, asked with the time since its start. It keeps the course since the last change
/// (hold, resume, stop, new limits) only: an earlier time is answered as the time of that change.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    path: Path,
    /// What the model can do on this path at 100 %.
    full: Rates,
    /// Most the tool point moves, mm per whole path.
    tool_way: f64,
    limits: Limits,
    phase: Phase,
    /// Course since `since`.
    profile: Profile,
    since: Duration,
}

impl Motion {
    pub(super) fn new(path: Path, full: Rates, tool_way: f64, limits: &Limits) -> Motion {
        let still = path.joints_at(0.0) == path.joints_at(1.0) && tool_way <= 0.0;
        let start = State {
            place: if still { 1.0 } else { 0.0 },
            speed: 0.0,
        };
        let profile = Profile::to_end(start, 1.0, &rates(&full, tool_way, limits));
        Motion {
            path,
            full,
            tool_way,
            limits: *limits,
            phase: Phase::Moving,
            profile,
            since: Duration::ZERO,
        }
    }

    /// Joints at `t` after the start; from [`Motion::duration`] on, where the motion rests.
    /// `_model` is the model the motion was planned for: the motion carries what it needs of it.
    #[must_use]
    pub fn joints_at(&self, _model: &ArmModel, t: Duration) -> Joints {
        self.path.joints_at(self.state_at(t).place)
    }

    /// When, after its start, the motion rests: at its end, or where feed hold or stop lets it rest. Rounded up to
    /// a whole microsecond.
    #[must_use]
    pub fn duration(&self) -> Duration {
        let micros = ceil(self.profile.duration() * 1e6 - MICROSECOND_SLACK);
        // A float converts to the nearest integer there is: nothing wraps.
        self.since.saturating_add(Duration::from_micros(micros as u64))
    }

    /// Part of the path gone, 0 to 100.
    #[must_use]
    pub fn percent_at(&self, t: Duration) -> f64 {
        self.state_at(t).place * 100.0
    }

    /// Feed hold: from `at` on the motion slows along its path and rests there. Nothing happens to one that is
    /// held, stopped, or over.
    pub fn hold(&mut self, _model: &ArmModel, at: Duration) {
        if self.phase == Phase::Moving && at < self.duration() {
            let decel = self.rates().decel;
            self.change(Phase::Held, at, |state| Profile::to_rest(state, 1.0, decel));
        }
    }

    /// Whether feed hold is on.
    #[must_use]
    pub fn is_held(&self) -> bool {
        self.phase == Phase::Held
    }

    /// When, after its start, a held motion rests; `None` when it is not held.
    #[must_use]
    pub fn rest_at(&self) -> Option<Duration> {
        self.is_held().then(|| self.duration())
    }

    /// Feed hold released: the motion goes on from where it is, to its end. Nothing happens to one not held.
    pub fn resume(&mut self, at: Duration) {
        if self.phase == Phase::Held {
            let rates = self.rates();
            self.change(Phase::Moving, at, |state| Profile::to_end(state, 1.0, &rates));
        }
    }

    /// New limits from `at` on: the motion goes on from its present place and speed. A held one takes them when it
    /// is resumed; one stopped or over does not.
    pub fn set_limits(&mut self, at: Duration, limits: &Limits) {
        match self.phase {
            Phase::Moving if at < self.duration() => {
                self.limits = *limits;
                let rates = self.rates();
                self.change(Phase::Moving, at, |state| Profile::to_end(state, 1.0, &rates));
            }
            Phase::Held => self.limits = *limits,
            Phase::Moving | Phase::Stopped => {}
        }
    }

    /// The motion is given up: from `at` on it slows at full deceleration and ends where it rests. A held one that
    /// rests already ends at once.
    pub fn stop(&mut self, at: Duration) {
        if self.phase == Phase::Held || (self.phase == Phase::Moving && at < self.duration()) {
            let decel = self.full.decel;
            self.change(Phase::Stopped, at, |state| Profile::to_rest(state, 1.0, decel));
        }
    }

    /// Joints at rest: the target's, or where feed hold or stop lets it rest.
    #[must_use]
    pub fn end(&self) -> Joints {
        self.path.joints_at(self.profile.end())
    }

    fn rates(&self) -> Rates {
        rates(&self.full, self.tool_way, &self.limits)
    }

    fn state_at(&self, t: Duration) -> State {
        let time = if t >= self.duration() {
            f64::INFINITY
        } else {
            t.saturating_sub(self.since).as_secs_f64()
        };
        self.profile.state_at(time)
    }

    fn change(&mut self, phase: Phase, at: Duration, profile: impl FnOnce(State) -> Profile) {
        self.profile = profile(self.state_at(at));
        self.since = self.since.max(at);
        self.phase = phase;
    }
}

fn rates(full: &Rates, tool_way: f64, limits: &Limits) -> Rates {
    let part = |value: f64| {
        if value >= MIN_FRACTION {
            value.min(1.0)
        } else {
            MIN_FRACTION
        }
    };
    let asked = full.speed * part(limits.speed);
    let speed = match limits.tool_speed_cap {
        Some(cap) if tool_way > 0.0 => {
            let cap = if cap >= MIN_TOOL_SPEED {
                cap
            } else {
                MIN_TOOL_SPEED
            };
            asked.min(cap / tool_way)
        }
        _ => asked,
    };
    Rates {
        speed,
        accel: full.accel * part(limits.accel),
        decel: full.decel * part(limits.decel),
    }
}
