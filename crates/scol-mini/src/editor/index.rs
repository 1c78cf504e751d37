//! The names of a file: what each is, where it is declared, and where it is used.

use crate::prelude::*;
use alloc::collections::{BTreeMap, BTreeSet};
use core::ops::RangeInclusive;

use super::marks::{Mark, MarkKind, marks};
use crate::MAX_SOURCE;
use crate::builtin::{self, TYPES};
use crate::lexer::{Lexeme, Sign, Token};
use crate::lines::{Line, Span, lines};
use crate::lint::targets;
use crate::options::Arm;
use crate::outline::{Outline, Part, Region, names, tasks};
use crate::points::TaughtPoint;

/// Kind of a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum SymbolKind {
    Program,
    Label,
    /// A parameter of a PROGRAM.
    Parameter,
    /// A variable of one PROGRAM.
    Local,
    /// A name of GLOBAL.
    Global,
    /// A line of DATA: POINT, TRANS, PAYLOAD or a number.
    Data,
    /// A point of the table of taught points, which the file does not declare.
    Taught,
}

/// A name of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symbol {
    /// In upper case.
    pub name: String,
    pub kind: SymbolKind,
    /// Name of the PROGRAM that alone knows it; labels, parameters and local variables have one.
    pub scope: Option<String>,
    /// The place that declares it; of a local variable the first that gives it a value. `None`: the file has none.
    pub declared: Option<Span>,
}

/// Part of a place where a name is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Declares it.
    Declaration,
    /// Gives it a value.
    Write,
    /// Uses it.
    Read,
}

/// A place where a name is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Use {
    /// Position of its [`Symbol`].
    pub symbol: usize,
    pub span: Span,
    pub role: Role,
}

/// Kind of a [`Block`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BlockKind {
    Global,
    /// Its heading without the word PROGRAM, for example `PICK(N)`.
    Program(String),
    Data,
    /// A FOR loop.
    Loop,
}

/// Lines that belong together, from the heading to the END or NEXT.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    pub kind: BlockKind,
    /// The name of a PROGRAM, else its first word.
    pub name: Span,
    /// Lines, from 1.
    pub lines: RangeInclusive<u32>,
}

impl Block {
    pub fn is_program(&self) -> bool {
        matches!(self.kind, BlockKind::Program(_))
    }
}

/// The names, tokens and blocks of a file.
#[derive(Debug, Default)]
pub struct Index {
    symbols: Vec<Symbol>,
    uses: Vec<Use>,
    blocks: Vec<Block>,
    marks: Vec<Mark>,
    lines: Vec<Line>,
}

impl Index {
    /// Reads a file; of one longer than [`MAX_SOURCE`] nothing is known. `points` are those of the table of taught points.
    pub fn new(source: &str, arm: Arm, points: &[TaughtPoint]) -> Index {
        if source.len() > MAX_SOURCE {
            return Index::default();
        }
        let outline = Outline::new(source);
        let mut builder = Builder {
            arm,
            known: BTreeMap::new(),
            points: points.iter().map(|point| point.name.as_str()).collect(),
            index: Index {
                blocks: blocks(&outline),
                lines: lines(source),
                ..Index::default()
            },
            scope: String::new(),
        };
        builder.outline(&outline);
        let mut index = builder.index;
        index.uses.sort_by_key(|found| (found.span.start, found.span.end));
        index.uses.dedup_by_key(|found| found.span);
        index.marks = marks(source, arm, &index);
        index
    }

    /// All names, in the order in which they are found.
    pub fn symbols(&self) -> &[Symbol] {
        &self.symbols
    }

    /// All places of names, in the order of the source.
    pub fn uses(&self) -> &[Use] {
        &self.uses
    }

    /// The blocks of the file and its FOR loops.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The tokens of the file by kind, in the order of the source; lines that cannot be cut into tokens have none.
    pub fn marks(&self) -> &[Mark] {
        &self.marks
    }

    /// The name at a byte of the source, also directly after its last letter.
    pub fn use_at(&self, byte: usize) -> Option<&Use> {
        let after = self.uses.partition_point(|found| found.span.start <= byte);
        let found = self.uses.get(after.checked_sub(1)?)?;
        (byte <= found.span.end).then_some(found)
    }

    /// The token at a byte of the source, also directly after its last letter.
    pub fn mark_at(&self, byte: usize) -> Option<&Mark> {
        let after = self.marks.partition_point(|mark| mark.span.start <= byte);
        let nearest = self.marks.get(..after)?.iter().rev().take(2);
        let mut touching = nearest.filter(|mark| byte <= mark.span.end);
        let last = touching.next()?;
        // Between a word and a sign it is the word.
        let before = touching.next().filter(|_| last.kind == MarkKind::Sign);
        Some(before.unwrap_or(last))
    }

