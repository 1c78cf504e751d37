//! Alarms: the table of codes, the active alarms and the error history.
//!
//! Each alarm the controller can raise is one row of [`ALARMS`]. What an alarm does to the robot (stop, servo off) is
//! decided in `run_control`; how it is encoded in EU, AC, AH and SF is `ts3100_proto::status`. The level rules are
//! decision D6, the numbers decision T8.

use crate::limits::{MAX_ALARMS, MAX_HISTORY};
use crate::prelude::*;
use alloc::collections::VecDeque;
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::status::AlarmLevel;
use ts3100_proto::status::sf::alarm_word;
use ts3100_proto::words::did_you_mean;

/// One row of the alarm table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AlarmCode {
    /// Severity: 8 is the worst, 1 is a warning (D6).
    pub level: AlarmLevel,
    /// Code within the level, from 1.
    pub code: u16,
    /// Message on the teach pendant and in AC and AH; without commas, which separate fields there.
    pub text: &'static str,
    /// Why the alarm is raised, in one sentence.
    pub cause: &'static str,
    /// Remedy for the operator, in one sentence.
    pub remedy: &'static str,
    /// Source of the number and of its cause.
    pub source: AlarmSource,
}

/// Where the number of an alarm comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AlarmSource {
    /// A manual states the number and its cause.
    Stated,
    /// The number was seen with this cause (scol.md 5.2, hosts.md 9.1).
    Observed,
    /// The number was seen; that this is its cause is inferred (T8).
    Inferred,
    /// A list has the number. The emulator raises it only by hand or for a fault (T8.4).
    Known,
    /// The emulator chose the number.
    Ours,
}

impl AlarmSource {
    /// The word for it on the page of alarms.
    pub const fn as_str(self) -> &'static str {
        match self {
            AlarmSource::Stated => "stated",
            AlarmSource::Observed => "observed",
            AlarmSource::Inferred => "cause inferred",
            AlarmSource::Known => "known",
            AlarmSource::Ours => "ours",
        }
    }
}

/// Numbers that the table no longer has, each with the one that replaces it (T8.6).
const REPLACED: [(&str, &str); 3] = [("8-027", "8-014"), ("8-203", "8-017"), ("8-204", "8-026")];

macro_rules! alarms {
    ($($name:ident = $level:ident $code:literal $source:ident $text:literal, $cause:literal, $remedy:literal;)*) => {
        $(#[doc = $text]
        pub const $name: AlarmCode = AlarmCode {
            level: AlarmLevel::$level, code: $code, text: $text, cause: $cause, remedy: $remedy, source: AlarmSource::$source,
        };)*
        /// Every alarm the controller can raise.
        pub const ALARMS: &[AlarmCode] = &[$($name),*];
    };
}

