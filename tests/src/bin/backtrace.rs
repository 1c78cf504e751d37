//! Checks that a panic in a program of the profile `release` can be traced: with `RUST_BACKTRACE=1` it names our
//! functions, and it ends the process. Without symbols or unwind tables it names none.
//!
//! `cargo run --release -p ts3100-tests --bin backtrace`
//!
//! The panic is in a caller's function that the emulator calls, so no panic is built into the emulator.

use std::error::Error;
use std::process::Command;
use ts3100_controller::{Config, Controller, Dialect, Input, Output, PanelAction, Time};
use ts3100_driver::seat::{Effects, Seat, Side};

/// With this argument the program panics; without it, it starts itself again with it.
const PANIC: &str = "panic";
/// The call that leads to the panic, and a function of a crate between them.
const NAMED: [&str; 2] = ["run_and_panic", "ts3100_driver::seat::Seat::feed"];

/// A caller that panics at the first output.
struct Caller;

impl Effects for Caller {
    #[expect(clippy::panic, reason = "what is checked")]
    fn perform(&mut self, _at: Time, output: Output, _controller: &Controller) -> Vec<Input> {
        panic!("at {output:?}")
    }
}

fn run_and_panic() -> Result<(), Box<dyn Error>> {
    let controller = Controller::new(Config::new(Dialect::default()), Vec::new())?;
    let servo = Input::by_hand(PanelAction::Servo(true));
    Seat::new(controller).feed(Time::ZERO, servo, Side::Host, &mut Caller)?;
    Err("cannot check a backtrace: nothing was put out".into())
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
