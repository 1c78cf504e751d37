//! The text form of conditions, the same in scenarios, `ts3100 ctl` and the control interface.
//!
//! What `Display` writes, `FromStr` reads back as the same condition. Values that cannot occur (a line that the
//! controller does not have, an unknown alarm or rule) are errors, because a wait for them would never end.

use crate::action::IoKind;
use crate::alarm::AlarmCode;
use crate::condition::Condition;
use crate::finding::{RULES, Rule};
use crate::port::Port;
use crate::prelude::*;
use crate::signals::{LINE_NUMBERS, Signals};
use crate::text_form::{single_word, split};
use core::fmt;
use core::str::FromStr;
use ts3100_proto::command::COMMANDS;
use ts3100_proto::escape::{self, EscapeError, Escaped};
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::words::{UnexpectedWord, Word as _, did_you_mean_or};

/// A form of a condition, as the page of conditions lists it.
#[derive(Debug, Clone, Copy)]
pub struct ConditionForm {
    /// Its words; those in capitals are to be replaced.
    pub form: &'static str,
    /// One of these conditions.
    pub example: &'static str,
    /// When it happens.
    pub happens: &'static str,
    /// Whether it is a state; a wait for a state that already holds ends immediately.
    pub is_state: bool,
}

/// A momentary event.
const fn event(form: &'static str, example: &'static str) -> ConditionForm {
    ConditionForm {
        form,
        example,
        happens: "",
        is_state: false,
    }
}

const fn state(form: &'static str, example: &'static str) -> ConditionForm {
    ConditionForm {
        is_state: true,
        ..event(form, example)
    }
}

impl ConditionForm {
    const fn when(self, happens: &'static str) -> ConditionForm {
        ConditionForm { happens, ..self }
    }
}

/// Every form of a condition.
pub const CONDITION_FORMS: [ConditionForm; 20] = [
    event("command TEXT", "command DO,MOVE").when("a host sends a text that begins with TEXT"),
    event("answer TEXT", "answer NG").when("the robot sends a text that begins with TEXT"),
    event("refused COMMAND", "refused RN").when("a command with these letters gets NG"),
    event("printed [CHANNEL] TEXT", "printed IP1 DONE<CR>").when(
        "a program prints TEXT, also with several PRINTs; without CHANNEL, or with TP: on the teach pendant",
    ),
    event("received CHANNEL TEXT", "received IP1 4<CR>").when("a peer sends TEXT, also in several parts"),
    state("connected PORT", "connected IP0").when("a peer connects"),
    state("disconnected PORT", "disconnected IP0").when("a peer disconnects"),
    state("alarm", "alarm").when("any alarm is raised; `alarm any` is the same"),
    state("alarm NUMBER", "alarm 2-046").when("this alarm is raised"),
    event("alarms reset", "alarms reset").when("alarms are reset"),
    state("status WORDS", "status stop (retry)")
        .when("the execution status becomes `running`, `stop (reset)`, `stop (retry)` or `stop (continue)`"),
    state("servo on|off", "servo on").when("servo power goes on or off"),
    state("selected NAME", "selected PICK").when("a file is selected; `none` for no file"),
    event("stored NAME", "stored PICK").when("a file is stored on the RAM drive"),
    event("erased NAME", "erased PICK").when("a file is erased"),
    event("finding RULE", "finding no-cr")
        .when("a host breaks a [rule](findings.md); findings that a fault caused do not count"),
    state("input LINE on|off", "input 5 on").when("an input goes on or off"),
    state("output LINE on|off", "output 264 off").when("an output goes on or off"),
    event("line N", "line 12").when("the statement in line N of the selected file begins"),
    state("idle", "idle").when("no program runs, nothing moves, and no exchange is open"),
];

/// The teach pendant, as `printed` names it.
const PENDANT: &str = "TP";

/// Why words are not a condition.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ConditionParseError {
    /// No condition begins so.
    #[error("unknown condition `{words}`{hint}")]
    Unknown {
        words: String,
        /// A name that may be meant, as the end of the message; may be empty.
        hint: String,
    },
    /// A known condition with wrong words after it.
    #[error("cannot read the condition `{words}`: {reason}{remedy}")]
    Form {
        words: String,
        reason: String,
        /// The forms of conditions with this beginning, as the end of the message.
        remedy: String,
    },
}

