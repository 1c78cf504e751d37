//! Compares two answers: which parts differ, their values, and which of them are excluded by `--ignore` or within the
//! tolerance. Which answers belong together is decided in `matching`.

use super::Tolerance;
use crate::answers::parse_reply;
use serde::Serialize;
use std::mem::discriminant;
use ts3100_proto::dissect::dissect;

/// A part of an answer that differs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PartDifference {
    /// Its key, as `--ignore` takes it: `sf.servo`, `su.status`.
    pub key: String,
    /// For people.
    pub name: String,
    /// Its first byte in the answer recorded, or where it would be.
    pub first: usize,
    /// The byte after its last.
    pub end: usize,
    /// Value in the recording; none if the part is not there.
    pub recorded: Option<String>,
    /// Value of the emulator; none if the part is not there.
    pub emulated: Option<String>,
}

/// The parts that differ, and how many differ that do not count.
pub(super) fn compare(
    letters: &str,
    recorded: &[u8],
    emulated: &[u8],
    tolerance: &Tolerance,
) -> (Vec<PartDifference>, usize) {
    if recorded == emulated {
        return (Vec::new(), 0);
    }
    // OK, NG, SP, a file, or something else.
    let kind = |wire: &[u8]| parse_reply(wire).as_ref().map(discriminant);
    if kind(recorded) != kind(emulated) {
        return (vec![whole_difference("reply", recorded, emulated)], 0);
    }
    let (old, mut new) = (dissect(letters, recorded), dissect(letters, emulated));
    let mut differing = Vec::new();
    let mut end = 0;
    for part in old {
        end = part.range.end;
        let place = new.iter().position(|other| other.key == part.key);
        let other = place.map(|place| new.remove(place));
        let theirs = other.as_ref().and_then(|other| emulated.get(other.range.clone()));
        if theirs != recorded.get(part.range.clone()) {
            differing.push(PartDifference {
                key: part.key,
                name: part.name,
                first: part.range.start,
                end: part.range.end,
                recorded: Some(part.value),
                emulated: other.map(|other| other.value),
            });
        }
    }
    differing.extend(new.into_iter().map(|part| PartDifference {
        key: part.key,
        name: part.name,
        first: end,
        end,
        recorded: None,
        emulated: Some(part.value),
    }));
    let all = differing.len();
    differing.retain(|part| !tolerance.ignore.covers(&part.key) && !is_near(part, tolerance.value));
    let ignored = all - differing.len();
    if all == 0 {
        // Bytes between the parts.
        differing.push(whole_difference("text", recorded, emulated));
    }
    (differing, ignored)
}

fn whole_difference(key: &str, recorded: &[u8], emulated: &[u8]) -> PartDifference {
    let shown = |bytes: &[u8]| Some(ts3100_proto::escape::Escaped::for_reading(bytes).to_string());
    PartDifference {
        key: key.to_owned(),
        name: key.to_owned(),
        first: 0,
        end: recorded.len(),
        recorded: shown(recorded),
        emulated: shown(emulated),
    }
}

/// Coordinates that are the same within what was asked for: those of SF one by one, those of PR in a record.
fn is_near(part: &PartDifference, value: f64) -> bool {
    let is_coordinate = ["sf.joint.", "sf.world.", "sf.work.", "pr."]
        .iter()
        .any(|group| part.key.starts_with(group));
    let (Some(recorded), Some(emulated), true) = (&part.recorded, &part.emulated, is_coordinate) else {
        return false;
    };
    let (old, new) = (recorded.split(','), emulated.split(','));
    let near = |old: &str, new: &str| {
        let numbers = old.parse::<f64>().ok().zip(new.parse::<f64>().ok());
        old == new || numbers.is_some_and(|(old, new)| (old - new).abs() <= value)
    };
    old.clone().count() == new.clone().count() && old.zip(new).all(|(old, new)| near(old, new))
}
