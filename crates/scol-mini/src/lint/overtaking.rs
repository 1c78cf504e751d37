//! Warning W0601: a PRINT that may be sent before the arm arrives, because NOWAIT, PASS or ACCUR = COARSE can be on at the
//! motion before it.
//!
//! The modes are followed along every path of a file: through jumps, loops, calls, monitors and the next cycle. A value that
//! is computed may switch its mode on. `flow` has the other rules about order.

use crate::prelude::*;
use alloc::collections::BTreeMap;

use crate::builtin::MOTIONS;
use crate::diagnostic::{Diagnostic, Sink};
use crate::fix::Edit;
use crate::lexer::{Lexeme, Sign, Token};
use crate::outline::{Outline, Part, Row, sign, word};

/// Where a cycle continues in the first program.
pub(super) const CYCLE: &str = "RCYCLE";
/// Most passes over a file. Each may add a path; a file that needs more is not warned about fully.
const MAX_PASSES: usize = 64;

/// The modes that let the statement after a motion begin before the arm rests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    Nowait,
    Pass,
    Accur,
}

const MODES: [Mode; 3] = [Mode::Nowait, Mode::Pass, Mode::Accur];

/// A statement that can switch a mode on: its words and its line.
type Setting = (u32, &'static str);

/// A mode at a place of a program.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Reaching {
    /// A setting of this program, or of one that it calls, can be in force.
    on: Option<Setting>,
    /// The mode can still be as it was at the beginning of the program.
    is_kept: bool,
}

/// The modes at a place; `None` when no path leads to it.
type State = Option<[Reaching; 3]>;

fn joined(a: State, b: State) -> State {
    let (Some(a), Some(b)) = (a, b) else {
        return a.or(b);
    };
    Some(MODES.map(|mode| {
        let (a, b) = (at(&a, mode), at(&b, mode));
        Reaching {
            on: earlier(a.on, b.on),
            is_kept: a.is_kept || b.is_kept,
        }
    }))
}

/// The setting that comes first in the file.
fn earlier(a: Option<Setting>, b: Option<Setting>) -> Option<Setting> {
    a.into_iter().chain(b).min()
}

fn at(state: &[Reaching; 3], mode: Mode) -> Reaching {
    state.get(mode as usize).copied().unwrap_or_default()
}

/// Effect of some words on a mode: switched off, or on by this setting.
type Effect = (Mode, Option<&'static str>);

/// The effect of a statement on the motions after it.
fn effect(segment: &[Lexeme]) -> Option<Effect> {
    match (word(segment.first()), word(segment.get(1))) {
        ("ENABLE", "NOWAIT") => Some((Mode::Nowait, Some("ENABLE NOWAIT"))),
        ("ENABLE", "PASS") => Some((Mode::Pass, Some("ENABLE PASS"))),
        ("DISABLE", "NOWAIT") => Some((Mode::Nowait, None)),
        ("DISABLE", "PASS") => Some((Mode::Pass, None)),
        _ => assigned(segment),
    }
}

/// The effect of `PASS = value` or `ACCUR = value`.
fn assigned(words: &[Lexeme]) -> Option<Effect> {
    let value = words
        .get(2..)
        .filter(|_| sign(words.get(1)) == Some(Sign::Assign))?;
    let alone = if let [only] = value { Some(only) } else { None };
    match word(words.first()) {
        "PASS" => Some((Mode::Pass, (!alone.is_some_and(is_zero)).then_some("PASS"))),
        "ACCUR" => Some((Mode::Accur, (!alone.is_some_and(is_fine)).then_some("ACCUR"))),
        _ => None,
    }
}

/// The effects of the conditions of a motion on itself.
fn own_effects(motion: &[Lexeme]) -> impl Iterator<Item = Effect> {
    let with = motion.iter().position(|lexeme| lexeme.word() == "WITH");
    let conditions = with.and_then(|with| motion.get(with + 1..)).unwrap_or_default();
    conditions
        .split(|lexeme| lexeme.is(Sign::Comma))
        .filter_map(assigned)
}

/// Whether it is FINE or a number that means it; COARSE is 0.
fn is_fine(lexeme: &Lexeme) -> bool {
    lexeme.word() == "FINE" || matches!(lexeme.token, Token::Integer(1..))
}

fn is_zero(lexeme: &Lexeme) -> bool {
    match lexeme.token {
        Token::Integer(number) => number == 0,
        Token::Real(number) => number == 0.0,
        Token::Word(_) | Token::Text(_) | Token::Sign(_) => false,
    }
}

/// What is known of a program from the passes before.
#[derive(Debug, Clone, PartialEq, Default)]
struct Known<'a> {
    /// Settings that can be in force when it begins.
    entry: [Option<Setting>; 3],
    /// The modes at its end, as it leaves them.
    exit: State,
    labels: BTreeMap<&'a str, State>,
    /// The modes where a FOR is repeated, by its line.
    loops: BTreeMap<u32, State>,
    /// The modes at any place: a monitor acts at all of them.
    anywhere: State,
    /// Settings of its monitors.
    monitors: [Option<Setting>; 3],
}

