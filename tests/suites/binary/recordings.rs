//! `serve --transcript`, `tap` and `diff` as commands: what one records, another plays; a killed process leaves a
//! whole transcript.

use super::support::{Serve, expect_code, run, stderr, stdout, ts3100};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::Stdio;
use ts3100_tests::host::Host;
use ts3100_tests::testing::TempDir;

const PICK: &str =
    "PROGRAM PICK\nX = 0\nPRINT IP1, \"REQ\", CR\nINPUT IP1, X\nPRINT IP1, \"AT\", X, CR\nEND\n";

/// A host's errand: status, a refused selection, a program with its dialogue.
fn errand(mut host: TcpStream, mut program: TcpStream) {
    host.write_all(b"\x02SU\r\x03").unwrap();
    host.read_until(0x03);
    host.exchange(b"\x02OK\r\x03\x02SL,NOPE\r\x03", b"\x02NG\r\x03");
    host.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    host.exchange(b"\x02SL,PICK\r\x03", b"\x02OK\r\x03");
    host.exchange(b"\x02RN\r\x03", b"\x02OK\r\x03");
    program.exchange(b"", b"REQ\r");
    program.exchange(b"7\r", b"AT           7\r");
    host.exchange(b"", b"\x02SP\r\x03");
}

#[test]
#[cfg(unix)]
fn a_transcript_into_a_pipe_without_a_reader_is_refused_and_holds_nothing_up() {
    let directory = TempDir::new("binary");
    let pipe = directory.path().join("pipe");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
    assert!(made.success());
    for (path, found) in [
        (pipe.as_path(), "this pipe has no reader; start its reader first"),
        (Path::new("/dev/null"), "expected a regular file, found a device"),
        (directory.path(), "expected a regular file, found a directory"),
    ] {
        let path = path.to_str().unwrap();
        for words in [
            &["exec", "--transcript", path, "--", "true"][..],
            &["tap", "127.0.0.1", "--ports", "auto", "--transcript", path],
        ] {
            let output = run(words);
            assert!(!output.status.success(), "{words:?}");
            let expected = format!("cannot write the transcript {path}: {found}");
            assert!(stderr(&output).contains(&expected), "{}", stderr(&output));
        }
    }
}

/// A recording proxy between hosts and an emulator.
fn tap(serve: &Serve, transcripts: &[String]) -> Serve {
    let [ip0, ip1] = [0, 1].map(|channel| serve.ports[channel].unwrap());
    let channels = format!("ip0={ip0},ip1={ip1}");
    let mut words = vec!["tap", "127.0.0.1", "--channels", &channels];
    for transcript in transcripts {
        words.extend(["--transcript", transcript]);
    }
    Serve::ready(&words)
}

#[test]
fn what_serve_records_is_the_same_when_played_and_a_kill_loses_nothing() {
    let directory = TempDir::new("binary");
    let pick = directory.file("pick.scol", PICK);
    let names = ["a.txt", "a.jsonl", "a.pcapng"].map(|name| directory.file(name, ""));
    let mut words = vec!["--load", &pick];
    for name in &names {
        words.extend(["--transcript", name]);
    }
    let serve = Serve::start(&words);
    errand(serve.dial(0), serve.dial(1));
    serve.signal("KILL");
    for name in &names[..2] {
        let output = run(&["diff", name]);
        expect_code(&output, 0);
        assert!(
            stdout(&output).contains("8 answers compared: 0 differ in bytes"),
            "{}",
            stdout(&output)
        );
    }
    let capture = run(&["diff", &names[2]]);
    assert_eq!(capture.status.code(), Some(2));
    assert!(
        stderr(&capture).contains("found a capture"),
        "{}",
        stderr(&capture)
    );
    assert!(std::fs::metadata(&names[2]).unwrap().len() > 2_000);
    let text = std::fs::read_to_string(&names[0]).unwrap();
    assert!(text.contains("file PICK\n| PROGRAM PICK\n"), "{text}");
    // An emulator of another option is told which one would be this robot's.
    let other = ["diff", &names[0], "--set", "su.layout=six-records"];
    assert!(!stdout(&run(&other)).contains("closer"));
    let output = run(&[other.as_slice(), &["--suggest"]].concat());
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stdout(&output).ends_with("\ncloser with --set su.layout=one-record: 0 parts left\n"),
        "{}",
        stdout(&output)
    );
    // One letter doctored: exactly that is told, and where.
    let doctored = directory.file("b.txt", text.replace("OVRD:100%", "OVRD:90%"));
    let output = run(&["diff", &doctored]);
    assert_eq!(output.status.code(), Some(1));
    let line = 1 + text.lines().position(|line| line.contains("OVRD")).unwrap();
    let printed = stdout(&output);
    assert!(
        printed.starts_with(&format!("{doctored}:{line}: IP0 at ")),
        "{printed}"
    );
    assert!(
        printed.contains("SU OVRD [su.ovrd], bytes 40-47: recorded `OVRD:90%`, emulator `OVRD:100%`"),
        "{printed}"
    );
    assert_eq!(
        run(&["diff", &doctored, "--ignore", "su.ovrd"]).status.code(),
        Some(0)
    );
    let output = run(&["diff", &doctored, "--json"]);
    let report: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(
        (report["bytes"].as_u64(), report["equal"].as_bool()),
        (Some(1), Some(false))
    );
    assert_eq!(report["differences"][0]["parts"][0]["key"], "su.ovrd");
    assert_eq!(report["differences"][0]["file_line"].as_u64(), Some(line as u64));
}

