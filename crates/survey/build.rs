//! Takes the ledger out of docs/explanation/fidelity.md, where it is written and read by people: one line for each row, its
//! id, evidence, questions and behaviour, with tabs between them.

use std::error::Error;
use std::path::Path;
use std::{env, fs};

const PAGE: &str = "../../docs/explanation/fidelity.md";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed={PAGE}");
    let page = fs::read_to_string(PAGE).map_err(|error| format!("{PAGE}: {error}"))?;
    let rows = page.lines().filter_map(row);
    let rows: Vec<String> = rows.collect();
    let out = Path::new(&env::var("OUT_DIR")?).join("ledger.tsv");
    Ok(fs::write(out, rows.join("\n"))?)
}

/// `| id | behaviour | evidence | clauses | option | survey |`
fn row(line: &str) -> Option<String> {
    let cells: Vec<&str> = line
        .strip_prefix("| ")?
        .strip_suffix(" |")?
        .split(" | ")
        .collect();
    let [id, behaviour @ .., evidence, _clauses, _option, survey] = cells.as_slice() else {
        return None;
    };
    let is_row = id
        .rsplit_once('-')
        .is_some_and(|(_, number)| number.parse::<u16>().is_ok());
    // A cell may hold the sign of a choice, as in `one \| several`.
    is_row.then(|| format!("{id}\t{evidence}\t{survey}\t{}", behaviour.join(" | ")))
}
