//! The bodies of SU, SF, EU, VR and CA: how each state of the robot appears in all of them at once.
//!
//! Layouts have unit tests in `ts3100-proto`.

use std::time::Duration;
use ts3100_controller::{Action, Config, Controller, Dialect, Input, IoKind, PanelAction, Port};
use ts3100_tests::{Robot, notation};

fn idle() -> Robot {
    let mut robot = Robot::new(Dialect::Field);
    robot.connect(Port::Ip0);
    robot
}

fn su(robot: &mut Robot) -> String {
    String::from_utf8(robot.file(Port::Ip0, "SU")).unwrap()
}

fn word(body: &[u8], offset: usize) -> u16 {
    u16::from_be_bytes([body[offset], body[offset + 1]])
}

// clause: SF-01 SF-08 SF-18 SF-22 SF-23 SF-24 SF-32 SF-40 SF-46 GEN-03 L34-L38
#[test]
fn an_idle_controller() {
    let mut robot = idle();
    robot.advance_ms(2_000);
    assert_eq!(robot.received(Port::Ip0), b"");
    let body = robot.total(Port::Ip0);
    assert_eq!(body.len(), 276);
    assert_eq!(body[..3], [0, 0, 0]);
    assert_eq!(body[4..24], [0xFF; 20], "no alarm is FFFF");
    assert_eq!(body[24..34], [0; 10], "no file: lines and tasks 0, no feed hold");
    assert_eq!(word(&body, 40), 3, "EXT");
    assert_eq!(body[42..52], [0; 10]);
    assert_eq!(body[76..84], [0; 8]);
    assert_eq!(body[108..116], [0; 8]);
    assert_eq!(body[140..148], [0; 8], "axes 7 and 8");
    assert_eq!(body[212..276], [0; 64]);
}

// clause: SF-42 SF-43 SF-44 I6-I7
#[test]
fn joint_angles_stand_before_world_and_work_coordinates() {
    let mut robot = idle();
    robot.panel(PanelAction::Servo(true));
    let number =
        |body: &[u8], offset: usize| f32::from_be_bytes(body[offset..offset + 4].try_into().unwrap());
    let before = robot.total(Port::Ip0);
    let turn = 30.0 - number(&before, 116);
    robot.command(Port::Ip0, "DO,MOVEA 1, 30");
    robot.advance_ms(10_000);
    let body = robot.total(Port::Ip0);
    assert!((number(&body, 116) - 30.0).abs() < 0.001, "joint 1");
    // Axis 1 turns about Z of the world.
    let (sin, cos) = turn.to_radians().sin_cos();
    for offset in [148, 180] {
        let (x, y) = (number(&before, offset), number(&before, offset + 4));
        let turned = [x * cos - y * sin, x * sin + y * cos, number(&before, offset + 8)];
        for (axis, expected) in turned.into_iter().enumerate() {
            let found = number(&body, offset + 4 * axis);
            assert!(
                (found - expected).abs() < 0.01,
                "{offset}, {axis}: {found} {expected}"
            );
        }
    }
}

