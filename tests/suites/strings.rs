//! Strings that INPUT finds instead of numbers (T13): the default of each arm, \[U25\] of USER.PAR, and the numbers of
//! STRING.PAR.
//!
//! How the files are read is tested in `ts3100-proto`, what counts as a number in `ts3100-controller`.

use serde_json::{Value as Json, json};
use ts3100_controller::findings::rules;
use ts3100_controller::model::ArmModel;
use ts3100_controller::options::Malformed;
use ts3100_controller::{Config, Dialect, PanelAction, Port};
use ts3100_proto::parameter::OpenMode;
use ts3100_tests::Robot;
use ts3100_tests::round_trip::{from_json, round_trip, to_json};

const READS: &str = "GLOBAL\nN = 7\nX = 7.5\nEND\nPROGRAM TEST\nINPUT IP1, N, X\nEND\n";

/// A robot with a program that reads two numbers.
fn robot(dialect: Dialect, model: ArmModel, malformed: Option<Malformed>) -> Robot {
    let mut config = Config::new(dialect);
    config.model = model;
    config.options.malformed = malformed.or(config.options.malformed);
    config.options.open_mode = [OpenMode::Server; 4];
    let mut robot = Robot::with(config);
    robot.load("TEST", READS);
    robot.connect(Port::Ip0);
    robot.connect(Port::Ip1);
    robot.panel(PanelAction::Servo(true));
    robot
}

fn six_axes() -> Robot {
    robot(Dialect::Field, ArmModel::tv800(), None)
}

/// With this as the rows of \[U25\] and of STRING.PAR, in force since a power cycle.
fn set(robot: &mut Robot, functions: &str, strings: &str) {
    write_functions(robot, functions);
    put(robot, "STRING.PAR", strings);
    power_cycle(robot);
}

fn put(robot: &mut Robot, name: &str, content: &str) {
    robot.seat.controller.put_file(name, content.as_bytes()).unwrap();
}

fn write_functions(robot: &mut Robot, functions: &str) {
    let content = format!("[U06]\r{{COM1}} = 9600 8 0 1\r{{HOST}} = 9600 8 0 1\r{functions}\r[END]\r");
    put(robot, "USER.PAR", &content);
}

fn power_cycle(robot: &mut Robot) {
    robot.panel(PanelAction::PowerCycle);
    robot.connect(Port::Ip0);
    robot.connect(Port::Ip1);
    robot.panel(PanelAction::Servo(true));
}

/// What INPUT makes of a record: both numbers, and the alarms.
fn read(robot: &mut Robot, record: &str) -> (String, Vec<String>) {
    let before = robot.alarms().len();
    robot.command(Port::Ip0, "RS,ERR");
    robot.command(Port::Ip0, "RS,STP");
    robot.command(Port::Ip0, "RN");
    robot.raw(Port::Ip1, record.as_bytes());
    robot.advance_ms(100);
    let value = |robot: &mut Robot, name: &str| {
        let answer = robot.ask(Port::Ip0, &format!("MR,{name}"));
        robot.send(Port::Ip0, b"OK\r");
        let text = String::from_utf8(answer).unwrap();
        text.trim_start_matches("FL,")
            .trim_end_matches("\r\u{1A}")
            .to_string()
    };
    let values = format!("{} {}", value(robot, "N 0"), value(robot, "X 1"));
    (values, robot.alarms().split_off(before))
}

fn numbers(robot: &mut Robot, record: &str) -> String {
    let (values, alarms) = read(robot, record);
    assert_eq!(alarms, [""; 0], "{record:?}");
    values
}

fn refused(robot: &mut Robot, record: &str) {
    assert_eq!(read(robot, record).1, ["2-046"], "{record:?}");
}

// clause: S89 T13
#[test]
fn a_string_is_an_alarm_but_on_six_axes_in_the_manual_dialect() {
    let (six, scara) = (ArmModel::tv800, ArmModel::thl400);
    let cases = [
        (Dialect::Field, six(), None, true),
        (Dialect::Field, scara(), None, true),
        (Dialect::Manual, six(), None, false),
        (Dialect::Manual, scara(), None, true),
        (Dialect::Manual, six(), Some(Malformed::Alarm), true),
        (Dialect::Manual, scara(), Some(Malformed::LeadingNumber), false),
    ];
    for (dialect, model, option, alarm) in cases {
        let is_scara = model == scara();
        let mut robot = robot(dialect, model, option);
        robot.command(Port::Ip0, "RN");
        robot.raw(Port::Ip1, b"12mm,5\r");
        robot.advance_ms(100);
        let expected: &[&str] = if alarm { &["2-046"] } else { &[] };
        assert_eq!(
            robot.alarms(),
            expected,
            "{dialect:?}, SCARA {is_scara}, {option:?}"
        );
    }
}

