//! The speed along a path: accelerate, cruise and brake to rest at the end, or brake to rest on the way, from any state.
//!
//! Closed form: the state at a time is computed from that time alone. `path` and `plan` supply the path and its rates.

use libm::sqrt;

/// Most phases a profile has: up or down to cruising speed, cruising, braking.
const PHASES: usize = 3;
/// Rates of a path on which almost nothing moves, 1/s and 1/s²: at 100 % such a path takes 2 ms.
const MAX_RATE: f64 = 1e6;

/// How fast a path may be run through, in parts of the path: 1/s and 1/s².
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rates {
    /// Cruising speed.
    pub speed: f64,
    /// Acceleration.
    pub accel: f64,
    /// Deceleration, as a positive number.
    pub decel: f64,
}

/// Limits of the arm on a path, in parts of the path: 1/s and 1/s².
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ability {
    /// Speed at 100 %, of which SPEED and the override are parts.
    pub speed: f64,
    /// Acceleration and deceleration at 100 %, of which ACCEL and DECEL are parts.
    pub accel: f64,
    /// Speed never exceeded, whatever is asked for.
    pub most_speed: f64,
    /// Acceleration and deceleration never exceeded.
    pub most_accel: f64,
}

impl Ability {
    /// Of a path on which nothing holds the arm back.
    pub const FREE: Ability = Ability {
        speed: MAX_RATE,
        accel: MAX_RATE,
        most_speed: MAX_RATE,
        most_accel: MAX_RATE,
    };

    /// Of a path on which something moves, to be bounded by all that does: a short way of a quick axis takes more than the
    /// highest rate of a path on which nothing moves.
    pub const UNBOUNDED: Ability = Ability {
        speed: f64::INFINITY,
        accel: f64::INFINITY,
        most_speed: f64::INFINITY,
        most_accel: f64::INFINITY,
    };

    /// At 100 %: something that goes so far per whole path, and how fast it can.
    #[must_use]
    pub fn bounded(mut self, way: f64, speed: f64, accel: f64) -> Ability {
        if way > 0.0 {
            self.speed = self.speed.min(speed / way);
            self.accel = self.accel.min(accel / way);
        }
        self
    }

    /// The same, whatever is asked for.
    #[must_use]
    pub fn capped(mut self, way: f64, speed: f64, accel: f64) -> Ability {
        if way > 0.0 {
            self.most_speed = self.most_speed.min(speed / way);
            self.most_accel = self.most_accel.min(accel / way);
        }
        self
    }

    /// The speed at which a bend asks for this acceleration: `bend` is the second derivative by the path.
    #[must_use]
    pub fn bent(mut self, bend: f64, accel: f64) -> Ability {
        if bend > 0.0 {
            self.most_speed = self.most_speed.min(sqrt(accel / bend));
        }
        self
    }

    /// Rates with these parts of speed, acceleration and deceleration.
    pub fn rates(&self, speed: f64, accel: f64, decel: f64) -> Rates {
        Rates {
            speed: (self.speed * speed).min(self.most_speed),
            accel: (self.accel * accel).min(self.most_accel),
            decel: (self.accel * decel).min(self.most_accel),
        }
    }
}

/// Where on the path, and how fast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathState {
    /// Place, 0 to the length of the path.
    pub place: f64,
    /// Speed, 0 or more.
    pub speed: f64,
}

impl PathState {
    /// At rest at a place.
    pub const fn at_rest(place: f64) -> PathState {
        PathState { place, speed: 0.0 }
    }
}

/// A stretch of constant acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ProfilePhase {
    duration: f64,
    speed: f64,
    accel: f64,
}

impl ProfilePhase {
    /// From one speed to another at this acceleration or deceleration (positive).
    fn change(from: f64, to: f64, rate: f64) -> ProfilePhase {
        let accel = if to < from { -rate } else { rate };
        ProfilePhase {
            duration: (to - from).abs() / rate,
            speed: from,
            accel,
        }
    }

    /// At one speed along a way.
    fn steady(way: f64, speed: f64) -> ProfilePhase {
        let (duration, accel) = (way / speed, 0.0);
        ProfilePhase {
            duration,
            speed,
            accel,
        }
    }

