//! Every question, one row each. A new row needs nothing else but the word in the column Survey of
//! docs/explanation/fidelity.md; a test compares both.

mod channels;
mod files;
mod look;
mod motion;
mod program;
mod turns;

use crate::probe::{Ask, Class, Probe, Reading};

/// What a row has unless it says otherwise.
const ROW: Probe = Probe {
    id: "",
    question: "",
    class: Class::Look,
    sends: "",
    ask: Ask::Bytes(""),
    readings: &[],
    repeats: 3,
    is_public: true,
};

/// A reading that decides no option.
const fn reading(heard: &'static str) -> Reading {
    Reading {
        heard,
        sets: None,
        is_default: false,
    }
}

/// A reading, and the option it decides.
const fn decides(heard: &'static str, option: &'static str, value: &'static str) -> Reading {
    Reading {
        heard,
        sets: Some((option, value)),
        is_default: false,
    }
}

/// A reading that the emulator has by default with some arm.
const fn default_of_an_arm(reading: Reading) -> Reading {
    Reading {
        is_default: true,
        ..reading
    }
}

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
            let heard: BTreeSet<&str> = probe.readings.iter().map(|reading| reading.heard).collect();
            assert_eq!(heard.len(), probe.readings.len(), "{}", probe.id);
        }
    }
}
