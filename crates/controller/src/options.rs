//! The options: one for each point that the manual leaves open or that real controllers do differently.
//!
//! A dialect presets them (D0) and the user may override each. No other place in the code asks for the dialect.
//! docs/reference/options.md lists them for users; `rows` is the table.

mod rows;

use crate::limits;
use crate::panel::{ControlRight, KeySwitch};
use crate::prelude::*;
use core::time::Duration;
use scol_mini::{Arm, Compilation, IntDivision, LanguageOptions, TaughtPoint, compile_with_points};
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::command::Command;
use ts3100_proto::parameter::{LineEnd, OpenMode};
use ts3100_proto::permission::{Edition, PermissionTable};
use ts3100_proto::status::eu::YearDigits;
use ts3100_proto::status::su::SuLayout;
use ts3100_proto::status::vr::VrLayout;
use ts3100_proto::text::{Checksum, EndRule, StxRule, TextOptions};

/// Operand of MD for the guide mode free.
const GUIDE_FREE: u8 = 2;

/// A named preset of [`Options`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Dialect {
    /// The manual, and the further needs of real host programs.
    #[default]
    Field,
    /// The letter of the manual.
    Manual,
}

/// How SF travels (option `sf.split`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SfTexts {
    /// One text of any length, as the vendor's library reads it.
    One,
    /// Texts of 253 data bytes at most, each acknowledged (SF-02).
    Several,
}

/// Behaviour of PRINT and INPUT on an Ethernet channel without a peer (option `channel.no_peer`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum NoPeer {
    /// Alarm 2-046, the program stops.
    Alarm,
    /// PRINT is discarded, INPUT waits.
    Silent,
}

/// Behaviour of INPUT at a value that is not a number (option `input.malformed`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Malformed {
    /// Alarm 2-046, the program stops.
    Alarm,
    /// The leading number counts, 0 if there is none.
    LeadingNumber,
}

/// The statement with which a program continues after SP stopped it inside a WAIT (option `wait.after_stop`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum WaitAfterStop {
    /// With the step after the WAIT, as after an INPUT (CMD-RN-02 to the letter).
    Next,
    /// With the WAIT itself.
    Again,
}

/// Who is sent SP when the robot stops by itself (option `sp.unsolicited`, D7).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Option<bool>", into = "Option<bool>")]
pub enum UnsolicitedSp {
    /// Every host but one that has sent an extension command or a text without STX.
    Auto,
    /// Every host.
    Always,
    /// None.
    Never,
}

impl From<Option<bool>> for UnsolicitedSp {
    fn from(always: Option<bool>) -> UnsolicitedSp {
        match always {
            None => UnsolicitedSp::Auto,
            Some(true) => UnsolicitedSp::Always,
            Some(false) => UnsolicitedSp::Never,
        }
    }
}

impl From<UnsolicitedSp> for Option<bool> {
    fn from(rule: UnsolicitedSp) -> Option<bool> {
        match rule {
            UnsolicitedSp::Auto => None,
            UnsolicitedSp::Always => Some(true),
            UnsolicitedSp::Never => Some(false),
        }
    }
}

/// Behaviour of RS,CYC without a selected file, or without the label RCYCLE (option `rs.cycle_without_label`, T19).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum CycleWithoutLabel {
    /// The same as RS,STP, and OK.
    AsStep,
    /// NG.
    Ng,
}

/// Effect of a new peer of an Ethernet channel on an INPUT that waits there (option `channel.reconnect`, T25).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reconnect {
    /// The INPUT waits on.
    Keep,
    /// The INPUT ends; variables without a value become 0.
    Release,
}

/// Behaviour of DIN with a number that no input has (option `scol.din_unknown`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum UnknownInput {
    /// The alarm that DOUT raises for such a number.
    Alarm,
    /// It is off.
    Zero,
}

