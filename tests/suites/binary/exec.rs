//! `ts3100 exec`: an emulator for the time of one command.

use super::support::{TS3100, expect_code, run, stderr, stdout, ts3100};
use std::io::{BufRead, BufReader, Read, Write};
use std::process::Stdio;
use ts3100_tests::testing::TempDir;

fn exec(words: &[&str], script: &str) -> std::process::Output {
    let script = format!("ts3100() {{ '{TS3100}' \"$@\"; }}\n{script}");
    run(&[&["exec"], words, &["--", "sh", "-c", &script]].concat())
}

#[test]
fn the_command_finds_a_robot_that_answers_and_was_not_spoken_to() {
    let directory = TempDir::new("binary");
    let coverage = directory.path().join("coverage.json");
    let transcript = directory.path().join("day.txt");
    let words = [
        "--coverage",
        coverage.to_str().unwrap(),
        "--transcript",
        transcript.to_str().unwrap(),
    ];
    let output = exec(
        &words,
        "ts3100 host $TS3100_HOST:$TS3100_IP0_PORT so && echo $TS3100_HOST $TS3100_IP3_PORT",
    );
    expect_code(&output, 0);
    assert_eq!(stderr(&output), "", "the emulator keeps quiet");
    let words = stdout(&output);
    let last = words.lines().last().unwrap();
    assert!(
        last.starts_with("127.0.0.1 ") && last.split(' ').count() == 2,
        "{words}"
    );
    let coverage = std::fs::read_to_string(coverage).unwrap();
    assert!(coverage.contains("\"SO\""), "{coverage:.300}");
    let transcript = std::fs::read_to_string(transcript).unwrap();
    assert!(transcript.contains("> IP0 SO<CR>"), "{transcript}");
    assert!(
        !transcript.contains("SU<CR>"),
        "the question whether it is there leaves no trace: {transcript}"
    );
}

