//! How long a controller takes for its answers.

use std::time::Duration;

/// Most answer times that are kept.
const MAX_DELAYS: usize = 10_000;

/// How long answers took.
#[derive(Debug, Default)]
pub(crate) struct Delays(Vec<Duration>);

impl Delays {
    /// Another one.
    pub(crate) fn add(&mut self, delay: Duration) {
        if self.0.len() < MAX_DELAYS {
            self.0.push(delay);
        }
    }

    /// The least, the quartiles and the greatest, in milliseconds; empty without any.
    pub(crate) fn quartiles(&self) -> Vec<f64> {
        let mut sorted = self.0.clone();
        sorted.sort_unstable();
        let Some(last) = sorted.len().checked_sub(1) else {
            return Vec::new();
        };
        let at = |quarter: usize| sorted.get(last * quarter / 4).copied().unwrap_or_default();
        (0..=4)
            .map(|quarter| (at(quarter).as_secs_f64() * 10_000.0).round() / 10.0)
            .collect()
    }
}
