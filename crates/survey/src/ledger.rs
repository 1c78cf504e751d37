//! What is known of the controller, and how: the rows of docs/explanation/fidelity.md. The page is the only place where they
//! are written.

use crate::probe::Verdict;
use crate::report::Report;
use std::collections::BTreeSet;
use ts3100_proto::words::Word;

/// The rows, one a line: id, evidence, questions, behaviour.
const ROWS: &str = include_str!(concat!(env!("OUT_DIR"), "/ledger.tsv"));

/// How a behaviour is known. What is only partly known counts as the weaker.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Evidence {
    /// The manual says so.
    Stated,
    /// It was seen on the wire of real host programs, or reported by their authors.
    Observed,
    /// It follows from something stated.
    Inferred,
    /// The reading of this project; nothing is known.
    Assumed,
    /// A choice of this project that no robot has.
    Ours,
}

impl Word for Evidence {
    const ALL: &'static [Evidence] = &[
        Evidence::Stated,
        Evidence::Observed,
        Evidence::Inferred,
        Evidence::Assumed,
        Evidence::Ours,
    ];

    fn word(self) -> &'static str {
        match self {
            Evidence::Stated => "stated",
            Evidence::Observed => "observed",
            Evidence::Inferred => "inferred",
            Evidence::Assumed => "assumed",
            Evidence::Ours => "ours",
        }
    }
}

/// Why a row has no question.
pub const REASONS: &[(&str, &str)] = &[
    ("alarm", "it would raise an alarm that a survey does not raise"),
    ("emulator", "it is about the emulator alone"),
    ("fills", "it would fill the drive"),
    ("known", "the manual or real hosts show it"),
    ("motion", "it needs a motion to a place; a survey chooses none"),
    ("ours", "no robot has it"),
    ("outputs", "it would switch outputs"),
    ("panel", "it needs a hand at the panel"),
    ("parameters", "it would change parameter files"),
    ("power", "it would turn the power off"),
    (
        "serial",
        "it needs a second serial setting, or no host can see it",
    ),
    ("timing", "a network is too slow to see it"),
    ("two hosts", "it needs two hosts at once"),
    ("wiring", "it needs wires to the inputs"),
];

/// What a host does, by the letters of its command or the name of a finding, and the rows that it rests on.
const RESTS_ON: &[(&str, &[&str])] = &[
    ("BR", &["op-7"]),
    ("DL", &["file-1", "file-4"]),
    ("DO", &["op-12", "op-14"]),
    ("EC", &["op-17"]),
    ("ER", &["file-8"]),
    ("FD", &["op-16"]),
    ("HO", &["ext-3", "ext-13"]),
    ("IW", &["file-9"]),
    ("JG", &["ext-3", "ext-20"]),
    ("MN", &["ext-17", "ext-19"]),
    ("MR", &["file-10"]),
    ("MW", &["file-10"]),
    ("RN", &["op-3", "op-9"]),
    ("RS", &["op-19"]),
    ("SM", &["ext-3", "ext-4"]),
    ("SP", &["op-4", "op-5"]),
    ("WD", &["ext-8"]),
    ("ZS", &["ext-3"]),
    ("abbreviated", &["op-17"]),
    ("blank-after-comma", &["text-5"]),
    ("command-in-exchange", &["text-10"]),
    ("half-duplex", &["line-6"]),
    ("input-overflow", &["scol-4"]),
    ("lower-case", &["text-5"]),
    ("text-over-long", &["text-3"]),
    ("print-cut", &["scol-19"]),
    ("unexpected-answer", &["text-12"]),
];

/// The assumed rows that a host rests on which has sent these commands and got these findings, in the order of the page.
pub fn rests_on<'a>(done: impl IntoIterator<Item = &'a str>) -> impl Iterator<Item = Row> {
    let mut ids: BTreeSet<&str> = BTreeSet::new();
    for word in done {
        // The rows of the permission tables have operands, as in `RS,ERR`.
        let letters = word.split(',').next().unwrap_or(word);
        let found = RESTS_ON
            .iter()
            .filter(|(known, _)| *known == word || *known == letters);
        ids.extend(found.flat_map(|(_, ids)| ids.iter()));
    }
    rows().filter(move |row| row.evidence == Evidence::Assumed && ids.contains(&row.id))
}

