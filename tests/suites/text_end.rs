//! Texts that CR ends instead of ETX (option `text.end`), bytes between texts, and the rest of a text that was given up.
//!
//! The decoder alone is tested in `ts3100-proto`; here it is what a host hears and when.

use std::time::Duration;
use ts3100_controller::findings::{Rule, rules};
use ts3100_controller::options::Options;
use ts3100_controller::{Config, Controller, Dialect, PanelAction, Port};
use ts3100_proto::text::{Checksum, EndRule, Terminator};
use ts3100_tests::round_trip::round_trip;
use ts3100_tests::{Robot, frame, notation};

const WAIT: u64 = 250;

fn with(dialect: Dialect, change: impl FnOnce(&mut Options)) -> Robot {
    let mut config = Config::new(dialect);
    config.options.serial_pacing = false;
    change(&mut config.options);
    let mut robot = Robot::with(config);
    robot.connect(Port::Ip0);
    robot
}

fn field() -> Robot {
    with(Dialect::Field, |_| {})
}

/// On a connection that is marked already: by one exchange of the host.
fn marked(mark: Terminator) -> Robot {
    let mut robot = field();
    let text: &[u8] = match mark {
        Terminator::Etx => b"SP\r\x03",
        Terminator::Cr => b"SP\r",
    };
    robot.raw(Port::Ip0, text);
    robot.advance_ms(WAIT);
    assert_eq!(heard(&mut robot), "OK<CR><ETX>");
    robot
}

/// What has come on IP0 since.
fn heard(robot: &mut Robot) -> String {
    notation::write(&robot.received(Port::Ip0))
}

fn after(robot: &mut Robot, bytes: &[u8]) -> String {
    robot.raw(Port::Ip0, bytes);
    heard(robot)
}

fn count(robot: &Robot, rule: &'static Rule) -> u64 {
    robot.findings.count(rule)
}

// clause: T6 T7
#[test]
fn a_stray_etx_in_the_same_segment_delays_no_text_that_cr_ends() {
    let mut robot = field();
    assert_eq!(after(&mut robot, b"\x03SP\r"), "");
    robot.advance_ms(WAIT);
    assert_eq!(heard(&mut robot), "OK<CR><ETX>");
}

// clause: T6 I1
#[test]
fn a_cr_that_came_last_is_the_end_after_250_ms_and_not_before() {
    for (pause, first, second) in [
        (Duration::from_micros(249_999), "", "OK<CR><ETX>"),
        (Duration::from_millis(250), "OK<CR><ETX>", ""),
    ] {
        let mut robot = field();
        assert_eq!(after(&mut robot, b"SP\r"), "");
        robot.advance(pause);
        assert_eq!(heard(&mut robot), first, "{pause:?}");
        // ETX is in time, or late and swallowed.
        assert_eq!(after(&mut robot, b"\x03"), second, "{pause:?}");
        assert_eq!(count(&robot, &rules::NO_ETX), u64::from(second.is_empty()));
        assert_eq!(count(&robot, &rules::BYTES_OUTSIDE), 0);
        // From now on the host is known.
        let at_once = after(&mut robot, b"SP\r");
        assert_eq!(at_once, first, "a CR ends a text at once after {pause:?}");
    }
}

// clause: T6
#[test]
fn each_pause_between_two_bytes_counts_anew() {
    let mut robot = field();
    for byte in b"SP\r" {
        robot.advance_ms(9_999);
        robot.raw(Port::Ip0, &[*byte]);
    }
    robot.advance_ms(WAIT - 1);
    assert_eq!(heard(&mut robot), "");
    robot.advance_ms(1);
    assert_eq!(heard(&mut robot), "OK<CR><ETX>");
}

