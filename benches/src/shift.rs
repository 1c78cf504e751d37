//! A shift of eight hours of pick and place in `--time auto`: without sockets beside a count loop of the interpreter, and
//! over TCP beside an echo server, to which a host sends as many texts and then waits as long as it takes until time
//! jumps. Over TCP most of the time is this waiting.

use crate::contender::Contender;
use crate::server::{ECHO, Exchange, Server};
use crate::table::median;
use cpu_time::ProcessTime;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};
use ts3100_controller::{Config, Dialect};
use ts3100_emulator::embed::TimeMode;
use ts3100_emulator::headless::{self, RunEnd, RunEvent, RunRequest};

/// Length of the shift in seconds of virtual time.
const SHIFT: f64 = 28_800.0;
/// Over TCP a part of the shift is measured and counted so often: most of it is waiting.
const PARTS_OF_SHIFT: u32 = 8;
/// Most rounds over TCP, each of a few seconds.
const MOST_ROUNDS: usize = 3;

/// Most processor time without sockets, in that of the count loop. The aim, 0.6 s, is about 24 of them.
const MOST_ALONE: f64 = 10.0;
/// How long a cycle waits until time jumps: a millisecond, which the timer of the runtime makes up to two.
const SILENCE: Duration = Duration::from_millis(2);

/// One part, from the feeder to the fixture.
const PART: &str = "
MOVE FEEDER + POINT(0, 0, 60)
MOVES FEEDER WITH SPEED=20
DOUT(1)
DELAY 0.2
MOVES FEEDER + POINT(0, 0, 60)
MOVE FIXTURE + POINT(0, 0, 60)
MOVES FIXTURE WITH SPEED=20
DOUT(-1)
DELAY 0.15
MOVES FIXTURE + POINT(0, 0, 60)
WAIT MOTION >= 100
PARTS = PARTS + 1
";
const POINTS: &str = "
DATA
POINT FIXTURE=300,-260,120,0,0,0,0,0/
POINT FEEDER=380,180,100,0,0,0,0,0/
END
";

/// The whole shift in one program.
fn whole() -> String {
    format!(
        "PROGRAM SHIFT\nPARTS = 0\nSPEED = 60\nTIMER = 0.0\nAGAIN:{PART}IF TIMER < {SHIFT:.1} THEN GOTO AGAIN\n\
         PRINT TP, PARTS, CR\nEND{POINTS}"
    )
}

/// One part for each start.
fn single() -> String {
    format!("GLOBAL\nPARTS = 0\nEND\nPROGRAM PART\nSPEED = 60{PART}END{POINTS}")
}

/// What a host does for each part; the texts are those that the robot sends first.
const STATUS: Exchange = exchange("SF", b"\x02SF\r\x03", Some(b"\x02OK\r\x03"));
const WRITE: Exchange = exchange("MW", b"\x02MW,0 PARTS 0 5\r\x03", None);
const READ: Exchange = exchange("MR", b"\x02MR,PARTS 0\r\x03", Some(b"\x02OK\r\x03"));
const START: Exchange = exchange("RN", b"\x02RN\r\x03", None);
/// Each exchange of a part with the echo server; a text that confirms counts as half of one, and so does SP.
const ECHOES: u32 = 6;

const fn exchange(name: &'static str, request: &'static [u8], confirm: Option<&'static [u8]>) -> Exchange {
    Exchange {
        name,
        request,
        confirm,
        echoes: 1.0,
    }
}

