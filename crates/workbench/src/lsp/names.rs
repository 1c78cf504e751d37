//! The places of a name: its definition, its uses, a new name for it, and the lists of names.

use super::document::Document;
use super::text::Text;
use crate::rpc::ResponseError;
use scol_mini::editor::{Block, BlockKind, Role, Symbol, SymbolKind, Use, check_name};
use scol_mini::{MAX_DATA_NAME, Span};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::rc::Rc;
use ts3100_recording::uri;

/// Most symbols in an answer about all files.
const MAX_SYMBOLS: usize = 500;

/// Kinds of symbols, by the numbers of the protocol.
mod kind {
    pub(super) const NAMESPACE: u8 = 3;
    pub(super) const FUNCTION: u8 = 12;
    pub(super) const VARIABLE: u8 = 13;
    pub(super) const CONSTANT: u8 = 14;
    pub(super) const KEY: u8 = 20;
}

fn kind_of(symbol: &Symbol) -> u8 {
    match symbol.kind {
        SymbolKind::Program => kind::FUNCTION,
        SymbolKind::Label => kind::KEY,
        SymbolKind::Parameter | SymbolKind::Local | SymbolKind::Global => kind::VARIABLE,
        SymbolKind::Data | SymbolKind::Taught => kind::CONSTANT,
    }
}

fn location(document: &Document, span: Span) -> Value {
    json!({ "uri": document.uri, "range": document.text.span(span.start..span.end) })
}

/// The table of points as a text, with the place of a point.
fn in_table(document: &Document, name: &str) -> Option<(String, Text, std::ops::Range<usize>)> {
    let table = &document.table;
    let place = table.place_of(name)?;
    let address = uri::of_file(table.path.as_ref()?);
    Some((
        address,
        Text::new(table.text.clone(), document.text.units()),
        place,
    ))
}

pub(super) fn definition(document: &Document, byte: usize) -> Value {
    let Some((symbol, _)) = document.symbol_at(byte) else {
        return Value::Null;
    };
    match (symbol.declared, symbol.kind) {
        (Some(declared), _) => location(document, declared),
        (None, SymbolKind::Taught) => in_table(document, &symbol.name).map_or(
            Value::Null,
            |(address, text, place)| json!({ "uri": address, "range": text.span(place) }),
        ),
        (None, _) => Value::Null,
    }
}

pub(super) fn references(
    document: &Document,
    byte: usize,
    with_declaration: bool,
    others: impl FnOnce() -> Vec<Rc<Document>>,
) -> Value {
    let Some((symbol, found)) = document.symbol_at(byte) else {
        return Value::Null;
    };
    let mut locations = Vec::new();
    let mut add = |document: &Document, number: usize| {
        let places = document.index().places(number);
        let places = places.filter(|place| with_declaration || place.role != Role::Declaration);
        locations.extend(places.map(|place| location(document, place.span)));
    };
    add(document, found.symbol);
    if symbol.kind == SymbolKind::Taught {
        for other in others() {
            if let Some(number) = other.taught(&symbol.name) {
                add(&other, number);
            }
        }
    }
    if with_declaration && symbol.kind == SymbolKind::Taught {
        let row = in_table(document, &symbol.name);
        locations
            .extend(row.map(|(address, text, place)| json!({ "uri": address, "range": text.span(place) })));
    }
    Value::Array(locations)
}

pub(super) fn highlights(document: &Document, byte: usize) -> Value {
    let Some((_, found)) = document.symbol_at(byte) else {
        return Value::Null;
    };
    let highlights = document.index().places(found.symbol).map(|place| {
        let kind = match place.role {
            Role::Read => 2,
            Role::Declaration | Role::Write => 3,
        };
        json!({ "range": document.text.span(place.span.start..place.span.end), "kind": kind })
    });
    Value::Array(highlights.collect())
}

pub(super) fn prepare_rename(document: &Document, byte: usize) -> Result<Value, ResponseError> {
    let (_, found) = renamed(document, byte)?;
    let span = found.span;
    Ok(json!({ "range": document.text.span(span.start..span.end), "placeholder": document.text_of(span) }))
}

fn renamed(document: &Document, byte: usize) -> Result<(&Symbol, &Use), ResponseError> {
    let here = || "only names of programs, labels, variables and points can change";
    document
        .symbol_at(byte)
        .ok_or_else(|| ResponseError::failed(here()))
}

pub(super) fn rename(
    document: &Document,
    byte: usize,
    new_name: &str,
    others: impl FnOnce() -> Vec<Rc<Document>>,
) -> Result<Value, ResponseError> {
    let (symbol, found) = renamed(document, byte)?;
    let new_name = new_name.trim();
    let upper = new_name.to_ascii_uppercase();
    check_name(&upper, document.arm()).map_err(|error| ResponseError::failed(error.to_string()))?;
    let is_shared = symbol.scope.is_none() && symbol.kind != SymbolKind::Program;
    if is_shared && upper.len() > MAX_DATA_NAME {
        let found = upper.len();
        let message = format!("{upper} has {found} characters; hosts reach names of at most {MAX_DATA_NAME}");
        return Err(ResponseError::failed(message));
    }
    if let Some(taken) = collision(document, symbol, &upper) {
        return Err(ResponseError::failed(taken));
    }
    let mut changes: BTreeMap<String, Vec<Value>> = BTreeMap::new();
    let mut rename_in = |document: &Document, number: usize| {
        let places = document.index().places(number).map(|place| {
            json!({ "range": document.text.span(place.span.start..place.span.end), "newText": new_name })
        });
        changes.insert(document.uri.clone(), places.collect());
    };
    rename_in(document, found.symbol);
    if symbol.kind == SymbolKind::Taught {
        for other in others() {
            // What it calls so would become the point.
            if let Some(taken) = collision(&other, symbol, &upper) {
                return Err(ResponseError::failed(taken));
            }
            if let Some(number) = other.taught(&symbol.name) {
                rename_in(&other, number);
            }
        }
    }
    if symbol.kind == SymbolKind::Taught
        && let Some((address, text, place)) = in_table(document, &symbol.name)
    {
        changes.insert(
            address,
            vec![json!({ "range": text.span(place), "newText": upper })],
        );
    }
    Ok(json!({ "changes": changes }))
}

