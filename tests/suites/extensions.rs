//! The commands that real hosts send beyond the manual (hosts.md 2): answers to the byte, effects, refusals and
//! permissions, on both arm models.
//!
//! Jogging and the watchdog are in `jogging.rs`, MN is in `maintenance.rs`.

use ts3100_controller::model::ArmModel;
use ts3100_controller::{Config, ControlRight, Dialect, KeySwitch, PanelAction, Port};
use ts3100_tests::{Robot, notation};

/// A field-dialect robot with the SCARA arm, a host on IP0, servo on.
pub fn scara() -> Robot {
    scara_of(ArmModel::thl400())
}

pub fn scara_of(model: ArmModel) -> Robot {
    let mut robot = Robot::with(Config {
        model,
        ..Config::new(Dialect::Field)
    });
    robot.connect(Port::Ip0);
    robot.panel(PanelAction::Servo(true));
    robot
}

/// Across 50 above the higher end, the first 10 straight up, the last 5 straight down, as TsRemoteLib sends it
/// (129 bytes).
// clause: T11 L69
#[test]
fn an_arch_of_a_real_host_is_carried_out() {
    let mut robot = scara();
    let arch = |x: &str, gate: &str| {
        format!(
            "DO,MOVEJ POINT({x},100.500,-20.123,45.000,0.000,1) POINT({gate}) with SPEED=100.000,ACCEL=100.000"
        )
    };
    robot.command(Port::Ip0, "DO,MOVE POINT(250.0,-100.0,-40.0,0.0,0.0,1)");
    robot.advance_ms(5_000);
    robot.command(Port::Ip0, &arch("200.000", "50.000,10.000,5.000"));
    let (mut highest, mut last) = (f64::MIN, 0.0);
    for _ in 0..500 {
        robot.advance_ms(5);
        last = values(&mut robot, "PR,4")[2];
        highest = highest.max(last);
    }
    assert!(highest <= 29.878 && highest > 29.0, "{highest}");
    assert!((last + 20.123).abs() < 1e-3, "{last}");
    let end = values(&mut robot, "PR,4");
    assert!(
        (end[0] - 200.0).abs() < 1e-3 && (end[1] - 100.5).abs() < 1e-3,
        "{end:?}"
    );
    // A distance that the way down does not have: accepted, then the alarm; the arm stays.
    robot.command(Port::Ip0, &arch("250.000", "50.000,10.000,500.000"));
    robot.advance_ms(1_000);
    assert!((values(&mut robot, "PR,4")[0] - 200.0).abs() < 1e-3);
    assert!(text(&mut robot, "SM,1").contains("AL2"));
}

/// The same with the six-axis arm.
pub fn six_axis() -> Robot {
    let mut robot = Robot::new(Dialect::Field);
    robot.connect(Port::Ip0);
    robot.panel(PanelAction::Servo(true));
    robot
}

/// Content of an FL of characters.
pub fn text(robot: &mut Robot, command: &str) -> String {
    String::from_utf8(robot.file(Port::Ip0, command)).unwrap()
}

/// The values PR or VL answers.
pub fn values(robot: &mut Robot, command: &str) -> Vec<f64> {
    let content = text(robot, command);
    content.split(',').map(|item| item.parse().unwrap()).collect()
}

/// A 16-bit word of the SF body.
pub fn word(body: &[u8], offset: usize) -> u16 {
    u16::from_be_bytes([body[offset], body[offset + 1]])
}

fn refused(robot: &mut Robot, command: &str) {
    assert_eq!(
        notation::write(&robot.ask(Port::Ip0, command)),
        "NG<CR>",
        "{command}"
    );
}

/// One well-formed text of every extension.
const EXAMPLES: [&str; 20] = [
    "SM,1",
    "WD,700 2",
    "AC",
    "AH",
    "IO,1",
    "HI,1 8",
    "HO,1 8 165",
    "PR,0",
    "VL,0",
    "ZS,1 WK1 1.000 2.000 3.000 4.000 5.000 6.000",
    "MD,1",
    "RT,2",
    "SC,3",
    "JG,1 +",
    "RS,ERR",
    "MN,1",
    "RM,1",
    "PS",
    "MP,0 POINT(400,0,300,0,0,0,0,0)",
    "EM,2",
];

