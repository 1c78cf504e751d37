//! The words of a transcript for what was done to the controller by one who holds it, beyond the panel: behind `!` in
//! a text, in `deed` of a JSON line.

use super::{notation, panel};
use std::time::Duration;
use ts3100_controller::faults::{Fault, FaultError, FaultOrder};
use ts3100_controller::{Deed, Side};
use ts3100_proto::command::Number;

/// The words of a deed. One at the panel has those of the panel.
#[must_use]
pub fn write(deed: &Deed) -> String {
    let state = |on: bool| if on { "on" } else { "off" };
    match deed {
        Deed::Panel(action) => panel::write(action),
        Deed::FeedHold(on) => format!("feed-hold {}", state(*on)),
        Deed::PowerOff => "power off".to_owned(),
        Deed::PowerOn => "power on".to_owned(),
        Deed::RaiseAlarm { number, detail } => format!("raise {number} {detail}").trim_end().to_owned(),
        Deed::Pulse {
            side,
            line,
            on,
            length,
        } => {
            let micros = length.as_micros();
            format!("pulse {} {line} {} {micros}us", side_word(*side), state(*on))
        }
        Deed::SetOutput { line, on } => format!("output {line} {}", state(*on)),
        Deed::Force { side, line, on } => format!("force {} {line} {}", side_word(*side), state(*on)),
        Deed::Release { side, line } => format!("release {} {line}", side_word(*side)),
        Deed::SetVariable {
            name,
            values,
            restore,
        } => {
            let values: Vec<String> = values.iter().map(number_word).collect();
            format!("{} {name} {}", verb("set", *restore), values.join(" "))
        }
        Deed::Teach { name, restore } => format!("{} {name}", verb("teach", *restore)),
        Deed::PutFile { name, content } => format!("put {name} {}", notation::write(content)),
        Deed::EraseFile { name } => format!("erase {name}"),
        Deed::Select { name } => format!("select {name}"),
        Deed::Fault(FaultOrder::Arm(fault)) => match fault.id {
            0 => format!("fault arm {fault}"),
            id => format!("fault arm {id} {fault}"),
        },
        Deed::Fault(FaultOrder::Disarm(id)) => format!("fault disarm {id}"),
        Deed::Fault(FaultOrder::Clear) => "fault clear".to_owned(),
    }
}

fn side_word(side: Side) -> &'static str {
    match side {
        Side::Input => "input",
        Side::Output => "output",
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

/// Reads the words of a deed, those of the panel among them.
///
/// # Errors
/// What is no deed, with what was expected.
pub fn read(words: &str) -> Result<Deed, String> {
    let (name, rest) = words.split_once(' ').unwrap_or((words, ""));
    Ok(match (name, rest) {
        ("feed-hold", "on" | "off") => Deed::FeedHold(rest == "on"),
        ("power", "off") => Deed::PowerOff,
        ("power", "on") => Deed::PowerOn,
        ("raise", rest) => {
            let (number, detail) = rest.split_once(' ').unwrap_or((rest, ""));
            let (number, detail) = (number.to_owned(), detail.to_owned());
            Deed::RaiseAlarm { number, detail }
        }
        ("pulse", rest) => read_pulse(rest)?,
        ("output", rest) => {
            let (line, on) = rest
                .split_once(' ')
                .ok_or_else(|| wrong("a line and on or off", rest))?;
            let (line, on) = (line_of(line)?, state_of(on)?);
            Deed::SetOutput { line, on }
        }
        ("force" | "release", rest) => read_force(rest, name == "release")?,
        ("set" | "set-restore", rest) => read_set(rest, name == "set-restore")?,
        ("teach" | "teach-restore", name_of) => Deed::Teach {
            name: one(name_of)?,
            restore: name == "teach-restore",
        },
        ("put", rest) => {
            let (name, content) = rest.split_once(' ').unwrap_or((rest, ""));
            let (name, content) = (one(name)?, notation::bytes(content)?);
            Deed::PutFile { name, content }
        }
        ("erase", name) => Deed::EraseFile { name: one(name)? },
        ("select", name) => Deed::Select { name: one(name)? },
        ("fault", rest) => Deed::Fault(read_fault(rest)?),
        _ => Deed::Panel(panel::read(words)?),
    })
}

fn read_fault(rest: &str) -> Result<FaultOrder, String> {
    let (verb, rest) = rest.split_once(' ').unwrap_or((rest, ""));
    let number = |word: &str| {
        word.parse::<u32>()
            .map_err(|_| wrong("the number of a fault", word))
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
            FaultOrder::Arm(Box::new(fault))
        }
        "disarm" => FaultOrder::Disarm(number(rest)?),
        "clear" if rest.is_empty() => FaultOrder::Clear,
        _ => return Err(wrong("arm, disarm or clear", verb)),
    })
}

