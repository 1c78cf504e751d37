//! An OK means an effect: every command in every state of the robot, once sent and once not, compared by what can be
//! observed of the robot then, later, and after the next start.
//!
//! A pair without a difference has to be in a list with the reason; a reading command that makes a difference is an error.
//! What the effects are is tested in the suites of the commands.

use std::collections::BTreeSet;
use ts3100_controller::{PanelAction, Port};
use ts3100_tests::{Robot, notation};

const PROGRAM: &str = "GLOBAL\nN = 1\nEND\nPROGRAM TEST\nPRINT IP1, \"A\", N, CR\nN = N + 1\nDOUT(3)\n\
    MOVEA 1,60.0 WITH SPEED=10\nRCYCLE:\nDELAY 2.0\nMOVEA 1,0.0 WITH SPEED=10\nPRINT IP1, \"B\", N, CR\nEND\n\
    DATA\nTRANS WK1=10,20,30,0,0,45\nEND\n";

/// Commands that are to change something when they are answered OK.
const CHANGING: [&str; 53] = [
    "RN",
    "SP",
    "BR",
    "SO",
    "RS,PRG",
    "RS,STP",
    "RS,CYC",
    "RS,SIG",
    "RS,SEL",
    "RS,ERR",
    "SL,OTHER",
    "SL,TEST",
    "ER,OTHER",
    "EC,MODE STEP",
    "EC,MODE CONT",
    "EC,MODE CONTINUOUS",
    "EC,MODE CYCLE",
    "EC,MODE SEGMENT",
    "EC,OVRD 50",
    "EC,OVRD 100",
    "EC,BREAK",
    "MW,0 N 0 40",
    "MW,1 N 0 40",
    "FD",
    "IW,1 1",
    "IW,3 0",
    "DO,DOUT(5)",
    "DO,N = 50",
    "DO,MOVEA 1,20.0",
    "DO,MOVEA 2,20.0 WITH SPEED=20",
    "DO,SPEED = 50",
    "DO,ACCEL = 50",
    "DO,DECEL = 50",
    "DO,WORK = WK1",
    "DO,TOOL = WK1",
    "DO,PAYLOAD = {5.0,0,0,50.0}",
    "DO,PRINT IP1, \"X\", CR",
    "DO,DELAY 1.0",
    "WD,700 2",
    "WD,700 8",
    "WD,700 1",
    "WD,0 0",
    "HO,1 8 165",
    "HO,1 8 0",
    "ZS,1 WK1 1 2 3 4 5 6",
    "ZS,2 TL1 1 2 3 4 5 6",
    "MD,1",
    "RT,2",
    "SC,3",
    "MD,0",
    "JG,2 +",
    "JG,1 -",
    "JG,2 !",
];

/// Commands that are to change nothing.
const READING: [&str; 26] = [
    "SU",
    "SF",
    "EU",
    "CA",
    "VR",
    "UL,TEST",
    "MR,N 0",
    "MR,N -1",
    "AC",
    "AH",
    "IO,1",
    "HI,1 8",
    "PR,0",
    "PR,1",
    "PR,2",
    "PR,3",
    "PR,4",
    "PR,5",
    "VL,0",
    "VL,1",
    "XX",
    "RN,1",
    "SL,NOFILE",
    "EC,OVRD 0",
    "IW,65 1",
    "DO,XYZZY",
];

/// Commands, states, and why OK without a difference is right there.
const SO_ALREADY: [(&[&str], &[&str], &str); 11] = [
    (
        &["SO"],
        &[
            "ready", "running", "moving", "stopped", "held", "jogged", "direct", "watched",
        ],
        "servo power is on",
    ),
    (&["BR"], &["off"], "servo power is off"),
    (
        &["EC,BREAK"],
        &["stopped"],
        "nothing moves or runs, and SM shows a break already",
    ),
    (
        &["EC,MODE CYCLE"],
        &["off", "ready", "stopped", "jogged", "watched"],
        "it is cycle mode",
    ),
    (&["EC,OVRD 100"], &STATES, "the override is 100"),
    (
        &["RS,PRG", "RS,STP", "SL,TEST"],
        &["off", "ready", "jogged", "watched"],
        "step 1, data as in the file",
    ),
    (
        &["RS,ERR"],
        &["off", "ready", "jogged", "watched"],
        "there is no alarm",
    ),
    (
        &["RS,SIG", "IW,3 0", "HO,1 8 0"],
        &["off", "ready", "jogged", "watched"],
        "the outputs are off",
    ),
    (&["IW,3 0", "HO,1 8 0"], &["direct"], "the outputs are off"),
    (
        &["WD,0 0"],
        &[
            "off", "ready", "running", "moving", "stopped", "held", "jogged", "direct",
        ],
        "no watchdog",
    ),
    (
        &["MD,0", "JG,2 !"],
        &STATES,
        "the mode is 0, and JG guides nothing",
    ),
];

