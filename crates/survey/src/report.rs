//! The file of a survey: what was asked, what came back, which options follow.
//!
//! Only what [`Report::write`] names is written down. Names of files, positions, addresses, the error history and the content
//! of parameter files are not.

use crate::catalogue;
use crate::probe::{Probe, Verdict};
use crate::session::Reply;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use ts3100_proto::words::Word as _;

/// Version of the file.
const FORMAT: u32 = 1;
/// Largest file that is read, in bytes.
pub const MAX_REPORT: u64 = 1024 * 1024;

/// The answer to one question.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// Name of the [`Probe`].
    pub probe: String,
    pub verdict: Verdict,
    /// The answer; empty if nothing could be asked.
    pub heard: Reply,
    /// The option it decides, and its value.
    pub sets: Option<(String, String)>,
    /// Why there is no verdict.
    pub note: String,
    /// Bytes on the line, with seconds and direction.
    pub traffic: Vec<String>,
}

impl Answer {
    /// The answer of a controller with this reply.
    pub fn heard(probe: &Probe, heard: Reply) -> Answer {
        let (verdict, sets, note) = match probe.judge(&heard) {
            Some((verdict, sets)) => (verdict, sets, ""),
            None => (Verdict::Unknown, None, "no reading that is known"),
        };
        Answer {
            sets: sets.map(|(option, value)| (option.to_owned(), value.replace('*', &heard))),
            heard,
            ..Answer::without(probe, verdict, note.to_owned())
        }
    }

    /// An answer that says nothing yet.
    pub(crate) fn without(probe: &Probe, verdict: Verdict, note: String) -> Answer {
        Answer {
            probe: probe.id.to_owned(),
            verdict,
            heard: String::new(),
            sets: None,
            note,
            traffic: Vec::new(),
        }
    }
}

/// The answers of one controller.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// Program that made the file, such as `ts3100 0.1.0`.
    pub made_by: String,
    /// Whether the owner agrees that it is published.
    pub share: bool,
    /// The records of VR.
    pub versions: Vec<String>,
    /// `six axes` or `SCARA`.
    pub arm: String,
    /// The answers, in the order of the catalogue.
    pub answers: Vec<Answer>,
    /// Why the survey did not come to its end.
    pub stopped: Option<String>,
    /// State that could not be restored.
    pub left: Vec<String>,
    /// The least, the quartiles and the greatest answer time in milliseconds; empty if none is known.
    pub answer_times: Vec<f64>,
}

/// Why a file cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReportError {
    /// The file is not TOML, or lacks a field.
    #[error("{0}")]
    Form(String),
    /// Another version of the format.
    #[error("format {0} is not known; this program reads format {FORMAT}")]
    Format(u32),
    /// It was changed after it was made.
    #[error(
        "the checksum is {found}, but that of the content is {computed}: the file was changed after it was made. \
         Survey again, or take what you trust into a configuration file"
    )]
    Checksum {
        /// In the file.
        found: String,
        /// Of its content.
        computed: String,
    },
    /// An answer decides an option whose name is none, or begins that of another.
    #[error("answer {probe}: `{option}` is not the name of an option, such as su.layout")]
    Option {
        /// Name of the question.
        probe: String,
        /// The word.
        option: String,
    },
    /// The answer times are not what [`Report::answer_times`] has.
    #[error("delays: expected milliseconds from 0 on, found {0}")]
    Delay(f64),
    /// An answer has a verdict that is none.
    #[error("answer {probe}: `{verdict}` is not a verdict")]
    Verdict {
        /// Name of the question.
        probe: String,
        /// The word.
        verdict: String,
    },
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
struct File {
    share: bool,
    checksum: String,
    format: u32,
    made_by: String,
    #[serde(default)]
    stopped: Option<String>,
    #[serde(default)]
    left: Vec<String>,
    controller: ControllerTable,
    #[serde(default)]
    delays: DelayTable,
    #[serde(default)]
    answer: Vec<AnswerTable>,
}

#[derive(Deserialize)]
struct ControllerTable {
    versions: Vec<String>,
    arm: String,
}

#[derive(Deserialize, Default)]
struct DelayTable {
    #[serde(default)]
    ms: Vec<f64>,
}

