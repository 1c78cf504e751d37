//! Virtual time and its relation to the wall clock: the four time modes of decision D12 (`--time`).
//!
//! This is the only place that reads the system clock for the controller; the controller itself sees only the times it is
//! given. Start with [`TimeMode`], then [`Clock::wake`], by which the driver decides how long to sleep.

use core::fmt;
use core::str::FromStr;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use ts3100_controller::findings::rules::MIN_POLL_INTERVAL;
use ts3100_controller::time::Time;
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::words::UnexpectedWord;

/// Time for which connections must be quiet before [`TimeMode::Auto`] jumps, unless the option `auto.silence` says
/// otherwise: long enough to read an answer that is already on the loopback. It then jumps from deadline to deadline
/// until a byte is sent or received.
pub const AUTO_GRACE: Duration = Duration::from_millis(1);
/// Longest wall-clock time spent on overdue work before hosts, requests and signals get a turn.
pub const CATCH_UP_SLICE: Duration = Duration::from_millis(3);
/// Lag of virtual time from which a warning is logged; a busy machine causes short delays.
const NOTICEABLE_LAG: Duration = Duration::from_secs(1);
/// Interval of the checks for gaps with [`TimeGap::Skip`].
pub const GAP_CHECK_INTERVAL: Duration = Duration::from_millis(100);
/// Shortest time between two checks that counts as a gap; a busy machine causes shorter ones.
const MIN_GAP: Duration = Duration::from_millis(500);
/// Largest factor of [`TimeMode::Scaled`].
pub const MAX_SCALE: f64 = 100_000.0;

/// Pace of virtual time (option `--time`).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum TimeMode {
    /// At the pace of wall-clock time.
    #[default]
    Real,
    /// This many times as fast (below 1: slower); greater than 0, at most [`MAX_SCALE`].
    Scaled(f64),
    /// Time stands still; it moves only on request.
    Stepped,
    /// It jumps to the next deadline whenever every host is silent, and passes at the pace of wall-clock time
    /// otherwise; while no peer is connected and no wait is pending, it only jumps.
    Auto,
}

/// Treatment of wall-clock time in which the emulator was stopped, as by SIGSTOP (option `--time-gap`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TimeGap {
    /// Virtual time has passed as well: what was due meanwhile happens at once, as far as a slice of work goes.
    #[default]
    CatchUp,
    /// Virtual time continues from where it stopped.
    Skip,
}

/// The words of the time modes.
const TIME_MODES: &str = "`real`, `xN` (for example `x10` or `x0.5`, at most x100000), `stepped` or `auto`";

impl TimeMode {
    /// Whether virtual time runs at least as fast as the host's clock.
    fn keeps_pace(self) -> bool {
        match self {
            TimeMode::Real | TimeMode::Auto => true,
            TimeMode::Scaled(factor) => factor >= 1.0,
            TimeMode::Stepped => false,
        }
    }
}

impl FromStr for TimeMode {
    type Err = UnexpectedWord;

    fn from_str(word: &str) -> Result<TimeMode, UnexpectedWord> {
        match word {
            "real" => Ok(TimeMode::Real),
            "stepped" => Ok(TimeMode::Stepped),
            "auto" => Ok(TimeMode::Auto),
            _ => word
                .strip_prefix('x')
                .and_then(|factor| factor.parse::<f64>().ok())
                .filter(|factor| *factor > 0.0 && *factor <= MAX_SCALE)
                .map(TimeMode::Scaled)
                .ok_or_else(|| UnexpectedWord::new(TIME_MODES, word).hinting(factor_hint(word))),
        }
    }
}

/// What was meant by `10x` or `10`.
fn factor_hint(word: &str) -> String {
    let factor = word.strip_suffix('x').unwrap_or(word);
    match factor.parse::<f64>() {
        Ok(number) if number > 0.0 && number <= MAX_SCALE => format!("; did you mean `x{factor}`?"),
        _ => String::new(),
    }
}

