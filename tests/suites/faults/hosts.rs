//! Two hosts that do the same work. The careful one has time limits, compares what it reads with what can be meant,
//! drops what it did not request, reads the status, and repeats what was not done. The careless one takes one
//! segment for one text, waits once, and goes on whatever came.
//!
//! They share nothing but the controller of `world.rs`.

use super::world::{NoBytes, World};
use std::time::Duration;
use ts3100_controller::Port;
use ts3100_proto::text::{EOF, ETX, STX};

/// The pause that the manual advises (TRN-04).
const PAUSE: Duration = Duration::from_millis(50);
/// Longest silence before a careful host gives a text up: as long as the robot's own (SER-06).
const SILENCE: Duration = Duration::from_secs(10);
/// How often it tries.
const TRIES: usize = 6;
/// How long a careless host waits.
const IMPATIENCE: Duration = Duration::from_secs(2);

/// What went wrong, for the person who looks at the test.
pub type Outcome<T> = Result<T, String>;

/// What a host has to be able to do.
pub trait Host {
    /// A command that is answered OK.
    fn command(&mut self, world: &mut World, command: &str) -> Outcome<()>;
    /// A command that is answered by a file: its content.
    fn file(&mut self, world: &mut World, command: &str, begins: &str) -> Outcome<Vec<u8>>;
    /// Stores a file.
    fn download(&mut self, world: &mut World, name: &str, content: &str) -> Outcome<()>;
    /// Starts the program and sees to it that it comes to its end.
    fn cycle(&mut self, world: &mut World) -> Outcome<()>;
    /// Sends a record to the program on a channel: the record that the program answers.
    fn record(&mut self, world: &mut World, port: Port, record: &str) -> Outcome<String>;
    /// Reads records that the program sends unasked.
    fn records(&mut self, world: &mut World, port: Port, count: usize) -> Outcome<Vec<String>>;
}

fn text(data: &[u8]) -> Vec<u8> {
    [&[STX], data, &[ETX]].concat()
}

/// The texts of a file.
fn blocks(content: &str) -> Vec<Vec<u8>> {
    let whole = [b"FL,", content.as_bytes(), &[EOF]].concat();
    whole.chunks(253).map(<[u8]>::to_vec).collect()
}

/// The careful host.
pub struct Careful {
    port: Port,
    kept: Vec<u8>,
    stopped: bool,
}

impl Careful {
    pub fn new(world: &mut World, port: Port) -> Careful {
        world.connect(port);
        Careful {
            port,
            kept: Vec::new(),
            stopped: false,
        }
    }

    /// Connects again, as often as it takes.
    fn again(&mut self, world: &mut World) {
        self.kept.clear();
        world.hang_up(self.port);
        for _ in 0..TRIES * 4 {
            if world.connect(self.port) {
                return;
            }
            world.pass(Duration::from_secs(1));
        }
    }

    /// Sends a text; what lies there unasked is dropped before.
    fn send(&mut self, world: &mut World, data: &[u8]) -> Result<(), NoBytes> {
        world.pass(PAUSE);
        while let Ok(bytes) = world.read(self.port, Duration::ZERO) {
            self.kept.extend(bytes);
        }
        self.note_stops();
        self.kept.clear();
        world.write(self.port, &text(data))
    }

    fn note_stops(&mut self) {
        let sp = text(b"SP\r");
        self.stopped |= self.kept.windows(sp.len()).any(|window| window == sp);
    }

    /// The data section of the next text that is not SP.
    fn receive(&mut self, world: &mut World) -> Result<Vec<u8>, NoBytes> {
        loop {
            if let Some(end) = self.kept.iter().position(|byte| *byte == ETX) {
                let whole: Vec<u8> = self.kept.drain(..=end).collect();
                let data = whole
                    .strip_prefix(&[STX])
                    .and_then(|text| text.strip_suffix(&[ETX]));
                match data {
                    Some(b"SP\r") => self.stopped = true,
                    Some(data) => return Ok(data.to_vec()),
                    // Noise: whatever it was, it is no answer.
                    None => {}
                }
                continue;
            }
            match world.read(self.port, SILENCE) {
                Ok(bytes) => self.kept.extend(bytes),
                Err(reason) => {
                    self.kept.clear();
                    return Err(reason);
                }
            }
        }
    }

