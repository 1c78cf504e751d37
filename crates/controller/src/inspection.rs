//! A look at a program between two of its statements, for a debugger that holds time instead of stopping the robot.
//!
//! An inspection counts the statements that begin and looks at each of them. At the place it was made for the controller halts:
//! no statement begins any more, nothing is due, and every part is as it was then. A halted controller can only be read; the
//! run continues in a copy from before, with an inspection for a later place. So a run that was inspected is byte for byte the
//! run that was not.
//!
//! Stops of the robot at a line are in `executor::breakpoints`; both ask [`Breakpoint`] whether it counts, and [`Target`] whether a
//! step is over.

use crate::io::signals::LINE_NUMBERS;
use crate::limits::MAX_BREAKPOINT_TEXT;
use crate::listed::listed;
use crate::prelude::*;
use core::fmt;
use core::str::FromStr;
use scol_mini::{Arm, Inputs, Machine, Memory, ProbeError, Program, Value, ValueKind};
use ts3100_proto::command::Number;
use ts3100_proto::status::pr::three_decimals;

/// Most statements that one inspection lists.
pub const MAX_LISTED: usize = 1_000_000;

/// Which of its hits a breakpoint stops at. Serialized as its text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum HitRule {
    /// This hit alone, from 1.
    Exactly(u32),
    /// This hit and all after it.
    From(u32),
    /// Each hit whose number is a multiple.
    Every(u32),
}

/// A text that cannot be read as a rule for hits.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected a number of hits such as `3`, `>=3`, `>3` or `%3`, found `{0}`")]
pub struct HitRuleError(String);

impl FromStr for HitRule {
    type Err = HitRuleError;

    fn from_str(text: &str) -> Result<HitRule, HitRuleError> {
        let text = text.trim();
        let number = |rest: &str| rest.trim().parse::<u32>().ok().filter(|count| *count > 0);
        let found = if let Some(rest) = text.strip_prefix(">=") {
            number(rest).map(HitRule::From)
        } else if let Some(rest) = text.strip_prefix('>') {
            number(rest)
                .and_then(|count| count.checked_add(1))
                .map(HitRule::From)
        } else if let Some(rest) = text.strip_prefix('%') {
            number(rest).map(HitRule::Every)
        } else {
            let rest = text.strip_prefix("==").or(text.strip_prefix('=')).unwrap_or(text);
            number(rest).map(HitRule::Exactly)
        };
        found.ok_or_else(|| HitRuleError(text.chars().take(40).collect()))
    }
}

impl TryFrom<String> for HitRule {
    type Error = HitRuleError;

    fn try_from(text: String) -> Result<HitRule, HitRuleError> {
        text.parse()
    }
}

impl From<HitRule> for String {
    fn from(rule: HitRule) -> String {
        rule.to_string()
    }
}

impl fmt::Display for HitRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            HitRule::Exactly(count) => write!(f, "{count}"),
            HitRule::From(count) => write!(f, ">={count}"),
            HitRule::Every(count) => write!(f, "%{count}"),
        }
    }
}

impl HitRule {
    fn holds(self, hit: u32) -> bool {
        match self {
            HitRule::Exactly(count) => hit == count,
            HitRule::From(count) => hit >= count,
            HitRule::Every(count) => hit.is_multiple_of(count),
        }
    }
}

/// A line before which a program stops, or says something. Serialized as its line alone where that is all.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "BreakpointForm", into = "BreakpointForm")]
pub struct Breakpoint {
    /// Line of the selected file, from 1, with a statement.
    pub line: u32,
    /// An expression that has to be true.
    pub condition: Option<String>,
    /// Which hits count, of those for which the condition is true.
    pub hits: Option<HitRule>,
    /// A text that is said instead of a stop; an expression in braces becomes its value.
    pub message: Option<String>,
    /// Hits so far.
    pub hit: u32,
}

/// A breakpoint in a snapshot.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum BreakpointForm {
    Line(u32),
    Rules {
        line: u32,
        condition: Option<String>,
        hits: Option<HitRule>,
        message: Option<String>,
        hit: u32,
    },
}

