//! Measures the time from starting `ts3100 serve` to the first correct SU answer, beside a bare echo server of
//! tokio started and queried in the same way in the same run.
//!
//! `cargo run --profile dist -p ts3100-benches --bin startup -- target/dist/ts3100 [ROUNDS]`
//!
//! Fails when the quickest start of the emulator takes more than [`MOST`] times as long as the quickest of the bare
//! server. The quickest are compared because a busy machine only ever adds to a time. Both are started from copies, as
//! installed programs are: a file that a linker wrote lies in small pieces in the cache of the system, and each piece is
//! mapped by itself.

use std::error::Error;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const ROUNDS: usize = 50;
const SU: &[u8] = b"\x02SU\r\x03";
const TIMEOUT: Duration = Duration::from_secs(10);
/// 1.3 to 1.7 was measured; on a busy machine even the quickest starts differ by half.
const MOST: f64 = 2.5;

/// What is started, how its port is found in its first line, and what its answer has to look like.
struct Subject {
    name: &'static str,
    program: PathBuf,
    arguments: &'static [&'static str],
    key: &'static str,
    answer: fn(&[u8]) -> bool,
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

fn port(line: &str, key: &str) -> Option<u16> {
    let after = &line[line.find(key)? + key.len()..];
    let digits: String = after.chars().take_while(char::is_ascii_digit).collect();
    digits.parse().ok()
}

fn once(subject: &Subject) -> Result<Duration, Box<dyn Error>> {
    let start = Instant::now();
    let mut child = Running(
        Command::new(&subject.program)
            .args(subject.arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|error| format!("{}: {error}", subject.program.display()))?,
    );
    let mut line = String::new();
    let stdout = child.0.stdout.take().ok_or("no standard output")?;
    BufReader::new(stdout).read_line(&mut line)?;
    let port = port(&line, subject.key).ok_or_else(|| format!("{}: no port in {line:?}", subject.name))?;
    let mut stream = TcpStream::connect(("127.0.0.1", port))?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(TIMEOUT))?;
    stream.write_all(SU)?;
    let mut answer = Vec::new();
    let mut buffer = [0; 512];
    while !(subject.answer)(&answer) {
        match stream.read(&mut buffer)? {
            0 => return Err(format!("{}: closed after {answer:02x?}", subject.name).into()),
            count => answer.extend_from_slice(&buffer[..count]),
        }
    }
    Ok(start.elapsed())
}

fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1_000.0
}

fn measure(subjects: &[Subject], rounds: usize) -> Result<(), Box<dyn Error>> {
    let mut times = vec![Vec::with_capacity(rounds); subjects.len()];
    // By turns, so that both see the same machine.
    for _ in 0..rounds {
        for (times, subject) in times.iter_mut().zip(subjects) {
            times.push(once(subject)?);
        }
    }
    let mut leasts = Vec::new();
    for (times, subject) in times.iter_mut().zip(subjects) {
        times.sort_unstable();
        let (median, least) = (milliseconds(times[rounds / 2]), milliseconds(times[0]));
        println!(
            "{:24} median {median:7.3} ms   least {least:7.3} ms   of {rounds}",
            subject.name
        );
        leasts.push(least);
    }
    if let [emulator, bare] = leasts[..] {
        let ratio = emulator / bare;
        println!("{:24} {ratio:.2}, at most {MOST}", "ratio of the least");
        if ratio > MOST {
            return Err(
                format!("cannot accept {ratio:.2} times the start of a bare server, at most {MOST}").into(),
            );
        }
    }
    Ok(())
}

/// A copy of a program in the folder of `neighbour`.
fn copied(program: &Path, neighbour: &Path) -> std::io::Result<PathBuf> {
    let name = program.file_stem().unwrap_or_default();
    let copy = neighbour.with_file_name(name).with_extension("copy");
    std::fs::copy(program, &copy)?;
    Ok(copy)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let binary = arguments.next().ok_or("usage: startup PATH_TO_ts3100 [ROUNDS]")?;
    let rounds = arguments.next().map_or(Ok(ROUNDS), |rounds| rounds.parse())?;
    let echo = std::env::current_exe()?.with_file_name("echo");
    if !echo.exists() {
        return Err(format!("{} is missing: build ts3100-benches whole", echo.display()).into());
    }
    let subjects = [
        Subject {
            name: "ts3100 serve, SU",
            program: copied(Path::new(&binary), &echo)?,
            arguments: &["serve", "--ports", "auto", "--ready-json"],
            key: "\"ip0\":",
            answer: |bytes| {
                bytes.starts_with(b"\x02FL,MODE:external(ethernet)/") && bytes.ends_with(b"\x1a\x03")
            },
        },
        Subject {
            name: "bare tokio echo",
            program: copied(&echo, &echo)?,
            arguments: &[],
            key: "\"port\":",
            answer: |bytes| bytes == SU,
        },
    ];
    measure(&subjects, rounds.max(1))
}
