//! `ts3100 host` and `ts3100 check` against a running emulator, and against peers that answer nothing or
//! nonsense.

use super::support::{Serve, expect_code, run, stderr, stdout, ts3100};
use std::io::{Read, Write};
use std::net::TcpListener;
use ts3100_tests::host::Host;
use ts3100_tests::testing::TempDir;

const COUNTER: &str = "GLOBAL\nCOUNT = 7\nEND\nPROGRAM COUNTER\nCOUNT = COUNT + 1\nEND\n";

pub fn ok(serve: &Serve, words: &[&str]) -> String {
    let output = serve.host(words);
    expect_code(&output, 0);
    stdout(&output)
}

#[test]
fn a_day_of_a_host_in_both_framings() {
    let directory = TempDir::new("binary");
    // More than one text, so that the file is divided.
    let long = COUNTER.to_owned() + &"REMARK a line to make the file longer than a text\n".repeat(20);
    let long = long.replace("END\nREMARK", "REMARK") + "END\n";
    let file = directory.file("counter.scol", &long);
    for (framing, end) in [(&[][..], "SP"), (&["--no-stx"], "stopped")] {
        let serve = Serve::start(&[]);
        let ok = |words: &[&str]| ok(&serve, &[framing, words].concat());
        assert!(ok(&["dl", &file]).starts_with("OK, "));
        assert_eq!(ok(&["ul", "COUNTER"]), long);
        assert!(ok(&["ca"]).lines().any(|line| line.starts_with("COUNTER")));
        assert_eq!(ok(&["SO"]), "OK\n");
        assert_eq!(ok(&["SL", "COUNTER"]), "OK\n");
        assert!(ok(&["su"]).contains("COUNTER"));
        assert_eq!(ok(&["rn", "--wait", "20"]), format!("OK\n{end}\n"));
        assert_eq!(ok(&["mr", "COUNT"]), "8\n");
        assert_eq!(ok(&["mw", "COUNT", "41"]), "OK\n");
        assert_eq!(ok(&["mr", "COUNT", "--type", "0"]), "41\n");
        let status: serde_json::Value = serde_json::from_str(&ok(&["sf", "--json"])).unwrap();
        assert_eq!(
            (&status["servo"], &status["status"]),
            (&true.into(), &"stop (reset)".into())
        );
        assert!(
            ok(&["sf"])
                .lines()
                .any(|line| line.starts_with("servo") && line.ends_with("on"))
        );
        assert_eq!(ok(&["iw", "3", "1"]), "OK\n");
        assert_eq!(ok(&["ec", "ovrd", "50"]), "OK\n");
        assert!(ok(&["su", "--json"]).contains("\"override_percent\":50"));
        assert_eq!(ok(&["do", "SPEED", "=", "20"]), "OK\n");
        assert!(ok(&["vr"]).contains("TS3100"));
        ok(&["eu"]);
        ok(&["RS", "PRG"]);
        assert_eq!(ok(&["br"]), "OK\n");
    }
}

#[test]
fn sf_is_read_in_every_form_it_has() {
    for words in [
        &[][..],
        &["--model", "tsl3000-thl400"],
        &["--dialect", "manual"],
        &["--set", "sf.split=several", "--set", "text.stx=detect"],
    ] {
        let serve = Serve::start(&[words, &["--servo-on"]].concat());
        let status: serde_json::Value = serde_json::from_str(&ok(&serve, &["sf", "--json"])).unwrap();
        assert_eq!(status["servo"], true, "{words:?}");
        assert_eq!(status["master_mode"], "EXT (HOST)", "{words:?}");
    }
}

#[test]
fn refusals_are_exit_code_one() {
    let serve = Serve::start(&[]);
    for words in [
        &["sl", "ABSENT"][..],
        &["ul", "ABSENT"],
        &["rn"],
        &["mr", "ABSENT"],
        &["do", "MOVE", "P"],
    ] {
        let output = serve.host(words);
        assert_eq!(
            (output.status.code(), stdout(&output).as_str()),
            (Some(1), "NG\n"),
            "{words:?}"
        );
    }
}

#[test]
fn every_reply_has_a_form_in_json() {
    let serve = Serve::start(&[]);
    let directory = TempDir::new("binary");
    let file = directory.file("a.scol", "PROGRAM A\nEND\n");
    let json = |words: &[&str]| stdout(&serve.host(&[words, &["--json"]].concat()));
    assert_eq!(
        json(&["dl", &file]),
        "{\"reply\":\"OK\",\"bytes\":14,\"texts\":1}\n"
    );
    assert_eq!(json(&["ul", "A"]), "{\"text\":\"PROGRAM A\\nEND\\n\"}\n");
    assert_eq!(json(&["so"]), "{\"reply\":\"OK\"}\n");
    assert_eq!(json(&["sl", "NONE"]), "{\"reply\":\"NG\"}\n");
    let missing = stderr(&serve.host(&["--json"]));
    assert!(
        missing.contains("the command is missing\n\nCommands of `ts3100 host`: su sf ca"),
        "{missing}"
    );
}

#[test]
fn wrong_words_are_not_sent() {
    let serve = Serve::start(&[]);
    for (words, expected) in [
        (&["rs", "everything"][..], "cannot send `RS,everything`: "),
        (&["sl", "2X"], "cannot send `SL,2X`: "),
        (&["mw", "2P", "1", "2"], "cannot send `MW,0 2P -1 1 2`: "),
    ] {
        let output = serve.host(words);
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        assert!(stderr(&output).contains(expected), "{}", stderr(&output));
    }
}

/// A peer that reads one text and answers with these bytes; they are its address.
pub fn peer(answer: &'static [u8]) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        stream.read_until(0x03);
        stream.write_all(answer).unwrap();
        // Until the host closes.
        let _ = stream.read_to_end(&mut Vec::new());
    });
    address
}

