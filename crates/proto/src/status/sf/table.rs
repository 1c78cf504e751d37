//! The layout of SF as a table: one row for each field of [`SystemStatus`] (sf-layout, SF-04 to SF-46). Encoder and decoder
//! go through the rows in their order; [`sf_fields`] has them byte by byte for transcripts, differences and dissectors.

use super::{ALARM_SLOTS, NAME_LENGTH, NO_ALARM, SfLayout, SystemStatus, alarm_from_word};
use crate::prelude::*;
use crate::status::fields::Field;
use crate::status::{BodyError, ExecutionStatus};
use SfFieldKind::{Alarm, Code, Float, Lines, Minutes, Name, Reserved};
use core::iter::{repeat, repeat_n};

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
const MOTION_STATES: &[&str] = &["stop (reset)", "run", "stop (retry)", "stop (continue)"];
const SYSTEMS: &[&str] = &["joint", "tool", "work", "world"];
const MASTER_MODES: &[&str] = &["TEACHING", "INTERNAL", "EXT (SIG)", "EXT (HOST)"];

/// A row of the table. One that has several elements is a group: alarm slots, words of lines, axes.
struct Row {
    key: &'static str,
    /// The manual's words.
    name: &'static str,
    /// Length of an element in bytes.
    size: usize,
    kind: SfFieldKind,
}

/// The rows in the order of their bytes: key, name, length of an element, kind, and the field of the value. Bytes without
/// a field are 0 and are not read.
macro_rules! rows {
    ($($key:literal, $name:literal, $size:expr, $kind:expr $(=> $field:ident)?;)*) => {
        const ROWS: &[Row] = &[$(Row { key: $key, name: $name, size: $size, kind: $kind }),*];

        impl SystemStatus {
            /// The content of the file, [`SfLayout::len`] bytes.
            pub fn encode(&self, layout: SfLayout) -> Vec<u8> {
                let mut out = Vec::with_capacity(layout.len());
                $(Part::put(&($(self.$field)?), $size, layout, &mut out);)*
                // The reserved tail.
                out.resize(layout.len(), 0);
                out
            }

            /// Reads a content. Axes beyond the layout read 0, empty alarm slots are left out.
            ///
            /// # Errors
            /// A content of another length, a flag that is neither 0 nor 1, an unknown motion status, a name that
            /// is not ASCII.
            pub fn decode(content: &[u8], layout: SfLayout) -> Result<SystemStatus, BodyError> {
                let whole = Field::whole("SF", content);
                if content.len() != layout.len() {
                    return Err(whole.error(match layout {
                        SfLayout::Eight => "276 bytes",
                        SfLayout::Six => "250 bytes",
                    }));
                }
                let mut rest = whole;
                let mut status = SystemStatus::default();
                $(Part::take(&mut ($(status.$field)?), $size, layout, &mut rest)?;)*
                Ok(status)
            }
        }
    };
}

rows! {
    "servo", "servo power", 1, SWITCH => servo;
    "emergency-stop", "EMERGENCY stop switch", 1, SWITCH => emergency_stop;
    "motion-status", "motion status", 1, Code(MOTION_STATES) => execution;
    "su-request", "SU command request", 1, SWITCH => su_request;
    "alarm", "current alarm", 2, Alarm => alarms;
    "execution-line", "program execution line", 2, NUMBER => execution_line;
    "analysis-line", "program analysis line", 2, NUMBER => analysis_line;
    "execution-task", "program execution task", 2, NUMBER => execution_task;
    "analysis-task", "program analysis task", 2, NUMBER => analysis_task;
    "feed-hold", "feed hold", 2, SWITCH => feed_hold;
    "guide-coordinate", "guidance coordinate system", 2, Code(SYSTEMS) => guide_coordinate;
    "guide-rate", "guide rate", 2, Code(&["slow", "mid", "fast"]) => guide_rate;
    "guide-mode", "guide mode", 2, Code(&["jog", "inching", "free"]) => guide_mode;
    "master-mode", "master mode", 2, Code(MASTER_MODES) => master_mode;
    "dummy", "dummy", 2, Reserved;
    "power-on-time", "power ON time", 4, Minutes => power_on_minutes;
    "run-time", "program run time", 4, Minutes => run_minutes;
    "input", "input", 2, Lines("Din", 1) => inputs;
    "output", "output", 2, Lines("Dout", 1) => outputs;
    "joint", "joint coordinate", 4, Float => joint;
    "world", "world coordinate", 4, Float => world;
    "work", "work coordinate", 4, Float => work;
    "name.work", "work coordinate name", NAME_LENGTH, Name => work_name;
    "name.tool", "tool coordinate name", NAME_LENGTH, Name => tool_name;
    "name.base", "base coordinate name", NAME_LENGTH, Name => base_name;
}

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
    for row in ROWS {
        let Row {
            key,
            name,
            size,
            kind,
        } = *row;
        match kind {
            Alarm => (1..=ALARM_SLOTS).for_each(|slot| {
                table.add(format!("{key}.{slot}"), format!("{name} {slot}"), size, kind);
            }),
            Lines(prefix, _) => table.add_lines(key, prefix, layout),
            Float => (1..=layout.axes()).for_each(|axis| {
                let name = match LETTERS.get(axis - 1).filter(|_| key != "joint") {
                    Some(letter) => format!("{name} {letter}"),
                    None => format!("{name} {axis}"),
                };
                table.add(format!("{key}.{axis}"), name, size, kind);
            }),
            Code(_) | Minutes | Name | Reserved => table.add(key, name, size, kind),
        }
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

    /// The words of the lines of one direction.
    fn add_lines(&mut self, direction: &str, prefix: &'static str, layout: SfLayout) {
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
                self.add(format!("{direction}.{key}.{number}"), name, 2, kind);
            }
        }
    }
}