// clause: T6 I2 I3 I4
#[test]
fn ok_with_cr_alone_acknowledges_and_gets_no_answer() {
    let mut robot = field();
    let content = "REMARK 0123456789\n".repeat(40);
    robot
        .seat
        .controller
        .put_file("LONG", content.as_bytes())
        .unwrap();
    assert_eq!(after(&mut robot, b"UL,LONG\r"), "");
    robot.advance_ms(WAIT);
    let first = robot.received(Port::Ip0);
    assert!(
        first.starts_with(b"FL,") && first.ends_with(b"\x03"),
        "no STX, but ETX"
    );
    robot.advance_ms(50);
    let second = after(&mut robot, b"OK\r");
    assert!(!second.is_empty() && !second.starts_with("OK"));
    for _ in 0..2 {
        robot.advance_ms(50);
        robot.raw(Port::Ip0, b"OK\r");
    }
    robot.received(Port::Ip0);
    assert_eq!(after(&mut robot, b"OK\r"), "");
    assert_eq!(after(&mut robot, b"NG\r"), "");
    assert_eq!(count(&robot, &rules::NO_ETX), 1, "UL alone");
    // OK counts for the mark like any other text.
    let mut robot = field();
    robot.raw(Port::Ip0, b"OK\r");
    robot.advance_ms(WAIT);
    assert_eq!(after(&mut robot, b"SP\r"), "OK<CR><ETX>");
    assert_eq!(count(&robot, &rules::NO_ETX), 1, "SP alone");
}

// clause: T6
#[test]
fn another_byte_after_the_cr_ends_the_text_at_once() {
    let mut robot = field();
    assert_eq!(after(&mut robot, b"SP\rSP\r"), "OK<CR><ETX>OK<CR><ETX>");
    let mut robot = field();
    assert_eq!(
        after(&mut robot, b"SP\r\x02SP\r\x03"),
        "OK<CR><ETX><STX>OK<CR><ETX>"
    );
}

// clause: T6 T7
#[test]
fn a_terminal_that_ends_lines_by_cr_and_lf_is_served() {
    let mut robot = field();
    for round in 0..3 {
        assert_eq!(after(&mut robot, b"SP\r\n"), "OK<CR><ETX>", "round {round}");
        robot.advance_ms(11_000);
    }
    let others = [
        &rules::BYTES_OUTSIDE,
        &rules::TEXT_UNFINISHED,
        &rules::UNKNOWN_COMMAND,
    ];
    assert_eq!(others.map(|rule| count(&robot, rule)), [0, 0, 0]);
    assert_eq!(count(&robot, &rules::NO_ETX), 3);
    // Letter by letter, and LF alone ends nothing.
    let mut robot = field();
    for byte in b"SP\r" {
        assert_eq!(after(&mut robot, &[*byte]), "");
    }
    assert_eq!(after(&mut robot, b"\n"), "OK<CR><ETX>");
    assert_eq!(after(&mut robot, b"SP\n"), "");
    robot.advance_ms(1_000);
    assert_eq!(heard(&mut robot), "");
}

// clause: T6 T27
#[test]
fn on_a_connection_that_sends_etx_a_cr_waits_for_it() {
    for first in [&b"SP\r\x03"[..], b"SP\x03", b"\x02SP\r\x03", b"OK\r\x03"] {
        let mut robot = field();
        robot.raw(Port::Ip0, first);
        robot.received(Port::Ip0);
        assert_eq!(after(&mut robot, b"SP\r"), "");
        robot.advance_ms(9_999);
        assert_eq!(heard(&mut robot), "");
        assert_eq!(after(&mut robot, b"\x03"), "OK<CR><ETX>");
        // Two commands and one ETX are one text of no known form.
        assert_eq!(after(&mut robot, b"SP\rSP\r\x03"), "NG<CR><ETX>");
        assert_eq!(count(&robot, &rules::NO_ETX), 0);
    }
}

// clause: T27
#[test]
fn an_etx_ends_a_bare_text_on_every_connection() {
    for mark in [Terminator::Etx, Terminator::Cr] {
        let mut robot = marked(mark);
        for text in [&b"SP\x03"[..], b"SP\r\x03"] {
            assert_eq!(after(&mut robot, text), "OK<CR><ETX>");
        }
        let at_once = after(&mut robot, b"SP\r") == "OK<CR><ETX>";
        assert_eq!(at_once, mark == Terminator::Cr, "the mark stays");
    }
}

