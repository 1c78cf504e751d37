//! The place of a cursor: what can follow there, and the call that it is in.

use crate::prelude::*;

use super::index::{BlockKind, Index};
use crate::MAX_LINE;
use crate::builtin::{self, MOTIONS, TYPES, WordKind, word_kind};
use crate::lexer::{self, Lexeme, Sign, Token, is_letter, leading_word};
use crate::lines::Span;
use crate::options::Arm;
use crate::outline::word;

/// Kind of the words that can follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// A statement, or the name that one begins with.
    Statement,
    /// A statement after THEN or ELSE.
    Branch,
    /// A statement after DO.
    Action,
    /// A number, a function or a variable.
    Value,
    /// An item of PRINT: a value, or CR.
    Item,
    /// The target of a motion.
    Position,
    /// A condition after WITH.
    Condition,
    /// A label of this PROGRAM.
    Label,
    /// A program that can be a task, in quotes.
    Program,
    /// A channel of PRINT and INPUT, or a variable.
    Channel,
    /// A variable that gets a value, or that a loop counts.
    Variable,
    /// A name of GLOBAL or DATA.
    Shared,
    /// A coordinate system.
    Frame,
    /// Load data.
    Load,
    /// The letter of a coordinate.
    Coordinate,
    /// A word of a configuration.
    Configuration,
    /// One of these words.
    Words(&'static [&'static str]),
    /// A name that is made up here, a text, a comment.
    Nothing,
}

/// A function or a program whose operands the cursor is in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    /// In upper case.
    pub name: String,
    /// The operand, from 0.
    pub operand: usize,
}

/// The place of a cursor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Context {
    pub expected: Expected,
    /// Whether ELSE can follow as well.
    pub can_branch: bool,
    /// Conditions that the WITH before it has already, in upper case.
    pub taken: Vec<String>,
    /// The word that the cursor is in or after.
    pub word: Span,
    pub call: Option<Call>,
}

/// Motions to a position.
const TO_POSITIONS: [&str; 4] = ["MOVE", "MOVES", "MOVEC", "MOVEJ"];
const BLOCKS: &[&str] = &["GLOBAL", "PROGRAM", "DATA"];
const DATA: &[&str] = &["POINT", "TRANS", "PAYLOAD", "WORK", "END"];
const GLOBALS: &[&str] = &["DIM", "END"];
const AS: &[&str] = &["AS"];
const SWITCHES: &[&str] = &["PASS", "NOWAIT"];
const OPERATORS: &[&str] = &["AND", "OR", "MOD"];
/// Words that are a whole statement.
const ALONE: &[&str] = &[
    "BREAK", "CLOSE1", "CLOSE2", "CLOSEI1", "CLOSEI2", "FREELOAD", "IGNORE", "OPEN1", "OPEN2", "OPENI1",
    "OPENI2", "PAUSE", "READY", "RESUME", "RETURN", "STOP", "SWITCH",
];

impl Context {
    /// The place before this byte of a source; beyond it, its end.
    pub fn at(source: &str, byte: usize, index: &Index, arm: Arm) -> Context {
        let byte = byte.min(source.len());
        let before = source.get(..byte).unwrap_or_default();
        let (_, before) = before.rsplit_once(['\r', '\n']).unwrap_or(("", before));
        // The empty line after the last line end is none of the file.
        let (number, line) = index.line_of(byte);
        let number = number + u32::from(line.end < byte - before.len());
        let begun = before.trim_end_matches(is_letter);
        let rest = source.get(byte..).unwrap_or_default();
        let word = Span::new(
            byte - (before.len() - begun.len()),
            byte + (leading_word(rest).0.len()),
        );
        let nothing = Context {
            expected: Expected::Nothing,
            can_branch: false,
            taken: Vec::new(),
            word,
            call: None,
        };
        // A tab is an error of its own, which does not change what can follow.
        let begun = begun.replace('\t', " ");
        if let Some(name) = begun
            .strip_suffix('"')
            .and_then(|begun| begun.trim_end().strip_suffix('('))
            && leads_to_program(name)
        {
            return Context {
                expected: Expected::Program,
                ..nothing
            };
        }
        let Ok(tokens) = lexer::tokens(&begun, Span::new(0, begun.len()), MAX_LINE) else {
            return nothing;
        };
        let end = tokens.last().map_or(0, |last| last.span.end);
        if !begun.get(end..).unwrap_or_default().trim().is_empty() {
            return nothing;
        }
        let block = index.block_of(number).map(|block| &block.kind);
        // A file that is being written may lack its END.
        let block = block.or_else(|| {
            let mut before = index.blocks().iter().rev();
            let open = before.find(|block| block.kind != BlockKind::Loop && *block.lines.start() < number);
            open.filter(|block| !is_closed(source, index, *block.lines.end()))
                .map(|block| &block.kind)
        });
        let expected = match block {
            Some(BlockKind::Program(_) | BlockKind::Loop) => in_program(&tokens, arm),
            Some(BlockKind::Data) => in_data(&tokens),
            Some(BlockKind::Global) => in_global(&tokens),
            None if tokens.is_empty() => Expected::Words(BLOCKS),
            None => Expected::Nothing,
        };
        let in_program = matches!(block, Some(BlockKind::Program(_) | BlockKind::Loop));
        Context {
            expected,
            can_branch: in_program && can_branch(&tokens, arm),
            taken: conditions(&tokens).map(String::from).collect(),
            call: call(&tokens),
            ..nothing
        }
    }
}

