//! `ts3100 fmt`: formats SCOL files in place, or stdin to stdout.
//!
//! The formatter is `scol-mini`'s. Here files are read and replaced, and the exit code is chosen.

use super::check::{is_stdin, read_source};
use crate::log::print_error;
use clap::Args;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
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

/// What became of a file; the order is that of the exit codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum FormatOutcome {
    Done = 0,
    Unformatted = 1,
    Failed = 2,
}

/// Formats every file.
pub(super) fn run(args: &FormatArgs) -> ExitCode {
    let mut worst = FormatOutcome::Done;
    for path in &args.files {
        let outcome = format_file(path, args.check).unwrap_or_else(|error| {
            print_error(format_args!("cannot format {}: {error}", path.display()));
            FormatOutcome::Failed
        });
        worst = worst.max(outcome);
    }
    ExitCode::from(worst as u8)
}

fn format_file(path: &Path, check: bool) -> io::Result<FormatOutcome> {
    let stdin = is_stdin(path);
    let source = String::from_utf8(read_source(path)?)
        .map_err(|_| io::Error::other("not text in ASCII or UTF-8; the file is left as it is"))?;
    let formatted = scol_mini::format(&source);
    let changed = formatted != source;
    if check {
        if changed {
            println!("{}: not formatted", path.display());
        }
        return Ok(if changed {
            FormatOutcome::Unformatted
        } else {
            FormatOutcome::Done
        });
    }
    if stdin {
        io::stdout().lock().write_all(formatted.as_bytes())?;
    } else if changed {
        files::replace(path, formatted.as_bytes())?;
    }
    Ok(FormatOutcome::Done)
}
