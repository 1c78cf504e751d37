//! `cargo run -p ts3100-tests --bin clauses [-- OPTIONS]`: prints which clauses of the manual, rows of the other sources and
//! rules of this project are proven by which test, which are not and why, and which rest on a single test or on unit
//! tests alone.
//!
//! `--from FILE` reads what `cargo test --workspace` printed (both streams) instead of running the tests once more.
//! `--check` fails when a row that needs a test has none, a clause that was proven is not any more, a mark is wrong, or
//! more clauses than before rest on little. `--write` brings the column of tests in `docs/clauses.tsv` up to date.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Read as _};
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};
use ts3100_tests::clauses::{
    Clause, Outcomes, PACKAGES, Proof, Source, join, outcomes, proofs, read_list, root, thin, write_list,
};

/// How many rows of these sources may rest on little; `None` is any number.
struct Bound {
    sources: &'static [Source],
    /// What the report calls the rows.
    rows: &'static str,
    /// Proven by a single test.
    single: Option<usize>,
    /// Proven by unit tests alone.
    units: Option<usize>,
}

/// A clause of the manual is a paragraph of several facts, so a single test is thin. A row of the other sources is one
/// fact and often repeats such a clause: one test that fails without it is what it needs. A rule is about bytes on a
/// wire or a motion seen from outside, so unit tests alone are too little. A number that has become smaller is written
/// here, so that it stays.
const BOUNDS: [Bound; 3] = [
    Bound {
        sources: &[Source::Manual, Source::ScaraEdition],
        rows: "clauses",
        single: Some(58),
        units: Some(13),
    },
    Bound {
        sources: &[Source::CommandList, Source::LibraryManual, Source::Hosts],
        rows: "rows of other sources",
        single: None,
        units: None,
    },
    Bound {
        sources: &[Source::Rules],
        rows: "rules",
        single: None,
        units: Some(0),
    },
];

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

/// Lists every row and counts those of each source; the ids of the rows that need a test and have none.
fn report(clauses: &[Clause]) -> Vec<&str> {
    let (proven, without): (Vec<&Clause>, Vec<&Clause>) =
        clauses.iter().partition(|clause| !clause.tests.is_empty());
    let (open, exempt): (Vec<&Clause>, Vec<&Clause>) =
        without.into_iter().partition(|clause| clause.needs_test());
    for clause in &proven {
        let tests: Vec<&str> = clause.tests.iter().map(String::as_str).collect();
        println!("proven   {:<16} {}", clause.id, tests.join(" "));
    }
    for clause in &exempt {
        println!(
            "{:<8} {:<16} {}",
            clause.certainty(),
            clause.id,
            clause.columns[1]
        );
    }
    for clause in &open {
        println!(
            "missing  {:<16} {} (no test names it)",
            clause.id, clause.columns[1]
        );
    }
    for source in Source::ALL {
        let count = |list: &[&Clause]| list.iter().filter(|clause| clause.source() == source).count();
        let (proven, missing, exempt) = (count(&proven), count(&open), count(&exempt));
        println!(
            "{} {}: {proven} proven, {missing} without a test, {exempt} need none",
            proven + missing + exempt,
            source.title()
        );
    }
    open.iter().map(|clause| clause.id.as_str()).collect()
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

/// Lists the rows that rest on little; whether they are more than they may be.
fn report_thin(clauses: &[Clause], proofs: &[Proof]) -> bool {
    let mut exceeded = false;
    for bound in &BOUNDS {
        let of_bound = clauses
            .iter()
            .filter(|clause| bound.sources.contains(&clause.source()));
        let thin = thin(of_bound, proofs);
        for (what, ids, most) in [
            ("a single test", &thin.single, bound.single),
            ("unit tests alone", &thin.units, bound.units),
        ] {
            let limit = most.map_or_else(String::new, |most| format!(" of at most {most}"));
            println!(
                "{} proven by {what}: {}{limit}: {}",
                bound.rows,
                ids.len(),
                ids.join(" ")
            );
            if most.is_some_and(|most| ids.len() < most) {
                println!("fewer than before: write {} to {}", ids.len(), file!());
            }
            exceeded |= most.is_some_and(|most| ids.len() > most);
        }
    }
    exceeded
}

fn work(options: &Options) -> Result<bool, String> {
    let path = root().join("docs/clauses.tsv");
    let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let list = read_list(&text).map_err(|error| format!("{}: {error}", path.display()))?;
    let proofs = proofs(&root())?;
    let (clauses, wrong) = join(&list, &proofs, &read_outcomes(options.from.as_ref())?);
    let missing = report(&clauses);
    let thinner = report_thin(&clauses, &proofs);
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
    if !missing.is_empty() {
        println!("{} without a test: {}", missing.len(), missing.join(" "));
    }
    let is_sound = !thinner && wrong.is_empty() && lost.is_empty() && missing.is_empty();
    Ok(!options.check || is_sound)
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