impl Expected {
    /// Whether a statement begins here.
    pub fn is_statement(self) -> bool {
        matches!(self, Expected::Statement | Expected::Branch | Expected::Action)
    }
}

/// The word that a statement follows, and the statement as far as it is written.
fn begun(tokens: &[Lexeme]) -> (&str, &[Lexeme]) {
    let joint = |token: &Lexeme| matches!(token.word(), "THEN" | "ELSE" | "DO") || token.is(Sign::Colon);
    let at = tokens.iter().rposition(joint);
    let statement = tokens.get(at.map_or(0, |at| at + 1)..).unwrap_or_default();
    (word(at.and_then(|at| tokens.get(at))), statement)
}

/// Whether tokens end in the complete statement of a THEN, which ELSE can follow.
fn can_branch(tokens: &[Lexeme], arm: Arm) -> bool {
    let (joint, statement) = begun(tokens);
    let [first, operands @ ..] = statement else {
        return false;
    };
    let last_assigned = statement.iter().rposition(|token| token.is(Sign::Assign));
    let last_comma = statement.iter().rposition(|token| token.is(Sign::Comma));
    let with = statement.iter().rposition(|token| token.word() == "WITH");
    // The last condition of a WITH has its value.
    let has_value = with.is_none_or(|with| last_assigned > last_comma.max(Some(with)));
    let is_complete = match first.word() {
        head if ALONE.contains(&head) && operands.is_empty() => true,
        "ENABLE" | "DISABLE" => true,
        "RESTORE" if operands.is_empty() => true,
        "MOVEA" | "MOVEI" => last_comma.is_some() && ends_value(operands),
        "MOVEC" | "MOVEJ" => operands.len() > 1 && ends_value(operands),
        head if operands.is_empty() => !builtin::is_reserved(head, arm),
        _ => ends_value(operands),
    };
    joint == "THEN" && is_complete && has_value && !is_open(statement)
}

/// The conditions after WITH that have a value.
fn conditions(tokens: &[Lexeme]) -> impl Iterator<Item = &str> {
    let (_, statement) = begun(tokens);
    let with = statement.iter().rposition(|token| token.word() == "WITH");
    let rest = with.and_then(|with| statement.get(with..)).unwrap_or_default();
    let assigned = rest.windows(2).filter_map(|pair| match pair {
        [condition, sign] if sign.is(Sign::Assign) => Some(condition.word()),
        _ => None,
    });
    assigned.filter(|word| builtin::condition(word).is_some())
}

fn leads_to_program(before: &str) -> bool {
    let begun = before.trim_end();
    let at = begun.len() - begun.bytes().rev().take_while(u8::is_ascii_alphabetic).count();
    begun
        .get(at..)
        .is_some_and(|word| word.eq_ignore_ascii_case("TASK"))
}

/// Whether a line is an END.
fn is_closed(source: &str, index: &Index, line: u32) -> bool {
    let text = index.line(line).map_or("", |line| line.text(source));
    let tokens = lexer::tokens(text, Span::new(0, text.len()), MAX_LINE);
    tokens.is_ok_and(|tokens| word(tokens.last()) == "END")
}

