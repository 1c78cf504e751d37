//! The conversation of a survey: keeps the pauses that the manual asks for, cuts what comes into texts, notices what nobody
//! asked for, and writes everything down.

mod program;
mod written;

use crate::delays::Delays;
use crate::forms;
use crate::peer::{Line, Peer, PeerError};
use core::time::Duration;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use ts3100_proto::command::RunMode;
use ts3100_proto::reply::STOP;
use ts3100_proto::status::su::StatusBody;
use ts3100_proto::status::{ExecutionStatus, MasterMode};
use ts3100_proto::text::{
    Checksum, Decoded, EndRule, Framing, STX, StxRule, Text, TextDecoder, TextOptions, encode_text,
};
use written::Written;
pub(crate) use written::described;

/// Shortest time between what came last and what is sent next: the manual asks for 50 ms (TRN-05), and at most 20 texts a
/// second are sent.
pub(crate) const PAUSE: Duration = Duration::from_millis(52);
/// How long an answer is waited for. The manual gives no time; every controller seen so far answers within 0.2 s.
pub(crate) const PATIENCE: Duration = Duration::from_secs(2);
/// A line is quiet when nothing has come for so long.
pub(crate) const QUIET: Duration = Duration::from_millis(300);
/// How soon an interruption is noticed.
const PROMPT: Duration = Duration::from_millis(100);
/// The file of the survey on the RAM drive.
pub(crate) const FILE: &str = "TSSURVEY";

/// The answer in a few words; a number where something is measured.
pub type Heard = String;

/// Why a question has no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Trouble {
    /// The controller does not allow what the question needs.
    #[error("{0}")]
    Refused(String),
    /// Something that nobody expected. The survey ends: what is unclear must not go on at a machine.
    #[error("{0}")]
    Surprise(String),
}

impl From<PeerError> for Trouble {
    fn from(error: PeerError) -> Trouble {
        match error {
            PeerError::Absent => Trouble::Refused(error.to_string()),
            PeerError::Unreachable(_) | PeerError::Closed | PeerError::Interrupted => {
                Trouble::Surprise(error.to_string())
            }
        }
    }
}

/// A conversation with a controller.
pub struct Talk<'a> {
    peer: &'a mut dyn Peer,
    checksum: Checksum,
    decoder: TextDecoder,
    /// When a byte went out or came in last.
    last: Duration,
    /// When the last command of [`Talk::ask`] went out and when its answer was here.
    asked: (Duration, Duration),
    /// Those of the first status: with other ones the same commands are refused.
    modes: Option<(MasterMode, RunMode)>,
    /// That of the last status, while nothing has been sent since that may change it.
    execution: Option<ExecutionStatus>,
    /// How long the answer to a command of [`Talk::burst`] is: always the same.
    lengths: BTreeMap<&'static str, usize>,
    /// Why IP1 cannot be reached: it is not tried again.
    without_channel: Option<String>,
    /// Unsolicited SP that have come.
    stops: usize,
    written: Written,
    delays: Delays,
    /// Set by others: nothing more is asked.
    stop: Arc<AtomicBool>,
}