    /// The places of a symbol, in the order of the source.
    pub fn places(&self, symbol: usize) -> impl Iterator<Item = &Use> {
        self.uses.iter().filter(move |found| found.symbol == symbol)
    }

    /// The line of a byte, from 1, and its place in the source.
    pub fn line_of(&self, byte: usize) -> (u32, Span) {
        let after = self.lines.partition_point(|line| line.span.start <= byte);
        let line = after.checked_sub(1).and_then(|at| self.lines.get(at));
        line.map_or((1, Span::default()), |line| (line.number, line.span))
    }

    /// The place of a line, from 1.
    pub fn line(&self, number: u32) -> Option<Span> {
        let at = usize::try_from(number).ok()?.checked_sub(1)?;
        self.lines.get(at).map(|line| line.span)
    }

    /// The PROGRAM, GLOBAL or DATA that holds a line.
    pub fn block_of(&self, line: u32) -> Option<&Block> {
        let mut blocks = self.blocks.iter().filter(|block| block.kind != BlockKind::Loop);
        blocks.find(|block| block.lines.contains(&line))
    }
}

fn blocks(outline: &Outline) -> Vec<Block> {
    let region = |region: &Option<Region>, kind| {
        region.map(|region| Block {
            kind,
            name: region.heading,
            lines: region.first..=region.last,
        })
    };
    let mut blocks: Vec<Block> = Vec::new();
    blocks.extend(region(&outline.global_region, BlockKind::Global));
    for part in &outline.parts {
        if let Some(name) = &part.name {
            blocks.push(Block {
                kind: BlockKind::Program(part.heading()),
                name: name.span,
                lines: part.first..=part.last,
            });
        }
        let mut open: Vec<(u32, Span)> = Vec::new();
        for row in &part.rows {
            match (row.head(), row.body.first()) {
                ("FOR", Some(first)) => open.push((row.line.number, first.span)),
                ("NEXT", _) => blocks.extend(open.pop().map(|(first, name)| Block {
                    kind: BlockKind::Loop,
                    name,
                    lines: first..=row.line.number,
                })),
                _ => {}
            }
        }
    }
    blocks.extend(region(&outline.data_region, BlockKind::Data));
    blocks
}

/// Names that can be alike and mean different things.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Space {
    Programs,
    Labels,
    Values,
}

struct Builder<'a> {
    arm: Arm,
    /// Symbols by space, scope (empty: the file) and name.
    known: BTreeMap<(Space, String, String), usize>,
    points: BTreeSet<&'a str>,
    index: Index,
    /// Name of the present PROGRAM.
    scope: String,
}

