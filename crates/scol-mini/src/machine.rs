//! The machine that runs a compiled program until something outside has to happen.
//!
//! The machine holds its place in the program, the open calls and loops and the pending request; the values of variables are
//! in [`Memory`], which several machines may share. `vm` runs the instructions, on `registers`; `execute` does the statements
//! that are more than values, whose operands `evaluate` computes; `request_values` makes requests, `monitor` watches conditions, `told` says
//! what a statement does.
//! Serving requests, clocks and motion are left to the caller. Start with [`Machine::run`].

mod arithmetic;
mod compose;
mod evaluate;
mod execute;
mod fast_sine;
mod frames;
mod functions;
mod loops;
mod monitor;
mod place;
mod registers;
mod request_values;
mod snapshot;
#[cfg(test)]
mod tests;
mod told;
mod trial;
mod vm;

use crate::prelude::*;
use alloc::sync::Arc;

use crate::memory::{MAIN_TASK, Memory};
use crate::program::{Operation, Program, STATE_VERSION};
use crate::request::{Answer, Fault, FaultKind, Inputs, Pause, Request};
use crate::tree::{Ask, Change, Simple};
use crate::value::{Number, Position};

pub(crate) use arithmetic::convert;
use evaluate::Execution;
pub use frames::Local;
pub use monitor::{Jump, MonitorAction};
pub(crate) use place::outside_array;
use place::{Argument, ValuePlace};
pub(crate) use request_values::FIELD;
pub use told::{Effect, Recipient, Way};
pub(crate) use trial::{TrialInputs, try_operations, try_value};

/// Jumps followed in search of the next motion.
const MAX_JUMPS_AHEAD: usize = 4;

/// The fault is boxed, so that a result of a number fits two machine words. Its line is set where the statement is known.
pub(crate) type Result<T, E = Box<Fault>> = core::result::Result<T, E>;

impl FaultKind {
    /// A fault of this kind, on a line that is not known yet.
    #[cold]
    pub(crate) fn error(self, message: impl Into<String>) -> Box<Fault> {
        let (kind, line, message) = (self, 0, message.into());
        Box::new(Fault { kind, line, message })
    }

    /// The fault as the result of what fails with it.
    #[cold]
    pub(crate) fn fail<T>(self, message: impl Into<String>) -> Result<T> {
        Err(self.error(message))
    }
}

/// A program under way: where it is, what it waits for, which calls and loops are open.
///
/// ```text
///            run: statement begins             request
///  Ready ---------------------------> (step) ----------> Requested
///    ^  ^                                |  WAIT false      | answer, skip
///    |  |        WAIT true, skip         v                  |
///    |  +---------------------------- Waiting               |
///    +------------------------------------------------------+
///  END of the main program: Ended, until restart or go_to_rcycle
/// ```
///
/// A machine is written without its program and says only which it is. What is read back stands
/// still until `relink` gives it the program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Machine {
    /// [`STATE_VERSION`].
    #[serde(deserialize_with = "crate::snapshot::version")]
    version: u32,
    #[serde(with = "crate::snapshot::source")]
    program: Arc<Program>,
    /// The step under way or next.
    at: usize,
    frames: Vec<Frame>,
    /// The arguments of all open calls, one call after the other.
    arguments: Vec<Argument>,
    /// The FOR loops of all open calls, one call after the other.
    loops: Vec<Loop>,
    state: RunPhase,
    /// ID of its task (`TID`).
    task: u16,
    monitors: Vec<monitor::Monitor>,
    /// The last word was `ENABLE`, not `DISABLE`: the conditions of the monitors are evaluated.
    monitors_enabled: bool,
    /// `IGNORE` has been executed. What a monitor runs does not hold the monitors that it drops.
    ignored: bool,
    /// The motion statement answered last, when that under way or next is the motion after it.
    motion_before: Option<usize>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum RunPhase {
    /// Before a step.
    Ready,
    /// A WAIT has begun; each run evaluates its condition again, without fuel.
    Waiting,
    /// A request waits for its answer.
    Requested(PendingRequest),
    /// The statement could not be executed; it is tried again unless it is skipped.
    Faulted,
    /// The main program is over.
    Ended,
}

