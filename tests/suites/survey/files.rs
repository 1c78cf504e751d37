//! The files of surveys: read, compared, and made into an emulator that answers alike.

use super::{ALL, config, peer, plan, surveyed};
use std::time::Duration;
use ts3100_controller::{Config, PanelAction, Port};
use ts3100_emulator::config::{ServeArgs, Settings};
use ts3100_survey::passive::{Evidence, Passive};
use ts3100_survey::{Class, Report, ReportError, Verdict, differences, survey};
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
    let differences: Vec<_> = differences(&report, &other)
        .into_iter()
        .map(|difference| difference.probe)
        .collect();
    assert_eq!(differences, ["status-form"]);
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

fn answers(mut robot: Robot) -> Vec<(u64, Vec<u8>)> {
    robot.connect(Port::Ip0);
    robot.panel(PanelAction::Servo(true));
    let mut heard = Vec::new();
    for text in HELD {
        robot.raw(Port::Ip0, text);
        for _ in 0..400 {
            let bytes = robot.received(Port::Ip0);
            if !bytes.is_empty() {
                heard.push((robot.now().as_micros(), bytes));
            }
            robot.advance_ms(1);
        }
    }
    heard
}

#[test]
fn a_file_makes_another_robot_answer_alike() {
    let directory = TempDir::new("survey");
    let path = directory.path().join("robot.toml");
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
    for options in [
        &strange[..],
        &[],
        &[("text.checksum", "sum"), ("sp.unsolicited", "true")],
    ] {
        let report = surveyed(options, &ALL);
        std::fs::write(&path, report.write()).unwrap();
        let args = ServeArgs {
            like: Some(path.clone()),
            ..ServeArgs::default()
        };
        let like = Settings::from_args(&args).unwrap().controller;
        let original = answers(Robot::with(config(options)));
        assert!(original.len() > 10, "{original:?}");
        // The same calendar: the daemon's is today.
        let like = Config {
            calendar: config(options).calendar,
            ..like
        };
        assert_eq!(answers(Robot::with(like)), original, "{options:?}");
    }
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
        let times = report.answer_times();
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
        let mut evidence = Evidence::default();
        let mut passive = Passive::new(&mut evidence);
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
        let report = evidence.report();
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
