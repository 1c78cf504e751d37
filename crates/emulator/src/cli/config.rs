//! `ts3100 config schema`: the JSON schema of the configuration file.

use crate::config::schema::schema;
use clap::{Args, Subcommand};
use std::io::{self, Write as _};
use std::process::ExitCode;

/// Print the JSON schema of the configuration file.
#[derive(Debug, Args)]
pub(super) struct ConfigArgs {
    #[command(subcommand)]
    what: ConfigCommand,
}

#[derive(Debug, Subcommand)]
enum ConfigCommand {
    /// Print the JSON schema, for editors
    Schema,
}

/// Prints it.
pub(super) fn run(args: &ConfigArgs) -> ExitCode {
    let document = match args.what {
        ConfigCommand::Schema => schema(),
    };
    // A closed pipe is not an error.
    let _ = writeln!(io::stdout(), "{document:#}");
    ExitCode::SUCCESS
}
