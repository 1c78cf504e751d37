//! The files of surveys: read, compared, and made into an emulator that answers alike.

use super::{ALL, DECIDED, config, peer, plan, surveyed};
use std::collections::BTreeSet;
use std::time::Duration;
use ts3100_controller::{Config, PanelAction, Port};
use ts3100_emulator::config::{ServeArgs, Settings};
use ts3100_survey::passive::{Observation, Passive};
use ts3100_survey::{Class, Report, ReportError, Verdict, compare, survey};
use ts3100_tests::Robot;
use ts3100_tests::testing::TempDir;

#[test]
fn the_file_is_read_as_it_was_written_and_a_change_is_noticed() {
    let report = surveyed(&[("su.layout", "six-records")], &[Class::Look]);
    let text = report.write();
    let read = Report::read(&text).unwrap();
    assert_eq!(read.answers, report.answers);
    assert_eq!(read.options().get("su.layout"), Some(&"six-records"));
    assert_eq!(read.write(), text);
    // An editor may change the line ends.
    assert_eq!(Report::read(&text.replace('\n', "\r\n")).unwrap(), read);
    assert!(
        Report::read(&text.replace("share = false", "share = true"))
            .unwrap()
            .share
    );
    let changed = text.replace("six-records", "one-record");
    assert!(matches!(
        Report::read(&changed),
        Err(ReportError::Checksum { .. })
    ));
    let other = surveyed(&[], &[Class::Look]);
    let names = |report: &Report, other: &Report| {
        let found = compare(report, other);
        let differences = found.differences.into_iter().map(|difference| difference.probe);
        (
            differences.collect::<Vec<_>>(),
            found.only_first,
            found.only_second,
        )
    };
    let expected = (vec!["status-form".to_owned()], Vec::new(), Vec::new());
    assert_eq!(names(&report, &other), expected);
    // A question that one file has not asked, or that had no answer, is no difference.
    let mut fewer = other.clone();
    let unasked = fewer.answers.remove(0).probe;
    fewer.answers[0].heard.clear();
    let unanswered = fewer.answers[0].probe.clone();
    assert!(!expected.0.contains(&unasked) && !expected.0.contains(&unanswered));
    let only = vec![unasked, unanswered];
    assert_eq!(
        names(&report, &fewer),
        (expected.0.clone(), only.clone(), Vec::new())
    );
    assert_eq!(names(&fewer, &report), (expected.0, Vec::new(), only));
}

#[test]
fn an_option_without_a_name_and_a_time_that_is_none_are_refused() {
    let text = surveyed(&[("su.layout", "six-records")], &[Class::Look]).write();
    let refused = |from: &str, to: &str| {
        let changed = text.replacen(from, to, 1);
        let Err(ReportError::Checksum { found, computed }) = Report::read(&changed) else {
            panic!("{from} is not in {text}");
        };
        let read = Report::read(&changed.replacen(&found, &computed, 1));
        read.unwrap_err().to_string()
    };
    let option = "option = \"su.layout\"";
    for name in ["su layout", "su..layout", "", "su\\nlayout", "SU.LAYOUT", "text"] {
        let message = refused(option, &format!("option = \"{name}\""));
        assert!(
            message.contains("is not the name of an option"),
            "{name}: {message}"
        );
    }
    for time in ["nan", "inf", "-0.5"] {
        let message = refused("\nms = [", &format!("\nms = [{time}, "));
        assert!(message.starts_with("delays: expected milliseconds"), "{message}");
    }
}

/// What a host of another day says, and when.
const HELD: &[&[u8]] = &[
    b"\x02SU\r\x03",
    b"\x02OK\r\x03",
    b"SU\r\x03",
    b"\x02OK\r\x03",
    b"\x02VR\r\x03",
    b"\x02OK\r\x03",
    b"\x02su\x03",
    b"\x02OK\r\x03",
    b"\x02CA\r\x03",
    b"\x02OK\r\x03",
    b"\x02SF\r\x03",
    b"\x02OK\r\x03",
    b"\x02OK\r\x03",
    b"\x02SM,1\r\x03",
    b"\x02OK\r\x03",
    b"\x02UL,USER.PAR\r\x03",
    b"\x02OK\r\x03",
    b"\x02OK\r\x03",
    b"\x02DL,A\r\x03",
    b"\x02FL,PROGRAM A\r\x03",
    b"\x02CA\r\x03",
    b"\x02OK\r\x03",
    b"\x02DL,A\r\x03",
    b"\x02FL,PROGRAM A\nPRINT IP1, 7/2, CR\nEND\n\x1A\x03",
    b"\x02SL,A\r\x03",
    b"\x02RN\r\x03",
    b"\x02SU\r\x03",
    b"\x02OK\r\x03",
];

