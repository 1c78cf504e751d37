//! What is known of the controller, and how: the rows of docs/explanation/fidelity.md. The page is the only place where they
//! are written.

use crate::probe::Verdict;
use crate::report::Report;
use std::collections::BTreeSet;
use ts3100_proto::words::Word;

/// The page.
fn page() -> &'static str {
    let page = ts3100_book::book().page("explanation/fidelity");
    page.map_or("", |page| page.text.as_str())
}

/// How a behaviour is known. What is only partly known counts as the weaker; the order here is that of the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum EvidenceLevel {
    /// A manual of the maker says so: ours, its SCARA edition, or that of the client library.
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

impl Word for EvidenceLevel {
    const ALL: &'static [EvidenceLevel] = &[
        EvidenceLevel::Stated,
        EvidenceLevel::Observed,
        EvidenceLevel::Inferred,
        EvidenceLevel::Assumed,
        EvidenceLevel::Ours,
    ];

    fn word(self) -> &'static str {
        match self {
            EvidenceLevel::Stated => "stated",
            EvidenceLevel::Observed => "observed",
            EvidenceLevel::Inferred => "inferred",
            EvidenceLevel::Assumed => "assumed",
            EvidenceLevel::Ours => "ours",
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

/// Commands of a host, by their letters, or findings, by their names, with the rows that they rest on.
const RESTS_ON: &[(&str, &[&str])] = &[
    ("BR", &["op-7"]),
    ("DL", &["file-1", "file-4"]),
    ("DO", &["op-12", "op-14"]),
    ("EC", &["op-17"]),
    ("ER", &["file-8"]),
    ("FD", &["op-16"]),
    ("IW", &["file-9"]),
    ("JG", &["ext-20"]),
    ("MN", &["ext-17"]),
    ("RN", &["op-3", "op-9"]),
    ("RS", &["op-19"]),
    ("SM", &["ext-4"]),
    ("SP", &["op-4", "op-5"]),
    ("WD", &["ext-8"]),
    ("abbreviated", &["op-17"]),
    ("answer-missing", &["text-8"]),
    ("bad-checksum", &["text-7"]),
    ("blank-after-comma", &["text-5"]),
    ("bytes-outside", &["text-2", "text-25"]),
    ("command-in-exchange", &["text-10"]),
    ("data-cleared", &["scol-5"]),
    ("download-abandoned", &["text-8"]),
    ("file-bad-line", &["file-4"]),
    ("file-too-large", &["file-6"]),
    ("file-without-download", &["text-13"]),
    ("half-duplex", &["line-6"]),
    ("half-value", &["scol-7"]),
    ("input-empty", &["scol-6"]),
    ("input-line-feed", &["scol-6"]),
    ("input-overflow", &["scol-4"]),
    ("left-jogging", &["ext-20"]),
    ("line-garbled", &["line-4"]),
    ("lower-case", &["text-5"]),
    ("message-too-long", &["text-6"]),
    ("parameter-broken", &["file-13"]),
    ("print-cut", &["scol-19"]),
    ("second-connection", &["text-18"]),
    ("selected-overwritten", &["file-7"]),
    ("start-servo-off", &["op-3"]),
    ("text-over-long", &["text-3"]),
    ("text-unfinished", &["text-8"]),
    ("unexpected-answer", &["text-12"]),
    ("watchdog-late", &["ext-8"]),
];

/// Words of programs, and the assumed behaviours that a program with them relies on.
const PROGRAMS_REST_ON: &[(&str, &[&str])] = &[
    ("BCDIN", &["scol-33"]),
    ("BCDOUT", &["scol-33"]),
    ("BREAK", &["scol-24"]),
    ("DEST", &["scol-36"]),
    ("FOR", &["scol-45"]),
    ("INPUT", &["scol-5", "scol-6"]),
    ("MOTIONT", &["scol-36"]),
    ("MOVE", &["motion-10"]),
    ("MOVEC", &["motion-11", "motion-12"]),
    ("MOVEJ", &["motion-1"]),
    ("MOVES", &["motion-11"]),
    ("NOWAIT", &["scol-25"]),
    ("ON", &["scol-37", "scol-38"]),
    ("PAUSE", &["scol-24"]),
    ("PRINT", &["scol-3"]),
    ("PULOUT", &["scol-33"]),
    ("REMAIN", &["scol-36"]),
    ("REMAINT", &["scol-36"]),
    ("RESTORE", &["scol-12"]),
    ("RESUME", &["scol-24"]),
    ("SWITCH", &["scol-40"]),
    ("TASK", &["scol-40", "scol-41", "scol-42"]),
    ("TID", &["scol-40"]),
    ("TIMER", &["scol-35"]),
    ("WAIT", &["scol-39"]),
    ("WITH", &["scol-31"]),
];

/// Assumed behaviours that a run depended on, by its commands, findings and programs, in the order of the page.
pub fn rests_on<'a>(
    done: impl IntoIterator<Item = &'a str>,
    programs: impl IntoIterator<Item = &'a [u8]>,
) -> impl Iterator<Item = Row> {
    let mut ids: BTreeSet<&str> = BTreeSet::new();
    let mut add = |table: &[(&str, &'static [&'static str])], word: &str| {
        let found = table.iter().filter(|(known, _)| *known == word);
        ids.extend(found.flat_map(|(_, ids)| ids.iter()));
    };
    for word in done {
        // The rows of the permission tables have operands, as in `RS,ERR`.
        let letters = word.split(',').next().unwrap_or(word);
        add(RESTS_ON, letters);
    }
    for program in programs {
        // Lines end with CR on a drive that a real host has written.
        for line in String::from_utf8_lossy(program).split(['\r', '\n']) {
            // No strings, and no comments.
            let code = line.split('"').step_by(2).collect::<Vec<_>>().join(" ");
            let code = code.split('\'').next().unwrap_or_default().to_ascii_uppercase();
            for word in code.split(|char: char| !char.is_ascii_alphanumeric()) {
                add(PROGRAMS_REST_ON, word);
            }
        }
    }
    assumed().filter(move |row| ids.contains(&row.id))
}

