//! Actions of the owner of the controller on the robot, without a command: `crate::action`.
//!
//! `controller::owner` calls these; a refusal says why in a sentence.

use crate::action::ActionError;
use crate::action_error::ActionResult;
use crate::alarm::AlarmCode;
use crate::arm::Frames;
use crate::inspection::{Assignment, Breakpoint, InspectError, StepKind};
use crate::io::signals::{IoKind, LINE_NUMBERS, Signals};
use crate::limits::{MAX_BREAKPOINT_TEXT, MAX_BREAKPOINTS, TAUGHT_STEPS};
use crate::persistence::Change;
use crate::prelude::*;
use crate::refusal::{OperateError, SelectError};
use crate::robot::Robot;
use bytes::Bytes;
use core::fmt::Display;
use core::time::Duration;
use scol_mini::{AccessError, Position, ValueKind};
use ts3100_proto::command::{Number, VariableKind, VariableWrite};
use ts3100_proto::name::{FileName, VariableName};
use ts3100_proto::words::Word;

fn no_statement(line: u32) -> String {
    format!("no statement is in line {line} or after it")
}

impl Robot {
    /// Raises an alarm of the table by its number.
    pub(crate) fn raise_by_number(&mut self, number: &str, detail: String) -> ActionResult {
        let row = AlarmCode::from_number(number).ok_or_else(|| unknown_alarm(number))?;
        self.raise(row, detail);
        Ok(())
    }

    /// Sets the breakpoints of the selected file.
    pub(crate) fn set_breakpoints(&mut self, breakpoints: Vec<Breakpoint>) -> ActionResult {
        let refused =
            |reason: &dyn Display| ActionError::cannot("breakpoints", "set the breakpoints", reason);
        let mut program = None;
        if !breakpoints.is_empty() {
            self.executor
                .selected()
                .ok_or_else(|| refused(&"no file is selected"))?;
            program = Some(self.next_program().map_err(|reason| refused(&reason))?);
        }
        let count = breakpoints.len();
        if count > MAX_BREAKPOINTS {
            let reason = format!("there can be {MAX_BREAKPOINTS}, and these are {count}");
            return Err(refused(&reason));
        }
        if let Some(long) = breakpoints.iter().find(|set| !set.fits()) {
            let reason = format!(
                "line {}: a condition and a message have at most {MAX_BREAKPOINT_TEXT} bytes",
                long.line
            );
            return Err(refused(&reason));
        }
        let program = program.as_deref();
        let found = self.executor.found_breakpoints(breakpoints, program);
        let found = found.map_err(|line| refused(&no_statement(line)))?;
        let before = self.executor.breakpoints().set();
        for added in found.iter().filter(|set| set.find_in(before).is_none()) {
            let checked = program.map_or(Ok(()), |program| added.check(program));
            checked.map_err(|reason| {
                let line = added.line;
                let place = format!("line {line}");
                ActionError::cannot(&place, format!("set the breakpoint of line {line}"), reason)
            })?;
        }
        self.executor.set_breakpoints(found);
        Ok(())
    }

    /// Runs the program until it comes to the line.
    pub(crate) fn run_to(&mut self, line: u32) -> ActionResult {
        let verb = format!("run to line {line}");
        let refused = |reason: &dyn Display| ActionError::cannot("run-to", &verb, reason);
        if !self.executor.program_runs() {
            // The lines are those of the file as it is on the drive.
            self.renew_stale().map_err(|reason| refused(&reason))?;
        }
        if !self.executor.stop_before_line(line) {
            return Err(refused(&no_statement(line)));
        }
        if !self.executor.program_runs()
            && let Err(reason) = self.start()
        {
            self.executor.drop_target();
            return Err(refused(&reason));
        }
        Ok(())
    }

    /// Runs the stopped program until a step of this task ends.
    pub(crate) fn step_task(&mut self, kind: StepKind, task: u16) -> ActionResult {
        let verb = format!("step task {task}");
        let refused = |reason: &dyn Display| ActionError::cannot("step-task", &verb, reason);
        if self.executor.program_runs() {
            return Err(refused(&OperateError::ProgramRuns));
        }
        self.renew_stale().map_err(|reason| refused(&reason))?;
        let found = self.executor.program_tasks().find(|found| found.id() == task);
        let depth = found.map(|found| found.parts().map(|part| part.machine().depth()).sum());
        let depth = depth.ok_or_else(|| refused(&InspectError::NoTask(task)))?;
        self.start().map_err(|reason| refused(&reason))?;
        self.executor.stop_after_step_of_task(kind.target(task, depth));
        Ok(())
    }

