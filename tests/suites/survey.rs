//! `ts3100 survey` against the emulator: under every option value it finds that value, under faults it finds nothing wrong, and
//! what it sends is what it says.

mod files;
mod recordings;
mod restoring;

use std::time::Duration;
use ts3100_controller::faults::FaultAction;
use ts3100_controller::model::ArmModel;
use ts3100_controller::options::Options;
use ts3100_controller::{Config, ControlRight, Dialect, PanelAction, Port};
use ts3100_driver::tcp::LinkOptions;
use ts3100_emulator::config::{OPTIONS, set_option};
use ts3100_proto::escape::Escaped;
use ts3100_survey::{Class, Peer as _, Plan, Report, Verdict, survey};
use ts3100_tests::Robot;
use ts3100_tests::virtual_peer::VirtualPeer;

const ALL: [Class; 4] = [Class::Look, Class::Files, Class::Program, Class::Motion];

fn plan(classes: &[Class]) -> Plan {
    Plan {
        classes: classes.to_vec(),
        ..Plan::default()
    }
}

fn config(options: &[(&str, &str)]) -> Config {
    let mut config = Config::new(Dialect::Field);
    for (key, value) in options {
        let mut links = LinkOptions::default();
        set_option(&mut config.options, &mut links, key, value).unwrap();
    }
    config
}

fn peer(config: Config, port: Port) -> VirtualPeer {
    let mut robot = Robot::with(config);
    robot.panel(PanelAction::Servo(true));
    VirtualPeer::new(robot, port)
}

fn surveyed(options: &[(&str, &str)], classes: &[Class]) -> Report {
    let mut peer = peer(config(options), Port::Ip0);
    survey(&mut peer, &plan(classes), &mut |_| {}).unwrap()
}

#[test]
fn a_controller_as_it_is_by_default_has_the_first_reading_of_every_question() {
    let report = surveyed(&[], &ALL);
    assert_eq!(report.stopped, None);
    let others: Vec<_> = report
        .answers
        .iter()
        .filter(|answer| answer.verdict != Verdict::Manual)
        .map(|answer| (answer.probe.as_str(), answer.heard.as_str(), answer.note.as_str()))
        .collect();
    assert_eq!(others, [("while-sending", "", "only a serial line takes turns")]);
}

/// Options and values that a survey finds, and the class of questions that it takes.
const DECIDED: &[(&str, Class, &[&str])] = &[
    ("ac.date", Class::Program, &["yyyy", "yy"]),
    ("channel.no_peer", Class::Program, &["alarm", "silent"]),
    ("channel.reconnect", Class::Program, &["keep", "release"]),
    ("dl.command_ends", Class::Files, &["true", "false"]),
    ("do.min_run", Class::Motion, &["100ms", "200ms", "0.5s", "1s"]),
    ("drive.open_mode", Class::Look, &["1 1 1 1", "1 0 0 0", "1 0 2 0"]),
    ("extensions", Class::Look, &["true", "false"]),
    ("input.malformed", Class::Program, &["alarm", "leading-number"]),
    ("parameter.line_end", Class::Look, &["lf", "cr"]),
    ("rs.cycle_without_label", Class::Program, &["as-step", "ng"]),
    ("scol.data_copy", Class::Program, &["true", "false"]),
    ("scol.din_unknown", Class::Program, &["alarm", "zero"]),
    (
        "scol.equal_within",
        Class::Program,
        &["0", "0.001", "0.5", "12.5"],
    ),
    ("scol.int_division", Class::Program, &["truncate", "real"]),
    ("scol.reset_locals", Class::Program, &["true", "false"]),
    ("scol.sticky_work", Class::Motion, &["true", "false"]),
    ("servo.interval", Class::Motion, &["0s", "7s", "3s"]),
    ("sf.split", Class::Look, &["one", "several"]),
    ("sp.unsolicited", Class::Program, &["auto", "true", "false"]),
    ("strict_50ms", Class::Look, &["true", "false"]),
    ("su.layout", Class::Look, &["one-record", "six-records"]),
    ("text.checksum", Class::Look, &["none", "sum"]),
    ("text.require_cr", Class::Look, &["true", "false"]),
    ("text.stx", Class::Look, &["detect", "required"]),
    ("vr.layout", Class::Look, &["blanks", "packed"]),
    ("wait.after_stop", Class::Program, &["next", "again"]),
];