// clause: S90 T13
#[test]
fn u25_makes_a_string_0_or_looks_it_up() {
    for (dialect, model) in [
        (Dialect::Field, ArmModel::tv800()),
        (Dialect::Field, ArmModel::thl400()),
        (Dialect::Manual, ArmModel::thl400()),
    ] {
        let mut robot = robot(dialect, model, None);
        refused(&mut robot, "OK,5\r");
        for (rows, values) in [
            ("[U25]\r= 1 0 0 0 0 0", Some("0 5.000")),
            ("[U25]\r= 2 0 0 0 0 0", Some("12 5.000")),
            ("[U25]\r= 0 1 2 1 2 1\r= 1 1 1 1 1 1", None),
            ("[U25]", None),
            ("", None),
        ] {
            set(&mut robot, rows, "= 12 \"OK\"\r");
            match values {
                Some(values) => assert_eq!(numbers(&mut robot, "OK,5\r"), values, "{rows}"),
                None => refused(&mut robot, "OK,5\r"),
            }
            assert_eq!(robot.findings.count(&rules::INPUT_NOT_A_NUMBER), {
                robot.alarms().iter().filter(|alarm| *alarm == "2-046").count() as u64
            });
        }
    }
}

// clause: S90 T13 T27
#[test]
fn u25_has_no_effect_where_the_leading_number_counts() {
    let leading = Some(Malformed::LeadingNumber);
    for (dialect, model, malformed) in [
        (Dialect::Manual, ArmModel::tv800(), None),
        (Dialect::Field, ArmModel::tv800(), leading),
        (Dialect::Field, ArmModel::thl400(), leading),
        (Dialect::Manual, ArmModel::thl400(), leading),
    ] {
        for functions in ["[U25]\r= 1 0 0 0 0 0", "[U25]\r= 2 0 0 0 0 0"] {
            let mut robot = robot(dialect, model.clone(), malformed);
            set(&mut robot, functions, "= 3 \"12mm\"\r");
            robot.load("TEST", READS);
            robot.command(Port::Ip0, "RN");
            robot.raw(Port::Ip1, b"12mm,5\r");
            robot.advance_ms(100);
            assert_eq!(robot.ask(Port::Ip0, "MR,N 0"), b"FL,12\r\x1A", "{functions}");
        }
    }
}

// clause: S91 T13 T27
#[test]
fn each_value_is_looked_up_by_itself_in_exact_letters() {
    let mut robot = six_axes();
    let rows = "= 0 \"OK000\"\r= 32767 \"LAST\"\r= 5 \"A B\"\r= 6 \"A B\"\r= 8 \"1X\"\r= 9 \"5\"\r= 4 \"\"\r";
    set(&mut robot, "[U25]\r= 2 0 0 0 0 0", rows);
    for (record, values) in [
        ("OK000,LAST\r", "0 32767.000"),
        (" A B , LAST \r", "5 32767.000"),
        ("1X,A B\r", "8 5.000"),
        // A number is no string, and no value is 0.
        ("5,5\r", "5 5.000"),
        (",1X\r", "0 8.000"),
        ("LAST\rOK000\r", "32767 0.000"),
    ] {
        assert_eq!(numbers(&mut robot, record), values, "{record:?}");
    }
    for record in ["ok000,1\r", "LAST1,1\r", "AB,1\r", "NONE,1\r", "1,NONE\r"] {
        refused(&mut robot, record);
    }
}

// clause: S91 T13
#[test]
fn string_par_is_made_by_a_host_counts_from_power_on_and_can_be_erased() {
    let mut robot = six_axes();
    assert_eq!(
        robot.ask(Port::Ip0, "UL,STRING.PAR"),
        b"NG\r",
        "there is none at first"
    );
    set(&mut robot, "[U25]\r= 2 0 0 0 0 0", "= 1 \"OK\"\r");
    assert_eq!(numbers(&mut robot, "OK,5\r"), "1 5.000");
    robot.command(Port::Ip0, "DL,STRING.PAR");
    robot.command(Port::Ip0, "FL,= 2 \"OK\"\r\u{1A}");
    assert_eq!(robot.findings.count(&rules::PARAMETER_PENDING), 1);
    assert_eq!(robot.findings.count(&rules::PARAMETER_BROKEN), 0);
    assert_eq!(numbers(&mut robot, "OK,5\r"), "1 5.000", "the old one");
    robot.seat.controller = round_trip(&robot.seat.controller);
    assert_eq!(numbers(&mut robot, "OK,5\r"), "1 5.000", "in a snapshot too");
    power_cycle(&mut robot);
    assert_eq!(numbers(&mut robot, "OK,5\r"), "2 5.000");
    assert_eq!(robot.ask(Port::Ip0, "SL,STRING.PAR"), b"NG\r");
    let directory = String::from_utf8(robot.file(Port::Ip0, "CA")).unwrap();
    assert!(directory.contains("STRING.PAR 9\r"), "{directory}");
    robot.command(Port::Ip0, "ER,STRING.PAR");
    assert_eq!(numbers(&mut robot, "OK,5\r"), "2 5.000", "until the power goes");
    power_cycle(&mut robot);
    refused(&mut robot, "OK,5\r");
}