/// What it says later, with a peer at IP1 too; nothing: it connects again.
const HELD_LATER: &[(Port, &[u8])] = &[
    (Port::Ip0, b"\x02QQ\r\x03\x02SU\r\x03"),
    (Port::Ip0, b"\x02OK\r\x03"),
    (Port::Ip0, b"\x02UL,ETHERNET.PAR\r\x03"),
    (Port::Ip0, b"\x02OK\r\x03"),
    (Port::Ip0, b"\x02OK\r\x03"),
    (Port::Ip0, b"\x02RS,CYC\r\x03"),
    (Port::Ip0, b"\x02SL,D\r\x03"),
    (Port::Ip0, b"\x02DO,R = 1\r\x03"),
    (Port::Ip0, b"\x02OK\r\x03"),
    (Port::Ip0, b"\x02SU\r\x03"),
    (Port::Ip0, b"\x02OK\r\x03"),
    (Port::Ip0, b"\x02RN\r\x03"),
    (Port::Ip0, b"\x02SL,B\r\x03"),
    (Port::Ip0, b"\x02RN\r\x03"),
    (Port::Ip1, b""),
    (Port::Ip1, b"ABC\r"),
    (Port::Ip0, b"\x02SU\r\x03"),
    (Port::Ip0, b"\x02OK\r\x03"),
    (Port::Ip0, b"\x02AC\r\x03"),
    (Port::Ip0, b"\x02OK\r\x03"),
    (Port::Ip0, b"\x02SL,E\r\x03"),
    (Port::Ip0, b"\x02RN\r\x03"),
    (Port::Ip0, b"\x02RS,STP\r\x03"),
    (Port::Ip0, b"\x02RN\r\x03"),
    (Port::Ip0, b"\x02SL,C\r\x03"),
    (Port::Ip0, b"\x02RN\r\x03"),
    (Port::Ip0, b"\x02SP\r\x03"),
    (Port::Ip0, b"\x02RN\r\x03"),
    (Port::Ip0, b"\x02SU\r\x03"),
    (Port::Ip0, b"\x02OK\r\x03"),
    (Port::Ip0, b"\x02BR\r\x03"),
    (Port::Ip0, b"\x02SO\r\x03"),
    (Port::Ip0, b"\x02BR\r\x03"),
    (Port::Ip0, b"\x02SO\r\x03"),
    (Port::Ip0, b"\x02SF\r\x03"),
    (Port::Ip0, b"\x02OK\r\x03"),
];

const PRINTS: &str = "PROGRAM B\nN = 7\nM = 2\nX = 0.0005\nE = 0\nIF X == 0.0 THEN E = 1\nP.X = 5\nSUB\n\
    PRINT IP1, N/M, E, CR\nINPUT IP1, N\nPRINT IP1, N, CR\nEND\n\
    PROGRAM SUB\nPRINT IP1, P.X, CR\nEND\nDATA\nPOINT P = 1,2,3\nEND\n";
const LOOKS: &str = "GLOBAL\nR = 0\nEND\nPROGRAM D\nN = 999\nN = DIN(N)\nPRINT IP1, N, CR\nEND\n";
const WAITS: &str = "PROGRAM C\nN = 0\nWAIT N == 1\nPRINT IP1, \"ON\", CR\nDELAY 2\nEND\n";
const REMEMBERS: &str = "GLOBAL\nF = 0\nEND\nPROGRAM E\nIF F == 1 THEN GOTO L1\nN = 5\nF = 1\nGOTO L2\nL1: PRINT IP1, N, CR\nL2:\nEND\n";

fn answers(mut robot: Robot) -> Vec<(u64, Port, Vec<u8>)> {
    robot.load("B", PRINTS);
    robot.load("C", WAITS);
    robot.load("D", LOOKS);
    robot.load("E", REMEMBERS);
    robot.connect(Port::Ip0);
    robot.panel(PanelAction::Servo(true));
    let mut heard = Vec::new();
    let mut say = |robot: &mut Robot, port, text| {
        robot.raw(port, text);
        for _ in 0..80 {
            for port in [Port::Ip0, Port::Ip1] {
                let bytes = robot.received(port);
                if !bytes.is_empty() {
                    heard.push((robot.now().as_micros(), port, bytes));
                }
            }
            robot.advance_ms(5);
        }
    };
    for text in HELD {
        say(&mut robot, Port::Ip0, text);
    }
    robot.connect(Port::Ip1);
    for (port, text) in HELD_LATER {
        if text.is_empty() {
            robot.disconnect(*port);
            robot.connect(*port);
        }
        say(&mut robot, *port, text);
    }
    heard
}

/// The emulator that `serve --like` makes of a report.
fn like(report: &Report) -> Config {
    let directory = TempDir::new("survey");
    let path = directory.path().join("robot.toml");
    std::fs::write(&path, report.write()).unwrap();
    let args = ServeArgs::from_words(&["--like".into(), path.into()]).unwrap();
    Config {
        // The same calendar: the daemon's is today.
        calendar: config(&[]).calendar,
        ..Settings::from_args(&args).unwrap().controller
    }
}

