//! Which reports are written at the end of a run, and how they determine its exit code. The contents are in `findings`,
//! `coverage`, `lcov` and the formats beside them.

use super::{CoverageReport, FindingsView, RunRecord, html, junit, lcov, markdown, sarif, write_report};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use ts3100_controller::alarm::AlarmCode;
use ts3100_controller::{Config, Controller, Findings, Rule, Severity};
use ts3100_driver::files::{self, PathError};
use ts3100_proto::words::UnexpectedWord;

/// Exit code when a denied rule was broken.
pub const DENIED: u8 = 3;
/// Exit code when the coverage is below the least that was asked for.
pub const BELOW_COVERAGE: u8 = 4;

/// When a finding is an error of the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Deny {
    /// Every rule of this severity or worse.
    Severity(Severity),
    Rule(&'static str),
    /// A fault that was armed and never fired.
    NeverFired,
}

/// The word for [`Deny::NeverFired`].
const NEVER_FIRED: &str = "fault-never-fired";

impl Deny {
    /// The words beside the names of rules.
    pub const WORDS: [&str; 5] = ["all", "note", "warning", "error", NEVER_FIRED];

    /// Warnings and errors.
    pub const WARNINGS: Deny = Deny::Severity(Severity::Warning);

    /// Whether the rule is one of them.
    pub fn covers(&self, rule: &Rule) -> bool {
        match self {
            Deny::Severity(severity) => rule.severity >= *severity,
            Deny::Rule(id) => rule.id == *id,
            Deny::NeverFired => false,
        }
    }
}

impl FromStr for Deny {
    type Err = UnexpectedWord;

    /// `all`, a severity, the name of a rule, or the word for faults.
    fn from_str(word: &str) -> Result<Deny, UnexpectedWord> {
        if word == "all" {
            return Ok(Deny::Severity(Severity::Note));
        }
        if word == NEVER_FIRED {
            return Ok(Deny::NeverFired);
        }
        if let Some(severity) = Severity::ALL
            .into_iter()
            .find(|severity| severity.as_str() == word)
        {
            return Ok(Deny::Severity(severity));
        }
        let rule = Rule::by_id(word);
        rule.map(|rule| Deny::Rule(rule.id)).ok_or_else(|| {
            let words = Deny::WORDS.join(", ");
            let expected = format!("{words} or a rule that `ts3100 docs findings` lists");
            let hint = AlarmCode::replacement(word)
                .map(|new| format!("; {word} is now alarm {new}, and alarms are not findings"));
            UnexpectedWord::new(expected, word).hinting(hint.unwrap_or_default())
        })
    }
}

/// Form of the report of findings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum FindingsFormat {
    /// JUnit XML (.xml).
    Junit,
    /// SARIF 2.1.0 (.sarif).
    Sarif,
    /// Markdown for the summary of a CI job, with the coverage (.md).
    Markdown,
    /// A JSON document (.json).
    Json,
}

impl FindingsFormat {
    /// The format for a file extension; JSON by default.
    pub fn from_path(path: &Path) -> FindingsFormat {
        match files::extension(path).as_str() {
            "xml" => FindingsFormat::Junit,
            "sarif" => FindingsFormat::Sarif,
            "md" => FindingsFormat::Markdown,
            _ => FindingsFormat::Json,
        }
    }
}

/// The reports of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reports {
    /// Files for the findings, each in its form.
    pub findings: Vec<(PathBuf, FindingsFormat)>,
    /// Findings that make the run fail.
    pub deny: Vec<Deny>,
    /// Files for the coverage of the permission tables: `.html` a page, any other JSON.
    pub coverage: Vec<PathBuf>,
    /// Least coverage in percent.
    pub min_coverage: Option<f64>,
    /// File for the lines of the user files executed, as lcov has it.
    pub lcov: Option<PathBuf>,
}

/// Result of the reports of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReportOutcome {
    /// Denied rules that were broken, and how often.
    pub denied: Vec<(&'static Rule, u64)>,
    /// Numbers of the faults that never fired, if `--deny` includes them.
    pub never_fired: Vec<u32>,
    /// Coverage reached and asked for in percent, if it is below that.
    pub below_coverage: Option<(f64, f64)>,
}

