//! `ts3100 run`: runs a SCOL program without sockets.
//!
//! Here the flags and files are read and the exit code is chosen. The run is [`crate::headless`]; its output is
//! [`show`].

pub(super) mod show;

use super::check::CheckedFile;
use super::exit::{NEGATIVE, UNUSABLE};
use super::input::{self, is_stdin};
use super::output;
use super::programs::points_beside;
use super::serve::list_options;
use super::watch::{Announcement, watch};
use crate::config::args::{line_number, seconds, written_file};
use crate::config::model::ModelChoice;
use crate::config::of_run;
pub(super) use crate::config::reason;
use crate::headless::{self, RunEnd, RunError, RunRequest};
use crate::log::print_error;
use anyhow::{Context, bail};
use clap::Args;
use scol_mini::Severity;
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use ts3100_control::printable::printable;
use ts3100_controller::Config;
use ts3100_controller::signals::{LINE_NUMBERS, Signals};
use ts3100_driver::clock::TimeMode;
use ts3100_driver::pc_file::{drive_content, drive_name};
use ts3100_recording::reports::lcov;
use ts3100_recording::scenario::{MAX_ENTRIES, Scenario, Step};

/// Largest file of records, in bytes.
const MAX_RECORDS: u64 = 64 * 1024 * 1024;
/// Longest run that can be asked for: a hundred years.
const MAX_TIME: &str = "3155760000s";
/// The channels a program can INPUT from.
pub(super) const CHANNELS: [&str; 4] = ["TP", "COM1", "IP1", "IP2"];

/// Run a SCOL program without a host or sockets.
///
/// PRINT writes to stdout, INPUT reads records from files. Cycle time, position and outputs are printed to stderr at the
/// end.
///
/// Exit codes: 0 the program ended or stopped, or --watch was ended by a signal; 1 alarm, an INPUT without a record, deadlock, --max-time reached, or an
/// expectation of the scenario that was not met; 2 wrong usage, a file that cannot be read, or a program with errors.
#[derive(Debug, Args)]
pub(super) struct RunArgs {
    /// The program; - is stdin
    #[arg(value_name = "FILE")]
    pub(super) file: PathBuf,
    /// Records for INPUT of a channel (tp, com1, ip1, ip2), one per line; - is stdin (repeatable)
    #[arg(long, value_name = "CHANNEL=FILE")]
    input: Vec<String>,
    /// Input lines that are on from the start, separated by commas
    #[arg(long, value_name = "LINE", value_delimiter = ',', value_parser = line_number)]
    din: Vec<u16>,
    /// Something that happens during the run, as in "1.5 s: input 8 on"; times count from START (repeatable)
    #[arg(long, value_name = "TIME: ACTION")]
    at: Vec<String>,
    /// What happens during the run and what is expected, as for serve
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Exit with 0 if an INPUT finds no record
    #[arg(long)]
    input_optional: bool,
    /// How time passes: auto (as fast as possible), real, x10 (any factor)
    #[arg(long, value_name = "MODE", default_value = "auto")]
    time: TimeMode,
    /// Longest run in virtual time
    #[arg(long, value_name = "TIME", default_value = "3600s", value_parser = seconds("1us", MAX_TIME))]
    max_time: Duration,
    /// Print every statement to stderr with its time and line, the values that it gives, the way of an IF and the target of a motion
    #[arg(long)]
    trace: bool,
    /// Print where the cycle goes to stderr: the statements by the time that the program was at them
    #[arg(long)]
    profile: bool,
    /// Write the executed lines as an lcov tracefile
    #[arg(long, value_name = "FILE", value_parser = written_file())]
    lcov: Option<PathBuf>,
    /// Print one JSON document to stdout instead of text
    #[arg(long)]
    json: bool,
    /// Arm, as for serve
    #[arg(long, value_name = "MODEL")]
    model: Option<String>,
    /// Points taught on the controller, as for serve [default: points.csv beside the program]
    #[arg(long, value_name = "FILE")]
    points: Option<PathBuf>,
    /// Override a named option, as for serve (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Run again whenever the program or another file of the run changes, until Ctrl-C; with --json, one line for each run
    #[arg(long)]
    watch: bool,
}