/// Whether the controller has a field bus, whose lines are 301 to 364 and 401 to 464 (option `io.field_bus`, T14).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum FieldBus {
    /// Programs and commands cannot set its outputs.
    #[default]
    Absent,
    /// Programs and commands set its outputs; no device is connected to it.
    Present,
}

/// The alarm of a motion whose target or way the arm cannot reach (option `alarm.out_of_reach`, T8).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum OutOfReach {
    /// 8-035, and 8-034 for a singular posture: servo power goes off.
    Level8,
    /// 4-101, and 4-103 for a singular posture: servo power stays on.
    Level4,
}

/// Whether the command inputs of EXT (SIG) need STROBE (option `sig.strobe`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Strobe {
    /// Each acts on its own rising edge.
    Free,
    /// Those that are on act on the rising edge of STROBE.
    Required,
}

/// Treatment of a character with a parity or framing error (option `serial.bad_character`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum BadCharacter {
    /// It is dropped; the text around it lacks it.
    Drop,
    /// Its data bits are taken as read.
    Keep,
}

/// Treatment of characters that arrive on HOST while the robot sends (option `serial.while_sending`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum WhileSending {
    /// They are lost: the port is half-duplex.
    Lost,
    /// They are received all the same.
    Kept,
}

/// Makes the struct of the rows, and its presets.
macro_rules! define {
    (
        text {$(
            $(#[$text_doc:meta])*
            $text_key:literal $text_field:ident: $text_type:ty, $text_kind:ident $text_values:tt,
            field $text_preset:expr, manual $text_manual:expr;
        )*}
        own {$(
            $(#[$doc:meta])*
            $key:literal $field:ident: $type:ty, $kind:ident $values:tt,
            field $preset:expr, manual $manual:expr;
        )*}
    ) => {
        /// The controller's readings of what the manual leaves open.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct Options {
            /// `text.stx`, `text.end` and `text.checksum`.
            pub text: TextOptions,
            $($(#[$doc])* pub $field: $type,)*
        }

        impl Options {
            /// The preset of a dialect.
            pub fn for_dialect(dialect: Dialect) -> Options {
                Options {
                    text: TextOptions {
                        $($text_field: dialect.choose($text_preset, $text_manual),)*
                    },
                    $($field: dialect.choose($preset, $manual),)*
                }
            }
        }
    };
}

crate::for_each_option!(define);

impl Dialect {
    fn choose<T>(self, field: T, manual: T) -> T {
        match self {
            Dialect::Field => field,
            Dialect::Manual => manual,
        }
    }
}

impl Options {
    /// What INPUT does with a string: the SCARA edition of the manual says it (ste80722 S89), ours does not.
    pub fn malformed(&self, arm: Arm) -> Malformed {
        self.malformed.unwrap_or(match arm {
            Arm::Scara => Malformed::Alarm,
            Arm::SixAxis => Malformed::LeadingNumber,
        })
    }

    /// The options of the language.
    pub fn language(&self, arm: Arm) -> LanguageOptions {
        LanguageOptions {
            arm,
            sticky_work: self.sticky_work,
            int_division: self.int_division,
            data_copy: self.data_copy,
            equal_within: self.equal_within.unwrap_or(match arm {
                Arm::Scara => limits::SCARA_EQUAL_WITHIN,
                Arm::SixAxis => 0.0,
            }),
        }
    }
}

ts3100_proto::codes! {
    /// Which controller it is: only the TS3100 has an INTERNAL position on its key switch (GEN-05; of the TSL3000E assumed).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
    pub enum ControllerType {
        /// TS3100.
        #[default]
        Ts3100 = "TS3100",
        /// TSL3100.
        Tsl3100 = "TSL3100",
        /// TSL3000E, of whose interface manual two pages are known (S40, S41): it presets `servo.interval`.
        Tsl3000e = "TSL3000E",
    }
    /// Its name, as VR tells it.
    fn name -> &'static str;
}

impl ControllerType {
    /// Whether its key switch has the position INTERNAL.
    pub const fn has_internal(self) -> bool {
        matches!(self, ControllerType::Ts3100)
    }
}

/// Whether the misprint of RN on HOST in the six-axis manual holds (T2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Misprint {
    /// To the letter.
    Kept,
    /// As the SCARA edition has it.
    Corrected,
}

/// Where tables 5.3 and 5.4 come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Permissions {
    /// The edition of the manual for the arm.
    Edition(Misprint),
    /// A table of the user's, which holds on every arm.
    Given(Box<PermissionTable>),
}

/// Everything a controller is made from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The readings.
    pub options: Options,
    /// Which commands are valid when (tables 5.3 and 5.4).
    pub permissions: Permissions,
    pub controller: ControllerType,
    pub model: crate::model::ArmModel,
    /// Key switch when the power comes on.
    pub key: KeySwitch,
    /// Control right when the power comes on.
    pub control_right: ControlRight,
    /// Date and time at [`crate::time::Time::ZERO`], for the error history.
    pub calendar: CalendarTime,
    /// Seed of the random choices of faults.
    pub fault_seed: u64,
    /// Seed of the legal variation; none: every text leaves at once, in one piece, in the usual order.
    pub vary: Option<u64>,
    /// Points that are taught on the controller; every selected file sees them as names of its DATA.
    pub points: Vec<TaughtPoint>,
}