// clause: I6-I7 SF-25 SF-26 SF-27 SF-28 SF-33 SF-34 SF-35 SF-41 CMD-IW-01 CMD-IW-02 CMD-IW-03 CMD-IW-04 CMD-IW-05
#[test]
fn every_line_has_its_bit() {
    let mut robot = idle();
    for (line, offset, bit) in [
        (1, 84, 0),
        (16, 84, 15),
        (17, 86, 0),
        (64, 90, 15),
        (101, 92, 0),
        (109, 92, 8),
        (110, 92, 9),
        (164, 98, 15),
        (201, 100, 0),
        (208, 100, 7),
    ] {
        robot.command(Port::Ip0, &format!("IW,{line} 1"));
        assert_eq!(word(&robot.total(Port::Ip0), offset), 1 << bit, "Dout{line}");
        robot.command(Port::Ip0, &format!("IW,{line} 0"));
        assert_eq!(word(&robot.total(Port::Ip0), offset), 0, "Dout{line}");
    }
    for (line, offset, bit) in [
        (1, 52, 0),
        (32, 54, 15),
        (64, 58, 15),
        (101, 60, 0),
        (164, 66, 15),
        (201, 68, 0),
        (217, 70, 0),
        (232, 70, 15),
        (257, 74, 8),
    ] {
        robot.panel(PanelAction::InputLine { line, on: true });
        assert_eq!(word(&robot.total(Port::Ip0), offset), 1 << bit, "Din{line}");
        robot.panel(PanelAction::InputLine { line, on: false });
    }
    for operands in [
        "0 1", "65 1", "70 1", "100 1", "165 1", "200 1", "209 1", "1 2", "1", "", "1 1 2", "-1 1",
    ] {
        assert_eq!(
            robot.ask(Port::Ip0, &format!("IW,{operands}")),
            b"NG\r",
            "IW,{operands}"
        );
    }
    let pairs = |count: u16| {
        (1..=count)
            .map(|line| format!("{line} 1"))
            .collect::<Vec<_>>()
            .join(" ")
    };
    assert_eq!(robot.ask(Port::Ip0, &format!("IW,{}", pairs(33))), b"NG\r");
    assert_eq!(robot.total(Port::Ip0)[84..100], [0; 16], "all or nothing");
    robot.command(Port::Ip0, &format!("IW,{}", pairs(32)));
    assert_eq!(robot.total(Port::Ip0)[84..92], [255, 255, 255, 255, 0, 0, 0, 0]);
    robot.command(Port::Ip0, "IW,1,0,2,0");
    assert_eq!(word(&robot.total(Port::Ip0), 84), 0xFFFC);
}

// clause: CMD-RS-07 CMD-RS-08
#[test]
fn rs_sig_clears_the_first_24_outputs() {
    let mut robot = idle();
    robot.command(Port::Ip0, "IW,1 1 24 1 25 1 101 1");
    robot.command(Port::Ip0, "RS,SIG");
    let body = robot.total(Port::Ip0);
    assert_eq!(
        (word(&body, 84), word(&body, 86), word(&body, 92)),
        (0, 1 << 8, 1)
    );
}

// clause: CMD-RS-07
#[test]
fn rs_sig_ends_the_pulse_of_an_output_that_it_clears() {
    let mut robot = idle();
    robot.put(Input::by_owner(Action::Pulse {
        side: IoKind::Output,
        line: 3,
        on: true,
        length: Duration::from_secs(5),
    }));
    robot.command(Port::Ip0, "RS,SIG");
    let snapshot = robot.seat.controller.snapshot();
    assert!(Controller::restore(snapshot).is_ok());
    robot.command(Port::Ip0, "IW,3 1");
    robot.advance_ms(6_000);
    assert_eq!(word(&robot.total(Port::Ip0), 84), 1 << 2, "on, as IW has set it");
}

// clause: SU-12 SF-17 SF-38 SF-39 CMD-BR-01 CMD-SO-01 S20 S26 L30 T16
#[test]
fn su_and_sf_agree_in_every_mode() {
    use ts3100_controller::{ControlRight, KeySwitch};
    for (key, right, words, number, bit) in [
        (KeySwitch::Teaching, ControlRight::Ether, "teaching", 0, 3),
        (KeySwitch::Internal, ControlRight::Ether, "internal", 1, 4),
        (KeySwitch::Ext, ControlRight::Sig, "external(sig)", 2, 5),
        (KeySwitch::Ext, ControlRight::Rs232c, "external(host)", 3, 6),
        (KeySwitch::Ext, ControlRight::Ether, "external(ethernet)", 3, 6),
    ] {
        let mut robot = idle();
        robot.panel(PanelAction::Key(key));
        robot.panel(PanelAction::ControlRight(right));
        assert!(
            su(&mut robot).starts_with(&format!("MODE:{words}/cycle ")),
            "{words}"
        );
        let body = robot.total(Port::Ip0);
        assert_eq!(word(&body, 40), number, "{words}");
        assert_eq!(word(&body, 106) >> 3 & 0b1111, 1 << (bit - 3), "{words}");
        for servo in [true, false] {
            robot.panel(PanelAction::Servo(servo));
            let body = robot.total(Port::Ip0);
            assert_eq!(
                (body[0] == 1, word(&body, 106) & 2 == 2),
                (servo, servo),
                "{words}"
            );
        }
    }
}

