//! The table of findings that faults cause: a host is not to blame for an exchange that a fault has broken.
//!
//! [`CAUSES`] has a reason for each row. `effects` remembers which faults have fired, and asks the table for each finding.
//! Legal variation is not in it, because a host has to cope with that.

use crate::finding::{Rule, rules};

ts3100_proto::codes! {
    /// Where and how long a fault can cause a finding.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Reach {
        /// The port, until the host sends its next command. A text that leaves only after that command reaches further, into
        /// the exchange of that command.
        Exchange = "the exchange in which it fires",
        /// Every port, until the host sends its next command.
        Silence = "until the next command of the host",
        /// The port, until two commands have come after the last text of the fault.
        Following = "the exchange and the next command",
        /// The command whose reply the host has not read, as long as the host sends nothing else and it is refused.
        Repetition = "the same command, sent again",
        /// As before, if the host has read another text than OK as something else.
        Belief = "the next command, if the reply that was changed was not OK",
        /// The port, until the text with the changed byte has been read.
        Input = "the text that was changed",
        /// The port, until the next peer connects.
        Link = "until the host is connected again",
        /// The channel, until two records and two outputs of PRINT have passed or a program starts.
        Channel = "the channel, up to the second record after it",
        /// Everything, until the robot has its previous state: power, servo, key, alarms, and a program that ran.
        Machine = "until the robot is as it was before",
    }
    /// The phrase for lists.
    fn description -> &'static str;
}

/// A row of [`CAUSES`].
#[derive(Debug)]
pub struct CauseRow {
    /// Names of the kinds of fault.
    pub kinds: &'static [&'static str],
    /// Where and how long.
    pub reach: Reach,
    /// The findings; none listed: every one.
    pub rules: &'static [&'static Rule],
    /// Why, in one sentence.
    pub reason: &'static str,
}