// clause: CMD-LST-05 CMD-LST-04
#[test]
fn the_manual_dialect_knows_none_of_them() {
    for command in EXAMPLES {
        let mut robot = Robot::new(Dialect::Manual);
        robot.connect(Port::Ip0);
        robot.panel(PanelAction::Servo(true));
        let before = robot.total(Port::Ip0);
        refused(&mut robot, command);
        robot.advance_ms(2_000);
        assert_eq!(robot.total(Port::Ip0), before, "{command} has an effect");
        assert!(robot.alarms().is_empty(), "{command}");
    }
}

// clause: L82
#[test]
fn six_axes_serve_each_of_them_by_default() {
    for command in EXAMPLES {
        let mut robot = six_axis();
        let answer = robot.ask(Port::Ip0, command);
        assert!(answer == b"OK\r" || answer.starts_with(b"FL,"), "{command}");
    }
}

// clause: FRM-01
#[test]
fn each_is_answered_in_the_form_it_was_asked() {
    for command in EXAMPLES {
        let bare = [command.as_bytes(), b"\r\x03"].concat();
        let mut with = six_axis();
        let mut without = with.clone();
        let answer = with.ask(Port::Ip0, command);
        without.raw(Port::Ip0, &bare);
        let found = without.received(Port::Ip0);
        assert_eq!(found, [answer.as_slice(), b"\x03"].concat(), "{command}");
    }
}

// clause: PRM-LEG-06 CMD-RS-02
#[test]
fn running_refuses_jogging_and_the_alarm_reset() {
    let mut robot = Robot::ready("PROGRAM T\nDELAY 100.0\nEND\n");
    robot.command(Port::Ip0, "RN");
    for command in ["JG,1 +", "RS,ERR"] {
        refused(&mut robot, command);
    }
    for command in ["SM,1", "PR,1", "VL,1", "AC", "AH", "HI,1 8", "MN,1", "PS"] {
        robot.file(Port::Ip0, command);
    }
    assert!(robot.ask(Port::Ip0, "IO,1").starts_with(b"FL,"));
    robot.send(Port::Ip0, b"OK\r");
    for command in ["WD,700 2", "WD,0 0", "HO,1 8 1"] {
        robot.command(Port::Ip0, command);
    }
    assert!(text(&mut robot, "SU").ends_with("running"));
}

// clause: FRM-18 CMD-LST-04
#[test]
fn operands_out_of_range_are_refused_without_effect() {
    let mut robot = six_axis();
    let before = robot.total(Port::Ip0);
    for command in [
        "SM",
        "SM,2",
        "MN,18",
        "SM,1 1",
        "WD",
        "WD,700",
        "WD,700 3",
        "WD,-1 2",
        "WD,x 2",
        "AC,1",
        "AH,1",
        "IO",
        "IO,2",
        "HI",
        "HI,1",
        "HI,0 8",
        "HI,1 0",
        "HI,1 33",
        "HI,33 33",
        "HI,401 65",
        "HO,1 33 0",
        "HI,60 8",
        "HI,262 8",
        "HO,1 8",
        "HO,1 8 256",
        "HO,60 8 1",
        "HO,1 33 1",
        "HO,1 0 0",
        "HO,249 1 1",
        "HO,1 8 -1",
        "PR",
        "PR,6",
        "PR,-1",
        "VL,2",
        "VL",
        "ZS,3 WK1 1 2 3 4 5 6",
        "ZS,1 WK1 1 2 3 4",
        "ZS,1 WK1 1e308 2 3 4 5 6",
        "ZS,2 TL1 1 2 3 4 5 -1e39",
        "ZS,1 WK1 1 2 3 4 5 6 7",
        "ZS,1 WK1",
        "ZS,1",
        "MD,3",
        "MD,",
        "RT,3",
        "SC,4",
        "JG,0 +",
        "JG,7 +",
        "JG,9 +",
        "JG,1",
        "JG,1 x",
        "JG,+ 1",
        "RS,ERROR",
        "RS,ER",
    ] {
        refused(&mut robot, command);
    }
    robot.advance_ms(10_000);
    assert_eq!(robot.total(Port::Ip0), before);
}

