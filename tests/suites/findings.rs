//! For each rule of docs/reference/findings.md a host that breaks it and one that does the same work and keeps it. A rule without
//! a row fails.
//!
//! The hosts are in `findings/cases.rs` and `findings/channels.rs`.

mod cases;
mod channels;

use cases::{PROGRAM, cases, commands, download};
use std::collections::BTreeSet;
use ts3100_controller::findings::{Finding, MAX_BYTES, MAX_PER_RULE, RULES, rules};
use ts3100_controller::{Event, KeySwitch, Output, PanelAction, Port, Severity};
use ts3100_tests::Robot;

/// A robot to which a host has done something.
fn after(host: fn(&mut Robot)) -> Robot {
    let mut robot = Robot::ready(PROGRAM);
    host(&mut robot);
    robot
}

#[test]
fn every_rule_has_a_host_that_breaks_it_and_one_that_keeps_it() {
    let tried: Vec<&str> = cases().map(|(rule, ..)| rule.id).collect();
    let known: Vec<&str> = RULES.iter().map(|rule| rule.id).collect();
    assert_eq!(tried, known);
    let mut failures = Vec::new();
    for (rule, breaks, keeps) in cases() {
        for (host, expected) in [(breaks, true), (keeps, false)] {
            let robot = after(*host);
            let found = robot.findings.count(rule) > 0;
            if found != expected {
                let others: Vec<&str> = robot.findings.broken().map(|(rule, _)| rule.id).collect();
                failures.push(format!(
                    "{}: found {found}, {expected} expected, also {others:?}",
                    rule.id
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_finding_says_when_where_what_and_never_too_much() {
    for (rule, breaks, _) in cases() {
        let robot = after(*breaks);
        let (_, tally) = robot.findings.broken().find(|(found, _)| found == rule).unwrap();
        for finding in &tally.first {
            assert!(finding.bytes.len() <= MAX_BYTES, "{}", rule.id);
            assert!(
                finding.at <= robot.now() && !finding.message.to_string().is_empty(),
                "{}",
                rule.id
            );
        }
    }
    let robot = after(|r| commands(r, &["IW,1,1"]));
    let (_, tally) = robot.findings.broken().next().unwrap();
    assert_eq!(tally.first[0].port, Some(Port::Ip0));
    assert_eq!(tally.first[0].bytes, "IW,1,1");
    assert_eq!(tally.first[0].at.as_micros(), 60_000);
}

#[test]
fn a_careful_host_finds_nothing() {
    let robot = after(|r| {
        download(r, "NEW", "PROGRAM NEW\rEND\r");
        commands(r, &["CA", "OK", "SL,NEW", "SL,TEST", "SO", "SU", "OK", "RN"]);
        r.raw(Port::Ip1, b"1,2\r");
        r.advance_ms(500);
        commands(r, &["SF", "OK", "EU", "OK", "VR", "OK", "MR,A 0", "OK", "BR"]);
    });
    let found: Vec<_> = robot.findings.broken().collect();
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn a_host_cannot_wait_for_an_sp_it_does_not_expect() {
    let robot = after(|r| {
        commands(r, &["RN"]);
        r.advance_ms(1_000);
        r.panel(PanelAction::Stop);
        r.raw(Port::Ip1, b"1,2\r");
        r.advance_ms(10);
        assert!(r.received(Port::Ip0).ends_with(b"\x02SP\r\x03"));
        r.send(Port::Ip0, b"SU\r");
    });
    assert_eq!(robot.findings.count(&rules::COMMAND_EARLY), 0);
}

// clause: T26
#[test]
fn a_host_that_sends_before_the_start_waits_and_the_finding_says_what_to_do() {
    let mut robot = Robot::ready(PROGRAM);
    robot.raw(Port::Ip1, b"1,2\r");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(3_600_000);
    assert_eq!(robot.received(Port::Ip1), b"", "INPUT waits for ever");
    let (_, tally) = robot
        .findings
        .broken()
        .find(|(rule, _)| **rule == rules::DATA_CLEARED)
        .unwrap();
    assert_eq!((tally.count, tally.first[0].port), (1, Some(Port::Ip1)));
    assert!(rules::DATA_CLEARED.remedy.starts_with("Send after the start"));
    // The remedy helps.
    robot.raw(Port::Ip1, b"1,2\r");
    robot.advance_ms(100);
    assert!(!robot.received(Port::Ip1).is_empty());
}

#[test]
fn answers_are_the_same_bytes_whatever_is_found() {
    // The same command in the form of the manual and in one that is forgiven.
    for (plain, forgiven) in [("IW,1 1", "IW,1,1"), ("RS,PRG", "rs, PRG "), ("SU", "su ")] {
        let answers = [plain, forgiven].map(|text| Robot::ready(PROGRAM).ask(Port::Ip0, text));
        assert_eq!(answers[0], answers[1], "{forgiven}");
    }
}

#[test]
fn a_refusal_is_told_once_by_the_rule_that_says_most() {
    for (host, rule) in [
        (
            (|r| {
                download(r, "NEW", "PROGRAM NEW\rGOTO NOWHERE\rEND\r");
                commands(r, &["SL,NEW"]);
            }) as fn(&mut Robot),
            &rules::PROGRAM_ERRORS,
        ),
        (|r| commands(r, &["BR", "RN"]), &rules::START_SERVO_OFF),
        (
            |r| {
                r.panel(PanelAction::Key(KeySwitch::Teaching));
                commands(r, &["RN"]);
            },
            &rules::MODE_FORBIDS,
        ),
    ] {
        let robot = after(host);
        let found: Vec<&str> = robot.findings.broken().map(|(rule, _)| rule.id).collect();
        assert_eq!(found, [rule.id]);
    }
}

#[test]
fn a_refused_start_is_told_by_the_cause_that_refused_it() {
    type Cause = fn(&mut Robot);
    let nothing: Cause = |r| commands(r, &["RS,SEL"]);
    let jogging: Cause = |r| commands(r, &["MD,0", "SC,0", "JG,1 +"]);
    let emergency: Cause = |r| r.panel(PanelAction::EmergencyStop(true));
    let open: Cause = |r| r.panel(PanelAction::SafetySwitch(true));
    let held: Cause = |r| commands(r, &["FD"]);
    let off: Cause = |r| commands(r, &["BR"]);
    let state = &rules::REFUSED_BY_STATE;
    for (causes, rule, reason) in [
        (&[nothing][..], state, "no file is selected"),
        (&[nothing, off], state, "no file is selected"),
        (&[nothing, off, emergency], state, "no file is selected"),
        (&[jogging], state, "the arm is being jogged; stop the jog first"),
        (&[emergency], state, "the emergency stop is pressed"),
        (&[off, emergency], state, "the emergency stop is pressed"),
        (&[off, open], state, "the safety switch is open"),
        (&[off], &rules::START_SERVO_OFF, "servo power is off"),
        (&[off, held], &rules::START_SERVO_OFF, "servo power is off"),
        (&[held], state, "feed hold is on; release it first"),
    ] {
        let mut robot = Robot::ready(PROGRAM);
        causes.iter().for_each(|cause| cause(&mut robot));
        robot.findings.clear();
        commands(&mut robot, &["RN"]);
        let found: Vec<_> = robot.findings.broken().collect();
        let [(found, tally)] = found[..] else {
            panic!("{reason}: {found:#?}");
        };
        assert_eq!(
            (found.id, tally.first[0].message.to_string()),
            (rule.id, format!("RN: {reason}"))
        );
    }
}

#[test]
fn a_risk_is_told_of_a_command_that_was_obeyed_alone() {
    let robot = after(|r| commands(r, &["RN", "MW,0 NOSUCH 0 5"]));
    let found: Vec<&str> = robot.findings.broken().map(|(rule, _)| rule.id).collect();
    assert_eq!(found, [rules::REFUSED_BY_STATE.id]);
}

#[test]
fn texts_of_a_file_without_a_download_are_never_blamed_for_their_missing_cr() {
    let full = format!("FL,{}", "REMARK\r".repeat(40));
    let full = &full[..253];
    let more = &"REMARK A\r".repeat(40)[..253];
    for texts in [
        &["FL,PROGRAM NEW\rEND\r\x1a"][..],
        &["fl,PROGRAM NEW\rEND\r\x1a\r"],
        &["FL,"],
        // A host that does not look at the answers.
        &[full, "END\r\x1a"],
        &[full, more, "END\r\x1a"],
        &["DL,1\r", full, more, "END\r\x1a"],
        // Refused in the middle.
        &["DL,NEW\r", "FL,PROGRAM NEW\r\t", "END", "\x1a"],
    ] {
        let mut robot = Robot::ready(PROGRAM);
        for text in texts {
            robot.advance_ms(60);
            robot.send(Port::Ip0, text.as_bytes());
        }
        let answers = robot.received(Port::Ip0);
        assert!(answers.ends_with(b"\x02NG\r\x03"), "{texts:?}");
        assert_eq!(
            answers.iter().filter(|byte| **byte == 3).count(),
            texts.len(),
            "{texts:?}"
        );
        let found = |rule| robot.findings.count(rule);
        assert!(found(&rules::FILE_WITHOUT_DOWNLOAD) > 0, "{texts:?}");
        assert_eq!(
            (found(&rules::NO_CR), found(&rules::UNKNOWN_COMMAND)),
            (0, 0),
            "{texts:?}"
        );
    }
    // A command ends it: what comes after it without CR is a command without CR.
    let robot = after(|r| {
        r.send(Port::Ip0, b"FL,PROGRAM NEW\r");
        commands(r, &["FD", "FD"]);
        r.advance_ms(60);
        r.send(Port::Ip0, b"FD");
    });
    assert_eq!(robot.findings.count(&rules::FILE_WITHOUT_DOWNLOAD), 1);
    assert_eq!(robot.findings.count(&rules::NO_CR), 1);
}

#[test]
fn the_rest_of_a_file_whose_download_was_given_up_is_a_file_without_download() {
    let robot = after(|r| {
        commands(r, &["DL,NEW"]);
        r.advance_ms(60);
        r.send(Port::Ip0, b"FL,PROGRAM NEW\r");
        r.advance_ms(10_500);
        r.send(Port::Ip0, b"END\r\x1a");
    });
    let found: Vec<&str> = robot.findings.broken().map(|(rule, _)| rule.id).collect();
    let expected = [&rules::DOWNLOAD_ABANDONED, &rules::FILE_WITHOUT_DOWNLOAD];
    assert_eq!(found, expected.map(|rule| rule.id));
}

/// After the end of a refused file, a wrong command is an unknown command again.
#[test]
fn a_refused_file_ends_with_eof_and_with_eof_cr() {
    for (end, rest) in [("\x1a", 0), ("\x1a\r", 0), ("\r", 1)] {
        let mut robot = Robot::ready(PROGRAM);
        robot.send(Port::Ip0, format!("FL,PROGRAM NEW\rEND\r{end}").as_bytes());
        commands(&mut robot, &["XX"]);
        let found = |rule| robot.findings.count(rule);
        assert_eq!(
            (
                found(&rules::FILE_WITHOUT_DOWNLOAD),
                found(&rules::UNKNOWN_COMMAND)
            ),
            (1 + rest, 1 - rest),
            "{}",
            end.escape_debug()
        );
    }
}

#[test]
fn answers_and_files_in_lower_case_are_found_too() {
    let answer = after(|r| commands(r, &["SU", "ok"]));
    assert_eq!(answer.findings.count(&rules::LOWER_CASE), 1);
    let mut file = after(|r| {
        commands(r, &["DL,NEW"]);
        r.received(Port::Ip0);
        r.send(Port::Ip0, b"fl,PROGRAM NEW\rEND\r\x1a");
    });
    assert_eq!(file.received(Port::Ip0), b"\x02OK\r\x03", "it is taken");
    assert_eq!(file.findings.count(&rules::LOWER_CASE), 1);
}

#[test]
fn polls_of_different_things_are_no_fast_poll() {
    let fast = |commands: &[&str]| {
        let mut robot = Robot::ready(PROGRAM);
        for command in commands {
            robot.send(Port::Ip0, format!("{command}\r").as_bytes());
            robot.send(Port::Ip0, b"OK\r");
        }
        robot.findings.count(&rules::POLL_FAST)
    };
    assert_eq!(fast(&["SU", "SF", "MR,A 0", "MR,B 0"]), 0);
    assert_eq!(fast(&["SU", "SF", "SU", "SF"]), 2);
    assert_eq!(fast(&["MR,A 0", "MR,A 0", "mr,A 0"]), 1);
    // The last poll counts, not the first.
    assert_eq!(fast(&["MR,A 0", "MR,B 0", "MR,B 0"]), 1);
    assert_eq!(fast(&["MR,A 0", "MR,B 0", "MR,A 0"]), 0);
}

#[test]
fn each_break_is_counted_and_only_the_first_are_kept() {
    let robot = after(|r| (0..30).for_each(|_| commands(r, &["so"])));
    let (rule, tally) = robot.findings.broken().next().unwrap();
    assert_eq!((rule.id, tally.count), ("lower-case", 30));
    assert_eq!(tally.first.len(), MAX_PER_RULE);
}

#[test]
fn nothing_is_reported_that_is_not_in_the_table() {
    let known: BTreeSet<&str> = RULES.iter().map(|rule| rule.id).collect();
    for (_, breaks, _) in cases() {
        for output in after(*breaks).outputs {
            if let Output::Event(Event::Finding(Finding { rule, .. })) = output {
                assert!(known.contains(rule.id), "{}", rule.id);
            }
        }
    }
    assert!(Severity::Note < Severity::Warning && Severity::Warning < Severity::Error);
}
