//! Diagnostics as messages, and the fixes that they offer.

use super::document::Document;
use super::text::{Position, Span, Text};
use crate::rpc;
use scol_mini::editor::MarkKind;
use scol_mini::{Diagnostic, Edit, Severity};
use serde_json::{Value, json};
use ts3100_book::explain_command;
use ts3100_recording::uri;

pub(super) const QUICK_FIX: &str = "quickfix";
/// Every fix of a file at once; editors carry it out when a file is saved, if they are told to.
pub(super) const FIX_ALL: &str = "source.fixAll.ts3100";
/// A file without a PROGRAM.
const NO_PROGRAM: &str = "E0304";
/// What editors show as the origin of a diagnostic.
const SOURCE: &str = "ts3100";
/// Warnings about what nothing uses; editors show it faded.
const UNUSED: [&str; 6] = ["W0603", "W0604", "W0605", "W0606", "W0607", "W0611"];

pub(super) fn published(uri: &str, version: Option<i64>, diagnostics: &[Value]) -> Value {
    let mut params = json!({ "uri": uri, "diagnostics": diagnostics });
    if let Some(version) = version {
        params["version"] = version.into();
    }
    rpc::notification("textDocument/publishDiagnostics", &params)
}

/// The diagnostics of a file. `explanation` gives the address of the page that explains a code.
pub(super) fn diagnostics(document: &Document, explanation: impl Fn(&str) -> Option<String>) -> Vec<Value> {
    // A file that is just begun lacks its PROGRAM, as everybody sees.
    let is_begun = document
        .index()
        .marks()
        .iter()
        .all(|mark| mark.kind == MarkKind::Comment);
    let found = document.diagnostics().iter();
    found
        .filter(|found| !is_begun || found.code != NO_PROGRAM)
        .map(|diagnostic| {
            let mut value = diagnostic_json(document, diagnostic);
            if let Some(address) = explanation(diagnostic.code) {
                value["codeDescription"] = json!({ "href": address });
            }
            value
        })
        .collect()
}

fn diagnostic_json(document: &Document, diagnostic: &Diagnostic) -> Value {
    let message = match &diagnostic.help {
        Some(help) => format!("{}\nhelp: {help}", diagnostic.message),
        None => diagnostic.message.clone(),
    };
    let mut value = json!({
        "range": document.text.span(diagnostic.bytes(document.source())),
        "severity": match diagnostic.severity {
            Severity::Error => 1,
            Severity::Warning => 2,
        },
        "code": diagnostic.code,
        "source": SOURCE,
        "message": message,
        "data": explain_command(diagnostic.code),
    });
    if UNUSED.contains(&diagnostic.code) {
        value["tags"] = json!([1]);
    }
    value
}

/// The address of the table of points of a file, with the error in it.
pub(super) fn table_diagnostic(document: &Document) -> Option<(String, Vec<Value>)> {
    let table = &document.table;
    let address = uri::of_file(table.path.as_ref()?);
    let Some(error) = &table.error else {
        return Some((address, Vec::new()));
    };
    let text = Text::new(table.text.clone(), document.text.units());
    let line = super::text::number(error.line.saturating_sub(1));
    // The column counts characters, which in a table of points are ASCII or part of an error.
    let start = Position {
        line,
        character: super::text::number(error.column.saturating_sub(1)),
    };
    let end = text.position(text.byte(Position {
        line,
        character: u32::MAX,
    }));
    let message = format!(
        "expected {}, found {}; no point of this table is used",
        error.expected, error.found
    );
    let diagnostic = json!({
        "range": Span { start: start.min(end), end },
        "severity": 1,
        "source": SOURCE,
        "message": message,
    });
    Some((address, vec![diagnostic]))
}

/// The fixes of the diagnostics in a part of a file, and one of all.
pub(super) fn actions(document: &Document, range: Span, only: Option<&[Value]>) -> Value {
    let mut asked = document.text.bytes(range);
    if asked.is_empty() {
        // A cursor asks for its line.
        let (_, line) = document.index().line_of(asked.start);
        asked = line.start.min(asked.start)..line.end.max(asked.end);
    }
    let is_asked_for = |kind: &str| {
        only.is_none_or(|only| {
            let mut wanted = only.iter().filter_map(Value::as_str);
            wanted.any(|wanted| {
                kind.strip_prefix(wanted)
                    .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
            })
        })
    };
    let fixes = document
        .diagnostics()
        .iter()
        .filter_map(|found| Some((found, found.fix.as_deref()?)));
    let mut actions: Vec<Value> = Vec::new();
    for (diagnostic, edit) in fixes.clone().filter(|_| is_asked_for(QUICK_FIX)) {
        let place = diagnostic.bytes(document.source());
        if place.start <= asked.end && asked.start <= place.end {
            actions.push(json!({
                "title": capitalised(&edit.title(document.source())),
                "kind": QUICK_FIX,
                "diagnostics": [diagnostic_json(document, diagnostic)],
                "isPreferred": edit.is_certain,
                "edit": workspace_edit(document, [edit]),
            }));
        }
    }
    // Two that touch the same place cannot be carried out together; what is left is fixed by the next.
    let mut all: Vec<&Edit> = fixes
        .map(|(_, edit)| edit)
        .filter(|edit| edit.is_certain)
        .collect();
    all.sort_by_key(|edit| (edit.span.start, edit.span.end));
    let mut end = 0;
    all.retain(|edit| {
        let is_apart = edit.span.start >= end;
        if is_apart {
            end = edit.span.end.max(edit.span.start + 1);
        }
        is_apart
    });
    // In the menu of a place it stands beside the fix of that place, and does more.
    let is_more = only.is_some() || !actions.is_empty() && all.len() > 1;
    if is_asked_for(FIX_ALL) && is_more && !all.is_empty() {
        actions.push(json!({
            "title": format!("Fix all that can be fixed ({})", all.len()),
            "kind": FIX_ALL,
            "edit": workspace_edit(document, all),
        }));
    }
    Value::Array(actions)
}

fn workspace_edit<'e>(document: &Document, edits: impl IntoIterator<Item = &'e Edit>) -> Value {
    let edits = edits.into_iter().map(|edit| {
        let range = document.text.span(edit.span.start..edit.span.end);
        json!({ "range": range, "newText": edit.text })
    });
    let edits: Vec<Value> = edits.collect();
    json!({ "changes": { document.uri.as_str(): edits } })
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters
        .next()
        .map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