#[test]
fn sm_shows_each_of_its_items() {
    let mut robot = six_axis();
    robot.panel(PanelAction::Servo(false));
    let idle = "EE0 SE0 SC0 BC0 ES0 SS0 SV0 MM5 RM1 RS0 OV100 AL0 DC0 DS0";
    let mut expected: Vec<String> = idle.split(' ').map(str::to_string).collect();
    assert_eq!(text(&mut robot, "SM,1"), idle);
    let mut now = |robot: &mut Robot, changes: &[(usize, &str)], what: &str| {
        for (place, item) in changes {
            expected[*place] = (*item).to_string();
        }
        assert_eq!(text(robot, "SM,1"), expected.join(" "), "{what}");
    };
    robot.command(Port::Ip0, "SO");
    now(&mut robot, &[(6, "SV1")], "servo");
    for (mode, item) in [
        ("CONT", "RM0"),
        ("SEGMENT", "RM3"),
        ("STEP", "RM2"),
        ("CYCLE", "RM1"),
    ] {
        robot.command(Port::Ip0, &format!("EC,MODE {mode}"));
        now(&mut robot, &[(8, item)], mode);
    }
    robot.command(Port::Ip0, "EC,OVRD 55");
    now(&mut robot, &[(10, "OV55")], "override");
    for (right, item) in [
        (ControlRight::Sig, "MM2"),
        (ControlRight::Rs232c, "MM4"),
        (ControlRight::Ether, "MM5"),
    ] {
        robot.panel(PanelAction::ControlRight(right));
        now(&mut robot, &[(7, item)], item);
    }
    for (key, item) in [
        (KeySwitch::Teaching, "MM0"),
        (KeySwitch::Internal, "MM1"),
        (KeySwitch::Ext, "MM5"),
    ] {
        robot.panel(PanelAction::Key(key));
        now(&mut robot, &[(7, item)], item);
    }
    for (line, on, off) in [(257, (2, "SC1"), (2, "SC0")), (260, (3, "BC1"), (3, "BC0"))] {
        robot.panel(PanelAction::InputLine { line, on: true });
        now(&mut robot, &[on], "a system input");
        robot.panel(PanelAction::InputLine { line, on: false });
        now(&mut robot, &[off], "a system input");
    }
    robot.panel(PanelAction::SafetySwitch(true));
    now(
        &mut robot,
        &[(1, "SE1"), (5, "SS1"), (6, "SV0"), (11, "AL8")],
        "safety switch",
    );
    robot.panel(PanelAction::SafetySwitch(false));
    robot.command(Port::Ip0, "RS,ERR");
    now(&mut robot, &[(1, "SE0"), (5, "SS0"), (11, "AL0")], "RS,ERR");
    robot.panel(PanelAction::EmergencyStop(true));
    now(
        &mut robot,
        &[(0, "EE1"), (4, "ES1"), (11, "AL8")],
        "emergency stop",
    );
    robot.panel(PanelAction::EmergencyStop(false));
    robot.command(Port::Ip0, "RS,ERR");
    now(&mut robot, &[(0, "EE0"), (4, "ES0"), (11, "AL0")], "RS,ERR");
}

#[test]
fn sm_shows_the_run_status() {
    let mut robot = Robot::ready("PROGRAM T\nDELAY 10.0\nDELAY 10.0\nEND\n");
    let status = |robot: &mut Robot| text(robot, "SM,1").split(' ').nth(9).unwrap().to_string();
    assert_eq!(status(&mut robot), "RS0");
    robot.command(Port::Ip0, "RN");
    assert_eq!(status(&mut robot), "RS1");
    robot.command(Port::Ip0, "EC,BREAK");
    assert_eq!(status(&mut robot), "RS2");
    robot.command(Port::Ip0, "RN");
    robot.command(Port::Ip0, "SP");
    robot.advance_ms(11_000);
    assert_eq!(status(&mut robot), "RS3");
}

