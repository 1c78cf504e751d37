//! The words that can follow at a place.

use super::document::Document;
use scol_mini::editor::{Context, Expected, Symbol, SymbolKind};
use scol_mini::{WordKind, word_kind, words};
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
static FORMS: LazyLock<BTreeMap<&str, String>> = LazyLock::new(|| {
    let first = |word| Some((word, book().call_forms(word).into_iter().next()?.0));
    words().filter_map(first).collect()
});

/// Texts with places to fill in: word, description, text, and where it fits.
const SNIPPETS: &[(&str, &str, &str, Expected)] = &[
    (
        "PROGRAM",
        "a program",
        "PROGRAM ${1:NAME}\n  $0\nEND",
        Expected::Block,
    ),
    (
        "GLOBAL",
        "variables of all programs",
        "GLOBAL\n  $0\nEND",
        Expected::Block,
    ),
    (
        "DATA",
        "points and coordinate systems",
        "DATA\n  POINT ${1:P1}=${2:400},${3:0},${4:100}/\nEND",
        Expected::Block,
    ),
    (
        "FOR",
        "a loop that counts",
        "FOR ${1:I} = ${2:1} TO ${3:10}\n  $0\nNEXT ${1:I}",
        Expected::Statement,
    ),
    (
        "IF",
        "a condition",
        "IF ${1:DIN(1)} THEN ${2:GOTO ${3:LABEL}}",
        Expected::Statement,
    ),
    (
        "IF ELSE",
        "a condition with two ways",
        "IF ${1:DIN(1)} THEN ${2:STATEMENT} ELSE ${3:STATEMENT}",
        Expected::Statement,
    ),
    (
        "ON",
        "a monitor",
        "ON ${1:DIN(1)} DO ${2:STATEMENT}",
        Expected::Statement,
    ),
    (
        "MOVE WITH",
        "a motion with conditions of its own",
        "MOVE ${1:P1} WITH SPEED = ${2:50}",
        Expected::Statement,
    ),
    (
        "POINT",
        "a position",
        "POINT ${1:P1}=${2:400},${3:0},${4:100}/",
        Expected::Datum,
    ),
    (
        "TRANS",
        "a coordinate system",
        "TRANS ${1:T1}=${2:0},${3:0},${4:0}/",
        Expected::Datum,
    ),
    ("PAYLOAD", "load data", "PAYLOAD ${1:L1}=${2:1}/", Expected::Datum),
    (
        "WORK",
        "the coordinate system of the next POINT",
        "WORK ${1:T1}",
        Expected::Datum,
    ),
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
    let few = !matches!(
        context.expected,
        Expected::Statement | Expected::Value | Expected::Block
    );
    if trigger.is_some_and(|character| character != "\"") && !few {
        return json!([]);
    }
    let list = List {
        document,
        context: &context,
        scope: document.index().scope_at(document.source(), byte),
        items: Vec::new(),
    };
    Value::Array(list.filled(takes_snippets))
}

struct List<'d> {
    document: &'d Document,
    context: &'d Context,
    scope: Option<String>,
    items: Vec<Value>,
}