impl RunArgs {
    /// The table of points: the one that is named, or that of the folder of the program.
    fn table(&self) -> Option<PathBuf> {
        self.points.clone().or_else(|| points_beside(&self.file))
    }

    /// Files whose changes change the run.
    fn sources(&self) -> Vec<PathBuf> {
        let records = self.input.iter().filter_map(|pair| pair.split_once('='));
        let records = records.map(|(_, path)| PathBuf::from(path));
        let models = self.model.iter().filter_map(|model| match model.parse() {
            Ok(ModelChoice::File(path)) => Some(path),
            // An unknown word is reported by the run.
            Ok(ModelChoice::Shipped(_)) | Err(_) => None,
        });
        let settings = self.scenario.iter().cloned().chain(self.table());
        let program = std::iter::once(self.file.clone());
        program.chain(records).chain(models).chain(settings).collect()
    }
}

/// Runs the program; the exit code. With `--watch` it runs it again and again.
pub(super) fn run(args: RunArgs) -> anyhow::Result<u8> {
    if !args.watch {
        return run_once(&args, &AtomicBool::new(false));
    }
    if args.sources().iter().any(|path| is_stdin(path)) {
        bail!("cannot watch stdin; name a file");
    }
    let announcement = Announcement::new(args.json);
    watch(args, announcement, RunArgs::sources, run_once)
}

/// Runs the program until its end, or until the flag is set.
fn run_once(args: &RunArgs, outdated: &AtomicBool) -> anyhow::Result<u8> {
    if args.set.iter().any(|pair| pair == "help") {
        return list_options().map(|()| 0);
    }
    let config = config(args)?;
    let checked = CheckedFile::check(&args.file, &config);
    let (source, remarks) = checked
        .result
        .with_context(|| format!("cannot read {}", checked.name))?;
    let errors: Vec<_> = remarks.iter().filter(|d| d.severity == Severity::Error).collect();
    if !errors.is_empty() {
        for remark in errors {
            let text = remark.render(&source, &checked.name);
            output::tell(format_args!("{}\n", printable(text.trim_end())));
        }
        return Ok(UNUSABLE);
    }
    let job = request(args, &source, &config)?;
    let programs = config.compile(&source).program;
    let programs = programs.iter().flat_map(|program| program.program_lines());
    let programs = programs.map(|(name, line)| (name.to_owned(), line)).collect();
    let style = show::Style::new(args.json, args.watch);
    let mut screen = show::RunPrinter::new(&source, programs, style);
    let report = match headless::run_until(outdated, job, &mut |at, event| screen.show(at, event)) {
        Err(RunError::Interrupted) => return Ok(NEGATIVE),
        Err(RunError::Start(reason)) => {
            print_error(format_args!("{reason}"));
            return Ok(NEGATIVE);
        }
        report => report?,
    };
    screen.finish(&report)?;
    if let Some(path) = &args.lcov {
        lcov::write(path, &report.executed, &config, std::slice::from_ref(&args.file))?;
    }
    let failed = report.scenario.is_some_and(|outcome| outcome.has_failed());
    Ok(match exit_code(&report.end, args.input_optional) {
        0 if failed => NEGATIVE,
        code => code,
    })
}

/// The exit code of a run that has ended like this.
pub(super) fn exit_code(end: &RunEnd, input_optional: bool) -> u8 {
    match end {
        RunEnd::OutOfInput { .. } | RunEnd::NoInput { .. } if !input_optional => NEGATIVE,
        RunEnd::Alarm { .. } | RunEnd::Blocked { .. } | RunEnd::TimeUp { .. } | RunEnd::PowerOff => NEGATIVE,
        RunEnd::End | RunEnd::Stopped { .. } | RunEnd::OutOfInput { .. } | RunEnd::NoInput { .. } => 0,
    }
}

