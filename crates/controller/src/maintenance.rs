//! The maintenance information (MN, S29).
//!
//! [`MaintenanceCounters`] counts how long the controller was in each state; `arm` counts what the axes do. Both survive
//! a power cycle.

use crate::arm::Wear;
use crate::model::Joints;
use crate::motion::Effort;
use crate::time::Time;
use core::time::Duration;
use libm::sqrt;
use ts3100_proto::status::mn::{MN_AXES, Maintenance};

/// Degrees of a revolution.
const REVOLUTION: f64 = 360.0;
/// Seconds of a minute: times are in minutes, as those of SF (assumed).
const MINUTE: f64 = 60.0;
/// Place of the axis of a SCARA arm that slides.
const SLIDING: usize = 2;

/// How long something has been so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(deny_unknown_fields))]
struct DurationMeter {
    before: Duration,
    since: Option<Time>,
}

impl DurationMeter {
    fn set(&mut self, now: Time, on: bool) {
        match self.since {
            Some(since) if !on => {
                self.before = self.before.saturating_add(now.since(since));
                self.since = None;
            }
            None if on => self.since = Some(now),
            _ => {}
        }
    }

    fn minutes(&self, now: Time) -> f64 {
        let present = self.since.map_or(Duration::ZERO, |since| now.since(since));
        self.before.saturating_add(present).as_secs_f64() / MINUTE
    }
}

/// What is counted besides the motions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(deny_unknown_fields))]
pub(crate) struct MaintenanceCounters {
    energised: DurationMeter,
    off: DurationMeter,
    fault: DurationMeter,
    servo: DurationMeter,
    servo_offs: u32,
}

impl MaintenanceCounters {
    /// Takes note of the state that holds from now on.
    pub(crate) fn update(&mut self, now: Time, powered: bool, servo: bool, fault: bool) {
        let was_on = self.servo.since.is_some();
        self.energised.set(now, powered);
        self.off.set(now, !powered);
        self.servo.set(now, servo);
        self.fault.set(now, fault);
        if was_on && !servo {
            self.servo_offs = self.servo_offs.saturating_add(1);
        }
    }

    /// The maintenance information now. Which item is which value is assumed, but for the order of items 10 to 16.
    pub(crate) fn information(&self, now: Time, wear: &Wear, slides: bool) -> Maintenance {
        let [total, present] = [&wear.total, &wear.since_power_on].map(|effort| per_axis(effort, slides));
        let mut axes = [PerAxis::default(); _];
        for (item, values) in axes.iter_mut().zip(total.into_iter().chain(present)) {
            *item = values;
        }
        let energised = self.energised.minutes(now);
        let off = self.off.minutes(now);
        Maintenance {
            axes,
            information: [
                energised + off,
                energised,
                off,
                wear.total.seconds / MINUTE,
                self.fault.minutes(now),
                f64::from(self.servo_offs),
                self.servo.minutes(now),
            ],
        }
    }

    /// The longest of its durations, for a check of one that was read.
    #[cfg(feature = "serde")]
    pub(crate) fn longest(&self) -> Duration {
        let meters = [self.energised, self.off, self.fault, self.servo];
        meters.iter().map(|meter| meter.before).max().unwrap_or_default()
    }
}

type PerAxis = [f64; MN_AXES];

/// Rotation, movement, torque integral, peak torque, load factor.
fn per_axis(effort: &Effort, slides: bool) -> [PerAxis; 5] {
    let first = |[a, b, c, d, e, f, ..]: Joints| [a, b, c, d, e, f];
    let movement = first(effort.way);
    let mut rotation = movement.map(|way| way / REVOLUTION);
    if slides && let Some(axis) = rotation.get_mut(SLIDING) {
        *axis = 0.0;
    }
    let (torque, peak) = (first(effort.torque), first(effort.peak));
    let load = first(effort.mean(effort.square)).map(sqrt);
    [rotation, movement, torque, peak, load]
}
