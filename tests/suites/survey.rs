//! `ts3100 survey` against the emulator: under every option value it finds that value, under faults it finds nothing wrong, and
//! what it sends is what it says.

use ts3100_controller::options::Options;
use ts3100_controller::{Config, Dialect, PanelAction, Port};
use ts3100_driver::tcp::LinkOptions;
use ts3100_emulator::config::set_option;
use ts3100_survey::{Class, Plan, Report, Verdict, survey};
use ts3100_tests::Robot;
use ts3100_tests::virtual_peer::VirtualPeer;

const ALL: [Class; 4] = [Class::Look, Class::Files, Class::Program, Class::Motion];

fn plan(classes: &[Class]) -> Plan {
    Plan {
        classes: classes.to_vec(),
        only: Vec::new(),
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

/// Options and values that a survey finds, and the classes that it takes. The default of each is found in every other run.
const DECIDED: &[(&str, &[&str])] = &[
    ("channel.no_peer", &["alarm", "silent"]),
    ("dl.command_ends", &["true", "false"]),
    ("do.min_run", &["100ms", "200ms", "0.5s", "1s"]),
    ("drive.open_mode", &["1 1 1 1", "1 0 0 0", "1 1 0 0"]),
    ("extensions", &["true", "false"]),
    ("input.malformed", &["alarm", "leading-number"]),
    ("parameter.line_end", &["lf", "cr"]),
    ("scol.data_copy", &["true", "false"]),
    ("scol.din_unknown", &["alarm", "zero"]),
    ("scol.equal_within", &["0", "0.001", "0.5", "12.5"]),
    ("scol.int_division", &["truncate", "real"]),
    ("servo.interval", &["0s", "7s", "3s"]),
    ("sf.split", &["one", "several"]),
    ("sp.unsolicited", &["auto", "true", "false"]),
    ("strict_50ms", &["true", "false"]),
    ("su.layout", &["one-record", "six-records"]),
    ("text.checksum", &["none", "sum"]),
    ("text.require_cr", &["true", "false"]),
    ("text.stx", &["detect", "required"]),
    ("vr.layout", &["blanks", "packed"]),
    ("wait.after_stop", &["next", "again"]),
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
fn under_every_option_value_the_survey_finds_that_value() {
    let mut wrong = Vec::new();
    for (option, values) in DECIDED {
        for value in *values {
            let report = surveyed(&[(option, value)], &ALL);
            let found: Vec<_> = report.options().into_iter().collect();
            // Not this option alone: all together make the same controller.
            if report.stopped.is_some() || options(&found) != options(&[(option, value)]) {
                wrong.push(format!("{option} = {value}: {:?} {found:?}", report.stopped));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
