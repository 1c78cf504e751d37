//! A run that can stop before any of its statements, continue from there, and go back.
//!
//! Statements are numbered from the start of the run. To stop before one, a copy of the run takes the step that begins it with
//! an inspection, which halts the copy there; the run itself stays before that step. So inspecting changes nothing, and to
//! continue the step is taken once more with a later place to halt at. To go back, an earlier copy is played forward.

use super::debuggee::{
    Abilities, Debuggee, Goal, MAIN_TASK, Progress, Refusal, Said, Scene, Source, Stop, StopReason, placed,
};
use std::mem;
use ts3100_controller::inspection::{Assignment, Begun, Breakpoint, Halt, HaltReason, Inspection, Target};
use ts3100_controller::queries::VariableView;
use ts3100_controller::{Controller, Time};
use ts3100_recording::replay::{Keyframes, Playback};

/// Steps of a run between two looks at what the editor wants.
const PORTION: usize = 512;

/// A run that goes step by step. A copy goes its own way.
pub trait Course: Clone + Send {
    fn controller(&self) -> &Controller;

    /// Looks at every statement from now on; a run that was halted is for looking only.
    fn inspect(&mut self, inspection: Inspection);

    /// Takes what has looked at the statements.
    fn take_inspection(&mut self) -> Option<Inspection>;

    /// Takes the next step; the exit code and how it has ended, if it has.
    fn step(&mut self) -> Option<Ending>;

    /// Takes what the program has said since the last call.
    fn take_said(&mut self) -> Vec<Said>;

    /// Whether variables may be given other values: what is recorded has happened.
    fn may_change(&self) -> bool;

    /// Whether START continues it: a STOP or a key has stopped the program.
    fn waits_for_start(&self) -> bool;

    /// Carries out a change between two steps.
    ///
    /// # Errors
    /// Why it is refused.
    fn change(&mut self, change: &Change) -> Result<(), Refusal>;
}

/// Something done from outside to a run that has stopped.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Change {
    Assignment(Assignment),
    /// START with the next step.
    Start,
}

/// How a run has ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ending {
    pub code: u8,
    pub words: String,
    pub then: Afterwards,
}

/// The use of a run after it has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Afterwards {
    /// None: the program is over.
    Over,
    /// It can be looked at, and goes back, as the end of a recording.
    Stays,
    /// The same, and its next step continues it: its time was limited.
    Continues,
}

impl Ending {
    /// Nothing comes after it.
    fn is_last(&self) -> bool {
        self.then != Afterwards::Continues
    }
}

impl Course for Playback {
    fn controller(&self) -> &Controller {
        Playback::controller(self)
    }

    fn inspect(&mut self, inspection: Inspection) {
        Playback::inspect(self, inspection);
    }

    fn take_inspection(&mut self) -> Option<Inspection> {
        Playback::take_inspection(self)
    }

    fn step(&mut self) -> Option<Ending> {
        match Playback::step(self) {
            Some(_) => None,
            None => Some(Ending {
                code: 0,
                words: "the end of the recording".to_owned(),
                then: Afterwards::Stays,
            }),
        }
    }

    fn take_said(&mut self) -> Vec<Said> {
        Vec::new()
    }

    fn may_change(&self) -> bool {
        false
    }

    fn waits_for_start(&self) -> bool {
        false
    }

    fn change(&mut self, _: &Change) -> Result<(), Refusal> {
        Err(Refusal::new(
            "a recording has happened: nothing in it can be changed",
        ))
    }
}

/// A run before one of its steps, and the number of the next statement.
#[derive(Clone)]
struct Place<C> {
    run: C,
    next: u64,
}