impl fmt::Display for TimeMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TimeMode::Real => f.write_str("real"),
            TimeMode::Scaled(factor) => write!(f, "x{factor}"),
            TimeMode::Stepped => f.write_str("stepped"),
            TimeMode::Auto => f.write_str("auto"),
        }
    }
}

/// Next wake-up of the driver if no input arrives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wake {
    /// Only on input.
    Never,
    /// After this much wall-clock time.
    After(Duration),
    /// After this much wall-clock time without input; the driver then calls [`Clock::jump`]. Zero: as soon as
    /// no input is waiting.
    JumpAfter(Duration),
}

impl Wake {
    /// The earlier of two. Of a wait and a jump after the same time it is the jump, which serves the wait as well.
    #[must_use]
    pub fn min(self, other: Wake) -> Wake {
        match (self, other) {
            (Wake::Never, only) | (only, Wake::Never) => only,
            (Wake::After(one), Wake::After(other)) => Wake::After(one.min(other)),
            (Wake::JumpAfter(one), Wake::JumpAfter(other)) => Wake::JumpAfter(one.min(other)),
            (Wake::After(wait), Wake::JumpAfter(silence)) | (Wake::JumpAfter(silence), Wake::After(wait)) => {
                if wait < silence {
                    Wake::After(wait)
                } else {
                    Wake::JumpAfter(silence)
                }
            }
        }
    }
}

/// Virtual time, derived from the wall clock by the time mode.
#[derive(Debug, Clone)]
pub struct Clock {
    mode: TimeMode,
    origin: Instant,
    base: Time,
    /// Time at which a byte was last received from a host or sent to one.
    last_activity: Instant,
    /// No peer is connected and no wait is pending.
    idle: bool,
    /// Lag of virtual time because the machine could not keep up.
    lag: Duration,
    gap: TimeGap,
    /// Time for which connections must be quiet before automatic time jumps.
    silence: Duration,
    /// Wall-clock time of the last gap check.
    last_check: Instant,
    /// Wall-clock time that was skipped.
    skipped: Duration,
    /// The moment at which wall-clock time is held.
    held: Option<Instant>,
    /// Virtual time at which it was last slower than the clocks of hosts ([`Clock::keeps_pace`]).
    lost_pace: Option<Time>,
}

impl Clock {
    /// A clock that shows [`Time::ZERO`] now. `gap` decides about time in which the process was stopped, `silence` how
    /// long connections must be quiet before [`TimeMode::Auto`] jumps.
    pub fn start(mode: TimeMode, gap: TimeGap, silence: Duration) -> Clock {
        let wall = Instant::now();
        Clock {
            mode,
            origin: wall,
            base: Time::ZERO,
            last_activity: wall,
            idle: true,
            lag: Duration::ZERO,
            gap,
            silence,
            last_check: wall,
            skipped: Duration::ZERO,
            held: None,
            lost_pace: None,
        }
    }

    /// Holds wall-clock time at a moment: worlds that are read together are read at one. `None` lets it pass.
    pub fn hold(&mut self, moment: Option<Instant>) {
        self.held = moment;
    }

    /// Wall-clock time, or the moment at which it is held.
    pub fn wall(&self) -> Instant {
        self.held.unwrap_or_else(Instant::now)
    }

    /// Time for which connections must be quiet before automatic time jumps.
    pub fn silence(&self) -> Duration {
        self.silence
    }

    /// Sets what [`Clock::silence`] returns.
    pub fn set_silence(&mut self, silence: Duration) {
        self.silence = silence;
    }

    /// Whether the silence is shorter than the timer of the runtime can tell, which counts whole milliseconds.
    pub fn needs_fine_timer(&self) -> bool {
        self.mode == TimeMode::Auto && self.silence < AUTO_GRACE
    }

