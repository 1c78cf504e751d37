//! The words that can follow at a place.

use super::document::Document;
use super::text::Span;
use scol_mini::editor::{BlockKind, Context, Expected, Symbol, SymbolKind};
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
/// Words of the sorts that begin statements, but none themselves.
const WITHIN: [&str; 9] = [
    "DO", "ELSE", "THEN", "TO", "STEP", "TASK", "WITH", "NOWAIT", "MOD",
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
    let many = matches!(
        context.expected,
        Expected::Statement | Expected::Value | Expected::Item
    );
    if trigger.is_some_and(|character| character != "\"") && many {
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

impl<'d> List<'d> {
    fn filled(mut self, takes_snippets: bool) -> Vec<Value> {
        use SymbolKind::{Data, Global, Label, Local, Parameter, Taught};
        use WordKind::{Channel, Condition, Constant, Flow, Function, Operator, Remark, Statement, Variable};
        match self.context.expected {
            Expected::Nothing => return Vec::new(),
            Expected::Statement => {
                self.programs(false);
                self.names(&[Parameter, Local, Global], |_| true);
                self.words(&[Flow, Statement, Condition, Remark]);
                self.exact(&["DOUT", "TIMER", "GAIN", "TORQUE", "ON", "DIM", "END", "PAYLOAD"]);
            }
            Expected::Value | Expected::Item => {
                self.names(&[Parameter, Local, Global, Data, Taught], |_| true);
                self.words(&[Function, Variable, Condition, Constant, Operator]);
                self.exact(&["TASK"]);
            }
            Expected::Position => {
                self.names(&[Parameter, Local, Global, Data, Taught], |kind| kind == "POINT");
                self.exact(&["POINT", "HERE", "DEST"]);
            }
            Expected::Condition => {
                self.words(&[Condition]);
                self.exact(&["PAYLOAD"]);
            }
            Expected::Label => self.names(&[Label], |_| true),
            Expected::Program => self.programs(true),
            Expected::Channel => {
                self.words(&[Channel]);
                self.names(&[Parameter, Local, Global], |_| true);
            }
            Expected::Variable => self.names(&[Parameter, Local, Global], |_| true),
            Expected::Shared => self.names(&[Global, Data], |_| true),
            Expected::Frame => {
                self.names(&[Data], |kind| kind == "TRANS");
                self.exact(&["TRANS"]);
            }
            Expected::Load => {
                self.names(&[Data], |kind| kind == "PAYLOAD");
                self.exact(&["PAYLOAD"]);
            }
            Expected::Words(words) => self.exact(words),
        }
        if takes_snippets {
            self.snippets();
        }
        self.items
    }

    fn push(&mut self, label: &str, kind: u8, detail: &str, rank: u8) {
        // A list that is sorted by the case of letters has to have the case that is typed.
        let typed = self.document.text_of(self.context.word);
        let label = match typed.starts_with(|letter: char| letter.is_ascii_lowercase()) {
            true => label.to_ascii_lowercase(),
            false => label.to_owned(),
        };
        let range = self.range();
        self.items.push(json!({
            "label": label,
            "kind": kind,
            "detail": detail,
            // Names of the file come before words of the language.
            "sortText": format!("{rank}{label}"),
            "textEdit": { "range": range, "newText": label },
        }));
    }

    /// The word that an item replaces.
    fn range(&self) -> Span {
        self.document
            .text
            .span(self.context.word.start..self.context.word.end)
    }

    fn words(&mut self, kinds: &[WordKind]) {
        let arm = self.document.arm();
        let mut found: Vec<&str> = words()
            .filter(|word| word_kind(word, arm).is_some_and(|kind| kinds.contains(&kind)))
            .filter(|word| self.context.expected != Expected::Statement || !WITHIN.contains(word))
            .filter(|word| self.context.expected == Expected::Item || !word.starts_with("CR"))
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

    /// Names that can be used here, but the one that is just typed.
    fn symbols(&self) -> Vec<&'d Symbol> {
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
            // A variable that gets no value is misspelt, as is a call of no program.
            let is_unknown = symbol.declared.is_none() && symbol.kind != SymbolKind::Taught;
            let is_other = Some(*at) != typed || index.places(*at).count() > 1;
            visible(symbol) && is_other && !is_unknown
        });
        symbols.map(|(_, symbol)| symbol).collect()
    }

    /// Names of these kinds; of data those whose kind fits. Taught points are positions.
    fn names(&mut self, kinds: &[SymbolKind], fits: impl Fn(&str) -> bool) {
        let document = self.document;
        for symbol in self.symbols() {
            let datum = document.datum(symbol);
            if !kinds.contains(&symbol.kind) || datum.as_ref().is_some_and(|(kind, _)| !fits(kind)) {
                continue;
            }
            let detail = datum.map_or_else(String::new, |(kind, values)| format!("{kind} {values}"));
            let (number, rank) = match symbol.kind {
                SymbolKind::Label => (kind::REFERENCE, 1),
                SymbolKind::Data | SymbolKind::Taught => (kind::CONSTANT, 0),
                SymbolKind::Program | SymbolKind::Parameter | SymbolKind::Local | SymbolKind::Global => {
                    (kind::VARIABLE, 1)
                }
            };
            self.push(&symbol.name, number, &detail, rank);
        }
        // Those that the file does not use yet.
        let index = document.index();
        let is_known = |name: &str| {
            index
                .symbols()
                .iter()
                .any(|symbol| symbol.scope.is_none() && symbol.name == name)
        };
        let taught = document
            .table
            .points
            .iter()
            .filter(|point| kinds.contains(&SymbolKind::Taught) && !is_known(&point.name));
        for point in taught {
            self.push(&point.name, kind::CONSTANT, "taught point", 0);
        }
    }

    /// The programs of the file but the first, which nothing calls; of tasks those without parameters.
    fn programs(&mut self, is_task: bool) {
        let document = self.document;
        let programs = document
            .index()
            .blocks()
            .iter()
            .filter(|block| block.is_program())
            .skip(1);
        for program in programs {
            let name = document.text_of(program.name).to_ascii_uppercase();
            let heading = match &program.kind {
                BlockKind::Program(heading) if !is_task || heading.ends_with("()") => heading,
                BlockKind::Program(_) | BlockKind::Global | BlockKind::Data | BlockKind::Loop => continue,
            };
            self.push(&name, kind::FUNCTION, heading, 1);
        }
    }

    fn snippets(&mut self) {
        let offered: Vec<Value> = self.items.iter().map(|item| item["label"].clone()).collect();
        let range = self.range();
        for (label, detail, text) in SNIPPETS {
            let word = label.split(' ').next().unwrap_or_default();
            let is_block = matches!(self.context.expected, Expected::Statement | Expected::Words(_));
            if !is_block || !offered.contains(&word.into()) {
                continue;
            }
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
    let label = item
        .get("label")
        .and_then(Value::as_str)
        .unwrap_or_default()
        .to_ascii_uppercase();
    let is_name = matches!(
        item.get("sortText")
            .and_then(Value::as_str)
            .map(|text| text.chars().next()),
        Some(Some('0' | '1'))
    );
    let text = label
        .split(' ')
        .next()
        .filter(|word| !is_name && !word.is_empty())
        .and_then(|word| book().language_word(word));
    if let (Some(text), Some(item)) = (text, item.as_object_mut()) {
        item.insert(
            "documentation".into(),
            json!({ "kind": "markdown", "value": text }),
        );
    }
    item
}