impl<'a> Talk<'a> {
    /// A conversation that has not begun.
    pub(crate) fn new(peer: &'a mut dyn Peer, stop: Arc<AtomicBool>) -> Talk<'a> {
        let last = peer.now();
        Talk {
            peer,
            checksum: Checksum::None,
            decoder: decoder(Checksum::None),
            last,
            asked: (last, last),
            modes: None,
            execution: None,
            lengths: BTreeMap::new(),
            without_channel: None,
            stops: 0,
            written: Written::default(),
            delays: Delays::default(),
            stop,
        }
    }

    /// From now on nobody interrupts: what was changed is put back.
    pub(crate) fn ignore_interruptions(&mut self) {
        self.stop = Arc::default();
    }

    /// Waits for bytes until this time; none came: empty.
    fn receive(&mut self, line: Line, until: Duration) -> Result<Vec<u8>, PeerError> {
        loop {
            if self.stop.load(Ordering::Relaxed) {
                return Err(PeerError::Interrupted);
            }
            let next = until.min(self.now() + PROMPT);
            let bytes = self.peer.receive(line, next)?;
            if !bytes.is_empty() || self.now() >= until {
                return Ok(bytes);
            }
        }
    }

    /// Time of the peer.
    pub fn now(&self) -> Duration {
        self.peer.now()
    }

    /// Whether each character takes its time.
    pub fn is_serial(&self) -> bool {
        self.peer.is_serial()
    }

    /// The checksum that texts have.
    pub fn checksum(&self) -> Checksum {
        self.checksum
    }

    /// Texts have this checksum from now on.
    pub(crate) fn set_checksum(&mut self, checksum: Checksum) {
        self.checksum = checksum;
        self.decoder = decoder(checksum);
    }

    /// What is written down.
    pub(crate) fn written(&mut self) -> &mut Written {
        &mut self.written
    }

    fn note(&mut self, direction: char, bytes: &[u8]) {
        let at = self.now();
        self.written.note(at, direction, bytes);
    }

    /// How long answers took.
    pub(crate) fn delays(&self) -> &Delays {
        &self.delays
    }

    /// Begins a new conversation on a fresh connection.
    ///
    /// # Errors
    /// The controller cannot be reached.
    pub fn reopen(&mut self) -> Result<(), Trouble> {
        self.peer.close(Line::Commands);
        self.decoder = decoder(self.checksum);
        self.peer.open(Line::Commands)?;
        self.last = self.peer.now();
        Ok(())
    }

    /// Opens another connection. As after [`Talk::say`], the next command comes after a pause.
    ///
    /// # Errors
    /// The controller cannot be reached. That nobody is at IP1 is a refusal: its `[E00]` may say so.
    pub fn open(&mut self, line: Line) -> Result<(), Trouble> {
        if let Some(reason) = self.without_channel.clone().filter(|_| line == Line::Channel) {
            return Err(Trouble::Refused(reason));
        }
        match self.peer.open(line) {
            Err(PeerError::Unreachable(reason)) if line == Line::Channel => {
                let reason = format!("{reason}. IP1 has to be a server (OPEN MODE); --ip1 gives its port");
                self.without_channel = Some(reason.clone());
                Err(Trouble::Refused(reason))
            }
            opened => {
                opened?;
                self.last = self.now();
                Ok(())
            }
        }
    }

    /// Closes another connection.
    pub fn close(&mut self, line: Line) {
        self.peer.close(line);
    }

    /// Reads a connection until it is quiet, without cutting texts.
    ///
    /// # Errors
    /// The controller has closed it.
    pub fn listen(&mut self, line: Line, wait: Duration) -> Result<Vec<u8>, PeerError> {
        self.bytes(line, wait, usize::MAX)
    }

    /// Sends on another connection. What comes of it may be an SP, and a strict controller ignores a command that follows
    /// SP too soon: the next command comes after a pause.
    ///
    /// # Errors
    /// The controller has closed it.
    pub fn say(&mut self, line: Line, bytes: &[u8]) -> Result<(), PeerError> {
        self.note('>', bytes);
        self.last = self.now();
        self.peer.send(line, bytes)
    }

    /// Bytes that have come, as texts. An unsolicited SP is counted and not returned.
    fn take(&mut self, until: Duration) -> Result<Vec<Text>, Trouble> {
        let bytes = self.receive(Line::Commands, until)?;
        if !bytes.is_empty() {
            self.last = self.now();
            self.note('<', &bytes);
        }
        self.decoder.push(&bytes);
        let mut texts = Vec::new();
        while let Some(decoded) = self.decoder.next() {
            match decoded {
                Decoded::Text(text) if text.error.is_none() && text.data == STOP => self.stops += 1,
                Decoded::Text(text) if text.error.is_none() => texts.push(text),
                Decoded::Text(_) => return Err(Trouble::Surprise("a text came damaged".to_owned())),
                Decoded::Skipped { bytes } => {
                    return Err(Trouble::Surprise(format!(
                        "{bytes} bytes came that belong to no text"
                    )));
                }
            }
        }
        Ok(texts)
    }

    /// Waits. What comes meanwhile, other than an unsolicited SP, is a surprise.
    ///
    /// # Errors
    /// Something came.
    pub fn wait(&mut self, duration: Duration) -> Result<(), Trouble> {
        let until = self.now() + duration;
        while self.now() < until {
            if let Some(text) = self.take(until)?.first() {
                let what = described(&text.data);
                return Err(Trouble::Surprise(format!("nobody asked, and there came {what}")));
            }
        }
        Ok(())
    }

    fn pause(&mut self) -> Result<(), Trouble> {
        // An unsolicited SP may come meanwhile: the pause counts from it then.
        while self.now() < self.last + PAUSE {
            self.wait(self.last + PAUSE - self.now())?;
        }
        Ok(())
    }

    /// Sends these bytes without a pause before.
    ///
    /// # Errors
    /// The connection has ended.
    pub fn send_at_once(&mut self, bytes: &[u8]) -> Result<(), Trouble> {
        self.note('>', bytes);
        self.execution = None;
        self.peer.send(Line::Commands, bytes)?;
        self.last = self.now();
        Ok(())
    }

    /// Waits for the first text.
    ///
    /// # Errors
    /// Two came, or something that is no text.
    pub fn hear(&mut self, patience: Duration) -> Result<Option<Text>, Trouble> {
        let until = self.now() + patience;
        while self.now() < until {
            let mut texts = self.take(until)?.into_iter();
            if let Some(text) = texts.next() {
                return match texts.next() {
                    None => Ok(Some(text)),
                    Some(second) => {
                        let what = described(&second.data);
                        Err(Trouble::Surprise(format!("a second answer came: {what}")))
                    }
                };
            }
        }
        Ok(None)
    }

    /// Sends these bytes and waits for the first text. A text under way when patience ends is a surprise.
    ///
    /// # Errors
    /// Two texts came, or something that is no text.
    pub fn exchange(&mut self, bytes: &[u8]) -> Result<Option<Text>, Trouble> {
        self.pause()?;
        self.send_at_once(bytes)?;
        let heard = self.hear(PATIENCE)?;
        if heard.is_none() && self.decoder.is_partial() {
            return Err(Trouble::Surprise("a text came without its end".to_owned()));
        }
        Ok(heard)
    }

    /// A text with this data section as bytes.
    pub fn text(&self, data: &str) -> Vec<u8> {
        encode_text(data.as_bytes(), Framing::Stx, self.checksum)
    }

    /// Sends a command after the usual pause.
    fn send(&mut self, command: &str) -> Result<(), Trouble> {
        self.pause()?;
        let text = self.text(&format!("{command}\r"));
        self.send_at_once(&text)
    }

    /// The data section of the answer to a command.
    ///
    /// # Errors
    /// None came.
    pub fn ask(&mut self, command: &str) -> Result<Vec<u8>, Trouble> {
        self.send(command)?;
        let begun = self.now();
        let heard = self.hear(PATIENCE)?;
        let answer = heard.ok_or_else(|| Trouble::Surprise(format!("no answer to {command}")))?;
        self.asked = (begun, self.now());
        self.delays.add(self.asked.1.saturating_sub(begun));
        if answer.framing != Framing::Stx {
            return Err(Trouble::Surprise(format!("the answer to {command} has no STX")));
        }
        Ok(answer.data.to_vec())
    }

    /// When the last command went out, and when its answer was here.
    pub fn asked(&self) -> (Duration, Duration) {
        self.asked
    }

    /// A command that is answered by OK.
    ///
    /// # Errors
    /// NG is a refusal.
    pub fn command(&mut self, command: &str) -> Result<(), Trouble> {
        match self.asks(command)? {
            true => Ok(()),
            false => Err(Trouble::Refused(format!("{command} got NG"))),
        }
    }

    /// Whether a command is answered by OK; false for NG.
    ///
    /// # Errors
    /// Anything else came.
    pub fn asks(&mut self, command: &str) -> Result<bool, Trouble> {
        match self.ask(command)?.as_slice() {
            b"OK\r" => Ok(true),
            b"NG\r" => Ok(false),
            other => {
                let what = described(other);
                Err(Trouble::Surprise(format!("the answer to {command} is {what}")))
            }
        }
    }

    /// The answer to a command: `OK` or `NG`.
    ///
    /// # Errors
    /// Anything else came.
    pub fn reply(&mut self, command: &str) -> Result<&'static str, Trouble> {
        Ok(if self.asks(command)? { "OK" } else { "NG" })
    }

