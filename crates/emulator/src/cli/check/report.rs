//! The diagnostics of `ts3100 check` as documents: plain JSON, and SARIF 2.1.0 (OASIS).
//!
//! Positions are converted from the compiler's bytes to the characters that editors and code hosts count. Which
//! diagnostics exist is decided in `scol-mini`; the text form is in [`super`].

use super::CheckedFile;
use scol_mini::{Diagnostic, DiagnosticKind, Edit, Severity};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::Path;
use ts3100_book::{PLAIN, book, explain_command};
use ts3100_recording::uri;

/// Width of the lines of a text of SARIF.
const HELP_WIDTH: usize = 100;

/// The JSON document: files in the order given, each with its remarks in the order of the source.
pub(super) fn json(files: &[CheckedFile]) -> Value {
    let count = |severity| remarks(files).filter(|(_, _, d)| d.severity == severity).count();
    json!({
        "version": 1,
        "errors": count(Severity::Error),
        "warnings": count(Severity::Warning),
        "files": files.iter().map(file_json).collect::<Vec<_>>(),
    })
}

/// Every remark with the name and the source of its file.
fn remarks(files: &[CheckedFile]) -> impl Iterator<Item = (&str, &str, &Diagnostic)> {
    files.iter().flat_map(|file| {
        let read = file.result.iter();
        read.flat_map(|(source, remarks)| remarks.iter().map(|d| (file.name.as_str(), source.as_str(), d)))
    })
}

fn file_json(file: &CheckedFile) -> Value {
    match &file.result {
        Err(error) => json!({ "file": file.name, "unreadable": error.to_string() }),
        Ok((source, remarks)) => json!({
            "file": file.name,
            "diagnostics": remarks.iter().map(|d| diagnostic_json(d, source)).collect::<Vec<_>>(),
        }),
    }
}

fn diagnostic_json(diagnostic: &Diagnostic, source: &str) -> Value {
    let place = diagnostic.columns(source);
    json!({
        "severity": diagnostic.severity.as_str(),
        "code": diagnostic.code,
        "docs": DiagnosticKind::by_code(diagnostic.code).map(|kind| explain_command(kind.code)),
        "message": diagnostic.message,
        "help": diagnostic.help,
        "fix": diagnostic.fix.as_ref().map(|fix| json!({
            "title": fix.title(source),
            "offset": fix.span.start,
            "length": fix.span.end.saturating_sub(fix.span.start),
            "text": fix.text,
            "certain": fix.is_certain,
        })),
        "line": diagnostic.line,
        "column": place.start,
        "endColumn": place.end,
        "offset": diagnostic.span.start,
        "length": diagnostic.span.end.saturating_sub(diagnostic.span.start),
    })
}

/// The SARIF document: one run, a rule for every code that occurs, a notification for every file that cannot be
/// read.
pub(super) fn sarif(files: &[CheckedFile]) -> Value {
    let rules: BTreeSet<&str> = remarks(files).map(|(_, _, d)| d.code).collect();
    let index = |code: &str| rules.iter().position(|rule| *rule == code);
    let results: Vec<Value> = remarks(files)
        .map(|(name, source, d)| sarif_result(name, source, d, index(d.code)))
        .collect();
    let unreadable: Vec<Value> = files
        .iter()
        .filter_map(|file| Some((&file.name, file.result.as_ref().err()?)))
        .map(|(name, error)| {
            json!({
                "level": "error",
                "message": { "text": error.to_string() },
                "locations": [{ "physicalLocation": { "artifactLocation": { "uri": uri::of_file(Path::new(name)) } } }],
            })
        })
        .collect();
    json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{
            "tool": { "driver": {
                "name": "ts3100 check",
                "semanticVersion": env!("CARGO_PKG_VERSION"),
                "rules": rules.iter().map(|code| sarif_rule(code)).collect::<Vec<_>>(),
            } },
            "columnKind": "unicodeCodePoints",
            "invocations": [{
                "executionSuccessful": unreadable.is_empty(),
                "toolExecutionNotifications": unreadable,
            }],
            "results": results,
        }],
    })
}

fn sarif_rule(code: &str) -> Value {
    let Some(kind) = DiagnosticKind::by_code(code) else {
        return json!({ "id": code });
    };
    json!({
        "id": code,
        "name": kind.name,
        "shortDescription": { "text": kind.title },
        "fullDescription": { "text": kind.title },
        "helpUri": uri::of_code(kind.code),
        "help": { "text": explanation(kind) },
        "defaultConfiguration": { "level": kind.severity.as_str() },
    })
}

/// What the documentation says of a kind, as text.
fn explanation(kind: &DiagnosticKind) -> String {
    let book = book();
    let passages = book.explain(kind.code);
    let texts = passages
        .iter()
        .map(|passage| passage.terminal(HELP_WIDTH, &PLAIN));
    texts.collect::<Vec<_>>().join("\n")
}