// clause: T6
#[test]
fn a_file_ends_by_etx_whatever_the_host_is() {
    let served = [(b"PROGRAM A\rEND\r".as_slice(), "A"), (b" \r\nPROGRAM B\r", "B")];
    for (content, name) in served {
        let mut robot = marked(Terminator::Cr);
        assert_eq!(
            after(&mut robot, format!("DL,{name}\r").as_bytes()),
            "OK<CR><ETX>"
        );
        let (front, back) = content.split_at(content.len() / 2);
        assert_eq!(after(&mut robot, &[b"FL,", front].concat()), "");
        assert_eq!(after(&mut robot, b"\x03"), "OK<CR><ETX>");
        robot.raw(Port::Ip0, back);
        robot.advance_ms(1_000);
        assert_eq!(heard(&mut robot), "", "CR ends no text of a file");
        assert_eq!(after(&mut robot, b"\x1A\x03"), "OK<CR><ETX>");
        let stored = robot.seat.controller.drive().get(name).unwrap().to_vec();
        assert_eq!(stored, content);
        assert_eq!(after(&mut robot, b"SP\r"), "OK<CR><ETX>");
    }
}

// clause: T6 T7
#[test]
fn each_byte_of_a_bare_file_and_of_a_long_message_is_data() {
    let mut robot = marked(Terminator::Cr);
    let content = [&[b'A'; 100][..], b"\r \n ", &[b'B'; 20]].concat();
    assert_eq!(after(&mut robot, b"DL,F\r"), "OK<CR><ETX>");
    assert_eq!(
        after(&mut robot, &[b"FL,", &content[..100], b"\x03"].concat()),
        "OK<CR><ETX>"
    );
    assert_eq!(
        after(&mut robot, &[&content[100..], b"\x1A\x03"].concat()),
        "OK<CR><ETX>"
    );
    assert_eq!(robot.seat.controller.drive().get("F").unwrap(), content);
    // The second text of a message begins with a blank of its own.
    let long = format!("DO,PRINT TP,\"{}", "x".repeat(240));
    assert_eq!(long.len(), 253);
    assert_eq!(after(&mut robot, &[long.as_bytes(), b"\x03"].concat()), "");
    robot.raw(Port::Ip0, b" \"\r");
    robot.advance_ms(1_000);
    assert_eq!(heard(&mut robot), "", "CR ends no text of a message");
    assert_eq!(
        after(&mut robot, b"\x03"),
        "NG<CR><ETX>",
        "longer than a line of the language"
    );
    assert_eq!(after(&mut robot, b"SP\r"), "OK<CR><ETX>");
}

// clause: T27
#[test]
fn between_the_texts_of_a_download_a_late_etx_and_the_bytes_of_a_line_end_are_skipped() {
    let mut robot = field();
    robot.raw(Port::Ip0, b"DL,F\r");
    robot.advance_ms(WAIT);
    assert_eq!(heard(&mut robot), "OK<CR><ETX>");
    assert_eq!(after(&mut robot, b"\x03\r\n\0 FL,A\rB\x1A\x03"), "OK<CR><ETX>");
    assert_eq!(robot.seat.controller.drive().get("F").unwrap(), &b"A\rB"[..]);
    // With STX it is plain what lies between two texts.
    let mut robot = field();
    robot.command(Port::Ip0, "DL,F");
    let text = after(&mut robot, b"\r\n\x02FL,A\x03\r\n\0 \x02 B\x1A\x03\r\n");
    assert_eq!(text, "<STX>OK<CR><ETX><STX>OK<CR><ETX>");
    assert_eq!(robot.seat.controller.drive().get("F").unwrap(), &b"A B"[..]);
    assert_eq!(count(&robot, &rules::BYTES_OUTSIDE), 0);
}

// clause: T6
#[test]
fn the_mark_ends_with_the_connection_and_on_host_with_the_power() {
    let mut robot = marked(Terminator::Cr);
    robot.disconnect(Port::Ip0);
    robot.connect(Port::Ip0);
    assert_eq!(after(&mut robot, b"SP\r"), "", "a new host may send ETX");

    let mut robot = field();
    robot.connect(Port::Host);
    let on_host = |robot: &mut Robot| {
        robot.raw(Port::Host, b"SP\r");
        let at_once = robot.received(Port::Host);
        robot.advance_ms(WAIT);
        let later = robot.received(Port::Host);
        (!at_once.is_empty(), !later.is_empty())
    };
    assert_eq!(on_host(&mut robot), (false, true));
    for _ in 0..2 {
        robot.disconnect(Port::Host);
        robot.connect(Port::Host);
        assert_eq!(on_host(&mut robot), (true, false), "the line is the same");
    }
    robot.panel(PanelAction::PowerCycle);
    robot.connect(Port::Host);
    assert_eq!(on_host(&mut robot), (false, true));
}

