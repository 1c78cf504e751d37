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

/// Why a row has no question.
pub(super) fn reasons() -> String {
    let rows = REASONS
        .iter()
        .map(|(word, reason)| [code(word), (*reason).to_owned()]);
    table(["Survey", "Why there is no question"], rows)
}
