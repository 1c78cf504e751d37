//! The commands that real hosts send beyond Table 5.1 (hosts 2, decision D0), in the form of that table.

use crate::command::table::{CommandRow, Sender};
use crate::command::{Command, frame, jog, line_value, request, reset, watchdog};

/// Letters of the extensions that the SCARA edition of the manual prints (ste80722, commands).
pub const SCARA_MANUAL: [&str; 9] = ["SM", "IO", "WD", "PR", "VL", "HI", "AC", "AH", "MN"];

/// The extensions in the order of decision D0. The last is a further operand of RS, which has its row in
/// [`COMMANDS`](super::COMMANDS) too.
pub const EXTENSIONS: &[CommandRow] = &[
    CommandRow {
        letters: "SM",
        description: "Quick status request",
        form: "SM,1",
        sender: Sender::Host,
        example: "SM,1",
        read: request::sm,
    },
    CommandRow {
        letters: "WD",
        description: "Watchdog of the host",
        form: "WD,<milliseconds> <0|1|2|8>",
        sender: Sender::Host,
        example: "WD,700 2",
        read: watchdog::wd,
    },
    CommandRow {
        letters: "AC",
        description: "Current alarms request",
        form: "AC",
        sender: Sender::Host,
        example: "AC",
        read: |operands| operands.none(Command::Ac),
    },
    CommandRow {
        letters: "AH",
        description: "Alarm history request",
        form: "AH",
        sender: Sender::Host,
        example: "AH",
        read: |operands| operands.none(Command::Ah),
    },
    CommandRow {
        letters: "IO",
        description: "I/O words request",
        form: "IO,1",
        sender: Sender::Host,
        example: "IO,1",
        read: request::io,
    },
    CommandRow {
        letters: "HI",
        description: "Reading of successive input lines as a number",
        form: "HI,<first line> <count>",
        sender: Sender::Host,
        example: "HI,1 8",
        read: line_value::hi,
    },
    CommandRow {
        letters: "HO",
        description: "Writing of successive output lines as a number",
        form: "HO,<first line> <count> <value>",
        sender: Sender::Host,
        example: "HO,1 8 165",
        read: line_value::ho,
    },
    CommandRow {
        letters: "PR",
        description: "Position request",
        form: "PR,<0-5>",
        sender: Sender::Host,
        example: "PR,5",
        read: request::pr,
    },
    CommandRow {
        letters: "VL",
        description: "Speed request",
        form: "VL,<0|1>",
        sender: Sender::Host,
        example: "VL,1",
        read: request::vl,
    },
    CommandRow {
        letters: "ZS",
        description: "Setting of the work or tool coordinate system",
        form: "ZS,<1|2> <name> <value> ...",
        sender: Sender::Host,
        example: "ZS,1 WK1 1.000 2.000 3.000 4.000",
        read: frame::zs,
    },
    CommandRow {
        letters: "MD",
        description: "Guide mode",
        form: "MD,<0-2>",
        sender: Sender::Host,
        example: "MD,2",
        read: request::md,
    },
    CommandRow {
        letters: "RT",
        description: "Guide rate",
        form: "RT,<0-2>",
        sender: Sender::Host,
        example: "RT,2",
        read: request::rt,
    },
    CommandRow {
        letters: "SC",
        description: "Guide coordinate system",
        form: "SC,<0-3>",
        sender: Sender::Host,
        example: "SC,3",
        read: request::sc,
    },
    CommandRow {
        letters: "JG",
        description: "Guidance of an axis",
        form: "JG,<1-8> <+|-|!>",
        sender: Sender::Host,
        example: "JG,1 +",
        read: jog::jg,
    },
    CommandRow {
        letters: "MN",
        description: "Maintenance information request",
        form: "MN",
        sender: Sender::Host,
        example: "MN",
        read: |operands| operands.none(Command::Mn),
    },
    CommandRow {
        letters: "RS",
        description: "Reset of alarms",
        form: "RS,ERR",
        sender: Sender::Host,
        example: "RS,ERR",
        read: reset::rs,
    },
];
