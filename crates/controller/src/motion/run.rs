//! A planned motion in time: where its joints are, and how feed hold, BREAK and a new override change its course.
//!
//! `plan` creates motions. Times count from the start of the motion; the caller has the clock.

use super::effort::{Effort, between};
use super::path::{Chain, ChainedMotion, Path, SAMPLED_SPEED_MARGIN};
use super::pose::Transform;
use super::profile::{Ability, PathState, Profile, Rates};
use super::{Limits, MIN_FRACTION, MIN_TOOL_SPEED};
use crate::model::{ArmModel, Joints};
use crate::prelude::*;
use core::time::Duration;
use libm::ceil;

/// Rounding allowed before a duration counts as the next microsecond, in microseconds: 0.25 s computed as
/// 250000.00000001 us stays 250000.
const MICROSECOND_SLACK: f64 = 1e-3;

/// The time of an event that never happens.
const NEVER: Duration = Duration::from_micros(u64::MAX);

/// Highest rate of a path that takes no time, 1/s.
const MAX_TIME_RATE: f64 = 1e6;

/// ```text
/// Moving --hold--> Held --resume--> Moving
///   |               |
///   +-----stop------+--> Stopped --continue_from--> Moving
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum MotionPhase {
    /// On the way to the end.
    Moving,
    /// Feed hold: slowing on the path, or at rest on it.
    Held,
    /// Given up: slowing on the path, or at rest on it.
    Stopped,
}

/// A motion under way: a value, asked with the time since its start. It keeps the course since the last change
/// (hold, resume, stop, new limits) only: an earlier time is answered as the time of that change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    path: Path,
    /// Limits of the arm on this path.
    full: Ability,
    /// Most the tool point moves, mm per whole path.
    tool_way: f64,
    limits: Limits,
    phase: MotionPhase,
    /// Course since `since`.
    profile: Profile,
    since: Duration,
    /// When the motion added last by PASS began or will begin, as far as is known.
    joined: Duration,
    /// When the one before it began.
    before: Duration,
}

impl Motion {
    pub(super) fn new(path: Path, full: Ability, tool_way: f64, limits: &Limits) -> Motion {
        let still = path.joints_at(0.0) == path.joints_at(1.0) && tool_way <= 0.0;
        Motion::starting(path, full, tool_way, limits, still)
    }

    /// A motion whose path is a function of time and rests at its end by itself: it takes `duration` seconds as
    /// SPEED asks for it, the override is a factor on the time. Its feed hold takes as long as the slowest axis needs
    /// from full speed to rest (assumed).
    pub(super) fn timed(
        path: Path,
        model: &ArmModel,
        duration: f64,
        tool_way: f64,
        limits: &Limits,
    ) -> Motion {
        let ramps = model.axes.iter().map(|axis| axis.max_speed / axis.max_accel);
        let ramp = ramps.fold(model.max_tool_speed / model.max_tool_accel, f64::max);
        let speed = (1.0 / duration).min(MAX_TIME_RATE);
        let full = Ability {
            speed,
            accel: speed / ramp,
            ..Ability::FREE
        };
        Motion::starting(path, full, tool_way, limits, duration <= 0.0)
    }

    /// A motion without length is `still`. A path that rests at its end by itself begins at its full speed too.
    fn starting(path: Path, full: Ability, tool_way: f64, limits: &Limits, still: bool) -> Motion {
        let mut motion = Motion {
            path,
            full,
            tool_way,
            limits: *limits,
            phase: MotionPhase::Moving,
            profile: Profile::resting(1.0),
            since: Duration::ZERO,
            joined: Duration::ZERO,
            before: Duration::ZERO,
        };
        if !still {
            let timed = motion.path.is_timed();
            let speed = if timed { motion.rates().speed } else { 0.0 };
            motion.profile = motion.to_end(PathState { place: 0.0, speed });
        }
        motion
    }

