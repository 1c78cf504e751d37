//! `serve --snapshot-on-exit` and `serve --restore`.

use super::support::{Serve, TempDir, run, stderr, stdout};

const PICK: &str = "PROGRAM PICK\nDOUT(5)\nEND\n";

#[test]
fn what_ends_with_a_snapshot_begins_again_from_it() {
    let directory = TempDir::new();
    let program = directory.file("pick.scol", PICK);
    let state = directory.path().join("state.json");
    let state = state.to_str().unwrap();
    let first = Serve::start(&[
        "--load",
        &program,
        "--select",
        "PICK",
        "--key",
        "teaching",
        "--snapshot-on-exit",
        state,
    ]);
    assert!(first.host(&["su"]).status.success());
    assert!(first.signal("TERM").status.success());
    let text = std::fs::read_to_string(state).unwrap();
    assert!(
        text.starts_with("{\n  \"format\": \"ts3100-snapshot\",\n  \"version\": 1,\n"),
        "{text:.200}"
    );
    assert!(text.contains(r#""PICK": "PROGRAM PICK\nDOUT(5)\nEND\n""#));

    let second = Serve::start(&["--restore", state]);
    let status = stdout(&second.host(&["su"]));
    assert!(
        status.contains("PICK") && status.to_lowercase().contains("teaching"),
        "{status}"
    );
}

#[test]
fn what_cannot_be_restored_is_no_start() {
    let directory = TempDir::new();
    let broken = directory.file(
        "broken.json",
        "{\"format\": \"ts3100-snapshot\", \"version\": 1, \"config\": 5}",
    );
    for (words, expected) in [
        (
            vec!["--restore", &broken],
            "broken.json: no snapshot: invalid type",
        ),
        (
            vec!["--restore", "nowhere.json"],
            "cannot read the snapshot nowhere.json",
        ),
        (
            vec!["--restore", &broken, "--key", "ext", "--servo-on"],
            "found --key, --servo-on",
        ),
        (
            vec!["--restore", &broken, "--set", "text.stx=required"],
            "found --set",
        ),
    ] {
        let output = run(&[&["serve", "--ports", "auto"], words.as_slice()].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains(expected), "{}", stderr(&output));
    }
}