fn state(name: &str) -> Robot {
    let mut robot = Robot::ready(PROGRAM);
    robot
        .seat
        .controller
        .put_file("OTHER", b"PROGRAM OTHER\nPRINT IP1, \"O\", CR\nEND\n")
        .unwrap();
    robot.outputs.clear();
    match name {
        "off" => robot.panel(PanelAction::Servo(false)),
        "ready" => {}
        "running" => {
            robot.command(Port::Ip0, "RN");
            robot.advance_ms(4_000);
        }
        "moving" => {
            robot.command(Port::Ip0, "RN");
            robot.advance_ms(1_000);
        }
        "stopped" => {
            robot.command(Port::Ip0, "RN");
            robot.advance_ms(1_000);
            robot.command(Port::Ip0, "EC,BREAK");
            robot.advance_ms(1_000);
            robot.panel(PanelAction::Battery(true));
            robot.panel(PanelAction::Battery(false));
        }
        "held" => {
            robot.command(Port::Ip0, "RN");
            robot.advance_ms(1_000);
            robot.command(Port::Ip0, "FD");
        }
        "jogged" => robot.command(Port::Ip0, "JG,1 +"),
        "direct" => robot.command(Port::Ip0, "DO,MOVEA 1,60.0 WITH SPEED=10"),
        "watched" => robot.command(Port::Ip0, "WD,2500 8"),
        other => panic!("no state {other}"),
    }
    robot.received(Port::Ip1);
    robot.advance_ms(100);
    robot.received(Port::Ip0);
    robot
}

const STATES: [&str; 9] = [
    "off", "ready", "running", "moving", "stopped", "held", "jogged", "direct", "watched",
];

/// What can be seen from outside, times and the flag of SU left out.
fn seen(robot: &mut Robot) -> Vec<String> {
    let mut body = robot.total(Port::Ip0);
    body.drain(44..52);
    body.remove(3);
    let mut seen = vec![notation::write(&body)];
    for command in ["SU", "CA", "EU", "UL,TEST", "MR,N 0", "AC", "VL,1"] {
        let answer = robot.ask(Port::Ip0, command);
        robot.send(Port::Ip0, b"NG\r");
        seen.push(notation::write(&answer));
    }
    seen.push(notation::write(&robot.received(Port::Ip1)));
    seen
}

/// What is seen 1 ms, 50 ms and 3 s later, and after the next start.
fn future(mut robot: Robot) -> Vec<String> {
    robot.advance_ms(1);
    let mut all = seen(&mut robot);
    robot.advance_ms(50);
    all.extend(seen(&mut robot));
    robot.advance_ms(3_000);
    all.extend(seen(&mut robot));
    all.push(notation::write(&robot.file(Port::Ip0, "SM,1")));
    all.push(notation::write(
        &robot.ask(Port::Ip0, "DO,MOVE POINT(400,20,200,0,0,0,0,0)"),
    ));
    robot.advance_ms(300);
    all.extend(seen(&mut robot));
    robot.advance_ms(5_000);
    all.extend(seen(&mut robot));
    all.push(notation::write(&robot.ask(Port::Ip0, "RN")));
    for _ in 0..4 {
        robot.advance_ms(5_000);
        all.extend(seen(&mut robot));
    }
    all
}

#[test]
fn what_is_answered_ok_has_an_effect() {
    let pairs = SO_ALREADY.iter().flat_map(|(commands, states, _)| {
        states
            .iter()
            .flat_map(|state| commands.iter().map(|command| (*state, *command)))
    });
    let mut allowed: BTreeSet<(&str, &str)> = pairs.collect();
    assert!(
        allowed.remove(&("jogged", "JG,2 !")),
        "there it ends the jog, whatever axis it names"
    );
    let (mut without, mut refused) = (BTreeSet::new(), 0);
    for name in STATES {
        let prepared = state(name);
        let plain = future(prepared.clone());
        for command in CHANGING {
            let mut robot = prepared.clone();
            let answer = robot.ask(Port::Ip0, command);
            let same = future(robot) == plain;
            match notation::write(&answer).as_str() {
                "OK<CR>" if same => drop(without.insert((name, command))),
                "OK<CR>" => {}
                _ => {
                    assert!(same, "{command} in state {name} was refused and has an effect");
                    refused += 1;
                }
            }
        }
    }
    let surplus: Vec<_> = without.difference(&allowed).collect();
    assert!(surplus.is_empty(), "OK without effect: {surplus:#?}");
    let stale: Vec<_> = allowed.difference(&without).collect();
    assert!(
        stale.is_empty(),
        "has an effect after all, or is refused: {stale:?}"
    );
    assert!(refused > 50, "{refused} refusals");
}

#[test]
fn what_only_reads_changes_nothing() {
    for name in STATES {
        let prepared = state(name);
        let plain = future(prepared.clone());
        for command in READING {
            let mut robot = prepared.clone();
            robot.ask(Port::Ip0, command);
            robot.send(Port::Ip0, b"NG\r");
            assert_eq!(future(robot), plain, "{command} in state {name}");
        }
    }
}
