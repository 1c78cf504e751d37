//! What a word, a name, a line or an alarm means, as Markdown; the operands of a call; the values of points beside their names.
//!
//! The words of the language come from the tables of the book, so that hover and reference say the same.

use super::document::Document;
use scol_mini::editor::{BlockKind, Call, Mark, MarkKind, Symbol, SymbolKind};
use scol_mini::{TaughtPoint, WordKind, word_kind};
use serde_json::{Value, json};
use std::ops::Range;
use ts3100_book::book;
use ts3100_controller::{IoKind, line_name};

/// Functions and statements whose numbers are digital lines.
const INPUTS: &[&str] = &["DIN", "BCDIN"];
const OUTPUTS: &[&str] = &["DOUT", "PULOUT", "BCDOUT"];
/// Most comments on a line of the controller that are shown.
const MAX_COMMENTS: usize = 5;

pub(super) fn hover(document: &Document, byte: usize) -> Value {
    let found = alarm(document, byte).or_else(|| {
        let mark = *document.index().mark_at(byte)?;
        let text = described(document, &mark)?;
        Some((mark.span.start..mark.span.end, text))
    });
    found.map_or(Value::Null, |(place, text)| {
        json!({
            "contents": { "kind": "markdown", "value": text },
            "range": document.text.span(place),
        })
    })
}

fn described(document: &Document, mark: &Mark) -> Option<String> {
    match mark.kind {
        // The other ON is a constant.
        MarkKind::Word(WordKind::Flow) if document.text_of(mark.span).eq_ignore_ascii_case("ON") => {
            let (form, effect) = book().call_forms("ON").into_iter().next()?;
            Some(format!("`{form}`  \n{effect}"))
        }
        MarkKind::Word(_) | MarkKind::Type => {
            book().language_word(&document.text_of(mark.span).to_ascii_uppercase())
        }
        MarkKind::Name(symbol) => name(document, document.index().symbols().get(symbol)?),
        MarkKind::Number => line(document, mark),
        // TASK("NAME") names a program.
        MarkKind::Text => name(document, document.symbol_at(mark.span.start + 1)?.0),
        MarkKind::Comment | MarkKind::Sign | MarkKind::Property => None,
    }
}

/// The alarm whose number is at a place, in a comment as well.
fn alarm(document: &Document, byte: usize) -> Option<(Range<usize>, String)> {
    let source = document.source();
    let is_part = |letter: char| letter.is_ascii_digit() || letter == '-';
    let before = source.get(..byte)?;
    let start = before.trim_end_matches(is_part).len();
    let after = source.get(byte..)?;
    let end = source.len() - after.trim_start_matches(is_part).len();
    let number = source.get(start..end)?;
    let (level, rest) = number.split_once('-')?;
    if level.is_empty() || rest.len() != 3 {
        return None;
    }
    Some((start..end, book().alarm(number)?))
}

/// A name: its kind, its declaration, and the comments above that.
pub(super) fn name(document: &Document, symbol: &Symbol) -> Option<String> {
    // A program that is not declared is a misspelt statement.
    if symbol.kind == SymbolKind::Program && symbol.declared.is_none() {
        return None;
    }
    let scope = symbol.scope.as_deref().unwrap_or_default();
    let kind = match symbol.kind {
        SymbolKind::Program => "program".to_owned(),
        SymbolKind::Label => format!("label of {scope}"),
        SymbolKind::Parameter => format!("parameter of {scope}"),
        SymbolKind::Local => format!("variable of {scope}"),
        SymbolKind::Global => "variable of all programs (GLOBAL)".to_owned(),
        SymbolKind::Data => "data of the file".to_owned(),
        SymbolKind::Taught => "point that is taught on the controller".to_owned(),
    };
    let mut text = format!("**{}**: {kind}", symbol.name);
    if symbol.kind == SymbolKind::Taught {
        let table = document.table.path.as_ref().and_then(|path| path.file_name());
        let table = table.map_or_else(String::new, |name| format!(", from {}", name.to_string_lossy()));
        let values = taught(document, &symbol.name).map_or_else(String::new, values_of);
        text += &format!("{table}\n\n`{}` = `{values}`", symbol.name);
    }
    if let Some(line) = document.declaration(symbol) {
        text += &format!("\n\n```scol\n{line}\n```");
    }
    let line = symbol
        .declared
        .map_or(0, |declared| document.index().line_of(declared.start).0);
    let comments = document.index().comments_above(document.source(), line);
    if !comments.is_empty() {
        text += &format!("\n\n{}", comments.join("  \n"));
    }
    Some(text)
}

fn taught<'d>(document: &'d Document, name: &str) -> Option<&'d TaughtPoint> {
    document.table.points.iter().find(|point| point.name == name)
}

