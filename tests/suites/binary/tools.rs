//! The tools for programs from outside: `check` as documents, `fmt`.

use super::support::{run, stderr, stdout, ts3100};
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

#[test]
fn colours_are_for_terminals_or_for_whoever_asks() {
    let directory = TempDir::new("binary");
    let bad = directory.file("bad.scol", "PROGRAM BAD\nGOTO NOWHERE\nEND\n");
    let is_coloured = |words: &[&str], environment: &[(&str, &str)]| {
        let mut command = ts3100(words);
        command.env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE");
        let output = command.envs(environment.iter().copied()).output().unwrap();
        let both = [&output.stdout[..], &output.stderr].concat();
        assert!(!both.is_empty());
        both.contains(&0x1b)
    };
    let forced = [("CLICOLOR_FORCE", "1")];
    let refused = [("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")];
    let messages: [&[&str]; 4] = [
        &["check", &bad],
        &["check", "no-such.scol"],
        &["serve", "--help"],
        &["serve", "--ports", "auto", "--select", "NOPE"],
    ];
    for words in messages {
        assert!(!is_coloured(words, &[]), "{words:?} into a pipe");
        assert!(is_coloured(words, &forced), "{words:?} asked for colours");
        assert!(!is_coloured(words, &refused), "{words:?} refused colours");
    }
    let json: [&[&str]; 2] = [
        &["check", "--format", "json", &bad],
        &[
            "serve",
            "--ports",
            "auto",
            "--log-format",
            "json",
            "--select",
            "NOPE",
        ],
    ];
    for words in json {
        assert!(!is_coloured(words, &forced), "{words:?} is for programs");
    }
}

#[test]
fn every_subcommand_has_a_manual_page() {
    let directory = TempDir::new("binary");
    let pages = directory.path().join("man1");
    assert_eq!(run(&["man", pages.to_str().unwrap()]).status.code(), Some(0));
    for (page, words) in [
        ("ts3100.1", "Emulator of the Toshiba Machine"),
        ("ts3100-serve.1", "TS3100_PORT_OFFSET"),
        ("ts3100-ctl-clock-advance.1", "Advance time"),
    ] {
        let text = std::fs::read_to_string(pages.join(page)).unwrap();
        assert!(text.replace('\\', "").contains(words), "{page}:\n{text}");
    }
    let output = run(&["man", "/dev/null/man1"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).starts_with("error: cannot write the manual pages to /dev/null/man1: "));
}