    fn whole_way(&self) -> f64 {
        self.way(self.duration)
    }

    /// Way gone after `time` in this phase.
    fn way(&self, time: f64) -> f64 {
        self.speed * time + 0.5 * self.accel * time * time
    }
}

/// The course in time from a state to rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    start: f64,
    end: f64,
    phases: [ProfilePhase; PHASES],
}

impl Profile {
    /// At rest at a place.
    pub fn resting(place: f64) -> Profile {
        Profile::new(PathState::at_rest(place), place, &[])
    }

    /// The quickest way from a state to rest at `length`. A state faster than the cruising speed is slowed to it
    /// first; one that can no longer stop at `length` at the deceleration given brakes as much harder as it takes.
    pub fn to_end(from: PathState, length: f64, rates: &Rates) -> Profile {
        let way = length - from.place;
        if way <= 0.0 {
            return Profile::resting(length);
        }
        let Rates {
            speed: cruise,
            accel,
            decel,
        } = *rates;
        let v = from.speed;
        if v * v >= 2.0 * decel * way {
            // From v to rest within `way`: v² = 2 a way.
            let brake = ProfilePhase::change(v, 0.0, v * v / (2.0 * way));
            return Profile::new(from, length, &[brake]);
        }
        // Speed at which accelerating and braking alone would fill the way:
        // way = (peak² - v²) / 2a + peak² / 2d. It is above v, because v² < 2 d way.
        let peak = sqrt((way + v * v / (2.0 * accel)) * 2.0 * accel * decel / (accel + decel));
        let top = peak.min(cruise);
        // Hence only the cruising speed can be below v.
        let rate = if top < v { decel } else { accel };
        let first = ProfilePhase::change(v, top, rate);
        let last = ProfilePhase::change(top, 0.0, decel);
        let rest = (way - first.whole_way() - last.whole_way()).max(0.0);
        Profile::new(from, length, &[first, ProfilePhase::steady(rest, top), last])
    }

    /// As [`Profile::to_end`], but a state faster than the cruising speed is slowed to it at `slowing`.
    pub fn to_end_slowing(from: PathState, length: f64, rates: &Rates, slowing: f64) -> Profile {
        let (way, v) = (length - from.place, from.speed);
        if way <= 0.0 || v <= rates.speed || slowing <= rates.decel {
            return Profile::to_end(from, length, rates);
        }
        let first = ProfilePhase::change(v, rates.speed, slowing);
        let last = ProfilePhase::change(rates.speed, 0.0, rates.decel);
        let rest = way - first.whole_way() - last.whole_way();
        if rest >= 0.0 {
            let cruise = ProfilePhase::steady(rest, rates.speed);
            return Profile::new(from, length, &[first, cruise, last]);
        }
        let room = 2.0 * slowing * way - v * v;
        if room <= 0.0 {
            return Profile::to_end(from, length, rates);
        }
        // The cruising speed comes too late: from this lower one the last deceleration fills the way.
        // way = (v² - low²) / 2s + low² / 2d, with s for `slowing`. Dividing is safe: s > d here.
        let low = sqrt(room / (slowing / rates.decel - 1.0));
        let first = ProfilePhase::change(v, low, slowing);
        Profile::new(
            from,
            length,
            &[first, ProfilePhase::change(low, 0.0, rates.decel)],
        )
    }

    /// From a state at the cruising speed through `length`: for a path that comes to rest there by itself.
    pub fn through(from: PathState, length: f64, rates: &Rates) -> Profile {
        let way = length - from.place;
        if way <= 0.0 {
            return Profile::resting(length);
        }
        let v = from.speed;
        let rate = if rates.speed < v { rates.decel } else { rates.accel };
        let change = ProfilePhase::change(v, rates.speed, rate);
        let rest = way - change.whole_way();
        if rest >= 0.0 {
            let cruise = ProfilePhase::steady(rest, rates.speed);
            return Profile::new(from, length, &[change, cruise]);
        }
        // The end comes before the cruising speed does.
        let last = sqrt((v * v + 2.0 * change.accel * way).max(0.0));
        Profile::new(from, length, &[ProfilePhase::change(v, last, rate)])
    }

