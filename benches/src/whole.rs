//! Benchmarks of the whole: a snapshot of a controller under way, the reply to SU, the front end.

use crate::table::median;
use crate::{LOOPS, contender};
use cpu_time::ProcessTime;
use scol_mini::LanguageOptions;
use std::hint::black_box;

use ts3100_controller::output::Output;
use ts3100_controller::port::Port;
use ts3100_controller::{Config, Controller, Dialect, Input, PanelAction, Time};

/// What is timed is done so often in one go, because one is too short for a clock.
const BATCH: u32 = 1_000;
/// Copies of the loops that the front end reads in one go.
const COPIES: u32 = 200;

/// Measures and prints.
pub fn print(rounds: usize) -> Result<(), String> {
    let controller = running()?;
    let taken = micros(rounds, BATCH, || {
        black_box(black_box(&controller).clone());
    });
    println!("snapshot of a controller under way     {taken:>10.2} µs");
    let snapshot = controller.clone();
    let mut restored = controller.clone();
    let taken = micros(rounds, BATCH, || restored.clone_from(black_box(&snapshot)));
    println!("the same put back                      {taken:>10.2} µs");
    let mut asked = idle()?;
    let mut now = asked.now();
    let mut replies = 0_u32;
    let alone = micros(rounds, BATCH, || {
        // A host waits 50 ms after each exchange.
        now = Time::from_micros(now.as_micros() + 60_000);
        replies += u32::from(su(&mut asked, now));
    });
    if replies != BATCH * u32::try_from(rounds).unwrap_or(u32::MAX) {
        return Err(format!("only {replies} of the SU texts were replied to"));
    }
    println!("SU: text in, reply out                 {alone:>10.2} µs");
    let sources = LOOPS.map(contender::source);
    let sources = sources.into_iter().collect::<Result<Vec<_>, _>>()?;
    let bytes: usize = sources.iter().map(String::len).sum();
    let options = LanguageOptions::default();
    let taken = micros(rounds, COPIES, || {
        for source in &sources {
            black_box(scol_mini::compile(black_box(source), &options));
        }
    });
    println!(
        "front end, source to program           {:>10.2} MB/s",
        bytes as f64 / taken
    );
    Ok(())
}

/// Microseconds of one, the median of `rounds` batches.
fn micros(rounds: usize, batch: u32, mut one: impl FnMut()) -> f64 {
    let batches = (0..rounds).map(|_| {
        let began = ProcessTime::now();
        (0..batch).for_each(|_| one());
        began.elapsed().as_secs_f64() * 1e6 / f64::from(batch)
    });
    median(batches.collect())
}

fn idle() -> Result<Controller, String> {
    let mut controller =
        Controller::new(Config::new(Dialect::default()), Vec::new()).map_err(|error| error.to_string())?;
    let peer = "bench".to_string();
    controller.feed(
        Time::ZERO,
        Input::Connected {
            port: Port::Ip0,
            peer,
        },
    );
    controller.feed(Time::ZERO, Input::by_hand(PanelAction::Servo(true)));
    Ok(controller)
}

/// In the middle of a program with arrays.
fn running() -> Result<Controller, String> {
    let mut controller = idle()?;
    let source = contender::source("arrays")?;
    controller
        .put_file("ARRAYS", source.as_bytes())
        .map_err(|error| error.to_string())?;
    controller
        .select(Time::ZERO, "ARRAYS")
        .map_err(|error| error.to_string())?;
    controller.feed(Time::ZERO, Input::by_hand(PanelAction::Start));
    controller.feed(Time::from_millis(1_000), Input::Tick);
    if controller.program_runs() {
        Ok(controller)
    } else {
        Err("the program was not started".into())
    }
}

/// Sends SU; whether something came back.
fn su(controller: &mut Controller, now: Time) -> bool {
    let bytes = b"SU,STATUS\r\x03".to_vec();
    let outputs = controller.feed(now, Input::received(Port::Ip0, bytes));
    let replied = outputs.iter().any(|output| matches!(output, Output::Send { .. }));
    controller.feed(now, Input::received(Port::Ip0, b"OK\r\x03".as_slice()));
    replied
}
