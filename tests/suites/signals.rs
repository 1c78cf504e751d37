//! EXT (SIG): the robot driven by the system inputs Din249 to Din261 and answering on the system outputs
//! Dout249 to Dout262. Edges, levels and pulses are those of docs/reference/protocol/signals.md, all of them assumed but for what
//! ACK answers (S40) and where EX_SVON acts (S41).

use crate::extensions::{text, values, word};
use std::time::Duration;
use ts3100_controller::options::Strobe;
use ts3100_controller::{
    Config, ControlRight, ControllerType, Dialect, Event, KeySwitch, Output, PanelAction, Port,
};
use ts3100_tests::Robot;

const STROBE: u16 = 249;
const PRG_RST: u16 = 250;
const STEP_RST: u16 = 251;
const CYC_RST: u16 = 252;
const DO_RST: u16 = 253;
const ALM_RST: u16 = 254;
const RUN: u16 = 255;
const EX_SVON: u16 = 256;
const STOP: u16 = 257;
const CYCLE: u16 = 258;
const LOW_SPD: u16 = 259;
const BREAK: u16 = 260;
const SVOFF: u16 = 261;

const EMG_ST: u16 = 249;
const SV_RDY: u16 = 250;
const ACK: u16 = 251;
pub const SYS_RDY: u16 = 256;
const AUTORUN: u16 = 257;
const CYC_END: u16 = 258;
const LOW_ST: u16 = 259;
const CYC_ST: u16 = 260;
const BT_ALM: u16 = 261;
pub const ALARM: u16 = 262;

const PROGRAM: &str = "GLOBAL\nN = 7\nEND\nPROGRAM T\nPRINT IP1, \"A\"\nRCYCLE:\nN = N + 1\nDELAY 10.0\nPRINT IP1, \"B\"\nEND\n";

/// A robot in EXT (SIG) with servo on and the program selected; `strobe` as the option says.
fn robot_with(strobe: Strobe, program: &str) -> Robot {
    let mut config = Config::new(Dialect::Field);
    config.options.strobe = strobe;
    config.control_right = ControlRight::Sig;
    let mut robot = Robot::with(config);
    robot.load("TEST", program);
    robot.connect(Port::Ip0);
    robot.connect(Port::Ip1);
    robot.panel(PanelAction::Servo(true));
    robot
}

fn robot() -> Robot {
    robot_with(Strobe::Free, PROGRAM)
}

fn set(robot: &mut Robot, line: u16, on: bool) {
    robot.panel(PanelAction::InputLine { line, on });
}

/// A rising and a falling edge, 20 ms apart.
fn pulse(robot: &mut Robot, line: u16) {
    set(robot, line, true);
    robot.advance_ms(20);
    set(robot, line, false);
}

pub fn output(robot: &mut Robot, line: u16) -> bool {
    word(&robot.total(Port::Ip0), 106) >> (line - 249) & 1 == 1
}

fn status(robot: &mut Robot) -> String {
    let su = text(robot, "SU");
    su.rsplit_once(':').unwrap().1.to_string()
}

/// Forgets what was sent to the host unasked.
fn quiet(robot: &mut Robot) {
    robot.advance_ms(100);
    robot.received(Port::Ip0);
}

fn refusals(robot: &Robot) -> usize {
    let refused = |output: &&Output| matches!(output, Output::Event(Event::Finding(found)) if found.rule.id == "signal-refused");
    robot.outputs.iter().filter(refused).count()
}

// clause: SF-31 SF-32 SF-38 SF-39
#[test]
fn a_cycle_by_signals_alone() {
    let mut robot = robot();
    robot.panel(PanelAction::Servo(false));
    assert!(!output(&mut robot, SV_RDY) && output(&mut robot, SYS_RDY) && output(&mut robot, CYC_ST));
    pulse(&mut robot, EX_SVON);
    assert!(output(&mut robot, SV_RDY) && !output(&mut robot, ACK));
    robot.advance_ms(100);
    pulse(&mut robot, RUN);
    assert!(output(&mut robot, AUTORUN) && !output(&mut robot, ACK) && !output(&mut robot, CYC_END));
    assert_eq!(status(&mut robot), "running");
    robot.advance_ms(10_000);
    assert_eq!(robot.received(Port::Ip1), b"AB");
    assert!(!output(&mut robot, AUTORUN) && output(&mut robot, CYC_END));
    quiet(&mut robot);
    pulse(&mut robot, RUN);
    assert!(!output(&mut robot, CYC_END), "on until the next start");
    pulse(&mut robot, SVOFF);
    assert!(!output(&mut robot, SV_RDY) && !output(&mut robot, AUTORUN));
}