    /// Interval for [`Clock::skip_gap`]; `None` if gaps are not skipped.
    pub fn gap_check_interval(&self) -> Option<Duration> {
        (self.gap == TimeGap::Skip).then_some(GAP_CHECK_INTERVAL)
    }

    /// Checks for a gap since the last call. Returns the wall-clock time that was skipped. Call it first after
    /// each wake.
    pub fn skip_gap(&mut self) -> Option<Duration> {
        // The driver calls this before each unit of work: the system clock is not asked in vain.
        if self.gap == TimeGap::CatchUp {
            return None;
        }
        let wall = self.wall();
        let since = std::mem::replace(&mut self.last_check, wall).max(self.origin);
        let missed = wall.saturating_duration_since(since);
        let stopped = match self.mode {
            TimeMode::Stepped => true,
            TimeMode::Auto => self.idle,
            TimeMode::Real | TimeMode::Scaled(_) => false,
        };
        if stopped || missed < MIN_GAP {
            return None;
        }
        self.origin += missed;
        self.skipped += missed;
        self.lost_pace = Some(self.at(wall));
        Some(missed)
    }

    /// Wall-clock time that was skipped since the clock was started.
    pub fn skipped(&self) -> Duration {
        self.skipped
    }

    /// Sets whether wall-clock time is irrelevant: no peer is connected and no wait is pending. [`TimeMode::Auto`] then
    /// stands still between two jumps, so that an undisturbed run is reproducible.
    pub fn set_idle(&mut self, idle: bool) {
        // Each new origin costs a fraction of a microsecond.
        if self.idle != idle && self.mode == TimeMode::Auto {
            let wall = self.wall();
            self.base = self.at(wall);
            self.origin = wall;
        }
        self.idle = idle;
    }

    /// Current time mode.
    pub fn mode(&self) -> TimeMode {
        self.mode
    }

    /// Changes the time mode; virtual time continues without a jump.
    pub fn set_mode(&mut self, mode: TimeMode) {
        let wall = self.wall();
        self.base = self.at(wall);
        self.origin = wall;
        self.last_activity = wall;
        if !self.mode.keeps_pace() {
            self.lost_pace = Some(self.base);
        }
        self.mode = mode;
    }

    /// Continues virtual time from `reached`, because work that was due later could not be done in time.
    /// Returns `true` once, when the total lag becomes noticeable (1 s).
    pub fn note_lag(&mut self, reached: Time) -> bool {
        let before = self.lag;
        let wall = self.wall();
        self.lag += self.at(wall).since(reached);
        (self.base, self.origin) = (reached, wall);
        self.lost_pace = Some(reached);
        before < NOTICEABLE_LAG && self.lag >= NOTICEABLE_LAG
    }

    /// Total lag of virtual time since the clock was started.
    pub fn lag(&self) -> Duration {
        self.lag
    }

    /// Notes that a byte was sent or received; `auto` waits for as much silence from now.
    pub fn note_activity(&mut self) {
        self.last_activity = self.wall();
    }

    /// Whether virtual time runs at least as fast as the host's clock at `now`, and has for as long as findings about
    /// the host's timing look back. They are invalid otherwise: a host that waited 50 ms would be accused of less,
    /// because virtual time stood still, was slow, lagged or skipped a gap meanwhile.
    pub fn keeps_pace(&self, now: Time) -> bool {
        let regained = self.lost_pace.map(|lost| lost + MIN_POLL_INTERVAL);
        self.mode.keeps_pace() && regained.is_none_or(|regained| now >= regained)
    }

    /// Current virtual time.
    pub fn now(&self) -> Time {
        self.at(self.wall())
    }

