//! Finds named options that bring the emulator closer to the recorded controller. Every option with a list of
//! values is tried with each of them, and those that leave fewer differences are suggested.
//!
//! The controller defines what an option does; the list of options is in [`crate::config`].

use crate::config::{OPTIONS, Settings, set_option};
use crate::loading::candidate;
use ts3100_recording::diff::{DifferenceKind, Report, Tolerance, diff};
use ts3100_recording::transcript::Recording;

/// Most suggestions that are made.
const MAX_SUGGESTIONS: usize = 5;

/// An option, and the differences that are left with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Suggestion {
    /// `su.layout=one-record`.
    pub set: String,
    /// Parts that still differ.
    pub left: usize,
}

/// Number of parts of answers that differ; anything but an answer is one part.
fn differing_parts(report: &Report) -> usize {
    let parts = report.differences.iter().map(|difference| {
        if let DifferenceKind::Bytes { parts, .. } = &difference.kind {
            parts.len().max(1)
        } else {
            1
        }
    });
    parts.sum::<usize>() + report.more
}

/// The options with which fewer parts differ than without, the best first.
pub(super) fn suggestions(
    recording: &Recording,
    settings: &Settings,
    tolerance: &Tolerance,
    found: &Report,
) -> Vec<Suggestion> {
    let mut closer = Vec::new();
    for row in OPTIONS.iter() {
        let key = row.key;
        for value in row.values().words() {
            let mut other = settings.clone();
            let options = &mut other.controller.options;
            if set_option(options, &mut other.links, key, value).is_err() {
                continue;
            }
            // One with which it cannot even start is none.
            let Ok(candidate) = candidate(&other) else {
                continue;
            };
            let report = diff(recording, candidate, tolerance);
            let left = differing_parts(&report);
            if left < differing_parts(found) {
                let set = format!("{key}={value}");
                closer.push(Suggestion { set, left });
            }
        }
    }
    closer.sort_by_key(|suggestion| suggestion.left);
    closer.truncate(MAX_SUGGESTIONS);
    closer
}
