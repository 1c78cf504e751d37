//! `check --watch` and `run --watch` as processes: files are saved as editors do it, and the output is waited for.

use super::support::{kill, run, stderr, ts3100};
use serde_json::Value;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdout, Stdio};
use ts3100_tests::testing::TempDir;

/// A process that watches files, ended on drop.
struct Watching {
    child: Child,
    stdout: BufReader<ChildStdout>,
    stderr: BufReader<ChildStderr>,
}

impl Watching {
    fn start(words: &[&str]) -> Watching {
        let mut command = ts3100(words);
        let piped = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = piped.spawn().unwrap();
        Watching {
            stdout: BufReader::new(child.stdout.take().unwrap()),
            stderr: BufReader::new(child.stderr.take().unwrap()),
            child,
        }
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.stdout.read_line(&mut line).unwrap();
        line
    }

    /// Reads to a line that contains this; the lines before it.
    fn until(&mut self, words: &str) -> Vec<String> {
        let mut lines = Vec::new();
        loop {
            let line = self.line();
            assert!(!line.is_empty(), "{words} not in {lines:?}");
            if line.contains(words) {
                return lines;
            }
            lines.push(line);
        }
    }

    /// Ends it as Ctrl-C does; the exit code.
    fn interrupt(mut self) -> Option<i32> {
        kill("INT", self.child.id());
        self.child.wait().unwrap().code()
    }
}

impl Drop for Watching {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Saves as many editors do: a file beside it takes its place.
fn save(path: &str, content: &str) {
    let beside = Path::new(path).with_extension("tmp");
    std::fs::write(&beside, content).unwrap();
    std::fs::rename(&beside, path).unwrap();
}

#[test]
fn check_again_when_a_file_of_a_folder_changes() {
    let directory = TempDir::new("watch");
    let file = directory.file("t.scol", "PROGRAM T\n  MOVE P1\nEND\n");
    let points = directory.file("points.csv", "P1,400,0,200,0,0,0,0,0,LANSS\n");
    let folder = directory.path().to_str().unwrap();
    let mut watching = Watching::start(&["check", "--watch", folder, "--points", &points]);
    assert_eq!(watching.line(), "watching 2 files\n");
    assert_eq!(watching.line(), format!("{file}: no errors\n"));
    save(&file, "PROGRAM T\n  MOV P1\nEND\n");
    assert_eq!(watching.line(), format!("{file} changed\n"));
    assert!(watching.line().starts_with(&format!("{file}:2:3: error[E0103]")));
    save(&file, "PROGRAM T\n  MOVE P1\nEND\n");
    watching.until("t.scol changed");
    assert_eq!(watching.line(), format!("{file}: no errors\n"));
    // The points are part of what is checked, and a mistake in them does not end it.
    save(&points, "P1,400\n");
    assert_eq!(watching.line(), format!("{points} changed\n"));
    let mut error = String::new();
    watching.stderr.read_line(&mut error).unwrap();
    assert!(error.contains("points.csv"), "{error}");
    save(&points, "P1,400,0,200,0,0,0,0,0,LANSS\n");
    assert_eq!(watching.line(), format!("{points} changed\n"));
    assert_eq!(watching.line(), format!("{file}: no errors\n"));
    let added = directory.file("u.scol", "PROGRAM U\nEND\n");
    assert_eq!(watching.line(), format!("{added} added\n"));
    assert_eq!(watching.line(), format!("{file}: no errors\n"));
    assert_eq!(watching.line(), format!("{added}: no errors\n"));
    std::fs::remove_file(&added).unwrap();
    assert_eq!(watching.line(), format!("{added} removed\n"));
    assert_eq!(watching.line(), format!("{file}: no errors\n"));
    assert_eq!(watching.interrupt(), Some(0));
}

#[test]
fn json_of_each_check_and_run_is_one_line() {
    let directory = TempDir::new("watch");
    let file = directory.file("t.scol", "PROGRAM T\n  PRINT \"1\", CR\nEND\n");
    let mut checks = Watching::start(&["check", "--json", "--watch", &file]);
    let mut runs = Watching::start(&["run", "--json", "--watch", &file]);
    let document = |watching: &mut Watching| -> Value { serde_json::from_str(&watching.line()).unwrap() };
    assert_eq!(document(&mut checks)["errors"], 0);
    assert_eq!(document(&mut runs)["printed"][0]["text"], "1");
    save(&file, "PROGRAM T\n  PRINT \"2\", CR\nEND\n");
    assert_eq!(document(&mut checks)["errors"], 0);
    assert_eq!(document(&mut runs)["printed"][0]["text"], "2");
    save(&file, "PROGRAM T\n  PRNT \"3\", CR\nEND\n");
    assert_eq!(document(&mut checks)["errors"], 1);
    assert_eq!(checks.interrupt(), Some(0));
    assert_eq!(runs.interrupt(), Some(0));
}

#[test]
fn a_change_ends_a_run_that_waits() {
    let directory = TempDir::new("watch");
    let file = directory.file("t.scol", "PROGRAM T\n  PRINT \"BEFORE\", CR\n  DELAY 3000\nEND\n");
    let records = directory.file("records.txt", "7\n");
    let input = format!("ip1={records}");
    let mut watching = Watching::start(&["run", "--watch", "--time", "real", &file, "--input", &input]);
    assert_eq!(watching.line(), "watching 2 files\n");
    assert_eq!(watching.line(), "BEFORE\n");
    save(
        &file,
        "PROGRAM T\n  N = 0\n  INPUT IP1, N\n  PRINT \"AFTER\", N, CR\nEND\n",
    );
    assert_eq!(watching.line(), format!("{file} changed\n"));
    assert_eq!(
        watching.line().split_whitespace().collect::<Vec<_>>(),
        ["AFTER", "7"]
    );
    save(&records, "8\n");
    assert_eq!(watching.line(), format!("{records} changed\n"));
    assert_eq!(
        watching.line().split_whitespace().collect::<Vec<_>>(),
        ["AFTER", "8"]
    );
    assert_eq!(watching.interrupt(), Some(0));
}

#[test]
fn stdin_is_not_watched() {
    for words in [
        &["check", "--watch", "-"][..],
        &["run", "--watch", "-"],
        &["run", "--watch", "t.scol", "--input", "ip1=-"],
    ] {
        let output = run(words);
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        assert!(
            stderr(&output).starts_with("error: cannot watch stdin; name "),
            "{words:?}"
        );
    }
}