// clause: T6
#[test]
fn a_snapshot_knows_what_a_text_waits_for_and_how_host_ends_its_texts() {
    // In the 250 ms.
    let mut robot = field();
    robot.raw(Port::Ip0, b"SP\r");
    robot.advance_ms(WAIT - 1);
    robot.seat.controller = round_trip(&robot.seat.controller);
    robot.advance_ms(1);
    assert_eq!(heard(&mut robot), "OK<CR><ETX>");
    robot.seat.controller = round_trip(&robot.seat.controller);
    assert_eq!(after(&mut robot, b"\x03SP\r"), "OK<CR><ETX>");
    assert_eq!(count(&robot, &rules::BYTES_OUTSIDE), 0);
    // In the rest of a text that was given up.
    robot.raw(Port::Ip0, b"S");
    robot.advance_ms(10_000);
    robot.seat.controller = round_trip(&robot.seat.controller);
    assert_eq!(after(&mut robot, b"P\rSP\r"), "OK<CR><ETX>");

    // Restored where a host is connected: IP0 is met anew unless it has said how it ends its texts, HOST is known.
    let restored = |port, now: &[u8]| {
        let mut past = field();
        past.connect(Port::Host);
        past.raw(port, b"SP\r");
        past.advance_ms(WAIT);
        let mut robot = field();
        robot.advance_ms(WAIT);
        robot.connect(Port::Host);
        robot.raw(port, now);
        robot.received(port);
        let mut controller: Controller = round_trip(&past.seat.controller);
        controller.adopt_peers(&robot.seat.controller);
        robot.seat.controller = controller;
        robot.raw(port, b"SP\r");
        !robot.received(port).is_empty()
    };
    assert!(restored(Port::Host, b""));
    assert!(
        !restored(Port::Host, b"SP\r\x03"),
        "the host that is there sends ETX"
    );
    assert!(!restored(Port::Ip0, b""), "a new conversation");
    assert!(restored(Port::Ip0, b"SP\rSP\r"), "it has just ended one by CR");
}

// clause: T6 T27
#[test]
fn the_option_says_whether_cr_ends_a_text() {
    let rules = [EndRule::Etx, EndRule::Cr, EndRule::Detect];
    for (dialect, stx) in [(Dialect::Field, "detect"), (Dialect::Manual, "required")] {
        let preset = with(dialect, |_| {});
        let expected = match dialect {
            Dialect::Field => EndRule::Detect,
            Dialect::Manual => EndRule::Etx,
        };
        assert_eq!(preset.seat.controller.config().options.text.end, expected);
        for end in rules {
            let mut robot = with(dialect, |options| options.text.end = end);
            let at_once = after(&mut robot, b"SP\r");
            robot.advance_ms(WAIT);
            let later = heard(&mut robot);
            let found = (at_once.as_str(), later.as_str());
            let wanted = match end {
                EndRule::Etx => ("", ""),
                EndRule::Cr => ("OK<CR><ETX>", ""),
                EndRule::Detect => ("", "OK<CR><ETX>"),
            };
            let wanted = if stx == "detect" { wanted } else { ("", "") };
            assert_eq!(found, wanted, "{end:?}, text.stx = {stx}");
            // With STX the end is ETX.
            robot.raw(Port::Ip0, b"\x02SP\r");
            robot.advance_ms(1_000);
            assert_eq!(heard(&mut robot), "", "{end:?}");
            assert_eq!(after(&mut robot, b"\x03"), "<STX>OK<CR><ETX>", "{end:?}");
        }
    }
    // Nothing marks a connection with `cr`.
    let mut robot = with(Dialect::Field, |options| options.text.end = EndRule::Cr);
    assert_eq!(
        after(&mut robot, b"SP\r\x03SP\x03\x02SP\r\x03SP\r"),
        ["OK<CR><ETX>", "OK<CR><ETX>", "<STX>OK<CR><ETX>", "OK<CR><ETX>"].concat()
    );
}

