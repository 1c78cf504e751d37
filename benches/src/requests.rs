//! Processor time and delay of a request over TCP, beside an echo server of the same shape in the same run. Both are
//! processes of their own; run it with `taskset -c N`, so that servers and client share one core.

use crate::table::median;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Makes this program the echo server: the next word is the length of its replies.
pub const ECHO: &str = "--echo";
/// Exchanges in one go.
const EXCHANGES: usize = 4_000;
/// Exchanges before the first that is measured.
const WARM_UP: usize = 500;
/// Longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(10);
/// End of every text.
const ETX: u8 = 3;

/// What a host sends.
#[derive(Clone, Copy)]
struct Exchange {
    name: &'static str,
    request: &'static [u8],
    /// Sent after the reply; nothing answers it.
    confirm: Option<&'static [u8]>,
    /// Exchanges of the echo server that count as one of these.
    echoes: f64,
}

const SU: Exchange = Exchange {
    name: "SU",
    request: b"\x02SU\r\x03",
    confirm: None,
    echoes: 1.0,
};
const SF: Exchange = Exchange {
    name: "SF with its OK",
    request: b"\x02SF\r\x03",
    confirm: Some(b"\x02OK\r\x03"),
    echoes: 2.0,
};

/// What one go came to, in microseconds.
struct Lap {
    /// Processor time of the server for each exchange.
    processor: f64,
    p50: f64,
    p99: f64,
}

/// Answers each text with `length` bytes, in one task for each connection.
pub fn echo(length: usize) -> Result<(), String> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.map_err(|error| error.to_string())?.block_on(async {
        let listener = tokio::net::TcpListener::bind(("127.0.0.1", 0)).await;
        let listener = listener.map_err(|error| error.to_string())?;
        let address = listener.local_addr().map_err(|error| error.to_string())?;
        println!("{{\"port\":{}}}", address.port());
        loop {
            let (stream, _) = listener.accept().await.map_err(|error| error.to_string())?;
            tokio::spawn(async move { drop(answer(&stream, length).await) });
        }
    })
}

async fn answer(stream: &tokio::net::TcpStream, length: usize) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    let mut reply = vec![b'.'; length];
    if let Some(last) = reply.last_mut() {
        *last = ETX;
    }
    let mut buffer = [0; 4_096];
    loop {
        stream.readable().await?;
        match stream.try_read(&mut buffer) {
            Ok(0) => return Ok(()),
            Ok(_) => {
                // A socket that has room for the next reply: the client reads each before it asks again.
                stream.try_write(&reply)?;
            }
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {}
            Err(error) => return Err(error),
        }
    }
}

/// A server and a connection to it.
struct Server {
    child: Child,
    streams: Vec<TcpStream>,
}

