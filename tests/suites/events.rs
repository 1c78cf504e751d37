//! SM: which requests to stop are events, which connection is shown them (T1), and the states beside them.
//!
//! `ext-events.txt` has the bytes.

use crate::extensions::six_axis;
use ts3100_controller::{Action, ControlRight, Controller, Input, KeySwitch, PanelAction, Port};
use ts3100_tests::Robot;

/// EE, SE, SC and BC of an SM, and the states ES and SS.
fn events(robot: &mut Robot, port: Port) -> String {
    let status = String::from_utf8(robot.file(port, "SM,1")).unwrap();
    status[..23].to_owned()
}

const NO_EVENT: &str = "EE0 SE0 SC0 BC0 ES0 SS0";

// clause: T1 T27 L13 K10-K12 J6
#[test]
fn each_request_to_stop_is_one_event_whether_a_program_runs_or_not() {
    use PanelAction::{EmergencyStop, InputLine, SafetySwitch, Stop};
    let line = |line| InputLine { line, on: true };
    let requests = [
        (
            EmergencyStop(true),
            "EE1 SE0 SC0 BC0 ES1 SS0",
            "EE0 SE0 SC0 BC0 ES1 SS0",
        ),
        (
            SafetySwitch(true),
            "EE0 SE1 SC0 BC0 ES0 SS1",
            "EE0 SE0 SC0 BC0 ES0 SS1",
        ),
        (Stop, "EE0 SE0 SC1 BC0 ES0 SS0", NO_EVENT),
        (line(257), "EE0 SE0 SC1 BC0 ES0 SS0", NO_EVENT),
        (line(260), "EE0 SE0 SC0 BC1 ES0 SS0", NO_EVENT),
    ];
    for running in [false, true] {
        for (request, first, then) in requests.clone() {
            let mut robot = Robot::ready("PROGRAM T\nDELAY 100.0\nEND\n");
            if running {
                robot.command(Port::Ip0, "RN");
            }
            assert_eq!(events(&mut robot, Port::Ip0), NO_EVENT);
            robot.panel(request.clone());
            robot.advance_ms(1_000);
            assert_eq!(events(&mut robot, Port::Ip0), first, "{request}");
            assert_eq!(events(&mut robot, Port::Ip0), then, "{request}");
            // The edge counts, not the level.
            robot.panel(request.clone());
            let again = if request == Stop { first } else { then };
            assert_eq!(events(&mut robot, Port::Ip0), again, "{request}");
        }
    }
}

// clause: T1 L18 L25
#[test]
fn what_is_no_request_to_stop_is_no_event() {
    use PanelAction::{InputLine, Key, PressFeedHold, RunMode, Servo};
    let panel = [
        Servo(false),
        PressFeedHold,
        Key(KeySwitch::Teaching),
        InputLine { line: 261, on: true },
        RunMode(ts3100_proto::command::RunMode::Step),
    ];
    for action in panel {
        let mut robot = Robot::ready("PROGRAM T\nDELAY 0.1\nDELAY 0.1\nEND\n");
        robot.command(Port::Ip0, "RN");
        robot.panel(action.clone());
        robot.advance_ms(1_000);
        assert_eq!(events(&mut robot, Port::Ip0), NO_EVENT, "{action}");
    }
    for program in [
        "STOP\n",
        "BREAK\n",
        "MOVE POINT(9999,0,0,0,0,0,0,0)\n",
        "DELAY 0.1\n",
    ] {
        let mut robot = Robot::ready(&format!("PROGRAM T\n{program}END\n"));
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(1_000);
        assert_eq!(events(&mut robot, Port::Ip0), NO_EVENT, "{program}");
        robot.command(Port::Ip0, "BR");
        assert_eq!(events(&mut robot, Port::Ip0), NO_EVENT, "BR");
    }
}

// clause: T1 T27
#[test]
fn the_power_begins_without_events() {
    let mut robot = six_axis();
    robot.connect(Port::Host);
    robot.panel(PanelAction::EmergencyStop(true));
    robot.panel(PanelAction::PowerCycle);
    for port in [Port::Host, Port::Ip0] {
        robot.connect(port);
        assert_eq!(
            events(&mut robot, port),
            "EE0 SE0 SC0 BC0 ES1 SS0",
            "{port}: held over power-on"
        );
    }
}