/// Why a symbol cannot have a name: another one that can be meant in the same place has it.
fn collision(document: &Document, symbol: &Symbol, name: &str) -> Option<String> {
    if symbol.name == name {
        return None;
    }
    let is_label = symbol.kind == SymbolKind::Label;
    if is_label && [symbol.name.as_str(), name].contains(&"RCYCLE") {
        return Some("RCYCLE is the label where a cycle continues; write it by hand".to_owned());
    }
    let class = |kind| matches!(kind, SymbolKind::Program | SymbolKind::Label).then_some(kind);
    if class(symbol.kind).is_none() && document.table.points.iter().any(|point| point.name == name) {
        return Some(format!("{name} is taken by a taught point"));
    }
    let mut symbols = document.index().symbols().iter();
    let taken = symbols.find(|other| {
        let meets = other.scope.is_none() || symbol.scope.is_none() || other.scope == symbol.scope;
        // A use of what is not declared may be the name that is wanted.
        other.declared.is_some() && other.name == name && class(other.kind) == class(symbol.kind) && meets
    })?;
    let line = taken
        .declared
        .map(|declared| document.index().line_of(declared.start).0);
    let place = line.map_or_else(String::new, |line| format!(", line {line}"));
    let path = document.path().unwrap_or_default();
    let file = path
        .file_name()
        .map_or(document.uri.as_str().into(), std::ffi::OsStr::to_string_lossy);
    Some(format!("{name} is taken in {file}{place}"))
}

pub(super) fn document_symbols(document: &Document) -> Value {
    let index = document.index();
    let blocks = index
        .blocks()
        .iter()
        .filter(|block| block.kind != BlockKind::Loop);
    Value::Array(blocks.map(|block| block_symbol(document, block)).collect())
}

fn block_symbol(document: &Document, block: &Block) -> Value {
    let index = document.index();
    let name = document.text_of(block.name).to_ascii_uppercase();
    let (kind, detail) = match &block.kind {
        BlockKind::Program(heading) => (kind::FUNCTION, heading.get(name.len()..).unwrap_or_default()),
        BlockKind::Global | BlockKind::Data | BlockKind::Loop => (kind::NAMESPACE, ""),
    };
    let belongs = |symbol: &&Symbol| match (&block.kind, symbol.kind) {
        (BlockKind::Program(_), SymbolKind::Label | SymbolKind::Parameter | SymbolKind::Local) => {
            symbol.scope.as_deref() == Some(&name)
        }
        (BlockKind::Global, SymbolKind::Global) | (BlockKind::Data, SymbolKind::Data) => true,
        _ => false,
    };
    let children = index.symbols().iter().filter(belongs).filter_map(|symbol| {
        let declared = symbol.declared?;
        let (line, span) = index.line_of(declared.start);
        // Two programs of one name have their names apart.
        if !block.lines.contains(&line) {
            return None;
        }
        let detail = document
            .datum(symbol)
            .map_or_else(String::new, |(kind, values)| format!("{kind} {values}"));
        Some(json!({
            "name": symbol.name,
            "detail": detail,
            "kind": kind_of(symbol),
            "range": document.text.span(span.start..span.end),
            "selectionRange": document.text.span(declared.start..declared.end),
        }))
    });
    let start = index.line(*block.lines.start()).map_or(0, |line| line.start);
    let end = index.line(*block.lines.end()).map_or(start, |line| line.end);
    json!({
        "name": name,
        "detail": detail,
        "kind": kind,
        "range": document.text.span(start..end),
        "selectionRange": document.text.span(block.name.start..block.name.end),
        "children": children.collect::<Vec<_>>(),
    })
}

/// Programs, variables of GLOBAL and data of all files whose names have these letters, in this order.
pub(super) fn workspace_symbols(documents: &[Rc<Document>], query: &str) -> Value {
    let query = query.to_ascii_uppercase();
    let matches = |name: &str| {
        let mut letters = name.chars();
        query.chars().all(|wanted| letters.any(|letter| letter == wanted))
    };
    let mut found = Vec::new();
    for document in documents {
        for symbol in document
            .index()
            .symbols()
            .iter()
            .filter(|symbol| symbol.scope.is_none())
        {
            if let Some(declared) = symbol.declared.filter(|_| matches(&symbol.name)) {
                found.push(json!({
                    "name": symbol.name,
                    "kind": kind_of(symbol),
                    "location": location(document, declared),
                }));
            }
            if found.len() >= MAX_SYMBOLS {
                return Value::Array(found);
            }
        }
    }
    Value::Array(found)
}
