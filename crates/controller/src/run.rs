//! Carries what runs forward: lets the machine execute and stops it between steps where it is to stop.
//! What a statement asks for is served in `serve`; who may start and stop is decided in `ops`.

use crate::Controller;
use crate::alarm::{self, AlarmCode};
use crate::arm::Frames;
use crate::execution::{By, Course, Direct, Doing, Task};
use crate::limits::{SCAN, STATEMENTS_PER_SCAN};
use crate::options::WaitAfterStop;
use crate::output::Event;
use crate::view::View;
use alloc::format;
use alloc::string::String;
use core::cell::Cell;
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

impl Controller {
    /// Runs everything as far as it goes at this instant.
    pub(crate) fn settle(&mut self) {
        self.arm.settle(self.now);
        self.signals.expire(self.now);
        while self.step_direct() || self.step_program() {}
        self.show_state();
        self.release_sp();
    }

    /// Takes the program one step further; false when it waits or does not run.
    fn step_program(&mut self) -> bool {
        let Course::Running { stop } = self.execution.course else {
            return false;
        };
        let Some(mut task) = self.execution.main.take() else {
            return false;
        };
        let ended = stop.filter(|_| self.end_step(&mut task));
        if let Some(by) = ended {
            self.execution.main = Some(task);
            self.stop_program(Course::Continue, by);
            return true;
        }
        let step = self.advance(&mut task, self.traced || self.state.run_mode == RunMode::Step);
        self.execution.main = Some(task);
        match step {
            Step::Blocked => return false,
            Step::Begun => {}
            Step::Done { motion } => self.between_steps(motion),
            Step::Stopped => self.stop_program(Course::Continue, By::Other),
            Step::Ended => self.end_cycle(),
            Step::Trouble(code, detail) => self.raise(code, detail),
        }
        true
    }

    /// A step is over: the operation mode may end the run here.
    fn between_steps(&mut self, motion: bool) {
        let stops = match self.state.run_mode {
            RunMode::Step => true,
            RunMode::Segment => motion,
            RunMode::Cycle | RunMode::Continuous => false,
        };
        if stops && self.execution.course == (Course::Running { stop: None }) {
            self.stop_program(Course::Continue, By::Other);
        }
    }

    /// END of the main program (D8, CMD-SP-10).
    fn end_cycle(&mut self) {
        let stop_wanted = self.execution.course != (Course::Running { stop: None });
        if self.state.run_mode == RunMode::Continuous && !stop_wanted {
            if let Some(task) = &mut self.execution.main {
                if !task.machine.go_to_rcycle() {
                    task.machine.restart();
                }
                task.doing = Doing::Ready;
            }
            self.show_cycle_end();
            return;
        }
        let by = match self.execution.course {
            Course::Running { stop: Some(by) } => by,
            Course::Running { stop: None } | Course::Reset | Course::Retry | Course::Continue => By::Other,
        };
        self.execution.rewind(self.now);
        self.stop_program(Course::Reset, by);
        self.show_cycle_end();
    }

    /// Ends the present step for a stop, where that can be done now; true if the task stands between steps.
    fn end_step(&mut self, task: &mut Task) -> bool {
        match &task.doing {
            Doing::Ready | Doing::Pausing { .. } => {}
            Doing::Moving | Doing::Holding | Doing::Delaying { .. } => return false,
            Doing::Reading { got, .. } => {
                let answer = Answer::Cancelled(got.clone());
                // The values that came are stored; a value the variable cannot hold is lost with the INPUT.
                if task.machine.answer(self.execution.memory_mut(), answer).is_err() {
                    task.machine.skip();
                }
            }
            Doing::Watching { .. } => match self.config.options.wait_after_stop {
                WaitAfterStop::Next => task.machine.skip(),
                WaitAfterStop::Again => {}
            },
        }
        task.doing = Doing::Ready;
        true
    }

