//! Findings as SARIF 2.1.0 for code-scanning viewers: every rule with its help, and each recorded finding as a result.

use super::findings::{FindingView, FindingsView};
use crate::book;
use serde_json::{Value, json};
use ts3100_controller::findings::{Findings, RULES, Rule};

/// The schema the document keeps to.
const SCHEMA: &str = "https://json.schemastore.org/sarif-2.1.0.json";

/// The document.
pub(super) fn document(findings: &Findings) -> Value {
    let rules: Vec<Value> = RULES.iter().map(|rule| descriptor(rule)).collect();
    let view = FindingsView::new(findings);
    let mut results = Vec::new();
    for broken in &view.findings {
        let index = RULES
            .iter()
            .position(|rule| rule.id == broken.rule)
            .unwrap_or_default();
        for finding in &broken.first {
            results.push(result(broken.rule, broken.severity, index, broken.count, finding));
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
        "help": { "text": rule.remedy },
        "helpUri": book::finding(rule),
        "defaultConfiguration": { "level": rule.severity.as_str() },
        "properties": { "source": rule.source },
    })
}

fn result(rule: &str, level: &str, index: usize, count: u64, finding: &FindingView) -> Value {
    let port = finding.port.unwrap_or("controller");
    json!({
        "ruleId": rule,
        "ruleIndex": index,
        "level": level,
        "message": { "text": format!("{port} at {:.6} s: {}", finding.t, finding.message) },
        "locations": [{ "logicalLocations": [{ "name": port, "kind": "resource" }] }],
        "properties": { "t": finding.t, "bytes": finding.bytes, "text": finding.text, "count": count },
    })
}
