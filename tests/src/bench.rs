//! A running emulator on a test bench: in this process, with a control interface and a client of it.

use crate::host::{Host, dial, dial_address};
use serde_json::Value;
use std::io::Write;
use std::net::TcpStream;
use ts3100_controller::port::Port;
use ts3100_emulator::client::Client;
use ts3100_emulator::clock::TimeMode;
use ts3100_emulator::control::ControlSettings;
use ts3100_emulator::embed::{Builder, Emulator};

/// An emulator and a client of its control interface.
pub struct Bench {
    /// The emulator.
    pub emulator: Emulator,
    /// The client.
    pub client: Client,
}

/// On free ports, in stepped time.
pub fn builder() -> Builder {
    Emulator::builder()
        .control(ControlSettings::free())
        .time(TimeMode::Stepped)
}

/// With this program selected and servo power on, in stepped time.
pub fn running(program: &str) -> Bench {
    Bench::start(builder().file("TEST", program).select("TEST").servo_on(true))
}

impl Bench {
    /// Starts it.
    pub fn start(builder: Builder) -> Bench {
        let emulator = builder.start().unwrap();
        let client = Client::new(&format!("http://{}", emulator.control().unwrap()), None).unwrap();
        Bench { emulator, client }
    }

    /// Calls and expects success.
    pub fn ok(&self, method: &str, path: &str, body: &str) -> Value {
        let (status, answer) = self.call(method, path, body);
        assert_eq!(status, 200, "{method} {path} {body}: {answer}");
        answer
    }

    /// GET.
    pub fn get(&self, path: &str) -> Value {
        self.ok("GET", path, "")
    }

    /// PUT.
    pub fn put(&self, path: &str, body: &str) -> Value {
        self.ok("PUT", path, body)
    }

    /// POST.
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

    /// Calls; the status and the body.
    pub fn call_text(&self, method: &str, path: &str, body: &str) -> (u16, String) {
        let body = Some(body).filter(|body| !body.is_empty());
        self.client.call(method, path, body).unwrap()
    }

    /// Calls; the status and the JSON of the body.
    pub fn call(&self, method: &str, path: &str, body: &str) -> (u16, Value) {
        let (status, text) = self.call_text(method, path, body);
        let answer = serde_json::from_str(&text).unwrap_or_else(|_| panic!("{status} {text}"));
        (status, answer)
    }

    /// Raw bytes to the interface, and all that comes back.
    pub fn raw(&self, bytes: &[u8]) -> String {
        let mut stream = dial_address(self.emulator.control().unwrap());
        // What is refused early may be reset.
        let _ = stream.write_all(bytes);
        String::from_utf8_lossy(&stream.rest().0).into_owned()
    }

    /// Connects to a port.
    pub fn dial(&self, port: Port) -> TcpStream {
        dial(&self.emulator, port)
    }

    /// A host on IP0 that the controller knows.
    pub fn host(&self) -> TcpStream {
        let mut host = self.dial(Port::Ip0);
        // Its answer shows that the controller has met it.
        host.command("SU");
        host
    }
}
