//! The quick status of SM (hosts SM): 14 labelled items in one line.
//!
//! The watchdog that hosts feed by polling SM is the controller's. For the long forms see [`super::su`] and
//! [`super::sf`].

use super::fields::Field;
use super::{AlarmLevel, BodyError};
use crate::prelude::*;

/// The content of SM. Hosts read the items by position; the labels are those they were seen to accept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct QuickStatus {
    /// `EE`: emergency stop.
    pub emergency_stop: bool,
    /// `SE`: safety stop.
    pub safety_stop: bool,
    /// `SC`: stop command.
    pub stop_command: bool,
    /// `BC`: break command.
    pub break_command: bool,
    /// `ES`: emergency switch.
    pub emergency_switch: bool,
    /// `SS`: safety switch.
    pub safety_switch: bool,
    /// `SV`: servo power is on.
    pub servo: bool,
    /// `MM`: master mode, 0 TEACHING, 1 INTERNAL, 2 EXT (SIG), 3 EXT, 4 EXT (RS-232C), 5 EXT (ETHER).
    pub master_mode: u8,
    /// `RM`: operation mode, 0 continuous, 1 cycle, 2 step, 3 segment (hosts 8.8).
    pub run_mode: u8,
    /// `RS`: execution status as of [`super::ExecutionStatus::code`], 0 to 3.
    pub run_status: u8,
    /// `OV`: speed override in percent, 0 to 100.
    pub override_percent: u8,
    /// `AL`: level of the worst alarm, 8, 4, 2 or 1; 0 without an alarm.
    pub alarm_level: u8,
    /// `DC`: how many DO statements have ended since power-on, modulo 10. A host sees the end of a DO as a change
    /// (hosts 8.1).
    pub ended: u8,
    /// `DS`: a DO statement is being carried out.
    pub busy: bool,
}

/// Highest count of ended DO statements: it has one digit.
pub const MAX_ENDED: u8 = 9;

/// One item.
struct Item {
    label: &'static str,
    is_valid: fn(u8) -> bool,
    /// What an invalid value is told.
    expected: &'static str,
    place: Place,
}

/// The field of an item.
enum Place {
    Flag(fn(&mut QuickStatus) -> &mut bool),
    Number(fn(&mut QuickStatus) -> &mut u8),
}

const fn flag(label: &'static str, place: fn(&mut QuickStatus) -> &mut bool) -> Item {
    Item {
        label,
        is_valid: |value| value <= 1,
        expected: "0 or 1",
        place: Place::Flag(place),
    }
}

const fn number(
    label: &'static str,
    is_valid: fn(u8) -> bool,
    expected: &'static str,
    place: fn(&mut QuickStatus) -> &mut u8,
) -> Item {
    Item {
        label,
        is_valid,
        expected,
        place: Place::Number(place),
    }
}

/// The items in their order.
const ITEMS: [Item; 14] = [
    flag("EE", |status| &mut status.emergency_stop),
    flag("SE", |status| &mut status.safety_stop),
    flag("SC", |status| &mut status.stop_command),
    flag("BC", |status| &mut status.break_command),
    flag("ES", |status| &mut status.emergency_switch),
    flag("SS", |status| &mut status.safety_switch),
    flag("SV", |status| &mut status.servo),
    // Up to the highest of the vendor's client library.
    number(
        "MM",
        |mode| mode <= 5,
        "a master mode from 0 to 5",
        |status| &mut status.master_mode,
    ),
    number(
        "RM",
        |mode| mode <= 3,
        "an operation mode from 0 to 3",
        |status| &mut status.run_mode,
    ),
    number(
        "RS",
        |code| code <= 3,
        "an execution status from 0 to 3",
        |status| &mut status.run_status,
    ),
    number(
        "OV",
        |percent| percent <= 100,
        "a percentage from 0 to 100",
        |status| &mut status.override_percent,
    ),
    number(
        "AL",
        |level| level == 0 || AlarmLevel::from_number(level).is_some(),
        "an alarm level 8, 4, 2 or 1, or 0",
        |status| &mut status.alarm_level,
    ),
    number(
        "DC",
        |count| count <= MAX_ENDED,
        "one digit",
        |status| &mut status.ended,
    ),
    flag("DS", |status| &mut status.busy),
];

