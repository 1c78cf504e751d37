//! `ts3100 test`: tests of SCOL programs. The keys of their files are tested in `ts3100-recording`.

use super::support::{expect_code, run, stdout};
use crate::house::root;
use serde_json::Value;
use std::process::Output;
use ts3100_recording::program_test::keys::ENDINGS;
use ts3100_tests::testing::TempDir;

const PALLET: &str = "\
GLOBAL
  COUNT = 0
END
PROGRAM PALLET
  WAIT DIN(5)
  PLACE(2, 30.5)
  PRINT IP1, \"DONE\", COUNT, CR
  DOUT(8)
END
PROGRAM PLACE(ROW, H)
  COUNT = COUNT + ROW
  MOVE P1 + POINT(0, ROW * 10, H)
END
DATA
  POINT P1=400,0,200/11111
END
";

const TESTS: &str = "\
[[test]]
name = \"places a part\"
call = \"PLACE(3, 20)\"
given.variables = { COUNT = 4, P1 = [400, 5, 200, 0, 0, 0, 0, 0, 11111] }
then.variables = { COUNT = 7 }
then.position = [400, 35, 220]

[[test]]
name = \"waits for a part\"
at = [\"1.5 s: input 5 on\"]
then.printed.ip1 = [\"DONE           2\"]
then.outputs-on = [8]
then.outputs-off = [9]
then.within = \"3 s\"
";

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn folder(tests: &str) -> (TempDir, String) {
    let directory = TempDir::new("program-tests");
    directory.file("pallet.scol", PALLET);
    let file = directory.file("pallet.test.toml", tests);
    (directory, file)
}

#[test]
fn tests_pass_and_each_has_a_line() {
    let (directory, file) = folder(TESTS);
    let program = directory.at("pallet.scol").display().to_string();
    let whole = directory.path().display().to_string();
    for path in [&file, &program, &whole] {
        let output = run(&["test", path]);
        expect_code(&output, 0);
        let text = stdout(&output);
        let lines: Vec<&str> = text.lines().collect();
        assert!(
            lines[0].starts_with("ok   ") && lines[0].contains(": places a part ("),
            "{text}"
        );
        assert!(lines[1].contains(": waits for a part ("), "{text}");
        assert!(lines[2].starts_with("2 tests: all passed, "), "{text}");
        assert_eq!(lines.len(), 3, "{text}");
    }
    let filtered = stdout(&run(&["test", &file, "--filter", "waits"]));
    assert!(filtered.contains("\n1 test: all passed, "), "{filtered}");
}

/// Every key of `then` finds what differs, at its line.
#[test]
fn a_failure_says_what_was_expected_and_found() {
    let tests = "\
[[test]]
name = \"wrong\"
given.inputs = [5]
[test.then]
printed.ip1 = [\"DONE 3\"]
outputs-on = [7]
outputs-off = [8]
variables = { COUNT = 3, CONT = 2, \"PALLET.N\" = 1 }
position = \"P1\"
within = \"1 ms\"
ending = \"alarm\"
[[test.never]]
what = \"output 8 on\"
";
    let (_directory, file) = folder(tests);
    let output = run(&["test", &file]);
    assert_eq!(output.status.code(), Some(1));
    let text = stdout(&output);
    for line in [
        "pallet.test.toml:5: PRINT to IP1, line 1: expected \"DONE 3\", found \"DONE           2\"",
        "pallet.test.toml:6: output 7: expected on, found off",
        "pallet.test.toml:7: output 8: expected off, found on",
        "pallet.test.toml:8: variable COUNT: expected 3, found 2",
        "pallet.test.toml:8: variable CONT: there is none of this name; did you mean `COUNT`?",
        "pallet.test.toml:9: position: expected P1 400.000 0.000 200.000 0.000 0.000 0.000 0.000 0.000 within 0.01, found 400.000 20.000 230.500",
        "pallet.test.toml:10: cycle time: expected at most 0.001 s, found ",
        "pallet.test.toml:11: ending: expected alarm, found end: ended",
        "pallet.test.toml:12: never output 8 on: ",
        "     printed:\n",
        "s IP1: DONE           2\n",
        " 8 | DOUT(8)\n",
        "\n1 test: 0 passed, 1 failed, ",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    let document: Value = serde_json::from_slice(&run(&["test", &file, "--json"]).stdout).unwrap();
    assert_eq!((&document["passed"], &document["failed"]), (&0.into(), &1.into()));
    let test = &document["tests"][0];
    assert_eq!((&test["name"], &test["passed"]), (&"wrong".into(), &false.into()));
    assert_eq!(test["failures"][0]["line"], 5);
    assert_eq!(test["printed"][0]["channel"], "IP1");
    assert_eq!(test["lastStatements"].as_array().unwrap().len(), 5);
}

/// The step, the end of the program and the remedy are named.
#[test]
fn a_step_that_never_happens_fails_the_test() {
    let tests = "\
[[test]]
name = \"too late\"
given.inputs = [5]
at = [\"1 ms: input 6 on\",
  \"60 s: input 7 on\"]

[[test.do]]
when = \"output 9 on\"
actions = [\"input 7 on\"]

[[test.do]]
when = \"output 8 on\"
after = \"5 s\"
actions = [\"input 7 on\"]

[[test.do]]
when = \"output 9 on\"
times = 0
actions = [\"input 7 on\"]

[[test.never]]
what = \"output 8 on\"
after = \"output 9 on\"
";
    let (_directory, file) = folder(tests);
    let output = run(&["test", &file]);
    expect_code(&output, 1);
    let text = stdout(&output);
    let end = text.split(" (").nth(1).unwrap().split(" s)").next().unwrap();
    for line in [
        format!(
            "pallet.test.toml:5: do at 60 s: `input 7 on` was not done: the run ended after {end} s, before its time; choose an earlier time, or remove the step\n"
        ),
        format!(
            "pallet.test.toml:7: do when output 9 on: `input 7 on` was not done: its condition never happened; the run ended after {end} s; correct the step or remove it, or write `times = 0` if it need not happen\n"
        ),
        format!(
            "pallet.test.toml:11: do when output 8 on: `input 7 on` was not done: the run ended after {end} s, before the 5 s after its condition had passed; correct the step"
        ),
        format!(
            "pallet.test.toml:21: never output 8 on: nothing was checked: it begins after `output 9 on`, which never happened; the run ended after {end} s; correct `after`, or remove the entry\n"
        ),
    ] {
        assert!(text.contains(&line), "{line}\n{text}");
    }
    assert_eq!(text.matches("pallet.test.toml:").count(), 5, "{text}");
}

/// A failure is said of the line of its key, not of its test.
#[test]
fn a_failure_points_at_its_key() {
    let tests = "\
[[test]]
name = \"wrong\"
given.inputs = [5]
at = [\"1 ms: input 6 on\",
  \"2 ms: variable NONE 3\"]
[test.given.variables]
COUNT = 1
CONT = 2
[[test.do]]
at = \"3 ms\"
actions = [
  \"input 7 on\",
  \"file erase NONE\",
]

[[test]]
name = \"waits\"
call = \"READS()\"
given.records.ip1 = []

[[test]]
name = \"long\"
call = \"LASTS()\"
limit = \"1 s\"

[[test]]
name = \"does not start\"
at = [
  \"0 s: emergency-stop press\",
  \"1 s: input 5 on\",
]
";
    let (directory, file) = folder(tests);
    let reads = "PROGRAM READS\nINPUT IP1, N\nEND\nPROGRAM LASTS\nDELAY 5\nEND\nDATA\n";
    directory.file("pallet.scol", PALLET.replace("DATA\n", reads));
    let text = stdout(&run(&["test", &file]));
    for line in [
        "pallet.test.toml:5: at 0.002 s: ",
        "pallet.test.toml:8: at 0.000 s: ",
        "pallet.test.toml:13: at 0.003 s: ",
        "pallet.test.toml:19: ending: expected end, found",
        "pallet.test.toml:24: ending: expected end, found",
        "pallet.test.toml:29: cannot start the program: the emergency stop is pressed\n",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    assert_eq!(text.matches("pallet.test.toml:").count(), 10, "{text}");
}

/// A key of the whole file that is wrong is named with its line.
#[test]
fn a_file_that_cannot_be_tested_names_its_key() {
    let test = "[[test]]\nname = \"x\"\n";
    for (keys, place) in [
        ("\nprogram = \"none.scol\"\n", ":2:11: cannot read the program "),
        ("", ":1:1: cannot read the program "),
        ("program = \"pallet.scol\"\nmodel = \"none\"\n", ":2:9: "),
        (
            "program = \"pallet.scol\"\noptions = [\"io.field_bus=present\",\n\"nothing=1\"]\n",
            ":3:1: ",
        ),
        ("program = \"pallet.scol\"\npoints = \"none.csv\"\n", ":2:10: "),
    ] {
        let directory = TempDir::new("program-tests");
        directory.file("pallet.scol", PALLET);
        let file = directory.file("other.test.toml", format!("{keys}{test}"));
        let output = run(&["test", &file]);
        expect_code(&output, 2);
        let text = stderr(&output);
        assert!(
            text.contains(&format!("other.test.toml{place}")),
            "{place}\n{text}"
        );
    }
}

/// The arm begins where the test says, within the limits of its model.
#[test]
fn the_arm_is_placed_before_the_start() {
    let test = |name: &str, more: &str| format!("[[test]]\nname = \"{name}\"\ncall = \"LOOK()\"\n{more}\n");
    let tests = test("ready", "then.position = [408.509, 0]")
        + &test(
            "first coordinates",
            "given.position = [400, 30]\nthen.position = [400, 30]",
        )
        + &test("a point", "given.position = \"P1\"\nthen.position = \"P1\"")
        + &test(
            "a given point",
            "given.position = \"P1\"\ngiven.variables.P1 = [350, 10, 200, 0, 0, 0, 0, 0, 0]\nthen.position = [350, 10, 200, 0, 0, 0]",
        );
    let look = "PROGRAM LOOK\nDELAY 0.1\nEND\nDATA\n";
    let (directory, file) = folder(&tests);
    directory.file("pallet.scol", PALLET.replace("DATA\n", look));
    let output = run(&["test", &file]);
    assert_eq!(output.status.code(), Some(0), "{}", stdout(&output));
    let tests = test("far", "given.position = [4000, 0, 200]")
        + &test("many", "given.position = [1, 2, 3, 4, 5, 6, 7, 8, 9]")
        + &test("unknown", "given.position = \"P2\"")
        + &test("no point", "given.position = \"COUNT\"");
    directory.file("pallet.test.toml", &tests);
    let output = run(&["test", &file]);
    expect_code(&output, 1);
    let text = stdout(&output);
    for line in [
        "pallet.test.toml:4: cannot place the arm: reach: expected ",
        "pallet.test.toml:8: position: expected at most 8 coordinates, found 9\n",
        "pallet.test.toml:12: position P2: there is none of this name\n",
        "pallet.test.toml:16: position: COUNT is not a point\n",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
}

/// A word of an ending is explained where it is met, with what to do, and on the page.
#[test]
fn an_ending_explains_itself() {
    let ending =
        |call: &str, more: &str| format!("[[test]]\nname = \"{call}{more}\"\ncall = \"{call}()\"\n{more}\n");
    let tests = ending("READS", "given.records.ip1 = []")
        + &ending("READS", "")
        + &ending("WAITS", "")
        + &ending("LASTS", "limit = '1 s'");
    let (directory, file) = folder(&tests);
    let programs = "PROGRAM READS\nINPUT IP1, N\nEND\nPROGRAM LASTS\nDELAY 5\nEND\nPROGRAM WAITS\nWAIT DIN(3)\nEND\nDATA\n";
    directory.file("pallet.scol", PALLET.replace("DATA\n", programs));
    let text = stdout(&run(&["test", &file]));
    let expected = [
        "out-of-input: INPUT at line 15 waits: all records of IP1 are used; add a record for it to `given.records.ip1`",
        "no-input: INPUT IP1 at line 15 waits; give it records with `given.records.ip1`",
        "stuck: line 21 waits for a condition that can no longer become true; change an input with `given.inputs` or `at`, or a variable with `given.variables`",
        "time-up: stopped at line 18 when its time was up; give it more with `limit`",
    ];
    for line in expected {
        let word = line.split(':').next().unwrap();
        let line =
            format!("ending: expected end, found {line}, or expect it with `then.ending = \"{word}\"`\n");
        assert!(text.contains(&line), "{line}\n{text}");
    }
    let page = std::fs::read_to_string(root().join("docs/reference/scol/test.md")).unwrap();
    for word in ENDINGS {
        assert!(page.contains(&format!("\n| `{word}` | ")), "{word}");
    }
}

#[test]
fn records_that_no_input_has_read_fail_the_test() {
    let tests = "[[test]]\nname = \"reads\"\ncall = \"READS()\"\ngiven.records.ip1 = [\"1\", \"2\", \"3\"]\n";
    let (directory, file) = folder(tests);
    let program = "PROGRAM READS\nINPUT IP1, N\nEND\nDATA\n";
    directory.file("pallet.scol", PALLET.replace("DATA\n", program));
    let text = stdout(&run(&["test", &file]));
    let reason = ":4: records of IP1: 2 of 3 were not read; remove what the program has no INPUT for\n";
    assert!(text.contains(reason), "{text}");
}

#[test]
fn a_program_that_prints_more_than_a_test_compares_fails_it() {
    let test = |name: &str, count: u32, expected: &str| {
        format!("[[test]]\nname = \"{name}\"\ncall = \"TALK({count})\"\nthen.printed.ip1 = [{expected}]\n")
    };
    let (directory, file) = folder(&(test("much", 10_001, "") + &test("enough", 10_000, "")));
    let program = "PROGRAM TALK(N)\nFOR I = 1 TO N\nPRINT \"X\", CR\nNEXT I\nEND\nDATA\n";
    directory.file("pallet.scol", PALLET.replace("DATA\n", program));
    let text = stdout(&run(&["test", &file]));
    let reason =
        ":4: PRINT to IP1: the program printed more than 10000 lines, the most that a test compares\n";
    assert!(text.contains(reason), "{text}");
    assert!(text.contains("2 tests: 1 passed, 1 failed"), "{text}");
}

#[test]
fn a_program_and_its_tests_are_named_together() {
    let (_directory, file) = folder("[[test]]\nname = \"home\"\n");
    let program = file.replace(".test.toml", ".scol");
    let text = stdout(&run(&["test", &file, &program]));
    assert!(text.contains("1 test: "), "{text}");
}

#[test]
fn a_report_replaces_neither_a_program_nor_its_tests() {
    let (_directory, file) = folder("[[test]]\nname = \"home\"\n");
    for report in [file.clone(), file.replace(".test.toml", ".scol")] {
        let refused = run(&["test", &file, "--junit", &report]);
        assert_eq!(refused.status.code(), Some(2));
        assert!(
            stderr(&refused).contains("would replace a program or its tests"),
            "{}",
            stderr(&refused)
        );
    }
}

#[test]
fn an_alarm_is_expected_by_its_number() {
    let number = |name: &str, call: &str, alarm: &str| {
        format!("[[test]]\nname = \"{name}\"\ncall = \"{call}\"\nthen.alarm = \"{alarm}\"\n")
    };
    let tests = number("far", "PLACE(900, 0)", "2-046") + &number("near", "PLACE(0, 0)", "2-046");
    let (_directory, file) = folder(&tests);
    let text = stdout(&run(&["test", &file]));
    assert!(
        text.contains("pallet.test.toml:8: alarm: expected 2-046, found end: ended\n"),
        "{text}"
    );
    // The alarm of the first names its line of the program.
    let other = tests.replace("2-046", "2-101");
    let (_directory, file) = folder(&other);
    let text = stdout(&run(&["test", &file]));
    assert!(text.contains("alarm: expected 2-101, found: alarm "), "{text}");
    assert!(text.contains("line 12: "), "{text}");
}

#[test]
fn what_cannot_be_tested_is_an_error_with_its_place() {
    let entry = |line: &str| format!("[[test]]\nname = \"x\"\n{line}\n");
    for (tests, place) in [
        (
            entry("call = \"PLCE(1, 2)\""),
            ":3:8: this file has no program PLCE; did you mean PLACE?",
        ),
        (
            entry("given.inputs = [5, 8, 5]"),
            ":3:23: expected each input once, found 5 again",
        ),
        (
            entry("call = \"PLACE(1)\""),
            ":3:8: PLACE takes 2 arguments, found 1",
        ),
        (
            entry("call = \"DELAY 1\""),
            ":3:8: expected a call such as PLACE(2, 30.5), found another statement",
        ),
        (
            entry("given.recods.ip1 = []"),
            ":3:7: unknown key `recods` in [test.given]; did you mean `records`?",
        ),
        (
            entry("at = [\"1 s: imput 3 on\"]"),
            ":3:7: unknown action `imput 3 on`; did you mean `input`?",
        ),
        (
            entry("then.alarm = \"2-999\""),
            ":3:14: expected the number of an alarm of the controller",
        ),
        (entry("") + &entry(""), ":5:8: the test `x` appears twice"),
    ] {
        let (_directory, file) = folder(&tests);
        let output = run(&["test", &file]);
        assert_eq!(output.status.code(), Some(2), "{tests}");
        let text = stderr(&output);
        assert!(
            text.starts_with("error: ") && text.contains(&format!("pallet.test.toml{place}")),
            "{text}"
        );
    }
    let (directory, file) = folder(TESTS);
    assert_eq!(
        run(&["test", &file, "--filter", "nothing"]).status.code(),
        Some(2)
    );
    directory.file("pallet.scol", "PROGRAM M\nMOVEE P\nEND\n");
    let output = run(&["test", &file]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("pallet.scol:2:1: error["),
        "{}",
        stderr(&output)
    );
    let other = directory.file("other.scol", PALLET);
    let output = run(&["test", &other]);
    assert!(
        stderr(&output).contains("other.test.toml is missing"),
        "{}",
        stderr(&output)
    );
}

/// A file that is wrong does not hide the results of the others.
#[test]
fn junit_has_passed_failed_and_untested() {
    let (directory, _) = folder(TESTS);
    directory.file("b.scol", PALLET);
    directory.file(
        "b.test.toml",
        "[[test]]\nname = \"fails <here>\"\ngiven.inputs = [5]\nthen.outputs-on = [9]\n",
    );
    directory.file("c.test.toml", "[[test]]\nnam = \"x\"\n");
    let report = directory.at("results.xml").display().to_string();
    let output = run(&[
        "test",
        &directory.path().display().to_string(),
        "--junit",
        &report,
    ]);
    assert_eq!(output.status.code(), Some(2));
    let xml = std::fs::read_to_string(report).unwrap();
    assert!(
        xml.contains("<testsuite name=\"ts3100 test\" tests=\"4\" skipped=\"0\" errors=\"1\" failures=\"1\""),
        "{xml}"
    );
    assert!(xml.contains("name=\"fails &lt;here&gt;\""), "{xml}");
    assert!(xml.contains("output 9: expected on, found off"), "{xml}");
    assert!(xml.contains("unknown key `nam`"), "{xml}");
    assert!(
        xml.contains("c.test.toml\"") && xml.contains("name=\"the file\""),
        "{xml}"
    );
}

/// Whatever is wrong with a file, a report has it: CI would show no tests otherwise.
#[test]
fn junit_has_an_error_for_all_that_cannot_be_tested() {
    let (directory, _) = folder(&TESTS.replace("PLACE(3, 20)", "PLCE(3, 20)"));
    let broken = "[[test]]\nname = \"x\"\n";
    directory.file("bad.scol", "PROGRAM M\nMOVEE P\nEND\n");
    directory.file("bad.test.toml", broken);
    directory.file("latin.test.toml", b"[[test]]\nname = \"\xe9\"\n");
    directory.file("gone.test.toml", broken);
    directory.file("alone.scol", PALLET);
    let (empty, report) = (TempDir::new("no-tests"), directory.at("results.xml"));
    let at = |name: &str| directory.at(name).display().to_string();
    for (path, case, reason) in [
        (at("pallet.test.toml"), "places a part", "has no program PLCE"),
        (at("bad.test.toml"), "the file", "bad.scol has errors"),
        (at("latin.test.toml"), "the file", "latin.test.toml"),
        (at("gone.test.toml"), "the file", "cannot read the program"),
        (at("missing.test.toml"), "the file", "missing.test.toml"),
        (at("alone.scol"), "the file", "alone.test.toml is missing"),
        (
            empty.path().display().to_string(),
            "the file",
            "no files of tests",
        ),
    ] {
        let output = run(&["test", &path, "--junit", report.to_str().unwrap()]);
        expect_code(&output, 2);
        let xml = std::fs::read_to_string(&report).unwrap();
        std::fs::remove_file(&report).unwrap();
        assert!(xml.contains("errors=\"1\""), "{path}\n{xml}");
        assert!(
            xml.contains(&format!("name=\"{case}\" classname=\"{path}\"")),
            "{path}\n{xml}"
        );
        assert!(
            xml.contains("<error message=") && xml.contains(reason),
            "{path}\n{xml}"
        );
        // The other test of the file has run.
        let passed = usize::from(path.ends_with("pallet.test.toml"));
        assert!(
            xml.contains(&format!("tests=\"{}\"", 1 + passed)),
            "{path}\n{xml}"
        );
    }
}
