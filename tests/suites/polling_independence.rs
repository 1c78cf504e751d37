//! Random programs under random commands, from a seed: output, alarms and the pose at every moment do not depend on when
//! and how often a host polls.
//!
//! The crate `ts3100-simulation` checks rules over random hosts; this suite compares two runs.

use crate::extensions::scara;
use std::fmt::Write;
use std::time::Duration;
use ts3100_controller::{Event, Output, Port};
use ts3100_tests::Robot;
use ts3100_tests::kinematics::Seeded;

/// Programs of each arm.
const PROGRAMS: u64 = 14;
/// Commands sent to each.
const COMMANDS: usize = 8;

struct Rng(Seeded);

impl Rng {
    fn new(seed: u64) -> Rng {
        let mut seeded = Seeded::new(seed);
        for _ in 0..10 {
            seeded.between(0.0, 1.0);
        }
        Rng(seeded)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.0.between(0.0, count as f64) as usize).min(count - 1)
    }

    fn micros(&mut self, most: f64) -> Duration {
        Duration::from_micros(self.0.between(1.0, most) as u64)
    }
}

fn point(rng: &mut Rng, small: bool) -> String {
    let (x, z) = if small {
        ((180.0, 330.0), (-60.0, 60.0))
    } else {
        ((350.0, 520.0), (150.0, 350.0))
    };
    format!(
        "{:.1},{:.1},{:.1}",
        rng.0.between(x.0, x.1),
        rng.0.between(-150.0, 150.0),
        rng.0.between(z.0, z.1)
    )
}

/// A program of motions in all their kinds, with what runs beside them.
fn program(rng: &mut Rng, small: bool) -> String {
    let mut text = "PROGRAM R\nTIMER=0\nON DIN(1) DO DOUT(9)\n".to_string();
    if rng.below(2) == 0 {
        text += "ON MOTION > 60 DO PRINT IP1, \"HALF\", TIMER, CR\n";
    }
    for step in 0..8 {
        let (name, other) = (
            ["A", "B", "C", "D"][rng.below(4)],
            ["A", "B", "C", "D"][rng.below(4)],
        );
        text += &match rng.below(13) {
            0..=2 => format!("MOVE {name} WITH SPEED={}\n", 10 + rng.below(90)),
            3..=5 => format!("MOVES {name}\n"),
            6 => format!("MOVEC {name} {other} WITH SPEED={}\n", 10 + rng.below(90)),
            7 => format!("MOVEJ {name} POINT(20,5,5)\n"),
            8 => format!("PASS={}\n", rng.below(101)),
            9 => ["ENABLE NOWAIT\n", "DISABLE NOWAIT\n", "DISABLE PASS\n"][rng.below(3)].to_string(),
            10 => format!("WAIT MOTION >= {}\n", rng.below(101)),
            11 => format!("DOUT({}{})\n", ["", "-"][rng.below(2)], 1 + rng.below(8)),
            _ => format!("DELAY {:.3}\n", rng.0.between(0.0, 0.1)),
        };
        let _ = writeln!(text, "PRINT IP1, {step}, TIMER, MOTION, MOTIONT, REMAINT, CR");
        let _ = writeln!(text, "PRINT IP1, HERE.X, HERE.Y, DEST.Z, CR");
    }
    text += "END\nDATA\n";
    for name in ["A", "B", "C", "D"] {
        let _ = writeln!(text, "POINT {name}={}/", point(rng, small));
    }
    text + "END\n"
}

/// The commands, each with the time since the one before.
fn script(rng: &mut Rng) -> Vec<(Duration, String)> {
    (0..COMMANDS)
        .map(|_| {
            let command = match rng.below(8) {
                0 | 1 => format!("EC,OVRD {}", 1 + rng.below(100)),
                2 | 3 => "FD".to_string(),
                4 => "EC,BREAK".to_string(),
                5 => "SP".to_string(),
                _ => "RN".to_string(),
            };
            (rng.micros(400_000.0), command)
        })
        .collect()
}

fn robot(text: &str, small: bool) -> Robot {
    let mut robot = if small {
        let mut robot = scara();
        robot.connect(Port::Ip1);
        robot.load("TEST", text);
        robot
    } else {
        Robot::ready(text)
    };
    robot.ask(Port::Ip0, "RN");
    robot
}

/// Everything observable: what was printed, switched and raised so far, and where the arm is.
fn seen(robot: &mut Robot, log: &mut String) {
    let printed = robot.received(Port::Ip1);
    let raised = robot.outputs.iter().filter_map(|output| match output {
        Output::Event(Event::Alarm { number, text }) => Some(format!("{number} {text}")),
        Output::Event(Event::Status { status, line }) => Some(format!("{status} {line}")),
        _ => None,
    });
    let raised: Vec<String> = raised.collect();
    robot.outputs.clear();
    let _ = writeln!(
        log,
        "{} {} {raised:?} {:?} {:?}",
        robot.now(),
        String::from_utf8_lossy(&printed),
        robot.seat.controller.outputs_on(),
        robot.seat.controller.arm_pose(),
    );
}

/// The log of the whole run, with a host that polls in between or without.
fn run(text: &str, small: bool, script: &[(Duration, String)], mut polls: Option<Rng>) -> String {
    let mut robot = robot(text, small);
    let mut log = String::new();
    let mut pass = |robot: &mut Robot, whole: Duration| {
        let end = robot.now() + whole;
        while let Some(rng) = &mut polls {
            let left = end.since(robot.now());
            let step = rng.micros(60_000.0);
            if step >= left {
                break;
            }
            robot.advance(step);
            robot.ask(Port::Ip0, "SF");
            robot.send(Port::Ip0, b"OK\r");
        }
        robot.advance(end.since(robot.now()));
    };
    for (after, command) in script {
        pass(&mut robot, *after);
        seen(&mut robot, &mut log);
        // Some are refused in the state the robot is in: the same ones both times.
        let answer = robot.ask(Port::Ip0, command);
        let _ = writeln!(log, "{command}: {}", String::from_utf8_lossy(&answer));
    }
    for _ in 0..6 {
        pass(&mut robot, Duration::from_millis(500));
        seen(&mut robot, &mut log);
    }
    log
}

// clause: SEQ-01 CMD-FD-01 CMD-EC-02
#[test]
fn nothing_depends_on_when_a_host_polls() {
    let mut moved = 0;
    for small in [false, true] {
        for seed in 0..PROGRAMS {
            let mut rng = Rng::new(seed);
            let text = program(&mut rng, small);
            let script = script(&mut rng);
            let quiet = run(&text, small, &script, None);
            moved += usize::from(quiet.matches("running").count() > 1);
            let polled = run(&text, small, &script, Some(Rng::new(1_000 + seed)));
            let differs = quiet
                .lines()
                .zip(polled.lines())
                .find(|(quiet, polled)| quiet != polled);
            assert!(quiet == polled, "seed {seed}: {differs:#?}\n{text}\n{script:#?}");
        }
    }
    assert!(moved > 5, "{moved} programs were stopped and started again");
}

// clause: CMD-SP-03
#[test]
fn a_stop_while_a_monitor_looks_at_the_motion_ends_with_the_step() {
    let mut robot = Robot::ready(
        "PROGRAM M\nON MOTION > 200 DO DOUT(1)\nMOVE POINT(400,-200,200) WITH SPEED=5\nMOVE POINT(400,200,200)\nEND\n",
    );
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
    robot.command(Port::Ip0, "SP");
    robot.advance_ms(20_000);
    assert_eq!(robot.total(Port::Ip0)[2], 3, "stop (continue)");
}
