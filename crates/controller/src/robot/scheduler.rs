//! Runs the program, its tasks and the statement of DO as far as they go at one instant, and stops them between steps.
//!
//! Start at `run()`. A statement that needs the robot is served in `requests`; who may start and stop is decided in `ops`
//! and `panel`.

use crate::executor::scol_inputs::ScolInputs;
use crate::executor::step::Step;
use crate::executor::{MAIN_TASK, RunState, Standstill, StopCause, Task, TaskState};
use crate::inspection::StopReason;
use crate::options::UnknownInput;
use crate::output::Event;
use crate::persistence::Change;
use crate::port::Port;
use crate::port_facts::PortFacts;
use crate::prelude::*;
use crate::robot::Robot;
use crate::time::Time;
use bytes::Bytes;
use core::cell::Cell;
use scol_mini::{Memory, MonitorAction, Pause};
use ts3100_proto::command::RunMode;

/// Request of a statement to the controller, which alone sees ports and robot together. The program continues when it
/// is done.
#[derive(Debug)]
pub(crate) enum RunEffect {
    /// Bytes of a PRINT on their way to a port.
    Print {
        port: Port,
        bytes: Bytes,
        /// By the program, not by DO.
        by_program: bool,
    },
    /// RESTORE writes the file.
    Restore {
        change: Box<Change>,
        /// By DO.
        direct: bool,
    },
}

/// Result of the turn of a task.
pub(crate) enum Turn {
    /// All tasks wait, or nothing runs.
    Over,
    /// A task has gone on.
    Taken,
    /// A task has gone on and asks for something.
    Asks(RunEffect),
}

impl Robot {
    /// Runs the program and the statement of DO as far as they go at this instant, or up to something that is asked of
    /// the controller. After bytes of a PRINT the program continues when they are sent ([`Robot::printed`]), because
    /// the next PRINT waits for the room that they leave.
    pub(crate) fn run(&mut self, ports: &dyn PortFacts) -> Option<RunEffect> {
        if self.executor.is_halted() {
            return None;
        }
        if self.panel.state().powered {
            loop {
                // A DO and a program never run together (D7), so the order decides nothing.
                let mut turn = self.step_direct(ports);
                if matches!(turn, Turn::Over) {
                    turn = self.step_program(ports);
                }
                match turn {
                    Turn::Over => break,
                    Turn::Taken => {}
                    Turn::Asks(effect) => return Some(effect),
                }
            }
            if self.executor.is_halted() {
                return None;
            }
            self.show_state();
        }
        self.update_maintenance();
        None
    }

    /// The bytes of a PRINT are sent: its step ends.
    pub(crate) fn printed(&mut self, by_program: bool) {
        if by_program {
            self.between_steps(false);
        }
    }

    /// Takes one task one step further.
    fn step_program(&mut self, ports: &dyn PortFacts) -> Turn {
        let RunState::Running { stop } = self.executor.run_state() else {
            return Turn::Over;
        };
        // One statement at a time where something is looked at between two of them.
        let single = self.context.outputs.is_traced()
            || self.executor.inspection().is_some()
            || self.panel.state().run_mode == RunMode::Step
            || self.executor.breakpoints().are_set();
        let mut standing = true;
        for id in self.executor.order() {
            let sleeps = |task: &Task| task.id() == id && task.sleeps(self.context.now);
            if stop.is_none() && self.executor.program_tasks().any(sleeps) {
                standing = false;
                continue;
            }
            let Some(mut task) = self.executor.take_task(id) else {
                continue;
            };
            // A task between two steps waits here until the others have ended theirs.
            if stop.is_some() && self.end_step(&mut task) {
                self.executor.put_task(task);
                continue;
            }
            standing = false;
            let step = self.advance(ports, &mut task, single, stop.is_some());
            self.executor.put_task(task);
            if self.executor.is_halted() {
                return Turn::Over;
            }
            if !matches!(step, Step::Blocked) {
                self.executor.give_turn(id);
                return self.after(id, step);
            }
        }
        let held = self.executor.waits_for_resume(&self.arm);
        // A motion with PASS or NOWAIT outlasts its statement: the program stands when the arm rests. An arm that
        // PAUSE holds never would, so its motion is interrupted.
        let stops = stop.filter(|_| standing && (held || !self.arm.is_moving()));
        match stops {
            Some(by) if held => self.interrupt(by),
            Some(by) => self.stop_program(Standstill::BetweenSteps, by),
            None => return Turn::Over,
        }
        Turn::Taken
    }