// clause: S90 T13
#[test]
fn the_drive_of_a_scara_alone_begins_with_u25() {
    for dialect in [Dialect::Field, Dialect::Manual] {
        for (model, rows) in [(ArmModel::tv800(), 0), (ArmModel::thl400(), 4)] {
            let robot = robot(dialect, model, None);
            let drive = robot.seat.controller.drive();
            let user = String::from_utf8(drive.get("USER.PAR").unwrap().to_vec()).unwrap();
            assert_eq!(user.matches("= 0 0 0 0 0 0").count(), rows, "{user}");
            assert_eq!(user.matches("[U25]").count(), rows / 4, "{user}");
            assert!(!drive.contains("STRING.PAR"));
        }
    }
}

// clause: S90 T13 T27
#[test]
fn a_bad_first_number_of_u25_keeps_the_last_good_one() {
    for model in [ArmModel::tv800(), ArmModel::thl400()] {
        let mut robot = robot(Dialect::Field, model, None);
        for (good, value) in [("1", "0 5.000"), ("2", "7 5.000")] {
            set(&mut robot, &format!("[U25]\r= {good} 0 0 0 0 0"), "= 7 \"OK\"\r");
            for first in ["3", "-1", "X"] {
                let before = robot.alarms().len();
                write_functions(&mut robot, &format!("[U25]\r= {first} 0 0 0 0 0"));
                power_cycle(&mut robot);
                assert_eq!(robot.alarms()[before..], ["1-101"], "{first}");
                assert_eq!(numbers(&mut robot, "OK,5\r"), value, "{first} after {good}");
            }
        }
    }
}

// clause: S91 T13 T27
#[test]
fn bad_rows_of_string_par_raise_one_1_101() {
    let mut robot = six_axes();
    let rows = "= 1 \"A\"\r= 40000 \"B\"\r= C\r= 2 \"D\"\r";
    set(&mut robot, "[U25]\r= 2 0 0 0 0 0", rows);
    assert_eq!(robot.alarms(), ["1-101"]);
    let list = String::from_utf8(robot.file(Port::Ip0, "AC")).unwrap();
    assert!(list.contains("STRING.PAR: line 2: expected = N"), "{list}");
    let active = robot.seat.controller.alarms().active();
    let details: Vec<_> = active.iter().map(|alarm| alarm.detail.as_str()).collect();
    assert!(
        details[0].ends_with("found `= 40000 \"B\"`; 2 such rows"),
        "{details:?}"
    );
    assert_eq!(numbers(&mut robot, "A,D\r"), "1 2.000");
    refused(&mut robot, "B,1\r");
    let active = robot.seat.controller.alarms().active();
    let message = "INPUT: expected a number or a string of STRING.PAR, found \"B\"";
    assert!(active[0].detail.ends_with(message), "{active:?}");
    robot.command(Port::Ip0, "DL,STRING.PAR");
    robot.command(Port::Ip0, "FL,= -1 \"OK\"\r\u{1A}");
    assert_eq!(robot.findings.count(&rules::PARAMETER_BROKEN), 1);
}

// clause: S91 T13
#[test]
fn a_snapshot_has_the_rows_and_no_others_than_a_file_can_have() {
    let mut robot = six_axes();
    let rows: String = (0..129).map(|n| format!("= {n} \"T{n}\"\r")).collect();
    set(&mut robot, "[U25]\r= 2 0 0 0 0 0", &rows);
    let whole: Json = serde_json::from_str(&to_json(&robot.seat.controller)).unwrap();
    assert_eq!(whole["strings"].as_array().unwrap().len(), 128);
    assert_eq!(whole["user"]["input_string"], "LookUp");
    let with = |rows: Json| {
        let mut json = whole.clone();
        json["strings"] = rows;
        from_json(&json.to_string()).map(drop)
    };
    let row = |number: u32, text: &str| json!({"number": number, "text": text});
    for (valid, good) in [
        (row(32_767, &"x".repeat(32)), true),
        (row(32_768, "A"), false),
        (row(1, &"x".repeat(33)), false),
        (row(1, "A\"B"), false),
    ] {
        let result = with(json!([valid]));
        assert_eq!(result.is_ok(), good, "{valid}: {result:?}");
    }
    let error = with(Json::Array(vec![row(1, "A"); 129])).unwrap_err();
    assert!(error.contains("strings: expected"), "{error}");
}
