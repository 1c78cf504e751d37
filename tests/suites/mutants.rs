//! Behaviour that mutation testing found untested: each test here fails when one line of the controller is taken out, and
//! no other suite did.

use super::extensions::{text, word};
use super::signals::{ALARM, SYS_RDY, output};
use ts3100_controller::action::Action;
use ts3100_controller::{Config, Dialect, Input, KeySwitch, Options, PanelAction, Port};
use ts3100_tests::{Robot, frame};

fn with(change: impl Fn(&mut Options)) -> Robot {
    let mut config = Config::new(Dialect::Field);
    change(&mut config.options);
    let mut robot = Robot::with(config);
    robot.connect(Port::Ip0);
    robot.panel(PanelAction::Servo(true));
    robot
}

fn line(robot: &mut Robot, line: u16, on: bool) {
    robot.panel(PanelAction::InputLine { line, on });
}

/// Numbers of the active alarms, newest first.
fn active(robot: &mut Robot) -> Vec<String> {
    let content = text(robot, "AC");
    let records = content.split('\r').filter(|record| !record.is_empty());
    let number = |record: &str| {
        record
            .split(',')
            .find(|item| item.contains('-'))
            .map(str::to_string)
    };
    records.filter_map(number).collect()
}

// clause: SU-10
#[test]
fn su_shows_the_speed_limit_in_force() {
    for (percent, shown) in [(10, "LSPEED:10%"), (37, "LSPEED:37%")] {
        let mut robot = with(|options| options.low_speed = percent);
        assert!(text(&mut robot, "SU").contains("LSPEED:100%"));
        line(&mut robot, 259, true);
        assert!(text(&mut robot, "SU").contains(shown), "{shown}");
        robot.panel(PanelAction::Key(KeySwitch::Teaching));
        assert!(text(&mut robot, "SU").contains("LSPEED:100%"), "in EXT only");
        robot.panel(PanelAction::Key(KeySwitch::Ext));
        line(&mut robot, 259, false);
        assert!(text(&mut robot, "SU").contains("LSPEED:100%"));
    }
}

// clause: SF-42 SF-43 SF-44
#[test]
fn sf_shows_the_position_in_the_work_coordinates_in_force() {
    let mut robot = with(|_| {});
    let (world, work) = (robot.float(Port::Ip0, 148), robot.float(Port::Ip0, 180));
    assert!((world - work).abs() < 0.001);
    robot.command(Port::Ip0, "ZS,1 JIG 100.000 0.000 20.000 0.000 0.000 0.000");
    assert!(
        (robot.float(Port::Ip0, 148) - world).abs() < 0.001,
        "the world stays"
    );
    assert!((robot.float(Port::Ip0, 180) - (work - 100.0)).abs() < 0.001);
    assert!((robot.float(Port::Ip0, 188) - (robot.float(Port::Ip0, 156) - 20.0)).abs() < 0.001);
    assert_eq!(robot.total(Port::Ip0)[212..216], *b"JIG\0");
}

// clause: CMD-RS-02 CMD-FD-02
#[test]
fn rs_prg_ends_feed_hold_and_takes_the_new_text() {
    let mut robot = Robot::ready("GLOBAL\nN1 = 1\nEND\nPROGRAM T\nEND\n");
    robot.command(Port::Ip0, "FD");
    assert_eq!(word(&robot.total(Port::Ip0), 32), 1);
    robot.command(Port::Ip0, "DL,TEST");
    robot.send(Port::Ip0, b"FL,GLOBAL\nN1 = 5\nEND\nPROGRAM T\nEND\n\x1A");
    assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"));
    assert_eq!(robot.file(Port::Ip0, "MR,N1 0"), b"1\r");
    robot.command(Port::Ip0, "RS,PRG");
    assert_eq!(word(&robot.total(Port::Ip0), 32), 0);
    assert_eq!(robot.file(Port::Ip0, "MR,N1 0"), b"5\r");
}

// clause: CMD-SO-02
#[test]
fn an_open_safety_switch_keeps_its_alarm_through_a_reset() {
    let mut robot = with(|_| {});
    robot.panel(PanelAction::SafetySwitch(true));
    robot.command(Port::Ip0, "RS,ERR");
    assert_eq!(active(&mut robot), ["008-017"]);
    assert_eq!(robot.ask(Port::Ip0, "SO"), b"NG\r");
    robot.panel(PanelAction::SafetySwitch(false));
    robot.command(Port::Ip0, "RS,ERR");
    assert!(active(&mut robot).is_empty());
    robot.command(Port::Ip0, "SO");
}

#[test]
fn what_persists_is_an_alarm_again_at_power_on() {
    let mut robot = with(|_| {});
    robot.panel(PanelAction::SafetySwitch(true));
    robot.panel(PanelAction::Battery(true));
    robot.panel(PanelAction::PowerCycle);
    robot.connect(Port::Ip0);
    let mut found = active(&mut robot);
    found.sort();
    assert_eq!(found, ["001-102", "008-017"]);
}

