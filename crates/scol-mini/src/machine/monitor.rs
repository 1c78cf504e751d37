//! Monitors: the conditions of `ON ... DO`, which are evaluated while the program runs.
//!
//! The caller decides when to evaluate them, with [`Machine::check_monitors`]. A condition that has become true leads to a jump, or to a
//! handler that runs beside the program. Executing the ON itself is in `execute`.

use crate::prelude::*;
use alloc::sync::Arc;

use super::{Machine, Result, RunPhase};
use crate::MAX_MONITORS;
use crate::memory::Memory;
use crate::program::{Operation, Program};
use crate::request::{Fault, FaultKind, Inputs};

/// An `ON` that has been executed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Monitor {
    /// The step of its `ON`.
    pub(super) on: usize,
    /// Number of programs that were called when it was executed; a jump returns to that call.
    pub(super) depth: usize,
    /// The value of its condition when it was last evaluated.
    last_value: bool,
}

impl Monitor {
    /// Whether its action is a jump.
    fn jumps(&self, program: &Program) -> bool {
        let on = program.steps.get(self.on).map(|step| &step.operation);
        matches!(on, Some(Operation::On { jump: true, .. }))
    }
}

/// Effect of a monitor whose condition has become true.
#[derive(Debug, Clone, PartialEq)]
pub enum MonitorAction {
    /// The statement under way is given up, then [`Machine::jump`] with this.
    Jump(Jump),
    /// Run this machine to its end before the other one continues.
    Handler(Box<Machine>),
}

/// Target of a monitor that jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump(Monitor);

impl Machine {
    /// Begins to watch; executing the same ON again re-arms it. A condition that is already true has to become false
    /// first.
    pub(super) fn start_monitor(&mut self, last_value: bool) -> Result<()> {
        let on = self.at;
        let depth = self.frames.len();
        self.add_monitor(Monitor {
            on,
            depth,
            last_value,
        })
    }

    fn add_monitor(&mut self, added: Monitor) -> Result<()> {
        self.monitors.retain(|monitor| monitor.on != added.on);
        if self.monitors.len() >= MAX_MONITORS {
            return FaultKind::Range.fail(format!("a task has at most {MAX_MONITORS} monitors"));
        }
        self.monitors.push(added);
        Ok(())
    }

    /// Takes over `IGNORE`, `DISABLE`, `ENABLE` and `ON` of a handler that has ended; its `GOTO` has no effect any
    /// more.
    ///
    /// # Errors
    /// There are too many monitors; those that are too many are dropped.
    pub fn end_handler(&mut self, handler: &Machine) -> Result<(), Fault> {
        self.monitors_enabled = handler.monitors_enabled;
        if handler.ignored {
            self.monitors.clear();
        }
        let lasting = handler.monitors.iter();
        for monitor in lasting.filter(|monitor| !monitor.jumps(&handler.program)) {
            self.add_monitor(*monitor)
                .map_err(|error| handler.fault(*error))?;
        }
        Ok(())
    }

    /// Whether any monitor is active.
    pub fn has_monitors(&self) -> bool {
        self.monitors_enabled && !self.monitors.is_empty()
    }

    /// Evaluates the conditions of all monitors, in the order in which their ON was executed. The first that has become
    /// true acts, once; others that became true act at the next calls.
    ///
    /// # Errors
    /// A condition cannot be evaluated; its monitor is dropped.
    pub fn check_monitors(
        &mut self,
        memory: &mut Memory,
        inputs: &dyn Inputs,
    ) -> Result<Option<MonitorAction>, Fault> {
        if !self.monitors_enabled {
            return Ok(None);
        }
        let program = Arc::clone(&self.program);
        let here = self.at;
        let mut execution = self.enter(&program, memory, inputs);
        for index in 0..execution.machine.monitors.len() {
            let Some(monitor) = execution.machine.monitors.get(index).copied() else {
                break;
            };
            let step = program.steps.get(monitor.on);
            let operation = step.map(|step| (step.line, &step.operation));
            let Some((line, Operation::On { condition, jump, .. })) = operation else {
                continue;
            };
            let value = execution.truth(condition);
            // A fault in the condition is not one of the statement under way.
            execution.machine.at = here;
            match value {
                Ok(true) if !monitor.last_value => {
                    execution.machine.monitors.remove(index);
                    return Ok(Some(execution.machine.triggered(monitor, *jump)));
                }
                Ok(value) => {
                    if let Some(monitor) = execution.machine.monitors.get_mut(index) {
                        monitor.last_value = value;
                    }
                }
                Err(error) => {
                    execution.machine.monitors.remove(index);
                    return Err(Fault { line, ..*error });
                }
            }
        }
        Ok(None)
    }

    /// Jumps to the target of a monitor: leaves the subprograms called since its ON and drops the pending request.
    pub fn jump(&mut self, Jump(monitor): Jump) {
        self.unwind(monitor.depth);
        self.at = monitor.on + 1;
        self.state = RunPhase::Ready;
        self.motion_before = None;
    }

    fn triggered(&self, monitor: Monitor, jump: bool) -> MonitorAction {
        if jump {
            return MonitorAction::Jump(Jump(monitor));
        }
        MonitorAction::Handler(Box::new(Machine {
            at: monitor.on + 1,
            task: self.task,
            ..Machine::main(Arc::clone(&self.program))
        }))
    }

    /// Drops the monitors that jump into a program that has been left.
    pub(super) fn drop_jump_monitors(&mut self) {
        if self.monitors.is_empty() {
            return;
        }
        self.monitors
            .retain(|monitor| !monitor.jumps(&self.program) || monitor.depth <= self.frames.len());
    }
}
