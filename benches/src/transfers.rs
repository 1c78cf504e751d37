//! What else a host does: it reads a variable, downloads and uploads a file, reads what a program prints, and talks over a
//! terminal. Each is measured beside an echo server that is sent the same number of texts and answers with as many bytes.

use crate::requests::SU;
use crate::server::{ECHO, ETX, Exchange, Failure, PATIENCE, Server, ask, connect, read_text};
use crate::table::median;
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::fs::File;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};
use ts3100_host::{Client, Options, Response, TcpTransport};
use ts3100_proto::command::Command;
use ts3100_proto::file::FlSender;

/// Microseconds of wall clock that tell the two speeds of a terminal: the kernel passes its bytes on the same core in 7 to 15, on
/// another one in 70 to 100. Which it is changes from round to round, and only rounds with the same one can be compared.
const SLOW_TERMINAL: f64 = 40.0;

/// Makes this program the echo behind a terminal: the next word is the length of its replies.
pub const TERMINAL: &str = "--terminal-echo";
/// Makes this program a server that answers each text with lines of the same length.
pub const TALK: &str = "--talk";

/// Exchanges in one go.
const EXCHANGES: u32 = 3_000;
/// Files in one go.
const FILES: u32 = 20;
/// Bytes of the file, and of it in each text but the first.
const FILE: usize = 30_000;
const FURTHER: usize = 253;
/// Lines that a program prints in one go, each in one PRINT, and the bytes of a line.
const LINES: u32 = 20_000;
const LINE: usize = 17;

const READ: Exchange = Exchange {
    name: "MR",
    request: b"\x02MR,PARTS 0\r\x03",
    confirm: Some(b"\x02OK\r\x03"),
    echoes: 1.0,
};
const OK: &[u8] = b"\x02OK\r\x03";
const PARTS: &str = "GLOBAL\nPARTS = 0\nEND\nPROGRAM PARTS\nPARTS = PARTS + 1\nEND\n";
const PRINTS: &str = "PROGRAM PRINTS\nFOR N = 1 TO 20000\nPRINT IP1, \"PART\", N, CR\nNEXT N\nEND\n";

/// What one go came to.
#[derive(Clone, Copy)]
struct Lap {
    /// Microseconds for each of its units: processor time of the server, and wall-clock time.
    processor: f64,
    wall: f64,
}

/// A thing that is done to the robot and, in turn, to the echo.
struct Row {
    name: &'static str,
    laps: Vec<[Lap; 2]>,
    /// Bytes of each unit, where the throughput matters.
    bytes: Option<usize>,
    /// Microseconds of wall clock that tell two speeds; only rounds at the same one are compared.
    slow: f64,
}

type Go<'a> = dyn FnMut() -> Result<(), Failure> + 'a;

/// Measures and prints.
pub fn print(rounds: usize) -> Result<(), String> {
    let folder = std::env::temp_dir().join(format!("ts3100-transfers-{}", std::process::id()));
    let rows = std::fs::create_dir_all(&folder)
        .map_err(Failure::from)
        .and_then(|()| measure(&folder, rounds));
    drop(std::fs::remove_dir_all(&folder));
    let rows = rows.map_err(|error| format!("transfers: {error}"))?;
    println!(
        "\nFurther exchanges: microseconds, medians of {rounds} rounds in turn, beside an echo; ratios of the best rounds\n\n\
         {:28} {:>9} {:>9}   {:>9} {:>9}   ratios",
        "", "processor", "wall", "echo", "wall"
    );
    for row in rows {
        let of = |at: usize, figure: fn(&Lap) -> f64| {
            median(
                row.laps
                    .iter()
                    .filter_map(|laps| laps.get(at))
                    .map(figure)
                    .collect(),
            )
        };
        let same_speed = |laps: &&[Lap; 2]| {
            let [ours, theirs] = laps.each_ref().map(|lap| lap.wall > row.slow);
            ours == theirs
        };
        let best = |figure: fn(&Lap) -> f64| {
            let comparable = row.laps.iter().filter(same_speed);
            let ratios = comparable.map(|[ours, theirs]| figure(ours) / figure(theirs));
            ratios.reduce(f64::min)
        };
        let [processor, wall]: [fn(&Lap) -> f64; 2] = [|lap| lap.processor, |lap| lap.wall];
        let ratios = [best(processor), best(wall)];
        print!(
            "{:28} {:>9.2} {:>9.2}   {:>9.2} {:>9.2}   {:.2} {:.2}",
            row.name,
            of(0, processor),
            of(0, wall),
            of(1, processor),
            of(1, wall),
            ratios[0].unwrap_or(f64::NAN),
            ratios[1].unwrap_or(f64::NAN)
        );
        #[expect(clippy::cast_precision_loss, reason = "a few hundred")]
        if let Some(bytes) = row.bytes {
            let bytes = bytes as f64;
            print!(
                "   {:.1} MB/s, echo {:.1} MB/s",
                bytes / of(0, wall),
                bytes / of(1, wall)
            );
        }
        println!();
    }
    Ok(())
}

