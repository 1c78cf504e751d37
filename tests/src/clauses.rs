//! Which clause of the manual, which row of the other sources and which rule of this project is proven by which test.
//! Tests name them in a comment line `// clause: ID ID` above them, transcripts in their header; this file finds them and
//! joins them with the outcome of a test run, read from what `cargo test` printed.
//!
//! It runs no tests; the binary `clauses` does. The list is `docs/clauses.tsv`, and `docs/explanation/fidelity.md` names
//! its sources.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The packages whose tests count, and where their sources are.
pub const PACKAGES: [(&str, &str); 6] = [
    ("ts3100-proto", "crates/proto"),
    ("scol-mini", "crates/scol-mini"),
    ("ts3100-controller", "crates/controller"),
    ("ts3100-driver", "crates/driver"),
    ("ts3100-emulator", "crates/emulator"),
    ("ts3100-tests", "tests"),
];
/// The test that runs every transcript as written.
const TRANSCRIPT_TEST: &str = "every_transcript_holds_as_written";
/// What a comment that names clauses begins with.
const MARK: &str = "// clause:";
/// How many lines may be between that comment and the function: attributes and further comments.
const REACH: usize = 8;
/// What the column of the certainty says of a row: the words that ask for a test.
const TESTED: [&str; 5] = ["stated", "implied", "garbled", "silent", "observed"];
/// The words that need none: wires are not modelled; what happens inside a library says nothing about the controller; and
/// of an open row no source says what the controller does.
const UNTESTED: [&str; 3] = ["wiring", "library", "open"];
/// First row of the command list of the SCARA edition (its Table 5.1): the rows from here on are counted by themselves.
const COMMAND_LIST: u16 = 42;

/// A test that names clauses.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Proof {
    /// Package of the test.
    pub package: &'static str,
    /// Path of its file, from the root of the repository.
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

/// Where a row comes from. The report counts the rows of each source by themselves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// The communication manual of six-axis robots: `FRM-01`.
    Manual,
    /// The first pages that were found of its SCARA edition, and an interface manual: `S1` to `S41`.
    ScaraEdition,
    /// The command list and the permission tables of that edition: `S42` and up.
    CommandList,
    /// The manual of the maker's client library: `L2`.
    LibraryManual,
    /// Host programs of real robots: `I1`, `J8`, `K5`.
    Hosts,
    /// Rules of this project on how to read them: `T6`.
    Rules,
}

impl Source {
    /// All, in the order of the report.
    pub const ALL: [Source; 6] = [
        Source::Manual,
        Source::ScaraEdition,
        Source::CommandList,
        Source::LibraryManual,
        Source::Hosts,
        Source::Rules,
    ];

    /// What the report calls its rows.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Source::Manual => "clauses of the manual",
            Source::ScaraEdition => "rows of the SCARA edition (STE 80722)",
            Source::CommandList => "rows of its command list and tables (STE 80722, S42 and up)",
            Source::LibraryManual => "rows of the manual of the client library (STE 85409)",
            Source::Hosts => "rows of real hosts (I, J, K)",
            Source::Rules => "rules of this project (T1 to T27)",
        }
    }
}

impl Clause {
    /// Where it comes from, by its id: a letter and a number, or else a clause of the manual.
    #[must_use]
    pub fn source(&self) -> Source {
        let mut letters = self.id.chars();
        let first = letters.next();
        let digits: String = letters.take_while(char::is_ascii_digit).collect();
        match (first, digits.parse::<u16>()) {
            (Some('S'), Ok(row)) if row < COMMAND_LIST => Source::ScaraEdition,
            (Some('S'), Ok(_)) => Source::CommandList,
            (Some('L'), Ok(_)) => Source::LibraryManual,
            (Some('I' | 'J' | 'K'), Ok(_)) => Source::Hosts,
            (Some('T'), Ok(_)) => Source::Rules,
            _ => Source::Manual,
        }
    }

    /// How sure its source is: one of the words of the list.
    #[must_use]
    pub fn certainty(&self) -> &str {
        &self.columns[2]
    }

    /// Whether a test has to prove it.
    #[must_use]
    pub fn needs_test(&self) -> bool {
        !UNTESTED.contains(&self.certainty())
    }
}

