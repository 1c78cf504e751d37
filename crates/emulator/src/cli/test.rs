//! `ts3100 test`: runs the tests of SCOL programs.
//!
//! Here flags and files are read and the exit code is chosen. A test is run by [`crate::program_test`]; [`show`] formats the
//! results.

mod show;

use super::exit::{NEGATIVE, UNUSABLE};
use super::input::{is_stdin, read_program};
use super::programs::{self, FolderError, TESTS, points_beside};
use super::watch::{Announcement, watch};
use crate::config::args::written_file;
use crate::config::of_run;
use crate::headless::RunError;
use crate::program_test::{self, Subject, TestError};
use anyhow::{Context as _, anyhow, bail};
use clap::Args;
use scol_mini::Severity;
use show::{FileOutcome, TestOutcome, TestPrinter};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use ts3100_controller::Config;
use ts3100_driver::files;
use ts3100_driver::pc_file::drive_name;
use ts3100_recording::program_test::{ENDING, Place, TestFile};

/// Name of the test case in a report when no test of a file can be run.
const WHOLE_FILE: &str = "the file";

/// Run tests of SCOL programs.
///
/// The tests of pick.scol are in pick.test.toml beside it. A test calls a subprogram with values or runs the main program, and
/// names the expected result: lines of PRINT, outputs, variables, the position of the arm, an alarm, the cycle time.
///
/// Exit codes: 0 all tests passed, or --watch was ended by a signal; 1 a test failed; 2 wrong usage, no tests, or a file that
/// cannot be read, a file of tests that is wrong, or a program with errors.
#[derive(Debug, Args)]
pub(super) struct TestArgs {
    /// Files of tests, programs with tests beside them, and folders with all *.test.toml files below
    #[arg(value_name = "PATH", default_value = ".")]
    files: Vec<PathBuf>,
    /// Run only the tests whose file or name contains TEXT
    #[arg(long, value_name = "TEXT")]
    filter: Option<String>,
    /// Print one JSON document to stdout instead of text
    #[arg(long)]
    json: bool,
    /// Write the results as JUnit XML
    #[arg(long, value_name = "FILE", value_parser = written_file())]
    junit: Option<PathBuf>,
    /// Run again whenever a program, its tests or its points change, until Ctrl-C; with --json, one line for each run
    #[arg(long)]
    watch: bool,
}

impl TestArgs {
    /// The files of tests, in order, each as given or found; or a path and why there is none.
    fn found(&self) -> Vec<Result<PathBuf, (PathBuf, anyhow::Error)>> {
        let mut seen = BTreeSet::new();
        let found = programs::expand(TESTS, &self.files).into_iter();
        let found = found.map(|found| match found {
            Ok(path) => beside(&path).map_err(|error| (path, error)),
            Err(FolderError { path, reason }) => {
                let error = anyhow!("cannot read {}: {reason}", path.display());
                Err((path, error))
            }
        });
        // A program and its tests, both named, are the same tests.
        let found = found.filter(|found| found.as_ref().map_or(true, |path| seen.insert(path.clone())));
        found.collect()
    }

    /// Files whose changes change the results.
    fn sources(&self) -> Vec<PathBuf> {
        let mut sources = self.files.clone();
        sources.retain(|path| !path.is_dir());
        for path in self.found().into_iter().flatten() {
            if let Ok(file) = TestFile::read(&path) {
                sources.extend(points(&file));
                sources.push(file.program.value);
            }
            sources.push(path);
        }
        sources.sort();
        sources.dedup();
        sources
    }

    fn wants(&self, file: &Path, name: &str) -> bool {
        let filter = self.filter.as_ref();
        filter.is_none_or(|filter| name.contains(filter) || file.to_string_lossy().contains(filter))
    }
}

/// The tests of a program, or the file of tests itself.
fn beside(path: &Path) -> anyhow::Result<PathBuf> {
    if files::extension(path) != "scol" {
        return Ok(path.to_path_buf());
    }
    let tests = path.with_extension(ENDING.trim_start_matches('.'));
    if !tests.is_file() {
        bail!("{} has no tests: {} is missing", path.display(), tests.display());
    }
    Ok(tests)
}

/// Runs the tests; the exit code. With `--watch` it runs them again and again.
pub(super) fn run(args: TestArgs) -> anyhow::Result<u8> {
    if args.files.iter().any(|path| is_stdin(path)) {
        bail!("cannot read tests from stdin; name files or folders");
    }
    if !args.watch {
        return run_all(&args, &AtomicBool::new(false));
    }
    let announcement = Announcement::new(args.json);
    watch(args, announcement, TestArgs::sources, run_all)
}

