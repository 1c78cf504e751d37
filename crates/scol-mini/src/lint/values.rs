//! Warnings about constants that lose something: divisions without their fraction, reals for integer variables.
//!
//! It looks at the rows of `outline`. Constants that raise an alarm are in `constants`.

use crate::prelude::*;
use alloc::collections::BTreeMap;

use crate::diagnostic::{Diagnostic, Sink};
use crate::fix::Edit;
use crate::lexer::{Lexeme, Sign, Token};
use crate::options::{IntDivision, LanguageOptions};
use crate::outline::{Part, sign, word};

pub(super) fn lint(part: &Part, options: &LanguageOptions, sink: &mut Sink) {
    let mut integers: BTreeMap<&str, u32> = BTreeMap::new();
    for row in &part.rows {
        divisions(&row.body, options, sink);
        for segment in row.segments() {
            if let [target, equals, value] = segment
                && equals.is(Sign::Assign)
            {
                let name = target.word();
                if let Token::Real(real) = value.token {
                    truncated(name, real, value, &integers, sink);
                } else {
                    // 0: it began as something else.
                    let integer = matches!(value.token, Token::Integer(_));
                    let line = if integer { row.line.number } else { 0 };
                    integers.entry(name).or_insert(line);
                }
            }
        }
    }
}

/// W0610: the first value of a variable fixes its type (scol.md 2.3).
fn truncated(name: &str, real: f32, value: &Lexeme, integers: &BTreeMap<&str, u32>, sink: &mut Sink) {
    let cut = libm::truncf(real);
    if let Some(line) = integers.get(name).filter(|line| **line > 0)
        && (real - cut) != 0.0
    {
        let message = format!("{name} is an integer since line {line}, so {real} becomes {cut}");
        let problem = Diagnostic::new("W0610", value.span, message);
        sink.push(problem.help(format!("make it a real with its first value: {name} = 0.0")));
    }
}

/// W0612.
fn divisions(tokens: &[Lexeme], options: &LanguageOptions, sink: &mut Sink) {
    for (at, window) in tokens.windows(3).enumerate() {
        let [left, slash, right] = window else { continue };
        if !slash.is(Sign::Slash) {
            continue;
        }
        let before = at.checked_sub(1).and_then(|at| tokens.get(at));
        let tighter =
            matches!(sign(before), Some(Sign::Star | Sign::Slash | Sign::Caret)) || word(before) == "MOD";
        if tighter || options.int_division != IntDivision::Truncate {
            continue;
        }
        if let (Token::Integer(a), Token::Integer(b)) = (&left.token, &right.token)
            && *b != 0
            && a % b != 0
        {
            let span = left.span.to(right.span);
            let message = format!("{a}/{b} divides integers and gives {}", a / b);
            let problem = Diagnostic::new("W0612", span, message);
            let problem = problem.help(format!("write {a}.0/{b} to keep the fraction"));
            sink.push(problem.fix(Edit::replace(left.span, format!("{a}.0"))));
        }
    }
}