impl Proof {
    /// Whether it is a unit test next to the code, and not in a suite that tests from outside.
    #[must_use]
    pub fn is_unit(&self) -> bool {
        self.file.split(['/', '\\']).any(|folder| folder == "src")
    }
}

/// Clauses whose proof is thin.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Thin<'a> {
    /// Proven by one test alone.
    pub single: Vec<&'a str>,
    /// Proven by [units](Proof::is_unit) alone.
    pub units: Vec<&'a str>,
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
/// A line that has not six columns, or whose certainty is none of the words; with its number.
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
        if !TESTED.iter().chain(&UNTESTED).any(|word| *word == certainty) {
            let words = [&TESTED[..], &UNTESTED[..]].concat().join(", ");
            return Err(format!(
                "line {}: certainty: expected one of {words}, found {certainty}",
                index + 1
            ));
        }
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
/// A file that cannot be read, a mark without a test after it.
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

/// Reads what `cargo test --workspace` printed, both of its streams as one.
#[must_use]
pub fn outcomes(printed: &str) -> Outcomes {
    let mut all = Outcomes::new();
    let mut package = None;
    for line in printed.lines().map(str::trim_start) {
        if line.starts_with("Running ") || line.starts_with("Doc-tests ") {
            package = package_of(line);
            continue;
        }
        let named = line.strip_prefix("test ");
        let (Some(package), Some((path, result))) =
            (package, named.and_then(|rest| rest.rsplit_once(" ... ")))
        else {
            continue;
        };
        let name = path.rsplit("::").next().unwrap_or(path).to_string();
        let tests = all.entry(package.to_string()).or_default();
        *tests.entry(name).or_insert(true) &= result == "ok";
    }
    all
}

/// Whose tests come after `Running unittests src/lib.rs (target/debug/deps/ts3100_proto-0123)` or
/// `Running tests/suite/main.rs (...)`; `None` for a package whose tests do not count. Cargo names the file from the
/// root of its package, which is how the tests of two packages are distinguished.
fn package_of(line: &str) -> Option<&'static str> {
    let mut words = line.split_whitespace();
    let file = match words.next()? {
        "Doc-tests" => None,
        _ => Some(words.next()?).filter(|word| *word != "unittests"),
    };
    let packages = PACKAGES.iter();
    if let Some(file) = file {
        let mut owners = packages.filter(|(_, folder)| root().join(folder).join(file).is_file());
        return owners.next().map(|(package, _)| *package);
    }
    let artifact = words
        .last()?
        .trim_matches(['(', ')'])
        .rsplit(['/', '\\'])
        .next()?;
    let target = artifact.rsplit_once('-').map_or(artifact, |(target, _)| target);
    let mut named = packages.filter(|(package, _)| package.replace('-', "_") == target);
    named.next().map(|(package, _)| *package)
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

