//! Splits a text of the controller into named fields with their bytes, as a protocol analyser does: the fields of
//! SF, the items of SU and SM, the records of EU, VR, CA and the alarm lists, the words of IO, the lines of a file.
//!
//! It serves people who compare two answers, so it never fails: bytes that fit no field become one field of their own.
//! Programs that need values use the decoders in [`crate::status`]. The layout of SF is in
//! [`crate::status::sf::table`].

use crate::prelude::*;
use crate::reply::Reply;
use crate::status::fields::Field;
use crate::status::io;
use crate::status::sf::SfLayout;
use crate::status::sf::table::{SfFieldKind, sf_fields};
use crate::text::{CR, EOF, ETX, LF, STX};
use core::ops::Range;

/// Bytes of a field that `value` quotes; the rest is cut.
const MAX_SHOWN: usize = 256;
/// Fields of one content; one further field covers the rest.
const MAX_FIELDS: usize = 4_096;
/// Letters in front of an item of SM.
const LABEL: usize = 2;
/// The first bytes of the first text of a file.
pub(crate) const FL: &[u8] = b"FL,";

/// A field of an answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DissectedField {
    /// Stable name with dots, beginning with the command in lower case: `sf.servo`, `su.status`, `ca.TEST`.
    pub key: String,
    /// Description for people.
    pub name: String,
    /// Its bytes in the text that was dissected.
    pub range: Range<usize>,
    /// The value in words, or the bytes in backquotes.
    pub value: String,
}

/// The fields of one text as it was on the wire, framing included. `letters` is the command it answers; empty if
/// unknown.
pub fn dissect(letters: &str, wire: &[u8]) -> Vec<DissectedField> {
    framed(wire, |fields, data| fields.reply(letters, data)).0
}

/// Where the data section of a text lies: up to its ETX, which a checksum may follow, or up to the end.
pub(crate) fn data_section(wire: &[u8]) -> Range<usize> {
    let start = usize::from(wire.first() == Some(&STX));
    match wire.iter().rposition(|byte| *byte == ETX) {
        Some(end) if end >= start && end + 2 >= wire.len() => start..end,
        _ => start..wire.len(),
    }
}

