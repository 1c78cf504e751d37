//! The questions of `ts3100 survey`, and the counts of docs/explanation/fidelity.md.

use super::{code, table};
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
         [Fidelity](docs/explanation/fidelity.md) lists them. [Tell us how your robot answers](docs/how-to/survey.md).",
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