    /// PASS: this motion, under way since its start, and after it `next`, planned from its end at rest; the two overlap
    /// by `pass` percent of the shorter of the two ramps, braking of this one and gathering speed of the next. The
    /// result takes this one's place: its times count from the same start, and at `at` it agrees with this one.
    /// Override and cap stay this one's; from here on the override is a factor on the time. `tool` is the tool point
    /// as seen from the flange.
    ///
    /// `None` where they cannot be blended, and the next has to be started when this one rests: one of them is held,
    /// given up, over, an arch or no way at all; the next begins elsewhere; `pass` is 0; two are waiting already; the
    /// rounded corner would leave the limits of an axis or need a faster tool than either motion has.
    ///
    /// No axis is faster than on the faster of the two; where the second goes back, both decelerations add up
    /// (assumed).
    #[must_use]
    pub fn blend(
        &self,
        model: &ArmModel,
        at: Duration,
        next: &Motion,
        pass: f64,
        tool: &Transform,
    ) -> Option<Motion> {
        let under_way = self.phase == MotionPhase::Moving && at < self.duration();
        let fresh = next.phase == MotionPhase::Moving && next.since.is_zero() && !next.duration().is_zero();
        if !under_way || !fresh || next.path.is_timed() {
            return None;
        }
        let limits = Limits {
            override_part: self.limits.override_part,
            tool_speed_cap: self.limits.tool_speed_cap,
            ..next.limits
        };
        let asked = nominal_rates(&next.full, &next.limits);
        let start = PathState::at_rest(0.0);
        // As at override 100. The chain is a function of time, and the override scales that time.
        let chained = ChainedMotion::new(next.path.clone(), start, &asked, next.tool_way, 0.0);
        let state = self.state_at(at);
        let (chain, now, rate) = match &self.path {
            Path::Chain(chain) => {
                let chain = Chain::clone(chain);
                let (now, rate) = (state.place * chain.duration, state.speed * chain.duration);
                (chain, now, rate)
            }
            Path::Tool(_) if self.path.is_timed() => return None,
            path @ (Path::Joint { .. } | Path::Tool(_)) => {
                // Its speed as it would be at override 100, so that the chain goes on at the present one.
                let own = nominal_rates(&self.full, &self.limits);
                let fastest = chained.top_speed().max(self.tool_way * own.speed) * SAMPLED_SPEED_MARGIN;
                let rate = capped_speed(clamp_fraction(limits.override_part), fastest, &limits);
                let speed = state.speed / rate;
                let state = PathState { speed, ..state };
                let first = ChainedMotion::new(path.clone(), state, &own, self.tool_way, 0.0);
                (Chain::new(first), 0.0, rate)
            }
        };
        let chain = chain.append(model, tool, chained, (now, rate), pass / 100.0)?;
        // A chain is followed by its own time: a place is a part of its duration, a rate is seconds of the chain per
        // second. `now` and `rate` carry the present state over, so at `at` the arm neither jumps nor changes its
        // speed.
        let (duration, top) = (chain.duration, chain.top_speed());
        let path = Path::Chain(Box::new(chain));
        let mut blended = Motion::timed(path, model, duration, top * duration, &limits);
        let state = PathState {
            place: now / duration,
            speed: rate / duration,
        };
        blended.profile = blended.to_end(state);
        blended.since = self.since.max(at);
        blended.joined = blended.joins_at();
        blended.before = self.joined;
        Some(blended)
    }

    /// When, after its start, the motion added last by [`Motion::blend`] begins, or the only one; `None` if it does not,
    /// because it is held or given up before.
    pub fn last_begins(&self) -> Option<Duration> {
        Some(self.joined).filter(|joined| *joined < NEVER)
    }

    /// Whether the motion added last by [`Motion::blend`] has begun by `t`; true of one that is not blended.
    pub fn last_has_begun(&self, t: Duration) -> bool {
        t >= self.joined
    }

    /// How long the motion under way at `t`, the one begun last, has gone on by then.
    pub fn elapsed_at(&self, t: Duration) -> Duration {
        t.checked_sub(self.joined)
            .unwrap_or(t.saturating_sub(self.before))
    }

    /// When the present course comes to the motion added last; [`NEVER`] when it ends before.
    fn joins_at(&self) -> Duration {
        match &self.path {
            Path::Chain(chain) => {
                // A held or stopped course can rest before it comes to the motion added last.
                let place = chain.last_begins() / chain.duration;
                if self.profile.end() < place {
                    return NEVER;
                }
                let seconds = self.profile.time_at(place);
                let after = Duration::try_from_secs_f64(seconds).unwrap_or(NEVER);
                self.since.saturating_add(after).min(NEVER)
            }
            Path::Joint { .. } | Path::Tool(_) => Duration::ZERO,
        }
    }

    /// Joints at `t` after the start; from [`Motion::duration`] on, where the motion rests.
    pub fn joints_at(&self, t: Duration) -> Joints {
        self.path.joints_at(self.state_at(t).place)
    }

