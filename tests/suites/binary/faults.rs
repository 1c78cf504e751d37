//! Faults and legal variation from the command line: flags, files, the report, the list.

use super::support::{Serve, expect_code, run, stderr, stdout};
use serde_json::Value;
use ts3100_tests::host::Host;
use ts3100_tests::testing::TempDir;

#[test]
fn faults_of_flags_and_files_fire_and_those_that_never_did_are_reported() {
    let directory = TempDir::new("binary");
    let file = directory.file(
        "faults.toml",
        "[[fault]]\nkind = \"ng\"\ncommand = \"SO\"\n\n[[fault]]\nkind = \"no-reply\"\ncommand = \"ER\"\n",
    );
    let report = directory.path().join("report.json");
    let report = report.to_str().unwrap();
    let serve = Serve::start(&[
        "--faults",
        &file,
        "--fault",
        "late-reply:command=BR,delay=1",
        "--report",
        report,
    ]);
    let refused = serve.host(&["so"]);
    assert!(!refused.status.success());
    assert!(serve.host(&["so"]).status.success());
    assert!(serve.host(&["br"]).status.success());
    let log = stderr(&serve.signal("TERM"));
    for line in [
        "IP0: fault 1 ng: SO is refused",
        "IP0: fault 3 late-reply: the answer to BR leaves 1 ms late",
        "WARN fault 2 `no-reply:command=ER,lost=reply` never fired: no occasion occurred",
    ] {
        assert!(log.contains(line), "{line}:\n{log}");
    }
    let report: Value = serde_json::from_str(&std::fs::read_to_string(report).unwrap()).unwrap();
    assert_eq!(report["faults"]["never_fired"], serde_json::json!([2]));
    assert_eq!(report["faults"]["faults"][0]["fired"], 1);
    assert_eq!(report["faults"]["faults"][0]["fault"]["on"]["command"], "SO");
}

#[test]
fn the_report_says_why_and_a_fault_that_met_nothing_can_fail_the_run() {
    let directory = TempDir::new("binary");
    let [json, xml] = ["report.json", "report.xml"].map(|name| directory.file(name, ""));
    let words = |deny: &'static str| {
        let faults = [
            "--fault",
            "no-reply:command=SO",
            "--fault",
            "ng:command=CA,block=0",
        ];
        let reports = ["--report", &json, "--report", &xml, "--deny", deny];
        let serve = Serve::start(&[faults.as_slice(), reports.as_slice()].concat());
        let mut host = serve.dial(0);
        std::io::Write::write_all(&mut host, b"\x02SO\r\x03").unwrap();
        host.exchange(b"\x02BR\r\x03", b"\x02OK\r\x03");
        serve.signal("TERM")
    };
    // What is denied of findings has nothing to do with faults.
    assert_eq!(words("selected-overwritten").status.code(), Some(0));
    let output = words("fault-never-fired");
    expect_code(&output, 3);
    assert!(
        stderr(&output).contains("denied: fault 2 never fired"),
        "{}",
        stderr(&output)
    );
    let report: Value = serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
    let [fired, never] = [0, 1].map(|index| &report["faults"]["faults"][index]);
    assert_eq!(fired["applied"][0]["what"], "the answer to SO is not sent");
    assert_eq!(fired["applied"][0]["port"], "IP0");
    assert_eq!(fired["applied"][0]["t"], fired["at"][0]);
    assert!(
        fired["host"]
            .as_str()
            .unwrap()
            .starts_with("It waits for the reply")
    );
    assert_eq!(never["applied"], serde_json::json!([]));
    let waits = never["waits_for"].as_str().unwrap();
    assert_eq!(waits, "an incoming command or FL text; command CA; block 0");
    let xml = std::fs::read_to_string(xml).unwrap();
    assert!(xml.contains("tests=\"2\" skipped=\"0\" failures=\"1\""), "{xml}");
    assert!(
        xml.contains("the answer to SO is not sent\nA robust host: It waits"),
        "{xml}"
    );
    assert!(
        xml.contains("never fired: no occasion occurred\" type=\"fault-never-fired\""),
        "{xml}"
    );
}

#[test]
fn a_report_that_cannot_be_written_is_known_before_the_run() {
    let directory = TempDir::new("binary");
    let scenario = directory.file("s.toml", "[[never]]\nwhat = \"alarm\"\n");
    for flag in ["--report", "--junit"] {
        let output = run(&[
            "serve",
            "--ports",
            "auto",
            "--scenario",
            &scenario,
            flag,
            "/nowhere-at-all/report.xml",
        ]);
        assert_eq!(output.status.code(), Some(2), "{flag}");
        let words = stderr(&output);
        assert!(
            words.contains("cannot write /nowhere-at-all/report.xml"),
            "{words}"
        );
    }
}