// clause: S22
#[test]
fn ac_and_ah_to_the_byte() {
    let mut robot = six_axis();
    assert_eq!(robot.ask(Port::Ip0, "AC"), b"FL,0\x1A");
    robot.send(Port::Ip0, b"OK\r");
    assert_eq!(robot.ask(Port::Ip0, "AH"), b"FL,0\x1A");
    robot.send(Port::Ip0, b"OK\r");
    robot.advance_ms(61_000);
    robot.panel(PanelAction::EmergencyStop(true));
    robot.advance_ms(1_000);
    robot.panel(PanelAction::Battery(true));
    let both = "2,001-102,Battery low,14-02-06 00:01:02\r008-014,Emergency Stop SW ON,14-02-06 00:01:01\r";
    let with_four_digits = both.replace(",14-", ",2014-");
    let mut active: Vec<String> = text(&mut robot, "AC")[2..]
        .split('\r')
        .map(str::to_string)
        .collect();
    active.sort();
    assert_eq!(
        active.join("\r"),
        format!("\r{}", with_four_digits[2..].trim_end()),
        "in whatever order"
    );
    assert_eq!(text(&mut robot, "AH"), both);
    robot.panel(PanelAction::EmergencyStop(false));
    robot.command(Port::Ip0, "RS,ERR");
    assert_eq!(text(&mut robot, "AC"), "0");
    assert_eq!(text(&mut robot, "AH"), both, "a reset leaves the history");
}

// clause: FL-02 FL-05
#[test]
fn a_long_history_goes_on_in_bare_texts() {
    let mut robot = six_axis();
    for _ in 0..16 {
        robot.panel(PanelAction::EmergencyStop(true));
        robot.panel(PanelAction::EmergencyStop(false));
    }
    let mut texts = vec![robot.ask(Port::Ip0, "AH")];
    while !texts.last().unwrap().ends_with(b"\x1A") {
        robot.send(Port::Ip0, b"OK\r");
        let bytes = robot.received(Port::Ip0);
        texts.push(ts3100_tests::unframe(&bytes).unwrap());
    }
    assert!(texts.len() >= 3);
    for (place, data) in texts.iter().enumerate() {
        assert_eq!(data.starts_with(b"FL,"), place == 0);
        assert!(data.len() == 253 || place == texts.len() - 1);
    }
    let whole = texts.concat();
    assert!(whole.starts_with(b"FL,16,008-014,Emergency Stop SW ON,14-02-06 "));
    assert_eq!(whole.iter().filter(|byte| **byte == b'\r').count(), 16);
}

// clause: SF-25 SF-33 S14 S24 S27 S82 L53 S96
#[test]
fn io_hi_and_ho_speak_of_the_same_lines_as_sf() {
    let mut robot = six_axis();
    for line in [1, 3, 6, 8, 101, 201, 301, 332, 464] {
        robot.panel(PanelAction::InputLine { line, on: true });
    }
    robot.command(Port::Ip0, "HO,1 8 165");
    robot.command(Port::Ip0, "HO,15 4 6");
    robot.command(Port::Ip0, "HO,201 8 129");
    let first = robot.ask(Port::Ip0, "IO,1");
    assert_eq!(first.len(), 3 + 80, "no EOF");
    robot.send(Port::Ip0, b"OK\r");
    let io = &first[3..83];
    let sf = robot.total(Port::Ip0);
    assert_eq!(io[..32], sf[52..84], "inputs");
    assert_eq!(io[40..72], sf[84..116], "outputs");
    assert_eq!(io[32..40], [0, 0, 0, 0, 0, 0, 0x80, 0], "line 464");
    assert_eq!(io[72..80], [0; 8]);
    assert_eq!((word(&sf, 84), word(&sf, 86)), (165 | 1 << 15, 1));
    assert_eq!(word(&sf, 100), 129);
    for (command, value) in [
        ("HI,1 8", "165"),
        ("HI,2 8", "82"),
        ("HI,101 16", "1"),
        ("HI,201 1", "1"),
        ("HI,9 8", "0"),
        ("HI,1 32", "165"),
        ("HI,101 1", "1"),
        ("HI,301 32", "2147483649"),
        ("HI,433 32", "2147483648"),
    ] {
        assert_eq!(text(&mut robot, command), format!("{value}\r"), "{command}");
    }
    robot.command(Port::Ip0, "HO,1 8 0");
    assert_eq!(word(&robot.total(Port::Ip0), 84), 1 << 15, "the other lines stay");
}

