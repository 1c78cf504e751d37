//! Lines 301-364 and 401-464, the lines of the field bus: what commands, programs and the line words do with them with
//! and without option `io.field_bus`.
//!
//! The bits of the line words have unit tests in the controller; `control/resources.rs` has the control interface.

use ts3100_controller::action::Action;
use ts3100_controller::model::ArmModel;
use ts3100_controller::options::FieldBus;
use ts3100_controller::{Config, Dialect, Input, PanelAction, Port};
use ts3100_tests::{Robot, round_trip};

/// The first and the last line of each group.
const ENDS: [u16; 4] = [301, 364, 401, 464];
/// The numbers next to them, which no line has.
const OUTSIDE: [u16; 4] = [300, 365, 400, 465];

/// Every kind of arm in every dialect.
fn robots(bus: FieldBus) -> Vec<Robot> {
    let mut robots = Vec::new();
    for dialect in [Dialect::Field, Dialect::Manual] {
        for model in [ArmModel::thl400(), ArmModel::tv800()] {
            let mut config = Config::new(dialect);
            config.model = model;
            if bus == FieldBus::Present {
                config.options.field_bus = bus;
            }
            let mut robot = Robot::with(config);
            robot.connect(Port::Ip0);
            robot.panel(PanelAction::Servo(true));
            robots.push(robot);
        }
    }
    robots
}

/// Whether HO, HI and IO are served.
fn has_extensions(robot: &mut Robot) -> bool {
    let answer = robot.ask(Port::Ip0, "HI,1 1");
    robot.send(Port::Ip0, b"OK\r");
    answer.starts_with(b"FL,")
}

fn outputs_on(robot: &Robot) -> Vec<u16> {
    let signals = robot.seat.controller.signals();
    (0..=500).filter(|line| signals.output(*line)).collect()
}

/// User outputs and lines of the field bus that are on: all but the system outputs.
fn user_outputs_on(robot: &Robot) -> Vec<u16> {
    let all = outputs_on(robot);
    all.into_iter()
        .filter(|line| !(209..=264).contains(line))
        .collect()
}

fn refused(robot: &mut Robot, command: &str) {
    assert_eq!(robot.ask(Port::Ip0, command), b"NG\r", "{command}");
}

/// A statement that is accepted, and the alarms that it raises.
fn alarms_of(robot: &mut Robot, statement: &str) -> Vec<String> {
    let known = robot.alarms().len();
    robot.command(Port::Ip0, &format!("DO,{statement}"));
    robot.advance_ms(500);
    let raised = robot.alarms().split_off(known);
    robot.panel(PanelAction::AlarmReset);
    robot.advance_ms(500);
    raised
}

/// The words of SF for 301 to 364.
fn sf_words(robot: &mut Robot) -> (Vec<u8>, Vec<u8>) {
    let sf = robot.total(Port::Ip0);
    (sf[76..84].to_vec(), sf[108..116].to_vec())
}

/// The words of IO for 301 to 364 and 401 to 464.
fn io_words(robot: &mut Robot) -> (Vec<u8>, Vec<u8>) {
    let answer = robot.ask(Port::Ip0, "IO,1");
    assert_eq!(answer.len(), 3 + 80);
    robot.send(Port::Ip0, b"OK\r");
    (answer[27..43].to_vec(), answer[67..83].to_vec())
}

const FIRST_AND_LAST: [u8; 8] = [0, 1, 0, 0, 0, 0, 0x80, 0];

// clause: T14 T27 L39 L43 L51 S76 S97 K2-K4
#[test]
fn without_a_field_bus_its_inputs_are_read_and_its_outputs_are_refused() {
    for mut robot in robots(FieldBus::Absent) {
        let has_extensions = has_extensions(&mut robot);
        for line in ENDS {
            refused(&mut robot, &format!("IW,{line} 1"));
            refused(&mut robot, &format!("IW,5 1 {line} 1"));
            refused(&mut robot, &format!("HO,{line} 1 1"));
            for statement in ["DOUT", "PULOUT"] {
                let operands = if statement == "PULOUT" { ", 0.2" } else { "" };
                let statement = format!("{statement}({line}{operands})");
                assert_eq!(alarms_of(&mut robot, &statement), ["2-104"], "{statement}");
            }
            assert_eq!(user_outputs_on(&robot), [0; 0]);
            robot.panel(PanelAction::InputLine { line, on: true });
        }
        assert_eq!(sf_words(&mut robot), (FIRST_AND_LAST.to_vec(), vec![0; 8]));
        if has_extensions {
            let inputs = FIRST_AND_LAST.repeat(2);
            assert_eq!(io_words(&mut robot), (inputs, vec![0; 16]));
            assert_eq!(robot.file(Port::Ip0, "HI,301 32"), b"1\r");
            assert_eq!(robot.file(Port::Ip0, "HI,433 32"), b"2147483648\r");
        }
    }
}

// clause: T14 L39 L43 L51 S76 S97
#[test]
fn with_a_field_bus_commands_and_programs_set_its_outputs() {
    for mut robot in robots(FieldBus::Present) {
        let has_extensions = has_extensions(&mut robot);
        for line in OUTSIDE {
            refused(&mut robot, &format!("IW,{line} 1"));
            refused(&mut robot, &format!("HO,{line} 1 1"));
            assert_eq!(alarms_of(&mut robot, &format!("DOUT({line})")), ["2-104"]);
        }
        refused(&mut robot, "IW,301 1 365 1");
        assert_eq!(user_outputs_on(&robot), [0; 0]);
        robot.command(Port::Ip0, "IW,301 1 364 1 401 1 464 1");
        assert_eq!(user_outputs_on(&robot), ENDS);
        // Nothing is at the other end: an output drives no input.
        assert_eq!(sf_words(&mut robot), (vec![0; 8], FIRST_AND_LAST.to_vec()));
        if has_extensions {
            let outputs = FIRST_AND_LAST.repeat(2);
            assert_eq!(io_words(&mut robot), (vec![0; 16], outputs));
            refused(&mut robot, "HO,364 2 0");
            robot.command(Port::Ip0, "HO,301 2 2");
            robot.command(Port::Ip0, "HO,433 32 1");
            assert_eq!(user_outputs_on(&robot), [302, 364, 401, 433]);
            robot.command(Port::Ip0, "IW,302 0 433 0 301 1 464 1");
        }
        robot.command(Port::Ip0, "RS,SIG");
        assert_eq!(user_outputs_on(&robot), ENDS);

        for statement in ["DOUT(-301, 302)", "BCDOUT(401, 2, 42)", "PULOUT(310, 5)"] {
            assert_eq!(alarms_of(&mut robot, statement), [""; 0], "{statement}");
        }
        let pulsed = [302, 310, 364, 402, 407, 464];
        assert_eq!(user_outputs_on(&robot), pulsed);
        robot.seat.controller = round_trip::round_trip(&robot.seat.controller);
        assert_eq!(user_outputs_on(&robot), pulsed);
        robot.advance_ms(5_000);
        assert_eq!(user_outputs_on(&robot), [302, 364, 402, 407, 464]);
        for action in [Action::PowerOff, Action::PowerOn] {
            robot.put(Input::by_owner(action));
        }
        assert_eq!(user_outputs_on(&robot), [0; 0]);
    }
}
