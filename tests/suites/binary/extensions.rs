//! `ts3100 host` with variables of every type and with the commands beyond the manual.

use super::client::{ok, peer};
use super::support::{Serve, expect_code, run, stderr, stdout};
use serde_json::Value;
use ts3100_tests::testing::TempDir;

const KINDS: &str = "GLOBAL\nCOUNT = 7\nLEVEL = 1.5\nDIM TABLE(3) AS INTEGER\nEND\nPROGRAM KINDS\nCOUNT = 7\nEND\n\
                     DATA\nPOINT P1=400,0,200,0,0,0,0,0/12111\nTRANS W1=1,2,3,4,5,6\nEND\n";

fn json(serve: &Serve, words: &[&str]) -> Value {
    serde_json::from_str(&ok(serve, &[words, &["--json"]].concat())).unwrap()
}

// clause: CMD-MR-04 CMD-MR-05 CMD-MW-01 CMD-MW-02
#[test]
fn variables_are_read_and_written_by_word_by_code_or_without_a_type() {
    let directory = TempDir::new("binary");
    let file = directory.file("kinds.scol", KINDS);
    let serve = Serve::start(&["--load", &file, "--select", "KINDS"]);
    let values = |words: &[&str]| ok(&serve, words);
    for words in [
        &["mr", "COUNT"][..],
        &["mr", "COUNT", "0"],
        &["mr", "COUNT", "-1"],
        &["mr", "COUNT", "integer"],
        &["mr", "COUNT", "--type", "0"],
        &["mr", "COUNT", "--type", "-1"],
    ] {
        assert_eq!(values(words), "7\n", "{words:?}");
    }
    assert_eq!(values(&["mw", "LEVEL", "-2.5"]), "OK\n");
    assert_eq!(values(&["mr", "LEVEL", "real"]), "-2.5\n");
    assert_eq!(values(&["mw", "TABLE(2)", "9"]), "OK\n");
    assert_eq!(values(&["mw", "TABLE(3)", "8", "--type", "integer"]), "OK\n");
    assert_eq!(values(&["mr", "TABLE(2)", "integer"]), "9\n");
    assert_eq!(values(&["mr", "TABLE(3)", "5"]), "8\n");
    assert_eq!(values(&["mw", "W1", "6", "5", "4", "3", "2", "-1.5"]), "OK\n");
    let coordinate = json(&serve, &["mr", "W1", "coordinate"]);
    assert_eq!(coordinate, serde_json::json!([6.0, 5.0, 4.0, 3.0, 2.0, -1.5]));
    assert_eq!(
        json(&serve, &["mr", "P1", "position"]).as_array().unwrap().len(),
        9
    );
    assert_eq!(values(&["mw", "--restore", "COUNT", "41"]), "OK\n");
    assert!(values(&["ul", "KINDS"]).contains("COUNT = 41"));
    assert_eq!(
        serve.host(&["mr", "COUNT", "real"]).status.code(),
        Some(1),
        "wrong type"
    );
    for words in [
        &["mr", "COUNT", "point"][..],
        &["mr", "COUNT", "0", "--type", "0"],
    ] {
        let output = serve.host(words);
        expect_code(&output, 2);
    }
}

#[test]
fn the_commands_beyond_the_manual_are_sent_and_their_answers_decoded() {
    for framing in [&[][..], &["--no-stx"]] {
        let serve = Serve::start(&["--servo-on"]);
        let ok = |words: &[&str]| ok(&serve, &[framing, words].concat());
        let json = |words: &[&str]| json(&serve, &[framing, words].concat());
        for words in [
            &["ho", "1", "8", "165"][..],
            &["wd", "60000", "2"],
            &["wd", "0", "0"],
            &["zs", "work", "W1", "1", "-2.5", "3", "4", "5", "6"],
            &["zs", "tool", "T1", "0", "0", "100", "0", "0", "0"],
            &["rs", "err"],
            &["rs", "ERR"],
        ] {
            assert_eq!(ok(words), "OK\n", "{words:?}");
        }
        assert_eq!(
            json(&["io"])["outputs_on"].as_array().unwrap()[..4],
            [1, 3, 6, 8].map(Value::from)
        );
        assert_eq!(ok(&["iw", "1", "1"]), "OK\n");
        assert_eq!(ok(&["hi", "1", "8"]), "0\n", "outputs are no inputs");
        let status = json(&["sm"]);
        assert_eq!(
            (&status["servo"], &status["master_mode"], &status["status"]),
            (&true.into(), &"EXT (ETHER)".into(), &"stop (reset)".into())
        );
        assert!(
            ok(&["sm"])
                .lines()
                .any(|line| line.starts_with("run mode") && line.ends_with("cycle"))
        );
        for which in ["0", "3"] {
            let joint = json(&["pr", which]);
            assert_eq!(joint["values"].as_array().unwrap().len(), 8);
            assert_eq!(joint["configuration"], Value::Null);
        }
        assert!(json(&["pr", "4"])["configuration"].is_number());
        assert_eq!(
            ok(&["pr", "0"]).lines().count(),
            1,
            "joints have no configuration"
        );
        assert_eq!(ok(&["pr", "5"]).lines().count(), 2);
        assert_eq!(json(&["vl", "1"])["values"][0], 0.0);
        assert_eq!(ok(&["ac"]), "(none)\n");
        ok(&["ah"]);
    }
}

