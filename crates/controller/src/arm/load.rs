//! How hard the axes have worked of late, for the load factors of MN (items 6 to 9): the root mean square of the torque over
//! windows that end now. A motion counts evenly over its time (ours), so a window that cuts through one is an estimate.

use crate::model::Joints;
use crate::motion::pairwise;
use crate::prelude::*;
use crate::time::Time;
use core::time::Duration;
use libm::sqrt;

/// The windows of items 6 to 9 (S74).
const WINDOWS: [Duration; 4] = [
    Duration::from_secs(3),
    Duration::from_secs(60),
    Duration::from_secs(15 * 60),
    Duration::from_secs(2 * 60 * 60),
];
/// Parts of a window in which torque is summed up; the oldest counts by the share of it that still lies in the window.
const SLOTS: u64 = 60;

/// The windows, each with its slots in which the arm has moved.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct LoadHistory {
    windows: [Vec<Slot>; WINDOWS.len()],
}

/// A part of a window, counted from the beginning of time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Slot {
    number: u64,
    /// The square of the torque integrated over the time in it.
    square: Joints,
}

fn slot_micros(window: Duration) -> u64 {
    u64::try_from(window.as_micros()).unwrap_or(u64::MAX) / SLOTS
}

impl LoadHistory {
    /// Adds a motion between two moments, whose squared torque integrates to this. No slot counts beyond `most`.
    pub(super) fn add(&mut self, from: Time, until: Time, square: Joints, most: f64) {
        let took = until.since(from).as_secs_f64();
        if took <= 0.0 || square.iter().all(|square| *square <= 0.0) {
            return;
        }
        let (from, until) = (from.as_micros(), until.as_micros());
        for (slots, window) in self.windows.iter_mut().zip(WINDOWS) {
            let width = slot_micros(window);
            let last = until / width;
            let oldest = last.saturating_sub(SLOTS);
            slots.retain(|slot| slot.number >= oldest);
            for number in (from / width).max(oldest)..=last {
                // The last slot may not end before time does.
                let (begin, end) = (number * width, (number + 1).saturating_mul(width));
                let within = end.min(until).saturating_sub(begin.max(from));
                // A motion counts evenly over its time: its share in a slot is that of the time it spends there.
                let share = Duration::from_micros(within).as_secs_f64() / took;
                let part = square.map(|square| square * share);
                match slots.last_mut().filter(|slot| slot.number == number) {
                    Some(slot) => {
                        slot.square = pairwise(slot.square, part, |one, other| (one + other).min(most));
                    }
                    None => slots.push(Slot { number, square: part }),
                }
            }
        }
    }

    /// Root mean square of the torque in the window of this index, percent.
    pub(crate) fn factor(&self, index: usize, now: Time) -> Joints {
        let (Some(slots), Some(window)) = (self.windows.get(index), WINDOWS.get(index)) else {
            return Joints::default();
        };
        let width = slot_micros(*window);
        let begin = now.as_micros().saturating_sub(width * SLOTS);
        let mut sum = Joints::default();
        for slot in slots {
            // Of the slot in which the window begins only the end counts, of an older one nothing.
            let end = (slot.number + 1).saturating_mul(width);
            let inside = end.saturating_sub(begin).min(width);
            let share =
                Duration::from_micros(inside).as_secs_f64() / Duration::from_micros(width).as_secs_f64();
            sum = pairwise(sum, slot.square, |sum, square| sum + square * share);
        }
        sum.map(|sum| sqrt(sum / window.as_secs_f64()))
    }

    /// Restarts the window of this index.
    pub(super) fn clear(&mut self, index: usize) {
        if let Some(slots) = self.windows.get_mut(index) {
            slots.clear();
        }
    }

    /// Whether a run can lead to it; for a snapshot.
    pub(super) fn is_valid(&self, now: Time, most: f64) -> bool {
        self.windows.iter().zip(WINDOWS).all(|(slots, window)| {
            let rises = slots.is_sorted_by(|one, next| one.number < next.number);
            let last = now.as_micros() / slot_micros(window);
            let mut numbers = slots.iter().flat_map(|slot| slot.square);
            rises
                && slots.len() as u64 <= SLOTS + 1
                && slots.iter().all(|slot| slot.number <= last)
                && numbers.all(|number| (0.0..=most).contains(&number))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Time {
        Time::from_millis(ms)
    }

    fn first(joints: Joints) -> f64 {
        joints[0]
    }

    #[test]
    fn a_window_forgets_what_lies_before_it() {
        let mut history = LoadHistory::default();
        let mut square = Joints::default();
        // One second at 100 %.
        square[0] = 10_000.0;
        history.add(at(0), at(1_000), square, f64::MAX);
        let expected = |seconds: f64| 100.0 * (1.0 / seconds).sqrt();
        assert!((first(history.factor(0, at(1_000))) - expected(3.0)).abs() < 1e-9);
        assert!((first(history.factor(0, at(3_000))) - expected(3.0)).abs() < 1e-9);
        assert!(
            (first(history.factor(0, at(3_500))) - expected(6.0)).abs() < 1e-9,
            "half of it"
        );
        assert!(first(history.factor(0, at(4_000))) < 1e-9);
        for (index, seconds) in [(1, 60.0), (2, 900.0), (3, 7_200.0)] {
            assert!((first(history.factor(index, at(4_000))) - expected(seconds)).abs() < 1e-9);
        }
        history.clear(1);
        assert!(first(history.factor(1, at(4_000))) < 1e-9);
        assert!(first(history.factor(2, at(4_000))) > 1.0);
    }

    #[test]
    fn the_history_is_bounded() {
        let mut history = LoadHistory::default();
        let square = [1.0; _];
        for step in 0..10_000 {
            history.add(at(step * 1_000), at(step * 1_000 + 900), square, f64::MAX);
        }
        assert!(
            history
                .windows
                .iter()
                .all(|slots| slots.len() as u64 <= SLOTS + 1)
        );
    }
}
