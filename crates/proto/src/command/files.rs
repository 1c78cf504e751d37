//! SL, UL, DL, ER: one file name as operand. FL: the content of a file, taken as it is.
//!
//! Whether the file exists is the controller's to check. The spelling of names is in [`crate::name`].

use crate::command::CommandError;
use crate::command::operand::Operands;
use crate::name::FileName;

const NAME: &str =
    "a file name (a letter, then letters and digits, optionally a dot and an extension, at most 12 in all)";

pub(super) fn name(operands: Operands<'_>) -> Result<FileName, CommandError> {
    let text = operands.text(NAME)?;
    let start = operands.len() - text.len();
    FileName::parse(text.trim_end_matches(' ')).map_err(|_| operands.malformed(NAME, start))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Command;
    use alloc::format;

    const WITH_NAME: [&str; 4] = ["SL", "UL", "DL", "ER"];

    // clause: CMD-SL-01 CMD-UL-01 CMD-DL-01 CMD-ER-01 FRM-08 FRM-13
    #[test]
    fn a_name_in_any_case_with_or_without_a_blank() {
        for letters in WITH_NAME {
            for message in [
                format!("{letters},TEST.PAR"),
                format!("{letters}, test.par "),
                format!("{letters},Test.Par"),
            ] {
                let command = Command::parse(message.as_bytes());
                assert_eq!(command.as_ref().map(Command::letters), Ok(letters), "{message}");
                assert_eq!(
                    command.map(|command| command.encode()),
                    Ok(format!("{letters},TEST.PAR\r").into_bytes())
                );
            }
        }
    }

    // clause: CMD-DL-08 FRM-18 FRM-07
    #[test]
    fn bad_names_are_malformed() {
        for letters in WITH_NAME {
            for rest in [
                "",
                ",",
                ", ",
                ",1ABC",
                ",ABCDEFGHIJKLM",
                ",A B",
                ",A.B.C",
                ",A.",
                ",A_B",
                ",A\t",
                ",\u{e9}",
                "TEST",
                " TEST",
            ] {
                let message = format!("{letters}{rest}");
                let error = Command::parse(message.as_bytes());
                assert!(
                    matches!(error, Err(CommandError::Malformed { .. })),
                    "{message}: {error:?}"
                );
            }
        }
        let error = Command::parse(b"SL,A_B").map_err(|error| format!("{error}"));
        let expected = format!("SL: expected {NAME}, found \"A_B\" at byte 3");
        assert_eq!(error, Err(expected));
    }

    // clause: FL-01
    #[test]
    fn file_content_is_taken_as_it_is() {
        let content = b" PROGRAM A\rEND\x00\xff\x1a";
        let message = [b"FL,".as_slice(), content].concat();
        assert_eq!(Command::parse(&message), Ok(Command::Fl(content.to_vec())));
        assert_eq!(Command::Fl(content.to_vec()).encode(), message);
        assert_eq!(Command::parse(b"FL,"), Ok(Command::Fl([].to_vec())));
        assert!(Command::parse(b"FL").is_err());
    }
}