/// The modes in which the inputs are tried: all five.
const MODES: [(KeySwitch, ControlRight); 5] = [
    (KeySwitch::Ext, ControlRight::Sig),
    (KeySwitch::Ext, ControlRight::Rs232c),
    (KeySwitch::Ext, ControlRight::Ether),
    (KeySwitch::Internal, ControlRight::Sig),
    (KeySwitch::Teaching, ControlRight::Sig),
];

fn in_mode(robot: &mut Robot, (key, right): (KeySwitch, ControlRight)) {
    robot.panel(PanelAction::Key(key));
    robot.panel(PanelAction::ControlRight(right));
}

// clause: S40
#[test]
fn ack_is_a_pulse_of_100_ms_in_every_mode_for_the_five_it_answers() {
    for mode in MODES {
        for line in [PRG_RST, STEP_RST, CYC_RST, DO_RST, STROBE] {
            let mut robot = robot();
            in_mode(&mut robot, mode);
            assert!(!output(&mut robot, ACK));
            set(&mut robot, line, true);
            assert!(output(&mut robot, ACK), "{mode:?} Din{line}");
            robot.advance_ms(99);
            assert!(output(&mut robot, ACK), "{mode:?} Din{line}, 99 ms");
            robot.advance_ms(1);
            assert!(!output(&mut robot, ACK), "{mode:?} Din{line}, 100 ms");
            robot.advance_ms(500);
            set(&mut robot, line, false);
            assert!(
                !output(&mut robot, ACK),
                "the falling edge of Din{line} says nothing"
            );
        }
    }
}

// clause: S40
#[test]
fn ack_never_answers_the_other_inputs() {
    for mode in MODES {
        for line in [RUN, EX_SVON, ALM_RST, STOP, CYCLE, LOW_SPD, BREAK, SVOFF] {
            let mut robot = robot();
            robot.panel(PanelAction::Servo(line != EX_SVON));
            in_mode(&mut robot, mode);
            set(&mut robot, line, true);
            assert!(!output(&mut robot, ACK), "{mode:?} Din{line}");
            robot.advance_ms(100);
            assert!(!output(&mut robot, ACK), "{mode:?} Din{line}, later");
        }
    }
}

#[test]
fn what_has_no_effect_is_not_acknowledged() {
    let mut robot = robot();
    robot.panel(PanelAction::Servo(false));
    set(&mut robot, RUN, true);
    assert!(!output(&mut robot, ACK));
    assert_eq!(refusals(&robot), 1);
    robot.panel(PanelAction::EmergencyStop(true));
    set(&mut robot, EX_SVON, true);
    assert!(!output(&mut robot, ACK) && !output(&mut robot, SV_RDY));
    assert_eq!(refusals(&robot), 2);
}

