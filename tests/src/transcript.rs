//! Conversations written down by hand, and their runner. A transcript is never rewritten by a machine.
//!
//! ```text
//! origin: manual 5.3.3            where the truth comes from; also `observed`, `assumed`
//! clauses: CMD-SP-01 CMD-SP-02    what it proves
//! dialect: field                  or manual; field when left out
//! servo: on                       off when left out
//! model: tsl3000-thl400           the SCARA arm; the six-axis one when left out
//! file TEST                       a file on the RAM drive, lines follow after a bar; `select TEST` selects it
//! | PROGRAM T
//! | END
//! > IP0 SO<CR>                    the host sends a text; STX and ETX are added
//! >> IP0 02 53 55                 the host sends these bytes
//! < IP0 OK<CR>                    the next thing sent is this text; on a channel: these bytes
//! << IP0 02 53 55                 the next bytes sent are these
//! >: IP0 SU<CR><ETX>              the host sends these bytes
//! <: IP0 OK<CR><ETX>              the next bytes sent are these
//! < IP0 nothing                   nothing more was sent
//! @+250ms                         time passes
//! ! emergency-stop press          something is done at the controller; also `! connect IP1`
//! # a remark
//! ```
//! Recordings of an emulator (`ts3100_emulator::transcript::text`) are read too, as far as they need no flags.
//! IP0 is connected from the start. What is sent on a port has to be read before the next line that sends
//! there, and nothing may be left over at the end.

use crate::notation::{self, ExpectedByte};
use crate::{Robot, frame, unframe};
use std::time::Duration;
use ts3100_controller::model::ArmModel;
use ts3100_controller::{Action, Config, Dialect, PanelAction, Port};
use ts3100_emulator::transcript::text;

/// One line of a transcript that does something.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// The host sends these bytes.
    Send(Port, Vec<u8>),
    /// The controller has sent this; when empty, nothing.
    Expect(Port, Vec<ExpectedByte>),
    /// Time passes.
    Pass(Duration),
    /// Something is done at the controller.
    Panel(PanelAction),
    /// A peer comes.
    Connect(Port),
    /// A peer leaves.
    Disconnect(Port),
}

/// A transcript as read.
#[derive(Debug, Clone, PartialEq)]
pub struct Transcript {
    /// `manual ...`, `observed ...` or `assumed ...`.
    pub origin: String,
    /// Clause ids.
    pub clauses: Vec<String>,
    dialect: Dialect,
    servo: bool,
    scara: bool,
    files: Vec<(String, Vec<u8>)>,
    select: Option<String>,
    steps: Vec<(usize, Step)>,
}

/// How the host's bytes are handed over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cut {
    /// As written, one segment a line.
    Whole,
    /// One byte a segment.
    Bytes,
    /// Two segments a line, the first of so many bytes.
    At(usize),
}

impl Transcript {
    /// Reads a transcript.
    ///
    /// # Errors
    /// The line, and what is wrong with it.
    pub fn read(text: &str) -> Result<Transcript, String> {
        let mut transcript = Transcript {
            origin: String::new(),
            clauses: Vec::new(),
            dialect: Dialect::Field,
            servo: false,
            scara: false,
            files: Vec::new(),
            select: None,
            steps: Vec::new(),
        };
        for (number, line) in (1..).zip(text.lines()) {
            let read = transcript.line(number, line);
            read.map_err(|error| format!("line {number}: {error}: {line}"))?;
        }
        let known = ["manual", "observed", "assumed"]
            .iter()
            .any(|word| transcript.origin.starts_with(word));
        if !known {
            return Err("the header has no `origin: manual|observed|assumed`".to_string());
        }
        if transcript.clauses.is_empty() {
            return Err("the header has no `clauses:`".to_string());
        }
        Ok(transcript)
    }

