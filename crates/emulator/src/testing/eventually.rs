//! Polling for things that send no event: a file, a terminal, a port. This is the only place in the tests that sleeps;
//! for everything else wait for the event.

use std::time::{Duration, Instant};

/// Timeout; reached only by failing tests.
const LIMIT: Duration = Duration::from_secs(30);
/// Pause between two polls.
const PAUSE: Duration = Duration::from_millis(10);

/// Polls `look` until it returns a value; panics with `what` after the timeout.
pub fn eventually<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(started.elapsed() < LIMIT, "{what}: not within {LIMIT:?}");
        std::thread::sleep(PAUSE);
    }
}
