//! Walks the folders of fixtures: `ok` compiles without a word, `run` plays as expected, `err` says what is wrong.

#![expect(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    reason = "tests read and bless fixtures"
)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::common::{answers, compiled, folder, options, play, programs};
use scol_mini::{Diagnostic, Severity, check, compile, format};

// clause: EXAMPLE-09 RAM-04 RAM-09 RAM-10 DATA-01
#[test]
fn ok_programs_compile_without_a_remark() {
    for (path, source) in programs("ok") {
        for line_end in ["\n", "\r", "\r\n"] {
            let text = source.replace('\n', line_end);
            let compilation = compile(&text, &options(&source));
            assert_eq!(compilation.diagnostics, [], "{}", path.display());
            assert!(compilation.program.is_some());
        }
    }
}

/// Programs of the kind that run in cells are not warned of; those of the manual for what is true of them: a check value
/// that INPUT gives its kind, a label nothing jumps to, a GLOBAL that nothing uses.
#[test]
fn ok_programs_get_no_false_warnings() {
    let mut found = Vec::new();
    for (path, source) in programs("ok") {
        let name = path.file_stem().unwrap().to_str().unwrap().to_string();
        let remarks = check(&source, &options(&source)).diagnostics;
        found.extend(remarks.iter().map(|remark| (name.clone(), remark.code)));
    }
    let expected = [
        ("direct_position", "W0602"),
        ("select", "W0604"),
        ("workfile", "W0607"),
    ];
    assert_eq!(found, expected.map(|(name, code)| (name.to_string(), code)));
}

// clause: PRT-13 PRT-15 INP-01 BUF-01
#[test]
fn run_programs_play_as_expected() {
    // The others are played by the suite of whole controllers alone.
    let transcript = |path: &std::path::Path| std::fs::read_to_string(path.with_extension("expected")).ok();
    for (path, source) in programs("run") {
        let Some(expected) = transcript(&path) else {
            continue;
        };
        let lines = play(&compiled(&source), answers(&source), 10_000);
        assert_eq!(lines.join("\n") + "\n", expected, "{}", path.display());
    }
}

#[test]
fn laying_out_is_done_once_and_changes_no_meaning() {
    let mut changed = 0;
    for (path, source) in ["ok", "run", "err"].into_iter().flat_map(programs) {
        let laid = format(&source);
        assert_eq!(format(&laid), laid, "{}", path.display());
        changed += usize::from(laid != source);
        // Tabs are errors that formatting removes.
        let without_tabs = source.replace('\t', " ");
        let (before, after) = (
            compile(&without_tabs, &options(&source)),
            compile(&laid, &options(&source)),
        );
        let said = |list: &[scol_mini::Diagnostic]| -> Vec<(u32, &str)> {
            let mut codes: Vec<_> = list.iter().map(|d| (d.line, d.code)).collect();
            codes.sort_unstable();
            codes
        };
        assert_eq!(
            said(&after.diagnostics),
            said(&before.diagnostics),
            "{}",
            path.display()
        );
        if let (Some(before), Some(after)) = (before.program, after.program) {
            let lines = |program| play(program, answers(&source), 3_000);
            assert_eq!(lines(&after), lines(&before), "{}", path.display());
            assert_eq!(
                after.statement_lines(),
                before.statement_lines(),
                "lines stay where they are"
            );
        }
    }
    assert!(
        changed > 20,
        "{changed} programs are laid out anew: the test proves little"
    );
}

/// The programs of `err` that are wrong whatever the robot; the controller checks the others.
fn wrong_programs() -> Vec<(PathBuf, String)> {
    let programs = programs("err").into_iter();
    programs
        .filter(|(path, _)| !path.file_name().unwrap().to_str().unwrap().starts_with("robot_"))
        .collect()
}