/// Which of these clauses are proven, but rest on little.
#[must_use]
pub fn thin<'a>(clauses: impl IntoIterator<Item = &'a Clause>, proofs: &[Proof]) -> Thin<'a> {
    let mut thin = Thin::default();
    let proven = clauses.into_iter().filter(|clause| !clause.tests.is_empty());
    for clause in proven {
        if clause.tests.len() == 1 {
            thin.single.push(&clause.id);
        }
        let passed = |proof: &&Proof| {
            clause
                .tests
                .contains(&format!("{}::{}", proof.package, proof.test))
        };
        let mut naming = proofs.iter().filter(|proof| proof.clauses.contains(&clause.id));
        if naming.all(|proof| !passed(&proof) || proof.is_unit()) {
            thin.units.push(&clause.id);
        }
    }
    thin
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIST: &str = "id\tsection\tsubject\tcertainty\toption\ttests\nA-1\t1\tx\tstated\t-\t\nA-2\t1\ty\tsilent\t-\tp::t\n";

    #[test]
    fn a_list_is_written_as_it_is_read() {
        assert_eq!(write_list(&read_list(LIST).unwrap()), LIST);
        assert!(read_list("head\nA-1\tx\n").unwrap_err().contains("line 2"));
        let unknown = read_list("head\nA-1\t1\tx\tsure\t-\t\n").unwrap_err();
        assert!(
            unknown.contains("line 2") && unknown.contains("found sure"),
            "{unknown}"
        );
    }

    #[test]
    fn wiring_a_librarys_own_matters_and_open_rows_need_no_test() {
        for word in TESTED {
            assert!(clause("A-1", word).needs_test(), "{word}");
        }
        for word in UNTESTED {
            assert!(!clause("A-1", word).needs_test(), "{word}");
        }
    }

    #[test]
    fn a_row_comes_from_the_source_its_id_names() {
        let ids = [
            ("SER-01", Source::Manual),
            ("SF-03", Source::Manual),
            ("INP-14", Source::Manual),
            ("TRN-07", Source::Manual),
            ("S1", Source::ScaraEdition),
            ("S41", Source::ScaraEdition),
            ("S42", Source::CommandList),
            ("S86-RN", Source::CommandList),
            ("S48-S64", Source::CommandList),
            ("L34-L38", Source::LibraryManual),
            ("I17-035", Source::Hosts),
            ("J1-J5", Source::Hosts),
            ("K10-K12", Source::Hosts),
            ("T27", Source::Rules),
        ];
        for (id, source) in ids {
            assert_eq!(clause(id, "stated").source(), source, "{id}");
        }
    }

    fn clause(id: &str, certainty: &str) -> Clause {
        let mut read = read_list(&format!("head\n{id}\t1\tx\t{certainty}\t-\t\n")).unwrap();
        read.remove(0)
    }

    #[test]
    fn marks_are_joined_with_outcomes() {
        let source = "    // clause: A-1 A-2\n    #[test]\n    fn holds() {\n    // clause: A-2 X-9\n    #[test]\n    fn breaks() {";
        let proofs = proofs_in("scol-mini", "f.rs", source).unwrap();
        let run = outcomes(
            "     Running unittests src/lib.rs (target/debug/deps/scol_mini-0123)\n\
             test m::holds ... ok\ntest m::breaks ... FAILED\n   Doc-tests ts3100_proto\ntest m::breaks ... ok\n",
        );
        let (clauses, wrong) = join(&read_list(LIST).unwrap(), &proofs, &run);
        assert_eq!(clauses[0].tests, BTreeSet::from(["scol-mini::holds".to_string()]));
        assert_eq!(clauses[1].tests, BTreeSet::from(["scol-mini::holds".to_string()]));
        assert_eq!(
            wrong,
            ["f.rs: breaks failed", "f.rs: breaks: there is no clause X-9"]
        );
        assert!(proofs_in("scol-mini", "f.rs", "// clause: A-1\nstruct X;\n").is_err());
    }

    #[test]
    fn a_test_belongs_to_the_package_that_cargo_names() {
        let of = |line| package_of(line);
        let suites = "Running suites/main.rs (target/debug/deps/suites-88)";
        assert_eq!(of(suites), Some("ts3100-tests"));
        let suite = "Running tests/suite/main.rs (target/debug/deps/suite-88)";
        assert_eq!(of(suite), Some("scol-mini"));
        let bench = "Running unittests src/main.rs (target/debug/deps/ts3100_benches-88)";
        assert_eq!(of(bench), None);
        assert_eq!(of("Doc-tests ts3100_controller"), Some("ts3100-controller"));
    }

    #[test]
    fn thin_proofs_are_told() {
        let source = "// clause: A-1\nfn one() {\n// clause: A-2\nfn two() {";
        let mut proofs = proofs_in("scol-mini", "crates/scol-mini/src/f.rs", source).unwrap();
        proofs.extend(proofs_in("ts3100-tests", "tests/suites/f.rs", "// clause: A-2\nfn far() {").unwrap());
        let run = outcomes(
            "Doc-tests scol_mini\ntest one ... ok\ntest two ... ok\nDoc-tests ts3100_tests\ntest far ... ok\n",
        );
        let (clauses, wrong) = join(&read_list(LIST).unwrap(), &proofs, &run);
        assert_eq!(wrong, [""; 0]);
        let expected = Thin {
            single: vec!["A-1"],
            units: vec!["A-1"],
        };
        assert_eq!(thin(&clauses, &proofs), expected);
    }
}
