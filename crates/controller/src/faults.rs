//! Fault injection: the armed faults, their firing, and their outcome.
//!
//! Each kind of fault is a file in `kinds`, after the description in `kind`. `spec` parses and writes faults, and
//! `reachability` rejects one that can never fire. `causes` says which findings a fault causes, and `effects` remembers what
//! has fired. `crate::endpoint::filters` asks at each site and sends the bytes of a fault; `crate::controller::owner` performs
//! the actions on the machine.
//!
//! ```
//! use ts3100_controller::{Config, Controller, Dialect, Input, Time};
//! use ts3100_controller::faults::{Fault, FaultAction};
//! let mut robot = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
//! let fault: Fault = "no-reply:command=SU,after=1".parse().unwrap();
//! robot.feed(Time::ZERO, Input::from(FaultAction::Arm(Box::new(fault))));
//! assert_eq!(robot.faults().reports().next().unwrap().fired, 0);
//! ```

mod causes;
pub(crate) mod effects;
mod error;
pub mod kind;
mod kinds;
mod reachability;
pub mod rng;
mod saved;
mod spec;

pub use crate::finding::FaultCause;
pub use causes::{CAUSES, CauseRow, Reach};
pub use error::FaultError;
pub use kind::{FaultKind, InjectionPoint, Parameter, ParameterType, ParameterValues};
pub use kinds::KINDS;
pub use spec::{COMMON_KEYS, MAX_COUNT};

use crate::limits::{MAX_FAULT_TIMES, MAX_FAULTS, MAX_SCHEDULED_ACTIONS};
use crate::output::Event;
use crate::port::Port;
use crate::prelude::*;
use crate::snapshot_error::{SnapshotError, check};
use crate::time::Time;
use alloc::collections::{BTreeMap, BTreeSet};
use effects::FaultEffects;
use kind::{Effect, FaultContext, FaultSite, ScheduledAction};
use rng::{MILLION, Rng};

/// Which sites a fault applies to. `None` matches everything.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FaultFilter {
    /// Letters of a command: matches the command, the texts of its exchange and its answers.
    pub command: Option<String>,
    /// The port it is received or sent on.
    pub channel: Option<Port>,
    /// Number of an FL text in its exchange, from 1: matches the text and the OK to it. 0 matches the command
    /// itself and answers that are not FL texts.
    pub block: Option<u32>,
}

/// A fault that can be armed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Number, from 1; 0 means the next free one. Arming replaces a fault of the same number.
    pub id: u32,
    pub kind: &'static FaultKind,
    /// Where it applies.
    pub filter: FaultFilter,
    /// How many matching sites pass before it can fire.
    pub after: u32,
    /// How often it fires at most; 0: without limit.
    pub times: u32,
    /// Probability that it fires at a matching site, in millionths.
    pub probability: u32,
    /// Values of the parameters of its kind.
    pub values: ParameterValues,
}

/// An action on the faults of a controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FaultAction {
    /// Arms a fault.
    Arm(Box<Fault>),
    /// Disarms the fault of this number; it stays in the report.
    Disarm(u32),
    /// Disarms every fault and empties the report.
    Clear,
}

/// A fault and its outcome since it was armed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaultReport {
    /// The fault as it was armed, with its number.
    pub fault: Fault,
    /// Whether it can still fire.
    pub armed: bool,
    /// Matching sites while it was armed.
    pub seen: u32,
    /// How often it fired.
    pub fired: u32,
    /// When it fired, for the first [`MAX_FAULT_TIMES`] times.
    pub at: Vec<Time>,
}

impl FaultReport {
    /// One line for people: the fault and its outcome.
    pub fn summary(&self) -> String {
        let FaultReport {
            fault, seen, fired, ..
        } = self;
        let outcome = match (fired, self.at.first()) {
            (0, _) if *seen == 0 => "never fired: no occasion occurred".into(),
            (0, _) => format!("never fired: skipped {seen} occasions (after, probability)"),
            (_, first) => {
                let millis = first.copied().unwrap_or_default().as_micros() / 1_000;
                let (seconds, millis) = (millis / 1_000, millis % 1_000);
                format!("fired {fired} of {seen} times, first at {seconds}.{millis:03} s")
            }
        };
        format!("fault {} `{fault}` {outcome}", fault.id)
    }
}