alarms! {
    EMERGENCY_STOP = L8 14 Observed "Emergency Stop SW ON", "The emergency stop button is pressed.",
        "Release the button, reset the alarm, turn servo power on.";
    SAFETY_STOP = L8 17 Observed "Safety SW ON", "The safety switch (fence) was opened.",
        "Close it, reset the alarm, turn servo power on.";
    SERVO_FAILURE = L8 26 Inferred "Servo Gate OFF error", "Servo power went off by itself.",
        "Reset the alarm and turn servo power on. If it comes again, have the servo amplifier inspected.";
    UNABLE_TO_TRANS = L8 34 Inferred "Unable to Trans",
        "A line, an arc or an arch leads through a posture in which an axis would have to jump.",
        "Use MOVE, or choose a path around the posture. Reset the alarm, turn servo power on.";
    INVALID_RANGE = L8 35 Inferred "Point Invalid of Range",
        "The target, or a point of the path to it, cannot be reached by the arm.",
        "Correct the position, the tool, or the work coordinate system. Reset the alarm, turn servo power on.";
    INVALID_CHANNEL = L2 46 Observed "Invalid Channel",
        "PRINT or INPUT on a channel without a peer, or INPUT received something that is not a number.",
        "Connect the peer before the program reaches the statement. Send numbers, commas and CR only.";
    OUT_OF_REACH = L4 101 Ours "Position out of reach",
        "The target, or a point of the path to it, cannot be reached by the arm.",
        "Correct the position, the tool, or the work coordinate system.";
    OVERLOAD = L4 102 Ours "Load too heavy", "The load selected by PAYLOAD is heavier than the arm can carry.",
        "Correct the load data.";
    SINGULAR = L4 103 Ours "Singular posture",
        "A line, an arc or an arch leads through a posture in which an axis would have to jump.",
        "Use MOVE, or choose a path around the posture.";
    AXIS_FREE = L4 104 Ours "Axis without servo gain", "A motion needs an axis whose GAIN or TORQUE is 0.",
        "Set GAIN and TORQUE of the axis again, or move without it.";
    DIVISION_BY_ZERO = L2 101 Ours "Division by zero", "A divisor was zero.", "Check the value before dividing.";
    UNDEFINED_VARIABLE = L2 102 Ours "Undefined variable",
        "A variable was read before it got a value.", "Give it a value at the beginning of the program.";
    TYPE_MISMATCH = L2 103 Ours "Type mismatch", "A value has the wrong type.",
        "Correct the expression.";
    OUT_OF_RANGE = L2 104 Ours "Value out of range", "A value is outside the range of the statement.",
        "Correct the value.";
    SUBSCRIPT = L2 105 Ours "Subscript out of range", "The array element does not exist.",
        "Correct the subscript or the DIM.";
    NESTING = L2 106 Ours "Nesting too deep", "Too many calls or FOR loops are open.",
        "Leave loops and subprograms before entering further ones.";
    OVERFLOW = L2 107 Ours "Overflow", "A result does not fit its type.", "Use a real, or smaller values.";
    NEXT_WITHOUT_FOR = L2 108 Ours "NEXT without FOR", "The program jumped into a loop.",
        "Enter the loop by its FOR.";
    DOMAIN = L2 109 Ours "Argument outside the domain", "A function has no value for its argument.",
        "Check the argument.";
    ARM_TAKEN = L2 110 Ours "Arm belongs to another task",
        "A task wanted to move the arm that another task moves.", "Move the arm from one task only.";
    TOO_MANY_TASKS = L2 111 Ours "Too many tasks", "TASK was executed while all tasks were in use.",
        "End a task first; MAXTASK is the largest number.";
    NOT_RESTORED = L2 112 Ours "Data not restored",
        "RESTORE could not write the file: none is selected, it was downloaded again, or the RAM \
             drive is full.",
        "Select the file again, or make room on the RAM drive.";
    PARAMETER = L1 101 Ours "Parameter not accepted", "A value in USER.PAR, ETHERNET.PAR or STRING.PAR is not allowed.",
        "Correct the file and turn the power off and on.";
    BATTERY = L1 102 Ours "Battery low", "The battery of the RAM drive is low.", "Replace the battery.";
    ETHERNET_8 = L8 201 Ours "Ethernet disconnected", "The peer of a channel left while a program ran ([E10] = 8).",
        "Reconnect and restart.";
    ETHERNET_4 = L4 121 Ours "Ethernet disconnected", "The peer of a channel left while a program ran ([E10] = 4).",
        "Reconnect and restart.";
    ETHERNET_2 = L2 121 Ours "Ethernet disconnected", "The peer of a channel left while a program ran ([E10] = 2).",
        "Reconnect and restart.";
    HOST_TIME_OUT_8 = L8 352 Stated "Host Port Time Out", "A host had started the watchdog, level 8, and sent nothing in time.",
        "Restart the host, reset the alarm, turn servo power on.";
    HOST_TIME_OUT_2 = L2 137 Stated "Host Port Time Out", "A host had started the watchdog, level 2, and sent nothing in time.",
        "Restart the host.";
    HOST_TIME_OUT_1 = L1 200 Stated "Host Port Time Out", "A host had started the watchdog, level 1, and sent nothing in time.",
        "Restart the host.";
    ETHERNET_1 = L1 121 Ours "Ethernet disconnected", "The peer of a channel left while a program ran ([E10] = 1).",
        "Reconnect.";
    MEMORY_CHECK = L8 2 Known "Memory Check error", "The self-test of the memory failed.",
        "Turn the power off and on. If it comes again, have the controller repaired.";
    WATCHDOG = L8 4 Known "Watchdog error", "The supervision found the main processor failed.",
        "Turn the power off and on. If it comes again, have the controller repaired.";
    SERVO_WATCHDOG = L8 7 Known "Servo soft Watchdog error", "The main board found the servo processor failed.",
        "Turn the power off and on. If it comes again, have the controller repaired.";
    AC_ALARM = L8 13 Known "AC Alarm", "The mains supply is disturbed.",
        "Check the mains supply, then reset the alarm.";
    PARAMETER_8 = L8 15 Known "Parameter error", "A parameter is wrong.",
        "Correct the parameter and turn the power off and on.";
    SERVO_TYPE = L8 16 Known "Servo Type error", "The settings of the servo amplifier do not match the robot.",
        "Correct the settings of the servo amplifier.";
    SERVO_CPU = L8 18 Known "Servo CPU error", "The servo processor failed.",
        "Turn the power off and on. If it comes again, have the controller repaired.";
    MMI_TIMEOUT = L8 24 Known "MMI timeout", "The operating panel does not answer.",
        "Check the cable of the operating panel.";
    DC24_REGULATOR = L8 29 Known "DC24 Regulator error", "The 24 V supply is too low.",
        "Check the 24 V supply and its load.";
    RESISTOR_OVERHEAT = L8 31 Known "resistor overheat", "The regenerative resistor is too hot.",
        "Let it cool, and lower the speed or the load.";
    OVER_VOLT = L8 32 Known "Servo Power Over Volt", "The voltage of the servo supply is too high.",
        "Check the mains supply and lower the deceleration.";
    DISTRIBUTION = L8 33 Known "Distribution error", "The interpolation could not be calculated.",
        "Choose another path.";
    EXCEED_SPEED_1 = L8 41 Known "Axis1 Exceed Speed", "Axis 1 was too fast.",
        "Lower the speed or choose another path.";
    EXCEED_SPEED_2 = L8 42 Known "Axis2 Exceed Speed", "Axis 2 was too fast.",
        "Lower the speed or choose another path.";
    EXCEED_SPEED_3 = L8 43 Known "Axis3 Exceed Speed", "Axis 3 was too fast.",
        "Lower the speed or choose another path.";
    EXCEED_SPEED_4 = L8 44 Known "Axis4 Exceed Speed", "Axis 4 was too fast.",
        "Lower the speed or choose another path.";
    EXCEED_SPEED_5 = L8 45 Known "Axis5 Exceed Speed", "Axis 5 was too fast.",
        "Lower the speed or choose another path.";
    EXCEED_SPEED_6 = L8 46 Known "Axis6 Exceed Speed", "Axis 6 was too fast.",
        "Lower the speed or choose another path.";
    FIELDBUS_PARAMETER = L8 353 Known "Fieldbus Parameter error", "A parameter of the field bus is wrong.",
        "Correct the parameter of the field bus.";
    FIELDBUS_OFFLINE = L8 354 Known "Fieldbus Offline", "The field bus is not connected.",
        "Connect the field bus.";
    FIELDBUS_BOARD = L8 355 Known "Fieldbus Board error", "The field bus board is of the wrong type.",
        "Fit the right field bus board.";
    AXIS_1_COMMUNICATION = L8 561 Known "Axis1 communication error", "A wire of the encoder of axis 1 is broken.",
        "Repair the encoder cable.";
    PLC_USER = L4 77 Known "PLC user alarm", "The program of the built-in PLC raised an alarm.",
        "Look at the program of the PLC.";
}

