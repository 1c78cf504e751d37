//! Findings as SARIF 2.1.0 for code-scanning viewers: every rule with its help, and each recorded finding as a result.

use super::findings::{FindingView, FindingsView};
use crate::uri;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;
use ts3100_book::explain_command;
use ts3100_controller::findings::{Findings, RULES, Rule};

/// The schema the document keeps to.
const SCHEMA: &str = "https://json.schemastore.org/sarif-2.1.0.json";

/// The document. Viewers show a result at a place in a file: `run` is the file to show for the whole run.
pub(super) fn document(findings: &Findings, run: &Path) -> Value {
    let run = uri::of_file(run);
    let rules: Vec<Value> = RULES.iter().map(|rule| descriptor(rule)).collect();
    let view = FindingsView::new(findings);
    let mut results = Vec::new();
    for broken in &view.findings {
        let index = RULES
            .iter()
            .position(|rule| rule.id == broken.rule)
            .unwrap_or_default();
        for finding in &broken.first {
            let mut result = result(broken.rule, broken.severity, index, broken.count, finding);
            // A finding is about the run as a whole: it has no line in a program or a scenario.
            result["locations"][0]["physicalLocation"] = json!({
                "artifactLocation": { "uri": run },
                "region": { "startLine": 1 },
            });
            results.push(result);
        }
    }
    json!({
        "$schema": SCHEMA,
        "version": "2.1.0",
        "runs": [{
            "tool": { "driver": {
                "name": "ts3100",
                "version": env!("CARGO_PKG_VERSION"),
                "rules": rules,
            }},
            "columnKind": "unicodeCodePoints",
            "results": results,
        }],
    })
}

fn descriptor(rule: &Rule) -> Value {
    json!({
        "id": rule.id,
        "shortDescription": { "text": rule.title },
        "fullDescription": { "text": format!("{}. Manual: {}", rule.title, rule.source) },
        "help": { "text": format!("{} See `{}`.", rule.remedy, explain_command(rule.id)) },
        "helpUri": uri::of_code(rule.id),
        "defaultConfiguration": { "level": rule.severity.as_str() },
        "properties": { "source": rule.source },
    })
}

fn result(rule: &str, level: &str, index: usize, count: u64, finding: &FindingView) -> Value {
    let port = finding.port.unwrap_or("controller");
    let mut properties =
        json!({ "t": finding.t, "bytes": finding.bytes, "text": finding.text, "count": count });
    let mut message = format!("{port} at {:.3} s: {}", finding.t, finding.message);
    if let Some(cause) = &finding.caused_by {
        properties["caused-by"] = cause.as_str().into();
        let _ = write!(message, " (caused-by: {cause})");
    }
    json!({
        "ruleId": rule,
        "ruleIndex": index,
        "level": level,
        "message": { "text": message },
        "locations": [{ "logicalLocations": [{ "name": port, "kind": "resource" }] }],
        "properties": properties,
    })
}
