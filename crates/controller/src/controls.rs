//! The table of controls: one row for each switch and each button of the robot, and for each document that is read whole.
//!
//! A row says everything about its control once. Made from it are the action with its text form, its place over HTTP with the
//! entry of the OpenAPI document, the command of `ts3100 ctl`, the method of the embedding API, the tool of assistants, the
//! reference page and `controls.json`. To add a switch, write a row, and the method of `Robot` that carries it out.
//!
//! Lines, variables, files, faults and the clock have no row: a line is one of many, a file has a content, and the
//! clock is not part of the controller. Each of them has a resource of its own in the control interface.

use crate::panel::JogMode;
use crate::prelude::*;
use core::fmt;
use core::ops::RangeInclusive;
use ts3100_proto::escape::Escaped;
use ts3100_proto::words::{UnexpectedWord, Word, one_of};

/// Passes the table to the macro of this name.
///
/// A switch: name, variant of [`PanelAction`](crate::PanelAction) with the type of its value and the range of a number, HTTP path;
/// then
/// - `form`: its text form, name and words; of a switch with two states the word for true comes first;
/// - `document`: the JSON document with its field, and the field of `PanelState` that it shows;
/// - `act`: the method of `Robot` that sets it, and of the embedding API;
/// - `needs_power`: whether it has no effect while the power is off;
/// - `cannot`: place of a refusal, and what cannot be done, with `{}` for the word;
/// - `get`: what is read.
///
/// A button: name, variant, HTTP path; then the same, with the group of the OpenAPI document that it is in, and with the document
/// that answers it and what makes that document.
///
/// A query: name and HTTP path; then whether there is more below its name, so that `ctl` has a command of its own for it; its group, and its document with what makes it and what is said about it.
#[macro_export]
macro_rules! controls {
    ($then:ident) => {
        $then! {
            switches {
                /// Turn the key switch
                ///
                /// A running program stops after its current step.
                key_switch: Key($crate::panel::KeySwitch) = "/key-switch" {
                    form: "key-switch teaching|internal|ext",
                    document: KeySwitch { position: key },
                    act: set_key_switch,
                    needs_power: false,
                    cannot: ("key switch", "turn the key switch to {}"),
                    get: "Get the key switch position",
                }
                /// Set the control right
                ///
                /// The parameter EXTERNAL mode control right: who commands the robot while the key switch is at EXT.
                control_right: ControlRight($crate::panel::ControlRight) = "/control-right" {
                    form: "control-right sig|rs232c|ether",
                    document: ControlRight { holder: control_right },
                    act: set_control_right,
                    needs_power: true,
                    cannot: ("control right", "set the control right to {}"),
                    get: "Get the control right",
                }
                /// Press or release the emergency stop
                ///
                /// Pressing it raises alarm 8-014: motion stops at once and servo power goes off.
                emergency_stop: EmergencyStop(bool) = "/emergency-stop" {
                    form: "emergency-stop press|release",
                    document: Button { pressed: emergency_stop },
                    act: set_emergency_stop,
                    needs_power: false,
                    cannot: ("emergency stop", "{} the emergency stop"),
                    get: "Get the emergency stop",
                }
                /// Open or close the safety switch
                ///
                /// Opening it stops the robot as the emergency stop does.
                safety_switch: SafetySwitch(bool) = "/safety-switch" {
                    form: "safety-switch open|close",
                    document: SafetySwitch { open: safety_open },
                    act: set_safety_switch,
                    needs_power: false,
                    cannot: ("safety switch", "{} the safety switch"),
                    get: "Get the safety switch",
                }
                /// Turn servo power on or off
                ///
                /// Servo power cannot be turned on while the emergency stop is pressed, the safety switch is open, or an alarm of
                /// level 8 is active. The command SO has the same rule.
                servo: Servo(bool) = "/servo" {
                    form: "servo on|off",
                    document: Switch { on: servo },
                    act: set_servo,
                    needs_power: true,
                    cannot: ("servo", "turn the servo {}"),
                    get: "Get servo power",
                }
                /// Turn feed hold on or off
                ///
                /// Feed hold pauses the arm; the program stays running.
                feed_hold: FeedHold(bool) = "/feed-hold" {
                    form: "feed-hold on|off",
                    document: Switch { on: feed_hold },
                    act: set_feed_hold,
                    needs_power: true,
                    cannot: ("feed hold", "turn feed hold {}"),
                    get: "Get feed hold",
                }
                /// Turn the machine lock on or off
                ///
                /// With the machine lock on, programs run but the arm does not move.
                machine_lock: MachineLock(bool) = "/machine-lock" {
                    form: "machine-lock on|off",
                    document: Switch { on: machine_lock },
                    act: set_machine_lock,
                    needs_power: false,
                    cannot: ("machine lock", "turn the machine lock {}"),
                    get: "Get the machine lock",
                }
                /// Set the battery of the RAM drive to low or ok
                battery: Battery(bool) = "/battery" {
                    form: "battery low|ok",
                    document: Battery { low: battery_low },
                    act: set_battery,
                    needs_power: false,
                    cannot: ("battery", "set the battery to {}"),
                    get: "Get the battery of the RAM drive",
                }
                /// Set the speed override
                ///
                /// The motion under way continues with it. The command `EC,OVRD` does the same.
                override: Override(u8, 1..=100) = "/override" {
                    form: "override PERCENT",
                    document: Override { percent: override_percent },
                    act: set_override,
                    needs_power: false,
                    cannot: ("override", "set the override to {} %"),
                    get: "Get the speed override",
                }
                /// Set the operation mode
                ///
                /// Only while the robot is stopped, as the command `EC,MODE`.
                run_mode: RunMode($crate::RunMode) = "/run-mode" {
                    form: "run-mode continuous|cycle|step|segment",
                    document: OperationMode { mode: run_mode },
                    act: set_run_mode,
                    needs_power: false,
                    cannot: ("run mode", "set the operation mode to {}"),
                    get: "Get the operation mode",
                }
            }
            buttons {
                /// Press the feed hold button
                ///
                /// It turns feed hold on, or off if it is on.
                press_feed_hold: PressFeedHold = "/feed-hold/press" {
                    form: "feed-hold press",
                    group: panel,
                    answer: (Switch, set_feed_hold::look),
                    act: feed_hold,
                    needs_power: true,
                    cannot: ("feed hold", "press feed hold"),
                }
                /// Press START
                ///
                /// The selected program starts or continues, whoever has the control right.
                start_program: Start = "/program/start" {
                    form: "program start",
                    group: panel,
                    answer: (ProgramStatus, ProgramStatus::new),
                    act: start_by_hand,
                    needs_power: true,
                    cannot: ("start", "start the program"),
                }
                /// Press STOP
                ///
                /// The program stops after its current step.
                stop_program: Stop = "/program/stop" {
                    form: "program stop",
                    group: panel,
                    answer: (ProgramStatus, ProgramStatus::new),
                    act: stop_by_hand,
                    needs_power: true,
                    cannot: ("stop", "stop the program"),
                }
                /// Run one step of the program
                ///
                /// It starts or continues and stops after one step, whatever the operation mode.
                step_program: Step = "/program/step" {
                    form: "program step",
                    group: breakpoints,
                    answer: (ProgramStatus, ProgramStatus::new),
                    act: step,
                    needs_power: true,
                    cannot: ("step", "run a step"),
                }
                /// Reset the program
                ///
                /// Back to its first step with its initial values, as the command `RS,PRG`; it ends feed hold and resets the alarms.
                reset_program: ProgramReset = "/program/reset" {
                    form: "program reset",
                    group: panel,
                    answer: (ProgramStatus, ProgramStatus::new),
                    act: reset_program,
                    needs_power: true,
                    cannot: ("program", "reset the program"),
                }
                /// Press ALARM RESET
                ///
                /// Clears every alarm whose cause has gone.
                reset_alarms: AlarmReset = "/alarms/reset" {
                    form: "alarms reset",
                    group: alarms,
                    answer: (AlarmList, AlarmList::new),
                    act: reset_alarms,
                    needs_power: true,
                    cannot: ("alarms", "reset the alarms"),
                }
                /// Release the key
                ///
                /// The arm slows and rests.
                stop_jog: JogStop = "/jog/stop" {
                    form: "jog stop",
                    group: jog,
                    answer: (ArmPosture, ArmPosture::new),
                    act: stop_jog,
                    needs_power: false,
                    cannot: ("jog", "stop the jog"),
                }
            }
            queries {
                /// Get the selected program and its status
                get_program = "/program" {
                    has_more: true,
                    group: panel,
                    answer: (ProgramStatus, ProgramStatus::new),
                }
                /// List the breakpoints
                get_breakpoints = "/breakpoints" {
                    has_more: true,
                    group: breakpoints,
                    answer: (Breakpoints, Breakpoints::new),
                }
                /// Get what the teach pendant shows
                get_pendant = "/pendant" {
                    has_more: true,
                    group: pendant,
                    answer: (PendantStatus, PendantStatus::new),
                }
                /// Get what a picture of the arm needs
                get_arm = "/arm" {
                    has_more: false,
                    group: arm,
                    answer: (ArmPicture, ArmPicture::new, "The arm with its model."),
                }
                /// Get the posture of the arm
                ///
                /// A part of GET /arm that costs little, for many readings a second.
                get_pose = "/arm/pose" {
                    has_more: false,
                    group: arm,
                    answer: (ArmPosture, ArmPosture::new),
                }
                /// List active alarms and the error history
                get_alarms = "/alarms" {
                    has_more: true,
                    group: alarms,
                    answer: (AlarmList, AlarmList::new),
                }
                /// List all inputs and outputs with their names
                get_lines = "/lines" {
                    has_more: false,
                    group: lines,
                    answer: (LineTable, LineTable::new),
                }
                /// List the inputs that are on or forced
                get_inputs = "/inputs" {
                    has_more: true,
                    group: lines,
                    answer: (LineList, LineList::inputs),
                }
                /// List the outputs that are on or forced
                get_outputs = "/outputs" {
                    has_more: true,
                    group: lines,
                    answer: (LineList, LineList::outputs),
                }
                /// List the variables of the selected file
                get_variables = "/variables" {
                    has_more: true,
                    group: variables,
                    answer: (Vec<VariableInfo>, VariableInfo::all, "Those of GLOBAL and DATA, positions included; then those of the programs."),
                }
                /// List the files on the RAM drive
                get_files = "/files" {
                    has_more: true,
                    group: files,
                    answer: (DriveStatus, DriveStatus::new),
                }
                /// List the communication ports
                get_channels = "/channels" {
                    has_more: true,
                    group: channels,
                    answer: (Vec<ChannelStatus>, ChannelStatus::all, "All six ports."),
                }
                /// Get what the command SF would answer now
                ///
                /// For the host on IP0, or on HOST if only that one is connected. Nothing is sent, and `su-request` stays as it is.
                get_status_frame = "/status-frame" {
                    has_more: false,
                    group: state,
                    answer: (Vec<StatusField>, StatusField::all, "The fields of SF in the order of their bytes."),
                }
                /// Get the parameters in effect
                ///
                /// To change them, write the files USER.PAR and ETHERNET.PAR, then cycle the power.
                get_parameters = "/parameters" {
                    has_more: false,
                    group: parameters,
                    answer: (Parameters, Parameters::new),
                }
                /// Get the clock
                get_clock = "/clock" {
                    has_more: true,
                    group: clock,
                    answer: (ClockStatus, ClockStatus::new),
                }
                /// Get the power state
                get_power = "/power" {
                    has_more: true,
                    group: power,
                    answer: (PowerStatus, PowerStatus::new),
                }
                /// List the faults and their outcome
                get_faults = "/faults" {
                    has_more: true,
                    group: faults,
                    answer: (FaultList, FaultList::new),
                }
            }
        }
    };
}

