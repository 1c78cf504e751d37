//! The text form of actions, in the words of `ts3100 ctl`: after `!` in a text transcript, in JSON lines, in scenarios
//! and in the log of a scenario.
//!
//! What `Display` writes, `FromStr` reads back as the same action. It checks words only, not whether there is such a line
//! or file.

use crate::action::{Action, IoKind};
use crate::controls::{BUTTONS, PanelAction, SWITCHES};
use crate::faults::{Fault, FaultAction, FaultError};
use crate::inspection::{Assignment, Breakpoint, StepKind};
use crate::panel::JogMode;
use crate::prelude::*;
use crate::text_form::{single_word, split};
use crate::time::{DurationError, parse_duration};
use alloc::borrow::Cow;
use alloc::string::FromUtf8Error;
use core::fmt;
use core::str::FromStr;
use ts3100_proto::command::Number;
use ts3100_proto::escape::{self, EscapeError, Escaped};
use ts3100_proto::words::{UnexpectedWord, Word};

/// The forms of the actions without a row in the table of controls.
const OTHER_FORMS: [&str; 26] = [
    "jog AXIS plus|minus joint|tool|work|world slow|mid|fast [inching]",
    "program run-to LINE",
    "program step-task into|over|out|motion TASK",
    "program assign TASK CALL NAME = VALUE",
    "breakpoints none|LINE [if CONDITION] [hits RULE] [say TEXT] [LINE ...]",
    "alarms raise NUMBER [TEXT]",
    "power on|off|cycle",
    "pendant keys TEXT",
    "input LINE on|off",
    "output LINE on|off",
    "input LINE pulse on|off TIME",
    "output LINE pulse on|off TIME",
    "input LINE force on|off",
    "output LINE force on|off",
    "input LINE release",
    "output LINE release",
    "variable NAME VALUES",
    "variable NAME VALUES restore",
    "position NAME teach",
    "position NAME teach restore",
    "file put NAME TEXT",
    "file erase NAME",
    "file select NAME",
    "faults arm SPEC",
    "faults disarm NUMBER",
    "faults clear",
];

/// The rule for hits of a breakpoint.
const HITS: &str = "a number of hits such as 3, >=3 or %3";

/// Every form of an action, as the page of scenarios lists it.
pub fn action_forms() -> impl Iterator<Item = &'static str> + Clone {
    let switches = SWITCHES.iter().map(|switch| switch.form);
    let buttons = BUTTONS.iter().map(|button| button.form);
    switches.chain(buttons).chain(OTHER_FORMS)
}