fn measure(folder: &Path, rounds: usize) -> Result<Vec<Row>, Failure> {
    let own = std::env::current_exe()?;
    let binary = own.with_file_name("ts3100");
    let mut rows = over_tcp(&own, &binary, folder, rounds)?;
    rows.push(prints(&own, &binary, folder, rounds)?);
    rows.push(terminal(&own, &binary, folder, rounds)?);
    Ok(rows)
}

/// A server, and what is done to it.
type Contender<'a> = (&'a Server, &'a mut Go<'a>);

/// The robot and the echo by turns; how often in each turn, and of how many units each is.
fn turns(
    rounds: usize,
    [count, units]: [u32; 2],
    robot: &mut Contender,
    echo: &mut Contender,
) -> Result<Vec<[Lap; 2]>, Failure> {
    let lap = |server: &Server, one: &mut Go| {
        for _ in 0..count.div_ceil(10) {
            one()?;
        }
        let (before, began) = (server.processor()?, Instant::now());
        for _ in 0..count {
            one()?;
        }
        let wall = began.elapsed().as_secs_f64();
        let spent = (server.processor()? - before).as_secs_f64();
        let units = f64::from(count * units) / 1e6;
        Ok::<_, Failure>(Lap {
            processor: spent / units,
            wall: wall / units,
        })
    };
    (0..rounds)
        .map(|_| Ok([lap(robot.0, robot.1)?, lap(echo.0, echo.1)?]))
        .collect()
}

/// MR with its OK, beside two exchanges of the echo; and a file down and up.
fn over_tcp(own: &Path, binary: &Path, folder: &Path, rounds: usize) -> Result<Vec<Row>, Failure> {
    let robot = serve(binary, folder, ("PARTS", PARTS), &[])?;
    let mut stream = connect("127.0.0.1", robot.port("\"ip0\":")?)?;
    let mut echo = start_echo(own, ask(&mut stream, READ)?)?;
    let mut line = echo.connection()?;
    let alone = Exchange {
        confirm: None,
        ..READ
    };
    let laps = turns(
        rounds,
        [EXCHANGES, 1],
        &mut (&robot, &mut || ask(&mut stream, READ).map(drop)),
        &mut (&echo, &mut || {
            ask(&mut line, alone)?;
            ask(&mut line, alone).map(drop)
        }),
    )?;
    let mut host = unhurried(stream);
    Ok(vec![
        Row {
            name: "MR with its OK",
            laps,
            bytes: None,
            slow: f64::INFINITY,
        },
        Row {
            name: "DL, each text of 253 bytes",
            laps: downloads(own, &robot, &mut host, rounds)?,
            bytes: Some(FURTHER),
            slow: f64::INFINITY,
        },
        Row {
            name: "UL, each text of 253 bytes",
            laps: uploads(own, &robot, &mut host, rounds)?,
            bytes: Some(FURTHER),
            slow: f64::INFINITY,
        },
    ])
}

/// A host without pauses.
fn unhurried(stream: TcpStream) -> Client<TcpTransport> {
    let options = Options {
        pause: Duration::ZERO,
        timeout: PATIENCE,
        ..Options::with_stx()
    };
    Client::new(TcpTransport::from(stream), options)
}