/// Each pair rises within one instant, the second a moment after the first or together with it by STROBE.
// clause: S40
#[test]
fn of_several_at_once_only_the_first_is_processed() {
    let both_on = |strobe, order: [u16; 2]| {
        let mut robot = robot_with(strobe, PROGRAM);
        robot.panel(PanelAction::ControlRight(ControlRight::Ether));
        robot.command(Port::Ip0, "IW,1 1");
        robot.panel(PanelAction::ControlRight(ControlRight::Sig));
        pulse(&mut robot, RUN);
        pulse(&mut robot, STROBE);
        robot.panel(PanelAction::Start);
        pulse(&mut robot, BREAK);
        quiet(&mut robot);
        assert_eq!(status(&mut robot), "stop(retry)");
        for line in order {
            set(&mut robot, line, true);
        }
        set(&mut robot, STROBE, strobe == Strobe::Required);
        let outputs = word(&robot.total(Port::Ip0), 84);
        (
            status(&mut robot),
            outputs,
            output(&mut robot, ACK),
            refusals(&robot),
        )
    };
    let step = ("stop(reset)".to_string(), 1, true, 1);
    let outputs = ("stop(retry)".to_string(), 0, true, 1);
    assert_eq!(both_on(Strobe::Free, [STEP_RST, DO_RST]), step);
    assert_eq!(both_on(Strobe::Free, [DO_RST, STEP_RST]), outputs);
    for order in [[STEP_RST, DO_RST], [DO_RST, STEP_RST]] {
        assert_eq!(both_on(Strobe::Required, order), step, "the lowest number");
    }
    let mut robot = robot();
    set(&mut robot, PRG_RST, true);
    robot.advance_ms(1);
    set(&mut robot, DO_RST, true);
    assert_eq!(refusals(&robot), 0, "one after the other");
}

// clause: PRM-LEG-08
#[test]
fn start_inputs_are_dead_outside_ext_sig() {
    let places = [
        (KeySwitch::Ext, ControlRight::Rs232c),
        (KeySwitch::Ext, ControlRight::Ether),
        (KeySwitch::Internal, ControlRight::Sig),
        (KeySwitch::Teaching, ControlRight::Sig),
    ];
    for (key, right) in places {
        for strobe in [Strobe::Free, Strobe::Required] {
            let mut robot = robot_with(strobe, PROGRAM);
            pulse(&mut robot, RUN);
            pulse(&mut robot, STROBE);
            robot.panel(PanelAction::Start);
            pulse(&mut robot, BREAK);
            robot.panel(PanelAction::Servo(false));
            robot.panel(PanelAction::Battery(true));
            robot.advance_ms(200);
            quiet(&mut robot);
            robot.panel(PanelAction::Key(key));
            robot.panel(PanelAction::ControlRight(right));
            let mode = text(&mut robot, "SU");
            let before = robot.total(Port::Ip0);
            for line in [EX_SVON, RUN, ALM_RST, CYCLE] {
                set(&mut robot, line, true);
                pulse(&mut robot, STROBE);
                set(&mut robot, line, false);
                robot.advance_ms(100);
                let after = robot.total(Port::Ip0);
                assert_eq!(after, before, "{key:?} {right:?} Din{line}");
                assert_eq!(text(&mut robot, "SU"), mode, "{key:?} {right:?} Din{line}");
            }
        }
    }
}

// clause: PRM-LEG-08
#[test]
fn stop_inputs_act_in_every_mode() {
    for (key, right) in [
        (KeySwitch::Ext, ControlRight::Sig),
        (KeySwitch::Ext, ControlRight::Rs232c),
        (KeySwitch::Ext, ControlRight::Ether),
        (KeySwitch::Internal, ControlRight::Sig),
        (KeySwitch::Teaching, ControlRight::Sig),
    ] {
        for (line, servo, expected) in [
            (STOP, 1, "stop(continue)"),
            (BREAK, 1, "stop(retry)"),
            (SVOFF, 0, "stop(retry)"),
        ] {
            let mut robot = robot();
            robot.panel(PanelAction::Key(key));
            robot.panel(PanelAction::ControlRight(right));
            robot.panel(PanelAction::Start);
            robot.advance_ms(1_000);
            assert_eq!(status(&mut robot), "running");
            quiet(&mut robot);
            pulse(&mut robot, line);
            robot.advance_ms(11_000);
            assert_eq!(
                robot.received(Port::Ip0),
                b"\x02SP\r\x03",
                "Din{line}: the host gets SP"
            );
            assert_eq!(status(&mut robot), expected, "{key:?} {right:?} Din{line}");
            assert_eq!(robot.total(Port::Ip0)[0], servo, "Din{line}");
        }
    }
}

