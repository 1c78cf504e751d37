//! One long day of a robot, on which everything happens that a fault can wait for: what is taken when it is armed
//! finds its occasion there, and what is refused finds none.

use super::*;
use crate::faults::spec::parse;
use crate::options::SfTexts;
use crate::{ControlRight, Controller, KeySwitch};
use ts3100_proto::command::COMMANDS;

/// Prints on each channel and reads from each.
const PROGRAM: &[u8] = b"GLOBAL\nX = 1.0\nA = POINT(1,2,3,4,5,6)\nEND\nPROGRAM T\nPRINT COM1, 1, CR\n\
                         PRINT IP1, 1, CR\nPRINT IP2, 1, CR\nDELAY 1\nEND\n";
const BLOCKS: [Option<u32>; 5] = [None, Some(0), Some(1), Some(2), Some(3)];

/// Every kind with every word of its parameters, every command and none, every port and none, and each number of
/// a text, as they are written.
fn specs() -> Vec<String> {
    let rows = COMMANDS.iter().map(|row| row.letters);
    let letters: BTreeSet<&str> = rows.filter(|row| !matches!(*row, "FL" | "OK" | "NG")).collect();
    let mut commands: Vec<String> = vec![String::new()];
    commands.extend(letters.into_iter().map(|letters| format!(",command={letters}")));
    let mut ports = vec![String::new()];
    ports.extend(Port::ALL.map(|port| format!(",channel={port}")));
    let mut specs = Vec::new();
    for kind in KINDS {
        let mut words = vec![String::new()];
        for parameter in kind.parameters {
            if let ParameterType::Word(takes) = parameter.value_type {
                words.extend(takes.iter().map(|word| format!(",{}={word}", parameter.name)));
            }
        }
        for word in &words {
            for command in &commands {
                for port in &ports {
                    for block in BLOCKS {
                        let block = block.map(|block| format!(",block={block}")).unwrap_or_default();
                        let keys = format!("{word}{command}{port}{block}");
                        specs.push(format!("{}:{}", kind.name, keys.trim_start_matches(',')));
                    }
                }
            }
        }
    }
    specs
}

/// A host that asks for everything, and ends every exchange.
struct Day {
    robot: Controller,
}

impl Day {
    fn hear(&mut self, port: Port, bytes: Vec<u8>) -> usize {
        let now = self.robot.now() + Duration::from_millis(60);
        let outputs = self.robot.feed(now, Input::received(port, bytes));
        let sent = outputs.iter().filter_map(|output| match output {
            Output::Send { port: from, bytes } if *from == port => Some(bytes),
            _ => None,
        });
        let files = sent.filter(|bytes| !matches!(bytes.get(1..3), Some(b"OK" | b"NG" | b"SP")));
        files.count()
    }

    fn text(&mut self, port: Port, data: &[u8]) -> usize {
        self.hear(port, [b"\x02", data, b"\x03"].concat())
    }

    /// A command, and OK to each text of its answer.
    fn ask(&mut self, port: Port, command: &str) {
        let mut files = self.text(port, format!("{command}\r").as_bytes());
        while files > 0 {
            files = self.text(port, b"OK\r");
        }
    }

    fn on(&mut self, port: Port) {
        let right = if port == Port::Host {
            ControlRight::Rs232c
        } else {
            ControlRight::Ether
        };
        for panel in [PanelAction::Key(KeySwitch::Ext), PanelAction::ControlRight(right)] {
            self.robot.feed(self.robot.now(), Input::by_hand(panel));
        }
        for row in COMMANDS {
            if !matches!(row.letters, "FL" | "OK" | "NG" | "DL") {
                self.ask(port, row.example);
            }
        }
        for command in ["RS,ERR", "SP", "RS,SEL", "SL,T", "SO"] {
            self.ask(port, command);
        }
        self.ask(port, "DL,NEW");
        self.text(port, &[b"FL,".as_slice(), &[b'A'; 200], b"\r"].concat());
        for data in [b"B\r".as_slice(), b"C\r", b"D\r\x1a"] {
            self.text(port, data);
        }
        for command in [
            "UL,BIG",
            "MW,0 X 1 1.5",
            "MR,X 1",
            "MW,0 A 4 -3e38 -3e38 -3e38 -3e38 -3e38 -3e38 -3e38 -3e38 22222",
            "MR,A 4",
            "PR,1",
            "VL,0",
            "HI,1 4",
        ] {
            self.ask(port, command);
        }
    }

    /// The program prints, to its end.
    fn print(&mut self) {
        for command in ["SO", "SL,T", "RN"] {
            self.ask(Port::Ip0, command);
        }
        let now = self.robot.now() + Duration::from_secs(9);
        self.robot.feed(now, Input::Tick);
    }
}

fn armed(fault: Fault) -> FaultReport {
    FaultReport {
        fault,
        armed: true,
        seen: 0,
        fired: 0,
        at: Vec::new(),
    }
}

