//! `ts3100 serve`: ready line, ports, signals, errors at the start, the backing directory, time.

use super::support::{Serve, expect_code, run, stderr, stdout, ts3100};
use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::net::TcpListener;
use ts3100_tests::host::Host;
use ts3100_tests::testing::{TempDir, eventually};

const PICK: &str = "PROGRAM PICK\nX = 0\nINPUT IP1, X\nDELAY X\nPRINT IP1, \"AT\", X, CR\nEND\n";

// clause: GEN-02 FRM-01 CMD-SO-01
#[test]
fn a_host_is_served_in_the_framing_it_uses() {
    let serve = Serve::start(&[]);
    assert!(
        serve.ports.iter().all(Option::is_some),
        "a fresh drive opens all four channels"
    );
    let mut host = serve.dial(0);
    host.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    host.exchange(b"SO\r\x03", b"OK\r\x03");
    host.write_all(b"\x02SU\r\x03").unwrap();
    let status = host.read_until(0x03);
    let expected = b"\x02FL,MODE:external(ethernet)/cycle FILE:";
    assert!(status.starts_with(expected), "{}", status.escape_ascii());
    host.write_all(b"\x02OK\r\x03").unwrap();
}

#[test]
fn the_last_lines_reach_a_slow_reader() {
    let serve = Serve::start(&["-vv"]);
    let mut host = serve.dial(0);
    for _ in 0..900 {
        host.exchange(b"\x02QQ\r\x03", b"\x02NG\r\x03");
    }
    let mut child = serve.signalled("TERM");
    let mut log = child.stderr.take().unwrap();
    let mut read = Vec::new();
    eventually("the log ends", || {
        let length = log.by_ref().take(4_096).read_to_end(&mut read).unwrap();
        (length == 0).then_some(())
    });
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let read = String::from_utf8(read).unwrap();
    assert!(
        read.contains(" INFO ended\n"),
        "{}: {:?}",
        read.len(),
        read.lines().last()
    );
    assert!(!read.contains("lines dropped"));
}

// clause: ETH-06
#[test]
fn a_second_host_is_turned_away_and_the_first_stays() {
    let serve = Serve::start(&[]);
    let mut first = serve.dial(0);
    first.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    let mut second = serve.dial(0);
    assert!(matches!(second.read(&mut [0; 8]), Ok(0) | Err(_)));
    first.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
}

// clause: ETH-07
#[test]
fn garbage_half_a_text_and_a_disconnect_leave_a_working_port() {
    let serve = Serve::start(&[]);
    for rubbish in [
        &b"\x00\xff\xfe\x03garbage"[..],
        b"\x02DL,HA",
        b"\x02\x02\x02",
        &[b'x'; 5_000],
    ] {
        let mut host = serve.dial(0);
        host.write_all(rubbish).unwrap();
        drop(host);
        let mut next = serve.dial(0);
        next.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    }
}

#[test]
fn signals_end_it_cleanly() {
    for name in ["TERM", "INT"] {
        let serve = Serve::start(&["-v"]);
        let mut host = serve.dial(0);
        host.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
        let output = serve.signal(name);
        assert_eq!(output.status.code(), Some(0));
        let log = stderr(&output);
        assert!(
            log.contains("IP0 < <STX>SO<CR><ETX>") && log.contains("IP0 > <STX>OK<CR><ETX>"),
            "{log}"
        );
        assert!(matches!(host.read(&mut [0; 8]), Ok(0) | Err(_)));
    }
}

#[test]
fn the_log_can_be_json() {
    let serve = Serve::start(&["-v", "--log-format", "json"]);
    serve.dial(0).exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    let log = stderr(&serve.signal("TERM"));
    let lines: Vec<serde_json::Value> = log
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let text = lines.iter().find(|line| line["event"] == "text-in").unwrap();
    assert_eq!(
        (text["port"].as_str(), text["text"].as_str()),
        (Some("IP0"), Some("<STX>SO<CR><ETX>"))
    );
}

