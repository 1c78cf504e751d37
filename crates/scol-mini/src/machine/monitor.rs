//! `ON ... DO`: conditions that are watched while the program runs. When they are looked at is the outside's
//! choice; what happens then, a jump or a handler beside the program, begins here.

use alloc::boxed::Box;
use alloc::format;
use alloc::sync::Arc;

use super::evaluate::Context;
use super::{Machine, RuntimeError, State};
use crate::MAX_MONITORS;
use crate::memory::Memory;
use crate::program::Operation;
use crate::request::{Fault, FaultKind, Inputs};

/// An `ON` that has been executed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Monitor {
    /// Its step.
    pub(super) on: usize,
    /// How many programs were called when it was executed; a jump goes back to there.
    pub(super) depth: usize,
    /// What its condition was when it was last looked at.
    was: bool,
}

/// What a monitor has brought about.
#[derive(Debug, Clone, PartialEq)]
pub enum Monitored {
    /// The statement under way is given up, then [`Machine::jump`] with this.
    Jump(Jump),
    /// This machine is to be run to its end before the other one goes on.
    Handler(Box<Machine>),
}

/// Where a monitor leads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump(Monitor);

impl Machine {
    /// Begins to watch: executing the same ON again arms it anew. A condition that is true already has to become
    /// false first.
    pub(super) fn watch(&mut self, was: bool) -> Result<(), RuntimeError> {
        let on = self.at;
        self.monitors.retain(|monitor| monitor.on != on);
        if self.monitors.len() >= MAX_MONITORS {
            let message = format!("a task has at most {MAX_MONITORS} monitors");
            return Err(RuntimeError::new(FaultKind::Range, message));
        }
        let depth = self.frames.len();
        self.monitors.push(Monitor { on, depth, was });
        Ok(())
    }

    /// Whether there is a monitor to look at.
    #[must_use]
    pub fn has_monitors(&self) -> bool {
        self.awake && !self.monitors.is_empty()
    }

    /// Looks at the conditions of all monitors, in the order in which their ON was executed. The first that has
    /// become true acts, once; the others that have act at the next looks.
    ///
    /// # Errors
    /// A condition cannot be evaluated; its monitor is dropped.
    pub fn look(&mut self, memory: &mut Memory, inputs: &dyn Inputs) -> Result<Option<Monitored>, Fault> {
        if !self.awake {
            return Ok(None);
        }
        let program = Arc::clone(&self.program);
        memory.enter(&program, self.task);
        for index in 0..self.monitors.len() {
            let Some(monitor) = self.monitors.get(index).copied() else {
                break;
            };
            let Some(step) = program.steps.get(monitor.on) else {
                continue;
            };
            let Operation::On { condition, jump, .. } = &step.operation else {
                continue;
            };
            let context = Context {
                program: &program,
                memory,
                inputs,
                arguments: &[],
                base: 0,
                task: self.task,
            };
            match context.truth(condition) {
                Ok(true) if !monitor.was => {
                    self.monitors.remove(index);
                    return Ok(Some(self.act(monitor, *jump)));
                }
                Ok(is) => {
                    if let Some(monitor) = self.monitors.get_mut(index) {
                        monitor.was = is;
                    }
                }
                Err(trouble) => {
                    self.monitors.remove(index);
                    return Err(Fault {
                        kind: trouble.kind,
                        line: step.line,
                        message: trouble.message,
                    });
                }
            }
        }
        Ok(None)
    }

    /// Goes where a monitor leads; subprograms called since its ON are left, what is pending is dropped.
    pub fn jump(&mut self, Jump(monitor): Jump) {
        self.cut(monitor.depth);
        self.at = monitor.on + 1;
        self.state = State::Ready;
    }

    fn act(&self, monitor: Monitor, jump: bool) -> Monitored {
        if jump {
            return Monitored::Jump(Jump(monitor));
        }
        Monitored::Handler(Box::new(Machine {
            at: monitor.on + 1,
            task: self.task,
            ..Machine::main(Arc::clone(&self.program))
        }))
    }

    /// A program has been left: nobody can jump into it any more.
    pub(super) fn forget_jumps(&mut self) {
        if self.monitors.is_empty() {
            return;
        }
        let depth = self.frames.len();
        let program = Arc::clone(&self.program);
        self.monitors.retain(|monitor| {
            let step = program.steps.get(monitor.on);
            let jump = matches!(
                step.map(|step| &step.operation),
                Some(Operation::On { jump: true, .. })
            );
            !jump || monitor.depth <= depth
        });
    }
}