// clause: SF-06 SU-08 SU-12
#[test]
fn su_and_sf_agree_in_every_status() {
    let mut robot = Robot::ready("PROGRAM T\nDELAY 10.0\nDELAY 10.0\nEND\n");
    let both = |robot: &mut Robot| {
        let text = su(robot);
        (
            robot.total(Port::Ip0)[2],
            text.rsplit_once(':').unwrap().1.to_string(),
        )
    };
    assert_eq!(both(&mut robot), (0, "stop(reset)".to_string()));
    robot.command(Port::Ip0, "RN");
    assert_eq!(both(&mut robot), (1, "running".to_string()));
    robot.command(Port::Ip0, "EC,BREAK");
    assert_eq!(both(&mut robot), (2, "stop(retry)".to_string()));
    robot.command(Port::Ip0, "RN");
    robot.command(Port::Ip0, "SP");
    robot.advance_ms(20_000);
    assert_eq!(both(&mut robot), (3, "stop(continue)".to_string()));
    robot.command(Port::Ip0, "RS,STP");
    assert_eq!(both(&mut robot), (0, "stop(reset)".to_string()));
}

// clause: SF-09 SF-11 SF-24 RAM-11
#[test]
fn sf_shows_the_line_of_the_file() {
    let mut robot = Robot::ready("GLOBAL\nA = 1\nEND\nPROGRAM T\nN = 0\nINPUT IP1, N\nINPUT IP1, N\nEND\n");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(50);
    assert_eq!(word(&robot.total(Port::Ip0), 24), 6);
    robot.raw(Port::Ip1, b"1\r");
    robot.advance_ms(50);
    let body = robot.total(Port::Ip0);
    assert_eq!((word(&body, 24), word(&body, 28)), (7, 1));
}

// clause: SF-07 SF-21
#[test]
fn sf_says_when_su_is_worth_asking() {
    let mut robot = idle();
    su(&mut robot);
    assert_eq!(robot.total(Port::Ip0)[3], 0);
    robot.command(Port::Ip0, "EC,OVRD 40");
    assert_eq!(robot.total(Port::Ip0)[3], 1);
    assert!(su(&mut robot).contains("OVRD:40%"));
    assert_eq!(robot.total(Port::Ip0)[3], 0);
}

// clause: SF-19 SF-20
#[test]
fn minutes_are_counted() {
    let mut robot = Robot::ready("PROGRAM T\nDELAY 150.0\nEND\n");
    robot.advance_ms(120_500);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(180_000);
    let body = robot.total(Port::Ip0);
    assert_eq!(
        (body[44..48].to_vec(), body[48..52].to_vec()),
        (vec![0, 0, 0, 5], vec![0, 0, 0, 2])
    );
}

// clause: EU-01 EU-02 EU-03 EU-04 EU-05 EU-06 EU-07 CMD-EU-01 S21
#[test]
fn the_error_history() {
    let mut robot = idle();
    assert_eq!(robot.file(Port::Ip0, "EU"), b"0\r");
    robot.advance_ms(3_661_000);
    robot.panel(PanelAction::EmergencyStop(true));
    robot.panel(PanelAction::EmergencyStop(false));
    robot.advance_ms(1_000);
    robot.panel(PanelAction::EmergencyStop(true));
    let text = notation::write(&robot.file(Port::Ip0, "EU"));
    assert_eq!(
        text,
        "2<CR>008-014 14-02-06 01:01:02<CR>008-014 14-02-06 01:01:01<CR>"
    );
    for _ in 0..120 {
        robot.panel(PanelAction::EmergencyStop(false));
        robot.panel(PanelAction::EmergencyStop(true));
    }
    let content = robot.file(Port::Ip0, "EU");
    assert!(content.starts_with(b"99\r"));
    assert_eq!(content.iter().filter(|byte| **byte == b'\r').count(), 100);
}

