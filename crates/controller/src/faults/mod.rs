//! Faults on purpose: what is armed, when it bites, and what has been. Each kind is a file in `kinds`; how a fault is
//! written is `spec`'s; what leaves late is in `crate::outbox`.
//!
//! ```
//! use ts3100_controller::{Config, Controller, Dialect, Input, Time};
//! use ts3100_controller::faults::{Fault, FaultOrder};
//! let mut robot = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
//! let fault: Fault = "no-reply:command=SU,after=1".parse().unwrap();
//! robot.feed(Time::ZERO, Input::from(FaultOrder::Arm(Box::new(fault))));
//! assert_eq!(robot.faults().reports().next().unwrap().fired, 0);
//! ```

pub mod kind;
mod kinds;
mod occasions;
pub mod rng;
mod scheduled;
mod spec;

pub use kind::{Kind, Parameter, Point, Takes, Value, Values};
pub use kinds::KINDS;
pub use spec::FaultError;

use crate::Controller;
use crate::action::ActionError;
#[cfg(feature = "serde")]
use crate::limits::MAX_STRIKES;
use crate::limits::{FAULT_MOMENTS, MAX_FAULTS};
use crate::output::Event;
use crate::port::Port;
use crate::time::Time;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use kind::{Applied, Effect, FaultSite};
use rng::{MILLION, Rng};
use scheduled::ScheduledAction;

/// What a fault waits for. What is not said does not matter.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct On {
    /// Letters of a command: the command itself, the texts of its exchange, its answers.
    pub command: Option<String>,
    /// The port.
    pub channel: Option<Port>,
    /// Number of an FL text in its exchange, from 1, or of the OK to it; 0 is the answer that is no FL text and
    /// belongs to none, and the command itself.
    pub block: Option<u32>,
}

/// A fault to be armed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Its number; 0: the next free one. A fault of the same number is replaced.
    pub id: u32,
    /// Its kind.
    pub kind: &'static Kind,
    /// What it waits for.
    pub on: On,
    /// How many occasions pass before the first one it can take.
    pub after: u32,
    /// How often it bites at most; 0: as often as it can.
    pub times: u32,
    /// How probably it takes an occasion, in millionths.
    pub probability: u32,
    /// The parameters of the kind.
    pub values: Values,
}

/// What is done with faults.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FaultOrder {
    /// A fault is armed from now on.
    Arm(alloc::boxed::Box<Fault>),
    /// The fault of this number does not bite any more; it stays in the report.
    Disarm(u32),
    /// No fault bites any more, and the report is empty.
    Clear,
}

/// A fault and what has become of it.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct FaultReport {
    /// The fault.
    pub fault: Fault,
    /// It can still bite.
    pub armed: bool,
    /// Occasions it saw while it was armed.
    pub seen: u32,
    /// How often it bit.
    pub fired: u32,
    /// When, the first [`FAULT_MOMENTS`] times.
    pub at: Vec<Time>,
}

impl FaultReport {
    /// One line for people: what it was, and what has become of it.
    #[must_use]
    pub fn line(&self) -> String {
        let Fault { id, .. } = self.fault;
        match (self.fired, self.at.first()) {
            (0, _) if self.seen == 0 => {
                format!("fault {id} `{}` never fired: it saw no occasion", self.fault)
            }
            (0, _) => format!(
                "fault {id} `{}` never fired: {} occasions passed (after, probability)",
                self.fault, self.seen
            ),
            (fired, first) => format!(
                "fault {id} `{}` fired {fired} times of {} occasions, first at {} s",
                self.fault,
                self.seen,
                first.copied().unwrap_or_default()
            ),
        }
    }
}

/// All faults of a controller.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Faults {
    reports: Vec<FaultReport>,
    dice: Rng,
    /// Ports on which nothing is read or written.
    deaf: BTreeSet<Port>,
    /// Where the record that comes in stands: it is being lost.
    records: BTreeMap<Port, Record>,
    /// What a fault does later.
    strikes: Vec<(Time, ScheduledAction)>,
    /// Bytes the RAM drive has for the file of the command that is being served.
    pub(crate) free: Option<usize>,
}

/// Where a record that comes in stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Record {
    /// It goes through.
    Taken,
    /// It is being lost.
    Lost,
}

impl Faults {
    /// None armed; what is drawn follows from the seed.
    #[must_use]
    pub(crate) fn new(seed: u64) -> Faults {
        Faults {
            reports: Vec::new(),
            dice: Rng::new(seed, "faults"),
            deaf: BTreeSet::new(),
            records: BTreeMap::new(),
            strikes: Vec::new(),
            free: None,
        }
    }

