//! Waiting for what tests outside the controller can only look for: a file, a terminal, a port. It is the one place of
//! the tests that sleeps; whatever tells by itself is waited for by its event.

use std::time::{Duration, Instant};

/// Longest wait; reached only when a test fails.
const LIMIT: Duration = Duration::from_secs(30);
/// Between two looks.
const PAUSE: Duration = Duration::from_millis(10);

/// What `look` finds, as soon as it does; the test fails when that takes too long. `what` is awaited.
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