/// The faults of a controller and the state that they leave.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Faults {
    reports: Vec<FaultReport>,
    rng: Rng,
    /// Ports on which nothing is read or written.
    stalled: BTreeSet<Port>,
    /// Per SCOL channel, the record for INPUT that is being received.
    pub(crate) records: BTreeMap<Port, RecordState>,
    /// Actions of faults that are due later.
    scheduled: Vec<(Time, ScheduledAction)>,
    /// Bytes free on the RAM drive for the file of the command that is being served; `None`: no fault limits them.
    pub(crate) drive_free: Option<usize>,
}

/// Result of a fault that fires: the change at its site, actions on the machine at once, the event for the log.
pub(crate) type Fired = (Effect, Vec<ScheduledAction>, Event);

/// Fate of the rest of a record that is being received.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum RecordState {
    /// It reaches the program.
    Kept,
    /// It is dropped up to its CR.
    Lost,
}

impl Faults {
    /// No fault armed; probabilities and random parameters follow from the seed.
    pub(crate) fn new(seed: u64) -> Faults {
        Faults {
            reports: Vec::new(),
            rng: Rng::new(seed, "faults"),
            stalled: BTreeSet::new(),
            records: BTreeMap::new(),
            scheduled: Vec::new(),
            drive_free: None,
        }
    }

    /// Every fault armed since the start or the last [`FaultAction::Clear`], by number.
    pub fn reports(&self) -> impl Iterator<Item = &FaultReport> {
        self.reports.iter()
    }

    /// Whether no fault was armed.
    pub fn is_empty(&self) -> bool {
        self.reports.is_empty()
    }

    /// Whether no fault can change the bytes of a port.
    pub(crate) fn are_quiet(&self) -> bool {
        self.reports.is_empty() && self.stalled.is_empty()
    }

    /// The reports of the faults that never fired.
    pub fn never_fired(&self) -> impl Iterator<Item = &FaultReport> {
        self.reports.iter().filter(|report| report.fired == 0)
    }

