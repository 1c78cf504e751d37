//! `ts3100 coverage merge`: adds up the coverage reports of several runs.
//!
//! The report and its formats are in [`ts3100_recording::reports`]; here files are read and written and the exit code is
//! chosen.

use super::exit::BELOW_COVERAGE;
use super::output;
use crate::config::args;
use crate::log::print_error;
use clap::{Args, Subcommand};
use std::path::PathBuf;
use ts3100_recording::reports::{CoverageReport, coverage_text, write_report};

/// Merge coverage reports of several runs.
#[derive(Debug, Args)]
pub(super) struct CoverageArgs {
    #[command(subcommand)]
    action: CoverageCommand,
}

#[derive(Debug, Subcommand)]
enum CoverageCommand {
    /// Merge reports and print the percentage.
    ///
    /// Exit codes: 0 done; 2 wrong usage, or a file that cannot be read or written; 4 below --min-coverage.
    Merge(MergeArgs),
}

#[derive(Debug, Args)]
struct MergeArgs {
    /// Reports that `serve --coverage FILE.json` wrote
    #[arg(required = true, value_name = "FILE")]
    reports: Vec<PathBuf>,
    /// Write the result: .html for a page, otherwise JSON (repeatable)
    #[arg(long, short, value_name = "FILE", value_parser = args::written_file())]
    out: Vec<PathBuf>,
    /// Exit with code 4 if the result is below this
    #[arg(long, value_name = "PERCENT", value_parser = crate::config::parse_percent)]
    min_coverage: Option<f64>,
}

/// Merges the reports; the exit code.
pub(super) fn run(args: &CoverageArgs) -> anyhow::Result<u8> {
    let CoverageCommand::Merge(args) = &args.action;
    let reports = args.reports.iter().map(|path| CoverageReport::read(path));
    let merged = CoverageReport::merged(reports.collect::<Result<Vec<_>, _>>()?);
    for path in &args.out {
        write_report(path, &coverage_text(&merged, path))?;
    }
    output::print(format!(
        "{:.1} % ({} of {} cells)\n",
        merged.percent, merged.reached, merged.reachable
    ))?;
    if let Some(least) = args.min_coverage.filter(|least| merged.percent < *least) {
        let percent = merged.percent;
        print_error(format_args!(
            "the coverage is {percent:.1} %, below the {least} % of --min-coverage"
        ));
        return Ok(BELOW_COVERAGE);
    }
    Ok(0)
}