    /// Carries out an assignment in a call of the stopped program.
    pub(crate) fn assign_while_stopped(&mut self, assignment: &Assignment) -> ActionResult {
        let target = assignment.target();
        let refused = |reason: &dyn Display| ActionError::cannot(&target, format!("set {target}"), reason);
        if self.executor.program_runs() {
            return Err(refused(&"the program is running; stop it first"));
        }
        let text = &assignment.text;
        if scol_mini::split_assignment(text).is_none() {
            return Err(refused(&format!("expected NAME = VALUE, found `{text}`")));
        }
        let done = self.assign(assignment);
        done.map(drop).map_err(|reason| refused(&reason))
    }

    /// Sets a user output as IW does.
    pub(crate) fn set_user_output(&mut self, line: u16, on: bool) -> ActionResult {
        let bus = self.context.config.options.field_bus;
        let set = self.signals.set_user_outputs([(line, on)].into_iter(), bus);
        set.map_err(|line| {
            let numbers = Signals::user_output_numbers(line, bus);
            let sentence = format!("cannot set output {line}: user outputs are {numbers}");
            ActionError::missing("output", sentence)
        })
    }

    pub(crate) fn pulse_line(&mut self, side: IoKind, line: u16, on: bool, length: Duration) -> ActionResult {
        if !Signals::exists(line) {
            return Err(no_line(side, line));
        }
        let (until, bus) = (self.context.now + length, self.context.config.options.field_bus);
        match side {
            IoKind::Input => {
                self.drive_input(line, on);
                self.signals.schedule_input(line, until, !on);
            }
            IoKind::Output if on && Signals::is_user_output(line, bus) => {
                self.signals.pulse_output(line, until);
            }
            IoKind::Output => {
                let reason = match on {
                    true => format!("user outputs are {}", Signals::user_output_numbers(line, bus)),
                    false => "an output is pulsed to on only".into(),
                };
                let verb = format!("give output {line} a pulse");
                return Err(ActionError::cannot("output", verb, reason));
            }
        }
        Ok(())
    }

    pub(crate) fn force_line(&mut self, side: IoKind, line: u16, state: Option<bool>) -> ActionResult {
        let was = self.signals.input(line);
        if !self.signals.force(side, line, state) {
            return Err(no_line(side, line));
        }
        if side == IoKind::Input {
            self.input_is_now(line, was);
        }
        Ok(())
    }

    pub(crate) fn set_variable(
        &mut self,
        name: &str,
        values: Vec<Number>,
        restore: bool,
    ) -> Result<Option<Change>, ActionError> {
        let variable = self.variable_name(name)?;
        let write = VariableWrite {
            restore,
            variable,
            kind: VariableKind::Unclarified,
            values,
        };
        self.write_variable(&write, None)
            .map_err(|reason| ActionError::cannot(name, format!("set {name}"), reason))
    }

    /// The name of a variable that exists.
    fn variable_name(&self, name: &str) -> Result<VariableName, ActionError> {
        if name.contains('.') {
            let reason = "variables of programs can only be read";
            return Err(ActionError::cannot(name, format!("set {name}"), reason));
        }
        let variable = VariableName::parse(name).map_err(|error| {
            ActionError::missing(name, format!("`{name}` is not the name of a variable: {error}"))
        })?;
        let selected = self.executor.selected();
        selected
            .ok_or_else(|| ActionError::conflict(name, format!("cannot find {name}: no file is selected")))?;
        if let Err(
            error @ (AccessError::Unknown(_) | AccessError::NotGlobal(_) | AccessError::Subscript(_)),
        ) = self.executor.global(&variable)
        {
            return Err(ActionError::missing(name, format!("cannot find {name}: {error}")));
        }
        Ok(variable)
    }