#[test]
fn communication_errors_are_exit_code_three_and_say_what_was_expected() {
    for (answer, words, expected) in [
        (
            &b""[..],
            &["so", "--timeout", "0.05"][..],
            "no reply within 0.05 s: expected OK or NG",
        ),
        (b"\x02FL,A\x1a\x03", &["so"], "expected OK or NG, found FL,A<EOF>"),
        (b"\x02WHAT\r\x03", &["su"], "expected FL or NG, found WHAT<CR>"),
        (
            b"HTTP/1.0 400 Bad Request\r\n\r\n",
            &["su"],
            "the reply is HTTP, as from the control interface: give the address of IP0",
        ),
        (b"\x02OK\r\x03", &["sf"], "expected FL or NG, found OK<CR>"),
        (b"\x02FL,MODE?\x1a\x03", &["su"], "cannot read the reply to SU"),
    ] {
        let address = peer(answer);
        let output = run(&[&["host", &address], words].concat());
        assert_eq!(output.status.code(), Some(3), "{words:?}");
        assert!(
            stderr(&output).contains(expected) && stderr(&output).contains("error: "),
            "{words:?}: {}",
            stderr(&output)
        );
    }
    let free = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap()
        .to_string();
    let output = run(&["host", &free, "su"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(
        stderr(&output).contains("cannot connect to"),
        "{}",
        stderr(&output)
    );
    let incomplete = run(&["host", "127.0.0.1", "su"]);
    assert_eq!(incomplete.status.code(), Some(2));
    assert_eq!(
        stderr(&incomplete),
        "error: cannot connect to `127.0.0.1`: add the port of IP0: 127.0.0.1:1000\n"
    );
}

#[test]
fn the_answer_of_another_port_of_the_robot_says_where_commands_go() {
    let serve = Serve::start(&[]);
    let ip0 = serve.address(0);
    let output = run(&["host", &serve.address(1), "su", "--timeout", "0.05"]);
    assert_eq!(output.status.code(), Some(3));
    let expected = format!(". This is IP1 of the robot; commands go to IP0: {ip0}\n");
    assert!(stderr(&output).ends_with(&expected), "{}", stderr(&output));
    let control = serve.control.as_deref().unwrap();
    let output = run(&["host", control.trim_start_matches("http://"), "su"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(
        stderr(&output).contains("the reply is HTTP"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn a_file_without_an_end_ends_with_the_time_for_everything() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        // A text for the command, and for each OK.
        loop {
            stream.read_until(0x03);
            if stream.write_all(b"\x02FL,AND SO ON\n\x03").is_err() {
                break;
            }
        }
    });
    let output = run(&["host", &address, "su", "--total", "0.3"]);
    assert_eq!(output.status.code(), Some(3));
    let expected = "no reply within 0.3 s in total: expected the next text of the file";
    assert!(stderr(&output).contains(expected), "{}", stderr(&output));
}

// clause: CMD-SP-05
#[test]
fn an_sp_in_between_is_no_answer() {
    let address = peer(b"\x02SP\r\x03\x02OK\r\x03");
    let output = run(&["host", &address, "so"]);
    assert_eq!(
        (output.status.code(), stdout(&output).as_str()),
        (Some(0), "OK\n")
    );
    assert!(stderr(&output).contains("warning: SP came before the reply"));
    let address = peer(b"\x02SP\r\x03\x02NG\r\x03");
    let output = run(&["host", &address, "sf"]);
    assert_eq!(
        (output.status.code(), stdout(&output).as_str()),
        (Some(1), "NG\n"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn check_says_what_the_compiler_says() {
    let directory = TempDir::new("binary");
    let good = directory.file("good.scol", COUNTER);
    let bad = directory.file("bad.scol", "PROGRAM BAD\nGOTO NOWHERE\nEND\n");
    assert_eq!(run(&["check", &good]).status.code(), Some(0));
    let output = run(&["check", &good, &bad]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stdout(&output).contains("bad.scol:2:"), "{}", stdout(&output));
    let missing = directory.path().join("missing.scol");
    let output = run(&["check", missing.to_str().unwrap(), &bad]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("missing.scol"));
    let mut piped = ts3100(&["check", "-"]);
    let piped = piped.stdin(std::fs::File::open(&bad).unwrap()).output().unwrap();
    assert_eq!(piped.status.code(), Some(1));
    assert!(stdout(&piped).contains("<stdin>:2:"), "{}", stdout(&piped));
    let scara = directory.file("scara.scol", "PROGRAM S\nMOVE POINT(300,0,50,0,0,LEFTY)\nEND\n");
    assert_eq!(
        run(&["check", "--model", "tsl3000-thl400", &scara]).status.code(),
        Some(0)
    );
}

/// A peer that sends these bytes again and again to whoever connects.
fn flood(bytes: &'static [u8]) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let bytes = bytes.repeat(1_000);
        while stream.write_all(&bytes).is_ok() {}
    });
    address
}

#[test]
fn a_peer_that_floods_a_host_does_not_flood_its_terminal() {
    for bytes in [
        &b"\x02SP\r\x03"[..],
        b"garbage\r\n",
        b"\x02SP",
        b"\x02WHAT\r\x03",
        b"\x02FL,A",
    ] {
        for command in ["su", "sf", "so"] {
            let output = run(&["host", &flood(bytes), command, "--timeout", "0.3"]);
            expect_code(&output, 3);
            let error = stderr(&output);
            assert!(error.contains("error: "), "{bytes:?}, {command}: {error}");
            assert!(error.len() < 4_096, "{bytes:?}, {command}: {} bytes", error.len());
        }
    }
}
