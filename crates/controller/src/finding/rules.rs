//! The table of rules: what the manual advises a host against, what this controller forgives, and what costs the host
//! data or time.
//!
//! This file says what each rule is. `checks`, and the places in the crate that see the bytes, decide when one is
//! broken. docs/reference/findings.md lists the rules for users.

use core::time::Duration;
use ts3100_proto::text::HOST_DELAY;

ts3100_proto::codes! {
    /// How serious the violation of a rule is.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub enum Severity {
        /// It worked here; another controller, or a strict reading of the manual, may reject it.
        Note = "note",
        /// The manual advises against it, or the robot answered NG for a reason the host could have known.
        Warning = "warning",
        /// Data was lost, a text or command was invalid, or an exchange was abandoned.
        Error = "error",
    }
    /// `note`, `warning` or `error`.
    fn as_str -> &'static str;
    impl Word;
}

/// A rule that a host can break.
#[derive(Debug)]
pub struct Rule {
    /// Name; stays the same from release to release.
    pub id: &'static str,
    /// How serious a violation is.
    pub severity: Severity,
    /// Section of the manual, and in brackets the clauses (docs/clauses.tsv) and decisions.
    pub source: &'static str,
    /// The violation, in one line.
    pub title: &'static str,
    /// Advice to the author of the host, in one or two sentences.
    pub remedy: &'static str,
    /// Whether it measures the host's pace in virtual time. Such a rule means nothing if virtual time does not
    /// follow the wall clock.
    pub timed: bool,
}

impl Rule {
    /// The rule of this name.
    pub fn by_id(id: &str) -> Option<&'static Rule> {
        RULES.iter().copied().find(|rule| rule.id == id)
    }

    /// The clauses and decisions of its source.
    pub fn clauses(&self) -> impl Iterator<Item = &'static str> {
        let ids = self.source.split_once('[').map_or("", |(_, ids)| ids);
        let ids = ids.trim_end_matches(']').split(", ");
        ids.filter(|id| !id.is_empty())
    }
}

/// There is one of each name.
impl PartialEq for Rule {
    fn eq(&self, other: &Rule) -> bool {
        core::ptr::eq(self, other)
    }
}

impl Eq for Rule {}

/// Shortest time between two requests for the same status: the request, 50 ms, OK, 50 ms (TRN-04). No other rule with
/// [`Rule::timed`] looks back further.
pub const MIN_POLL_INTERVAL: Duration = HOST_DELAY.saturating_mul(2);

/// Makes each rule a documented static and a row of [`RULES`]; `$timed` is [`Rule::timed`].
macro_rules! rules {
    ($($timed:literal: {
        $($name:ident $id:literal $severity:ident $source:literal $title:literal $remedy:literal)*
    })*) => {
        $($(
            #[doc = $title]
            pub static $name: Rule = Rule {
                id: $id,
                severity: Severity::$severity,
                source: $source,
                title: $title,
                remedy: $remedy,
                timed: $timed,
            };
        )*)*
        /// Every rule, in the order of docs/reference/findings.md: pace, texts, commands, exchanges and files,
        /// connections, SCOL channels, SCOL motion, actions at the controller itself.
        pub static RULES: &[&Rule] = &[$($(&$name),*),*];
    };
}