#[test]
fn resets_do_what_rs_does() {
    let stopped = || {
        let mut robot = robot();
        robot.command(Port::Ip0, "MW,0 N 0 20");
        pulse(&mut robot, RUN);
        robot.advance_ms(1_000);
        pulse(&mut robot, BREAK);
        quiet(&mut robot);
        robot.received(Port::Ip1);
        assert_eq!(status(&mut robot), "stop(retry)");
        robot
    };
    for (line, expected, number, printed) in [
        (PRG_RST, "stop(reset)", "7\r", "AB"),
        (STEP_RST, "stop(reset)", "21\r", "AB"),
        (CYC_RST, "stop(continue)", "21\r", "B"),
    ] {
        let mut robot = stopped();
        pulse(&mut robot, line);
        assert_eq!(status(&mut robot), expected, "Din{line}");
        assert_eq!(text(&mut robot, "MR,N 0"), number, "Din{line}");
        pulse(&mut robot, RUN);
        robot.advance_ms(11_000);
        assert_eq!(robot.received(Port::Ip1), printed.as_bytes(), "Din{line}");
    }
    let mut robot = stopped();
    robot.panel(PanelAction::ControlRight(ControlRight::Ether));
    robot.command(Port::Ip0, "IW,1 1 24 1 25 1");
    robot.panel(PanelAction::ControlRight(ControlRight::Sig));
    pulse(&mut robot, DO_RST);
    let sf = robot.total(Port::Ip0);
    assert_eq!((word(&sf, 84), word(&sf, 86)), (0, 1 << 8), "outputs 1 to 24 off");
    assert_eq!(status(&mut robot), "stop(retry)");
}

// clause: I9 T17
#[test]
fn resets_wait_for_a_stop_but_not_that_of_alarms() {
    let mut robot = robot();
    pulse(&mut robot, RUN);
    robot.advance_ms(200);
    robot.panel(PanelAction::Battery(true));
    assert!(output(&mut robot, ALARM));
    for line in [PRG_RST, STEP_RST, CYC_RST, DO_RST] {
        pulse(&mut robot, line);
        assert!(!output(&mut robot, ACK), "Din{line}");
        assert_eq!(status(&mut robot), "running", "Din{line}");
    }
    assert_eq!(refusals(&robot), 4);
    pulse(&mut robot, ALM_RST);
    assert!(!output(&mut robot, ALARM) && !output(&mut robot, ACK));
    assert_eq!(status(&mut robot), "running");
}

#[test]
fn alm_rst_leaves_an_alarm_whose_cause_persists() {
    let mut robot = robot();
    robot.panel(PanelAction::EmergencyStop(true));
    assert!(output(&mut robot, EMG_ST) && output(&mut robot, ALARM) && !output(&mut robot, SYS_RDY));
    pulse(&mut robot, ALM_RST);
    assert!(output(&mut robot, ALARM));
    robot.panel(PanelAction::EmergencyStop(false));
    assert!(!output(&mut robot, EMG_ST) && output(&mut robot, ALARM));
    pulse(&mut robot, ALM_RST);
    assert!(!output(&mut robot, ALARM) && output(&mut robot, SYS_RDY));
}

#[test]
fn with_strobe_required_commands_wait_for_it() {
    let mut robot = robot_with(Strobe::Required, PROGRAM);
    robot.panel(PanelAction::Servo(false));
    set(&mut robot, EX_SVON, true);
    set(&mut robot, RUN, true);
    robot.advance_ms(500);
    assert!(!output(&mut robot, SV_RDY) && !output(&mut robot, ACK));
    set(&mut robot, STROBE, true);
    assert!(
        output(&mut robot, SV_RDY) && output(&mut robot, AUTORUN) && output(&mut robot, ACK),
        "servo, then run"
    );
    for line in [EX_SVON, RUN, STROBE] {
        set(&mut robot, line, false);
    }
    robot.advance_ms(200);
    pulse(&mut robot, STROBE);
    assert!(output(&mut robot, ACK), "STROBE itself is answered");
    quiet(&mut robot);
    set(&mut robot, PRG_RST, true);
    pulse(&mut robot, STROBE);
    assert!(!output(&mut robot, ACK), "the reset waits for a stop");
    pulse(&mut robot, STOP);
    robot.advance_ms(11_000);
    assert_eq!(status(&mut robot), "stop(continue)", "stops need no strobe");
}

