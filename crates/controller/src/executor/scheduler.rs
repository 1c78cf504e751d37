//! Runs the program, its tasks and the statement of DO as far as they go at one instant, and stops them between steps.
//!
//! Start at `run()`. A statement that needs the robot is served in `requests`; who may start and stop is decided in `ops`
//! and `panel`.

use crate::alarm::{self, AlarmCode};
use crate::endpoint::Endpoints;
use crate::executor::scol_inputs::ScolInputs;
use crate::executor::{Executor, RunState, Standstill, StopCause, Task, TaskState};
use crate::limits::{SCAN, STATEMENTS_PER_SCAN};
use crate::options::WaitAfterStop;
use crate::output::Event;
use crate::robot::Robot;
use crate::time::Time;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::time::Duration;
use scol_mini::{Answer, Fault, FaultKind, Pause};
use ts3100_proto::command::RunMode;

/// How far a task came.
pub(crate) enum Step {
    /// It waits for something.
    Blocked,
    /// A statement has begun that takes time.
    Begun,
    /// A statement is over.
    Done {
        /// It moved the arm.
        motion: bool,
    },
    /// A statement is over, and with it the turn of its task.
    Switch {
        /// The task whose turn it is.
        to: u16,
    },
    /// A statement is over that ends a task.
    Killed {
        /// That task.
        id: u16,
    },
    /// RESTORE is over as a statement; the file is written when every task stands in its place.
    Restore {
        /// What is to be restored; none: all.
        names: Vec<String>,
    },
    /// STOP was executed.
    Stopped,
    /// The main program, or the statement of DO, is over.
    Ended,
    /// Something went wrong; the detail says what and where.
    Trouble(AlarmCode, String),
}

impl Step {
    /// A statement without motion is over.
    pub(crate) const DONE: Step = Step::Done { motion: false };
}

impl Robot {
    /// Runs the program and the statement of DO as far as they go at this instant.
    pub(crate) fn run(&mut self, endpoints: &mut Endpoints) {
        if self.panel.state().powered {
            while self.step_direct(endpoints) || self.step_program(endpoints) {
                if self.persistence.is_pending() {
                    return;
                }
            }
            self.show_state();
        }
        self.update_maintenance();
    }

    /// Takes one task one step further; false when all wait or nothing runs.
    fn step_program(&mut self, endpoints: &mut Endpoints) -> bool {
        let RunState::Running { stop } = self.executor.operation.state() else {
            return false;
        };
        let single = self.traced || self.panel.state().run_mode == RunMode::Step;
        let mut standing = true;
        for id in self.executor.order() {
            if stop.is_none() && self.executor.task(id).is_some_and(|task| task.sleeps(self.now)) {
                standing = false;
                continue;
            }
            let Some(mut task) = self.executor.take_task(id) else {
                continue;
            };
            if stop.is_some() && self.end_step(&mut task) {
                self.executor.put_task(task);
                continue;
            }
            standing = false;
            let step = self.advance(endpoints, &mut task, single, stop.is_some());
            self.executor.put_task(task);
            if !matches!(step, Step::Blocked) {
                self.executor.turn = id;
                self.after(id, step);
                return true;
            }
        }
        match stop {
            Some(by) if standing && !self.arm.is_moving() => {
                self.stop_program(Standstill::BetweenSteps, by);
                true
            }
            _ => false,
        }
    }

    fn after(&mut self, id: u16, step: Step) {
        match step {
            Step::Blocked | Step::Begun => {}
            Step::Done { motion } => self.between_steps(motion),
            Step::Switch { to } => {
                self.executor.turn = to;
                self.between_steps(false);
            }
            Step::Restore { names } => {
                self.restore_data(names, false);
            }
            Step::Stopped => self.stop_after_step(StopCause::Other),
            Step::Ended => self.end_task(id),
            Step::Killed { id } => {
                self.between_steps(false);
                self.end_task(id);
            }
            Step::Trouble(code, detail) => self.raise(code, detail),
        }
    }

    /// A step is over: the operation mode may end the run here.
    pub(crate) fn between_steps(&mut self, motion: bool) {
        let stops = match self.panel.state().run_mode {
            RunMode::Step => true,
            RunMode::Segment => motion,
            RunMode::Cycle | RunMode::Continuous => false,
        };
        if stops {
            self.stop_after_step(StopCause::Other);
        }
    }