    /// Slowing from a state to rest at this deceleration, at `length` at the latest.
    pub fn to_rest(from: PathState, length: f64, decel: f64) -> Profile {
        // A state too fast to rest before `length` brakes harder: `to_end` lets it rest there, never beyond the path.
        let way = from.speed * from.speed / (2.0 * decel);
        if from.place + way >= length {
            let (speed, accel) = (from.speed, decel);
            return Profile::to_end(from, length, &Rates { speed, accel, decel });
        }
        let brake = ProfilePhase::change(from.speed, 0.0, decel);
        Profile::new(from, from.place + way, &[brake])
    }

    /// The phases that are not given take no time.
    fn new(from: PathState, end: f64, given: &[ProfilePhase]) -> Profile {
        let mut phases = [ProfilePhase::default(); PHASES];
        for (phase, given) in phases.iter_mut().zip(given) {
            *phase = *given;
        }
        let start = from.place;
        Profile { start, end, phases }
    }

    /// Seconds until rest.
    pub fn duration(&self) -> f64 {
        self.phases.iter().map(|phase| phase.duration).sum()
    }

    /// The stretches of steady acceleration between two times, from the start: each with its begin and end.
    pub fn stretches(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> {
        let ends = self.phases.iter().scan(0.0, |time, phase| {
            let begin = *time;
            *time += phase.duration;
            Some((begin, *time))
        });
        let within = move |(begin, end): (f64, f64)| (begin.max(from), end.min(to));
        ends.map(within).filter(|(begin, end)| begin < end)
    }

    /// Whether it leads from one end of a path to the other, and is valid; for a snapshot.
    pub fn is_whole(&self) -> bool {
        self.is_valid() && self.duration() > 0.0 && [self.start, self.end] == [0.0, 1.0]
    }

    /// Whether it is made of numbers and never leads back; for a snapshot.
    pub fn is_valid(&self) -> bool {
        let is_number = |phase: &ProfilePhase| {
            phase.duration >= 0.0
                && phase.duration.is_finite()
                && phase.speed.is_finite()
                && phase.accel.is_finite()
        };
        let ends = self.start.is_finite() && self.end.is_finite() && self.start <= self.end;
        ends && self.phases.iter().all(is_number)
    }

    /// Where it rests.
    pub fn end(&self) -> f64 {
        self.end
    }

    /// Seconds until `place` is reached; until rest, if it is not.
    pub fn time_at(&self, place: f64) -> f64 {
        let (mut left, mut time) = (place - self.start, 0.0);
        if left <= 0.0 {
            return 0.0;
        }
        for phase in &self.phases {
            let way = phase.whole_way();
            if left < way {
                // left = v t + a t² / 2. The usual root, (speed - v) / a, has no value while cruising (a = 0) and loses
                // digits near it; this form of the same root does not.
                let speed = sqrt((phase.speed * phase.speed + 2.0 * phase.accel * left).max(0.0));
                return time + (2.0 * left / (phase.speed + speed)).min(phase.duration);
            }
            left -= way;
            time += phase.duration;
        }
        time
    }

    /// Seconds of changing speed at the beginning, and of braking at the end.
    pub fn ramps(&self) -> (f64, f64) {
        let mut phases = self.phases.iter().filter(|phase| phase.duration > 0.0);
        let begins = phases.clone().next().filter(|phase| phase.accel > 0.0);
        let ends = phases.next_back().filter(|phase| phase.accel < 0.0);
        let seconds = |phase: Option<&ProfilePhase>| phase.map_or(0.0, |phase| phase.duration);
        (seconds(begins), seconds(ends))
    }

    /// The state `time` seconds after the start.
    pub fn state_at(&self, time: f64) -> PathState {
        let (mut place, mut left) = (self.start, time.max(0.0));
        for phase in &self.phases {
            if left < phase.duration {
                // Rounding may not lead past the end, nor back.
                return PathState {
                    place: (place + phase.way(left)).clamp(self.start, self.end),
                    speed: (phase.speed + phase.accel * left).max(0.0),
                };
            }
            place += phase.whole_way();
            left -= phase.duration;
        }
        PathState::at_rest(self.end)
    }
}

#[cfg(test)]
mod tests {
    use super::{PathState, Profile, Rates};

    const RATES: Rates = Rates {
        speed: 0.5,
        accel: 1.0,
        decel: 2.0,
    };

