//! `cargo run -p ts3100-tests --bin clauses`: runs every test and prints which clauses of the manual are
//! proven, which are not, and why. `--check` fails when a clause that was proven is not any more; `--write`
//! brings the column of tests in `docs/clauses.tsv` up to date.

use std::collections::BTreeSet;
use std::fs;
use std::process::{Command, ExitCode};
use ts3100_tests::clauses::{
    Clause, Outcomes, PACKAGES, join, outcomes, proofs, read_list, root, write_list,
};

/// Clauses that no test over the protocol can prove, and why.
const PICTURES: [(&str, &str); 2] = [
    ("UI-ETHER-01", "a picture of a teach pendant screen"),
    ("UI-ETHER-02", "keys of the teach pendant"),
];

fn run_tests() -> Result<Outcomes, String> {
    let mut all = Outcomes::new();
    for (package, _) in PACKAGES {
        let output = Command::new(env!("CARGO"))
            .current_dir(root())
            .args(["test", "--package", package, "--no-fail-fast"])
            .output()
            .map_err(|error| format!("cargo test --package {package}: {error}"))?;
        let printed = String::from_utf8_lossy(&output.stdout).into_owned();
        let found = outcomes(&printed);
        if found.is_empty() {
            return Err(format!(
                "{package}: no test ran\n{}",
                String::from_utf8_lossy(&output.stderr)
            ));
        }
        all.insert(package.to_string(), found);
    }
    Ok(all)
}

fn reason(clause: &Clause) -> String {
    let picture = PICTURES.iter().find(|(id, _)| *id == clause.id);
    picture.map_or_else(|| "no test names it".to_string(), |(_, why)| (*why).to_string())
}

fn report(clauses: &[Clause]) -> usize {
    let (proven, open): (Vec<&Clause>, Vec<&Clause>) =
        clauses.iter().partition(|clause| !clause.tests.is_empty());
    for clause in &proven {
        let tests: Vec<&str> = clause.tests.iter().map(String::as_str).collect();
        println!("proven   {:<16} {}", clause.id, tests.join(" "));
    }
    for clause in &open {
        println!(
            "open     {:<16} {} ({})",
            clause.id,
            clause.columns[1],
            reason(clause)
        );
    }
    let pictures = open
        .iter()
        .filter(|clause| PICTURES.iter().any(|(id, _)| *id == clause.id))
        .count();
    let count = |list: &[&Clause]| {
        let rows = list
            .iter()
            .filter(|clause| clause.is_row_of_scara_edition())
            .count();
        (list.len() - rows, rows)
    };
    let ((proven, rows_proven), (open_clauses, rows_open)) = (count(&proven), count(&open));
    println!(
        "{} clauses: {proven} proven, {pictures} pictures of a pendant screen, {} open",
        proven + open_clauses,
        open_clauses - pictures
    );
    println!(
        "{} rows of the SCARA edition (STE 80722): {rows_proven} proven, {rows_open} open",
        rows_proven + rows_open
    );
    open.len() - pictures
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

fn work() -> Result<bool, String> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let path = root().join("docs/clauses.tsv");
    let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let list = read_list(&text).map_err(|error| format!("{}: {error}", path.display()))?;
    let (clauses, wrong) = join(&list, &proofs(&root())?, &run_tests()?);
    report(&clauses);
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
    if arguments.iter().any(|argument| argument == "--write") {
        fs::write(&path, write_list(&clauses)).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(wrong.is_empty() && lost.is_empty())
}

fn main() -> ExitCode {
    match work() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}