    /// Joints at this part of the path, 0 to 1, whenever the motion gets there; of motions blended or of an arch, at
    /// this part of the time.
    pub fn joints_along(&self, part: f64) -> Joints {
        self.path.joints_at(part)
    }

    /// Effort of the axes between two times after the start. `load` is the part of their acceleration that the load
    /// leaves them.
    pub fn effort(&self, model: &ArmModel, load: f64, from: Duration, to: Duration) -> Effort {
        let (from, to) = (self.course_seconds(from), self.course_seconds(to));
        between(model, &self.path, &self.profile, load, (from, to))
    }

    /// When, after its start, the motion rests: at its end, or where feed hold or stop lets it rest. Rounded up to
    /// a whole microsecond.
    pub fn duration(&self) -> Duration {
        // Up and not down: at the deadline the profile is over, and the joints are exactly those of its end.
        let micros = ceil(self.profile.duration() * 1e6 - MICROSECOND_SLACK);
        // A float converts to the nearest integer there is: nothing wraps.
        self.since.saturating_add(Duration::from_micros(micros as u64))
    }

    /// Part of the path gone, 0 to 100; of an arch, of its time; of motions blended, of the one begun last.
    pub fn percent_at(&self, t: Duration) -> f64 {
        let place = self.state_at(t).place;
        match &self.path {
            Path::Chain(chain) if place < 1.0 => chain.part_at(place * chain.duration) * 100.0,
            Path::Chain(_) | Path::Joint { .. } | Path::Tool(_) => place * 100.0,
        }
    }

    /// Feed hold: from `at` on the motion slows along its path and rests there. Nothing happens to one that is
    /// held, stopped, or over.
    pub fn hold(&mut self, at: Duration) {
        if self.phase == MotionPhase::Moving && at < self.duration() {
            self.change(MotionPhase::Held, at);
        }
    }

    /// Whether feed hold is on.
    pub fn is_held(&self) -> bool {
        self.phase == MotionPhase::Held
    }

    /// Feed hold released: the motion continues from its present place to its end. A motion that is not held is
    /// unchanged.
    pub fn resume(&mut self, at: Duration) {
        if self.phase == MotionPhase::Held {
            self.change(MotionPhase::Moving, at);
        }
    }

    /// New limits from `at` on: the motion continues from its present place and speed. A held one takes them when it is
    /// resumed; a stopped or finished one does not.
    pub fn set_limits(&mut self, at: Duration, limits: &Limits) {
        match self.phase {
            MotionPhase::Moving if at < self.duration() => {
                self.limits = *limits;
                self.change(MotionPhase::Moving, at);
            }
            MotionPhase::Held => self.limits = *limits,
            MotionPhase::Moving | MotionPhase::Stopped => {}
        }
    }

    /// The motion is given up: from `at` on it slows at full deceleration and ends where it rests. A held one that
    /// rests already ends at once.
    pub fn stop(&mut self, at: Duration) {
        if self.phase == MotionPhase::Held || (self.phase == MotionPhase::Moving && at < self.duration()) {
            self.change(MotionPhase::Stopped, at);
        }
    }

    /// Whether it was given up.
    pub fn is_stopped(&self) -> bool {
        self.phase == MotionPhase::Stopped
    }

    /// Continues a motion that was given up, from its place at `at`, within these limits.
    pub fn continue_from(&mut self, at: Duration, limits: &Limits) {
        if self.phase == MotionPhase::Stopped {
            self.phase = MotionPhase::Held;
            self.limits = *limits;
            self.resume(at);
        }
    }

    /// Joints at rest: the target's, or where feed hold or stop lets it rest.
    pub fn end(&self) -> Joints {
        self.path.joints_at(self.profile.end())
    }

    /// Where it leads: its target, also while feed hold lets it rest before; of one given up, where it rests.
    pub fn target(&self) -> Joints {
        match self.phase {
            MotionPhase::Stopped => self.end(),
            MotionPhase::Moving | MotionPhase::Held => self.path.joints_at(1.0),
        }
    }

    /// Whether its times and places are numbers, with an end; for a motion that was read.
    pub fn is_valid(&self, model: &ArmModel) -> bool {
        let times = [self.since, self.joined, self.before];
        times.iter().all(|time| *time <= NEVER)
            && self.tool_way.is_finite()
            && self.profile.is_valid()
            && self.profile.duration().is_finite()
            && self.path.is_valid(model)
    }