#[test]
fn cycle_chooses_the_operation_mode() {
    let mut robot = robot_with(Strobe::Free, "PROGRAM T\nPRINT IP1, \"A\"\nDELAY 1.0\nEND\n");
    set(&mut robot, CYCLE, true);
    assert!(text(&mut robot, "SU").contains("/cycle ") && output(&mut robot, CYC_ST));
    set(&mut robot, CYCLE, false);
    assert!(text(&mut robot, "SU").contains("/continuous ") && !output(&mut robot, CYC_ST));
    pulse(&mut robot, RUN);
    robot.advance_ms(981);
    assert!(output(&mut robot, CYC_END), "a pulse at each END");
    robot.advance_ms(100);
    assert!(!output(&mut robot, CYC_END) && output(&mut robot, AUTORUN));
    robot.advance_ms(2_000);
    assert_eq!(robot.received(Port::Ip1), b"AAAA");
    set(&mut robot, CYCLE, true);
    robot.advance_ms(2_000);
    assert_eq!(status(&mut robot), "stop(reset)", "the present cycle is the last");
}

#[test]
fn low_spd_holds_the_speed_down() {
    let mut robot = robot_with(Strobe::Free, "PROGRAM T\nMOVEA 1,150.0 WITH SPEED=100\nEND\n");
    set(&mut robot, LOW_SPD, true);
    assert!(output(&mut robot, LOW_ST));
    pulse(&mut robot, RUN);
    // The override is a factor on the time (T27.15): 0.25 s to full speed take 2.5 s.
    robot.advance_ms(2_600);
    assert!(
        (values(&mut robot, "VL,0")[0] - 24.0).abs() < 0.01,
        "10 % of 240 degrees/s"
    );
    set(&mut robot, LOW_SPD, false);
    assert!(!output(&mut robot, LOW_ST));
    robot.advance_ms(300);
    assert!((values(&mut robot, "VL,0")[0] - 240.0).abs() < 0.01);
    set(&mut robot, LOW_SPD, true);
    robot.panel(PanelAction::Key(KeySwitch::Internal));
    assert!(!output(&mut robot, LOW_ST), "only with the key in EXT");
}

// clause: SF-38
#[test]
fn one_output_names_the_mode_and_one_the_battery() {
    let mut robot = robot();
    for (key, right, line) in [
        (KeySwitch::Teaching, ControlRight::Sig, 252),
        (KeySwitch::Internal, ControlRight::Sig, 253),
        (KeySwitch::Ext, ControlRight::Sig, 254),
        (KeySwitch::Ext, ControlRight::Rs232c, 255),
        (KeySwitch::Ext, ControlRight::Ether, 255),
    ] {
        robot.panel(PanelAction::Key(key));
        robot.panel(PanelAction::ControlRight(right));
        for candidate in 252..=255 {
            assert_eq!(
                output(&mut robot, candidate),
                candidate == line,
                "{key:?} {right:?}"
            );
        }
    }
    assert!(!output(&mut robot, BT_ALM));
    robot.panel(PanelAction::Battery(true));
    assert!(
        output(&mut robot, BT_ALM) && output(&mut robot, SYS_RDY),
        "a warning"
    );
    robot.panel(PanelAction::Battery(false));
    assert!(!output(&mut robot, BT_ALM));
}

// clause: S41
#[test]
fn ex_svon_is_latched_and_acts_in_ext_sig_while_sv_rdy_is_off() {
    for mode in MODES {
        let mut robot = robot();
        robot.panel(PanelAction::Servo(false));
        in_mode(&mut robot, mode);
        set(&mut robot, EX_SVON, true);
        let acts = mode == (KeySwitch::Ext, ControlRight::Sig);
        assert_eq!(output(&mut robot, SV_RDY), acts, "{mode:?}");
        set(&mut robot, EX_SVON, false);
        robot.advance_ms(1_000);
        assert_eq!(output(&mut robot, SV_RDY), acts, "{mode:?}: latched");
        assert_eq!(refusals(&robot), 0, "{mode:?}");
        pulse(&mut robot, EX_SVON);
        assert_eq!(refusals(&robot), usize::from(acts), "{mode:?}: SV_RDY is on");
    }
}