#[derive(Deserialize)]
struct AnswerTable {
    probe: String,
    verdict: String,
    #[serde(default)]
    heard: String,
    #[serde(default)]
    option: Option<String>,
    #[serde(default)]
    value: Option<String>,
    #[serde(default)]
    note: String,
    #[serde(default)]
    traffic: Vec<String>,
}

const HEADER: &str = "\
# How a robot controller answers where the manual leaves it open. Made by `ts3100 survey`; nothing was sent anywhere.
# Read it before you give it to others. `ts3100 survey show FILE` explains it, `ts3100 serve --like FILE` answers like it.

# true: you agree that this file is published with the emulator, under its licence.
";

impl Report {
    /// The options that the answers decide, by name.
    pub fn options(&self) -> BTreeMap<&str, &str> {
        let decided = self.answers.iter().filter_map(|answer| answer.sets.as_ref());
        decided
            .map(|(option, value)| (option.as_str(), value.as_str()))
            .collect()
    }

    /// How many answers have this verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.answers
            .iter()
            .filter(|answer| answer.verdict == verdict)
            .count()
    }

    /// The file.
    pub fn write(&self) -> String {
        let body = self.body();
        let checksum = checksum(&body);
        format!(
            "{HEADER}share = {}\n\nchecksum = \"{checksum}\"\n{body}",
            self.share
        )
    }

    fn body(&self) -> String {
        let mut out = String::new();
        // Writing to a String does not fail.
        let _ = writeln!(out, "format = {FORMAT}\nmade-by = {}", quoted(&self.made_by));
        if let Some(reason) = &self.stopped {
            let _ = writeln!(out, "stopped = {}", quoted(reason));
        }
        if !self.left.is_empty() {
            let _ = writeln!(out, "left = {}", list(&self.left));
        }
        let _ = writeln!(
            out,
            "\n[controller]\nversions = {}\narm = {}",
            list(&self.versions),
            quoted(&self.arm)
        );
        let times = &self.answer_times;
        if !times.is_empty() {
            let _ = writeln!(
                out,
                "\n# From a command to its answer: least, quartiles, greatest.\n[delays]\nms = {times:?}"
            );
        }
        let options = self.options();
        if !options.is_empty() {
            let _ = writeln!(out, "\n# What follows for the emulator.\n[options]");
            for (option, value) in options {
                let _ = writeln!(out, "{option} = {}", quoted(value));
            }
        }
        for answer in &self.answers {
            let _ = writeln!(out, "\n[[answer]]\nprobe = {}", quoted(&answer.probe));
            if let Some(probe) = catalogue::find(&answer.probe) {
                let _ = writeln!(out, "question = {}", quoted(probe.question));
            }
            let _ = writeln!(out, "verdict = {}", quoted(answer.verdict.word()));
            if !answer.heard.is_empty() {
                let _ = writeln!(out, "heard = {}", quoted(&answer.heard));
            }
            if let Some((option, value)) = &answer.sets {
                let _ = writeln!(out, "option = {}\nvalue = {}", quoted(option), quoted(value));
            }
            if !answer.note.is_empty() {
                let _ = writeln!(out, "note = {}", quoted(&answer.note));
            }
            if !answer.traffic.is_empty() {
                let lines: Vec<String> = answer.traffic.iter().map(|line| quoted(line)).collect();
                let _ = writeln!(out, "traffic = [\n    {},\n]", lines.join(",\n    "));
            }
        }
        out
    }

    /// Reads a file.
    ///
    /// # Errors
    /// See [`ReportError`].
    pub fn read(text: &str) -> Result<Report, ReportError> {
        let file: File = toml::from_str(text).map_err(|error| ReportError::Form(error.to_string()))?;
        if file.format != FORMAT {
            return Err(ReportError::Format(file.format));
        }
        let body = text
            .split_once("\nchecksum = ")
            .and_then(|(_, rest)| rest.split_once('\n'));
        let computed = checksum(body.unwrap_or_default().1);
        if computed != file.checksum {
            let found = file.checksum;
            return Err(ReportError::Checksum { found, computed });
        }
        let answers = file.answer.into_iter().map(|table| {
            let verdict = Verdict::from_word(&table.verdict).ok_or(ReportError::Verdict {
                probe: table.probe.clone(),
                verdict: table.verdict,
            })?;
            Ok(Answer {
                probe: table.probe,
                verdict,
                heard: table.heard,
                sets: table.option.zip(table.value),
                note: table.note,
                traffic: table.traffic,
            })
        });
        let answers: Vec<Answer> = answers.collect::<Result<_, _>>()?;
        check_options(&answers)?;
        let times = file.delays.ms.iter();
        // Not a number is neither.
        let mut wrong = times.filter(|time| !(time.is_finite() && **time >= 0.0));
        if let Some(time) = wrong.next() {
            return Err(ReportError::Delay(*time));
        }
        Ok(Report {
            made_by: file.made_by,
            share: file.share,
            versions: file.controller.versions,
            arm: file.controller.arm,
            answers,
            stopped: file.stopped,
            left: file.left,
            answer_times: file.delays.ms,
        })
    }
}