/// One row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Its id, such as `text-5`.
    pub id: &'static str,
    /// How it is known.
    pub evidence: Evidence,
    /// The questions of the catalogue that ask for it, or one of [`REASONS`].
    pub survey: &'static str,
    /// What the emulator does.
    pub behaviour: &'static str,
}

/// All rows, in the order of the page.
pub fn rows() -> impl Iterator<Item = Row> {
    ROWS.lines().filter_map(|line| {
        let mut cells = line.split('\t');
        let (id, evidence, survey, behaviour) = (cells.next()?, cells.next()?, cells.next()?, cells.next()?);
        Some(Row {
            id,
            evidence: weakest(evidence),
            survey,
            behaviour,
        })
    })
}

/// How many rows have this evidence.
#[must_use]
pub fn count(evidence: Evidence) -> usize {
    rows().filter(|row| row.evidence == evidence).count()
}

/// How many assumed rows the answers of a report settle, and how many there are.
#[must_use]
pub fn settled(report: &Report) -> (usize, usize) {
    let is_answered = |id: &str| {
        report.answers.iter().any(|answer| {
            answer.probe == id && matches!(answer.verdict, Verdict::Manual | Verdict::Variation)
        })
    };
    let assumed = rows().filter(|row| row.evidence == Evidence::Assumed);
    let settled = assumed.filter(|row| row.survey.split(", ").all(is_answered));
    (settled.count(), count(Evidence::Assumed))
}

fn weakest(text: &str) -> Evidence {
    let words = [
        ("assumed", Evidence::Assumed),
        ("inferred", Evidence::Inferred),
        ("observed", Evidence::Observed),
        ("stated", Evidence::Stated),
        ("ours", Evidence::Ours),
    ];
    let found = words.into_iter().find(|(word, _)| text.contains(word));
    found.map_or(Evidence::Stated, |(_, evidence)| evidence)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue;

    #[test]
    fn every_row_has_a_question_or_a_reason_and_every_question_a_row() {
        let mut asked = BTreeSet::new();
        for row in rows() {
            for word in row.survey.split(", ") {
                let is_reason = REASONS.iter().any(|(reason, _)| *reason == word);
                assert!(is_reason || catalogue::find(word).is_some(), "{}: {word}", row.id);
                asked.insert(word);
            }
        }
        assert!(rows().count() > 150, "{}", rows().count());
        let without: Vec<_> = catalogue::probes()
            .filter(|probe| !asked.contains(probe.id))
            .collect();
        // What the manual states is asked too, so that a controller that differs is found.
        let stated = [
            "unknown-command",
            "servo-twice",
            "do-stop-notice",
            "file-round-trip",
            "erase-absent",
            "undefined-variable",
            "loop-variable",
        ];
        let without: Vec<_> = without
            .iter()
            .map(|probe| probe.id)
            .filter(|id| !stated.contains(id))
            .collect();
        assert_eq!(without, [""; 0]);
    }

    #[test]
    fn a_host_rests_on_rows_that_exist_and_are_assumed() {
        for (word, ids) in RESTS_ON {
            let found: Vec<_> = rests_on([*word]).map(|row| row.id).collect();
            assert_eq!(found.len(), ids.len(), "{word}: {found:?}");
        }
        assert_eq!(rests_on(["SU", "VR"]).count(), 0);
    }

    #[test]
    fn what_is_partly_assumed_counts_as_assumed() {
        assert_eq!(weakest("stated (speed), assumed"), Evidence::Assumed);
        assert_eq!(weakest("observed: two sources"), Evidence::Observed);
        assert_eq!(weakest("ours (every common UART)"), Evidence::Ours);
    }
}
