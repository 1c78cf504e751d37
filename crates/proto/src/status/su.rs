//! The status file of SU in both layouts (decision D5).
//!
//! The controller fills [`StatusBody`] and decides when it is sent. SF tells the same and more in binary, see
//! [`super::sf`].

use super::fields::Field;
use super::{BodyError, ExecutionStatus, MasterMode};
use crate::command::RunMode;
use crate::prelude::*;
use crate::text::CR;
use core::fmt;

/// The content of SU.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusBody {
    /// Controller mode.
    pub master_mode: MasterMode,
    /// Operation mode.
    pub run_mode: RunMode,
    /// Name of the selected file; empty if none is selected. Holds no blank and no CR.
    pub file: String,
    /// Speed override in percent, 1 to 100.
    pub override_percent: u8,
    /// Speed limit in percent; our reading of the reserved field. The six records do not carry it.
    pub speed_limit_percent: u8,
    /// Machine lock: programs run without motion of the axes (SU-09).
    pub machine_lock: bool,
    /// Execution status.
    pub execution: ExecutionStatus,
}

/// How the six items are written (option `su.layout`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum SuLayout {
    /// One record, items separated by one blank, no blank within, no CR at the end (hosts 7.1).
    OneRecord,
    /// Six records with CR after each, words as the manual prints them, the fourth empty (SU-11).
    SixRecords,
}

/// Override and speed limit of a file without them, in percent.
const FULL_SPEED: u8 = 100;

/// One item: its label, and how its value is written and read.
struct Item {
    label: &'static str,
    put: fn(&StatusBody, &mut Writer),
    read: fn(&mut StatusBody, Field<'_>) -> Result<(), BodyError>,
}

/// The items in their order.
const ITEMS: [Item; 6] = [
    Item {
        label: "MODE:",
        put: |body, out| {
            out.put(mode_word(body.master_mode, out.layout));
            out.put("/");
            out.put(body.run_mode.as_str());
        },
        read: |body, field| {
            (body.master_mode, body.run_mode) = decode_mode(field)?;
            Ok(())
        },
    },
    Item {
        label: "FILE:",
        put: |body, out| out.put(&body.file),
        read: |body, field| {
            body.file = field.text("a file name in ASCII")?.to_string();
            Ok(())
        },
    },
    Item {
        label: "OVRD:",
        put: |body, out| out.put_percent(body.override_percent),
        read: |body, field| {
            body.override_percent = decode_percent(field)?;
            Ok(())
        },
    },
    Item {
        label: LIMIT,
        put: |body, out| out.put_percent(body.speed_limit_percent),
        read: |body, field| {
            if !field.bytes().is_empty() {
                body.speed_limit_percent = decode_percent(field)?;
            }
            Ok(())
        },
    },
    Item {
        label: "MACHINE:",
        put: |body, out| out.put(machine_word(body.machine_lock)),
        read: |body, field| {
            body.machine_lock = find(field, "free or lock", [false, true], machine_word)?;
            Ok(())
        },
    },
    Item {
        label: "STATUS:",
        put: |body, out| out.put(body.execution.as_str()),
        read: |body, field| {
            let expected = "running, stop(reset), stop(retry) or stop(continue)";
            body.execution = find(field, expected, ExecutionStatus::ALL, ExecutionStatus::as_str)?;
            Ok(())
        },
    },
];
/// The item whose record of the six is empty.
const LIMIT: &str = "LSPEED:";

struct Writer {
    text: String,
    layout: SuLayout,
}

impl Writer {
    /// Appends a word, in one record without its blanks.
    fn put(&mut self, word: &str) {
        match self.layout {
            SuLayout::OneRecord => self.text.extend(word.split(' ')),
            SuLayout::SixRecords => self.text.push_str(word),
        }
    }

    fn put_percent(&mut self, percent: u8) {
        self.put(&format!("{percent}%"));
    }
}

impl StatusBody {
    /// The content of the file.
    pub fn encode(&self, layout: SuLayout) -> Vec<u8> {
        let text = String::new();
        let mut out = Writer { text, layout };
        for item in &ITEMS {
            if layout == SuLayout::OneRecord && !out.text.is_empty() {
                out.text.push(' ');
            }
            if layout == SuLayout::OneRecord || item.label != LIMIT {
                out.text.push_str(item.label);
                (item.put)(self, &mut out);
            }
            if layout == SuLayout::SixRecords {
                out.text.push('\r');
            }
        }
        out.text.into_bytes()
    }

