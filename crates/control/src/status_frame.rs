//! `/status-frame`: the present content of SF, field by field in words.
//!
//! The content is the controller's, its fields are [`ts3100_proto::dissect`]'s. Here each field gets a meaning beyond its
//! value: texts of alarms, names of lines, units.

use super::resource::{Serialize, View};
use ts3100_controller::alarm::AlarmCode;
use ts3100_controller::{IoKind, Port, line_name};
use ts3100_proto::dissect::{DissectedField, dissect};
use ts3100_proto::text::{EOF, ETX, STX};

/// Meanings of fields whose value alone does not say it, by their keys without `sf.`.
const MEANINGS: [(&str, &str); 11] = [
    ("motion-status", "execution status; a statement of DO runs too"),
    ("su-request", "on: SU has changed since this host last read it"),
    (
        "execution-line",
        "file line of the motion, or at which the program is; 0 without a file",
    ),
    (
        "analysis-line",
        "file line that is read, which can be ahead of the motion",
    ),
    ("execution-task", "1 is the main program; 0 without a file"),
    ("analysis-task", "1 is the main program; 0 without a file"),
    (
        "guide-coordinate",
        "the coordinate system in which an axis is guided by hand",
    ),
    ("guide-rate", "how fast an axis is guided by hand"),
    ("guide-mode", "how an axis is guided by hand"),
    ("power-on-time", "since power-on"),
    ("run-time", "of programs, since power-on"),
];

/// A field of SF.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct StatusField {
    /// Stable name, with dots: `sf.servo`, `sf.joint.1`.
    key: String,
    /// Name in the manual.
    name: String,
    /// Value in words: `on`, `2-046`, `Din1 Din3`, `12.5`.
    value: String,
    /// Meaning of the value: the text of an alarm, names of lines, the unit; absent if the value is clear.
    #[serde(skip_serializing_if = "Option::is_none")]
    meaning: Option<String>,
}

impl StatusField {
    /// All of SF, as the host would get it: the one on IP0, or on HOST if only that one is connected.
    pub fn all(view: &View<'_>) -> Vec<StatusField> {
        let controller = view.controller;
        let on_host = controller.peer(Port::Ip0).is_none() && controller.peer(Port::Host).is_some();
        let port = if on_host { Port::Host } else { Port::Ip0 };
        let is_scara = controller.config().model.language() == scol_mini::Arm::Scara;
        let content = controller.status_frame(port);
        let text = [&[STX], b"FL,".as_slice(), &content, &[EOF, ETX]].concat();
        let fields = dissect("SF", &text).into_iter();
        fields
            .filter(|field| field.key.starts_with("sf."))
            .map(|field| StatusField::new(field, is_scara))
            .collect()
    }

    fn new(field: DissectedField, is_scara: bool) -> StatusField {
        let value = in_words(&field.value);
        StatusField {
            meaning: meaning(field.key.trim_start_matches("sf."), value, is_scara),
            value: value.to_owned(),
            key: field.key,
            name: field.name,
        }
    }
}

/// `on` of `1 (on)`; a value without words is what it is.
fn in_words(value: &str) -> &str {
    let words = value
        .split_once(" (")
        .filter(|(number, _)| number.bytes().all(|digit| digit.is_ascii_hexdigit()));
    words
        .and_then(|(_, words)| words.strip_suffix(')'))
        .unwrap_or(value)
}

fn meaning(key: &str, value: &str, is_scara: bool) -> Option<String> {
    let (group, rest) = key.split_once('.').unwrap_or((key, ""));
    match group {
        "alarm" => AlarmCode::from_number(value).map(|alarm| alarm.text.to_owned()),
        "input" => names_of_lines(value, IoKind::Input),
        "output" => names_of_lines(value, IoKind::Output),
        "joint" if is_scara && rest == "3" => Some("mm".to_owned()),
        "joint" => Some("degrees".to_owned()),
        "world" | "work" if ["1", "2", "3"].contains(&rest) => Some("mm".to_owned()),
        "world" | "work" => Some("degrees".to_owned()),
        _ => {
            let mut meanings = MEANINGS.iter();
            let found = meanings.find(|(known, _)| *known == key);
            found.map(|(_, meaning)| (*meaning).to_owned())
        }
    }
}

/// The names of lines as `Din249 Din255`, of those that have one.
fn names_of_lines(lines: &str, kind: IoKind) -> Option<String> {
    let names = lines.split(' ').filter_map(|line| {
        let number = line.trim_start_matches(|letter: char| letter.is_ascii_alphabetic());
        line_name(kind, number.parse().ok()?)
    });
    let names: Vec<&str> = names.collect();
    (!names.is_empty()).then(|| names.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ts3100_proto::status::sf::SfLayout;
    use ts3100_proto::status::sf::table::sf_fields;

    #[test]
    fn values_are_cut_to_their_words() {
        for (value, words) in [
            ("1 (on)", "on"),
            ("0 (stop (reset))", "stop (reset)"),
            ("8000 (Dout264)", "Dout264"),
            ("65535 (none)", "none"),
            ("12.5", "12.5"),
            ("77 min", "77 min"),
            ("`A (B)`", "`A (B)`"),
        ] {
            assert_eq!(in_words(value), words);
        }
    }

    #[test]
    fn every_meaning_is_of_a_field() {
        let fields = sf_fields(SfLayout::Eight);
        for (key, _) in MEANINGS {
            assert!(fields.iter().any(|field| field.key == key), "{key}");
        }
        let of = |key, value| meaning(key, value, true);
        assert_eq!(of("alarm.1", "8-014").as_deref(), Some("Emergency Stop SW ON"));
        assert_eq!(of("alarm.2", "none"), None);
        assert_eq!(
            of("output.system.4", "Dout250 Dout256 Dout264").as_deref(),
            Some("SV_RDY SYS_RDY")
        );
        assert_eq!(of("joint.3", "1").as_deref(), Some("mm"));
    }
}
