//! The words and names that can follow at a place.

use crate::prelude::*;
use alloc::collections::BTreeSet;

use super::context::{Context, Expected};
use super::index::{BlockKind, Index, Symbol, SymbolKind};
use crate::MAX_LINE;
use crate::builtin::{WordKind, configurations, word_kind, words};
use crate::lexer::{self, Lexeme, Sign, Token};
use crate::options::Arm;
use crate::outline::word;
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
const WITHIN: &[&str] = &[
    "DO", "ELSE", "THEN", "TO", "STEP", "TASK", "WITH", "NOWAIT", "MOD",
];

/// Operators between two values.
const AFTER_VALUES: &[&str] = &["AND", "OR", "MOD"];
/// Words that cannot begin a statement after THEN or ELSE.
const LOOPS: &[&str] = &["FOR", "NEXT"];
/// Words that cannot begin a statement after DO.
const NOT_WATCHED: &[&str] = &["IF", "WAIT", "RETURN"];

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
        if self.context.can_branch {
            self.exact(&["ELSE"]);
        }
        match self.context.expected {
            Expected::Nothing => {}
            Expected::Statement => {
                self.programs(false);
                self.names(&[Parameter, Local, Global], |_| true);
                self.words(&[Flow, Statement, Condition, Remark]);
                self.exact(&["DOUT", "TIMER", "GAIN", "TORQUE", "ON", "DIM", "END", "PAYLOAD"]);
            }
            Expected::Branch | Expected::Action => {
                self.programs(false);
                self.names(&[Parameter, Local, Global], |_| true);
                self.words(&[Flow, Statement, Condition]);
                self.exact(&["DOUT", "TIMER", "GAIN", "TORQUE", "PAYLOAD"]);
                if self.context.expected == Expected::Branch {
                    self.exact(&["ON"]);
                }
            }
            Expected::Value | Expected::Item => {
                self.names(&[Parameter, Local, Global, Data, Taught], |_| true);
                self.words(&[Function, Variable, Condition, Constant, Operator]);
                self.exact(&["TASK"]);
            }
            Expected::Position => {
                self.names(&[Parameter, Local, Global, Data, Taught], |kind| kind == "POINT");
                self.exact(&["POINT", "HERE", "DEST"]);
                let numbers: BTreeSet<String> = self.numbers().map(|symbol| symbol.name.clone()).collect();
                self.offers.retain(|offer| !numbers.contains(&offer.text));
            }
            Expected::Condition => {
                self.words(&[Condition]);
                if !self.context.taken.iter().any(|taken| taken == "PAYLOAD") {
                    self.exact(&["PAYLOAD"]);
                }
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
        let expected = self.context.expected;
        let is_condition = expected == Expected::Condition;
        let excluded: &[&[&str]] = match expected {
            Expected::Statement => &[WITHIN],
            Expected::Branch => &[WITHIN, LOOPS],
            Expected::Action => &[WITHIN, LOOPS, NOT_WATCHED],
            Expected::Value
            | Expected::Item
            | Expected::Position
            | Expected::Condition
            | Expected::Label
            | Expected::Program
            | Expected::Channel
            | Expected::Variable
            | Expected::Shared
            | Expected::Frame
            | Expected::Load
            | Expected::Coordinate
            | Expected::Configuration
            | Expected::Words(_)
            | Expected::Nothing => &[AFTER_VALUES],
        };
        let mut found: Vec<&str> = words()
            .filter(|word| word_kind(word, arm).is_some_and(|kind| kinds.contains(&kind)))
            .filter(|word| !excluded.iter().any(|words| words.contains(word)))
            .filter(|word| !self.context.taken.iter().any(|taken| taken == word) || !is_condition)
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

    /// Variables that are numbers by the place that declares them.
    fn numbers(&self) -> impl Iterator<Item = &'a Symbol> {
        let (index, source, arm) = (self.index, self.source, self.arm);
        self.symbols().into_iter().filter(move |symbol| {
            let is_variable = matches!(symbol.kind, SymbolKind::Local | SymbolKind::Global);
            let declared = symbol.declared.filter(|_| is_variable);
            declared.is_some_and(|declared| {
                let (_, line) = index.line_of(declared.start);
                let tokens = lexer::tokens(source, line, MAX_LINE).unwrap_or_default();
                let at = tokens
                    .iter()
                    .position(|token| token.span == declared)
                    .unwrap_or_default();
                declares_number(&tokens, at, arm)
            })
        })
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

/// Whether a line makes the variable with this token a number: by its value, its loop, INPUT, or its type.
fn declares_number(tokens: &[Lexeme], at: usize, arm: Arm) -> bool {
    let head = word(tokens.first());
    if head == "DIM" {
        return matches!(word(tokens.last()), "INTEGER" | "REAL");
    }
    let before = at.checked_sub(1).and_then(|before| tokens.get(before));
    if head == "INPUT" || word(before) == "FOR" {
        return true;
    }
    let mut value = tokens.iter().skip(at + 1);
    let is_assigned = value.next().is_some_and(|sign| sign.is(Sign::Assign));
    let first = value.find(|token| !(token.is(Sign::Open) || token.is(Sign::Minus) || token.is(Sign::Plus)));
    is_assigned
        && first.is_some_and(|first| match &first.token {
            Token::Integer(_) | Token::Real(_) => true,
            Token::Word(word) => matches!(
                word_kind(word, arm),
                Some(WordKind::Constant | WordKind::Operator)
            ),
            Token::Text(_) | Token::Sign(_) => false,
        })
}