/// A request and where its numbers go.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct PendingRequest {
    request: Request,
    targets: Vec<ValuePlace>,
}

/// A program that was called, the main program first.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
struct Frame {
    return_to: usize,
    /// Index of its first argument.
    arguments: usize,
    /// Index of its first loop.
    loops: usize,
}

/// A FOR under way: its step, the one after its NEXT, and the numbers it counts with.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Loop {
    opener: usize,
    exit: usize,
    limit: Number,
    step: Number,
}

/// Whether the caller has to act before the next statement: there is a new monitor, or HERE and DEST refer to another
/// coordinate system.
fn needs_host(operation: &Operation) -> bool {
    if let Operation::Simple(Simple::Change(Change::Set(condition, _))) = operation {
        return condition.is_frame();
    }
    matches!(operation, Operation::On { .. })
}

fn is_motion(operation: &Operation) -> bool {
    matches!(operation, Operation::Simple(Simple::Ask(Ask::Move { .. })))
}

impl Machine {
    /// A machine before step 1 of the main program.
    pub fn main(program: Arc<Program>) -> Self {
        Self {
            version: STATE_VERSION,
            at: program.first,
            program,
            frames: Vec::from([Frame::default()]),
            arguments: Vec::new(),
            loops: Vec::new(),
            state: RunPhase::Ready,
            task: MAIN_TASK,
            monitors: Vec::new(),
            monitors_enabled: true,
            ignored: false,
            motion_before: None,
        }
    }

    /// A machine before the first statement of the PROGRAM block with this index, as the task `task`.
    pub fn task(program: Arc<Program>, block: usize, task: u16) -> Self {
        let at = program.blocks.get(block).map_or(0, |entry| entry.step);
        Self {
            at,
            task,
            ..Self::main(program)
        }
    }

    /// ID of its task: 1 for the main program.
    pub fn task_id(&self) -> u16 {
        self.task
    }

    /// A machine for the statement of [`compile_direct`](crate::compile_direct); it ends after it.
    pub fn direct(program: Arc<Program>) -> Self {
        Self {
            task: 0,
            arguments: alloc::vec![Argument::Unset; program.created],
            ..Self::main(program)
        }
    }

    /// Runs until the fuel is used up or something outside has to happen.
    ///
    /// Each statement takes 1 from `fuel` when it begins; labels, blank lines and comments cost nothing, END
    /// costs 1 too. A statement that has begun is finished without more fuel. While a request is pending, returns the same
    /// request again. After a fault the machine stays on the statement and the next run tries it again.
    pub fn run(&mut self, memory: &mut Memory, inputs: &dyn Inputs, fuel: &mut u32) -> Pause {
        match &self.state {
            RunPhase::Requested(pending) => return Pause::Request(pending.request.clone()),
            RunPhase::Ended => return Pause::Ended,
            RunPhase::Ready | RunPhase::Faulted | RunPhase::Waiting => {}
        }
        let program = Arc::clone(&self.program);
        let entry = program
            .code
            .entries
            .get(self.at)
            .map_or(usize::MAX, |at| *at as usize);
        let mut left = u64::from(*fuel);
        if self.state == RunPhase::Waiting {
            // A WAIT that goes on waiting has paid when it began. One after THEN costs nothing: its IF has paid.
            let cost = program.code.instructions.get(entry).map_or(0, |first| first.cost);
            left += u64::from(cost);
        }
        self.state = RunPhase::Ready;
        let done = self.enter(&program, memory, inputs).compute(entry, &mut left);
        *fuel = u32::try_from(left).unwrap_or(u32::MAX);
        if let Err(error) = done {
            return Pause::Fault(self.faulted(*error));
        }
        match &self.state {
            RunPhase::Waiting => Pause::Waiting,
            RunPhase::Requested(pending) => Pause::Request(pending.request.clone()),
            RunPhase::Ended => Pause::Ended,
            RunPhase::Ready | RunPhase::Faulted => Pause::Fuel,
        }
    }

