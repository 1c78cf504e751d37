//! An emulator with a control interface, a host of it, and one who calls.

use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;
use ts3100_controller::port::Port;
use ts3100_emulator::client::Client;
use ts3100_emulator::clock::TimeMode;
use ts3100_emulator::control::ControlSettings;
use ts3100_emulator::embed::{Builder, Emulator};

const LONG: Duration = Duration::from_secs(30);

/// One with a control interface.
pub struct Robot {
    pub emulator: Emulator,
    pub client: Client,
}

/// On free ports, in stepped time.
pub fn builder() -> Builder {
    Emulator::builder()
        .control(ControlSettings::free())
        .time(TimeMode::Stepped)
}

/// With this program selected and servo power on, in stepped time.
pub fn running(program: &str) -> Robot {
    Robot::start(builder().file("TEST", program).select("TEST").servo_on(true))
}

impl Robot {
    pub fn start(builder: Builder) -> Robot {
        let emulator = builder.start().unwrap();
        let client = Client::new(&format!("http://{}", emulator.control().unwrap()), None).unwrap();
        Robot { emulator, client }
    }

    /// Calls and expects success.
    pub fn ok(&self, method: &str, path: &str, body: &str) -> Value {
        let (status, answer) = self.call(method, path, body);
        assert_eq!(status, 200, "{method} {path} {body}: {answer}");
        answer
    }

    pub fn get(&self, path: &str) -> Value {
        self.ok("GET", path, "")
    }

    pub fn put(&self, path: &str, body: &str) -> Value {
        self.ok("PUT", path, body)
    }

    pub fn post(&self, path: &str, body: &str) -> Value {
        self.ok("POST", path, body)
    }

    /// Calls and expects this refusal.
    pub fn refused(&self, status: u16, method: &str, path: &str, body: &str) -> String {
        let (found, answer) = self.call(method, path, body);
        assert_eq!(found, status, "{method} {path} {body}: {answer}");
        let words = answer["error"].as_str().unwrap_or_else(|| panic!("{answer}"));
        words.to_owned()
    }

    pub fn call_text(&self, method: &str, path: &str, body: &str) -> (u16, String) {
        let body = Some(body).filter(|body| !body.is_empty());
        self.client.call(method, path, body).unwrap()
    }

    pub fn call(&self, method: &str, path: &str, body: &str) -> (u16, Value) {
        let (status, text) = self.call_text(method, path, body);
        let answer = serde_json::from_str(&text).unwrap_or_else(|_| panic!("{status} {text}"));
        (status, answer)
    }

    /// Raw bytes to the interface, and all that comes back.
    pub fn raw(&self, bytes: &[u8]) -> String {
        let mut stream = TcpStream::connect(self.emulator.control().unwrap()).unwrap();
        stream.set_read_timeout(Some(LONG)).unwrap();
        // What is refused early may be reset.
        let _ = stream.write_all(bytes);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    pub fn dial(&self, port: Port) -> TcpStream {
        let stream = TcpStream::connect(self.emulator.address(port).unwrap()).unwrap();
        stream.set_read_timeout(Some(LONG)).unwrap();
        stream
    }

    /// A host on IP0 that the controller knows.
    pub fn host(&self) -> Host {
        let mut host = Host(self.dial(Port::Ip0));
        // Its answer shows that the controller has met it.
        host.command("SU");
        host
    }
}

/// One end of a protocol port.
pub struct Host(pub TcpStream);

impl Host {
    /// Sends a command; the answer without STX, CR and ETX. An FL text is acknowledged.
    pub fn command(&mut self, command: &str) -> String {
        let text = self.ask(command);
        String::from_utf8_lossy(&text).trim_end_matches('\r').to_owned()
    }

    fn ask(&mut self, command: &str) -> Vec<u8> {
        let text = format!("\x02{command}\r\x03");
        self.0.write_all(text.as_bytes()).unwrap();
        let text = self.text();
        if text.starts_with(b"FL,") {
            self.0.write_all(b"\x02OK\r\x03").unwrap();
        }
        text
    }

    /// The 276 bytes of SF.
    pub fn sf(&mut self) -> Vec<u8> {
        self.0.write_all(b"\x02SF\r\x03").unwrap();
        let mut answer = [0; 282];
        self.0.read_exact(&mut answer).unwrap();
        self.0.write_all(b"\x02OK\r\x03").unwrap();
        answer[4..280].to_vec()
    }

    /// The data section of the next text that comes.
    pub fn text(&mut self) -> Vec<u8> {
        let mut found = Vec::new();
        let mut byte = [0];
        loop {
            self.0.read_exact(&mut byte).unwrap();
            match byte[0] {
                0x02 => found.clear(),
                0x03 => return found,
                other => found.push(other),
            }
        }
    }

    /// Whether the connection has ended.
    pub fn has_ended(&mut self) -> bool {
        let mut rest = Vec::new();
        match self.0.read_to_end(&mut rest) {
            Ok(_) => true,
            Err(error) => error.kind() == std::io::ErrorKind::ConnectionReset,
        }
    }
}