fn downloads(
    own: &Path,
    robot: &Server,
    host: &mut Client<TcpTransport>,
    rounds: usize,
) -> Result<Vec<[Lap; 2]>, Failure> {
    let content = content();
    let texts = texts(&content);
    let mut echo = start_echo(own, OK.len())?;
    let mut line = echo.connection()?;
    let download = Command::parse(b"DL,BIG")?;
    turns(
        rounds,
        [FILES, u32::try_from(texts.len())?],
        &mut (robot, &mut || {
            if host.request(&download)? == Response::Ok && host.send_file(&content)? {
                Ok(())
            } else {
                Err("DL: NG".into())
            }
        }),
        &mut (&echo, &mut || {
            for text in &texts {
                line.write_all(text)?;
                read_text(&mut line)?;
            }
            Ok(())
        }),
    )
}

fn uploads(
    own: &Path,
    robot: &Server,
    host: &mut Client<TcpTransport>,
    rounds: usize,
) -> Result<Vec<[Lap; 2]>, Failure> {
    let content = content();
    let texts = texts(&content);
    let mut echo = start_echo(own, FURTHER + 2)?;
    let mut line = echo.connection()?;
    let upload = Command::parse(b"UL,BIG")?;
    turns(
        rounds,
        [FILES, u32::try_from(texts.len())?],
        &mut (robot, &mut || {
            if host.request(&upload)? == Response::Content(content.clone()) {
                Ok(())
            } else {
                Err("UL: another content".into())
            }
        }),
        &mut (&echo, &mut || {
            for _ in &texts {
                line.write_all(OK)?;
                read_text(&mut line)?;
            }
            Ok(())
        }),
    )
}

fn start_echo(own: &Path, length: usize) -> Result<Server, Failure> {
    Server::start(own, &[ECHO, &length.to_string()], "\"port\":", 1)
}

/// A program that prints to IP1 as fast as it can.
fn prints(own: &Path, binary: &Path, folder: &Path, rounds: usize) -> Result<Row, Failure> {
    // Each PRINT takes virtual time, which passes quickly enough here that it never waits.
    let robot = serve(binary, folder, ("PRINTS", PRINTS), &["--time", "x100000"])?;
    let mut host = connect("127.0.0.1", robot.port("\"ip0\":")?)?;
    let mut reader = connect("127.0.0.1", robot.port("\"ip1\":")?)?;
    // The robot has taken the second connection when it has answered here.
    std::thread::sleep(Duration::from_millis(50));
    ask(&mut host, SU)?;
    let mut talker = Server::start(own, &[TALK, &LINES.to_string()], "\"port\":", 1)?;
    let mut talk = talker.connection()?;
    Ok(Row {
        name: "PRINT to IP1, each line",
        laps: turns(
            rounds,
            [1, LINES],
            &mut (&robot, &mut || {
                host.write_all(b"\x02RN\r\x03")?;
                expect_ok(&mut host)?;
                read_lines(&mut reader)?;
                // SP: the program has ended.
                read_text(&mut host).map(drop)
            }),
            &mut (&talker, &mut || {
                talk.write_all(OK)?;
                read_lines(&mut talk)
            }),
        )?,
        bytes: Some(LINE),
        slow: f64::INFINITY,
    })
}

/// SU over the pseudo terminal of HOST.
fn terminal(own: &Path, binary: &Path, folder: &Path, rounds: usize) -> Result<Row, Failure> {
    let directory = folder.join("serial");
    std::fs::create_dir_all(&directory)?;
    let directory = directory.to_str().ok_or("a directory whose name is no text")?;
    let flags = ["--serial-dir", directory, "--set", "serial.pacing=false"];
    let robot = serve(binary, folder, ("PARTS", PARTS), &flags)?;
    let mut line = open_terminal(&Path::new(directory).join("host"))?;
    let length = ask(&mut line, SU)?;
    let echo = Server::launch(own, &[TERMINAL, &length.to_string()])?;
    let (_, path) = echo.ready.split_once("\"terminal\":\"").ok_or("no terminal")?;
    let mut bare = open_terminal(Path::new(path.split('"').next().unwrap_or_default()))?;
    Ok(Row {
        name: "SU over a terminal",
        laps: turns(
            rounds,
            [EXCHANGES, 1],
            &mut (&robot, &mut || ask(&mut line, SU).map(drop)),
            &mut (&echo, &mut || ask(&mut bare, SU).map(drop)),
        )?,
        bytes: None,
        slow: SLOW_TERMINAL,
    })
}

