//! Splits a text of a host into named fields with their bytes: framing, the letters of the command, each operand, and
//! what is wrong where the text does not parse.
//!
//! It serves people who read traffic, so it never fails. Names come from the table of commands, errors from the parser
//! that the controller uses; a program that needs values uses [`Command::parse`]. Texts of the controller are
//! [`crate::dissect`]'s.

use crate::command::{Command, CommandError, CommandRow};
use crate::dissect::{DissectedField, FL, Fields, framed};
use crate::prelude::*;
use crate::status::fields::Field;
use crate::text::{CR, MAX_DATA};
use core::ops::Range;

/// Letters of a command.
const LETTERS: usize = 2;
/// Operands that become fields of their own; one further field has the rest.
const MAX_OPERANDS: usize = 128;
/// The key of an error.
const ERROR: &str = "error";

/// The fields of one text of a host as it was on the wire, framing included. `is_content` says that it is a further text
/// of a file: it has no command.
pub fn dissect_command(wire: &[u8], is_content: bool) -> Vec<DissectedField> {
    let mut fields = framed(wire, |fields, data| {
        let (begin, _) = data.split_at(FL.len());
        let is_file = begin.bytes().eq_ignore_ascii_case(FL);
        match is_file || is_content {
            true => fields.reply("", data),
            false => fields.message(data),
        }
        if let Some(row) = CommandRow::of_letters(b"FL").filter(|_| is_file) {
            fields.letters(row, data.split_at(LETTERS).0);
        }
        if data.range().end == wire.len() {
            fields.error(data.range().end..wire.len(), "the text has no ETX".to_string());
        }
        let length = data.bytes().len();
        if length > MAX_DATA {
            let words = format!("the text has {length} bytes of data; at most {MAX_DATA} are allowed");
            fields.error(data.split_at(MAX_DATA).1.range(), words);
        }
    });
    fields.0.sort_by_key(|field| (field.range.start, field.range.end));
    fields.0
}

impl Fields {
    fn error(&mut self, range: Range<usize>, words: String) {
        self.add(ERROR, "what is wrong", range, words);
    }

    /// A data section without ETX.
    fn message(&mut self, data: Field<'_>) {
        let length = data.bytes().len() - usize::from(data.bytes().last() == Some(&CR));
        let (message, cr) = data.split_at(length);
        let parsed = Command::parse(message.bytes());
        let (letters, operands) = message.split_at(LETTERS);
        let row = parsed.as_ref().ok().map(Command::row);
        if let Some(row) = row.or_else(|| CommandRow::of_letters(letters.bytes())) {
            self.letters(row, letters);
            self.operands(row, operands);
        } else {
            self.quote("command", "command", letters);
            self.rest("rest", operands);
        }
        if !cr.bytes().is_empty() {
            self.add("text.cr", "CR", cr.range(), "there".to_string());
        } else if length == MAX_DATA {
            let name = "part of a longer message";
            return self.add("text.part", name, cr.range(), "no CR".to_string());
        } else {
            self.error(cr.range(), "expected CR before ETX".to_string());
        }
        match parsed {
            Ok(_) => {}
            Err(error @ CommandError::Unknown { .. }) => self.error(letters.range(), error.to_string()),
            Err(CommandError::Malformed {
                expected, found, at, ..
            }) => {
                let words = format!("expected {expected}, found {found}");
                self.error(message.split_at(at).1.range(), words);
            }
        }
    }

    fn letters(&mut self, row: &CommandRow, letters: Field<'_>) {
        let value = format!("{}: {}", row.name, row.help);
        self.add("command", "command", letters.range(), value);
    }

    /// Operands of this command.
    fn operands(&mut self, row: &CommandRow, after_letters: Field<'_>) {
        let [b',', list @ ..] = after_letters.bytes() else {
            let length = after_letters.bytes().trim_ascii_end().len();
            return self.rest("rest", after_letters.split_at(length).0);
        };
        let (_, operands) = after_letters.split_at(1);
        let key = row.letters.to_ascii_lowercase();
        let tokens = match row.operands {
            // A statement, a name: what is in it does not separate.
            [_] => whole(list),
            _ => split(list),
        };
        for (index, range) in tokens.into_iter().enumerate() {
            let (_, rest) = operands.split_at(range.start);
            let (token, _) = rest.split_at(range.len());
            match row.operand_name(index).filter(|_| index < MAX_OPERANDS) {
                Some((name, None)) => self.quote(operand_key(&key, name), name, token),
                Some((name, Some(number))) => {
                    let key = format!("{}.{number}", operand_key(&key, name));
                    self.quote(key, format!("{name} {number}"), token);
                }
                None => return self.rest("rest", rest),
            }
        }
    }
}

fn operand_key(command: &str, name: &str) -> String {
    format!("{command}.{}", name.replace(' ', "-"))
}

/// The operand that is all there is, without blanks around it.
fn whole(operands: &[u8]) -> Vec<Range<usize>> {
    let start = operands.len() - operands.trim_ascii_start().len();
    let end = operands.trim_ascii_end().len();
    let range = (start < end).then_some(start..end);
    range.into_iter().collect()
}

