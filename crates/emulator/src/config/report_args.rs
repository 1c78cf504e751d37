//! The flags of `serve` that ask for reports at the end of a run and for an exit code that depends on them.
//!
//! The reports are written by [`ts3100_recording::reports`]. The doc comments are the help texts.

use super::args::written_file;
use super::flag_group::flag_group;
use std::path::PathBuf;
use ts3100_proto::words::UnexpectedWord;
use ts3100_recording::reports::{Deny, FindingsFormat, Reports};
use ts3100_recording::transcript::TranscriptFile;

flag_group! {
    /// What is reported at the end of a run.
    #[command(next_help_heading = "Reports")]
    pub struct ReportArgs {
        /// Record every port: .txt, .jsonl, or .pcapng for Wireshark (repeatable)
        #[arg(long, value_name = "FILE", action = clap::ArgAction::Append)]
        pub transcript: Vec<TranscriptFile>,
        /// Report what each fault did, and which never fired: .xml for JUnit, otherwise JSON (repeatable)
        #[arg(long, value_name = "FILE", value_parser = written_file())]
        pub report: Vec<PathBuf>,
        /// Write the findings, the protocol mistakes of hosts: .xml for JUnit, .sarif for SARIF, .md for Markdown, otherwise
        /// JSON (repeatable)
        #[arg(long, value_name = "FILE", value_parser = written_file())]
        pub findings: Vec<PathBuf>,
        /// Format of the findings, whatever the file name ends with
        #[arg(long, value_name = "FORMAT")]
        pub findings_format: Option<FindingsFormat>,
        /// Exit with code 3 on these findings: all, note, warning (and worse), error, a rule, or fault-never-fired
        #[arg(long, value_name = "RULE", value_delimiter = ',')]
        pub deny: Vec<Deny>,
        /// Write which cells of the permission tables hosts reached: .html for a page, otherwise JSON (repeatable)
        #[arg(long, value_name = "FILE", value_parser = written_file())]
        pub coverage: Vec<PathBuf>,
        /// Exit with code 4 if the coverage is below this
        #[arg(long, value_name = "PERCENT", value_parser = parse_percent)]
        pub min_coverage: Option<f64>,
        /// Write the executed lines of user files as an lcov tracefile
        #[arg(long, value_name = "FILE", value_parser = written_file())]
        pub lcov: Option<PathBuf>,
    }
}

impl ReportArgs {
    /// The reports these arguments ask for.
    pub fn reports(&self) -> Reports {
        let format = |path: &PathBuf| {
            self.findings_format
                .unwrap_or_else(|| FindingsFormat::from_path(path))
        };
        Reports {
            findings: self
                .findings
                .iter()
                .map(|path| (path.clone(), format(path)))
                .collect(),
            deny: self.deny.clone(),
            coverage: self.coverage.clone(),
            min_coverage: self.min_coverage,
            lcov: self.lcov.clone(),
        }
    }
}

/// Parses a percentage, 0 to 100.
///
/// # Errors
/// Not a number, or out of range.
pub fn parse_percent(text: &str) -> Result<f64, UnexpectedWord> {
    let number = text.parse::<f64>().ok();
    number
        .filter(|number| (0.0..=100.0).contains(number))
        .ok_or_else(|| UnexpectedWord::new("0 to 100", text))
}
