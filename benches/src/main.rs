//! Runs the benchmarks and prints what they measured. With `--check` it fails when the interpreter has become slow
//! beside Lua or CPython. Who takes part is in `contender`, the tables are in `table`, everything but statements
//! per second is in `whole`.

mod contender;
mod control;
mod fleet;
mod requests;
mod server;
mod shift;
mod table;
mod transfers;
mod whole;

use contender::Contender;
use std::process::ExitCode;
use table::Row;

/// The loops; each stands in `programs` as `.scol`, `.lua` and `.py`.
const LOOPS: [&str; 5] = ["count", "reals", "arrays", "calls", "jumps"];
/// How often each contender runs each loop, unless `--rounds` says otherwise.
const ROUNDS: usize = 9;

fn main() -> ExitCode {
    let (mut check, mut rounds, mut only) = (false, ROUNDS, None);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut count = || arguments.next().and_then(|count| count.parse().ok());
        match argument.as_str() {
            "--check" => check = true,
            "--shift" => only = Some(Only::Shift),
            "--fleet" => only = Some(Only::Fleet),
            "--transfers" => only = Some(Only::Transfers),
            // cargo bench passes it.
            "--bench" => {}
            control::BARE => {
                return control::bare_listener().map_or_else(|error| failed(&error), |()| ExitCode::SUCCESS);
            }
            server::ECHO => {
                let Some(length) = count() else {
                    return failed("--echo: expected the length of a reply");
                };
                return server::echo(length).map_or_else(|error| failed(&error), |()| ExitCode::SUCCESS);
            }
            transfers::TERMINAL | transfers::TALK => {
                let Some(number) = count() else {
                    return failed("expected a number");
                };
                let served = match argument.as_str() {
                    transfers::TALK => transfers::talk(number),
                    _ => transfers::terminal_echo(number),
                };
                return served.map_or_else(|error| failed(&error.to_string()), |()| ExitCode::SUCCESS);
            }
            "--rounds" => match count().filter(|count| *count > 0) {
                Some(count) => rounds = count,
                None => return failed("--rounds: expected a number from 1 up"),
            },
            other => {
                return failed(&format!(
                    "expected --check, --shift, --fleet, --transfers or --rounds N, found {other}"
                ));
            }
        }
    }
    pin();
    match run(check, rounds, only) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => failed(&message),
    }
}

fn failed(message: &str) -> ExitCode {
    eprintln!("benches: {message}");
    ExitCode::FAILURE
}

/// A part that runs alone.
#[derive(Clone, Copy)]
enum Only {
    Shift,
    Fleet,
    Transfers,
}

/// Keeps this program and its children on one core: the cores of a busy machine differ by more than the margins.
fn pin() {
    #[cfg(target_os = "linux")]
    {
        use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
        // A system that does not allow it has no fewer figures, only more noise in them.
        let Ok(allowed) = sched_getaffinity(None) else {
            return;
        };
        let mut one = CpuSet::new();
        if let Some(last) = (0..CpuSet::MAX_CPU).rev().find(|core| allowed.is_set(*core)) {
            one.set(last);
            let _refused = sched_setaffinity(None, &one);
        }
    }
}

/// Everything, or only a part; `false` when a check was missed.
fn run(check: bool, rounds: usize, only: Option<Only>) -> Result<bool, String> {
    if cfg!(debug_assertions) {
        return Err("measure with --release".into());
    }
    if let Some(only) = only {
        let slow = match only {
            Only::Shift => shift::print(rounds)?,
            Only::Fleet => fleet::print(rounds)?,
            Only::Transfers => transfers::print(rounds)?,
        };
        tell(check, &slow);
        return Ok(!check || slow.is_empty());
    }
    let mut contenders = Vec::new();
    for contender in Contender::ALL {
        match contender.missing() {
            None => contenders.push(contender),
            Some(program) if check => return Err(format!("{program} is missing, and --check needs it")),
            Some(program) => println!("{program} is missing: left out"),
        }
    }
    println!(
        "Statements per second in millions, medians of {rounds} rounds in turn; ratios to the machine of each round.\n"
    );
    let rows = LOOPS
        .iter()
        .map(|name| Row::measure(name, &contenders, rounds))
        .collect::<Result<Vec<Row>, String>>()?;
    table::print(&rows, &contenders);
    let missed = table::missed(&rows);
    tell(check, &missed);
    println!();
    whole::print(rounds)?;
    let mut slow = control::print(rounds)?;
    slow.extend(requests::print(rounds)?);
    slow.extend(transfers::print(rounds)?);
    slow.extend(fleet::print(rounds)?);
    slow.extend(shift::print(rounds)?);
    tell(check, &slow);
    Ok(!check || missed.is_empty() && slow.is_empty())
}

fn tell(check: bool, missed: &[String]) {
    for line in missed {
        println!("{}: {line}", if check { "MISSED" } else { "beyond the margin" });
    }
}