    /// Takes the statement of DO one step further.
    fn step_direct(&mut self) -> bool {
        let Some(mut direct) = self.execution.direct.take() else {
            return false;
        };
        if let Some(until) = direct.shown_until {
            let over = until <= self.now;
            if over {
                self.execution.direct_done = true;
                self.report_status();
            } else {
                self.execution.direct = Some(direct);
            }
            return over;
        }
        match self.advance(&mut direct.task, false) {
            Step::Blocked => {
                self.execution.direct = Some(direct);
                return false;
            }
            Step::Begun => self.execution.direct = Some(direct),
            Step::Done { motion } => {
                self.execution.direct = Some(Direct {
                    moved: direct.moved || motion,
                    ..direct
                });
            }
            Step::Stopped | Step::Ended => {
                let shown = if direct.moved {
                    self.config.options.do_min_run
                } else {
                    Duration::ZERO
                };
                let until = direct.since + shown;
                self.execution.direct = Some(Direct {
                    shown_until: Some(until.max(self.now)),
                    ..direct
                });
            }
            Step::Trouble(code, detail) => {
                self.raise(code, detail);
                self.report_status();
            }
        }
        true
    }

    /// Carries a task forward as far as one statement, or one slice of statements.
    fn advance(&mut self, task: &mut Task, single: bool) -> Step {
        match &task.doing {
            Doing::Ready | Doing::Watching { .. } => self.execute(task, single),
            Doing::Pausing { until } if *until > self.now => Step::Blocked,
            Doing::Pausing { .. } => self.execute(task, single),
            Doing::Holding if self.state.feed_hold => Step::Blocked,
            Doing::Holding => {
                task.doing = Doing::Ready;
                self.execute(task, single)
            }
            Doing::Moving if self.arm.is_moving() => Step::Blocked,
            Doing::Moving => self.answer(task, Answer::Done, true),
            Doing::Delaying { until } if *until > self.now => Step::Blocked,
            Doing::Delaying { .. } => self.answer(task, Answer::Done, false),
            Doing::Reading { .. } => self.read_values(task),
        }
    }

    /// Ends the statement under way by giving it what it asked for.
    pub(crate) fn answer(&mut self, task: &mut Task, answer: Answer, motion: bool) -> Step {
        task.doing = Doing::Ready;
        match task.machine.answer(self.execution.memory_mut(), answer) {
            Ok(()) => Step::Done { motion },
            Err(fault) => fail(task, &fault),
        }
    }

    fn execute(&mut self, task: &mut Task, single: bool) -> Step {
        if task.scan_at < self.now {
            task.budget = STATEMENTS_PER_SCAN;
            task.scan_at = self.now;
        }
        if task.budget == 0 {
            task.doing = Doing::Pausing {
                until: self.now + SCAN,
            };
            return Step::Blocked;
        }
        if self.traced && !matches!(task.doing, Doing::Watching { .. }) {
            let line = task.machine.line();
            self.event(Event::Statement { line });
        }
        let given = if single { 1 } else { task.budget };
        let mut fuel = given;
        let (pause, changing) = self.run_machine(task, &mut fuel);
        task.budget = task.budget.saturating_sub(given - fuel);
        task.doing = Doing::Ready;
        match pause {
            Pause::Fuel => Step::DONE,
            Pause::Ended => Step::Ended,
            Pause::Waiting => {
                task.doing = Doing::Watching {
                    again: changing.then(|| self.now + SCAN),
                };
                Step::Blocked
            }
            Pause::Fault(fault) => fail(task, &fault),
            Pause::Request(request) => self.serve(task, request),
        }
    }

    fn run_machine(&mut self, task: &mut Task, fuel: &mut u32) -> (Pause, bool) {
        let frames = Frames::of(self.execution.memory().conditions());
        let view = View {
            signals: &self.signals,
            arm: &self.arm,
            frames,
            run_mode: self.state.run_mode,
            now: self.now,
            changing: Cell::new(false),
        };
        let pause = task.machine.run(self.execution.memory_mut(), &view, fuel);
        (pause, view.changing.get())
    }
}

/// A statement that cannot be executed is given up; its alarm of level 2 stops the program behind it.
fn fail(task: &mut Task, fault: &Fault) -> Step {
    task.machine.skip();
    Step::Trouble(alarm_of(fault.kind), format!("{fault}"))
}

fn alarm_of(kind: FaultKind) -> AlarmCode {
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