fn wrong(expected: &str, found: &str) -> String {
    format!("{expected} expected, {found:?} found")
}

fn one(word: &str) -> Result<String, String> {
    if word.is_empty() || word.contains(' ') {
        return Err(wrong("one name", word));
    }
    Ok(word.to_owned())
}

fn line_of(word: &str) -> Result<u16, String> {
    word.parse().map_err(|_| wrong("the number of a line", word))
}

fn state_of(word: &str) -> Result<bool, String> {
    match word {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err(wrong("on or off", word)),
    }
}

fn side_of(word: &str) -> Result<Side, String> {
    match word {
        "input" => Ok(Side::Input),
        "output" => Ok(Side::Output),
        _ => Err(wrong("input or output", word)),
    }
}

fn read_pulse(rest: &str) -> Result<Deed, String> {
    let words: Vec<&str> = rest.split(' ').collect();
    let [side, line, on, length] = words.as_slice() else {
        return Err(wrong(
            "input or output, a line, on or off, and a length in us",
            rest,
        ));
    };
    let micros = length.strip_suffix("us").and_then(|micros| micros.parse().ok());
    let micros = micros.ok_or_else(|| wrong("a length in us", length))?;
    Ok(Deed::Pulse {
        side: side_of(side)?,
        line: line_of(line)?,
        on: state_of(on)?,
        length: Duration::from_micros(micros),
    })
}

fn read_force(rest: &str, release: bool) -> Result<Deed, String> {
    let words: Vec<&str> = rest.split(' ').collect();
    match (words.as_slice(), release) {
        ([side, line, on], false) => Ok(Deed::Force {
            side: side_of(side)?,
            line: line_of(line)?,
            on: state_of(on)?,
        }),
        ([side, line], true) => Ok(Deed::Release {
            side: side_of(side)?,
            line: line_of(line)?,
        }),
        _ => Err(wrong("input or output, a line, and for force on or off", rest)),
    }
}

fn read_set(rest: &str, restore: bool) -> Result<Deed, String> {
    let mut words = rest.split(' ');
    let name = one(words.next().unwrap_or_default())?;
    let number = |word: &str| Number::parse(word).ok_or_else(|| wrong("a number", word));
    let values = words.map(number).collect::<Result<Vec<Number>, String>>()?;
    if values.is_empty() {
        return Err(wrong("a name and numbers", rest));
    }
    Ok(Deed::SetVariable {
        name,
        values,
        restore,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ts3100_controller::Panel;

    #[test]
    fn every_deed_reads_back_as_it_was_written() {
        let (side, line, on) = (Side::Input, 101, true);
        let name = || "P1".to_owned();
        let values = vec![Number::Integer(-3), Number::Real(1.0), Number::Real(1e-9)];
        let deeds = [
            Deed::Panel(Panel::FeedHold),
            Deed::Panel(Panel::InputLine { line, on }),
            Deed::FeedHold(true),
            Deed::PowerOff,
            Deed::PowerOn,
            Deed::RaiseAlarm {
                number: "2-046".to_owned(),
                detail: String::new(),
            },
            Deed::RaiseAlarm {
                number: "2-046".to_owned(),
                detail: "by hand: <x>".to_owned(),
            },
            Deed::Pulse {
                side: Side::Output,
                line,
                on,
                length: Duration::from_micros(1_500),
            },
            Deed::SetOutput { line, on: false },
            Deed::Force { side, line, on },
            Deed::Release { side, line },
            Deed::SetVariable {
                name: "A(1,2)".to_owned(),
                values,
                restore: false,
            },
            Deed::SetVariable {
                name: name(),
                values: vec![Number::Integer(0)],
                restore: true,
            },
            Deed::Teach {
                name: name(),
                restore: true,
            },
            Deed::Teach {
                name: name(),
                restore: false,
            },
            Deed::PutFile {
                name: name(),
                content: b"PROGRAM A B\r\nEND\n\xff<".to_vec(),
            },
            Deed::PutFile {
                name: name(),
                content: Vec::new(),
            },
            Deed::EraseFile { name: name() },
            Deed::Select { name: name() },
        ];
        for deed in deeds {
            let words = write(&deed);
            assert_eq!(read(&words), Ok(deed), "{words}");
            assert!(words.is_ascii() && !words.contains('\n'), "{words:?}");
        }
    }

    #[test]
    fn what_is_no_deed_is_refused() {
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