fn remarks(source: &str) -> String {
    let compilation = check(source, &options(source));
    let list = &compilation.diagnostics;
    assert!(!list.is_empty(), "nothing is said about\n{source}");
    let errors = list.iter().any(|d| d.severity == Severity::Error);
    assert_eq!(compilation.program.is_none(), errors);
    list.iter().map(|d| d.render(source, "TEST")).collect()
}

/// What a fixture says by hand it expects: codes and lines, in the order of the source.
fn said(source: &str) -> Option<Vec<String>> {
    let line = source.lines().find_map(|line| line.strip_prefix("' says: "))?;
    let mut list: Vec<String> = line.split(',').map(|entry| entry.trim().to_string()).collect();
    list.sort();
    Some(list)
}

#[test]
fn err_programs_get_the_codes_on_the_lines_they_name() {
    let mut fixtures = 0;
    for (path, source) in wrong_programs() {
        let Some(expected) = said(&source) else { continue };
        fixtures += 1;
        let compilation = check(&source, &options(&source));
        let mut found: Vec<String> = compilation
            .diagnostics
            .iter()
            .map(|d| format!("{}@{}", d.code, d.line))
            .collect();
        found.sort();
        assert_eq!(
            found,
            expected,
            "{}:
{}",
            path.display(),
            remarks(&source)
        );
    }
    assert!(fixtures >= 60, "{fixtures} programs name what they expect");
}

/// Where it is written what is said of a program.
fn golden(program: &Path) -> PathBuf {
    let name = program.with_extension("txt");
    folder("../golden/err").join(name.file_name().unwrap())
}

// clause: RAM-08 DATA-11 DATA-12 DATA-13
#[test]
fn err_programs_are_told_what_is_wrong() {
    for (path, source) in wrong_programs() {
        let expected = std::fs::read_to_string(golden(&path)).unwrap();
        let found = remarks(&source);
        assert_eq!(found, expected, "{}:\n{found}", path.display());
    }
}

/// Codes of the errors on these lines.
fn errors(remarks: &[Diagnostic], lines: std::ops::RangeInclusive<u32>) -> Vec<&'static str> {
    let there = remarks.iter().filter(|d| lines.contains(&d.line));
    there
        .map(|d| d.code)
        .filter(|code| code.starts_with('E'))
        .collect()
}

/// A fix removes its diagnostic, and the line has no error after it that it did not have before.
#[test]
fn every_fix_cures_what_it_is_for() {
    let mut kinds = BTreeSet::new();
    for (path, source) in wrong_programs() {
        let before = check(&source, &options(&source)).diagnostics;
        for remark in &before {
            let Some(fix) = &remark.fix else { continue };
            kinds.insert(remark.code);
            let title = fix.title(&source);
            let changed = fix.apply(&source);
            assert_ne!(changed, source, "{}: {title}", path.display());
            let after = check(&changed, &options(&source)).diagnostics;
            let place = format!("{}:{}: {title}\n{changed}", path.display(), remark.line);
            let gone = !after
                .iter()
                .any(|d| d.code == remark.code && d.message == remark.message && d.line == remark.line);
            assert!(gone, "{place}: {remark:?}");
            // A line that the fix inserts moves the others down.
            let added = changed.lines().count().saturating_sub(source.lines().count());
            let last = remark.line + u32::try_from(added).unwrap();
            let known = errors(&before, remark.line..=last);
            let found = errors(&after, remark.line..=last);
            // A line that parses has its names looked up.
            let is_looked_up = |code: &&&str| remark.code == "E0101" && **code == "E0201";
            let mut new = found
                .iter()
                .filter(|code| !known.contains(code) && !is_looked_up(code));
            assert_eq!(new.next(), None, "{place}");
        }
    }
    assert!(kinds.len() >= 12, "only {kinds:?} have a fix");
}