#[cfg(unix)]
#[test]
fn files_that_were_not_kept_are_not_kept_when_played() {
    let directory = TempDir::new("binary");
    let pick = directory.file("pick.scol", PICK);
    let names = ["a.txt", "a.jsonl"].map(|name| directory.file(name, ""));
    let (drive, away) = (directory.path().join("drive"), directory.path().join("away"));
    let words = [
        "--drive",
        drive.to_str().unwrap(),
        "--load",
        &pick,
        "--transcript",
        &names[0],
        "--transcript",
        &names[1],
    ];
    let serve = Serve::start(&words);
    let mut host = serve.dial(0);
    let mut steps = |answer: &[u8]| {
        host.exchange(b"\x02DL,A\r\x03", b"\x02OK\r\x03");
        host.exchange(b"\x02FL,END\n\x1a\x03", answer);
        host.exchange(
            b"\x02ER,PICK\r\x03\x02ER,PICK\r\x03",
            &[answer, b"\x02NG\r\x03"].concat(),
        );
    };
    std::fs::rename(&drive, &away).unwrap();
    steps(b"\x02NG\r\x03");
    std::fs::rename(&away, &drive).unwrap();
    steps(b"\x02OK\r\x03");
    serve.signal("KILL");
    for name in &names {
        let text = std::fs::read_to_string(name).unwrap();
        assert_eq!(text.matches("unkept PICK the directory ").count(), 2, "{text}");
        let output = run(&["diff", name]);
        expect_code(&output, 0);
        // Without these records everything is kept.
        let mut lines: Vec<&str> = text.lines().filter(|line| !line.contains("unkept")).collect();
        lines.push("");
        let ending = name.rsplit('.').next().unwrap();
        let other = directory.file(&format!("b.{ending}"), lines.join("\n"));
        assert_eq!(run(&["diff", &other]).status.code(), Some(1));
    }
}

#[test]
fn what_a_tap_records_is_played_to_the_emulator() {
    let directory = TempDir::new("binary");
    let pick = directory.file("pick.scol", PICK);
    let names = ["a.txt", "a.jsonl", "a.pcapng"].map(|name| directory.file(name, ""));
    let serve = Serve::start(&["--load", &pick]);
    let tap = tap(&serve, &names);
    errand(tap.dial(0), tap.dial(1));
    drop(tap);
    let recorded = std::fs::read_to_string(&names[0]).unwrap();
    assert!(
        recorded.starts_with("origin: observed, ts3100 tap ") && recorded.contains("calendar: "),
        "{recorded}"
    );
    for name in &names[..2] {
        let output = run(&["diff", name, "--load", &pick, "--time-tolerance", "5s"]);
        expect_code(&output, 0);
    }
    // Without the file the emulator refuses, and says why.
    let output = run(&["diff", &names[0]]);
    assert_eq!(output.status.code(), Some(1));
    let printed = stdout(&output);
    assert!(
        printed.contains("after `SL,PICK`: 1 part differs")
            && printed.contains("the emulator says: SL refused: "),
        "{printed}"
    );
}

