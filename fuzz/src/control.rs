//! Fuzzes the control interface: calls, each a line `METHOD PATH` and its body, with a zero byte between two. An emulator in
//! this process answers them over a socket of the loopback.
//!
//! Nothing panics. Each call has an answer, an object where the interface says JSON. A call that is refused says why, and
//! none is answered with an internal error. Afterwards the state can be read. What waits or sends for long is left out:
//! `/wait`, `/events`, and more than [`MAX_SECONDS`] of virtual time.

use serde_json::Value;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;
use ts3100_emulator::clock::TimeMode;
use ts3100_emulator::control::ControlSettings;
use ts3100_emulator::embed::Emulator;

/// Calls of one run.
const CALLS: usize = 12;
/// Largest number in the body of a call that advances time: a program may run in it.
const MAX_SECONDS: f64 = 10.0;
/// The calls that are left out.
const LEFT_OUT: [&str; 2] = ["/wait", "/events"];
/// Longest time that a call may take.
const TIMEOUT: Duration = Duration::from_secs(20);

/// The emulator and a connection to its control interface.
struct Caller {
    emulator: Emulator,
    address: SocketAddr,
    connection: Option<BufReader<TcpStream>>,
}

/// An answer: its status, whether it says that it is JSON, and its body.
type Answer = (u16, bool, Vec<u8>);

impl Caller {
    fn new() -> Caller {
        let builder = Emulator::builder()
            .control(ControlSettings::free())
            .time(TimeMode::Stepped);
        let emulator = builder
            .start()
            .unwrap_or_else(|error| panic!("cannot start an emulator: {error}"));
        let address = emulator
            .control()
            .unwrap_or_else(|| panic!("the emulator has no control interface"));
        Caller {
            emulator,
            address,
            connection: None,
        }
    }

    /// Returns to the state at the start.
    fn reset(&self) {
        let reset = self
            .emulator
            .reset()
            .and_then(|()| self.emulator.set_time_mode(TimeMode::Stepped));
        reset.unwrap_or_else(|error| panic!("the emulator has ended: {error}"));
        for name in self.emulator.snapshots().unwrap_or_default() {
            // Somebody may have replaced the emulator by one without it.
            let _gone = self.emulator.delete_snapshot(&name);
        }
    }

    fn call(&mut self, method: &str, path: &str, body: &[u8]) -> Answer {
        // A connection that was idle for long is closed by the emulator.
        let old = self
            .connection
            .take()
            .and_then(|old| exchange(old, method, path, body).ok());
        let (answer, connection) = old.unwrap_or_else(|| {
            let connected = TcpStream::connect(self.address).and_then(|stream| {
                stream.set_nodelay(true)?;
                stream.set_read_timeout(Some(TIMEOUT))?;
                exchange(BufReader::new(stream), method, path, body)
            });
            connected.unwrap_or_else(|error| panic!("{method} {path} is not answered: {error}"))
        });
        self.connection = Some(connection);
        answer
    }
}

/// Sends a call and reads its answer.
fn exchange(
    mut connection: BufReader<TcpStream>,
    method: &str,
    path: &str,
    body: &[u8],
) -> std::io::Result<(Answer, BufReader<TcpStream>)> {
    let length = body.len();
    let head = format!(
        "{method} {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: {length}\r\n\r\n"
    );
    connection
        .get_mut()
        .write_all(&[head.as_bytes(), body].concat())?;
    let (mut status, mut is_json, mut length) = (0, false, 0);
    for number in 0.. {
        let mut line = String::new();
        if connection.read_line(&mut line)? == 0 {
            return Err(std::io::ErrorKind::UnexpectedEof.into());
        }
        let line = line.trim_end().to_ascii_lowercase();
        match line.split_once(' ') {
            Some((_, rest)) if number == 0 => {
                status = rest.get(..3).and_then(|code| code.parse().ok()).unwrap_or(0);
            }
            Some(("content-length:", value)) => length = value.parse().unwrap_or(0),
            Some(("content-type:", value)) => is_json = value.starts_with("application/json"),
            Some(_) => {}
            None => break,
        }
    }
    let mut answer = vec![0; length];
    connection.read_exact(&mut answer)?;
    Ok(((status, is_json, answer), connection))
}

/// The method, the path and the body of a call; `None` for what no client of HTTP can send, and for what is left out.
fn call_of(text: &[u8]) -> Option<(&str, &str, &[u8])> {
    let end = text.iter().position(|byte| *byte == b'\n').unwrap_or(text.len());
    let (line, body) = text.split_at(end);
    let (method, path) = str::from_utf8(line).ok()?.split_once(' ')?;
    let body = body.get(1..).unwrap_or_default();
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/_.-~%?&=,:+".contains(&byte);
    let can_be_sent = ["GET", "PUT", "POST", "DELETE"].contains(&method)
        && path.starts_with('/')
        && path.bytes().all(plain);
    let left_out =
        LEFT_OUT.iter().any(|left_out| path.contains(left_out)) || path.contains("/advance") && is_long(body);
    (can_be_sent && !left_out).then_some((method, path, body))
}

/// Whether a body has a number above [`MAX_SECONDS`].
fn is_long(body: &[u8]) -> bool {
    fn largest(value: &Value) -> f64 {
        let of = |values: &mut dyn Iterator<Item = &Value>| values.map(largest).fold(0.0, f64::max);
        match value {
            Value::Number(number) => number.as_f64().unwrap_or(f64::MAX),
            Value::Array(items) => of(&mut items.iter()),
            Value::Object(fields) => of(&mut fields.values()),
            _ => 0.0,
        }
    }
    serde_json::from_slice(body).is_ok_and(|body| largest(&body) > MAX_SECONDS)
}

/// Makes the calls.
///
/// # Panics
/// When what must hold does not.
pub fn check(data: &[u8]) {
    static CALLER: Mutex<Option<Caller>> = Mutex::new(None);
    let mut calls = data
        .split(|byte| *byte == 0)
        .take(CALLS)
        .filter_map(call_of)
        .peekable();
    if calls.peek().is_none() {
        return;
    }
    let mut caller = CALLER.lock().unwrap_or_else(PoisonError::into_inner);
    let caller = caller.get_or_insert_with(Caller::new);
    caller.reset();
    for (method, path, body) in calls {
        let (status, is_json, answer) = caller.call(method, path, body);
        let said = answer.escape_ascii();
        assert!(
            (200..500).contains(&status) || status == 503,
            "{method} {path}: {status} {said}"
        );
        let document = serde_json::from_slice::<Value>(&answer);
        assert!(!is_json || document.is_ok(), "{method} {path}: {status} {said}");
        // A page of the book says to a person that it is not there.
        let is_page = path.contains("/book/") && !is_json && !answer.is_empty();
        if status >= 400 && !is_page {
            let reason = document
                .ok()
                .and_then(|problem| problem["error"].as_str().map(str::len));
            assert!(
                reason.is_some_and(|length| length > 0),
                "{method} {path}: {status} {said}"
            );
        }
    }
    let (status, _, answer) = caller.call("GET", "/state", b"");
    assert_eq!(status, 200, "{}", answer.escape_ascii());
}
