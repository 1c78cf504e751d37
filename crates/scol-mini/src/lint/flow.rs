//! Warnings about the order of statements: code that is never reached, jumps into loops, loops whose variable is changed.
//!
//! A PRINT that may overtake the motion before it is in `overtaking`. This module looks at the rows of `outline`, not at trees. The codes are listed in `diagnostic`.

use crate::prelude::*;
use alloc::collections::{BTreeMap, BTreeSet};

use crate::diagnostic::{Diagnostic, Sink, Span};
use crate::lexer::{Lexeme, Sign};
use crate::outline::{Outline, Part, Row, word};

pub(super) fn lint(outline: &Outline, broken: &BTreeSet<u32>, sink: &mut Sink) {
    for part in &outline.parts {
        unreachable(part, broken, sink);
        loops(part, sink);
    }
}

/// The place of a row without its label.
fn span(row: &Row) -> Span {
    match (row.body.first(), row.body.last()) {
        (Some(first), Some(last)) => first.span.to(last.span),
        _ => row.line.span,
    }
}

/// `true` when nothing after this statement is executed.
fn leaves(segment: &[Lexeme]) -> bool {
    match word(segment.first()) {
        "GOTO" => !segment.get(1).is_some_and(|lexeme| lexeme.is(Sign::Open)),
        "RETURN" => true,
        _ => false,
    }
}

/// W0603: statements after a jump and before the next label; one warning for each run of them.
fn unreachable(part: &Part, broken: &BTreeSet<u32>, sink: &mut Sink) {
    let mut left: Option<(u32, &str)> = None;
    let mut reported = false;
    for row in &part.rows {
        if row.label.is_some() {
            (left, reported) = (None, false);
        }
        if row.body.is_empty() {
            continue;
        }
        let Some((line, by)) = left else {
            let leaving = leaving(row).filter(|_| !broken.contains(&row.line.number));
            left = leaving.map(|by| (row.line.number, by));
            continue;
        };
        // A line with an error has its message.
        if broken.contains(&row.line.number) {
            continue;
        }
        if !reported {
            let message = format!("this is never reached: line {line} always leaves with {by}");
            let problem = Diagnostic::new("W0603", span(row), message);
            sink.push(problem.help(match row.head() {
                // Without it the FOR is an error.
                "NEXT" => "remove its FOR as well, or put a label before it that something jumps to",
                _ => "remove it, or put a label before it that something jumps to",
            }));
            reported = true;
        }
    }
}

/// The word by which a row leaves in every case.
fn leaving(row: &Row) -> Option<&str> {
    let segments: Vec<&[Lexeme]> = row.segments().collect();
    match segments.as_slice() {
        [only] if leaves(only) => Some(word(only.first())),
        [condition, then, otherwise] if leaves(then) && leaves(otherwise) => {
            Some(word(then.first())).filter(|_| word(condition.first()) == "IF")
        }
        _ => None,
    }
}

/// A FOR loop that is open at some row: its line and its variable.
type Loop<'a> = (u32, &'a str);

/// W0608 and W0609.
fn loops(part: &Part, sink: &mut Sink) {
    let mut open: Vec<Loop<'_>> = Vec::new();
    let mut labels: BTreeMap<&str, Vec<Loop<'_>>> = BTreeMap::new();
    let mut jumps: Vec<(&str, Span, Vec<Loop<'_>>)> = Vec::new();
    for row in &part.rows {
        if let Some(label) = &row.label {
            labels.entry(&label.text).or_insert_with(|| open.clone());
        }
        for segment in row.segments() {
            changed(segment, &open, sink);
            if word(segment.first()) == "GOTO" {
                jumps.extend(targets(segment).map(|(label, span)| (label, span, open.clone())));
            }
        }
        if row.head() == "FOR" && open.len() < crate::MAX_FOR_NESTING {
            open.push((row.line.number, word(row.body.get(1))));
        } else if row.head() == "NEXT" {
            open.pop();
        }
    }
    for (label, span, from) in jumps {
        let mut around = labels.get(label).into_iter().flatten().enumerate();
        let entered = around.find(|(depth, known)| from.get(*depth) != Some(known));
        if let Some((_, (line, variable))) = entered {
            let message =
                format!("this jumps into the FOR {variable} loop of line {line}; its NEXT then has no FOR");
            let problem = Diagnostic::new("W0609", span, message);
            sink.push(problem.help(format!("jump to a label before line {line} instead")));
        }
    }
}

/// The labels of a GOTO.
pub(crate) fn targets(segment: &[Lexeme]) -> impl Iterator<Item = (&str, Span)> {
    let close = segment.iter().rposition(|lexeme| lexeme.is(Sign::Close));
    let list = segment.get(close.map_or(1, |at| at + 1)..).unwrap_or_default();
    let words = list.iter().filter(|lexeme| !lexeme.word().is_empty());
    words.map(|lexeme| (lexeme.word(), lexeme.span))
}

/// W0608: the variable of an open loop gets a value by other means.
fn changed(segment: &[Lexeme], open: &[Loop<'_>], sink: &mut Sink) {
    let targets = match word(segment.first()) {
        "INPUT" => segment.get(1..),
        "FOR" => segment.get(1..2),
        _ if segment.get(1).is_some_and(|lexeme| lexeme.is(Sign::Assign)) => segment.get(..1),
        _ => return,
    };
    for lexeme in targets.unwrap_or_default() {
        let name = lexeme.word();
        let mut open = open.iter();
        if let Some((line, _)) = open.find(|(_, variable)| *variable == name && !name.is_empty()) {
            let message = format!("{name} is changed in the FOR loop of line {line} that counts it");
            let problem = Diagnostic::new("W0608", lexeme.span, message);
            sink.push(problem.help("use another variable: this one decides how often the loop runs"));
        }
    }
}