/// A run with its copies.
pub struct Timeline<C> {
    /// Before the step in which it has stopped.
    base: Place<C>,
    /// Steps before that.
    steps: u64,
    /// As it is shown: halted within that step, or before it.
    shown: C,
    /// Number of the statement before which it has stopped, or which comes next.
    at: u64,
    /// It has stopped within the step, before that statement.
    is_halted: bool,
    /// Texts of the present step that were said already.
    said_of_step: usize,
    keyframes: Keyframes<Place<C>>,
    began: Time,
    breakpoints: Vec<Breakpoint>,
    stops_on_alarm: bool,
    changes: Vec<(When, Change)>,
    /// The goal of the statement from which it has set out.
    target: Option<Target>,
    /// The first statement at which it may stop.
    first: u64,
    /// Tasks that have executed a motion statement since then.
    moved: Vec<u16>,
    said: Vec<Said>,
    going: Going,
}

/// When a change is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum When {
    /// Before the step with this number, from 0.
    Step(u64),
    /// Before the statement with this number.
    Statement(u64),
}

/// An earlier statement, before that with the number `until`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Search {
    until: u64,
    goal: BackGoal,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BackGoal {
    /// One of this task, in this call or outside it.
    Statement { task: u16, depth: usize },
    /// One at which a breakpoint stops.
    Breakpoint,
}

/// What is under way.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Going {
    Forward,
    /// In search of an earlier statement.
    Back(Search),
    /// Stopped already.
    Arrived(Stop),
    Pausing,
    /// The run is over; it is told once more.
    Over(Ending),
}

impl<C: Course> Timeline<C> {
    /// A run at its start.
    pub fn new(run: C) -> Timeline<C> {
        let began = run.controller().now();
        let base = Place { run, next: 0 };
        Timeline {
            shown: base.run.clone(),
            keyframes: Keyframes::new(base.clone()),
            base,
            steps: 0,
            at: 0,
            is_halted: false,
            said_of_step: 0,
            began,
            breakpoints: Vec::new(),
            stops_on_alarm: true,
            changes: Vec::new(),
            target: None,
            first: 0,
            moved: Vec::new(),
            said: Vec::new(),
            going: Going::Pausing,
        }
    }

    /// Goes to the first statement; false if there is none.
    pub fn enter(&mut self) -> bool {
        self.target = Some(Target::Statement(0));
        while self.forward() == Progress::Going {}
        let found = self.is_halted;
        self.going = Going::Arrived(Stop::of_program(StopReason::Entry));
        found
    }

    fn controller(&self) -> &Controller {
        self.shown.controller()
    }

    /// An inspection of the next step of a place.
    fn inspection(&self, next: u64, first: u64, target: Option<Target>) -> Inspection {
        let made = self.changes.iter().filter_map(|change| match change {
            (When::Statement(number), Change::Assignment(assignment)) if *number >= next => {
                Some((*number, assignment.clone()))
            }
            (When::Statement(_) | When::Step(_), _) => None,
        });
        Inspection {
            next,
            first,
            target,
            file: self.controller().selected().to_owned(),
            assignments: made.collect(),
            ..Inspection::default()
        }
    }

    /// A copy of a place before its next step, with what is changed there.
    fn before_step(&self, place: &Place<C>, steps: u64) -> C {
        let mut run = place.run.clone();
        let due = self.changes.iter().filter(|(when, _)| *when == When::Step(steps));
        for (_, change) in due {
            // It was tried when it was made.
            let _ = run.change(change);
        }
        run
    }

    /// A copy of a place after its next step, how it has ended, if it has, and what the inspection has found. A change
    /// before the step that follows lets an ended run continue.
    fn step(&self, place: &Place<C>, steps: u64, inspection: Inspection) -> (C, Option<Ending>, Inspection) {
        let mut run = self.before_step(place, steps);
        run.inspect(inspection);
        let ending = run.step();
        let inspection = run.take_inspection().unwrap_or_default();
        let ending = ending.filter(|_| !self.is_changed_at(steps + 1));
        (run, ending, inspection)
    }

