//! `ts3100 check`: prints the diagnostics of SCOL files, as text, JSON or SARIF.
//!
//! `Config::check` of the controller and the compiler in `scol-mini` find and word the diagnostics. Here files are read and
//! the exit code is chosen.
//! The JSON and SARIF documents are built in [`report`].

mod report;

use super::exit::{NEGATIVE, UNUSABLE};
use super::input::{self, is_stdin};
use super::output;
use super::programs::{self, FolderError, points_beside};
use super::watch::{Announcement, watch};
use crate::color;
use crate::config::model::ModelChoice;
use crate::config::read_points;
use crate::log::print_error;
use anyhow::bail;
use clap::{Args, ValueEnum};
use scol_mini::{Diagnostic, DiagnosticKind, Severity};
use std::collections::BTreeSet;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use ts3100_control::printable::printable;
use ts3100_controller::{Config, Dialect};

/// Check SCOL files for errors and likely mistakes.
///
/// Exit codes: 0 no errors, or --watch was ended by a signal; 1 errors, or warnings with --deny-warnings; 2 a file cannot be
/// read.
#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// SCOL files, and folders with all *.scol files below; - is stdin
    #[arg(required = true, value_name = "PATH")]
    files: Vec<PathBuf>,
    /// Arm, by name or .toml file: it decides how many values a position has and which places it reaches
    #[arg(long, value_name = "MODEL", default_value = "ts3100-tv800")]
    model: ModelChoice,
    /// Points taught on the controller: a CSV file of NAME,X,Y,Z,C,T,CONFIG (six axes: NAME,X,Y,Z,A,B,C,U,V,CONFIG) [default: points.csv beside each program]
    #[arg(long, value_name = "FILE")]
    points: Option<PathBuf>,
    /// Output format
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    format: CheckFormat,
    /// Print one JSON document to stdout, as --format json
    #[arg(long, conflicts_with = "format")]
    json: bool,
    /// Treat warnings as errors
    #[arg(long)]
    deny_warnings: bool,
    /// Check again whenever a file changes, until Ctrl-C; with JSON, one line for each check
    #[arg(long)]
    watch: bool,
}

impl CheckArgs {
    /// Files whose changes change the result.
    fn sources(&self) -> Vec<PathBuf> {
        let found = programs::expand(programs::PROGRAMS, &self.files).into_iter();
        let programs: Vec<PathBuf> = found
            .map(|found| found.unwrap_or_else(|error| error.path))
            .collect();
        // One that is written later is there when it is looked for again.
        let beside: BTreeSet<PathBuf> = programs.iter().filter_map(|path| points_beside(path)).collect();
        let beside = beside.into_iter().filter(|_| self.points.is_none());
        let model = match &self.model {
            ModelChoice::File(path) => Some(path),
            ModelChoice::Shipped(_) => None,
        };
        let settings = self.points.iter().chain(model);
        programs.iter().chain(settings).cloned().chain(beside).collect()
    }

    fn format(&self) -> CheckFormat {
        if self.json { CheckFormat::Json } else { self.format }
    }
}

/// Format of the diagnostics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum CheckFormat {
    /// For people: the line with carets under the place.
    Text,
    /// One JSON document for programs.
    Json,
    /// SARIF 2.1.0, which code hosts show beside the source.
    Sarif,
}

/// Checks every file; the worst exit code. With `--watch` it checks them again and again.
pub(super) fn run(args: CheckArgs) -> anyhow::Result<u8> {
    if !args.watch {
        return check_all(&args);
    }
    if args.files.iter().any(|path| is_stdin(path)) {
        bail!("cannot watch stdin; name files or folders");
    }
    let announcement = Announcement::new(args.format() != CheckFormat::Text);
    watch(args, announcement, CheckArgs::sources, |args, _| check_all(args))
}

