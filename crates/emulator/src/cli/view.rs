//! `ts3100 view`: opens a recorded run, and serves the page that shows it.
//!
//! The emulator is configured as for `diff`. The run itself is [`ts3100_view`].

use super::output;
use super::serve::stop_signal;
use crate::embed::single_threaded;
use crate::launch::bind_control;
use crate::loading;
use crate::recorded::{RobotArgs, settings};
use anyhow::Context as _;
use clap::Args;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use ts3100_control::{ControlChoice, ControlSettings};
use ts3100_recording::transcript::Recording;
use ts3100_view::run::{Opening, Run};
use ts3100_view::serve;

/// Watch a recorded run again.
///
/// Opens a recording of `serve --transcript` or of the control interface, and serves the page that shows it: every moment
/// of the run, with a timeline. The emulator plays the recording in virtual time, from the settings that the recording
/// names. Nothing is changed and no port for hosts is open.
///
/// Exit codes: 0 ended by a signal; 2 wrong usage, or a recording that cannot be read.
#[derive(Debug, Args)]
pub(super) struct ViewArgs {
    /// Recording, .txt or .jsonl
    #[arg(value_name = "TRANSCRIPT")]
    recording: PathBuf,
    /// Serve the page here; port 0 is a free one
    #[arg(long, value_name = "ADDRESS", default_value = "0")]
    control: ControlChoice,
    #[command(flatten)]
    robot: RobotArgs,
}

/// Shows the run until a signal.
pub(super) fn run(args: &ViewArgs) -> anyhow::Result<u8> {
    let recording = Recording::read(&args.recording)?;
    recording.has_beginning(&args.recording)?;
    let settings = settings(&args.robot, &recording.header)?;
    let name = args.recording.display().to_string();
    let (run, opening) = Run::open(&name, recording, loading::candidate(&settings)?);
    single_threaded()?.block_on(serve_run(args, &run, opening))?;
    Ok(0)
}

async fn serve_run(args: &ViewArgs, run: &Arc<Run>, opening: Opening) -> anyhow::Result<()> {
    let stop = stop_signal().context("cannot listen for signals")?;
    let address = match args.control {
        ControlChoice::Address(address) => address,
        ControlChoice::Off => ControlSettings::free().address,
    };
    let control = ControlSettings {
        address,
        ..ControlSettings::free()
    };
    let server = bind_control(&control)?;
    let address: SocketAddr = server.address();
    serve::serve(run, server);
    std::thread::spawn(move || opening.finish());
    output::print(format!("http://{address}/\n"))?;
    stop.await;
    Ok(())
}
