//! The tools for programs from outside: `check` as documents, `fmt`.

use super::support::{run, stdout};
use serde_json::Value;
use ts3100_tests::testing::TempDir;

const UNTIDY: &str = "program t\nn=1\nprint ip1,n,cr ' Count\nend\n";
const TIDY: &str = "PROGRAM T\n  N = 1\n  PRINT IP1, N, CR ' Count\nEND\n";

#[test]
fn check_writes_documents() {
    let directory = TempDir::new("binary");
    let bad = directory.file("bad.scol", "PROGRAM BAD\nSPARE = 1\nGOTO NOWHERE\nEND\n");
    let output = run(&["check", "--format", "json", &bad]);
    assert_eq!(output.status.code(), Some(1));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["files"][0]["diagnostics"][0]["code"], "E0202");
    let output = run(&["check", "--format", "sarif", &bad]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["runs"][0]["results"][0]["ruleId"], "E0202");
}

#[test]
fn warnings_fail_only_where_they_are_denied() {
    let directory = TempDir::new("binary");
    let doubtful = directory.file("doubtful.scol", "PROGRAM T\nSPARE = 1\nEND\n");
    let output = run(&["check", &doubtful]);
    assert_eq!(output.status.code(), Some(0));
    assert!(stdout(&output).contains("warning[W0605]"), "{}", stdout(&output));
    assert!(stdout(&output).contains("no errors, 1 warning"));
    assert_eq!(
        run(&["check", "--deny-warnings", &doubtful]).status.code(),
        Some(1)
    );
}

#[test]
fn fmt_writes_only_what_changes() {
    let directory = TempDir::new("binary");
    let file = directory.file("t.scol", UNTIDY);
    let output = run(&["fmt", "--check", &file]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stdout(&output).contains("t.scol: not formatted"));
    assert_eq!(std::fs::read_to_string(&file).unwrap(), UNTIDY);
    assert_eq!(run(&["fmt", &file]).status.code(), Some(0));
    assert_eq!(std::fs::read_to_string(&file).unwrap(), TIDY);
    assert_eq!(run(&["fmt", "--check", &file]).status.code(), Some(0));
    let binary = directory.file("b.scol", b"PROGRAM\xff\n");
    assert_eq!(run(&["fmt", &binary]).status.code(), Some(2));
    assert_eq!(std::fs::read(&binary).unwrap(), b"PROGRAM\xff\n");
}
