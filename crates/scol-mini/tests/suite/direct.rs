//! What a host is told about a statement of DO that is not accepted: what is wrong, and what was probably meant.

#![expect(clippy::unwrap_used, reason = "a statement that is accepted fails the test")]

use scol_mini::{LanguageOptions, compile, compile_direct};

const FILE: &str =
    "GLOBAL\nCOUNT=1\nEND\nPROGRAM MAIN\nCOUNT=2\nEND\nPROGRAM BRAK\nEND\nDATA\nPOINT HOME=1\nEND\n";

/// Code and remedy.
fn told(statement: &str) -> (&'static str, String) {
    let base = compile(FILE, &LanguageOptions::default()).program.unwrap();
    let list = compile_direct(statement, &base).unwrap_err();
    assert_eq!(list.len(), 1, "{list:?}");
    let marked = statement.get(list[0].span.start..list[0].span.end);
    assert!(marked.is_some(), "the place lies within the statement");
    (list[0].code, list[0].help.clone().unwrap_or_default())
}

// clause: CMD-DO-04
#[test]
fn the_word_that_was_meant_is_named() {
    for (statement, code, meant) in [
        ("MOEV HOME", "E0103", "MOVE"),
        ("MOVES HOM", "E0201", "HOME"),
        ("MOVE HOME WIHT SPEED=5", "E0101", "WITH"),
        ("PRINT IP1, CUONT", "E0201", "COUNT"),
        ("COUT = 3", "E0201", "COUNT"),
        ("RAEDY", "E0501", "READY"),
        ("OPEM1", "E0501", "OPEN1"),
        ("PRINT TP, \"A\", CRE", "E0106", "end the record with CR"),
        ("PRINT IP3, COUNT", "E0201", "use TP, COM1, IP1 or IP2"),
    ] {
        let (found, help) = told(statement);
        assert_eq!(found, code, "{statement}");
        assert!(help.contains(meant), "{statement}: {help:?}");
    }
    assert_eq!(
        told("BRAK"),
        ("E0501", String::new()),
        "a program of the file was meant"
    );
    assert_eq!(
        told("STOP"),
        ("E0501", String::new()),
        "STOP is spelt right, it is not for DO"
    );
}