    /// Every fault that was armed since the start or the last [`FaultOrder::Clear`], in the order of their numbers.
    pub fn reports(&self) -> impl Iterator<Item = &FaultReport> {
        self.reports.iter()
    }

    /// Whether none was armed.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.reports.is_empty()
    }

    /// Those of them that never bit.
    pub fn never_fired(&self) -> impl Iterator<Item = &FaultReport> {
        self.reports.iter().filter(|report| report.fired == 0)
    }

    /// When a fault acts by itself.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.strikes.iter().map(|(due, _)| *due).min()
    }

    /// Whether nothing is read or written on this port.
    #[must_use]
    pub fn is_stalled(&self, port: Port) -> bool {
        self.deaf.contains(&port)
    }

    pub(crate) fn stall(&mut self, port: Port) {
        self.deaf.insert(port);
    }

    /// A peer came or went: what held for the last one is over.
    pub(crate) fn forget_peer(&mut self, port: Port) {
        self.deaf.remove(&port);
        self.records.remove(&port);
    }

    /// Whether they are such as a run leads to, for those that were read: where not, what was expected and found.
    #[cfg(feature = "serde")]
    pub(crate) fn check(&self) -> Result<(), (&'static str, String, String)> {
        let at_most = |place, found: usize, most: usize| match found <= most {
            true => Ok(()),
            false => Err((place, format!("at most {most}"), found.to_string())),
        };
        at_most("reports", self.reports.len(), MAX_FAULTS)?;
        at_most("strikes", self.strikes.len(), MAX_STRIKES)?;
        let ids: Vec<u32> = self.reports.iter().map(|report| report.fault.id).collect();
        if !(ids.first().is_none_or(|first| *first > 0) && ids.is_sorted_by(|one, other| one < other)) {
            return Err((
                "reports",
                "numbers that rise from 1".to_string(),
                format!("{ids:?}"),
            ));
        }
        for FaultReport {
            fault,
            armed,
            seen,
            fired,
            at,
        } in &self.reports
        {
            at_most("reports.at", at.len(), FAULT_MOMENTS)?;
            let over = fault.times > 0 && (*fired > fault.times || *armed && *fired == fault.times);
            if fired > seen || at.len() > *fired as usize || over {
                let expected =
                    "no more bites than occasions and times, and a moment for each of the first".to_string();
                return Err((
                    "reports",
                    expected,
                    format!("{seen} seen, {fired} fired, {} moments", at.len()),
                ));
            }
        }
        Ok(())
    }

    fn arm(&mut self, mut fault: Fault) -> Result<u32, String> {
        if fault.id == 0 {
            let last = self.reports.iter().map(|report| report.fault.id).max();
            fault.id = last.unwrap_or(0).saturating_add(1);
        }
        let id = fault.id;
        let fresh = FaultReport {
            fault,
            armed: true,
            seen: 0,
            fired: 0,
            at: Vec::new(),
        };
        let full = self.reports.len() >= MAX_FAULTS;
        match self.reports.iter_mut().find(|report| report.fault.id == id) {
            Some(report) => *report = fresh,
            None if full => {
                return Err("one more".to_string());
            }
            None => self.reports.push(fresh),
        }
        self.reports.sort_by_key(|report| report.fault.id);
        Ok(id)
    }

    /// The fault that takes this occasion: the first armed one, by number, whose turn it is.
    fn taken(&mut self, now: Time, prey: &FaultSite<'_>) -> Option<Fault> {
        let mut taken = None;
        for report in self.reports.iter_mut().filter(|report| report.armed) {
            if !report.fault.waits_for(prey) {
                continue;
            }
            report.seen = report.seen.saturating_add(1);
            let ready = taken.is_none() && report.seen > report.fault.after;
            if !ready || !self.dice.happens(report.fault.probability) {
                continue;
            }
            report.fired = report.fired.saturating_add(1);
            if report.at.len() < FAULT_MOMENTS {
                report.at.push(now);
            }
            report.armed = report.fault.times == 0 || report.fired < report.fault.times;
            taken = Some(report.fault.clone());
        }
        taken
    }
}

impl Fault {
    /// A fault of this kind with everything at its default.
    ///
    /// # Errors
    /// No kind has this name.
    pub fn of(kind: &str) -> Result<Fault, FaultError> {
        spec::build(kind, &[])
    }