    /// Acknowledges a text of a file.
    ///
    /// # Errors
    /// Something came before.
    pub fn acknowledge(&mut self) -> Result<(), Trouble> {
        self.send("OK")
    }

    /// Sends these bytes and tells what kind of text comes back: `answer`, `OK`, `NG` or `silence`.
    ///
    /// # Errors
    /// Two texts came, or something that is no text.
    pub fn kind_of_answer(&mut self, bytes: &[u8]) -> Result<Heard, Trouble> {
        let heard = self.exchange(bytes)?;
        self.kind(heard)
    }

    /// The same for a text with this data section.
    ///
    /// # Errors
    /// Those of [`Talk::kind_of_answer`].
    pub fn kind_of_answer_to(&mut self, data: &str) -> Result<Heard, Trouble> {
        let text = self.text(data);
        self.kind_of_answer(&text)
    }

    /// The kind of a text. What has to be acknowledged is acknowledged.
    ///
    /// # Errors
    /// A file that is none.
    pub fn kind(&mut self, heard: Option<Text>) -> Result<Heard, Trouble> {
        let Some(text) = heard else {
            return Ok("silence".to_owned());
        };
        let kind = match text.data.as_ref() {
            b"OK\r" => "OK",
            b"NG\r" => "NG",
            data if data.starts_with(b"FL,") => {
                self.rest_of_content("it", text.data.to_vec())?;
                "answer"
            }
            _ => "another text",
        };
        let without = match text.framing {
            Framing::Stx => "",
            Framing::Bare => " without STX",
        };
        Ok(format!("{kind}{without}"))
    }

