//! All that a seed draws: the robots of a cell, and the steps that happen to them.

use crate::watch::whole_file;
use std::fmt;
use std::time::Duration;
use ts3100_controller::faults::rng::Rng;
use ts3100_controller::model::ArmModel;
use ts3100_controller::options::UnsolicitedSp;
use ts3100_controller::{Action, Config, Dialect, Port};
use ts3100_proto::command::COMMANDS;
use ts3100_proto::escape::Escaped;
use ts3100_proto::words::Word as _;
use ts3100_recording::transcript::Header;

/// Most robots of a cell.
const MAX_ROBOTS: u64 = 3;
/// Longest pause between two steps that is drawn, and the one that is drawn now and then.
const PAUSE: Duration = Duration::from_millis(400);
const LONG_PAUSE: Duration = Duration::from_secs(20);

/// Programs that hold the controller in every kind of waiting.
const PROGRAMS: [&str; 10] = [
    "GLOBAL\nA = 1\nEND\nPROGRAM P\nMOVE H\nMOVES F WITH SPEED=30\nPRINT IP1, A, CR\nMOVE H\nEND\nDATA\n\
        POINT H=400,0,200,0,0,0,0,0/\nPOINT F=400,100,150,0,0,0,0,0/\nEND\n",
    "PROGRAM P\nN = 0\nINPUT IP1, N\nPRINT IP1, N, CR\nDELAY 0.3\nEND\n",
    "PROGRAM P\nAGAIN:\nGOTO AGAIN\nEND\n",
    "PROGRAM P\nWAIT DIN(1)\nDOUT(1)\nWAIT MOTION >= 100\nDOUT(-1)\nEND\n",
    "PROGRAM P\nEND\n",
    "PROGRAM P\nRCYCLE:\nEND\n",
    "PROGRAM P\nX = 1.0\nX = X / 0\nMOVE POINT(9000,0,0)\nEND\n",
    "PROGRAM P\nREADY\nSPEED = 40\nMOVEA 1, 20\nMOVEI 2, 5\nMOVEA 1, -20\nMOVEI 2, -5\nEND\n",
    "PROGRAM P\nI = 0\nAGAIN:\nI = I + 1\nDOUT(2)\nDELAY 0.05\nDOUT(-2)\nIF I < 40 THEN AGAIN\nPRINT COM1, I, CR\nEND\n",
    "PROGRAM P\nMOVE A\nPASS = 50\nMOVES B\nMOVEC C, A\nMOVE B\nEND\nDATA\nPOINT A=400,0,200,0,0,0,0,0/\n\
        POINT B=420,60,200,0,0,0,0,0/\nPOINT C=440,0,180,0,0,0,0,0/\nEND\n",
];

/// Besides an example of every command: what makes more happen, and no command at all.
const MORE: [&str; 40] = [
    "RN",
    "RN",
    "RN",
    "RN",
    "SO",
    "SO",
    "RS,STP",
    "RS,CYC",
    "RS,SIG",
    "RS,SEL",
    "RS,ERR",
    "SL,P0",
    "SL,P1",
    "SL,P2",
    "SL,P3",
    "SL,P4",
    "SL,P5",
    "SL,P6",
    "SL,P7",
    "SL,P8",
    "SL,P9",
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
    "DO,READY",
    "DO,STOP",
    "DO,INPUT IP1, A",
    "MW,0 A 0 7",
    "MR,A 0",
    "IW,3 1",
    "UL,P0",
    "UL,S1",
    "QQ",
];