impl Builder<'_> {
    fn outline(&mut self, outline: &Outline) {
        for row in &outline.globals {
            let declared = row.declared();
            self.declare_all(Space::Values, SymbolKind::Global, &declared);
            let further = names(&row.body, self.arm).filter(|name| !declared.contains(name));
            for (name, span) in further.filter(|(name, _)| !TYPES.contains(name)) {
                self.value(name, span, Role::Read);
            }
        }
        for row in &outline.data {
            let datum: Vec<(&str, Span)> = row.datum().into_iter().collect();
            self.declare_all(Space::Values, SymbolKind::Data, &datum);
        }
        for part in &outline.parts {
            let name = part.name.as_ref().map(|name| (name.text.as_str(), name.span));
            self.declare_all(Space::Programs, SymbolKind::Program, name.as_slice());
        }
        let works = outline.data.iter().filter(|row| row.head() == "WORK");
        for named in works.filter_map(|row| row.body.get(1)) {
            self.value(named.word(), named.span, Role::Read);
        }
        for part in &outline.parts {
            self.part(part);
        }
    }

    fn part(&mut self, part: &Part) {
        self.scope = part.name().into();
        for parameter in &part.parameters {
            self.declare(
                Space::Values,
                SymbolKind::Parameter,
                &parameter.text,
                parameter.span,
            );
        }
        for label in part.rows.iter().filter_map(|row| row.label.as_ref()) {
            self.declare(Space::Labels, SymbolKind::Label, &label.text, label.span);
        }
        for row in &part.rows {
            if row.head() == "DIM" {
                self.declare_all(Space::Values, SymbolKind::Local, &row.declared());
                continue;
            }
            row.segments().for_each(|segment| self.segment(segment));
        }
        self.scope.clear();
    }

    fn segment(&mut self, segment: &[Lexeme]) {
        for (name, span) in tasks(segment) {
            self.used(Space::Programs, SymbolKind::Program, &name, span, Role::Read);
        }
        let (first, rest) = match segment.split_first() {
            Some((first, rest)) => (first, rest),
            None => return,
        };
        match first.word() {
            "GOTO" => {
                let labels: Vec<(&str, Span)> = targets(segment).collect();
                let number = segment
                    .iter()
                    .take_while(|lexeme| labels.iter().all(|label| label.1 != lexeme.span));
                self.read(segment.get(..number.count()).unwrap_or_default());
                for (name, span) in labels {
                    self.used(Space::Labels, SymbolKind::Label, name, span, Role::Read);
                }
            }
            // Within the parentheses of INPUT A(I) are subscripts.
            "INPUT" => self.written(rest),
            "FOR" => {
                let (variable, range) = rest.split_at_checked(1).unwrap_or((rest, &[]));
                self.written(variable);
                self.read(range);
            }
            head if head.is_empty() || builtin::is_reserved(head, self.arm) => self.read(segment),
            _ if segment.iter().any(|lexeme| lexeme.is(Sign::Assign)) => {
                let end = segment.iter().position(|lexeme| lexeme.is(Sign::Assign));
                let (target, value) = segment.split_at(end.unwrap_or(segment.len()));
                self.written(target);
                self.read(value);
            }
            head => {
                self.used(Space::Programs, SymbolKind::Program, head, first.span, Role::Read);
                self.read(rest);
            }
        }
    }

    fn read(&mut self, tokens: &[Lexeme]) {
        for (name, span) in names(tokens, self.arm) {
            self.value(name, span, Role::Read);
        }
    }

    /// The names outside of parentheses get a value.
    fn written(&mut self, tokens: &[Lexeme]) {
        let mut depth = 0;
        let mut written = Vec::new();
        for lexeme in tokens {
            match lexeme.token {
                Token::Sign(Sign::Open) => depth += 1,
                Token::Sign(Sign::Close) => depth -= 1,
                Token::Word(_) if depth == 0 => written.push(lexeme.span),
                Token::Word(_) | Token::Sign(_) | Token::Integer(_) | Token::Real(_) | Token::Text(_) => {}
            }
        }
        for (name, span) in names(tokens, self.arm) {
            let role = if written.contains(&span) {
                Role::Write
            } else {
                Role::Read
            };
            self.value(name, span, role);
        }
    }

    fn value(&mut self, name: &str, span: Span, role: Role) {
        self.used(Space::Values, SymbolKind::Local, name, span, role);
    }

    fn declare_all(&mut self, space: Space, kind: SymbolKind, names: &[(&str, Span)]) {
        for (name, span) in names {
            self.declare(space, kind, name, *span);
        }
    }

    fn declare(&mut self, space: Space, kind: SymbolKind, name: &str, span: Span) {
        if !name.is_empty() {
            self.used(space, kind, name, span, Role::Declaration);
        }
    }

    /// Notes a place of a name. A name that is not known becomes a symbol of this kind.
    fn used(&mut self, space: Space, kind: SymbolKind, name: &str, span: Span, role: Role) {
        let own = (space, self.scope.clone(), name.to_string());
        let shared = (space, String::new(), name.to_string());
        let known = self.known.get(&own).or_else(|| self.known.get(&shared));
        let symbol = known.copied().unwrap_or_else(|| {
            let is_taught = kind == SymbolKind::Local && self.points.contains(name);
            let kind = if is_taught { SymbolKind::Taught } else { kind };
            let is_own = matches!(
                kind,
                SymbolKind::Label | SymbolKind::Parameter | SymbolKind::Local
            );
            let symbol = self.index.symbols.len();
            self.index.symbols.push(Symbol {
                name: name.into(),
                kind,
                scope: is_own.then(|| self.scope.clone()),
                declared: None,
            });
            self.known.insert(if is_own { own } else { shared }, symbol);
            symbol
        });
        let mut role = role;
        if let Some(found) = self.index.symbols.get_mut(symbol)
            && found.declared.is_none()
            && (role == Role::Declaration || role == Role::Write && found.kind == SymbolKind::Local)
        {
            found.declared = Some(span);
            role = Role::Declaration;
        }
        self.index.uses.push(Use { symbol, span, role });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str = "GLOBAL\n  TOTAL = 0\n  DIM SLOT(4) AS INTEGER\nEND\nPROGRAM MAIN\n  N = 1\n  TOTAL = TOTAL + N\nAGAIN: PLACE(N, UP)\n  \
        IF DIN(1) THEN GOTO AGAIN ELSE GOTO OUT\n  GOTO(N) AGAIN, OUT\n  I = TASK(\"Look\")\n  FOR K = 1 TO N\n    SLOT(K) = P1.X\n  NEXT K\n  INPUT COM1, SLOT(N)\n\
        OUT: END\nPROGRAM PLACE(N, POS)\n  MOVE POS WITH SPEED = N\nEND\nPROGRAM LOOK\n  ON DIN(2) DO PLACE(1, UP)\nEND\nDATA\n  TRANS T1=0,0,0/\n  WORK T1\n  P1=400,0,0/\nEND\n";

    fn index() -> Index {
        let up = TaughtPoint {
            name: "UP".into(),
            position: crate::Position::default(),
        };
        Index::new(SOURCE, Arm::Scara, &[up])
    }

    /// Lines and roles of the places of the name that is used on a line.
    fn places(index: &Index, name: &str, line: u32) -> Vec<(u32, Role)> {
        let on_line = |found: &&Use| index.line_of(found.span.start).0 == line;
        let named = |found: &&Use| found.span.text(SOURCE).eq_ignore_ascii_case(name);
        let found = index.uses().iter().filter(on_line).find(named).unwrap();
        let place = |found: &Use| (index.line_of(found.span.start).0, found.role);
        index.places(found.symbol).map(place).collect()
    }

    #[test]
    fn a_name_is_one_thing_in_its_scope() {
        use Role::{Declaration, Read, Write};
        let index = index();
        assert_eq!(
            places(&index, "N", 6),
            [
                (6, Declaration),
                (7, Read),
                (8, Read),
                (10, Read),
                (12, Read),
                (15, Read)
            ]
        );
        assert_eq!(places(&index, "N", 17), [(17, Declaration), (18, Read)]);
        assert_eq!(
            places(&index, "TOTAL", 7),
            [(2, Declaration), (7, Write), (7, Read)]
        );
        assert_eq!(
            places(&index, "SLOT", 13),
            [(3, Declaration), (13, Write), (15, Write)]
        );
        assert_eq!(
            places(&index, "OUT", 9),
            [(9, Read), (10, Read), (16, Declaration)]
        );
        assert_eq!(
            places(&index, "PLACE", 21),
            [(8, Read), (17, Declaration), (21, Read)]
        );
        assert_eq!(places(&index, "LOOK", 11), [(11, Read), (20, Declaration)]);
        assert_eq!(places(&index, "T1", 25), [(24, Declaration), (25, Read)]);
        assert_eq!(places(&index, "UP", 8), [(8, Read), (21, Read)]);
        let kind = |name: &str| {
            index
                .symbols()
                .iter()
                .find(|symbol| symbol.name == name)
                .unwrap()
                .kind
        };
        assert_eq!(
            (kind("UP"), kind("P1"), kind("K")),
            (SymbolKind::Taught, SymbolKind::Data, SymbolKind::Local)
        );
    }

    #[test]
    fn blocks_reach_from_their_heading_to_their_end() {
        let index = index();
        let lines = |block: &Block| (block.name.text(SOURCE).to_string(), block.lines.clone());
        let found: Vec<_> = index.blocks().iter().map(lines).collect();
        let expected = [
            ("GLOBAL", 1..=4),
            ("MAIN", 5..=16),
            ("FOR", 12..=14),
            ("PLACE", 17..=19),
            ("LOOK", 20..=22),
            ("DATA", 23..=27),
        ];
        assert_eq!(found, expected.map(|(name, lines)| (name.to_string(), lines)));
        assert_eq!(
            index.block_of(13).map(|block| &block.kind),
            Some(&BlockKind::Program("MAIN()".into()))
        );
    }

    #[test]
    fn every_letter_of_a_line_belongs_to_a_token() {
        let source = "PROGRAM T ' first\n  N = P.X + 2.5 REMARK rest\n  PRINT \"a b\", N\n\tN = 1\nEND\n";
        let index = Index::new(source, Arm::Scara, &[]);
        let kind = |text: &str| {
            let mark = index.marks().iter().find(|mark| mark.span.text(source) == text);
            mark.unwrap_or_else(|| panic!("{text}")).kind
        };
        assert_eq!(kind("' first"), MarkKind::Comment);
        assert_eq!(kind("REMARK rest"), MarkKind::Comment);
        assert_eq!(kind("X"), MarkKind::Property);
        assert_eq!(kind("\"a b\""), MarkKind::Text);
        assert_eq!(kind("PRINT"), MarkKind::Word(crate::WordKind::Statement));
        assert!(matches!(kind("N"), MarkKind::Name(_)));
        let covered = |byte: usize| {
            index
                .marks()
                .iter()
                .any(|mark| (mark.span.start..mark.span.end).contains(&byte))
        };
        // The line with a tab has none.
        let cut = source.find('\t').unwrap();
        for (at, letter) in source[..cut].char_indices() {
            assert!(letter.is_whitespace() || covered(at), "{letter} at {at}");
        }
    }
}