impl From<Breakpoint> for BreakpointForm {
    fn from(breakpoint: Breakpoint) -> BreakpointForm {
        if breakpoint.is_plain() {
            return BreakpointForm::Line(breakpoint.line);
        }
        let Breakpoint {
            line,
            condition,
            hits,
            message,
            hit,
        } = breakpoint;
        BreakpointForm::Rules {
            line,
            condition,
            hits,
            message,
            hit,
        }
    }
}

impl From<BreakpointForm> for Breakpoint {
    fn from(form: BreakpointForm) -> Breakpoint {
        match form {
            BreakpointForm::Line(line) => Breakpoint::at(line),
            BreakpointForm::Rules {
                line,
                condition,
                hits,
                message,
                hit,
            } => Breakpoint {
                line,
                condition,
                hits,
                message,
                hit,
            },
        }
    }
}

/// Result of a breakpoint whose line begins.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reached {
    /// Not this time.
    No,
    Stop,
    /// It says this and does not stop.
    Says(String),
    /// Its condition has no value: it stops, and says why.
    Fault(String),
}

impl Breakpoint {
    /// A breakpoint without conditions.
    pub fn at(line: u32) -> Breakpoint {
        Breakpoint {
            line,
            condition: None,
            hits: None,
            message: None,
            hit: 0,
        }
    }

    /// Whether it stops at every hit.
    pub fn is_plain(&self) -> bool {
        self.condition.is_none() && self.hits.is_none() && self.message.is_none()
    }

    /// Whether its texts are short enough.
    pub(crate) fn fits(&self) -> bool {
        let mut texts = self.condition.iter().chain(&self.message);
        texts.all(|text| text.len() <= MAX_BREAKPOINT_TEXT)
    }

    /// The same breakpoint among others, whatever its hits.
    pub(crate) fn find_in<'a>(&self, others: &'a [Breakpoint]) -> Option<&'a Breakpoint> {
        let hit = self.hit;
        let same = |other: &&Breakpoint| {
            Breakpoint {
                hit,
                ..(*other).clone()
            } == *self
        };
        others.iter().find(same)
    }

    /// Takes the hits of the same breakpoint among those that were set before: setting all of them again restarts no count.
    pub fn resume(&mut self, before: &[Breakpoint]) {
        self.hit = self.find_in(before).map_or(0, |old| old.hit);
    }

    /// Checks its expressions as the program of its line reads them.
    ///
    /// # Errors
    /// See [`BreakpointError`].
    pub(crate) fn check(&self, program: &Program) -> Result<(), BreakpointError> {
        if let Some(condition) = &self.condition {
            let checked = program.check_expression(self.line, condition);
            checked.map_err(|error| BreakpointError::Condition(condition.clone(), Box::new(error)))?;
        }
        let mut wrong = None;
        filled(self.message.as_deref().unwrap_or_default(), |text| {
            if let Err(error) = program.check_expression(self.line, text) {
                wrong.get_or_insert(BreakpointError::Message(String::from(text), Box::new(error)));
            }
            String::new()
        });
        wrong.map_or(Ok(()), Err)
    }

    /// Counts a hit of a statement that is about to begin, if the condition is true.
    pub(crate) fn reach(&mut self, machine: &Machine, memory: &mut Memory, inputs: &dyn Inputs) -> Reached {
        let call = machine.depth().saturating_sub(1);
        if let Some(condition) = &self.condition {
            match machine
                .value(call, condition, memory, inputs)
                .map(|value| is_true(&value))
            {
                Ok(Some(true)) => {}
                Ok(Some(false)) => return Reached::No,
                Ok(None) => return Reached::Fault(format!("the condition `{condition}` is not a number")),
                Err(error) => {
                    return Reached::Fault(format!("the condition `{condition}` has no value: {error}"));
                }
            }
        }
        self.hit = self.hit.saturating_add(1);
        if self.hits.is_some_and(|rule| !rule.holds(self.hit)) {
            return Reached::No;
        }
        match &self.message {
            None => Reached::Stop,
            Some(message) => {
                let value = |text: &str| match machine.value(call, text, memory, inputs) {
                    Ok(value) => words(&value, machine.arm()),
                    Err(error) => format!("{{{text}: {error}}}"),
                };
                Reached::Says(filled(message, value))
            }
        }
    }
}

/// Whether a number counts as true; `None` of other values.
fn is_true(value: &Value) -> Option<bool> {
    match value {
        Value::Integer(number) => Some(*number != 0),
        Value::Real(number) => Some(*number != 0.0),
        Value::Load(_) | Value::Coordinate(_) | Value::Position(_) => None,
    }
}