/// The fault after the first word.
#[derive(Debug, thiserror::Error)]
enum Wrong {
    #[error(transparent)]
    Word(#[from] UnexpectedWord),
    #[error(transparent)]
    Bytes(#[from] EscapeError),
}

type ReadResult<T> = Result<T, Wrong>;

impl FromStr for Condition {
    type Err = ConditionParseError;

    fn from_str(words: &str) -> Result<Condition, ConditionParseError> {
        let (name, rest) = split(words);
        let first = |row: &ConditionForm| split(row.form).0;
        let forms = CONDITION_FORMS.iter().filter(|row| first(row) == name);
        let forms: Vec<String> = forms.map(|row| format!("`{}`", row.form)).collect();
        if forms.is_empty() {
            let page = "; `ts3100 docs conditions` lists every condition";
            let hint = did_you_mean_or(name, CONDITION_FORMS.iter().map(first), page);
            let words = words.to_string();
            return Err(ConditionParseError::Unknown { words, hint });
        }
        read(name, rest).map_err(|wrong| {
            let (words, reason) = (words.to_string(), wrong.to_string());
            // The word that was meant, or the list of words, is remedy enough.
            let remedy = match reason.ends_with('?') || reason.contains("; ") {
                true => String::new(),
                false => format!("; write {}", forms.join(" or ")),
            };
            ConditionParseError::Form {
                words,
                reason,
                remedy,
            }
        })
    }
}

fn read(name: &str, rest: &str) -> ReadResult<Condition> {
    Ok(match name {
        "command" => Condition::Command(command(rest)?),
        "answer" => Condition::Answer(text(rest)?),
        "refused" => Condition::Refused(single_word("the letters of a command", rest)?),
        "printed" => printed(rest)?,
        "received" => {
            let (port, rest) = split(rest);
            let (port, text) = (scol_port(port)?, text(rest)?);
            Condition::Received { port, text }
        }
        "connected" => Condition::Connected(port(rest)?),
        "disconnected" => Condition::Disconnected(port(rest)?),
        "alarm" if rest.is_empty() || rest == "any" => Condition::Alarm(None),
        "alarm" => {
            let unknown = || {
                let hint = AlarmCode::did_you_mean(rest);
                UnexpectedWord::new(AlarmCode::expected_number(rest), rest).hinting(hint)
            };
            let row = AlarmCode::from_number(rest).ok_or_else(unknown)?;
            Condition::Alarm(Some(row.number()))
        }
        "alarms" if rest == "reset" => Condition::AlarmsReset,
        "alarms" => return Err(UnexpectedWord::new("reset", rest).into()),
        "status" => {
            let expected = "running, stop (reset), stop (retry) or stop (continue)";
            let status = ExecutionStatus::from_word(rest);
            Condition::Status(status.ok_or_else(|| UnexpectedWord::new(expected, rest))?)
        }
        "servo" => Condition::Servo(bool::read(rest)?),
        "selected" if rest == "none" => Condition::Selected(String::new()),
        "selected" => Condition::Selected(file(rest)?),
        "stored" => Condition::Stored(file(rest)?),
        "erased" => Condition::Erased(file(rest)?),
        "finding" => {
            let rule = Rule::by_id(rest).ok_or_else(|| {
                UnexpectedWord::new("the name of a rule", rest).suggesting(RULES.iter().map(|rule| rule.id))
            })?;
            Condition::Finding(rule.id.to_string())
        }
        "input" => signal(IoKind::Input, rest)?,
        "output" => signal(IoKind::Output, rest)?,
        "line" => {
            // A line has a byte at least, and a file has no more.
            let last = scol_mini::MAX_SOURCE;
            let fits = |line: &u32| usize::try_from(*line).is_ok_and(|line| (1..=last).contains(&line));
            let line = rest.parse().ok().filter(fits);
            let expected = || UnexpectedWord::new(format!("a line of a file, 1 to {last}"), rest);
            Condition::Statement(line.ok_or_else(expected)?)
        }
        _ if rest.is_empty() => Condition::Idle,
        _ => return Err(UnexpectedWord::new("nothing after it", rest).into()),
    })
}

/// `IP1 DONE`, `TP DONE` or `DONE`. What looks like a port is none of the text: `printed IP4 DONE` would never happen.
fn printed(rest: &str) -> ReadResult<Condition> {
    let (first, after) = split(rest);
    let name = first.to_uppercase();
    let is_port =
        ["TP", "IP", "COM", "HOST"].contains(&name.trim_end_matches(|end: char| end.is_ascii_digit()));
    let (port, shown) = match is_port {
        false => (None, rest),
        true if name == PENDANT => (None, after),
        true => {
            let expected = "the channel COM1, IP1, IP2 or TP";
            let port = scol_port(first).map_err(|_| UnexpectedWord::new(expected, first))?;
            (Some(port), after)
        }
    };
    let text = text(shown)?;
    Ok(Condition::Printed { port, text })
}

fn signal(side: IoKind, rest: &str) -> ReadResult<Condition> {
    let (number, state) = split(rest);
    let line = number.parse().ok().filter(|line| Signals::exists(*line));
    let line = line.ok_or_else(|| UnexpectedWord::new(format!("line {LINE_NUMBERS}"), number))?;
    let on = bool::read(state)?;
    Ok(Condition::Signal { side, line, on })
}

fn text(words: &str) -> ReadResult<Vec<u8>> {
    if words.is_empty() {
        return Err(UnexpectedWord::new("text, with control codes as <CR>", words).into());
    }
    Ok(escape::parse(words)?)
}

/// A text that a host may send: it begins with the letters of a command, which may be cut short. A wait for any other would
/// never end, because the letters are mistyped; `refused` waits for those that no controller knows.
fn command(words: &str) -> ReadResult<Vec<u8>> {
    let text = text(words)?;
    let end = text.iter().position(|byte| !byte.is_ascii_alphanumeric());
    let (letters, rest) = text.split_at(end.unwrap_or(text.len()));
    let is_command = |known: &str| match rest.is_empty() {
        true => starts_with(known.as_bytes(), letters),
        false => known.as_bytes().eq_ignore_ascii_case(letters),
    };
    let known = || COMMANDS.iter().map(|row| row.letters);
    if letters.is_empty() || known().any(is_command) {
        return Ok(text);
    }
    let letters = String::from_utf8_lossy(letters);
    let page = "; `ts3100 docs commands` lists every command";
    let hint = did_you_mean_or(&letters, known(), page);
    Err(UnexpectedWord::new("the letters of a command", &letters)
        .hinting(hint)
        .into())
}

fn starts_with(word: &[u8], beginning: &[u8]) -> bool {
    word.get(..beginning.len())
        .is_some_and(|word| word.eq_ignore_ascii_case(beginning))
}

fn port(word: &str) -> ReadResult<Port> {
    let port = Port::from_word(&word.to_uppercase());
    Ok(port.ok_or_else(|| UnexpectedWord::new("HOST, COM1, IP0, IP1, IP2 or IP3", word))?)
}

fn scol_port(word: &str) -> ReadResult<Port> {
    let port = Port::from_word(&word.to_uppercase()).filter(|port| port.is_scol_channel());
    Ok(port.ok_or_else(|| UnexpectedWord::new("the channel COM1, IP1 or IP2", word))?)
}

fn file(word: &str) -> ReadResult<String> {
    Ok(single_word("the name of a file", word)?.to_uppercase())
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Condition::Command(text) => write!(f, "command {}", Escaped::new(text)),
            Condition::Answer(text) => write!(f, "answer {}", Escaped::new(text)),
            Condition::Refused(letters) => write!(f, "refused {letters}"),
            Condition::Printed { port, text } => {
                let channel = port.map_or(PENDANT, Port::name);
                write!(f, "printed {channel} {}", Escaped::new(text))
            }
            Condition::Received { port, text } => write!(f, "received {port} {}", Escaped::new(text)),
            Condition::Connected(port) => write!(f, "connected {port}"),
            Condition::Disconnected(port) => write!(f, "disconnected {port}"),
            Condition::Alarm(None) => f.write_str("alarm"),
            Condition::Alarm(Some(number)) => write!(f, "alarm {number}"),
            Condition::AlarmsReset => f.write_str("alarms reset"),
            Condition::Status(status) => write!(f, "status {status}"),
            Condition::Servo(on) => write!(f, "servo {}", on.word()),
            Condition::Selected(name) if name.is_empty() => f.write_str("selected none"),
            Condition::Selected(name) => write!(f, "selected {name}"),
            Condition::Stored(name) => write!(f, "stored {name}"),
            Condition::Erased(name) => write!(f, "erased {name}"),
            Condition::Finding(rule) => write!(f, "finding {rule}"),
            Condition::Signal { side, line, on } => write!(f, "{} {line} {}", side.word(), on.word()),
            Condition::Statement(line) => write!(f, "line {line}"),
            Condition::Idle => f.write_str("idle"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_condition_reads_back_as_it_was_written() {
        let more = [
            "printed TP X Y",
            "command <STX>A<3C>",
            "command S",
            "command su",
            "command ok",
            "selected none",
        ];
        for words in CONDITION_FORMS.iter().map(|row| row.example).chain(more) {
            let condition: Condition = words.parse().unwrap();
            assert_eq!(condition.to_string(), words);
        }
        for (words, other) in [
            ("alarm any", "alarm"),
            ("printed X Y", "printed TP X Y"),
            ("printed tp X", "printed TP X"),
            ("printed ip1 X", "printed IP1 X"),
            ("connected ip0", "connected IP0"),
            ("selected pick", "selected PICK"),
        ] {
            assert_eq!(words.parse::<Condition>().unwrap().to_string(), other);
        }
    }

    #[test]
    fn what_is_no_condition_says_what_is_expected() {
        for (words, expected) in [
            (
                "",
                "unknown condition ``; `ts3100 docs conditions` lists every condition",
            ),
            (
                "commandd SU",
                "unknown condition `commandd SU`; did you mean `command`?",
            ),
            (
                "output 5",
                "cannot read the condition `output 5`: expected on or off, found ``; write `output LINE on|off`",
            ),
            (
                "output 77 on",
                "expected line 1-64, 101-164, 201-264, 301-364, 401-464, found `77`",
            ),
            ("output five on", "expected line 1-64"),
            (
                "line",
                "expected a line of a file, 1 to 99999, found ``; write `line N`",
            ),
            ("line 0", "found `0`"),
            ("alarm 9-999", "found `9-999`; write `alarm` or `alarm NUMBER`"),
            ("alarm 2-46", "found `2-46`; did you mean `2-046`?"),
            ("alarms raise", "expected reset, found `raise`"),
            ("printed", "expected text"),
            ("printed IP1", "expected text"),
            (
                "printed IP3 X",
                "expected the channel COM1, IP1, IP2 or TP, found `IP3`",
            ),
            ("printed HOST X", "found `HOST`"),
            (
                "received IP0 X",
                "expected the channel COM1, IP1 or IP2, found `IP0`",
            ),
            ("command <CR", "no > after <CR"),
            (
                "command QQ",
                "cannot read the condition `command QQ`: expected the letters of a command, found `QQ`; \
                 `ts3100 docs commands` lists every command",
            ),
            ("command US", "found `US`; did you mean `SU`?"),
            ("command SUX", "found `SUX`"),
            ("command D,MOVE", "found `D`"),
            (
                "finding no-cR",
                "cannot read the condition `finding no-cR`: expected the name of a rule, found `no-cR`; did you mean `no-cr`?",
            ),
            ("status stop", "expected running, stop (reset)"),
            ("idle now", "expected nothing after it, found `now`; write `idle`"),
            ("stored A B", "expected the name of a file"),
        ] {
            let error = words.parse::<Condition>().unwrap_err().to_string();
            assert!(error.contains(expected), "{words}\n{error}");
            assert!(!error.contains("?;"), "{error}");
        }
    }
}
