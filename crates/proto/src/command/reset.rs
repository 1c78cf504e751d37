//! RS: the five resets.

use crate::command::operand::{Operands, Read};
use crate::command::{Command, CommandError};
use nom::Parser;
use nom::character::complete::alpha1;
use nom::combinator::map_opt;

/// What RS resets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reset {
    /// `PRG`: back to step 1, program data initialised (CMD-RS-03).
    Program,
    /// `STP`: back to step 1, program data kept (CMD-RS-04).
    Step,
    /// `CYC`: to the label RCYCLE (CMD-RS-05).
    Cycle,
    /// `SIG`: output signals (CMD-RS-07).
    Signal,
    /// `SEL`: the selection of the execution file (CMD-RS-09).
    Select,
}

impl Reset {
    /// All resets, in the order of Table 5.1.
    pub const ALL: [Reset; 5] = [
        Reset::Program,
        Reset::Step,
        Reset::Cycle,
        Reset::Signal,
        Reset::Select,
    ];

    /// The operand.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Reset::Program => "PRG",
            Reset::Step => "STP",
            Reset::Cycle => "CYC",
            Reset::Signal => "SIG",
            Reset::Select => "SEL",
        }
    }
}

pub(super) fn rs(operands: Operands<'_>) -> Result<Command, CommandError> {
    operands.read("PRG, STP, CYC, SIG or SEL", word).map(Command::Rs)
}

fn word(input: &str) -> Read<'_, Reset> {
    let known = |word: &str| {
        Reset::ALL
            .into_iter()
            .find(|reset| reset.word().eq_ignore_ascii_case(word))
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
    fn five_resets_in_any_case() {
        for reset in Reset::ALL {
            for form in ["RS,", "RS, ", "rs,"] {
                let message = format!("{form}{}", reset.word());
                assert_eq!(Command::parse(message.as_bytes()), Ok(Command::Rs(reset)));
                assert_eq!(
                    Command::parse(message.to_ascii_lowercase().as_bytes()),
                    Ok(Command::Rs(reset))
                );
            }
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
            "RS,ERR",
        ] {
            assert!(matches!(
                Command::parse(message.as_bytes()),
                Err(CommandError::Malformed { letters: "RS", .. })
            ));
        }
        let error = Command::parse(b"RS,ABC").map_err(|error| error.to_string());
        assert_eq!(
            error,
            Err("RS: PRG, STP, CYC, SIG or SEL expected, \"ABC\" found at byte 3".to_string())
        );
        let error = Command::parse(b"RSPRG").map_err(|error| error.to_string());
        assert_eq!(
            error,
            Err("RS: a comma after the letters expected, \"PRG\" found at byte 2".to_string())
        );
    }
}
