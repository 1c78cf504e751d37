//! Whole cells under random traffic and failures, and the rules that hold whatever happens.
//!
//! A seed draws a [`Plan`]: robots, wires, and the steps of hosts, operators, faults, disks, power and snapshots, in virtual
//! time. Carrying a plan out depends on nothing else, so that steps can be left out of it: [`shrunk`] finds the few that a
//! broken rule needs, and [`recorded`] writes them as a transcript. The rules ([`Rule`]) look at the wire and at what the
//! controller shows, and are written from the manual, not from the controller's code.
//!
//! Beyond the plans: bytes lost or changed between the host and the edge other than by faults, sockets and real
//! serial devices, two hosts on one port, wall-clock time, programs other than those of [`plan`], models and permission tables
//! of the user's. Tests with running emulators are in `tests/`.

// A new variant of an enum of ours is met at every place that tells them apart.
#![cfg_attr(not(test), warn(clippy::wildcard_enum_match_arm))]

mod cell;
mod figures;
mod host;
pub mod manual;
pub mod plan;
mod rules;
mod watch;

pub use figures::Figures;
pub use plan::{Plan, Step};
pub use rules::{Rule, Violation};

use cell::Cell;
use std::fmt;
use std::io;
use std::path::Path;
use ts3100_recording::transcript::{Format, TranscriptFile};

/// Steps of one plan.
pub const STEPS_OF_PLAN: usize = 400;
/// Plans after which one is carried out a second time, for the same bytes.
const REPEATED_EVERY: u64 = 16;
/// Most times a plan is carried out to leave steps out of it.
const MAX_TRIALS: usize = 3_000;

/// A plan that breaks a rule.
#[derive(Debug, Clone)]
pub struct Failure {
    /// The seed of the plan.
    pub seed: u64,
    /// The plan, with as few steps as were found.
    pub plan: Plan,
    /// Number of steps that were drawn.
    pub drawn: usize,
    /// The rule and how it is broken.
    pub violation: Violation,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "seed {}: {}", self.seed, self.violation)?;
        for (number, robot) in self.plan.robots.iter().enumerate() {
            writeln!(f, "  robot {}: {robot}", number + 1)?;
        }
        for step in &self.plan.steps {
            writeln!(f, "  {step}")?;
        }
        write!(f, "{} of {} steps", self.plan.steps.len(), self.drawn)
    }
}

/// Carries out the plan of a seed, and adds to the figures what was checked. `canary` plants a defect that this rule has to find.
///
/// # Errors
/// The broken rule, with the plan.
pub fn simulate(seed: u64, canary: Option<Rule>, figures: &mut Figures) -> Result<(), Box<Failure>> {
    let plan = Plan::draw(seed, STEPS_OF_PLAN);
    let drawn = plan.steps.len();
    let mut cell = Cell::new(&plan, canary);
    let mut result = cell.run(&plan.steps);
    figures.add(cell.figures());
    if result.is_ok() && seed.is_multiple_of(REPEATED_EVERY) {
        let mut again = Cell::new(&plan, None);
        let repeated = again.run(&plan.steps);
        figures.repeated += 1;
        if repeated.is_err() || again.digest() != cell.digest() {
            result = Err(Violation::of_bytes());
        }
    }
    result.map_err(|violation| {
        Box::new(Failure {
            seed,
            plan,
            drawn,
            violation,
        })
    })
}

/// The same failure with fewer steps: parts of the plan are left out as long as the same rule is broken (delta debugging).
#[must_use]
pub fn shrunk(mut failure: Failure, canary: Option<Rule>) -> Failure {
    if failure.violation.rule == Rule::SameBytes {
        return failure;
    }
    let mut trials = 0;
    let mut part = failure.plan.steps.len().div_ceil(2);
    while part > 0 && trials < MAX_TRIALS {
        let mut begin = 0;
        let mut is_shorter = false;
        while begin < failure.plan.steps.len() && trials < MAX_TRIALS {
            let end = failure.plan.steps.len().min(begin + part);
            let mut plan = failure.plan.clone();
            plan.steps.drain(begin..end);
            trials += 1;
            match Cell::new(&plan, canary).run(&plan.steps) {
                Err(violation) if violation.rule == failure.violation.rule => {
                    (failure.plan, failure.violation) = (plan, violation);
                    is_shorter = true;
                }
                _ => begin = end,
            }
        }
        // At the size of one step: until no single one can be left out.
        part = if part == 1 && is_shorter { 1 } else { part / 2 };
    }
    failure
}

/// Writes what happens to the robot of the broken rule as a transcript, which `ts3100 diff` replays.
///
/// # Errors
/// The file cannot be written.
pub fn recorded(failure: &Failure, path: &Path, canary: Option<Rule>) -> io::Result<()> {
    record(&failure.plan, failure.violation.robot, path, canary)
}

/// Writes what a plan has happen to one of its robots as a transcript.
///
/// # Errors
/// The file cannot be written.
pub fn record(plan: &Plan, robot: usize, path: &Path, canary: Option<Rule>) -> io::Result<()> {
    let mut cell = Cell::new(plan, canary);
    let target = TranscriptFile {
        path: path.to_path_buf(),
        format: Format::Text,
    };
    cell.record(robot, plan, target).map_err(io::Error::other)?;
    // A rule that was broken is broken again: that is what the transcript ends with.
    let _ = cell.run(&plan.steps);
    Ok(())
}

#[cfg(test)]
mod tests;