#[test]
fn jogging_goes_by_words_or_numbers() {
    let serve = Serve::start(&["--servo-on"]);
    for words in [
        &["md", "inching"][..],
        &["md", "1"],
        &["rt", "fast"],
        &["rt", "0"],
        &["sc", "world"],
        &["sc", "0"],
        &["jg", "1", "+"],
        &["jg", "1", "-"],
        &["jg", "1", "!"],
    ] {
        assert_eq!(ok(&serve, words), "OK\n", "{words:?}");
    }
    let status = json(&serve, &["sf"]);
    assert_eq!(
        (
            &status["guide_mode"],
            &status["guide_rate"],
            &status["guide_coordinate"]
        ),
        (&1.into(), &0.into(), &0.into())
    );
    for words in [
        &["md", "hopping"][..],
        &["jg", "1", "x"],
        &["jg", "9", "+"],
        &["pr", "6"],
        &["hi", "1", "33"],
        &["wd", "700", "3"],
        &["wd", "700", "4"],
        &["wd", "100000", "2"],
    ] {
        let output = serve.host(words);
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        assert!(stderr(&output).contains("cannot send `"), "{}", stderr(&output));
    }
}

#[test]
fn the_manuals_dialect_refuses_them() {
    let serve = Serve::start(&["--dialect", "manual"]);
    for words in [
        &["sm"][..],
        &["io"],
        &["pr", "0"],
        &["ac"],
        &["md", "1"],
        &["rs", "err"],
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
fn numbers_positions_and_alarms_are_shown_readably() {
    for (answer, words, expected) in [
        (&b"\x02FL,165\r\x1a\x03"[..], &["hi", "1", "8"][..], "165\n"),
        (
            b"\x02FL,1.000,-2.500,3.000,4.000,5.000,0.000,2\x1a\x03",
            &["pr", "5"],
            "values         1.0 -2.5 3.0 4.0 5.0 0.0\nconfiguration  2\n",
        ),
        (
            b"\x02FL,1,002-046,port without a peer,2014-02-06 10:30:15\r\x1a\x03",
            &["ac"],
            "alarm  message              at                   docs\n\
             2-046  port without a peer  2014-02-06 10:30:15  ts3100 explain 2-046\n",
        ),
    ] {
        let output = run(&[&["host", &peer(answer)], words].concat());
        assert_eq!(stdout(&output), expected, "{}", stderr(&output));
    }
}

#[test]
fn the_words_of_io_may_look_like_anything_and_end_with_eof_or_not() {
    // An ETX, an EOF and the letters SP among them.
    let mut words = [0u8; 80];
    words[1] = 0x03;
    words[17] = 0x1A;
    words[40..42].copy_from_slice(&[0x02, 0x03]);
    words[42..44].copy_from_slice(b"SP");
    for end in [&b"\x03"[..], b"\x1a\x03", b"\x1a\r\x03"] {
        for before in [&b""[..], b"\x02SP\r\x03"] {
            let answer = [before, b"\x02FL,", &words, end].concat();
            let address = peer(answer.leak());
            let output = run(&["host", &address, "io", "--json"]);
            assert_eq!(
                stdout(&output),
                "{\"inputs_on\":[1,2,202,204,205],\"outputs_on\":[1,2,10,21,23,25,26,29,31]}\n",
                "{}",
                stderr(&output)
            );
        }
    }
    let output = run(&["host", &peer(b"\x02OK\r\x03"), "io"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(
        stderr(&output).contains("expected FL or NG, found OK<CR>"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn the_log_says_so_when_a_host_writes_a_decimal_comma() {
    let directory = TempDir::new("binary");
    let program = "GLOBAL\nRATE = 0.5\nEND\nPROGRAM COMMA\nEND\nDATA\nPOINT A1 = 1,2,3,4,5\nEND\n";
    let file = directory.file("comma.scol", program);
    let load = [
        "--load",
        &file,
        "--select",
        "COMMA",
        "--servo-on",
        "--model",
        "tsl3000-thl400",
    ];
    for (words, named) in [
        (&["do", "SPEED", "=", "1,5"][..], true),
        (&["do", "DELAY", "0,5"], true),
        (&["do", "MOVE", "A1", "WITH", "SPEED=50,5"], true),
        (&["do", "MOVE", "A1", "WITH", "SPEED=50,5,ACCEL=20"], true),
        (&["do", "MOVE", "A1", "WITH", "SPEED=50,NONE=1"], false),
        (&["do", "SPEED", "=", "nothing"], false),
        (&["mw", "RATE", "1,5"], true),
        (&["mw", "A1", "1,5", "2,5", "3", "4", "5", "1"], true),
        (&["mw", "A1", "1", "2", "3", "4", "0,5"], true),
        (&["mw", "A1", "1"], false),
    ] {
        let serve = Serve::start(&load);
        expect_code(&serve.host(words), 1);
        let log = stderr(&serve.signal("TERM"));
        assert_eq!(
            log.contains("write decimals with a point"),
            named,
            "{words:?}: {log}"
        );
    }
}