    /// Takes one step, or halts within it.
    fn forward(&mut self) -> Progress {
        let mut inspection = self.inspection(self.base.next, self.first, self.target);
        inspection.breakpoints = mem::take(&mut self.breakpoints);
        inspection.moved.clone_from(&self.moved);
        let alarms = self.base.run.controller().alarms().active().to_vec();
        let (mut run, ending, inspection) = self.step(&self.base, self.steps, inspection);
        self.breakpoints = inspection.breakpoints;
        let said = run.take_said();
        self.said.extend(said.iter().skip(self.said_of_step).cloned());
        let texts = inspection.said.into_iter();
        self.said.extend(texts.map(|(line, text)| Said {
            line: Some(line),
            text,
        }));
        if let Some(halt) = inspection.halt {
            self.said_of_step = said.len();
            return self.halted(run, halt);
        }
        self.moved = inspection.moved;
        self.said_of_step = 0;
        let raised = run.controller().alarms().active();
        let raised = raised.iter().find(|alarm| !alarms.contains(alarm));
        let alarm = raised.map(|alarm| Stop {
            reason: StopReason::Alarm {
                number: alarm.code.number(),
                text: alarm.message(),
            },
            task: run.controller().alarm_stop().map_or(MAIN_TASK, |stop| stop.task),
        });
        self.base = Place {
            run,
            next: inspection.next,
        };
        self.steps += 1;
        self.keyframes.note(self.steps, &self.base);
        match (alarm.filter(|_| self.stops_on_alarm), ending) {
            (Some(stop), ending) => {
                self.stand();
                self.going = ending.filter(Ending::is_last).map_or(Going::Forward, Going::Over);
                Progress::Stopped(stop)
            }
            (None, Some(ending)) => self.over(ending),
            (None, None) => Progress::Going,
        }
    }

    fn over(&mut self, ending: Ending) -> Progress {
        self.stand();
        let Ending { code, words, then } = ending.clone();
        self.going = if ending.is_last() {
            Going::Over(ending)
        } else {
            Going::Forward
        };
        match then {
            Afterwards::Over => Progress::Ended { code, words },
            Afterwards::Stays | Afterwards::Continues => {
                Progress::Stopped(Stop::of_program(StopReason::End { code, words }))
            }
        }
    }

    fn halted(&mut self, run: C, halt: Halt) -> Progress {
        self.shown = run;
        self.at = halt.statement.number;
        self.is_halted = true;
        Progress::Stopped(Stop {
            task: halt.statement.task,
            reason: match halt.reason {
                HaltReason::Breakpoints(indices) => StopReason::Breakpoints(indices),
                HaltReason::Fault { reason, .. } => StopReason::Fault(reason),
                HaltReason::Target => StopReason::Step,
            },
        })
    }

    /// Shows the run between two of its steps.
    fn stand(&mut self) {
        self.shown = self.before_step(&self.base, self.steps);
        self.at = self.base.next;
        self.is_halted = false;
        self.said_of_step = 0;
    }

    /// Whether something is changed before this step: a run that had ended there continues.
    fn is_changed_at(&self, steps: u64) -> bool {
        self.changes.iter().any(|(when, _)| *when == When::Step(steps))
    }

    /// The statements from a copy on until that with the number `until`.
    fn list(&self, from: &Place<C>, mut steps: u64, until: u64) -> Vec<Begun> {
        let mut place = from.clone();
        let mut listed = Vec::new();
        while place.next < until {
            let mut inspection = self.inspection(place.next, place.next, Some(Target::Statement(until)));
            // Which of the hits it was is not known from here.
            inspection.breakpoints = self.breakpoints.clone();
            for breakpoint in &mut inspection.breakpoints {
                breakpoint.hits = None;
            }
            inspection.listed = Some(Vec::new());
            let (run, ending, inspection) = self.step(&place, steps, inspection);
            listed.extend(inspection.listed.into_iter().flatten());
            let next = inspection.next;
            place = Place { run, next };
            steps += 1;
            if inspection.halt.is_some() || ending.is_some_and(|ending| ending.is_last()) {
                break;
            }
        }
        listed.retain(|statement| statement.number < until);
        listed
    }