    /// Reads a content of either layout. A missing or empty speed limit reads 100 %.
    ///
    /// # Errors
    /// An item that is missing, without its label, or with a word or number that is not in the manual.
    pub fn decode(content: &[u8]) -> Result<StatusBody, BodyError> {
        let whole = Field::record("SU", content);
        let separator = if whole.bytes().contains(&CR) { CR } else { b' ' };
        let mut found = whole.split(separator);
        let mut body = StatusBody {
            master_mode: MasterMode::Teaching,
            run_mode: RunMode::Continuous,
            file: String::new(),
            override_percent: FULL_SPEED,
            speed_limit_percent: FULL_SPEED,
            machine_lock: false,
            execution: ExecutionStatus::Reset,
        };
        for Item { label, read, .. } in ITEMS {
            let item = found.next().ok_or_else(|| whole.error("six items"))?;
            let is_left_out = label == LIMIT && separator == CR && item.bytes().is_empty();
            if !is_left_out {
                read(&mut body, item.after(label, label)?)?;
            }
        }
        match found.next() {
            Some(surplus) => Err(surplus.error("the end after six items")),
            None => Ok(body),
        }
    }
}

/// The controller mode. In the one record RS-232C is called `host`: it is what hosts know (hosts 7.1).
fn mode_word(mode: MasterMode, layout: SuLayout) -> &'static str {
    match (mode, layout) {
        (MasterMode::Teaching, _) => "teaching",
        (MasterMode::Internal, _) => "internal",
        (MasterMode::ExtSig, _) => "external (sig)",
        (MasterMode::ExtRs232c, SuLayout::OneRecord) => "external (host)",
        (MasterMode::ExtRs232c, SuLayout::SixRecords) => "external (rs232c)",
        (MasterMode::ExtEther, _) => "external (ethernet)",
    }
}

fn machine_word(lock: bool) -> &'static str {
    if lock { "lock" } else { "free" }
}

struct WithoutBlanks<'a>(&'a str);

impl fmt::Display for WithoutBlanks<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.split(' ').try_for_each(|part| f.write_str(part))
    }
}

fn decode_mode(field: Field<'_>) -> Result<(MasterMode, RunMode), BodyError> {
    let mut parts = field.split(b'/');
    let (Some(mode), Some(run_mode), None) = (parts.next(), parts.next(), parts.next()) else {
        return Err(field.error("controller mode, `/` and operation mode"));
    };
    let expected =
        "teaching, internal, external(sig), external(host), external(rs232c) or external(ethernet)";
    let as_in = |layout| find(mode, expected, MasterMode::ALL, |mode| mode_word(mode, layout));
    let master_mode = as_in(SuLayout::OneRecord).or_else(|_| as_in(SuLayout::SixRecords))?;
    let expected = "continuous, cycle, step or segment";
    let run_mode = find(run_mode, expected, RunMode::ALL, RunMode::as_str)?;
    Ok((master_mode, run_mode))
}

fn decode_percent(field: Field<'_>) -> Result<u8, BodyError> {
    let expected = "a number of percent and `%`";
    let digits = field.bytes().strip_suffix(b"%");
    let number = digits.and_then(|digits| field.cut(digits.len()));
    number.ok_or_else(|| field.error(expected))?.0.number(expected)
}