/// The controller that runs the program.
pub(super) fn config(args: &RunArgs) -> anyhow::Result<Config> {
    of_run(args.model.as_deref(), &args.set, args.table())
}

/// The run of a program without errors.
pub(super) fn request(args: &RunArgs, source: &str, config: &Config) -> anyhow::Result<RunRequest> {
    if let Some(line) = args.din.iter().find(|line| !Signals::exists(**line)) {
        bail!("--din {line}: expected input lines, {LINE_NUMBERS}");
    }
    let name = drive_name(&args.file).unwrap_or_else(|_| "MAIN".to_owned());
    Ok(RunRequest {
        scenario: scenario(args, &name)?,
        name,
        source: drive_content(source.as_bytes(), config.options.line_end),
        records: read_records(&args.input, is_stdin(&args.file))?,
        lines_on: args.din.clone(),
        position: None,
        call: None,
        trace: args.trace,
        profile: args.profile,
        record_lines: args.lcov.is_some(),
        time: args.time,
        max_time: args.max_time,
        config: config.clone(),
    })
}

/// What `--scenario` and `--at` say about a run of the program `name`.
fn scenario(args: &RunArgs, name: &str) -> anyhow::Result<Option<Scenario>> {
    if args.scenario.is_none() && args.at.is_empty() {
        return Ok(None);
    }
    let file = args.scenario.as_deref();
    let mut scenario = file.map(Scenario::read).transpose()?.unwrap_or_default();
    let start = &scenario.start;
    let other = start
        .select
        .as_ref()
        .filter(|selected| !selected.eq_ignore_ascii_case(name));
    let unfit = [
        ("restore", start.restore.is_some()),
        ("load", !start.load.is_empty()),
        ("select", other.is_some()),
    ];
    if let Some((key, _)) = unfit.into_iter().find(|(_, is_given)| *is_given) {
        let file = file.unwrap_or(Path::new("")).display();
        bail!(
            "{file}: `{key}` in [start] has no effect on `run`, which runs {name} alone; use `ts3100 exec`"
        );
    }
    let count = scenario.steps.len() + args.at.len();
    if count > MAX_ENTRIES {
        bail!("--at: expected at most {MAX_ENTRIES} steps, found {count}");
    }
    for words in &args.at {
        let step = Step::parse(words).with_context(|| format!("--at \"{words}\""))?;
        scenario.steps.push(step);
    }
    Ok(Some(scenario))
}

/// The records of every `--input`.
fn read_records(
    inputs: &[String],
    program_on_stdin: bool,
) -> anyhow::Result<BTreeMap<String, VecDeque<Vec<u8>>>> {
    let mut records = BTreeMap::new();
    for pair in inputs {
        let expected = "expected tp, com1, ip1 or ip2, = and a file";
        let (channel, path) = pair
            .split_once('=')
            .with_context(|| format!("--input {pair}: {expected}"))?;
        let channel = channel.trim().to_ascii_uppercase();
        if !CHANNELS.contains(&channel.as_str()) {
            bail!("--input {pair}: {expected}");
        }
        if program_on_stdin && path == "-" {
            bail!("--input {pair}: cannot read stdin twice: the program comes from it");
        }
        let bytes = input::read(Path::new(path), MAX_RECORDS).with_context(|| format!("--input {pair}"))?;
        let lines = bytes
            .split(|byte| matches!(byte, b'\r' | b'\n'))
            .filter(|line| !line.is_empty())
            .map(<[u8]>::to_vec);
        if records.insert(channel.clone(), lines.collect()).is_some() {
            bail!("--input {pair}: {channel} is given twice");
        }
    }
    Ok(records)
}