    /// Decides when to wake for `deadline` if no input arrives before.
    pub fn wake(&self, deadline: Option<Time>, host_is_silent: bool) -> Wake {
        let Some(deadline) = deadline else {
            return Wake::Never;
        };
        let wall = self.wall();
        let left = deadline.since(self.at(wall));
        match self.mode {
            _ if left.is_zero() => Wake::After(Duration::ZERO),
            TimeMode::Stepped => Wake::Never,
            TimeMode::Auto if host_is_silent => {
                let quiet = wall.saturating_duration_since(self.last_activity);
                Wake::JumpAfter(self.silence.saturating_sub(quiet).min(left))
            }
            TimeMode::Real | TimeMode::Auto => Wake::After(left),
            TimeMode::Scaled(factor) => Wake::After(scaled(left, 1.0 / factor)),
        }
    }

    /// Moves virtual time forward to `deadline`, after [`Wake::JumpAfter`]; never backward.
    pub fn jump(&mut self, deadline: Time) {
        let wall = self.wall();
        if deadline > self.at(wall) {
            self.base = deadline;
            self.origin = wall;
        }
    }

    fn at(&self, wall: Instant) -> Time {
        let passed = wall.saturating_duration_since(self.origin);
        match self.mode {
            TimeMode::Auto if self.idle => self.base,
            TimeMode::Real | TimeMode::Auto => self.base + whole_micros(passed),
            TimeMode::Scaled(factor) => self.base + whole_micros(scaled(passed, factor)),
            TimeMode::Stepped => self.base,
        }
    }
}

/// Rounded down, so that virtual time never runs ahead of the wall clock.
fn whole_micros(duration: Duration) -> Duration {
    Duration::from_micros(u64::try_from(duration.as_micros()).unwrap_or(u64::MAX))
}

fn scaled(duration: Duration, factor: f64) -> Duration {
    Duration::try_from_secs_f64(duration.as_secs_f64() * factor).unwrap_or(Duration::MAX)
}