#[test]
fn a_file_makes_another_robot_answer_alike() {
    let strange = [
        ("su.layout", "six-records"),
        ("vr.layout", "packed"),
        ("text.require_cr", "true"),
        ("text.stx", "required"),
        ("sf.split", "several"),
        ("parameter.line_end", "cr"),
        ("dl.command_ends", "false"),
        ("extensions", "false"),
        ("scol.int_division", "real"),
        ("channel.no_peer", "silent"),
        ("sp.unsolicited", "false"),
        ("drive.open_mode", "1 1 0 0"),
    ];
    let several = [
        strange.to_vec(),
        vec![("text.checksum", "sum"), ("sp.unsolicited", "true")],
    ];
    let several = several.into_iter().map(|options| (options, ALL.to_vec()));
    let each = DECIDED.iter().flat_map(|(option, class, values)| {
        values.iter().map(|value| (vec![(*option, *value)], vec![*class]))
    });
    let default = answers(Robot::with(config(&[])));
    let mut others = BTreeSet::new();
    for (options, classes) in several.chain(each) {
        let original = answers(Robot::with(config(&options)));
        assert!(original.len() > 10, "{original:?}");
        let surveyed = like(&surveyed(&options, &classes));
        assert_eq!(answers(Robot::with(surveyed)), original, "{options:?}");
        if let ([(option, _)], true) = (options.as_slice(), original != default) {
            others.insert(*option);
        }
    }
    // The recording would show it.
    let hidden: Vec<_> = DECIDED
        .iter()
        .map(|(option, ..)| *option)
        .filter(|option| !others.contains(option))
        .collect();
    assert_eq!(hidden, ["scol.sticky_work"], "it takes a motion");
}

const SEEDS: u64 = 32;

#[test]
fn how_long_answers_take_is_taken_over() {
    // One survey hears too few answers for its quartiles to be exact: the mean of many.
    let mut sums = [0.0; 5];
    for seed in 1..=SEEDS {
        let mut config = config(&[("reply.delay", "12 20 24 30 80")]);
        config.fault_seed = seed;
        let report = survey(&mut peer(config, Port::Ip0), &plan(&[Class::Look]), &mut |_| {}).unwrap();
        assert_eq!(report.stopped, None);
        let times = report.answer_times;
        assert_eq!(times.len(), sums.len());
        for (sum, time) in sums.iter_mut().zip(times) {
            *sum += time;
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "a few")]
    let times = sums.map(|sum| sum / SEEDS as f64);
    let [least, first, middle, third, greatest] = &times;
    assert!(
        (12.0..16.0).contains(least) && (60.0..=80.0).contains(greatest),
        "{times:?}"
    );
    assert!(
        (17.0..22.0).contains(first) && (21.0..27.0).contains(middle) && (25.0..35.0).contains(third),
        "{times:?}"
    );
}

#[test]
fn a_recording_decides_what_it_shows() {
    for options in [
        &[][..],
        &[
            ("su.layout", "six-records"),
            ("vr.layout", "packed"),
            ("parameter.line_end", "cr"),
        ],
    ] {
        let mut robot = Robot::with(config(options));
        robot.connect(Port::Ip0);
        robot.panel(PanelAction::Servo(true));
        let mut observation = Observation::default();
        let mut passive = Passive::new(&mut observation);
        for text in HELD {
            let at = Duration::from_micros(robot.now().as_micros());
            passive.host(at, text);
            robot.raw(Port::Ip0, text);
            for _ in 0..200 {
                let bytes = robot.received(Port::Ip0);
                if !bytes.is_empty() {
                    passive.robot(Duration::from_micros(robot.now().as_micros()), &bytes);
                }
                robot.advance_ms(1);
            }
        }
        passive.finish();
        let report = observation.report();
        let truth = surveyed(options, &ALL);
        assert!(report.answers.len() >= 7, "{report:?}");
        for answer in &report.answers {
            let asked = truth
                .answers
                .iter()
                .find(|other| other.probe == answer.probe)
                .unwrap();
            assert_eq!(
                (&answer.heard, &answer.sets),
                (&asked.heard, &asked.sets),
                "{}",
                answer.probe
            );
        }
    }
}

#[test]
fn files_of_controllers_are_read_and_those_of_the_emulator_are_its_defaults() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/controllers");
    let mut read = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let report = Report::read(&std::fs::read_to_string(&path).unwrap()).unwrap();
        let name = path.file_stem().unwrap().to_str().unwrap();
        assert!(report.share || name.starts_with("emulator-"), "{name}");
        if name.starts_with("emulator-") {
            let others = report
                .answers
                .iter()
                .filter(|answer| answer.verdict == Verdict::Variation);
            assert_eq!(
                others.collect::<Vec<_>>(),
                Vec::<&ts3100_survey::Answer>::new(),
                "{name}"
            );
            assert!(report.answers.len() > 75, "{name}: every question was asked");
        }
        read += 1;
    }
    assert!(read >= 2);
}