/// The value whose word is in the field; blanks within it and case are ignored.
fn find<T: Copy, const N: usize>(
    field: Field<'_>,
    expected: &'static str,
    values: [T; N],
    word: impl Fn(T) -> &'static str,
) -> Result<T, BodyError> {
    let found = WithoutBlanks(field.text(expected)?).to_string();
    let mut values = values.into_iter();
    let known = values.find(|value| {
        let word = WithoutBlanks(word(*value)).to_string();
        word.eq_ignore_ascii_case(&found)
    });
    known.ok_or_else(|| field.error(expected))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body() -> StatusBody {
        StatusBody {
            master_mode: MasterMode::ExtEther,
            run_mode: RunMode::Cycle,
            file: String::from("TEST"),
            override_percent: 100,
            speed_limit_percent: 100,
            machine_lock: false,
            execution: ExecutionStatus::Reset,
        }
    }

    #[test]
    fn one_record_to_the_byte() {
        assert_eq!(
            body().encode(SuLayout::OneRecord),
            b"MODE:external(ethernet)/cycle FILE:TEST OVRD:100% LSPEED:100% MACHINE:free STATUS:stop(reset)"
        );
        let other = StatusBody {
            master_mode: MasterMode::Internal,
            override_percent: 55,
            machine_lock: true,
            execution: ExecutionStatus::Running,
            ..body()
        };
        assert_eq!(
            other.encode(SuLayout::OneRecord),
            b"MODE:internal/cycle FILE:TEST OVRD:55% LSPEED:100% MACHINE:lock STATUS:running"
        );
    }

    // clause: SU-01 SU-02 SU-05 SU-06 SU-07 SU-09 SU-10 SU-11
    #[test]
    fn six_records_to_the_byte() {
        assert_eq!(
            StatusBody { run_mode: RunMode::Continuous, override_percent: 50, ..body() }.encode(SuLayout::SixRecords),
            b"MODE:external (ethernet)/continuous\rFILE:TEST\rOVRD:50%\r\rMACHINE:free\rSTATUS:stop (reset)\r"
        );
        let none = StatusBody {
            file: String::new(),
            machine_lock: true,
            ..body()
        }
        .encode(SuLayout::SixRecords);
        let text = String::from_utf8(none).unwrap();
        assert!(text.contains("\rFILE:\rOVRD:100%\r\rMACHINE:lock\r"), "{text}");
    }

    // clause: SU-03 SU-04 SU-08
    #[test]
    fn words_as_the_manual_prints_them() {
        let modes = MasterMode::ALL.map(|mode| mode_word(mode, SuLayout::SixRecords));
        assert_eq!(
            modes,
            [
                "teaching",
                "internal",
                "external (sig)",
                "external (rs232c)",
                "external (ethernet)"
            ]
        );
        let modes =
            MasterMode::ALL.map(|mode| WithoutBlanks(mode_word(mode, SuLayout::OneRecord)).to_string());
        assert_eq!(
            modes,
            [
                "teaching",
                "internal",
                "external(sig)",
                "external(host)",
                "external(ethernet)"
            ]
        );
        let status = ExecutionStatus::ALL.map(ExecutionStatus::as_str);
        assert_eq!(
            status,
            ["stop (reset)", "running", "stop (retry)", "stop (continue)"]
        );
        assert_eq!(
            RunMode::ALL.map(RunMode::as_str),
            ["continuous", "cycle", "step", "segment"]
        );
    }

    #[test]
    fn every_status_reads_back_in_both_layouts() {
        for master_mode in MasterMode::ALL {
            for run_mode in RunMode::ALL {
                for execution in ExecutionStatus::ALL {
                    for machine_lock in [false, true] {
                        let body = StatusBody {
                            master_mode,
                            run_mode,
                            execution,
                            machine_lock,
                            ..body()
                        };
                        for layout in [SuLayout::OneRecord, SuLayout::SixRecords] {
                            let bytes = body.encode(layout);
                            assert_eq!(
                                StatusBody::decode(&bytes),
                                Ok(body.clone()),
                                "{}",
                                bytes.escape_ascii()
                            );
                        }
                    }
                }
            }
        }
        let slow = StatusBody {
            speed_limit_percent: 30,
            file: String::new(),
            ..body()
        };
        assert_eq!(StatusBody::decode(&slow.encode(SuLayout::OneRecord)), Ok(slow));
    }

    #[test]
    fn blanks_within_items_are_refused_in_one_record_as_hosts_do() {
        let bytes = b"MODE:external (sig)/cycle FILE: OVRD:1% LSPEED: MACHINE:free STATUS:running";
        assert!(StatusBody::decode(bytes).is_err());
        let bytes = b"MODE:external(rs232c)/CYCLE FILE: OVRD:1% LSPEED: MACHINE:free STATUS:running\r";
        let read = StatusBody::decode(bytes).unwrap();
        assert_eq!(
            (read.master_mode, read.speed_limit_percent),
            (MasterMode::ExtRs232c, 100)
        );
    }

    #[test]
    fn errors_tell_where() {
        let error =
            StatusBody::decode(b"MODE:internal/cycle FILE:T OVRD:5 LSPEED: MACHINE:free STATUS:running")
                .unwrap_err();
        assert_eq!(
            error.to_string(),
            "SU file, byte 32: expected a number of percent and `%`, found `5`"
        );
        for layout in [SuLayout::OneRecord, SuLayout::SixRecords] {
            let bytes = body().encode(layout);
            for end in 0..bytes.len() - 1 {
                assert!(StatusBody::decode(&bytes[..end]).is_err(), "{end}");
            }
            for at in 0..bytes.len() {
                for byte in [0, 3, b' ', b'\r', b'x', b'/', 0xFF] {
                    let mut broken = bytes.clone();
                    broken[at] = byte;
                    let _ = StatusBody::decode(&broken);
                }
            }
        }
    }
}