/// Checks that the table of options can be written: a name is words of it joined by dots, and a name that begins another
/// would be a value and a table at once.
fn check_options(answers: &[Answer]) -> Result<(), ReportError> {
    let is_word = |word: &str| {
        let letter = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_';
        !word.is_empty() && word.bytes().all(letter)
    };
    let named = |answer: &Answer| answer.sets.as_ref().map(|(option, _)| option.clone());
    let names: BTreeSet<String> = answers.iter().filter_map(named).collect();
    for answer in answers {
        let Some((option, _)) = &answer.sets else {
            continue;
        };
        let table = format!("{option}.");
        let begins_another = names.iter().any(|name| name.starts_with(&table));
        if begins_another || !option.split('.').all(is_word) {
            return Err(ReportError::Option {
                probe: answer.probe.clone(),
                option: option.clone(),
            });
        }
    }
    Ok(())
}

/// A question that two controllers answer in different ways.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// Name of the question.
    pub probe: String,
    /// Answer of the first one.
    pub first: Reply,
    /// Answer of the second one.
    pub second: Reply,
}

/// Answers of two reports to the same question.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Comparison {
    /// The questions that they answer in different ways.
    pub differences: Vec<Difference>,
    /// The questions that only the first one answers. They are not differences: the other was not asked, or not for
    /// this.
    pub only_first: Vec<String>,
    /// The questions that only the second one answers.
    pub only_second: Vec<String>,
}

/// Compares the answers of two reports, in the order of the catalogue.
pub fn compare(first: &Report, second: &Report) -> Comparison {
    let heard = |report: &Report, id: &str| {
        let mut answers = report.answers.iter();
        let answer = answers.find(|answer| answer.probe == id && !answer.heard.is_empty());
        answer.map(|answer| answer.heard.clone())
    };
    let mut found = Comparison::default();
    for probe in catalogue::probes() {
        let id = probe.id.to_owned();
        match (heard(first, probe.id), heard(second, probe.id)) {
            (Some(first), Some(second)) if first != second => found.differences.push(Difference {
                probe: id,
                first,
                second,
            }),
            (Some(_), None) => found.only_first.push(id),
            (None, Some(_)) => found.only_second.push(id),
            (Some(_), Some(_)) | (None, None) => {}
        }
    }
    found
}

/// Detects accidental changes, not deliberate ones. FNV-1a, 64 bits.
fn checksum(text: &str) -> String {
    const OFFSET: u64 = 0xCBF2_9CE4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01B3;
    let fold = |sum: u64, byte: u8| (sum ^ u64::from(byte)).wrapping_mul(PRIME);
    // An editor may change the line ends.
    let bytes = text.bytes().filter(|byte| *byte != b'\r');
    format!("{:016x}", bytes.fold(OFFSET, fold))
}

fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for char in text.chars() {
        match char {
            '"' | '\\' => out.extend(['\\', char]),
            control if control.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(control));
            }
            other => out.push(other),
        }
    }
    out + "\""
}

fn list(items: &[String]) -> String {
    let items: Vec<String> = items.iter().map(|item| quoted(item)).collect();
    format!("[{}]", items.join(", "))
}
