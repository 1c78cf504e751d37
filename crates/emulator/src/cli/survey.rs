//! `ts3100 survey`, `ts3100 conform` and `ts3100 fidelity`: what a controller answers where the manual leaves it open.
//!
//! Questions, readings and the file are [`ts3100_survey`]. Here are the flags, what people see, and files.

mod page;

use super::exit::{NEGATIVE, NO_ANSWER, UNUSABLE};
use super::serve::stop_signal;
use super::{output, tap};
use crate::config::args;
use crate::embed::single_threaded;
use crate::log::{print_error, print_note};
use anyhow::{Context as _, anyhow};
use clap::{Args, Subcommand};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::io::{self, BufRead as _, Write as _};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use ts3100_driver::files;
use ts3100_proto::parameter::SerialSettings;
use ts3100_proto::words::{UnexpectedWord, Word};
use ts3100_recording::reports::junit;
use ts3100_recording::transcript::{PeerId, Record, RecordKind, Recording};
use ts3100_survey::ledger::{self, EvidenceLevel};
use ts3100_survey::passive::{Observation, Passive};
use ts3100_survey::{
    Answer, Class, Difference, Peer, Plan, Report, SerialPeer, TcpPeer, Verdict, catalogue, survey,
};

/// A line on stdout; a closed pipe is not an error.
macro_rules! say {
    ($($word:tt)*) => {{
        let _ = writeln!(io::stdout(), $($word)*);
    }};
}

/// Word to type before axes could move.
const CONSENT: &str = "ready";
/// The program and its version, as files name it.
const MADE_BY: &str = concat!("ts3100 ", env!("CARGO_PKG_VERSION"));

