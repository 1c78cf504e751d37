//! What a question is made of.

use crate::session::{ProbeError, Reply, Session};
use ts3100_proto::words::Word;

/// Effect that a question may have on the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Commands that change nothing: status, versions, directory, and texts of unusual form.
    Look,
    /// A file of the survey's own name is stored, read back and erased.
    Files,
    /// A program of the survey is selected and run. It computes, prints and waits; no axis moves.
    Program,
    /// Servo power is switched, statements are executed with DO, feed hold and BREAK are used, the last axis is turned
    /// by a few degrees and back. A person has to be at the emergency stop.
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

/// Meaning of an answer.
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

/// How a question is asked.
#[derive(Debug, Clone, Copy)]
pub enum Ask {
    /// These bytes are sent, in the readable notation. The reply is the type of the first text received, or `silence`.
    Bytes(&'static str),
    /// Runs this program; the reply is the value of its global variable R.
    Value(&'static str),
    /// The same of a program that an alarm may stop: `stopped` then.
    Stops(&'static str),
    /// This program is selected: `accepted` or `refused`.
    Selects(&'static str),
    /// Reads the content of this file or status; the reply is its form.
    Form(&'static str, fn(&[u8]) -> &'static str),
    /// More than one step; the reply is one of a few words.
    Word(fn(&mut Session<'_>) -> Result<&'static str, ProbeError>),
    /// More than one step.
    Steps(fn(&mut Session<'_>) -> Result<Reply, ProbeError>),
}

/// One question.
#[derive(Debug, Clone, Copy)]
pub struct Probe {
    /// Its name, which stays the same from release to release.
    pub id: &'static str,
    pub question: &'static str,
    pub class: Class,
    /// Texts that are sent, in short, for those who have to decide.
    pub sends: &'static str,
    /// How it is asked.
    pub ask: Ask,
    /// The known readings of the manual, each as the [`Reply`] of a controller that has it; `*` matches any number, or
    /// several with blanks between them. The first is that of the emulator by default.
    pub readings: &'static [&'static str],
    /// The option that the first readings decide, and the value for each that makes the emulator do the same; `*` is
    /// the number in the reply.
    pub decides: Option<(&'static str, &'static [&'static str])>,
    /// The reading that the emulator has by default with another arm.
    pub with_other_arm: Option<&'static str>,
    /// To ask once takes so long that it is not asked again.
    pub is_slow: bool,
    /// Whether what went over the line may be written down: it holds nothing of the user's.
    pub is_public: bool,
}

impl Probe {
    /// How often it is asked: only what is answered alike each time counts, the more if an option follows from it.
    pub(crate) fn repeats(&self) -> u8 {
        match self.class {
            _ if self.is_slow => 1,
            Class::Look => 2 + u8::from(self.decides.is_some()),
            Class::Files => 2,
            Class::Program => 1 + u8::from(self.decides.is_some()),
            Class::Motion => 1,
        }
    }

    /// The verdict about a reply, and the option that it decides with its value; `None` if no reading is known.
    pub(crate) fn judge(&self, heard: &str) -> Option<(Verdict, Option<(&'static str, &'static str)>)> {
        let fits = |reading: &&str| match *reading {
            "*" => heard.starts_with(|char: char| char.is_ascii_digit()) && heard.bytes().all(is_numeral),
            text => text == heard,
        };
        let index = self.readings.iter().position(fits)?;
        let verdict = match index == 0 || self.with_other_arm == Some(heard) {
            true => Verdict::Manual,
            false => Verdict::Variation,
        };
        let sets = self
            .decides
            .and_then(|(option, values)| Some((option, *values.get(index)?)));
        Some((verdict, sets))
    }
}

/// Of numbers, one or several.
const fn is_numeral(byte: u8) -> bool {
    matches!(byte, b'0'..=b'9' | b'.' | b' ')
}
