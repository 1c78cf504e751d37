//! `ts3100 view`: opens a recorded run, and serves the page that shows it, writes it into a file, or prints what is asked.
//!
//! The emulator is configured as for `diff`. The run itself is [`ts3100_view`].

use super::ctl::target::TOKEN_VARIABLE;
use super::exit::NEGATIVE;
use super::output;
use super::serve::stop_signal;
use crate::embed::single_threaded;
use crate::launch::bind_control;
use crate::loading;
use crate::recorded::{RobotArgs, settings};
use anyhow::{Context as _, anyhow, bail};
use clap::{ArgGroup, Args};
use serde::Serialize;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use ts3100_control::client::Client;
use ts3100_control::recorded::document;
use ts3100_control::{ControlChoice, ControlSettings};
use ts3100_controller::{Time, Watched};
use ts3100_driver::files;
use ts3100_proto::words::UnexpectedWord;
use ts3100_recording::transcript::{Format, Recording};
use ts3100_view::key::{MomentKey, parse_seconds};
use ts3100_view::kind::Kind;
use ts3100_view::list::{self, Line};
use ts3100_view::run::{Opening, Run};
use ts3100_view::summary::Summary;
use ts3100_view::why::{Answer, Found, Question};
use ts3100_view::{html, serve};

/// Watch a recorded run again.
///
/// Opens a recording of `serve --transcript` or of the control interface, and serves the page that shows it: every moment
/// of the run, with a timeline. The emulator plays the recording in virtual time, from the settings that the recording
/// names. Nothing is changed and no port for hosts is open. With the URL of a running emulator its transcript is opened.
///
/// Exit codes: 0 shown; 1 with --errors, when there are some; 2 wrong usage, or a recording that cannot be read.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("moment"), group = ArgGroup::new("output"))]
pub(super) struct ViewArgs {
    /// Recording, .txt or .jsonl, or the URL of a control interface
    #[arg(value_name = "FILE|URL")]
    recording: String,
    /// Show this moment, in seconds of virtual time
    #[arg(long, value_name = "SECONDS", group = "moment", value_parser = moment)]
    at: Option<Time>,
    /// Show the moment of the event of this number
    #[arg(long, value_name = "N", group = "moment")]
    event: Option<u64>,
    /// Show the first moment of this kind: ng, finding, alarm, received, or the rule of a finding
    #[arg(long, value_name = "KIND", group = "moment")]
    first: Option<Kind>,
    /// Show the last moment of this kind
    #[arg(long, value_name = "KIND", group = "moment")]
    last: Option<Kind>,
    /// Print the events, one a line
    #[arg(long, group = "output")]
    list: bool,
    /// Print what went wrong alone: NG, findings, alarms
    #[arg(long, requires = "list")]
    errors: bool,
    /// Print a summary: what went wrong first, findings with their remedies, the last texts
    #[arg(long, group = "output")]
    summary: bool,
    /// Print each change of this value with its cause, until the moment: N, PICK.N, din.3, dout.5, override, mode, servo
    #[arg(long, value_name = "VALUE", group = "output")]
    why: Option<Watched>,
    /// Print a variable at each execution of a line, such as N@PICK:7
    #[arg(long, value_name = "VALUE@FILE:LINE", group = "output")]
    watch: Option<Watch>,
    /// Print JSON: of a moment its state, otherwise what is printed
    #[arg(long)]
    json: bool,
    /// Write the run as one HTML file that needs nothing else
    #[arg(long, value_name = "FILE", group = "output")]
    html: Option<PathBuf>,
    /// Serve the page here; port 0 is a free one
    #[arg(long, value_name = "ADDRESS", default_value = "0")]
    control: ControlChoice,
    #[command(flatten)]
    robot: RobotArgs,
}

/// A value at each execution of a line.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Watch {
    value: Watched,
    file: String,
    line: u32,
}

impl FromStr for Watch {
    type Err = UnexpectedWord;

    fn from_str(text: &str) -> Result<Watch, UnexpectedWord> {
        let wrong = || UnexpectedWord::new("VALUE@FILE:LINE, such as N@PICK:7", text);
        let (value, place) = text.split_once('@').ok_or_else(wrong)?;
        let (file, line) = place.rsplit_once(':').ok_or_else(wrong)?;
        Ok(Watch {
            value: value.parse().map_err(|_| wrong())?,
            file: Some(file)
                .filter(|file| !file.is_empty())
                .ok_or_else(wrong)?
                .to_owned(),
            line: line.parse().map_err(|_| wrong())?,
        })
    }
}

fn moment(text: &str) -> Result<Time, UnexpectedWord> {
    parse_seconds(text).ok_or_else(|| UnexpectedWord::new("seconds such as 12.4", text))
}

