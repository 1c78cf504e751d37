//! The findings of a run as Markdown, for the summary of a CI job: the mistakes of a host, their remedies, and the
//! coverage of the protocol.

use super::{CoverageReport, FindingsView};
use std::fmt::Write as _;

pub(super) fn document(findings: &FindingsView, coverage: &CoverageReport) -> String {
    let mut out = String::from("## Robot\n\n");
    if findings.findings.is_empty() {
        out += "No protocol mistakes.\n";
    } else {
        out += "| Finding | Times | What the host did | What to do |\n|---|---|---|---|\n";
    }
    for broken in &findings.findings {
        let first = broken.first.first();
        let example = first.map_or_else(String::new, |first| {
            let port = first.port.unwrap_or("controller");
            let cause = first.caused_by.as_ref();
            let cause = cause.map_or_else(String::new, |cause| format!(" (caused-by: {cause})"));
            format!("<br>{port} at {:.3} s: {}{cause}", first.t, cell(&first.message))
        });
        let (rule, severity) = (broken.rule, broken.severity);
        // Writing to a String does not fail.
        let _ = writeln!(
            out,
            "| `{rule}` ({severity}) | {} | {}{example} | {} |",
            broken.count,
            cell(broken.title),
            cell(broken.remedy)
        );
    }
    if !findings.findings.is_empty() {
        out += "\n`ts3100 explain FINDING` explains a finding.\n";
    }
    let _ = writeln!(
        out,
        "\n{} % of the permission tables covered: {} of {} cells.",
        coverage.percent, coverage.reached, coverage.reachable
    );
    if !findings.assumptions.is_empty() {
        out += "\nThis run relied on unverified assumptions:\n\n";
    }
    for row in &findings.assumptions {
        let _ = writeln!(out, "- {}: {}", row.id, row.behaviour);
    }
    out
}

/// Text in a cell of a table.
fn cell(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('|', "\\|")
        .replace(['\r', '\n'], " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_stays_one() {
        assert_eq!(cell("a | <STX>\nb"), "a \\| &lt;STX> b");
    }
}