/// Runs all tests once, or until the flag is set.
fn run_all(args: &TestArgs, outdated: &AtomicBool) -> anyhow::Result<u8> {
    let mut printer = TestPrinter::new(args.json, args.watch);
    for found in args.found() {
        let (path, outcome) = match found {
            Ok(path) => {
                let outcome = run_file(args, &path, outdated, &mut printer);
                (path, outcome)
            }
            Err((path, error)) => (path, Err(error)),
        };
        if outdated.load(Ordering::Relaxed) {
            return Ok(NEGATIVE);
        }
        if let Err(error) = outcome {
            printer.add_error(&path, WHOLE_FILE, &error);
        }
    }
    if let Some(filter) = args.filter.as_ref().filter(|_| printer.is_empty()) {
        let error = anyhow!("no test matches --filter {filter}");
        printer.add_error(Path::new("ts3100"), "test", &error);
    }
    if let Some(path) = &args.junit {
        files::replace(path, printer.junit().as_bytes())
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    let (has_errors, has_failures) = printer.finish()?;
    Ok(match (has_errors, has_failures) {
        (true, _) => UNUSABLE,
        (false, true) => NEGATIVE,
        (false, false) => 0,
    })
}

/// Runs the tests of a file.
fn run_file(
    args: &TestArgs,
    path: &Path,
    outdated: &AtomicBool,
    printer: &mut TestPrinter,
) -> anyhow::Result<()> {
    let file = TestFile::read(path)?;
    let wanted: Vec<_> = file
        .tests
        .iter()
        .filter(|test| args.wants(path, &test.name))
        .collect();
    if wanted.is_empty() {
        return Ok(());
    }
    let subject = subject(&file)?;
    let mut outcome = FileOutcome::new(&file, &subject.source);
    for test in wanted {
        match program_test::run(&subject, test, outdated) {
            Ok(result) => printer.add(&mut outcome, TestOutcome::new(test, result))?,
            Err(TestError::Run(RunError::Interrupted)) => return Ok(()),
            // The other tests of the file are run.
            Err(TestError::Call { place, reason }) => {
                let error = anyhow!("{}: {reason}", placed(&file, place));
                printer.add_error(path, &test.name, &error);
            }
            Err(TestError::Run(error)) => {
                let error = anyhow!("{}: {error}", placed(&file, test.place));
                printer.add_error(path, &test.name, &error);
            }
        }
    }
    printer.add_file(outcome);
    Ok(())
}

/// The table of points: the one that is named, or that of the folder of the program.
fn points(file: &TestFile) -> Option<PathBuf> {
    let named = file.points.as_ref().map(|points| points.value.clone());
    named.or_else(|| points_beside(&file.program.value))
}

/// The controller of a file, or the key that it cannot be made with.
fn config(file: &TestFile) -> anyhow::Result<Config> {
    let model = file.model.as_ref().map(|model| model.value.as_str());
    let options: Vec<String> = file.options.iter().map(|option| option.value.clone()).collect();
    of_run(model, &options, points(file)).with_context(|| {
        // The first key that is wrong by itself or with those before it.
        let fails = |count| of_run(model, options.get(..count).unwrap_or_default(), None).is_err();
        let options = (1..=options.len()).find(|count| fails(*count));
        let options = options.and_then(|count| file.options.get(count - 1));
        let place = match (&file.model, options) {
            (Some(model), _) if fails(0) => model.place,
            (_, Some(option)) => option.place,
            (_, None) => file
                .points
                .as_ref()
                .map_or_else(Place::default, |points| points.place),
        };
        placed(file, place)
    })
}

/// A place in a file of tests, as messages begin.
fn placed(file: &TestFile, place: Place) -> String {
    format!("{}:{}:{}", file.path.display(), place.line, place.column)
}

/// The program under test, which must compile.
fn subject(file: &TestFile) -> anyhow::Result<Subject> {
    let config = config(file)?;
    let program = &file.program.value;
    let shown = program.display();
    let source = read_program(program).with_context(|| {
        let place = placed(file, file.program.place);
        format!("{place}: cannot read the program {shown}")
    })?;
    let compilation = config.compile(&source);
    let Some(compiled) = compilation.program else {
        let errors = compilation.diagnostics.iter();
        let errors = errors.filter(|found| found.severity == Severity::Error);
        let errors: Vec<String> = errors
            .map(|found| found.render(&source, &shown.to_string()).trim_end().to_owned())
            .collect();
        bail!("{shown} has errors\n{}", errors.join("\n"));
    };
    Ok(Subject {
        name: drive_name(program).unwrap_or_else(|_| "MAIN".to_owned()),
        source,
        config,
        program: compiled,
    })
}
