//! RS: the five resets of the manual, and the reset of alarms that hosts send (hosts 2).
//!
//! The controller gives them their effect. `RS,ERR` has its own permission row, see [`crate::permission`].

use crate::codes::codes;
use crate::command::operand::{Operands, ParseResult};
use crate::command::{Command, CommandError};
use nom::Parser;
use nom::character::complete::alpha1;
use nom::combinator::map_opt;

codes! {
    /// What RS resets, in the order of Table 5.1.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Reset {
        /// `PRG`: back to step 1, program data initialised (CMD-RS-03).
        Program = "PRG",
        /// `STP`: back to step 1, program data kept (CMD-RS-04).
        Step = "STP",
        /// `CYC`: to the label RCYCLE (CMD-RS-05).
        Cycle = "CYC",
        /// `SIG`: output signals (CMD-RS-07).
        Signal = "SIG",
        /// `SEL`: the selection of the execution file (CMD-RS-09).
        Select = "SEL",
    }
    /// The operand on the wire, for example `PRG`.
    fn as_str -> &'static str;
}

/// The operand of the reset of alarms, which is a command of its own: it has its own row in the permission tables.
pub(super) const RESET_OF_ALARMS: &str = "ERR";

/// One word: a reset of the manual, or that of alarms.
pub(super) fn rs(operands: Operands<'_>) -> Result<Command, CommandError> {
    operands.parse("PRG, STP, CYC, SIG, SEL or ERR", word)
}

fn word(input: &str) -> ParseResult<'_, Command> {
    let known = |word: &str| {
        if word.eq_ignore_ascii_case(RESET_OF_ALARMS) {
            return Some(Command::RsErr);
        }
        let mut resets = Reset::ALL.into_iter();
        resets
            .find(|reset| reset.as_str().eq_ignore_ascii_case(word))
            .map(Command::Rs)
    };
    map_opt(alpha1, known).parse(input)
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::format;
    use alloc::string::ToString;

    // clause: CMD-RS-01 FRM-07 FRM-08 FRM-13
    #[test]
    fn every_reset_in_any_case() {
        for reset in Reset::ALL {
            for form in ["RS,", "RS, ", "rs,"] {
                let message = format!("{form}{}", reset.as_str());
                assert_eq!(Command::parse(message.as_bytes()), Ok(Command::Rs(reset)));
                assert_eq!(
                    Command::parse(message.to_ascii_lowercase().as_bytes()),
                    Ok(Command::Rs(reset))
                );
            }
        }
    }

    #[test]
    fn the_reset_of_alarms_is_the_only_extension() {
        for message in ["RS,ERR", "rs, err ", "Rs,Err"] {
            assert_eq!(Command::parse(message.as_bytes()), Ok(Command::RsErr));
        }
        assert_eq!(Command::RsErr.encode(), b"RS,ERR\r");
        assert!(Command::RsErr.is_extension());
        assert_eq!(Command::RsErr.letters(), "RS");
        assert_eq!(Command::RsErr.permission_row(), "RS,ERR");
        for reset in Reset::ALL {
            let command = Command::Rs(reset);
            assert!(!command.is_extension());
            assert_eq!((command.letters(), command.permission_row()), ("RS", "RS"));
        }
    }

    // clause: CMD-RS-01 FRM-07 FRM-18
    #[test]
    fn other_operands_are_malformed() {
        for message in [
            "RS",
            "RS,",
            "RSPRG",
            "RS PRG",
            "RS,ABC",
            "RS,PRG STP",
            "RS,PRG,STP",
            "RS,PR",
            "RS,PRGX",
            "RS,ER",
            "RS,ERROR",
        ] {
            assert!(matches!(
                Command::parse(message.as_bytes()),
                Err(CommandError::Malformed { letters: "RS", .. })
            ));
        }
        let error = Command::parse(b"RS,ABC").map_err(|error| error.to_string());
        assert_eq!(
            error,
            Err("RS: expected PRG, STP, CYC, SIG, SEL or ERR, found \"ABC\" at byte 3".to_string())
        );
        let error = Command::parse(b"RSPRG").map_err(|error| error.to_string());
        assert_eq!(
            error,
            Err("RS: expected a comma after the letters, found \"PRG\" at byte 2".to_string())
        );
    }
}