    fn after(&mut self, id: u16, step: Step) -> Turn {
        match step {
            Step::Print { port, bytes } => {
                return Turn::Asks(RunEffect::Print {
                    port,
                    bytes,
                    by_program: true,
                });
            }
            Step::Blocked | Step::Begun => {}
            Step::Done { motion } => self.between_steps(motion),
            Step::Switch { to } => {
                self.executor.give_turn(to);
                self.between_steps(false);
            }
            Step::Restore { names } => return self.restore_data(&names, false),
            Step::Stopped => self.stop_after_step(StopCause::Other),
            Step::Ended => self.end_task(id),
            Step::Killed { id } => {
                // The step ends before the task: with a stop pending, a killed main program begins no further cycle.
                self.between_steps(false);
                self.end_task(id);
            }
            Step::Alarm { code, line, detail } => self.raise_in(id, line, code, detail),
        }
        Turn::Taken
    }

    /// A step has ended: the operation mode may end the run here.
    pub(crate) fn between_steps(&mut self, motion: bool) {
        let stops = match self.panel.state().run_mode {
            RunMode::Step => true,
            RunMode::Segment => motion,
            RunMode::Cycle | RunMode::Continuous => false,
        };
        if stops || self.executor.breakpoints().stops_after_step() {
            self.executor.note_stop(StopReason::Step);
            self.stop_after_step(StopCause::Other);
        }
    }

    /// END of the main program (D8, CMD-SP-10).
    pub(crate) fn end_cycle(&mut self) {
        let stop = match self.executor.run_state() {
            RunState::Running { stop } => stop,
            RunState::Reset | RunState::Retry | RunState::Continue => Some(StopCause::Other),
        };
        if self.panel.state().run_mode == RunMode::Continuous && stop.is_none() {
            self.executor.begin_cycle();
        } else {
            // Rewound first, so that the status of the stop shows the first line.
            self.executor.rewind(self.context.now);
            self.stop_program(Standstill::FirstStep, stop.unwrap_or(StopCause::Other));
        }
        // Last: CYC_END is a pulse or a level, depending on whether the program runs on.
        self.show_cycle_end();
    }

    /// A task has ended, and its motion with it; the end of the main program ends the cycle and every motion.
    pub(crate) fn end_task(&mut self, id: u16) {
        if self.executor.release_arm(id) {
            self.arm.stop(self.context.now);
        }
        if id == MAIN_TASK {
            self.end_cycle();
        } else {
            self.executor.drop_task(id);
        }
    }

    /// Carries a task forward as far as one statement, or one slice of statements. A handler goes first, unless
    /// everything is to stop and it is between its statements.
    pub(crate) fn advance(
        &mut self,
        ports: &dyn PortFacts,
        task: &mut Task,
        single: bool,
        stopping: bool,
    ) -> Step {
        if let Some(mut handler) = task.take_handler(stopping) {
            if !(stopping && self.end_step(&mut handler)) {
                let outside = task.machine().depth();
                let step = self.carry(ports, &mut handler, single, outside);
                if matches!(step, Step::Ended) {
                    return task.end_handler(&handler);
                }
                task.put_handler(handler);
                return step;
            }
            task.put_handler(handler);
        } else if !stopping && let Some(step) = self.look_at_monitors(task) {
            return step;
        }
        // Monitors are looked at between statements, so one statement at a time.
        self.carry(ports, task, single || task.machine().has_monitors(), 0)
    }

