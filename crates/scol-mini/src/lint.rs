//! Warnings about code that is legal and likely wrong, W0601 to W0629 (listed in `codes`).
//!
//! The lints look at tokens, and at the statements that parse, so they also report on a file that does not compile. Errors
//! are left to the compiler. The modules hold the rules; start with [`check`].

mod constants;
mod flow;
mod names;
mod overtaking;
mod slips;
mod values;

pub(crate) use flow::targets;

use crate::prelude::*;
use alloc::collections::BTreeSet;

use crate::diagnostic::{Diagnostic, MAX_DIAGNOSTICS, Severity, Sink};
use crate::options::LanguageOptions;
use crate::outline::Outline;
use crate::parser::parse_file;
use crate::points::TaughtPoint;
use crate::request::{Request, Robot};
use crate::{Compilation, MAX_SOURCE, compile_with_points};

/// Compiles a file and adds warnings about legal but suspicious code, in source order; at most [`MAX_DIAGNOSTICS`] in
/// all. Unused names are reported only when there is no error: the broken line may be the one that uses them.
pub fn check(source: &str, options: &LanguageOptions) -> Compilation {
    check_with_points(source, options, &[])
}

/// As [`check`]; the programs of the file also see these points.
pub fn check_with_points(source: &str, options: &LanguageOptions, points: &[TaughtPoint]) -> Compilation {
    check_for(source, options, points, &AnyRobot)
}

/// A robot that has every line and reaches every place.
struct AnyRobot;

impl Robot for AnyRobot {
    fn has_input(&self, _: u16) -> bool {
        true
    }
    fn refusal(&self, _: &Request) -> Option<String> {
        None
    }
}

/// As [`check_with_points`]; constants that this robot refuses are warnings too.
pub fn check_for(
    source: &str,
    options: &LanguageOptions,
    points: &[TaughtPoint],
    robot: &dyn Robot,
) -> Compilation {
    let mut compilation = compile_with_points(source, options, points);
    if source.len() > MAX_SOURCE {
        return compilation;
    }
    let diagnostics = compilation.diagnostics.iter();
    let errors = diagnostics.filter(|d| d.severity == Severity::Error);
    let broken = errors.map(|d| d.line).collect();
    let warnings = warnings(source, options, points, robot, &broken);
    let room = MAX_DIAGNOSTICS.saturating_sub(compilation.diagnostics.len());
    compilation.diagnostics.extend(warnings.into_iter().take(room));
    compilation.diagnostics.sort_by_key(|d| (d.line, d.column));
    compilation
}

/// `broken` are the lines with errors.
fn warnings(
    source: &str,
    options: &LanguageOptions,
    points: &[TaughtPoint],
    robot: &dyn Robot,
    broken: &BTreeSet<u32>,
) -> Vec<Diagnostic> {
    let outline = Outline::new(source);
    let mut sink = Sink::new(source);
    flow::lint(&outline, broken, &mut sink);
    overtaking::lint(&outline, source, &mut sink);
    for part in &outline.parts {
        values::lint(part, options, &mut sink);
    }
    let mut file = parse_file(source, options, &mut Sink::new(source));
    slips::lint(&mut file, source, options, &mut sink);
    constants::lint(&mut file, options, points, robot, &mut sink);
    names::lint(&outline, source, options.arm, broken.is_empty(), &mut sink);
    sink.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn codes(source: &str) -> Vec<&'static str> {
        let list = warnings(
            source,
            &LanguageOptions::default(),
            &[],
            &AnyRobot,
            &BTreeSet::new(),
        );
        list.iter().map(|d| d.code).collect()
    }

    #[test]
    fn tasks_and_monitors_use_what_they_name() {
        let source = "PROGRAM M\nI1 = TASK(\"Prog 2\")\nON DIN(1) DO GOTO OUT\nON DIN(2) DO TELL\nDELAY 1\nOUT:\nEND\n\
            PROGRAM PROG2\nEND\nPROGRAM TELL\nEND\n";
        assert_eq!(codes(source), [] as [&str; 0]);
        assert_eq!(codes(&source.replace("TELL\nDELAY", "BREAK\nDELAY")), ["W0611"]);
    }

    #[test]
    fn parameters_arrays_and_subscripts_are_uses() {
        let source = "PROGRAM M\nDIM A(3) AS INTEGER\nI = 1\nA(I) = 2\nS(A(1), J)\nINPUT IP1, A(2)\nEND\n\
            PROGRAM S(P, Q)\nQ = P\nEND\n";
        assert_eq!(codes(source), [] as [&str; 0]);
    }
}
