//! The tokens of a file by kind, comments too.

use crate::prelude::*;

use super::index::Index;
use crate::lexer::{self, Lexeme, Sign, Token};
use crate::lines::{Span, lines};
use crate::options::Arm;
use crate::{MAX_LINE, builtin};

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
    /// A word of the language.
    Word,
    /// A name, by the position of its [`Symbol`](super::Symbol).
    Name(usize),
    /// The letter of a coordinate, after a point, or the type after AS.
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
        for lexeme in &tokens {
            while uses
                .next_if(|found| found.span.start < lexeme.span.start)
                .is_some()
            {}
            let named = uses.peek().filter(|found| found.span == lexeme.span);
            let kind = named.map_or_else(|| kind(lexeme, arm), |found| MarkKind::Name(found.symbol));
            let span = lexeme.span;
            marks.push(Mark { span, kind });
        }
        marks.extend(comment(source, line.span, &tokens));
    }
    marks
}

fn kind(lexeme: &Lexeme, arm: Arm) -> MarkKind {
    match &lexeme.token {
        Token::Word(word) if builtin::is_reserved(word, arm) => MarkKind::Word,
        Token::Word(_) => MarkKind::Property,
        Token::Integer(_) | Token::Real(_) => MarkKind::Number,
        Token::Text(_) => MarkKind::Text,
        Token::Sign(Sign::Dot) => MarkKind::Sign,
        Token::Sign(_) => MarkKind::Sign,
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
