//! Table 5.1 as data: for reading messages, for documents, and for tests that walk every command.

use crate::command::operand::Operands;
use crate::command::{Command, CommandError, files, internal, lines, reset, statement, variable};

/// Who sends a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sender {
    /// The host alone.
    Host,
    /// Host and controller (Table 5.2; SP by CMD-SP-06).
    Both,
}

/// A row of Table 5.1.
#[derive(Debug, Clone, Copy)]
pub struct CommandRow {
    /// The two letters.
    pub letters: &'static str,
    /// What it is for.
    pub description: &'static str,
    /// How it is written.
    pub form: &'static str,
    /// Who sends it.
    pub sender: Sender,
    /// A message of it in canonical form, without CR.
    pub example: &'static str,
    /// Its grammar.
    pub(super) read: fn(Operands<'_>) -> Result<Command, CommandError>,
}

/// Table 5.1 in the order of the manual (CMD-LST-01).
pub const COMMANDS: &[CommandRow] = &[
    CommandRow {
        letters: "RN",
        description: "Start of automatic operation",
        form: "RN",
        sender: Sender::Host,
        example: "RN",
        read: |operands| operands.none(Command::Rn),
    },
    CommandRow {
        letters: "SP",
        description: "Stop; from the controller: the robot has stopped",
        form: "SP",
        sender: Sender::Both,
        example: "SP",
        read: |operands| operands.none(Command::Sp),
    },
    CommandRow {
        letters: "BR",
        description: "Servo power off",
        form: "BR",
        sender: Sender::Host,
        example: "BR",
        read: |operands| operands.none(Command::Br),
    },
    CommandRow {
        letters: "SO",
        description: "Servo power on",
        form: "SO",
        sender: Sender::Host,
        example: "SO",
        read: |operands| operands.none(Command::So),
    },
    CommandRow {
        letters: "RS",
        description: "Reset of program, step, cycle, output signals or selection",
        form: "RS,<PRG|STP|CYC|SIG|SEL>",
        sender: Sender::Host,
        example: "RS,PRG",
        read: reset::rs,
    },
    CommandRow {
        letters: "SL",
        description: "Program selection",
        form: "SL,<file name>",
        sender: Sender::Host,
        example: "SL,TEST",
        read: files::sl,
    },
    CommandRow {
        letters: "UL",
        description: "RAM file upload",
        form: "UL,<file name>",
        sender: Sender::Host,
        example: "UL,ETHERNET.PAR",
        read: files::ul,
    },
    CommandRow {
        letters: "DL",
        description: "RAM file download",
        form: "DL,<file name>",
        sender: Sender::Host,
        example: "DL,TEST",
        read: files::dl,
    },
    CommandRow {
        letters: "CA",
        description: "Directory request",
        form: "CA",
        sender: Sender::Host,
        example: "CA",
        read: |operands| operands.none(Command::Ca),
    },
    CommandRow {
        letters: "SU",
        description: "Status request",
        form: "SU",
        sender: Sender::Host,
        example: "SU",
        read: |operands| operands.none(Command::Su),
    },
    CommandRow {
        letters: "EU",
        description: "Error history upload",
        form: "EU",
        sender: Sender::Host,
        example: "EU",
        read: |operands| operands.none(Command::Eu),
    },
    CommandRow {
        letters: "ER",
        description: "File erase",
        form: "ER,<file name>",
        sender: Sender::Host,
        example: "ER,TEST",
        read: files::er,
    },
    CommandRow {
        letters: "FL",
        description: "File contents",
        form: "FL,<contents><EOF>",
        sender: Sender::Both,
        example: "FL,END",
        read: files::fl,
    },
    CommandRow {
        letters: "OK",
        description: "Acknowledge",
        form: "OK",
        sender: Sender::Both,
        example: "OK",
        read: |operands| operands.none(Command::Ok),
    },
    CommandRow {
        letters: "NG",
        description: "Non-acknowledge",
        form: "NG",
        sender: Sender::Both,
        example: "NG",
        read: |operands| operands.none(Command::Ng),
    },
    CommandRow {
        letters: "EC",
        description: "Internal command",
        form: "EC,<MODE mode|OVRD percent|BREAK>",
        sender: Sender::Host,
        example: "EC,OVRD 50",
        read: internal::ec,
    },
    CommandRow {
        letters: "MW",
        description: "Global variable write",
        form: "MW,<0|1> <name> <type> <value> ...",
        sender: Sender::Host,
        example: "MW,0 A1 4 1.500 -2.250 3.000 4.123 5.000 1",
        read: variable::mw,
    },
    CommandRow {
        letters: "FD",
        description: "Feed hold",
        form: "FD",
        sender: Sender::Host,
        example: "FD",
        read: |operands| operands.none(Command::Fd),
    },
    CommandRow {
        letters: "SF",
        description: "System total status request",
        form: "SF",
        sender: Sender::Host,
        example: "SF",
        read: |operands| operands.none(Command::Sf),
    },
    CommandRow {
        letters: "MR",
        description: "Global variable read",
        form: "MR,<name> <type>",
        sender: Sender::Host,
        example: "MR,TBL(1,3) 5",
        read: variable::mr,
    },
    CommandRow {
        letters: "IW",
        description: "I/O forced writing",
        form: "IW,<line> <0|1> ...",
        sender: Sender::Host,
        example: "IW,3 1 4 0",
        read: lines::iw,
    },
    CommandRow {
        letters: "VR",
        description: "Version request",
        form: "VR",
        sender: Sender::Host,
        example: "VR",
        read: |operands| operands.none(Command::Vr),
    },
    CommandRow {
        letters: "DO",
        description: "Execution of a statement",
        form: "DO,<statement>",
        sender: Sender::Host,
        example: "DO,MOVE A1",
        read: statement::statement,
    },
];