    /// When the next scheduled action is due.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.scheduled.iter().map(|(due, _)| *due).min()
    }

    /// Whether nothing is read or written on this port.
    pub fn is_stalled(&self, port: Port) -> bool {
        self.stalled.contains(&port)
    }

    pub(crate) fn stall(&mut self, port: Port) {
        self.stalled.insert(port);
    }

    /// Drops the state of the previous peer, when a peer connects or leaves.
    pub(crate) fn forget_peer(&mut self, port: Port) {
        self.stalled.remove(&port);
        self.records.remove(&port);
    }

    /// Checks the values read from a snapshot.
    ///
    /// # Errors
    /// The field, what was expected, and what was found.
    pub(crate) fn validate(&self) -> Result<(), SnapshotError> {
        let at_most = |place, found: usize, most: usize| {
            let expected = format!("at most {most}");
            check(found <= most, place, &expected, found)
        };
        at_most("faults.reports", self.reports.len(), MAX_FAULTS)?;
        at_most("faults.scheduled", self.scheduled.len(), MAX_SCHEDULED_ACTIONS)?;
        let ids: Vec<u32> = self.reports.iter().map(|report| report.fault.id).collect();
        let rise = ids.first() != Some(&0) && ids.is_sorted_by(|one, other| one < other);
        let (place, found) = ("faults.reports", format!("{ids:?}"));
        check(rise, place, "numbers that rise from 1", found)?;
        for report in &self.reports {
            let (seen, fired, times) = (report.seen, report.fired, report.fault.times);
            let moments = report.at.len();
            at_most("faults.reports.at", moments, MAX_FAULT_TIMES)?;
            let beyond_times = times > 0 && (fired > times || report.armed && fired == times);
            let fits = fired <= seen && moments <= fired as usize && !beyond_times;
            let expected =
                "a fault that fired no more often than it could, and at most a moment for each time";
            let found = format!("{seen} seen, {fired} fired, {moments} moments");
            check(fits, place, expected, found)?;
        }
        Ok(())
    }

    /// Arms a fault; returns its number, or `None` if [`MAX_FAULTS`] are there.
    pub(crate) fn arm(&mut self, mut fault: Fault) -> Option<u32> {
        if fault.id == 0 {
            let last = self.reports.iter().map(|report| report.fault.id).max();
            fault.id = last.unwrap_or(0).saturating_add(1);
        }
        let id = fault.id;
        let place = self.reports.binary_search_by_key(&id, |report| report.fault.id);
        if place.is_err() && self.reports.len() >= MAX_FAULTS {
            return None;
        }
        let fresh = FaultReport {
            fault,
            armed: true,
            seen: 0,
            fired: 0,
            at: Vec::new(),
        };
        match place {
            Ok(place) => self.reports[place] = fresh,
            Err(place) => self.reports.insert(place, fresh),
        }
        Some(id)
    }

    /// Disarms a fault; false if none has this number.
    pub(crate) fn disarm(&mut self, id: u32) -> bool {
        let found = self.reports.iter_mut().find(|report| report.fault.id == id);
        found.map(|report| report.armed = false).is_some()
    }

    /// Disarms every fault and empties the report.
    pub(crate) fn clear(&mut self) {
        self.reports.clear();
        self.scheduled.clear();
    }

    /// The next action that is due, in the order of their times.
    pub(crate) fn take_due(&mut self, now: Time) -> Option<ScheduledAction> {
        let actions = self.scheduled.iter().enumerate();
        let due = actions.filter(|(_, (due, _))| *due <= now);
        let (place, _) = due.min_by_key(|(_, (due, _))| *due)?;
        Some(self.scheduled.remove(place).1)
    }

    /// Lets at most one armed fault fire at a site. What it does to the machine later waits here, unless
    /// [`MAX_SCHEDULED_ACTIONS`] do.
    pub(crate) fn fire(
        &mut self,
        now: Time,
        site: &FaultSite<'_>,
        effects: &mut FaultEffects,
    ) -> Option<Fired> {
        let fault = self.firing_fault(now, site)?;
        let Fault { id, kind, values, .. } = &fault;
        let mut context = FaultContext {
            rng: &mut self.rng,
            room: &mut self.drive_free,
            scheduled: Vec::new(),
        };
        let (effect, message) = (kind.apply)(&mut context, values, site);
        let delays = || context.scheduled.iter().map(|(delay, _)| *delay);
        let actions = delays().min().zip(delays().max());
        effects.note(now, &fault, site, &effect, actions);
        let mut at_once = Vec::new();
        for (delay, action) in context.scheduled {
            if delay.is_zero() {
                at_once.push(action);
            } else if self.scheduled.len() < MAX_SCHEDULED_ACTIONS {
                self.scheduled.push((now + delay, action));
            }
        }
        let event = Event::Fault {
            id: *id,
            kind: kind.name,
            port: Some(site.port),
            message,
            fired: true,
        };
        Some((effect, at_once, event))
    }

    /// Counts the site for every armed fault that matches it, and returns the one that fires: the first by number
    /// that is due and passes its probability.
    fn firing_fault(&mut self, now: Time, site: &FaultSite<'_>) -> Option<Fault> {
        let mut firing = None;
        for report in self.reports.iter_mut().filter(|report| report.armed) {
            if !report.fault.waits_for(site) {
                continue;
            }
            report.seen = report.seen.saturating_add(1);
            let ready = firing.is_none() && report.seen > report.fault.after;
            if !ready || !self.rng.happens(report.fault.probability) {
                continue;
            }
            report.fired = report.fired.saturating_add(1);
            if report.at.len() < MAX_FAULT_TIMES {
                report.at.push(now);
            }
            report.armed = report.fault.times == 0 || report.fired < report.fault.times;
            firing = Some(report.fault.clone());
        }
        firing
    }
}

impl Fault {
    /// A fault from its kind and the pairs of key and value of a specification, a file or a request.
    ///
    /// # Errors
    /// A key or value is invalid, or the fault can never fire.
    pub fn from_pairs(kind: &str, pairs: &[(String, String)]) -> Result<Fault, FaultError> {
        let fault = spec::from_pairs(kind, pairs)?;
        fault.check_can_fire()?;
        Ok(fault)
    }

    fn waits_for(&self, site: &FaultSite<'_>) -> bool {
        let (kind, filter) = (self.kind, &self.filter);
        let command = filter.command.as_ref();
        kind.points.contains(&site.point)
            && (kind.applies)(&self.values, site.point, site.block)
            && command.is_none_or(|command| command == site.command)
            && filter.channel.is_none_or(|channel| channel == site.port)
            && filter.block.is_none_or(|block| block == site.block)
    }

    /// The probability as a number from 0 to 1.
    pub fn chance(&self) -> f64 {
        f64::from(self.probability) / f64::from(MILLION)
    }
}

#[cfg(test)]
mod tests;