/// A value as a program would write it, near enough to be read.
pub(crate) fn words(value: &Value, arm: Arm) -> String {
    let numbers = listed(value, arm).into_iter();
    let words: Vec<String> = numbers.map(|number| readable(number, value.kind())).collect();
    words.join(", ")
}

/// A number of a value of this kind as people read it: coordinates with three decimals, a real with the digits that its 32 bits
/// have, but three at least.
pub fn readable(number: Number, kind: ValueKind) -> String {
    let Number::Real(real) = number else {
        return number.to_string();
    };
    match kind {
        ValueKind::Position | ValueKind::Coordinate | ValueKind::Load => three_decimals(real),
        ValueKind::Integer | ValueKind::Real => {
            // 0.1 is the shortest text of a real, and not that of the same number in 64 bits.
            let single = real as f32;
            let shortest = Some(single).filter(|single| f64::from(*single) == real);
            let shortest = shortest.and_then(|single| single.to_string().parse().ok());
            Number::Real(shortest.unwrap_or(real)).to_string()
        }
    }
}

/// The text with each expression in braces replaced; a brace that is not closed stays.
fn filled(text: &str, mut value: impl FnMut(&str) -> String) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('{') {
        out.push_str(before);
        let Some((expression, left)) = after.split_once('}') else {
            out.push('{');
            out.push_str(after);
            return out;
        };
        out.push_str(&value(expression));
        rest = left;
    }
    out.push_str(rest);
    out
}

ts3100_proto::codes! {
    /// How far one step of a task goes.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum StepKind {
        /// To its next statement.
        Into = "into",
        /// To its next statement that is not in a program called from here.
        Over = "over",
        /// To its next statement after the program it is in has returned.
        Out = "out",
        /// To its next statement after a motion.
        Motion = "motion",
    }
    /// Its word in actions and in the control interface.
    fn as_str -> &'static str;
    impl Word;
}

impl StepKind {
    /// The target of such a step of a task with this number of open calls.
    pub fn target(self, task: u16, depth: usize) -> Target {
        match self {
            StepKind::Into => Target::Into { task },
            StepKind::Over => Target::Over { task, depth },
            StepKind::Out => Target::Over {
                task,
                depth: depth.saturating_sub(1),
            },
            StepKind::Motion => Target::Motion { task },
        }
    }
}

/// The statement of a task at which a step ends. Calls are counted outermost first, the program of the task is 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Target {
    /// The next one of the task.
    Into { task: u16 },
    /// The next one that is in this call, or in one outside it.
    Over { task: u16, depth: usize },
    /// The next one after a motion statement, or after the end of its program.
    Motion { task: u16 },
    /// The one with this number.
    Statement(u64),
}

impl Target {
    /// Whether the step ends before a statement; `has_moved`: its task has begun a motion since the step began.
    pub(crate) fn is_reached(self, statement: &Begun, has_moved: bool) -> bool {
        match self {
            Target::Into { task } => statement.task == task,
            Target::Over { task, depth } => statement.task == task && statement.depth <= depth,
            Target::Motion { task } => statement.task == task && has_moved,
            Target::Statement(number) => statement.number >= number,
        }
    }

    /// The task that steps, if one does.
    pub(crate) fn task(self) -> Option<u16> {
        match self {
            Target::Into { task } | Target::Over { task, .. } | Target::Motion { task } => Some(task),
            Target::Statement(_) => None,
        }
    }
}

ts3100_proto::codes! {
    /// Why the program of a controller stopped last.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
    pub enum StopReason {
        /// A breakpoint.
        Breakpoint = "breakpoint",
        /// The end of a step, or the line to which it ran.
        Step = "step",
        /// An alarm.
        Alarm = "alarm",
        /// STOP, BREAK, or something else that stops a program.
        Stop = "stop",
        /// The end of the program.
        End = "end",
    }
    /// Its word in the control interface.
    fn as_str -> &'static str;
    impl Word;
}

/// The last stop of the program of a controller.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stopped {
    pub reason: StopReason,
    /// The task it concerns, 1 the main program.
    pub task: u16,
    /// File line of the statement whose alarm stopped it. The task may be at the next one: a statement at fault is given up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<u32>,
    /// Why the condition of its breakpoint has no value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
}