/// One row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Its id, such as `text-5`.
    pub id: &'static str,
    /// How it is known.
    pub evidence: EvidenceLevel,
    /// The questions of the catalogue that ask for it, or one of [`REASONS`].
    pub survey: &'static str,
    /// Behaviour of the emulator.
    pub behaviour: &'static str,
}

/// All rows, in the order of the page.
pub fn rows() -> impl Iterator<Item = Row> {
    page().lines().filter_map(row)
}

/// `| id | behaviour | evidence | clauses | option | survey |`
fn row(line: &'static str) -> Option<Row> {
    let (id, rest) = line.strip_prefix("| ")?.strip_suffix(" |")?.split_once(" | ")?;
    id.rsplit_once('-')?.1.parse::<u16>().ok()?;
    // From the end: a cell may hold the sign of a choice, as in `one \| several`.
    let mut cells = rest.rsplitn(5, " | ");
    let (survey, _option, _clauses) = (cells.next()?, cells.next()?, cells.next()?);
    let (evidence, behaviour) = (weakest(cells.next()?)?, cells.next()?);
    Some(Row {
        id,
        evidence,
        survey,
        behaviour,
    })
}

/// How many rows have this evidence.
pub fn count(evidence: EvidenceLevel) -> usize {
    rows().filter(|row| row.evidence == evidence).count()
}

/// The rows of which nothing is known.
pub fn assumed() -> impl Iterator<Item = Row> {
    rows().filter(|row| row.evidence == EvidenceLevel::Assumed)
}

/// The rows that remain assumed after the answers of a report.
pub fn remaining(report: &Report) -> impl Iterator<Item = Row> {
    let is_settled = |id: &str| {
        report.answers.iter().any(|answer| {
            answer.probe == id && matches!(answer.verdict, Verdict::Manual | Verdict::Variation)
        })
    };
    assumed().filter(move |row| !row.survey.split(", ").all(is_settled))
}