fn serve(binary: &Path, folder: &Path, file: (&str, &str), flags: &[&str]) -> Result<Server, Failure> {
    let path = folder.join(file.0);
    std::fs::write(&path, file.1)?;
    let path = path.to_str().ok_or("a directory whose name is no text")?;
    let words = [
        "serve",
        "--ports",
        "auto",
        "--ready-json",
        "--servo-on",
        "--control",
        "127.0.0.1:0",
        "--load",
        path,
        "--select",
        file.0,
    ];
    Server::launch(binary, &[&words[..], flags].concat())
}

/// The file.
fn content() -> Vec<u8> {
    let line = b"' A remark that fills a line of a file; there is nothing in it but these words.\r\n";
    line.iter().copied().cycle().take(FILE).collect()
}

/// The file in the texts of DL.
fn texts(content: &[u8]) -> Vec<Vec<u8>> {
    let mut sender = FlSender::new(content);
    let options = Options::with_stx();
    std::iter::from_fn(|| sender.next_text().map(|data| options.text(data))).collect()
}

fn expect_ok(stream: &mut impl Read) -> Result<(), Failure> {
    let mut found = [0; OK.len()];
    stream.read_exact(&mut found)?;
    if found == OK {
        Ok(())
    } else {
        Err(format!("expected OK, found {found:?}").into())
    }
}

fn read_lines(stream: &mut impl Read) -> Result<(), Failure> {
    let mut buffer = vec![0; 65_536];
    let mut missing = usize::try_from(LINES)? * LINE;
    while missing > 0 {
        let count = stream.read(&mut buffer)?;
        if count == 0 || count > missing {
            return Err(format!("{count} bytes found, {missing} expected").into());
        }
        missing -= count;
    }
    Ok(())
}

/// A terminal that changes no byte.
fn open_terminal(path: &Path) -> Result<File, Failure> {
    let began = Instant::now();
    let file = loop {
        match File::options().read(true).write(true).open(path) {
            Ok(file) => break file,
            Err(error) if began.elapsed() > PATIENCE => {
                return Err(format!("{}: {error}", path.display()).into());
            }
            Err(_) => std::thread::sleep(Duration::from_millis(1)),
        }
    };
    let mut settings = tcgetattr(&file)?;
    settings.make_raw();
    tcsetattr(&file, OptionalActions::Now, &settings)?;
    Ok(file)
}

/// Answers each text from a terminal with `length` bytes.
pub fn terminal_echo(length: usize) -> Result<(), Failure> {
    use rustix::event::{PollFd, PollFlags, poll};
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    let terminal = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    grantpt(&terminal)?;
    unlockpt(&terminal)?;
    let name = ptsname(&terminal, Vec::new())?;
    // Somebody must have it open, or reading fails until the client comes.
    let _open = open_terminal(Path::new(name.to_str()?))?;
    println!("{{\"terminal\":\"{}\"}}", name.to_str()?);
    let mut reply = vec![b'.'; length.saturating_sub(1)];
    reply.push(ETX);
    let mut buffer = [0; 4_096];
    loop {
        poll(&mut [PollFd::new(&terminal, PollFlags::IN)], None)?;
        let count = rustix::io::read(&terminal, &mut buffer)?;
        if buffer.get(..count).is_some_and(|bytes| bytes.ends_with(&[ETX])) {
            rustix::io::write(&terminal, &reply)?;
        }
    }
}

/// Answers each text with `count` lines, each in a write of its own.
pub fn talk(count: usize) -> Result<(), Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::bind(("127.0.0.1", 0)).await?;
        println!("{{\"port\":{}}}", listener.local_addr()?.port());
        let (stream, _) = listener.accept().await?;
        stream.set_nodelay(true)?;
        let mut line = [b'.'; LINE];
        if let Some(last) = line.last_mut() {
            *last = b'\r';
        }
        let mut buffer = [0; 64];
        loop {
            stream.readable().await?;
            match stream.try_read(&mut buffer) {
                Ok(0) => return Ok(()),
                Ok(_) => {}
                Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => continue,
                Err(error) => return Err(error.into()),
            }
            for _ in 0..count {
                let mut rest = &line[..];
                while !rest.is_empty() {
                    stream.writable().await?;
                    match stream.try_write(rest) {
                        Ok(count) => rest = rest.get(count..).unwrap_or_default(),
                        Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {}
                        Err(error) => return Err(error.into()),
                    }
                }
            }
        }
    })
}