/// A switch, as data.
#[derive(Debug)]
pub struct Switch {
    /// End of the names of its operations: `key_switch` of `get_key_switch` and `put_key_switch`.
    pub operation: &'static str,
    /// The HTTP path, which is the name after a slash: `/key-switch`.
    pub path: &'static str,
    /// The text form: its name, then its words.
    pub form: &'static str,
    /// The field of its JSON document.
    pub field: &'static str,
    /// The type of its value.
    pub value: ValueType,
    /// Whether it has no effect while the power is off.
    pub needs_power: bool,
    /// Description of a change: a summary, an empty line, and more.
    pub doc: &'static [&'static str],
}

/// A button, as data.
#[derive(Debug)]
pub struct Button {
    /// The name of its operation.
    pub operation: &'static str,
    /// The HTTP path: its words after slashes.
    pub path: &'static str,
    /// The text form.
    pub form: &'static str,
    /// Whether it has no effect while the power is off.
    pub needs_power: bool,
    /// Description: a summary, an empty line, and more.
    pub doc: &'static [&'static str],
}

/// A query, as data.
#[derive(Debug)]
pub struct Query {
    /// The name of its operation.
    pub operation: &'static str,
    /// The HTTP path: its words after slashes.
    pub path: &'static str,
    /// Whether there is more below its name: elements, or something to do.
    pub has_more: bool,
    /// What it shows: a summary, an empty line, and more.
    pub doc: &'static [&'static str],
}