/// Codes as they stand between quotes in the sources of the front end.
fn codes() -> BTreeSet<String> {
    let mut folders = Vec::from([Path::new(env!("CARGO_MANIFEST_DIR")).join("src")]);
    let mut codes = BTreeSet::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            // The table, which is compared with the others.
            if path.ends_with("codes.rs") {
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            let product = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
            let words = product
                .split('"')
                .filter(|word| word.len() == 5 && word.starts_with(['E', 'W']));
            codes.extend(
                words
                    .filter(|word| word[1..].bytes().all(|b| b.is_ascii_digit()))
                    .map(String::from),
            );
        }
    }
    codes
}

/// Every code of the front end has a program in `err` that brings it about, with what is to be done about it at least
/// once, and a section in docs/reference/diagnostics.md.
#[test]
fn every_code_has_its_program_its_remedy_and_its_row() {
    // A file that is too long is no fixture, what cannot be done by DO is no file, and an arm has a model.
    const ELSEWHERE: [&str; 3] = ["E0001", "E0501", "W0624"];
    let (mut told, mut helped) = (BTreeSet::new(), BTreeSet::new());
    for (path, source) in wrong_programs() {
        for remark in check(&source, &options(&source)).diagnostics {
            let inside = remark.span.start <= remark.span.end && remark.span.end <= source.len();
            assert!(inside, "{}: {remark:?}", path.display());
            told.insert(remark.code.to_string());
            if remark.help.is_some() {
                helped.insert(remark.code.to_string());
            }
        }
    }
    let codes = codes();
    assert!(codes.len() >= 50, "{} codes found", codes.len());
    let docs = std::fs::read_to_string(folder("err").join("../../../docs/reference/diagnostics.md")).unwrap();
    let without = |known: &BTreeSet<String>| -> Vec<String> {
        let missing = codes
            .iter()
            .filter(|code| !known.contains(*code) && !ELSEWHERE.contains(&code.as_str()));
        missing.cloned().collect()
    };
    assert_eq!(
        without(&told),
        [] as [&str; 0],
        "no program of err brings these about"
    );
    assert_eq!(
        without(&helped),
        [] as [&str; 0],
        "no program of err is told what to do about these"
    );
    let listed: BTreeSet<String> = scol_mini::DIAGNOSTICS
        .iter()
        .map(|kind| kind.code.to_owned())
        .collect();
    assert_eq!(listed, codes, "the table of diagnostics");
    for kind in scol_mini::DIAGNOSTICS {
        assert_eq!(
            kind.severity == Severity::Error,
            kind.code.starts_with('E'),
            "{kind:?}"
        );
    }
    let rows: Vec<&String> = codes
        .iter()
        .filter(|code| !docs.contains(&format!("<a id=\"{code}\"></a>")))
        .collect();
    assert_eq!(
        rows,
        [] as [&str; 0],
        "docs/reference/diagnostics.md misses these"
    );
}

/// A fixture begins with its origin.
#[test]
fn a_byte_order_mark_is_one_error_with_a_fix() {
    let source = "\u{FEFF}PROGRAM T\n  DELAY 1\nEND\n";
    let found = check(source, &Default::default()).diagnostics;
    let [only] = found.as_slice() else {
        panic!("{found:?}")
    };
    assert_eq!((only.code, only.line, only.column), ("E0004", 1, 1));
    let fix = only.fix.as_ref().unwrap();
    assert!(fix.is_certain);
    assert_eq!(fix.title(source), "remove the byte order mark");
    assert_eq!(check(&fix.apply(source), &Default::default()).diagnostics, []);
}

#[test]
fn a_file_that_is_too_long_is_told_so() {
    let source = "' too long\n".repeat(10_000);
    let found = check(&source, &Default::default()).diagnostics;
    assert_eq!((found.len(), found[0].code, found[0].line), (1, "E0001", 1));
    assert!(found[0].message.contains("99999"), "{}", found[0].message);
}

#[test]
#[ignore = "writes fixtures/golden/err anew; review the difference"]
fn bless_err() {
    for (path, source) in wrong_programs() {
        std::fs::write(golden(&path), remarks(&source)).unwrap();
    }
}