    fn line(&mut self, number: usize, line: &str) -> Result<(), String> {
        if let Some(program) = line.strip_prefix('|') {
            let (_, content) = self.files.last_mut().ok_or("no `file NAME` before it")?;
            if let Some(raw) = program.strip_prefix(':') {
                content.extend(notation::read_bytes(raw.strip_prefix(' ').unwrap_or(raw))?);
            } else {
                content.extend_from_slice(program.strip_prefix(' ').unwrap_or(program).as_bytes());
                content.push(b'\n');
            }
            return Ok(());
        }
        if line.trim().is_empty() || line.starts_with('#') {
            return Ok(());
        }
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        match word {
            "origin:" => self.origin = rest.to_string(),
            "clauses:" => self.clauses.extend(rest.split_whitespace().map(str::to_string)),
            "dialect:" if rest == "manual" => self.dialect = Dialect::Manual,
            "dialect:" if rest == "field" => self.dialect = Dialect::Field,
            "servo:" => self.servo = on(rest)?,
            "model:" if rest == "tsl3000-thl400" => self.scara = true,
            "file" => self.files.push((rest.to_string(), Vec::new())),
            "select" => self.select = Some(rest.to_string()),
            _ => {
                let step = step(word, rest)?;
                self.steps.push((number, step));
            }
        }
        Ok(())
    }

    fn robot(&self) -> Result<Robot, String> {
        let mut config = Config::new(self.dialect);
        config.options.serial_pacing = false;
        if self.scara {
            config.model = ArmModel::thl400();
        }
        let mut robot = Robot::with(config);
        for (name, content) in &self.files {
            let stored = robot.seat.controller.put_file(name, content);
            stored.map_err(|error| format!("file {name}: {error}"))?;
        }
        if let Some(name) = &self.select {
            let selected = robot.seat.controller.select(robot.now(), name);
            selected.map_err(|error| format!("select {name}: {error}"))?;
        }
        robot.connect(Port::Ip0);
        if self.servo {
            robot.panel(PanelAction::Servo(true));
        }
        Ok(robot)
    }

    /// Runs it with the host's bytes cut so.
    ///
    /// # Errors
    /// The line that did not hold, what was expected there and what was found.
    pub fn run(&self, cut: Cut) -> Result<(), String> {
        let mut robot = self.robot()?;
        for (number, step) in &self.steps {
            self.step(&mut robot, step, cut)
                .map_err(|error| format!("line {number}, cut {cut:?}: {error}"))?;
        }
        match robot.unread().first() {
            Some((port, bytes)) => Err(format!(
                "at the end, cut {cut:?}: {port} has sent {} unread",
                notation::write(bytes)
            )),
            None => Ok(()),
        }
    }

    fn step(&self, robot: &mut Robot, step: &Step, cut: Cut) -> Result<(), String> {
        match step {
            Step::Send(port, bytes) => {
                if let Some((_, unread)) = robot.unread().iter().find(|(unread, _)| unread == port) {
                    return Err(format!(
                        "{port} has sent {} before, unread",
                        notation::write(unread)
                    ));
                }
                for segment in segments(bytes, cut) {
                    robot.raw(*port, segment);
                }
            }
            Step::Expect(port, pieces) => {
                let count = if pieces.is_empty() {
                    usize::MAX
                } else {
                    pieces.len()
                };
                let found = robot.take(*port, count);
                if !notation::matches(pieces, &found) {
                    let all = [found, robot.received(*port)].concat();
                    return Err(format!(
                        "{} bytes expected, found {}",
                        pieces.len(),
                        notation::write(&all)
                    ));
                }
            }
            Step::Pass(duration) => robot.advance(*duration),
            Step::Panel(panel) => robot.panel(panel.clone()),
            Step::Connect(port) => robot.connect(*port),
            Step::Disconnect(port) => robot.disconnect(*port),
        }
        Ok(())
    }

    /// Length of the longest segment the host sends: cuts up to it are worth trying.
    #[must_use]
    pub fn longest(&self) -> usize {
        let length = |(_, step): &(usize, Step)| match step {
            Step::Send(_, bytes) => bytes.len(),
            _ => 0,
        };
        self.steps.iter().map(length).max().unwrap_or(0)
    }

