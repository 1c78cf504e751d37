//! Checks that a panic in a program of the profile `release` can be traced: with `RUST_BACKTRACE=1` it names our
//! functions, and it ends the process. Without symbols or unwind tables it names none.
//!
//! `cargo run --release -p ts3100-tests --bin backtrace`
//!
//! The panic is in a caller's function that the emulator calls, so no panic is built into the emulator.

use std::collections::BTreeMap;
use std::error::Error;
use std::process::Command;
use std::time::Duration;
use ts3100_controller::{Config, Dialect};
use ts3100_emulator::clock::TimeMode;
use ts3100_emulator::headless::{self, RunRequest};

/// With this argument the program panics; without it, it starts itself again with it.
const PANIC: &str = "panic";
/// The call that leads to the panic, and a crate between them.
const NAMED: [&str; 2] = ["ts3100_emulator::headless::run", "ts3100_driver::"];

#[expect(clippy::panic, reason = "what is checked")]
fn run_and_panic() -> Result<(), Box<dyn Error>> {
    let request = RunRequest {
        config: Config::new(Dialect::default()),
        name: "TEST".to_owned(),
        source: b"PROGRAM TEST\rPRINT \"HELLO\", CR\rEND\r".to_vec(),
        records: BTreeMap::new(),
        lines_on: Vec::new(),
        scenario: None,
        call: None,
        trace: false,
        profile: false,
        record_lines: false,
        time: TimeMode::Auto,
        max_time: Duration::from_secs(10),
    };
    headless::run(request, &mut |_, event| panic!("at {event:?}"))?;
    Err("cannot check a backtrace: the program printed nothing".into())
}

fn main() -> Result<(), Box<dyn Error>> {
    if std::env::args().nth(1).as_deref() == Some(PANIC) {
        return run_and_panic();
    }
    let mut program = Command::new(std::env::current_exe()?);
    let ended = program.arg(PANIC).env("RUST_BACKTRACE", "1").output()?;
    let trace = String::from_utf8_lossy(&ended.stderr);
    println!("{trace}");
    for name in NAMED {
        if !trace.contains(name) {
            return Err(format!("cannot find {name} in the backtrace").into());
        }
    }
    // A signal: an exit code would say that only a thread has ended.
    match ended.status.code() {
        None => Ok(()),
        Some(code) => {
            Err(format!("expected the end by a signal after a panic, found exit code {code}").into())
        }
    }
}
