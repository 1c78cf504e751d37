//! The place of a cursor: what can follow there, and the call that it is in.

use crate::prelude::*;

use super::index::{BlockKind, Index};
use crate::MAX_LINE;
use crate::builtin;
use crate::lexer::{self, Lexeme, Sign, Token};
use crate::lines::Span;
use crate::options::Arm;
use crate::outline::word;

/// Kind of the words that can follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// Outside of all blocks: GLOBAL, PROGRAM, DATA.
    Block,
    /// A statement, or the name that one begins with.
    Statement,
    /// A number, a function or a variable.
    Value,
    /// The target of a motion.
    Position,
    /// A condition after WITH.
    Condition,
    /// A label of this PROGRAM.
    Label,
    /// A program, in quotes.
    Program,
    /// A channel or a value of PRINT and INPUT.
    Channel,
    /// PASS, NOWAIT.
    Switch,
    /// A line of DATA.
    Datum,
    /// The coordinate system of WORK in DATA.
    Frame,
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
    /// The word that the cursor is in or after.
    pub word: Span,
    pub call: Option<Call>,
}

const MOTIONS: [&str; 4] = ["MOVE", "MOVES", "MOVEC", "MOVEJ"];

impl Context {
    /// The place before this byte of a source; beyond it, its end.
    pub fn at(source: &str, byte: usize, index: &Index, arm: Arm) -> Context {
        let byte = byte.min(source.len());
        let before = source.get(..byte).unwrap_or_default();
        let (_, before) = before.rsplit_once(['\r', '\n']).unwrap_or(("", before));
        // The empty line after the last line end is none of the file.
        let (number, line) = index.line_of(byte);
        let number = number + u32::from(line.end < byte - before.len());
        let begun = before.trim_end_matches(|letter: char| letter.is_ascii_alphanumeric() || letter == '_');
        let rest = source.get(byte..).unwrap_or_default();
        let word = Span::new(
            byte - (before.len() - begun.len()),
            byte + (rest.len() - after_word(rest).len()),
        );
        let nothing = Context {
            expected: Expected::Nothing,
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
            Some(BlockKind::Global) => match tokens.iter().any(|token| token.is(Sign::Assign)) {
                true => Expected::Value,
                false => Expected::Nothing,
            },
            None if tokens.is_empty() => Expected::Block,
            None => Expected::Nothing,
        };
        Context {
            expected,
            call: call(&tokens),
            ..nothing
        }
    }
}

/// Text after the word that it begins with.
fn after_word(text: &str) -> &str {
    text.trim_start_matches(|letter: char| letter.is_ascii_alphanumeric() || letter == '_')
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
        ("", 0) => Expected::Datum,
        ("WORK", 1) => Expected::Frame,
        _ if tokens.iter().any(|token| token.is(Sign::Assign)) => Expected::Value,
        _ => Expected::Nothing,
    }
}

fn in_program(tokens: &[Lexeme], arm: Arm) -> Expected {
    let joint = |token: &Lexeme| matches!(token.word(), "THEN" | "ELSE" | "DO") || token.is(Sign::Colon);
    let begin = tokens.iter().rposition(joint).map_or(0, |at| at + 1);
    let statement = tokens.get(begin..).unwrap_or_default();
    let head = word(statement.first());
    let last = statement.last();
    let follows_name = matches!(
        last.map(|last| &last.token),
        Some(Token::Integer(_) | Token::Real(_))
    );
    let with = statement.iter().rposition(|token| token.word() == "WITH");
    if let Some(with) = with {
        let comma = statement.iter().rposition(|token| token.is(Sign::Comma));
        let from = comma.map_or(with, |comma| comma.max(with));
        let has_value = statement.iter().skip(from).any(|token| token.is(Sign::Assign));
        return if has_value {
            Expected::Value
        } else {
            Expected::Condition
        };
    }
    match head {
        "" => Expected::Statement,
        "PROGRAM" | "DIM" => Expected::Nothing,
        "GOTO" => match statement.get(1) {
            Some(open) if open.is(Sign::Open) && !statement.iter().any(|token| token.is(Sign::Close)) => {
                Expected::Value
            }
            _ => Expected::Label,
        },
        "ENABLE" | "DISABLE" if statement.len() == 1 => Expected::Switch,
        "PRINT" | "INPUT" if statement.len() == 1 => Expected::Channel,
        _ if MOTIONS.contains(&head) => match last {
            Some(last) if last.word() == head || last.is(Sign::Comma) => Expected::Position,
            // Two points of MOVEC stand side by side.
            Some(last) if head == "MOVEC" && !last.word().is_empty() => Expected::Position,
            _ => Expected::Value,
        },
        _ if follows_name => Expected::Nothing,
        _ if statement.len() == 1 && !builtin::is_reserved(head, arm) => Expected::Nothing,
        _ => Expected::Value,
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
            ("IF DIN(1) THEN |", Expected::Statement),
            ("ON DIN(1) DO GOTO |", Expected::Label),
            ("GOTO L|", Expected::Label),
            ("GOTO(|", Expected::Value),
            ("GOTO(K) A, |", Expected::Label),
            ("MOVE |", Expected::Position),
            ("MOVEC A |", Expected::Position),
            ("MOVE P WITH |", Expected::Condition),
            ("MOVE P WITH SPEED = |", Expected::Value),
            ("MOVE P WITH SPEED = 5, |", Expected::Condition),
            ("ENABLE |", Expected::Switch),
            ("PRINT |", Expected::Channel),
            ("INPUT COM1, |", Expected::Value),
            ("N = |", Expected::Value),
            ("I = TASK(\"|", Expected::Program),
            ("PRINT \"a |", Expected::Nothing),
            ("N = 1 ' |", Expected::Nothing),
            ("REMARK |", Expected::Nothing),
            ("\tMOVE |", Expected::Position),
        ] {
            let program = ["PROGRAM T\n", line, "\nEND\nDATA\nEND\n"].concat();
            assert_eq!(context(&program).expected, expected, "{line}");
        }
        assert_eq!(context("PROGRAM T\nSTOP\n|").expected, Expected::Statement);
        assert_eq!(context("PROGRAM T\nSTOP\nEND\n|").expected, Expected::Block);
        assert_eq!(context("DATA\n|\nEND\n").expected, Expected::Datum);
        assert_eq!(context("DATA\nWORK |\nEND\n").expected, Expected::Frame);
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