#[test]
fn bytes_of_a_program_are_logged_with_v_and_those_of_texts_with_vv() {
    let directory = TempDir::new("binary");
    let file = directory.file("pick.scol", PICK);
    for (level, ports) in [("-v", &["IP1"][..]), ("-vv", &["IP0", "IP1"])] {
        let serve = Serve::start(&[level, "--log-format", "json", "--load", &file, "--select", "PICK"]);
        let (mut host, mut program) = (serve.dial(0), serve.dial(1));
        host.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
        host.exchange(b"\x02RN\r\x03", b"\x02OK\r\x03");
        program.exchange(b"0\r", b"AT           0\r");
        let log = stderr(&serve.signal("TERM"));
        let lines = log
            .lines()
            .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
        let bytes: Vec<_> = lines.filter(|line| line["event"] == "bytes").collect();
        let logged: BTreeSet<_> = bytes.iter().map(|line| line["port"].as_str().unwrap()).collect();
        assert_eq!(logged, ports.iter().copied().collect(), "{level}");
        for text in ["IP1 < 0<CR>", "IP1 > AT           0<CR>"] {
            assert!(bytes.iter().any(|line| line["message"] == text), "{text}: {log}");
        }
    }
}

#[test]
fn a_port_in_use_is_one_clear_error() {
    // Free ports that happen to be four in a row are not worth hunting for: the first is the one in use.
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let offset = (taken.local_addr().unwrap().port() - 1000).to_string();
    let output = run(&["serve", "--port-offset", &offset, "--ready-json"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(output.stdout.is_empty());
    let error = stderr(&output);
    assert!(
        error.contains("cannot open IP0 at 127.0.0.1:") && error.contains("the port is in use"),
        "{error}"
    );
    assert!(
        error.contains("another `--port-offset`") && error.contains("--ports auto"),
        "{error}"
    );
}

#[test]
#[cfg(unix)]
fn a_variable_that_is_not_text_is_named() {
    use std::os::unix::ffi::OsStrExt as _;
    let wrong = std::ffi::OsStr::from_bytes(b"\xff");
    for (words, variable, expected) in [
        (
            &["serve"][..],
            "TS3100_LISTEN",
            "error: TS3100_LISTEN: listen: expected text in UTF-8\n",
        ),
        (
            &["ctl", "state"],
            "TS3100_CONTROL_URL",
            "error: URL of the control interface: expected http://HOST:PORT, found `\u{fffd}`\n",
        ),
    ] {
        let output = ts3100(words).env(variable, wrong).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{variable}");
        assert_eq!(stderr(&output), expected);
    }
}

#[test]
fn what_cannot_be_used_at_the_start_is_refused_with_its_reason() {
    let directory = TempDir::new("binary");
    let broken = directory.file("broken.scol", "PROGRAM BROKEN\nGOTO NOWHERE\nEND\n");
    let tab = directory.file("tab.scol", "PROGRAM TAB\n\tSPEED = 20\nEND\n");
    let name = directory.file("2name.scol", "PROGRAM X\nEND\n");
    let config = directory.file("bad.toml", "port-ofset = 1\n");
    let missing = directory.path().join("missing.scol");
    let cases: [(&[&str], &str); 9] = [
        (&["--load", &broken, "--select", "BROKEN"], "BROKEN:2:"),
        (&["--select", "ABSENT"], "cannot select ABSENT"),
        (&["--load", &tab], "cannot store TAB on the RAM drive: "),
        (&["--load", &name], "2name.scol on the RAM drive under its name"),
        (&["--load", missing.to_str().unwrap()], "cannot read"),
        (
            &["--config", &config],
            ", line 1: unknown key `port-ofset`; did you mean `port-offset`?",
        ),
        (
            &["--set", "text.sxt=detect"],
            "unknown option `text.sxt`; did you mean `text.stx`?",
        ),
        (
            &["--port-offset", "abc"],
            "expected a whole number from 0 to 65535, found `abc`",
        ),
        (&["--listen", "203.0.113.77"], "cannot open IP0 at 203.0.113.77"),
    ];
    for (words, expected) in cases {
        let mut all = vec!["serve", "--ports", "auto", "--ready-json"];
        all.extend(words);
        let output = run(&all);
        let error = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {error}");
        assert!(
            output.stdout.is_empty() && error.contains(expected),
            "{words:?}: {error}"
        );
    }
}

#[test]
fn an_error_in_a_configuration_file_names_its_line() {
    let directory = TempDir::new("binary");
    directory.file("tab.scol", "PROGRAM TAB\n\tSPEED = 20\nEND\n");
    for (content, expected) in [
        (
            "servo-on = true\nfault = [\"no-reply:comand=SO\"]\n",
            ", line 2: fault: ",
        ),
        (
            "servo-on = true\nload = [\"missing.scol\"]\n",
            ", line 2: cannot read ",
        ),
        ("\nload = [\"tab.scol\"]\n", ", line 2: cannot store TAB"),
        ("\n\nselect = \"ABSENT\"\n", ", line 3: cannot select ABSENT"),
        ("\nmodel = \"missing.toml\"\n", ", line 2: cannot read "),
        (
            "[[robot]]\nnme = \"left\"\n",
            ", [[robot]] 1: unknown key `nme`; did you mean `name`?",
        ),
        (
            "[[robot]]\nname = \"left\"\n[[wire]]\nform = \"outside.a\"\n",
            ", [[wire]] 1: unknown key `form`; did you mean `from`?",
        ),
        (
            "[[robot]]\nservo-on = true\n",
            ", [[robot]] 1: the key `name` is missing",
        ),
        (
            "\nPROGRAM PICK\nEND\n",
            ": this is a SCOL program, not a configuration: load it with `--load`",
        ),
    ] {
        let config = directory.file("robot.toml", content);
        let output = run(&["serve", "--ports", "auto", "--config", &config]);
        let error = stderr(&output);
        expect_code(&output, 2);
        assert!(
            error.contains(&format!("{config}{expected}")),
            "{content}: {error}"
        );
    }
    // A flag replaces the value of the file, and its error is that of the flag.
    let config = directory.file("robot.toml", "select = \"ABSENT\"\nload = [\"missing.scol\"]\n");
    let pick = directory.file("pick.scol", PICK);
    let words = [
        "serve", "--ports", "auto", "--config", &config, "--load", &pick, "--select", "NONE",
    ];
    let error = stderr(&run(&words));
    assert!(error.starts_with("error: cannot select NONE: "), "{error}");
}

#[test]
fn what_the_system_says_is_said_once() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = taken.local_addr().unwrap().to_string();
    let control = ["--control", &taken];
    for (words, expected) in [
        (&control[..], "in use"),
        (&["--restore", "/nowhere/a.json"], "No such file"),
        (&["--load", "/nowhere/a.scol"], "No such file"),
        (&["--scenario", "/nowhere/a.toml"], "No such file"),
        (&["--faults", "/nowhere/a.toml"], "No such file"),
        (&["--config", "/nowhere/a.toml"], "No such file"),
        (&["--transcript", "/nowhere/a.txt"], "No such file"),
        (&["--fault", "nothing"], "fault `nothing`"),
    ] {
        let mut all = vec!["serve", "--ports", "auto", "--ready-json"];
        all.extend(words);
        let error = stderr(&run(&all));
        assert_eq!(error.matches(expected).count(), 1, "{words:?}: {error}");
    }
}

#[test]
fn a_control_port_in_use_says_what_to_do() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = taken.local_addr().unwrap().to_string();
    let error = stderr(&run(&["serve", "--ports", "auto", "--control", &taken]));
    let reason = format!("cannot open the control interface at {taken}: the port is in use.");
    assert!(error.contains(&reason), "{error}");
    assert!(
        error.contains("Use `--control 127.0.0.1:0` (a free port) or `--control off`"),
        "{error}"
    );
}

