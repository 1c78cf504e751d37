//! The questions of `ts3100 survey`, and the counts of docs/explanation/fidelity.md.

use super::{code, table};
use std::collections::BTreeMap;
use ts3100_controller::findings::RULES;
use ts3100_proto::words::Word as _;
use ts3100_survey::ledger::{self, EvidenceLevel, REASONS};
use ts3100_survey::{Class, catalogue};

/// A table of questions for each class.
pub(super) fn questions() -> String {
    let sections = Class::ALL.iter().map(|class| {
        let probes = catalogue::probes().filter(|probe| probe.class == *class);
        let rows = probes.map(|probe| {
            let option = match probe.decides {
                None => "-".to_owned(),
                Some((option, _)) => format!("[{}](options.md#{option})", code(option)),
            };
            let known = ledger::rows().filter(|row| row.survey.split(", ").any(|id| id == probe.id));
            let known: Vec<&str> = known.map(|row| row.id).collect();
            [
                code(probe.id),
                probe.question.to_owned(),
                probe.sends.replace('<', "\\<"),
                option,
                known.join(", "),
            ]
        });
        let heading = class.word();
        format!(
            "### {heading}\n\n{}",
            table(["Name", "Question", "Sends", "Decides", "Row"], rows)
        )
    });
    sections.collect::<Vec<_>>().join("\n\n")
}

/// How many rows have which evidence.
pub(super) fn evidence() -> String {
    let rows = EvidenceLevel::ALL
        .iter()
        .map(|level| [level.word().to_owned(), ledger::count(*level).to_string()]);
    table(["Evidence", "Rows"], rows)
}

/// Subjects of the decisions of this project that findings name.
const DECISIONS: [(&str, &str); 5] = [
    (
        "D0",
        "What the manual and real hosts do not agree on is a named option, which a dialect presets",
    ),
    (
        "D2",
        "Form of texts: framing, end of a file, checksum, time limits",
    ),
    (
        "D3",
        "Connections: one peer a channel, keepalive, dialing of a client",
    ),
    (
        "D4",
        "Permissions: the tables as printed, and rows for the commands that they do not have",
    ),
    (
        "D10",
        "Buffer of a SCOL channel: its size, when it is cleared, ends of a record",
    ),
];

/// Source of a decision.
const OURS: &str = "this project";

/// The clauses and decisions that the sources of findings name, with those findings.
pub(super) fn clauses() -> String {
    let stated: BTreeMap<&str, (&str, &str)> = include_str!("../../../docs/clauses.tsv")
        .lines()
        .filter_map(|line| {
            let mut columns = line.split('\t');
            Some((columns.next()?, (columns.next()?, columns.next()?)))
        })
        .collect();
    let decided = DECISIONS.map(|(id, subject)| (id, (OURS, subject)));
    let known: BTreeMap<&str, (&str, &str)> = stated.into_iter().chain(decided).collect();
    let mut named: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for rule in RULES {
        for id in rule.clauses() {
            named.entry(id).or_default().push(code(rule.id));
        }
    }
    let rows = named.into_iter().map(|(id, rules)| {
        let (section, subject) = known.get(id).unwrap_or_else(|| panic!("{id}: no such clause"));
        // Lines of the text of the manual in brackets: nobody else has them.
        let section = section.split(" (").next().unwrap_or_default();
        let section = match section.starts_with("decisions.md") {
            true => OURS,
            false => section,
        };
        [
            code(id),
            section.to_owned(),
            (*subject).to_owned(),
            rules.join(", "),
        ]
    });
    table(["Clause", "Section", "Subject", "Findings"], rows)
}

/// What is proven and what is assumed, for the first page.
pub(super) fn trust() -> String {
    let clauses = include_str!("../../../docs/clauses.tsv").lines().skip(1);
    let (all, tested) = clauses.fold((0, 0), |(all, tested), line| {
        (all + 1, tested + u32::from(line.contains("::")))
    });
    let count = ledger::count;
    let rows: usize = EvidenceLevel::ALL.iter().map(|level| count(*level)).sum();
    let known =
        count(EvidenceLevel::Stated) + count(EvidenceLevel::Observed) + count(EvidenceLevel::Inferred);
    format!(
        "**Proven and assumed.** {tested} of {all} statements of the maker's manuals and of real hosts have a test. Beyond them the emulator has to\n\
         decide {rows} points: {known} are stated elsewhere, observed or inferred, {} are assumed and {} are ours. `ts3100 fidelity` counts them, and\n\
         [Fidelity](docs/explanation/fidelity.md) lists them. [Trust](docs/explanation/trust.md) has the checks and their commands. [Tell us how your robot answers](docs/how-to/survey.md).",
        count(EvidenceLevel::Assumed),
        count(EvidenceLevel::Ours),
    )
}

/// Why a row has no question.
pub(super) fn reasons() -> String {
    let rows = REASONS
        .iter()
        .map(|(word, reason)| [code(word), (*reason).to_owned()]);
    table(["Survey", "Why there is no question"], rows)
}
