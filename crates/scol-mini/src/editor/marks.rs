//! The tokens of a file by kind, comments too.

use crate::prelude::*;

use super::context::ends_value;
use super::index::{BlockKind, Index};
use crate::MAX_LINE;
use crate::builtin::{WordKind, word_kind};
use crate::lexer::{self, Lexeme, Sign, Token};
use crate::lines::{Span, lines};
use crate::options::Arm;
use crate::outline::{sign, word};

/// Kind of a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarkKind {
    /// From ' or REMARK to the end of the line.
    Comment,
    /// A text with its quotes; one that names a program in `TASK("NAME")` as well.
    Text,
    Number,
    /// An operator, a parenthesis, a comma.
    Sign,
    /// A word of the language, as it is used here: `ON` begins a monitor or is a constant.
    Word(WordKind),
    /// The kind of a line of DATA or of an array: `POINT`, and `INTEGER` after AS.
    Type,
    /// A name, by the position of its [`Symbol`](super::Symbol).
    Name(usize),
    /// The letter of a coordinate, after a point.
    Property,
}

/// A token of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mark {
    pub span: Span,
    pub kind: MarkKind,
}

pub(super) fn marks(source: &str, arm: Arm, index: &Index) -> Vec<Mark> {
    let mut marks = Vec::new();
    let mut uses = index.uses().iter().peekable();
    for line in lines(source) {
        let Ok(tokens) = lexer::tokens(source, line.span, MAX_LINE) else {
            continue;
        };
        let in_data = index
            .block_of(line.number)
            .is_some_and(|block| block.kind == BlockKind::Data);
        for (at, lexeme) in tokens.iter().enumerate() {
            while uses
                .next_if(|found| found.span.start < lexeme.span.start)
                .is_some()
            {}
            let named = uses.peek().filter(|found| found.span == lexeme.span);
            let kind = named.map_or_else(
                || kind(&tokens, at, in_data, arm),
                |found| MarkKind::Name(found.symbol),
            );
            let span = lexeme.span;
            marks.push(Mark { span, kind });
        }
        marks.extend(comment(source, line.span, &tokens));
    }
    marks
}

fn kind(tokens: &[Lexeme], at: usize, in_data: bool, arm: Arm) -> MarkKind {
    let before = at.checked_sub(1).and_then(|at| tokens.get(at));
    match tokens.get(at).map(|lexeme| &lexeme.token) {
        Some(Token::Word(_)) if word(before) == "AS" => MarkKind::Type,
        Some(Token::Word(_)) if sign(before) == Some(Sign::Dot) => MarkKind::Property,
        Some(Token::Word(_)) if in_data && at == 0 && tokens.len() > 1 => MarkKind::Type,
        Some(Token::Word(text)) => word_kind(text, arm).map_or(MarkKind::Property, |kind| {
            let begins = before
                .is_none_or(|before| before.is(Sign::Colon) || matches!(before.word(), "THEN" | "ELSE"));
            MarkKind::Word(match text.as_str() {
                "ON" if begins => WordKind::Flow,
                // As a function it has its operands in parentheses, and nothing to its left.
                "MOD" if ends_value(tokens.get(..at).unwrap_or_default()) => WordKind::Operator,
                _ => kind,
            })
        }),
        Some(Token::Integer(_) | Token::Real(_)) => MarkKind::Number,
        Some(Token::Text(_)) => MarkKind::Text,
        Some(Token::Sign(_)) | None => MarkKind::Sign,
    }
}

/// The comment after the last token of a line.
fn comment(source: &str, line: Span, tokens: &[Lexeme]) -> Option<Mark> {
    let begin = tokens.last().map_or(line.start, |last| last.span.end);
    let rest = Span::new(begin, line.end).text(source);
    let blanks = rest.len() - rest.trim_start_matches(' ').len();
    let span = Span::new(begin + blanks, line.end);
    let kind = MarkKind::Comment;
    (span.start < span.end).then_some(Mark { span, kind })
}
