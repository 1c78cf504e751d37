//! Every question, one row each. A new row needs nothing else but the word in the column Survey of
//! docs/explanation/fidelity.md; a test compares both.

mod channels;
mod files;
mod look;
mod motion;
mod program;
mod turns;

use crate::probe::{Ask, Class, Probe};

/// Values of a row unless it says otherwise.
const ROW: Probe = Probe {
    id: "",
    question: "",
    class: Class::Look,
    sends: "",
    ask: Ask::Bytes(""),
    readings: &[],
    decides: None,
    with_other_arm: None,
    is_slow: false,
    is_public: true,
};

/// All questions, in the order in which they are asked.
pub fn probes() -> impl Iterator<Item = &'static Probe> {
    [
        look::PROBES,
        files::PROBES,
        program::PROBES,
        channels::PROBES,
        motion::PROBES,
        turns::PROBES,
    ]
    .into_iter()
    .flatten()
}

pub(crate) use files::size as files_size;
pub(crate) use motion::arm_status;
pub(crate) use program::plain;
pub(crate) use turns::moved_axis;

/// The question with this name.
pub fn find(id: &str) -> Option<&'static Probe> {
    probes().find(|probe| probe.id == id)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_row_is_complete_and_its_name_is_its_own() {
        let mut seen = BTreeSet::new();
        for probe in probes() {
            assert!(seen.insert(probe.id), "{} twice", probe.id);
            assert!(probe.question.ends_with('?'), "{}", probe.id);
            assert!(
                !probe.sends.is_empty() && !probe.readings.is_empty(),
                "{}",
                probe.id
            );
            let heard: BTreeSet<_> = probe.readings.iter().collect();
            assert_eq!(heard.len(), probe.readings.len(), "{}", probe.id);
            let values = probe.decides.map_or(&[][..], |(_, values)| values);
            assert!(values.len() <= probe.readings.len(), "{}", probe.id);
            let other = probe.with_other_arm;
            assert!(other.is_none_or(|other| heard.contains(&other)), "{}", probe.id);
        }
    }
}
