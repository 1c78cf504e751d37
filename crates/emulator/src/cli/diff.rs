//! `ts3100 diff`: plays a recording to the emulator and lists the differences.
//!
//! Here the flags are merged with those the recording names, which configures the controller. The comparison is
//! [`ts3100_recording::diff`], its output is [`show`], and the search for better options is [`suggest`].

mod show;
mod suggest;

use super::exit::NEGATIVE;
use crate::config::args::{self, duration};
use crate::config::{self, Environment, ServeArgs, Settings};
use crate::loading;
use anyhow::{Context as _, anyhow};
use clap::{Args, Parser};
use std::path::PathBuf;
use std::time::Duration;
use ts3100_controller::{ControlRight, ControllerType, Dialect, KeySwitch};
use ts3100_recording::diff::{Ignore, Tolerance, diff};
use ts3100_recording::transcript::{Header, Recording};

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

/// The flags of `serve` that make the controller.
#[derive(Debug, Clone, Args)]
pub(super) struct RobotArgs {
    /// Read settings from a TOML file, as for serve
    #[arg(long, help_heading = "Emulator", value_name = "FILE")]
    config: Option<PathBuf>,
    /// Override a named option, as for serve (repeatable)
    #[arg(long, help_heading = "Emulator", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Preset of the named options, as for serve
    #[arg(long, help_heading = "Emulator", value_name = "DIALECT", value_parser = args::described(args::DIALECTS))]
    dialect: Option<Dialect>,
    /// Arm, as for serve
    #[arg(long, help_heading = "Emulator", value_name = "MODEL")]
    model: Option<config::model::ModelChoice>,
    /// Controller type, as for serve
    #[arg(long, help_heading = "Emulator", value_name = "TYPE", value_parser = args::described(args::CONTROLLERS))]
    controller: Option<ControllerType>,
    /// Key switch, as for serve
    #[arg(long, help_heading = "Emulator", value_name = "POSITION", value_parser = args::word::<KeySwitch>())]
    key_switch: Option<KeySwitch>,
    /// Who commands the robot in EXT, as for serve
    #[arg(long, help_heading = "Emulator", value_name = "WHO", value_parser = args::word::<ControlRight>())]
    control_right: Option<ControlRight>,
    /// Permission tables, as for serve
    #[arg(long, help_heading = "Emulator", value_name = "FILE")]
    permissions: Option<PathBuf>,
    /// Points taught on the controller, as for serve
    #[arg(long, help_heading = "Emulator", value_name = "FILE")]
    points: Option<PathBuf>,
    /// Seed of the random choices of faults, as for serve
    #[arg(long, help_heading = "Emulator", value_name = "N", value_parser = args::whole(0, u64::MAX))]
    fault_seed: Option<u64>,
    /// Legal variation, as for serve
    #[arg(long, help_heading = "Emulator", value_name = "SEED")]
    vary: Option<config::Seed>,
    /// Read the files of the RAM drive from this directory; nothing is written to it
    #[arg(long, help_heading = "Emulator", value_name = "DIR")]
    drive: Option<PathBuf>,
    /// Put these files on the RAM drive instead of those of the recording
    #[arg(long, help_heading = "Emulator", value_name = "FILE", num_args = 1..)]
    load: Vec<PathBuf>,
    /// Select this file of the RAM drive
    #[arg(long, help_heading = "Emulator", value_name = "NAME")]
    select: Option<String>,
    /// Start with servo power on
    #[arg(long, help_heading = "Emulator", value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    servo_on: Option<bool>,
}

/// The flags that a recording names.
#[derive(Debug, Parser)]
#[command(no_binary_name = true)]
struct RecordedFlags {
    #[command(flatten)]
    args: RobotArgs,
}

impl From<RobotArgs> for ServeArgs {
    fn from(robot: RobotArgs) -> ServeArgs {
        ServeArgs {
            robot: args::RobotArgs {
                set: robot.set,
                dialect: robot.dialect,
                model: robot.model,
                controller: robot.controller,
                key_switch: robot.key_switch,
                control_right: robot.control_right,
                permissions: robot.permissions,
                servo_on: robot.servo_on,
                ..args::RobotArgs::default()
            },
            files: args::FileArgs {
                config: robot.config,
                points: robot.points,
                drive: robot.drive,
                load: robot.load,
                select: robot.select,
                ..args::FileArgs::default()
            },
            variation: args::FaultArgs {
                fault_seed: robot.fault_seed,
                vary: robot.vary,
                ..args::FaultArgs::default()
            },
            ..ServeArgs::default()
        }
    }
}

/// Compares; the exit code.
pub(super) fn run(args: &DiffArgs) -> anyhow::Result<u8> {
    let mut ignore = Ignore::default();
    ignore.add(&args.ignore).context("--ignore")?;
    if args.value_tolerance < 0.0 || !args.value_tolerance.is_finite() {
        return Err(anyhow!("--value-tolerance: expected a number of at least 0"));
    }
    let recording = Recording::read(&args.recording)?;
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

/// The flags given, over those of a configuration file, over those of the recording.
pub(super) fn settings(flags: &RobotArgs, header: &Header) -> anyhow::Result<Settings> {
    let words = header.flags.iter().map(|flag| format!("--{flag}"));
    let recorded = RecordedFlags::try_parse_from(words)
        .map_err(|error| anyhow!("a flag of the recording: {}", error.to_string().trim_end()))?;
    let (flags, _) = config::read(flags.clone().into(), &Environment::new())?;
    let merged = flags.with_fallback(recorded.args.into());
    let mut settings = Settings::from_args(&merged)?;
    // Two replays of one recording are the same: the date is the recording's, not today's.
    let fresh = ts3100_controller::Config::new(ts3100_controller::Dialect::default());
    settings.controller.calendar = header.calendar.unwrap_or(fresh.calendar);
    let files = &mut settings.files;
    if files.load.is_empty() && files.drive.is_none() {
        settings.contents.clone_from(&header.files);
        files.select = files.select.take().or_else(|| header.select.clone());
    }
    Ok(settings)
}
