//! The selected file, its tasks, and the statement of DO.
//!
//! `run_state` has the states of automatic operation with their diagram, `task` those of a task. It does nothing by itself:
//! `robot::scheduler` runs the tasks against arm, lines and ports, `robot::requests` serves what they ask for,
//! `robot::run_control` starts and stops.

mod breakpoints;
pub(crate) mod direct;
mod relink;
mod run_state;
pub(crate) mod scol_inputs;
pub(crate) mod selection;
pub(crate) mod step;
mod task;
pub(crate) mod tasks;

pub use breakpoints::Breakpoints;
use direct::Direct;
pub use run_state::{Operation, RunState, Standstill, StopCause};
use selection::Selected;
pub use task::{Task, TaskState, TaskView};

use crate::arm::Arm;
use crate::inspection::{Inspection, StopReason};
use crate::port::Port;
use crate::prelude::*;
use crate::time::Time;
use alloc::collections::BTreeMap;
use alloc::sync::Arc;
use scol_mini::{Channel, LanguageOptions, MAX_TASKS, Machine, Memory, Program};
use ts3100_proto::status::ExecutionStatus;

/// ID of the main program (M-58762 p.2-27).
pub const MAIN_TASK: u16 = 1;

/// The running timer of TIMER.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stopwatch {
    /// When it was set.
    set_at: Time,
    /// To how many seconds.
    seconds: f64,
}

impl Stopwatch {
    /// Set to this many seconds at `now`.
    pub(crate) fn new(seconds: f64, now: Time) -> Stopwatch {
        Stopwatch { set_at: now, seconds }
    }

    /// Seconds at `now`.
    pub(crate) fn read(&self, now: Time) -> f64 {
        self.seconds + now.since(self.set_at).as_secs_f64()
    }
}

/// Everything that runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Executor {
    /// The selected file.
    selected: Option<Selected>,
    /// Its main program; there is one exactly while a file is selected.
    main: Option<Task>,
    /// The tasks it has started, by their IDs.
    tasks: BTreeMap<u16, Task>,
    /// ID of the task that executes statements next.
    turn: u16,
    /// ID of the next task.
    next_task: u16,
    /// The task that moves the arm: the first that did.
    arm_owner: Option<u16>,
    /// Line of the last motion statement that began.
    motion_line: u32,
    /// PASS of that motion, in percent; 0 where the arm is to rest at its end.
    pass: f64,
    /// The motion is held by PAUSE.
    paused: bool,
    /// TIMER.
    timer: Stopwatch,
    /// Automatic operation.
    operation: Operation,
    /// The statement of DO, while it runs.
    direct: Option<Direct>,
    /// Where the program stops besides its end.
    breakpoints: Breakpoints,
    /// DO statements that have ended or were cut short since power-on, modulo 10 (SM field DC, hosts 8.1).
    direct_ended: u8,
    /// Until then SF, SU and SM show RUN for a DO statement that has ended or failed already (hosts 8.10). Nothing is
    /// refused for it.
    run_shown_until: Option<Time>,
    /// The program of DO while no file is selected.
    #[serde(skip, default = "no_program")]
    spare_program: Arc<Program>,
    /// Its data.
    spare_memory: Memory,
    /// Of a debugger: it looks at each statement.
    #[serde(skip)]
    inspection: Option<Box<Inspection>>,
}

/// The program of a snapshot that was read back, until it is compiled again.
fn no_program() -> Arc<Program> {
    Program::empty(&LanguageOptions::default())
}

impl Executor {
    /// Power has come on at `now`; no file is selected.
    pub(crate) fn new(language: &LanguageOptions, now: Time) -> Executor {
        let spare_program = Program::empty(language);
        let spare_memory = Memory::new(&spare_program);
        Executor {
            selected: None,
            main: None,
            tasks: BTreeMap::new(),
            turn: MAIN_TASK,
            next_task: MAIN_TASK + 1,
            arm_owner: None,
            motion_line: 0,
            pass: 0.0,
            paused: false,
            timer: Stopwatch::new(0.0, now),
            operation: Operation::RESET,
            direct: None,
            breakpoints: Breakpoints::default(),
            direct_ended: 0,
            run_shown_until: None,
            spare_program,
            spare_memory,
            inspection: None,
        }
    }

    /// The state of automatic operation.
    pub(crate) fn run_state(&self) -> RunState {
        self.operation.state()
    }

    /// Starts or continues automatic operation, from the current lines of the tasks.
    pub(crate) fn start(&mut self) {
        self.leave_breakpoints();
        self.forget_stop();
        self.operation.start();
        self.run_shown_until = None;
    }

    /// The program is to stop when the present step has ended.
    pub(crate) fn request_stop(&mut self, by: StopCause) {
        self.operation.request_stop(by);
    }

