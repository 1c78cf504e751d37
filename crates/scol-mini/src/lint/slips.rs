//! Warnings about statements that do something else than they look like: a WAIT for a number, a DELAY in milliseconds, a
//! comparison that is always the same.
//!
//! It looks at the parsed statements. Constants that raise an alarm are in `constants`. The codes are listed in
//! `diagnostic`.

use crate::prelude::*;

use crate::builtin::Builtin;
use crate::diagnostic::{Diagnostic, Sink, Span};
use crate::fix::Edit;
use crate::machine::{FIELD, NoInputs, try_value};
use crate::options::LanguageOptions;
use crate::parser::File;
use crate::request::MAX_PRINT;
use crate::tree::{Ask, Binary, Expression, Item, Node, Simple, Statement, Unary};
use crate::value::Number;

/// Shortest DELAY in whole seconds that is taken for milliseconds. Programs that wait for minutes wait for a signal; one
/// that does not writes a decimal point.
const LONG_DELAY: i32 = 100;

pub(super) fn lint(file: &mut File, source: &str, options: &LanguageOptions, sink: &mut Sink) {
    let mut slips = Slips {
        source,
        options,
        sink,
    };
    for located in file.blocks.iter_mut().flat_map(|block| &mut block.statements) {
        let span = located.span;
        let statement = &mut located.statement;
        statement.expressions(&mut |expression, _| slips.compared(expression));
        statement.each(&mut |statement| match statement {
            Statement::Wait(condition) => slips.wait(condition),
            Statement::Select(selector, labels) if labels.len() == 1 => slips.single_label(selector),
            Statement::Simple(Simple::Ask(Ask::Delay(seconds))) => slips.delay(seconds),
            Statement::Simple(Simple::Ask(Ask::Print { items, cr, .. })) => slips.print(items, *cr, span),
            Statement::Simple(_)
            | Statement::If { .. }
            | Statement::For(_)
            | Statement::Next(_)
            | Statement::Goto(_)
            | Statement::Select(..)
            | Statement::Call(..)
            | Statement::Return
            | Statement::On { .. } => {}
        });
    }
}

struct Slips<'a> {
    source: &'a str,
    options: &'a LanguageOptions,
    sink: &'a mut Sink,
}

impl Slips<'_> {
    /// The number of a constant.
    fn constant(&self, expression: &Expression) -> Option<f64> {
        let constant = Some(expression).filter(|expression| expression.is_constant())?;
        match try_value(constant, self.options, &NoInputs).ok()?.number()? {
            Number::Integer(number) => Some(f64::from(number)),
            Number::Real(number) => Some(f64::from(number)),
        }
    }

    /// W0625.
    fn wait(&mut self, condition: &Expression) {
        let Some(number) = self.constant(condition) else {
            return;
        };
        let span = condition.span;
        let text = span.text(self.source);
        let message = format!("WAIT waits for a condition, and {text} is always the same");
        let problem = Diagnostic::new("W0625", span, message);
        if number <= 0.0 {
            self.sink
                .push(problem.help("write a condition, as in WAIT DIN(1) == ON"));
            return;
        }
        if number >= f64::from(LONG_DELAY) {
            // Whether seconds or milliseconds are meant is not known.
            self.sink
                .push(problem.help("wait for a time with DELAY, which counts in seconds"));
            return;
        }
        let problem = problem.help(format!("wait for {number} seconds with DELAY {text}"));
        let before = self.source.get(..span.start).unwrap_or_default().trim_end();
        let word = before.len().checked_sub("WAIT".len());
        let word = word.map(|start| Span::new(start, before.len()));
        let word = word.filter(|word| word.text(self.source).eq_ignore_ascii_case("WAIT"));
        self.sink.push(match word {
            Some(word) => problem.fix(Edit::replace(word, "DELAY")),
            None => problem,
        });
    }

    /// W0627.
    fn delay(&mut self, seconds: &Expression) {
        let Node::Literal(Number::Integer(number @ LONG_DELAY..)) = seconds.node else {
            return;
        };
        let (minutes, milliseconds) = (f64::from(number) / 60.0, f64::from(number) / 1000.0);
        let message = format!("DELAY counts in seconds: this waits for {minutes:.1} minutes");
        let problem = Diagnostic::new("W0627", seconds.span, message);
        let problem = problem.help(format!(
            "write DELAY {milliseconds} for {number} milliseconds, or DELAY {number}.0 for {number} seconds"
        ));
        self.sink
            .push(problem.fix(Edit::replace(seconds.span, milliseconds.to_string())));
    }

    /// W0628.
    fn single_label(&mut self, selector: &Expression) {
        let message = "this GOTO has one label, so it jumps for the value 1 alone";
        let problem = Diagnostic::new("W0628", selector.span, message);
        self.sink.push(problem.help(
            "list a label for each value, or use IF ... THEN GOTO; GOTO without parentheses always jumps",
        ));
    }

    /// W0629: a number takes the same room whatever its value.
    fn print(&mut self, items: &[Item], cr: bool, span: Span) {
        let lengths = items.iter().map(|item| match item {
            Item::Text(text) => text.len(),
            Item::Value(_) => FIELD,
        });
        let length = lengths.sum::<usize>() + usize::from(cr);
        if length > MAX_PRINT {
            let lost = length - MAX_PRINT;
            let message = format!("this PRINT sends {length} characters, of which {lost} are lost");
            let problem = Diagnostic::new("W0629", span, message);
            self.sink.push(problem.help(format!(
                "print at most {MAX_PRINT} characters at once; a number takes {FIELD}"
            )));
        }
    }

    /// W0626: a truth is compared with a number that it never is.
    fn compared(&mut self, expression: &Expression) {
        match &expression.node {
            Node::Literal(_) | Node::System(_) => {}
            Node::Variable(variable) => variable.subscripts.iter().for_each(|part| self.compared(part)),
            Node::Component(of, _) | Node::Unary(_, of) => self.compared(of),
            Node::Function(_, arguments) => arguments.iter().for_each(|part| self.compared(part)),
            Node::Binary(operator, left, right) => {
                self.compared(left);
                self.compared(right);
                if !matches!(operator, Binary::Relation(_)) {
                    return;
                }
                let other = match (is_truth(left), is_truth(right)) {
                    (true, false) => right,
                    (false, true) => left,
                    _ => return,
                };
                let number = self.constant(other);
                if let Some(number) = number.filter(|number| *number != 0.0 && *number != 1.0) {
                    let message = format!("the other side is 0 or 1, never {number}");
                    let problem = Diagnostic::new("W0626", other.span, message);
                    self.sink
                        .push(problem.help("compare with ON or OFF, which are 1 and 0"));
                }
            }
        }
    }
}

/// Whether a value is always 0 or 1.
fn is_truth(expression: &Expression) -> bool {
    matches!(
        expression.node,
        Node::Function(Builtin::Din | Builtin::Dout, _)
            | Node::Unary(Unary::Not, _)
            | Node::Binary(Binary::And | Binary::Or | Binary::Relation(_), ..)
    )
}
