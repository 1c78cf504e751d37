//! The outcome of the faults of a run: logged at the end, and written as JSON or JUnit XML. In addition to the counts of
//! the controller it holds what each application of a fault did, so that the report explains what a host saw.

use super::{junit, write_report};
use crate::faults::{fault_json, points};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Duration;
use tracing::{info, warn};
use ts3100_controller::faults::{Fault, FaultReport, Faults};
use ts3100_controller::limits::MAX_FAULT_TIMES;
use ts3100_controller::{Event, Port, Time};
use ts3100_driver::files::{self, PathError};

/// One application of a fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AppliedFault {
    /// Virtual time.
    pub at: Time,
    /// Port concerned, if any.
    pub port: Option<Port>,
    /// Description of the effect.
    pub message: String,
}

/// Applications of faults by fault number; of each fault the first [`MAX_FAULT_TIMES`].
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FaultLog(BTreeMap<u32, Vec<AppliedFault>>);

impl FaultLog {
    /// Records an event of the controller about a fault.
    pub fn observe(&mut self, at: Time, event: &Event) {
        let Event::Fault {
            id,
            port,
            message,
            fired,
            ..
        } = event
        else {
            return;
        };
        // A fault that is armed again is a new one.
        if !fired {
            self.0.remove(id);
            return;
        }
        let applied = self.0.entry(*id).or_default();
        if applied.len() < MAX_FAULT_TIMES {
            applied.push(AppliedFault {
                at,
                port: *port,
                message: message.clone(),
            });
        }
    }

    fn applications(&self, id: u32) -> &[AppliedFault] {
        self.0.get(&id).map_or(&[], Vec::as_slice)
    }
}

/// Describes the trigger of a fault.
fn trigger_description(fault: &Fault) -> String {
    let mut words = points(fault.kind).join(", or ");
    for (key, value) in fault.active_filters() {
        let _ = write!(words, "; {key} {value}");
    }
    words
}

fn report_json(report: &FaultReport, log: &[AppliedFault]) -> Value {
    let at: Vec<f64> = report.at.iter().copied().map(Time::as_seconds).collect();
    let applied = |fault: &AppliedFault| json!({ "t": fault.at.as_seconds(), "port": fault.port.map(Port::name), "what": fault.message });
    json!({
        "fault": fault_json(&report.fault),
        "spec": report.fault.to_string(),
        "what": report.fault.kind.summary,
        "host": report.fault.kind.remedy,
        "waits_for": trigger_description(&report.fault),
        "armed": report.armed,
        "seen": report.seen,
        "fired": report.fired,
        "at": at,
        "applied": log.iter().map(applied).collect::<Vec<_>>(),
        "words": report.summary(),
    })
}

fn document(faults: &Faults, log: &FaultLog) -> String {
    let each = |report: &FaultReport| report_json(report, log.applications(report.fault.id));
    let report = json!({ "version": 1, "faults": {
        "armed": faults.reports().filter(|report| report.armed).count(),
        "fired": faults.reports().filter(|report| report.fired > 0).count(),
        "never_fired": faults.never_fired().map(|report| report.fault.id).collect::<Vec<_>>(),
        "faults": faults.reports().map(each).collect::<Vec<_>>(),
    }});
    format!("{report:#}\n")
}

/// One test case for each fault. A fault that never fired counts as failed: the host was not tested against it.
fn junit(faults: &Faults, log: &FaultLog) -> String {
    let cases = faults.reports().map(|report| {
        let fault = &report.fault;
        let class = format!("ts3100.faults.{}", fault.kind.name);
        let name = format!("fault {} {fault}", fault.id);
        if report.fired == 0 {
            let trigger = trigger_description(fault);
            let text = format!("{}\nIt waits for: {trigger}\n", fault.kind.summary);
            let mut status = junit::failure(&report.summary(), &text);
            status.set_type("fault-never-fired");
            return junit::case(&class, &name, Duration::ZERO, status);
        }
        let mut text = format!("{}\n", report.summary());
        for AppliedFault { at, port, message } in log.applications(fault.id) {
            let place = port.map(|port| format!("{port} ")).unwrap_or_default();
            let _ = writeln!(text, "{place}at {:.3} s: {message}", at.as_seconds());
        }
        let _ = writeln!(text, "A robust host: {}", fault.kind.remedy);
        let mut case = junit::case(&class, &name, Duration::ZERO, junit::success());
        case.set_system_out(text);
        case
    });
    junit::report("ts3100 faults", Duration::ZERO, cases)
}

/// Creates the files, so that errors show before the run.
///
/// # Errors
/// The first that cannot be written.
pub fn prepare(files: &[PathBuf]) -> Result<(), PathError> {
    files.iter().try_for_each(|path| write_report(path, ""))
}

/// Writes the report into these files: JUnit XML where a name ends in `.xml`, otherwise JSON.
///
/// # Errors
/// The first that cannot be written; the others are written.
pub fn write(files: &[PathBuf], faults: &Faults, log: &FaultLog) -> Result<(), PathError> {
    let written = files.iter().map(|path| {
        let text = if files::extension(path) == "xml" {
            junit(faults, log)
        } else {
            document(faults, log)
        };
        write_report(path, &text)
    });
    written.fold(Ok(()), Result::and)
}

/// Logs the outcome of each fault at the end of a run; one that never fired is a warning.
pub fn log_summary(faults: &Faults) {
    for report in faults.reports() {
        let (id, kind, fired) = (report.fault.id, report.fault.kind.name, report.fired);
        let line = report.summary();
        if fired == 0 {
            let seen = report.seen;
            warn!(event = "fault-never-fired", id, kind, seen, "{line}");
        } else {
            info!(event = "fault-report", id, kind, fired, "{line}");
        }
    }
}