#[test]
fn what_is_no_fault_ends_it_before_it_is_ready() {
    let directory = TempDir::new("binary");
    let file = directory.file("faults.toml", "[[fault]]\nkind = \"ng\"\nafter = \"soon\"\n");
    let twice = directory.file(
        "twice.toml",
        "[[fault]]\nkind = \"ng\"\nid = 7\n\n[[fault]]\nkind = \"no-reply\"\nid = 7\n",
    );
    for (words, says) in [
        (["--fault", "nothing"], "--fault: unknown kind of fault `nothing`"),
        (
            ["--fault", "flipped-bit:way=in,command=SO"],
            "--fault: cannot arm flipped-bit: no occasion matches command=SO",
        ),
        (
            ["--faults", &file],
            "faults.toml, line 3: ng: after: expected a whole number from 0 to 1000000, found `soon`",
        ),
        (["--faults", "/nowhere.toml"], "cannot read /nowhere.toml"),
        (
            ["--faults", &twice],
            "cannot arm the faults: two have the number id=7",
        ),
        (
            ["--vary", "luck"],
            "expected a whole number, random or off, found `luck`",
        ),
    ] {
        let output = run(&["serve", "--ports", "auto", words[0], words[1]]);
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
    }
}

#[test]
fn a_seed_is_printed_and_a_drawn_one_too() {
    let serve = Serve::start(&["--vary", "41"]);
    assert!(serve.host(&["su"]).status.success());
    let log = stderr(&serve.signal("TERM"));
    assert!(
        log.contains("legal variation with seed 41; repeat it with --vary 41"),
        "{log}"
    );
    let log = stderr(&Serve::start(&["--vary", "random"]).signal("TERM"));
    let seed = log
        .split("--vary ")
        .nth(1)
        .and_then(|rest| rest.split_whitespace().next());
    assert!(seed.is_some_and(|seed| seed.parse::<u64>().is_ok()), "{log}");
    let log = stderr(&Serve::start(&["--vary", "off"]).signal("TERM"));
    assert!(!log.contains("variation"), "{log}");
}

#[test]
fn kinds_are_listed_and_specifications_checked() {
    let list = run(&["faults", "list"]);
    assert!(stdout(&list).contains("\nhalf-open\n"), "{}", stdout(&list));
    let list: Value = serde_json::from_str(&stdout(&run(&["faults", "list", "--json"]))).unwrap();
    assert_eq!(list["kinds"].as_array().map(Vec::len), Some(20));
    let good = run(&["faults", "check", "ng:command=so", "power-loss"]);
    assert_eq!(
        stdout(&good),
        "ng:command=SO\npower-loss:command=DL,block=1,delay=0\n"
    );
    let bad = run(&["faults", "check", "--json", "ng:command=XX", "ng"]);
    assert_eq!(bad.status.code(), Some(1));
    assert!(stderr(&bad).contains("the letters of a command"));
    let never = run(&["faults", "check", "ng:command=SU,block=1"]);
    assert_eq!(never.status.code(), Some(1));
    assert!(stderr(&never).contains("leave out command, or leave out block"));
    let good: Value = serde_json::from_str(&stdout(&bad)).unwrap();
    assert_eq!(good["faults"][0]["kind"], "ng");
}

#[test]
fn a_fault_that_the_controller_cannot_do_ends_it_before_it_is_ready() {
    let directory = TempDir::new("binary");
    let file = directory.file(
        "faults.toml",
        "[[fault]]\nkind = \"key-turned\"\nto = \"internal\"\n",
    );
    for words in [["--fault", "key-turned:to=internal"], ["--faults", &file]] {
        for controller in ["tsl3100", "tsl3000e"] {
            let output = run(&[
                "serve",
                "--ports",
                "auto",
                "--controller",
                controller,
                words[0],
                words[1],
            ]);
            assert_eq!(output.status.code(), Some(2), "{words:?}");
            let says = stderr(&output);
            assert!(says.contains("cannot arm key-turned: the TSL3"), "{says}");
            assert!(
                says.contains("has no INTERNAL position; give to=teaching"),
                "{says}"
            );
        }
        let output = run(&["exec", words[0], words[1], "--", "true"]);
        assert_eq!(output.status.code(), Some(0), "the TS3100 has one");
    }
}
