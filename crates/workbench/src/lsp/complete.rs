//! The words that can follow at a place.

use super::document::Document;
use scol_mini::WordKind;
use scol_mini::editor::{Expected, Offer, OfferKind, SymbolKind, offers};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::LazyLock;
use ts3100_book::book;

/// Kinds of items, by the numbers of the protocol.
mod kind {
    pub(super) const FUNCTION: u8 = 3;
    pub(super) const VARIABLE: u8 = 6;
    pub(super) const KEYWORD: u8 = 14;
    pub(super) const SNIPPET: u8 = 15;
    pub(super) const REFERENCE: u8 = 18;
    pub(super) const ENUM_MEMBER: u8 = 20;
    pub(super) const CONSTANT: u8 = 21;
    pub(super) const PROPERTY: u8 = 10;
}

/// The first form of each word that has operands.
static FORMS: LazyLock<BTreeMap<String, String>> = LazyLock::new(|| book().first_forms());

/// Texts with places to fill in: word, description, text, and where it fits.
const SNIPPETS: &[(&str, &str, &str)] = &[
    ("PROGRAM", "a program", "PROGRAM ${1:NAME}\n  $0\nEND"),
    ("GLOBAL", "variables of all programs", "GLOBAL\n  $0\nEND"),
    (
        "DATA",
        "points and coordinate systems",
        "DATA\n  POINT ${1:P1}=${2:400},${3:0},${4:100}/\nEND",
    ),
    (
        "FOR",
        "a loop that counts",
        "FOR ${1:I} = ${2:1} TO ${3:10}\n  $0\nNEXT ${1:I}",
    ),
    ("IF", "a condition", "IF ${1:DIN(1)} THEN ${2:GOTO ${3:LABEL}}"),
    (
        "IF ELSE",
        "a condition with two ways",
        "IF ${1:DIN(1)} THEN ${2:STATEMENT} ELSE ${3:STATEMENT}",
    ),
    ("ON", "a monitor", "ON ${1:DIN(1)} DO ${2:STATEMENT}"),
    (
        "MOVE WITH",
        "a motion with conditions of its own",
        "MOVE ${1:P1} WITH SPEED = ${2:50}",
    ),
    ("POINT", "a position", "POINT ${1:P1}=${2:400},${3:0},${4:100}/"),
    (
        "TRANS",
        "a coordinate system",
        "TRANS ${1:T1}=${2:0},${3:0},${4:0}",
    ),
    ("PAYLOAD", "load data", "PAYLOAD ${1:L1}=${2:1}"),
    ("WORK", "the coordinate system of the next POINT", "WORK ${1:T1}"),
];
/// The character that made the editor ask, if the user did not.
pub(super) fn trigger(params: &Value) -> Option<&str> {
    let context = params.get("context")?;
    let is_character = context.get("triggerKind").and_then(Value::as_u64) == Some(2);
    let character = context.get("triggerCharacter").and_then(Value::as_str);
    character.filter(|_| is_character)
}

pub(super) fn items(document: &Document, byte: usize, trigger: Option<&str>, takes_snippets: bool) -> Value {
    let context = document.context(byte);
    // A blank or a comma that is typed opens a list only where few words can follow.
    let many =
        context.expected.is_statement() || matches!(context.expected, Expected::Value | Expected::Item);
    let is_unwanted = match trigger {
        None | Some("\"") => false,
        // That of a number opens none.
        Some(".") => context.expected != Expected::Coordinate,
        Some(_) => many,
    };
    if is_unwanted {
        return json!([]);
    }
    let (index, arm, points) = (document.index(), document.arm(), &document.table.points);
    let found = offers(document.source(), byte, &context, index, arm, points);
    let range = document.text.span(context.word.start..context.word.end);
    // A list that is sorted by the case of letters has to have the case that is typed.
    let is_lower = document
        .text_of(context.word)
        .starts_with(|letter: char| letter.is_ascii_lowercase());
    let mut items: Vec<Value> = Vec::new();
    let has_order = matches!(
        context.expected,
        Expected::Words(_) | Expected::Coordinate | Expected::Configuration
    );
    for (at, Offer { text, kind, detail }) in found.iter().enumerate() {
        let form = FORMS
            .get(text.as_str())
            .filter(|_| matches!(kind, OfferKind::Word(_)));
        let label = if is_lower {
            text.to_ascii_lowercase()
        } else {
            text.clone()
        };
        let (number, rank) = number_and_rank(*kind);
        items.push(json!({
            "label": label,
            "kind": number,
            "detail": form.unwrap_or(detail),
            "data": matches!(kind, OfferKind::Word(_)).then_some(text),
            // THEN comes before AND.
            "sortText": if has_order { format!("{rank}{at:02}") } else { format!("{rank}{label}") },
            "textEdit": { "range": range, "newText": label },
        }));
    }
    let takes_snippets =
        takes_snippets && (context.expected.is_statement() || matches!(context.expected, Expected::Words(_)));
    for (label, detail, text) in SNIPPETS.iter().filter(|_| takes_snippets) {
        let word = label.split(' ').next().unwrap_or_default();
        if found.iter().any(|offer| offer.text == word) {
            items.push(json!({
                "label": label,
                "kind": kind::SNIPPET,
                "detail": detail,
                "data": word,
                "sortText": format!("3{label}"),
                "insertTextFormat": 2,
                "textEdit": { "range": range, "newText": text },
            }));
        }
    }
    Value::Array(items)
}

/// The number of a kind in the protocol; names of the file come before words of the language, points before others.
fn number_and_rank(kind: OfferKind) -> (u8, u8) {
    match kind {
        OfferKind::Name(SymbolKind::Data | SymbolKind::Taught) => (kind::CONSTANT, 0),
        OfferKind::Name(SymbolKind::Program) => (kind::FUNCTION, 1),
        OfferKind::Name(SymbolKind::Label) => (kind::REFERENCE, 1),
        OfferKind::Name(SymbolKind::Parameter | SymbolKind::Local | SymbolKind::Global) => {
            (kind::VARIABLE, 1)
        }
        OfferKind::Word(Some(WordKind::Function)) => (kind::FUNCTION, 2),
        OfferKind::Word(Some(WordKind::Variable)) => (kind::VARIABLE, 2),
        OfferKind::Word(Some(WordKind::Condition)) => (kind::PROPERTY, 2),
        OfferKind::Word(Some(WordKind::Channel)) => (kind::ENUM_MEMBER, 2),
        OfferKind::Word(Some(WordKind::Constant)) => (kind::CONSTANT, 2),
        OfferKind::Word(_) => (kind::KEYWORD, 2),
    }
}

/// An item with the description of its word, which it has in `data`.
pub(super) fn resolved(mut item: Value) -> Value {
    let word = item.get("data").and_then(Value::as_str);
    let text = word.and_then(|word| book().language_word(word));
    if let (Some(text), Some(item)) = (text, item.as_object_mut()) {
        item.insert(
            "documentation".into(),
            json!({ "kind": "markdown", "value": text }),
        );
    }
    item
}