impl ReportOutcome {
    /// 0, [`DENIED`], or [`BELOW_COVERAGE`].
    pub fn exit_code(&self) -> u8 {
        if !self.denied.is_empty() || !self.never_fired.is_empty() {
            DENIED
        } else if self.below_coverage.is_some() {
            BELOW_COVERAGE
        } else {
            0
        }
    }
}

impl Reports {
    /// Creates every file, so that errors show before the run.
    ///
    /// # Errors
    /// The first that cannot be written.
    pub fn prepare(&self) -> Result<(), PathError> {
        let findings = self.findings.iter().map(|(path, _)| path);
        let paths = findings.chain(&self.coverage).chain(&self.lcov);
        paths.into_iter().try_for_each(|path| write_report(path, ""))
    }

    /// Writes all reports except that of the faults. `loaded` are the files of the PC that were put on the RAM drive;
    /// `run` is the file to show for the whole run where a viewer needs one.
    ///
    /// # Errors
    /// The first that cannot be written; the others are written.
    pub fn write_all(
        &self,
        run_record: &RunRecord,
        controller: &Controller,
        loaded: &[PathBuf],
        run: &Path,
    ) -> Result<ReportOutcome, PathError> {
        let config = controller.config();
        let findings = run_record.findings();
        let mut written = Ok(());
        for (path, format) in &self.findings {
            let text = self.findings_text(&findings, *format, run_record, config, run);
            written = written.and(write_report(path, &text));
        }
        // Going through all cells takes longer than a short run.
        let is_asked = !self.coverage.is_empty() || self.min_coverage.is_some();
        let coverage = is_asked.then(|| run_record.coverage(config));
        for (path, coverage) in self.coverage.iter().zip(coverage.iter().cycle()) {
            written = written.and(write_report(path, &coverage_text(coverage, path)));
        }
        if let Some(path) = &self.lcov {
            written = written.and(lcov::write(path, &run_record.executed(), config, loaded));
        }
        written?;
        let broken = findings.broken();
        let denied = broken.filter(|(rule, _)| self.deny.iter().any(|deny| deny.covers(rule)));
        let reached = coverage.map(|coverage| coverage.percent);
        let below = reached
            .zip(self.min_coverage)
            .filter(|(reached, least)| reached < least);
        let never_fired = controller.faults().never_fired().map(|report| report.fault.id);
        let never_fired = never_fired.filter(|_| self.deny.contains(&Deny::NeverFired));
        Ok(ReportOutcome {
            never_fired: never_fired.collect(),
            denied: denied.map(|(rule, tally)| (rule, tally.count)).collect(),
            below_coverage: below,
        })
    }

    fn findings_text(
        &self,
        findings: &Findings,
        format: FindingsFormat,
        run: &RunRecord,
        config: &Config,
        run_file: &Path,
    ) -> String {
        let view = || FindingsView::of_run(findings, &run.command_coverage(), &run.executed());
        match format {
            FindingsFormat::Junit => junit::document(findings, |rule| fails(&self.deny, rule)),
            FindingsFormat::Sarif => pretty(&sarif::document(findings, run_file)),
            FindingsFormat::Markdown => markdown::document(&view(), &run.coverage(config)),
            FindingsFormat::Json => pretty(&view()),
        }
    }
}

/// A coverage report in the format for the extension of its file.
pub fn coverage_text(report: &CoverageReport, path: &Path) -> String {
    match files::extension(path).as_str() {
        "html" | "htm" => html::page(report),
        _ => pretty(report),
    }
}

fn pretty(document: &impl serde::Serialize) -> String {
    // Fails only for a map with keys that are no text, and there is none.
    let mut text = serde_json::to_string_pretty(document).unwrap_or_default();
    text.push('\n');
    text
}

/// Whether a broken rule fails its test case when these are denied.
fn fails(deny: &[Deny], rule: &Rule) -> bool {
    // What is denied of faults says nothing of rules.
    if deny.iter().all(|deny| *deny == Deny::NeverFired) {
        return Deny::WARNINGS.covers(rule);
    }
    deny.iter().any(|deny| deny.covers(rule))
}
