//! Many robots in one process: start, first answers, memory, idle processor time and end, for 1 to 10,000 robots; and the
//! rate of 32 robots with 32 connections. Beside each is the echo server with as many connections.

use crate::requests::SU;
use crate::server::{ECHO, Exchange, Failure, Server, ask, connect, read_text};
use crate::table::median;
use std::io::Write;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::Path;
use std::time::{Duration, Instant};

/// Robots in one process.
const SIZES: [u32; 4] = [1, 100, 1_000, 10_000];
/// The size whose memory is held.
const HELD: u32 = 1_000;
/// Connections that stay open; a process on a usual machine has files for twice as many.
const MOST_OPEN: u32 = 5_000;
/// Most rounds of each size but the largest, which has one.
const MOST_ROUNDS: usize = 3;
/// How long nothing happens while idle processor time is measured.
const IDLE: Duration = Duration::from_secs(3);
/// Robots and connections of the rate.
const ROBOTS: u32 = 32;
/// Requests on each connection in one go, and before the first that is measured.
const REQUESTS: u32 = 400;
const WARM_UP: u32 = 40;

/// Most kilobytes for each further robot of 1,000.
const MOST_MEMORY: f64 = 100.0;

/// After SU the host confirms, so that no exchange is open while the robots are idle.
const STATUS: Exchange = Exchange {
    confirm: Some(b"\x02OK\r\x03"),
    ..SU
};
const BARE: Exchange = Exchange { confirm: None, ..SU };

/// One process from start to end.
struct Life {
    /// Milliseconds to its ready line, and until each has answered, the slowest, and to its end.
    ready: f64,
    answered: f64,
    worst: f64,
    end: f64,
    /// Kilobytes when ready, and when each has answered.
    fresh: u32,
    used: u32,
    /// Processor time while idle, in milliseconds.
    idle: f64,
}

/// Measures and prints; what is beyond its margin.
pub fn print(rounds: usize) -> Result<Vec<String>, String> {
    rate(rounds).map_err(|error| format!("32 robots: {error}"))?;
    lives(rounds.min(MOST_ROUNDS)).map_err(|error| format!("many robots: {error}"))
}

fn lives(rounds: usize) -> Result<Vec<String>, Failure> {
    files()?;
    let own = std::env::current_exe()?;
    let binary = own.with_file_name("ts3100");
    let mut missed = Vec::new();
    println!(
        "\nMany robots in one process: medians of up to {rounds} rounds, beside an echo server with as many connections\n\n\
         {:24} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}",
        "", "ready ms", "all ms", "worst ms", "fresh kB", "used kB", "kB each", "idle ms", "end ms"
    );
    let mut firsts: [Option<u32>; 2] = [None, None];
    for size in SIZES {
        let mut both: [Vec<Life>; 2] = Default::default();
        for _ in 0..if size > HELD { 1 } else { rounds } {
            both[0].push(robots(&binary, size)?);
            both[1].push(echoes(&own, size)?);
        }
        for ((name, lives), first) in ["robots", "echo connections"].iter().zip(&both).zip(&mut firsts) {
            let of = |figure: fn(&Life) -> f64| median(lives.iter().map(figure).collect());
            let used = lives.iter().map(|life| life.used).min().unwrap_or_default();
            let alone = *first.get_or_insert(used);
            let each = if size > 1 {
                f64::from(used.saturating_sub(alone)) / f64::from(size - 1)
            } else {
                f64::from(used)
            };
            println!(
                "{:24} {:>9.1} {:>9.1} {:>9.1} {:>9.0} {:>9} {:>9.1} {:>9.1} {:>9.1}",
                format!("{size} {name}"),
                of(|life| life.ready),
                of(|life| life.ready + life.answered),
                of(|life| life.worst),
                of(|life| f64::from(life.fresh)),
                used,
                each,
                of(|life| life.idle),
                of(|life| life.end)
            );
            if size == HELD && *name == "robots" && each > MOST_MEMORY {
                missed.push(format!(
                    "{size} robots, each further one: {each:.1} kB, at most {MOST_MEMORY} kB expected"
                ));
            }
        }
    }
    Ok(missed)
}

fn robots(binary: &Path, size: u32) -> Result<Life, Failure> {
    let (count, offset) = (size.to_string(), offset()?.to_string());
    let ports = if size > 100 {
        ["--port-offset", &offset]
    } else {
        ["--ports", "auto"]
    };
    let serve = [
        "serve",
        "--robots",
        &count,
        "--ready-json",
        "--control",
        "127.0.0.1:0",
    ];
    let server = Server::launch(binary, &[&serve[..], &ports].concat())?;
    let addresses = server.robots()?;
    if addresses.len() != usize::try_from(size)? {
        return Err(format!("{size} robots expected, found {}", addresses.len()).into());
    }
    life(server, &addresses, size, STATUS)
}

