//! A queue of the outputs of an embedded emulator, so that a test in the same process waits for an output instead of
//! sleeping. The driver sends every output that it has carried out; the test decides which one it waits for. See
//! [`crate::embed`] for the public API.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use ts3100_controller::{Output, Time};
use ts3100_driver::seat::Subscriber;

/// Outputs that a [`Watch`] holds; the oldest are dropped when there are more.
pub const MAX_OUTPUTS: usize = 4_096;

/// Why a wait failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum WaitError {
    /// No matching output within the limit.
    #[error("the awaited event did not happen within {0:?}")]
    Late(Duration),
    /// The emulator has ended.
    #[error("the emulator ended before the awaited event happened")]
    Ended,
}

#[derive(Debug, Default)]
struct WatchState {
    outputs: VecDeque<Output>,
    ended: bool,
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<WatchState>,
    changed: Condvar,
}

impl Shared {
    /// A panic in another thread cannot leave the state inconsistent, so a poisoned lock is usable.
    fn state(&self) -> MutexGuard<'_, WatchState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The receiving end.
#[derive(Debug)]
pub struct Watch(Arc<Shared>);

/// The sending end, held by the driver; dropping it tells the receiver that the emulator has ended.
#[derive(Debug)]
pub struct WatchSender {
    shared: Arc<Shared>,
    /// Outputs that are still being carried out.
    pending: Vec<Output>,
}

/// Creates the two ends of a watch.
pub fn channel() -> (WatchSender, Watch) {
    let shared = Arc::new(Shared::default());
    let sender = WatchSender {
        shared: Arc::clone(&shared),
        pending: Vec::new(),
    };
    (sender, Watch(shared))
}

impl Subscriber for WatchSender {
    fn output(&mut self, _at: Time, output: &Output) {
        self.pending.push(output.clone());
    }

    fn flush(&mut self) {
        if self.pending.is_empty() {
            return;
        }
        let mut state = self.shared.state();
        state.outputs.extend(self.pending.drain(..));
        let surplus = state.outputs.len().saturating_sub(MAX_OUTPUTS);
        state.outputs.drain(..surplus);
        self.shared.changed.notify_all();
    }
}

impl Drop for WatchSender {
    fn drop(&mut self) {
        self.shared.state().ended = true;
        self.shared.changed.notify_all();
    }
}

impl Watch {
    /// The outputs that were not read yet; reading consumes them.
    pub fn take(&self) -> Vec<Output> {
        self.0.state().outputs.drain(..).collect()
    }

    /// Waits until `found` returns a value for an output and returns that value. This output and all before it
    /// are consumed.
    ///
    /// # Errors
    /// See [`WaitError`].
    pub fn wait_for<T>(
        &self,
        limit: Duration,
        mut found: impl FnMut(&Output) -> Option<T>,
    ) -> Result<T, WaitError> {
        let start = Instant::now();
        let mut state = self.0.state();
        loop {
            while let Some(output) = state.outputs.pop_front() {
                if let Some(value) = found(&output) {
                    return Ok(value);
                }
            }
            if state.ended {
                return Err(WaitError::Ended);
            }
            let left = limit.saturating_sub(start.elapsed());
            if left.is_zero() {
                return Err(WaitError::Late(limit));
            }
            let waited = self.0.changed.wait_timeout(state, left);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pendant(output: &Output) -> Option<String> {
        match output {
            Output::Pendant(text) => Some(text.clone()),
            _ => None,
        }
    }

    #[test]
    fn outputs_are_looked_at_once_and_in_order() {
        let (mut feeder, watch) = channel();
        for output in [
            Output::Pendant("a".to_owned()),
            Output::PowerCycled,
            Output::Pendant("b".to_owned()),
        ] {
            feeder.output(Time::ZERO, &output);
        }
        assert_eq!(
            watch.wait_for(Duration::ZERO, pendant),
            Err(WaitError::Late(Duration::ZERO))
        );
        feeder.flush();
        let now = Duration::ZERO;
        assert_eq!(watch.wait_for(now, pendant).as_deref(), Ok("a"));
        assert_eq!(watch.wait_for(now, pendant).as_deref(), Ok("b"));
        assert_eq!(watch.wait_for(now, pendant), Err(WaitError::Late(now)));
        let late = std::thread::spawn(move || {
            feeder.output(Time::ZERO, &Output::Pendant("c".to_owned()));
            feeder.flush();
        });
        assert_eq!(watch.wait_for(Duration::MAX, pendant).as_deref(), Ok("c"));
        late.join().unwrap();
        assert_eq!(watch.wait_for(Duration::MAX, pendant), Err(WaitError::Ended));
    }

    #[test]
    fn a_watch_nobody_reads_does_not_grow() {
        let (mut feeder, watch) = channel();
        for number in 0..=MAX_OUTPUTS {
            feeder.output(Time::ZERO, &Output::Pendant(number.to_string()));
            feeder.flush();
        }
        assert_eq!(watch.0.state().outputs.len(), MAX_OUTPUTS);
        assert_eq!(watch.wait_for(Duration::ZERO, pendant).as_deref(), Ok("1"));
    }
}