#[test]
fn people_are_told_what_to_try() {
    let mut child = ts3100(&["serve", "--ports", "auto"])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut text = String::new();
    let mut stderr = std::io::BufReader::new(child.stderr.take().unwrap());
    while !text.contains("Ctrl-C") {
        assert!(
            std::io::BufRead::read_line(&mut stderr, &mut text).unwrap() > 0,
            "{text}"
        );
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(
        text.contains("IP0  127.0.0.1:") && text.contains("ts3100 host 127.0.0.1:"),
        "{text}"
    );
}

// clause: RAM-14 CMD-DL-06
#[test]
fn a_download_survives_a_kill() {
    let directory = TempDir::new("binary");
    let drive = directory.path().join("drive");
    let drive = drive.to_str().unwrap();
    let file = directory.file("pick.scol", PICK.replace('\n', "\r\n"));
    let serve = Serve::start(&["--drive", drive]);
    let output = serve.host(&["dl", &file]);
    expect_code(&output, 0);
    serve.signal("KILL");
    assert_eq!(
        std::fs::read_to_string(directory.path().join("drive/PICK")).unwrap(),
        PICK
    );
    let serve = Serve::start(&["--drive", drive, "--select", "PICK"]);
    assert_eq!(serve.host(&["ul", "PICK"]).stdout, PICK.as_bytes());
    assert_eq!(serve.host(&["er", "PICK"]).status.code(), Some(1), "selected");
    assert_eq!(serve.host(&["rs", "sel"]).status.code(), Some(0));
    assert_eq!(serve.host(&["er", "PICK"]).status.code(), Some(0));
    assert!(!directory.path().join("drive/PICK").exists());
}

// clause: EU-06
#[test]
fn the_error_history_survives_a_kill_and_a_damaged_one_does_no_harm() {
    let directory = TempDir::new("binary");
    let drive = directory.path().join("drive");
    let kept = drive.join(".ts3100.history");
    let words = [
        "--drive",
        drive.to_str().unwrap(),
        "--fault",
        "alarm:command=SO,number=4-101",
    ];
    let history = |serve: &Serve| stdout(&serve.host(&["eu"]));
    let serve = Serve::start(&words);
    let empty = history(&serve);
    serve.host(&["so"]);
    let first = history(&serve);
    assert!(first.contains("4-101"), "{first}");
    serve.signal("KILL");
    let serve = Serve::start(&words);
    assert_eq!(history(&serve), first);
    assert!(!stdout(&serve.host(&["ca"])).contains("HISTORY"));
    serve.host(&["so"]);
    let both = history(&serve);
    assert_eq!(both.matches("4-101").count(), 2, "{both}");
    serve.signal("TERM");
    let serve = Serve::start(&words[..2]);
    assert_eq!(history(&serve), both);
    serve.signal("TERM");
    for damage in [
        "",
        "{\"version\":1,\"history\":[",
        "{\"version\":2,\"history\":[]}",
        "\u{0}",
    ] {
        std::fs::write(&kept, damage).unwrap();
        let serve = Serve::start(&words);
        assert_eq!(history(&serve), empty, "{damage:?}");
        serve.host(&["so"]);
        let again = history(&serve);
        let log = stderr(&serve.signal("TERM"));
        assert!(
            log.contains("cannot read the error history") && log.contains(".ts3100.history"),
            "{log}"
        );
        let serve = Serve::start(&words);
        assert_eq!(history(&serve), again, "it is kept anew");
    }
}

#[test]
fn foreign_files_in_the_directory_are_named_and_left_alone() {
    let directory = TempDir::new("binary");
    let drive = directory.path().join("drive");
    std::fs::create_dir_all(drive.join("SUB")).unwrap();
    for name in [".DS_Store", "README (1).md", "PICK"] {
        std::fs::write(drive.join(name), PICK).unwrap();
    }
    let serve = Serve::start(&["--drive", drive.to_str().unwrap()]);
    assert_eq!(serve.host(&["ul", "PICK"]).stdout, PICK.as_bytes());
    let files = stdout(&serve.host(&["ca"]));
    assert!(!files.contains("README") && !files.contains("SUB"), "{files}");
    let log = stderr(&serve.signal("TERM"));
    for name in ["README (1).md", "SUB"] {
        let warnings = log
            .lines()
            .filter(|line| line.contains("WARN") && line.contains(name));
        assert_eq!(warnings.count(), 1, "{name}: {log}");
        assert!(drive.join(name).exists());
    }
    assert!(!log.contains("DS_Store"), "hidden files are nobody's: {log}");
}

#[test]
fn two_daemons_on_one_directory_are_refused() {
    let directory = TempDir::new("binary");
    let drive = directory.path().join("drive");
    let drive = drive.to_str().unwrap();
    let first = Serve::start(&["--drive", drive]);
    let output = run(&["serve", "--ports", "auto", "--ready-json", "--drive", drive]);
    let error = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(output.stdout.is_empty());
    assert!(
        error.contains(drive) && error.contains("the RAM drive of another running ts3100"),
        "{error}"
    );
    first.dial(0).exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    first.signal("KILL");
    assert_eq!(
        Serve::start(&["--drive", drive]).signal("TERM").status.code(),
        Some(0)
    );
    Serve::start(&["--drive", drive]);
}

#[test]
fn a_directory_that_cannot_be_written_is_one_error_and_the_robot_goes_on() {
    for (when_full, code) in [("refuse", 1), ("memory", 0)] {
        let directory = TempDir::new("binary");
        let drive = directory.path().join("drive");
        let file = directory.file("pick.scol", PICK);
        let set = format!("drive.when_full={when_full}");
        let drive_word = drive.to_str().unwrap();
        let serve = Serve::start(&["--drive", drive_word, "--log-format", "json", "--set", &set]);
        // In the way of the temporary file: the write fails for every user, root included.
        std::fs::create_dir(drive.join(".PICK.unfinished")).unwrap();
        for _ in 0..2 {
            assert_eq!(serve.host(&["dl", &file]).status.code(), Some(code));
        }
        let held = serve.host(&["ul", "PICK"]).stdout;
        assert_eq!(held == PICK.as_bytes(), when_full == "memory");
        assert_eq!(serve.host(&["so"]).status.code(), Some(0));
        let log = stderr(&serve.signal("TERM"));
        let lines = log.lines();
        let events: Vec<serde_json::Value> = lines.map(|line| serde_json::from_str(line).unwrap()).collect();
        let failed: Vec<_> = events
            .iter()
            .filter(|event| event["event"] == "store-failed")
            .collect();
        assert_eq!(failed.len(), 1, "{log}");
        assert_eq!(
            (failed[0]["level"].as_str(), failed[0]["file"].as_str()),
            (Some("ERROR"), Some("PICK"))
        );
    }
}

#[test]
fn a_directory_that_does_not_take_the_files_of_the_start_is_no_start() {
    let directory = TempDir::new("binary");
    let drive = directory.path().join("drive");
    std::fs::create_dir_all(drive.join("PICK")).unwrap();
    let file = directory.file("pick.scol", PICK);
    let words = [
        "serve",
        "--ports",
        "auto",
        "--drive",
        drive.to_str().unwrap(),
        "--load",
        &file,
    ];
    let output = run(&words);
    expect_code(&output, 2);
    assert!(
        stderr(&output).contains("cannot put in place"),
        "{}",
        stderr(&output)
    );
}

// clause: PAR-FILE-03 PAR-E05-01
#[test]
fn a_parameter_file_given_at_the_start_acts_at_once() {
    let serve = Serve::start(&["--set", "drive.open_mode=1 1 0 0"]);
    assert_eq!(serve.ports.iter().filter(|port| port.is_some()).count(), 2);
    let parameters = serve.host(&["ul", "ETHERNET.PAR"]);
    expect_code(&parameters, 0);
    let directory = TempDir::new("binary");
    let file = directory.file("ethernet.par", &parameters.stdout);
    let serve = Serve::start(&["--load", &file]);
    assert_eq!(serve.ports.iter().filter(|port| port.is_some()).count(), 2);
}

#[test]
fn automatic_time_jumps_over_an_hour_but_waits_for_the_host() {
    let directory = TempDir::new("binary");
    let file = directory.file("pick.scol", PICK);
    let serve = Serve::start(&[
        "--time",
        "auto",
        "--load",
        &file,
        "--select",
        "PICK",
        "--servo-on",
    ]);
    let mut program = serve.dial(1);
    assert_eq!(serve.host(&["rn"]).status.code(), Some(0));
    // Half a minute is the longest that the host waits for what is due in an hour.
    program.write_all(b"3600\r").unwrap();
    assert_eq!(program.read_until(b'\r'), b"AT        3600\r");
}

#[test]
fn a_command_line_that_is_not_understood_says_what_to_type() {
    for (words, expected) in [
        (
            &["serve", "--ports", "1234"][..],
            "--ports takes the word `parameter` or `auto`, not a number; --port-offset 234 makes 1234 the first port",
        ),
        (
            &["exec", "pytest", "-x"],
            "put `--` before the command: ts3100 exec [OPTIONS] -- pytest\n",
        ),
        (
            &["host", "127.0.0.1:1", "us"],
            "unknown command `us`; did you mean `su`?\n\nFor more information, try 'ts3100 host --help'.\n",
        ),
        (
            &["ctl", "inputs", "5", "forc"],
            "unknown command `forc`; did you mean `force`?\n\nFor more information, try 'ts3100 ctl inputs --help'.\n",
        ),
        (&["ctl", "stae"], "unknown command `stae`; did you mean `state`?"),
        (&["srve"], "unknown command `srve`; did you mean `serve`?"),
        (
            &["ctl", "inputs", "5", "sideways"],
            "unknown command `sideways`\n\nCommands of `ts3100 ctl inputs`: on off pulse ",
        ),
        (
            &["ctl", "inputs", "5", "1"],
            "unknown command `1`; did you mean `on`?",
        ),
        (
            &["ctl", "estop"],
            "unknown command `estop`; did you mean `emergency-stop`?",
        ),
        (
            &["ctl", "snapshots", "save", "a"],
            "unknown command `save`; did you mean `take`?",
        ),
        (
            &["ctl", "alarms", "2-046"],
            "unknown command `2-046`; `ts3100 ctl alarms table 2-046` explains the alarm",
        ),
        (&["start"], "unknown command `start`; did you mean `serve`?"),
        (
            &["version"],
            "unknown command `version`; did you mean `--version`?",
        ),
        (
            &["serve", "--offset", "5"],
            "unknown flag `--offset`; did you mean `--port-offset`?",
        ),
        (
            &["serve", "--run-mode", "step"],
            "unknown flag `--run-mode`; `ts3100 ctl run-mode` sets the operation mode",
        ),
        (&["serve", "--time", "10x"], "found `10x`; did you mean `x10`?"),
        (
            &["ctl", "outputs", "5", "force"],
            "Usage: ts3100 ctl outputs <LINE> force <STATE>",
        ),
        (
            &["ctl", "override", "150"],
            "expected a whole number from 1 to 100, found `150`",
        ),
        (
            &["ctl", "pose"],
            "unknown command `pose`; did you mean `arm pose`?",
        ),
        (
            &["ctl", "clock", "advance", "-5"],
            "cannot read `-5` as a duration",
        ),
        (&["ctl", "clock", "mode", "10x"], "did you mean `x10`?"),
        (
            &["serve", "--port", "11000"],
            "unknown flag `--port`; did you mean `--port-offset`?",
        ),
        (
            &["run", "--din", "x", "a.scol"],
            "expected a line, 1-64, 101-164, 201-264, 301-364, 401-464, found `x`",
        ),
        (
            &["diff", "--value-tolerance", "x", "a", "b"],
            "expected a number, found `x`",
        ),
        (
            &["ctl", "call", "PUT", "/servo", ""],
            "body: the JSON ends too early",
        ),
        (
            &["ctl", "breakpoints", "x"],
            "expected a whole number, at least 1, found `x`",
        ),
        (
            &["ctl", "breakpoints", "none"],
            "unknown word `none`; did you mean `--none`?",
        ),
        (&["ctl", "servo", "1"], "a similar value exists: 'on'"),
        (
            &["ctl", "jog", "J1", "plus"],
            "unknown command `J1`; the direction comes first: `ts3100 ctl jog plus 1` or",
        ),
        (
            &["ctl", "jog", "plus", "9"],
            "expected an axis from 1 to 8, found `9`",
        ),
        (
            &["ctl", "wires", "outside", "x", "on"],
            "unknown command `on`; name the line and its state: `ts3100 ctl wires NAME on`\n\nFor",
        ),
        (
            &["ctl", "wait", "--within", "-1", "idle"],
            "cannot read `-1` as a duration",
        ),
        (
            &["host", "127.0.0.1:1", "rn", "--wait", "1", "s"],
            "unexpected `s` after `1`; write a duration as one word: `1s`",
        ),
        (
            &["run", "a.scol", "--lcov", "-"],
            "this report has to be a file; ./- is a file of this name",
        ),
        (
            &["serve", "--findings", "-"],
            "this report has to be a file; ./- is a file of this name",
        ),
        (
            &["survey", "127.0.0.1:1", "--out", "-"],
            "this report has to be a file; ./- is a file of this name",
        ),
        (
            &["survey", "infer", "day.txt", "--out=-"],
            "this report has to be a file; ./- is a file of this name",
        ),
        (
            &["serve", "--bind", "0.0.0.0"],
            "unknown flag `--bind`; did you mean `--listen`?",
        ),
        (
            &["exec", "--bind", "0.0.0.0"],
            "unknown flag `--bind`; did you mean `--listen`?",
        ),
        (
            &["ctl", "time", "stepped"],
            "unknown command `time`; did you mean `clock`?",
        ),
        (
            &["ctl", "advance", "5"],
            "unknown command `advance`; did you mean `clock advance`?",
        ),
    ] {
        let output = run(words);
        let code = if words[0] == "exec" { 125 } else { 2 };
        assert_eq!(output.status.code(), Some(code), "{words:?}");
        let error = stderr(&output);
        assert!(
            error.starts_with("error: ") && error.contains(expected),
            "{words:?}: {error}"
        );
    }
}

#[test]
fn files_of_the_pc_in_the_directory_are_those_of_load_and_one_bad_file_is_skipped() {
    let directory = TempDir::new("binary");
    let drive = directory.path().join("drive");
    std::fs::create_dir_all(&drive).unwrap();
    let crlf = PICK.replace('\n', "\r\n");
    let given: [(&str, &[u8]); 3] = [
        ("pick.scol", crlf.as_bytes()),
        ("tab.scol", b"PROGRAM TAB\n\tSPEED = 20\nEND\n"),
        ("Thumbs.db", b"\xd0\xcf\x11\xe0"),
    ];
    for (name, content) in given {
        std::fs::write(drive.join(name), content).unwrap();
    }
    let serve = Serve::start(&["--drive", drive.to_str().unwrap(), "--select", "PICK"]);
    assert_eq!(serve.host(&["ul", "PICK"]).stdout, PICK.as_bytes());
    let files = stdout(&serve.host(&["ca"]));
    assert!(!files.contains("TAB") && !files.contains("THUMBS"), "{files}");
    let log = stderr(&serve.signal("TERM"));
    for (name, place) in [
        (
            "tab.scol",
            "line 2, character 1: expected printable ASCII, found the byte 09",
        ),
        (
            "Thumbs.db",
            "line 1, character 1: expected printable ASCII, found the byte D0",
        ),
    ] {
        let warnings = log
            .lines()
            .filter(|line| line.contains("WARN") && line.contains(name) && line.contains(place));
        assert_eq!(warnings.count(), 1, "{name}: {log}");
    }
    for (name, content) in given {
        assert_eq!(std::fs::read(drive.join(name)).unwrap(), content, "{name}");
    }
}

#[test]
fn a_file_has_one_limit_whichever_way_it_takes_to_the_drive() {
    let directory = TempDir::new("binary");
    let most = directory.file("most.scol", "\n".repeat(99_999));
    let big = directory.file("big.scol", "\n".repeat(100_000));
    let huge = directory.file("huge.scol", "\n".repeat(300_000));
    let serve = Serve::start(&["--load", &most]);
    let control = serve.control.clone().unwrap();
    // As `host dl`, without its pause of 50 ms before each of 413 texts.
    let mut host = serve.dial(0);
    host.exchange(b"\x02DL,MOST\r\x03", b"\x02OK\r\x03");
    let content = [&b"FL,"[..], &[b'\n'; 99_999], b"\x1A"].concat();
    for part in content.chunks(242) {
        host.exchange(&[b"\x02", part, b"\x03"].concat(), b"\x02OK\r\x03");
    }
    expect_code(
        &run(&["ctl", "--url", &control, "files", "put", "MOST2", &most]),
        0,
    );
    for file in [&big, &huge] {
        let expected = format!("cannot read {file}: a file of the RAM drive has at most 99999 bytes");
        for words in [
            &["serve", "--ports", "auto", "--load", file][..],
            // Refused before it is sent, or anybody is called at all.
            &["host", "127.0.0.1:1", "dl", file],
            &["ctl", "--url", &control, "files", "put", "BIG", file],
            &["check", &huge],
            &["fmt", &huge],
            &["run", &huge],
        ] {
            let output = run(words);
            expect_code(&output, 2);
            let expected = match words.len() {
                2 => "a file of the RAM drive has at most 99999 bytes",
                _ => expected.as_str(),
            };
            assert!(
                stderr(&output).contains(expected),
                "{words:?}: {}",
                stderr(&output)
            );
        }
    }
}

#[test]
fn the_address_to_listen_on_may_be_a_name_of_this_computer() {
    let serve = Serve::start(&["--listen", "localhost", "--control", "off"]);
    expect_code(&serve.host(&["su"]), 0);
    for name in ["no-such-name.invalid", "localhost:1000", ""] {
        let output = run(&["serve", "--ports", "auto", "--listen", name]);
        expect_code(&output, 2);
        let error = stderr(&output);
        assert!(error.contains("a name that resolves to one"), "{name}: {error}");
    }
}

#[test]
fn a_quit_signal_ends_it_like_a_term_signal() {
    let serve = Serve::start(&[]);
    expect_code(&serve.signal("QUIT"), 0);
}

#[test]
fn a_duration_has_one_form_on_the_whole_command_line() {
    const EXPECTED: &str = "cannot read `5x` as a duration: expected e.g. `5s`, `500 ms`, `1.5 s`";
    for words in [
        &["ctl", "clock", "advance", "5x"][..],
        &["ctl", "clock", "advance", "1", "--wall", "5x"],
        &["ctl", "wait", "idle", "--within", "5x"],
        &["ctl", "inputs", "5", "pulse", "on", "5x"],
        &["ctl", "state", "--timeout", "5x"],
        &["host", "127.0.0.1:1", "su", "--timeout", "5x"],
        &["host", "127.0.0.1:1", "rn", "--wait=5x"],
        &["run", "none.scol", "--max-time", "5x"],
        &["ready", "--wait", "5x"],
        &["tap", "127.0.0.1", "--connect-timeout", "5x"],
        &["diff", "none.txt", "--time-tolerance", "5x"],
        &["diff", "none.txt", "--patience", "5x"],
    ] {
        let output = run(words);
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        let error = stderr(&output);
        assert!(error.contains(EXPECTED), "{words:?}: {error}");
    }
    // Outside of its bounds, a duration is one all the same.
    let output = run(&["ready", "--wait", "25000 min"]);
    let error = stderr(&output);
    assert!(error.contains("expected a duration from 0 s to 24 h"), "{error}");
}

#[test]
fn the_errors_of_the_parser_are_painted_as_all_others() {
    for words in [&["srve"][..], &["ctl", "override", "150"]] {
        let error = ts3100(words).env("CLICOLOR_FORCE", "1").output().unwrap();
        let error = stderr(&error);
        assert!(
            error.starts_with("\u{1b}[1m\u{1b}[31merror"),
            "{words:?}: {error:?}"
        );
    }
}