#[test]
fn ho_refused_switches_no_line() {
    let mut robot = six_axis();
    robot.command(Port::Ip0, "HO,57 8 255");
    let before = robot.total(Port::Ip0);
    refused(&mut robot, "HO,57 16 0");
    refused(&mut robot, "HO,205 8 255");
    assert_eq!(robot.total(Port::Ip0), before);
}

// clause: S12 S73 L55 L81
#[test]
fn positions_of_the_six_axis_arm() {
    let mut robot = six_axis();
    let sf = robot.total(Port::Ip0);
    let floats = |at: usize, count: usize| -> Vec<f64> {
        let block = sf[at..at + 4 * count].chunks(4);
        block
            .map(|four| f64::from(f32::from_be_bytes(four.try_into().unwrap())))
            .collect()
    };
    for (joint, expected) in [("PR,0", floats(116, 8)), ("PR,3", floats(116, 8))] {
        close(&values(&mut robot, joint), &expected);
    }
    for (query, at) in [("PR,1", 148), ("PR,4", 148), ("PR,2", 180), ("PR,5", 180)] {
        let found = values(&mut robot, query);
        assert_eq!(found.len(), 9, "{query}");
        close(&found[..8], &floats(at, 8));
        assert!(text(&mut robot, query).ends_with(",11111"), "{query}");
    }
    robot.command(
        Port::Ip0,
        "DO,MOVE POINT(300.0,100.0,250.0,0.0,0.0,10.0,0.0,0.0,LAFSS)",
    );
    robot.advance_ms(5_000);
    let found = text(&mut robot, "PR,1");
    assert_eq!(
        found,
        "300.000,100.000,250.000,0.000,0.000,10.000,0.000,0.000,11211"
    );
}

fn close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            (found - expected).abs() < 0.0011,
            "{found} found, {expected} expected"
        );
    }
}

// clause: S12 S73 L41 L55
#[test]
fn positions_of_the_scara_arm() {
    let mut robot = scara();
    assert!(values(&mut robot, "PR,0").len() >= 5);
    for (config, lefty, query) in [(1, "LEFTY", "PR,1"), (2, "RIGHTY", "PR,4")] {
        robot.command(
            Port::Ip0,
            &format!("DO,MOVE POINT(250.0,100.0,-20.0,45.0,7.0,{lefty})"),
        );
        robot.advance_ms(5_000);
        let expected = format!("250.000,100.000,-20.000,45.000,7.000,0.000,{config}");
        assert_eq!(text(&mut robot, query), expected);
    }
    assert_eq!(values(&mut robot, "PR,2").len(), 7);
    assert_eq!(values(&mut robot, "PR,5").len(), 7);
}

// clause: S13 S80 L56
#[test]
fn speeds_are_those_of_the_motion() {
    let mut robot = six_axis();
    assert!(values(&mut robot, "VL,0").iter().all(|speed| *speed == 0.0));
    assert!(
        text(&mut robot, "VL,1")
            .split(',')
            .all(|item| item.trim_start_matches('-') == "0.000")
    );
    robot.command(Port::Ip0, "DO,MOVEA 1,90.0 WITH SPEED=50");
    robot.advance_ms(400);
    let (before, speeds) = (values(&mut robot, "PR,0")[0], values(&mut robot, "VL,0"));
    assert!(
        (speeds[0] - 120.0).abs() < 0.01,
        "half of 240 degrees/s: {speeds:?}"
    );
    assert!(speeds[1..].iter().all(|speed| *speed == 0.0), "{speeds:?}");
    let world = values(&mut robot, "VL,1");
    assert!(world.len() >= 6 && world[0].hypot(world[1]) > 100.0, "{world:?}");
    robot.advance_ms(100);
    let gone = values(&mut robot, "PR,0")[0] - before;
    assert!((gone - 12.0).abs() < 0.01, "{gone}");
    robot.advance_ms(5_000);
    assert!(values(&mut robot, "VL,0").iter().all(|speed| *speed == 0.0));
}