    /// Searches one copy further back.
    fn search_back(&mut self, search: Search) -> Progress {
        let Search { until, goal } = search;
        let Some((steps, frame)) = self.keyframes.last(|frame| frame.next < until) else {
            return self.arrive(0, None);
        };
        let begins = frame.next;
        let listed = self.list(frame, steps, until);
        let found = listed.into_iter().rev().find(|begun| match goal {
            BackGoal::Statement { task, depth } => begun.task == task && begun.depth <= depth,
            BackGoal::Breakpoint => begun.is_stop,
        });
        if let Some(found) = found {
            let reason = match goal {
                BackGoal::Statement { .. } => StopReason::Step,
                BackGoal::Breakpoint => StopReason::Breakpoints(Vec::new()),
            };
            let task = found.task;
            return self.arrive(found.number, Some(Stop { reason, task }));
        }
        if steps == 0 {
            return self.arrive(0, None);
        }
        self.going = Going::Back(Search { until: begins, goal });
        Progress::Going
    }

    /// Goes back to a statement; without a stop it is the first of all.
    fn arrive(&mut self, number: u64, stop: Option<Stop>) -> Progress {
        self.go_to(number);
        Progress::Stopped(stop.unwrap_or(Stop::of_program(StopReason::Entry)))
    }

    /// Goes to a statement that has been there.
    fn go_to(&mut self, number: u64) {
        let found = self.keyframes.last(|frame| frame.next <= number);
        let Some((steps, place)) = found.map(|(steps, place)| (steps, place.clone())) else {
            return;
        };
        (self.base, self.steps) = (place, steps);
        loop {
            let inspection = self.inspection(self.base.next, number, Some(Target::Statement(number)));
            let (mut run, ending, inspection) = self.step(&self.base, self.steps, inspection);
            let said = run.take_said().len();
            if let Some(halt) = inspection.halt {
                self.said_of_step = said;
                let _at_the_statement = self.halted(run, halt);
                return;
            }
            self.base = Place {
                run,
                next: inspection.next,
            };
            self.steps += 1;
            if ending.is_some_and(|ending| ending.is_last()) {
                return self.stand();
            }
        }
    }

    /// Number of open calls of a task where it has stopped.
    fn depth(&self, task: u16) -> usize {
        let tasks = self.controller().tasks();
        let found = tasks.iter().find(|found| found.id == task);
        found.map_or(1, |found| found.calls.len())
    }

    /// What goes before is as it was; what was to come afterwards is forgotten.
    fn forget_future(&mut self) {
        self.keyframes.forget_after(self.steps);
        let (steps, at) = (self.steps, self.at);
        self.changes.retain(|(when, _)| match when {
            When::Step(step) => *step <= steps,
            When::Statement(number) => *number <= at,
        });
        if let Going::Over(_) = self.going {
            self.going = Going::Pausing;
        }
    }
}

impl<C: Course> Debuggee for Timeline<C> {
    fn abilities(&self) -> Abilities {
        Abilities {
            goes_back: true,
            assigns: self.base.run.may_change(),
        }
    }

    fn source(&self) -> Source {
        let name = self.controller().selected().to_owned();
        let mut files = self.controller().files();
        let text = files.find(|(file, _)| *file == name);
        Source {
            text: text.map_or(String::new(), |(_, text)| {
                String::from_utf8_lossy(text).into_owned()
            }),
            name,
        }
    }

    fn statement_lines(&self) -> Vec<u32> {
        self.controller().statement_lines()
    }

    fn set_breakpoints(&mut self, breakpoints: Vec<Breakpoint>) -> Vec<Result<u32, Refusal>> {
        let check = |set: &Breakpoint| self.controller().check_breakpoint(set).map_err(Refusal::new);
        let (mut set, found) = placed(breakpoints, &self.statement_lines(), check);
        set.iter_mut().for_each(|set| set.resume(&self.breakpoints));
        self.breakpoints = set;
        found
    }

