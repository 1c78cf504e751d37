//! A small client of the control interface: one request, one connection, blocking. It speaks HTTP/1.0, in which an
//! answer ends with its connection, so that nothing has to be known of chunks and pools; there is no TLS, because the
//! interface has none.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// Longest head of an answer in bytes.
const MAX_HEAD: u64 = 16 * 1024;
/// Longest answer in bytes: the state with every file and variable fits many times.
const MAX_ANSWER: u64 = 16 * 1024 * 1024;
/// Longest wait for a connection.
const CONNECT: Duration = Duration::from_secs(5);
/// Longest wait for an answer: what the interface itself waits at most, and something.
const ANSWER: Duration = Duration::from_secs(610);

/// Where a control interface is, and the token it wants.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Client {
    /// `HOST:PORT`.
    authority: String,
    token: Option<String>,
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// Not a URL of a control interface.
    #[error("expected http://HOST:PORT, found `{0}`")]
    Url(String),
    /// The token cannot be sent.
    #[error("a token is made of visible ASCII characters")]
    Token,
    /// Nobody answers there.
    #[error("no control interface answers at http://{authority}: {reason}")]
    Unreachable {
        /// Where.
        authority: String,
        /// What the system said.
        reason: io::Error,
    },
    /// What came is no answer.
    #[error("no HTTP answer from http://{authority}: {reason}")]
    Answer {
        /// Where.
        authority: String,
        /// What is wrong with it.
        reason: String,
    },
}

/// An answer whose head has been read.
pub struct Answer {
    /// Its status.
    pub status: u16,
    /// Its body, still to be read.
    pub body: io::Take<BufReader<TcpStream>>,
}

impl Client {
    /// Of the interface at `url`, `http://HOST:PORT` with or without a slash behind it.
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
        })
    }

    /// Sends a request; `body` is JSON. The path must be encoded as a URL wants it; see [`encoded`].
    ///
    /// # Errors
    /// [`ClientError::Unreachable`], [`ClientError::Answer`].
    pub fn send(&self, method: &str, path: &str, body: Option<&str>) -> Result<Answer, ClientError> {
        let unreachable = |reason| ClientError::Unreachable {
            authority: self.authority.clone(),
            reason,
        };
        let mut stream = self.connect().map_err(unreachable)?;
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
        match self.read_head(stream) {
            Ok(answer) => Ok(answer),
            Err(error) => Err(written.err().map_or(error, unreachable)),
        }
    }

    /// Sends a request and reads the whole answer: its status, its body.
    ///
    /// # Errors
    /// As of [`Client::send`].
    pub fn call(&self, method: &str, path: &str, body: Option<&str>) -> Result<(u16, String), ClientError> {
        let mut answer = self.send(method, path, body)?;
        let mut text = Vec::new();
        let read = answer.body.read_to_end(&mut text);
        read.map_err(|error| self.no_answer(&error.to_string()))?;
        Ok((answer.status, String::from_utf8_lossy(&text).into_owned()))
    }

    fn connect(&self) -> io::Result<TcpStream> {
        let mut last = io::Error::from(io::ErrorKind::AddrNotAvailable);
        for address in self.authority.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, CONNECT) {
                Ok(stream) => {
                    stream.set_read_timeout(Some(ANSWER))?;
                    stream.set_write_timeout(Some(CONNECT))?;
                    return Ok(stream);
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    }

    fn no_answer(&self, reason: &str) -> ClientError {
        ClientError::Answer {
            authority: self.authority.clone(),
            reason: reason.to_owned(),
        }
    }

    fn read_head(&self, stream: TcpStream) -> Result<Answer, ClientError> {
        let mut reader = BufReader::new(stream).take(MAX_HEAD);
        let line = |reader: &mut io::Take<BufReader<TcpStream>>| {
            let mut text = Vec::new();
            let read = reader.read_until(b'\n', &mut text);
            read.map_err(|error| self.no_answer(&error.to_string()))?;
            if text.ends_with(b"\n") {
                Ok(String::from_utf8_lossy(&text).trim_end().to_owned())
            } else {
                Err(self.no_answer("its head is not complete"))
            }
        };
        let first = line(&mut reader)?;
        let mut words = first.split(' ');
        let status = match (words.next(), words.next().map(str::parse::<u16>)) {
            (Some(version), Some(Ok(status))) if version.starts_with("HTTP/1.") => status,
            _ => return Err(self.no_answer(&format!("it begins with `{first}`"))),
        };
        while !line(&mut reader)?.is_empty() {}
        let mut body = reader;
        body.set_limit(MAX_ANSWER);
        Ok(Answer { status, body })
    }
}

/// One segment of a path as a URL wants it.
#[must_use]
pub fn encoded(segment: &str) -> String {
    segment.bytes().fold(String::new(), |mut text, byte| {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
            text.push(char::from(byte));
        } else {
            text.push_str(&format!("%{byte:02X}"));
        }
        text
    })
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

    #[test]
    fn a_segment_is_encoded() {
        assert_eq!(encoded("A(1,2)"), "A%281%2C2%29");
        assert_eq!(encoded("USER.PAR"), "USER.PAR");
        assert_eq!(encoded("a/../b ü"), "a%2F..%2Fb%20%C3%BC");
    }
}