rules! { true: {
    ANSWER_EARLY "answer-early" Warning "5.1 [TRN-04]"
        "OK or NG within 50 ms of the controller's text"
        "Wait 50 ms after a text of the controller before you answer it."
    COMMAND_EARLY "command-early" Warning "5.1 [TRN-04]"
        "A text within 50 ms of the controller's text"
        "Wait 50 ms after a text of the controller before you send the next."
    COMMAND_BEFORE_ANSWER "command-before-answer" Error "5.1 [TRN-01]"
        "A text sent before the reply to the previous one could be read"
        "Send one text, read its answer to the ETX, then send the next."
    POLL_FAST "poll-fast" Note "5.1, 5.5 [TRN-04, TSPC-02]"
        "The same status requested again within 100 ms"
        "Ask at most once every 100 ms, the two pauses of an exchange; the maker's own tool asks once every 1000 ms."
}
false: {
    NO_STX "no-stx" Note "5.2.1 [FRM-01, D0]"
        "A text without STX"
        "Send STX (02) before the data; a controller that follows the manual strictly ignores such a text."
    NO_ETX "no-etx" Note "5.2.1 [FRM-01, T6]"
        "A text without STX that ends with CR instead of ETX"
        "Send ETX (03) after the CR; a controller that follows the manual strictly waits for it."
    BYTES_OUTSIDE "bytes-outside" Warning "5.2.1 [FRM-04]"
        "Bytes outside a text"
        "Send only STX, data and ETX, and end a text before you begin the next."
    TEXT_OVER_LONG "text-over-long" Error "5.2 [FRM-02, FRM-03]"
        "A text of more than 253 data bytes"
        "Cut a file or a message into texts of at most 253 data bytes."
    TEXT_UNFINISHED "text-unfinished" Error "2.2.2 [SER-06, SER-07]"
        "A text that was begun but not finished within 10 s"
        "Send each text without a pause, with ETX at its end."
    BAD_CHECKSUM "bad-checksum" Error "5.3.3 FL [FRM-15]"
        "The byte after ETX is not the sum of the text"
        "Send the low 8 bits of the sum of all bytes after STX, ETX included."
    NO_CR "no-cr" Error "5.2.2 [FRM-09, FRM-10]"
        "CR is missing before ETX"
        "End every command with CR (0D) before ETX."
    MESSAGE_TOO_LONG "message-too-long" Error "5.2 [TRN-07]"
        "A message of more than 1024 bytes over several texts"
        "End each command with CR; no command is that long."
    LOWER_CASE "lower-case" Note "5.2.2 [FRM-13]"
        "Command letters in lower case"
        "Send command letters in upper case; the manual does not mention lower case."
    BLANK_AFTER_COMMA "blank-after-comma" Note "5.2.2 [FRM-08]"
        "A blank after the comma that follows the command letters"
        "Send the operand directly after the comma."
    BLANK_AT_END "blank-at-end" Note "5.2.2 [FRM-18]"
        "Blanks between the last operand and CR"
        "Send CR directly after the last operand."
    COMMA_FOR_BLANK "comma-for-blank" Note "5.3.3 [CMD-IW-03, CMD-MW-01, CMD-MR-01]"
        "A comma between operands where the format has a blank"
        "Only the first operand follows a comma: IW,1 1."
    ODD_CHARACTER "odd-character" Warning "5.2.2 [FRM-11, FRM-12]"
        "A character that the manual does not allow in a data section"
        "Use letters, digits, the blank and \" ' ( ) + - * / , . < > = ! [ ] { } % ^ & ? ; : _"
    ABBREVIATED "abbreviated" Note "5.3.1 [CMD-EC-03]"
        "An abbreviated operation mode"
        "Write STEP, CYCLE, SEGMENT or CONT."

    UNKNOWN_COMMAND "unknown-command" Error "5.3.1 [FRM-06, CMD-LST-04]"
        "No command has these letters"
        "Use a command that `ts3100 docs commands` lists, in upper case."
    MALFORMED_COMMAND "malformed-command" Error "5.3.1 [FRM-07, FRM-18]"
        "The operands do not fit the command"
        "Write the operands as `ts3100 docs commands` shows them."
    EXTENSION_COMMAND "extension-command" Note "5.3.1 [CMD-LST-01, D0]"
        "A command that the manual does not list"
        "Be ready for NG: real controllers accept the command, but the manual does not list it."
    MODE_FORBIDS "mode-forbids" Warning "5.3.2 [PRM-LEG-01, PRM-LEG-03]"
        "A command that is not valid in this master mode, or only while the robot is stopped"
        "Read mode and status with SU first; tables 5.3 and 5.4 list when a command is valid."
    START_SERVO_OFF "start-servo-off" Warning "5.3.3 RN [CMD-RN-05]"
        "RN with servo power off"
        "Send SO first and wait for its OK."
    PROGRAM_ERRORS "program-errors" Error "5.3.1 SL [CMD-SL-02]"
        "A program with errors was selected"
        "Run `ts3100 check` on the file before you download it."
    REFUSED_BY_STATE "refused-by-state" Warning "5.3.3 [TRN-02]"
        "A command that is valid now was refused for another reason"
        "Check the state with SU before you send the command; the message has the reason."
    REPEATED_REFUSAL "repeated-refusal" Warning "5.1 [TRN-02]"
        "The same command refused three times in a row"
        "Repeat a command after NG only if something has changed, and stop after a few attempts."
    SERVO_OFF_RUNNING "servo-off-running" Warning "5.3.3 BR [CMD-BR-02]"
        "BR while the robot runs: it stops in the middle of a motion"
        "Send SP, wait for the stop, then send BR."
    WRITE_WHILE_RUNNING "write-while-running" Note "5.3.3 MW [CMD-MW-06]"
        "A variable written while the program runs"
        "Write while the program is stopped, or use INPUT. The manual does not say when a running program sees the value."

    COMMAND_IN_EXCHANGE "command-in-exchange" Warning "5.1 [TRN-09]"
        "A command instead of OK, NG or a part of a file"
        "End the exchange first: OK or NG to an FL text, EOF at the end of a download."
    UNEXPECTED_ANSWER "unexpected-answer" Warning "5.1 [TRN-10, CMD-SP-08]"
        "OK or NG when there was nothing to answer"
        "Answer FL texts only. OK, NG and the unsolicited SP need no answer."
    ANSWER_MISSING "answer-missing" Error "2.2.2, 5.3.3 [SER-08, CMD-SU-01]"
        "An FL text was not answered within 10 s"
        "Send OK, or NG to stop, after every FL text of the controller (UL CA SU SF EU VR MR)."
    DOWNLOAD_ABANDONED "download-abandoned" Error "2.2.2, 5.3.3 DL [SER-08, CMD-DL-03]"
        "A download was opened and not continued for 10 s"
        "Send the texts of the file without a break and EOF (1A) at the end, or NG to cancel."
    LEFT_IN_EXCHANGE "left-in-exchange" Warning "5.1 [ETH-07]"
        "The host closed the connection in the middle of an exchange"
        "End the exchange with OK or NG before you close the connection."
    FILE_WITHOUT_DOWNLOAD "file-without-download" Error "5.3.3 FL [FL-04]"
        "FL from the host, but no download is open"
        "Send DL with the file name and wait for OK; after NG begin again with DL."
    FILE_BAD_LINE "file-bad-line" Error "5.4.1 [RAM-01, RAM-08]"
        "A line that is too long, a tab, or a character beyond ASCII in a file"
        "Write at most 252 ASCII characters on a line, without tabs."
    FILE_MALFORMED "file-malformed" Error "5.3.3 FL [FL-01, FL-02]"
        "A file without FL at its start, or with bytes after EOF"
        "Send FL in the first text only, and EOF (1A) as the last byte before the last ETX."
    FILE_TOO_LARGE "file-too-large" Error "5.4 [RAM-03, RAM-15]"
        "A file that does not fit on the RAM drive"
        "Keep each file at 99999 bytes or less, and erase files that you do not need."
    FILE_LINE_ENDS "file-line-ends" Note "5.4.1 [RAM-05]"
        "Lines of a user file end with LF or CR LF"
        "End lines with CR (0D); the manual contradicts itself here, and LF is accepted."
    CR_AFTER_EOF "cr-after-eof" Note "5.3.3 FL [FL-01, D2]"
        "CR between EOF and ETX"
        "Send ETX directly after EOF."
    SELECTED_OVERWRITTEN "selected-overwritten" Note "5.3.3 DL [CMD-DL-07]"
        "The selected file was downloaded again"
        "Select it again with SL; the manual does not specify whether RN starts the old or the new one."
    LONG_FILE_NAME "long-file-name" Note "STE 58761 1-16 [S8]"
        "A file was downloaded under a longer name than the robot's own editor allows"
        "Use a name of at most 8 characters and an extension of at most 3."
    PARAMETER_PENDING "parameter-pending" Note "5.2.3 [PAR-FILE-03]"
        "A parameter file was downloaded; it takes effect at the next power-on"
        "Turn the power off and on before you rely on it."
    PARAMETER_BROKEN "parameter-broken" Error "2.3, 3.3 [PAR-U06-06]"
        "A parameter file was downloaded with invalid values"
        "Correct the value and download the file again. Until then the last good value is used, and power-on raises an alarm."
    WATCHDOG_LATE "watchdog-late" Error "STE 80722 p. 90 [S11]"
        "The host started the watchdog with WD and then sent nothing in time"
        "Send a text, for example SM,1, at least twice in the time given to WD, or end the \
             monitoring with WD,0 0."
    LEFT_JOGGING "left-jogging" Error "beyond the manual [D4]"
        "The host closed the connection while it jogged the arm with JG"
        "Stop the axis with JG,n ! first."

    SECOND_CONNECTION "second-connection" Warning "3.2 [ETH-06, D3]"
        "A second connection to a channel that already has a peer"
        "Use one connection for each channel: close the old one first, or share it."
    ANSWERS_UNREAD "answers-unread" Error "3.2 [ETH-02, D3]"
        "The host does not read what the robot sends; the connection was closed"
        "Read to the ETX after every text; on IP1 and IP2 read what PRINT sends."

    HALF_DUPLEX "half-duplex" Error "2.2.2 [SER-02]"
        "Bytes sent on HOST while the robot sends; they are lost"
        "HOST is half-duplex: read the reply to its ETX before you send."
    LINE_SETTINGS "line-settings" Error "2.3 [PAR-U06-01, SER-01]"
        "The host's serial port has other settings than the robot's line"
        "Give both ends the same speed, data bits, parity and stop bits."
    LINE_GARBLED "line-garbled" Error "2.2.1 [SER-01, SER-02]"
        "Characters with parity or framing errors"
        "Set the host's port to the values of [U06], and check the cable."

    LINE_OVERFLOW "line-overflow" Error "2.2.1 [SER-01, SER-03]"
        "More bytes sent to a serial line than it can carry; the newest are lost"
        "Wait for the reply before you send more; each character takes time on the line."

    DATA_BEFORE_INPUT "data-before-input" Warning "4.1.2 [INP-08]"
        "Data for a channel where no INPUT is waiting"
        "Send when the program asks (let it PRINT a prompt); the robot may ignore early data."
    DATA_CLEARED "data-cleared" Warning "4.1.2 [INP-08, D10]"
        "Data lost because the program was started from step 1"
        "Send after the start: let the program PRINT a prompt, and answer it. A host that sends first waits forever."
    INPUT_OVERFLOW "input-overflow" Error "4.1.2 [INP-13]"
        "More than 256 bytes wait on a channel; the newest are lost"
        "Send a record when the program asks for it."
    PRINT_CUT "print-cut" Error "4.1.1 [SER-03]"
        "PRINT of more than 256 bytes: the end was lost, its CR kept"
        "Split it into several PRINT statements, with CR in the last one."
    INPUT_NOT_A_NUMBER "input-not-a-number" Error "4.1.2 [INP-03, INP-14]"
        "INPUT found something that is not a number"
        "Send only integers and reals, separated by commas, with CR at the end."
    INPUT_EMPTY "input-empty" Warning "4.1.2 [INP-17]"
        "An empty value was read as 0"
        "Send every value, even 0."
    INPUT_LINE_FEED "input-line-feed" Note "4.1.2 [INP-04, INP-17]"
        "LF in the data for INPUT"
        "End a record with CR alone."
    HALF_VALUE "half-value" Warning "4.1.2 [INP-16]"
        "The peer of a channel disconnected after a value without comma or CR"
        "End every record with CR; an unfinished record is dropped."
    PEER_LEFT "peer-left" Warning "3.3 [PAR-E10-01, ETH-07]"
        "The peer of a channel disconnected while the program runs"
        "Stop the program first; with [E10] the controller raises an alarm."
    PRINT_WITHOUT_PEER "print-without-peer" Error "4.1.1 [PRT-14]"
        "PRINT on a channel that has no peer"
        "Connect to the channel before you start the program."
    INPUT_WITHOUT_PEER "input-without-peer" Error "4.1.2 [INP-05]"
        "INPUT on a channel that has no peer"
        "Connect to the channel before you start the program."
    PROTOCOL_ON_CHANNEL "protocol-on-channel" Error "4 [GEN-02, NPC-02]"
        "A text of the simple protocol on a SCOL channel"
        "Send commands to HOST or IP0 (port 1000); COM1, IP1 and IP2 carry data only."
    DATA_TO_IP3 "data-to-ip3" Warning "3 [GEN-04]"
        "Data sent to IP3"
        "Use IP0 to IP2; IP3 belongs to a dedicated protocol that is not documented."

    ACCEL_OVER_FULL "accel-over-full" Note "STE 85409 p. 34 [L72, T15]"
        "A statement sets ACCEL or DECEL above 100 percent"
        "Use at most 100 percent. More can overload a real motor in a long motion, and it does not make this arm faster."

    PANEL_REFUSED "panel-refused" Note "5.3.2 [GEN-05]"
        "An operation at the panel had no effect"
        "Remove the cause that the message names, then repeat the operation."
    SIGNAL_REFUSED "signal-refused" Warning "5.3.3 SF [SF-31, PRM-LEG-08]"
        "A command input that had no effect"
        "Remove the cause that the message names, then pulse the input again. ACK confirms STROBE and the resets."
    NO_SUCH_LINE "no-such-line" Warning "5.3.3 SF [SF-31]"
        "An input line that does not exist"
        "Use an input in 1-64, 101-164, 201-264, 301-364, 401-464."
    WIRE_LOOP "wire-loop" Warning "beyond the manual [T27]"
        "Wires between robots that keep changing each other without time passing"
        "Let a program wait for time to pass, for example with DELAY, before it changes its output again."
    SELECTION_LOST "selection-lost" Warning "5.3.1 SL [CMD-SL-02]"
        "The selected file could not be selected again at power-on"
        "Correct the file, then select it with SL."
}}
