//! The table of commands: one row each, in the order of Table 5.1, then those of the SCARA edition, which are
//! extensions on six axes (decisions D0, T5).
//!
//! The row is the only place that states the facts of a command; `macros.rs` explains its form and derives the rest. The
//! grammars and encoders of operands are in the files next to it, one for each group.

use super::macros::commands;
use super::number::with_numbers;
use super::operate::RESET_OF_ALARMS;
use super::row::{valid, valid_unless_scara};
use super::{
    Answer, CommandRow, Encoding, InternalCommand, JogDirection, LineWrite, Number, PositionQuery, Reset,
    Sender, Source, VariableRead, VariableWrite, ZsFrame, decimal, files, guide, lines, operate, text,
    variable,
};
use crate::name::{FileName, VariableName};
use crate::prelude::*;
use crate::status::AlarmLevel;

commands! {
    /// Start automatic operation (CMD-RN-01).
    Rn => {
        letters: "RN", help: "Run the selected file",
        source: Manual, sender: Host, answer: Acknowledge, permission: valid_unless_scara(0, ["XXXSO", "XXXXS"], ["XXXSX", "XXXXS"], true),
    }

    /// Stop automatic operation (CMD-SP-01).
    Sp => {
        letters: "SP", help: "Stop the program",
        source: Manual, sender: Both, answer: Acknowledge, permission: valid(1, "OOOOO", "OOOOO"),
    }

    /// Servo power off (CMD-BR-01).
    Br => {
        letters: "BR", help: "Servo off",
        source: Manual, sender: Host, answer: Acknowledge, permission: valid(2, "OOOOO", "OOOOO"),
    }

    /// Servo power on (CMD-SO-01).
    So => {
        letters: "SO", help: "Servo on",
        source: Manual, sender: Host, answer: Acknowledge, permission: valid(3, "XXXOX", "XXXXO"),
    }

    /// Reset (CMD-RS-01).
    Rs(reset: Reset) => {
        letters: "RS", form: "RS,<PRG|STP|CYC|SIG|SEL>", example: "RS,PRG",
        operands: ["what"],
        help: "Reset: prg, stp, cyc, sig, sel; err (an extension) resets alarms",
        source: Manual, sender: Host, answer: Acknowledge, permission: valid(4, "XXXOX", "XXXXO"),
        parse: operate::rs, encode: text(reset.as_str()),
    }

    /// Select the execution file (CMD-SL-01).
    Sl(name: FileName) => {
        letters: "SL", form: "SL,<file name>", example: "SL,TEST",
        operands: ["file"],
        help: "Select a file",
        source: Manual, sender: Host, answer: Acknowledge, permission: valid_unless_scara(5, ["XXXOX", "XXXXO"], ["SSSSS", "SSSSS"], false),
        parse: |operands| files::name(operands).map(Command::Sl), encode: text(name.as_str()),
    }

    /// Upload a file from the RAM drive (CMD-UL-01).
    Ul(name: FileName) => {
        letters: "UL", form: "UL,<file name>", example: "UL,ETHERNET.PAR",
        operands: ["file"],
        help: "Upload: the file goes to stdout or --output",
        source: Manual, sender: Host, answer: File, permission: valid(6, "SSSSS", "SSSSS"),
        parse: |operands| files::name(operands).map(Command::Ul), encode: text(name.as_str()),
    }

    /// Download a file to the RAM drive (CMD-DL-01).
    Dl(name: FileName) => {
        letters: "DL", form: "DL,<file name>", example: "DL,TEST",
        operands: ["file"],
        help: "Download a file; pick.scol becomes PICK unless a name is given",
        source: Manual, sender: Host, answer: Acknowledge, permission: valid(7, "SSSSS", "SSSSS"),
        parse: |operands| files::name(operands).map(Command::Dl), encode: text(name.as_str()),
    }

    /// Directory of the RAM drive (CMD-CA-01).
    Ca => {
        letters: "CA", help: "Directory of the RAM drive",
        source: Manual, sender: Host, answer: Status, permission: valid(8, "OOOOO", "OOOOO"),
    }

    /// Status (CMD-SU-01).
    Su => {
        letters: "SU", help: "Status: modes, file, override, execution",
        source: Manual, sender: Host, answer: Status, permission: valid(9, "OOOOO", "OOOOO"),
    }

    /// Error history (CMD-EU-01).
    Eu => {
        letters: "EU", help: "Error history",
        source: Manual, sender: Host, answer: Status, permission: valid(11, "OOOOO", "OOOOO"),
    }

    /// Erase a file (CMD-ER-01).
    Er(name: FileName) => {
        letters: "ER", form: "ER,<file name>", example: "ER,TEST",
        operands: ["file"],
        help: "Erase a file",
        source: Manual, sender: Host, answer: Acknowledge, permission: valid(10, "SSSSS", "SSSSS"),
        parse: |operands| files::name(operands).map(Command::Er), encode: text(name.as_str()),
    }

    /// A file or a part of one: everything after `FL,` (FL-01).
    Fl(content: Vec<u8>) => {
        letters: "FL", form: "FL,<contents><EOF>", example: "FL,END",
        operands: ["content"],
        help: "Content of a file",
        source: Manual, sender: Both, answer: Acknowledge, permission: None,
        parse: |operands| operands.raw().map(|content| Command::Fl(content.to_vec())), encode: Encoding::Content(content),
    }

    /// Affirmative answer (CMD-OK-01).
    Ok => {
        letters: "OK", help: "Affirmative answer",
        source: Manual, sender: Both, answer: Acknowledge, permission: None,
    }

    /// Negative answer (CMD-NG-01).
    Ng => {
        letters: "NG", help: "Negative answer",
        source: Manual, sender: Both, answer: Acknowledge, permission: None,
    }

    /// Internal command (CMD-EC-01).
    Ec(internal: InternalCommand) => {
        letters: "EC", form: "EC,MODE <mode>|OVRD <percent>|BREAK", example: "EC,OVRD 50",
        operands: ["internal command", "value"],
        help: "Internal command: mode cycle | mode cont | mode step | mode segment | ovrd 50 | break",
        source: Manual, sender: Host, answer: Acknowledge, permission: valid(12, "XXXOX", "XXXXO"),
        parse: operate::ec, encode: text(operate::encode(*internal)),
    }

    /// Write a global variable (CMD-MW-01).
    Mw(write: VariableWrite) => {
        letters: "MW", form: "MW,<0|1> <name> <type> <value> ...", example: "MW,0 A1 4 1.500 -2.250 3.000 4.123 5.000 1",
        operands: ["write into the file", "variable", "type", "value ..."],
        help: "Write a global variable",
        source: Manual, sender: Host, answer: Acknowledge, permission: valid(13, "OOOOO", "OOOOO"),
        parse: variable::mw, encode: text(variable::encode_write(write)),
    }

    /// Feed hold (CMD-FD-01).
    Fd => {
        letters: "FD", help: "Feed hold: the first FD holds, the next releases",
        source: Manual, sender: Host, answer: Acknowledge, permission: valid(14, "OOOOO", "OOOOO"),
    }

    /// System total status (CMD-SU-01).
    Sf => {
        letters: "SF", help: "System total status: alarms, lines, signals, positions",
        source: Manual, sender: Host, answer: Status, permission: valid(15, "OOOOO", "OOOOO"),
    }

    /// Read a global variable (CMD-MR-01).
    Mr(read: VariableRead) => {
        letters: "MR", form: "MR,<name> <type>", example: "MR,TBL(1,3) 5",
        operands: ["variable", "type"],
        help: "Read a global variable, for example COUNT, TABLE(2) or PLACED integer",
        source: Manual, sender: Host, answer: Status, permission: valid(16, "OOOOO", "OOOOO"),
        parse: variable::mr, encode: text(format!("{} {}", read.variable, read.kind.code())),
    }

    /// Force I/O lines (CMD-IW-01).
    Iw(lines: Vec<LineWrite>) => {
        letters: "IW", form: "IW,<line> <0|1> ...", example: "IW,3 1 4 0",
        operands: ["line ...", "state ..."],
        help: "Force output lines: LINE STATE [LINE STATE ...]",
        source: Manual, sender: Host, answer: Acknowledge, permission: valid(17, "XXXOX", "XXXXO"),
        parse: lines::iw, encode: text(lines::encode(lines)),
    }

    /// Version (CMD-VR-01).
    Vr => {
        letters: "VR", help: "Version",
        source: Manual, sender: Host, answer: Status, permission: valid(18, "OOOOO", "OOOOO"),
    }

    /// Execute a statement (CMD-DO-01), kept as it came.
    Do(statement: String) => {
        letters: "DO", form: "DO,<statement>", example: "DO,MOVE A1",
        operands: ["statement"],
        help: "Execute one statement, for example: do \"MOVE POINT(400,0,200) WITH SPEED=50\"",
        source: Manual, sender: Host, answer: Acknowledge, permission: valid(19, "XXXOX", "XXXXO"),
        parse: |operands| operands.text("a statement").map(|text| Command::Do(text.into())), encode: text(statement.as_str()),
    }

    /// Extension: quick status; 1 is the only number known and read (hosts SM).
    Sm(number: u8) => {
        letters: "SM", form: "SM,1", example: "SM,1",
        operands: ["number"],
        help: "quick status",
        source: ScaraManual, sender: Host, answer: Status, permission: valid(0, "OOOOO", "OOOOO"),
        parse: |operands| operands.number("1", 1..=1).map(Command::Sm), encode: decimal(*number),
    }

    /// Extension: the host's watchdog. It is not running after a time of 0 (hosts 2).
    Wd {
        /// Longest silence of the host in milliseconds; 0 stops the watchdog.
        timeout_ms: u32,
        /// Level of the alarm that follows; `None` is written 0.
        level: Option<AlarmLevel>,
    } => {
        letters: "WD", form: "WD,<milliseconds> <0|1|2|8>", example: "WD,700 2",
        operands: ["milliseconds", "level of the alarm"],
        help: "watchdog: an alarm is raised if no sm follows in time; 0 0 stops it",
        source: ScaraManual, sender: Host, answer: Acknowledge, permission: valid(8, "OOOOO", "OOOOO"),
        parse: operate::wd, encode: text(format!("{timeout_ms} {}", level.map_or(0, AlarmLevel::number))),
    }

    /// Extension: current alarms (hosts 7.2).
    Ac => {
        letters: "AC", help: "present alarms",
        source: ScaraManual, sender: Host, answer: Status, permission: valid(1, "OOOOO", "OOOOO"),
    }

    /// Extension: alarm history (hosts 7.2).
    Ah => {
        letters: "AH", help: "alarm history",
        source: ScaraManual, sender: Host, answer: Status, permission: valid(2, "OOOOO", "OOOOO"),
    }

    /// Extension: input and output words; 1 is the only number known and read (hosts 2).
    Io(number: u8) => {
        letters: "IO", form: "IO,1", example: "IO,1",
        operands: ["number"],
        help: "input and output lines that are on",
        source: ScaraManual, sender: Host, answer: Status, permission: valid(3, "OOOOO", "OOOOO"),
        parse: |operands| operands.number("1", 1..=1).map(Command::Io), encode: decimal(*number),
    }

    /// Extension: read successive input lines as one number, the first line in bit 0 (hosts 2).
    Hi {
        /// Number of the first line; the last is at most 65535.
        first: u16,
        /// How many, 1 to [`super::MAX_WORD_LINES`].
        count: u8,
    } => {
        letters: "HI", form: "HI,<first line> <count>", example: "HI,1 8",
        operands: ["first line", "count"],
        help: "successive input lines as one number",
        source: ScaraManual, sender: Host, answer: Status, permission: valid(6, "XXXOX", "XXXXO"),
        parse: lines::hi, encode: text(format!("{first} {count}")),
    }

    /// Extension: write successive output lines as one number, the first line in bit 0 (hosts 2).
    Ho {
        /// Number of the first line; the last is at most 65535.
        first: u16,
        /// How many, 1 to [`super::MAX_WORD_LINES`].
        count: u8,
        /// Below two to the power of `count`.
        value: u32,
    } => {
        letters: "HO", form: "HO,<first line> <count> <value>", example: "HO,1 8 165",
        operands: ["first line", "count", "value"],
        help: "set successive output lines from one number",
        source: ScaraManual, sender: Host, answer: Acknowledge, permission: valid(7, "XXXOX", "XXXXO"),
        parse: lines::ho, encode: text(format!("{first} {count} {value}")),
    }

    /// Extension: a present position (hosts 2).
    Pr(query: PositionQuery) => {
        letters: "PR", form: "PR,<0-5>", example: "PR,5",
        operands: ["position"],
        help: "position. Commanded: 0 joint, 1 world, 2 work; measured: 3 joint, 4 world, 5 work",
        source: ScaraManual, sender: Host, answer: Status, permission: valid(4, "OOOOO", "OOOOO"),
        parse: guide::pr, encode: decimal(query.code()),
    }

    /// Extension: present speed, 0 of the joints, 1 in world coordinates (hosts 2).
    Vl(number: u8) => {
        letters: "VL", form: "VL,<0|1>", example: "VL,1",
        operands: ["speed"],
        help: "speed: 0 of the joints, 1 in world coordinates",
        source: ScaraManual, sender: Host, answer: Status, permission: valid(5, "OOOOO", "OOOOO"),
        parse: |operands| operands.number("0 (joint) or 1 (world)", 0..=1).map(Command::Vl), encode: decimal(*number),
    }

    /// Extension: set a coordinate system (hosts 2).
    Zs {
        /// Which of them.
        frame: ZsFrame,
        /// Name of the global coordinate variable.
        name: VariableName,
        /// X Y Z C, or X Y Z A B C, in mm and degrees; finite. The arm decides which.
        values: Vec<f64>,
    } => {
        letters: "ZS", form: "ZS,<1|2> <name> <value> ...", example: "ZS,1 WK1 1.000 2.000 3.000 4.000",
        operands: ["coordinate system", "variable", "value ..."],
        help: "set the work or the tool coordinate system",
        source: ScaraManual, sender: Host, answer: Acknowledge, permission: valid(9, "XXXOX", "XXXXO"),
        parse: guide::zs, encode: text(with_numbers(format!("{} {name}", frame.code()), values.iter().copied().map(Number::Real))),
    }

    /// Extension: guide mode, 0 jog, 1 inching, 2 free (hosts 2).
    Md(number: u8) => {
        letters: "MD", form: "MD,<0-2>", example: "MD,2",
        operands: ["guide mode"],
        help: "guide mode: jog, inching, free (0 to 2)",
        source: ScaraManual, sender: Host, answer: Acknowledge, permission: valid(10, "XXXOX", "XXXXO"),
        parse: |operands| operands.number("a guide mode from 0 to 2", 0..=2).map(Command::Md), encode: decimal(*number),
    }

    /// Extension: guide rate, 0 slow, 1 mid, 2 fast (hosts 2, SF).
    Rt(number: u8) => {
        letters: "RT", form: "RT,<0-2>", example: "RT,2",
        operands: ["guide rate"],
        help: "guide rate: slow, mid, fast (0 to 2)",
        source: ScaraManual, sender: Host, answer: Acknowledge, permission: valid(11, "XXXOX", "XXXXO"),
        parse: |operands| operands.number("a guide rate from 0 to 2", 0..=2).map(Command::Rt), encode: decimal(*number),
    }

    /// Extension: guide coordinate system, 0 joint, 1 tool, 2 work, 3 world (hosts 2).
    Sc(number: u8) => {
        letters: "SC", form: "SC,<0-3>", example: "SC,3",
        operands: ["guide coordinate system"],
        help: "guide coordinate system: joint, tool, work, world (0 to 3)",
        source: ScaraManual, sender: Host, answer: Acknowledge, permission: valid(12, "XXXOX", "XXXXO"),
        parse: |operands| operands.number("a guide coordinate system from 0 to 3", 0..=3).map(Command::Sc), encode: decimal(*number),
    }

    /// Extension: guide an axis (hosts 2).
    Jg {
        /// Axis, 1 to 8.
        axis: u8,
        motion: JogDirection,
    } => {
        letters: "JG", form: "JG,<1-8> <+|-|!>", example: "JG,1 +",
        operands: ["axis", "direction"],
        help: "guide an axis up (+), down (-), or stop it (!)",
        source: ScaraManual, sender: Host, answer: Acknowledge, permission: valid(13, "XXXOX", "XXXXO"),
        parse: guide::jg, encode: text(format!("{axis} {}", motion.sign())),
    }

    /// Extension: move to a position (S71).
    Mp {
        /// The tool point keeps its present height.
        keeps_height: bool,
        /// Name of a position, or `POINT(...)`.
        position: String,
    } => {
        letters: "MP", form: "MP,<0|1> <position>", example: "MP,0 A1",
        operands: ["height", "position"],
        help: "move to a position: 0 as it is, 1 at the present height",
        source: ScaraManual, sender: Host, answer: Acknowledge, permission: valid(16, "XXXOX", "XXXXO"),
        parse: guide::mp, encode: text(format!("{} {position}", u8::from(*keeps_height))),
    }

    /// Extension: the current position file (S28, S72).
    Ps => {
        letters: "PS", help: "current position file: status, line, joints, torques",
        source: ScaraManual, sender: Host, answer: Status, permission: valid(17, "OOOOO", "OOOOO"),
    }

    /// Extension: an item of the maintenance information (S74).
    Mn(item: u8) => {
        letters: "MN", form: "MN,<1-17>", example: "MN,13",
        operands: ["item"],
        help: "an item of the maintenance information, 1 to 17",
        source: ScaraManual, sender: Host, answer: File, permission: valid(15, "OOOOO", "OOOOO"),
        parse: |operands| operands.number("an item from 1 to 17", 1..=17).map(Command::Mn), encode: decimal(*item),
    }

    /// Extension: reset of a maintenance item (S75).
    Rm(item: u8) => {
        letters: "RM", form: "RM,<1-16>", example: "RM,13",
        operands: ["item"],
        help: "reset an item of the maintenance information, 1 to 16",
        source: ScaraManual, sender: Host, answer: Acknowledge, permission: valid(18, "OOOOO", "OOOOO"),
        parse: |operands| operands.number("an item from 1 to 16", 1..=16).map(Command::Rm), encode: decimal(*item),
    }

    /// Extension: origin change of the third axis, of a SCARA alone (S83).
    Zc => {
        letters: "ZC", help: "origin change of the third axis (SCARA): function and value",
        source: ScaraManual, sender: Host, answer: Status, permission: valid(19, "OOOOO", "OOOOO"),
    }

    /// Extension: who has the control right in EXT, 0 SIG, 1 RS-232C, 2 ETHER (S84).
    Em(right: u8) => {
        letters: "EM", form: "EM,<0-2>", example: "EM,2",
        operands: ["control right"],
        help: "give the control right to signals, RS-232C or ETHER (0 to 2)",
        source: ScaraManual, sender: Host, answer: Acknowledge, permission: valid(20, "XXXOX", "XXXXO"),
        parse: |operands| operands.number("a control right from 0 to 2", 0..=2).map(Command::Em), encode: decimal(*right),
    }

    /// Extension: reset of alarms (hosts 2, decision D6).
    RsErr => {
        letters: "RS", name: "RS,ERR", form: "RS,ERR", example: "RS,ERR",
        operands: ["what"],
        help: "reset of alarms",
        source: ScaraManual, sender: Host, answer: Acknowledge, permission: valid(14, "XXXOX", "XXXXO"),
        parse: operate::rs, encode: text(RESET_OF_ALARMS),
    }
}
