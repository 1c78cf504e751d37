//! The contenders: the machine alone, the whole controller, Lua and CPython. Each runs a loop once and says how long
//! it took, without start-up, and what came out.

use cpu_time::ProcessTime;
use scol_mini::{Answer, Inputs, LanguageOptions, Machine, Memory, Pause, Position, Request, compile};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;
use ts3100_controller::{Config, Dialect};
use ts3100_emulator::clock::TimeMode;
use ts3100_emulator::headless::{self, RunEnd, RunEvent, RunRequest};

/// Who runs a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Contender {
    /// `scol_mini::Machine` alone.
    Machine,
    /// A whole controller, as `ts3100 run` has it.
    Controller,
    /// The process `lua5.4`.
    Lua,
    /// The process `python3`.
    Python,
}

/// One run of a loop.
#[derive(Debug, Clone, Copy)]
pub struct Lap {
    /// How long the processor worked on it: other programs on a busy computer do not count.
    pub seconds: f64,
    /// The sum it came to.
    pub result: f64,
}

impl Contender {
    /// All of them, in the order of the tables.
    pub const ALL: [Contender; 4] = [
        Contender::Machine,
        Contender::Controller,
        Contender::Lua,
        Contender::Python,
    ];

    /// What the tables call it.
    pub fn name(self) -> &'static str {
        match self {
            Contender::Machine => "machine",
            Contender::Controller => "controller",
            Contender::Lua => "lua5.4",
            Contender::Python => "python3",
        }
    }

    fn command(self) -> Option<(&'static str, &'static str)> {
        match self {
            Contender::Machine | Contender::Controller => None,
            Contender::Lua => Some(("lua5.4", "lua")),
            Contender::Python => Some(("python3", "py")),
        }
    }

    /// The program it needs and this computer does not have.
    pub fn missing(self) -> Option<&'static str> {
        let (program, _) = self.command()?;
        let asked = Command::new(program)
            .arg(if program == "lua5.4" { "-v" } else { "--version" })
            .output();
        (!asked.is_ok_and(|output| output.status.success())).then_some(program)
    }

    /// Runs a loop once.
    pub fn run(self, name: &str) -> Result<Lap, String> {
        match self {
            Contender::Machine => machine(&source(name)?).map(|(lap, _)| lap),
            Contender::Controller => controller(name, &source(name)?),
            Contender::Lua | Contender::Python => {
                let (program, extension) = self.command().unwrap_or_default();
                script(program, &folder().join(format!("{name}.{extension}")))
            }
        }
    }
}

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("programs")
}

/// The SCOL program of a loop.
pub fn source(name: &str) -> Result<String, String> {
    let path = folder().join(format!("{name}.scol"));
    std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))
}

/// How many statements the SCOL program of a loop executes.
pub fn statements(name: &str) -> Result<u32, String> {
    machine(&source(name)?).map(|(_, statements)| statements)
}

fn machine(source: &str) -> Result<(Lap, u32), String> {
    let compilation = compile(source, &LanguageOptions::default());
    let program = compilation
        .program
        .ok_or_else(|| format!("the program does not compile: {:?}", compilation.diagnostics))?;
    let mut memory = Memory::new(&program);
    let mut machine = Machine::main(program);
    let mut fuel = u32::MAX;
    let mut printed = Vec::new();
    let began = ProcessTime::now();
    loop {
        match machine.run(&mut memory, &Still, &mut fuel) {
            Pause::Request(Request::Print { data, .. }) => {
                printed = data;
                let answered = machine.answer(&mut memory, Answer::Done);
                answered.map_err(|fault| fault.to_string())?;
            }
            Pause::Ended => break,
            other => return Err(format!("the machine paused with {other:?}")),
        }
    }
    let seconds = began.elapsed().as_secs_f64();
    let result = number(&String::from_utf8_lossy(&printed))?;
    Ok((Lap { seconds, result }, u32::MAX - fuel))
}

fn controller(name: &str, source: &str) -> Result<Lap, String> {
    let job = RunRequest {
        config: Config::new(Dialect::default()),
        name: name.to_uppercase(),
        source: source.as_bytes().to_vec(),
        records: BTreeMap::new(),
        lines_on: Vec::new(),
        scenario: None,
        call: None,
        position: None,
        trace: false,
        profile: false,
        record_lines: false,
        time: TimeMode::Auto,
        max_time: Duration::from_secs(365 * 24 * 3_600),
    };
    let mut printed = Vec::new();
    let began = ProcessTime::now();
    let report = headless::run(job, &mut |_, happening| {
        if let RunEvent::Printed { bytes, .. } = happening {
            printed.extend_from_slice(bytes);
        }
    })
    .map_err(|error| error.to_string())?;
    let seconds = began.elapsed().as_secs_f64();
    match report.end {
        RunEnd::End => Ok(Lap {
            seconds,
            result: number(&String::from_utf8_lossy(&printed))?,
        }),
        other => Err(format!("the controller ended with {other:?}")),
    }
}

/// A script prints its seconds and its result.
fn script(program: &str, path: &std::path::Path) -> Result<Lap, String> {
    let output = Command::new(program)
        .arg(path)
        .output()
        .map_err(|error| format!("{program}: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let mut fields = text.split_whitespace();
    match (fields.next(), fields.next()) {
        (Some(seconds), Some(result)) if output.status.success() => Ok(Lap {
            seconds: number(seconds)?,
            result: number(result)?,
        }),
        _ => Err(format!(
            "{program} {}: expected seconds and a result, found {text:?} {}",
            path.display(),
            String::from_utf8_lossy(&output.stderr)
        )),
    }
}

fn number(text: &str) -> Result<f64, String> {
    text.trim()
        .parse()
        .map_err(|_| format!("expected a number, found {text:?}"))
}

/// A world in which nothing happens.
struct Still;

impl Inputs for Still {
    fn din(&self, _: u16) -> bool {
        false
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