    /// Automatic operation has stopped; a motion that is not kept for retry has ended for its statement.
    pub(crate) fn stop(&mut self, place: Standstill, keeps_motion: bool) {
        self.breakpoints.note_stop_of_program(match place {
            Standstill::FirstStep => StopReason::End,
            Standstill::InsideStep | Standstill::BetweenSteps => StopReason::Stop,
        });
        self.stand(place);
        self.drop_target();
        // PAUSE ends with the run: its RESUME is a statement that does not come.
        self.paused = false;
        if !keeps_motion {
            self.program_tasks_mut().for_each(Task::end_motion);
        }
    }

    /// Statements whose motion was cut short move again.
    pub(crate) fn redo_motions(&mut self) {
        self.program_tasks_mut().for_each(Task::redo_motion);
    }

    /// RUN that was shown for a DO statement longer than it lasted ends now: whether it was shown until now.
    pub(crate) fn end_shown_run(&mut self, now: Time) -> bool {
        self.run_shown_until.take_if(|until| *until <= now).is_some()
    }

    /// Shows RUN for a DO statement that has ended, until then (hosts 8.10).
    pub(crate) fn show_run(&mut self, until: Time, now: Time) {
        self.run_shown_until = Some(until).filter(|until| *until > now);
    }

    /// A stop ends the RUN that is only shown.
    pub(crate) fn hide_run(&mut self) {
        self.run_shown_until = None;
    }

    /// Whether PAUSE holds the motions.
    pub(crate) fn is_paused(&self) -> bool {
        self.paused
    }

    /// PAUSE; whether it holds the motions only from now on.
    pub(crate) fn pause(&mut self) -> bool {
        !core::mem::replace(&mut self.paused, true)
    }

    /// RESUME; whether PAUSE held the motions.
    pub(crate) fn resume(&mut self) -> bool {
        core::mem::take(&mut self.paused)
    }

    /// TIMER is set.
    pub(crate) fn set_timer(&mut self, seconds: f64, now: Time) {
        self.timer = Stopwatch::new(seconds, now);
    }

    /// TIMER, in seconds.
    pub(crate) fn timer(&self, now: Time) -> f64 {
        self.timer.read(now)
    }

    /// PASS of the last motion, in percent; 0 where the arm is to rest at its end.
    pub(crate) fn pass(&self) -> f64 {
        self.pass
    }

    /// A motion with this PASS is on its way.
    pub(crate) fn set_pass(&mut self, percent: f64) {
        self.pass = percent;
    }

    /// The motion of a statement in this line has begun.
    pub(crate) fn begin_motion(&mut self, line: u32) {
        self.motion_line = line;
    }

    /// This task has the turn.
    pub(crate) fn give_turn(&mut self, id: u16) {
        self.turn = id;
    }

    /// Whether a program runs in automatic operation.
    pub(crate) fn program_runs(&self) -> bool {
        self.operation.is_running()
    }

    /// Whether a program or a DO is under way; the permissions depend on it (D7).
    pub(crate) fn is_running(&self) -> bool {
        self.program_runs() || self.direct.is_some()
    }

    /// The status SU, SF and SM show (SU-12): RUN during every DO, and for at least `do.min_run` after it (D7).
    pub(crate) fn shown_status(&self) -> ExecutionStatus {
        match self.operation.state() {
            _ if self.direct.is_some() || self.run_shown_until.is_some() => ExecutionStatus::Running,
            RunState::Running { .. } => ExecutionStatus::Running,
            RunState::Reset => ExecutionStatus::Reset,
            RunState::Retry => ExecutionStatus::Retry,
            RunState::Continue => ExecutionStatus::Continue,
        }
    }

    /// The program whose names a DO statement sees.
    pub(crate) fn program(&self) -> &Arc<Program> {
        let selected = self.selected.as_ref();
        selected.map_or(&self.spare_program, |selected| &selected.program)
    }

    /// The data of that program.
    pub(crate) fn memory(&self) -> &Memory {
        let selected = self.selected.as_ref();
        selected.map_or(&self.spare_memory, |selected| &selected.memory)
    }

    /// The data of that program, to be changed.
    pub(crate) fn memory_mut(&mut self) -> &mut Memory {
        match &mut self.selected {
            Some(selected) => &mut selected.memory,
            None => &mut self.spare_memory,
        }
    }

    /// Whether PAUSE holds a motion, or a statement that waits for one. A program that is to stop executes no RESUME, so such a
    /// motion would never end.
    pub(crate) fn waits_for_resume(&self, arm: &Arm) -> bool {
        let mut parts = self.program_tasks().flat_map(Task::parts);
        self.paused && (arm.is_held() || parts.any(|task| *task.state() != TaskState::Ready))
    }

