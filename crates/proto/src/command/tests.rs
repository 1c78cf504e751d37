//! Tests that walk Table 5.1 and the extensions, so that every command is held to the same rules.

use super::*;
use crate::text::MAX_DATA;
use alloc::format;
use alloc::string::ToString;
use std::collections::BTreeSet;

fn rows(extensions: bool) -> Vec<&'static CommandRow> {
    let rows = COMMANDS.iter();
    rows.filter(|row| row.is_extension() == extensions).collect()
}

fn parsed(row: &CommandRow) -> Command {
    Command::parse(row.example.as_bytes()).unwrap()
}

// clause: CMD-LST-01
#[test]
fn the_table_has_the_23_commands_of_the_manual() {
    let letters: Vec<&str> = rows(false).iter().map(|row| row.letters).collect();
    let manual = "RN SP BR SO RS SL UL DL CA SU EU ER FL OK NG EC MW FD SF MR IW VR DO";
    assert_eq!(letters.join(" "), manual);
    assert_eq!(letters.iter().collect::<BTreeSet<_>>().len(), 23);
}

#[test]
fn every_row_states_its_facts() {
    let names: BTreeSet<&str> = COMMANDS.iter().map(|row| row.name).collect();
    assert_eq!(names.len(), COMMANDS.len(), "each name once");
    for row in COMMANDS {
        assert!(
            row.form.starts_with(row.name) || row.name == row.letters && row.form.starts_with(row.letters)
        );
        assert!(row.example.starts_with(row.name) && row.name.starts_with(row.letters));
        assert!(!row.help.is_empty() && row.letters.len() == 2);
        let command = parsed(row);
        assert_eq!(command.row().name, row.name, "the example is one of this row");
        assert_eq!(command.permission_row(), row.name);
        assert_eq!(command.is_extension(), row.is_extension());
    }
}

#[test]
fn the_extensions_follow_the_manual() {
    let names: Vec<&str> = rows(true).iter().map(|row| row.name).collect();
    let all = "SM WD AC AH IO HI HO PR VL ZS MD RT SC JG MP PS MN RM ZC EM RS,ERR";
    assert_eq!(names.join(" "), all);
    assert!(rows(true).iter().all(|row| row.sender == Sender::Host));
    let boundary = COMMANDS.iter().position(CommandRow::is_extension);
    assert_eq!(boundary, Some(rows(false).len()));
}

#[test]
fn operands_are_separated_by_blanks_where_the_form_has_them() {
    let rows = COMMANDS.iter().filter(|row| row.separates_by_blanks());
    let names: Vec<&str> = rows.map(|row| row.name).collect();
    assert_eq!(names.join(" "), "EC MW MR IW WD HI HO ZS JG MP");
}

// clause: CMD-LST-02 CMD-SP-06
#[test]
fn the_controller_sends_four_of_them() {
    let both: Vec<&str> = COMMANDS
        .iter()
        .filter(|row| row.sender == Sender::Both)
        .map(|row| row.letters)
        .collect();
    assert_eq!(both, ["SP", "FL", "OK", "NG"]);
}

// clause: FRM-06 FRM-07 FRM-09 CMD-OK-01 CMD-NG-01
#[test]
fn every_example_is_read_and_written_back() {
    for row in COMMANDS {
        let command = parsed(row);
        assert_eq!(command.letters(), row.letters);
        let ending = if row.letters == "FL" { "" } else { "\r" };
        assert_eq!(command.encode(), format!("{}{ending}", row.example).into_bytes());
    }
    assert_eq!(Command::Ok.encode(), b"OK\r");
    assert_eq!(Command::Ng.encode(), b"NG\r");
}

// clause: FRM-13
#[test]
fn case_does_not_matter() {
    for row in COMMANDS.iter().filter(|row| !matches!(row.letters, "FL" | "DO")) {
        let lower = row.example.to_ascii_lowercase();
        assert_eq!(Command::parse(lower.as_bytes()), Ok(parsed(row)), "{lower}");
    }
    assert_eq!(Command::parse(b"fl,a"), Ok(Command::Fl(b"a".to_vec())));
    assert_eq!(
        Command::parse(b"do,move a1"),
        Ok(Command::Do("move a1".to_string()))
    );
}

// clause: FRM-08
#[test]
fn blanks_after_the_comma_are_skipped() {
    for row in COMMANDS
        .iter()
        .filter(|row| row.letters != "FL" && row.example.contains(','))
    {
        let (letters, operands) = row.example.split_once(',').unwrap();
        let message = format!("{letters},  {operands}");
        assert_eq!(Command::parse(message.as_bytes()), Ok(parsed(row)), "{message}");
    }
}

