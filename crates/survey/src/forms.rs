//! The forms of answers, for questions and for recorded texts alike.

use ts3100_proto::parameter::{EthernetParameters, OpenMode};
use ts3100_proto::status::ca::decode_directory;
use ts3100_proto::status::sf::SfLayout;
use ts3100_proto::status::su::StatusBody;
use ts3100_proto::text::CR;

/// Another form than any that is known.
pub const OTHER: &str = "another form";
/// Bytes of the first text of an SF that a six-axis arm sends in several: STX, 253 data bytes, ETX.
const FIRST_OF_SEVERAL: usize = 255;
/// Bytes of the one text of an SF with EOF: STX, `FL,`, 276 bytes, EOF, ETX.
const SIX_AXES: usize = 282;

/// The form of SU: `one record` or `six records`.
pub fn status(content: &[u8]) -> &'static str {
    let records = content.iter().filter(|byte| **byte == CR).count();
    match (StatusBody::decode(content), records) {
        (Ok(_), 0) => "one record",
        (Ok(_), 6) => "six records",
        _ => OTHER,
    }
}

/// The form of VR: `blanks` or `packed`.
pub fn versions(content: &[u8]) -> &'static str {
    if ts3100_proto::status::vr::decode_versions(content).is_err() {
        return OTHER;
    }
    let first = content.split(|byte| *byte == CR).next().unwrap_or_default();
    match first.len() {
        32 => "blanks",
        29 => "packed",
        _ => OTHER,
    }
}

/// The records of VR.
pub fn version_records(content: &[u8]) -> Vec<String> {
    let text = |record: &[u8]| String::from_utf8_lossy(record).trim().to_owned();
    records(content).map(text).collect()
}

fn records(content: &[u8]) -> impl Iterator<Item = &[u8]> {
    let records = content.split(|byte| *byte == CR);
    records.filter(|record| !record.is_empty())
}

/// The form of CA: `one blank, alphabetical`, or what differs.
pub fn directory(content: &[u8]) -> &'static str {
    let Ok(entries) = decode_directory(content) else {
        return OTHER;
    };
    let blanks = |record: &[u8]| record.iter().filter(|byte| **byte == b' ').count() == 1;
    match (
        records(content).all(blanks),
        entries.is_sorted_by(|a, b| a.name <= b.name),
    ) {
        (true, true) => "one blank, alphabetical",
        (true, false) => "one blank, another order",
        (false, true) => "other blanks, alphabetical",
        (false, false) => "other blanks, another order",
    }
}

/// The form of EU.
pub fn history(content: &[u8]) -> &'static str {
    match ts3100_proto::status::eu::decode_history(content) {
        Ok(_) => "a count, and its errors",
        Err(_) => OTHER,
    }
}

/// How the first record of AC writes the year.
pub fn alarm_year(content: &[u8]) -> &'static str {
    let date = content.split(|byte| matches!(byte, b',' | b'\r')).nth(3);
    let year = date.and_then(|date| date.split(|byte| *byte == b'-').next());
    match year.map(<[u8]>::len) {
        Some(4) => "four digits",
        Some(2) => "two digits",
        None => "no alarm",
        Some(_) => OTHER,
    }
}

/// How SF travels, from the bytes that come before the host says OK.
pub fn total_status(burst: &[u8], has_stx: bool) -> &'static str {
    let length = burst.len() + usize::from(!has_stx);
    match length {
        SIX_AXES => "one text, six axes",
        FIRST_OF_SEVERAL => {
            let content = burst.get(3 + usize::from(has_stx)..burst.len() - 1);
            match SfLayout::from_first_text(content.unwrap_or_default()) {
                SfLayout::Six => "one text, SCARA",
                SfLayout::Eight => "several texts, six axes",
            }
        }
        _ => OTHER,
    }
}

/// The arm that a form of SF tells of: `six axes` or `SCARA`.
pub fn arm(form: &str) -> String {
    form.split(", ").last().unwrap_or_default().to_owned()
}

/// The line end of a parameter file: `LF`, `CR` or `CR LF`.
pub fn line_end(content: &[u8]) -> &'static str {
    let count = |wanted: u8| content.iter().filter(|byte| **byte == wanted).count();
    match (count(b'\r'), count(b'\n')) {
        (0, 1..) => "LF",
        (1.., 0) => "CR",
        (cr, lf) if cr == lf && cr > 0 => "CR LF",
        _ => OTHER,
    }
}

/// `[E00]` of ETHERNET.PAR as its four digits; `None` if it cannot be read.
pub fn open_mode(content: &[u8]) -> Option<String> {
    // What the file does not say stays as it was before: two different ones show it.
    let read = |before| {
        let previous = EthernetParameters {
            open_mode: [before; 4],
            ..EthernetParameters::factory()
        };
        EthernetParameters::parse(content, &previous).0.open_mode
    };
    let modes = read(OpenMode::NotUsed);
    let digits: Vec<String> = modes.iter().map(|mode| mode.number().to_string()).collect();
    (modes == read(OpenMode::Client)).then(|| digits.join(" "))
}