fn check_all(args: &CheckArgs) -> anyhow::Result<u8> {
    let model = args.model.read()?;
    let mut config = Config {
        model,
        ..Config::new(Dialect::default())
    };
    let mut table = None;
    let (mut stdout, paints) = color::stream(io::stdout().lock());
    let mut explained = BTreeSet::new();
    let mut worst = 0;
    let mut files = Vec::new();
    let format = args.format();
    for found in programs::expand(programs::PROGRAMS, &args.files) {
        let file = match found {
            Ok(path) => {
                // Programs of one folder share its table.
                let wanted = args.points.clone().or_else(|| points_beside(&path));
                if wanted != table {
                    let arm = config.model.language();
                    let points = wanted.as_deref().map(|path| read_points(path, arm));
                    config.points = match points.transpose() {
                        Ok(points) => points.unwrap_or_default(),
                        Err(error) if args.points.is_some() => return Err(error.into()),
                        // Other programs can be checked without the table that lies beside these.
                        Err(error) => {
                            print_error(format_args!("{:#}", anyhow::Error::new(error)));
                            worst = UNUSABLE;
                            Vec::new()
                        }
                    };
                    table = wanted;
                }
                CheckedFile::check(&path, &config)
            }
            Err(folder) => CheckedFile::from(folder),
        };
        worst = worst.max(exit_code(&file, args.deny_warnings));
        if let Err(error) = &file.result {
            print_error(format_args!("cannot read {}: {error}", file.name));
        }
        if format != CheckFormat::Text {
            files.push(file);
        } else {
            output::written(write_text(&file, &mut explained, paints, &mut stdout))?;
        }
    }
    let document = match format {
        CheckFormat::Text => return Ok(worst),
        CheckFormat::Json => report::json(&files),
        CheckFormat::Sarif => report::sarif(&files),
    };
    let written = match args.watch {
        true => writeln!(stdout, "{document}").and_then(|()| stdout.flush()),
        false => writeln!(stdout, "{document:#}"),
    };
    output::written(written).map(|()| worst)
}

fn exit_code(file: &CheckedFile, deny_warnings: bool) -> u8 {
    let Ok((_, remarks)) = &file.result else {
        return UNUSABLE;
    };
    let denied = |remark: &Diagnostic| deny_warnings || remark.severity == Severity::Error;
    if remarks.iter().any(denied) { NEGATIVE } else { 0 }
}

/// The first diagnostic of each code is followed by the command that explains it.
fn write_text(
    file: &CheckedFile,
    explained: &mut BTreeSet<&str>,
    paints: bool,
    out: &mut impl Write,
) -> io::Result<()> {
    let Ok((source, remarks)) = &file.result else {
        return Ok(());
    };
    for remark in remarks {
        let text = printable(remark.render(source, &file.name).trim_end()).to_string();
        let text = if paints { color::diagnostic(&text) } else { text };
        writeln!(out, "{text}")?;
        let kind = DiagnosticKind::by_code(remark.code);
        if let Some(kind) = kind.filter(|kind| explained.insert(kind.code)) {
            let margin = remark.line.to_string().len();
            writeln!(
                out,
                "{:margin$} = see `{}`",
                "",
                ts3100_book::explain_command(kind.code)
            )?;
        }
    }
    if !remarks.iter().any(|d| d.severity == Severity::Error) {
        writeln!(
            out,
            "{}: no errors{}",
            printable(&file.name),
            warning_count(remarks.len())
        )?;
    }
    Ok(())
}

fn warning_count(number: usize) -> String {
    match number {
        0 => String::new(),
        1 => ", 1 warning".to_owned(),
        more => format!(", {more} warnings"),
    }
}

/// A file with its diagnostics, or the reason for which it cannot be read.
pub(super) struct CheckedFile {
    /// As given on the command line.
    pub(super) name: String,
    /// The source and the remarks.
    pub(super) result: io::Result<(String, Vec<Diagnostic>)>,
}

impl CheckedFile {
    /// Reads a file and checks it.
    pub(super) fn check(path: &Path, config: &Config) -> CheckedFile {
        let result = input::read_program(path).map(|source| {
            let remarks = config.check(&source).diagnostics;
            (source, remarks)
        });
        let name = input::shown_name(path);
        CheckedFile { name, result }
    }
}

impl From<FolderError> for CheckedFile {
    fn from(folder: FolderError) -> CheckedFile {
        CheckedFile {
            name: folder.path.display().to_string(),
            result: Err(folder.reason),
        }
    }
}