fn in_data(tokens: &[Lexeme]) -> Expected {
    match (word(tokens.first()), tokens.len()) {
        ("", 0) => Expected::Words(DATA),
        ("WORK", 1) => Expected::Frame,
        _ => Expected::Nothing,
    }
}

fn in_global(tokens: &[Lexeme]) -> Expected {
    match word(tokens.first()) {
        "" if tokens.is_empty() => Expected::Words(GLOBALS),
        "DIM" => in_dim(tokens),
        _ if tokens.iter().any(|token| token.is(Sign::Assign)) && !ends_value(tokens) => Expected::Value,
        _ => Expected::Nothing,
    }
}

fn in_dim(tokens: &[Lexeme]) -> Expected {
    match tokens.last() {
        Some(last) if last.is(Sign::Close) => Expected::Words(AS),
        Some(last) if last.word() == "AS" => Expected::Words(TYPES),
        _ => Expected::Nothing,
    }
}

fn in_program(tokens: &[Lexeme], arm: Arm) -> Expected {
    let (joint, statement) = begun(tokens);
    let head = word(statement.first());
    let last = statement.last();
    if last.is_some_and(|last| last.is(Sign::Dot)) {
        return Expected::Coordinate;
    }
    // The condition that gets a value here: of the statement, or the last one after WITH.
    if let [.., condition, sign] = statement
        && sign.is(Sign::Assign)
    {
        return match condition.word() {
            "ACCUR" => Expected::Words(&["FINE", "COARSE"]),
            "CONFIG" => Expected::Configuration,
            "TOOL" | "WORK" | "BASE" => Expected::Frame,
            "PAYLOAD" => Expected::Load,
            _ => Expected::Value,
        };
    }
    if statement.is_empty() {
        return match joint {
            "THEN" | "ELSE" => Expected::Branch,
            "DO" => Expected::Action,
            _ => Expected::Statement,
        };
    }
    // The name of a label, of an assignment or of a call is made up.
    if statement.len() == 1 && !builtin::is_reserved(head, arm) {
        return Expected::Nothing;
    }
    if is_open(statement) {
        return if ends_value(statement) {
            Expected::Words(OPERATORS)
        } else {
            Expected::Value
        };
    }
    if let Some(with) = statement.iter().rposition(|token| token.word() == "WITH") {
        let comma = statement.iter().rposition(|token| token.is(Sign::Comma));
        let from = comma.map_or(with, |comma| comma.max(with));
        let has_value = statement.iter().skip(from).any(|token| token.is(Sign::Assign));
        return match (has_value, ends_value(statement)) {
            (false, _) => Expected::Condition,
            (true, true) => Expected::Nothing,
            (true, false) => Expected::Value,
        };
    }
    after(head, statement)
}

/// The words that can follow the beginning of a statement, outside of parentheses.
fn after(head: &str, statement: &[Lexeme]) -> Expected {
    let is_first = statement.len() == 1;
    let follows_comma = statement.last().is_some_and(|last| last.is(Sign::Comma));
    match head {
        "PROGRAM" | "REMARK" => Expected::Nothing,
        "DIM" => in_dim(statement),
        "GOTO" if is_first || follows_comma || statement.last().is_some_and(|last| last.is(Sign::Close)) => {
            Expected::Label
        }
        "GOTO" => Expected::Nothing,
        "READY" if is_first => Expected::Words(&["WITH"]),
        _ if is_first && ALONE.contains(&head) => Expected::Nothing,
        "ENABLE" | "DISABLE" if is_first => Expected::Words(SWITCHES),
        "PRINT" if is_first => Expected::Channel,
        "PRINT" if follows_comma => Expected::Item,
        "INPUT" if is_first => Expected::Channel,
        "NEXT" | "KILL" if is_first => Expected::Variable,
        "FOR" if is_first => Expected::Variable,
        "INPUT" if follows_comma => Expected::Variable,
        "RESTORE" if is_first || follows_comma => Expected::Shared,
        _ if TO_POSITIONS.contains(&head) && (is_first || follows_comma) => Expected::Position,
        // Two points can be side by side.
        "MOVEC" | "MOVEJ" if statement.len() == 2 => Expected::Position,
        _ if !ends_value(statement) => Expected::Value,
        "IF" => Expected::Words(&["THEN", "AND", "OR", "MOD"]),
        "ON" => Expected::Words(&["DO", "AND", "OR", "MOD"]),
        "FOR" if statement.iter().any(|token| token.word() == "STEP") => Expected::Words(&["MOD"]),
        "FOR" if statement.iter().any(|token| token.word() == "TO") => Expected::Words(&["STEP", "MOD"]),
        "FOR" => Expected::Words(&["TO", "MOD"]),
        _ if MOTIONS.contains(&head) => Expected::Words(&["WITH"]),
        "NEXT" | "KILL" | "INPUT" | "RESTORE" | "ENABLE" | "DISABLE" => Expected::Nothing,
        _ => Expected::Words(OPERATORS),
    }
}

