//! What the tests of the language share: fixtures, their directives, and a world that plays a program to a
//! transcript, one line for each request.

#![expect(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot read its fixtures fails"
)]

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use scol_mini::{
    Answer, Arm, Inputs, LanguageOptions, Machine, Memory, Number, Path as Way, Pause, Position, Program,
    Request, compile,
};

/// The folder of fixtures of this name.
pub fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../fixtures/scol")
        .join(name)
}

/// The programs of a folder in the order of their names; every one states its origin.
pub fn programs(name: &str) -> Vec<(PathBuf, String)> {
    let mut list: Vec<(PathBuf, String)> = std::fs::read_dir(folder(name))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "scol"))
        .map(|path| (path.clone(), std::fs::read_to_string(path).unwrap()))
        .collect();
    list.sort();
    for (path, source) in &list {
        assert!(
            source.starts_with("' origin: "),
            "{} does not state its origin",
            path.display()
        );
    }
    assert!(!list.is_empty());
    list
}

/// The options a fixture asks for.
pub fn options(source: &str) -> LanguageOptions {
    let arm = if source.contains("\n' arm: scara") {
        Arm::Scara
    } else {
        Arm::SixAxis
    };
    LanguageOptions {
        arm,
        ..Default::default()
    }
}

/// The answers to INPUT a fixture gives; `!` at the end cancels.
pub fn answers(source: &str) -> VecDeque<Answer> {
    source
        .lines()
        .filter_map(|line| line.strip_prefix("' input: "))
        .map(answer)
        .collect()
}

pub fn answer(text: &str) -> Answer {
    let number = |text: &str| match text.trim().parse::<i32>() {
        Ok(value) => Number::Integer(value),
        Err(_) => Number::Real(text.trim().parse().unwrap()),
    };
    let list = text.trim_end_matches('!');
    let numbers = list
        .split(',')
        .filter(|field| !field.trim().is_empty())
        .map(number)
        .collect();
    if text.ends_with('!') {
        Answer::Cancelled(numbers)
    } else {
        Answer::Values(numbers)
    }
}

pub struct World;

impl Inputs for World {
    fn din(&self, line: u16) -> bool {
        line == 1
    }
    fn dout(&self, _: u16) -> bool {
        false
    }
    fn motion_percent(&self) -> f64 {
        100.0
    }
    fn here(&self) -> Position {
        Position::default()
    }
    fn mode(&self) -> i32 {
        0
    }
}

pub fn compiled(source: &str) -> Arc<Program> {
    let compilation = compile(source, &options(source));
    compilation.program.unwrap_or_else(|| {
        panic!(
            "{}",
            compilation
                .diagnostics
                .iter()
                .map(|d| d.render(source, "F"))
                .collect::<String>()
        )
    })
}

/// Plays a program until it ends, waits or fails, at most `fuel` statements.
pub fn play(program: &Arc<Program>, answers: VecDeque<Answer>, fuel: u32) -> Vec<String> {
    let mut memory = Memory::new(program);
    play_on(program, &mut memory, answers, fuel)
}

pub fn play_on(
    program: &Arc<Program>,
    memory: &mut Memory,
    mut answers: VecDeque<Answer>,
    mut fuel: u32,
) -> Vec<String> {
    let mut machine = Machine::main(Arc::clone(program));
    let mut lines = Vec::new();
    loop {
        let request = match machine.run(memory, &World, &mut fuel) {
            Pause::Request(request) => request,
            // The outside looks, and the program goes on.
            Pause::Fuel if fuel > 0 => continue,
            over => {
                lines.push(match over {
                    Pause::Fault(fault) => format!("FAULT {:?} line {}", fault.kind, fault.line),
                    Pause::Waiting => format!("WAITING line {}", machine.line()),
                    Pause::Fuel => "FUEL".into(),
                    _ => "ENDED".into(),
                });
                return lines;
            }
        };
        lines.push(describe(&request));
        let answer = match request {
            Request::Task { .. } => Answer::Values(vec![Number::Integer(2)]),
            Request::Input { .. } => match answers.pop_front() {
                Some(answer) => answer,
                None => {
                    lines.push("NO INPUT".into());
                    return lines;
                }
            },
            _ => Answer::Done,
        };
        if let Err(fault) = machine.answer(memory, answer) {
            lines.push(format!("FAULT {:?} line {}", fault.kind, fault.line));
            return lines;
        }
    }
}

pub fn describe(request: &Request) -> String {
    match request {
        Request::Print { channel, data, .. } => {
            format!("PRINT {channel:?} {:?}", String::from_utf8_lossy(data))
        }
        Request::BufferReset { channel } => format!("RESET {channel:?}"),
        Request::Input { channel, expected } => format!("INPUT {channel:?} {expected}"),
        Request::Delay { seconds } => format!("DELAY {seconds}"),
        Request::Outputs(list) => format!("OUTPUTS {list:?}"),
        Request::Stop => "STOP".into(),
        Request::Task { program } => format!("TASK {program}"),
        Request::Move(motion) => {
            let speed = motion.conditions.speed;
            match &motion.path {
                Way::Ptp(to) => format!("MOVE Ptp {} speed {speed}", place(to)),
                Way::Line(to) => format!("MOVE Line {} speed {speed}", place(to)),
                Way::Arc { via, .. } => format!("MOVE Arc {} speed {speed}", place(via)),
                other => format!("MOVE {other:?} speed {speed}"),
            }
        }
        other => format!("{other:?}"),
    }
}

fn place(position: &Position) -> String {
    let work = position
        .work
        .as_ref()
        .and_then(|work| work.name.as_deref())
        .unwrap_or("-");
    format!(
        "{:?}/{:05} work {work}",
        position.coords,
        position.config.number()
    )
}