/// The framing of a text, and the fields that `content` finds in its data section.
pub(crate) fn framed(wire: &[u8], content: impl FnOnce(&mut Fields, Field<'_>)) -> Fields {
    let mut fields = Fields(Vec::new());
    let Range { start, end } = data_section(wire);
    let (before_etx, etx) = Field::whole("", wire).split_at(end);
    let (stx, data) = before_etx.split_at(start);
    if !stx.bytes().is_empty() {
        fields.add("text.stx", "STX", stx.range(), "there".to_string());
    }
    content(&mut fields, data);
    if !etx.bytes().is_empty() {
        fields.quote("text.etx", "ETX", etx);
    }
    fields
}

/// Length in bytes, from STX through ETX, of the text at the start of `wire`, which answers the command `letters`;
/// `None` if more bytes are needed. The binary contents of SF and IO may contain ETX, so the lengths they can have
/// are tried first (hosts SF).
pub fn text_length(letters: &str, wire: &[u8]) -> Option<usize> {
    let stx = usize::from(wire.first() == Some(&STX));
    let prefix = wire.get(stx..).unwrap_or_default();
    let first = wire.iter().position(|byte| *byte == ETX).map(|at| at + 1);
    let Some(forms) = forms(letters) else {
        return first;
    };
    let known = prefix.len().min(FL.len());
    if prefix.get(..known) != FL.get(..known) {
        return first;
    }
    let ends = forms.iter().find_map(|(content, ending)| {
        let from = stx + FL.len() + content;
        let end = from + ending.len();
        (wire.get(from..end) == Some(ending)).then_some(end)
    });
    let lengths = forms.iter().map(|(content, ending)| content + ending.len());
    let longest = lengths.max().map(|length| FL.len() + length);
    match ends {
        None if wire.len() < stx + longest.unwrap_or_default() => None,
        None => first,
        ends => ends,
    }
}

/// Length of a binary content, and what may follow it.
pub type Form = (usize, &'static [u8]);

/// SF: eight floats a group with EOF; six floats with nothing, where a text of 250 bytes is also the manual's first text of
/// several (SF-02), and one that ends EOF CR a recording of 248 bytes.
const SF_FORMS: &[Form] = &[
    (SfLayout::Eight.len(), &[EOF, ETX]),
    (SfLayout::Eight.len(), &[EOF, CR, ETX]),
    (SfLayout::Six.len(), &[ETX]),
    (SfLayout::Six.len() - 2, &[EOF, ETX]),
];
/// IO. Recordings that were made before it lost its EOF have one.
const IO_FORMS: &[Form] = &[
    (io::LENGTH, &[ETX]),
    (io::LENGTH, &[EOF, ETX]),
    (io::LENGTH, &[EOF, CR, ETX]),
];

/// The forms of the texts of a binary content; `None` if its first ETX ends a text.
pub fn forms(letters: &str) -> Option<&'static [Form]> {
    match letters {
        "SF" => Some(SF_FORMS),
        "IO" => Some(IO_FORMS),
        _ => None,
    }
}

/// Whether a content is items with a label each, in one record or in several.
pub fn is_in_items(letters: &str) -> bool {
    matches!(letters, "SU" | "SM")
}

/// The fields found so far.
pub(crate) struct Fields(pub(crate) Vec<DissectedField>);

impl Fields {
    pub(crate) fn add(
        &mut self,
        key: impl Into<String>,
        name: impl Into<String>,
        range: Range<usize>,
        value: String,
    ) {
        self.0.push(DissectedField {
            key: key.into(),
            name: name.into(),
            range,
            value,
        });
    }

    /// A field whose value is its bytes.
    pub(crate) fn quote(&mut self, key: impl Into<String>, name: impl Into<String>, part: Field<'_>) {
        self.add(key, name, part.range(), quoted(part.bytes()));
    }

    /// The data section of a text of the controller.
    pub(crate) fn reply(&mut self, letters: &str, data: Field<'_>) {
        match Reply::parse(data.bytes()) {
            Ok(Reply::Fl(_)) => self.file(letters, data),
            Ok(_) => self.quote("reply", "reply", data),
            Err(_) => self.quote("text.data", "data", data),
        }
    }

    /// A data section that begins with `FL,`.
    fn file(&mut self, letters: &str, data: Field<'_>) {
        let (_, rest) = data.split_at(FL.len());
        let body = rest.bytes().strip_suffix(&[CR]).unwrap_or(rest.bytes());
        let length = match body.strip_suffix(&[EOF]) {
            // The last byte of its last word may equal EOF, so only the length tells the end.
            _ if letters == "IO" && rest.bytes().len() >= io::LENGTH => io::LENGTH,
            content => content.unwrap_or(rest.bytes()).len(),
        };
        let (content, tail) = rest.split_at(length);
        let key = letters.to_ascii_lowercase();
        match letters {
            "SF" => self.system_status(content),
            "IO" => self.words(content),
            _ if is_in_items(letters) => self.items(&key, content),
            "" => self.lines("file", "line", content),
            "UL" => self.lines("ul", "line", content),
            _ => self.lines(&key, "record", content),
        }
        self.quote("text.end", "end of the file", tail);
    }

    fn system_status(&mut self, content: Field<'_>) {
        let layout = match content.bytes().len() <= SfLayout::Six.len() {
            true => SfLayout::Six,
            false => SfLayout::Eight,
        };
        let mut rest = content;
        for field in sf_fields(layout) {
            let Some((part, after)) = rest.cut(field.size) else {
                break;
            };
            let value = field.kind.describe(part.bytes());
            self.add(format!("sf.{}", field.key), field.name, part.range(), value);
            rest = after;
        }
        self.rest("sf.rest", rest);
    }

    fn words(&mut self, content: Field<'_>) {
        let mut rest = content;
        for index in 0..2 * io::WORDS {
            let Some((pair, after)) = rest.cut(2) else { break };
            let direction = if index < io::WORDS { "input" } else { "output" };
            let number = index % io::WORDS + 1;
            let key = format!("io.{direction}.{number}");
            let value = SfFieldKind::Lines("bit ", 0).describe(pair.bytes());
            self.add(key, format!("{direction} word {number}"), pair.range(), value);
            rest = after;
        }
        self.rest("io.rest", rest);
    }

    /// The items of SU and SM: records if there is a CR, otherwise words between blanks.
    fn items(&mut self, key: &str, content: Field<'_>) {
        let separator = if content.bytes().contains(&CR) { CR } else { b' ' };
        for (index, item) in content.split(separator).enumerate() {
            let bytes = item.bytes();
            let colon = bytes.iter().position(|byte| *byte == b':');
            let length = colon.or((key == "sm").then_some(LABEL));
            let label = match length.and_then(|length| bytes.get(..length)) {
                None | Some([]) => (index + 1).to_string(),
                Some(label) => String::from_utf8_lossy(label).into_owned(),
            };
            if !(bytes.is_empty() && item.range().end == content.range().end) {
                let name = format!("{} {label}", key.to_ascii_uppercase());
                self.quote(format!("{key}.{}", label.to_ascii_lowercase()), name, item);
            }
        }
    }

    /// Lines or records by their number; files of CA by their name.
    fn lines(&mut self, key: &str, word: &str, content: Field<'_>) {
        let mut rest = content;
        let mut number = 0;
        while !rest.bytes().is_empty() && number < MAX_FIELDS {
            number += 1;
            let end = rest.bytes().iter().position(|byte| matches!(*byte, CR | LF));
            let end = end.unwrap_or(rest.bytes().len());
            let (line, _) = rest.split_at(end);
            let (whole, after) = rest.split_at(end + 1);
            rest = after;
            let file = line.split(b' ').next().unwrap_or(line);
            let name = match key {
                "ca" => String::from_utf8_lossy(file.bytes()).into_owned(),
                _ => number.to_string(),
            };
            match key {
                "eu" if number > 1 => self.entry(number - 1, line.bytes(), whole),
                "ac" | "ah" => self.alarm(key, number, whole),
                "eu" => self.quote("eu.count", "number of entries", whole),
                _ => self.quote(format!("{key}.{name}"), format!("{word} {name}"), whole),
            }
        }
        self.rest(&format!("{key}.rest"), rest);
    }

    /// A record of AC or AH: number, message and date of an alarm; the first record begins with the count.
    fn alarm(&mut self, key: &str, number: usize, record: Field<'_>) {
        let names = ["count", "alarm", "message", "date"].into_iter();
        let mut names = names.skip(usize::from(number > 1));
        let mut rest = record;
        for item in record.bytes().split_inclusive(|byte| *byte == b',') {
            let name = names.next().unwrap_or("surplus");
            let key = match name {
                "count" => format!("{key}.count"),
                _ => format!("{key}.{number}.{name}"),
            };
            let (part, after) = rest.split_at(item.len());
            self.quote(key, format!("alarm {number}, {name}"), part);
            rest = after;
        }
    }

    /// An entry of EU, `whole` with its line end: its alarm and its date.
    fn entry(&mut self, number: usize, line: &[u8], whole: Field<'_>) {
        let blank = line.iter().position(|byte| *byte == b' ').unwrap_or(line.len());
        let (alarm, rest) = whole.split_at(blank);
        let date = line.get(blank..).unwrap_or_default();
        let date = date.strip_prefix(b" ").unwrap_or(date);
        for (name, part, bytes) in [("alarm", alarm, alarm.bytes()), ("date", rest, date)] {
            let key = format!("eu.{number}.{name}");
            self.add(
                key,
                format!("entry {number}, {name}"),
                part.range(),
                quoted(bytes),
            );
        }
    }

    /// Bytes that fit no field, if any are left.
    pub(crate) fn rest(&mut self, key: &str, rest: Field<'_>) {
        if !rest.bytes().is_empty() {
            self.quote(key, "the rest", rest);
        }
    }
}

pub(crate) fn quoted(bytes: &[u8]) -> String {
    let cut = bytes.get(..MAX_SHOWN).unwrap_or(bytes);
    let more = if cut.len() < bytes.len() { "..." } else { "" };
    format!("`{}`{more}", cut.escape_ascii())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::sf::SystemStatus;
    use crate::text::encode_text;
    use crate::text::{Checksum, Framing};
    use alloc::vec;

    fn file(content: &[u8], ending: &[u8], framing: Framing) -> Vec<u8> {
        encode_text(&[FL, content, ending].concat(), framing, Checksum::None)
    }

    fn values(letters: &str, wire: &[u8]) -> Vec<(String, String)> {
        dissect(letters, wire)
            .into_iter()
            .map(|part| (part.key, part.value))
            .collect()
    }

    #[test]
    fn parts_cover_the_text_without_overlap() {
        let contents: [(&str, Vec<u8>); 9] = [
            (
                "AC",
                b"2,2-046,OUT OF REACH,2014-02-06 00:00:01\r8-201,STOP,2014-02-06 00:00:00\r".to_vec(),
            ),
            ("SF", SystemStatus::default().encode(SfLayout::Eight)),
            (
                "SU",
                b"MODE:external(ethernet)/cycle FILE:TEST OVRD:100% LSPEED:100% MACHINE:free STATUS:running"
                    .to_vec(),
            ),
            (
                "EU",
                b"2\r002-046 14-02-06 00:00:01\r008-201 14-02-06 00:00:00\r".to_vec(),
            ),
            ("CA", b"TEST 19\rUSER.PAR 6\r".to_vec()),
            ("UL", b"PROGRAM A\nEND\n".to_vec()),
            ("IO", vec![EOF; io::LENGTH]),
            ("XX", b"anything".to_vec()),
            ("", b"".to_vec()),
        ];
        for (letters, content) in contents {
            for framing in [Framing::Stx, Framing::Bare] {
                let wire = file(&content, &[EOF], framing);
                let mut covered = vec![0; wire.len()];
                for part in dissect(letters, &wire) {
                    covered[part.range].iter_mut().for_each(|count| *count += 1);
                }
                let blanks_and_prefix = covered.iter().filter(|count| **count == 0).count();
                let separators = if letters == "SU" { 5 } else { 0 };
                assert_eq!(blanks_and_prefix, FL.len() + separators, "{letters}");
                assert!(covered.iter().all(|count| *count <= 1), "{letters}");
            }
        }
    }

    #[test]
    fn items_records_and_files_have_their_names() {
        let su = file(b"MODE:teaching/cycle FILE:T OVRD:50%", &[EOF], Framing::Stx);
        let found = values("SU", &su);
        assert!(
            found.contains(&("su.ovrd".to_string(), "`OVRD:50%`".to_string())),
            "{found:?}"
        );
        let su = file(
            b"MODE:teaching/cycle\rFILE:T\rOVRD:50%\r\rMACHINE:free\r",
            &[EOF],
            Framing::Bare,
        );
        let found = values("SU", &su);
        assert!(
            found.contains(&("su.machine".to_string(), "`MACHINE:free`".to_string())),
            "{found:?}"
        );
        let eu = file(b"1\r002-046 14-02-06 00:00:01\r", &[EOF], Framing::Stx);
        let found = values("EU", &eu);
        assert!(
            found.contains(&("eu.count".to_string(), "`1\\r`".to_string())),
            "{found:?}"
        );
        assert!(
            found.contains(&("eu.1.date".to_string(), "`14-02-06 00:00:01`".to_string())),
            "{found:?}"
        );
        assert!(
            found.contains(&("eu.1.alarm".to_string(), "`002-046`".to_string())),
            "{found:?}"
        );
        let ac = file(b"1,2-046,OUT,2014-02-06 00:00:01\r", &[EOF], Framing::Stx);
        let found: Vec<String> = values("AC", &ac).into_iter().map(|(key, _)| key).collect();
        let keys = ["text.stx", "ac.count", "ac.1.alarm", "ac.1.message", "ac.1.date"];
        assert_eq!(found[..5], keys);
        let parts = ["`1,`", "`2-046,`", "`OUT,`", "`2014-02-06 00:00:01\\r`"];
        let found: Vec<String> = values("AC", &ac).into_iter().map(|(_, value)| value).collect();
        assert_eq!(found[1..5], parts);
        let ca = file(b"TEST 19\r", &[EOF], Framing::Stx);
        assert!(values("CA", &ca).contains(&("ca.TEST".to_string(), "`TEST 19\\r`".to_string())));
        assert_eq!(
            values("SO", b"\x02NG\r\x03")[1],
            ("reply".to_string(), "`NG\\r`".to_string())
        );
    }

    #[test]
    fn items_without_a_label_have_numbers() {
        let su = file(b"MODE:teaching/cycle FILE :50%", &[EOF], Framing::Bare);
        let found = values("SU", &su);
        let items: Vec<&str> = found.iter().map(|(key, _)| key.as_str()).collect();
        assert_eq!(items[..3], ["su.mode", "su.2", "su.3"]);
    }

    #[test]
    fn a_binary_text_of_no_known_form_ends_at_its_first_etx_once_none_can_come() {
        let longest = FL.len() + io::LENGTH + 3;
        for framing in [Framing::Stx, Framing::Bare] {
            let mut wire = file(&[0; io::LENGTH + 4], &[], framing);
            let start = usize::from(framing == Framing::Stx);
            let first = start + FL.len() + 10;
            wire[first - 1] = ETX;
            assert_eq!(text_length("IO", &wire[..start + longest - 1]), None);
            assert_eq!(text_length("IO", &wire[..start + longest]), Some(first));
        }
    }

    #[test]
    fn binary_texts_are_cut_by_length_and_others_by_etx() {
        let body = |layout: SfLayout| {
            let mut content = SystemStatus::default().encode(layout);
            content[52] = ETX;
            content[60] = EOF;
            content[61] = ETX;
            content
        };
        for framing in [Framing::Stx, Framing::Bare] {
            for (content, ending) in [
                (body(SfLayout::Eight), &[EOF][..]),
                (body(SfLayout::Six), &[]),
                (body(SfLayout::Six)[..248].to_vec(), &[EOF, CR]),
                (body(SfLayout::Six)[..248].to_vec(), &[EOF]),
            ] {
                let wire = file(&content, ending, framing);
                let followed = [wire.as_slice(), b"\x02SP\r\x03"].concat();
                assert_eq!(text_length("SF", &followed), Some(wire.len()));
                assert_eq!(text_length("SF", &wire), Some(wire.len()));
                assert_eq!(text_length("SF", &wire[..wire.len() - 1]), None);
            }
            for ending in [&[][..], &[EOF]] {
                let wire = file(&[ETX; io::LENGTH], ending, framing);
                assert_eq!(text_length("IO", &wire), Some(wire.len()));
                assert_eq!(text_length("IO", &wire[..50]), None);
            }
        }
        assert_eq!(text_length("SF", b"\x02NG\r\x03"), Some(5));
        assert_eq!(text_length("SO", b"OK\r\x03SP"), Some(4));
        assert_eq!(text_length("SO", b"\x02OK\r"), None);
        assert_eq!(text_length("SF", b""), None);
    }
}
