//! DO: one statement of the robot language, kept as it was received.
//!
//! The crate `scol-mini` compiles it, the controller executes it.

use crate::command::operand::Operands;
use crate::command::{Command, CommandError};
use alloc::string::String;

pub(super) fn statement(operands: Operands<'_>) -> Result<Command, CommandError> {
    operands
        .text("a statement")
        .map(|text| Command::Do(String::from(text)))
}

#[cfg(test)]
mod tests {
    use super::*;

    // clause: CMD-DO-01 FRM-12
    #[test]
    fn the_statement_is_kept_as_it_came() {
        for statement in [
            "MOVE A1",
            "MOVE POINT (300,100.5,-20.123,45) WITH ACCEL=50, DECEL=60, SPEED=70",
            "move Point(1.000,2.000) with SPEED=1, ",
            "PAYLOAD={1.500,20.000}",
        ] {
            let message = [b"DO,", statement.as_bytes()].concat();
            assert_eq!(Command::parse(&message), Ok(Command::Do(String::from(statement))));
        }
        assert_eq!(
            Command::parse(b"do,  MOVE A1"),
            Ok(Command::Do(String::from("MOVE A1")))
        );
    }

    // clause: FRM-18 FRM-12
    #[test]
    fn nothing_or_control_codes_are_malformed() {
        for message in [
            b"DO".as_slice(),
            b"DO,",
            b"DO,  ",
            b"DO MOVE A1",
            b"DO,MOVE\tA1",
            b"DO,MOVE \x80",
            b"DO,A\rB",
        ] {
            assert!(matches!(
                Command::parse(message),
                Err(CommandError::Malformed { letters: "DO", .. })
            ));
        }
    }
}