/// Actions of operators, failures and tests at the controller, in the words of scenarios.
const ACTIONS: [&str; 58] = [
    "key-switch teaching",
    "key-switch internal",
    "key-switch ext",
    "key-switch ext",
    "control-right sig",
    "control-right rs232c",
    "control-right ether",
    "control-right ether",
    "emergency-stop press",
    "emergency-stop release",
    "emergency-stop release",
    "safety-switch open",
    "safety-switch close",
    "safety-switch close",
    "alarms reset",
    "alarms reset",
    "servo on",
    "servo on",
    "servo off",
    "program start",
    "program start",
    "program stop",
    "program step",
    "program reset",
    "feed-hold press",
    "feed-hold press",
    "machine-lock on",
    "machine-lock off",
    "battery low",
    "battery ok",
    "override 50",
    "override 100",
    "run-mode step",
    "run-mode continuous",
    "run-mode cycle",
    "input 1 on",
    "input 1 off",
    "input 249 on",
    "input 255 pulse on 200 ms",
    "input 257 on",
    "input 257 off",
    "input 261 on",
    "input 2 force on",
    "input 2 release",
    "jog 1 plus joint fast",
    "jog 2 minus world slow",
    "jog 3 plus tool mid inching",
    "jog stop",
    "alarms raise 2-046",
    "alarms raise 8-014",
    "power off",
    "power on",
    "power cycle",
    "variable A 3",
    "file select P0",
    "file erase S2",
    "output 7 on",
    "output 7 off",
];

/// Faults, besides those that are actions above.
const FAULTS: [&str; 17] = [
    "no-reply",
    "late-reply",
    "ng",
    "wrong-reply",
    "lost-etx",
    "flipped-bit",
    "duplicate-text",
    "merged-texts",
    "split-bytes",
    "slow-line",
    "reset-mid-text",
    "half-open",
    "lost-record",
    "drive-full",
    "servo-failure",
    "key-turned",
    "emergency-stop",
];

/// Something that happens. Carrying it out draws nothing.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// A host, or the partner of a program, connects.
    Connect { robot: usize, port: Port },
    /// It leaves.
    Disconnect { robot: usize, port: Port },
    /// A host sends a command, if its last exchange is over, in two pieces if it is cut.
    Ask {
        robot: usize,
        port: Port,
        command: String,
        cut: bool,
    },
    /// A host downloads a file whose content says whether it is whole.
    Download {
        robot: usize,
        port: Port,
        name: String,
        version: u32,
        lines: u32,
    },
    /// Bytes come whatever the exchange is.
    Noise {
        robot: usize,
        port: Port,
        bytes: Vec<u8>,
    },
    /// Something is done to the controller itself.
    Act { robot: usize, action: Action },
    /// Key, control right, buttons, alarms and servo are brought to where programs can run.
    Recover { robot: usize },
    /// The line outside of all robots changes.
    Outside { on: bool },
    /// The disk refuses changes of files from now on, or takes them again.
    Disk { robot: usize, refuses: bool, slow: bool },
    /// A snapshot is written and read back, and kept.
    Snapshot { robot: usize },
    /// The kept one takes over.
    Restore { robot: usize },
    /// SU, SF and SM are asked for at one moment.
    Agree { robot: usize },
    /// Time passes.
    Pass(Duration),
}

/// One robot of a cell.
#[derive(Debug, Clone)]
pub struct RobotPlan {
    /// Its arm, by the word of `--model`.
    pub model: &'static str,
    pub dialect: Dialect,
    /// The seed of legal variation.
    pub variation: Option<u64>,
    /// Every host is sent SP.
    pub always_sp: bool,
    /// Its serial lines take their time.
    pub paced: bool,
}

/// A cell and everything that happens in it.
#[derive(Debug, Clone)]
pub struct Plan {
    pub robots: Vec<RobotPlan>,
    pub steps: Vec<Step>,
}

impl RobotPlan {
    fn draw(rng: &mut Rng) -> RobotPlan {
        RobotPlan {
            model: [
                "ts3100-tv800",
                "tsl3000-thl400",
                "tsl3000-thl400-4",
                "tsl3000-thl300",
            ][rng.index(4)],
            dialect: if rng.index(4) == 0 {
                Dialect::Manual
            } else {
                Dialect::Field
            },
            variation: (rng.index(3) == 0).then(|| rng.between(1, 1_000)),
            always_sp: rng.index(2) == 0,
            paced: rng.index(2) == 0,
        }
    }

    /// The configuration of its controller.
    #[must_use]
    pub fn config(&self) -> Config {
        let mut config = Config::new(self.dialect);
        config.model = match self.model {
            "tsl3000-thl400" => ArmModel::thl400(),
            "tsl3000-thl400-4" => ArmModel::thl400_four_axes(),
            "tsl3000-thl300" => ArmModel::thl300(),
            _ => ArmModel::tv800(),
        };
        config.vary = self.variation;
        config.options.serial_pacing = self.paced;
        if self.always_sp {
            config.options.unsolicited_sp = UnsolicitedSp::Always;
        }
        config
    }

