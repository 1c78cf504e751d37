//! The emulator that a recording is played to: the flags and files that the recording names, and flags given beside them.

use crate::config::args;
use crate::config::{self, Environment, ServeArgs, Settings};
use crate::loading;
use anyhow::anyhow;
use clap::{Args, Parser};
use std::path::PathBuf;
use ts3100_controller::{ControlRight, ControllerType, Dialect, KeySwitch};
use ts3100_recording::diff::Candidate;
use ts3100_recording::transcript::Header;

/// The flags of `serve` that make the controller.
#[derive(Debug, Clone, Default, Args)]
pub struct RobotArgs {
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

/// The emulator that a recording itself describes.
///
/// # Errors
/// As for [`settings`], and what the controller refuses.
pub fn candidate(header: &Header) -> anyhow::Result<Candidate> {
    Ok(loading::candidate(&settings(&RobotArgs::default(), header)?)?)
}

/// The flags given, over those of a configuration file, over those of the recording.
///
/// # Errors
/// A flag, or a file that one names, is wrong.
pub fn settings(flags: &RobotArgs, header: &Header) -> anyhow::Result<Settings> {
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
