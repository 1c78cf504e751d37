//! The text form of actions on the controller other than at the panel: after `!` in a text transcript, in `deed` of a JSON
//! line, and in scenarios. Actions at the panel are in [`panel`].

use super::{notation, panel};
use std::time::Duration;
use ts3100_controller::faults::{Fault, FaultAction, FaultError};
use ts3100_controller::{Action, IoKind};
use ts3100_proto::command::Number;

/// The words of a action. One at the panel has those of the panel.
#[must_use]
pub fn write(action: &Action) -> String {
    let state = |on: bool| if on { "on" } else { "off" };
    match action {
        Action::Panel(action) => panel::write(action),
        Action::FeedHold(on) => format!("feed-hold {}", state(*on)),
        Action::PowerOff => "power off".to_owned(),
        Action::PowerOn => "power on".to_owned(),
        Action::RaiseAlarm { number, detail } => format!("raise {number} {detail}").trim_end().to_owned(),
        Action::Pulse {
            side,
            line,
            on,
            length,
        } => {
            let micros = length.as_micros();
            format!("pulse {} {line} {} {micros}us", kind_word(*side), state(*on))
        }
        Action::SetOutput { line, on } => format!("output {line} {}", state(*on)),
        Action::Force { side, line, on } => format!("force {} {line} {}", kind_word(*side), state(*on)),
        Action::Release { side, line } => format!("release {} {line}", kind_word(*side)),
        Action::SetVariable {
            name,
            values,
            restore,
        } => {
            let values: Vec<String> = values.iter().map(number_word).collect();
            format!("{} {name} {}", verb("set", *restore), values.join(" "))
        }
        Action::Teach { name, restore } => format!("{} {name}", verb("teach", *restore)),
        Action::PutFile { name, content } => format!("put {name} {}", notation::write(content)),
        Action::EraseFile { name } => format!("erase {name}"),
        Action::Select { name } => format!("select {name}"),
        Action::Fault(FaultAction::Arm(fault)) => match fault.id {
            0 => format!("fault arm {fault}"),
            id => format!("fault arm {id} {fault}"),
        },
        Action::Fault(FaultAction::Disarm(id)) => format!("fault disarm {id}"),
        Action::Fault(FaultAction::Clear) => "fault clear".to_owned(),
    }
}

fn kind_word(side: IoKind) -> &'static str {
    match side {
        IoKind::Input => "input",
        IoKind::Output => "output",
    }
}

fn verb(word: &str, restore: bool) -> String {
    if restore {
        format!("{word}-restore")
    } else {
        word.to_owned()
    }
}

/// As it was given: whole numbers without a decimal point, others so that they read back the same.
fn number_word(number: &Number) -> String {
    match number {
        Number::Integer(whole) => whole.to_string(),
        Number::Real(real) => format!("{real:?}"),
    }
}

/// Reads the words of a action, those of the panel among them.
///
/// # Errors
/// What is no action, with what was expected.
pub fn read(words: &str) -> Result<Action, String> {
    let (name, rest) = words.split_once(' ').unwrap_or((words, ""));
    Ok(match (name, rest) {
        ("feed-hold", "on" | "off") => Action::FeedHold(rest == "on"),
        ("power", "off") => Action::PowerOff,
        ("power", "on") => Action::PowerOn,
        ("raise", rest) => {
            let (number, detail) = rest.split_once(' ').unwrap_or((rest, ""));
            let (number, detail) = (number.to_owned(), detail.to_owned());
            Action::RaiseAlarm { number, detail }
        }
        ("pulse", rest) => read_pulse(rest)?,
        ("output", rest) => {
            let (line, on) = rest
                .split_once(' ')
                .ok_or_else(|| expected_found("a line and on or off", rest))?;
            let (line, on) = (parse_line(line)?, parse_switch(on)?);
            Action::SetOutput { line, on }
        }
        ("force" | "release", rest) => read_force(rest, name == "release")?,
        ("set" | "set-restore", rest) => read_set(rest, name == "set-restore")?,
        ("teach" | "teach-restore", name_of) => Action::Teach {
            name: single_word(name_of)?,
            restore: name == "teach-restore",
        },
        ("put", rest) => {
            let (name, content) = rest.split_once(' ').unwrap_or((rest, ""));
            let (name, content) = (single_word(name)?, notation::read_bytes(content)?);
            Action::PutFile { name, content }
        }
        ("erase", name) => Action::EraseFile {
            name: single_word(name)?,
        },
        ("select", name) => Action::Select {
            name: single_word(name)?,
        },
        ("fault", rest) => Action::Fault(read_fault(rest)?),
        _ => Action::Panel(panel::read(words)?),
    })
}