impl QuickStatus {
    /// The content of the file: 14 items, one blank between them, no CR at the end.
    pub fn encode(mut self) -> Vec<u8> {
        let items = ITEMS.each_ref().map(|item| {
            let value = match item.place {
                Place::Flag(place) => u8::from(*place(&mut self)),
                Place::Number(place) => *place(&mut self),
            };
            format!("{}{value}", item.label)
        });
        items.join(" ").into_bytes()
    }

    /// Reads a content; a CR at the end is allowed.
    ///
    /// # Errors
    /// An item that is missing, without its label, or out of its range; more than 14 items.
    pub fn decode(content: &[u8]) -> Result<QuickStatus, BodyError> {
        let whole = Field::record("SM", content);
        let mut found = whole.split(b' ');
        let mut status = QuickStatus::default();
        for Item {
            label,
            is_valid,
            expected,
            place,
        } in ITEMS
        {
            let item = found.next().ok_or_else(|| whole.error("14 items"))?;
            let field = item.after(label, label)?;
            let value = Some(field.number(expected)?).filter(|value| is_valid(*value));
            let value = value.ok_or_else(|| field.error(expected))?;
            match place {
                Place::Flag(place) => *place(&mut status) = value == 1,
                Place::Number(place) => *place(&mut status) = value,
            }
        }
        match found.next() {
            Some(surplus) => Err(surplus.error("the end after 14 items")),
            None => Ok(status),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the vendor's client library was seen to accept it (hosts SM).
    const IDLE: &[u8] = b"EE0 SE0 SC0 BC0 ES0 SS0 SV1 MM5 RM0 RS0 OV100 AL0 DC0 DS0";

    fn idle() -> QuickStatus {
        QuickStatus {
            servo: true,
            master_mode: 5,
            override_percent: 100,
            ..QuickStatus::default()
        }
    }

    #[test]
    fn the_file_to_the_byte() {
        assert_eq!(idle().encode(), IDLE);
        assert_eq!(QuickStatus::decode(IDLE), Ok(idle()));
        assert_eq!(QuickStatus::decode(&[IDLE, b"\r"].concat()), Ok(idle()));
    }

    type Change = fn(&mut QuickStatus);

    #[test]
    fn every_item_has_its_own_place() {
        let changes: [(Change, &str); 14] = [
            (|s| s.emergency_stop = true, "EE1"),
            (|s| s.safety_stop = true, "SE1"),
            (|s| s.stop_command = true, "SC1"),
            (|s| s.break_command = true, "BC1"),
            (|s| s.emergency_switch = true, "ES1"),
            (|s| s.safety_switch = true, "SS1"),
            (|s| s.servo = false, "SV0"),
            (|s| s.master_mode = 4, "MM4"),
            (|s| s.run_mode = 3, "RM3"),
            (|s| s.run_status = 2, "RS2"),
            (|s| s.override_percent = 55, "OV55"),
            (|s| s.alarm_level = 8, "AL8"),
            (|s| s.ended = 9, "DC9"),
            (|s| s.busy = true, "DS1"),
        ];
        let before: Vec<&[u8]> = IDLE.split(|byte| *byte == b' ').collect();
        for (place, (change, item)) in changes.into_iter().enumerate() {
            let mut status = idle();
            change(&mut status);
            let mut after = before.clone();
            after[place] = item.as_bytes();
            let content = after.join(&b' ');
            assert_eq!(status.encode(), content, "{item}");
            assert_eq!(QuickStatus::decode(&content), Ok(status), "{item}");
        }
    }

    #[test]
    fn what_is_no_quick_status_is_refused() {
        for end in 0..IDLE.len() {
            assert!(QuickStatus::decode(&IDLE[..end]).is_err(), "{end}");
        }
        let text = core::str::from_utf8(IDLE).unwrap();
        for (from, to) in [
            ("EE0", "EE2"),
            ("EE0", "XX0"),
            ("SV1", "SV"),
            ("MM5", "MM6"),
            ("RM0", "RM4"),
            ("RS0", "RS-1"),
            ("OV100", "OV101"),
            ("OV100", "OV300"),
            ("AL0", "AL3"),
            ("DC0", "DC10"),
            ("DS0", "DS0 XX0"),
            ("SE0 SC0", "SC0 SE0"),
            (" SE0", "  SE0"),
        ] {
            let bad = text.replace(from, to);
            assert!(QuickStatus::decode(bad.as_bytes()).is_err(), "{bad}");
        }
        let error = QuickStatus::decode(text.replace("MM5", "MM6").as_bytes()).unwrap_err();
        assert_eq!((error.at, error.found.as_str()), (30, "`6`"));
    }
}
