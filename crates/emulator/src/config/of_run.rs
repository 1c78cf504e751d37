//! The configuration of a controller that runs one program: arm, named options and taught points, in the words of `serve`.

use super::{ServeArgs, Settings};
use anyhow::anyhow;
use clap::Parser;
use std::path::PathBuf;
use ts3100_controller::Config;

/// The flags of `serve`, so that a model and an option mean the same here.
#[derive(Debug, Parser)]
struct ServeFlags {
    #[command(flatten)]
    args: ServeArgs,
}

/// The configuration with this model and these options, as `--model` and `--set` take them, and the points of a table.
///
/// # Errors
/// One of them is wrong, or a file cannot be read.
pub fn of_run(model: Option<&str>, options: &[String], points: Option<PathBuf>) -> anyhow::Result<Config> {
    let words = model.iter().map(|model| format!("--model={model}"));
    let words = words.chain(options.iter().map(|pair| format!("--set={pair}")));
    let mut served = ServeFlags::try_parse_from(std::iter::once("ts3100 run".to_owned()).chain(words))
        .map_err(|error| anyhow!("{}", reason(&error)))?;
    served.args.files.points = points;
    Ok(Settings::from_args(&served.args)?.controller)
}

/// What is wrong with a flag, without the usage of another command.
pub fn reason(error: &clap::Error) -> String {
    let text = error.to_string();
    let first = text.split("\n\n").next().unwrap_or_default();
    first.trim_start_matches("error: ").to_owned()
}