// clause: SF-44 SF-45
#[test]
fn zs_sets_the_work_coordinate_and_the_tool() {
    let mut robot = six_axis();
    let (world, _) = (values(&mut robot, "PR,1"), values(&mut robot, "PR,2"));
    robot.command(Port::Ip0, "ZS,1 WK1 100.000 -50.000 25.000 0.000 0.000 0.000");
    let work = values(&mut robot, "PR,2");
    for (axis, shift) in [100.0, -50.0, 25.0].into_iter().enumerate() {
        assert!((world[axis] - work[axis] - shift).abs() < 0.002, "axis {axis}");
    }
    close(&values(&mut robot, "PR,1"), &world);
    robot.command(Port::Ip0, "ZS,2 TL1 0.000 0.000 60.000 0.000 0.000 0.000");
    let with_tool = values(&mut robot, "PR,1");
    assert!(
        (with_tool[2] - world[2]).abs() > 59.9,
        "a tool of 60 mm: {with_tool:?}"
    );
    let sf = robot.total(Port::Ip0);
    assert!(sf[212..].starts_with(b"WK1\0") && sf[232..].starts_with(b"TL1\0"));
    robot.command(Port::Ip0, "DO,MOVE POINT(250.0,60.0,150.0,0.0,0.0,0.0,0.0,0.0)");
    robot.advance_ms(5_000);
    close(&values(&mut robot, "PR,2")[..3], &[250.0, 60.0, 150.0]);
    close(&values(&mut robot, "PR,1")[..3], &[350.0, 10.0, 175.0]);

    let mut robot = scara();
    robot.command(Port::Ip0, "ZS,1 WK1 10.000 20.000 30.000 0.000");
    let (world, work) = (values(&mut robot, "PR,1"), values(&mut robot, "PR,2"));
    assert!((world[0] - work[0] - 10.0).abs() < 0.002 && (world[2] - work[2] - 30.0).abs() < 0.002);
    refused(&mut robot, "ZS,1 WK1 1.000 2.000 3.000 4.000 5.000 6.000");
}

// clause: SF-14 SF-15 SF-16
#[test]
fn sf_shows_md_rt_and_sc() {
    let mut robot = six_axis();
    for (command, offset, count) in [("SC", 34, 4), ("RT", 36, 3), ("MD", 38, 3)] {
        for value in 0..count {
            robot.command(Port::Ip0, &format!("{command},{value}"));
            assert_eq!(word(&robot.total(Port::Ip0), offset), value, "{command}");
        }
    }
}

#[test]
fn rs_err_ends_alarms_whose_cause_is_gone() {
    let mut robot = six_axis();
    robot.panel(PanelAction::EmergencyStop(true));
    robot.command(Port::Ip0, "RS,ERR");
    assert_eq!(word(&robot.total(Port::Ip0), 4), 13, "still pressed");
    robot.panel(PanelAction::EmergencyStop(false));
    // As RS: for the port that has the control right (T2).
    robot.panel(PanelAction::Key(KeySwitch::Teaching));
    refused(&mut robot, "RS,ERR");
    assert_eq!(word(&robot.total(Port::Ip0), 4), 13, "not reset");
    robot.panel(PanelAction::Key(KeySwitch::Ext));
    robot.command(Port::Ip0, "RS,ERR");
    assert_eq!(word(&robot.total(Port::Ip0), 4), 0xFFFF);
}
