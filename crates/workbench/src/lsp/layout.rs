//! The form of a file: formatting, lines that fold, tokens in colours.

use super::document::Document;
use scol_mini::WordKind;
use scol_mini::editor::{MarkKind, Role, SymbolKind};
use serde_json::{Value, json};
use similar::{Algorithm, DiffTag, capture_diff_slices};
use std::collections::BTreeSet;

/// Types of tokens; the names are those of the protocol, `label` too.
const TYPES: [&str; 13] = [
    "keyword",
    "function",
    "variable",
    "parameter",
    "property",
    "label",
    "string",
    "number",
    "operator",
    "comment",
    "type",
    "enumMember",
    "struct",
];
const MODIFIERS: [&str; 4] = ["declaration", "modification", "readonly", "defaultLibrary"];
const DECLARATION: u32 = 1;
const MODIFICATION: u32 = 1 << 1;
const READONLY: u32 = 1 << 2;
const LIBRARY: u32 = 1 << 3;

/// The edits that format a file: the lines that change, so that cursors in others stay.
pub(super) fn formatting(document: &Document) -> Value {
    let old = document.source();
    let new = scol_mini::format(old);
    let lines: Vec<&str> = old.split_inclusive('\n').collect();
    let laid: Vec<&str> = new.split_inclusive('\n').collect();
    let length = |lines: Option<&[&str]>| {
        lines
            .unwrap_or_default()
            .iter()
            .map(|line| line.len())
            .sum::<usize>()
    };
    let ops = capture_diff_slices(Algorithm::Myers, &lines, &laid);
    let edits = ops.iter().filter(|op| op.tag() != DiffTag::Equal).map(|op| {
        let start = length(lines.get(..op.old_range().start));
        let end = start + length(lines.get(op.old_range()));
        let text = laid.get(op.new_range()).unwrap_or_default().concat();
        json!({ "range": document.text.span(start..end), "newText": text })
    });
    Value::Array(edits.collect())
}

/// Blocks, loops, and comments of several lines.
pub(super) fn folding(document: &Document) -> Value {
    let index = document.index();
    let blocks = index
        .blocks()
        .iter()
        .map(|block| (*block.lines.start(), *block.lines.end(), "region"));
    let comments = index.comment_runs(document.source());
    let comments = comments.into_iter().map(|(first, last)| (first, last, "comment"));
    let folds = blocks.chain(comments).filter(|(first, last, _)| first < last);
    let folds =
        folds.map(|(first, last, kind)| json!({ "startLine": first - 1, "endLine": last - 1, "kind": kind }));
    Value::Array(folds.collect())
}

pub(super) fn legend() -> Value {
    json!({ "tokenTypes": TYPES, "tokenModifiers": MODIFIERS })
}

/// The tokens of a file, each relative to the one before it.
pub(super) fn tokens(document: &Document) -> Value {
    let index = document.index();
    let places: BTreeSet<(usize, bool)> = index
        .uses()
        .iter()
        .filter(|found| found.role != Role::Read)
        .map(|found| (found.span.start, found.role == Role::Declaration))
        .collect();
    let mut data: Vec<u32> = Vec::new();
    let (mut line, mut column) = (0, 0);
    for mark in index.marks() {
        let Some((kind, mut modifiers)) = token(document, mark.kind, document.text_of(mark.span)) else {
            continue;
        };
        if places.contains(&(mark.span.start, true)) {
            modifiers |= DECLARATION;
        } else if places.contains(&(mark.span.start, false)) {
            modifiers |= MODIFICATION;
        }
        let at = document.text.position(mark.span.start);
        let length = document.text.units().length(document.text_of(mark.span));
        if at.line != line {
            column = 0;
        }
        let kind = TYPES.iter().position(|known| *known == kind).unwrap_or(0);
        data.extend([
            at.line - line,
            at.character - column,
            super::text::number(length),
            super::text::number(kind),
            modifiers,
        ]);
        (line, column) = (at.line, at.character);
    }
    json!({ "data": data })
}

/// Type and modifiers of a token; none for one that stays as it is.
fn token(document: &Document, kind: MarkKind, text: &str) -> Option<(&'static str, u32)> {
    Some(match kind {
        MarkKind::Comment => ("comment", 0),
        MarkKind::Text => ("string", 0),
        MarkKind::Number => ("number", 0),
        MarkKind::Sign => {
            let is_operator = !text.chars().all(|sign| "(){},.:".contains(sign));
            return is_operator.then_some(("operator", 0));
        }
        MarkKind::Property => ("property", 0),
        MarkKind::Type => ("type", 0),
        MarkKind::Word(word) => match word {
            WordKind::Declaration | WordKind::Flow | WordKind::Statement | WordKind::Remark => ("keyword", 0),
            WordKind::Operator => ("operator", 0),
            WordKind::Channel => ("enumMember", LIBRARY),
            WordKind::Function => ("function", LIBRARY),
            WordKind::Variable => ("variable", LIBRARY | READONLY),
            WordKind::Condition => ("variable", LIBRARY),
            WordKind::Constant => ("enumMember", LIBRARY | READONLY),
        },
        MarkKind::Name(symbol) => {
            let symbol = document.index().symbols().get(symbol)?;
            match symbol.kind {
                // One that is not declared is a misspelt statement.
                SymbolKind::Program => return symbol.declared.map(|_| ("function", 0)),
                SymbolKind::Label => ("label", 0),
                SymbolKind::Parameter => ("parameter", 0),
                SymbolKind::Local | SymbolKind::Global => ("variable", 0),
                SymbolKind::Data => ("struct", 0),
                SymbolKind::Taught => ("struct", READONLY),
            }
        }
    })
}