    /// END of the main program (D8, CMD-SP-10).
    pub(crate) fn end_cycle(&mut self) {
        let stop_wanted = self.executor.operation.state() != (RunState::Running { stop: None });
        if self.panel.state().run_mode == RunMode::Continuous && !stop_wanted {
            self.executor.drop_tasks();
            if let Some(task) = &mut self.executor.main {
                task.handler = None;
                if !task.machine.go_to_rcycle() {
                    task.machine.restart();
                }
                task.doing = TaskState::Ready;
            }
            self.show_cycle_end();
            return;
        }
        let by = match self.executor.operation.state() {
            RunState::Running { stop: Some(by) } => by,
            RunState::Running { stop: None } | RunState::Reset | RunState::Retry | RunState::Continue => {
                StopCause::Other
            }
        };
        self.executor.rewind(self.now);
        self.stop_program(Standstill::FirstStep, by);
        self.show_cycle_end();
    }

    /// Ends the present step for a stop, where that can be done now; true if the task stands between steps.
    fn end_step(&mut self, task: &mut Task) -> bool {
        if let Some(mut handler) = task.handler.take() {
            let stands = self.end_step(&mut handler);
            task.handler = Some(handler);
            if !stands {
                return false;
            }
        }
        match &task.doing {
            TaskState::Ready | TaskState::Pausing { .. } => {}
            TaskState::Moving { .. }
            | TaskState::Queued { .. }
            | TaskState::Resting
            | TaskState::Holding
            | TaskState::Delaying { .. } => return false,
            TaskState::Reading { .. } => {
                task.end_reading(self.executor.memory_mut());
            }
            TaskState::Watching { .. } => match self.config.options.wait_after_stop {
                WaitAfterStop::Next => task.machine.skip(),
                WaitAfterStop::Again => {}
            },
        }
        task.doing = TaskState::Ready;
        true
    }

    /// Carries a task forward as far as one statement, or one slice of statements. A handler goes first, unless
    /// everything is to stop and it stands between its statements.
    pub(super) fn advance(
        &mut self,
        endpoints: &mut Endpoints,
        task: &mut Task,
        single: bool,
        stopping: bool,
    ) -> Step {
        if stopping || task.handler.is_some() {
            // Nobody looks at the monitors now: a time to do so would come again and again.
            task.look_at = None;
        }
        if let Some(mut handler) = task.handler.take() {
            if stopping && self.end_step(&mut handler) {
                task.handler = Some(handler);
            } else {
                let step = self.carry(endpoints, &mut handler, single);
                if matches!(step, Step::Ended) {
                    return Step::DONE;
                }
                task.handler = Some(handler);
                return step;
            }
        } else if !stopping && let Some(step) = self.look_at_monitors(task) {
            return step;
        }
        self.carry(endpoints, task, single || task.machine.has_monitors())
    }

    fn carry(&mut self, endpoints: &mut Endpoints, task: &mut Task, single: bool) -> Step {
        match &task.doing {
            TaskState::Ready | TaskState::Watching { .. } => self.execute(endpoints, task, single),
            TaskState::Pausing { until } if *until > self.now => Step::Blocked,
            TaskState::Pausing { .. } => self.execute(endpoints, task, single),
            TaskState::Holding if self.is_held() => Step::Blocked,
            TaskState::Resting if self.arm.is_moving() => Step::Blocked,
            TaskState::Holding | TaskState::Resting => {
                task.doing = TaskState::Ready;
                self.execute(endpoints, task, single)
            }
            TaskState::Queued { .. } if self.arm.last_begins_at().is_some_and(|begin| begin > self.now) => {
                Step::Blocked
            }
            TaskState::Queued { lead, passing } => {
                let (lead, passing) = (*lead, *passing);
                self.begun(task, lead, passing)
            }
            TaskState::Moving { lead } if !self.has_arrived(*lead) => Step::Blocked,
            TaskState::Moving { .. } => self.answer(task, Answer::Done, true),
            TaskState::Delaying { until } if *until > self.now => Step::Blocked,
            TaskState::Delaying { .. } => self.answer(task, Answer::Done, false),
            TaskState::Reading { .. } => self.read_values(task),
        }
    }

    /// Whether the motion under way is over, or as good as over.
    fn has_arrived(&self, lead: Duration) -> bool {
        !self.arm.is_moving() || self.arm.ends_at().is_some_and(|end| end - lead <= self.now)
    }

    /// When the program or the statement of DO can go on by itself.
    pub(crate) fn program_deadline(&self) -> Option<Time> {
        let deadlines = [self.executor.deadline(), self.arrives_at()];
        deadlines.into_iter().flatten().min()
    }

