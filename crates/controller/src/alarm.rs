//! Alarms: the table of codes, the active alarms and the error history.
//!
//! Each alarm the controller can raise is one row of [`ALARMS`]. What an alarm does to the robot (stop, servo off) is
//! decided in `run_control`; how it is encoded in EU, AC, AH and SF is `ts3100_proto::status`. The level rules are
//! decision D6.

use crate::limits::{MAX_ALARMS, MAX_HISTORY};
use crate::prelude::*;
use alloc::collections::VecDeque;
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::status::AlarmLevel;
use ts3100_proto::status::sf::alarm_word;

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
    /// What the operator does about it, in one sentence.
    pub remedy: &'static str,
    /// True if the code is assumed, false if it is known of a real controller (scol.md 5.2).
    pub is_assumed: bool,
}

macro_rules! alarms {
    ($($name:ident = $level:ident $code:literal $is_assumed:literal $text:literal, $cause:literal, $remedy:literal;)*) => {
        $(#[doc = $text]
        pub const $name: AlarmCode = AlarmCode {
            level: AlarmLevel::$level, code: $code, text: $text, cause: $cause, remedy: $remedy, is_assumed: $is_assumed,
        };)*
        /// Every alarm the controller can raise.
        pub const ALARMS: &[AlarmCode] = &[$($name),*];
    };
}

alarms! {
    EMERGENCY_STOP = L8 27 false "Emergency stop ON", "The emergency stop button is pressed.",
        "Release the button, reset the alarm, turn servo power on.";
    SAFETY_STOP = L8 203 true "Safety switch open", "The safety switch (fence) was opened.",
        "Close it, reset the alarm, turn servo power on.";
    SERVO_FAILURE = L8 204 true "Servo failure", "The servo of an axis has failed.",
        "Reset the alarm and turn servo power on. If it comes again, have the servo amplifier inspected.";
    INVALID_CHANNEL = L2 46 false "Invalid channel",
        "PRINT or INPUT on a channel without a peer, or INPUT received something that is not a number.",
        "Connect the peer before the program reaches the statement. Send numbers, commas and CR only.";
    OUT_OF_REACH = L4 101 true "Position out of reach",
        "The target, or a point of the path to it, cannot be reached by the arm.",
        "Correct the position, the tool, or the work coordinate system.";
    OVERLOAD = L4 102 true "Load too heavy", "The load selected by PAYLOAD is heavier than the arm can carry.",
        "Correct the load data.";
    SINGULAR = L4 103 true "Singular posture",
        "A line, an arc or an arch leads through a posture in which an axis would have to jump.",
        "Use MOVE, or choose a path around the posture.";
    AXIS_FREE = L4 104 true "Axis without servo gain", "A motion needs an axis whose GAIN or TORQUE is 0.",
        "Give the axis its gain and torque back, or move without it.";
    DIVISION_BY_ZERO = L2 101 true "Division by zero", "A divisor was zero.", "Check the value before dividing.";
    UNDEFINED_VARIABLE = L2 102 true "Undefined variable",
        "A variable was read before it got a value.", "Give it a value at the beginning of the program.";
    TYPE_MISMATCH = L2 103 true "Type mismatch", "A value has another type than is needed.",
        "Correct the expression.";
    OUT_OF_RANGE = L2 104 true "Value out of range", "A value is outside the range of the statement.",
        "Correct the value.";
    SUBSCRIPT = L2 105 true "Subscript out of range", "The array element does not exist.",
        "Correct the subscript or the DIM.";
    NESTING = L2 106 true "Nesting too deep", "Too many calls or FOR loops are open.",
        "Leave loops and subprograms before entering further ones.";
    OVERFLOW = L2 107 true "Overflow", "A result does not fit its type.", "Use a real, or smaller values.";
    NEXT_WITHOUT_FOR = L2 108 true "NEXT without FOR", "The program jumped into a loop.",
        "Enter the loop by its FOR.";
    DOMAIN = L2 109 true "Argument outside the domain", "A function has no value for its argument.",
        "Check the argument.";
    ARM_TAKEN = L2 110 true "Arm belongs to another task",
        "A task wanted to move the arm that another task moves.", "Move the arm from one task only.";
    TOO_MANY_TASKS = L2 111 true "Too many tasks", "TASK was executed while all tasks were in use.",
        "End a task first; MAXTASK is the largest number.";
    NOT_RESTORED = L2 112 true "Data not restored",
        "RESTORE could not write the file: none is selected, it was downloaded again, or the RAM \
             drive is full.",
        "Select the file again, or make room on the RAM drive.";
    PARAMETER = L1 101 true "Parameter not accepted", "A value in USER.PAR or ETHERNET.PAR is not allowed.",
        "Correct the file and turn the power off and on.";
    BATTERY = L1 102 true "Battery low", "The battery of the RAM drive is low.", "Replace the battery.";
    ETHERNET_8 = L8 201 true "Ethernet disconnected", "The peer of a channel left while a program ran ([E10] = 8).",
        "Reconnect and restart.";
    ETHERNET_4 = L4 121 true "Ethernet disconnected", "The peer of a channel left while a program ran ([E10] = 4).",
        "Reconnect and restart.";
    ETHERNET_2 = L2 121 true "Ethernet disconnected", "The peer of a channel left while a program ran ([E10] = 2).",
        "Reconnect and restart.";
    HOST_TIME_OUT_8 = L8 352 false "Host Port Time Out", "A host had started the watchdog, level 8, and sent nothing in time.",
        "Restart the host, reset the alarm, turn servo power on.";
    HOST_TIME_OUT_2 = L2 137 false "Host Port Time Out", "A host had started the watchdog, level 2, and sent nothing in time.",
        "Restart the host.";
    HOST_TIME_OUT_1 = L1 200 false "Host Port Time Out", "A host had started the watchdog, level 1, and sent nothing in time.",
        "Restart the host.";
    ETHERNET_1 = L1 121 true "Ethernet disconnected", "The peer of a channel left while a program ran ([E10] = 1).",
        "Reconnect.";
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
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(deny_unknown_fields))]
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
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(deny_unknown_fields))]
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