/// Date and time of the system clock in UTC, at most the year 2069: the controller stores two digits.
pub fn system_calendar() -> CalendarTime {
    let epoch = CalendarTime {
        year: 1970,
        month: 1,
        day: 1,
        hour: 0,
        minute: 0,
        second: 0,
    };
    let seconds = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |passed| passed.as_secs());
    epoch.plus_seconds(seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    fn started(mode: TimeMode) -> Clock {
        Clock::start(mode, TimeGap::CatchUp, AUTO_GRACE)
    }

    impl Clock {
        fn wake_at(&self, wall: Instant, deadline: Option<Time>, host_is_silent: bool) -> Wake {
            let held = Some(wall);
            Clock { held, ..self.clone() }.wake(deadline, host_is_silent)
        }

        fn skip_gap_at(&mut self, wall: Instant) -> Option<Duration> {
            self.hold(Some(wall));
            self.skip_gap()
        }
    }

    #[test]
    fn of_two_wakes_the_earlier_counts_and_waits_alone_never_become_a_jump() {
        let [short, long] = [1, 2].map(Duration::from_millis);
        for (one, other, first) in [
            (Wake::Never, Wake::Never, Wake::Never),
            (Wake::Never, Wake::After(short), Wake::After(short)),
            (Wake::Never, Wake::JumpAfter(short), Wake::JumpAfter(short)),
            (Wake::After(short), Wake::After(long), Wake::After(short)),
            (
                Wake::JumpAfter(short),
                Wake::JumpAfter(long),
                Wake::JumpAfter(short),
            ),
            (Wake::After(short), Wake::JumpAfter(long), Wake::After(short)),
            (Wake::After(short), Wake::JumpAfter(short), Wake::JumpAfter(short)),
            (Wake::After(long), Wake::JumpAfter(short), Wake::JumpAfter(short)),
        ] {
            assert_eq!([one.min(other), other.min(one)], [first; 2]);
        }
    }

    #[test]
    fn modes_are_read_and_shown() {
        for word in ["real", "x10", "x0.5", "stepped", "auto"] {
            assert_eq!(word.parse::<TimeMode>().unwrap().to_string(), word);
        }
        for word in ["", "x", "x0", "x-1", "xinf", "xnan", "x1e9", "REAL", "10"] {
            assert!(word.parse::<TimeMode>().is_err(), "{word}");
        }
    }

    #[test]
    fn scaled_time_runs_by_its_factor_and_wakes_by_its_inverse() {
        let clock = started(TimeMode::Scaled(10.0));
        let later = clock.origin + SECOND;
        assert_eq!(clock.at(later), Time::from_millis(10_000));
        assert_eq!(
            clock.wake_at(later, Some(Time::from_millis(20_000)), false),
            Wake::After(SECOND)
        );
        assert_eq!(
            clock.wake_at(later, Some(Time::from_millis(9_000)), false),
            Wake::After(Duration::ZERO)
        );
        assert_eq!(clock.wake_at(later, None, true), Wake::Never);
    }

    #[test]
    fn a_clock_that_falls_behind_goes_on_from_where_it_got_to() {
        let mut clock = started(TimeMode::Scaled(1_000.0));
        clock.origin = clock.origin.checked_sub(SECOND).unwrap();
        assert!(clock.now() >= Time::from_millis(1_000_000));
        assert!(clock.note_lag(Time::from_millis(7)));
        assert!(clock.now() >= Time::from_millis(7) && clock.now() < Time::from_millis(900_000));
        assert!(clock.lag() >= Duration::from_secs(999));
        assert!(!clock.note_lag(Time::from_millis(8)), "said once");
        let mut clock = started(TimeMode::Real);
        clock.origin = clock.origin.checked_sub(SECOND / 2).unwrap();
        assert!(!clock.note_lag(Time::ZERO), "not worth a word");
    }

    #[test]
    fn the_pace_of_hosts_is_judged_again_when_time_has_kept_up_for_as_long_as_a_rule_looks_back() {
        let keeps_up = |clock: &Clock| {
            let reached = clock.now();
            let regained = reached + MIN_POLL_INTERVAL;
            assert!(!clock.keeps_pace(regained - Duration::from_micros(1)));
            clock.keeps_pace(regained)
        };
        let mut clock = started(TimeMode::Real);
        clock.hold(Some(clock.origin + SECOND));
        assert!(clock.keeps_pace(Time::ZERO));
        clock.note_lag(Time::from_millis(900));
        assert!(keeps_up(&clock), "it lagged");
        clock.set_mode(TimeMode::Auto);
        clock.set_mode(TimeMode::Scaled(2.0));
        clock.hold(Some(clock.wall() + SECOND));
        assert!(clock.keeps_pace(clock.now()), "other paces, but none too slow");
        for slow in [TimeMode::Scaled(0.9), TimeMode::Stepped] {
            clock.set_mode(slow);
            assert!(!clock.keeps_pace(clock.now() + SECOND), "{slow}");
            clock.set_mode(TimeMode::Real);
            assert!(keeps_up(&clock), "it was {slow}");
        }
        let mut clock = Clock::start(TimeMode::Real, TimeGap::Skip, AUTO_GRACE);
        assert!(clock.skip_gap_at(clock.origin + SECOND).is_some());
        clock.hold(Some(clock.last_check));
        assert!(keeps_up(&clock), "it skipped a gap");
    }

    #[test]
    fn time_that_was_not_served_is_skipped_or_caught_up() {
        let (hour, moment) = (SECOND * 3_600, Duration::from_millis(100));
        for (mode, gap, passes) in [
            (TimeMode::Real, TimeGap::CatchUp, hour + moment * 2),
            (TimeMode::Real, TimeGap::Skip, moment * 2),
            (TimeMode::Scaled(10.0), TimeGap::Skip, SECOND * 2),
            (TimeMode::Scaled(10.0), TimeGap::CatchUp, hour * 10 + SECOND * 2),
            (TimeMode::Stepped, TimeGap::Skip, Duration::ZERO),
        ] {
            let mut clock = Clock::start(mode, gap, AUTO_GRACE);
            let stopped = clock.origin + moment;
            assert_eq!(clock.skip_gap_at(stopped), None, "a look is no gap");
            let runs_again = stopped + hour;
            let skips = gap == TimeGap::Skip && mode != TimeMode::Stepped;
            assert_eq!(clock.skip_gap_at(runs_again), skips.then_some(hour), "{mode}");
            assert_eq!(clock.skipped(), if skips { hour } else { Duration::ZERO });
            let later = runs_again + moment;
            assert_eq!(clock.skip_gap_at(later), None);
            assert_eq!(clock.at(later), Time::ZERO + passes, "{mode} {gap:?}");
            let due = clock.at(later) + SECOND;
            assert!(
                clock.at(later) < due
                    && clock.wake_at(later, Some(due), false) != Wake::After(Duration::ZERO)
            );
        }
    }

    #[test]
    fn stepped_time_stands_still_but_serves_what_is_due() {
        let clock = started(TimeMode::Stepped);
        let later = clock.origin + SECOND;
        assert_eq!(clock.at(later), Time::ZERO);
        assert_eq!(
            clock.wake_at(later, Some(Time::from_millis(1)), true),
            Wake::Never
        );
        assert_eq!(
            clock.wake_at(later, Some(Time::ZERO), true),
            Wake::After(Duration::ZERO)
        );
    }

    #[test]
    fn auto_jumps_only_while_the_hosts_are_silent() {
        let mut clock = started(TimeMode::Auto);
        clock.idle = false;
        let start = clock.origin;
        let hour = Time::from_millis(3_600_000);
        assert_eq!(
            clock.wake_at(start, Some(hour), true),
            Wake::JumpAfter(AUTO_GRACE)
        );
        assert_eq!(
            clock.wake_at(start, Some(hour), false),
            Wake::After(Duration::from_secs(3_600))
        );
        let later = start + AUTO_GRACE / 4;
        assert_eq!(
            clock.wake_at(later, Some(hour), true),
            Wake::JumpAfter(AUTO_GRACE * 3 / 4)
        );
        let quiet = start + AUTO_GRACE;
        assert_eq!(
            clock.wake_at(quiet, Some(hour), true),
            Wake::JumpAfter(Duration::ZERO)
        );
        clock.jump(hour);
        assert!(clock.now() >= hour);
        clock.jump(Time::ZERO);
        assert!(clock.now() >= hour, "time never runs back");
    }

    #[test]
    fn auto_stands_between_jumps_while_nobody_is_there() {
        let mut clock = started(TimeMode::Auto);
        let later = clock.origin + SECOND;
        assert_eq!(clock.at(later), Time::ZERO);
        let hour = Time::from_millis(3_600_000);
        assert_eq!(
            clock.wake_at(later, Some(hour), true),
            Wake::JumpAfter(Duration::ZERO)
        );
        clock.jump(hour);
        assert_eq!(clock.at(clock.origin + SECOND), hour);
        clock.set_idle(false);
        assert_eq!(clock.at(clock.origin + SECOND), hour + SECOND);
        // Real time is wall-clock time, whoever is connected.
        clock.set_mode(TimeMode::Real);
        clock.set_idle(true);
        assert!(clock.at(clock.origin + SECOND) >= hour + SECOND);
    }

    #[test]
    fn who_connects_takes_no_time_from_a_clock_that_does_not_stand() {
        for (mode, passed) in [(TimeMode::Real, 900), (TimeMode::Scaled(0.01), 9)] {
            let mut clock = started(mode);
            let start = clock.origin;
            for turn in 1..=1_000 {
                clock.hold(Some(start + Duration::from_nanos(900) * turn));
                clock.set_idle(turn % 2 == 0);
            }
            assert_eq!(clock.now(), Time::from_micros(passed), "{mode}");
        }
    }
}
