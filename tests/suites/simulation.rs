//! Seeded simulation: hosts, operators and time in any order. It checks what must hold always: every command is answered
//! by exactly one text, nothing but SP comes unsolicited and never inside an exchange, SU and SF agree, and the same seed
//! gives the same bytes.
//!
//! A failure names its seed. `snapshots.rs` runs the same simulation with round trips.

use std::time::Duration;
use ts3100_controller::{ControlRight, Dialect, KeySwitch, PanelAction, Port};
use ts3100_proto::command::COMMANDS;
use ts3100_tests::{Robot, frame, notation, unframe};

const SEEDS: u64 = 60;
const STEPS: u32 = 250;

/// Programs that hold the controller in every kind of waiting.
const PROGRAMS: [&str; 7] = [
    "GLOBAL\nA = 1\nEND\nPROGRAM P\nMOVE H\nMOVES F WITH SPEED=30\nPRINT IP1, A, CR\nMOVE H\nEND\nDATA\n\
        POINT H=400,0,200,0,0,0,0,0/\nPOINT F=400,100,150,0,0,0,0,0/\nEND\n",
    "PROGRAM P\nN = 0\nINPUT IP1, N\nPRINT IP1, N, CR\nDELAY 0.3\nEND\n",
    "PROGRAM P\nAGAIN:\nGOTO AGAIN\nEND\n",
    "PROGRAM P\nWAIT DIN(1)\nDOUT(1)\nWAIT MOTION >= 100\nDOUT(-1)\nEND\n",
    "PROGRAM P\nEND\n",
    "PROGRAM P\nRCYCLE:\nEND\n",
    "PROGRAM P\nX = 1.0\nX = X / 0\nMOVE POINT(9000,0,0)\nEND\n",
];

/// Besides an example of every command: what makes more happen, and no command at all.
const MORE: [&str; 31] = [
    "RN",
    "RN",
    "SO",
    "RS,STP",
    "RS,CYC",
    "RS,SIG",
    "RS,SEL",
    "SL,P0",
    "SL,P1",
    "SL,P2",
    "SL,P3",
    "SL,P4",
    "SL,P5",
    "SL,P6",
    "EC,MODE CONT",
    "EC,MODE STEP",
    "EC,MODE CYCLE",
    "EC,MODE SEG",
    "EC,OVRD 37",
    "EC,OVRD 100",
    "EC,BREAK",
    "DO,MOVE POINT(400,50,180)",
    "DO,DOUT(5)",
    "DO,DELAY 0.2",
    "DO,STOP",
    "DO,INPUT IP1, A",
    "MW,0 A 0 7",
    "MR,A 0",
    "IW,3 1",
    "UL,P0",
    "QQ",
];

/// xorshift: small, and the same everywhere.
pub struct Rng(pub u64);

impl Rng {
    pub fn next(&mut self, sides: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 >> 33).unwrap_or(0) % sides
    }
}

/// Takes unsolicited SP texts off; what remains is an answer.
fn without_sp(robot: &mut Robot) -> Vec<u8> {
    let stop = frame(b"SP\r");
    let mut bytes = robot.received(Port::Ip0);
    while let Some(rest) = bytes.strip_prefix(stop.as_slice()) {
        bytes = rest.to_vec();
    }
    while let Some(rest) = bytes.strip_suffix(stop.as_slice()) {
        bytes = rest.to_vec();
    }
    bytes
}

fn ask(robot: &mut Robot, command: &str) -> Vec<u8> {
    ask_bytes(robot, format!("{command}\r").as_bytes())
}

fn ask_bytes(robot: &mut Robot, data: &[u8]) -> Vec<u8> {
    let before = without_sp(robot);
    assert_eq!(notation::write(&before), "", "nothing but SP comes unasked");
    robot.send(Port::Ip0, data);
    let answer = without_sp(robot);
    unframe(&answer)
        .unwrap_or_else(|| panic!("{}: {} found", notation::write(data), notation::write(&answer)))
}

/// SU and SF, without time passing in between, say the same.
fn agree(robot: &mut Robot, wait: u64) {
    let body = ask(robot, "SF");
    robot.received(Port::Ip0);
    robot.send(Port::Ip0, b"OK\r");
    let text = String::from_utf8(ask(robot, "SU")).unwrap();
    robot.advance_ms(wait);
    assert_eq!(robot.received(Port::Ip0), b"", "nothing comes inside an exchange");
    robot.send(Port::Ip0, b"OK\r");
    let status = ["stop(reset)", "running", "stop(retry)", "stop(continue)"][usize::from(body[3 + 2])];
    assert!(
        text.ends_with(&format!("STATUS:{status}\x1A")),
        "SF {status}, SU {text}"
    );
    assert!(body[3] <= 1 && body[4] <= 1 && body[6] <= 1);
    assert!(body[3] == 0 || body[4] == 0, "servo power in an emergency stop");
}