/// The alarm raised when the peer of a channel leaves, at the level set by \[E10\] (PAR-E10-03).
pub const fn ethernet_disconnected(level: AlarmLevel) -> AlarmCode {
    match level {
        AlarmLevel::L8 => ETHERNET_8,
        AlarmLevel::L4 => ETHERNET_4,
        AlarmLevel::L2 => ETHERNET_2,
        AlarmLevel::L1 => ETHERNET_1,
    }
}

/// The alarm raised when the watchdog runs out, at the level set by WD (ste80722 S11).
///
/// The grammar of WD has no level 4; level 4 maps to the alarm of level 2.
pub const fn host_timeout(level: AlarmLevel) -> AlarmCode {
    match level {
        AlarmLevel::L8 => HOST_TIME_OUT_8,
        AlarmLevel::L4 | AlarmLevel::L2 => HOST_TIME_OUT_2,
        AlarmLevel::L1 => HOST_TIME_OUT_1,
    }
}

/// One occurrence of an alarm.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Alarm {
    /// The row of [`ALARMS`] it belongs to.
    pub code: AlarmCode,
    /// The specific cause and location; empty if the row says everything.
    pub detail: String,
    /// Controller date and time when it was raised.
    pub at: CalendarTime,
}

impl AlarmCode {
    /// The row with this `level-code`.
    pub fn from_number(number: &str) -> Option<AlarmCode> {
        ALARMS.iter().find(|row| row.number() == number).copied()
    }