// clause: FRM-18
#[test]
fn blanks_at_the_end_are_skipped_whatever_the_command() {
    // The content of a file and a statement are kept as they came.
    let skips = |row: &&CommandRow| !matches!(row.letters, "FL" | "DO");
    for row in COMMANDS.iter().filter(skips) {
        for blanks in [" ", "  ", "     "] {
            let message = format!("{}{blanks}", row.example);
            assert_eq!(Command::parse(message.as_bytes()), Ok(parsed(row)), "{message:?}");
        }
    }
    let statement = Command::Do("MOVE A1 ".to_string());
    assert_eq!(Command::parse(b"DO,MOVE A1 "), Ok(statement));
    assert_eq!(Command::parse(b"FL,END "), Ok(Command::Fl(b"END ".to_vec())));
    // Blanks do not stand for what is missing.
    for message in [
        "MW,0 A 0 ",
        "IW,3 1 4 ",
        "ZS,1 WK1 ",
        "SL,1A ",
        "EC,MODE ",
        "JG,1 ",
    ] {
        assert!(Command::parse(message.as_bytes()).is_err(), "{message:?}");
    }
}

// clause: FRM-18
#[test]
fn missing_and_surplus_operands_are_malformed() {
    for row in COMMANDS {
        let has_operand = row.example.contains(',');
        let bare = Command::parse(row.letters.as_bytes());
        assert_eq!(bare.is_err(), has_operand, "{}", row.letters);
        let surplus: &[&str] = if has_operand {
            &[]
        } else {
            &[",", ",X", "X", " X", ", "]
        };
        for rest in surplus {
            let message = format!("{}{rest}", row.letters);
            let error = Command::parse(message.as_bytes());
            assert!(
                matches!(error, Err(CommandError::Malformed { at: 2, .. })),
                "{message}: {error:?}"
            );
        }
        if !matches!(row.letters, "DO" | "FL" | "MW") && has_operand {
            let message = format!("{} 77", row.example);
            let error = Command::parse(message.as_bytes());
            assert!(
                matches!(error, Err(CommandError::Malformed { .. })),
                "{message}: {error:?}"
            );
        }
    }
}

// clause: FRM-06 CMD-LST-04 CMD-LST-05
#[test]
fn other_letters_are_unknown() {
    for message in [
        b"".as_slice(),
        b"S",
        b"S1",
        b"QQ",
        b"S",
        b"1SU",
        b" SU",
        b",SU",
        b"\xff\xfe",
        b"\0",
    ] {
        assert!(
            matches!(Command::parse(message), Err(CommandError::Unknown { .. })),
            "{message:02X?}"
        );
    }
    let error = Command::parse(b"QQ,1").map_err(|error| error.to_string());
    assert_eq!(error, Err("unknown command \"QQ\"".to_string()));
}

// clause: FRM-12 FRM-11
#[test]
fn only_printable_ascii_stands_in_operands() {
    for row in COMMANDS
        .iter()
        .filter(|row| row.letters != "FL" && row.example.contains(','))
    {
        for byte in (0..0x20).chain(0x7F..=0xFF) {
            for at in 3..=row.example.len() {
                let (front, back) = row.example.as_bytes().split_at(at);
                let message = [front, &[byte], back].concat();
                let error = Command::parse(&message);
                assert!(
                    matches!(error, Err(CommandError::Malformed { at: found, .. }) if found == at),
                    "{error:?}"
                );
            }
        }
    }
}

#[test]
fn every_truncation_and_every_changed_byte_is_survived() {
    for row in COMMANDS {
        let example = row.example.as_bytes();
        for length in 0..example.len() {
            // What it reads as does not matter; that it does not panic and can be said again does.
            check(&example[..length]);
        }
        for at in 0..example.len() {
            for byte in 0..=u8::MAX {
                let mut message = example.to_vec();
                message[at] = byte;
                check(&message);
            }
        }
    }
}

/// A message that reads as a command reads as the same command after it is written again.
fn check(message: &[u8]) {
    match Command::parse(message) {
        Ok(command) => {
            let data = command.encode();
            let again = data
                .strip_suffix(b"\r")
                .filter(|_| command.letters() != "FL")
                .unwrap_or(&data);
            assert_eq!(Command::parse(again), Ok(command), "{message:02X?}");
        }
        Err(CommandError::Malformed {
            expected, found, at, ..
        }) => {
            assert!(
                !expected.is_empty() && !found.is_empty() && at <= message.len(),
                "{message:02X?}"
            );
        }
        Err(CommandError::Unknown { .. }) => {}
    }
}

#[test]
fn errors_show_little_and_printable() {
    let long = [b"SL,".as_slice(), &[b'9'; 5000]].concat();
    let shown = Command::parse(&long).map_err(|error| error.to_string());
    assert!(shown.is_err_and(|text| text.len() < MAX_DATA && text.ends_with("...\" at byte 3")));
    assert_eq!(excerpt(b"\x02\xff\r"), "\\x02\\xff\\r");
}

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