// clause: VR-01 VR-02 VR-03 CMD-VR-01
#[test]
fn the_version_in_both_layouts() {
    let digits = |text: &str| text.chars().all(|c| c.is_ascii_digit());
    let field = String::from_utf8(idle().file(Port::Ip0, "VR")).unwrap();
    let record = field.split('\r').next().unwrap();
    assert_eq!(record.len(), 11 + 10 + 1 + 5 + 1 + 4, "{field:?}");
    assert_eq!(&record[15..16], "-");
    assert!(
        digits(&record[11..15]) && digits(&record[16..18]) && digits(&record[19..21]),
        "{record}"
    );
    assert!(
        digits(&record[22..24]) && digits(&record[25..27]) && &record[24..25] == ":",
        "{record}"
    );
    assert!(record[28..].chars().all(|c| c.is_ascii_hexdigit()), "{record}");

    let mut robot = Robot::new(Dialect::Manual);
    robot.connect(Port::Ip0);
    let content = robot.file(Port::Ip0, "VR");
    assert_eq!(content.len() % 30, 0);
    assert!(content.len() >= 60, "two records or more");
    for record in content.chunks(30) {
        let text = std::str::from_utf8(record).unwrap();
        assert!(
            text.ends_with('\r') && text[10..].starts_with("20") && &text[14..15] == "/",
            "{text:?}"
        );
        assert_eq!(&text[22..23], ":");
    }
}

// clause: SU-01 SU-02 SU-03 SU-04 SU-05 SU-07 SU-10 SU-11
#[test]
fn su_in_the_manual_dialect_has_six_records() {
    let mut robot = Robot::new(Dialect::Manual);
    robot.connect(Port::Ip0);
    robot.load("TEST", "PROGRAM T\nEND\n");
    robot.command(Port::Ip0, "EC,MODE CONT");
    let text = notation::write(&robot.file(Port::Ip0, "SU"));
    let expected = "MODE:external (ethernet)/continuous<CR>FILE:TEST<CR>OVRD:100%<CR><CR>MACHINE:free<CR>\
        STATUS:stop (reset)<CR>";
    assert_eq!(text, expected);
}

// clause: CMD-CA-02 DIR-01 DIR-02 DIR-03 DIR-04 PAR-FILE-04
#[test]
fn the_directory() {
    let mut robot = idle();
    for name in ["ZED", "ABC"] {
        robot.command(Port::Ip0, &format!("DL,{}", name.to_lowercase()));
        robot.send(Port::Ip0, b"FL,PROGRAM A\nEND\n\x1A");
        assert_eq!(robot.received(Port::Ip0), b"\x02OK\r\x03");
    }
    let text = String::from_utf8(robot.file(Port::Ip0, "CA")).unwrap();
    let names: Vec<&str> = text
        .split_terminator('\r')
        .map(|record| record.split_once(' ').unwrap().0)
        .collect();
    assert_eq!(names, ["ABC", "ETHERNET.PAR", "USER.PAR", "ZED"]);
    assert!(
        text.starts_with("ABC 14\r") && text.ends_with("ZED 14\r"),
        "{text:?}"
    );
}

// clause: SF-02
#[test]
fn legal_variation_leaves_the_texts_of_sf_as_long_as_hosts_expect_them() {
    for seed in 0..8 {
        let mut config = Config::new(Dialect::Manual);
        config.vary = Some(seed);
        let mut robot = Robot::with(config);
        robot.connect(Port::Ip0);
        robot.send(Port::Ip0, b"SF\r");
        robot.advance_ms(1_000);
        assert_eq!(robot.received(Port::Ip0).len(), 255, "seed {seed}");
    }
}