    /// The same for the head of a transcript.
    pub(crate) fn header(&self) -> Header {
        let mut flags = vec![
            format!("model={}", self.model),
            format!(
                "dialect={}",
                if self.dialect == Dialect::Manual {
                    "manual"
                } else {
                    "field"
                }
            ),
            format!("set=serial.pacing={}", self.paced),
        ];
        flags.extend(self.variation.map(|seed| format!("vary={seed}")));
        if self.always_sp {
            flags.push("set=sp.unsolicited=true".to_owned());
        }
        Header {
            origin: "observed, by ts3100 simulate".to_owned(),
            flags,
            files: programs()
                .map(|(name, content)| (name, content.to_vec()))
                .collect(),
            ..Header::default()
        }
    }
}

/// The files that are on every drive at first.
pub fn programs() -> impl Iterator<Item = (String, &'static [u8])> {
    let numbered = PROGRAMS.iter().enumerate();
    numbered.map(|(number, program)| (format!("P{number}"), program.as_bytes()))
}

impl Plan {
    /// The plan of a seed.
    #[must_use]
    pub fn draw(seed: u64, steps: usize) -> Plan {
        let mut rng = Rng::new(seed, "simulation");
        let robots: Vec<RobotPlan> = (0..rng.between(1, MAX_ROBOTS))
            .map(|_| RobotPlan::draw(&mut rng))
            .collect();
        let mut drawn = Vec::new();
        for robot in 0..robots.len() {
            drawn.push(Step::Connect {
                robot,
                port: Port::Ip0,
            });
            drawn.push(Step::Recover { robot });
        }
        while drawn.len() < steps {
            drawn.push(Step::draw(&mut rng, robots.len()));
        }
        Plan { robots, steps: drawn }
    }
}

/// A command of a host.
fn command(rng: &mut Rng) -> String {
    let rows = COMMANDS.iter().filter(|row| row.permission.is_some());
    let examples: Vec<&str> = rows.map(|row| row.example).collect();
    let known = examples.iter().chain(&MORE).filter(|row| !row.starts_with("DL,"));
    let known: Vec<&&str> = known.collect();
    (*known[rng.index(known.len())]).to_owned()
}

impl Step {
    fn draw(rng: &mut Rng, robots: usize) -> Step {
        let robot = rng.index(robots);
        let port = [Port::Ip0, Port::Ip0, Port::Ip0, Port::Host][rng.index(4)];
        match rng.index(100) {
            0..34 => Step::Ask {
                robot,
                port,
                command: command(rng),
                cut: rng.index(8) == 0,
            },
            34..38 => Step::Download {
                robot,
                port,
                name: format!("S{}", rng.between(1, 3)),
                version: u32::try_from(rng.between(1, 9_999)).unwrap_or(0),
                lines: u32::try_from(rng.between(0, 60)).unwrap_or(0),
            },
            38..40 => Step::Noise {
                robot,
                port,
                bytes: noise(rng),
            },
            40..42 => Step::Noise {
                robot,
                port: [Port::Ip1, Port::Com1][rng.index(2)],
                bytes: [&b"1\r"[..], b"2,", b"x\r", b"\r\n", b"99999999999\r"][rng.index(5)].to_vec(),
            },
            42..44 => Step::Connect {
                robot,
                port: [Port::Ip0, Port::Host, Port::Ip1, Port::Com1][rng.index(4)],
            },
            44..45 => Step::Disconnect {
                robot,
                port: [Port::Ip0, Port::Host, Port::Ip1, Port::Com1][rng.index(4)],
            },
            45..58 => Step::act(robot, ACTIONS[rng.index(ACTIONS.len())]),
            58..60 => fault(rng, robot),
            60..64 => Step::Recover { robot },
            64..66 => Step::Outside {
                on: rng.index(2) == 0,
            },
            66..67 => Step::Disk {
                robot,
                refuses: rng.index(3) == 0,
                slow: rng.index(3) == 0,
            },
            67..69 => Step::Snapshot { robot },
            69..70 => Step::Restore { robot },
            70..76 => Step::Agree { robot },
            76..78 => Step::Pass(LONG_PAUSE),
            _ => {
                let most = u64::try_from(PAUSE.as_micros()).unwrap_or(u64::MAX);
                Step::Pass(Duration::from_micros(rng.between(0, most)))
            }
        }
    }

