//! What a question is made of.

use crate::talk::{Heard, Talk, Trouble};
use ts3100_proto::words::Word;

/// What a question may do to the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Commands that change nothing: status, versions, directory, and texts of unusual form.
    Look,
    /// A file of the survey's own name is stored, read back and erased.
    Files,
    /// A program of the survey is selected and run. It computes, prints and waits; no axis moves.
    Program,
    /// Servo power is switched, statements are executed with DO, feed hold and BREAK are used, the last axis is turned by a few
    /// degrees and back. Somebody stands at the emergency stop.
    Motion,
}

impl Word for Class {
    const ALL: &'static [Class] = &[Class::Look, Class::Files, Class::Program, Class::Motion];

    fn word(self) -> &'static str {
        match self {
            Class::Look => "look",
            Class::Files => "files",
            Class::Program => "program",
            Class::Motion => "motion",
        }
    }
}

/// What an answer means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The reading that the emulator has by default.
    Manual,
    /// Another reading that is known.
    Variation,
    /// No reading that is known, or answers that differ from time to time.
    Unknown,
    /// The controller did not let the question be asked.
    Refused,
}

impl Word for Verdict {
    const ALL: &'static [Verdict] = &[
        Verdict::Manual,
        Verdict::Variation,
        Verdict::Unknown,
        Verdict::Refused,
    ];

    fn word(self) -> &'static str {
        match self {
            Verdict::Manual => "manual",
            Verdict::Variation => "variation",
            Verdict::Unknown => "unknown",
            Verdict::Refused => "refused",
        }
    }
}

/// One reading of the manual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// What a controller with this reading answers, as a [`Heard`]; `*` stands for any number, or several with blanks between them.
    pub heard: &'static str,
    /// The value of the option that makes the emulator do the same; `*` is the number heard.
    pub sets: Option<(&'static str, &'static str)>,
    /// The emulator has it by default with some arm.
    pub is_default: bool,
}

/// How a question is asked.
#[derive(Debug, Clone, Copy)]
pub enum Ask {
    /// These bytes are sent, in the readable notation. Heard is the kind of the first text that comes back, or `silence`.
    Bytes(&'static str),
    /// This program is run; heard is the value of its global variable R.
    Value(&'static str),
    /// The same of a program that an alarm may stop: `stopped` then.
    Stops(&'static str),
    /// This program is selected: `accepted` or `refused`.
    Selects(&'static str),
    /// More than one step; heard is one of a few words.
    Word(fn(&mut Talk<'_>) -> Result<&'static str, Trouble>),
    /// More than one step.
    Steps(fn(&mut Talk<'_>) -> Result<Heard, Trouble>),
}

/// One question.
#[derive(Debug, Clone, Copy)]
pub struct Probe {
    /// Its name, which stays the same from release to release.
    pub id: &'static str,
    /// What is asked.
    pub question: &'static str,
    /// What it may do to the robot.
    pub class: Class,
    /// What is sent, in short, for those who have to decide.
    pub sends: &'static str,
    /// How it is asked.
    pub ask: Ask,
    /// The known readings; the first is that of the emulator by default.
    pub readings: &'static [Reading],
    /// How often it is asked: only what is answered alike each time counts.
    pub repeats: u8,
    /// Whether what went over the line may be written down: it holds nothing of the user's.
    pub is_public: bool,
}

impl Probe {
    /// The reading that was heard, and its verdict.
    pub fn reading(&self, heard: &str) -> Option<(&'static Reading, Verdict)> {
        let fits = |reading: &Reading| match reading.heard {
            "*" => heard.starts_with(|char: char| char.is_ascii_digit()) && heard.bytes().all(is_numeral),
            text => text == heard,
        };
        let index = self.readings.iter().position(fits)?;
        let reading = self.readings.get(index)?;
        let verdict = match index == 0 || reading.is_default {
            true => Verdict::Manual,
            false => Verdict::Variation,
        };
        Some((reading, verdict))
    }
}

/// Of numbers, one or several.
const fn is_numeral(byte: u8) -> bool {
    matches!(byte, b'0'..=b'9' | b'.' | b' ')
}