/// Find out how a controller answers where the manual leaves it open.
///
/// Asks a real controller, or any other, and writes what it answers into a file: `ts3100 serve --like FILE` then behaves like
/// that controller. By default only commands are sent that change nothing (`look`). One connection, at most 20 requests a
/// second, with the pauses that the manual asks for. It stops at the first unexpected reply and restores what it changed.
/// It sends data to the controller only. Ctrl-C ends it: it restores what it changed, and writes the answers so far.
///
/// Exit codes: 0 done; 1 stopped at an unexpected reply or by Ctrl-C, or the files differ; 2 wrong usage or a file that cannot be read; 3 no reply.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, arg_required_else_help = true)]
pub(super) struct SurveyArgs {
    #[command(subcommand)]
    command: Option<SurveyCommand>,
    #[command(flatten)]
    target: TargetArgs,
    /// Write the answers to this file
    #[arg(long, value_name = "FILE", value_parser = args::written_file())]
    out: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum SurveyCommand {
    /// Explain a file of a survey
    Show {
        /// The file
        file: PathBuf,
        /// Write a page of HTML to stdout instead of text
        #[arg(long)]
        html: bool,
    },
    /// List the questions that two controllers answer in different ways; exit code 1 if there are any. Questions that only one
    /// file answers are listed apart
    Diff {
        /// One file
        first: PathBuf,
        /// The other one
        second: PathBuf,
    },
    /// Find the answers that a recording of a host at work contains
    Infer {
        /// Recording of `tap` or `serve --transcript`, .txt or .jsonl
        recording: PathBuf,
        /// Write the answers to this file
        #[arg(long, value_name = "FILE", value_parser = args::written_file())]
        out: Option<PathBuf>,
    },
}

/// Which controller, and what it is asked.
#[derive(Debug, Args)]
struct TargetArgs {
    /// The controller: NAME or NAME:PORT, where PORT is that of IP0 [default port: 1000]; IP1 is the next one
    #[arg(value_name = "ADDRESS", required_unless_present = "serial")]
    address: Option<String>,
    /// Port of IP1, if it is not the port after IP0's
    #[arg(long, value_name = "PORT", value_parser = args::whole(0, u16::MAX))]
    ip1: Option<u16>,
    /// Ask at HOST instead, over this serial port of the computer, for example /dev/ttyUSB0 or COM3
    #[arg(long, value_name = "DEVICE", conflicts_with = "address")]
    serial: Option<String>,
    /// Settings of HOST in [U06]: speed, length, parity (0 none, 1 odd, 2 even), stop bits
    #[arg(long, value_name = "SETTINGS", default_value = "9600 8 0 1", value_parser = serial_settings)]
    serial_settings: SerialSettings,
    /// Questions of these classes: look changes nothing; files stores and erases a file TSSURVEY; program runs programs
    /// that compute, print and wait; motion turns the last axis and moves the arm a little, with a person at the
    /// emergency stop
    #[arg(long, value_name = "CLASS", value_delimiter = ',', default_value = "look", value_parser = args::word::<Class>())]
    ask: Vec<Class>,
    /// Only these questions; `--dry-run` lists them
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    only: Vec<String>,
    /// Show what would be sent, and send nothing
    #[arg(long)]
    dry_run: bool,
}

/// Check another controller or emulator for the behaviour of this one.
///
/// Asks the questions of `survey`. A question passes if the answer is a known reading of the manual; with --strict only
/// if it is the one that this emulator has by default.
///
/// Exit codes: 0 all passed; 1 one failed, or stopped by Ctrl-C; 2 wrong usage; 3 no reply.
#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
pub(super) struct ConformArgs {
    #[command(flatten)]
    target: TargetArgs,
    /// Also fail if the controller behaves in another known way
    #[arg(long)]
    strict: bool,
    /// Write the result as JUnit XML
    #[arg(long, value_name = "FILE", value_parser = args::written_file())]
    junit: Option<PathBuf>,
}

/// Show how many behaviours are confirmed, observed or assumed.
#[derive(Debug, Args)]
pub(super) struct FidelityArgs {
    /// List the rows: id, evidence, survey question or why there is none, and behaviour of the
    /// emulator
    #[arg(long)]
    list: bool,
    /// Print counts and rows as one JSON document
    #[arg(long, conflicts_with = "list")]
    json: bool,
}

fn serial_settings(text: &str) -> Result<SerialSettings, UnexpectedWord> {
    let expected = "speed, length, parity and stop bits, for example 9600 8 0 1";
    SerialSettings::parse(text).ok_or_else(|| UnexpectedWord::new(expected, text))
}

/// Runs `survey`.
pub(super) fn run(args: &SurveyArgs) -> anyhow::Result<u8> {
    match &args.command {
        None => ask_controller(&args.target, args.out.as_deref()),
        Some(SurveyCommand::Show { file, html }) => {
            let report = read(file)?;
            let page = if *html { page::html } else { page::text };
            output::print(page(&report)).map(|()| 0)
        }
        Some(SurveyCommand::Diff { first, second }) => compare(first, second),
        Some(SurveyCommand::Infer { recording, out }) => infer(recording, out.as_deref()),
    }
}

/// Reads a file of a survey.
///
/// # Errors
/// It cannot be read, or is none; the message names it.
pub(crate) fn read(path: &Path) -> anyhow::Result<Report> {
    let text = files::read_text(path, ts3100_survey::MAX_REPORT)
        .with_context(|| format!("cannot read {}", path.display()))?;
    Report::read(&text).with_context(|| path.display().to_string())
}

fn plan(target: &TargetArgs) -> anyhow::Result<Plan> {
    for id in &target.only {
        if catalogue::find(id).is_none() {
            let known = catalogue::probes().map(|probe| probe.id);
            let hint = ts3100_proto::words::did_you_mean(id, known);
            return Err(anyhow!("--only: unknown question `{id}`{hint}"));
        }
    }
    let plan = Plan {
        classes: target.ask.clone(),
        only: target.only.clone(),
        ..Plan::default()
    };
    if plan.probes().next().is_none() {
        return Err(anyhow!("the questions of --only are of other classes than --ask"));
    }
    Ok(plan)
}

fn peer(target: &TargetArgs) -> anyhow::Result<Box<dyn Peer>> {
    if let Some(device) = &target.serial {
        return Ok(Box::new(SerialPeer::new(device, target.serial_settings)));
    }
    let ip0 = tap::real_address(target.address.as_deref().unwrap_or_default())?;
    let next = ip0.port().checked_add(1).unwrap_or(ip0.port());
    let ip1 = SocketAddr::new(ip0.ip(), target.ip1.unwrap_or(next));
    Ok(Box::new(TcpPeer::new(ip0, ip1)))
}

/// Explains what a class of probes may do.
fn explained(class: Class) -> &'static str {
    match class {
        Class::Look => "changes nothing",
        Class::Files => "stores, reads and erases a file TSSURVEY",
        Class::Program => {
            "selects and runs programs TSSURVEY that compute, print and wait; no axis moves; resets the program and its alarms"
        }
        Class::Motion => {
            "switches servo power, executes statements with DO, uses feed hold and BREAK; turns the last axis by up to 10 degrees and moves the arm by 1 mm, and back, at 1 to 5 % of their speed"
        }
    }
}