#[test]
fn a_tap_without_a_file_writes_to_stdout_until_a_signal() {
    let serve = Serve::start(&[]);
    let real = serve.address(0);
    let mut child = ts3100(&[
        "tap",
        &real,
        "--ports",
        "auto",
        "--channels",
        "ip0",
        "-v",
        "--log-format",
        "json",
    ])
    .stdin(Stdio::null())
    .stdout(Stdio::piped())
    .stderr(Stdio::piped())
    .spawn()
    .unwrap();
    let mut log = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    log.read_line(&mut line).unwrap();
    let printed: serde_json::Value = serde_json::from_str(&line).unwrap();
    let message = printed["message"].as_str().unwrap();
    let own = message.strip_prefix("IP0: ").unwrap().split(' ').next().unwrap();
    let mut host = TcpStream::connect(own).unwrap();
    host.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    drop(serve);
    // The controller dies: the host hears of it, the tap stays and says so.
    assert!(matches!(host.read(&mut [0; 8]), Ok(0) | Err(_)));
    let mut next = TcpStream::connect(own).unwrap();
    assert!(matches!(next.read(&mut [0; 8]), Ok(0) | Err(_)));
    let id = child.id().to_string();
    assert!(
        std::process::Command::new("kill")
            .args(["-s", "TERM", &id])
            .status()
            .unwrap()
            .success()
    );
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let (mut recorded, mut rest) = (String::new(), String::new());
    child
        .stdout
        .take()
        .unwrap()
        .read_to_string(&mut recorded)
        .unwrap();
    log.read_to_string(&mut rest).unwrap();
    assert!(
        recorded.contains("> IP0 SO<CR>\n") && recorded.contains("< IP0 OK<CR>\n"),
        "{recorded}"
    );
    assert!(recorded.contains(" refused\n"), "{recorded}");
    assert!(rest.contains("cannot reach"), "{rest}");
}

#[test]
fn what_diff_and_tap_cannot_use_is_said() {
    let directory = TempDir::new("binary");
    let broken = directory.file("a.txt", "origin: observed\n> IP9 SO\n");
    let flags = directory.file("b.txt", "origin: observed\nflag: listen=0.0.0.0\n");
    let fine = directory.file("c.txt", "origin: observed\n");
    let gone = "origin: observed\n# 5 records before this one are no longer kept\n> IP0 SU<CR>\n";
    let gone = directory.file("d.txt", gone);
    let middle = "d.txt:2: cannot use a recording that begins in the middle of a run";
    for (words, expected) in [
        (vec!["diff", "nowhere.txt"], "cannot read nowhere.txt"),
        (vec!["diff", &broken], "a.txt:2: expected a port"),
        (vec!["diff", &flags], "a flag of the recording"),
        (vec!["diff", &gone], middle),
        (vec!["survey", "infer", &gone], middle),
        (vec!["view", &gone], middle),
        (
            vec!["diff", &fine, "--ignore", "everything"],
            "expected clock, versions",
        ),
        (vec!["diff", &fine, "--value-tolerance=-1"], "--value-tolerance"),
        (
            vec!["diff", &fine, "--time-tolerance", "5"],
            "cannot read `5` as a duration",
        ),
        (
            vec!["tap", "127.0.0.1", "--ports", "auto", "--ready-json"],
            "--transcript",
        ),
        (
            vec!["tap", "127.0.0.1", "--ports", "auto", "--transcript", "x.pcap"],
            ".pcapng",
        ),
        (
            vec![
                "tap",
                "127.0.0.1",
                "--ports",
                "auto",
                "--transcript",
                "/nowhere-at-all/x.txt",
            ],
            "cannot write",
        ),
    ] {
        let output = run(&words);
        let error = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {error}");
        assert!(error.contains(expected), "{words:?}: {error}");
    }
    let output = run(&["diff", &fine]);
    expect_code(&output, 0);
}
