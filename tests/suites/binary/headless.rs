//! `ts3100 run`: programs from a shell, without sockets.

use super::support::{expect_code, run, stdout};
use serde_json::Value;
use std::process::Output;
use ts3100_tests::testing::TempDir;

const PICK: &str = "\
PROGRAM PICK
  N = 0
  X = 0.0
LOOP:
  PRINT IP1, \"REQ\", CR
  INPUT IP1, N, X
  IF N == 9 THEN GOTO LEAVE
  MOVES HOME + POINT(X) WITH SPEED=50
  WAIT MOTION >= 100
  DELAY 0.25
  DOUT(1, 5)
  PRINT IP1, \"DONE\", N, CR
  GOTO LOOP
LEAVE:
  MOVE HOME
  DOUT(-1)
END
DATA
  POINT HOME=400,0,200/11111
END
";

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_dialogue_runs_from_records() {
    let directory = TempDir::new("binary");
    let file = directory.file("pick.scol", PICK);
    let records = format!(
        "ip1={}",
        directory.file("in.txt", "1,10.0\r\n2,-20.5\n9,0\n7,7\n")
    );
    let output = run(&["run", &file, "--input", &records]);
    expect_code(&output, 0);
    assert_eq!(
        stdout(&output),
        "REQ\nDONE           1\nREQ\nDONE           2\nREQ\n"
    );
    let printed = stderr(&output);
    assert!(printed.contains(" s: ended\n"), "{printed}");
    assert!(
        printed.contains("position X 400.000 Y 0.000 Z 200.000"),
        "{printed}"
    );
    assert!(printed.contains("outputs on: 5\n"), "{printed}");
    assert!(printed.contains("IP1: 1 records unused"), "{printed}");

    let found = json(&run(&["run", &file, "--input", &records, "--json"]));
    assert_eq!(found["ending"], "end");
    assert_eq!(found["outputs"], serde_json::json!([5]));
    assert_eq!(found["printed"][1]["text"], "DONE           1");
    assert!(found["seconds"].as_f64().unwrap() > 0.5);
    // A trace shows the same run.
    let traced = json(&run(&["run", &file, "--input", &records, "--json", "--trace"]));
    assert_eq!(
        (&traced["seconds"], &traced["printed"]),
        (&found["seconds"], &found["printed"])
    );
    let first = &traced["trace"][0];
    assert_eq!(
        (&first["line"], &first["text"]),
        (&Value::from(2), &Value::from("N = 0"))
    );
    let delayed = traced["trace"].as_array().unwrap();
    let at = |text: &str| {
        delayed.iter().find(|s| s["text"] == text).unwrap()["time"]
            .as_f64()
            .unwrap()
    };
    let dwell = at("DOUT(1, 5)") - at("DELAY 0.25");
    assert!((dwell - 0.25).abs() < 1e-6, "{dwell}");
}

#[test]
fn a_trace_names_a_statement_once_however_long_it_waits_for_the_arm() {
    let directory = TempDir::new("binary");
    let program = "PROGRAM M\nENABLE NOWAIT\nON MOTION > 50 DO DOUT(1)\nMOVEA 1, 30\nMOVEA 1, 0\nDELAY 0.1\nMOVEA 1, 30\nEND\n";
    let file = directory.file("once.scol", program);
    let traced = json(&run(&["run", &file, "--json", "--trace"]));
    let lines = traced["trace"].as_array().unwrap().iter();
    let lines: Vec<u64> = lines.map(|entry| entry["line"].as_u64().unwrap()).collect();
    // The action on line 3 comes while the motion of line 5, tried at once, waits for that of
    // line 4; DELAY and END wait for theirs.
    assert_eq!(lines, [2, 3, 4, 5, 3, 6, 7, 8]);
}

#[test]
fn a_trace_names_the_task_of_each_statement() {
    let directory = TempDir::new("binary");
    let source = "PROGRAM M\nI = TASK(\"SIDE\")\nDELAY 1\nEND\nPROGRAM SIDE\nDELAY 0.5\nEND\n";
    let file = directory.file("tasks.scol", source);
    let traced = json(&run(&["run", &file, "--json", "--trace"]));
    let tasks = |line: u64| {
        let found = traced["trace"].as_array().unwrap().iter();
        let found: Vec<Value> = found
            .filter(|s| s["line"] == line)
            .map(|s| s["task"].clone())
            .collect();
        found
    };
    assert_eq!((tasks(3), tasks(6)), (vec![Value::from(1)], vec![Value::from(2)]));
    let printed = stderr(&run(&["run", &file, "--trace"]));
    assert!(
        printed.contains(" s task 2   SIDE     6 | DELAY 0.5\n"),
        "{printed}"
    );
    // A program without tasks needs no column for them.
    let alone = directory.file("alone.scol", "PROGRAM M\nDELAY 1\nEND\n");
    let printed = stderr(&run(&["run", &alone, "--trace"]));
    assert!(printed.contains(" s     2 | DELAY 1\n"), "{printed}");
}

