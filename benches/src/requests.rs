//! Processor time and delay of a request over TCP, beside an echo server of the same shape in the same run. Both are
//! processes of their own; run it with `taskset -c N`, so that servers and client share one core.

use crate::server::{ECHO, Exchange, Failure, Server};
use crate::table::median;
use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::Instant;

/// Exchanges in one go.
const EXCHANGES: usize = 4_000;
/// Exchanges before the first that is measured.
const WARM_UP: usize = 500;

pub const SU: Exchange = Exchange {
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

/// Many exchanges, one after the other.
fn lap(server: &mut Server, exchange: Exchange) -> Result<Lap, Failure> {
    for _ in 0..WARM_UP {
        server.exchange(exchange)?;
    }
    let mut delays = Vec::with_capacity(EXCHANGES);
    let before = server.processor()?;
    for _ in 0..EXCHANGES {
        let began = Instant::now();
        server.exchange(exchange)?;
        delays.push(began.elapsed().as_secs_f64() * 1e6);
    }
    let spent = server.processor()? - before;
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

/// A way to start the emulator, and the most that its requests may cost.
struct Variant {
    name: &'static str,
    flags: &'static [&'static str],
    /// Somebody follows `/events`.
    is_followed: bool,
    /// Most processor time of SU and of SF with its OK, in that of the echo.
    most: Option<[f64; 2]>,
}

const VARIANTS: [Variant; 5] = [
    Variant {
        name: "nobody watches",
        flags: &[],
        is_followed: false,
        most: Some([2.7, 3.2]),
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

/// Processor time, p50 and p99.
type Figures = [f64; 3];

/// Measures and prints; what is beyond its margin.
pub fn print(rounds: usize) -> Result<Vec<String>, String> {
    let missed = measure(rounds).map_err(|error| format!("requests: {error}"));
    drop(fs::remove_file(TRANSCRIPT));
    missed
}

fn measure(rounds: usize) -> Result<Vec<String>, Failure> {
    let own = std::env::current_exe()?;
    let binary = own.with_file_name("ts3100");
    let mut missed = Vec::new();
    println!(
        "\nA request over TCP: microseconds, medians of {rounds} rounds in turn, beside an echo of the same shape; ratios of the best rounds\n"
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
            let (ours, theirs, best) = compare(&mut robot, &own, exchange, rounds)?;
            let ratio = best.map(|ratio| ratio / exchange.echoes);
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
            let figures = [("SU", su[0]), ("SF with its OK", sf[0])];
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

/// The robot and the echo server in turn: the medians of each, and the ratios in the best round.
fn compare(
    robot: &mut Server,
    own: &Path,
    exchange: Exchange,
    rounds: usize,
) -> Result<(Figures, Figures, Figures), Failure> {
    let length = robot.exchange(exchange)?.to_string();
    let mut echo = Server::start(own, &[ECHO, &length], "\"port\":", 1)?;
    let alone = Exchange {
        confirm: None,
        ..exchange
    };
    let mut laps: [Vec<Lap>; 2] = Default::default();
    for _ in 0..rounds {
        let turn = [lap(robot, exchange)?, lap(&mut echo, alone)?];
        for (laps, lap) in laps.iter_mut().zip(turn) {
            laps.push(lap);
        }
    }
    let figures: [fn(&Lap) -> f64; 3] = [|lap| lap.processor, |lap| lap.p50, |lap| lap.p99];
    let [ours, theirs] = laps
        .each_ref()
        .map(|laps| figures.map(|figure| median(laps.iter().map(figure).collect())));
    let [robots, echoes] = &laps;
    let best = figures.map(|figure| {
        let ratios = robots
            .iter()
            .zip(echoes)
            .map(|(robot, echo)| figure(robot) / figure(echo));
        ratios.fold(f64::INFINITY, f64::min)
    });
    Ok((ours, theirs, best))
}

/// Reads `/events` in a thread, as fast as they come.
struct Follower(Option<(TcpStream, std::thread::JoinHandle<()>)>);

impl Follower {
    fn start(robot: Option<&Server>) -> Result<Follower, Failure> {
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