fn sarif_result(name: &str, source: &str, diagnostic: &Diagnostic, rule: Option<usize>) -> Value {
    let place = diagnostic.columns(source);
    let text = match &diagnostic.help {
        Some(help) => format!("{} (help: {help})", diagnostic.message),
        None => diagnostic.message.clone(),
    };
    let mut result = json!({
        "ruleId": diagnostic.code,
        "ruleIndex": rule,
        "level": diagnostic.severity.as_str(),
        "message": { "text": text },
        "locations": [{ "physicalLocation": {
            "artifactLocation": { "uri": uri::of_file(Path::new(name)) },
            "region": {
                "startLine": diagnostic.line,
                "startColumn": place.start,
                "endColumn": place.end,
            },
        } }],
    });
    // Viewers may carry all fixes of a document out at once.
    if let Some(fix) = diagnostic.fix.as_ref().filter(|fix| fix.is_certain) {
        result["fixes"] = json!([{
            "description": { "text": fix.title(source) },
            "artifactChanges": [{
                "artifactLocation": { "uri": uri::of_file(Path::new(name)) },
                "replacements": [{
                    "deletedRegion": fix_region(source, fix),
                    "insertedContent": { "text": fix.text },
                }],
            }],
        }]);
    }
    result
}

/// The place that a fix replaces, in characters, which `columnKind` promises.
fn fix_region(source: &str, fix: &Edit) -> Value {
    let characters = |range: std::ops::Range<usize>| source.get(range).map_or(0, |text| text.chars().count());
    json!({
        "charOffset": characters(0..fix.span.start),
        "charLength": characters(fix.span.start..fix.span.end),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(source: &str) -> Vec<CheckedFile> {
        let remarks = scol_mini::check(source, &scol_mini::LanguageOptions::default()).diagnostics;
        vec![
            CheckedFile {
                name: "a b/pick.scol".to_owned(),
                result: Ok((source.to_owned(), remarks)),
            },
            CheckedFile {
                name: "gone.scol".to_owned(),
                result: Err(std::io::Error::other("not there")),
            },
        ]
    }

    #[test]
    fn json_names_places_in_characters() {
        let found = json(&files("PROGRAM T\nN = 1 ' \u{e9}\nMOV N\nEND\n"));
        assert_eq!(found["errors"], 2);
        let first = &found["files"][0]["diagnostics"][0];
        assert_eq!((&first["code"], &first["column"]), (&json!("E0004"), &json!(9)));
        assert_eq!((&first["endColumn"], &first["length"]), (&json!(10), &json!(2)));
        let second = &found["files"][0]["diagnostics"][1];
        assert_eq!(second["help"], "did you mean MOVE?");
        let fix = json!({
            "title": "replace MOV by MOVE", "offset": 21, "length": 3, "text": "MOVE", "certain": true
        });
        assert_eq!(second["fix"], fix);
        assert_eq!(first["fix"], Value::Null);
        assert_eq!(found["files"][1]["unreadable"], "not there");
    }

    #[test]
    fn a_guessed_name_is_no_fix_of_sarif() {
        let files = files("PROGRAM T\n  MOVE HOEM\nEND\nDATA\n  POINT HOME=1/\nEND\n");
        let json = json(&files);
        let fix = &json["files"][0]["diagnostics"][0]["fix"];
        assert_eq!((&fix["text"], &fix["certain"]), (&json!("HOME"), &json!(false)));
        let sarif = sarif(&files);
        let result = &sarif["runs"][0]["results"][0];
        let text = result["message"]["text"].as_str().unwrap();
        assert!(text.contains("did you mean HOME?"), "{text}");
        assert_eq!(result["fixes"], Value::Null);
    }

    #[test]
    fn sarif_has_the_structure_of_2_1_0() {
        let found = sarif(&files("PROGRAM T\n  N = 1\n  MOV N\nEND\n"));
        assert_eq!(found["version"], "2.1.0");
        let run = &found["runs"][0];
        let rules = run["tool"]["driver"]["rules"].as_array().unwrap();
        for result in run["results"].as_array().unwrap() {
            let index = usize::try_from(result["ruleIndex"].as_u64().unwrap()).unwrap();
            assert_eq!(rules[index]["id"], result["ruleId"]);
            assert_eq!(rules[index]["helpUri"], "urn:ts3100:explain:E0103");
            let place = &result["locations"][0]["physicalLocation"];
            assert_eq!(place["artifactLocation"]["uri"], "a%20b/pick.scol");
            assert!(place["region"]["startLine"].as_u64().unwrap() >= 1);
            assert!(place["region"]["endColumn"].as_u64() >= place["region"]["startColumn"].as_u64());
        }
        assert_eq!(run["results"].as_array().unwrap().len(), 1);
        let fix = &run["results"][0]["fixes"][0];
        assert_eq!(fix["description"]["text"], "replace MOV by MOVE");
        let replacement = &fix["artifactChanges"][0]["replacements"][0];
        assert_eq!(
            replacement["deletedRegion"],
            json!({ "charOffset": 20, "charLength": 3 })
        );
        assert_eq!(replacement["insertedContent"]["text"], "MOVE");
        assert_eq!(run["invocations"][0]["executionSuccessful"], false);
    }
}