#[test]
fn an_input_without_a_record_fails_unless_records_are_optional() {
    let directory = TempDir::new("binary");
    let file = directory.file("pick.scol", PICK);
    let records = format!("ip1={}", directory.file("in.txt", "1,10.0\n"));
    let output = run(&["run", &file, "--input", &records]);
    assert_eq!(output.status.code(), Some(1));
    for flags in [&["--input", &records][..], &[]] {
        let all: Vec<&str> = ["run", &file, "--input-optional"]
            .iter()
            .chain(flags)
            .copied()
            .collect();
        expect_code(&run(&all), 0);
    }
    assert!(
        stderr(&output).contains("all records of IP1 are used"),
        "{}",
        stderr(&output)
    );
    let output = run(&["run", &file]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("--input ip1=FILE"),
        "{}",
        stderr(&output)
    );
    let output = run(&["run", &file, "--input", &records, "--din", "3,65"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("--din 65: expected input lines"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn channels_are_named_when_there_are_several() {
    let directory = TempDir::new("binary");
    let file = directory.file(
        "p.scol",
        "PROGRAM P\nPRINT \"A\", CR\nPRINT COM1, \"B\"\nPRINT COM1, \"C\", CR\nINPUT N\nPRINT IP2, N, CR\nSTOP\nEND\n",
    );
    let keys = format!("tp={}", directory.file("keys.txt", "42\n"));
    let output = run(&["run", &file, "--input", &keys]);
    expect_code(&output, 0);
    assert_eq!(stdout(&output), "TP: A\nCOM1: BC\nIP2:           42\n");
    assert!(
        stderr(&output).contains("stopped, line 8 is next"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn alarms_endless_runs_and_dead_waits_are_exit_code_one() {
    let directory = TempDir::new("binary");
    let file = directory.file("a.scol", "PROGRAM A\nN = 0\nM = 1 / N\nEND\n");
    let output = run(&["run", &file]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("alarm 2-1"), "{}", stderr(&output));
    let file = directory.file("e.scol", "PROGRAM A\nL: N = 1\nGOTO L\nEND\n");
    let output = run(&["run", &file, "--max-time", "5"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("after 5.000 s: stopped at line"),
        "{}",
        stderr(&output)
    );
    let file = directory.file("w.scol", "PROGRAM A\nWAIT DIN(3)\nEND\n");
    assert_eq!(run(&["run", &file]).status.code(), Some(1));
    assert_eq!(run(&["run", &file, "--din", "3,4"]).status.code(), Some(0));
}

#[test]
fn inputs_come_at_their_times() {
    let directory = TempDir::new("binary");
    let text = "PROGRAM W\nON DIN(9) DO PRINT \"SEEN\", CR\nWAIT DIN(3)\nDOUT(5)\nWAIT DIN(-3)\nEND\n";
    let file = directory.file("w.scol", text);
    let on = "1.5 s: input 3 on";
    let output = run(&[
        "run",
        &file,
        "--at",
        "500ms: input 9 on",
        "--at",
        on,
        "--at",
        "2s:input 3 off",
    ]);
    expect_code(&output, 0);
    assert_eq!(stdout(&output), "SEEN\n");
    assert!(
        stderr(&output).contains("after 2.000 s: ended"),
        "{}",
        stderr(&output)
    );
    let output = run(&["run", &file, "--at", on]);
    assert_eq!(output.status.code(), Some(1), "nothing turns it off");
    // What comes after a stop can continue the program.
    let stops = [
        "100 ms: emergency-stop press",
        "1 s: emergency-stop release",
        "1 s: alarms reset",
    ];
    let goes_on = ["1.1 s: servo on", "1.2 s: program start", on, "2 s: input 3 off"];
    let at = |words: &[&'static str]| -> Vec<&'static str> {
        words.iter().flat_map(|words| ["--at", *words]).collect()
    };
    let with = |words: &[&'static str]| run(&[&["run", &file][..], &at(words)].concat());
    let output = with(&stops);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("after 1.000 s: alarm 8-014"),
        "{}",
        stderr(&output)
    );
    expect_code(&with(&[&stops[..], &goes_on].concat()), 0);
    // A reset from a stop is not the end: the next start counts.
    let again = [
        "1 s: program stop",
        "2 s: program reset",
        "3 s: program start",
        "4 s: input 3 on",
        "5 s: input 3 off",
    ];
    let output = with(&again);
    expect_code(&output, 0);
    assert!(
        stderr(&output).contains("after 5.000 s: ended"),
        "{}",
        stderr(&output)
    );
    let output = with(&again[..2]);
    assert!(
        stderr(&output).contains("after 2.000 s: stopped, line 2 is next"),
        "{}",
        stderr(&output)
    );
    // What is planned for the start comes before it.
    let output = with(&["0 s: emergency-stop press"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).starts_with("error: cannot start the program: "),
        "{}",
        stderr(&output)
    );
    let output = with(&["1 s: power off"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("the power was turned off"),
        "{}",
        stderr(&output)
    );
    // What has no effect is said, by hand and by the owner.
    for refused in [
        "0 s: jog 1 plus joint fast",
        "1 s: jog 1 plus joint fast",
        "1 s: variable NOPE 5",
    ] {
        let output = with(&[refused, on, "2 s: input 3 off"]);
        expect_code(&output, 0);
        assert!(
            stderr(&output).contains(" s: cannot "),
            "{refused}: {}",
            stderr(&output)
        );
    }
    let many = vec!["1 s: input 9 on"; 1_001];
    let output = with(&many);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("at most 1000 steps, found 1001"),
        "{}",
        stderr(&output)
    );
    for (words, answer) in [
        (
            "input 3 on",
            "expected a time, a colon and an action, as in `1.5 s: input 8 on`",
        ),
        ("1.5: input 3 on", "expected"),
        ("1 s: input 65 on", "expected line 1-64"),
        ("1 s: imput 3 on", "did you mean `input`?"),
    ] {
        let output = run(&["run", &file, "--at", words]);
        assert_eq!(output.status.code(), Some(2), "{words}");
        let printed = stderr(&output);
        assert!(printed.contains(answer) && printed.contains(words), "{printed}");
    }
}

#[test]
fn a_scenario_says_what_the_program_has_to_do() {
    let directory = TempDir::new("binary");
    let file = directory.file("w.scol", "PROGRAM W\nWAIT DIN(3)\nDELAY 2\nDOUT(5)\nEND\n");
    let scenario = |within: &str| {
        let text = format!(
            "[start]\ninputs = [4]\nselect = \"w\"\n[[do]]\nat = \"1 s\"\nactions = [\"input 3 on\"]\n\
             [[expect]]\nwhat = \"output 5 on\"\nwithin = \"{within}\"\n"
        );
        directory.file("w.toml", &text)
    };
    expect_code(&run(&["run", &file, "--scenario", &scenario("3.1 s")]), 0);
    let output = run(&["run", &file, "--scenario", &scenario("2 s")]);
    assert_eq!(output.status.code(), Some(1));
    let printed = stderr(&output);
    assert!(
        printed.contains("scenario: line 7, expect output 5 on: expected within 2 s"),
        "{printed}"
    );
    let found = json(&run(&["run", &file, "--scenario", &scenario("2 s"), "--json"]));
    assert_eq!(found["ending"], "end");
    assert_eq!(found["scenarioFailures"].as_array().unwrap().len(), 1);
    for start in [
        "restore = \"s.snap\"",
        "load = [\"w.scol\"]",
        "select = \"OTHER\"",
    ] {
        let path = directory.file("s.toml", format!("[start]\n{start}\n"));
        let output = run(&["run", &file, "--scenario", &path]);
        assert_eq!(output.status.code(), Some(2), "{start}");
        assert!(
            stderr(&output).contains("use `ts3100 exec`"),
            "{}",
            stderr(&output)
        );
    }
}

#[test]
fn wrong_usage_and_programs_with_errors_are_exit_code_two() {
    let directory = TempDir::new("binary");
    let file = directory.file("a.scol", "PROGRAM A\nMOV X\nEND\n");
    let output = run(&["run", &file]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("did you mean MOVE?"),
        "{}",
        stderr(&output)
    );
    let file = directory.file("b.scol", "PROGRAM A\nEND\n");
    for words in [
        &["--input", "ip0=x"][..],
        &["--input", "ip1=/nowhere/at/all"],
        &["--model", "nope"],
        &["--set", "nope=1"],
        &["--time", "stepped"],
        &["--max-time", "-1"],
    ] {
        let all: Vec<&str> = ["run", &file].iter().chain(words).copied().collect();
        let output = run(&all);
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        let printed = stderr(&output);
        assert!(!printed.contains("error: error"), "{printed}");
    }
    let options = run(&["run", &file, "--set", "help"]);
    expect_code(&options, 0);
    assert!(stdout(&options).contains("text.stx"), "{}", stdout(&options));
    assert_eq!(run(&["run", &file]).status.code(), Some(0));
}

#[test]
fn points_come_from_a_table_for_check_and_run() {
    let directory = TempDir::new("binary");
    let file = directory.file("pick.scol", "PROGRAM PICK\nMOVE T1\nPRINT T1.X, CR\nEND\n");
    let table = "NAME,X,Y,Z,C,T,CONFIG\nT1,250,100,20,30,0,LEFTY\n";
    let points = directory.file("taught.csv", table);
    let scara = ["--model", "tsl3000-thl400"];
    for verb in ["check", "run"] {
        let output = run(&[verb, &file, scara[0], scara[1], "--points", &points]);
        expect_code(&output, 0);
        if verb == "run" {
            let printed = stderr(&output);
            assert!(printed.contains(", configuration LEFTY\n"), "{printed}");
            let found = json(&run(&[
                "run", &file, scara[0], scara[1], "--points", &points, "--json",
            ]));
            assert_eq!(found["configuration"], "LEFTY");
        }
        let output = run(&[verb, &file, scara[0], scara[1]]);
        assert_ne!(output.status.code(), Some(0), "{verb}");
        let printed = stdout(&output) + &stderr(&output);
        assert!(
            printed.contains("no value for T1: add it to DATA or to the taught points"),
            "{printed}"
        );
        let bad = directory.file("bad.csv", "NAME,X,Y,Z,C,T,CONFIG\nT1,250,1oo,20,30,0,LEFTY\n");
        let output = run(&[verb, &file, scara[0], scara[1], "--points", &bad]);
        assert_eq!(output.status.code(), Some(2), "{verb}");
        let printed = stderr(&output);
        assert!(
            printed.contains("bad.csv:2:8: expected a number, found `1oo`"),
            "{printed}"
        );
        let output = run(&[verb, &file, "--points", &points]);
        assert_eq!(output.status.code(), Some(2), "the table is not one of six axes");
    }
    // The file of this name beside the program needs no flag.
    directory.file("points.csv", table);
    for verb in ["check", "run"] {
        expect_code(&run(&[verb, &file, scara[0], scara[1]]), 0);
    }
}

const CYCLE: &str = "\
GLOBAL
  DIM A(3) AS REAL
  COUNT = 0
END
PROGRAM CYCLE
  ON DIN(4) DO DOUT(7)
  INPUT IP1, N, A(2)
  PLACE(N, 30.5)
  IF COUNT > 1 THEN DOUT(5) ELSE DOUT(6)
  T = TASK(\"SIDE\")
  DELAY 2
  MOVEA 1, 10
END
PROGRAM PLACE(ROW, H)
  COUNT = COUNT + 1
  MOVE P1 + POINT(0, ROW * 10, H)
END
PROGRAM SIDE
  WAIT DIN(9)
END
DATA
  POINT P1=400,0,200/11111
END
";

#[test]
fn a_trace_tells_what_each_statement_does() {
    let directory = TempDir::new("binary");
    let file = directory.file("cycle.scol", CYCLE);
    let records = format!("ip1={}", directory.file("in.txt", "3,1.5\n"));
    let words = [
        "run",
        &file,
        "--input",
        &records,
        "--at",
        "0.1 s: input 4 on",
        "--trace",
    ];
    let printed = stderr(&run(&words));
    for line in [
        " task 1   CYCLE     6 | ON DIN(4) DO DOUT(7)\n",
        " task 1   CYCLE     7 | INPUT IP1, N, A(2)\n                                  |   -> N = 3, A(2) = 1.5\n",
        " task 1   CYCLE     8 | PLACE(N, 30.5)  -> ROW = 3, H = 30.5\n",
        " task 1   PLACE    15 | COUNT = COUNT + 1  -> COUNT = 1\n",
        " task 1   PLACE    16 | MOVE P1 + POINT(0, ROW * 10, H)  -> to 400.0 30.0 230.5 0.0 0.0 0.0 0.0 0.0 11111\n",
        "     0.100 s task 1   CYCLE     6 | ON DIN(4) DO DOUT(7)  -> monitor acts\n",
        " task 1   CYCLE     9 | IF COUNT > 1 THEN DOUT(5) ELSE DOUT(6)  -> else\n",
        "                                  |   -> T = 2\n",
        " task 1   CYCLE    12 | MOVEA 1, 10  -> axis 1 to 10.0\n",
    ] {
        assert!(printed.contains(line), "{line}{printed}");
    }
    let words: Vec<&str> = words.into_iter().chain(["--json"]).collect();
    let document = json(&run(&words));
    let entries: Vec<&Value> = document["trace"].as_array().unwrap().iter().collect();
    let entry = |line: u64| *entries.iter().find(|entry| entry["line"] == line).unwrap();
    let assigned = |name: &str, value: Value| serde_json::json!({ "name": name, "value": value });
    assert_eq!(
        entry(7)["assigned"],
        serde_json::json!([assigned("N", 3.into()), assigned("A(2)", 1.5.into())])
    );
    assert_eq!(entry(8)["program"], "CYCLE");
    assert_eq!(entry(15)["program"], "PLACE");
    assert_eq!(entry(9)["branch"], "else");
    assert_eq!(
        entry(16)["target"],
        serde_json::json!({ "position": [400.0, 30.0, 230.5, 0.0, 0.0, 0.0, 0.0, 0.0, 11111] })
    );
    assert_eq!(entry(12)["target"], serde_json::json!({ "axis": 1, "to": 10.0 }));
    let acts: Vec<&Value> = entries
        .iter()
        .filter(|entry| entry["line"] == 6)
        .map(|entry| &entry["monitor"])
        .collect();
    assert_eq!(acts, [&Value::Null, &Value::Bool(true)]);
}

#[test]
fn a_profile_says_where_the_cycle_goes() {
    let directory = TempDir::new("binary");
    let file = directory.file("cycle.scol", CYCLE);
    let records = format!("ip1={}", directory.file("in.txt", "3,1.5\n"));
    let words = ["run", &file, "--input", &records, "--profile"];
    let printed = stderr(&run(&words));
    assert!(printed.contains("\ntime of task 1: "), "{printed}");
    assert!(printed.contains(" %        1     11 | DELAY 2\n"), "{printed}");
    let words: Vec<&str> = words.into_iter().chain(["--json"]).collect();
    let document = json(&run(&words));
    let tasks = document["profile"]["tasks"].as_array().unwrap();
    let main = &tasks[0];
    let seconds = document["seconds"].as_f64().unwrap();
    assert!(
        (main["seconds"].as_f64().unwrap() - seconds).abs() < 1e-9,
        "{main}"
    );
    let first = &main["statements"][0];
    assert_eq!(
        (
            &first["line"],
            &first["program"],
            &first["times"],
            &first["seconds"]
        ),
        (&11.into(), &"CYCLE".into(), &1.into(), &2.0.into())
    );
    assert_eq!(main["statements"][1]["program"], "PLACE");
    assert_eq!(
        (&tasks[1]["task"], &tasks[1]["statements"][0]["line"]),
        (&2.into(), &19.into())
    );
    assert!(document.get("trace").is_none());
}

/// After a motion that is not waited for, the time is that of the statement that waits.
#[test]
fn time_counts_to_the_statement_that_waits() {
    let directory = TempDir::new("binary");
    let source = "PROGRAM M\nENABLE NOWAIT\nMOVEA 1, 30\nDOUT(1)\nWAIT MOTION >= 100\nEND\n";
    let file = directory.file("wait.scol", source);
    let document = json(&run(&["run", &file, "--profile", "--json"]));
    let statements = document["profile"]["tasks"][0]["statements"].as_array().unwrap();
    let seconds = |line: u64| statements.iter().find(|row| row["line"] == line).unwrap()["seconds"].as_f64();
    assert_eq!(seconds(3), Some(0.0));
    assert_eq!(seconds(5), document["seconds"].as_f64());
}

#[test]
fn a_trace_names_the_statement_after_an_if_that_waited() {
    let directory = TempDir::new("binary");
    let source = "PROGRAM M\nIF 1 == 1 THEN DELAY 1 ELSE DELAY 2\nN = 1\nEND\n";
    let file = directory.file("if.scol", source);
    let traced = json(&run(&["run", &file, "--json", "--trace"]));
    let lines = traced["trace"].as_array().unwrap().iter();
    let lines: Vec<u64> = lines.map(|entry| entry["line"].as_u64().unwrap()).collect();
    assert_eq!(lines, [2, 3, 4]);
}
