//! The words and names that can follow at a place.

use crate::prelude::*;

use super::context::{Context, Expected};
use super::index::{BlockKind, Index, Symbol, SymbolKind};
use crate::builtin::{WordKind, configurations, word_kind, words};
use crate::options::Arm;
use crate::points::TaughtPoint;

/// Kind of an [`Offer`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OfferKind {
    /// A word of the language; without a sort it is a type, or the letter of a coordinate.
    Word(Option<WordKind>),
    /// A name of the file or of the table of taught points.
    Name(SymbolKind),
}

/// A word or a name that can follow.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Offer {
    /// In upper case.
    pub text: String,
    pub kind: OfferKind,
    /// Kind and values of data, parameters of a program; empty for a word.
    pub detail: String,
}

/// Words of the sorts that begin statements, but none themselves.
const WITHIN: [&str; 9] = [
    "DO", "ELSE", "THEN", "TO", "STEP", "TASK", "WITH", "NOWAIT", "MOD",
];

/// The words and names that can follow at `byte` of a source, where `context` is. `points` are those of the table of taught points.
pub fn offers(
    source: &str,
    byte: usize,
    context: &Context,
    index: &Index,
    arm: Arm,
    points: &[TaughtPoint],
) -> Vec<Offer> {
    let scope = index.scope_at(source, byte);
    let offers = Vec::new();
    let list = List {
        source,
        context,
        index,
        arm,
        points,
        scope,
        offers,
    };
    list.filled()
}

struct List<'a> {
    source: &'a str,
    context: &'a Context,
    index: &'a Index,
    arm: Arm,
    points: &'a [TaughtPoint],
    scope: Option<String>,
    offers: Vec<Offer>,
}

impl<'a> List<'a> {
    fn filled(mut self) -> Vec<Offer> {
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
            Expected::Coordinate => {
                let letters = self.arm.coordinates().chars();
                letters.for_each(|letter| self.exact(&[letter.encode_utf8(&mut [0; 4])]));
            }
            Expected::Configuration => configurations(self.arm).for_each(|word| self.exact(&[word])),
            Expected::Words(words) => self.exact(words),
        }
        self.offers
    }

    fn push(&mut self, text: &str, kind: OfferKind, detail: String) {
        let text = text.into();
        self.offers.push(Offer { text, kind, detail });
    }

    fn words(&mut self, kinds: &[WordKind]) {
        let arm = self.arm;
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
            self.push(word, OfferKind::Word(word_kind(word, self.arm)), String::new());
        }
    }

    /// Names that can be used here, but the one that is just typed.
    fn symbols(&self) -> Vec<&'a Symbol> {
        let index = self.index;
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
        let index = self.index;
        for symbol in self.symbols() {
            let datum = index.datum(self.source, symbol);
            if kinds.contains(&symbol.kind) && datum.as_ref().is_none_or(|(kind, _)| fits(kind)) {
                let detail = datum.map_or_else(String::new, |(kind, values)| format!("{kind} {values}"));
                self.push(&symbol.name, OfferKind::Name(symbol.kind), detail);
            }
        }
        // Those that the file does not use yet.
        let has_taught = kinds.contains(&SymbolKind::Taught);
        for point in self.points.iter().filter(|_| has_taught) {
            let mut shared = index.symbols().iter().filter(|symbol| symbol.scope.is_none());
            if !shared.any(|symbol| symbol.name == point.name) {
                self.push(
                    &point.name,
                    OfferKind::Name(SymbolKind::Taught),
                    "taught point".into(),
                );
            }
        }
    }

    /// The programs of the file but the first, which nothing calls; of tasks those without parameters.
    fn programs(&mut self, is_task: bool) {
        let index = self.index;
        for program in index.blocks().iter().filter(|block| block.is_program()).skip(1) {
            let name = program.name.text(self.source).to_ascii_uppercase();
            if let BlockKind::Program(heading) = &program.kind
                && (!is_task || heading.ends_with("()"))
            {
                self.push(&name, OfferKind::Name(SymbolKind::Program), heading.clone());
            }
        }
    }
}
