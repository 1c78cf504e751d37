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

/// Highest master mode of the vendor's client library.
const MAX_MASTER_MODE: u8 = 5;
/// Highest operation mode and execution status.
const MAX_CODE: u8 = 3;
/// Highest count of ended DO statements: it has one digit.
pub const MAX_ENDED: u8 = 9;
/// Full speed in percent.
const FULL_SPEED: u8 = 100;

impl QuickStatus {
    /// The content of the file: 14 items, one blank between them, no CR at the end.
    pub fn encode(&self) -> Vec<u8> {
        let [ee, se, sc, bc] = [
            self.emergency_stop,
            self.safety_stop,
            self.stop_command,
            self.break_command,
        ]
        .map(u8::from);
        let [es, ss, sv] = [self.emergency_switch, self.safety_switch, self.servo].map(u8::from);
        let (dc, ds) = (self.ended, u8::from(self.busy));
        let (mm, rm, rs) = (self.master_mode, self.run_mode, self.run_status);
        let (ov, al) = (self.override_percent, self.alarm_level);
        format!(
            "EE{ee} SE{se} SC{sc} BC{bc} ES{es} SS{ss} SV{sv} MM{mm} RM{rm} RS{rs} OV{ov} AL{al} DC{dc} DS{ds}"
        )
        .into_bytes()
    }

    /// Reads a content; a CR may stand at the end.
    ///
    /// # Errors
    /// An item that is missing, without its label, or out of its range; more than 14 items.
    pub fn decode(content: &[u8]) -> Result<QuickStatus, BodyError> {
        let whole = Field::record("SM", content);
        let mut items = whole.split(b' ');
        let mut value = |label: &'static str| {
            let item = items.next().ok_or_else(|| whole.error("14 items"))?;
            item.after(label, label)
        };
        let status = QuickStatus {
            emergency_stop: flag(value("EE")?)?,
            safety_stop: flag(value("SE")?)?,
            stop_command: flag(value("SC")?)?,
            break_command: flag(value("BC")?)?,
            emergency_switch: flag(value("ES")?)?,
            safety_switch: flag(value("SS")?)?,
            servo: flag(value("SV")?)?,
            master_mode: value("MM")?.at_most(MAX_MASTER_MODE, "a master mode from 0 to 5")?,
            run_mode: value("RM")?.at_most(MAX_CODE, "an operation mode from 0 to 3")?,
            run_status: value("RS")?.at_most(MAX_CODE, "an execution status from 0 to 3")?,
            override_percent: value("OV")?.at_most(FULL_SPEED, "a percentage from 0 to 100")?,
            alarm_level: alarm_level(value("AL")?)?,
            ended: value("DC")?.at_most(MAX_ENDED, "one digit")?,
            busy: flag(value("DS")?)?,
        };
        match items.next() {
            Some(surplus) => Err(surplus.error("the end after 14 items")),
            None => Ok(status),
        }
    }
}

fn flag(field: Field<'_>) -> Result<bool, BodyError> {
    field.at_most(1, "0 or 1").map(|value| value == 1)
}

fn alarm_level(field: Field<'_>) -> Result<u8, BodyError> {
    const EXPECTED: &str = "an alarm level 8, 4, 2 or 1, or 0";
    let level: u8 = field.number(EXPECTED)?;
    let known = level == 0 || AlarmLevel::from_number(level).is_some();
    known.then_some(level).ok_or_else(|| field.error(EXPECTED))
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