    /// When a motion counts as arrived before its end.
    fn arrives_at(&self) -> Option<Time> {
        let end = self.arm.ends_at()?;
        let tasks = self.executor.program_tasks();
        let direct = self.executor.direct.as_ref().map(|direct| &direct.task);
        let leads = tasks.chain(direct).map(Task::acting).filter_map(|task| {
            let TaskState::Moving { lead } = task.doing else {
                return None;
            };
            Some(end - lead).filter(|arrival| *arrival > self.now)
        });
        let begins = motion_waits(&self.executor)
            .then(|| self.arm.last_begins_at())
            .flatten();
        leads.chain(begins.filter(|begin| *begin > self.now)).min()
    }

    /// Ends the statement under way by giving it what it asked for.
    pub(crate) fn answer(&mut self, task: &mut Task, answer: Answer, motion: bool) -> Step {
        task.doing = TaskState::Ready;
        match task.machine.answer(self.executor.memory_mut(), answer) {
            Ok(()) => Step::Done { motion },
            Err(fault) => fail(task, &fault),
        }
    }

    fn execute(&mut self, endpoints: &mut Endpoints, task: &mut Task, single: bool) -> Step {
        if task.scan_at < self.now {
            task.budget = STATEMENTS_PER_SCAN;
            task.scan_at = self.now;
        }
        if task.budget == 0 {
            task.doing = TaskState::Pausing {
                until: self.now + SCAN,
            };
            return Step::Blocked;
        }
        if self.traced && task.machine.begins_statement() && !matches!(task.doing, TaskState::Watching { .. })
        {
            let line = task.machine.line();
            let task = task.id();
            self.event(Event::Statement { line, task });
        }
        // A WAIT looks at what time alone changes once a scan, however often something else happens in between.
        let due = match task.doing {
            TaskState::Watching { again } => again.filter(|again| *again > self.now),
            _ => None,
        };
        let given = match task.doing {
            TaskState::Watching { .. } => 0,
            _ if single => 1,
            _ => task.budget,
        };
        let mut fuel = given;
        let (pause, changing) = self.run_machine(task, &mut fuel, due.map_or(self.now, |due| due - SCAN));
        task.budget = task.budget.saturating_sub(given - fuel);
        task.doing = TaskState::Ready;
        match pause {
            Pause::Fuel => Step::DONE,
            // A motion that nobody waited for ends first.
            Pause::Ended if self.moves(task) && !task.machine.handler_ended() => {
                task.doing = TaskState::Resting;
                Step::Blocked
            }
            Pause::Ended => Step::Ended,
            Pause::Waiting => {
                task.doing = TaskState::Watching {
                    again: changing.then(|| due.unwrap_or(self.now + SCAN)),
                };
                Step::Blocked
            }
            Pause::Fault(fault) => fail(task, &fault),
            Pause::Request(request) => self.serve(endpoints, task, request),
        }
    }

    /// Whether the arm is on a motion of this task.
    pub(crate) fn moves(&self, task: &Task) -> bool {
        let id = task.id();
        self.arm.is_moving() && (id == 0 || self.executor.arm_owner == Some(id))
    }

    fn run_machine(&mut self, task: &mut Task, fuel: &mut u32, seen: Time) -> (Pause, bool) {
        let view = ScolInputs::new(
            &self.signals,
            &self.arm,
            &self.executor,
            self.panel.state().run_mode,
            seen,
        )
        .with_unknown_inputs(self.config.options.din_unknown);
        let pause = task.machine.run(self.executor.memory_mut(), &view, fuel);
        (pause, view.is_changing())
    }
}

/// Whether a motion waits behind the one under way.
fn motion_waits(execution: &Executor) -> bool {
    execution
        .program_tasks()
        .any(|task| matches!(task.acting().doing, TaskState::Queued { .. }))
}

/// A statement that cannot be executed is given up; its alarm of level 2 stops the program behind it.
pub(crate) fn fail(task: &mut Task, fault: &Fault) -> Step {
    task.machine.skip();
    Step::Trouble(alarm_of(fault.kind), format!("{fault}"))
}

pub(crate) fn alarm_of(kind: FaultKind) -> AlarmCode {
    match kind {
        FaultKind::DivisionByZero => alarm::DIVISION_BY_ZERO,
        FaultKind::Undefined => alarm::UNDEFINED_VARIABLE,
        FaultKind::Type => alarm::TYPE_MISMATCH,
        FaultKind::Range => alarm::OUT_OF_RANGE,
        FaultKind::Subscript => alarm::SUBSCRIPT,
        FaultKind::Nesting => alarm::NESTING,
        FaultKind::Overflow => alarm::OVERFLOW,
        FaultKind::NextWithoutFor => alarm::NEXT_WITHOUT_FOR,
        FaultKind::Domain => alarm::DOMAIN,
    }
}