fn read_fault(rest: &str) -> Result<FaultAction, String> {
    let (verb, rest) = rest.split_once(' ').unwrap_or((rest, ""));
    let number = |word: &str| {
        word.parse::<u32>()
            .map_err(|_| expected_found("the number of a fault", word))
    };
    Ok(match verb {
        "arm" => {
            let (id, spec) = match rest.split_once(' ') {
                Some((id, spec)) if id.bytes().all(|byte| byte.is_ascii_digit()) => (Some(number(id)?), spec),
                _ => (None, rest),
            };
            let mut fault: Fault = spec.parse().map_err(|error: FaultError| error.to_string())?;
            // One may stand among its keys too.
            fault.id = id.unwrap_or(fault.id);
            FaultAction::Arm(Box::new(fault))
        }
        "disarm" => FaultAction::Disarm(number(rest)?),
        "clear" if rest.is_empty() => FaultAction::Clear,
        _ => return Err(expected_found("arm, disarm or clear", verb)),
    })
}

fn expected_found(expected: &str, found: &str) -> String {
    format!("{expected} expected, {found:?} found")
}

fn single_word(word: &str) -> Result<String, String> {
    if word.is_empty() || word.contains(' ') {
        return Err(expected_found("one name", word));
    }
    Ok(word.to_owned())
}

fn parse_line(word: &str) -> Result<u16, String> {
    word.parse()
        .map_err(|_| expected_found("the number of a line", word))
}

fn parse_switch(word: &str) -> Result<bool, String> {
    match word {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err(expected_found("on or off", word)),
    }
}

fn parse_kind(word: &str) -> Result<IoKind, String> {
    match word {
        "input" => Ok(IoKind::Input),
        "output" => Ok(IoKind::Output),
        _ => Err(expected_found("input or output", word)),
    }
}

fn read_pulse(rest: &str) -> Result<Action, String> {
    let words: Vec<&str> = rest.split(' ').collect();
    let [side, line, on, length] = words.as_slice() else {
        return Err(expected_found(
            "input or output, a line, on or off, and a length in us",
            rest,
        ));
    };
    let micros = length.strip_suffix("us").and_then(|micros| micros.parse().ok());
    let micros = micros.ok_or_else(|| expected_found("a length in us", length))?;
    Ok(Action::Pulse {
        side: parse_kind(side)?,
        line: parse_line(line)?,
        on: parse_switch(on)?,
        length: Duration::from_micros(micros),
    })
}

fn read_force(rest: &str, release: bool) -> Result<Action, String> {
    let words: Vec<&str> = rest.split(' ').collect();
    match (words.as_slice(), release) {
        ([side, line, on], false) => Ok(Action::Force {
            side: parse_kind(side)?,
            line: parse_line(line)?,
            on: parse_switch(on)?,
        }),
        ([side, line], true) => Ok(Action::Release {
            side: parse_kind(side)?,
            line: parse_line(line)?,
        }),
        _ => Err(expected_found(
            "input or output, a line, and for force on or off",
            rest,
        )),
    }
}

fn read_set(rest: &str, restore: bool) -> Result<Action, String> {
    let mut words = rest.split(' ');
    let name = single_word(words.next().unwrap_or_default())?;
    let number = |word: &str| Number::parse(word).ok_or_else(|| expected_found("a number", word));
    let values = words.map(number).collect::<Result<Vec<Number>, String>>()?;
    if values.is_empty() {
        return Err(expected_found("a name and numbers", rest));
    }
    Ok(Action::SetVariable {
        name,
        values,
        restore,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ts3100_controller::PanelAction;

    #[test]
    fn every_action_reads_back_as_it_was_written() {
        let (side, line, on) = (IoKind::Input, 101, true);
        let name = || "P1".to_owned();
        let values = vec![Number::Integer(-3), Number::Real(1.0), Number::Real(1e-9)];
        let actions = [
            Action::Panel(PanelAction::FeedHold),
            Action::Panel(PanelAction::InputLine { line, on }),
            Action::FeedHold(true),
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
            Action::Select { name: name() },
        ];
        for action in actions {
            let words = write(&action);
            assert_eq!(read(&words), Ok(action), "{words}");
            assert!(words.is_ascii() && !words.contains('\n'), "{words:?}");
        }
    }

    #[test]
    fn what_is_no_action_is_refused() {
        for words in [
            "",
            "power",
            "pulse input 1 on 5",
            "force input 1",
            "release input",
            "set N",
            "set N one",
            "output 1",
            "teach",
            "teach A B",
            "erase ",
            "fly",
        ] {
            assert!(read(words).is_err(), "{words}");
        }
    }
}
