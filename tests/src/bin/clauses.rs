//! `cargo run -p ts3100-tests --bin clauses [-- OPTIONS]`: prints which clauses of the manual are proven by which test, which
//! are not and why, and which rest on a single test or on unit tests alone.
//!
//! `--from FILE` reads what `cargo test --workspace` printed (both streams) instead of running the tests once more.
//! `--check` fails when a clause that was proven is not any more, a mark is wrong, or more clauses than before rest on
//! little. `--write` brings the column of tests in `docs/clauses.tsv` up to date.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Read as _};
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};
use ts3100_tests::clauses::{
    Clause, Outcomes, PACKAGES, Thin, join, outcomes, proofs, read_list, root, thin, write_list,
};

/// Clauses that a single test proves, and those proven by unit tests alone: at most so many. A number that has become
/// smaller is written here, so that it stays.
const MAX_SINGLE: usize = 60;
const MAX_UNITS: usize = 13;

/// Lines of a test run that are shown when it cannot be read.
const SHOWN: usize = 20;

/// What the command line asks for.
#[derive(Default)]
struct Options {
    check: bool,
    write: bool,
    from: Option<PathBuf>,
}

fn options() -> Result<Options, String> {
    let mut options = Options::default();
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--check" => options.check = true,
            "--write" => options.write = true,
            "--from" => options.from = Some(words.next().ok_or("--from needs a file")?.into()),
            other => return Err(format!("expected --check, --write or --from FILE, found {other}")),
        }
    }
    Ok(options)
}

/// What `cargo test --workspace` prints, both streams as one: which package a test belongs to is on the other stream.
fn run_tests() -> Result<String, String> {
    let run = || -> io::Result<Vec<u8>> {
        let (mut printed, both) = io::pipe()?;
        let mut cargo = Command::new(env!("CARGO"))
            .current_dir(root())
            .args(["test", "--workspace", "--no-fail-fast"])
            .stdin(Stdio::null())
            .stdout(both.try_clone()?)
            .stderr(both)
            .spawn()?;
        let mut bytes = Vec::new();
        printed.read_to_end(&mut bytes)?;
        cargo.wait().map(|_| bytes)
    };
    let bytes = run().map_err(|error| format!("cannot run cargo test: {error}"))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn read_outcomes(from: Option<&PathBuf>) -> Result<Outcomes, String> {
    let printed = match from {
        Some(path) => fs::read(path)
            .map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
            .map_err(|error| format!("cannot read {}: {error}", path.display()))?,
        None => run_tests()?,
    };
    let found = outcomes(&printed);
    match PACKAGES.iter().find(|(package, _)| !found.contains_key(*package)) {
        Some((package, _)) => {
            let lines: Vec<&str> = printed.lines().collect();
            let end = lines[lines.len().saturating_sub(SHOWN)..].join("\n");
            Err(format!(
                "no test of {package} ran; what was printed ends with\n{end}"
            ))
        }
        None => Ok(found),
    }
}

fn report(clauses: &[Clause]) {
    let (proven, open): (Vec<&Clause>, Vec<&Clause>) =
        clauses.iter().partition(|clause| !clause.tests.is_empty());
    for clause in &proven {
        let tests: Vec<&str> = clause.tests.iter().map(String::as_str).collect();
        println!("proven   {:<16} {}", clause.id, tests.join(" "));
    }
    for clause in &open {
        println!(
            "open     {:<16} {} (no test names it)",
            clause.id, clause.columns[1]
        );
    }
    let count = |list: &[&Clause]| {
        let rows = list
            .iter()
            .filter(|clause| clause.is_row_of_scara_edition())
            .count();
        (list.len() - rows, rows)
    };
    let ((proven, rows_proven), (open, rows_open)) = (count(&proven), count(&open));
    println!("{} clauses: {proven} proven, {open} open", proven + open);
    println!(
        "{} rows of the SCARA edition (STE 80722): {rows_proven} proven, {rows_open} open",
        rows_proven + rows_open
    );
}

fn lost(before: &[Clause], now: &[Clause]) -> Vec<String> {
    let proven: BTreeSet<&str> = now
        .iter()
        .filter(|clause| !clause.tests.is_empty())
        .map(|clause| clause.id.as_str())
        .collect();
    let had = before.iter().filter(|clause| !clause.tests.is_empty());
    had.filter(|clause| !proven.contains(clause.id.as_str()))
        .map(|clause| clause.id.clone())
        .collect()
}

/// Lists the clauses that rest on little; whether they are more than there were.
fn report_thin(thin: &Thin<'_>) -> bool {
    let kinds = [
        ("a single test", &thin.single, MAX_SINGLE),
        ("unit tests alone", &thin.units, MAX_UNITS),
    ];
    for (what, ids, most) in &kinds {
        println!(
            "proven by {what}: {} of at most {most}: {}",
            ids.len(),
            ids.join(" ")
        );
        if ids.len() < *most {
            println!("fewer than before: write {} to {}", ids.len(), file!());
        }
    }
    kinds.iter().any(|(_, ids, most)| ids.len() > *most)
}

fn work(options: &Options) -> Result<bool, String> {
    let path = root().join("docs/clauses.tsv");
    let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let list = read_list(&text).map_err(|error| format!("{}: {error}", path.display()))?;
    let proofs = proofs(&root())?;
    let (clauses, wrong) = join(&list, &proofs, &read_outcomes(options.from.as_ref())?);
    report(&clauses);
    let thinner = report_thin(&thin(&clauses, &proofs));
    for line in &wrong {
        println!("wrong    {line}");
    }
    let lost = lost(&list, &clauses);
    for id in &lost {
        println!(
            "lost     {id}: it was proven by {:?}",
            list.iter().find(|clause| clause.id == *id).map(|c| &c.tests)
        );
    }
    if options.write {
        fs::write(&path, write_list(&clauses)).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(!options.check || !thinner && wrong.is_empty() && lost.is_empty())
}

fn main() -> ExitCode {
    match options().and_then(|options| work(&options)) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}