impl List<'_> {
    fn filled(mut self, takes_snippets: bool) -> Vec<Value> {
        use SymbolKind::{Data, Global, Label, Local, Parameter, Program, Taught};
        use WordKind::{Channel, Condition, Constant, Flow, Function, Operator, Remark, Statement, Variable};
        let expected = self.context.expected;
        match expected {
            Expected::Nothing => return Vec::new(),
            Expected::Block => self.exact(&["GLOBAL", "PROGRAM", "DATA"]),
            Expected::Statement => {
                self.names(&[Program, Parameter, Local, Global, Data]);
                self.words(&[Flow, Statement, Condition, Remark]);
                self.exact(&["DOUT", "TIMER", "GAIN", "TORQUE", "ON", "DIM", "END", "PAYLOAD"]);
            }
            Expected::Value => {
                self.names(&[Parameter, Local, Global, Data, Taught]);
                self.words(&[Function, Variable, Condition, Constant, Operator]);
                self.exact(&["WITH", "TO", "STEP", "THEN", "ELSE", "DO", "CR", "AS"]);
            }
            Expected::Position => {
                self.positions();
                self.exact(&["POINT", "HERE", "DEST"]);
            }
            Expected::Condition => {
                self.words(&[Condition]);
                self.exact(&["PAYLOAD"]);
            }
            Expected::Label => self.names(&[Label]),
            Expected::Program => self.names(&[Program]),
            Expected::Channel => {
                self.words(&[Channel]);
                self.names(&[Parameter, Local, Global]);
            }
            Expected::Switch => self.exact(&["PASS", "NOWAIT"]),
            Expected::Datum => self.exact(&["POINT", "TRANS", "PAYLOAD", "WORK", "END"]),
            Expected::Frame => self.frames(),
        }
        if takes_snippets {
            self.snippets();
        }
        self.items
    }

    fn push(&mut self, label: &str, kind: u8, detail: &str, rank: u8) {
        let span = self.context.word;
        let range = self.document.text.span(span.start..span.end);
        self.items.push(json!({
            "label": label,
            "kind": kind,
            "detail": detail,
            // Names of the file come before words of the language.
            "sortText": format!("{rank}{label}"),
            "textEdit": { "range": range, "newText": label },
        }));
    }

    fn words(&mut self, kinds: &[WordKind]) {
        let arm = self.document.arm();
        let mut found: Vec<&str> = words()
            .filter(|word| word_kind(word, arm).is_some_and(|kind| kinds.contains(&kind)))
            .collect();
        found.sort_unstable();
        found.dedup();
        self.exact(&found);
    }

    fn exact(&mut self, words: &[&str]) {
        for word in words {
            let kind = match word_kind(word, self.document.arm()) {
                Some(WordKind::Function) => kind::FUNCTION,
                Some(WordKind::Variable) => kind::VARIABLE,
                Some(WordKind::Condition) => kind::PROPERTY,
                Some(WordKind::Channel) => kind::ENUM_MEMBER,
                Some(WordKind::Constant) => kind::CONSTANT,
                Some(
                    WordKind::Declaration
                    | WordKind::Flow
                    | WordKind::Statement
                    | WordKind::Operator
                    | WordKind::Remark,
                )
                | None => kind::KEYWORD,
            };
            let form = FORMS.get(*word).map_or("", String::as_str);
            self.push(word, kind, form, 2);
        }
    }

    /// Names that can be used here, but the one that is just typed, and misspelt statements, which look like calls.
    fn symbols(&self) -> Vec<&Symbol> {
        let index = self.document.index();
        let word = self.context.word;
        let typed = index
            .uses()
            .iter()
            .find(|found| found.span == word)
            .map(|found| found.symbol);
        let visible = |symbol: &Symbol| symbol.scope.is_none() || symbol.scope == self.scope;
        let symbols = index.symbols().iter().enumerate();
        let symbols = symbols.filter(|(at, symbol)| {
            let is_call = symbol.kind == SymbolKind::Program && symbol.declared.is_none();
            let is_other = Some(*at) != typed || index.places(*at).count() > 1;
            visible(symbol) && is_other && !is_call
        });
        symbols.map(|(_, symbol)| symbol).collect()
    }

    fn names(&mut self, kinds: &[SymbolKind]) {
        let found: Vec<(String, SymbolKind, String)> = self
            .symbols()
            .into_iter()
            .filter(|symbol| kinds.contains(&symbol.kind))
            .map(|symbol| {
                let values = self.document.datum(symbol);
                let detail = values.map_or_else(String::new, |(kind, values)| format!("{kind} {values}"));
                (symbol.name.clone(), symbol.kind, detail)
            })
            .collect();
        for (name, kind, detail) in found {
            let number = match kind {
                SymbolKind::Program => kind::FUNCTION,
                SymbolKind::Label => kind::REFERENCE,
                SymbolKind::Parameter | SymbolKind::Local | SymbolKind::Global => kind::VARIABLE,
                SymbolKind::Data | SymbolKind::Taught => kind::CONSTANT,
            };
            self.push(&name, number, &detail, 1);
        }
        if kinds.contains(&SymbolKind::Taught) {
            self.taught();
        }
    }

    /// Taught points that the file does not use yet.
    fn taught(&mut self) {
        let document = self.document;
        let index = document.index();
        for point in &document.table.points {
            if !index
                .symbols()
                .iter()
                .any(|symbol| symbol.name == point.name && symbol.scope.is_none())
            {
                self.push(&point.name, kind::CONSTANT, "taught point", 1);
            }
        }
    }

    /// Names of positions come first; a variable can hold one too.
    fn positions(&mut self) {
        let is_position = |symbol: &&Symbol| match symbol.kind {
            SymbolKind::Data => self
                .document
                .datum(symbol)
                .is_some_and(|(kind, _)| kind == "POINT"),
            SymbolKind::Taught | SymbolKind::Parameter | SymbolKind::Local | SymbolKind::Global => true,
            SymbolKind::Program | SymbolKind::Label => false,
        };
        let found: Vec<(String, String)> = self
            .symbols()
            .into_iter()
            .filter(is_position)
            .map(|symbol| {
                let values = self
                    .document
                    .datum(symbol)
                    .map_or_else(String::new, |(_, values)| values.to_owned());
                (symbol.name.clone(), values)
            })
            .collect();
        for (name, values) in found {
            self.push(
                &name,
                kind::CONSTANT,
                &values,
                if values.is_empty() { 1 } else { 0 },
            );
        }
        self.taught();
    }

    fn frames(&mut self) {
        let is_frame = |symbol: &&Symbol| {
            self.document
                .datum(symbol)
                .is_some_and(|(kind, _)| kind == "TRANS")
        };
        let found: Vec<String> = self
            .symbols()
            .into_iter()
            .filter(is_frame)
            .map(|symbol| symbol.name.clone())
            .collect();
        for name in found {
            self.push(&name, kind::CONSTANT, "", 1);
        }
    }

    fn snippets(&mut self) {
        let span = self.context.word;
        let range = self.document.text.span(span.start..span.end);
        for (label, detail, text, _) in SNIPPETS
            .iter()
            .filter(|snippet| snippet.3 == self.context.expected)
        {
            self.items.push(json!({
                "label": label,
                "kind": kind::SNIPPET,
                "detail": detail,
                "sortText": format!("3{label}"),
                "insertTextFormat": 2,
                "textEdit": { "range": range, "newText": text },
            }));
        }
    }
}

/// An item with the description of its word.
pub(super) fn resolved(mut item: Value) -> Value {
    let label = item.get("label").and_then(Value::as_str).unwrap_or_default();
    let is_name = matches!(
        item.get("sortText")
            .and_then(Value::as_str)
            .map(|text| text.chars().next()),
        Some(Some('0' | '1'))
    );
    let text = label
        .split(' ')
        .next()
        .filter(|_| !is_name)
        .and_then(|word| book().language_word(word));
    if let (Some(text), Some(item)) = (text, item.as_object_mut()) {
        item.insert(
            "documentation".into(),
            json!({ "kind": "markdown", "value": text }),
        );
    }
    item
}
