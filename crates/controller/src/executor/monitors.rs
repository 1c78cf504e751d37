//! ON ... DO: when the conditions of a program are evaluated, and what happens to the statement that is interrupted.
//!
//! The conditions and handlers themselves belong to the machine of scol-mini.

use crate::executor::scol_inputs::ScolInputs;
use crate::executor::step::{Step, alarm_of};
use crate::executor::{Task, TaskState};
use crate::robot::Robot;
use alloc::boxed::Box;
use scol_mini::MonitorAction;

impl Robot {
    /// Looks at the monitors of a task: between its statements, when something changes, and once a scan while time
    /// alone can change them. `None` when nothing comes of it.
    pub(crate) fn look_at_monitors(&mut self, task: &mut Task) -> Option<Step> {
        let seen = task.monitors_see(self.now)?;
        let view = ScolInputs::new(
            &self.signals,
            &self.arm,
            &self.executor,
            self.panel.state().run_mode,
            self.config.options.din_unknown,
            seen,
        );
        match task.check_monitors(self.executor.memory_mut(), &view) {
            Ok(None) => None,
            Ok(Some(MonitorAction::Jump(jump))) => {
                // The motion is given up with its statement; one that nobody waits for goes on.
                if let TaskState::Moving { .. } = task.state() {
                    self.arm.stop(self.now);
                }
                task.jump(self.executor.memory_mut(), jump);
                Some(Step::DONE)
            }
            Ok(Some(MonitorAction::Handler(machine))) => {
                task.put_handler(Box::new(Task::new(*machine, self.now)));
                Some(Step::Begun)
            }
            Err(fault) => Some(Step::Trouble(alarm_of(fault.kind), format!("{fault}"))),
        }
    }
}