impl Config {
    /// Whether this command is served at all (T5): those of the edition of the manual for the arm, and by option `extensions`
    /// all the others. No edition has the guide mode free, which the vendor's library sends.
    pub fn serves(&self, command: &Command) -> bool {
        if let Command::Md(GUIDE_FREE) = command {
            return self.options.extensions;
        }
        !command.is_extension() || self.serves_row(command.permission_row())
    }

    /// The same of a command that only the SCARA edition has, by its row in the permission tables. ZC is about the third axis
    /// of a SCARA.
    pub fn serves_row(&self, row: &str) -> bool {
        self.is_scara() || self.options.extensions && row != "ZC"
    }

    fn is_scara(&self) -> bool {
        self.model.language() == Arm::Scara
    }

    /// The permission tables that hold.
    pub fn permission_table(&self) -> &PermissionTable {
        let edition = match &self.permissions {
            Permissions::Given(table) => return table,
            _ if self.is_scara() => Edition::Scara,
            Permissions::Edition(Misprint::Kept) => Edition::SixAxisPrint,
            Permissions::Edition(Misprint::Corrected) => Edition::SixAxis,
        };
        PermissionTable::of(edition)
    }

    /// The same with this controller, and the options it presets.
    #[must_use]
    pub fn with_controller(mut self, controller: ControllerType) -> Config {
        self.controller = controller;
        if controller == ControllerType::Tsl3000e {
            self.options.servo_interval = limits::SERVO_INTERVAL;
        }
        self
    }

    /// A TS3100 with the six-axis arm, key in EXT, control right with ETHER (D9).
    pub fn new(dialect: Dialect) -> Config {
        Config {
            options: Options::for_dialect(dialect),
            permissions: match dialect {
                Dialect::Field => Permissions::Edition(Misprint::Corrected),
                Dialect::Manual => Permissions::Edition(Misprint::Kept),
            },
            controller: ControllerType::default(),
            model: crate::model::ArmModel::tv800(),
            key: KeySwitch::default(),
            control_right: ControlRight::default(),
            calendar: CalendarTime {
                year: 2014,
                month: 2,
                day: 6,
                hour: 0,
                minute: 0,
                second: 0,
            },
            fault_seed: 0,
            vary: None,
            points: Vec::new(),
        }
    }

    /// The options of the language, for the arm of this controller.
    pub fn language(&self) -> LanguageOptions {
        self.options.language(self.model.language())
    }

    /// Compiles a file as this controller does when it is selected.
    pub fn compile(&self, source: &str) -> Compilation {
        compile_with_points(source, &self.language(), &self.points)
    }
}