/// A statement that begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Begun {
    /// How many began before it.
    pub number: u64,
    pub task: u16,
    pub line: u32,
    /// Number of open calls of its task, those of a monitor's action among them.
    pub depth: usize,
    /// A breakpoint stops at it.
    pub is_stop: bool,
}

/// A value that somebody gives a variable of a halted program, or an input: `text` is an assignment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assignment {
    pub task: u16,
    /// The call that sees the variable, as an index from the outermost.
    pub call: usize,
    pub text: String,
}

impl Assignment {
    /// The variable, as the text names it.
    pub fn target(&self) -> String {
        String::from(self.text.split('=').next().unwrap_or_default().trim())
    }

    /// The line and its state, as texts, if an input is given one: `DIN(3) = 1`.
    pub(crate) fn of_input(&self) -> Option<(&str, &str)> {
        let (target, state) = scol_mini::split_assignment(&self.text)?;
        let (function, rest) = target.split_once('(')?;
        let line = rest.strip_suffix(')')?;
        let is_input = function.trim().eq_ignore_ascii_case("DIN");
        is_input.then_some((line, state))
    }
}

/// Why it halted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum HaltReason {
    /// The line of these breakpoints, by their indices.
    Breakpoints(Vec<usize>),
    /// The condition of this breakpoint has no value.
    Fault {
        breakpoint: usize,
        reason: String,
    },
    Target,
}

/// A halt before a statement.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Halt {
    pub statement: Begun,
    pub reason: HaltReason,
}

/// The place at which a program is to halt, and the statements that were found on the way.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Inspection {
    /// Number of the next statement.
    pub next: u64,
    /// Number of the first statement at which it may halt.
    pub first: u64,
    /// Of this file; they do not count while another one is selected.
    pub breakpoints: Vec<Breakpoint>,
    pub file: String,
    pub target: Option<Target>,
    /// Values that variables are given, each before the statement of this number.
    pub assignments: Vec<(u64, Assignment)>,
    /// The statements that have begun, where they are asked for.
    pub listed: Option<Vec<Begun>>,
    /// Texts of breakpoints, each with the line of its own.
    pub said: Vec<(u32, String)>,
    pub halt: Option<Halt>,
    /// Tasks that have executed a motion statement since `first`.
    pub moved: Vec<u16>,
}

impl Inspection {
    /// The assignments before the statement that is next.
    pub(crate) fn due(&self) -> Vec<Assignment> {
        let due = self.assignments.iter().filter(|(number, _)| *number == self.next);
        due.map(|(_, assignment)| assignment.clone()).collect()
    }

    /// Looks at the statement that a task begins; true if the controller halts before it. `is_selected`: the file of the
    /// breakpoints is. `outside` calls belong to the program which the action of a monitor interrupts.
    pub(crate) fn begins(
        &mut self,
        is_selected: bool,
        machine: &Machine,
        outside: usize,
        memory: &mut Memory,
        inputs: &dyn Inputs,
    ) -> bool {
        let statement = Begun {
            number: self.next,
            task: machine.task_id(),
            line: machine.line(),
            depth: outside + machine.depth(),
            is_stop: false,
        };
        let reason = self.look(is_selected, statement, machine, memory, inputs);
        if let Some(reason) = reason {
            self.halt = Some(Halt { statement, reason });
            return true;
        }
        if statement.number + 1 >= self.first && machine.begins_motion() {
            self.moved.push(statement.task);
        }
        self.next += 1;
        false
    }