/// The operands between blanks or commas; those within parentheses are subscripts and do not separate.
fn split(operands: &[u8]) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let (mut begin, mut depth) = (None, 0_usize);
    for (at, byte) in operands.iter().enumerate() {
        match byte {
            b'(' => depth += 1,
            b')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth == 0 && matches!(byte, b' ' | b',') {
            found.extend(begin.take().map(|begin| begin..at));
        } else {
            begin = begin.or(Some(at));
        }
    }
    found.extend(begin.map(|begin| begin..operands.len()));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::COMMANDS;
    use crate::text::ETX;
    use alloc::vec;

    fn shown(wire: &[u8]) -> Vec<(String, String)> {
        let fields = dissect_command(wire, false).into_iter();
        let shown = fields.filter(|field| !field.key.starts_with("text."));
        shown
            .map(|field| {
                let bytes = field.range.start..field.range.end;
                assert!(wire.get(bytes).is_some(), "{field:?}");
                (field.key, field.value)
            })
            .collect()
    }

    fn pair(key: &str, value: &str) -> (String, String) {
        (key.to_string(), value.to_string())
    }

    #[test]
    fn every_example_is_split_into_named_operands_without_an_error() {
        for row in COMMANDS {
            let wire = [b"\x02", row.example.as_bytes(), b"\r\x03"].concat();
            let found = shown(&wire);
            assert!(
                found.iter().all(|(key, _)| key != ERROR && key != "rest"),
                "{found:?}"
            );
            let has_operands = row.example.contains(',');
            assert_eq!(has_operands, !row.operands.is_empty(), "{}", row.name);
            assert_eq!(found.len() > 1, has_operands, "{found:?}");
        }
    }

    #[test]
    fn operands_have_their_names_and_their_bytes() {
        let wire = b"\x02MW,0 TBL(1,3) 5 1.5 -2\r\x03";
        assert_eq!(
            shown(wire)[1..],
            [
                pair("mw.write-into-the-file", "`0`"),
                pair("mw.variable", "`TBL(1,3)`"),
                pair("mw.type", "`5`"),
                pair("mw.value.1", "`1.5`"),
                pair("mw.value.2", "`-2`"),
            ]
        );
        let fields = dissect_command(wire, false);
        let variable = fields.iter().find(|field| field.key == "mw.variable").unwrap();
        assert_eq!(
            (variable.name.as_str(), variable.range.clone()),
            ("variable", 6..14)
        );
        let keys: Vec<String> = fields.into_iter().map(|field| field.key).collect();
        assert_eq!(
            (keys[0].as_str(), keys[keys.len() - 2].as_str()),
            ("text.stx", "text.cr")
        );
        assert_eq!(
            shown(b"iw,3 1, 4 0\r\x03")[1..],
            [
                pair("iw.line.1", "`3`"),
                pair("iw.state.1", "`1`"),
                pair("iw.line.2", "`4`"),
                pair("iw.state.2", "`0`"),
            ]
        );
        assert_eq!(
            shown(b"\x02DO, MOVE A1 WITH SPEED=50\r\x03")[1],
            pair("do.statement", "`MOVE A1 WITH SPEED=50`")
        );
        assert_eq!(
            shown(b"\x02RS,ERR\r\x03")[0],
            pair("command", "RS,ERR: reset of alarms")
        );
    }

    #[test]
    fn what_is_wrong_is_said_where_it_is() {
        let wrong = |wire: &[u8]| {
            let fields = dissect_command(wire, false).into_iter();
            let errors = fields.filter(|field| field.key == ERROR);
            errors.map(|field| (field.range, field.value)).collect::<Vec<_>>()
        };
        assert_eq!(wrong(b"\x02SU\r\x03"), []);
        assert_eq!(
            wrong(b"\x02XY,1\r\x03"),
            [(1..3, "unknown command \"XY\"".to_string())]
        );
        assert_eq!(
            wrong(b"\x02IW,3 2\r\x03"),
            [(6..7, "expected 0 or 1, found \"2\"".to_string())]
        );
        assert_eq!(wrong(b"\x02SL\r\x03").len(), 1);
        assert_eq!(
            wrong(b"\x02SU\x03"),
            [(3..3, "expected CR before ETX".to_string())]
        );
        assert_eq!(wrong(b"\x02SU\r"), [(4..4, "the text has no ETX".to_string())]);
        let long = [vec![b'A'; MAX_DATA], b"\r\x03".to_vec()].concat();
        assert!(
            wrong(&long)
                .iter()
                .any(|(range, _)| *range == (MAX_DATA..MAX_DATA + 1))
        );
        let part = [b"\x02DO,".to_vec(), vec![b'A'; MAX_DATA - 3], vec![ETX]].concat();
        assert_eq!(wrong(&part), []);
        assert!(!wrong(b"").is_empty() && !wrong(b"\x02\x03").is_empty());
    }

    #[test]
    fn the_texts_of_a_file_are_its_lines() {
        let found = shown(b"\x02FL,PROGRAM A\nEND\n\x1a\x03");
        assert_eq!(found[0], pair("command", "FL: Content of a file"));
        assert_eq!(found[1], pair("file.1", "`PROGRAM A\\n`"));
        let further = dissect_command(b"\x02END\n\x1a\x03", true);
        assert_eq!(further[1].key, "text.data");
    }
}