/// Whether a parenthesis is open at the end.
fn is_open(tokens: &[Lexeme]) -> bool {
    let count = |signs: [Sign; 2]| {
        tokens
            .iter()
            .filter(|token| signs.iter().any(|sign| token.is(*sign)))
            .count()
    };
    count([Sign::Open, Sign::OpenBrace]) > count([Sign::Close, Sign::CloseBrace])
}

/// Whether a value is complete at the end.
pub(super) fn ends_value(tokens: &[Lexeme]) -> bool {
    match tokens.last().map(|last| &last.token) {
        Some(Token::Integer(_) | Token::Real(_) | Token::Text(_)) => true,
        Some(Token::Sign(sign)) => matches!(sign, Sign::Close | Sign::CloseBrace),
        Some(Token::Word(text)) => word_kind(text, Arm::SixAxis).is_none_or(|kind| {
            matches!(
                kind,
                WordKind::Variable | WordKind::Condition | WordKind::Constant | WordKind::Channel
            )
        }),
        None => false,
    }
}

/// The innermost call that is open at the end of tokens.
fn call(tokens: &[Lexeme]) -> Option<Call> {
    let mut depth = 0;
    let mut operand = 0;
    for (at, token) in tokens.iter().enumerate().rev() {
        match token.token {
            Token::Sign(Sign::Close) => depth += 1,
            Token::Sign(Sign::Open) if depth > 0 => depth -= 1,
            Token::Sign(Sign::Open) => {
                let name = at.checked_sub(1).and_then(|at| tokens.get(at));
                return Some(word(name)).filter(|name| !name.is_empty()).map(|name| Call {
                    name: name.into(),
                    operand,
                });
            }
            Token::Sign(Sign::Comma) if depth == 0 => operand += 1,
            Token::Word(_) | Token::Integer(_) | Token::Real(_) | Token::Text(_) | Token::Sign(_) => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn context(program: &str) -> Context {
        let source = program.replacen('|', "", 1);
        let index = Index::new(&source, Arm::Scara, &[]);
        Context::at(&source, program.find('|').unwrap(), &index, Arm::Scara)
    }

    #[test]
    fn the_words_before_a_place_decide_what_follows() {
        for (line, expected) in [
            ("|", Expected::Statement),
            ("  MO|VE P", Expected::Statement),
            ("OUT: |", Expected::Statement),
            ("IF DIN(1) THEN |", Expected::Branch),
            ("IF DIN(1) THEN STOP ELSE |", Expected::Branch),
            ("IF DIN(1) THEN STOP |", Expected::Nothing),
            ("ON DIN(1) DO |", Expected::Action),
            ("GOTO L |", Expected::Nothing),
            ("GOTO(K) |", Expected::Label),
            ("READY |", Expected::Words(&["WITH"])),
            ("MOVEJ A |", Expected::Position),
            ("MOVEJ A, B |", Expected::Words(&["WITH"])),
            ("ON DIN(1) DO GOTO |", Expected::Label),
            ("GOTO L|", Expected::Label),
            ("GOTO(|", Expected::Value),
            ("GOTO(K) A, |", Expected::Label),
            ("MOVE |", Expected::Position),
            ("MOVEC A |", Expected::Position),
            ("MOVE P |", Expected::Words(&["WITH"])),
            ("MOVE P WITH |", Expected::Condition),
            ("MOVE P WITH SPEED = |", Expected::Value),
            ("MOVE P WITH ACCUR = |", Expected::Words(&["FINE", "COARSE"])),
            ("MOVE P WITH SPEED = 5, |", Expected::Condition),
            ("ENABLE |", Expected::Words(SWITCHES)),
            ("PRINT |", Expected::Channel),
            ("PRINT COM1, |", Expected::Item),
            ("INPUT COM1, |", Expected::Variable),
            ("N = |", Expected::Value),
            ("N = P1.|", Expected::Coordinate),
            ("N = 1 |", Expected::Words(OPERATORS)),
            ("TOOL = |", Expected::Frame),
            ("PAYLOAD = |", Expected::Load),
            ("IF N == 1 |", Expected::Words(&["THEN", "AND", "OR", "MOD"])),
            ("IF DIN(1, |", Expected::Value),
            ("FOR |", Expected::Variable),
            ("FOR I = 1 |", Expected::Words(&["TO", "MOD"])),
            ("FOR I = 1 TO |", Expected::Value),
            ("FOR I = 1 TO N |", Expected::Words(&["STEP", "MOD"])),
            ("ON DIN(1) |", Expected::Words(&["DO", "AND", "OR", "MOD"])),
            ("NEXT |", Expected::Variable),
            ("RESTORE A, |", Expected::Shared),
            ("DIM T(3) |", Expected::Words(AS)),
            ("DIM T(3) AS |", Expected::Words(TYPES)),
            ("I = TASK(\"|", Expected::Program),
            ("LOOK(\"|", Expected::Nothing),
            ("PRINT \"a |", Expected::Nothing),
            ("N = 1 ' |", Expected::Nothing),
            ("REMARK |", Expected::Nothing),
            ("\tMOVE |", Expected::Position),
        ] {
            let program = ["PROGRAM T\n", line, "\nEND\nDATA\nEND\n"].concat();
            assert_eq!(context(&program).expected, expected, "{line}");
        }
        assert_eq!(context("PROGRAM T\nSTOP\n|").expected, Expected::Statement);
        assert_eq!(
            context("PROGRAM T\nSTOP\nEND\n|").expected,
            Expected::Words(BLOCKS)
        );
        assert_eq!(context("DATA\n|\nEND\n").expected, Expected::Words(DATA));
        assert_eq!(context("GLOBAL\n|\nEND\n").expected, Expected::Words(GLOBALS));
        assert_eq!(context("DATA\nWORK |\nEND\n").expected, Expected::Frame);
    }

    #[test]
    fn else_follows_the_complete_statement_of_a_then() {
        for (line, can_branch) in [
            ("IF DIN(1) THEN STOP |", true),
            ("IF DIN(1) THEN STOP E|", true),
            ("L: IF DIN(1) THEN GOTO L |", true),
            ("IF DIN(1) THEN N = 1 |", true),
            ("IF DIN(1) THEN N = |", false),
            ("IF DIN(1) THEN N = SIN(1 |", false),
            ("IF DIN(1) THEN MOVE P |", true),
            ("IF DIN(1) THEN MOVE |", false),
            ("IF DIN(1) THEN MOVEA 3 |", false),
            ("IF DIN(1) THEN MOVEJ P |", false),
            ("IF DIN(1) THEN MOVE P WITH SPEED |", false),
            ("IF DIN(1) THEN MOVE P WITH SPEED = 5 |", true),
            ("IF DIN(1) THEN MOVE P WITH SPEED = 5, |", false),
            ("IF DIN(1) THEN ENABLE NOWAIT |", true),
            ("IF DIN(1) THEN PLACE |", true),
            ("IF DIN(1) THEN PRINT N, CR |", true),
            ("IF DIN(1) THEN STOP ELSE STOP |", false),
            ("IF DIN(1) |", false),
            ("ON DIN(1) DO STOP |", false),
            ("STOP |", false),
        ] {
            let program = ["PROGRAM T\n", line, "\nEND\n"].concat();
            assert_eq!(context(&program).can_branch, can_branch, "{line}");
        }
        let taken = context("PROGRAM T\nMOVE P WITH SPEED = 5, TOOL = T, |\nEND\n").taken;
        assert_eq!(taken, ["SPEED", "TOOL"]);
    }

    #[test]
    fn a_cursor_is_in_the_innermost_open_call() {
        for (line, name, operand) in [
            ("N = MAX(1, SIN(2), |", "MAX", 2),
            ("N = MAX(1, SIN(|", "SIN", 0),
            ("BCDOUT(9, |", "BCDOUT", 1),
        ] {
            let program = ["PROGRAM T\n", line, "\nEND\n"].concat();
            let call = context(&program).call.unwrap();
            assert_eq!((call.name.as_str(), call.operand), (name, operand), "{line}");
        }
        assert_eq!(context("PROGRAM T\nN = SIN(1) |\nEND\n").call, None);
    }
}
