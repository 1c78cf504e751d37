//! Counts of everything that was checked.

use crate::rules::Rule;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::time::Duration;

/// Counts of everything that was checked.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Figures {
    /// Steps carried out.
    pub steps: u64,
    /// Requests of hosts with their whole answer.
    pub exchanges: u64,
    /// Statements executed.
    pub statements: u64,
    /// Faults that fired.
    pub faults: u64,
    /// Programs that stopped.
    pub stops: u64,
    /// Alarms raised.
    pub alarms: u64,
    /// Times the power came on again.
    pub power_cycles: u64,
    /// Snapshots written and read back.
    pub snapshots: u64,
    /// Earlier states that were restored.
    pub restores: u64,
    /// Changes of files that the disk refused.
    pub disk_errors: u64,
    /// Plans that were carried out twice.
    pub repeated: u64,
    /// Virtual time, in seconds.
    pub seconds: u64,
    /// How often each rule was checked.
    pub checks: BTreeMap<Rule, u64>,
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = [
            (self.steps, "steps"),
            (self.exchanges, "exchanges"),
            (self.statements, "statements"),
            (self.faults, "faults that fired"),
            (self.stops, "stops of programs"),
            (self.alarms, "alarms"),
            (self.power_cycles, "power cycles"),
            (self.snapshots, "snapshots"),
            (self.restores, "restores"),
            (self.disk_errors, "disk errors"),
            (self.repeated, "plans repeated"),
            (self.seconds, "seconds of virtual time"),
        ];
        for (count, name) in counts {
            writeln!(f, "{count:>14} {name}")?;
        }
        for (rule, count) in &self.checks {
            writeln!(f, "{count:>14} checks of {}: {}", rule.name(), rule.sentence())?;
        }
        Ok(())
    }
}

impl Figures {
    pub(crate) fn check(&mut self, rule: Rule) {
        *self.checks.entry(rule).or_default() += 1;
    }

    pub(crate) fn pass(&mut self, time: Duration) {
        self.seconds += time.as_secs();
    }

    /// Adds those of another run.
    pub fn add(&mut self, other: &Figures) {
        let Figures {
            steps,
            exchanges,
            statements,
            faults,
            stops,
            alarms,
            power_cycles,
            snapshots,
            restores,
            disk_errors,
            repeated,
            seconds,
            checks,
        } = other;
        self.steps += steps;
        self.exchanges += exchanges;
        self.statements += statements;
        self.faults += faults;
        self.stops += stops;
        self.alarms += alarms;
        self.power_cycles += power_cycles;
        self.snapshots += snapshots;
        self.restores += restores;
        self.disk_errors += disk_errors;
        self.repeated += repeated;
        self.seconds += seconds;
        for (rule, count) in checks {
            *self.checks.entry(*rule).or_default() += count;
        }
    }
}
