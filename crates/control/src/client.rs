//! A small blocking client of the control interface, used by `ts3100 ctl`: one connection for each request.
//!
//! It speaks HTTP/1.0, where the end of the connection ends the response, so it needs neither chunked encoding nor
//! a connection pool. It has no TLS because the control interface has none. It does not know which calls exist; see
//! `cli::ctl::call` for those and [`crate`] for the server.

use std::io::{self, BufRead as _, BufReader, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

/// Longest head of an answer in bytes.
const MAX_HEAD: u64 = 16 * 1024;
/// Longest body in bytes. The state with every file and variable is far smaller.
const MAX_BODY: u64 = 16 * 1024 * 1024;
/// Most characters of an answer that a message shows.
const MAX_SHOWN: usize = 100;
/// Longest wait for a connection.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
/// Default limit for a whole call. It is added to the wait of calls that wait.
pub const DEFAULT_TIMEOUT: Duration = Duration::from_secs(10);
/// Longest wait for the answer of a robot's port to something other than a command.
const PROBE_TIMEOUT: Duration = Duration::from_millis(300);
/// End of a text of the robot's protocol.
const ETX: u8 = 0x03;
/// The reply of a robot that has not understood a text.
const NG: &[u8] = b"NG";

/// Address and token of a control interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Client {
    /// `HOST:PORT`.
    authority: String,
    token: Option<String>,
    /// Longest time for a whole call, from connecting to the end of the body.
    timeout: Duration,
}

/// Why a call has no response.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// Not a URL of a control interface.
    #[error("URL of the control interface: expected http://HOST:PORT, found `{0}`")]
    Url(String),
    /// The token cannot be sent.
    #[error("cannot send the token: it may only have visible ASCII characters")]
    Token,
    /// The connection could not be made or broke while sending.
    #[error("cannot reach a control interface at http://{authority}: {reason}")]
    Unreachable {
        /// `HOST:PORT` of the interface.
        authority: String,
        /// The error of the operating system.
        reason: io::Error,
    },
    /// Connected, but the response is late.
    #[error(
        "http://{authority} accepts connections but has not answered within {} s",
        limit.as_secs_f64()
    )]
    Late {
        /// `HOST:PORT` of the interface.
        authority: String,
        /// The limit of the call.
        limit: Duration,
    },
    /// A port for commands of the host is at this address.
    #[error("IP0 of a robot answers at http://{authority}, not the control interface")]
    Robot {
        /// `HOST:PORT` that was called.
        authority: String,
    },
    /// The response is not valid HTTP or is incomplete.
    #[error("cannot read the answer from http://{authority}: {reason}")]
    InvalidResponse {
        /// `HOST:PORT` of the interface.
        authority: String,
        reason: String,
    },
}

/// A response whose head has been read.
pub struct Response {
    /// The HTTP status code.
    pub status: u16,
    /// The body, to be read from the connection.
    pub body: Body,
}

impl Client {
    /// A client for the interface at `url`: `http://HOST:PORT` with or without a trailing slash.
    ///
    /// # Errors
    /// Another scheme, a path, no port, or a token that no header can carry.
    pub fn new(url: &str, token: Option<String>) -> Result<Client, ClientError> {
        let wrong = || ClientError::Url(url.to_owned());
        let authority = url.strip_prefix("http://").ok_or_else(wrong)?;
        let authority = authority.strip_suffix('/').unwrap_or(authority);
        let (host, port) = authority.rsplit_once(':').ok_or_else(wrong)?;
        let plain = host
            .bytes()
            .all(|byte| byte.is_ascii_graphic() && byte != b'/' && byte != b'@');
        if host.is_empty() || !plain || port.parse::<u16>().is_err() {
            return Err(wrong());
        }
        if token
            .as_ref()
            .is_some_and(|token| !token.bytes().all(|byte| byte.is_ascii_graphic()))
        {
            return Err(ClientError::Token);
        }
        Ok(Client {
            authority: authority.to_owned(),
            token,
            timeout: DEFAULT_TIMEOUT,
        })
    }

    /// Sets the limit for a whole call; the default is [`DEFAULT_TIMEOUT`].
    #[must_use]
    pub fn with_timeout(self, limit: Duration) -> Client {
        Client {
            timeout: limit,
            ..self
        }
    }

