//! The servers that are measured: the emulator, and an echo server of the same shape, which is this program started
//! once more. What is asked of them is in the modules that measure.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// What may go wrong while something is measured.
pub type Failure = Box<dyn std::error::Error>;

/// Makes this program the echo server: the next word is the length of its replies.
pub const ECHO: &str = "--echo";
/// Longest wait for an answer.
pub const PATIENCE: Duration = Duration::from_secs(10);
/// End of every text.
pub const ETX: u8 = 3;

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

/// A server and the connections to it.
pub struct Server {
    child: Child,
    /// Its first line.
    pub ready: String,
    /// From its start to that line.
    pub took: Duration,
    pub streams: Vec<TcpStream>,
}

impl Drop for Server {
    fn drop(&mut self) {
        // Ending a process that has ended already is no loss.
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

impl Server {
    /// Starts a program and reads its first line.
    pub fn launch(program: &Path, words: &[&str]) -> Result<Server, Failure> {
        let mut command = Command::new(program);
        command.args(words).stdin(Stdio::null()).stderr(Stdio::null());
        let began = Instant::now();
        let child = command.stdout(Stdio::piped()).spawn();
        let mut server = Server {
            child: child.map_err(|error| format!("{}: {error}", program.display()))?,
            ready: String::new(),
            took: Duration::ZERO,
            streams: Vec::new(),
        };
        let stdout = server.child.stdout.take().ok_or("no standard output")?;
        BufReader::new(stdout).read_line(&mut server.ready)?;
        server.took = began.elapsed();
        if server.ready.is_empty() {
            return Err(format!("no ready line from {} {}", program.display(), words.join(" ")).into());
        }
        Ok(server)
    }

    /// The same with connections to the port that follows `key` in its first line.
    pub fn start(program: &Path, words: &[&str], key: &str, connections: usize) -> Result<Server, Failure> {
        let mut server = Server::launch(program, words)?;
        let port = server.port(key)?;
        for _ in 0..connections {
            server.streams.push(connect("127.0.0.1", port)?);
        }
        Ok(server)
    }

    /// The number that follows `key` in its first line.
    pub fn port(&self, key: &str) -> Result<u16, Failure> {
        let (_, after) = self
            .ready
            .split_once(key)
            .ok_or_else(|| format!("no {key} in {:?}", self.ready))?;
        leading_number(after)
    }

    /// Address and port IP0 of each of its robots.
    pub fn robots(&self) -> Result<Vec<(String, u16)>, Failure> {
        let mut robots = Vec::new();
        for robot in self.ready.split("\"address\":\"").skip(1) {
            let (address, after) = robot.split_once('"').ok_or("no address")?;
            let (_, after) = after.split_once("\"ip0\":").ok_or("no port IP0")?;
            robots.push((address.to_owned(), leading_number(after)?));
        }
        Ok(robots)
    }

    /// Processor time of all its threads.
    pub fn processor(&self) -> Result<Duration, Failure> {
        let mut nanoseconds = 0;
        for task in fs::read_dir(format!("/proc/{}/task", self.child.id()))? {
            let statistics = fs::read_to_string(task?.path().join("schedstat"))?;
            let spent = statistics.split_whitespace().next().ok_or("no time")?;
            nanoseconds += spent.parse::<u64>()?;
        }
        Ok(Duration::from_nanos(nanoseconds))
    }

    /// Resident memory in kilobytes.
    pub fn memory(&self) -> Result<u32, Failure> {
        let status = fs::read_to_string(format!("/proc/{}/status", self.child.id()))?;
        let mut lines = status.lines();
        let line = lines
            .find_map(|line| line.strip_prefix("VmRSS:"))
            .ok_or("no VmRSS")?;
        Ok(line.trim().trim_end_matches(" kB").parse()?)
    }

    /// Ends it with SIGTERM; how long that takes.
    pub fn end(mut self) -> Result<Duration, Failure> {
        let began = Instant::now();
        rustix::process::kill_process(
            rustix::process::Pid::from_child(&self.child),
            rustix::process::Signal::TERM,
        )?;
        self.child.wait()?;
        Ok(began.elapsed())
    }

    /// Its first connection, to be used beside it.
    pub fn connection(&mut self) -> Result<TcpStream, Failure> {
        self.streams.pop().ok_or_else(|| "no connection".into())
    }

    pub fn exchange(&mut self, exchange: Exchange) -> Result<usize, Failure> {
        ask(self.streams.first_mut().ok_or("no connection")?, exchange)
    }

    pub fn send(&mut self, text: &[u8]) -> Result<(), Failure> {
        let stream = self.streams.first_mut().ok_or("no connection")?;
        Ok(stream.write_all(text)?)
    }

    /// Reads exactly this.
    pub fn wait_for(&mut self, text: &[u8]) -> Result<(), Failure> {
        let stream = self.streams.first_mut().ok_or("no connection")?;
        let mut found = vec![0; text.len()];
        stream.read_exact(&mut found)?;
        if found == text {
            Ok(())
        } else {
            Err(format!("expected {text:?}, found {found:?}").into())
        }
    }
}

pub fn connect(address: &str, port: u16) -> Result<TcpStream, Failure> {
    let stream = TcpStream::connect((address, port))?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    Ok(stream)
}

fn leading_number(text: &str) -> Result<u16, Failure> {
    let end = text.find(|found: char| !found.is_ascii_digit());
    let digits = text.get(..end.unwrap_or(text.len())).unwrap_or_default();
    Ok(digits.parse()?)
}

/// One exchange; the length of its reply.
pub fn ask(stream: &mut (impl Read + Write), exchange: Exchange) -> Result<usize, Failure> {
    stream.write_all(exchange.request)?;
    let length = read_text(stream)?;
    if let Some(confirm) = exchange.confirm {
        stream.write_all(confirm)?;
        // On one core the server takes it now, by itself.
        std::thread::yield_now();
    }
    Ok(length)
}

/// Reads to the end of a text; its length.
pub fn read_text(stream: &mut impl Read) -> Result<usize, Failure> {
    let mut buffer = [0; 4_096];
    let mut length = 0;
    loop {
        let count = stream.read(&mut buffer)?;
        length += count;
        match buffer.get(..count).and_then(<[u8]>::last) {
            None => return Err("the server has closed".into()),
            Some(&ETX) => return Ok(length),
            Some(_) => {}
        }
    }
}