/// The weakest of the words in a cell, as in "stated for the SCARA (S74), inferred on six axes"; `None` without any.
fn weakest(text: &str) -> Option<EvidenceLevel> {
    // What is partly ours has no source for that part. What is assumed can still be asked of a robot, so it comes first.
    let mut weakest_first = [
        EvidenceLevel::Assumed,
        EvidenceLevel::Ours,
        EvidenceLevel::Inferred,
        EvidenceLevel::Observed,
        EvidenceLevel::Stated,
    ]
    .into_iter();
    // Whole words: `hours` says nothing of whose choice it is.
    weakest_first.find(|evidence| {
        text.split(|char: char| !char.is_ascii_alphanumeric())
            .any(|word| word == evidence.word())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue;
    use crate::report::Answer;

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
            "history-form",
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
        let count = |ids: Vec<Row>, expected: &[&str], word: &str| {
            assert_eq!(ids.len(), expected.len(), "{word}: {ids:?}");
        };
        for (word, ids) in RESTS_ON {
            count(rests_on([*word], []).collect(), ids, word);
        }
        for (word, ids) in PROGRAMS_REST_ON {
            count(rests_on([], [word.as_bytes()]).collect(), ids, word);
        }
        // Words in strings and in comments are no statements.
        for (program, expected) in [
            ("R = 1 'WAIT\nPRINT \"TASK\"", &["scol-3"][..]),
            ("R = 1 'WAIT\rPRINT \"TASK\"\r", &["scol-3"]),
            ("PRINT \"DON'T WAIT\", TIMER", &["scol-3", "scol-35"]),
        ] {
            let rows = rests_on(["SU", "VR"], [program.as_bytes()]);
            let ids: Vec<&str> = rows.map(|row| row.id).collect();
            assert_eq!(ids, expected, "{program}");
        }
    }

    #[test]
    fn a_row_with_several_questions_remains_until_each_is_settled() {
        let remains = |row: &Row, questions: &[&str]| {
            let answers = questions.iter().map(|id| {
                let probe = catalogue::find(id).unwrap();
                Answer::without(probe, Verdict::Manual, String::new())
            });
            let report = Report {
                answers: answers.collect(),
                ..Report::default()
            };
            remaining(&report).any(|other| other == *row)
        };
        let mut several = 0;
        for row in assumed().filter(|row| row.survey.contains(", ")) {
            let questions: Vec<&str> = row.survey.split(", ").collect();
            for index in 0..questions.len() {
                let mut fewer = questions.clone();
                fewer.remove(index);
                assert!(remains(&row, &fewer), "{}: {fewer:?}", row.id);
            }
            assert!(!remains(&row, &questions), "{}", row.id);
            several += 1;
        }
        assert!(several > 0);
    }

    #[test]
    fn what_is_partly_assumed_counts_as_assumed() {
        for (text, evidence) in [
            ("stated (speed), assumed", EvidenceLevel::Assumed),
            ("ours, the rest assumed", EvidenceLevel::Assumed),
            (
                "ours, but for the number: stated by the library's manual (L75)",
                EvidenceLevel::Ours,
            ),
            ("ours (every common UART)", EvidenceLevel::Ours),
            (
                "stated for the SCARA (S74), inferred on six axes",
                EvidenceLevel::Inferred,
            ),
            ("inferred from the maker (L82)", EvidenceLevel::Inferred),
            ("observed: two sources", EvidenceLevel::Observed),
            ("stated for the SCARA (S74)", EvidenceLevel::Stated),
            ("stated by the library's manual (L65)", EvidenceLevel::Stated),
            ("stated: every 24 hours", EvidenceLevel::Stated),
        ] {
            assert_eq!(weakest(text), Some(evidence), "{text}");
        }
        assert_eq!(weakest("hours 9.1"), None);
    }

    #[test]
    fn each_row_of_the_page_says_how_it_is_known() {
        let id = |line: &'static str| {
            let id = line.strip_prefix("| ")?.split(" | ").next()?;
            let (_, number) = id.rsplit_once('-')?;
            number.parse::<u16>().is_ok().then_some(id)
        };
        let known: Vec<&str> = rows().map(|row| row.id).collect();
        assert!(known.len() > 100, "{}", known.len());
        assert_eq!(page().lines().filter_map(id).collect::<Vec<_>>(), known);
    }
}