    /// OK true, NG false, anything else nothing: that is waited out.
    fn verdict(&mut self, world: &mut World) -> Result<Option<bool>, NoBytes> {
        Ok(match self.receive(world)?.as_slice() {
            b"OK\r" => Some(true),
            b"NG\r" => Some(false),
            _ => None,
        })
    }

    /// One try of a file.
    fn try_file(
        &mut self,
        world: &mut World,
        command: &str,
        begins: &str,
    ) -> Result<Option<Vec<u8>>, NoBytes> {
        self.send(world, format!("{command}\r").as_bytes())?;
        let mut content = Vec::new();
        loop {
            let data = self.receive(world)?;
            let block = match (content.is_empty(), data.strip_prefix(b"FL,")) {
                (true, Some(block)) => block,
                (true, None) => return Ok(None),
                (false, _) => &data,
            };
            content.extend_from_slice(block);
            self.send(world, b"OK\r")?;
            if content.last() == Some(&EOF) {
                content.pop();
                return Ok(content.starts_with(begins.as_bytes()).then_some(content));
            }
        }
    }

    /// One try of a download.
    fn try_download(&mut self, world: &mut World, name: &str, content: &str) -> Result<bool, NoBytes> {
        self.send(world, format!("DL,{name}\r").as_bytes())?;
        if self.verdict(world)? != Some(true) {
            return Ok(false);
        }
        for block in blocks(content) {
            self.send(world, &block)?;
            if self.verdict(world)? != Some(true) {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

impl Host for Careful {
    fn command(&mut self, world: &mut World, command: &str) -> Outcome<()> {
        for _ in 0..TRIES {
            let data = format!("{command}\r");
            let answer = match self.send(world, data.as_bytes()) {
                Ok(()) => self.verdict(world),
                Err(reason) => Err(reason),
            };
            match answer {
                Ok(Some(true)) => return Ok(()),
                Ok(_) | Err(NoBytes::Late) => world.pass(Duration::from_secs(1)),
                Err(NoBytes::Gone) => self.again(world),
            }
        }
        Err(format!("{command} is not answered OK"))
    }

    fn file(&mut self, world: &mut World, command: &str, begins: &str) -> Outcome<Vec<u8>> {
        for _ in 0..TRIES {
            match self.try_file(world, command, begins) {
                Ok(Some(content)) => return Ok(content),
                Ok(None) => world.pass(Duration::from_secs(1)),
                Err(_) => self.again(world),
            }
        }
        Err(format!(
            "{command} is not answered by a file that begins with {begins}"
        ))
    }

    /// Stored is what can be read back.
    fn download(&mut self, world: &mut World, name: &str, content: &str) -> Outcome<()> {
        for _ in 0..TRIES {
            match self.try_download(world, name, content) {
                Ok(true) => {
                    if self.file(world, &format!("UL,{name}"), "")? == content.as_bytes() {
                        return Ok(());
                    }
                }
                Ok(false) => world.pass(Duration::from_secs(1)),
                Err(_) => self.again(world),
            }
        }
        Err(format!("{name} is not stored"))
    }

    /// Starts, and starts again what was stopped, until the status says that the cycle is over.
    fn cycle(&mut self, world: &mut World) -> Outcome<()> {
        self.command(world, "RN")?;
        for _ in 0..TRIES * 10 {
            world.pass(Duration::from_millis(500));
            let status = self.file(world, "SU", "MODE:")?;
            let status = String::from_utf8_lossy(&status).into_owned();
            if status.contains("STATUS:stop(reset)") {
                return Ok(());
            }
            if status.contains("STATUS:stop") && status.contains("external") {
                // What is refused now may be taken later: the button may still be pressed.
                let mut steps = ["RS,ERR", "SO", "RN"].iter();
                let _ = steps.try_for_each(|command| self.command(world, command));
            }
        }
        Err("the cycle does not end".to_string())
    }

    fn record(&mut self, world: &mut World, port: Port, record: &str) -> Outcome<String> {
        for _ in 0..TRIES {
            let _ = world.write(port, format!("{record}\r").as_bytes());
            if let Ok(answers) = self.records(world, port, 1) {
                return Ok(answers.concat());
            }
        }
        Err(format!("the program does not answer {record}"))
    }

    fn records(&mut self, world: &mut World, port: Port, count: usize) -> Outcome<Vec<String>> {
        let mut kept = Vec::new();
        while kept.iter().filter(|byte| **byte == b'\r').count() < count {
            match world.read(port, SILENCE) {
                Ok(bytes) => kept.extend(bytes),
                Err(reason) => return Err(format!("records: {reason:?}")),
            }
        }
        let all = String::from_utf8_lossy(&kept).into_owned();
        Ok(all
            .split_terminator('\r')
            .map(|record| record.trim().to_string())
            .collect())
    }
}

/// The careless host.
pub struct Careless {
    port: Port,
}

impl Careless {
    pub fn new(world: &mut World, port: Port) -> Careless {
        world.connect(port);
        Careless { port }
    }

    /// One segment, which is one text.
    fn ask(&mut self, world: &mut World, data: &[u8]) -> Outcome<Vec<u8>> {
        let gone = |reason: NoBytes| format!("{}: {reason:?}", String::from_utf8_lossy(data));
        world.pass(PAUSE);
        world.write(self.port, &text(data)).map_err(gone)?;
        let mut segment = world.read(self.port, IMPATIENCE).map_err(gone)?;
        if segment == text(b"SP\r") {
            segment = world.read(self.port, IMPATIENCE).map_err(gone)?;
        }
        let data = segment
            .strip_prefix(&[STX])
            .and_then(|text| text.strip_suffix(&[ETX]));
        match data {
            Some(b"NG\r") => Err("NG".to_string()),
            Some(data) => Ok(data.to_vec()),
            None => Err(format!("{segment:02X?} is no text")),
        }
    }
}

impl Host for Careless {
    fn command(&mut self, world: &mut World, command: &str) -> Outcome<()> {
        self.ask(world, format!("{command}\r").as_bytes()).map(drop)
    }

    fn file(&mut self, world: &mut World, command: &str, begins: &str) -> Outcome<Vec<u8>> {
        let mut content = Vec::new();
        let mut question = format!("{command}\r").into_bytes();
        loop {
            content.extend(self.ask(world, &question)?);
            question = b"OK\r".to_vec();
            if content.last() == Some(&EOF) {
                break;
            }
        }
        world.pass(PAUSE);
        let _ = world.write(self.port, &text(b"OK\r"));
        let content = content.get(3..content.len() - 1).unwrap_or_default().to_vec();
        if content.starts_with(begins.as_bytes()) {
            Ok(content)
        } else {
            Err(format!("{command}: {}", String::from_utf8_lossy(&content)))
        }
    }

    fn download(&mut self, world: &mut World, name: &str, content: &str) -> Outcome<()> {
        self.command(world, &format!("DL,{name}"))?;
        blocks(content)
            .iter()
            .try_for_each(|block| self.ask(world, block).map(drop))
    }

    fn cycle(&mut self, world: &mut World) -> Outcome<()> {
        self.command(world, "RN")?;
        world.pass(Duration::from_secs(20));
        let status = self.file(world, "SU", "MODE:")?;
        let status = String::from_utf8_lossy(&status).into_owned();
        match status.contains("STATUS:stop(reset)") {
            true => Ok(()),
            false => Err(status),
        }
    }

    fn record(&mut self, world: &mut World, port: Port, record: &str) -> Outcome<String> {
        let _ = world.write(port, format!("{record}\r").as_bytes());
        Ok(self.records(world, port, 1)?.concat())
    }

    fn records(&mut self, world: &mut World, port: Port, count: usize) -> Outcome<Vec<String>> {
        let one = |_| {
            let bytes = world
                .read(port, IMPATIENCE)
                .map_err(|reason| format!("{reason:?}"))?;
            Ok(String::from_utf8_lossy(&bytes).trim().to_string())
        };
        (0..count).map(one).collect()
    }
}