    /// The number that replaces this one, which earlier versions of the table had.
    pub fn replacement(number: &str) -> Option<&'static str> {
        let mut replaced = REPLACED.iter();
        let (_, new) = replaced.find(|(old, _)| *old == number)?;
        Some(new)
    }

    /// The phrase for error messages about a number that no row has, after "expected".
    pub fn expected_number(found: &str) -> String {
        match AlarmCode::replacement(found) {
            Some(new) => format!("{new}, which replaces {found}"),
            None => String::from("the number of an alarm of the controller, for example 2-046"),
        }
    }

    /// The numbers that are probably meant by one that no row has, as the end of a message; may be empty.
    pub fn did_you_mean(found: &str) -> String {
        let numbers: Vec<String> = ALARMS.iter().map(AlarmCode::number).collect();
        did_you_mean(found, numbers.iter().map(String::as_str))
    }

    /// `level-code` as the pendant shows it, for example `2-046`.
    pub fn number(&self) -> String {
        format!("{}-{:03}", self.level.number(), self.code)
    }
}

impl Alarm {
    /// The text of the row, followed by the detail if there is one.
    pub fn message(&self) -> String {
        if self.detail.is_empty() {
            String::from(self.code.text)
        } else {
            format!("{}: {}", self.code.text, self.detail)
        }
    }
}

/// The active alarms and the error history.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Alarms {
    active: Vec<Alarm>,
    history: VecDeque<Alarm>,
}

impl Alarms {
    /// Adds an alarm to the history and to the active alarms. An alarm that is active already stays active once.
    pub fn raise(&mut self, alarm: Alarm) {
        self.history.push_front(alarm.clone());
        self.history.truncate(MAX_HISTORY);
        let known = self.active.iter().any(|other| other.code == alarm.code);
        if !known && self.active.len() < MAX_ALARMS {
            self.active.push(alarm);
        }
    }

    /// Appends alarms of an earlier run, newest first, after the entries of the history.
    pub fn append_history(&mut self, earlier: impl IntoIterator<Item = Alarm>) {
        self.history.extend(earlier);
        self.history.truncate(MAX_HISTORY);
    }