/// Which findings each kind of fault can cause.
pub static CAUSES: &[CauseRow] = &[
    CauseRow {
        kinds: &[
            "no-reply",
            "wrong-reply",
            "lost-etx",
            "flipped-bit",
            "reset-mid-text",
            "half-open",
            "parity-error",
            "power-loss",
            "late-reply",
            "split-bytes",
            "merged-texts",
            "slow-line",
            "duplicate-text",
        ],
        reach: Reach::Exchange,
        rules: &[
            &rules::ANSWER_MISSING,
            &rules::DOWNLOAD_ABANDONED,
            &rules::COMMAND_IN_EXCHANGE,
            &rules::LEFT_IN_EXCHANGE,
            &rules::LEFT_JOGGING,
        ],
        reason: "A host cannot end an exchange whose text it did not read in time; it gives up and begins again.",
    },
    CauseRow {
        kinds: &[
            "no-reply",
            "wrong-reply",
            "lost-etx",
            "flipped-bit",
            "reset-mid-text",
            "half-open",
            "parity-error",
            "late-reply",
            "split-bytes",
            "merged-texts",
            "slow-line",
        ],
        reach: Reach::Silence,
        rules: &[&rules::WATCHDOG_LATE],
        reason: "A host that waits for a reply sends nothing, so the watchdog of WD is late.",
    },
    CauseRow {
        kinds: &["half-open"],
        reach: Reach::Exchange,
        rules: &[&rules::TEXT_UNFINISHED],
        reason: "Nothing is read any more, so the end of a text does not arrive.",
    },
    CauseRow {
        kinds: &["reset-mid-text", "half-open", "power-loss"],
        reach: Reach::Link,
        rules: &[&rules::SECOND_CONNECTION],
        reason: "The host connects again before the robot has given up the old connection.",
    },
    CauseRow {
        kinds: &[
            "no-reply",
            "wrong-reply",
            "lost-etx",
            "flipped-bit",
            "reset-mid-text",
            "half-open",
            "late-reply",
            "split-bytes",
            "merged-texts",
            "slow-line",
            "duplicate-text",
            "power-loss",
        ],
        reach: Reach::Following,
        rules: &[
            &rules::UNEXPECTED_ANSWER,
            &rules::ANSWER_EARLY,
            &rules::COMMAND_EARLY,
            &rules::COMMAND_BEFORE_ANSWER,
            &rules::POLL_FAST,
            &rules::HALF_DUPLEX,
            &rules::FILE_WITHOUT_DOWNLOAD,
        ],
        reason: "The host's bytes cross a text that comes late, twice or not at all; it repeats its last text.",
    },
    CauseRow {
        kinds: &["ng"],
        reach: Reach::Following,
        rules: &[&rules::POLL_FAST],
        reason: "The host sends the command again after NG.",
    },
    CauseRow {
        kinds: &[
            "no-reply",
            "wrong-reply",
            "lost-etx",
            "flipped-bit",
            "reset-mid-text",
            "half-open",
            "late-reply",
            "split-bytes",
            "merged-texts",
            "slow-line",
        ],
        reach: Reach::Repetition,
        rules: &[
            &rules::MODE_FORBIDS,
            &rules::REFUSED_BY_STATE,
            &rules::REPEATED_REFUSAL,
        ],
        reason: "The robot has obeyed, but the host does not know it; the robot refuses the same command the second time.",
    },
    CauseRow {
        kinds: &["wrong-reply", "flipped-bit"],
        reach: Reach::Belief,
        rules: &[
            &rules::MODE_FORBIDS,
            &rules::START_SERVO_OFF,
            &rules::REFUSED_BY_STATE,
            &rules::PROGRAM_ERRORS,
        ],
        reason: "The host has not read that its command was refused, or has read a false status.",
    },
    CauseRow {
        kinds: &["flipped-bit", "parity-error", "power-loss"],
        reach: Reach::Input,
        rules: &[],
        reason: "The robot reads another text than the host has sent.",
    },
    CauseRow {
        kinds: &["flipped-bit", "parity-error"],
        reach: Reach::Exchange,
        rules: &[
            &rules::FILE_BAD_LINE,
            &rules::FILE_LINE_ENDS,
            &rules::FILE_MALFORMED,
            &rules::FILE_TOO_LARGE,
            &rules::PARAMETER_BROKEN,
            &rules::REFUSED_BY_STATE,
        ],
        reason: "A file has a byte that the host has not sent, or lacks one.",
    },
    CauseRow {
        kinds: &["drive-full"],
        reach: Reach::Exchange,
        rules: &[&rules::FILE_TOO_LARGE, &rules::REFUSED_BY_STATE],
        reason: "The fault takes the room that the file needs.",
    },
    CauseRow {
        kinds: &[
            "late-reply",
            "flipped-bit",
            "split-bytes",
            "merged-texts",
            "duplicate-text",
            "reset-mid-text",
            "half-open",
            "slow-line",
            "parity-error",
            "lost-record",
        ],
        reach: Reach::Channel,
        rules: &[
            &rules::DATA_BEFORE_INPUT,
            &rules::DATA_CLEARED,
            &rules::HALF_VALUE,
            &rules::PEER_LEFT,
            &rules::PRINT_WITHOUT_PEER,
            &rules::INPUT_WITHOUT_PEER,
        ],
        reason: "The program and the peer are out of step: a record or a prompt comes late, twice or not at all, or the \
                 connection ends.",
    },
    CauseRow {
        kinds: &["flipped-bit", "parity-error"],
        reach: Reach::Channel,
        rules: &[
            &rules::INPUT_NOT_A_NUMBER,
            &rules::INPUT_EMPTY,
            &rules::INPUT_LINE_FEED,
            &rules::INPUT_OVERFLOW,
            &rules::PROTOCOL_ON_CHANNEL,
        ],
        reason: "The program reads another record than the peer has sent.",
    },
    CauseRow {
        kinds: &[
            "power-loss",
            "alarm",
            "emergency-stop",
            "servo-failure",
            "key-turned",
            // By the alarms of [E10] and of WD.
            "reset-mid-text",
            "half-open",
            "no-reply",
            "late-reply",
            "wrong-reply",
            "lost-etx",
            "flipped-bit",
            "split-bytes",
            "merged-texts",
            "slow-line",
            "parity-error",
            "lost-record",
        ],
        reach: Reach::Machine,
        rules: &[
            &rules::MODE_FORBIDS,
            &rules::START_SERVO_OFF,
            &rules::REFUSED_BY_STATE,
            &rules::REPEATED_REFUSAL,
            &rules::SIGNAL_REFUSED,
            &rules::PANEL_REFUSED,
            &rules::SELECTION_LOST,
            &rules::DATA_BEFORE_INPUT,
            &rules::DATA_CLEARED,
            &rules::INPUT_OVERFLOW,
        ],
        reason: "The fault, or an alarm that follows from it, stops the robot: what was valid before is refused, and the \
                 program takes no data.",
    },
    CauseRow {
        kinds: &["power-loss"],
        reach: Reach::Machine,
        rules: &[&rules::FILE_WITHOUT_DOWNLOAD, &rules::UNEXPECTED_ANSWER],
        reason: "A host on a serial line does not see that the robot has lost its exchange.",
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::KINDS;

    // clause: T27
    #[test]
    fn every_kind_has_a_row_and_every_row_names_kinds() {
        for kind in KINDS {
            let rows = CAUSES.iter().filter(|row| row.kinds.contains(&kind.name));
            assert!(rows.count() > 0, "{}", kind.name);
        }
        for row in CAUSES {
            assert!(row.reason.ends_with('.'), "{}", row.reason);
            for name in row.kinds {
                assert!(KINDS.iter().any(|kind| kind.name == *name), "{name}");
            }
        }
    }
}