fn values_of(point: &TaughtPoint) -> String {
    let mut values: Vec<String> = point.position.coords.iter().map(f64::to_string).collect();
    // What is left out is 0.
    while values.len() > 3 && values.last().is_some_and(|value| value == "0") {
        values.pop();
    }
    values.join(",")
}

/// An input or output whose number is at this place: its name on the controller, and comments that speak of it.
fn line(document: &Document, mark: &Mark) -> Option<String> {
    let number: u16 = document.text_of(mark.span).parse().ok()?;
    let Call { name, operand } = document.context(mark.span.start).call?;
    let (kind, direction, words) = match name.as_str() {
        "DIN" | "BCDIN" => (IoKind::Input, "input", INPUTS),
        "DOUT" | "PULOUT" | "BCDOUT" => (IoKind::Output, "output", OUTPUTS),
        _ => return None,
    };
    // Further operands of the others are digits, values and seconds.
    if operand > 0 && !matches!(name.as_str(), "DIN" | "DOUT") {
        return None;
    }
    let system = line_name(kind, number).map_or_else(String::new, |name| format!(", `{name}`"));
    let mut text = format!("**{name}({number})**: {direction} {number}{system}");
    let comments = document.index().comments_on(document.source(), words, number);
    if system.is_empty() && comments.is_empty() {
        return None;
    }
    for (line, comment) in comments.into_iter().take(MAX_COMMENTS) {
        text += &format!("\n\nline {line}: {comment}");
    }
    Some(text)
}

pub(super) fn signature_help(document: &Document, byte: usize) -> Value {
    let index = document.index();
    let Some(Call { name, operand }) = document.context(byte).call else {
        return Value::Null;
    };
    let headings = index.blocks().iter().filter_map(|block| match &block.kind {
        BlockKind::Program(heading) => Some(heading),
        BlockKind::Global | BlockKind::Data | BlockKind::Loop => None,
    });
    let own = headings.filter(|heading| heading.split('(').next() == Some(name.as_str()));
    let mut found: Vec<(String, String)> = own.map(|heading| (heading.clone(), String::new())).collect();
    if word_kind(&name, document.arm()).is_some() {
        found.extend(
            book()
                .call_forms(&name)
                .into_iter()
                .filter(|(form, _)| form.contains('(')),
        );
    }
    if found.is_empty() {
        return Value::Null;
    }
    let signatures: Vec<Value> = found
        .iter()
        .map(|(form, effect)| {
            let parameters = operands(form);
            // `...` stands for more of the last.
            let is_open = parameters.last().is_some_and(|last| last == "...");
            let active = if is_open {
                operand.min(parameters.len() - 1)
            } else {
                operand
            };
            json!({
                "label": form,
                "documentation": { "kind": "markdown", "value": effect },
                "parameters": parameters.iter().map(|label| json!({ "label": label })).collect::<Vec<_>>(),
                "activeParameter": active,
            })
        })
        .collect();
    let active = signatures
        .first()
        .map_or(Value::Null, |first| first["activeParameter"].clone());
    json!({ "signatures": signatures, "activeSignature": 0, "activeParameter": active })
}

fn operands(form: &str) -> Vec<String> {
    let inner = form.split_once('(').and_then(|(_, rest)| rest.rsplit_once(')'));
    let inner = inner.map_or("", |(inner, _)| inner);
    let operands = inner.split(',').map(|operand| operand.trim().to_owned());
    operands.filter(|operand| !operand.is_empty()).collect()
}

/// The values of points after their names, in a part of a file.
pub(super) fn hints(document: &Document, range: Range<usize>) -> Value {
    let index = document.index();
    let from = index.uses().partition_point(|found| found.span.end < range.start);
    let in_range = index
        .uses()
        .iter()
        .skip(from)
        .take_while(|found| found.span.start <= range.end);
    let hints = in_range.filter_map(|found| {
        let symbol = index.symbols().get(found.symbol)?;
        let values = match symbol.kind {
            SymbolKind::Taught => taught(document, &symbol.name).map(values_of)?,
            SymbolKind::Data if Some(found.span) != symbol.declared => {
                let (kind, values) = document.datum(symbol)?;
                (kind == "POINT").then(|| values.to_owned())?
            }
            SymbolKind::Program
            | SymbolKind::Label
            | SymbolKind::Parameter
            | SymbolKind::Local
            | SymbolKind::Global
            | SymbolKind::Data => return None,
        };
        Some(json!({
            "position": document.text.position(found.span.end),
            "label": format!("({values})"),
            "paddingLeft": true,
        }))
    });
    Value::Array(hints.collect())
}
