//! Findings as one JSON document: the report of `--findings FILE.json`.

use serde::Serialize;
use ts3100_controller::findings::{Finding, RULES, Tally};
use ts3100_controller::{CommandCoverage, Findings, Port, Rule, Severity, StatementCoverage};
use ts3100_proto::escape::{self, Escaped};
use ts3100_survey::ledger;

/// Version of the document; raised when a key changes its meaning.
const VERSION: u32 = 1;

/// The command that starts a program.
const START: &str = "RN";

/// The value of `caused-by` for a rule.
const BY_FAULT: &str = "fault";

/// All findings of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FindingsView {
    /// Version of this document.
    pub version: u32,
    /// How many rules there are.
    pub rules: usize,
    /// How many of them were broken, by severity.
    pub broken: BrokenRules,
    /// The broken rules in the order of docs/reference/findings.md, then those whose findings faults have caused.
    pub findings: Vec<RuleView>,
    /// Unverified assumptions that the run relied on; only in the report of a run.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub assumptions: Vec<AssumptionView>,
}

/// A row of docs/explanation/fidelity.md whose evidence is "assumed".
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AssumptionView {
    pub id: &'static str,
    /// Behaviour of the emulator.
    pub behaviour: &'static str,
    /// The question of `ts3100 survey` that asks a real controller for it, or why none does.
    pub survey: &'static str,
}

/// Broken rules by severity.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BrokenRules {
    pub note: usize,
    pub warning: usize,
    pub error: usize,
}

/// A broken rule.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RuleView {
    /// Its name.
    pub rule: &'static str,
    /// `note`, `warning` or `error`; `note` if faults have caused the findings.
    pub severity: &'static str,
    /// `fault`, if faults have caused the findings and not the host.
    #[serde(rename = "caused-by", skip_serializing_if = "Option::is_none")]
    pub caused_by: Option<&'static str>,
    /// Section of the manual, and clauses.
    pub source: &'static str,
    pub title: &'static str,
    /// Remedy.
    pub remedy: &'static str,
    /// Command line that explains it.
    pub docs: String,
    /// How often it was broken.
    pub count: u64,
    /// The first breaks.
    pub first: Vec<FindingView>,
}

/// One break of a rule. A published form of its own: the stream of events has the same finding with other keys, where
/// `bytes` is their number, and leaves out a port that is none.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FindingView {
    /// `HOST`, `IP0`, ...; null where no port is concerned.
    pub port: Option<&'static str>,
    /// Virtual time in seconds.
    pub t: f64,
    pub message: String,
    /// The bytes concerned in hex.
    pub bytes: String,
    /// The same for people, control codes by name.
    pub text: String,
    /// The fault that has caused it, with its kind; absent if the host has.
    #[serde(rename = "caused-by", skip_serializing_if = "Option::is_none")]
    pub caused_by: Option<String>,
}

impl FindingsView {
    /// The document of a run: with the assumptions that it rested on, those of the programs on the drive once a host has
    /// started one.
    pub fn of_run(
        findings: &Findings,
        coverage: &CommandCoverage,
        executed: &StatementCoverage,
    ) -> FindingsView {
        let served = || coverage.reached().map(|(cell, _)| cell.row());
        let broken = findings.broken().chain(findings.caused());
        let broken = broken.map(|(rule, _)| rule.id);
        let programs = executed.versions().iter().map(|file| file.content.as_slice());
        let has_started = served().any(|row| row == START);
        let rows = ledger::rests_on(served().chain(broken), programs.filter(|_| has_started));
        let assumptions = rows.map(|row| AssumptionView {
            id: row.id,
            behaviour: row.behaviour,
            survey: row.survey,
        });
        FindingsView {
            assumptions: assumptions.collect(),
            ..FindingsView::new(findings)
        }
    }

    /// The document of these findings.
    pub fn new(findings: &Findings) -> FindingsView {
        let count = |severity: Severity| {
            let broken = findings.broken();
            broken.filter(|(rule, _)| rule.severity == severity).count()
        };
        FindingsView {
            version: VERSION,
            rules: RULES.len(),
            broken: BrokenRules {
                note: count(Severity::Note) + findings.caused().count(),
                warning: count(Severity::Warning),
                error: count(Severity::Error),
            },
            findings: findings
                .broken()
                .chain(findings.caused())
                .map(|(rule, tally)| RuleView::new(rule, tally))
                .collect(),
            assumptions: Vec::new(),
        }
    }
}

impl RuleView {
    fn new(rule: &'static Rule, tally: &Tally) -> RuleView {
        let first = tally.first.first();
        let severity = first.map_or(rule.severity, Finding::severity);
        let is_caused = first.is_some_and(|finding| finding.caused_by.is_some());
        RuleView {
            rule: rule.id,
            severity: severity.as_str(),
            caused_by: is_caused.then_some(BY_FAULT),
            source: rule.source,
            title: rule.title,
            remedy: rule.remedy,
            docs: ts3100_book::explain_command(rule.id),
            count: tally.count,
            first: tally.first.iter().map(FindingView::new).collect(),
        }
    }
}

impl FindingView {
    fn new(finding: &Finding) -> FindingView {
        FindingView {
            port: finding.port.map(Port::name),
            t: finding.at.as_seconds(),
            message: finding.message.to_string(),
            bytes: escape::hex(&finding.bytes),
            text: Escaped::for_reading(&finding.bytes).to_string(),
            caused_by: finding.caused_by.map(|cause| cause.to_string()),
        }
    }
}

/// One line for people: where, when, what, and the bytes.
pub(super) fn line(finding: &Finding) -> String {
    let view = FindingView::new(finding);
    let port = view.port.map(|port| format!("{port} ")).unwrap_or_default();
    let text = match view.text.as_str() {
        "" => String::new(),
        text => format!(" [{text}]"),
    };
    let cause = view.caused_by.map(|cause| format!(" (caused-by: {cause})"));
    let cause = cause.unwrap_or_default();
    format!("{port}at {:.3} s: {}{text}{cause}", view.t, view.message)
}
