//! The work of the manual's example programs, step by step with a host that answers.

#![expect(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    reason = "a test that cannot read its fixtures fails"
)]

use std::collections::VecDeque;

use crate::common::{answer, compiled, folder, play};

fn run(name: &str, answers: &[&str]) -> Vec<String> {
    let source = std::fs::read_to_string(folder("ok").join(name)).unwrap();
    play(
        &compiled(&source),
        answers.iter().map(|text| answer(text)).collect::<VecDeque<_>>(),
        1_000,
    )
}

fn count(lines: &[String], start: &str) -> usize {
    lines.iter().filter(|line| line.starts_with(start)).count()
}

// clause: EXAMPLE-01 EXAMPLE-02
#[test]
fn repeat() {
    let lines = run("repeat.scol", &["!", "0", "3"]);
    assert_eq!(count(&lines, "PRINT Com1 \"REQ\""), 3);
    assert_eq!(count(&lines, "MOVE"), 6);
    assert_eq!(lines[lines.len() - 2..], ["PRINT Com1 \"END\"", "ENDED"]);
}

// clause: EXAMPLE-03 EXAMPLE-04
#[test]
fn select() {
    for (input, output) in [
        ("1", "T1"),
        ("2", "T2"),
        ("3", "T3"),
        ("7", "NG"),
        ("0", "NG"),
        ("!", "NG"),
    ] {
        let lines = run("select.scol", &[input]);
        assert_eq!(lines[2..], [format!("PRINT Com1 {output:?}"), "ENDED".into()]);
    }
}

// clause: EXAMPLE-05 EXAMPLE-06
#[test]
fn direct_position() {
    let lines = run("direct_position.scol", &["400,0,200,0,0,0,0,0,601"]);
    assert_eq!(lines[1], "INPUT Com1 9");
    assert_eq!(lines[2], "PRINT Com1 \"OK\"");
    assert_eq!(
        lines[3],
        "MOVE Ptp [400.0, 0.0, 200.0, 0.0, 0.0, 0.0, 0.0, 0.0]/00000 work - speed 100"
    );
    let lines = run("direct_position.scol", &["400,0,200,0,0,0,0,0,600"]);
    assert_eq!(lines[2..], ["PRINT Com1 \"NG\"", "ENDED"]);
}

// clause: EXAMPLE-07 EXAMPLE-08 EXAMPLE-10
#[test]
fn relative() {
    let lines = run("relative.scol", &["10.5,20.25,31.75"]);
    assert_eq!(lines[3], "PRINT Com1 \"OK\"");
    assert_eq!(
        lines[4],
        "MOVE Ptp [410.5, 20.25, 200.0, 0.0, 90.0, 0.0, 0.0, 0.0]/12111 work - speed 100"
    );
    assert_eq!(
        run("relative.scol", &["10,20,30"])[3..],
        ["PRINT Com1 \"NG\"", "ENDED"]
    );
}

// clause: RAM-12 RAM-13 DATA-09 DATA-10
#[test]
fn work_file() {
    let lines = run("workfile.scol", &[]);
    let works: Vec<&str> = lines
        .iter()
        .filter_map(|line| line.split(' ').rev().nth(2))
        .collect();
    assert_eq!(
        works,
        ["-", "-", "-", "TABLE1", "TABLE1", "-", "-", "TABLE2", "-"]
    );
    assert!(lines[0].ends_with("speed 20"));
    assert!(lines[6].contains("/11111"));
}

#[test]
fn pick_dialogue() {
    let lines = run(
        "pick_dialogue.scol",
        &["1,2,0.000,-250.000,28.000,89.167,2", "9,0,0,0,0,0,0"],
    );
    assert_eq!(lines[1], "INPUT Ip1 7");
    assert_eq!(lines[2], "PRINT Ip1 \"ACK            2         -128\\r\"");
    assert!(lines[3].starts_with("MOVE Ptp [0.0, -250.0, 28.0, 89.1"));
    assert!(lines[3].contains("/20000"));
    assert_eq!(lines[4..6], ["DELAY 0.25", "PRINT Ip1 \"DONE\\r\""]);
    assert_eq!(lines.last().unwrap(), "ENDED");
}
