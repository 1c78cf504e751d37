//! Arch motion (MOVEJ): up, across at the height of the gate, and down; each is a line with its own profile, and they
//! overlap.
//!
//! The place is a function of time, so an arch is executed at a rate of time (see `run`). `plan` checks reach and limits.

use super::profile::{PathState, Profile, Rates};
use libm::hypot;

/// Distances of an arch in mm (T11). The library's manual names them; what they are measured from is inferred.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate {
    /// Height of the way across, above the higher of start and end.
    pub retreat: f64,
    /// Straight up from the start, before the way across begins.
    pub single_axis_1: f64,
    /// Straight down to the end, after the way across.
    pub single_axis_2: f64,
}

/// One of the three lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stretch {
    /// mm; 0 or more.
    pub(super) way: f64,
    /// Rates of the line; `None` when nothing moves on it.
    pub(super) rates: Option<Rates>,
}

impl Stretch {
    fn profile(&self) -> Profile {
        let course = |rates| Profile::to_end(PathState::at_rest(0.0), 1.0, &rates);
        self.rates.map_or(Profile::resting(1.0), course)
    }

    fn speed(&self) -> f64 {
        self.rates.map_or(0.0, |rates| rates.speed * self.way)
    }
}

/// The way of the tool point, as a part of the whole time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Arch {
    from: [f64; 3],
    to: [f64; 3],
    /// Ways up and down, mm.
    up_way: f64,
    down_way: f64,
    up: Profile,
    across: Profile,
    down: Profile,
    across_from: f64,
    down_from: f64,
    /// Seconds.
    pub(super) duration: f64,
    /// Fastest the tool point is, mm/s.
    pub(super) top_speed: f64,
    /// Length of the three lines, mm.
    pub(super) length: f64,
}

impl Arch {
    /// The way across begins when the arm has risen by `single_axis_1`, and ends when `single_axis_2` is left.
    pub(super) fn new(from: [f64; 3], to: [f64; 3], gate: &Gate, stretches: &[Stretch; 3]) -> Arch {
        let [up, across, down] = stretches;
        let profiles = stretches.map(|stretch| stretch.profile());
        // A line without length is over at once, and nothing has to wait for it.
        let part = |way: f64, whole: f64| if whole > 0.0 { way / whole } else { 1.0 };
        let across_from = profiles[0].time_at(part(gate.single_axis_1, up.way));
        let across_end = across_from + profiles[1].duration();
        // How long the way down takes until only `single_axis_2` is left: so much of it may overlap the way across.
        let free = profiles[2].time_at(1.0 - part(gate.single_axis_2, down.way).min(1.0));
        // Not before the way up has ended either, because the same axis does both.
        let down_from = profiles[0].duration().max(across_end - free);
        Arch {
            from,
            to,
            up_way: up.way,
            down_way: down.way,
            up: profiles[0],
            across: profiles[1],
            down: profiles[2],
            across_from,
            down_from,
            duration: across_end.max(down_from + profiles[2].duration()),
            // Up and down never overlap, and the way across is at right angles to both.
            top_speed: hypot(across.speed(), up.speed().max(down.speed())),
            length: up.way + across.way + down.way,
        }
    }

    /// Place of the tool point, and the part of the way across that is gone.
    pub(super) fn at(&self, part: f64) -> ([f64; 3], f64) {
        let time = part * self.duration;
        let across = self.across.state_at(time - self.across_from).place;
        let up = self.up.state_at(time).place;
        let down = self.down.state_at(time - self.down_from).place;
        let between = |from: f64, to: f64| from + (to - from) * across;
        let at = [
            between(self.from[0], self.to[0]),
            between(self.from[1], self.to[1]),
            self.from[2] + self.up_way * up - self.down_way * down,
        ];
        (at, across)
    }
}
