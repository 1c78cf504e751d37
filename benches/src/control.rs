//! Benchmarks of the control interface: setting a fault, putting a snapshot back, and from starting `ts3100 serve` to
//! its ready line; each beside the cheapest a program of this kind can do, in the same run.

use crate::table::median;
use axum::routing::post;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use ts3100_emulator::control::ControlSettings;
use ts3100_emulator::embed::Emulator;

/// Makes this program the bare one: it listens, says where, and waits for its end.
pub const BARE: &str = "--bare-listener";
/// Calls in one go, one after the other on one connection.
const CALLS: u32 = 100;
/// How often each takes its turn in a round, of which the quickest counts: a busy machine only ever adds to a time.
const TURNS: u32 = 5;
/// Longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(10);
/// Longest answer that is read, in bytes.
const MAX_ANSWER: usize = 1024 * 1024;

/// How many times the time of a bare listener's start each may take, in the best of the rounds, before `--check` fails. A
/// restore has to stay far cheaper than what it spares a test: a start.
const RESTORE_TO_LISTENER: f64 = 0.1;
const START_TO_LISTENER: f64 = 2.5;

const PROGRAM: &str =
    "GLOBAL\nDIM A(100)\nN = 0\nEND\nPROGRAM PICK\nREMARK WAITS\nINPUT IP1, N\nDELAY 1\nEND\n";

/// Measured time of each round in microseconds, its reference, and the bound on their ratio where one is held.
struct Figure {
    name: &'static str,
    took: Vec<f64>,
    beside: &'static str,
    bare: Vec<f64>,
    most: Option<f64>,
}

impl Figure {
    /// The ratio in the best round: what is measured side by side sees the same machine, and a busy machine disturbs one
    /// round or the other.
    fn best(&self) -> f64 {
        let ratios = self.took.iter().zip(&self.bare).map(|(took, bare)| took / bare);
        ratios.fold(f64::INFINITY, f64::min)
    }
}

/// Listens on a free port, says which, and ends with its standard input.
pub fn bare_listener() -> Result<(), String> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.map_err(|error| error.to_string())?.block_on(async {
        let listener = tokio::net::TcpListener::bind(("127.0.0.1", 0)).await;
        let listener = listener.map_err(|error| error.to_string())?;
        let address = listener.local_addr().map_err(|error| error.to_string())?;
        println!("{{\"port\":{}}}", address.port());
        let _taken = listener.accept().await;
        Ok(())
    })
}

/// Measures and prints; what is beyond its margin.
pub fn print(rounds: usize) -> Result<Vec<String>, String> {
    let figures = measure(rounds).map_err(|error| format!("control interface: {error}"))?;
    println!(
        "\nControl interface: microseconds, medians of {rounds} rounds in turn; ratio of the best round.\n"
    );
    let mut missed = Vec::new();
    for figure in figures {
        let best = figure.best();
        let Figure {
            name,
            took,
            beside,
            bare,
            most,
        } = figure;
        let (took, bare) = (median(took), median(bare));
        println!("{name:38} {took:>9.1}   {beside:36} {bare:>9.1}   ratio {best:.2}");
        if let Some(most) = most.filter(|most| best > *most) {
            missed.push(format!(
                "{name}: {best:.2} times {beside}, at most {most} expected"
            ));
        }
    }
    Ok(missed)
}