/// The options of a configuration, with what follows from the arm.
fn options(pairs: &[(&str, &str)]) -> Options {
    let config = config(pairs);
    let within = config.language().equal_within;
    Options {
        equal_within: Some(within),
        ..config.options
    }
}

#[test]
fn the_arm_is_known_with_a_checksum_too() {
    for (model, arm) in [(ArmModel::thl400(), "SCARA"), (ArmModel::tv800(), "six axes")] {
        let config = Config {
            model,
            ..config(&[("text.checksum", "sum")])
        };
        let report = survey(&mut peer(config, Port::Ip0), &plan(&ALL), &mut |_| {}).unwrap();
        assert_eq!((report.stopped, report.arm.as_str()), (None, arm));
    }
}

/// Under 1 in [U25] of USER.PAR a string is 0, as one without a number is under `leading-number`.
#[test]
fn a_string_that_u25_makes_0_is_no_leading_number() {
    let mut robot = Robot::with(config(&[]));
    let user = b"[U06]\r{COM1} = 9600 8 0 1\r{HOST} = 9600 8 0 1\r[U25]\r= 1 0 0 0 0 0\r[END]\r";
    robot.seat.controller.put_file("USER.PAR", user).unwrap();
    robot.panel(PanelAction::PowerCycle);
    robot.panel(PanelAction::Servo(true));
    let mut peer = VirtualPeer::new(robot, Port::Ip0);
    let report = survey(&mut peer, &plan(&[Class::Program]), &mut |_| {}).unwrap();
    let mut answers = report.answers.iter();
    let answer = answers.find(|answer| answer.probe == "input-malformed").unwrap();
    assert_eq!((answer.heard.as_str(), answer.verdict), ("0", Verdict::Variation));
    assert!(
        report
            .options()
            .into_iter()
            .all(|(option, _)| option != "input.malformed")
    );
}

