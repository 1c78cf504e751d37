//! Warnings about constants: divisions that lose their fraction, percentages outside their range, reals for integer
//! variables.
//!
//! It looks at the rows of `outline`. The compiler computes constant expressions.

use crate::prelude::*;
use alloc::collections::BTreeMap;

use crate::conditions::{FULL, MAX_ACCEL};
use crate::diagnostic::{Diagnostic, Sink};
use crate::fix::Edit;
use crate::lexer::{Lexeme, Sign, Token};
use crate::options::{IntDivision, LanguageOptions};
use crate::outline::{Part, sign, word};

pub(super) fn lint(part: &Part, options: &LanguageOptions, sink: &mut Sink) {
    let mut integers: BTreeMap<&str, u32> = BTreeMap::new();
    for row in &part.rows {
        divisions(&row.body, options, sink);
        percentages(&row.body, sink);
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

/// W0612 and W0613.
fn divisions(tokens: &[Lexeme], options: &LanguageOptions, sink: &mut Sink) {
    for (at, window) in tokens.windows(3).enumerate() {
        let [left, slash, right] = window else { continue };
        if !slash.is(Sign::Slash) {
            continue;
        }
        if matches!(right.token, Token::Integer(0)) || matches!(right.token, Token::Real(0.0)) {
            let problem = Diagnostic::new("W0613", right.span, "this divides by zero and raises an alarm");
            sink.push(problem.help("divide by a number other than 0"));
            continue;
        }
        let before = at.checked_sub(1).and_then(|at| tokens.get(at));
        let tighter =
            matches!(sign(before), Some(Sign::Star | Sign::Slash | Sign::Caret)) || word(before) == "MOD";
        if tighter || options.int_division != IntDivision::Truncate {
            continue;
        }
        if let (Token::Integer(a), Token::Integer(b)) = (&left.token, &right.token)
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

/// W0614: SPEED is 1 to 100 percent, ACCEL and DECEL are 1 to 100000 (ste85409 L72).
fn percentages(tokens: &[Lexeme], sink: &mut Sink) {
    for window in tokens.windows(3) {
        let [name, equals, value] = window else { continue };
        let condition = name.word();
        let most = match condition {
            "SPEED" => FULL,
            "ACCEL" | "DECEL" => MAX_ACCEL,
            _ => continue,
        };
        let percent = match value.token {
            Token::Integer(percent) => percent as f64,
            Token::Real(percent) => f64::from(percent),
            Token::Word(_) | Token::Text(_) | Token::Sign(_) => continue,
        };
        if equals.is(Sign::Assign) && !(1.0..=most).contains(&percent) {
            let message = format!("{condition} takes 1 to {most} percent");
            let problem = Diagnostic::new("W0614", value.span, message);
            sink.push(problem.help("the machine maximum is 100"));
        }
    }
}