    /// SF: in how many texts it travels and of which arm it is, as in [`forms::total_status`], and its content.
    ///
    /// # Errors
    /// NG is a refusal.
    pub fn total_status(&mut self) -> Result<(&'static str, Vec<u8>), Trouble> {
        let sum = usize::from(self.checksum == Checksum::Sum);
        let mut burst = self.burst("SF")?;
        burst.truncate(burst.len() - sum);
        let has_stx = burst.first() == Some(&STX);
        let begin = usize::from(has_stx);
        if burst.get(begin..).is_some_and(|data| data.starts_with(b"NG")) {
            return Err(Trouble::Refused("SF got NG".to_owned()));
        }
        let form = forms::total_status(&burst, has_stx);
        self.acknowledge()?;
        if form.starts_with("several") {
            burst.pop();
            let rest = self.listen(Line::Commands, PATIENCE)?;
            burst.extend(rest.into_iter().skip(begin));
            self.acknowledge()?;
        }
        Ok((form, burst.split_off(burst.len().min(begin + b"FL,".len()))))
    }

    /// Bytes have come that are no whole text yet.
    pub(crate) fn is_midway(&self) -> bool {
        self.decoder.is_partial()
    }

    /// Whether the controller has closed the connection for commands.
    pub fn is_closed(&mut self) -> bool {
        let until = self.now() + PAUSE;
        self.receive(Line::Commands, until) == Err(PeerError::Closed)
    }

    /// Waits for the first byte, which stays part of its text.
    ///
    /// # Errors
    /// The connection has ended.
    pub fn until_something_comes(&mut self, patience: Duration) -> Result<(), Trouble> {
        let until = self.now() + patience;
        while self.now() < until {
            let bytes = self.receive(Line::Commands, until)?;
            if !bytes.is_empty() {
                self.note('<', &bytes);
                self.decoder.push(&bytes);
                break;
            }
        }
        Ok(())
    }

    /// Bytes that follow a command, not cut into texts: those of SF may have ETX among them. The first time all that comes until
    /// the line is quiet, then as many.
    ///
    /// # Errors
    /// Nothing came.
    pub fn burst(&mut self, command: &'static str) -> Result<Vec<u8>, Trouble> {
        self.send(command)?;
        let enough = self.lengths.get(command).copied();
        let heard = self.bytes(Line::Commands, PATIENCE, enough.unwrap_or(usize::MAX))?;
        if heard.is_empty() {
            return Err(Trouble::Surprise(format!("no answer to {command}")));
        }
        self.lengths.entry(command).or_insert(heard.len());
        Ok(heard)
    }

    /// Bytes that come until there are enough, or the line is quiet; for the first of them it waits longer.
    fn bytes(&mut self, line: Line, wait: Duration, enough: usize) -> Result<Vec<u8>, PeerError> {
        let (mut heard, mut until) = (Vec::new(), self.now() + wait);
        while self.now() < until && heard.len() < enough {
            let bytes = self.receive(line, until)?;
            if !bytes.is_empty() {
                until = self.now() + QUIET;
                heard.extend(bytes);
                if line == Line::Commands {
                    self.last = self.now();
                }
            }
        }
        self.note('<', &heard);
        Ok(heard)
    }

    /// Whether the robot works, asked for where it is not known.
    ///
    /// # Errors
    /// Those of [`Talk::status`].
    pub fn execution(&mut self) -> Result<ExecutionStatus, Trouble> {
        match self.execution {
            Some(execution) => Ok(execution),
            None => Ok(self.status()?.execution),
        }
    }

    /// The status of the controller.
    ///
    /// # Errors
    /// It does not answer SU, or in no form that is known.
    pub fn status(&mut self) -> Result<StatusBody, Trouble> {
        let content = self.file("SU")?;
        let status = StatusBody::decode(&content)
            .map_err(|error| Trouble::Surprise(format!("the answer to SU: {error}")))?;
        let modes = (status.master_mode, status.run_mode);
        if *self.modes.get_or_insert(modes) != modes {
            return Err(Trouble::Surprise("somebody has changed the mode".to_owned()));
        }
        self.execution = Some(status.execution);
        Ok(status)
    }

    /// The unsolicited SP that have come since the last call.
    pub fn take_stops(&mut self) -> usize {
        std::mem::take(&mut self.stops)
    }
}

fn decoder(checksum: Checksum) -> TextDecoder {
    TextDecoder::new(TextOptions {
        stx: StxRule::Detect,
        end: EndRule::Etx,
        checksum,
    })
}