    /// Gives the pending request its answer; the next [`run`](Machine::run) goes on with the next statement.
    ///
    /// # Errors
    /// `Type` when nothing is pending or the answer is not one for the request, `Range` when the count of numbers is
    /// wrong (the request stays pending); the fault of storing a number that does not fit its variable, which is then
    /// 0, as are all after it.
    pub fn answer(&mut self, memory: &mut Memory, answer: Answer) -> Result<(), Fault> {
        let RunPhase::Requested(pending) = &self.state else {
            return Err(self.fault(*FaultKind::Type.error("no request is pending")));
        };
        let pending = pending.clone();
        let numbers = numbers(&pending.request, answer).map_err(|error| self.fault(*error))?;
        self.state = RunPhase::Ready;
        let reads_ahead = matches!(pending.request, Request::Move(_)) && self.motion_ahead().is_some();
        self.motion_before = reads_ahead.then_some(self.at);
        let program = Arc::clone(&self.program);
        let mut execution = self.enter(&program, memory, &NoInputs);
        let mut stored = Ok(());
        for (place, number) in pending.targets.iter().zip(numbers) {
            stored = stored.and_then(|()| execution.write(*place, number.into()));
            if stored.is_err() {
                // It is the first fault that counts.
                let _ = execution.write(*place, Number::Integer(0).into());
            }
        }
        stored.map_err(|error| self.faulted(*error))?;
        self.at += 1;
        self.leave_if();
        Ok(())
    }

    /// From the end of the statement after THEN past the one after ELSE: the next statement of the file is next, for its line and
    /// for breakpoints too.
    fn leave_if(&mut self) {
        while let Some(step) = self.program.steps.get(self.at)
            && let (false, Operation::Jump(target)) = (step.head, &step.operation)
        {
            self.at = *target;
        }
    }

    /// Back to the motion before the one under way or next, if nothing but that was executed since: it is done again.
    pub fn redo_motion_before(&mut self) {
        if let Some(at) = self.motion_before.take() {
            self.at = at;
            self.state = RunPhase::Ready;
        }
    }

    /// The motion before the one under way or next is over.
    pub fn end_motion_before(&mut self) {
        self.motion_before = None;
    }

    /// Back to step 1 of the main program; calls, loops and a pending request are dropped.
    pub fn restart(&mut self) {
        self.go_to(self.program.first);
    }

    /// Moves to the label `RCYCLE` of the main program and drops calls and loops. Returns `false`, with nothing
    /// changed, if there is no such label.
    pub fn go_to_rcycle(&mut self) -> bool {
        let step = self.program.rcycle;
        if let Some(step) = step {
            self.go_to(step);
        }
        step.is_some()
    }

    fn go_to(&mut self, step: usize) {
        *self = Self {
            at: step,
            task: self.task,
            ..Self::main(Arc::clone(&self.program))
        };
    }

    /// File line, from 1, of the statement under way or next.
    pub fn line(&self) -> u32 {
        let step = self.program.steps.get(self.at);
        step.or(self.program.steps.first()).map_or(1, |step| step.line)
    }

    /// The open calls, the main program or the program of a task first: name in upper case, and the file line it is at. A
    /// statement of DO has none.
    pub fn calls(&self) -> impl Iterator<Item = (&str, u32)> {
        let returns = self
            .frames
            .iter()
            .skip(1)
            .map(|frame| frame.return_to.saturating_sub(1));
        returns.chain([self.at]).filter_map(|at| {
            let step = self.program.steps.get(at)?;
            Some((self.program.block_of(at)?.name.as_str(), step.line))
        })
    }

    /// The operation of the step under way or next.
    fn operation(&self) -> Option<&Operation> {
        self.program.steps.get(self.at).map(|step| &step.operation)
    }

    /// Abandons the statement under way (a pending request, a `WAIT`, or one at fault) with all its parts: the next
    /// one follows. Between statements nothing happens.
    pub fn skip(&mut self) {
        if !matches!(self.state, RunPhase::Ready | RunPhase::Ended) {
            loop {
                // The action of an ON is no part of the statement.
                self.at = match self.operation() {
                    Some(Operation::On { after, .. }) => *after,
                    _ => self.at + 1,
                };
                if self.program.steps.get(self.at).is_none_or(|step| step.head) {
                    break;
                }
            }
            self.state = RunPhase::Ready;
            self.motion_before = None;
        }
    }

