//! Which clause of the manual is proven by which test. Tests name their clauses in a comment line
//! `// clause: ID ID` above them, transcripts in their header; this file finds them and joins them with the
//! outcome of a test run. Running the tests is the command's.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The packages whose tests count, and where their sources are.
pub const PACKAGES: [(&str, &str); 5] = [
    ("ts3100-proto", "crates/proto"),
    ("scol-mini", "crates/scol-mini"),
    ("ts3100-controller", "crates/controller"),
    ("ts3100-emulator", "crates/emulator"),
    ("ts3100-tests", "tests"),
];
/// The test that runs every transcript as written.
const TRANSCRIPT_TEST: &str = "every_transcript_holds_as_written";
/// What a comment that names clauses begins with.
const MARK: &str = "// clause:";
/// How many lines may stand between that comment and the function: attributes and further comments.
const REACH: usize = 8;

/// A test that names clauses.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Proof {
    /// Package of the test.
    pub package: &'static str,
    /// Where it stands, from the root of the repository.
    pub file: String,
    /// Name of the function.
    pub test: String,
    /// The clauses it names.
    pub clauses: Vec<String>,
}

/// A row of `docs/clauses.tsv`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Clause {
    /// `FRM-01`.
    pub id: String,
    /// The columns after the id up to the tests: section, subject, certainty, option.
    pub columns: [String; 4],
    /// `package::test` of each test that was proven to pass when the list was written.
    pub tests: BTreeSet<String>,
}

impl Clause {
    /// Whether it is a row of the SCARA edition of the manual, `S14`, rather than a clause of the six-axis one.
    #[must_use]
    pub fn is_row_of_scara_edition(&self) -> bool {
        let row = self.id.strip_prefix('S');
        row.is_some_and(|row| row.starts_with(|first: char| first.is_ascii_digit()))
    }
}

/// The outcomes of a run: for each package, whether every test of a name passed.
pub type Outcomes = BTreeMap<String, BTreeMap<String, bool>>;

/// Root of the repository.
#[must_use]
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Reads the list.
///
/// # Errors
/// A line that has not six columns, with its number.
pub fn read_list(text: &str) -> Result<Vec<Clause>, String> {
    let rows = text.lines().enumerate().skip(1);
    rows.map(|(index, line)| {
        let columns: Vec<&str> = line.split('\t').collect();
        let [id, section, subject, certainty, option, tests] = columns[..] else {
            return Err(format!(
                "line {}: 6 columns expected, {} found",
                index + 1,
                columns.len()
            ));
        };
        Ok(Clause {
            id: id.to_string(),
            columns: [section, subject, certainty, option].map(str::to_string),
            tests: tests.split_whitespace().map(str::to_string).collect(),
        })
    })
    .collect()
}

/// Writes the list.
#[must_use]
pub fn write_list(clauses: &[Clause]) -> String {
    let mut text = "id\tsection\tsubject\tcertainty\toption\ttests\n".to_string();
    for clause in clauses {
        let tests: Vec<&str> = clause.tests.iter().map(String::as_str).collect();
        text += &format!(
            "{}\t{}\t{}\n",
            clause.id,
            clause.columns.join("\t"),
            tests.join(" ")
        );
    }
    text
}

/// Every test of the repository that names clauses.
///
/// # Errors
/// A file that cannot be read, a mark without a test behind it.
pub fn proofs(root: &Path) -> Result<Vec<Proof>, String> {
    let mut found = Vec::new();
    for (package, folder) in PACKAGES {
        for path in files(&root.join(folder), "rs")? {
            let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
            let file = path.strip_prefix(root).unwrap_or(&path).display().to_string();
            found.extend(proofs_in(package, &file, &text)?);
        }
    }
    for path in files(&root.join("fixtures/transcripts"), "txt")? {
        let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let named = text.lines().filter_map(|line| line.strip_prefix("clauses:"));
        let clauses = named
            .flat_map(str::split_whitespace)
            .map(str::to_string)
            .collect();
        let file = path.strip_prefix(root).unwrap_or(&path).display().to_string();
        found.push(Proof {
            package: "ts3100-tests",
            file,
            test: TRANSCRIPT_TEST.to_string(),
            clauses,
        });
    }
    Ok(found)
}

