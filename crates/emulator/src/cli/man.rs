//! `ts3100 man DIR`: writes the manual pages, one for each subcommand, from the definition of the command line.

use anyhow::Context as _;
use clap::Args;
use std::path::PathBuf;

/// Write the manual pages, one for each subcommand.
#[derive(Debug, Args)]
pub(super) struct ManArgs {
    /// Directory to write them to; it is created
    #[arg(value_name = "DIR")]
    directory: PathBuf,
}

/// Writes the pages; the exit code.
pub(super) fn run(args: &ManArgs) -> anyhow::Result<u8> {
    let directory = &args.directory;
    let cannot_write = || format!("cannot write the manual pages to {}", directory.display());
    std::fs::create_dir_all(directory).with_context(cannot_write)?;
    let program = super::definition().disable_help_subcommand(true);
    clap_mangen::generate_to(program, directory).with_context(cannot_write)?;
    Ok(0)
}
