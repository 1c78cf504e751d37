//! JUnit reports: the one suite that every report of ours holds, and the findings as test cases, one for each rule, so
//! that CI shows the rules that were kept, too. The XML is `quick_junit`'s.

use super::findings::line;
use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};
use std::fmt::Write as _;
use std::time::Duration;
use ts3100_controller::findings::{Findings, RULES, Rule, Tally};

/// A report of one suite.
pub fn report(name: &str, time: Duration, cases: impl IntoIterator<Item = TestCase>) -> String {
    let mut suite = TestSuite::new(name);
    suite.set_time(time);
    suite.add_test_cases(cases);
    let mut report = Report::unnamed();
    report.add_test_suite(suite);
    // Writing into memory cannot fail.
    report.to_string().unwrap_or_default()
}

/// A test case; `time` is virtual.
pub fn case(class: &str, name: &str, time: Duration, status: TestCaseStatus) -> TestCase {
    let mut case = TestCase::new(name, status);
    case.set_classname(class);
    case.set_time(time);
    case
}

/// The status of a case that failed: `message` is one line, `text` all of it.
pub fn failure(message: &str, text: &str) -> TestCaseStatus {
    unsuccessful(NonSuccessKind::Failure, message, text)
}

/// The status of a case that could not be tried: `message` is one line, `text` all of it.
pub fn error(message: &str, text: &str) -> TestCaseStatus {
    unsuccessful(NonSuccessKind::Error, message, text)
}

/// The status of a case that passed.
pub fn success() -> TestCaseStatus {
    TestCaseStatus::success()
}

/// The status of a case that could not be tried; it does not count as a failure.
pub fn skipped(message: &str) -> TestCaseStatus {
    let mut status = TestCaseStatus::skipped();
    status.set_message(message);
    status
}

fn unsuccessful(kind: NonSuccessKind, message: &str, text: &str) -> TestCaseStatus {
    let mut status = TestCaseStatus::non_success(kind);
    status.set_message(message);
    status.set_description(text);
    status
}

/// A broken rule is a failure if it is denied; without `--deny`, if it is a warning or an error. A finding that a fault
/// caused is not a failure.
pub(super) fn document(findings: &Findings, fails: impl Fn(&Rule) -> bool) -> String {
    let cases = RULES.iter().map(|rule| {
        let broken = findings.broken().find(|(broken, _)| broken == rule);
        let caused = findings.caused().find(|(caused, _)| caused == rule);
        let tallies = [broken, caused].map(|found| found.map(|(_, tally)| tally));
        rule_case(rule, tallies, fails(rule))
    });
    report("ts3100 findings", Duration::ZERO, cases)
}

/// The case of a rule with the findings of hosts and of faults.
fn rule_case(rule: &Rule, tallies: [Option<&Tally>; 2], fails: bool) -> TestCase {
    let severity = rule.severity.as_str();
    let class = format!("ts3100.findings.{severity}");
    let with = |status| case(&class, rule.id, Duration::ZERO, status);
    let [broken, _] = tallies;
    if tallies == [None, None] {
        return with(success());
    }
    let mut text = format!(
        "{}\nManual: {}\nDo: {}\nSee: {}\n",
        rule.title,
        rule.source,
        rule.remedy,
        ts3100_book::explain_command(rule.id)
    );
    for tally in tallies.into_iter().flatten() {
        for finding in &tally.first {
            let _ = writeln!(text, "{}", line(finding));
        }
        let more = tally.count.saturating_sub(tally.first.len() as u64);
        if more > 0 {
            let _ = writeln!(text, "and {more} more");
        }
    }
    if fails && let Some(tally) = broken {
        let mut status = failure(&format!("{} ({} times)", rule.title, tally.count), &text);
        status.set_type(severity);
        return with(status);
    }
    let mut case = with(success());
    case.set_system_out(text);
    case
}