    /// A fault from its kind and its keys, as a specification, a file or a request has them.
    ///
    /// # Errors
    /// What was expected and found, and at which key.
    pub fn from_pairs(kind: &str, pairs: &[(String, String)]) -> Result<Fault, FaultError> {
        let fault = spec::build(kind, pairs)?;
        fault.check_occasions()?;
        Ok(fault)
    }

    /// A fault that was armed once, as a snapshot has it: one that can never fire is taken as it was then.
    ///
    /// # Errors
    /// As [`Fault::from_pairs`].
    #[cfg(feature = "serde")]
    pub(crate) fn restored(spec: &str) -> Result<Fault, FaultError> {
        spec::read(spec)
    }

    fn waits_for(&self, prey: &FaultSite<'_>) -> bool {
        let kind = self.kind;
        let On {
            command,
            channel,
            block,
        } = &self.on;
        kind.points.contains(&prey.point)
            && (kind.bites)(&self.values, prey.point, prey.block)
            && command.as_ref().is_none_or(|command| command == prey.command)
            && channel.is_none_or(|channel| channel == prey.port)
            && block.is_none_or(|block| block == prey.block)
    }

    /// Its probability as a number from 0 to 1.
    #[must_use]
    pub fn chance(&self) -> f64 {
        f64::from(self.probability) / f64::from(MILLION)
    }
}

impl Controller {
    /// The faults and what has become of them.
    #[must_use]
    pub fn faults(&self) -> &Faults {
        &self.faults
    }

    /// This controller with nothing broken and nothing varied: every text leaves at once, whatever was armed.
    #[must_use]
    pub fn unbroken(&self) -> Controller {
        Controller {
            faults: Faults::new(self.config.fault_seed),
            variation: None,
            ..self.clone()
        }
    }

    pub(crate) fn fault_order(&mut self, order: FaultOrder) -> Result<(), ActionError> {
        match order {
            FaultOrder::Arm(fault) => {
                let (kind, spec) = (fault.kind.name, fault.to_string());
                fault.check_occasions().map_err(|error| {
                    ActionError::conflict(&spec, "a fault that can fire", error.to_string())
                })?;
                let armed = self.faults.arm(*fault);
                let id = armed.map_err(|found| {
                    ActionError::conflict(&spec, &format!("at most {MAX_FAULTS} faults"), found)
                })?;
                self.event(Event::Fault {
                    id,
                    kind,
                    port: None,
                    message: format!("armed: {spec}"),
                    fired: false,
                });
            }
            FaultOrder::Disarm(id) => {
                let found = self
                    .faults
                    .reports
                    .iter_mut()
                    .find(|report| report.fault.id == id);
                let report = found.ok_or_else(|| {
                    ActionError::missing("fault", "the number of one that was armed", id.to_string())
                })?;
                report.armed = false;
            }
            FaultOrder::Clear => {
                self.faults.reports.clear();
                self.faults.strikes.clear();
            }
        }
        Ok(())
    }

    /// Gives the faults their occasion: what has become of the thing.
    pub(crate) fn apply_fault(&mut self, prey: &FaultSite<'_>) -> Effect {
        let now = self.now;
        let Some(fault) = self.faults.taken(now, prey) else {
            return Effect::Pass;
        };
        let Fault { id, kind, values, .. } = fault;
        let Applied { effect, words } = (kind.act)(self, &values, prey);
        self.event(Event::Fault {
            id,
            kind: kind.name,
            port: Some(prey.port),
            message: words,
            fired: true,
        });
        effect
    }

    /// Bytes that come in on a SCOL channel, without the records that are lost.
    pub(crate) fn surviving(&mut self, port: Port, bytes: &[u8]) -> Vec<u8> {
        if self.faults.is_empty() {
            return bytes.to_vec();
        }
        let mut kept = Vec::new();
        for &byte in bytes {
            let inside = self.faults.records.get(&port).copied();
            let state = match inside {
                Some(state) => state,
                // What ends a record and blanks begin none.
                None if matches!(byte, b'\r' | b'\n' | b' ') => {
                    kept.push(byte);
                    continue;
                }
                None => {
                    let prey = FaultSite {
                        point: Point::Record,
                        port,
                        command: "",
                        block: 0,
                        bytes: &[],
                        data: &[],
                    };
                    match self.apply_fault(&prey) {
                        Effect::Lost => Record::Lost,
                        _ => Record::Taken,
                    }
                }
            };
            if state == Record::Taken {
                kept.push(byte);
            }
            if byte == ts3100_proto::text::CR {
                self.faults.records.remove(&port);
            } else {
                self.faults.records.insert(port, state);
            }
        }
        kept
    }
}

#[cfg(test)]
mod tests;