#[test]
fn under_every_option_value_the_survey_finds_that_value() {
    let mut wrong = Vec::new();
    for (option, class, values) in DECIDED {
        for value in *values {
            let report = surveyed(&[(option, value)], &[*class]);
            let found: Vec<_> = report.options().into_iter().collect();
            // Not this option alone: all that was found makes the same controller.
            let is_found = found.iter().any(|(known, _)| known == option);
            if !is_found || report.stopped.is_some() || options(&found) != options(&[(option, value)]) {
                wrong.push(format!("{option} = {value}: {:?} {found:?}", report.stopped));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Faults of every kind, whose wrong answers must not be taken for those of a controller.
const FAULTS: &[&str] = &[
    "no-reply:probability=0.05",
    "no-reply:command=SU,probability=0.3",
    "no-reply:command=VR",
    "no-reply:lost=command,probability=0.1",
    "no-reply:command=MR",
    "no-reply:command=RN,after=3",
    "late-reply:delay=600,probability=0.2",
    "late-reply:delay=3000,probability=0.1",
    "late-reply:delay=100",
    "ng:command=VR",
    "ng:command=SM",
    "ng:command=SU,probability=0.2",
    "ng:command=MR,probability=0.4",
    "ng:command=RN,probability=0.3",
    "ng:probability=0.1",
    "wrong-reply:probability=0.05",
    "lost-etx:probability=0.05",
    "flipped-bit:probability=0.03",
    "flipped-bit:way=in,probability=0.03",
    "split-bytes:size=3,pause=20",
    "merged-texts:hold=300,probability=0.2",
    "duplicate-text:probability=0.05",
    "reset-mid-text:probability=0.03",
    "half-open:probability=0.03",
    "slow-line:speed=9600",
    "drive-full",
    "power-loss:delay=100",
    "alarm:command=RN,number=2-046,delay=50,probability=0.3",
    "emergency-stop:command=RN,delay=100,probability=0.3",
    "servo-failure:command=RN,delay=100,probability=0.3",
    "key-turned:delay=100",
    "lost-record:probability=0.5",
];

/// Controllers that are surveyed under faults and delays, and those of them that one test has.
const SEEDS: u64 = 100;
const SEEDS_A_TEST: u64 = SEEDS / 4;

#[test]
fn a_controller_with_faults_and_delays_gets_no_wrong_answer() {
    no_answer_is_wrong(0);
}

#[test]
fn a_controller_with_faults_and_delays_gets_no_wrong_answer_2() {
    no_answer_is_wrong(1);
}

#[test]
fn a_controller_with_faults_and_delays_gets_no_wrong_answer_3() {
    no_answer_is_wrong(2);
}

#[test]
fn a_controller_with_faults_and_delays_gets_no_wrong_answer_4() {
    no_answer_is_wrong(3);
}

/// A quarter of the seeds: side by side they take less time.
fn no_answer_is_wrong(quarter: u64) {
    let (mut wrong, mut decided) = (Vec::new(), 0);
    for seed in (0..SEEDS_A_TEST).map(|number| 4 * number + quarter) {
        // Each seed another controller, another fault, and most of them with legal variation.
        let index = usize::try_from(seed).unwrap();
        let (option, _, values) = DECIDED[index % DECIDED.len()];
        let value = values[index / DECIDED.len() % values.len()];
        let mut controller = config(&[(option, value)]);
        controller.fault_seed = seed;
        controller.vary = (seed % 4 != 3).then_some(seed);
        let mut peer = peer(controller, Port::Ip0);
        let mut faults = Vec::new();
        if seed % 10 != 0 {
            // Once, three times, or whenever there is an occasion.
            let (fault, times) = (
                FAULTS[index % FAULTS.len()],
                [0, 1, 3][(index + index / FAULTS.len()) % 3],
            );
            let separator = if fault.contains(':') { ',' } else { ':' };
            faults.push(format!("{fault}{separator}times={times}"));
        }
        for fault in &faults {
            peer.robot
                .feed(FaultAction::Arm(Box::new(fault.parse().unwrap())).into());
        }
        let Ok(report) = survey(&mut peer, &plan(&ALL), &mut |_| {}) else {
            continue;
        };
        // What the same controller answers without faults, or nothing.
        let truth = surveyed(&[(option, value)], &ALL);
        for (found, true_answer) in report.answers.iter().zip(&truth.answers) {
            let is_decided = matches!(found.verdict, Verdict::Manual | Verdict::Variation);
            // The order of the directory is one of the variations.
            if is_decided && found.probe != "directory-form" {
                decided += 1;
                if (&found.heard, &found.sets) != (&true_answer.heard, &true_answer.sets) {
                    wrong.push(format!(
                        "seed {seed}, {faults:?}: {found:?}, stopped {:?}",
                        report.stopped
                    ));
                }
            }
        }
    }
    println!("{decided} answers");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(decided > 625, "{decided}: it must not stop at everything");
}

/// Everything that a survey of the class *look* sends, text by text; the two over-long and cut ones by how they begin.
const LOOKS: &[&str] = &[
    "<STX>SU<CR><ETX>",
    "<STX>VR<CR><ETX>",
    "<STX>CA<CR><ETX>",
    "<STX>EU<CR><ETX>",
    "<STX>SF<CR><ETX>",
    "<STX>SM,1<CR><ETX>",
    "<STX>HI,1 8<CR><ETX>",
    "<STX>IO,1<CR><ETX>",
    "<STX>MN,17<CR><ETX>",
    "<STX>UL,USER.PAR<CR><ETX>",
    "<STX>UL,ETHERNET.PAR<CR><ETX>",
    "<STX>OK<CR><ETX>",
    "<STX>QQ<CR><ETX>",
    "SU<CR><ETX>",
    "<STX>SU<ETX>",
    "<STX>su<CR><ETX>",
    "<STX>VR<STX>SU<CR><ETX>",
    "<STX>",
];

#[test]
fn all_questions_together_take_less_than_two_minutes() {
    let mut peer = peer(config(&[]), Port::Ip0);
    survey(&mut peer, &plan(&ALL), &mut |_| {}).unwrap();
    assert!(peer.now() < Duration::from_secs(120), "{:?}", peer.now());
}

#[test]
fn to_look_sends_nothing_else_keeps_its_pauses_and_takes_less_than_a_minute() {
    let mut peer = peer(config(&[]), Port::Ip0);
    let report = survey(&mut peer, &plan(&[Class::Look]), &mut |_| {}).unwrap();
    assert_eq!(report.stopped, None);
    let mut last = None;
    let mut close = 0;
    for (at, bytes) in &peer.sent {
        let text = Escaped::for_reading(bytes).to_string();
        let is_blank = text.replace(' ', "");
        assert!(
            LOOKS.contains(&text.as_str())
                || text.starts_with("<STX>AAAA")
                || ["<STX>SU<ETX>", "<STX><CR><ETX>"].contains(&is_blank.as_str()),
            "{text}"
        );
        if last.is_some_and(|last| *at < last + Duration::from_millis(50)) {
            close += 1;
        }
        last = Some(*at);
    }
    // The question about the pause, three times; what it sends changes nothing.
    assert_eq!(close, 3);
    let took = peer.now();
    assert!(took < Duration::from_secs(50), "{took:?}");
    // Twenty a second at most.
    let mut requests = peer
        .sent
        .iter()
        .filter(|(_, bytes)| bytes != b"\x02OK\r\x03")
        .map(|(at, _)| *at)
        .collect::<Vec<_>>();
    requests.sort_unstable();
    for window in requests.windows(21) {
        assert!(window[20] - window[0] >= Duration::from_secs(1));
    }
}

#[test]
fn a_host_without_the_right_to_start_programs_is_told_so_and_takes_no_refusal_for_an_answer() {
    let mut config = config(&[]);
    config.control_right = ControlRight::Rs232c;
    let mut peer = peer(config, Port::Ip0);
    let report = survey(&mut peer, &plan(&[Class::Program, Class::Motion]), &mut |_| {}).unwrap();
    for answer in &report.answers {
        assert_eq!(answer.verdict, Verdict::Refused, "{answer:?}");
        assert_eq!(
            answer.note,
            "this host may not start programs in EXT (RS-232C); turn the key and give the control right for EXT (ETHER)"
        );
    }
}

#[test]
fn a_serial_line_shows_what_happens_while_it_sends() {
    for value in ["lost", "kept"] {
        let mut config = config(&[("serial.while_sending", value)]);
        config.control_right = ControlRight::Rs232c;
        let mut peer = peer(config, Port::Host);
        let report = survey(&mut peer, &plan(&[Class::Look]), &mut |_| {}).unwrap();
        assert_eq!(report.stopped, None);
        assert_eq!(report.options().get("serial.while_sending"), Some(&value));
        assert!(report.answer_times.is_empty(), "the line takes most of the time");
    }
}

#[test]
fn a_serial_line_without_a_fresh_connection_gets_no_wrong_answer_about_sp() {
    for (value, expected) in [("auto", None), ("true", Some("true")), ("false", None)] {
        let mut config = config(&[("sp.unsolicited", value)]);
        config.control_right = ControlRight::Rs232c;
        let mut peer = peer(config, Port::Host);
        let report = survey(&mut peer, &plan(&ALL), &mut |_| {}).unwrap();
        assert_eq!(report.stopped, None);
        let found = report.options().get("sp.unsolicited").copied();
        assert_eq!(found, expected, "{value}");
        let wrong: Vec<_> = report
            .answers
            .iter()
            .filter(|answer| answer.verdict == Verdict::Variation && answer.probe != "unsolicited-stop")
            .collect();
        assert!(wrong.is_empty(), "{value}: {wrong:?}");
    }
}

/// Options that no question decides, and why. Those of other tests are found by a survey too.
const NOT_ASKED: &[(&str, &str)] = &[
    (
        "alarm.out_of_reach",
        "it would raise an alarm that turns servo power off",
    ),
    ("auto.silence", "the emulator alone has it"),
    (
        "channel.redial",
        "it takes a controller that dials: its parameters would have to be changed",
    ),
    ("channel.second", "binary::survey, with sockets"),
    ("drive.capacity", "it would fill the drive"),
    ("drive.when_full", "the emulator alone has it"),
    ("io.field_bus", "it would switch outputs"),
    ("reply.delay", "measured; a_file_makes_another_robot_answer_alike"),
    (
        "serial.bad_character",
        "no port of a computer sends a character with a wrong parity among right ones",
    ),
    ("serial.pacing", "every real line takes its time"),
    (
        "serial.while_sending",
        "a_serial_line_shows_what_happens_while_it_sends",
    ),
    ("sig.low_speed", "it takes wires to the inputs"),
    ("sig.strobe", "it takes wires to the inputs"),
    (
        "text.end",
        "it takes a connection that has carried no text with STX; a real host shows it",
    ),
];

#[test]
fn every_option_is_found_or_says_why_not() {
    for option in OPTIONS.iter() {
        let is_decided = DECIDED.iter().any(|(known, ..)| *known == option.key);
        let is_excused = NOT_ASKED.iter().any(|(known, _)| *known == option.key);
        assert!(is_decided != is_excused, "{}", option.key);
    }
    let words = |option: &str| {
        OPTIONS
            .iter()
            .find(|row| row.key == option)
            .map_or(&[][..], |row| row.values().words())
    };
    for (option, _, values) in DECIDED {
        assert!(
            words(option).iter().all(|word| values.contains(word)),
            "{option}: every word"
        );
    }
}