fn show_plan(plan: &Plan) {
    let mut before = None;
    for probe in plan.probes() {
        if before != Some(probe.class) {
            say!("{} ({}):", probe.class.word(), explained(probe.class));
            before = Some(probe.class);
        }
        say!("  {:<22} {}", probe.id, probe.question);
        say!("  {:<22}   sends {}", "", probe.sends);
    }
}

/// Requires the consent of a person at the robot before it asks.
fn consents(plan: &Plan) -> bool {
    if !plan.probes().any(|probe| probe.class == Class::Motion) {
        return true;
    }
    output::tell(format_args!(
        "The class motion {}. Is the cell empty, and does a person have a hand at the emergency stop?\n\
         Type {CONSENT} to continue: ",
        explained(Class::Motion)
    ));
    let mut line = String::new();
    let read = io::stdin().lock().read_line(&mut line);
    read.is_ok() && line.trim() == CONSENT
}

/// The first signal ends the survey, which puts back what it changed; the second one ends the process.
fn stop_at_a_signal(stop: &Arc<AtomicBool>) -> anyhow::Result<()> {
    const WHAT: &str = "cannot listen for signals";
    let runtime = single_threaded()?;
    let first = runtime.block_on(async { stop_signal() }).context(WHAT)?;
    let stop = Arc::clone(stop);
    std::thread::spawn(move || {
        runtime.block_on(first);
        stop.store(true, Ordering::Relaxed);
        print_note("restoring what was changed; press Ctrl-C again to end at once");
        if let Ok(second) = runtime.block_on(async { stop_signal() }) {
            runtime.block_on(second);
            std::process::exit(NEGATIVE.into());
        }
    });
    Ok(())
}

/// Asks, says how it goes, and hands the answers over; the exit code.
fn asked(
    target: &TargetArgs,
    file: Option<&Path>,
    take: impl FnOnce(&Report) -> anyhow::Result<u8>,
) -> anyhow::Result<u8> {
    let plan = plan(target)?;
    show_plan(&plan);
    if target.dry_run {
        return Ok(0);
    }
    // A file that cannot be written is known before minutes have passed.
    if let Some(path) = file {
        files::check_target(path).with_context(|| cannot_write(path))?;
    }
    if !consents(&plan) {
        print_error(format_args!(
            "nothing was sent: the class motion needs the word {CONSENT}"
        ));
        return Ok(UNUSABLE);
    }
    let mut peer = peer(target)?;
    stop_at_a_signal(&plan.stop)?;
    say!("");
    let mut reason = String::new();
    let report = survey(&mut *peer, &plan, &mut |answer| {
        // One reason may hold for a whole class.
        if !reason.is_empty() && answer.note == reason {
            say!("{:<9} {:<22} as before", answer.verdict.word(), answer.probe);
        } else {
            say!("{}", line(answer));
            reason.clone_from(&answer.note);
        }
    });
    match report {
        Ok(report) => take(&Report {
            made_by: MADE_BY.to_owned(),
            ..report
        }),
        Err(error) if plan.stop.load(Ordering::Relaxed) => {
            print_error(format_args!("stopped: {error}"));
            Ok(NEGATIVE)
        }
        Err(error) => {
            let whom = target.address.iter().chain(&target.serial).next();
            print_error(format_args!(
                "cannot survey {}: {error}. Give the port of IP0, or the line of HOST, and end other host programs: a controller serves one",
                whom.map_or("", String::as_str)
            ));
            Ok(NO_ANSWER)
        }
    }
}

