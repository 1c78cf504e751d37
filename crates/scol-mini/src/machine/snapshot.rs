//! Validates a machine that was read back against the steps of its program, before it runs.
//!
//! The variables are validated in `memory::snapshot`.

use alloc::sync::Arc;
use core::ops::RangeInclusive;

use super::arithmetic::double;
use super::place::{Argument, ValuePlace};
use super::request_values::MAX_AXIS;
use super::{Loop, Machine, PendingRequest, RunPhase, is_motion};
use crate::conditions::{FULL, MAX_ACCEL};
use crate::program::{Operation, Program};
use crate::request::{MAX_PRINT, Path, Request};
use crate::snapshot::{self, RestoreError, expect};
use crate::{MAX_CALL_NESTING, MAX_MONITORS};

/// Possible numbers of calls, the main program included.
const DEPTH: RangeInclusive<usize> = 1..=MAX_CALL_NESTING + 1;

impl Machine {
    /// Gives a restored machine its program; it continues where the written one was.
    ///
    /// # Errors
    /// [`RestoreError`]: the state is of another program, or no run of the program leads to it.
    pub fn relink(&mut self, program: Arc<Program>) -> Result<(), RestoreError> {
        snapshot::belongs(self.program.fingerprint(), &program)?;
        let steps = program.steps.len();
        expect(self.at <= steps, "a step of the program")?;
        self.check_frames(steps)?;
        let mut arguments = self.arguments.iter();
        arguments.try_for_each(|argument| check_argument(argument, &program, self.arguments.len()))?;
        let mut loops = self.loops.iter();
        loops.try_for_each(|open| check_loop(open, &program))?;
        let few = self.monitors.len() <= MAX_MONITORS;
        expect(few, "no more monitors than a task has")?;
        for monitor in &self.monitors {
            let on = program.steps.get(monitor.on).map(|step| &step.operation);
            let begun = matches!(on, Some(Operation::On { .. }));
            expect(begun, "monitors that an ON began")?;
            let called = DEPTH.contains(&monitor.depth);
            expect(called, "monitors of programs that were called")?;
        }
        if let Some(before) = self.motion_before {
            let motion = program.steps.get(before).map(|step| &step.operation);
            expect(motion.is_some_and(is_motion), "a motion before the next one")?;
        }
        if let RunPhase::Requested(pending) = &self.state {
            expect(self.at < steps, "a statement that asks")?;
            check_pending(pending, &program, self.arguments.len())?;
        }
        self.program = program;
        Ok(())
    }

    /// The frames divide the arguments and the loops among them in their order.
    fn check_frames(&self, steps: usize) -> Result<(), RestoreError> {
        expect(DEPTH.contains(&self.frames.len()), "calls as deep as they can be")?;
        let (mut arguments, mut loops) = (0, 0);
        for frame in &self.frames {
            expect(frame.return_to <= steps, "returns to steps of the program")?;
            let in_order = (arguments..=self.arguments.len()).contains(&frame.arguments)
                && (loops..=self.loops.len()).contains(&frame.loops);
            expect(in_order, "arguments and loops in the order of the calls")?;
            (arguments, loops) = (frame.arguments, frame.loops);
        }
        Ok(())
    }
}

fn check_place(place: ValuePlace, program: &Program, arguments: usize) -> Result<(), RestoreError> {
    let exists = match place {
        ValuePlace::Cell { slot, cell } => {
            let slot = program.symbols.slots.get(slot);
            slot.is_some_and(|slot| (slot.base..slot.base + slot.length()).contains(&cell))
        }
        ValuePlace::Argument(at) => at < arguments,
    };
    expect(exists, "variables of the program")
}

fn check_argument(argument: &Argument, program: &Program, arguments: usize) -> Result<(), RestoreError> {
    match argument {
        Argument::Place(place) => check_place(*place, program, arguments),
        Argument::Number(number) => snapshot::value(&(*number).into()),
        Argument::Unset => expect(program.created > 0, "variables that a statement of DO makes"),
        Argument::Vector(value) => {
            expect(!value.kind().is_number(), "a number handed over as a number")?;
            snapshot::value(value)
        }
    }
}

fn check_loop(open: &Loop, program: &Program) -> Result<(), RestoreError> {
    let opener = program.steps.get(open.opener).map(|step| &step.operation);
    let begun = matches!(opener, Some(Operation::For { exit, .. }) if *exit == open.exit);
    expect(begun, "loops that a FOR began")?;
    let (limit, step) = (double(open.limit), double(open.step));
    let counts = limit.is_finite() && step.is_finite() && step != 0.0;
    expect(counts, "loops with a limit, and a step that is not 0")
}

fn check_pending(pending: &PendingRequest, program: &Program, arguments: usize) -> Result<(), RestoreError> {
    let PendingRequest { request, targets } = pending;
    let mut places = targets.iter();
    places.try_for_each(|place| check_place(*place, program, arguments))?;
    let seconds = |seconds: f64| expect(seconds.is_finite() && seconds >= 0.0, "seconds from 0 up");
    match request {
        Request::Move(motion) => {
            snapshot::conditions(&motion.conditions)?;
            check_path(&motion.path)
        }
        Request::Print { data, .. } => expect(data.len() <= MAX_PRINT, "a PRINT as long as it can be"),
        Request::Input { expected, .. } => {
            expect(*expected == targets.len(), "a variable for each number of INPUT")
        }
        Request::Delay { seconds: time } => seconds(*time),
        Request::Pulse { line, seconds: time } => {
            expect(*line > 0, "outputs that count from 1")?;
            seconds(*time)
        }
        Request::Outputs(lines) => {
            let count = lines.iter().all(|(line, _)| *line > 0);
            expect(count, "outputs that count from 1")
        }
        Request::Hand { hand, .. } => expect((1..=2).contains(hand), "hand 1 or 2"),
        Request::OverFull { percent } => expect(
            (FULL..=MAX_ACCEL).contains(percent),
            "ACCEL and DECEL of 1 to 100000",
        ),
        Request::SetTimer { seconds } => snapshot::numbers(&[*seconds]),
        Request::Task { program: block } => {
            let exists = *block < program.blocks.len() && targets.len() <= 1;
            expect(exists, "a task of a program of the file")
        }
        Request::Restore { names } => {
            let exist = names.iter().all(|name| program.symbols.find(name).is_some());
            expect(exist, "names of GLOBAL and DATA")
        }
        Request::BufferReset { .. }
        | Request::Stop
        | Request::Break
        | Request::Pause
        | Request::Resume
        | Request::Switch
        | Request::Kill { .. } => Ok(()),
    }
}

fn check_path(path: &Path) -> Result<(), RestoreError> {
    let axis = |axis: u8, value: f64| {
        expect((1..=MAX_AXIS).contains(&axis), "an axis from 1 to 8")?;
        snapshot::numbers(&[value])
    };
    match path {
        Path::Ptp(to) | Path::Line(to) => snapshot::position(to),
        Path::Arc { via, end } => {
            snapshot::position(via)?;
            snapshot::position(end)
        }
        Path::Arch {
            end,
            retreat,
            single_axis_1,
            single_axis_2,
        } => {
            snapshot::position(end)?;
            snapshot::numbers(&[*retreat, *single_axis_1, *single_axis_2])
        }
        Path::Axis { axis: number, value } => axis(*number, *value),
        Path::AxisBy { axis: number, delta } => axis(*number, *delta),
        Path::Ready => Ok(()),
    }
}