impl Drop for Server {
    fn drop(&mut self) {
        // Ending a process that has ended already is no loss.
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

impl Server {
    fn start(
        program: &PathBuf,
        words: &[&str],
        key: &str,
        connections: usize,
    ) -> Result<Server, Box<dyn std::error::Error>> {
        let mut command = Command::new(program);
        command.args(words).stdin(Stdio::null()).stderr(Stdio::null());
        let mut child = command.stdout(Stdio::piped()).spawn()?;
        let mut line = String::new();
        let stdout = child.stdout.take().ok_or("no standard output")?;
        BufReader::new(stdout).read_line(&mut line)?;
        let mut server = Server {
            child,
            streams: Vec::new(),
        };
        let (_, after) = line
            .split_once(key)
            .ok_or_else(|| format!("no {key} in {line:?}"))?;
        let digits: String = after.chars().take_while(char::is_ascii_digit).collect();
        for _ in 0..connections {
            let stream = TcpStream::connect(("127.0.0.1", digits.parse::<u16>()?))?;
            stream.set_nodelay(true)?;
            stream.set_read_timeout(Some(PATIENCE))?;
            server.streams.push(stream);
        }
        Ok(server)
    }

    /// Processor time of all its threads.
    fn processor(&self) -> Result<Duration, Box<dyn std::error::Error>> {
        let mut nanoseconds = 0;
        for task in fs::read_dir(format!("/proc/{}/task", self.child.id()))? {
            let statistics = fs::read_to_string(task?.path().join("schedstat"))?;
            let spent = statistics.split_whitespace().next().ok_or("no time")?;
            nanoseconds += spent.parse::<u64>()?;
        }
        Ok(Duration::from_nanos(nanoseconds))
    }

    fn exchange(&mut self, exchange: Exchange) -> Result<usize, Box<dyn std::error::Error>> {
        let stream = self.streams.first_mut().ok_or("no connection")?;
        let mut buffer = [0; 4_096];
        stream.write_all(exchange.request)?;
        let mut length = 0;
        loop {
            let count = stream.read(&mut buffer)?;
            length += count;
            match buffer.get(..count).and_then(<[u8]>::last) {
                None => return Err("the server has closed".into()),
                Some(&ETX) => break,
                Some(_) => {}
            }
        }
        if let Some(confirm) = exchange.confirm {
            stream.write_all(confirm)?;
            // On one core the server takes it now, by itself.
            std::thread::yield_now();
        }
        Ok(length)
    }

    fn lap(&mut self, exchange: Exchange) -> Result<Lap, Box<dyn std::error::Error>> {
        for _ in 0..WARM_UP {
            self.exchange(exchange)?;
        }
        let mut delays = Vec::with_capacity(EXCHANGES);
        let before = self.processor()?;
        for _ in 0..EXCHANGES {
            let began = Instant::now();
            self.exchange(exchange)?;
            delays.push(began.elapsed().as_secs_f64() * 1e6);
        }
        let spent = self.processor()? - before;
        delays.sort_by(f64::total_cmp);
        let at = |share: usize| delays.get(EXCHANGES * share / 100).copied().unwrap_or(f64::NAN);
        #[expect(clippy::cast_precision_loss, reason = "a few thousand")]
        let processor = spent.as_secs_f64() * 1e6 / EXCHANGES as f64;
        Ok(Lap {
            processor,
            p50: at(50),
            p99: at(99),
        })
    }
}

/// Measures and prints.
pub fn print(rounds: usize) -> Result<(), String> {
    measure(rounds).map_err(|error| format!("requests: {error}"))
}

fn measure(rounds: usize) -> Result<(), Box<dyn std::error::Error>> {
    let own = std::env::current_exe()?;
    let binary = own.with_file_name("ts3100");
    println!("\nA request over TCP, microseconds, medians of {rounds} rounds in turn\n");
    println!(
        "{:28} {:>10} {:>8} {:>8}   {:>10} {:>8} {:>8}   ratios",
        "", "processor", "p50", "p99", "echo", "p50", "p99"
    );
    let serve = ["serve", "--ports", "auto", "--ready-json", "--servo-on"];
    let variants: &[(&str, &[&str])] = &[
        ("", &[]),
        (", --control off", &["--control", "off"]),
        (", -vv to /dev/null", &["-vv"]),
    ];
    for (variant, flags) in variants {
        let words = [&serve[..], flags].concat();
        let mut robot = Server::start(&binary, &words, "\"ip0\":", 1)?;
        for exchange in [SU, SF] {
            let length = robot.exchange(exchange)?.to_string();
            let mut echo = Server::start(&own, &[ECHO, &length], "\"port\":", 1)?;
            let mut laps: [Vec<Lap>; 2] = Default::default();
            for _ in 0..rounds {
                let turn = [
                    robot.lap(exchange)?,
                    echo.lap(Exchange {
                        confirm: None,
                        ..exchange
                    })?,
                ];
                for (laps, lap) in laps.iter_mut().zip(turn) {
                    laps.push(lap);
                }
            }
            let [ours, theirs] = laps.map(|laps| {
                [
                    |lap: &Lap| lap.processor,
                    |lap: &Lap| lap.p50,
                    |lap: &Lap| lap.p99,
                ]
                .map(|figure| median(laps.iter().map(figure).collect()))
            });
            let name = format!("{}{variant}", exchange.name);
            let ratios: Vec<String> = ours
                .iter()
                .zip(&theirs)
                .map(|(ours, theirs)| format!("{:.2}", ours / theirs / exchange.echoes))
                .collect();
            println!(
                "{name:28} {:>10.1} {:>8.1} {:>8.1}   {:>10.1} {:>8.1} {:>8.1}   {}",
                ours[0],
                ours[1],
                ours[2],
                theirs[0],
                theirs[1],
                theirs[2],
                ratios.join(" ")
            );
        }
    }
    Ok(())
}
