//! `ts3100 check`: the diagnostics of SCOL files, rendered by the compiler.

use crate::config::model::ModelChoice;
use clap::Args;
use scol_mini::{LanguageOptions, Severity};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use ts3100_controller::limits;

/// Compiles SCOL files and prints what the compiler says. Exit code: 0 no errors, 1 errors, 2 a file cannot
/// be read.
#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// SCOL files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Arm, by name or .toml file, which decides how wide a position is
    #[arg(long, value_name = "MODEL", default_value = "ts3100-tv800")]
    model: ModelChoice,
}

/// The worst that was met; the order is that of the exit codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Outcome {
    Clean = 0,
    Errors = 1,
    Unreadable = 2,
}

/// Checks every file.
pub(super) fn run(args: &CheckArgs) -> ExitCode {
    let arm = match args.model.read() {
        Ok(model) => model.language(),
        Err(error) => {
            eprintln!("ts3100: {error}");
            return ExitCode::from(Outcome::Unreadable as u8);
        }
    };
    let options = LanguageOptions {
        arm,
        ..LanguageOptions::default()
    };
    let mut stdout = io::stdout().lock();
    let mut worst = Outcome::Clean;
    for path in &args.files {
        let outcome = check(path, &options, &mut stdout).unwrap_or_else(|error| {
            eprintln!("ts3100: {}: {error}", path.display());
            Outcome::Unreadable
        });
        worst = worst.max(outcome);
    }
    ExitCode::from(worst as u8)
}

fn check(path: &Path, options: &LanguageOptions, out: &mut impl Write) -> io::Result<Outcome> {
    if std::fs::metadata(path)?.len() > 2 * limits::MAX_FILE as u64 {
        return Err(io::Error::other(format!(
            "larger than the {} bytes of a file of the drive",
            limits::MAX_FILE
        )));
    }
    // Bytes that are no UTF-8 become a character the compiler points at.
    let source = String::from_utf8_lossy(&std::fs::read(path)?).into_owned();
    let compilation = scol_mini::compile(&source, options);
    let name = path.display().to_string();
    let mut outcome = Outcome::Clean;
    for diagnostic in &compilation.diagnostics {
        if diagnostic.severity == Severity::Error {
            outcome = Outcome::Errors;
        }
        writeln!(out, "{}", diagnostic.render(&source, &name).trim_end())?;
    }
    if compilation.diagnostics.is_empty() {
        writeln!(out, "{name}: no errors")?;
    }
    Ok(outcome)
}