    /// Whether the program is at its first step.
    pub(crate) fn is_reset(&self) -> bool {
        self.operation.state() == RunState::Reset
    }

    /// Stops the program at this place, whether it ran or not.
    pub(crate) fn stand(&mut self, place: Standstill) {
        self.operation.stand(place);
        self.run_shown_until = None;
    }

    /// To the label `RCYCLE` of the main program; false (and nothing done) without one.
    pub(crate) fn go_to_rcycle(&mut self) -> bool {
        let found = self.main.as_mut().is_some_and(Task::go_to_rcycle);
        if found {
            self.drop_tasks();
        }
        found
    }

    /// Ends everything that runs, as the power goes off; the file stays selected.
    pub(crate) fn power_off(&mut self, now: Time) {
        self.direct = None;
        self.rewind(now);
    }

    /// The main program, its tasks, and the statement of DO, for display.
    pub(crate) fn task_views(&self) -> Vec<TaskView> {
        let program = self.program_tasks().map(|task| task.view(self.program_runs()));
        let direct = self.direct.iter().map(|direct| direct.task.view(true));
        program.chain(direct).collect()
    }

    /// Where the program stops besides its end.
    pub(crate) fn breakpoints(&self) -> &Breakpoints {
        &self.breakpoints
    }

    /// As [`Executor::breakpoints`], to count their hits.
    pub(crate) fn breakpoints_mut(&mut self) -> &mut Breakpoints {
        &mut self.breakpoints
    }

    /// The inspection that looks at each statement.
    pub(crate) fn inspection(&self) -> Option<&Inspection> {
        self.inspection.as_deref()
    }

    /// The place of that inspection.
    pub(crate) fn inspection_mut(&mut self) -> &mut Option<Box<Inspection>> {
        &mut self.inspection
    }

    /// Whether an inspection has halted the program.
    pub(crate) fn is_halted(&self) -> bool {
        self.inspection
            .as_ref()
            .is_some_and(|inspection| inspection.halt.is_some())
    }

    /// Current file line of the program; 0 when no file is selected (SF-24).
    pub(crate) fn line(&self) -> u32 {
        self.main.as_ref().map_or(0, Task::line)
    }

    /// The main program and the tasks it has started.
    pub(crate) fn program_tasks(&self) -> impl Iterator<Item = &Task> {
        self.main.iter().chain(self.tasks.values())
    }

    /// As [`Executor::program_tasks`], to change them.
    fn program_tasks_mut(&mut self) -> impl Iterator<Item = &mut Task> {
        self.main.iter_mut().chain(self.tasks.values_mut())
    }

    /// The program's tasks and that of the statement of DO.
    fn all_tasks(&self) -> impl Iterator<Item = &Task> {
        let direct = self.direct.as_ref().map(|direct| &direct.task);
        self.program_tasks().chain(direct)
    }

    /// The IDs of the program's tasks, beginning with the task that has the turn.
    pub(crate) fn order(&self) -> impl Iterator<Item = u16> + use<> {
        let mut ids = [0; MAX_TASKS];
        let (mut count, mut first) = (0, 0);
        for (place, task) in ids.iter_mut().zip(self.program_tasks()) {
            *place = task.id();
            count += 1;
            first += usize::from(*place < self.turn);
        }
        let places = (first..count).chain(0..first);
        places.filter_map(move |at| ids.get(at).copied())
    }

    /// Takes a task out, to work with it. Until it is returned it is missing in `program_tasks()` and in every count.
    pub(crate) fn take_task(&mut self, id: u16) -> Option<Task> {
        if id == MAIN_TASK {
            self.main.take()
        } else {
            self.tasks.remove(&id)
        }
    }

    /// Puts a task back.
    pub(crate) fn put_task(&mut self, task: Task) {
        match task.id() {
            MAIN_TASK => self.main = Some(task),
            id => {
                self.tasks.insert(id, task);
            }
        }
    }

    /// Ends all tasks but the main program; the next ID is 2 again.
    pub(crate) fn drop_tasks(&mut self) {
        self.tasks.clear();
        if let Some(selected) = &mut self.selected {
            selected.memory.drop_tasks(&selected.program);
        }
        self.turn = MAIN_TASK;
        self.next_task = MAIN_TASK + 1;
        self.arm_owner = None;
    }

    /// The next cycle begins; the tasks end.
    pub(crate) fn begin_cycle(&mut self) {
        self.drop_tasks();
        if let Some(main) = &mut self.main {
            main.begin_cycle();
        }
    }

