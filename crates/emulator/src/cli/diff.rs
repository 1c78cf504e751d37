//! `ts3100 diff`: plays a recording to the emulator and lists the differences.
//!
//! The controller is that of the flags and of the recording ([`crate::recorded`]). The comparison is
//! [`ts3100_recording::diff`], its output is [`show`], and the search for better options is [`suggest`].

mod show;
mod suggest;

use super::exit::NEGATIVE;
use crate::config::args::{self, duration};
use crate::loading;
use crate::recorded::{RobotArgs, settings};
use anyhow::{Context as _, anyhow};
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;
use ts3100_recording::diff::{Ignore, Tolerance, diff};
use ts3100_recording::transcript::Recording;

/// Compare a recording of a robot with the emulator.
///
/// Plays the host's side of a recording of `tap` or `serve --transcript` to the emulator in virtual time, and lists every
/// difference between the recorded answers and the emulator's, in bytes and in time. The host's pauses are kept relative
/// to the answers. The emulator is configured from these flags, falling back to the flags and files stored in the
/// recording; environment variables are ignored.
///
/// Exit codes: 0 no difference; 1 differences; 2 wrong usage, or a recording that cannot be read.
#[derive(Debug, Args)]
pub(super) struct DiffArgs {
    /// Recording, .txt or .jsonl
    #[arg(value_name = "TRANSCRIPT")]
    recording: PathBuf,
    /// Accept answers that come this much earlier or later
    #[arg(long, value_name = "TIME", default_value = "100ms", value_parser = duration("0s", "1440min"))]
    time_tolerance: Duration,
    /// Accept coordinates of SF and PR that differ by this much, in mm or degrees
    #[arg(long, value_name = "NUMBER", default_value_t = 0.0, value_parser = args::number)]
    value_tolerance: f64,
    /// Wait this long for a missing answer, in virtual time
    #[arg(long, value_name = "TIME", default_value = "10s", value_parser = duration("0s", "1440min"))]
    patience: Duration,
    /// Do not compare these: clock, versions, positions, lines, time, sp, or keys such as sf.servo or eu.*.date
    #[arg(long, value_name = "WORDS", value_delimiter = ',')]
    ignore: Vec<String>,
    /// Try other values of the named options, and print those that leave fewer differences
    #[arg(long)]
    suggest: bool,
    /// Print one JSON document to stdout instead of text
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    robot: RobotArgs,
}

/// Compares; the exit code.
pub(super) fn run(args: &DiffArgs) -> anyhow::Result<u8> {
    let mut ignore = Ignore::default();
    ignore.add(&args.ignore).context("--ignore")?;
    if args.value_tolerance < 0.0 || !args.value_tolerance.is_finite() {
        return Err(anyhow!("--value-tolerance: expected a number of at least 0"));
    }
    let recording = Recording::read(&args.recording)?;
    recording.has_beginning(&args.recording)?;
    let settings = settings(&args.robot, &recording.header)?;
    let tolerance = Tolerance {
        time: args.time_tolerance,
        value: args.value_tolerance,
        answer_timeout: args.patience,
        ignore,
    };
    let report = diff(&recording, loading::candidate(&settings)?, &tolerance);
    let suggestions = if args.suggest && !report.differences.is_empty() {
        suggest::suggestions(&recording, &settings, &tolerance, &report)
    } else {
        Vec::new()
    };
    show::show(&args.recording, &report, &suggestions, args.json)?;
    Ok(if report.differences.is_empty() {
        0
    } else {
        NEGATIVE
    })
}
