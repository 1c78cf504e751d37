//! Warnings about names: variables that get a value and are never used, or are used without a type.
//!
//! Names that do not exist are errors and left to `compile::names`. The codes are listed in `diagnostic`.

use crate::prelude::*;
use alloc::collections::{BTreeMap, BTreeSet};

use super::flow::targets;
use super::overtaking::CYCLE;
use crate::builtin;
use crate::diagnostic::{Diagnostic, Sink, Span};
use crate::fix::Edit;
use crate::lexer::{Lexeme, Sign};
use crate::options::Arm;
use crate::outline::{Outline, Part, Row, names, tasks, word};
use crate::suggest::{CHANNELS, is_nearly};

/// Uses of names in the statements of a program.
#[derive(Default)]
struct Uses<'a> {
    /// Given a value by assignment, with the first place.
    assigned: BTreeMap<&'a str, Span>,
    /// Read, counted by a loop, handed to a subprogram or filled by INPUT.
    used: BTreeSet<&'a str>,
    input: BTreeMap<&'a str, Span>,
    labels: BTreeSet<&'a str>,
    called: BTreeSet<String>,
}

pub(super) fn lint(outline: &Outline, source: &str, arm: Arm, clean: bool, sink: &mut Sink) {
    let mut shared = outline.shared();
    let mut known: BTreeSet<&str> = BTreeSet::new();
    let mut called: BTreeSet<&str> = BTreeSet::new();
    let parts = outline.parts.iter();
    let parts: Vec<(&Part, Uses<'_>)> = parts.map(|part| (part, Uses::from_part(part, arm))).collect();
    let valued = valued(outline, &parts);
    for (at, (part, uses)) in parts.iter().enumerate() {
        uninitialised(part, uses, &valued, sink);
        if clean {
            labels(part, source, at == 0, uses, sink);
            unread(part, uses, &shared, sink);
        }
        known.extend(uses.used.iter().chain(uses.assigned.keys()));
        called.extend(uses.called.iter().map(String::as_str));
    }
    if !clean {
        return;
    }
    let works = outline.data.iter().filter(|row| row.head() == "WORK");
    known.extend(works.map(|row| word(row.body.get(1))));
    shared.retain(|name, _| !known.contains(name));
    for row in &outline.data {
        if let Some((name, span)) = row.datum()
            && shared.remove(name).is_some()
        {
            let message = format!("no program of this file uses {} {name}", row.datum_word());
            let problem = Diagnostic::new("W0606", span, message);
            sink.push(problem.help("remove it from DATA, unless a host uses it with DO or MR"));
        }
    }
    for (name, span) in shared {
        let problem = Diagnostic::new("W0607", span, format!("no program of this file uses {name}"));
        sink.push(problem.help("remove it from GLOBAL, unless a host reads it with MR"));
    }
    for name in outline.parts.iter().skip(1).filter_map(|part| part.name.as_ref()) {
        if !called.contains(name.text.as_str()) {
            let message = format!("nothing calls or starts {}", name.text);
            let problem = Diagnostic::new("W0611", name.span, message);
            sink.push(problem.help("only the first PROGRAM of a file starts without a call"));
        }
    }
}

/// Shared names that have a value from the file or from some program.
fn valued<'a>(outline: &'a Outline, parts: &[(&Part, Uses<'a>)]) -> BTreeSet<&'a str> {
    let data = outline.data.iter().filter_map(Row::datum);
    let mut names: BTreeSet<&str> = data.map(|(name, _)| name).collect();
    let globals = outline.globals.iter();
    let initialized = globals.filter(|row| row.head() == "DIM" || row.body.len() > 1);
    names.extend(initialized.flat_map(|row| row.body.iter().map(Lexeme::word)));
    let shared = outline.shared();
    let assigned = parts.iter().flat_map(|(_, uses)| uses.assigned.keys());
    names.extend(assigned.filter(|name| shared.contains_key(*name)));
    names
}

/// W0602: INPUT into a variable without a type.
fn uninitialised(part: &Part, uses: &Uses<'_>, valued: &BTreeSet<&str>, sink: &mut Sink) {
    for (name, span) in &uses.input {
        let has_value = uses.assigned.contains_key(name)
            || valued.contains(name)
            || part.dims().any(|(dim, _)| dim == *name)
            || part.has_parameter(name);
        if !has_value {
            let (message, help) = if CHANNELS.contains(name) {
                let message = format!("{name} is not a channel, so it is a variable without a type");
                (message, "use TP, COM1, IP1 or IP2".into())
            } else {
                let message = format!("{name} gets its type from the first number that it receives");
                (
                    message,
                    format!("give it a value first: {name} = 0 or {name} = 0.0"),
                )
            };
            let problem = Diagnostic::new("W0602", *span, message);
            sink.push(problem.help(help));
        }
    }
}

/// W0604.
fn labels(part: &Part, source: &str, is_first: bool, uses: &Uses<'_>, sink: &mut Sink) {
    for label in part.rows.iter().filter_map(|row| row.label.as_ref()) {
        if label.text != CYCLE && !uses.labels.contains(label.text.as_str()) {
            let problem = Diagnostic::new("W0604", label.span, format!("nothing jumps to {}", label.text));
            let continues = is_nearly(&label.text, CYCLE) && is_first && part.labelled(CYCLE).is_none();
            sink.push(match continues {
                true => problem
                    .help("did you mean RCYCLE, where RS,CYC continues? Otherwise: remove the label")
                    .fix(Edit::replace(label.span, CYCLE)),
                false => problem
                    .help("remove the label")
                    .fix(without_label(source, label.span)),
            });
        }
    }
}

/// Removes a label with its colon.
fn without_label(source: &str, label: Span) -> Edit {
    let rest = source.get(label.end..).unwrap_or_default();
    let colon = rest.find(':').map_or(label.end, |at| label.end + at + 1);
    Edit::remove(source, Span::new(label.start, colon))
}

/// W0605.
fn unread(part: &Part, uses: &Uses<'_>, shared: &BTreeMap<&str, Span>, sink: &mut Sink) {
    for (name, span) in &uses.assigned {
        let known = uses.used.contains(name) || shared.contains_key(name) || part.has_parameter(name);
        if !known {
            let message = format!("{name} is given a value that nothing reads");
            let problem = Diagnostic::new("W0605", *span, message);
            sink.push(problem.help("remove it; if a host reads it with MR, declare it in GLOBAL"));
        }
    }
}

impl<'a> Uses<'a> {
    fn from_part(part: &'a Part, arm: Arm) -> Uses<'a> {
        let mut uses = Uses::default();
        for row in part.rows.iter().filter(|row| row.head() != "DIM") {
            for segment in row.segments() {
                uses.segment(segment, arm);
            }
        }
        uses
    }

    fn segment(&mut self, segment: &'a [Lexeme], arm: Arm) {
        let head = word(segment.first());
        self.called.extend(tasks(segment).map(|(name, _)| name));
        match head {
            "NEXT" | "" => return,
            "GOTO" => self.labels.extend(targets(segment).map(|(label, _)| label)),
            "INPUT" => {
                for (name, span) in names(segment, arm) {
                    self.input.entry(name).or_insert(span);
                }
            }
            "FOR" => {
                if let Some(lexeme) = segment.get(1) {
                    self.assigned.entry(lexeme.word()).or_insert(lexeme.span);
                }
            }
            _ if builtin::is_reserved(head, arm) => {}
            _ => return self.named(head, segment, arm),
        }
        self.used.extend(names(segment, arm).map(|(name, _)| name));
    }

    /// An assignment or a call.
    fn named(&mut self, head: &'a str, segment: &'a [Lexeme], arm: Arm) {
        // A plain variable that is computed from itself is not read by that: N = N + 1.
        let counts = segment.get(1).is_some_and(|lexeme| lexeme.is(Sign::Assign));
        let further = names(segment, arm).skip(1).map(|(name, _)| name);
        self.used.extend(further.filter(|name| !counts || *name != head));
        match segment.first() {
            Some(first) if segment.iter().any(|lexeme| lexeme.is(Sign::Assign)) => {
                self.assigned.entry(head).or_insert(first.span);
                // The id of a task is of use to KILL alone.
                if segment.iter().any(|lexeme| lexeme.word() == "TASK") {
                    self.used.insert(head);
                }
            }
            _ => {
                self.called.insert(head.into());
                for (name, span) in names(segment, arm).skip(1) {
                    self.assigned.entry(name).or_insert(span);
                }
            }
        }
    }
}