/// Says what is not as it should be at the end. Returns the exit code.
fn ended(report: &Report) -> u8 {
    for left in &report.left {
        print_error(format_args!("not restored: {left}"));
    }
    match &report.stopped {
        None => 0,
        Some(reason) => {
            print_error(format_args!("stopped: {reason}"));
            NEGATIVE
        }
    }
}

fn cannot_write(path: &Path) -> String {
    format!("cannot write {}", path.display())
}

/// One answer.
fn line(answer: &Answer) -> String {
    let sets = answer.sets.as_ref();
    let sets = sets.map_or_else(String::new, |(option, value)| format!("  ({option} = {value})"));
    let said = said(answer);
    format!("{:<9} {:<22} {said}{sets}", answer.verdict.word(), answer.probe)
}

/// The answer as received, or the note why there was none.
fn said(answer: &Answer) -> &str {
    match answer.heard.is_empty() {
        true => &answer.note,
        false => &answer.heard,
    }
}

/// The question of an answer.
fn question(answer: &Answer) -> &'static str {
    catalogue::find(&answer.probe).map_or("", |probe| probe.question)
}

fn summary(report: &Report) -> String {
    let counts = Verdict::ALL
        .iter()
        .map(|verdict| format!("{} {}", report.count(*verdict), verdict.word()));
    counts.collect::<Vec<_>>().join(", ")
}

fn ask_controller(target: &TargetArgs, out: Option<&Path>) -> anyhow::Result<u8> {
    asked(target, out, |report| {
        say!("\n{}", summary(report));
        keep(report, out)?;
        Ok(ended(report))
    })
}

fn keep(report: &Report, out: Option<&Path>) -> anyhow::Result<()> {
    if let Some(path) = out {
        files::replace(path, report.write().as_bytes()).with_context(|| cannot_write(path))?;
        let path = path.display();
        say!("{path}: read it before you give it to others: ts3100 survey show {path}");
        say!("ts3100 serve --like {path} answers like this controller");
    }
    Ok(())
}

fn compare(first: &Path, second: &Path) -> anyhow::Result<u8> {
    let found = ts3100_survey::compare(&read(first)?, &read(second)?);
    for Difference { probe, first, second } in &found.differences {
        say!("{probe:<22} {first} | {second}");
    }
    say!("{} differences", found.differences.len());
    for (file, probes) in [(first, &found.only_first), (second, &found.only_second)] {
        if !probes.is_empty() {
            say!("answered in {} only: {}", file.display(), probes.join(", "));
        }
    }
    Ok(match found.differences.is_empty() {
        true => 0,
        false => NEGATIVE,
    })
}

fn infer(path: &Path, out: Option<&Path>) -> anyhow::Result<u8> {
    let recording = Recording::read(path)?;
    recording.has_beginning(path)?;
    let mut observation = Observation::default();
    for line in protocol_lines(&recording) {
        let mut passive = Passive::new(&mut observation);
        for epoch in recording.epochs() {
            epoch
                .records
                .iter()
                .for_each(|record| observe(&mut passive, line, record));
            // Another state answers now, and counts time from another moment.
            passive.reconnected();
        }
        passive.finish();
    }
    let mut report = observation.report();
    MADE_BY.clone_into(&mut report.made_by);
    for answer in &report.answers {
        say!("{}", line(answer));
    }
    say!("\n{}", summary(&report));
    keep(&report, out)?;
    Ok(0)
}

