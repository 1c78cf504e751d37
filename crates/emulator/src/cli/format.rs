//! `ts3100 fmt`: formats SCOL files in place, or stdin to stdout.
//!
//! The formatter is `scol-mini`'s. Here files are read and replaced, and the exit code is chosen.

use super::exit::{NEGATIVE, UNUSABLE};
use super::input::{self, is_stdin};
use super::output;
use crate::log::print_error;
use clap::Args;
use std::path::{Path, PathBuf};
use ts3100_driver::files;

/// Format SCOL files in place.
///
/// Formatting never changes the program; a line that cannot be formatted safely is left as is.
///
/// Exit codes: 0 done; 1 with --check, a file is not formatted; 2 a file cannot be read or written.
#[derive(Debug, Args)]
pub(super) struct FormatArgs {
    /// SCOL files; - formats stdin to stdout
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Only list the files that are not formatted
    #[arg(long)]
    check: bool,
}

/// Formats every file; the worst exit code.
pub(super) fn run(args: &FormatArgs) -> anyhow::Result<u8> {
    let mut worst = 0;
    for path in &args.files {
        let outcome = format_file(path, args.check).unwrap_or_else(|error| {
            print_error(format_args!("cannot format {}: {error:#}", path.display()));
            UNUSABLE
        });
        worst = worst.max(outcome);
    }
    Ok(worst)
}

/// Formats a file; the exit code.
fn format_file(path: &Path, check: bool) -> anyhow::Result<u8> {
    // A file that cannot be read whole is left as it is.
    let source = input::read_program(path)?;
    let formatted = scol_mini::format(&source);
    let changed = formatted != source;
    if check && changed {
        output::print(format!("{}: not formatted\n", path.display()))?;
        return Ok(NEGATIVE);
    }
    if check {
        return Ok(0);
    }
    if is_stdin(path) {
        output::print(formatted)?;
    } else if changed {
        files::replace(path, formatted.as_bytes())?;
    }
    Ok(0)
}