/// A TSL3000E in EXT, its servo off, switched on in each of the ways there are.
fn tsl3000e() -> Robot {
    let mut robot = Robot::with(Config::new(Dialect::Field).with_controller(ControllerType::Tsl3000e));
    robot.connect(Port::Ip0);
    robot
}

fn servo(robot: &mut Robot) -> bool {
    let shown = robot.total(Port::Ip0)[0] == 1;
    assert_eq!(text(robot, "SM,1").contains("SV1"), shown);
    assert_eq!(output(robot, SV_RDY), shown);
    shown
}

type Way = fn(&mut Robot);

/// Every way to turn the servo on.
const WAYS: [(&str, Way); 3] = [
    ("SO", |robot| robot.command(Port::Ip0, "SO")),
    ("panel", |robot| robot.panel(PanelAction::Servo(true))),
    ("EX_SVON", |robot| {
        robot.panel(PanelAction::ControlRight(ControlRight::Sig));
        pulse(robot, EX_SVON);
        robot.panel(PanelAction::ControlRight(ControlRight::Ether));
    }),
];

fn turned_on_twice() -> Robot {
    let mut robot = tsl3000e();
    for _ in 0..2 {
        robot.command(Port::Ip0, "SO");
        assert!(servo(&mut robot));
        robot.command(Port::Ip0, "BR");
    }
    robot
}

// clause: S41
#[test]
fn every_third_servo_on_comes_7_s_later_by_whatever_way() {
    for (way, turn_on) in WAYS {
        let mut robot = turned_on_twice();
        let start = robot.now();
        turn_on(&mut robot);
        assert!(!servo(&mut robot), "{way}");
        let due = start + Duration::from_secs(7);
        let held = |output: &Output| *output == Output::Event(Event::ServoDelayed(due));
        assert!(robot.outputs.iter().any(held), "{way}");
        assert_eq!(
            robot.ask(Port::Ip0, "DO,DOUT(1)"),
            b"NG\r",
            "{way}: no servo power yet"
        );
        // Requested again meanwhile it comes no later; a snapshot carries it.
        robot.command(Port::Ip0, "SO");
        robot = Robot::from_controller(ts3100_tests::round_trip::round_trip(&robot.seat.controller));
        robot.advance(due.since(robot.now()) - Duration::from_millis(1));
        assert!(!servo(&mut robot), "{way}");
        robot.advance_ms(1);
        assert!(servo(&mut robot), "{way}");
        // The fourth and the fifth come at once, the sixth does not.
        for at_once in [true, true, false] {
            robot.command(Port::Ip0, "BR");
            turn_on(&mut robot);
            assert_eq!(servo(&mut robot), at_once, "{way}");
        }
    }
}

// clause: S41
#[test]
fn what_turns_the_servo_off_ends_the_pause_and_only_a_tsl3000e_has_one() {
    let offs: [Way; 3] = [
        |robot| robot.command(Port::Ip0, "BR"),
        |robot| pulse(robot, SVOFF),
        |robot| {
            robot.panel(PanelAction::EmergencyStop(true));
            robot.panel(PanelAction::EmergencyStop(false));
            robot.command(Port::Ip0, "RS,ERR");
        },
    ];
    for turn_off in offs {
        let mut robot = turned_on_twice();
        robot.command(Port::Ip0, "SO");
        robot.advance_ms(3_000);
        turn_off(&mut robot);
        robot.advance_ms(10_000);
        assert!(!servo(&mut robot));
        robot.command(Port::Ip0, "SO");
        assert!(!servo(&mut robot), "the third still waits");
        robot.panel(PanelAction::PowerCycle);
        robot.connect(Port::Ip0);
        robot.advance_ms(10_000);
        assert!(!servo(&mut robot), "power off ends it too");
        robot.command(Port::Ip0, "SO");
        assert!(servo(&mut robot), "and counts from one again");
    }
    let mut robot = robot();
    robot.panel(PanelAction::ControlRight(ControlRight::Ether));
    for _ in 0..6 {
        robot.command(Port::Ip0, "BR");
        robot.command(Port::Ip0, "SO");
        assert!(servo(&mut robot));
    }
}