    /// Why it halts before a statement, if it does.
    fn look(
        &mut self,
        is_selected: bool,
        mut statement: Begun,
        machine: &Machine,
        memory: &mut Memory,
        inputs: &dyn Inputs,
    ) -> Option<HaltReason> {
        if statement.number < self.first {
            return None;
        }
        let mut stops = Vec::new();
        let mut fault = None;
        for (index, breakpoint) in self.breakpoints.iter_mut().enumerate() {
            if !is_selected || breakpoint.line != statement.line {
                continue;
            }
            match breakpoint.reach(machine, memory, inputs) {
                Reached::No => {}
                Reached::Stop => stops.push(index),
                Reached::Says(text) => self.said.push((statement.line, text)),
                Reached::Fault(reason) => {
                    fault.get_or_insert(HaltReason::Fault {
                        breakpoint: index,
                        reason,
                    });
                }
            }
        }
        statement.is_stop = !stops.is_empty() || fault.is_some();
        if let Some(listed) = self.listed.as_mut().filter(|listed| listed.len() < MAX_LISTED) {
            listed.push(statement);
            // A list is of a run that goes on to its target.
            return (self.target == Some(Target::Statement(statement.number))).then_some(HaltReason::Target);
        }
        let has_moved = self.moved.contains(&statement.task);
        let reached = self
            .target
            .is_some_and(|target| target.is_reached(&statement, has_moved));
        if !stops.is_empty() {
            return Some(HaltReason::Breakpoints(stops));
        }
        fault.or(reached.then_some(HaltReason::Target))
    }
}

/// Why a breakpoint cannot be set at its line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BreakpointError {
    #[error("the condition `{0}`: {1}")]
    Condition(String, Box<ProbeError>),
    #[error("`{{{0}}}` in the message: {1}")]
    Message(String, Box<ProbeError>),
}

/// Why something that was asked of a program has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InspectError {
    #[error("no file is selected")]
    NoFile,
    #[error("task {0} does not run")]
    NoTask(u16),
    /// Not the number of an input.
    #[error("there is no such input; inputs are {LINE_NUMBERS}")]
    NoInput,
    /// An input that the controller itself acts on.
    #[error(
        "input {line} is {name}, which acts on the controller itself: drive it with `ts3100 ctl inputs`, or with `at`"
    )]
    SystemInput { line: u16, name: &'static str },
    /// The value for an input.
    #[error("expected 0 or 1 for an input, found {0}")]
    NoState(String),
    /// See [`ProbeError`].
    #[error(transparent)]
    Probe(#[from] ProbeError),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_for_hits_read_as_editors_write_them() {
        for (text, rule, met) in [
            ("3", HitRule::Exactly(3), [3].as_slice()),
            ("= 3", HitRule::Exactly(3), &[3]),
            (">=4", HitRule::From(4), &[4, 5, 6]),
            ("> 4", HitRule::From(5), &[5, 6]),
            ("%2", HitRule::Every(2), &[2, 4, 6]),
        ] {
            let found: HitRule = text.parse().unwrap();
            assert_eq!(found, rule, "{text}");
            let hits: Vec<u32> = (1..=6).filter(|hit| found.holds(*hit)).collect();
            assert_eq!(hits, met, "{text}");
            assert_eq!(found.to_string().parse(), Ok(found));
        }
        for text in ["", "0", "x", "%0", ">= -1"] {
            assert!(text.parse::<HitRule>().is_err(), "{text}");
        }
    }

    #[test]
    fn numbers_are_shown_with_the_digits_that_matter() {
        let real = |value: f32| Number::Real(f64::from(value));
        for (number, kind, shown) in [
            (Number::Real(399.999_999_999_97), ValueKind::Position, "400.000"),
            (Number::Real(-1e-14), ValueKind::Position, "0.000"),
            (Number::Real(1.0 / 3.0), ValueKind::Load, "0.333"),
            (Number::Integer(11111), ValueKind::Position, "11111"),
            (real(0.1), ValueKind::Real, "0.100"),
            (real(1.0 / 3.0), ValueKind::Real, "0.33333334"),
            (real(12.5), ValueKind::Real, "12.500"),
            (Number::Integer(3), ValueKind::Integer, "3"),
        ] {
            assert_eq!(readable(number, kind), shown);
        }
    }

    #[test]
    fn a_number_is_true_unless_it_is_zero() {
        for (value, truth) in [
            (Value::Integer(0), Some(false)),
            (Value::Integer(-1), Some(true)),
            (Value::Real(0.0), Some(false)),
            (Value::Real(-0.0), Some(false)),
            (Value::Real(0.5), Some(true)),
            (Value::Coordinate(Box::default()), None),
        ] {
            assert_eq!(is_true(&value), truth, "{value:?}");
        }
    }

    #[test]
    fn expressions_in_a_message_become_their_values() {
        let said = filled("part {N} of {TOTAL}, {open", str::to_lowercase);
        assert_eq!(said, "part n of total, {open");
    }
}