/// Measures and prints; what is beyond its margin.
pub fn print(rounds: usize) -> Result<Vec<String>, String> {
    let mut missed = Vec::new();
    let (mut alone, mut counts, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    let mut parts = 0;
    for _ in 0..rounds {
        let count = Contender::Machine.run("count")?.seconds;
        let began = ProcessTime::now();
        parts = without_sockets()?;
        let seconds = began.elapsed().as_secs_f64();
        alone.push(seconds);
        counts.push(count);
        ratios.push(seconds / count);
    }
    println!(
        "\nA shift of eight hours of pick and place, {parts} parts, --time auto: seconds, medians; ratio of the best round\n"
    );
    let ratio = ratios.into_iter().fold(f64::INFINITY, f64::min);
    println!(
        "{:32} {:>8.2}   count loop       {:>8.2}   ratio {ratio:.2}",
        "without sockets, processor",
        median(alone),
        median(counts)
    );
    if ratio > MOST_ALONE {
        missed.push(format!(
            "a shift without sockets: {ratio:.1} times the count loop, at most {MOST_ALONE} expected"
        ));
    }
    over_tcp(rounds.min(MOST_ROUNDS), parts / PARTS_OF_SHIFT)
        .map_err(|error| format!("a shift over TCP: {error}"))?;
    Ok(missed)
}

/// Runs the shift in this process; the number of parts.
fn without_sockets() -> Result<u32, String> {
    let job = RunRequest {
        config: Config::new(Dialect::default()),
        name: "SHIFT".into(),
        source: whole().into_bytes(),
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
    let report = headless::run(job, &mut |_, happening| {
        if let RunEvent::Printed { bytes, .. } = happening {
            printed.extend_from_slice(bytes);
        }
    })
    .map_err(|error| error.to_string())?;
    let parts = String::from_utf8_lossy(&printed).trim().parse();
    match (report.end, parts) {
        (RunEnd::End, Ok(parts)) => Ok(parts),
        (end, _) => Err(format!("the shift ended with {end:?} and printed {printed:?}")),
    }
}

/// One round over TCP, in seconds for the whole shift.
struct Round {
    wall: f64,
    processor: f64,
    echo_wall: f64,
    echo_processor: f64,
    /// With a silence of a tenth of a millisecond, and the echo without any.
    quick_wall: f64,
    bare_wall: f64,
}

fn over_tcp(rounds: usize, parts: u32) -> Result<(), Box<dyn std::error::Error>> {
    let own = std::env::current_exe()?;
    let file = std::env::temp_dir().join(format!("ts3100-bench-{}", std::process::id()));
    std::fs::create_dir_all(&file)?;
    let measured = measure(&own, &file.join("part.scol"), rounds, parts);
    drop(std::fs::remove_dir_all(&file));
    let measured = measured?;
    let of = |figure: fn(&Round) -> f64| median(measured.iter().map(figure).collect());
    let (wall, processor) = (of(|round| round.wall), of(|round| round.processor));
    let (echo_wall, echo_processor) = (of(|round| round.echo_wall), of(|round| round.echo_processor));
    let best = |ratio: fn(&Round) -> f64| measured.iter().map(ratio).fold(f64::INFINITY, f64::min);
    let (silent, alone) = ("echo and silence", "echo alone      ");
    for (what, beside, took, bare, ratio) in [
        (
            "wall clock",
            silent,
            wall,
            echo_wall,
            best(|round| round.wall / round.echo_wall),
        ),
        (
            "processor",
            silent,
            processor,
            echo_processor,
            best(|round| round.processor / round.echo_processor),
        ),
        (
            "auto.silence=0.1ms",
            alone,
            of(|round| round.quick_wall),
            of(|round| round.bare_wall),
            best(|round| round.quick_wall / round.bare_wall),
        ),
    ] {
        println!("over TCP, {what:22} {took:>8.2}   {beside} {bare:>8.2}   ratio {ratio:.2}");
    }
    Ok(())
}

fn measure(
    own: &Path,
    file: &Path,
    rounds: usize,
    parts: u32,
) -> Result<Vec<Round>, Box<dyn std::error::Error>> {
    std::fs::write(file, single())?;
    let serve = [
        "serve",
        "--time",
        "auto",
        "--ports",
        "auto",
        "--ready-json",
        "--control",
        "off",
    ];
    let file = file
        .to_str()
        .ok_or("a temporary directory whose name is no text")?;
    let program = ["--servo-on", "--load", file, "--select", "PART"];
    let words = [&serve[..], &program].concat();
    let mut robot = Server::start(&own.with_file_name("ts3100"), &words, "\"ip0\":", 1)?;
    let quick = [&words[..], &["--set", "auto.silence=0.1ms"]].concat();
    let mut quick = Server::start(&own.with_file_name("ts3100"), &quick, "\"ip0\":", 1)?;
    let mut echo = Server::start(own, &[ECHO, "8"], "\"port\":", 1)?;
    // The first part begins elsewhere.
    part(&mut robot)?;
    part(&mut quick)?;
    let scale = f64::from(PARTS_OF_SHIFT);
    let mut measured = Vec::new();
    for _ in 0..rounds {
        let lap = |server: &mut Server, one: fn(&mut Server) -> Result<(), Box<dyn std::error::Error>>| {
            let (before, began) = (server.processor()?, Instant::now());
            for _ in 0..parts {
                one(server)?;
            }
            let wall = began.elapsed().as_secs_f64();
            let processor = (server.processor()? - before).as_secs_f64();
            Ok::<_, Box<dyn std::error::Error>>((wall * scale, processor * scale))
        };
        let (wall, processor) = lap(&mut robot, part)?;
        let (echo_wall, echo_processor) = lap(&mut echo, |echo| {
            for _ in 0..ECHOES {
                echo.exchange(START)?;
            }
            std::thread::sleep(SILENCE);
            Ok(())
        })?;
        let (quick_wall, _) = lap(&mut quick, part)?;
        let (bare_wall, _) = lap(&mut echo, |echo| {
            for _ in 0..ECHOES {
                echo.exchange(START)?;
            }
            Ok(())
        })?;
        measured.push(Round {
            quick_wall,
            bare_wall,
            wall,
            processor,
            echo_wall,
            echo_processor,
        });
    }
    Ok(measured)
}

/// What a cell computer does for a part: it looks whether the robot is ready, writes a variable, reads it back, starts
/// the program and waits for its end.
fn part(robot: &mut Server) -> Result<(), Box<dyn std::error::Error>> {
    robot.exchange(STATUS)?;
    robot.exchange(WRITE)?;
    robot.exchange(READ)?;
    robot.send(START.request)?;
    // A host that is late reads both at once.
    robot.wait_for(b"\x02OK\r\x03\x02SP\r\x03")
}