    /// Clears every active alarm for which `persists` is false; returns whether one was cleared.
    pub fn reset(&mut self, persists: impl Fn(&AlarmCode) -> bool) -> bool {
        let before = self.active.len();
        self.active.retain(|alarm| persists(&alarm.code));
        before != self.active.len()
    }

    /// Active alarms, oldest first (SF-23).
    pub fn active(&self) -> &[Alarm] {
        &self.active
    }

    /// Whether an alarm of level 4 or 8 is active: the robot cannot be started (CMD-RN-05).
    pub fn blocks_start(&self) -> bool {
        matches!(self.worst_level(), Some(AlarmLevel::L8 | AlarmLevel::L4))
    }

    /// Whether an alarm of level 8 is active: servo power cannot be turned on (CMD-SO-02).
    pub fn blocks_servo(&self) -> bool {
        self.worst_level() == Some(AlarmLevel::L8)
    }

    /// The alarm words of SF, oldest first (SF-22).
    pub fn status_words(&self) -> Vec<u16> {
        let codes = self.active.iter().map(|alarm| alarm.code);
        codes
            .filter_map(|code| alarm_word(code.level, code.code))
            .collect()
    }

    /// The history, newest first (EU-06).
    pub fn history(&self) -> impl Iterator<Item = &Alarm> + Clone {
        self.history.iter()
    }

    /// The worst level among the active alarms; `None` if there are none.
    pub fn worst_level(&self) -> Option<AlarmLevel> {
        let levels = self.active.iter().map(|alarm| alarm.code.level);
        levels.max_by_key(|level| level.number())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at() -> CalendarTime {
        CalendarTime {
            year: 2026,
            month: 1,
            day: 2,
            hour: 3,
            minute: 4,
            second: 5,
        }
    }

    // clause: SF-22
    #[test]
    fn every_row_has_a_word_and_a_unique_number() {
        let mut seen = alloc::collections::BTreeSet::new();
        for row in ALARMS {
            assert!(alarm_word(row.level, row.code).is_some(), "{}", row.number());
            assert!(seen.insert(row.number()), "{} appears twice", row.number());
            assert!(!row.text.contains(','), "AC and AH separate by commas");
        }
    }

    // clause: T8 I17-rest I17-561
    #[test]
    fn the_known_numbers_are_in_the_table_and_the_replaced_ones_are_not() {
        let numbers: Vec<String> = ALARMS.iter().map(AlarmCode::number).collect();
        let known = |level: u8, code: u16| numbers.contains(&format!("{level}-{code:03}"));
        let listed = [2, 4, 7, 13, 14, 15, 16, 17, 18, 24, 26, 29, 31, 32, 33, 34, 35];
        let codes = listed.into_iter().chain(41..=46).chain([353, 354, 355, 561]);
        for code in codes {
            assert!(known(8, code), "8-{code:03}");
        }
        assert!(known(4, 77) && known(4, 101) && known(4, 103));
        for (old, new) in REPLACED {
            assert_eq!(AlarmCode::from_number(old), None);
            assert!(AlarmCode::from_number(new).is_some(), "{new}");
            assert_eq!(
                AlarmCode::expected_number(old),
                format!("{new}, which replaces {old}")
            );
        }
        // 561 is beyond the first range of level 8, which ends at 368.
        assert_eq!(AXIS_1_COMMUNICATION.number(), "8-561");
        assert_eq!(alarm_word(AlarmLevel::L8, 561), Some(1152));
    }

    // clause: EU-06 SF-23
    #[test]
    fn the_history_keeps_99_and_the_active_list_is_bounded() {
        let mut alarms = Alarms::default();
        for _ in 0..120 {
            alarms.raise(Alarm {
                code: PARAMETER,
                detail: String::new(),
                at: at(),
            });
        }
        assert_eq!(alarms.history().count(), 99);
        assert_eq!(alarms.active().len(), 1);
        assert!(alarms.reset(|_| false));
        assert!(alarms.active().is_empty());
        assert_eq!(alarms.history().count(), 99);
    }
}
