//! The text form of actions at the operator panel: after `!` in a text transcript, in `panel` of a JSON line. Other actions
//! are in [`super::action`].

use super::notation;
use ts3100_controller::{ControlRight, KeySwitch, PanelAction};

/// The words of an action.
#[must_use]
pub fn write(panel: &PanelAction) -> String {
    let switch = |word: &str, on: bool| format!("{word} {}", if on { "on" } else { "off" });
    match panel {
        PanelAction::Key(KeySwitch::Teaching) => "key teaching".to_owned(),
        PanelAction::Key(KeySwitch::Internal) => "key internal".to_owned(),
        PanelAction::Key(KeySwitch::Ext) => "key ext".to_owned(),
        PanelAction::ControlRight(ControlRight::Sig) => "control-right sig".to_owned(),
        PanelAction::ControlRight(ControlRight::Rs232c) => "control-right rs232c".to_owned(),
        PanelAction::ControlRight(ControlRight::Ether) => "control-right ether".to_owned(),
        PanelAction::EmergencyStop(on) => switch("emergency-stop", *on),
        PanelAction::SafetySwitch(open) => switch("safety-switch", *open),
        PanelAction::Servo(on) => switch("servo", *on),
        PanelAction::Start => "start".to_owned(),
        PanelAction::Stop => "stop".to_owned(),
        PanelAction::FeedHold => "feed-hold".to_owned(),
        PanelAction::AlarmReset => "alarm-reset".to_owned(),
        PanelAction::MachineLock(on) => switch("machine-lock", *on),
        PanelAction::InputLine { line, on } => switch(&format!("input {line}"), *on),
        PanelAction::Battery(low) => switch("battery-low", *low),
        PanelAction::Keys(keys) => format!("keys {}", notation::write(keys.as_bytes())),
        PanelAction::PowerCycle => "power-cycle".to_owned(),
    }
}

/// Reads the words of an action.
///
/// # Errors
/// What is no action, or no `on` or `off`.
pub fn read(words: &str) -> Result<PanelAction, String> {
    let (name, rest) = words.split_once(' ').unwrap_or((words, ""));
    Ok(match (name, rest) {
        ("key", "teaching") => PanelAction::Key(KeySwitch::Teaching),
        ("key", "internal") => PanelAction::Key(KeySwitch::Internal),
        ("key", "ext") => PanelAction::Key(KeySwitch::Ext),
        ("control-right", "sig") => PanelAction::ControlRight(ControlRight::Sig),
        ("control-right", "rs232c") => PanelAction::ControlRight(ControlRight::Rs232c),
        ("control-right", "ether") => PanelAction::ControlRight(ControlRight::Ether),
        ("emergency-stop", state) => PanelAction::EmergencyStop(parse_switch(state)?),
        ("safety-switch", state) => PanelAction::SafetySwitch(parse_switch(state)?),
        ("servo", state) => PanelAction::Servo(parse_switch(state)?),
        ("start", "") => PanelAction::Start,
        ("stop", "") => PanelAction::Stop,
        ("feed-hold", "") => PanelAction::FeedHold,
        ("alarm-reset", "") => PanelAction::AlarmReset,
        ("machine-lock", state) => PanelAction::MachineLock(parse_switch(state)?),
        ("input", rest) => {
            let (line, state) = rest.split_once(' ').unwrap_or((rest, ""));
            let line = line
                .parse()
                .map_err(|_| format!("a line number expected, {line:?} found"))?;
            PanelAction::InputLine {
                line,
                on: parse_switch(state)?,
            }
        }
        ("battery-low", state) => PanelAction::Battery(parse_switch(state)?),
        ("keys", keys) => {
            let keys = String::from_utf8(notation::read_bytes(keys)?);
            PanelAction::Keys(keys.map_err(|error| format!("keys of the pendant expected: {error}"))?)
        }
        ("power-cycle", "") => PanelAction::PowerCycle,
        _ => return Err(format!("{words:?} is no action at the controller")),
    })
}

fn parse_switch(word: &str) -> Result<bool, String> {
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
            PanelAction::EmergencyStop,
            PanelAction::SafetySwitch,
            PanelAction::Servo,
            PanelAction::MachineLock,
            PanelAction::Battery,
        ];
        let mut all: Vec<PanelAction> = switches
            .into_iter()
            .flat_map(|make| [make(true), make(false)])
            .collect();
        all.extend([KeySwitch::Teaching, KeySwitch::Internal, KeySwitch::Ext].map(PanelAction::Key));
        let rights = [ControlRight::Sig, ControlRight::Rs232c, ControlRight::Ether];
        all.extend(rights.map(PanelAction::ControlRight));
        all.extend([
            PanelAction::Start,
            PanelAction::Stop,
            PanelAction::FeedHold,
            PanelAction::AlarmReset,
            PanelAction::PowerCycle,
            PanelAction::InputLine { line: 264, on: true },
            PanelAction::Keys("1,2<\r".to_owned()),
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
