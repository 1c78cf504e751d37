//! Reports at the end of a run: findings in three forms, coverage of the permission tables, lines executed, and
//! the exit codes that follow.

use super::support::{Serve, expect_code, run, stderr, stdout};
use serde_json::Value;
use std::io::Write;
use ts3100_tests::host::Host;
use ts3100_tests::testing::TempDir;

const PICK: &str =
    "PROGRAM PICK\nX = 0\nIF X == 0 THEN GOTO OUT\nX = 1\nOUT:\nPRINT IP1, \"AT\", X, CR\nEND\n";

fn json(path: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// A daemon with these reports; a host says SO in lower case and something nobody knows.
fn careless(words: &[&str], signal: &str) -> std::process::Output {
    let serve = Serve::start(words);
    let mut host = serve.dial(0);
    host.exchange(b"\x02so\r\x03", b"\x02OK\r\x03");
    host.exchange(b"\x02XX\r\x03", b"\x02NG\r\x03");
    serve.signal(signal)
}

#[test]
fn findings_are_written_in_three_forms_at_the_end() {
    let directory = TempDir::new("binary");
    let [xml, sarif, document] = ["f.xml", "f.sarif", "f.json"].map(|name| directory.file(name, ""));
    let output = careless(
        &["--findings", &xml, "--findings", &sarif, "--findings", &document],
        "TERM",
    );
    assert_eq!(output.status.code(), Some(0), "nothing is denied");
    let found = json(&document);
    let rules: Vec<&str> = found["findings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|finding| finding["rule"].as_str().unwrap())
        .collect();
    assert!(
        rules.contains(&"lower-case") && rules.contains(&"unknown-command"),
        "{rules:?}"
    );
    let unknown = found["findings"]
        .as_array()
        .unwrap()
        .iter()
        .find(|finding| finding["rule"] == "unknown-command")
        .unwrap();
    assert_eq!(
        (&unknown["count"], &unknown["first"][0]["bytes"]),
        (&1.into(), &"58 58".into())
    );
    assert_eq!(unknown["first"][0]["port"], "IP0");
    let xml = std::fs::read_to_string(&xml).unwrap();
    assert!(
        xml.contains("<failure message=\"No command has these letters (1 times)\" type=\"error\">"),
        "{xml}"
    );
    assert!(
        xml.contains(
            "name=\"lower-case\" classname=\"ts3100.findings.note\" time=\"0.000\">\n            <system-out>"
        ),
        "a note fails nothing: {xml}"
    );
    assert!(
        xml.contains("name=\"no-cr\" classname=\"ts3100.findings.error\" time=\"0.000\"/>"),
        "a rule that was kept is a case that passed"
    );
    let sarif = json(&sarif);
    let run = &sarif["runs"][0];
    assert_eq!(sarif["version"], "2.1.0");
    for result in run["results"].as_array().unwrap() {
        let index = usize::try_from(result["ruleIndex"].as_u64().unwrap()).unwrap();
        let rule = &run["tool"]["driver"]["rules"][index];
        assert_eq!(rule["id"], result["ruleId"]);
        let section = format!("urn:ts3100:explain:{}", result["ruleId"].as_str().unwrap());
        assert_eq!(rule["helpUri"], section.as_str());
        // Code scanning takes no result without a place in a file.
        let place = &result["locations"][0]["physicalLocation"];
        assert_eq!(place["artifactLocation"]["uri"], "ts3100-run");
        assert_eq!(place["region"]["startLine"], 1);
    }
    let log = stderr(&output);
    assert!(
        log.contains("(unknown-command)"),
        "it is in the log as it happens: {log}"
    );
}

/// The transcript, else the program, else the scenario.
#[test]
fn a_result_lies_in_the_file_that_stands_for_the_run() {
    let directory = TempDir::new("sarif");
    let sarif = directory.file("f.sarif", "");
    let transcript = directory.file("run 1.txt", "");
    let program = directory.file("pick.scol", PICK);
    let scenario = directory.file("day.toml", "name = \"day\"\n");
    let flags = [
        ["--transcript", &transcript],
        ["--load", &program],
        ["--scenario", &scenario],
    ];
    for first in 0..flags.len() {
        let words: Vec<&str> = ["--findings", &sarif]
            .into_iter()
            .chain(flags[first..].concat())
            .collect();
        careless(&words, "TERM");
        let found = json(&sarif);
        let uri =
            &found["runs"][0]["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]["uri"];
        let expected = format!("file://{}", flags[first][1].replace(' ', "%20"));
        assert_eq!(uri, expected.as_str());
    }
}

#[test]
fn what_is_denied_makes_the_exit_code() {
    for (deny, signal, expected) in [
        ("all", "TERM", 3),
        ("note", "INT", 3),
        ("warning", "TERM", 3),
        ("error", "TERM", 3),
        ("unknown-command", "TERM", 3),
        ("no-cr,lower-case", "TERM", 3),
        ("no-cr", "TERM", 0),
    ] {
        let output = careless(&["--deny", deny], signal);
        assert_eq!(
            output.status.code(),
            Some(expected),
            "{deny}: {}",
            stderr(&output)
        );
    }
    let output = careless(&["--deny", "unknown-command"], "TERM");
    let log = stderr(&output);
    assert!(
        log.contains("denied finding unknown-command, once: No command has these letters"),
        "{log}"
    );
}

// clause: T27
#[test]
fn what_cannot_be_reported_is_said_before_the_run() {
    for (words, expected) in [
        (["--findings", "/nowhere/f.xml"], "cannot write /nowhere/f.xml"),
        (["--coverage", "/nowhere/c.json"], "cannot write /nowhere/c.json"),
        (["--lcov", "/nowhere/run.info"], "cannot write /nowhere/run.info"),
        (
            ["--deny", "warnings"],
            "a rule that `ts3100 docs findings` lists, found `warnings`",
        ),
        (
            ["--deny", "8-027"],
            "8-027 is now alarm 8-014, and alarms are not findings",
        ),
        (["--min-coverage", "101"], "expected 0 to 100, found `101`"),
    ] {
        let output = run(&["serve", "--ports", "auto", words[0], words[1]]);
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        assert!(stderr(&output).contains(expected), "{}", stderr(&output));
    }
}

#[test]
fn coverage_is_written_judged_and_merged() {
    let directory = TempDir::new("binary");
    let [one, other, page] = ["1.json", "2.json", "1.html"].map(|name| directory.file(name, ""));
    let words = ["--coverage", &one, "--coverage", &page, "--min-coverage", "99"];
    let output = careless(&words, "TERM");
    assert_eq!(output.status.code(), Some(4));
    assert!(
        stderr(&output).contains("below the 99 % of --min-coverage"),
        "{}",
        stderr(&output)
    );
    let first = json(&one);
    assert_eq!(first["reached"], 1);
    let served = first["cells"]
        .as_array()
        .unwrap()
        .iter()
        .find(|cell| cell["count"] == 1)
        .unwrap();
    assert_eq!(
        [
            &served["port"],
            &served["command"],
            &served["mode"],
            &served["outcome"]
        ],
        ["IP0", "SO", "EXT (ETHER)", "served"]
    );
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(
        html.contains("<th>SO</th>") && html.contains("served 1") && !html.contains("src="),
        "{html}"
    );

    let serve = Serve::start(&["--coverage", &other, "--key-switch", "teaching"]);
    serve.dial(0).exchange(b"\x02SO\r\x03", b"\x02NG\r\x03");
    assert_eq!(serve.signal("TERM").status.code(), Some(0));
    let all = directory.file("all.json", "");
    let merged = run(&[
        "coverage",
        "merge",
        &one,
        &other,
        "--out",
        &all,
        "--min-coverage",
        "0.9",
    ]);
    expect_code(&merged, 0);
    assert_eq!(
        stdout(&merged),
        format!("0.9 % (2 of {} cells)\n", first["reachable"])
    );
    assert_eq!(json(&all)["reached"], 2);
    let below = run(&["coverage", "merge", &one, &other, "--min-coverage", "50"]);
    assert_eq!(below.status.code(), Some(4));
    let wrong = run(&["coverage", "merge", &page]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(
        stderr(&wrong).contains("1.html: expected a coverage report of ts3100"),
        "{}",
        stderr(&wrong)
    );
}

#[test]
fn executed_lines_are_written_for_lcov() {
    let directory = TempDir::new("binary");
    let (file, info) = (directory.file("pick.scol", PICK), directory.file("run.info", ""));
    let serve = Serve::start(&["--load", &file, "--select", "PICK", "--servo-on", "--lcov", &info]);
    let mut host = serve.dial(0);
    let mut channel = serve.dial(1);
    for _ in 0..2 {
        host.exchange(b"\x02RN\r\x03", b"\x02OK\r\x03");
        assert!(channel.read_until(b'\r').starts_with(b"AT"));
        assert_eq!(host.read_until(0x03), b"\x02SP\r\x03");
    }
    // A program the host brings has no file of the PC: it is written beside the report.
    host.exchange(b"\x02DL,NEW\r\x03", b"\x02OK\r\x03");
    host.write_all(b"\x02FL,PROGRAM NEW\rDOUT(1)\rEND\r\x1a\x03")
        .unwrap();
    assert_eq!(host.read_until(0x03), b"\x02OK\r\x03");
    assert_eq!(serve.signal("TERM").status.code(), Some(0));
    let trace = std::fs::read_to_string(&info).unwrap();
    let pick = format!(
        "SF:{file}\nFN:2,PICK\nFNDA:2,PICK\nFNF:1\nFNH:1\nDA:2,2\nDA:3,2\nDA:4,0\nDA:6,2\nDA:7,2\nLF:5\nLH:4\nend_of_record\n"
    );
    assert!(trace.contains(&pick), "{trace}");
    let new = format!("SF:{info}.src/NEW\nFN:2,NEW\nFNDA:0,NEW\n");
    assert!(trace.contains(&new), "{trace}");
    let source = std::fs::read_to_string(format!("{info}.src/NEW")).unwrap();
    assert_eq!(source, "PROGRAM NEW\nDOUT(1)\nEND\n");
}

#[test]
fn a_run_without_sockets_writes_the_same_lines() {
    let directory = TempDir::new("binary");
    let (file, info) = (directory.file("pick.scol", PICK), directory.file("run.info", ""));
    let output = run(&["run", &file, "--lcov", &info]);
    expect_code(&output, 0);
    let trace = std::fs::read_to_string(&info).unwrap();
    assert!(
        trace.contains("DA:2,1\nDA:3,1\nDA:4,0\nDA:6,1\nDA:7,1\nLF:5\nLH:4\n"),
        "{trace}"
    );
    assert!(
        !stderr(&output).contains("line 2"),
        "statements are told only with --trace"
    );
}

#[test]
fn a_run_names_the_file_that_it_was_given_whatever_the_file_is_called() {
    let directory = TempDir::new("binary");
    for name in [
        "pick and place.scol",
        "a_name_longer_than_those_of_the_drive.scol",
    ] {
        let (file, info) = (directory.file(name, PICK), directory.file("run.info", ""));
        expect_code(&run(&["run", &file, "--lcov", &info]), 0);
        let trace = std::fs::read_to_string(&info).unwrap();
        assert!(trace.contains(&format!("SF:{file}\n")), "{trace}");
    }
}

#[test]
fn the_reports_are_keys_of_the_file_and_the_environment_too() {
    let directory = TempDir::new("binary");
    let config = directory.file(
        "c.toml",
        "findings = [\"f.json\"]\ndeny = [\"no-cr\", \"lower-case\"]\n",
    );
    let output = careless(&["--config", &config], "TERM");
    assert_eq!(output.status.code(), Some(3));
    assert!(
        directory.path().join("f.json").exists(),
        "paths are seen from the file"
    );
}

#[test]
fn what_cannot_be_written_at_the_end_costs_no_other_report() {
    let directory = TempDir::new("binary");
    let path = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let scenario = directory.file("s.toml", "[[expect]]\nwhat = \"command SU\"\n");
    let [snapshot, lost] = ["d/s.json", "d/f.json"].map(path);
    let written = ["f.json", "c.json", "r.json", "run.info", "j.xml"].map(path);
    let [findings, coverage, faults, lines, results] = &written;
    let remove = format!("rm -r '{}'", path("d"));
    for first in [["--snapshot-on-exit", &snapshot], ["--findings", &lost]] {
        std::fs::create_dir(path("d")).unwrap();
        let reports = [
            ["--findings", findings],
            ["--coverage", coverage],
            ["--report", faults],
            ["--lcov", lines],
            ["--scenario", &scenario],
            ["--junit", results],
        ];
        let words = [&["exec"][..], &first, reports.as_flattened()].concat();
        let output = run(&[&words[..], &["--", "sh", "-c", &remove]].concat());
        expect_code(&output, 125);
        let said = stderr(&output);
        assert!(said.contains("cannot write") && said.contains(first[1]), "{said}");
        assert!(said.contains("expect command SU: expected once"), "{said}");
        for file in &written {
            let length = std::fs::metadata(file).unwrap().len();
            assert!(length > 0 || file == lines, "{file}: {said}");
        }
        let results = std::fs::read_to_string(results).unwrap();
        assert!(results.contains("expect command SU"), "{results}");
    }
}