// clause: T1 T27
#[test]
fn a_snapshot_brings_back_the_events_of_host_alone() {
    let mut robot = six_axis();
    robot.connect(Port::Host);
    robot.command(Port::Ip0, "SP");
    let snapshot = robot.seat.controller.snapshot();
    let restored = Controller::restore(snapshot).unwrap();
    let before = std::mem::replace(&mut robot.seat.controller, restored);
    robot.seat.controller.adopt_peers(&before);
    robot.received(Port::Ip0);
    robot.received(Port::Host);
    assert_eq!(events(&mut robot, Port::Ip0), NO_EVENT, "met as a new peer");
    assert_eq!(events(&mut robot, Port::Host), "EE0 SE0 SC1 BC0 ES0 SS0");
}

/// The digits of a field of SM.
fn field(robot: &mut Robot, name: &str) -> String {
    let status = String::from_utf8(robot.file(Port::Ip0, "SM,1")).unwrap();
    let fields: Vec<&str> = status.split(' ').collect();
    let found = fields.iter().find_map(|field| field.strip_prefix(name));
    found.unwrap().to_owned()
}

// clause: L20
#[test]
fn mm_is_the_master_mode() {
    let mut robot = six_axis();
    robot.connect(Port::Host);
    for (key, right, mode) in [
        (KeySwitch::Teaching, ControlRight::Ether, "0"),
        (KeySwitch::Internal, ControlRight::Ether, "1"),
        (KeySwitch::Ext, ControlRight::Sig, "2"),
        (KeySwitch::Ext, ControlRight::Rs232c, "4"),
        (KeySwitch::Ext, ControlRight::Ether, "5"),
    ] {
        robot.panel(PanelAction::Key(key));
        robot.panel(PanelAction::ControlRight(right));
        assert_eq!(field(&mut robot, "MM"), mode);
    }
}

// clause: L21 L22
#[test]
fn ov_is_the_override_and_rm_the_operation_mode() {
    let mut robot = six_axis();
    for percent in ["1", "55", "100"] {
        robot.command(Port::Ip0, &format!("EC,OVRD {percent}"));
        assert_eq!(field(&mut robot, "OV"), percent);
    }
    for (mode, number) in [("CONT", "0"), ("CYCLE", "1"), ("STEP", "2"), ("SEGMENT", "3")] {
        robot.command(Port::Ip0, &format!("EC,MODE {mode}"));
        assert_eq!(field(&mut robot, "RM"), number, "{mode}");
    }
}

// clause: L23 L26
#[test]
fn rs_is_the_status_of_operation_and_sv_servo_power() {
    let mut robot = Robot::ready("PROGRAM T\nDELAY 0.5\nDELAY 9.0\nEND\n");
    let shown = |robot: &mut Robot| [field(robot, "RS"), field(robot, "SV")].join(" ");
    assert_eq!(shown(&mut robot), "0 1");
    robot.command(Port::Ip0, "RN");
    assert_eq!(shown(&mut robot), "1 1");
    robot.command(Port::Ip0, "EC,BREAK");
    assert_eq!(shown(&mut robot), "2 1");
    robot.command(Port::Ip0, "RN");
    robot.command(Port::Ip0, "SP");
    robot.advance_ms(1_000);
    assert_eq!(shown(&mut robot), "3 1");
    robot.command(Port::Ip0, "BR");
    assert_eq!(field(&mut robot, "SV"), "0");
    robot.command(Port::Ip0, "RS,STP");
    assert_eq!(shown(&mut robot), "0 0");
}

// clause: L15
#[test]
fn al_is_the_highest_level_of_the_alarms_that_occur() {
    let mut robot = six_axis();
    assert_eq!(field(&mut robot, "AL"), "0");
    for (number, level) in [("1-200", "1"), ("2-046", "2"), ("4-102", "4"), ("8-026", "8")] {
        let (number, detail) = (number.to_owned(), String::new());
        robot.feed(Input::by_owner(Action::RaiseAlarm { number, detail }));
        assert_eq!(field(&mut robot, "AL"), level);
    }
    robot.command(Port::Ip0, "RS,ERR");
    assert_eq!(field(&mut robot, "AL"), "0");
}