    /// Stops every task inside its step, which will be repeated, and returns the place of the program. With
    /// `keeps_motion` a statement continues to wait for its motion, which can be resumed.
    pub(crate) fn abort_steps(&mut self, keeps_motion: bool) -> Standstill {
        let mut place = Standstill::InsideStep;
        for id in self.order() {
            if let Some(mut task) = self.take_task(id) {
                // An INPUT is over at any stop (INP-09). The status speaks of the main program, whatever the other
                // tasks do.
                if task.abort_step(self.memory_mut(), keeps_motion) && id == MAIN_TASK {
                    place = Standstill::BetweenSteps;
                }
                self.put_task(task);
            }
        }
        place
    }

    /// A task other than the main program has ended.
    pub(crate) fn drop_task(&mut self, id: u16) {
        self.tasks.remove(&id);
        if let Some(selected) = &mut self.selected {
            selected.memory.drop_task(&selected.program, id);
        }
    }

    /// Line and task of the statement that is executed: of the motion, while one is under way (SF-24).
    pub(crate) fn executed(&self, moving: bool) -> (u32, u16) {
        match self.arm_owner {
            Some(owner) if moving && self.program_runs() => (self.motion_line, owner),
            _ => (self.line(), if self.main.is_some() { MAIN_TASK } else { 0 }),
        }
    }

    /// Line and task of the statement that is analysed: a MOVE after a MOVE is read before its time (SF-24).
    pub(crate) fn analysed(&self) -> (u32, u16) {
        let turn = self.tasks.get(&self.turn).or(self.main.as_ref());
        turn.map_or((0, 0), |task| {
            let moves = matches!(task.state(), TaskState::Moving { .. }) && self.program_runs();
            let ahead = task.machine().motion_ahead().filter(|_| moves);
            (ahead.unwrap_or(task.line()), task.id())
        })
    }

    /// Whether an INPUT waits for values from this port.
    pub(crate) fn reads_from(&self, port: Port) -> bool {
        self.reading()
            .any(|channel| Port::from_channel(channel) == Some(port))
    }

    /// The channels from which an INPUT waits for values.
    pub(crate) fn reading(&self) -> impl Iterator<Item = Channel> {
        let parts = self.all_tasks().flat_map(Task::parts);
        parts.filter_map(|task| task.state().channel())
    }

    /// The time at which a task or the statement of DO can continue without an event.
    pub(crate) fn deadline(&self, arm: &Arm, now: Time) -> Option<Time> {
        let stopping = matches!(self.operation.state(), RunState::Running { stop: Some(_) });
        let tasks = self.program_tasks().filter(|_| self.program_runs());
        let program = tasks.filter_map(|task| task.deadline(stopping));
        let direct = self.direct.as_ref();
        // A statement that is over waits for the end of its RUN only.
        let direct = direct.and_then(|direct| direct.shown_until.or(direct.task.deadline(false)));
        let others = [direct, self.run_shown_until, self.arrives_at(arm, now)];
        program.chain(others.into_iter().flatten()).min()
    }

    /// When a motion counts as arrived before its end, or the next one begins.
    fn arrives_at(&self, arm: &Arm, now: Time) -> Option<Time> {
        let end = arm.ends_at()?;
        let leads = self.all_tasks().filter_map(|task| task.acting().state().lead());
        let ends = leads.map(|lead| end - lead);
        let mut acting = self.program_tasks().map(|task| task.acting().state());
        let waits = acting.any(|state| matches!(state, TaskState::Queued { .. }));
        let begins = waits.then(|| arm.last_begins_at()).flatten();
        // Moments that have passed are served. Asked for again, they would hold the controller at this instant for
        // ever.
        ends.chain(begins).filter(|at| *at > now).min()
    }

    /// Step 1 with the data as the file gives it (RS,PRG).
    pub(crate) fn initialise(&mut self, now: Time) {
        if let Some(selected) = &mut self.selected {
            selected.memory.start_anew(&selected.program);
        }
        self.rewind(now);
    }

    /// The variables of the programs have no value again; GLOBAL, DATA and the conditions stay.
    pub(crate) fn reset_locals(&mut self) {
        if let Some(selected) = &mut self.selected {
            selected.memory.reset_locals(&selected.program);
        }
    }

    /// Every INPUT that waits at this port ends: the values that came stay, the others are 0.
    pub(crate) fn release_inputs(&mut self, port: Port) {
        let direct = self.direct.iter_mut().map(|direct| &mut direct.task);
        let tasks = self.main.iter_mut().chain(self.tasks.values_mut());
        tasks.chain(direct).for_each(|task| task.release_input(port));
    }

    /// Step 1, data kept (RS,STP, end of a cycle).
    pub(crate) fn rewind(&mut self, now: Time) {
        self.stand(Standstill::FirstStep);
        self.forget_stop();
        self.drop_tasks();
        let machine = |selected: &Selected| Machine::main(Arc::clone(&selected.program));
        let main = self.selected.as_ref().map(machine);
        self.main = main.map(|machine| Task::new(machine, now));
    }
}