#[test]
fn switches_are_as_they_were_left_after_a_power_cycle() {
    for on in [true, false] {
        let mut robot = with(|_| {});
        robot.panel(PanelAction::EmergencyStop(on));
        robot.panel(PanelAction::SafetySwitch(on));
        robot.panel(PanelAction::MachineLock(on));
        robot.panel(PanelAction::Battery(on));
        robot.panel(PanelAction::PowerCycle);
        let state = robot.seat.controller.state();
        let switches = [
            state.emergency_stop,
            state.safety_open,
            state.machine_lock,
            state.battery_low,
        ];
        assert_eq!(switches, [on; 4]);
    }
}

// clause: RAM-03 RAM-15
#[test]
fn a_nearly_full_drive_takes_the_file_it_has_again_and_no_other() {
    let mut robot = with(|options| options.drive_capacity = 1_000);
    let download = |robot: &mut Robot, name: &str, length: usize| {
        robot.command(Port::Ip0, &format!("DL,{name}"));
        let content = [b"FL,".as_slice(), &b"REMARK X\n".repeat(length / 9), b"\x1A"].concat();
        let mut answer = Vec::new();
        for block in content.chunks(253) {
            robot.send(Port::Ip0, block);
            answer = robot.received(Port::Ip0);
        }
        answer
    };
    assert_eq!(download(&mut robot, "BIG", 900), frame(b"OK\r"));
    assert_eq!(
        download(&mut robot, "BIG", 990),
        frame(b"OK\r"),
        "in its own place"
    );
    assert_eq!(download(&mut robot, "MORE", 90), frame(b"NG\r"));
    assert_eq!(robot.file(Port::Ip0, "UL,BIG").len(), 990);
}

// clause: RAM-15
#[test]
fn the_drive_has_a_thousand_files() {
    let mut robot = with(|_| {});
    let before = text(&mut robot, "CA").split('\r').count() - 1;
    for number in before..1_000 {
        let stored = robot.seat.controller.put_file(&format!("F{number}"), b"END\n");
        assert!(stored.is_ok(), "{number}");
    }
    robot.command(Port::Ip0, "DL,ONEMORE");
    robot.send(Port::Ip0, b"FL,END\n\x1A");
    assert_eq!(robot.received(Port::Ip0), frame(b"NG\r"));
    robot.command(Port::Ip0, "DL,F500");
    robot.send(Port::Ip0, b"FL,END\n\x1A");
    assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"), "one that is there");
}

// clause: CMD-DL-06
#[test]
fn a_download_is_refused_when_the_robot_was_started_meanwhile() {
    let mut robot = Robot::ready("PROGRAM T\nDELAY 100.0\nEND\n");
    robot.command(Port::Ip0, "DL,OTHER");
    robot.send(Port::Ip0, b"FL,PROGRAM O\n");
    assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"));
    robot.panel(PanelAction::Start);
    robot.send(Port::Ip0, b"END\n\x1A");
    assert_eq!(robot.received(Port::Ip0), frame(b"NG\r"));
    assert!(!text(&mut robot, "CA").contains("OTHER"));
}

// clause: CMD-MW-02
#[test]
fn mw_does_not_restore_into_a_file_that_was_downloaded_anew() {
    let mut robot = Robot::ready("GLOBAL\nN1 = 1\nEND\nPROGRAM T\nEND\n");
    robot.command(Port::Ip0, "DL,TEST");
    robot.send(Port::Ip0, b"FL,GLOBAL\nN1 = 5\nEND\nPROGRAM T\nEND\n\x1A");
    assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"));
    assert_eq!(robot.ask(Port::Ip0, "MW,1 N1 0 7"), b"NG\r");
    assert!(robot.file(Port::Ip0, "UL,TEST").starts_with(b"GLOBAL\nN1 = 5\n"));
    robot.command(Port::Ip0, "SL,TEST");
    robot.command(Port::Ip0, "MW,1 N1 0 7");
    assert!(robot.file(Port::Ip0, "UL,TEST").starts_with(b"GLOBAL\nN1 = 7\n"));
}

/// SYS_RDY goes with alarms of level 4 and 8, without an emergency stop too, and stays with lesser ones.
#[test]
fn sys_rdy_is_off_under_an_alarm_of_level_4_or_8() {
    for (number, ready) in [
        ("8-017", false),
        ("4-101", false),
        ("2-101", true),
        ("1-102", true),
    ] {
        let mut robot = with(|_| {});
        assert!(output(&mut robot, SYS_RDY));
        robot.feed(Input::by_owner(Action::RaiseAlarm {
            number: number.to_string(),
            detail: String::new(),
        }));
        assert!(output(&mut robot, ALARM), "{number}");
        assert_eq!(output(&mut robot, SYS_RDY), ready, "{number}");
        robot.command(Port::Ip0, "RS,ERR");
        assert!(output(&mut robot, SYS_RDY), "{number}");
    }
}
