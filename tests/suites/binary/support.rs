//! A running `ts3100 serve`, and programs that run to their end.

use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::process::{Child, Command, Output, Stdio};
use ts3100_tests::host::{LONG, dial_address};

/// Where the program is.
pub const TS3100: &str = env!("CARGO_BIN_EXE_ts3100-suites");

/// The program, without the caller's configuration.
pub fn ts3100(words: &[&str]) -> Command {
    let mut command = Command::new(TS3100);
    // Usage lines begin with the name it was called by.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::arg0(&mut command, "ts3100");
    command.args(words);
    for (name, _) in std::env::vars_os() {
        if name.to_string_lossy().starts_with("TS3100_") {
            command.env_remove(name);
        }
    }
    // The emulators of the suites and those of the user do not see each other.
    command.env("XDG_RUNTIME_DIR", env!("CARGO_TARGET_TMPDIR"));
    command
}

/// Runs it to its end, which must come by itself.
pub fn run(words: &[&str]) -> Output {
    let mut command = ts3100(words);
    let piped = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let child = piped.spawn().unwrap();
    let id = child.id();
    let (ended, end) = std::sync::mpsc::channel();
    std::thread::spawn(move || ended.send(child.wait_with_output().unwrap()));
    end.recv_timeout(LONG).unwrap_or_else(|_| {
        kill("KILL", id);
        panic!("{words:?} does not end")
    })
}

/// Sends a signal to a process.
pub fn kill(signal: &str, id: u32) {
    assert!(
        Command::new("kill")
            .args(["-s", signal, &id.to_string()])
            .status()
            .unwrap()
            .success()
    );
}

/// Standard output as text.
pub fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Standard error as text.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The exit code is this one; what was printed is shown otherwise.
pub fn expect_code(output: &Output, code: i32) {
    let printed = (stdout(output), stderr(output));
    assert_eq!(output.status.code(), Some(code), "{printed:?}");
}

/// A running `ts3100 serve` or `ts3100 tap`, killed on drop.
pub struct Serve {
    child: Option<Child>,
    pub ports: Vec<Option<u16>>,
    /// URL of the control interface.
    pub control: Option<String>,
    /// The key `serial` of the ready line.
    pub serial: serde_json::Value,
    /// The key `robots` of the ready line, where there are several.
    pub robots: serde_json::Value,
}

impl Serve {
    /// Starts it on free ports and waits for its ready line.
    pub fn start(words: &[&str]) -> Serve {
        Serve::ready(&[&["serve"], words].concat())
    }

    /// As [`Serve::start`], with these variables of the environment.
    pub fn start_in(environment: &[(&str, &str)], words: &[&str]) -> Serve {
        let mut command = ts3100(&["serve"]);
        command.args(words).envs(environment.iter().copied());
        Serve::spawn(command)
    }

    /// Starts a subcommand with free ports and waits for its ready line.
    pub fn ready(words: &[&str]) -> Serve {
        Serve::spawn(ts3100(words))
    }

    fn spawn(mut command: Command) -> Serve {
        let mut child = command
            .args(["--ports", "auto", "--ready-json"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap())
            .read_line(&mut line)
            .unwrap();
        if line.is_empty() {
            let output = child.wait_with_output().unwrap();
            panic!(
                "not ready, {}: {}",
                output.status,
                String::from_utf8_lossy(&output.stderr)
            );
        }
        let ready: serde_json::Value = serde_json::from_str(&line).unwrap();
        assert_eq!(ready["event"], "ready");
        let ports = ["ip0", "ip1", "ip2", "ip3"].map(|name| {
            ready["ports"][name]
                .as_u64()
                .map(|port| u16::try_from(port).unwrap())
        });
        Serve {
            child: Some(child),
            ports: ports.to_vec(),
            control: ready["control"].as_str().map(str::to_owned),
            serial: ready["serial"].clone(),
            robots: ready["robots"].clone(),
        }
    }

    /// HOST:PORT of a channel.
    pub fn address(&self, channel: usize) -> String {
        format!("127.0.0.1:{}", self.ports[channel].unwrap())
    }

    /// A connection to a channel.
    pub fn dial(&self, channel: usize) -> TcpStream {
        dial_address(self.address(channel))
    }

    /// One command of the small host client.
    pub fn host(&self, words: &[&str]) -> Output {
        let address = self.address(0);
        let mut all = vec!["host", &address];
        all.extend(words);
        run(&all)
    }

    /// Ends it by a signal (`TERM`, `INT`, `KILL`) and waits.
    pub fn signal(self, name: &str) -> Output {
        self.signalled(name).wait_with_output().unwrap()
    }

    /// Sends it a signal.
    pub fn signalled(mut self, name: &str) -> Child {
        let child = self.child.take().unwrap();
        kill(name, child.id());
        child
    }
}

impl Drop for Serve {
    fn drop(&mut self) {
        if let Some(mut child) = self.child.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
