//! The layout of SF as a table: name, offset, size and meaning of each field (sf-layout, SF-04 to SF-46).
//!
//! It is for transcripts, differences and dissectors, which look at single bytes. To read the whole file use
//! [`super::SystemStatus`].

use super::{ALARM_SLOTS, NAME_LENGTH, NO_ALARM, SfLayout, alarm_from_word};
use crate::prelude::*;
use SfFieldKind::{Alarm, Code, Float, Lines, Minutes, Name, Reserved};

/// How the bytes of a field are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SfFieldKind {
    /// A number of one, two or four bytes, and what its values mean from 0 on; none: the number itself.
    Code(&'static [&'static str]),
    /// The word of a current alarm.
    Alarm,
    /// A mask of lines: prefix and number of the line in bit 0.
    Lines(&'static str, u16),
    /// Minutes.
    Minutes,
    /// A single float.
    Float,
    /// ASCII, filled with NUL.
    Name,
    /// Reserved bytes without a meaning.
    Reserved,
}

/// A field of SF.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SfField {
    /// Stable name, with dots: `servo`, `joint.1`.
    pub key: String,
    /// The manual's words.
    pub name: String,
    /// First byte in the content.
    pub offset: usize,
    /// Length in bytes.
    pub size: usize,
    /// How its bytes are read.
    pub kind: SfFieldKind,
}

const SWITCH: SfFieldKind = Code(&["off", "on"]);
const NUMBER: SfFieldKind = Code(&[]);

/// Flags in front of the alarms: key, name, kind; one byte each.
const HEAD: [(&str, &str, SfFieldKind); 4] = [
    ("servo", "servo power", SWITCH),
    ("emergency-stop", "EMERGENCY stop switch", SWITCH),
    ("motion-status", "motion status", Code(MOTION_STATES)),
    ("su-request", "SU command request", SWITCH),
];

const MOTION_STATES: &[&str] = &["stop (reset)", "run", "stop (retry)", "stop (continue)"];

/// Between the alarms and the lines: key, name, length in bytes, kind.
const MIDDLE: [(&str, &str, usize, SfFieldKind); 12] = [
    ("execution-line", "program execution line", 2, NUMBER),
    ("analysis-line", "program analysis line", 2, NUMBER),
    ("execution-task", "program execution task", 2, NUMBER),
    ("analysis-task", "program analysis task", 2, NUMBER),
    ("feed-hold", "feed hold", 2, SWITCH),
    ("guide-coordinate", "guidance coordinate system", 2, Code(SYSTEMS)),
    ("guide-rate", "guide rate", 2, Code(&["slow", "mid", "fast"])),
    ("guide-mode", "guide mode", 2, Code(&["jog", "inching", "free"])),
    ("master-mode", "master mode", 2, Code(MASTER_MODES)),
    ("dummy", "dummy", 2, Reserved),
    ("power-on-time", "power ON time", 4, Minutes),
    ("run-time", "program run time", 4, Minutes),
];
const SYSTEMS: &[&str] = &["joint", "tool", "work", "world"];
const MASTER_MODES: &[&str] = &["TEACHING", "INTERNAL", "EXT (SIG)", "EXT (HOST)"];

/// Groups of lines of one direction: name, number of the first line. The last is that of the SCARA edition (ste80722 S27),
/// reserved in the six-axis one.
const GROUPS: [(&str, u16); 4] = [
    ("general", 1),
    ("extension", 101),
    ("system", 201),
    (LAST_GROUP, 301),
];
const LAST_GROUP: &str = "further";
/// Words of a group.
const GROUP_WORDS: u16 = 4;
/// Letters of the values of a position (default reading of sf-layout).
const LETTERS: [&str; 8] = ["X", "Y", "Z", "A", "B", "C", "axis 7", "axis 8"];

/// The fields in the order of their bytes; together they cover the content.
pub fn sf_fields(layout: SfLayout) -> Vec<SfField> {
    let mut table = Table(Vec::new());
    for (key, name, kind) in HEAD {
        table.add(key, name, 1, kind);
    }
    for slot in 1..=ALARM_SLOTS {
        let name = format!("current alarm {slot}");
        table.add(format!("alarm.{slot}"), name, 2, Alarm);
    }
    for (key, name, size, kind) in MIDDLE {
        table.add(key, name, size, kind);
    }
    for (direction, prefix) in [("input", "Din"), ("output", "Dout")] {
        for (group, line) in GROUPS {
            for number in 1..=GROUP_WORDS {
                let first = line + 16 * (number - 1);
                let lines = format!("{direction} {prefix}{first}-{}", first + 15);
                let reserved = format!("reserved {direction} word {number}");
                let kind = Lines(prefix, first);
                let (key, name, kind) = match (group, layout) {
                    (LAST_GROUP, SfLayout::Eight) => ("reserved", reserved, Reserved),
                    (LAST_GROUP, SfLayout::Six) => (group, lines, kind),
                    _ => (group, format!("{group} {lines}"), kind),
                };
                table.add(format!("{direction}.{key}.{number}"), name, 2, kind);
            }
        }
    }
    for group in ["joint", "world", "work"] {
        for axis in 1..=layout.axes() {
            let name = match LETTERS.get(axis - 1).filter(|_| group != "joint") {
                Some(letter) => format!("{group} coordinate {letter}"),
                None => format!("{group} coordinate {axis}"),
            };
            table.add(format!("{group}.{axis}"), name, 4, Float);
        }
    }
    for name in ["work", "tool", "base"] {
        let words = format!("{name} coordinate name");
        table.add(format!("name.{name}"), words, NAME_LENGTH, Name);
    }
    let left = layout.len().saturating_sub(table.end());
    if left > 0 {
        table.add("reserved", "reserved", left, Reserved);
    }
    table.0
}

