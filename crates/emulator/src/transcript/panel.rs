//! The words of a transcript for what is done at the controller itself: behind `!` in a text, in `panel` of a
//! JSON line.

use super::notation;
use ts3100_controller::{ControlRight, KeySwitch, Panel};

/// The words of an action.
#[must_use]
pub fn write(panel: &Panel) -> String {
    let switch = |word: &str, on: bool| format!("{word} {}", if on { "on" } else { "off" });
    match panel {
        Panel::Key(KeySwitch::Teaching) => "key teaching".to_owned(),
        Panel::Key(KeySwitch::Internal) => "key internal".to_owned(),
        Panel::Key(KeySwitch::Ext) => "key ext".to_owned(),
        Panel::ControlRight(ControlRight::Sig) => "control-right sig".to_owned(),
        Panel::ControlRight(ControlRight::Rs232c) => "control-right rs232c".to_owned(),
        Panel::ControlRight(ControlRight::Ether) => "control-right ether".to_owned(),
        Panel::EmergencyStop(on) => switch("emergency-stop", *on),
        Panel::SafetySwitch(open) => switch("safety-switch", *open),
        Panel::Servo(on) => switch("servo", *on),
        Panel::Start => "start".to_owned(),
        Panel::Stop => "stop".to_owned(),
        Panel::FeedHold => "feed-hold".to_owned(),
        Panel::AlarmReset => "alarm-reset".to_owned(),
        Panel::MachineLock(on) => switch("machine-lock", *on),
        Panel::InputLine { line, on } => switch(&format!("input {line}"), *on),
        Panel::Battery(low) => switch("battery-low", *low),
        Panel::Keys(keys) => format!("keys {}", notation::write(keys.as_bytes())),
        Panel::PowerCycle => "power-cycle".to_owned(),
    }
}

/// Reads the words of an action.
///
/// # Errors
/// What is no action, or no `on` or `off`.
pub fn read(words: &str) -> Result<Panel, String> {
    let (name, rest) = words.split_once(' ').unwrap_or((words, ""));
    Ok(match (name, rest) {
        ("key", "teaching") => Panel::Key(KeySwitch::Teaching),
        ("key", "internal") => Panel::Key(KeySwitch::Internal),
        ("key", "ext") => Panel::Key(KeySwitch::Ext),
        ("control-right", "sig") => Panel::ControlRight(ControlRight::Sig),
        ("control-right", "rs232c") => Panel::ControlRight(ControlRight::Rs232c),
        ("control-right", "ether") => Panel::ControlRight(ControlRight::Ether),
        ("emergency-stop", state) => Panel::EmergencyStop(on(state)?),
        ("safety-switch", state) => Panel::SafetySwitch(on(state)?),
        ("servo", state) => Panel::Servo(on(state)?),
        ("start", "") => Panel::Start,
        ("stop", "") => Panel::Stop,
        ("feed-hold", "") => Panel::FeedHold,
        ("alarm-reset", "") => Panel::AlarmReset,
        ("machine-lock", state) => Panel::MachineLock(on(state)?),
        ("input", rest) => {
            let (line, state) = rest.split_once(' ').unwrap_or((rest, ""));
            let line = line
                .parse()
                .map_err(|_| format!("a line number expected, {line:?} found"))?;
            Panel::InputLine { line, on: on(state)? }
        }
        ("battery-low", state) => Panel::Battery(on(state)?),
        ("keys", keys) => {
            let keys = String::from_utf8(notation::bytes(keys)?);
            Panel::Keys(keys.map_err(|error| format!("keys of the pendant expected: {error}"))?)
        }
        ("power-cycle", "") => Panel::PowerCycle,
        _ => return Err(format!("{words:?} is no action at the controller")),
    })
}

fn on(word: &str) -> Result<bool, String> {
    match word {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err(format!("on or off expected, {word:?} found")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_action_reads_back() {
        let switches = [
            Panel::EmergencyStop,
            Panel::SafetySwitch,
            Panel::Servo,
            Panel::MachineLock,
            Panel::Battery,
        ];
        let mut all: Vec<Panel> = switches
            .into_iter()
            .flat_map(|make| [make(true), make(false)])
            .collect();
        all.extend([KeySwitch::Teaching, KeySwitch::Internal, KeySwitch::Ext].map(Panel::Key));
        let rights = [ControlRight::Sig, ControlRight::Rs232c, ControlRight::Ether];
        all.extend(rights.map(Panel::ControlRight));
        all.extend([
            Panel::Start,
            Panel::Stop,
            Panel::FeedHold,
            Panel::AlarmReset,
            Panel::PowerCycle,
            Panel::InputLine { line: 264, on: true },
            Panel::Keys("1,2<\r".to_owned()),
        ]);
        for panel in all {
            assert_eq!(read(&write(&panel)), Ok(panel));
        }
    }

    #[test]
    fn what_is_no_action_is_refused() {
        for words in [
            "",
            "dance",
            "servo",
            "servo maybe",
            "input x on",
            "input 1",
            "start now",
            "keys <FF>",
        ] {
            assert!(read(words).is_err(), "{words}");
        }
    }
}