/// A field of the value in its bytes.
trait Part {
    /// Appends its bytes; each element has this size.
    fn put(&self, size: usize, layout: SfLayout, out: &mut Vec<u8>);
    /// Reads it from the front of the rest.
    fn take(&mut self, size: usize, layout: SfLayout, rest: &mut Field<'_>) -> Result<(), BodyError>;
}

fn take<'a>(size: usize, rest: &mut Field<'a>) -> Result<Field<'a>, BodyError> {
    let (head, after) = rest.cut(size).ok_or_else(|| rest.error("more bytes"))?;
    *rest = after;
    Ok(head)
}

/// Bytes without a field.
impl Part for () {
    fn put(&self, size: usize, _: SfLayout, out: &mut Vec<u8>) {
        out.extend(repeat_n(0, size));
    }

    fn take(&mut self, size: usize, _: SfLayout, rest: &mut Field<'_>) -> Result<(), BodyError> {
        take(size, rest).map(drop)
    }
}

/// A flag in one byte or in two.
impl Part for bool {
    fn put(&self, size: usize, _: SfLayout, out: &mut Vec<u8>) {
        out.extend(repeat_n(0, size - 1));
        out.push(u8::from(*self));
    }

    fn take(&mut self, size: usize, _: SfLayout, rest: &mut Field<'_>) -> Result<(), BodyError> {
        let field = take(size, rest)?;
        *self = match field.bytes() {
            [0] | [0, 0] => false,
            [1] | [0, 1] => true,
            _ => return Err(field.error("0 or 1")),
        };
        Ok(())
    }
}

impl Part for ExecutionStatus {
    fn put(&self, _: usize, _: SfLayout, out: &mut Vec<u8>) {
        out.push(self.code());
    }

    fn take(&mut self, size: usize, _: SfLayout, rest: &mut Field<'_>) -> Result<(), BodyError> {
        let field = take(size, rest)?;
        let code = field.bytes().first().copied();
        let known = code.and_then(ExecutionStatus::from_code);
        *self = known.ok_or_else(|| field.error("motion status 0 to 3"))?;
        Ok(())
    }
}

/// Numbers, big-endian.
macro_rules! numbers {
    ($($number:ty)*) => {$(
        impl Part for $number {
            fn put(&self, _: usize, _: SfLayout, out: &mut Vec<u8>) {
                out.extend(self.to_be_bytes());
            }

            fn take(&mut self, size: usize, _: SfLayout, rest: &mut Field<'_>) -> Result<(), BodyError> {
                let field = take(size, rest)?;
                let bytes = field.bytes().try_into();
                *self = <$number>::from_be_bytes(bytes.map_err(|_| field.error("more bytes"))?);
                Ok(())
            }
        }
    )*};
}

numbers! { u16 u32 f32 }

/// The words of alarms in their slots.
impl Part for Vec<u16> {
    fn put(&self, size: usize, layout: SfLayout, out: &mut Vec<u8>) {
        let slots = self.iter().chain(repeat(&NO_ALARM)).take(ALARM_SLOTS);
        slots.for_each(|word| word.put(size, layout, out));
    }

    fn take(&mut self, size: usize, layout: SfLayout, rest: &mut Field<'_>) -> Result<(), BodyError> {
        for _ in 0..ALARM_SLOTS {
            let mut word = NO_ALARM;
            word.take(size, layout, rest)?;
            self.extend(Some(word).filter(|word| *word != NO_ALARM));
        }
        Ok(())
    }
}

/// Words of lines.
impl Part for [u16; 16] {
    fn put(&self, size: usize, layout: SfLayout, out: &mut Vec<u8>) {
        self.iter().for_each(|word| word.put(size, layout, out));
    }

    fn take(&mut self, size: usize, layout: SfLayout, rest: &mut Field<'_>) -> Result<(), BodyError> {
        self.iter_mut().try_for_each(|word| word.take(size, layout, rest))
    }
}

/// Coordinates of the axes of the layout.
impl Part for [f32; 8] {
    fn put(&self, size: usize, layout: SfLayout, out: &mut Vec<u8>) {
        let axes = self.iter().take(layout.axes());
        axes.for_each(|axis| axis.put(size, layout, out));
    }

    fn take(&mut self, size: usize, layout: SfLayout, rest: &mut Field<'_>) -> Result<(), BodyError> {
        let mut axes = self.iter_mut().take(layout.axes());
        axes.try_for_each(|axis| axis.take(size, layout, rest))
    }
}

/// A name, filled with NUL. Characters beyond ASCII 20-7E go as `?`, so that the fixed width counts characters.
impl Part for String {
    fn put(&self, size: usize, _: SfLayout, out: &mut Vec<u8>) {
        let bytes = self.chars().map(|char| match char {
            ' '..='~' => char as u8,
            _ => b'?',
        });
        out.extend(bytes.chain(repeat(0)).take(size));
    }

    fn take(&mut self, size: usize, _: SfLayout, rest: &mut Field<'_>) -> Result<(), BodyError> {
        let field = take(size, rest)?;
        let name = field.split(0).next().unwrap_or(field);
        let name = name.text("a name in ASCII, filled with NUL")?;
        *self = name.trim_end().to_string();
        Ok(())
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
