//! Splits a text of the controller into named fields with their bytes, as a protocol analyser does: the fields of
//! SF, the items of SU and SM, the records of EU, VR, CA and the alarm lists, the words of IO, the lines of a file.
//!
//! It serves people who compare two answers, so it never fails: bytes that fit no field become one field of their own.
//! Programs that need values use the decoders in [`crate::status`]. The layout of SF is in
//! [`crate::status::sf::table`].

use crate::prelude::*;
use crate::reply::Reply;
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
    framed(wire, |fields, data, start| fields.reply(letters, data, start)).0
}

/// Where the data section of a text lies: up to its ETX, which a checksum may follow, or up to the end.
pub(crate) fn data_section(wire: &[u8]) -> Range<usize> {
    let start = usize::from(wire.first() == Some(&STX));
    match wire.iter().rposition(|byte| *byte == ETX) {
        Some(end) if end >= start && end + 2 >= wire.len() => start..end,
        _ => start..wire.len(),
    }
}

/// The framing of a text, and what `content` finds in its data section, whose first byte it gets too.
pub(crate) fn framed(wire: &[u8], content: impl FnOnce(&mut Fields, &[u8], usize)) -> Fields {
    let data = data_section(wire);
    let mut fields = Fields(Vec::new());
    if data.start > 0 {
        fields.add("text.stx", "STX", 0..data.start, "there".to_string());
    }
    let bytes = wire.get(data.clone()).unwrap_or_default();
    content(&mut fields, bytes, data.start);
    if let Some(etx @ [_, ..]) = wire.get(data.end..) {
        fields.add("text.etx", "ETX", data.end..wire.len(), quoted(etx));
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
    let forms: &[(usize, &[u8])] = match letters {
        "SF" => SF_FORMS,
        "IO" => IO_FORMS,
        _ => return first,
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

/// Lengths of the content of SF, and what may follow each: eight floats a group with EOF; six floats with nothing,
/// where a text of 250 bytes is also the manual's first text of several (SF-02), and one that ends EOF CR a recording
/// of 248 bytes.
const SF_FORMS: &[(usize, &[u8])] = &[
    (SfLayout::Eight.len(), &[EOF, ETX]),
    (SfLayout::Eight.len(), &[EOF, CR, ETX]),
    (SfLayout::Six.len(), &[ETX]),
    (SfLayout::Six.len() - 2, &[EOF, ETX]),
];
/// The same for IO. Recordings that were made before IO lost its EOF have one.
const IO_FORMS: &[(usize, &[u8])] = &[
    (io::LENGTH, &[ETX]),
    (io::LENGTH, &[EOF, ETX]),
    (io::LENGTH, &[EOF, CR, ETX]),
];

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

    /// The data section of a text of the controller, at offset `start` of the wire.
    pub(crate) fn reply(&mut self, letters: &str, data: &[u8], start: usize) {
        let range = start..start + data.len();
        match Reply::parse(data) {
            Ok(Reply::Fl(_)) => self.file(letters, data, start),
            Ok(_) => self.add("reply", "reply", range, quoted(data)),
            Err(_) => self.add("text.data", "data", range, quoted(data)),
        }
    }

    /// A text that begins with `FL,` at offset `start` of the wire.
    fn file(&mut self, letters: &str, data: &[u8], start: usize) {
        let from = start + FL.len();
        let rest = data.get(FL.len()..).unwrap_or_default();
        let body = rest.strip_suffix(&[CR]).unwrap_or(rest);
        let content = match (letters, rest.get(..io::LENGTH)) {
            // The last byte of its last word may equal EOF, so only the length tells the end.
            ("IO", Some(words)) => words,
            _ => body.strip_suffix(&[EOF]).unwrap_or(rest),
        };
        let key = letters.to_ascii_lowercase();
        match letters {
            "SF" => self.system_status(content, from),
            "IO" => self.words(content, from),
            "SU" | "SM" => self.items(&key, content, from),
            "" => self.lines("file", "line", content, from),
            "UL" => self.lines("ul", "line", content, from),
            _ => self.lines(&key, "record", content, from),
        }
        let end = from + content.len();
        let tail = rest.get(content.len()..).unwrap_or_default();
        let range = end..start + data.len();
        self.add("text.end", "end of the file", range, quoted(tail));
    }

    fn system_status(&mut self, content: &[u8], from: usize) {
        let layout = match content.len() <= SfLayout::Six.len() {
            true => SfLayout::Six,
            false => SfLayout::Eight,
        };
        let mut end = 0;
        for field in sf_fields(layout) {
            let range = field.offset..field.offset + field.size;
            let Some(bytes) = content.get(range.clone()) else {
                break;
            };
            end = range.end;
            let value = field.kind.describe(bytes);
            let range = from + range.start..from + range.end;
            self.add(format!("sf.{}", field.key), field.name, range, value);
        }
        self.rest("sf.rest", content, end, from);
    }

    fn words(&mut self, content: &[u8], from: usize) {
        let half = io::WORDS;
        let mut end = 0;
        for (index, pair) in content.chunks_exact(2).enumerate().take(2 * half) {
            let direction = if index < half { "input" } else { "output" };
            let number = index % half + 1;
            let range = from + end..from + end + 2;
            let key = format!("io.{direction}.{number}");
            let value = SfFieldKind::Lines("bit ", 0).describe(pair);
            self.add(key, format!("{direction} word {number}"), range, value);
            end += 2;
        }
        self.rest("io.rest", content, end, from);
    }

    /// The items of SU and SM: records if there is a CR, otherwise words between blanks.
    fn items(&mut self, key: &str, content: &[u8], from: usize) {
        let separator = if content.contains(&CR) { CR } else { b' ' };
        let mut at = from;
        for (index, item) in content.split(|byte| *byte == separator).enumerate() {
            let end = at + item.len();
            let colon = item.iter().position(|byte| *byte == b':');
            let length = colon.or((key == "sm").then_some(LABEL));
            let label = match length.and_then(|length| item.get(..length)) {
                None | Some([]) => (index + 1).to_string(),
                Some(label) => String::from_utf8_lossy(label).into_owned(),
            };
            if !(item.is_empty() && end == from + content.len()) {
                let name = format!("{} {label}", key.to_ascii_uppercase());
                let key = format!("{key}.{}", label.to_ascii_lowercase());
                self.add(key, name, at..end, quoted(item));
            }
            at = end + 1;
        }
    }

    /// Lines or records by their number; files of CA by their name.
    fn lines(&mut self, key: &str, word: &str, content: &[u8], from: usize) {
        let mut at = 0;
        let mut number = 0;
        while at < content.len() && number < MAX_FIELDS {
            number += 1;
            let rest = content.get(at..).unwrap_or_default();
            let end = rest.iter().position(|byte| matches!(*byte, CR | LF));
            let line = rest.get(..end.unwrap_or(rest.len())).unwrap_or_default();
            let file = line.split(|byte| *byte == b' ').next().unwrap_or_default();
            let name = match key {
                "ca" => String::from_utf8_lossy(file).into_owned(),
                _ => number.to_string(),
            };
            let length = (line.len() + 1).min(rest.len());
            let range = from + at..from + at + length;
            let whole = rest.get(..length).unwrap_or_default();
            match key {
                "eu" if number > 1 => self.entry(number - 1, line, range),
                "ac" | "ah" => self.alarm(key, number, whole, range),
                "eu" => self.add("eu.count", "number of entries", range, quoted(whole)),
                _ => {
                    let value = quoted(whole);
                    self.add(format!("{key}.{name}"), format!("{word} {name}"), range, value);
                }
            }
            at += length;
        }
        self.rest(&format!("{key}.rest"), content, at, from);
    }

    /// A record of AC or AH: number, message and date of an alarm; the first record begins with the count.
    fn alarm(&mut self, key: &str, number: usize, record: &[u8], range: Range<usize>) {
        let names = ["count", "alarm", "message", "date"].into_iter();
        let mut names = names.skip(usize::from(number > 1));
        let mut at = range.start;
        for item in record.split_inclusive(|byte| *byte == b',') {
            let name = names.next().unwrap_or("surplus");
            let part = match name {
                "count" => format!("{key}.count"),
                _ => format!("{key}.{number}.{name}"),
            };
            let end = at + item.len();
            self.add(part, format!("alarm {number}, {name}"), at..end, quoted(item));
            at = end;
        }
    }

    /// An entry of EU: its alarm and its date.
    fn entry(&mut self, number: usize, line: &[u8], range: Range<usize>) {
        let blank = line.iter().position(|byte| *byte == b' ').unwrap_or(line.len());
        let (alarm, date) = line.split_at(blank);
        let middle = range.start + blank;
        let date = date.strip_prefix(b" ").unwrap_or(date);
        for (name, range, bytes) in [
            ("alarm", range.start..middle, alarm),
            ("date", middle..range.end, date),
        ] {
            let key = format!("eu.{number}.{name}");
            self.add(key, format!("entry {number}, {name}"), range, quoted(bytes));
        }
    }

    fn rest(&mut self, key: &str, content: &[u8], at: usize, from: usize) {
        if at < content.len() {
            let range = from + at..from + content.len();
            let rest = content.get(at..).unwrap_or_default();
            self.add(key, "the rest", range, quoted(rest));
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
                b"2,2-046,OUT OF REACH,14-02-06 00:00:01\r8-201,STOP,14-02-06 00:00:00\r".to_vec(),
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
            found.contains(&("eu.1.date".to_string(), "`14-02-06 00:00:01`".to_string())),
            "{found:?}"
        );
        assert!(
            found.contains(&("eu.1.alarm".to_string(), "`002-046`".to_string())),
            "{found:?}"
        );
        let ac = file(b"1,2-046,OUT,14-02-06 00:00:01\r", &[EOF], Framing::Stx);
        let found: Vec<String> = values("AC", &ac).into_iter().map(|(key, _)| key).collect();
        let keys = ["text.stx", "ac.count", "ac.1.alarm", "ac.1.message", "ac.1.date"];
        assert_eq!(found[..5], keys);
        let ca = file(b"TEST 19\r", &[EOF], Framing::Stx);
        assert!(values("CA", &ca).contains(&("ca.TEST".to_string(), "`TEST 19\\r`".to_string())));
        assert_eq!(
            values("SO", b"\x02NG\r\x03")[1],
            ("reply".to_string(), "`NG\\r`".to_string())
        );
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
