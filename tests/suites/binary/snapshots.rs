//! `serve --snapshot-on-exit` and `serve --restore`.

use super::support::{Serve, run, stderr, stdout};
use ts3100_tests::testing::TempDir;

const PICK: &str = "PROGRAM PICK\nDOUT(5)\nEND\n";

#[test]
fn what_ends_with_a_snapshot_begins_again_from_it() {
    let directory = TempDir::new("binary");
    let program = directory.file("pick.scol", PICK);
    let state = directory.path().join("state.json");
    let state = state.to_str().unwrap();
    let first = Serve::start(&[
        "--load",
        &program,
        "--select",
        "PICK",
        "--key-switch",
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
    let directory = TempDir::new("binary");
    let broken = directory.file(
        "broken.json",
        "{\"format\": \"ts3100-snapshot\", \"version\": 1, \"config\": 5}",
    );
    for (words, expected) in [
        (
            vec!["--restore", &broken],
            "broken.json: this is not a snapshot: expected an object, found `5` at line 1 column ",
        ),
        (
            vec!["--restore", "nowhere.json"],
            "cannot read the snapshot nowhere.json",
        ),
        (
            vec!["--restore", &broken, "--key-switch", "ext", "--servo-on"],
            "cannot use --key-switch, --servo-on with --restore",
        ),
        (
            vec!["--restore", &broken, "--set", "text.stx=required"],
            "cannot use --set with --restore",
        ),
    ] {
        let output = run(&[&["serve", "--ports", "auto"], words.as_slice()].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains(expected), "{}", stderr(&output));
    }
}

/// What a run writes, each to be told before it that it cannot.
#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_no_target() {
    let directory = TempDir::new("binary");
    let theirs = directory.file("theirs", "theirs");
    let here = directory.path().join("here");
    std::fs::create_dir(&here).unwrap();
    let link = here.join("link");
    std::os::unix::fs::symlink(&theirs, &link).unwrap();
    let targets = [
        (here.as_path(), "found a directory"),
        (link.as_path(), "a symbolic link out of its directory"),
        (std::path::Path::new("/dev/null"), "found a device"),
    ];
    for (target, expected) in targets {
        let path = target.to_str().unwrap();
        for option in [
            "--snapshot-on-exit",
            "--junit",
            "--findings",
            "--coverage",
            "--lcov",
            "--report",
        ] {
            let output = run(&["serve", "--ports", "auto", option, path]);
            let words = stderr(&output);
            assert_eq!(output.status.code(), Some(2), "{option} {path}: {words}");
            assert!(
                words.contains(path) && words.contains(expected),
                "{option}: {words}"
            );
        }
    }
    assert_eq!(std::fs::read(&theirs).unwrap(), b"theirs");
    assert_eq!(std::fs::read_dir(&here).unwrap().count(), 1);
}