    fn act(robot: usize, words: &str) -> Step {
        match words.parse() {
            Ok(action) => Step::Act { robot, action },
            // Held by a test: every one of them can be read.
            Err(_) => Step::Recover { robot },
        }
    }

    /// The content of its file, of a download.
    pub(crate) fn content(&self) -> Option<Vec<u8>> {
        let Step::Download {
            name, version, lines, ..
        } = self
        else {
            return None;
        };
        Some(whole_file(name, *version, *lines))
    }
}

impl fmt::Display for RobotPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.header().flags.join(" "))
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let robot = match self {
            Step::Connect { robot, .. }
            | Step::Disconnect { robot, .. }
            | Step::Ask { robot, .. }
            | Step::Download { robot, .. }
            | Step::Noise { robot, .. }
            | Step::Act { robot, .. }
            | Step::Recover { robot }
            | Step::Disk { robot, .. }
            | Step::Snapshot { robot }
            | Step::Restore { robot }
            | Step::Agree { robot } => robot + 1,
            Step::Outside { on } => return write!(f, "outside line {}", on.word()),
            Step::Pass(time) => return write!(f, "{} ms pass", time.as_micros() as f64 / 1_000.0),
        };
        write!(f, "robot {robot}: ")?;
        match self {
            Step::Connect { port, .. } => write!(f, "{port} connects"),
            Step::Disconnect { port, .. } => write!(f, "{port} leaves"),
            Step::Ask {
                port, command, cut, ..
            } => {
                let cut = if *cut { " in two pieces" } else { "" };
                write!(f, "{port} sends {command}{cut}")
            }
            Step::Download {
                port, name, lines, ..
            } => write!(f, "{port} downloads {name} of {lines} lines"),
            Step::Noise { port, bytes, .. } => write!(f, "{port} sends the bytes {}", Escaped::new(bytes)),
            Step::Act { action, .. } => action.fmt(f),
            Step::Recover { .. } => f.write_str("recovers"),
            Step::Disk { refuses, slow, .. } => {
                write!(f, "its disk is full: {}, slow: {}", refuses.word(), slow.word())
            }
            Step::Snapshot { .. } => f.write_str("a snapshot is taken"),
            Step::Restore { .. } => f.write_str("the snapshot takes over"),
            Step::Agree { .. } => f.write_str("IP0 asks for SF, SU and SM"),
            Step::Outside { .. } | Step::Pass(_) => Ok(()),
        }
    }
}

fn fault(rng: &mut Rng, robot: usize) -> Step {
    if rng.index(3) == 0 {
        return Step::act(robot, "faults clear");
    }
    let kind = FAULTS[rng.index(FAULTS.len())];
    Step::act(
        robot,
        &format!("faults arm {kind}:after={},times=1", rng.between(0, 3)),
    )
}

/// Bytes of a host that is in disorder.
fn noise(rng: &mut Rng) -> Vec<u8> {
    let known: [&[u8]; 8] = [
        b"\x02",
        b"\x03",
        b"\x02SU",
        b"OK\r\x03",
        b"\x02OK\r\x03",
        b"\x02FL,PROGRAM S1\n\x03",
        b"\x02SU\r\x03\x02SF\r\x03",
        b"SU\r",
    ];
    match rng.index(known.len() + 1) {
        random if random == known.len() => {
            let length = rng.between(1, 40);
            (0..length).map(|_| rng.next_u64().to_le_bytes()[0]).collect()
        }
        other => known[other].to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_action_and_every_fault_can_be_read() {
        let faults = FAULTS.map(|kind| format!("faults arm {kind}:after=1,times=1"));
        for words in ACTIONS.into_iter().chain(faults.iter().map(String::as_str)) {
            assert_ne!(Step::act(0, words), Step::Recover { robot: 0 }, "{words}");
        }
    }
}