fn measure(rounds: usize) -> Result<Vec<Figure>, Box<dyn std::error::Error>> {
    let robot = Emulator::builder()
        .control(ControlSettings::free())
        .file("PICK", PROGRAM)
        .select("PICK")
        .servo_on(true)
        .start()?;
    let folder = Folder::new()?;
    let file = folder.0.join("snapshot.json");
    robot.take_snapshot("clean")?;
    robot.write_snapshot(&file)?;
    let bare = bare_server()?;
    let control = robot.control().ok_or("it has no control interface")?;
    let [mut ours, mut theirs] = [Caller::dial(control)?, Caller::dial(bare)?];
    let binary = binary()?;
    let own = std::env::current_exe()?;
    let mut times: [Vec<f64>; 6] = Default::default();
    for _ in 0..rounds {
        let mut least = [f64::INFINITY; 6];
        for _ in 0..TURNS {
            let took = [
                each(CALLS, || theirs.call("/", "{}"))?,
                each(CALLS, || ours.call("/faults", r#"{"spec":"ng:command=FD,id=1"}"#))?,
                each(CALLS, || ours.call("/snapshots/clean/restore", "{}"))?,
                each(CALLS, || Ok(robot.load_snapshot(&file)?))?,
                started(&binary, &["serve", "--ports", "auto", "--ready-json"])?,
                started(&own, &[BARE])?,
            ];
            for (least, took) in least.iter_mut().zip(took) {
                *least = least.min(took);
            }
        }
        for (times, least) in times.iter_mut().zip(least) {
            times.push(least);
        }
    }
    let [cheapest, fault, restore, from_file, start, listener] = &times;
    let figure = |name, took: &Vec<f64>, beside, bare: &Vec<f64>, most| Figure {
        name,
        took: took.clone(),
        beside,
        bare: bare.clone(),
        most,
    };
    let call = "a call of a bare axum server";
    let bare = "a bare listener, until it is ready";
    Ok(vec![
        figure("a fault is set over HTTP", fault, call, cheapest, None),
        figure("a snapshot put back by name, HTTP", restore, call, cheapest, None),
        figure("the same", restore, bare, listener, Some(RESTORE_TO_LISTENER)),
        figure("the same from its file", from_file, bare, listener, None),
        figure(
            "ts3100 serve: start to ready line",
            start,
            bare,
            listener,
            Some(START_TO_LISTENER),
        ),
    ])
}

/// Microseconds of one of `count`.
fn each(
    count: u32,
    mut one: impl FnMut() -> Result<(), Box<dyn std::error::Error>>,
) -> Result<f64, Box<dyn std::error::Error>> {
    let began = Instant::now();
    for _ in 0..count {
        one()?;
    }
    Ok(began.elapsed().as_secs_f64() * 1e6 / f64::from(count))
}

/// An axum server with one call and nothing behind it, in a thread of its own as the emulator is.
fn bare_server() -> Result<SocketAddr, Box<dyn std::error::Error>> {
    let socket = TcpListener::bind(("127.0.0.1", 0))?;
    socket.set_nonblocking(true)?;
    let address = socket.local_addr()?;
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    std::thread::spawn(move || {
        runtime.block_on(async {
            let router = axum::Router::new().route("/", post(|| async { "{}" }));
            let listener = tokio::net::TcpListener::from_std(socket)?;
            axum::serve(listener, router).await
        })
    });
    Ok(address)
}

/// One who calls, on one connection.
struct Caller {
    stream: TcpStream,
    answer: Vec<u8>,
}

impl Caller {
    fn dial(address: SocketAddr) -> Result<Caller, Box<dyn std::error::Error>> {
        let stream = TcpStream::connect(address)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        Ok(Caller {
            stream,
            answer: Vec::new(),
        })
    }

    /// POST, and the whole answer read.
    fn call(&mut self, path: &str, body: &str) -> Result<(), Box<dyn std::error::Error>> {
        let length = body.len();
        let request = format!(
            "POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n\
             Content-Length: {length}\r\n\r\n{body}"
        );
        self.stream.write_all(request.as_bytes())?;
        self.answer.clear();
        let mut buffer = [0; 4096];
        loop {
            let count = self.stream.read(&mut buffer)?;
            if count == 0 || self.answer.len() > MAX_ANSWER {
                return Err(format!("{path}: no whole answer").into());
            }
            self.answer
                .extend_from_slice(buffer.get(..count).unwrap_or_default());
            if let Some(whole) = self.whole() {
                return if whole.starts_with("HTTP/1.1 200") {
                    Ok(())
                } else {
                    Err(format!("{path}: {whole}").into())
                };
            }
        }
    }

    /// The answer, once all of it is there.
    fn whole(&self) -> Option<&str> {
        let text = std::str::from_utf8(&self.answer).ok()?;
        let (head, body) = text.split_once("\r\n\r\n")?;
        let mut lengths = head.lines().filter_map(|line| {
            let (name, value) = line.split_once(':')?;
            name.eq_ignore_ascii_case("content-length")
                .then(|| value.trim().parse::<usize>().ok())?
        });
        (body.len() >= lengths.next()?).then_some(text)
    }
}

/// A process that is ended when it is dropped.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // Ending a process that has ended already is no loss.
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

/// Microseconds from the start of a process to its first line.
fn started(program: &Path, words: &[&str]) -> Result<f64, Box<dyn std::error::Error>> {
    let began = Instant::now();
    let mut child = Running(
        Command::new(program)
            .args(words)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?,
    );
    let mut line = String::new();
    let stdout = child.0.stdout.take().ok_or("no standard output")?;
    BufReader::new(stdout).read_line(&mut line)?;
    let took = began.elapsed().as_secs_f64() * 1e6;
    if line.contains("port") {
        Ok(took)
    } else {
        Err(format!("{}: no ready line, found {line:?}", program.display()).into())
    }
}

/// The emulator beside this program.
fn binary() -> Result<PathBuf, Box<dyn std::error::Error>> {
    let binary = std::env::current_exe()?.with_file_name("ts3100");
    if binary.exists() {
        Ok(binary)
    } else {
        let path = binary.display();
        Err(format!("{path} is missing: cargo build --profile dist -p ts3100-emulator").into())
    }
}

/// A directory removed on drop.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Result<Folder, std::io::Error> {
        let path = std::env::temp_dir().join(format!("ts3100-benches-{}", std::process::id()));
        std::fs::create_dir_all(&path)?;
        Ok(Folder(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // A leftover in the temporary directory is nobody's loss.
        drop(std::fs::remove_dir_all(&self.0));
    }
}