/// Shows a record to the observer of this connection.
fn observe(passive: &mut Passive<'_>, line: PeerId, record: &Record) {
    let at = Duration::from_micros(record.at.as_micros());
    match &record.kind {
        RecordKind::FromHost { line: from, bytes } if *from == line => passive.host(at, bytes),
        RecordKind::FromRobot { line: to, bytes } if *to == line => passive.robot(at, bytes),
        RecordKind::Connected { line: of, .. } if *of == line => passive.reconnected(),
        RecordKind::Connected { .. }
        | RecordKind::FromHost { .. }
        | RecordKind::FromRobot { .. }
        | RecordKind::Ended { .. }
        | RecordKind::Action(_)
        | RecordKind::Link(_)
        | RecordKind::Remark(_) => {}
    }
}

/// The connections of the recording on which commands are sent.
fn protocol_lines(recording: &Recording) -> BTreeSet<PeerId> {
    let records = recording.records.iter();
    let lines = records.filter_map(|record| {
        let RecordKind::FromHost { line, .. } = &record.kind else {
            return None;
        };
        Some(*line)
    });
    lines.filter(|line| line.port.protocol().is_some()).collect()
}

/// Runs `conform`.
pub(super) fn conform(args: &ConformArgs) -> anyhow::Result<u8> {
    let junit = args.junit.as_deref();
    let fails = |answer: &Answer| match answer.verdict {
        Verdict::Manual | Verdict::Refused => false,
        Verdict::Variation => args.strict,
        Verdict::Unknown => true,
    };
    asked(&args.target, junit, |report| {
        let failed = report.answers.iter().filter(|answer| fails(answer)).count();
        say!("\n{}; {failed} failed", summary(report));
        if let Some(path) = junit {
            files::replace(path, junit_of(report, fails).as_bytes()).with_context(|| cannot_write(path))?;
        }
        Ok(match ended(report) {
            0 if failed > 0 => NEGATIVE,
            code => code,
        })
    })
}

fn junit_of(report: &Report, fails: impl Fn(&Answer) -> bool) -> String {
    let cases = report.answers.iter().map(|answer| {
        let class = catalogue::find(&answer.probe).map_or("look", |probe| probe.class.word());
        let question = question(answer);
        let text = format!("{question}\n{}\n{}", line(answer), answer.traffic.join("\n"));
        let status = match (fails(answer), answer.verdict) {
            (true, _) => junit::failure(&line(answer), &text),
            (false, Verdict::Refused) => junit::skipped(&answer.note),
            (false, Verdict::Manual | Verdict::Variation | Verdict::Unknown) => junit::success(),
        };
        junit::case(
            &format!("ts3100.conform.{class}"),
            &answer.probe,
            Duration::ZERO,
            status,
        )
    });
    junit::report("ts3100 conform", Duration::ZERO, cases)
}

/// Counts and rows for programs; the names are a public format.
fn fidelity_document() -> Value {
    let counts = EvidenceLevel::ALL
        .iter()
        .map(|level| (level.word().to_owned(), json!(ledger::count(*level))));
    let rows = ledger::rows().map(|row| {
        json!({ "id": row.id, "evidence": row.evidence.word(), "survey": row.survey, "behaviour": row.behaviour })
    });
    json!({ "version": 1, "counts": counts.collect::<Value>(), "rows": rows.collect::<Value>() })
}

/// Runs `fidelity`.
pub(super) fn fidelity(args: &FidelityArgs) -> anyhow::Result<u8> {
    if args.json {
        return output::print(format!("{:#}\n", fidelity_document())).map(|()| 0);
    }
    let mut out = String::new();
    if args.list {
        for row in ledger::rows() {
            out += &format!(
                "{:<10} {:<9} {:<34} {}\n",
                row.id,
                row.evidence.word(),
                row.survey,
                row.behaviour
            );
        }
        out += "\n";
    }
    for level in EvidenceLevel::ALL {
        out += &format!("{:>4} {}\n", ledger::count(*level), level.word());
    }
    output::print(out).map(|()| 0)
}