    /// Sends a request; `body` is JSON. The path must be percent-encoded.
    ///
    /// # Errors
    /// [`ClientError::Unreachable`], [`ClientError::InvalidResponse`].
    pub fn send(&self, method: &str, path: &str, body: Option<&str>) -> Result<Response, ClientError> {
        let unreachable = |reason| ClientError::Unreachable {
            authority: self.authority.clone(),
            reason,
        };
        let until = Instant::now() + self.timeout;
        let mut stream = self.connect(until).map_err(unreachable)?;
        let mut request = format!("{method} {path} HTTP/1.0\r\nHost: {}\r\n", self.authority);
        if let Some(token) = &self.token {
            request.push_str(&format!("Authorization: Bearer {token}\r\n"));
        }
        if let Some(body) = body {
            let length = body.len();
            request.push_str(&format!(
                "Content-Type: application/json\r\nContent-Length: {length}\r\n"
            ));
        }
        request.push_str("\r\n");
        request.push_str(body.unwrap_or_default());
        // A server that refuses early may close before it has read everything: its answer counts.
        let written = stream.write_all(request.as_bytes());
        let probed = stream.try_clone();
        let stream = DeadlineStream {
            stream,
            deadline: Some(until),
        };
        match (self.read_head(stream), written) {
            (Ok(answer), _) => Ok(answer),
            (Err(_), Err(reason)) => Err(unreachable(reason)),
            (Err(ClientError::Late { authority, .. }), Ok(())) if probed.is_ok_and(is_robot) => {
                Err(ClientError::Robot { authority })
            }
            (Err(error), Ok(())) => Err(error),
        }
    }

    /// Sends a request and reads the whole response: status and body.
    ///
    /// # Errors
    /// As [`Client::send`].
    pub fn call(&self, method: &str, path: &str, body: Option<&str>) -> Result<(u16, String), ClientError> {
        let mut answer = self.send(method, path, body)?;
        let mut text = Vec::new();
        let read = answer.body.read_to_end(&mut text);
        read.map_err(|error| self.invalid_response(&error.to_string()))?;
        Ok((answer.status, String::from_utf8_lossy(&text).into_owned()))
    }

    fn connect(&self, until: Instant) -> io::Result<TcpStream> {
        let mut last = io::Error::from(io::ErrorKind::AddrNotAvailable);
        for address in self.authority.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, time_left(until)?.min(CONNECT_TIMEOUT)) {
                Ok(stream) => {
                    stream.set_write_timeout(Some(time_left(until)?))?;
                    return Ok(stream);
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    }

    fn invalid_response(&self, reason: &str) -> ClientError {
        ClientError::InvalidResponse {
            authority: self.authority.clone(),
            reason: reason.to_owned(),
        }
    }

    fn read_head(&self, stream: DeadlineStream) -> Result<Response, ClientError> {
        let mut reader = BufReader::new(stream).take(MAX_HEAD);
        let first = self.read_line(&mut reader)?;
        let mut words = first.split(' ');
        let status = match (words.next(), words.next().map(str::parse::<u16>)) {
            (Some(version), Some(Ok(status))) if version.starts_with("HTTP/1.") => status,
            _ => {
                let begin: String = first.chars().take(MAX_SHOWN).collect();
                return Err(self.invalid_response(&format!("it begins with `{begin}`")));
            }
        };
        let mut length = None;
        loop {
            let line = self.read_line(&mut reader)?;
            let Some((name, value)) = line.split_once(':') else {
                break;
            };
            if name.eq_ignore_ascii_case("content-length") {
                let number = value.trim().parse::<u64>();
                let number =
                    number.map_err(|_| self.invalid_response("its Content-Length is not a number"))?;
                length = Some(number);
            } else if name.eq_ignore_ascii_case("transfer-encoding") {
                return Err(self.invalid_response("it has a Transfer-Encoding, which HTTP/1.0 does not know"));
            }
        }
        let body = Body {
            reader: reader.into_inner(),
            remaining: length,
            most: MAX_BODY,
            size_limit: MAX_BODY,
        };
        Ok(Response { status, body })
    }

    /// Reads one line of the head.
    fn read_line(&self, reader: &mut io::Take<BufReader<DeadlineStream>>) -> Result<String, ClientError> {
        let mut text = Vec::new();
        let read = reader.read_until(b'\n', &mut text);
        read.map_err(|error| {
            if error.kind() == io::ErrorKind::TimedOut && text.starts_with(NG) {
                // It has taken each line of the request for a text without ETX.
                ClientError::Robot {
                    authority: self.authority.clone(),
                }
            } else if error.kind() == io::ErrorKind::TimedOut {
                ClientError::Late {
                    authority: self.authority.clone(),
                    limit: self.timeout,
                }
            } else {
                self.invalid_response(&error.to_string())
            }
        })?;
        if text.ends_with(b"\n") {
            Ok(String::from_utf8_lossy(&text).trim_end().to_owned())
        } else {
            Err(self.invalid_response("its head is incomplete"))
        }
    }
}

/// Whether a robot waits at the other end: it has taken the request for the beginning of a text, and answers its end.
fn is_robot(mut stream: TcpStream) -> bool {
    let mut reply = [0; 64];
    let asked = stream
        .set_read_timeout(Some(PROBE_TIMEOUT))
        .and_then(|()| stream.write_all(&[ETX]))
        .and_then(|()| stream.read(&mut reply));
    let length = asked.unwrap_or_default();
    let reply = reply.get(..length).unwrap_or_default();
    reply.windows(NG.len()).any(|part| part == NG)
}

/// The time until `until`, or an error once it has passed.
fn time_left(until: Instant) -> io::Result<Duration> {
    let left = until.saturating_duration_since(Instant::now());
    if left.is_zero() {
        let reason = "the call took longer than --timeout";
        return Err(io::Error::new(io::ErrorKind::TimedOut, reason));
    }
    Ok(left)
}

/// A connection with a deadline for all reads together. A read timeout alone would restart with every byte.
struct DeadlineStream {
    stream: TcpStream,
    deadline: Option<Instant>,
}

impl Read for DeadlineStream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let limit = self.deadline.map(time_left).transpose()?;
        self.stream.set_read_timeout(limit)?;
        match (self.stream.read(buffer), self.deadline) {
            (Err(error), Some(until))
                if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) =>
            {
                // The message of `time_left` instead of the system's, unless the timer fired a little early.
                time_left(until).and(Err(io::ErrorKind::Interrupted.into()))
            }
            (result, _) => result,
        }
    }
}