    pub(crate) fn teach(&mut self, name: &str, restore: bool) -> Result<Option<Change>, ActionError> {
        let variable = self.variable_name(name)?;
        let info = self.executor.program().variable(&variable.name);
        let kind = info.and_then(|info| info.kind);
        if let Some(kind) = kind.filter(|kind| *kind != ValueKind::Position) {
            let reason = format!("it is {}, not positional data", kind.description());
            return Err(ActionError::cannot(name, format!("teach {name}"), reason));
        }
        let frames = Frames::new(self.executor.memory().conditions());
        let values = self.arm.here(self.context.now, &frames).listed(self.arm.kind());
        let steps = |value: f64| libm::round(value * TAUGHT_STEPS) / TAUGHT_STEPS + 0.0;
        // The configuration stands last and is whole; the others may be written as reals throughout.
        let values = values
            .into_iter()
            .map(|value| Number::Real(steps(value)))
            .collect();
        self.set_variable(name, values, restore)
    }

    /// See [`Controller::place_arm`](crate::Controller::place_arm).
    pub(crate) fn place_arm(&mut self, world: &[f64]) -> ActionResult {
        let refused = |reason: &dyn Display| ActionError::cannot("arm", "place the arm", reason);
        if self.arm.is_moving() || self.executor.is_running() {
            return Err(refused(&"it is under way; stop the program first"));
        }
        let conditions = self.executor.memory().conditions();
        let frames = Frames::new(conditions);
        let mut numbers = self.arm.pose(self.context.now, conditions).world_values();
        let (most, kind) = (numbers.len(), self.arm.kind());
        if world.len() > most + 1 {
            let found = world.len();
            return Err(refused(&format_args!(
                "expected at most {most} coordinates, found {found}"
            )));
        }
        // A configuration of 0 leaves the posture open.
        numbers.push(0.0);
        for (number, given) in numbers.iter_mut().zip(world) {
            *number = *given;
        }
        let Some(position) = Position::from_listed(kind, &numbers) else {
            return Err(refused(&"expected a configuration such as 11111 at the end"));
        };
        self.arm
            .place(&position, &frames)
            .map_err(|reason| refused(&reason))
    }

    pub(crate) fn put_file(&self, name: &str, content: &[u8]) -> Result<Option<Change>, ActionError> {
        let name = file_name(name)?;
        let place = name.as_str();
        if self.executor.is_running() && self.executor.file() == place {
            let (verb, reason) = (
                format!("replace {place}"),
                "it is running; stop the program first",
            );
            return Err(ActionError::cannot(place, verb, reason));
        }
        let staged = self.drive.stage(&name, Bytes::copy_from_slice(content));
        staged
            .map(|staged| Some(staged.into()))
            .map_err(|error| ActionError::cannot(place, format!("store {place}"), error))
    }

    pub(crate) fn erase_file(&self, name: &str) -> Result<Option<Change>, ActionError> {
        let name = file_name(name)?;
        let place = name.as_str();
        if !self.drive.contains(place) {
            let sentence = format!("cannot erase {place}: it is not on the RAM drive");
            return Err(ActionError::missing(place, sentence));
        }
        let staged = self.stage_erase(&name);
        staged
            .map(|staged| Some(staged.into()))
            .map_err(|reason| ActionError::cannot(place, format!("erase {place}"), reason))
    }

    pub(crate) fn select_by_name(&mut self, name: &str) -> ActionResult {
        let name = file_name(name)?;
        let place = name.as_str();
        let refused = |error: SelectError| match error {
            SelectError::Name(_) | SelectError::Missing(_) => {
                ActionError::missing(place, format!("cannot select {place}: {error}"))
            }
            SelectError::Parameter(_) | SelectError::Running | SelectError::Errors { .. } => {
                ActionError::cannot(place, format!("select {place}"), error)
            }
        };
        self.select_file(&name).map_err(refused)?;
        self.report_status();
        Ok(())
    }
}

fn unknown_alarm(number: &str) -> ActionError {
    if let Some(new) = AlarmCode::replacement(number) {
        return ActionError::missing("alarm", format!("there is no alarm {number}; {new} replaces it"));
    }
    let hint = AlarmCode::did_you_mean(number);
    ActionError::missing("alarm", format!("there is no alarm {number}{hint}"))
}

/// There is no such line.
pub(crate) fn no_line(side: IoKind, line: u16) -> ActionError {
    let side = side.word();
    let sentence = format!("there is no {side} {line}: {side}s are {LINE_NUMBERS}");
    ActionError::missing(side, sentence)
}

fn file_name(name: &str) -> Result<FileName, ActionError> {
    FileName::parse(name)
        .map_err(|error| ActionError::missing(name, format!("`{name}` is not the name of a file: {error}")))
}