/// Sends a command and whatever its exchange needs.
fn host(robot: &mut Robot, rng: &mut Rng) {
    let rows = COMMANDS.iter().filter(|row| row.permission.is_some());
    let examples: Vec<&str> = rows.map(|row| row.example).collect();
    let choice = rng.next(examples.len() + MORE.len());
    let command = examples
        .get(choice)
        .unwrap_or_else(|| &MORE[choice - examples.len()]);
    let mut answer = ask(robot, command);
    if answer.starts_with(b"FL,") {
        // Up to the OK that is not answered. A full text needs no EOF.
        let mut text = frame(&answer);
        while !text.is_empty() {
            answer = unframe(&text).unwrap_or_else(|| panic!("{command}: {}", notation::write(&text)));
            robot.send(Port::Ip0, b"OK\r");
            text = without_sp(robot);
        }
        assert!(
            answer.ends_with(b"\x1A") || *command == "IO,1",
            "{command}: {}",
            notation::write(&answer)
        );
        return;
    }
    if command.starts_with("DL,") && answer == b"OK\r" {
        answer = ask_bytes(robot, b"FL,PROGRAM T\nEND\n\x1A");
    }
    assert!(
        answer == b"OK\r" || answer == b"NG\r",
        "{command}: {}",
        notation::write(&answer)
    );
}

fn operator(robot: &mut Robot, rng: &mut Rng) {
    let panel = match rng.next(12) {
        0 => PanelAction::Key([KeySwitch::Teaching, KeySwitch::Internal, KeySwitch::Ext][rng.next(3)]),
        1 => PanelAction::ControlRight(
            [ControlRight::Sig, ControlRight::Rs232c, ControlRight::Ether][rng.next(3)],
        ),
        2 => PanelAction::EmergencyStop(true),
        3 | 4 => PanelAction::EmergencyStop(false),
        5 => PanelAction::AlarmReset,
        6 => PanelAction::Servo(rng.next(3) > 0),
        7 => PanelAction::Start,
        8 => PanelAction::Stop,
        9 => PanelAction::PressFeedHold,
        10 => PanelAction::MachineLock(rng.next(2) == 0),
        _ => PanelAction::InputLine {
            line: [1, 249, 255, 257, 261][rng.next(5)],
            on: rng.next(2) == 0,
        },
    };
    robot.panel(panel);
}

fn step(robot: &mut Robot, rng: &mut Rng) {
    match rng.next(20) {
        0..8 => host(robot, rng),
        8..10 => operator(robot, rng),
        10..14 => robot.advance(Duration::from_micros(rng.next(400_000) as u64)),
        14 => robot.advance_ms(20_000),
        15 => robot.raw(Port::Ip1, [&b"1\r"[..], b"2,", b"x\r", b"\r\n"][rng.next(4)]),
        16 => robot.disconnect(Port::Ip1),
        17 => robot.connect(Port::Ip1),
        18 => agree(robot, rng.next(3_000) as u64),
        _ => {
            // Back to where something can happen.
            robot.panel(PanelAction::Key(KeySwitch::Ext));
            robot.panel(PanelAction::ControlRight(ControlRight::Ether));
            robot.panel(PanelAction::EmergencyStop(false));
            robot.panel(PanelAction::AlarmReset);
            robot.panel(PanelAction::Servo(true));
            robot.connect(Port::Ip1);
        }
    }
}

pub fn run(seed: u64) -> Vec<u8> {
    let mut rng = Rng(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    let mut robot = Robot::new(Dialect::Field);
    for (number, program) in PROGRAMS.iter().enumerate() {
        let stored = robot
            .seat
            .controller
            .put_file(&format!("P{number}"), program.as_bytes());
        stored.unwrap_or_else(|error| panic!("P{number}: {error}"));
    }
    robot.connect(Port::Ip0);
    for _ in 0..STEPS {
        step(&mut robot, &mut rng);
    }
    robot.advance_ms(100);
    without_sp(&mut robot);
    agree(&mut robot, 0);
    let mut trace = format!("{:?}", robot.outputs).into_bytes();
    trace.extend(robot.total(Port::Ip0));
    trace
}

// clause: TRN-01 TRN-02 SU-12 CMD-SP-07 CMD-LST-02
#[test]
fn whatever_hosts_and_operators_do() {
    for seed in 0..SEEDS {
        println!("seed {seed}");
        run(seed);
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    assert_eq!(run(7), run(7));
}

// clause: CMD-RN-06
#[test]
fn an_empty_program_in_continuous_mode_does_not_hold_up_the_controller() {
    for program in [
        "PROGRAM P\nEND\n",
        "PROGRAM P\nRCYCLE:\nEND\n",
        "PROGRAM P\nREMARK nothing\nEND\n",
    ] {
        let mut robot = Robot::ready(program);
        robot.command(Port::Ip0, "EC,MODE CONT");
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(1_000);
        assert_eq!(robot.total(Port::Ip0)[2], 1, "{program}");
        robot.command(Port::Ip0, "SP");
        robot.advance_ms(100);
        assert_ne!(robot.total(Port::Ip0)[2], 1, "{program}");
    }
}