    fn stop_on_alarm(&mut self, on: bool) {
        self.stops_on_alarm = on;
    }

    fn go(&mut self, goal: Goal) -> Result<(), Refusal> {
        match goal {
            Goal::Enter => {
                if !matches!(self.going, Going::Arrived(_)) {
                    self.enter();
                }
                return Ok(());
            }
            Goal::Back(_) | Goal::RunBack => {
                let goal = if let Goal::Back(task) = goal {
                    let depth = self.depth(task);
                    BackGoal::Statement { task, depth }
                } else {
                    BackGoal::Breakpoint
                };
                let until = self.at;
                self.going = Going::Back(Search { until, goal });
                return Ok(());
            }
            Goal::Run | Goal::Into(_) | Goal::Over(_) | Goal::Out(_) | Goal::Motion(_) => {}
        }
        // The statement that is shown as the next one was not looked at yet, and is not where a step ends.
        let starts = !self.is_halted && self.base.run.waits_for_start();
        if starts {
            self.forget_future();
            let start = (When::Step(self.steps), Change::Start);
            if !self.changes.contains(&start) {
                self.changes.push(start);
            }
        } else if let Going::Over(_) = self.going {
            return Ok(());
        }
        self.moved.clear();
        self.first = self.at + u64::from(self.is_halted || starts);
        self.target = goal
            .step()
            .map(|(kind, task)| kind.target(task, self.depth(task)));
        self.going = Going::Forward;
        Ok(())
    }

    fn work(&mut self) -> Result<Progress, Refusal> {
        for _ in 0..PORTION {
            match mem::replace(&mut self.going, Going::Forward) {
                Going::Forward => {}
                // A search is looked after once for each copy, which takes longer than a step.
                Going::Back(search) => return Ok(self.search_back(search)),
                Going::Arrived(stop) => return Ok(Progress::Stopped(stop)),
                Going::Over(ending) => return Ok(self.over(ending)),
                Going::Pausing => {
                    self.stand();
                    return Ok(Progress::Stopped(Stop::of_program(StopReason::Pause)));
                }
            }
            let progress = self.forward();
            if progress != Progress::Going {
                return Ok(progress);
            }
        }
        Ok(Progress::Going)
    }

    fn pause(&mut self) {
        if self.going == Going::Forward {
            self.going = Going::Pausing;
        } else if let Going::Back(_) = self.going {
            // It has not moved yet.
            self.going = Going::Arrived(Stop::of_program(StopReason::Pause));
        }
    }

    fn take_said(&mut self) -> Vec<Said> {
        mem::take(&mut self.said)
    }

    fn scene(&self) -> Result<Scene, Refusal> {
        Ok(Scene::of(self.controller(), self.began))
    }

    fn evaluate(&self, task: u16, call: usize, text: &str) -> Result<VariableView, Refusal> {
        let found = self.controller().evaluate(task, call, text);
        found.map_err(Refusal::new)
    }

    fn assign(&mut self, task: u16, call: usize, text: &str) -> Result<VariableView, Refusal> {
        let stacks = self.controller().stacks();
        let interrupted = stacks
            .iter()
            .find(|stack| stack.id == task)
            .and_then(|stack| stack.interrupted);
        if interrupted.is_some_and(|interrupted| call < interrupted) {
            return Err(Refusal::new(
                "the action of a monitor is under way: change it in the frame of the action, which sees GLOBAL and DATA, or when the action has ended",
            ));
        }
        let text = text.to_owned();
        let assignment = Assignment { task, call, text };
        let target = assignment.target();
        let change = Change::Assignment(assignment);
        self.shown.change(&change)?;
        let value = self.evaluate(task, call, &target)?;
        self.forget_future();
        let when = match self.is_halted {
            true => When::Statement(self.at),
            false => When::Step(self.steps),
        };
        self.changes.push((when, change));
        Ok(value)
    }

    fn release(&mut self) {}
}