    /// Runs it up to each text of a protocol port, cuts that text off after each of its bytes, hangs up, and
    /// has the next host ask for SU.
    ///
    /// # Errors
    /// The line and the place at which the next host was not served.
    pub fn truncate(&self) -> Result<u32, String> {
        let mut robot = self.robot()?;
        let mut tried = 0;
        for (number, step) in &self.steps {
            if let Step::Send(port @ (Port::Ip0 | Port::Host), bytes) = step {
                for end in 0..bytes.len() {
                    let mut other = robot.clone();
                    other.raw(*port, &bytes[..end]);
                    other.disconnect(*port);
                    served(&mut other, *port)
                        .map_err(|error| format!("line {number} cut off after {end} bytes: {error}"))?;
                    tried += 1;
                }
            }
            self.step(&mut robot, step, Cut::Whole)
                .map_err(|error| format!("line {number}: {error}"))?;
        }
        Ok(tried)
    }
}

/// A new host asks for SU and gets it.
fn served(robot: &mut Robot, port: Port) -> Result<(), String> {
    robot.received(port);
    robot.connect(port);
    let first = robot.received(port);
    if !first.is_empty() {
        return Err(format!("the next host hears {} first", notation::write(&first)));
    }
    robot.send(port, b"SU\r");
    let answer = robot.received(port);
    let data = unframe(&answer).filter(|data| data.starts_with(b"FL,MODE:") && data.ends_with(b"\x1A"));
    data.ok_or_else(|| format!("the next host's SU is answered {}", notation::write(&answer)))?;
    robot.send(port, b"OK\r");
    match robot.received(port).as_slice() {
        [] => Ok(()),
        bytes if bytes == frame(b"SP\r") => Ok(()),
        bytes => Err(format!("its OK is answered {}", notation::write(bytes))),
    }
}

fn segments(bytes: &[u8], cut: Cut) -> Vec<&[u8]> {
    match cut {
        Cut::Whole => vec![bytes],
        Cut::Bytes => bytes.chunks(1).collect(),
        Cut::At(at) if at < bytes.len() => vec![&bytes[..at], &bytes[at..]],
        Cut::At(_) => vec![bytes],
    }
}

fn step(word: &str, rest: &str) -> Result<Step, String> {
    if let Some(time) = word.strip_prefix("@+") {
        let time = text::parse_pause(&format!("{time}{rest}")).map_err(|error| error.to_string())?;
        return Ok(Step::Pass(time));
    }
    if word == "!" {
        return action(rest);
    }
    let (name, data) = rest.split_once(' ').unwrap_or((rest, ""));
    let port = port(name)?;
    let protocol = port.protocol().is_some();
    match word {
        ">" if protocol => Ok(Step::Send(port, frame(&notation::read_bytes(data)?))),
        ">" | ">:" => Ok(Step::Send(port, notation::read_bytes(data)?)),
        ">>" => Ok(Step::Send(port, hex(data)?)),
        "<<" => {
            let bytes = hex(data)?;
            Ok(Step::Expect(
                port,
                bytes.into_iter().map(ExpectedByte::Byte).collect(),
            ))
        }
        "<:" => Ok(Step::Expect(port, notation::read(data)?)),
        "<" if data == "nothing" => Ok(Step::Expect(port, Vec::new())),
        "<" => {
            let mut pieces = notation::read(data)?;
            if protocol {
                pieces.insert(0, ExpectedByte::Byte(0x02));
                pieces.push(ExpectedByte::Byte(0x03));
            }
            Ok(Step::Expect(port, pieces))
        }
        _ => Err("no such line".to_string()),
    }
}

fn action(words: &str) -> Result<Step, String> {
    let all: Vec<&str> = words.split(' ').collect();
    match all.as_slice() {
        // The peer's address, which a recording has, is nothing to the controller.
        ["connect", name] | ["connect", name, _] => Ok(Step::Connect(port(name)?)),
        ["disconnect", name] => Ok(Step::Disconnect(port(name)?)),
        _ => {
            let action = words.parse::<Action>().map_err(|error| error.to_string())?;
            if let Action::Panel(panel) = action {
                Ok(Step::Panel(panel))
            } else {
                Err(format!("{words} is not done at the panel"))
            }
        }
    }
}

fn hex(digits: &str) -> Result<Vec<u8>, String> {
    text::parse_hex(digits).map_err(|error| error.to_string())
}

fn port(name: &str) -> Result<Port, String> {
    let known = Port::ALL.into_iter().find(|port| port.name() == name);
    known.ok_or_else(|| format!("{name} is no port"))
}

fn on(word: &str) -> Result<bool, String> {
    match word {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err(format!("on or off expected, {word} found")),
    }
}