struct Table(Vec<SfField>);

impl Table {
    fn end(&self) -> usize {
        self.0.last().map_or(0, |field| field.offset + field.size)
    }

    fn add(&mut self, key: impl Into<String>, name: impl Into<String>, size: usize, kind: SfFieldKind) {
        let offset = self.end();
        self.0.push(SfField {
            key: key.into(),
            name: name.into(),
            offset,
            size,
            kind,
        });
    }
}

impl SfFieldKind {
    /// The value of these bytes of a field in words. Bytes of an unexpected length are quoted.
    pub fn describe(self, bytes: &[u8]) -> String {
        let number = match *bytes {
            [byte] => u32::from(byte),
            [high, low] => u32::from(u16::from_be_bytes([high, low])),
            [a, b, c, d] => u32::from_be_bytes([a, b, c, d]),
            _ if self == Name => return name(bytes),
            _ => return format!("`{}`", bytes.escape_ascii()),
        };
        let word = u16::try_from(number).unwrap_or(NO_ALARM);
        match self {
            Code(words) => match usize::try_from(number).ok().and_then(|code| words.get(code)) {
                Some(word) => format!("{number} ({word})"),
                None => number.to_string(),
            },
            Alarm => match alarm_from_word(word) {
                Some((level, code)) => format!("{word} ({}-{code:03})", level.number()),
                None => format!("{word} (none)"),
            },
            Lines(prefix, first) => {
                let bits = (0..16).filter(|bit| word & (1 << bit) != 0);
                let lines: Vec<String> = bits.map(|bit| format!("{prefix}{}", first + bit)).collect();
                match lines.is_empty() {
                    true => format!("{word:04X} (all off)"),
                    false => format!("{word:04X} ({})", lines.join(" ")),
                }
            }
            Minutes => format!("{number} min"),
            Float => format!("{}", f32::from_bits(number)),
            Name => name(bytes),
            Reserved => format!("{number}"),
        }
    }
}

fn name(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    let (name, rest) = bytes.split_at(end);
    let filled = rest.iter().all(|byte| *byte == 0);
    format!("`{}`", if filled { name } else { bytes }.escape_ascii())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::sf::SystemStatus;

    #[test]
    fn the_fields_cover_either_layout_without_a_gap() {
        for layout in [SfLayout::Eight, SfLayout::Six] {
            let fields = sf_fields(layout);
            let mut end = 0;
            for field in &fields {
                assert_eq!(field.offset, end, "{}", field.key);
                end += field.size;
            }
            assert_eq!(end, layout.len());
        }
    }

    #[test]
    fn offsets_are_those_of_the_encoder() {
        let mut status = SystemStatus {
            servo: true,
            master_mode: 3,
            power_on_minutes: 77,
            work_name: "W".to_string(),
            alarms: alloc::vec![512],
            ..SystemStatus::default()
        };
        status.inputs[0] = 5;
        status.outputs[11] = 0x8000;
        status.joint[1] = 12.5;
        status.world[0] = -1.5;
        for layout in [SfLayout::Eight, SfLayout::Six] {
            let content = status.encode(layout);
            let shown = |key: &str| {
                let fields = sf_fields(layout);
                let field = fields.iter().find(|field| field.key == key).unwrap();
                field
                    .kind
                    .describe(&content[field.offset..field.offset + field.size])
            };
            assert_eq!(shown("servo"), "1 (on)");
            assert_eq!(shown("motion-status"), "0 (stop (reset))");
            assert_eq!(shown("master-mode"), "3 (EXT (HOST))");
            assert_eq!(shown("power-on-time"), "77 min");
            assert_eq!(shown("alarm.1"), "512 (2-001)");
            assert_eq!(shown("alarm.2"), "65535 (none)");
            assert_eq!(shown("input.general.1"), "0005 (Din1 Din3)");
            assert_eq!(shown("output.system.4"), "8000 (Dout264)");
            assert_eq!(shown("output.system.3"), "0000 (all off)");
            assert_eq!(shown("joint.2"), "12.5");
            assert_eq!(shown("world.1"), "-1.5");
            assert_eq!(shown("name.work"), "`W`");
        }
    }
}