fn echoes(own: &Path, size: u32) -> Result<Life, Failure> {
    let server = Server::launch(own, &[ECHO, "400"])?;
    let port = server.port("\"port\":")?;
    let addresses = vec![("127.0.0.1".to_owned(), port); usize::try_from(size)?];
    life(server, &addresses, size, BARE)
}

fn life(
    mut server: Server,
    addresses: &[(String, u16)],
    size: u32,
    exchange: Exchange,
) -> Result<Life, Failure> {
    let fresh = server.memory()?;
    let (began, mut worst) = (Instant::now(), Duration::ZERO);
    for (address, port) in addresses {
        let asked = Instant::now();
        let mut stream = connect(address, *port)?;
        ask(&mut stream, exchange)?;
        worst = worst.max(asked.elapsed());
        if size <= MOST_OPEN {
            server.streams.push(stream);
        }
    }
    let answered = began.elapsed();
    let used = server.memory()?;
    let before = server.processor()?;
    std::thread::sleep(IDLE);
    let idle = server.processor()? - before;
    let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
    Ok(Life {
        ready: milliseconds(server.took),
        answered: milliseconds(answered),
        worst: milliseconds(worst),
        fresh,
        used,
        idle: milliseconds(idle),
        end: milliseconds(server.end()?),
    })
}

/// A distance from the ports 1000 to 1003 at which nobody listens on any address.
fn offset() -> Result<u16, Failure> {
    let is_free = |offset: &u16| {
        (1_000..1_004).all(|port| TcpListener::bind((Ipv4Addr::UNSPECIFIED, offset + port)).is_ok())
    };
    let mut offsets = (20_000..31_000).step_by(500);
    Ok(offsets.find(is_free).ok_or("no free ports from 21000 to 31999")?)
}

/// Lets this program and its servers open as many files as the machine allows.
fn files() -> Result<(), Failure> {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let limit = getrlimit(Resource::Nofile);
    let most = Rlimit {
        current: limit.maximum,
        maximum: limit.maximum,
    };
    Ok(setrlimit(Resource::Nofile, most)?)
}

/// The rate of 32 robots, each with one connection and one request on its way; with the control interface and without.
fn rate(rounds: usize) -> Result<(), Failure> {
    let own = std::env::current_exe()?;
    let count = ROBOTS.to_string();
    println!(
        "\n{ROBOTS} robots, {ROBOTS} connections, one request on its way on each: medians of {rounds} rounds in turn\n"
    );
    for (name, control) in [("SU", "127.0.0.1:0"), ("SU, --control off", "off")] {
        let serve = ["serve", "--ports", "auto", "--ready-json", "--servo-on"];
        let words = [&serve[..], &["--robots", &count, "--control", control]].concat();
        let mut robots = Server::launch(&own.with_file_name("ts3100"), &words)?;
        for (address, port) in robots.robots()? {
            robots.streams.push(connect(&address, port)?);
        }
        let length = robots.exchange(BARE)?.to_string();
        let connections = usize::try_from(ROBOTS)?;
        let mut echo = Server::start(&own, &[ECHO, &length], "\"port\":", connections)?;
        let mut rounds: Vec<[[f64; 2]; 2]> = (0..rounds)
            .map(|_| Ok([go(&mut robots)?, go(&mut echo)?]))
            .collect::<Result<_, Failure>>()?;
        let [rate, processor, bare_rate, bare_processor] = [(0, 0), (0, 1), (1, 0), (1, 1)]
            .map(|(who, what)| median(rounds.iter().map(|both| both[who][what]).collect()));
        let ratios = rounds.drain(..).map(|[robots, echo]| robots[0] / echo[0]);
        let best = ratios.fold(0.0, f64::max);
        println!(
            "{name:24} {rate:>8.0} a second {processor:>6.1} µs   echo {bare_rate:>8.0} a second {bare_processor:>6.1} µs   \
             ratio of the best round {best:.2}"
        );
    }
    Ok(())
}

/// Requests per second, and microseconds of processor time of the server for each.
fn go(server: &mut Server) -> Result<[f64; 2], Failure> {
    let mut streams = std::mem::take(&mut server.streams);
    turns(&mut streams, WARM_UP)?;
    let (before, began) = (server.processor()?, Instant::now());
    turns(&mut streams, REQUESTS)?;
    let seconds = began.elapsed().as_secs_f64();
    let spent = server.processor()? - before;
    server.streams = streams;
    let requests = f64::from(ROBOTS * REQUESTS);
    Ok([requests / seconds, spent.as_secs_f64() * 1e6 / requests])
}

/// Each connection in turn: its reply is read, the next request is sent.
fn turns(streams: &mut [TcpStream], count: u32) -> Result<(), Failure> {
    for stream in streams.iter_mut() {
        stream.write_all(SU.request)?;
    }
    for turn in 1..=count {
        for stream in streams.iter_mut() {
            read_text(stream)?;
            if turn < count {
                stream.write_all(SU.request)?;
            }
        }
    }
    Ok(())
}