fn proofs_in(package: &'static str, file: &str, text: &str) -> Result<Vec<Proof>, String> {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let mut found = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        let Some(named) = line.strip_prefix(MARK) else {
            continue;
        };
        let below = lines.iter().skip(index + 1).take(REACH);
        let name = below
            .filter_map(|line| line.trim_start_matches("async ").strip_prefix("fn "))
            .next();
        let name = name.and_then(|rest| rest.split(['(', '<']).next());
        let Some(test) = name else {
            return Err(format!("{file}:{}: a test expected below `{MARK}`", index + 1));
        };
        let clauses = named.split_whitespace().map(str::to_string).collect();
        found.push(Proof {
            package,
            file: file.to_string(),
            test: test.to_string(),
            clauses,
        });
    }
    Ok(found)
}

fn files(folder: &Path, extension: &str) -> Result<Vec<PathBuf>, String> {
    let mut found = Vec::new();
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    for entry in entries.filter_map(Result::ok) {
        let path = entry.path();
        if path.is_dir() && entry.file_name() != "target" {
            found.extend(files(&path, extension)?);
        } else if path.extension().is_some_and(|found| found == extension) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Reads what the test harness printed of one package.
#[must_use]
pub fn outcomes(printed: &str) -> BTreeMap<String, bool> {
    let mut outcomes = BTreeMap::new();
    for line in printed.lines() {
        let Some((path, result)) = line
            .strip_prefix("test ")
            .and_then(|rest| rest.rsplit_once(" ... "))
        else {
            continue;
        };
        let name = path.rsplit("::").next().unwrap_or(path).to_string();
        let passed = outcomes.entry(name).or_insert(true);
        *passed &= result == "ok";
    }
    outcomes
}

/// The clauses with the tests that passed; and what is wrong with the marks: tests that did not run or failed,
/// clauses that do not exist.
#[must_use]
pub fn join(list: &[Clause], proofs: &[Proof], outcomes: &Outcomes) -> (Vec<Clause>, Vec<String>) {
    let mut clauses: Vec<Clause> = list
        .iter()
        .map(|clause| Clause {
            tests: BTreeSet::new(),
            ..clause.clone()
        })
        .collect();
    let mut wrong = Vec::new();
    for proof in proofs {
        let Proof {
            package, file, test, ..
        } = proof;
        match outcomes.get(*package).and_then(|tests| tests.get(test)) {
            Some(true) => {}
            Some(false) => wrong.push(format!("{file}: {test} failed")),
            None => wrong.push(format!("{file}: {test} did not run")),
        }
        let passed = outcomes.get(*package).and_then(|tests| tests.get(test)) == Some(&true);
        for id in &proof.clauses {
            match clauses.iter_mut().find(|clause| clause.id == *id) {
                Some(clause) if passed => {
                    clause.tests.insert(format!("{package}::{test}"));
                }
                Some(_) => {}
                None => wrong.push(format!("{file}: {test}: there is no clause {id}")),
            }
        }
    }
    (clauses, wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIST: &str = "id\tsection\tsubject\tcertainty\toption\ttests\nA-1\t1\tx\tstated\t-\t\nA-2\t1\ty\tsilent\t-\tp::t\n";

    #[test]
    fn a_list_is_written_as_it_is_read() {
        assert_eq!(write_list(&read_list(LIST).unwrap()), LIST);
        assert!(read_list("head\nA-1\tx\n").unwrap_err().contains("line 2"));
    }

    #[test]
    fn marks_are_joined_with_outcomes() {
        let source = "    // clause: A-1 A-2\n    #[test]\n    fn holds() {\n    // clause: A-2 X-9\n    #[test]\n    fn breaks() {";
        let proofs = proofs_in("scol-mini", "f.rs", source).unwrap();
        let run = outcomes("test m::holds ... ok\ntest m::breaks ... FAILED\n");
        let (clauses, wrong) = join(
            &read_list(LIST).unwrap(),
            &proofs,
            &BTreeMap::from([("scol-mini".to_string(), run)]),
        );
        assert_eq!(clauses[0].tests, BTreeSet::from(["scol-mini::holds".to_string()]));
        assert_eq!(clauses[1].tests, BTreeSet::from(["scol-mini::holds".to_string()]));
        assert_eq!(
            wrong,
            ["f.rs: breaks failed", "f.rs: breaks: there is no clause X-9"]
        );
        assert!(proofs_in("scol-mini", "f.rs", "// clause: A-1\nstruct X;\n").is_err());
    }
}
