//! Runs the benchmarks and prints what they measured. With `--check` it fails when one of the few figures that are held
//! (`README.md`) misses its bound. Who takes part is in `contender`, statements per second are in `table`.

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
/// How often `--check` measures a part until it keeps its bounds. A busy machine only ever adds to a figure, so the best
/// of a few attempts is the nearest to the truth.
const ATTEMPTS: u32 = 3;

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
        return Err("measure with --profile dist".into());
    }
    let attempts = if check { ATTEMPTS } else { 1 };
    match only {
        Some(Only::Shift) => return held(attempts, check, || shift::print(rounds)),
        Some(Only::Fleet) => return held(attempts, check, || fleet::print(rounds)),
        Some(Only::Transfers) => return transfers::print(rounds).map(|()| true),
        None => {}
    }
    let mut contenders = Vec::new();
    for contender in Contender::ALL {
        match contender.missing() {
            None => contenders.push(contender),
            Some(program) if check => return Err(format!("{program} is missing, and --check needs it")),
            Some(program) => println!("{program} is missing: left out"),
        }
    }
    let statements = || {
        println!(
            "Statements per second in millions, medians of {rounds} rounds in turn; ratios to the machine of each round.\n"
        );
        let rows = LOOPS
            .iter()
            .map(|name| Row::measure(name, &contenders, rounds))
            .collect::<Result<Vec<Row>, String>>()?;
        table::print(&rows, &contenders);
        Ok(table::missed(&rows))
    };
    let mut good = held(attempts, check, statements)?;
    println!();
    whole::print(rounds)?;
    good &= held(attempts, check, || control::print(rounds))?;
    good &= held(attempts, check, || requests::print(rounds))?;
    transfers::print(rounds)?;
    good &= held(attempts, check, || fleet::print(rounds))?;
    good &= held(attempts, check, || shift::print(rounds))?;
    Ok(good)
}

/// Measures a part until it keeps its bounds, at most `attempts` times; `false` when `--check` has to fail.
fn held(
    attempts: u32,
    check: bool,
    measure: impl Fn() -> Result<Vec<String>, String>,
) -> Result<bool, String> {
    for attempt in 1..=attempts {
        let missed = measure()?;
        let word = match (check, attempt < attempts) {
            (false, _) => "beyond the bound",
            (true, true) => "measured again",
            (true, false) => "MISSED",
        };
        missed.iter().for_each(|line| println!("{word}: {line}"));
        if missed.is_empty() {
            return Ok(true);
        }
    }
    Ok(!check)
}