/// The body of a response. Reading fails if it ends before its Content-Length or exceeds the size limit.
pub struct Body {
    reader: BufReader<DeadlineStream>,
    /// Bytes of Content-Length that have not been read; `None` without that header.
    remaining: Option<u64>,
    /// Bytes that may be read in all.
    most: u64,
    /// Bytes that may still be read.
    size_limit: u64,
}

impl Body {
    /// Sets another size limit, for a file or a stream of events.
    pub fn set_size_limit(&mut self, most: u64) {
        (self.most, self.size_limit) = (most, most);
    }

    /// Lifts the deadline, for a stream of events without an end.
    pub fn lift_deadline(&mut self) {
        self.reader.get_mut().deadline = None;
    }
}

impl Read for Body {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let most = self.remaining.unwrap_or(u64::MAX).min(self.size_limit);
        if most == 0 && self.remaining != Some(0) {
            return Err(io::Error::other(format!("more than {} bytes", self.most)));
        }
        let read = (&mut self.reader).take(most).read(buffer)?;
        if let Some(missing) = self.remaining.filter(|missing| read == 0 && *missing > 0)
            && !buffer.is_empty()
        {
            let reason = format!("it is cut short: {missing} bytes are missing");
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, reason));
        }
        self.remaining = self.remaining.map(|missing| missing - read as u64);
        self.size_limit -= read as u64;
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_url_is_scheme_host_and_port() {
        for url in [
            "http://127.0.0.1:3100",
            "http://localhost:3100/",
            "http://[::1]:3100",
        ] {
            assert!(Client::new(url, None).is_ok(), "{url}");
        }
        for url in [
            "",
            "127.0.0.1:3100",
            "https://a:1",
            "http://a",
            "http://:1",
            "http://a:99999",
            "http://a:1/state",
            "http://a@b:1",
            "http://a\r\nb:1",
        ] {
            assert!(Client::new(url, None).is_err(), "{url}");
        }
        assert!(Client::new("http://a:1", Some("a\r\nb".to_owned())).is_err());
    }

    /// Result of the client when the server sends these bytes and closes.
    fn response_to(bytes: &'static str) -> Result<(u16, String), String> {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        let server = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().unwrap();
            let mut head = io::BufReader::new(stream.try_clone().unwrap());
            let mut line = String::new();
            while line != "\r\n" {
                line.clear();
                head.read_line(&mut line).unwrap();
            }
            stream.write_all(bytes.as_bytes()).unwrap();
        });
        let answer = Client::new(&url, None).unwrap().call("GET", "/health", None);
        server.join().unwrap();
        answer.map_err(|error| error.to_string())
    }

    #[test]
    fn an_answer_that_is_cut_short_is_none() {
        for (bytes, expected) in [
            ("HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n{}", Ok("{}")),
            ("HTTP/1.1 200 OK\r\ncontent-length: 1\r\n\r\n{}", Ok("{")),
            ("HTTP/1.1 200 OK\r\n\r\n{}", Ok("{}")),
            ("HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n", Ok("")),
            (
                "HTTP/1.1 200 OK\r\nContent-Length: 9\r\n\r\n{}",
                Err("it is cut short: 7 bytes are missing"),
            ),
            (
                "HTTP/1.1 200 OK\r\nContent-Length: -1\r\n\r\n{}",
                Err("its Content-Length is not a number"),
            ),
            (
                "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n",
                Err("it has a Transfer-Encoding"),
            ),
            ("HTTP/1.1 200 OK\r\nContent-Le", Err("its head is incomplete")),
            ("\x1b[2J\r\n\r\n", Err("it begins with")),
        ] {
            match (response_to(bytes), expected) {
                (Ok((200, text)), Ok(expected)) => assert_eq!(text, expected, "{bytes}"),
                (Err(error), Err(expected)) => assert!(error.contains(expected), "{bytes}: {error}"),
                (found, _) => panic!("{bytes}: {found:?}"),
            }
        }
    }
}
