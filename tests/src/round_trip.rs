//! Snapshot round trips inside other suites: a controller is written as JSON and read back every so many inputs.
//!
//! A suite that passes inside [`with_round_trips`] has shown that a snapshot taken at any of these moments goes on as
//! the run it was taken of. Robots created meanwhile pick the setting up by [`RoundTrips::current`]. What a snapshot file
//! must look like is in `suites/snapshots.rs` and `suites/snapshot_files.rs`.

use std::cell::Cell;
use ts3100_controller::{Controller, Snapshot};

/// When this variable of the environment is set, every robot of every suite makes a round trip after every input.
const EVERYWHERE: &str = "TS3100_TESTS_ON_PAPER";

thread_local! {
    static EVERY: Cell<u32> = const { Cell::new(0) };
}

/// Runs `run`; every robot created meanwhile makes a round trip after every `every` inputs.
pub fn with_round_trips<T>(every: u32, run: impl FnOnce() -> T) -> T {
    let before = EVERY.replace(every);
    let result = run();
    EVERY.set(before);
    result
}

/// Counts the inputs of one robot between two round trips.
#[derive(Debug, Clone, Copy)]
pub struct RoundTrips {
    every: u32,
    inputs: u32,
}

impl RoundTrips {
    /// The setting of the enclosing [`with_round_trips`], or of the environment; by default no round trips.
    #[must_use]
    pub fn current() -> RoundTrips {
        RoundTrips::every(match EVERY.get() {
            0 => u32::from(std::env::var_os(EVERYWHERE).is_some()),
            every => every,
        })
    }

    /// One round trip every `every` inputs; none with 0.
    #[must_use]
    pub fn every(every: u32) -> RoundTrips {
        RoundTrips { every, inputs: 0 }
    }

    /// Whether round trips are made at all.
    #[must_use]
    pub fn are_made(&self) -> bool {
        self.every > 0
    }

    /// Counts one input and returns whether a round trip is due.
    pub fn is_due(&mut self) -> bool {
        self.inputs += 1;
        self.are_made() && self.inputs.is_multiple_of(self.every)
    }
}

/// The snapshot of a controller as JSON on one line.
///
/// # Panics
/// When it cannot be serialized.
#[must_use]
pub fn to_json(controller: &Controller) -> String {
    serde_json::to_string(&controller.snapshot()).unwrap_or_else(|error| panic!("a snapshot: {error}"))
}

/// The controller of a snapshot in JSON.
///
/// # Errors
/// The message of what cannot be parsed or restored.
pub fn from_json(text: &str) -> Result<Controller, String> {
    let snapshot: Snapshot = serde_json::from_str(text).map_err(|error| error.to_string())?;
    Controller::restore(snapshot).map_err(|error| error.to_string())
}

/// The controller after being written as JSON and read back.
///
/// # Panics
/// When the two differ.
#[must_use]
pub fn round_trip(controller: &Controller) -> Controller {
    let text = to_json(controller);
    let restored = from_json(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert!(
        restored == *controller,
        "a field that is not in the snapshot differs: {text}"
    );
    restored
}