/// Shows the run: prints or writes what is asked, or serves the page until a signal.
pub(super) fn run(args: &ViewArgs) -> anyhow::Result<u8> {
    let recording = read(&args.recording)?;
    recording.has_beginning(Path::new(&args.recording))?;
    let settings = settings(&args.robot, &recording.header)?;
    let candidate = loading::candidate(&settings)?;
    let (run, opening) = if recording.header.is_of_robot() {
        (
            Run::open_robot(&args.recording, recording, candidate.controller),
            None,
        )
    } else {
        let (run, opening) = Run::open(&args.recording, recording, candidate);
        (run, Some(opening))
    };
    let prints = args.list || args.summary || args.json || args.html.is_some();
    if !prints && args.why.is_none() && args.watch.is_none() {
        single_threaded()?.block_on(serve_run(args, &run, opening))?;
        return Ok(0);
    }
    if let Some(opening) = opening {
        opening.finish();
    } else if args.why.is_some() || args.watch.is_some() {
        bail!(
            "{}: a recording of a real robot has its traffic alone, so nothing tells what changed a value",
            args.recording
        );
    }
    let key = key(args, &run)?;
    if let Some(path) = &args.html {
        let page = html::page(&run)?;
        files::replace(path, page.as_bytes()).map_err(files::cannot("write", path))?;
        return Ok(0);
    }
    if args.list {
        let lines = list::lines(&run, args.errors);
        show(args.json, &lines, || {
            lines.iter().map(|line: &Line| format!("{line}\n")).collect()
        })?;
        return Ok(if args.errors && !lines.is_empty() {
            NEGATIVE
        } else {
            0
        });
    }
    if args.summary {
        output::print(Summary::new(&run).to_text())?;
        return Ok(0);
    }
    if let Some(value) = &args.why {
        let answer = run.ask(&Question::Changes(value.clone()));
        let found = until(&run, &answer, key)?;
        show(args.json, &found, || rows(&found, answer.more, " <- "))?;
        return Ok(0);
    }
    if let Some(Watch { value, file, line }) = &args.watch {
        let (value, file, line) = (Some(value.clone()), file.clone(), *line);
        let answer = run.ask(&Question::Hits { file, line, value });
        let found = until(&run, &answer, key)?;
        show(args.json, &found, || rows(&found, answer.more, "  "))?;
        return Ok(0);
    }
    let state = run
        .state(key.unwrap_or_default())
        .map_err(|error| anyhow!("{error}"))?;
    output::print(format!("{state:#}\n"))?;
    Ok(0)
}

/// The recording in a file, or the transcript of a running emulator.
fn read(place: &str) -> anyhow::Result<Recording> {
    if !place.starts_with("http://") {
        return Ok(Recording::read(Path::new(place))?);
    }
    let (_, rest) = place.split_at("http://".len());
    let (authority, path) = rest.split_once('/').unwrap_or((rest, ""));
    let token = std::env::var(TOKEN_VARIABLE).ok();
    let client = Client::new(&format!("http://{authority}"), token)?;
    let prefix = path.trim_end_matches('/');
    let slash = if prefix.is_empty() { "" } else { "/" };
    let (status, text) = client.call("GET", &format!("{slash}{prefix}/transcript?format=jsonl"), None)?;
    if status >= 400 {
        bail!("{place}: {}", text.trim());
    }
    Ok(Recording::parse(Path::new(place), Format::Json, &text)?)
}

/// The moment that was asked for.
fn key(args: &ViewArgs, run: &Run) -> anyhow::Result<Option<MomentKey>> {
    let named = match (args.first, args.last) {
        (Some(kind), _) => Some(("first", kind, kind.first(run))),
        (None, Some(kind)) => Some(("last", kind, kind.last(run))),
        (None, None) => None,
    };
    if let Some((flag, kind, found)) = named {
        let found = found.ok_or_else(|| anyhow!("--{flag} {kind}: there is none in this run"))?;
        let (event, at) = (Some(found), None);
        return Ok(Some(MomentKey { event, at }));
    }
    let key = match (args.event, args.at) {
        (None, None) => None,
        (event, at) => Some(MomentKey { event, at }),
    };
    if let Some(key) = key {
        run.moment(key)?;
    }
    Ok(key)
}

/// The findings of an answer until a moment, or all of them.
fn until(run: &Run, answer: &Answer, key: Option<MomentKey>) -> anyhow::Result<Vec<Found>> {
    let Some(key) = key else {
        return Ok(answer.found.clone());
    };
    let moment = run.moment(key)?;
    let before = answer.before(run, moment);
    Ok(before.to_vec())
}

fn rows(found: &[Found], more: u64, sign: &str) -> String {
    let row = |found: &Found| {
        format!(
            "{:>13} {:>6} {}{sign}{}\n",
            found.at, found.event, found.value, found.cause
        )
    };
    let mut text: String = found.iter().map(row).collect();
    if more > 0 {
        text += &format!("and {more} more\n");
    }
    text
}

fn show<T: Serialize>(json: bool, value: &T, text: impl FnOnce() -> String) -> anyhow::Result<()> {
    if json {
        output::print(format!("{:#}\n", document(value)))
    } else {
        output::print(text())
    }
}

async fn serve_run(args: &ViewArgs, run: &Arc<Run>, opening: Option<Opening>) -> anyhow::Result<()> {
    let stop = stop_signal().context("cannot listen for signals")?;
    let ControlChoice::Address(address) = args.control else {
        bail!("--control: expected an address, since the page is served there");
    };
    let control = ControlSettings {
        address,
        ..ControlSettings::free()
    };
    let server = bind_control(&control)?;
    let address: SocketAddr = server.address();
    serve::serve(run, server);
    let opened = tokio::task::spawn_blocking(move || opening.map(Opening::finish));
    let is_named = args.first.is_some() || args.last.is_some();
    let moment = if is_named || args.event.is_some() || args.at.is_some() {
        opened.await?;
        let key = key(args, run)?.unwrap_or_default();
        format!("#{}", run.fragment(key)?)
    } else {
        String::new()
    };
    output::print(format!("http://{address}/{moment}\n"))?;
    stop.await;
    Ok(())
}