    /// ON ... DO: looks at the monitors of a task, between its statements, when something changes, and once a scan
    /// while time alone can change them. `None` if none acts.
    fn look_at_monitors(&mut self, task: &mut Task) -> Option<Step> {
        let seen = task.monitors_see(self.context.now)?;
        let (inputs, memory) = self.inputs_and_memory(seen);
        match task.check_monitors(memory, &inputs) {
            Ok(None) => None,
            Ok(Some(MonitorAction::Jump(jump))) => {
                // The motion is given up with its statement; one that nobody waits for goes on.
                if task.state().is_motion() {
                    self.arm.stop(self.context.now);
                }
                task.jump(self.executor.memory_mut(), jump);
                Some(Step::DONE)
            }
            Ok(Some(MonitorAction::Handler(machine))) => {
                task.put_handler(Box::new(Task::new(*machine, self.context.now)));
                Some(Step::Begun)
            }
            Err(fault) => Some(Step::monitor_fault(&fault)),
        }
    }

    fn end_step(&mut self, task: &mut Task) -> bool {
        let (wait, paused) = (
            self.context.config.options.wait_after_stop,
            self.executor.is_paused(),
        );
        task.end_step(self.executor.memory_mut(), wait, paused)
    }

    /// Ends the wait of the task if it has expired, or executes its next statements. The action of a monitor interrupts as
    /// many calls as there are `outside`.
    fn carry(&mut self, ports: &dyn PortFacts, task: &mut Task, single: bool, outside: usize) -> Step {
        let now = self.context.now;
        let waits = match *task.state() {
            TaskState::Ready | TaskState::Watching { .. } | TaskState::Reading { .. } => false,
            TaskState::Pausing { until } | TaskState::Delaying { until } => until > now,
            TaskState::Holding => self.is_held(),
            TaskState::Resting => self.arm.is_moving(),
            // A motion after one that is held has no begin yet.
            TaskState::Queued { .. } => {
                let begin = self.arm.last_begins_at();
                begin.map_or(self.arm.is_moving(), |begin| begin > now)
            }
            // With ACCUR = COARSE the statement is over `lead` before the motion. A motion that is held has no end.
            TaskState::Moving { lead } => {
                let end = self.arm.ends_at();
                end.map_or(self.arm.is_moving(), |end| end - lead > now)
            }
        };
        if waits {
            return Step::Blocked;
        }
        match *task.state() {
            TaskState::Ready | TaskState::Watching { .. } | TaskState::Pausing { .. } => {}
            TaskState::Holding | TaskState::Resting => task.enter(TaskState::Ready),
            TaskState::Queued { lead, passing } => return self.begun(task, lead, passing),
            TaskState::Moving { .. } => return self.executor.moved(task),
            TaskState::Delaying { .. } => return self.executor.done(task),
            TaskState::Reading { .. } => {
                return self.told_of_answer(task, Robot::read_values);
            }
        }
        if !task.has_budget(self.context.now) {
            return Step::Blocked;
        }
        if self.stops_before(task, outside) {
            return Step::Stopped;
        }
        if self.inspect(task, outside) {
            return Step::Blocked;
        }
        let pause = match self.context.outputs.is_traced() && task.begins_statement() {
            true => self.run_told(task, single),
            false => {
                let (inputs, memory) = self.inputs_and_memory(task.sees(self.context.now));
                task.run(memory, &inputs, single)
            }
        };
        match pause {
            Pause::Fuel => Step::DONE,
            // A motion that nobody waited for ends first.
            Pause::Ended if self.moves(task) && !task.machine().handler_ended() => {
                task.wait(TaskState::Resting)
            }
            Pause::Ended => Step::Ended,
            Pause::Waiting => Step::Blocked,
            Pause::Fault(fault) => task.fail(&fault),
            Pause::Request(request) => {
                self.told_of_answer(task, |robot, task| robot.serve(ports, task, request))
            }
        }
    }

