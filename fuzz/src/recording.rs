//! Fuzzes the transcripts: the first byte says whether the rest is read as text or as JSON lines.
//!
//! A transcript is refused with its line and a message, or it is written and read again as it is. It can be written in every
//! other form, the blocks of a capture are well-formed, and a short one is played to a controller.

use std::time::Duration;
use ts3100_controller::{Config, Controller, Dialect};
use ts3100_driver::snapshot::from_json;
use ts3100_driver::tcp::SecondConnection;
use ts3100_recording::diff::{Candidate, Tolerance, diff};
use ts3100_recording::transcript::{
    Format, LinkRecord, MAX_BUFFERED_RECORDS, RecordKind, Recording, TranscriptBuffer, json, text,
};

/// Virtual time that is played at most: a program may run in it.
const MAX_PLAYED: u64 = 60_000_000;
/// Bytes of a block of a capture without its body.
const BLOCK: usize = 12;

fn written(recording: &Recording, format: Format) -> Vec<u8> {
    let buffer = TranscriptBuffer::new(recording.header.clone(), MAX_BUFFERED_RECORDS);
    for record in &recording.records {
        buffer.push(record.clone());
    }
    buffer.to_bytes(format)
}

/// Checks that a capture is blocks of whole words, each with its length at both ends.
fn check_capture(mut capture: &[u8]) {
    let word = |bytes: &[u8]| {
        bytes
            .first_chunk()
            .map_or(0, |word| u32::from_le_bytes(*word) as usize)
    };
    while !capture.is_empty() {
        let length = word(&capture[4.min(capture.len())..]);
        assert!(
            length >= BLOCK && length.is_multiple_of(4) && length <= capture.len(),
            "{length}"
        );
        let (block, rest) = capture.split_at(length);
        assert_eq!(word(&block[length - 4..]), length);
        capture = rest;
    }
}

/// Whether it is short, and each of its snapshots valid, as a file that is played has to be.
pub(crate) fn can_be_played(recording: &Recording) -> bool {
    recording.records.iter().all(|record| {
        let restored = match &record.kind {
            RecordKind::Link(
                LinkRecord::Restored { at, snapshot } | LinkRecord::Begin { at, snapshot, .. },
            ) => at.as_micros() <= MAX_PLAYED && from_json(snapshot).is_ok(),
            _ => true,
        };
        restored && record.at.as_micros() <= MAX_PLAYED
    })
}

/// An emulator with the files of a recording.
pub(crate) fn candidate(recording: &Recording, choice: &u8) -> Option<Candidate> {
    let config = Config::new(if choice & 2 == 0 {
        Dialect::Field
    } else {
        Dialect::Manual
    });
    let mut controller = Controller::new(config, Vec::new()).ok()?;
    for (name, content) in &recording.header.files {
        // A name or a content that the drive does not take is refused.
        let _refused = controller.put_file(name, content);
    }
    while controller.poll_output().is_some() {}
    Some(Candidate {
        controller,
        second: SecondConnection::default(),
        servo_on: choice & 4 != 0,
    })
}

/// Reads a transcript, writes and plays it.
///
/// # Panics
/// When what must hold does not.
pub fn check(data: &[u8]) {
    let (choice, data) = data.split_first().unwrap_or((&b't', data));
    let content = String::from_utf8_lossy(data);
    let (format, read): (_, fn(&str) -> _) = match choice & 1 {
        0 => (Format::Text, text::read),
        _ => (Format::Json, json::read),
    };
    let recording: Recording = match read(&content) {
        Ok(recording) => recording,
        Err((line, reason)) => {
            assert!(line >= 1 && !reason.to_string().is_empty(), "{reason:?}");
            return;
        }
    };
    let again = written(&recording, format);
    let again = String::from_utf8(again).unwrap_or_else(|_| panic!("a transcript is characters"));
    let read_again =
        read(&again).unwrap_or_else(|refused| panic!("{refused:?} of what is written: {again:?}"));
    assert_eq!(read_again.header, recording.header, "{again:?}");
    assert_eq!(read_again.records, recording.records, "{again:?}");
    written(
        &recording,
        if format == Format::Text {
            Format::Json
        } else {
            Format::Text
        },
    );
    check_capture(&written(&recording, Format::Pcapng));
    if !can_be_played(&recording) {
        return;
    }
    let Some(candidate) = candidate(&recording, choice) else {
        return;
    };
    let tolerance = Tolerance {
        answer_timeout: Duration::from_secs(1),
        ..Tolerance::default()
    };
    diff(&recording, candidate, &tolerance);
}
