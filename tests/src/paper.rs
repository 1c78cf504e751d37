//! Controllers on paper: a robot made inside [`on_paper`] is written down and read back after everything that happens
//! to it, so that a suite that holds all the same has shown of each of its moments that a snapshot goes on as the
//! whole run.

use std::cell::Cell;
use ts3100_controller::{Controller, Snapshot};

/// Set in the environment, every robot of every suite lives on paper.
const EVERYWHERE: &str = "TS3100_TESTS_ON_PAPER";

thread_local! {
    static EVERY: Cell<u32> = const { Cell::new(0) };
}

/// Runs something with every robot that is made meanwhile on paper, after `every` so many happenings.
pub fn on_paper<T>(every: u32, run: impl FnOnce() -> T) -> T {
    let before = EVERY.replace(every);
    let result = run();
    EVERY.set(before);
    result
}

/// How a robot made now lives on paper.
#[must_use]
pub fn wanted() -> Paper {
    let every = match EVERY.get() {
        0 => u32::from(std::env::var_os(EVERYWHERE).is_some()),
        every => every,
    };
    Paper { every, passed: 0 }
}

/// When a robot is written down and read back.
#[derive(Debug, Clone, Copy)]
pub struct Paper {
    every: u32,
    passed: u32,
}

impl Paper {
    /// After every so many happenings.
    #[must_use]
    pub fn every(every: u32) -> Paper {
        Paper { every, passed: 0 }
    }

    /// Something has happened; whether it is time.
    pub fn is_due(&mut self) -> bool {
        self.passed += 1;
        self.every > 0 && self.passed.is_multiple_of(self.every)
    }
}

/// The controller as JSON.
///
/// # Panics
/// When it cannot be written.
#[must_use]
pub fn written(controller: &Controller) -> String {
    serde_json::to_string(&controller.snapshot()).unwrap_or_else(|error| panic!("a snapshot: {error}"))
}

/// The controller of JSON.
///
/// # Errors
/// What is wrong with it.
pub fn read(text: &str) -> Result<Controller, String> {
    let snapshot: Snapshot = serde_json::from_str(text).map_err(|error| error.to_string())?;
    Controller::restore(snapshot).map_err(|error| error.to_string())
}

/// The controller from its paper.
///
/// # Panics
/// When it is not the same.
#[must_use]
pub fn again(controller: &Controller) -> Controller {
    let text = written(controller);
    let restored = read(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert!(
        restored == *controller,
        "what was read differs where it is not written: {text}"
    );
    restored
}