#[test]
fn the_question_whether_it_is_there_wakes_no_fault_and_waits_for_no_stepped_clock() {
    let words = [
        "--fault",
        "no-reply:command=SU",
        "--vary",
        "3",
        "--time",
        "stepped",
    ];
    let output = exec(&words, "exit 7");
    expect_code(&output, 7);
    assert!(
        stderr(&output).contains("never fired: no occasion occurred"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn a_seed_that_was_drawn_is_told_though_the_log_is_quiet() {
    let words = stderr(&exec(&["--vary", "random"], "exit 0"));
    let seed = words
        .split("--vary ")
        .nth(1)
        .and_then(|rest| rest.split_whitespace().next());
    assert!(seed.is_some_and(|seed| seed.parse::<u64>().is_ok()), "{words}");
    assert_eq!(stderr(&exec(&["--vary", "5"], "exit 0")), "");
}

#[test]
fn the_exit_code_is_the_commands_and_a_bit_of_the_reports() {
    let directory = TempDir::new("binary");
    let scenario = directory.file("s.toml", "[[expect]]\nwhat = \"command SU\"\n");
    let results = directory.path().join("results.xml");
    let results = results.to_str().unwrap();
    let scenario = ["--scenario", scenario.as_str(), "--junit", results];
    let ask = "ts3100 host $TS3100_HOST:$TS3100_IP0_PORT su >/dev/null;";
    let none: [&str; 0] = [];
    for (words, script, code) in [
        (&none[..], "exit 7".to_owned(), 7),
        (&none[..], "kill -KILL $$".to_owned(), 137),
        (&scenario[..], format!("{ask} exit 7"), 7),
        (&scenario[..], format!("{ask} exit 0"), 0),
        (&scenario[..], "exit 7".to_owned(), 7 + 64),
        (&scenario[..], "exit 0".to_owned(), 64),
        (&["--min-coverage", "50"][..], "exit 1".to_owned(), 1 + 64),
    ] {
        let output = exec(words, &script);
        assert_eq!(
            output.status.code(),
            Some(code),
            "{words:?} {script}: {}",
            stderr(&output)
        );
    }
    let output = exec(&scenario, "exit 0");
    let words = stderr(&output);
    assert!(
        words.contains("expect command SU: expected once, but never happened"),
        "{words}"
    );
    let results = std::fs::read_to_string(results).unwrap();
    assert!(
        results.contains("failures=\"1\"") && results.contains("name=\"expect command SU\""),
        "{results}"
    );
}

#[test]
fn a_run_that_fails_is_kept_and_can_be_watched_at_the_moment_it_went_wrong() {
    let directory = TempDir::new("binary");
    let names = ["a.html", "it's b.jsonl", "c.txt"].map(|name| directory.path().join(name));
    let mut words = Vec::new();
    for name in &names {
        words.extend(["--trace-on-failure", name.to_str().unwrap()]);
    }
    let host = "ts3100 host $TS3100_IP0 su; ts3100 host $TS3100_IP0 sl NOFILE;";
    expect_code(&exec(&words, &format!("{host} exit 0")), 0);
    assert!(names.iter().all(|name| !name.exists()), "a run that passes");

    let output = exec(&words, &format!("{host} exit 7"));
    expect_code(&output, 7);
    let [page, records, text] = names
        .each_ref()
        .map(|name| std::fs::read_to_string(name).unwrap());
    assert!(page.trim_end().ends_with("</html>") && page.contains("NOFILE"));
    assert!(records.contains("SL,NOFILE") && text.contains("> IP0 SL,NOFILE<CR>"));
    let said = stderr(&output);
    let note = format!(
        "note: watch the failed run in a browser: {}\n",
        names[0].display()
    );
    assert!(said.contains(&note), "{said}");
    let command = said.split("note: watch the failed run: ts3100 ").nth(2).unwrap();
    let words: Vec<&str> = command.split_whitespace().collect();
    assert_eq!(
        words[..3],
        ["view", names[2].to_str().unwrap(), "--event"],
        "{said}"
    );
    assert!(said.contains(r"/it'\''s b.jsonl' --event "), "{said}");
    let list = run(&[&words[..2], &["--list", "--errors"]].concat());
    expect_code(&list, 1);
    let first = stdout(&list);
    assert_eq!(
        first.split_whitespace().nth(1),
        Some(words[3]),
        "the first NG: {first}"
    );
    expect_code(&run(&[&words[..], &["--json"]].concat()), 0);
    // By the kind of the moment the same is found, which needs no number.
    let state = |moment: &[&str]| stdout(&run(&[&words[..2], moment, &["--json"]].concat()));
    assert_eq!(state(&["--first", "ng"]), state(&["--event", words[3]]));
    let none = run(&[words[0], words[1], "--first", "no-cr", "--json"]);
    expect_code(&none, 2);
    assert!(stderr(&none).contains("--first no-cr: there is none in this run"));
}

#[test]
fn a_run_that_its_reports_fail_is_kept_and_a_trace_that_cannot_be_is_told_before_it() {
    let directory = TempDir::new("binary");
    let trace = directory.path().join("a.txt");
    let words = ["--deny", "all", "--trace-on-failure", trace.to_str().unwrap()];
    let output = exec(&words, "ts3100 host $TS3100_IP0 --no-stx su");
    assert_eq!(output.status.code(), Some(64), "{}", stderr(&output));
    assert!(stderr(&output).contains("/a.txt --event "), "{}", stderr(&output));
    for (words, code, expected) in [
        (
            &["--trace-on-failure", "a.pcapng"][..],
            125,
            "expected a name that ends in .html, .txt or .jsonl, found `a.pcapng`",
        ),
        (
            &["--trace-on-failure", "nowhere-at-all/a.html"],
            125,
            "cannot write the trace nowhere-at-all/a.html",
        ),
        (
            &["--trace-on-failure", "a.html", "--control", "off"],
            125,
            "leave out --control off",
        ),
    ] {
        let output = exec(words, "echo it ran");
        assert_eq!(output.status.code(), Some(code), "{words:?}");
        let said = stderr(&output);
        assert!(said.contains(expected) && stdout(&output).is_empty(), "{said}");
    }
}

#[test]
fn what_cannot_be_run_has_the_codes_of_shells_and_what_cannot_begin_its_own() {
    let output = run(&["exec", "--", "no-such-command-anywhere"]);
    expect_code(&output, 127);
    let directory = TempDir::new("binary");
    let file = directory.file("file", "");
    assert_eq!(run(&["exec", "--", &file]).status.code(), Some(126));
    let broken = directory.file("s.toml", "[[expect]]\nwat = 1\n");
    let output = run(&["exec", "--scenario", &broken, "--", "true"]);
    assert_eq!(output.status.code(), Some(125));
    let words = stderr(&output);
    assert!(
        words.contains("s.toml, line 2: unknown key `wat`") && words.contains("did you mean `what`?"),
        "{words}"
    );
    assert_eq!(run(&["exec"]).status.code(), Some(125), "no command");
}

#[test]
fn options_and_variables_are_as_those_of_serve() {
    let lists = [run(&["exec", "--set", "help"]), run(&["serve", "--set", "help"])];
    let [exec, serve] = lists.map(|output| (output.status.code(), output.stdout));
    assert_eq!(exec, serve);
    assert_eq!(exec.0, Some(0));
    let output = ts3100(&["exec", "--", "true"])
        .env("TS3100_PROTS", "auto")
        .output()
        .unwrap();
    let words = stderr(&output);
    assert!(
        words.contains("ignoring unknown environment variable TS3100_PROTS"),
        "{words}"
    );
}

#[test]
fn a_run_that_cannot_start_leaves_a_report_that_says_why() {
    let directory = TempDir::new("binary");
    let results = directory.path().join("results.xml");
    let results = results.to_str().unwrap();
    let scenario = directory.file("s.toml", "[[expect]]\nwhat = \"command SU\"\n");
    let broken = directory.file("broken.toml", "[[expect]]\nwat = 1\n");
    let plain = directory.file("file", "");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let busy = taken.local_addr().unwrap().port().to_string();
    let whole = ["--scenario", &scenario];
    for (words, code, says) in [
        (
            &[&whole[..], &["--", "no-such-command"]].concat()[..],
            127,
            "cannot run no-such-command: ",
        ),
        (&[&whole[..], &["--", &plain]].concat(), 126, "cannot run "),
        (
            &["--scenario", &broken, "--", "true"],
            125,
            "broken.toml, line 2: unknown key `wat`",
        ),
        (
            &["--", "true"],
            125,
            "cannot write --junit: it reports the results of a scenario; add --scenario FILE",
        ),
        (
            &[
                &whole[..],
                &["--control", &format!("127.0.0.1:{busy}"), "--", "true"],
            ]
            .concat(),
            125,
            &busy,
        ),
        (
            &[&whole[..], &["--fault", "nothing", "--", "true"]].concat(),
            125,
            "unknown kind of fault",
        ),
        (
            &["--no-such-flag", "--", "true"],
            125,
            "unexpected argument '--no-such-flag",
        ),
        (&["--config", "/nowhere.toml", "--", "true"], 125, "/nowhere.toml"),
        (&["--ports", "auto"], 125, "required"),
        (&["--set", "text.stx=required"], 125, "the command is missing"),
    ] {
        std::fs::write(results, "left by the run before").unwrap();
        let output = run(&[&["exec", "--junit", results], words].concat());
        assert_eq!(output.status.code(), Some(code), "{words:?}: {}", stderr(&output));
        let report = std::fs::read_to_string(results).unwrap().replace("&apos;", "'");
        assert!(report.contains(says), "{words:?}: {report}");
        assert!(
            report.contains(" tests=\"1\" skipped=\"0\" failures=\"0\" errors=\"1\""),
            "{report}"
        );
        let tags = |tag: &str| report.matches(tag).count();
        for tag in ["testsuites", "testsuite", "testcase", "error"] {
            assert_eq!(
                (
                    tags(&format!("<{tag} ")) + tags(&format!("<{tag}>")),
                    tags(&format!("</{tag}>"))
                ),
                (1, 1)
            );
        }
    }
}

#[test]
fn a_command_and_what_it_has_started_end_when_exec_is_killed() {
    // The inner shell waits for its stdin, which stays open here, and holds the pipe that is read to its end.
    // The answer of the emulator comes from an exec whose guard knows the command.
    let script = format!(
        "'{TS3100}' host $TS3100_HOST:$TS3100_IP0_PORT su > /dev/null && sh -c 'echo $$; read line'; echo over"
    );
    let mut child = ts3100(&["exec", "--", "sh", "-c", &script])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let stdin = child.stdin.take();
    let mut stdout = BufReader::new(child.stdout.take().unwrap());
    let mut line = String::new();
    stdout.read_line(&mut line).unwrap();
    assert!(line.trim().parse::<u32>().is_ok(), "it runs: {line}");
    child.kill().unwrap();
    child.wait().unwrap();
    let (sender, ended) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let mut rest = String::new();
        stdout.read_to_string(&mut rest).unwrap();
        sender.send(rest).unwrap();
    });
    // Reached only when something is left behind.
    let rest = ended.recv_timeout(std::time::Duration::from_secs(20));
    assert_eq!(rest.as_deref(), Ok(""), "everything has ended");
    drop(stdin);
}

#[test]
fn a_signal_is_passed_on_and_the_reports_are_written_all_the_same() {
    let directory = TempDir::new("binary");
    let state = directory.path().join("state.json");
    let script = "trap 'echo told; exit 9' TERM; echo ready; while :; do read line || exit 3; done";
    let mut child = ts3100(&[
        "exec",
        "--snapshot-on-exit",
        state.to_str().unwrap(),
        "--",
        "sh",
        "-c",
        script,
    ])
    .stdin(Stdio::piped())
    .stdout(Stdio::piped())
    .spawn()
    .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert_eq!(lines.next().unwrap().unwrap(), "ready");
    let mut stdin = child.stdin.take().unwrap();
    let kill = std::process::Command::new("kill")
        .args(["-s", "TERM", &child.id().to_string()])
        .status();
    assert!(kill.unwrap().success());
    // The shell acts on a signal when its read has ended; by then it must have been passed on, or the next ends it.
    while stdin.write_all(b"line\n").is_ok() && child.try_wait().unwrap().is_none() {}
    drop(stdin);
    assert_eq!(lines.next().unwrap().unwrap(), "told");
    assert_eq!(child.wait().unwrap().code(), Some(9));
    assert!(state.exists());
}

#[test]
fn the_command_gets_addresses_and_an_emulator_inside_ignores_them_without_a_warning() {
    let words = ["--serial-host-tcp", "127.0.0.1:0"];
    let script = "
        ts3100 host $TS3100_IP0 su > /dev/null && test $TS3100_IP0 = $TS3100_HOST:$TS3100_IP0_PORT || exit 11
        test -n \"$TS3100_IP3\" && test -n \"$TS3100_CONTROL_URL\" && test -n \"$TS3100_SERIAL_HOST_LINE\" || exit 12
        export TS3100_ROBOT=feeder
        ts3100 exec --control off -- sh -c '
            test $TS3100_IP0 != '$TS3100_IP0' || exit 1
            test -z \"$TS3100_CONTROL_URL$TS3100_ROBOT$TS3100_SERIAL_HOST_LINE\"' || exit 13
        ts3100 serve --ports auto --scenario no-such-file";
    let output = exec(&words, script);
    expect_code(&output, 2);
    let said = stderr(&output);
    assert!(
        said.contains("no-such-file") && !said.contains("TS3100_"),
        "{said}"
    );
    assert_eq!(said.lines().count(), 1, "{said}");
}

#[test]
fn the_address_of_a_host_is_no_serial_port() {
    for (flag, address) in [("--serial-host", "0.0.0.0"), ("--serial-com1", "robot.example")] {
        let refused = run(&["serve", "--ports", "auto", flag, address]);
        expect_code(&refused, 2);
        let said = stderr(&refused);
        assert!(said.contains("did you mean --listen?"), "{said}");
    }
}

// clause: T27
#[test]
fn what_a_fault_has_caused_is_a_note_and_not_denied() {
    let directory = TempDir::new("exec");
    let files = ["found.json", "found.xml", "found.sarif", "found.md"].map(|name| directory.file(name, ""));
    let reports: Vec<&str> = files.iter().flat_map(|file| ["--findings", file]).collect();
    let run = |fault: &[&str], script: &str| exec(&[fault, &["--deny", "note"], &reports].concat(), script);
    let reset = ["--fault", "reset-mid-text:command=SU"];
    // The first connection ends in the middle of the status; the host connects again.
    let output = run(&reset, "ts3100 host $TS3100_IP0 su; ts3100 host $TS3100_IP0 su");
    expect_code(&output, 0);
    let [json, xml, sarif, markdown] = files
        .each_ref()
        .map(|file| std::fs::read_to_string(file).unwrap());
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let found = &json["findings"];
    assert_eq!(found.as_array().map(Vec::len), Some(1), "{found}");
    for (key, value) in [
        ("rule", "left-in-exchange"),
        ("severity", "note"),
        ("caused-by", "fault"),
    ] {
        assert_eq!(found[0][key], value, "{found}");
    }
    let cause = "fault 1 (reset-mid-text)";
    assert_eq!(found[0]["first"][0]["caused-by"], cause);
    assert_eq!(
        json["broken"],
        serde_json::json!({"note": 1, "warning": 0, "error": 0})
    );
    assert!(
        xml.contains("failures=\"0\"") && xml.contains(&format!("(caused-by: {cause})")),
        "{xml}"
    );
    let sarif: serde_json::Value = serde_json::from_str(&sarif).unwrap();
    let result = &sarif["runs"][0]["results"][0];
    assert_eq!(
        (&result["level"], &result["properties"]["caused-by"]),
        (&"note".into(), &cause.into())
    );
    assert!(markdown.contains(&format!("(caused-by: {cause})")), "{markdown}");
    // A mistake that the fault does not explain is the host's.
    let output = run(
        &reset,
        "ts3100 host $TS3100_IP0 su; ts3100 host $TS3100_IP0 su; ts3100 host $TS3100_IP0 sl NOSUCH; true",
    );
    expect_code(&output, 64);
    assert!(
        stderr(&output).contains("denied finding refused-by-state, once"),
        "{}",
        stderr(&output)
    );
}
