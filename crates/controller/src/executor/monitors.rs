//! ON ... DO: when the conditions of a program are evaluated, and what happens to the statement that is interrupted.
//!
//! The conditions and handlers themselves belong to the machine of scol-mini.

use crate::executor::scheduler::{Step, alarm_of};
use crate::executor::scol_inputs::ScolInputs;
use crate::executor::{Task, TaskState};
use crate::limits::SCAN;
use crate::robot::Robot;
use alloc::boxed::Box;
use alloc::format;
use scol_mini::MonitorAction;

impl Robot {
    /// Looks at the monitors of a task: between its statements, when something changes, and once a scan while time
    /// alone can change them. `None` when nothing comes of it.
    pub(crate) fn look_at_monitors(&mut self, task: &mut Task) -> Option<Step> {
        // What time alone changes is looked at between statements and once a scan, however often something happens.
        let due = task.look_at.take().filter(|due| *due > self.now);
        let due = due.filter(|_| !matches!(task.doing, TaskState::Ready));
        let seen = due.map_or(self.now, |due| due - SCAN);
        if !task.machine.has_monitors() {
            return None;
        }
        let view = ScolInputs::new(
            &self.signals,
            &self.arm,
            &self.executor,
            self.panel.state().run_mode,
            seen,
        )
        .with_unknown_inputs(self.config.options.din_unknown);
        let found = task.machine.check_monitors(self.executor.memory_mut(), &view);
        if view.is_changing() {
            task.look_at = Some(due.unwrap_or(self.now + SCAN));
        }
        match found {
            Ok(None) => None,
            Ok(Some(MonitorAction::Jump(jump))) => {
                // The motion is given up with its statement; one that nobody waits for goes on.
                if let TaskState::Moving { .. } = task.doing {
                    self.arm.stop(self.now);
                }
                // An INPUT ends as at a stop: what has not come is 0.
                task.end_reading(self.executor.memory_mut());
                task.machine.jump(jump);
                task.doing = TaskState::Ready;
                Some(Step::DONE)
            }
            Ok(Some(MonitorAction::Handler(machine))) => {
                task.handler = Some(Box::new(Task::new(*machine, self.now)));
                Some(Step::Begun)
            }
            Err(fault) => Some(Step::Trouble(alarm_of(fault.kind), format!("{fault}"))),
        }
    }
}