// clause: T6
#[test]
fn with_a_checksum_every_text_ends_by_etx() {
    for end in [EndRule::Cr, EndRule::Detect] {
        let mut robot = with(Dialect::Field, |options| {
            options.text.end = end;
            options.text.checksum = Checksum::Sum;
        });
        robot.raw(Port::Ip0, b"SP\r");
        robot.advance_ms(1_000);
        assert_eq!(heard(&mut robot), "", "{end:?}");
        assert_eq!(after(&mut robot, b"\x03\xB3\r\n"), "OK<CR><ETX><AA>", "{end:?}");
    }
}

// clause: T7
#[test]
fn bytes_between_texts_hold_back_nothing_and_are_no_finding() {
    for (stx, skipped) in [(Dialect::Field, true), (Dialect::Manual, false)] {
        let mut robot = with(stx, |_| {});
        robot.raw(Port::Ip0, b"\r\n\0 ");
        robot.advance_ms(20_000);
        robot.command(Port::Ip0, "SP");
        robot.raw(Port::Ip0, b"\r\n");
        assert_eq!(count(&robot, &rules::BYTES_OUTSIDE) == 0, skipped);
        assert_eq!(count(&robot, &rules::TEXT_UNFINISHED), 0);
    }
    // A host that ends its texts with CR LF after ETX is told of a stop at once.
    let mut robot = Robot::ready("PROGRAM T\nDELAY 1\nEND\n");
    robot.raw(Port::Ip0, b"\x02RN\r\x03\r\n");
    assert_eq!(heard(&mut robot), "<STX>OK<CR><ETX>");
    robot.advance_ms(1_000);
    assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"));
    // Any other byte opens a text, which holds it back.
    robot.raw(Port::Ip0, b"\x02RN\r\x03X");
    robot.advance_ms(1_500);
    assert_eq!(heard(&mut robot), "<STX>OK<CR><ETX>");
}

// clause: T22
#[test]
fn the_rest_of_a_text_that_timed_out_gets_no_answer() {
    for (begin, rest) in [
        (&b"\x02S"[..], &b"P\r\x03"[..]),
        (b"S", b"P\r\x03"),
        (b"S", b"P\rXX\r\x03"),
        (b"S", b"P"),
    ] {
        for dialect in [Dialect::Field, Dialect::Manual] {
            let mut robot = with(dialect, |_| {});
            robot.raw(Port::Ip0, begin);
            robot.advance_ms(9_999);
            assert_eq!(count(&robot, &rules::TEXT_UNFINISHED), 0);
            robot.advance_ms(1);
            let opened = dialect == Dialect::Field || begin.starts_with(b"\x02");
            assert_eq!(count(&robot, &rules::TEXT_UNFINISHED), u64::from(opened));
            assert_eq!(after(&mut robot, rest), "", "{begin:02X?} {rest:02X?}");
            assert_eq!(
                count(&robot, &rules::BYTES_OUTSIDE),
                u64::from(opened) + u64::from(!opened) * 2
            );
            robot.advance_ms(20_000);
            assert_eq!(after(&mut robot, b"\x02SP\r\x03"), "<STX>OK<CR><ETX>");
            assert_eq!(count(&robot, &rules::TEXT_UNFINISHED), u64::from(opened));
        }
    }
    // One millisecond earlier it is a text.
    let mut robot = field();
    robot.raw(Port::Ip0, b"\x02S");
    robot.advance_ms(9_999);
    assert_eq!(after(&mut robot, b"P\r\x03"), "<STX>OK<CR><ETX>");
}

// clause: T22 T27
#[test]
fn a_cr_ends_the_dropped_rest_of_a_host_that_sends_no_etx() {
    let dropped_then_served = |robot: &mut Robot| {
        robot.raw(Port::Ip0, b"S");
        robot.advance_ms(10_000);
        after(robot, b"P\rSP\r")
    };
    assert_eq!(dropped_then_served(&mut marked(Terminator::Cr)), "OK<CR><ETX>");
    let mut cr = with(Dialect::Field, |options| options.text.end = EndRule::Cr);
    assert_eq!(dropped_then_served(&mut cr), "OK<CR><ETX>");
    let mut etx = marked(Terminator::Etx);
    assert_eq!(dropped_then_served(&mut etx), "");
    assert_eq!(after(&mut etx, b"\x03SP\r\x03"), "OK<CR><ETX>");
}
