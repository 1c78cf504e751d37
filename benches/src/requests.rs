//! Processor time and delay of a request over TCP, beside an echo server of the same shape in the same run. Both are
//! processes of their own; run it with `taskset -c N`, so that servers and client share one core.

use crate::table::median;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
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
pub struct Exchange {
    pub name: &'static str,
    pub request: &'static [u8],
    /// Sent after the reply; nothing answers it.
    pub confirm: Option<&'static [u8]>,
    /// Exchanges of the echo server that count as one of these.
    pub echoes: f64,
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
pub struct Server {
    child: Child,
    /// Its first line.
    ready: String,
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
    pub fn start(
        program: &Path,
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
            ready: line.clone(),
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
    pub fn processor(&self) -> Result<Duration, Box<dyn std::error::Error>> {
        let mut nanoseconds = 0;
        for task in fs::read_dir(format!("/proc/{}/task", self.child.id()))? {
            let statistics = fs::read_to_string(task?.path().join("schedstat"))?;
            let spent = statistics.split_whitespace().next().ok_or("no time")?;
            nanoseconds += spent.parse::<u64>()?;
        }
        Ok(Duration::from_nanos(nanoseconds))
    }

    /// Resident memory in kilobytes.
    fn memory(&self) -> Result<u64, Box<dyn std::error::Error>> {
        let status = fs::read_to_string(format!("/proc/{}/status", self.child.id()))?;
        let mut lines = status.lines();
        let line = lines
            .find_map(|line| line.strip_prefix("VmRSS:"))
            .ok_or("no VmRSS")?;
        Ok(line.trim().trim_end_matches(" kB").parse()?)
    }

    pub fn exchange(&mut self, exchange: Exchange) -> Result<usize, Box<dyn std::error::Error>> {
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

    pub fn send(&mut self, text: &[u8]) -> Result<(), Box<dyn std::error::Error>> {
        let stream = self.streams.first_mut().ok_or("no connection")?;
        Ok(stream.write_all(text)?)
    }

    /// Reads exactly this.
    pub fn wait_for(&mut self, text: &[u8]) -> Result<(), Box<dyn std::error::Error>> {
        let stream = self.streams.first_mut().ok_or("no connection")?;
        let mut found = vec![0; text.len()];
        stream.read_exact(&mut found)?;
        if found == text {
            Ok(())
        } else {
            Err(format!("expected {text:?}, found {found:?}").into())
        }
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

/// A way to start the emulator, and the most that its requests may cost.
struct Variant {
    name: &'static str,
    flags: &'static [&'static str],
    /// Somebody follows `/events`.
    is_followed: bool,
    /// Most processor time of SU and of SF with its OK, in that of the echo; most p50 of SU.
    most: Option<[f64; 3]>,
}

/// The aims are 2, 2.5 and 1.5; a busy machine is allowed a fifth more.
const VARIANTS: [Variant; 5] = [
    Variant {
        name: "nobody watches",
        flags: &[],
        is_followed: false,
        most: Some([2.4, 3.0, 1.8]),
    },
    Variant {
        name: "--control off",
        flags: &["--control", "off"],
        is_followed: false,
        most: None,
    },
    Variant {
        name: "/events followed",
        flags: &[],
        is_followed: true,
        most: None,
    },
    Variant {
        name: "--transcript",
        flags: &["--transcript", TRANSCRIPT],
        is_followed: false,
        most: None,
    },
    Variant {
        name: "-vv",
        flags: &["-vv"],
        is_followed: false,
        most: None,
    },
];
/// Where the transcript goes: nothing is kept of it.
const TRANSCRIPT: &str = "/dev/shm/ts3100-bench.jsonl";

/// The medians of the rounds: processor time, p50, p99.
type Figures = [f64; 3];

/// Measures and prints; what is beyond its margin.
pub fn print(rounds: usize) -> Result<Vec<String>, String> {
    let missed = measure(rounds).map_err(|error| format!("requests: {error}"));
    drop(fs::remove_file(TRANSCRIPT));
    missed
}

fn measure(rounds: usize) -> Result<Vec<String>, Box<dyn std::error::Error>> {
    let own = std::env::current_exe()?;
    let binary = own.with_file_name("ts3100");
    let mut missed = Vec::new();
    println!(
        "\nA request over TCP: microseconds, medians of {rounds} rounds in turn, beside an echo of the same shape\n"
    );
    println!(
        "{:32} {:>9} {:>7} {:>7}   {:>9} {:>7} {:>7}   ratios",
        "", "processor", "p50", "p99", "echo", "p50", "p99"
    );
    for variant in VARIANTS {
        let serve = ["serve", "--ports", "auto", "--ready-json", "--servo-on"];
        let words = [&serve[..], variant.flags].concat();
        let mut robot = Server::start(&binary, &words, "\"ip0\":", 1)?;
        let mut follower = Follower::start(variant.is_followed.then_some(&robot))?;
        let mut ratios = Vec::new();
        for exchange in [SU, SF] {
            let (ours, theirs) = compare(&mut robot, &own, exchange, rounds)?;
            let ratio = [0, 1, 2].map(|at| ours[at] / theirs[at] / exchange.echoes);
            println!(
                "{:32} {:>9.1} {:>7.1} {:>7.1}   {:>9.1} {:>7.1} {:>7.1}   {:.2} {:.2} {:.2}",
                format!("{}, {}", exchange.name, variant.name),
                ours[0],
                ours[1],
                ours[2],
                theirs[0],
                theirs[1],
                theirs[2],
                ratio[0],
                ratio[1],
                ratio[2]
            );
            ratios.push(ratio);
        }
        println!(
            "{:32} {:>9} kB",
            format!("memory, {}", variant.name),
            robot.memory()?
        );
        follower.stop();
        if let (Some(most), [su, sf]) = (variant.most, ratios.as_slice()) {
            let figures = [("SU", su[0]), ("SF with its OK", sf[0]), ("p50 of SU", su[1])];
            for ((name, ratio), most) in figures.into_iter().zip(most) {
                if ratio > most {
                    missed.push(format!(
                        "{name}: {ratio:.2} times the echo, at most {most} expected"
                    ));
                }
            }
        }
    }
    Ok(missed)
}

/// The robot and the echo server in turn.
fn compare(
    robot: &mut Server,
    own: &Path,
    exchange: Exchange,
    rounds: usize,
) -> Result<(Figures, Figures), Box<dyn std::error::Error>> {
    let length = robot.exchange(exchange)?.to_string();
    let mut echo = Server::start(own, &[ECHO, &length], "\"port\":", 1)?;
    let alone = Exchange {
        confirm: None,
        ..exchange
    };
    let mut laps: [Vec<Lap>; 2] = Default::default();
    for _ in 0..rounds {
        let turn = [robot.lap(exchange)?, echo.lap(alone)?];
        for (laps, lap) in laps.iter_mut().zip(turn) {
            laps.push(lap);
        }
    }
    let [ours, theirs] = laps.map(|laps| {
        let of = |figure: fn(&Lap) -> f64| median(laps.iter().map(figure).collect());
        [of(|lap| lap.processor), of(|lap| lap.p50), of(|lap| lap.p99)]
    });
    Ok((ours, theirs))
}

/// Reads `/events` in a thread, as fast as they come.
struct Follower(Option<(TcpStream, std::thread::JoinHandle<()>)>);

impl Follower {
    fn start(robot: Option<&Server>) -> Result<Follower, Box<dyn std::error::Error>> {
        let Some(robot) = robot else {
            return Ok(Follower(None));
        };
        let (_, url) = robot
            .ready
            .split_once("\"control\":\"http://")
            .ok_or("no control interface")?;
        let mut stream = TcpStream::connect(url.split('"').next().unwrap_or_default())?;
        stream.write_all(b"GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n")?;
        let mut reader = stream.try_clone()?;
        let thread = std::thread::spawn(move || {
            let mut buffer = [0; 65_536];
            while reader.read(&mut buffer).is_ok_and(|count| count > 0) {}
        });
        Ok(Follower(Some((stream, thread))))
    }

    fn stop(&mut self) {
        if let Some((stream, thread)) = self.0.take() {
            drop(stream.shutdown(std::net::Shutdown::Both));
            drop(thread.join());
        }
    }
}