/// The type of the value of a switch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ValueType {
    /// Two states; the word for true comes first in the form.
    State,
    /// One of the words of the form.
    Choice,
    /// A whole number in this range.
    Number(RangeInclusive<u8>),
}

impl Switch {
    pub fn name(&self) -> &'static str {
        name_in(self.form)
    }

    /// The words of its values; of a number its placeholder.
    pub fn words(&self) -> impl DoubleEndedIterator<Item = &'static str> + Clone {
        words(self.form)
    }

    /// The words after its name: those of its values, and those of the buttons with this name.
    pub fn all_words(&self) -> impl Iterator<Item = &'static str> {
        all_words(self.form)
    }

    /// The place of a word among those of the values.
    ///
    /// # Errors
    /// It is none of them.
    pub fn position(&self, word: &str) -> Result<usize, UnexpectedWord> {
        position(self.form, word)
    }
}

fn name_in(form: &'static str) -> &'static str {
    form.split(' ').next().unwrap_or_default()
}

fn words(form: &'static str) -> impl DoubleEndedIterator<Item = &'static str> + Clone {
    let (_, words) = form.split_once(' ').unwrap_or_default();
    words.split('|')
}

fn all_words(form: &'static str) -> impl Iterator<Item = &'static str> {
    let buttons = BUTTONS
        .iter()
        .filter_map(move |button| button.form.strip_prefix(name_in(form))?.strip_prefix(' '));
    words(form).chain(buttons)
}

fn position(form: &'static str, word: &str) -> Result<usize, UnexpectedWord> {
    words(form).position(|known| known == word).ok_or_else(|| {
        let words: Vec<String> = all_words(form).map(str::to_string).collect();
        UnexpectedWord::new(one_of(&words), word)
    })
}

/// The number that a word is.
///
/// # Errors
/// It is none, or out of range.
pub fn number_in(range: &RangeInclusive<u8>, word: &str) -> Result<u8, UnexpectedWord> {
    let number = word.parse().ok().filter(|number| range.contains(number));
    number.ok_or_else(|| {
        let expected = format!("a whole number from {} to {}", range.start(), range.end());
        UnexpectedWord::new(expected, word)
    })
}

/// The values of a type are in the order of the words of the form.
fn value_of<T: Word>(form: &'static str, word: &str) -> Result<T, UnexpectedWord> {
    let value = T::ALL.get(position(form, word)?).copied();
    value.ok_or_else(|| UnexpectedWord::new(form, word))
}

fn word_of<T: Word + PartialEq>(form: &'static str, value: T) -> &'static str {
    let place = T::ALL.iter().position(|known| *known == value);
    place.and_then(|place| words(form).nth(place)).unwrap_or_default()
}

/// The type of a value by that of Rust and by its range.
macro_rules! value_type {
    (bool) => {
        ValueType::State
    };
    ($type:ty) => {
        ValueType::Choice
    };
    ($type:ty, $range:expr) => {
        ValueType::Number($range)
    };
}

/// The value of a word.
macro_rules! value {
    ($form:expr, $word:expr) => {
        value_of($form, $word)?
    };
    ($form:expr, $word:expr, $range:expr) => {
        number_in(&$range, $word)?
    };
}

/// The word of a value.
macro_rules! word {
    ($form:expr, $value:expr) => {
        word_of($form, *$value)
    };
    ($form:expr, $value:expr, $range:expr) => {
        $value
    };
}

/// Makes the action of each row, the rows as data, and the text form of the actions.
macro_rules! panel_actions {
    (
        switches { $(
            $(#[doc = $doc:literal])*
            $name:ident: $variant:ident($($type:tt)::+ $(, $range:expr)?) = $path:literal {
                form: $form:literal,
                document: $document:ident { $field:ident: $state:ident },
                act: $act:ident,
                needs_power: $needs_power:literal,
                cannot: ($place:literal, $cannot:literal),
                get: $get:literal,
            }
        )* }
        buttons { $(
            $(#[doc = $press_doc:literal])*
            $press_name:ident: $press:ident = $press_path:literal {
                form: $press_form:literal,
                group: $group:ident,
                answer: $answer:tt,
                act: $press_act:ident,
                needs_power: $press_needs_power:literal,
                cannot: ($press_place:literal, $press_cannot:literal),
            }
        )* }
        queries { $(
            $(#[doc = $query_doc:literal])*
            $query:ident = $query_path:literal { has_more: $has_more:literal, $($more:tt)* }
        )* }
    ) => {
        /// Something done at the controller itself.
        #[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
        pub enum PanelAction {
            $( $(#[doc = $doc])* $variant($($type)::+), )*
            $( $(#[doc = $press_doc])* $press, )*
            /// An input line is driven by the outside (1-64, 101-164, 201-264, 301-364, 401-464).
            InputLine {
                /// Din number.
                line: u16,
                /// Its state.
                on: bool,
            },
            /// A key of the teach pendant that moves the arm is held from now; in TEACHING only.
            Jog {
                /// From 1; in a coordinate system 1-3 go along X Y Z, 4-6 turn about them.
                axis: u8,
                /// Towards larger values.
                positive: bool,
                /// The settings of the pendant; mode 2 is refused.
                mode: JogMode,
            },
            /// Figures typed at the teach pendant, for INPUT without a channel.
            Keys(String),
            /// Power off and on again.
            PowerCycle,
        }

        pub const SWITCHES: &[Switch] = &[$( Switch {
            operation: stringify!($name),
            path: $path,
            form: $form,
            field: stringify!($field),
            value: value_type!($($type)::+ $(, $range)?),
            needs_power: $needs_power,
            doc: &[$($doc),*],
        } ),*];

        pub const BUTTONS: &[Button] = &[$( Button {
            operation: stringify!($press_name),
            path: $press_path,
            form: $press_form,
            needs_power: $press_needs_power,
            doc: &[$($press_doc),*],
        } ),*];

        /// The queries.
        pub const QUERIES: &[Query] = &[$( Query {
            operation: stringify!($query),
            path: $query_path,
            has_more: $has_more,
            doc: &[$($query_doc),*],
        } ),*];

        impl PanelAction {
            /// The action of a text form, if a row has it.
            ///
            /// # Errors
            /// The name is that of a switch, and the word after it is none of its words.
            pub(crate) fn of_row(form: &str) -> Result<Option<PanelAction>, UnexpectedWord> {
                $( if form == $press_form {
                    return Ok(Some(PanelAction::$press));
                } )*
                let (name, word) = form.split_once(' ').unwrap_or((form, ""));
                $( if name == name_in($form) {
                    return Ok(Some(PanelAction::$variant(value!($form, word $(, $range)?))));
                } )*
                Ok(None)
            }

            /// Whether it has no effect while the power is off.
            pub(crate) fn needs_power(&self) -> bool {
                match self {
                    $( PanelAction::$variant(_) => $needs_power, )*
                    $( PanelAction::$press => $press_needs_power, )*
                    PanelAction::Jog { .. } | PanelAction::Keys(_) => true,
                    PanelAction::InputLine { .. } | PanelAction::PowerCycle => false,
                }
            }

            /// The place of its refusal, and the verb phrase after "cannot".
            pub(crate) fn purpose(&self) -> (&'static str, String) {
                let form = self.to_string();
                let (_, word) = form.split_once(' ').unwrap_or_default();
                match self {
                    $( PanelAction::$variant(_) => ($place, $cannot.replace("{}", word)), )*
                    $( PanelAction::$press => ($press_place, $press_cannot.to_string()), )*
                    PanelAction::Jog { axis, .. } => ("jog", format!("jog axis {axis}")),
                    PanelAction::Keys(_) => ("pendant", "type on the teach pendant".to_string()),
                    PanelAction::InputLine { line, .. } => ("input", format!("drive input {line}")),
                    PanelAction::PowerCycle => ("power", "turn the power off and on".to_string()),
                }
            }
        }

        impl fmt::Display for PanelAction {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match self {
                    $( PanelAction::$variant(value) => {
                        let word = word!($form, value $(, $range)?);
                        write!(f, "{} {word}", name_in($form))
                    } )*
                    $( PanelAction::$press => f.write_str($press_form), )*
                    PanelAction::InputLine { line, on } => write!(f, "input {line} {}", on.word()),
                    PanelAction::Jog { axis, positive, mode } => {
                        let [coordinates, rate] = mode.words();
                        let sign = if *positive { "plus" } else { "minus" };
                        write!(f, "jog {axis} {sign} {coordinates} {rate}")?;
                        f.write_str(if mode.mode == JogMode::INCHING { " inching" } else { "" })
                    }
                    PanelAction::Keys(keys) => write!(f, "pendant keys {}", Escaped::new(keys.as_bytes())),
                    PanelAction::PowerCycle => f.write_str("power cycle"),
                }
            }
        }
    };
}

controls!(panel_actions);