    /// Whether a breakpoint, or the end of a step, stops the program before the statement that a task would begin now.
    fn stops_before(&mut self, task: &Task, outside: usize) -> bool {
        if !self.executor.may_stop_before(task) {
            return false;
        }
        let mut breakpoints = core::mem::take(self.executor.breakpoints_mut());
        let (inputs, memory) = self.inputs_and_memory(self.context.now);
        let mut said = Vec::new();
        let stops = breakpoints.stops_before(task, outside, memory, &inputs, |text| said.push(text));
        *self.executor.breakpoints_mut() = breakpoints;
        let (line, task) = (task.line(), task.id());
        for text in said {
            self.context.outputs.event(Event::Breakpoint { line, task, text });
        }
        stops
    }

    /// Lets the inspection, if there is one, look at the statement that a task begins; true if the program halts before it.
    fn inspect(&mut self, task: &mut Task, outside: usize) -> bool {
        let Some(mut inspection) = self.executor.inspection_mut().take() else {
            return false;
        };
        let mut halts = false;
        if task.id() >= MAIN_TASK && task.begins_statement() {
            for assignment in inspection.due() {
                // It was tried when it was made.
                let _ = self.assign_between(task, outside, &assignment);
            }
            let is_selected = inspection.file == self.executor.file();
            let (inputs, memory) = self.inputs_and_memory(self.context.now);
            halts = inspection.begins(is_selected, task.machine(), outside, memory, &inputs);
        }
        *self.executor.inspection_mut() = Some(inspection);
        halts
    }

    /// Executes a statement and tells its event. Nothing else is put out meanwhile, so the event comes before all that the
    /// statement leads to.
    fn run_told(&mut self, task: &mut Task, single: bool) -> Pause {
        let watched = self.context.outputs.watched();
        let (line, id) = (task.line(), task.id());
        let (seen, mut detail) = (watched.map(|watched| self.read_watched(watched)), None);
        let (is_detailed, arm) = (self.context.outputs.is_detailed(), self.arm.kind());
        let (inputs, memory) = self.inputs_and_memory(task.sees(self.context.now));
        let pause = if is_detailed {
            let (pause, told) = task.run_told(memory, &inputs, arm);
            detail = Some(told);
            pause
        } else {
            task.run(memory, &inputs, single)
        };
        self.context.outputs.event(Event::Statement {
            line,
            task: id,
            seen,
            detail,
        });
        pause
    }

    /// Serves the request of a statement, whose values are told with the statement after it.
    fn told_of_answer(&mut self, task: &mut Task, serve: impl FnOnce(&mut Robot, &mut Task) -> Step) -> Step {
        let is_told = self.context.outputs.is_detailed();
        let recipients = is_told.then(|| task.machine().recipients());
        let step = serve(self, task);
        if let Some(recipients) = recipients.filter(|recipients| !recipients.is_empty()) {
            task.note_received(self.executor.memory(), &recipients, self.arm.kind());
        }
        step
    }

    /// Inputs of a program at `now`, and the data with which it runs; coordinate systems and TIMER are the executor's.
    pub(crate) fn inputs_and_memory(&mut self, now: Time) -> (ScolInputs<'_>, &mut Memory) {
        let inputs = ScolInputs {
            signals: &self.signals,
            arm: &self.arm,
            frames: self.arm.frames(now, self.executor.memory().conditions()),
            run_mode: self.panel.state().run_mode,
            now,
            timer: self.executor.timer(now),
            unknown_inputs: self.context.config.options.din_unknown == UnknownInput::Zero,
            changing: Cell::new(false),
        };
        (inputs, self.executor.memory_mut())
    }

    /// Whether the arm is on a motion of this task.
    pub(crate) fn moves(&self, task: &Task) -> bool {
        self.arm.is_moving() && self.executor.owns_arm(task)
    }
}