/// Why words are not an action.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ActionParseError {
    /// A word of an action.
    #[error(transparent)]
    Expected(#[from] UnexpectedWord),
    /// The length of a pulse.
    #[error(transparent)]
    Duration(#[from] DurationError),
    /// No action begins so.
    #[error("unknown action `{0}`")]
    Unknown(String),
    /// Keys of the pendant or a name that are not UTF-8.
    #[error("expected UTF-8: {0}")]
    NotUtf8(FromUtf8Error),
    /// Bytes.
    #[error(transparent)]
    Bytes(#[from] EscapeError),
    /// A fault.
    #[error(transparent)]
    Fault(#[from] FaultError),
}

type ParseResult<T> = Result<T, ActionParseError>;

fn expected(expected: impl Into<Cow<'static, str>>, found: &str) -> ActionParseError {
    UnexpectedWord::new(expected, found).into()
}

/// A name or number from outside, which may be none: still one word that reads back.
fn as_word(name: &str) -> Escaped<'_> {
    Escaped::word(name.as_bytes())
}

fn unescaped(word: &str) -> ParseResult<String> {
    String::from_utf8(escape::parse(word)?).map_err(ActionParseError::NotUtf8)
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let suffix = |restore: &bool| if *restore { " restore" } else { "" };
        match self {
            Action::Panel(action) => action.fmt(f),
            Action::PowerOff => f.write_str("power off"),
            Action::PowerOn => f.write_str("power on"),
            Action::RaiseAlarm { number, detail } => match detail.trim_end() {
                "" => write!(f, "alarms raise {}", as_word(number)),
                detail => write!(f, "alarms raise {} {detail}", as_word(number)),
            },
            Action::Pulse {
                side,
                line,
                on,
                length,
            } => {
                // Up, as the end of a pulse is.
                let micros = length.as_nanos().div_ceil(1_000);
                write!(f, "{} {line} pulse {} {micros} us", side.word(), on.word())
            }
            Action::SetOutput { line, on } => write!(f, "output {line} {}", on.word()),
            Action::Force { side, line, on } => write!(f, "{} {line} force {}", side.word(), on.word()),
            Action::Release { side, line } => write!(f, "{} {line} release", side.word()),
            Action::SetVariable {
                name,
                values,
                restore,
            } => {
                write!(f, "variable {}", as_word(name))?;
                values.iter().try_for_each(|value| match value {
                    Number::Integer(whole) => write!(f, " {whole}"),
                    // With a decimal point or an exponent, so that it reads back as a real.
                    Number::Real(real) => write!(f, " {real:?}"),
                })?;
                f.write_str(suffix(restore))
            }
            Action::Teach { name, restore } => {
                write!(f, "position {} teach{}", as_word(name), suffix(restore))
            }
            Action::PutFile { name, content } => {
                write!(f, "file put {} {}", as_word(name), Escaped::new(content))
            }
            Action::EraseFile { name } => write!(f, "file erase {}", as_word(name)),
            Action::Select { name } => write!(f, "file select {}", as_word(name)),
            Action::Breakpoints(set) if set.is_empty() => f.write_str("breakpoints none"),
            Action::Breakpoints(set) => {
                f.write_str("breakpoints")?;
                set.iter().try_for_each(|set| write_breakpoint(set, f))
            }
            Action::RunTo(line) => write!(f, "program run-to {line}"),
            Action::StepTask { kind, task } => write!(f, "program step-task {} {task}", kind.as_str()),
            Action::Assign(Assignment { task, call, text }) => {
                write!(
                    f,
                    "program assign {task} {call} {}",
                    Escaped::new(text.as_bytes())
                )
            }
            Action::Fault(FaultAction::Arm(fault)) if fault.id == 0 => write!(f, "faults arm {fault}"),
            Action::Fault(FaultAction::Arm(fault)) => write!(f, "faults arm {} {fault}", fault.id),
            Action::Fault(FaultAction::Disarm(id)) => write!(f, "faults disarm {id}"),
            Action::Fault(FaultAction::Clear) => f.write_str("faults clear"),
        }
    }
}

impl FromStr for Action {
    type Err = ActionParseError;

    fn from_str(words: &str) -> ParseResult<Action> {
        if let Some(action) = PanelAction::of_row(words)? {
            return Ok(Action::Panel(action));
        }
        let (thing, rest) = split(words);
        Ok(match thing {
            "jog" => Action::Panel(jog(rest)?),
            "program" => program(rest)?,
            "breakpoints" if rest == "none" => Action::Breakpoints(Vec::new()),
            "breakpoints" => Action::Breakpoints(breakpoints(rest)?),
            "alarms" => alarms_action(rest)?,
            "power" => match rest {
                "on" => Action::PowerOn,
                "off" => Action::PowerOff,
                "cycle" => Action::Panel(PanelAction::PowerCycle),
                _ => return Err(expected("on, off or cycle", rest)),
            },
            "pendant" => pendant_action(rest)?,
            "input" => line_action(IoKind::Input, rest)?,
            "output" => line_action(IoKind::Output, rest)?,
            "variable" => set_variable(rest)?,
            "position" => teach(rest)?,
            "file" => file_action(rest)?,
            "faults" => Action::Fault(fault_action(rest)?),
            _ => return Err(ActionParseError::Unknown(words.to_string())),
        })
    }
}

fn program(rest: &str) -> ParseResult<Action> {
    let (verb, line) = split(rest);
    Ok(match (verb, line) {
        ("run-to", line) => Action::RunTo(file_line(line)?),
        ("step-task", rest) => {
            let (kind, task) = split(rest);
            Action::StepTask {
                kind: StepKind::read(kind)?,
                task: number(task, "the number of a task")?,
            }
        }
        ("assign", rest) => {
            let (task, rest) = split(rest);
            let (call, text) = split(rest);
            Action::Assign(Assignment {
                task: number(task, "the number of a task")?,
                call: number(call, "the number of a call, 0 the outermost")?,
                text: unescaped(text)?,
            })
        }
        _ => {
            let form = "start, stop, step, run-to LINE, step-task KIND TASK or assign TASK CALL NAME = VALUE";
            return Err(expected(form, rest));
        }
    })
}

fn number<T: FromStr>(word: &str, form: &'static str) -> ParseResult<T> {
    word.parse().map_err(|_| expected(form, word))
}

/// The line, and the rules that it has.
fn write_breakpoint(set: &Breakpoint, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    write!(f, " {}", set.line)?;
    if let Some(condition) = &set.condition {
        write!(f, " if {}", as_word(condition))?;
    }
    if let Some(hits) = &set.hits {
        write!(f, " hits {hits}")?;
    }
    match &set.message {
        Some(message) => write!(f, " say {}", as_word(message)),
        None => Ok(()),
    }
}

/// Lines, each with the rules after it.
fn breakpoints(rest: &str) -> ParseResult<Vec<Breakpoint>> {
    let mut words = rest.split(' ').peekable();
    let mut set: Vec<Breakpoint> = Vec::new();
    while let Some(word) = words.next() {
        let mut breakpoint = Breakpoint::at(file_line(word)?);
        loop {
            let rule = words.next_if(|word| ["if", "hits", "say"].contains(word));
            let Some(rule) = rule else { break };
            let form = "a condition, a rule for hits or a message, without blanks";
            let value = words.next().filter(|value| !value.is_empty());
            let value = value.ok_or_else(|| expected(form, ""))?;
            match rule {
                "if" => breakpoint.condition = Some(unescaped(value)?),
                "say" => breakpoint.message = Some(unescaped(value)?),
                _ => breakpoint.hits = Some(value.parse().map_err(|_| expected(HITS, value))?),
            }
        }
        set.push(breakpoint);
    }
    Ok(set)
}

fn file_line(word: &str) -> ParseResult<u32> {
    let line = word.parse().ok().filter(|line| *line > 0);
    line.ok_or_else(|| expected("the number of a line", word))
}

fn jog(rest: &str) -> ParseResult<PanelAction> {
    let form = "stop, or an axis, plus or minus, a coordinate system and a rate";
    let wrong = || expected(form, rest);
    let words: Vec<&str> = rest.trim_end().split(' ').collect();
    let (settings, inching) = match words.as_slice() {
        [settings @ .., "inching"] => (settings, true),
        settings => (settings, false),
    };
    let [axis, sign, coordinates, rate] = settings else {
        return Err(wrong());
    };
    Ok(PanelAction::Jog {
        axis: axis.parse().map_err(|_| wrong())?,
        positive: match *sign {
            "plus" => true,
            "minus" => false,
            _ => return Err(wrong()),
        },
        mode: JogMode::from_words(coordinates, rate, inching).ok_or_else(wrong)?,
    })
}

fn alarms_action(rest: &str) -> ParseResult<Action> {
    let (verb, rest) = split(rest);
    match verb {
        "raise" => {
            let (number, detail) = split(rest);
            let (number, detail) = (unescaped(number)?, detail.to_string());
            Ok(Action::RaiseAlarm { number, detail })
        }
        _ => Err(expected("raise NUMBER or reset", verb)),
    }
}

fn pendant_action(rest: &str) -> ParseResult<Action> {
    let ("keys", keys) = split(rest) else {
        return Err(expected("keys TEXT", rest));
    };
    Ok(Action::Panel(PanelAction::Keys(unescaped(keys)?)))
}

/// Actions on an input or output: `5 on`, `5 pulse on 200 ms`, `5 force off`, `5 release`.
fn line_action(side: IoKind, rest: &str) -> ParseResult<Action> {
    let (number, what) = split(rest);
    let line = number
        .parse()
        .map_err(|_| expected("the number of a line", number))?;
    let (verb, rest) = split(what);
    Ok(match (verb, side) {
        ("pulse", side) => {
            let (on, length) = split(rest);
            let on = bool::read(on)?;
            let length = parse_duration(length)?;
            Action::Pulse {
                side,
                line,
                on,
                length,
            }
        }
        ("force", side) => {
            let on = bool::read(rest)?;
            Action::Force { side, line, on }
        }
        ("release", side) if rest.is_empty() => Action::Release { side, line },
        ("on" | "off", IoKind::Input) => {
            let on = bool::read(what)?;
            Action::Panel(PanelAction::InputLine { line, on })
        }
        ("on" | "off", IoKind::Output) => {
            let on = bool::read(what)?;
            Action::SetOutput { line, on }
        }
        _ => return Err(expected("on, off, pulse, force or release", what)),
    })
}

fn set_variable(rest: &str) -> ParseResult<Action> {
    let (rest, restore) = split_restore(rest);
    let (name, values) = split(rest);
    if name.is_empty() || values.is_empty() {
        return Err(expected("a name and numbers", rest));
    }
    let number = |word: &str| Number::parse(word).ok_or_else(|| expected("a number", word));
    let values = values.split(' ').map(number).collect::<ParseResult<_>>()?;
    Ok(Action::SetVariable {
        name: unescaped(name)?,
        values,
        restore,
    })
}

fn teach(rest: &str) -> ParseResult<Action> {
    let (words, restore) = split_restore(rest);
    match split(words) {
        (name, "teach") if !name.is_empty() => Ok(Action::Teach {
            name: unescaped(name)?,
            restore,
        }),
        _ => Err(expected("NAME teach", rest)),
    }
}

/// The words without a `restore` at their end, and whether there was one.
fn split_restore(words: &str) -> (&str, bool) {
    words
        .strip_suffix(" restore")
        .map_or((words, false), |words| (words, true))
}

fn one_name(word: &str) -> ParseResult<String> {
    unescaped(&single_word("one name", word)?)
}

fn file_action(rest: &str) -> ParseResult<Action> {
    let (verb, rest) = split(rest);
    Ok(match verb {
        "put" => {
            let (name, content) = split(rest);
            let (name, content) = (one_name(name)?, escape::parse(content)?);
            Action::PutFile { name, content }
        }
        "erase" => Action::EraseFile {
            name: one_name(rest)?,
        },
        "select" => Action::Select {
            name: one_name(rest)?,
        },
        _ => return Err(expected("put, erase or select", verb)),
    })
}

fn fault_action(rest: &str) -> ParseResult<FaultAction> {
    let (verb, rest) = split(rest);
    let no_number = |word: &str| expected("the number of a fault", word);
    let number = |word: &str| word.parse::<u32>().map_err(|_| no_number(word));
    Ok(match verb {
        "arm" => {
            let (id, spec) = match rest.split_once(' ') {
                Some((id, spec)) if id.bytes().all(|byte| byte.is_ascii_digit()) => (Some(number(id)?), spec),
                _ => (None, rest),
            };
            let mut fault: Fault = spec.parse()?;
            // A number may be among its keys too.
            fault.id = id.unwrap_or(fault.id);
            FaultAction::Arm(Box::new(fault))
        }
        "disarm" => FaultAction::Disarm(number(rest)?),
        "clear" if rest.is_empty() => FaultAction::Clear,
        _ => return Err(expected("arm, disarm or clear", verb)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panel::{ControlRight, KeySwitch};
    use alloc::borrow::ToOwned;
    use ts3100_proto::command::RunMode;
    use ts3100_proto::words::Word;

    use core::time::Duration;

    #[test]
    fn every_action_reads_back_as_it_was_written() {
        let (side, line, on) = (IoKind::Input, 101, true);
        let name = || "P1".to_owned();
        let values = vec![Number::Integer(-3), Number::Real(1.0), Number::Real(1e-9)];
        let actions = [
            Action::Panel(PanelAction::PressFeedHold),
            Action::Panel(PanelAction::InputLine { line, on }),
            Action::PowerOff,
            Action::PowerOn,
            Action::RaiseAlarm {
                number: "2-046".to_owned(),
                detail: String::new(),
            },
            Action::RaiseAlarm {
                number: "2-046".to_owned(),
                detail: "by hand: <x>".to_owned(),
            },
            Action::Pulse {
                side: IoKind::Output,
                line,
                on,
                length: Duration::from_micros(1_500),
            },
            Action::SetOutput { line, on: false },
            Action::Force { side, line, on },
            Action::Release { side, line },
            Action::SetVariable {
                name: "A(1,2)".to_owned(),
                values,
                restore: false,
            },
            Action::SetVariable {
                name: name(),
                values: vec![Number::Integer(0)],
                restore: true,
            },
            Action::Teach {
                name: name(),
                restore: true,
            },
            Action::Teach {
                name: name(),
                restore: false,
            },
            Action::PutFile {
                name: name(),
                content: b"PROGRAM A B\r\nEND\n\xff<".to_vec(),
            },
            Action::PutFile {
                name: name(),
                content: Vec::new(),
            },
            Action::EraseFile { name: name() },
            // Impossible names are refused, and recorded all the same.
            Action::EraseFile {
                name: "A B\n! servo off <\u{fc}>".to_owned(),
            },
            Action::Select { name: name() },
        ];
        for action in actions {
            let words = action.to_string();
            assert_eq!(words.parse(), Ok(action), "{words}");
            assert!(words.is_ascii() && !words.contains('\n'), "{words:?}");
        }
    }

    #[test]
    fn words_are_those_of_ctl() {
        for words in [
            "key-switch teaching",
            "control-right rs232c",
            "emergency-stop press",
            "safety-switch close",
            "servo off",
            "feed-hold on",
            "feed-hold press",
            "machine-lock on",
            "battery low",
            "battery ok",
            "override 35",
            "run-mode step",
            "jog 1 plus joint slow",
            "jog 6 minus tool fast inching",
            "jog stop",
            "program step",
            "program run-to 12",
            "breakpoints none",
            "breakpoints 3 17",
            "breakpoints 3 17 if N<20>><20>2 hits >=4 say part<20>{N} 20 hits %2",
            "program step-task over 2",
            "program assign 1 0 N = 5",
            "program start",
            "program stop",
            "alarms raise 2-046",
            "alarms reset",
            "pendant keys 1,2<CR>",
            "input 5 on",
            "input 5 pulse on 200000 us",
            "output 5 off",
            "output 5 force on",
            "output 5 release",
            "variable A(1,2) -3 1.5",
            "variable N 1 restore",
            "position P1 teach",
            "position P1 teach restore",
            "file put N A<CR>",
            "file erase N",
            "file select N",
            "power on",
            "power off",
            "power cycle",
            "faults disarm 3",
            "faults clear",
        ] {
            let action: Action = words.parse().unwrap();
            assert_eq!(action.to_string(), words);
        }
        let pulse: Action = "input 5 pulse on 0.2s".parse().unwrap();
        assert_eq!("input 5 pulse on 200 ms".parse(), Ok(pulse));
    }

    #[test]
    fn a_pulse_is_as_long_when_it_is_read_back() {
        let length = Duration::from_nanos(1_001);
        let pulse = Action::Pulse {
            side: IoKind::Input,
            line: 5,
            on: true,
            length,
        };
        let ends = |length| crate::Time::ZERO + length;
        let Ok(Action::Pulse { length: read, .. }) = pulse.to_string().parse() else {
            panic!("{pulse}");
        };
        assert_eq!(ends(read), ends(length));
    }

    #[test]
    fn what_is_no_action_is_refused() {
        for words in [
            "",
            "power",
            "input 1 pulse on 5",
            "input 1 pulse on -5 ms",
            "input 1 force",
            "input release",
            "input 1 release now",
            "variable N",
            "variable N one",
            "variable N restore",
            "output 1",
            "position P1",
            "position P1 teach now",
            "position teach",
            "file put",
            "file erase ",
            "file select A B",
            "fly",
            "servo",
            "servo maybe",
            "emergency-stop down",
            "battery full",
            "override 0",
            "override 101",
            "run-mode fast",
            "jog",
            "jog 1 up joint slow",
            "jog 1 plus base slow",
            "jog 1 plus joint slow inching on",
            "input x on",
            "program",
            "program start now",
            "program run-to",
            "program run-to 0",
            "breakpoints",
            "breakpoints 3 x",
            "breakpoints 3 if",
            "breakpoints if A",
            "breakpoints 3 hits x",
            "program step-task up 1",
            "program step-task over",
            "program assign 1 x N = 5",
            "alarms reset now",
            "pendant 5",
            "pendant keys <FF>",
        ] {
            assert!(words.parse::<Action>().is_err(), "{words}");
        }
    }

    #[test]
    fn every_panel_action_reads_back() {
        let switches = [
            PanelAction::EmergencyStop,
            PanelAction::SafetySwitch,
            PanelAction::Servo,
            PanelAction::MachineLock,
            PanelAction::Battery,
            PanelAction::FeedHold,
        ];
        let mut all: Vec<PanelAction> = switches
            .into_iter()
            .flat_map(|make| [make(true), make(false)])
            .collect();
        all.extend([KeySwitch::Teaching, KeySwitch::Internal, KeySwitch::Ext].map(PanelAction::Key));
        let rights = [ControlRight::Sig, ControlRight::Rs232c, ControlRight::Ether];
        all.extend(rights.map(PanelAction::ControlRight));
        all.extend(RunMode::ALL.map(PanelAction::RunMode));
        all.extend([
            PanelAction::Override(35),
            PanelAction::Jog {
                axis: 3,
                positive: false,
                mode: JogMode {
                    coordinate: 2,
                    rate: 1,
                    mode: 0,
                },
            },
            PanelAction::JogStop,
            PanelAction::Start,
            PanelAction::Stop,
            PanelAction::Step,
            PanelAction::PressFeedHold,
            PanelAction::AlarmReset,
            PanelAction::PowerCycle,
            PanelAction::InputLine { line: 264, on: true },
            PanelAction::Keys("1,2<\r".to_owned()),
        ]);
        for panel in all {
            assert_eq!(panel.to_string().parse(), Ok(Action::Panel(panel)));
        }
    }

    #[test]
    fn the_words_of_a_choice_are_those_of_its_type() {
        let words = |name: &str| {
            let mut rows = SWITCHES.iter();
            rows.find(|row| row.name() == name)
                .map(|row| row.words().collect::<Vec<_>>())
        };
        assert_eq!(words("key-switch"), Some(KeySwitch::ALL.map(Word::word).to_vec()));
        assert_eq!(
            words("control-right"),
            Some(ControlRight::ALL.map(Word::word).to_vec())
        );
        assert_eq!(words("run-mode"), Some(RunMode::ALL.map(Word::word).to_vec()));
    }

    #[test]
    fn a_wrong_word_gets_those_of_the_values_and_the_buttons() {
        let error = "feed-hold down".parse::<Action>().unwrap_err();
        assert_eq!(error.to_string(), "expected on, off or press, found `down`");
        let error = "override 101".parse::<Action>().unwrap_err();
        assert_eq!(
            error.to_string(),
            "expected a whole number from 1 to 100, found `101`"
        );
    }
}