    /// Goes on in another compilation of its program, one that differs in initial values and lines alone: what
    /// [`rewrite_value`](crate::rewrite_value) makes.
    pub fn relocate(&mut self, program: &Arc<Program>) {
        self.program = Arc::clone(program);
    }

    /// File line of the next statement, when that is a motion that follows whatever comes of the present one.
    pub fn motion_ahead(&self) -> Option<u32> {
        let mut at = self.at + 1;
        for _ in 0..MAX_JUMPS_AHEAD {
            let step = self.program.steps.get(at)?;
            let Operation::Jump(target) = step.operation else {
                return is_motion(&step.operation).then_some(step.line);
            };
            at = target;
        }
        None
    }

    /// Whether a statement of the file begins with the next step. Not while one asks for something, however often it is
    /// tried, and not where the action of a monitor is over.
    pub fn begins_statement(&self) -> bool {
        !matches!(self.state, RunPhase::Requested(_) | RunPhase::Ended)
            && !matches!(self.operation(), Some(Operation::HandlerEnd))
    }

    /// Whether this is the action of a monitor, and over: the motion under way is not its own.
    pub fn handler_ended(&self) -> bool {
        self.state == RunPhase::Ended && matches!(self.operation(), Some(Operation::HandlerEnd))
    }

    /// The request that waits for its answer.
    pub fn pending(&self) -> Option<&Request> {
        match &self.state {
            RunPhase::Requested(pending) => Some(&pending.request),
            RunPhase::Ready | RunPhase::Waiting | RunPhase::Faulted | RunPhase::Ended => None,
        }
    }

    /// Returns the execution of this task. The memory gets the variables of the task.
    fn enter<'a>(
        &'a mut self,
        program: &'a Program,
        memory: &'a mut Memory,
        inputs: &'a dyn Inputs,
    ) -> Execution<'a> {
        memory.switch_task(program, self.task);
        memory.begin_code(program);
        Execution {
            machine: self,
            program,
            memory,
            inputs,
            vectors: Vec::new(),
        }
    }

    /// Ends the calls beyond this many, with their arguments and loops.
    fn unwind(&mut self, depth: usize) {
        if let Some(frame) = self.frames.get(depth) {
            self.arguments.truncate(frame.arguments);
            self.loops.truncate(frame.loops);
            self.frames.truncate(depth);
        }
    }

    fn fault(&self, error: Fault) -> Fault {
        let line = self.line();
        Fault { line, ..error }
    }

    /// The fault of a statement, on which the machine stays.
    fn faulted(&mut self, error: Fault) -> Fault {
        self.state = RunPhase::Faulted;
        self.fault(error)
    }
}

/// The numbers an answer holds, filled up with zeros after a cancellation (INP-10).
fn numbers(request: &Request, answer: Answer) -> Result<Vec<Number>> {
    let message = match (request, answer) {
        (Request::Input { expected, .. }, Answer::Values(numbers)) if numbers.len() == *expected => {
            return Ok(numbers);
        }
        (Request::Input { expected, .. }, Answer::Cancelled(mut numbers)) if numbers.len() <= *expected => {
            numbers.resize(*expected, Number::Integer(0));
            return Ok(numbers);
        }
        (Request::Input { expected, .. }, Answer::Values(numbers) | Answer::Cancelled(numbers)) => {
            return FaultKind::Range.fail(format!("INPUT wants {expected} numbers, found {}", numbers.len()));
        }
        (Request::Task { .. }, Answer::Values(numbers)) if numbers.len() == 1 => return Ok(numbers),
        (Request::Input { .. }, Answer::Done) => "INPUT wants numbers",
        (Request::Task { .. }, _) => "TASK wants one task ID",
        (_, Answer::Done) => return Ok(Vec::new()),
        (_, Answer::Values(_) | Answer::Cancelled(_)) => "only INPUT and TASK take numbers",
    };
    FaultKind::Type.fail(message)
}

/// The world of a constant: none.
pub(crate) struct NoInputs;

impl Inputs for NoInputs {
    fn din(&self, _: u16) -> bool {
        false
    }
    fn dout(&self, _: u16) -> bool {
        false
    }
    fn motion_percent(&self) -> f64 {
        100.0
    }
    fn here(&self) -> Position {
        Position::default()
    }
    fn mode(&self) -> i32 {
        0
    }
}