fn day(faults: Vec<Fault>) -> Vec<FaultReport> {
    let mut config = Config::new(Dialect::Field);
    config.options.serial_pacing = false;
    config.options.sf_texts = SfTexts::Several;
    let mut robot = Controller::new(config, Vec::new()).unwrap();
    robot.put_file("T", PROGRAM).unwrap();
    robot.put_file("BIG", &b"REMARK\n".repeat(150)).unwrap();
    for name in 0..60 {
        robot.put_file(&format!("FILE{name}"), b"END\n").unwrap();
    }
    for port in Port::ALL {
        let peer = String::new();
        robot.feed(Time::ZERO, Input::Connected { port, peer });
    }
    // More than can be armed, none of which ever takes its turn.
    robot.endpoints.faults.reports = faults
        .into_iter()
        .map(|fault| {
            armed(Fault {
                probability: 0,
                ..fault
            })
        })
        .collect();
    robot.robot.arm.age(1e12);
    let mut day = Day { robot };
    day.print();
    for port in [Port::Host, Port::Ip0] {
        day.on(port);
    }
    for port in [Port::Com1, Port::Ip1, Port::Ip2, Port::Ip3] {
        day.hear(port, b"1,2\r".to_vec());
    }
    for row in crate::alarm::ALARMS {
        day.robot.robot.raise(*row, "x".repeat(60));
    }
    for port in [Port::Host, Port::Ip0] {
        for command in ["AC", "AH", "EU"] {
            day.ask(port, command);
        }
    }
    // What is never refused of itself is refused by another fault.
    let ng = parse("ng:times=0").unwrap();
    day.robot.endpoints.faults.reports.push(armed(ng));
    for port in [Port::Host, Port::Ip0] {
        for row in COMMANDS {
            day.ask(port, row.example);
        }
    }
    day.robot.endpoints.faults.reports
}

#[test]
fn what_is_armed_can_fire_and_what_cannot_is_refused() {
    let specs = specs();
    // The robot of the day has six axes, and ZC is served on a SCARA alone.
    let specs: Vec<_> = specs
        .into_iter()
        .filter(|spec| !spec.contains("command=ZC"))
        .collect();
    let read: Vec<Fault> = specs.iter().filter_map(|spec| parse(spec).ok()).collect();
    assert!(read.len() > 10_000, "{} of {}", read.len(), specs.len());
    let mut wrong = Vec::new();
    let mut counts = [0, 0];
    for report in day(read) {
        let probability = MILLION;
        let fault = Fault {
            probability,
            ..report.fault
        };
        let armed = fault.to_string().parse::<Fault>();
        counts[usize::from(armed.is_ok())] += 1;
        match armed {
            Ok(_) if report.seen == 0 => wrong.push(format!("{fault} is armed and finds nothing")),
            Err(error) if report.seen > 0 => {
                wrong.push(format!("{fault} finds {} and is refused: {error}", report.seen));
            }
            _ => {}
        }
    }
    assert!(counts.iter().all(|count| *count > 1_000), "{counts:?}");
    let total = wrong.len();
    wrong.truncate(40);
    assert!(wrong.is_empty(), "{total}:\n{}", wrong.join("\n"));
}

#[test]
fn a_refusal_says_what_to_leave_out_or_to_give() {
    for (spec, says) in [
        (
            "flipped-bit:way=in,command=SO",
            "cannot arm flipped-bit: no occasion matches command=SO (it waits for incoming bytes); leave out command, \
             or give way=out",
        ),
        (
            "ng:command=SU,block=1",
            "no occasion matches command=SU and block=1 (it waits for an incoming command or FL text); leave out \
             command, or leave out block",
        ),
        (
            "no-reply:command=SU,block=2",
            "leave out command, or leave out block",
        ),
        (
            "late-reply:command=SU,channel=IP1",
            "leave out command, or leave out channel",
        ),
        (
            "late-reply:channel=IP1,block=1",
            "leave out channel, or leave out block",
        ),
        ("flipped-bit:channel=IP3", "leave out channel, or give way=in"),
        ("parity-error:command=SU,block=1", "leave out command and block"),
        (
            "power-loss:channel=IP1,block=1",
            "leave out channel, or leave out block",
        ),
        ("key-turned:block=1", "no occasion matches command=RN and block=1"),
        (
            "duplicate-text:command=UL,block=1000000",
            "leave out command, or leave out block",
        ),
        (
            "ng:probability=0",
            "cannot arm ng: with this probability it never fires; give one from 0.000001 to 1",
        ),
        ("ng:probability=0.0000001", "it never fires"),
    ] {
        let error = spec.parse::<Fault>().unwrap_err().to_string();
        assert!(error.contains(says), "{spec}: {error}");
        // As it is read from a snapshot, which keeps what was armed once; to arm it anew is refused here too.
        let mut robot = robot();
        robot.feed(
            Time::ZERO,
            Input::from(FaultAction::Arm(Box::new(parse(spec).unwrap()))),
        );
        assert!(robot.faults().is_empty(), "{spec}");
    }
}