/// Looks for every PRINT that may overtake the motion before it.
pub(super) fn lint(outline: &Outline, source: &str, sink: &mut Sink) {
    let mut known: Vec<Known<'_>> = outline.parts.iter().map(|_| Known::default()).collect();
    for _ in 0..MAX_PASSES {
        let before = known.clone();
        for (at, part) in outline.parts.iter().enumerate() {
            let walk = Walk::new(outline, at, &mut known);
            walk.part(part, &mut |_, _, _| {});
        }
        if known == before {
            break;
        }
    }
    for (at, part) in outline.parts.iter().enumerate() {
        let mut moving: Option<(u32, &str, Setting)> = None;
        let walk = Walk::new(outline, at, &mut known);
        walk.part(part, &mut |row, segment, setting| {
            overtaking(row, segment, setting, source, &mut moving, sink);
        });
    }
}

/// Notes the motion of a statement, which this setting lets end early; reports a PRINT that follows one.
fn overtaking<'a>(
    row: &'a Row,
    segment: Option<&'a [Lexeme]>,
    setting: Option<Setting>,
    source: &str,
    moving: &mut Option<(u32, &'a str, Setting)>,
    sink: &mut Sink,
) {
    // A label is reached from elsewhere too.
    let Some(segment) = segment else {
        *moving = None;
        return;
    };
    let head = word(segment.first());
    if MOTIONS.contains(&head) {
        *moving = setting.map(|setting| (row.line.number, head, setting));
    } else if head == "PRINT" {
        let Some((line, motion, (set, words))) = moving.take() else {
            return;
        };
        let message = format!("this PRINT follows the {motion} of line {line} without waiting for its end");
        let place = segment.first().map_or(row.line.span, |first| first.span);
        let problem = Diagnostic::new("W0601", place, message).help(format!(
            "put WAIT MOTION >= 100 before it: with the {words} of line {set} it may be sent before the arm arrives"
        ));
        // Before an IF it would wait in every case.
        sink.push(match row.head() {
            "PRINT" => problem.fix(Edit::line_before(source, place.start, "WAIT MOTION >= 100")),
            _ => problem,
        });
    } else if head == "FOR" || head != "IF" && !segment.iter().any(|l| l.is(Sign::Assign)) {
        *moving = None;
    }
}

/// One pass over a program.
struct Walk<'a, 'k> {
    outline: &'a Outline,
    /// Number of the program.
    at: usize,
    known: &'k mut [Known<'a>],
    /// Lines of the FOR that are open.
    open: Vec<u32>,
    state: State,
}

impl<'a, 'k> Walk<'a, 'k> {
    fn new(outline: &'a Outline, at: usize, known: &'k mut [Known<'a>]) -> Walk<'a, 'k> {
        let is_kept = true;
        Walk {
            outline,
            at,
            known,
            open: Vec::new(),
            state: Some([Reaching { on: None, is_kept }; 3]),
        }
    }

    fn own(&mut self) -> Option<&mut Known<'a>> {
        self.known.get_mut(self.at)
    }

    /// Calls `visit` with every statement, and the setting that is in force if it is a motion; without a statement at a
    /// label.
    fn part(mut self, part: &'a Part, visit: &mut dyn FnMut(&'a Row, Option<&'a [Lexeme]>, Option<Setting>)) {
        for row in &part.rows {
            if let Some(label) = &row.label {
                visit(row, None, None);
                let exit = self.own().and_then(|own| own.exit);
                let jumped = self
                    .own()
                    .and_then(|own| own.labels.get(label.text.as_str()).copied());
                self.state = joined(self.state, jumped.flatten());
                if self.at == 0 && label.text == CYCLE {
                    self.state = joined(self.state, exit);
                }
            }
            self.row(row, visit);
        }
        self.leave();
    }

    fn row(&mut self, row: &'a Row, visit: &mut dyn FnMut(&'a Row, Option<&'a [Lexeme]>, Option<Setting>)) {
        let segments: Vec<&'a [Lexeme]> = row.segments().collect();
        let before = self.state;
        if row.head() == "ON" {
            for segment in segments {
                visit(row, Some(segment), None);
                self.monitor(segment, row.line.number);
            }
            self.state = before;
        } else if let [only] = segments.as_slice() {
            self.statement(row, only, visit);
        } else {
            // Whether one of the two ways of an IF is always taken shows when it has no IF inside.
            let mut after = match segments.as_slice() {
                [_, then, otherwise] if ![then, otherwise].iter().any(|s| word(s.first()) == "IF") => None,
                _ => before,
            };
            for (at, segment) in segments.into_iter().enumerate() {
                self.state = before;
                self.statement(row, segment, visit);
                if at > 0 {
                    after = joined(after, self.state);
                }
            }
            self.state = after;
        }
        let now = self.state;
        if let Some(own) = self.own() {
            own.anywhere = joined(own.anywhere, now);
        }
    }

