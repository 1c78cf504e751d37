//! The inputs of a running program: digital lines, the motion under way, the present position.
//!
//! It implements the trait `Inputs` of scol-mini for one instant.

use crate::arm::{Arm, Frames};
use crate::io::signals::Signals;
use crate::limits::SCAN;
use crate::time::Time;
use core::cell::Cell;
use scol_mini::{Inputs, Position};
use ts3100_proto::command::RunMode;

/// Inputs of the program at one instant.
pub(crate) struct ScolInputs<'a> {
    pub(crate) signals: &'a Signals,
    pub(crate) arm: &'a Arm,
    /// Base, work and tool when the machine began to run.
    pub(crate) frames: Frames,
    pub(crate) run_mode: RunMode,
    pub(crate) now: Time,
    /// TIMER, in seconds.
    pub(crate) timer: f64,
    /// Inputs that do not exist are off, and not refused.
    pub(crate) unknown_inputs: bool,
    /// Something was read that changes by time alone, so a WAIT must look again.
    pub(crate) changing: Cell<bool>,
}

impl ScolInputs<'_> {
    /// When to look again, if something was read that changes by time alone.
    pub(crate) fn next_look(&self) -> Option<Time> {
        self.changing.get().then(|| self.now + SCAN)
    }

    /// The arm, to read values that change while it moves.
    fn watched_arm(&self) -> &Arm {
        if self.arm.is_moving() {
            self.changing.set(true);
        }
        self.arm
    }
}

impl Inputs for ScolInputs<'_> {
    fn din(&self, line: u16) -> bool {
        self.signals.input(line)
    }

    fn has_input(&self, line: u16) -> bool {
        self.unknown_inputs || Signals::exists(line)
    }

    fn dout(&self, line: u16) -> bool {
        self.signals.output(line)
    }

    fn motion_percent(&self) -> f64 {
        self.watched_arm().percent(self.now)
    }

    fn here(&self) -> Position {
        self.watched_arm().here(self.now, &self.frames)
    }

    fn timer(&self) -> f64 {
        self.changing.set(true);
        self.timer
    }

    fn motion_seconds(&self) -> f64 {
        self.watched_arm().elapsed(self.now).as_secs_f64()
    }

    fn remaining_seconds(&self) -> f64 {
        self.watched_arm().remaining(self.now).as_secs_f64()
    }

    fn destination(&self) -> Position {
        self.watched_arm().destination(self.now, &self.frames)
    }

    /// Numbered as hosts know the modes (scol.md 4): 0 continuous, 1 cycle, 2 step, 3 segment.
    fn mode(&self) -> i32 {
        self.run_mode as i32
    }
}