    fn at(place: f64, speed: f64) -> PathState {
        PathState { place, speed }
    }

    #[test]
    fn a_long_way_takes_the_closed_form_time() {
        // 0.5 s up, 0.25 s down, the way left over at 0.5.
        let profile = Profile::to_end(at(0.0, 0.0), 1.0, &RATES);
        assert!((profile.duration() - (0.5 + 0.25 + (1.0 - 0.125 - 0.0625) / 0.5)).abs() < 1e-12);
        assert_eq!(profile.state_at(0.5), at(0.125, 0.5));
        assert_eq!(profile.state_at(99.0), at(1.0, 0.0));
    }

    #[test]
    fn a_short_way_never_reaches_cruising_speed() {
        let profile = Profile::to_end(at(0.9, 0.0), 1.0, &RATES);
        let peak = (0.1f64 * 2.0 * 2.0 / 3.0).sqrt();
        assert!((profile.duration() - (peak / 1.0 + peak / 2.0)).abs() < 1e-12);
    }

    #[test]
    fn too_fast_a_state_is_slowed_first_and_a_late_one_brakes_harder() {
        let profile = Profile::to_end(at(0.0, 1.0), 1.0, &RATES);
        assert!((profile.state_at(0.25).speed - 0.5).abs() < 1e-12);
        let late = Profile::to_end(at(0.9, 1.0), 1.0, &RATES);
        assert!((late.duration() - 0.2).abs() < 1e-12);
        assert_eq!(late.end(), 1.0);
    }

    #[test]
    fn rest_is_on_the_way_or_at_the_end_and_never_beyond() {
        let brake = Profile::to_rest(at(0.2, 0.4), 1.0, 2.0);
        assert!((brake.end() - 0.24).abs() < 1e-12 && (brake.duration() - 0.2).abs() < 1e-12);
        assert_eq!(Profile::to_rest(at(0.99, 0.4), 1.0, 2.0).end(), 1.0);
        assert_eq!(Profile::to_rest(at(0.3, 0.0), 1.0, 2.0).end(), 0.3);
    }

    #[test]
    fn a_path_that_rests_by_itself_is_run_through_at_cruising_speed() {
        let steady = Profile::through(at(0.0, 0.5), 1.0, &RATES);
        assert!((steady.duration() - 2.0).abs() < 1e-12);
        let slowed = Profile::through(at(0.0, 1.5), 1.0, &RATES);
        // 0.5 s from 1.5 to 0.5, half the way; the rest at 0.5.
        assert!((slowed.duration() - 1.5).abs() < 1e-12);
        let late = Profile::through(at(0.98, 0.0), 1.0, &RATES);
        assert!((late.duration() - 0.2).abs() < 1e-12 && late.end() == 1.0);
    }

    #[test]
    fn the_time_of_a_place_is_that_at_which_the_state_is_there() {
        for from in [at(0.0, 0.0), at(0.1, 0.3), at(0.4, 0.9)] {
            let profile = Profile::to_end(from, 1.0, &RATES);
            for step in 1..100 {
                let time = profile.duration() * f64::from(step) / 100.0;
                let found = profile.time_at(profile.state_at(time).place);
                assert!((found - time).abs() < 1e-9, "{found} is not {time}");
            }
            assert_eq!(profile.time_at(2.0), profile.duration());
            assert_eq!(profile.time_at(0.0), 0.0);
        }
        assert_eq!(Profile::to_end(at(0.0, 0.0), 1.0, &RATES).ramps(), (0.5, 0.25));
        assert_eq!(Profile::through(at(0.0, 0.5), 1.0, &RATES).ramps(), (0.0, 0.0));
    }

    #[test]
    fn state_is_continuous_and_never_goes_back() {
        for from in [at(0.0, 0.0), at(0.1, 0.3), at(0.4, 0.9)] {
            let profile = Profile::to_end(from, 1.0, &RATES);
            let mut last = from;
            for step in 0..=1000 {
                let state = profile.state_at(profile.duration() * f64::from(step) / 1000.0);
                assert!(state.place >= last.place && state.place - last.place < 0.01);
                assert!((state.speed - last.speed).abs() < 0.02);
                last = state;
            }
        }
    }
}
