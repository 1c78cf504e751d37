//! `ts3100 fmt`: formats SCOL files in place, or stdin to stdout, or shows what formatting would change.
//!
//! The formatter is `scol-mini`'s. Here files are read and replaced, and the exit code is chosen. Differences are written
//! by [`unified`].

mod unified;

use super::exit::{NEGATIVE, UNUSABLE};
use super::input::{self, is_stdin};
use super::output;
use super::programs;
use crate::color;
use crate::log::print_error;
use clap::Args;
use std::io;
use std::path::{Path, PathBuf};
use ts3100_driver::files;

/// Format SCOL files in place.
///
/// Formatting never changes the program; a line that cannot be formatted safely is left as is.
///
/// Exit codes: 0 done; 1 with --check or --diff, a file is not formatted; 2 a file cannot be read or written.
#[derive(Debug, Args)]
pub(super) struct FormatArgs {
    /// SCOL files, and folders with all *.scol files below; - formats stdin to stdout
    #[arg(required = true, value_name = "PATH")]
    files: Vec<PathBuf>,
    /// Only list the files that are not formatted
    #[arg(long)]
    check: bool,
    /// Only print what would change, as a unified diff for `patch -p0` or `git apply -p0`
    #[arg(long)]
    diff: bool,
}

/// Formats every file; the worst exit code.
pub(super) fn run(args: &FormatArgs) -> anyhow::Result<u8> {
    let mut worst = 0;
    for found in programs::expand(programs::PROGRAMS, &args.files) {
        let outcome = match &found {
            Ok(path) => format_file(path, args).map_err(|error| (path, error)),
            Err(folder) => Err((&folder.path, anyhow::anyhow!("{}", folder.reason))),
        };
        let outcome = outcome.unwrap_or_else(|(path, error)| {
            print_error(format_args!("cannot format {}: {error:#}", path.display()));
            UNUSABLE
        });
        worst = worst.max(outcome);
    }
    Ok(worst)
}

/// Formats a file; the exit code.
fn format_file(path: &Path, args: &FormatArgs) -> anyhow::Result<u8> {
    // A file that cannot be read whole is left as it is.
    let source = input::read_program(path)?;
    let formatted = scol_mini::format(&source);
    let changed = formatted != source;
    // The differences name the file, so --check has nothing to add.
    if args.diff && changed {
        let (mut stdout, paints) = color::stream(io::stdout().lock());
        let name = input::shown_name(path);
        output::written(unified::write(&name, &source, &formatted, paints, &mut stdout))?;
        return Ok(NEGATIVE);
    }
    if args.check && changed {
        output::print(format!("{}: not formatted\n", path.display()))?;
        return Ok(NEGATIVE);
    }
    if args.check || args.diff {
        return Ok(0);
    }
    if is_stdin(path) {
        output::print(formatted)?;
    } else if changed {
        files::replace(path, formatted.as_bytes())?;
    }
    Ok(0)
}