    fn statement(
        &mut self,
        row: &'a Row,
        segment: &'a [Lexeme],
        visit: &mut dyn FnMut(&'a Row, Option<&'a [Lexeme]>, Option<Setting>),
    ) {
        let line = row.line.number;
        let head = word(segment.first());
        let setting = MOTIONS.contains(&head).then(|| self.at_motion(segment, line));
        visit(row, Some(segment), setting.flatten());
        if let Some((mode, words)) = effect(segment) {
            self.switch(mode, words.map(|words| (line, words)));
        }
        match head {
            "FOR" => {
                self.open.push(line);
                let repeated = self.own().and_then(|own| own.loops.get(&line).copied());
                self.state = joined(self.state, repeated.flatten());
            }
            "NEXT" => {
                let (begin, state) = (self.open.pop(), self.state);
                if let (Some(begin), Some(own)) = (begin, self.own()) {
                    let repeated = own.loops.entry(begin).or_default();
                    *repeated = joined(*repeated, state);
                }
            }
            "GOTO" => {
                self.jump(segment, self.state);
                if !segment.get(1).is_some_and(|lexeme| lexeme.is(Sign::Open)) {
                    self.state = None;
                }
            }
            "RETURN" => self.leave(),
            _ => self.call(segment),
        }
    }

    /// Takes this state to the labels of a GOTO.
    fn jump(&mut self, segment: &'a [Lexeme], state: State) {
        for (label, _) in super::targets(segment) {
            if let Some(own) = self.own() {
                let known = own.labels.entry(label).or_default();
                *known = joined(*known, state);
            }
        }
    }

    /// The program ends here, and the first one begins again.
    fn leave(&mut self) {
        let state = self.state.take();
        if let Some(own) = self.own() {
            own.exit = joined(own.exit, state);
        }
        if self.at == 0 {
            self.enter(0, state);
        }
    }

    /// The program with this number begins with the modes of this state.
    fn enter(&mut self, program: usize, state: State) {
        let settings = MODES.map(|mode| state.and_then(|_| self.in_force(state, mode)));
        if let Some(known) = self.known.get_mut(program) {
            for (entry, setting) in known.entry.iter_mut().zip(settings) {
                *entry = earlier(*entry, setting);
            }
        }
    }

    fn call(&mut self, segment: &[Lexeme]) {
        let name = word(segment.first());
        let mut parts = self.outline.parts.iter();
        let is_assigned = segment.get(1).is_some_and(|lexeme| lexeme.is(Sign::Assign));
        let called = parts.position(|part| !name.is_empty() && part.name() == name);
        let Some(called) = called.filter(|_| !is_assigned) else {
            return;
        };
        self.enter(called, self.state);
        let exit = self.known.get(called).and_then(|known| known.exit);
        // A program that is not known to end yet has no effect in this pass.
        let (Some(state), Some(exit)) = (self.state, exit) else {
            self.state = None;
            return;
        };
        self.state = Some(MODES.map(|mode| {
            let (before, inside) = (at(&state, mode), at(&exit, mode));
            Reaching {
                on: earlier(inside.on, before.on.filter(|_| inside.is_kept)),
                is_kept: before.is_kept && inside.is_kept,
            }
        }));
    }

    /// Takes note of what a monitor does, at any place of the program.
    fn monitor(&mut self, segment: &'a [Lexeme], line: u32) {
        if let Some((mode, Some(words))) = effect(segment)
            && let Some(setting) = self.own().and_then(|own| own.monitors.get_mut(mode as usize))
        {
            *setting = earlier(*setting, Some((line, words)));
        }
        let anywhere = self.own().and_then(|own| own.anywhere);
        if word(segment.first()) == "GOTO" {
            self.jump(segment, anywhere);
        }
        self.state = anywhere;
        self.call(segment);
        let after = self.state;
        for mode in MODES {
            let on = after.and_then(|after| at(&after, mode).on);
            if let Some(setting) = self.own().and_then(|own| own.monitors.get_mut(mode as usize)) {
                *setting = earlier(*setting, on);
            }
        }
    }

    fn switch(&mut self, mode: Mode, on: Option<Setting>) {
        if let Some(reaching) = self.state.as_mut().and_then(|state| state.get_mut(mode as usize)) {
            *reaching = Reaching { on, is_kept: false };
        }
    }

    /// The setting of a mode that can be in force in this state.
    fn in_force(&self, state: State, mode: Mode) -> Option<Setting> {
        let reaching = at(&state?, mode);
        let own = self.known.get(self.at)?;
        let of = |settings: &[Option<Setting>; 3]| settings.get(mode as usize).copied().flatten();
        let entry = of(&own.entry).filter(|_| reaching.is_kept);
        earlier(reaching.on, earlier(entry, of(&own.monitors)))
    }

    /// The setting that can let this motion end early.
    fn at_motion(&self, segment: &[Lexeme], line: u32) -> Option<Setting> {
        let mut settings = MODES.map(|mode| self.in_force(self.state, mode));
        for (mode, words) in own_effects(segment) {
            if let Some(setting) = settings.get_mut(mode as usize) {
                *setting = words.map(|words| (line, words));
            }
        }
        settings.into_iter().flatten().next()
    }
}
