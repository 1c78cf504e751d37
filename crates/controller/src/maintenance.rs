//! The maintenance information (MN, S29).
//!
//! [`MaintenanceCounters`] counts how long the controller was in each state; `arm` counts the work of the axes. Both
//! survive a power cycle.

use crate::arm::Wear;
use crate::model::Joints;
use crate::prelude::*;
use crate::time::Time;
use core::time::Duration;
use ts3100_proto::status::mn::MN_AXES;

/// Degrees of a revolution.
const REVOLUTION: f64 = 360.0;
/// Seconds of a minute: times are in minutes, as those of SF (assumed).
const MINUTE: f64 = 60.0;
/// Place of the axis of a SCARA arm that slides.
const SLIDING: usize = 2;

/// How long something has been so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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

    /// Whether so much time has passed; for a snapshot.
    fn is_valid(&self, now: Time) -> bool {
        let until = self.since.unwrap_or(now);
        until <= now && self.before <= until.since(Time::ZERO)
    }

    fn minutes(&self, now: Time) -> f64 {
        let present = self.since.map_or(Duration::ZERO, |since| now.since(since));
        self.before.saturating_add(present).as_secs_f64() / MINUTE
    }
}

/// Counters besides those of motions.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MaintenanceCounters {
    energised: DurationMeter,
    off: DurationMeter,
    fault: DurationMeter,
    servo: DurationMeter,
    servo_offs: u32,
    bases: Bases,
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

    /// The values of an item of MN (T3), since it was last reset.
    pub(crate) fn item(&self, item: u8, now: Time, wear: &Wear, slides: bool) -> Vec<f64> {
        let mut values = self.measured(item, now, wear, slides);
        if let Some(base) = self.bases.of(item) {
            for (value, base) in values.iter_mut().zip(base) {
                *value = (*value - base).max(0.0);
            }
        }
        values
    }

    /// An item that is summed up begins at 0 again (RM); no other does.
    pub(crate) fn reset(&mut self, item: u8, now: Time, wear: &Wear, slides: bool) {
        let values = self.measured(item, now, wear, slides);
        if let Some(base) = self.bases.of_mut(item) {
            for (base, value) in base.iter_mut().zip(values) {
                *base = value;
            }
        }
    }

    /// The values as counted. Units are assumed.
    fn measured(&self, item: u8, now: Time, wear: &Wear, slides: bool) -> Vec<f64> {
        let axes = |[a, b, c, d, e, f, ..]: Joints| vec![a, b, c, d, e, f];
        let (energised, off) = (self.energised.minutes(now), self.off.minutes(now));
        let minutes = match item {
            1 => {
                let mut turns = axes(wear.total.way.map(|way| way / REVOLUTION));
                if slides && let Some(axis) = turns.get_mut(SLIDING) {
                    *axis = 0.0;
                }
                return turns;
            }
            2 => return axes(wear.total.way),
            3 => return axes(wear.total.torque),
            // No motion of this model uses more torque than an axis has.
            4 => return axes(Joints::default()),
            6..=9 => return axes(wear.loads.factor(usize::from(item - 6), now)),
            10 => energised + off,
            11 => energised,
            12 => off,
            13 => wear.total.seconds / MINUTE,
            14 => self.fault.minutes(now),
            15 => f64::from(self.servo_offs),
            16 => self.servo.minutes(now),
            // 5 and 17 show one value.
            _ => return axes(wear.total.peak),
        };
        vec![minutes]
    }

    /// Whether the values at the last resets are possible; for a snapshot.
    pub(crate) fn has_valid_bases(&self) -> bool {
        let bases = self.bases.axes.iter().flatten().chain(&self.bases.information);
        bases.into_iter().all(|base| (0.0..=MAX_BASE).contains(base))
    }

    /// Whether no duration is longer than the time that has passed; for a snapshot.
    pub(crate) fn has_valid_durations(&self, now: Time) -> bool {
        let meters = [self.energised, self.off, self.fault, self.servo];
        meters.iter().all(|meter| meter.is_valid(now))
    }
}

/// More than any item reaches.
const MAX_BASE: f64 = 1e18;
/// Items 1 to 3 are summed up for each axis, 10 to 16 as one value; the others are maxima or windows.
const SUMMED_AXES: usize = 3;
const FIRST_INFORMATION: u8 = 10;
const INFORMATION: usize = 7;

/// The values of the items at their last reset.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Bases {
    axes: [[f64; MN_AXES]; SUMMED_AXES],
    information: [f64; INFORMATION],
}

impl Bases {
    fn of(&self, item: u8) -> Option<&[f64]> {
        if let Some(values) = self.axes.get(usize::from(item).wrapping_sub(1)) {
            return Some(values);
        }
        let place = usize::from(item.checked_sub(FIRST_INFORMATION)?);
        self.information.get(place).map(core::slice::from_ref)
    }

    fn of_mut(&mut self, item: u8) -> Option<&mut [f64]> {
        if let Some(values) = self.axes.get_mut(usize::from(item).wrapping_sub(1)) {
            return Some(values);
        }
        let place = usize::from(item.checked_sub(FIRST_INFORMATION)?);
        self.information.get_mut(place).map(core::slice::from_mut)
    }
}