    fn rates(&self) -> Rates {
        let limits = &self.limits;
        let asked = if self.path.is_timed() {
            self.full.rates(clamp_fraction(limits.override_part), 1.0, 1.0)
        } else if let Path::Joint { .. } = self.path {
            // The override is a factor on the time of the motion (T27.15).
            let part = clamp_fraction(limits.override_part);
            let own = nominal_rates(&self.full, limits);
            Rates {
                speed: own.speed * part,
                accel: own.accel * part * part,
                decel: own.decel * part * part,
            }
        } else {
            // A line or an arc: the override is a part of the speed, the ramps stay (motion-11).
            let speed = limits.speed * limits.override_part;
            nominal_rates(&self.full, &Limits { speed, ..*limits })
        };
        let speed = capped_speed(asked.speed, self.tool_way, limits);
        Rates { speed, ..asked }
    }

    /// The course to the end: to rest there, or through it where the path rests by itself.
    fn to_end(&self, state: PathState) -> Profile {
        let mut rates = self.rates();
        match &self.path {
            path if path.is_timed() => Profile::through(state, 1.0, &rates),
            Path::Joint { .. } => {
                // From its start the leading axis gathers speed as it can; on the way no axis may be asked for too much.
                if state.place > 0.0 {
                    rates.accel = rates.accel.min(self.path.most_accel().unwrap_or(f64::MAX));
                }
                Profile::to_end_slowing(state, 1.0, &rates, self.slowing())
            }
            Path::Tool(_) | Path::Chain(_) => Profile::to_end(state, 1.0, &rates),
        }
    }

    /// Deceleration to a lower speed or to rest on the way. That of a motion of all joints does not depend on the
    /// override: at a low one the arm would rest too late.
    fn slowing(&self) -> f64 {
        match &self.path {
            Path::Joint { .. } => {
                let own = nominal_rates(&self.full, &self.limits).decel;
                own.min(self.path.most_accel().unwrap_or(own))
            }
            Path::Tool(_) | Path::Chain(_) => self.rates().decel,
        }
    }

    /// Seconds of the present course at `t` after the start.
    fn course_seconds(&self, t: Duration) -> f64 {
        t.saturating_sub(self.since).as_secs_f64()
    }

    fn state_at(&self, t: Duration) -> PathState {
        if t < self.duration() {
            self.profile.state_at(self.course_seconds(t))
        } else {
            PathState::at_rest(self.profile.end())
        }
    }

    /// The course from `at` on is that of this phase.
    fn change(&mut self, phase: MotionPhase, at: Duration) {
        let state = self.state_at(at);
        self.profile = match phase {
            MotionPhase::Moving => self.to_end(state),
            MotionPhase::Held => Profile::to_rest(state, 1.0, self.slowing()),
            MotionPhase::Stopped => {
                // BREAK and stop brake as hard as the arm can, whatever DECEL says.
                let full = self.full.rates(1.0, 1.0, 1.0).decel;
                let decel = full.min(self.path.most_accel().unwrap_or(full));
                Profile::to_rest(state, 1.0, decel)
            }
        };
        // The course begins anew at the present place and speed, and an earlier one is forgotten.
        self.since = self.since.max(at);
        self.phase = phase;
        // What has begun already has its time; what is still to come moves with the new course.
        if self.joined > self.since {
            self.joined = self.joins_at();
        }
    }
}

/// Rates of a path as its own conditions ask for it: override 100, no cap.
pub(super) fn nominal_rates(full: &Ability, limits: &Limits) -> Rates {
    let [speed, accel, decel] = [limits.speed, limits.accel, limits.decel].map(clamp_fraction);
    full.rates(speed, accel, decel)
}

/// The speed, in parts of a path, at which the tool point keeps to the cap.
fn capped_speed(speed: f64, tool_way: f64, limits: &Limits) -> f64 {
    match limits.tool_speed_cap {
        Some(cap) if tool_way > 0.0 => speed.min(cap.max(MIN_TOOL_SPEED) / tool_way),
        _ => speed,
    }
}

/// A part of full speed or acceleration, brought into range.
pub(super) fn clamp_fraction(value: f64) -> f64 {
    if value >= MIN_FRACTION {
        value.min(1.0)
    } else {
        MIN_FRACTION
    }
}
