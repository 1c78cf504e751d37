//! Actions of faults on the machine, at once or later: an operation at the panel, or an alarm.
//!
//! This module keeps the schedule. The panel and the alarms handle the actions like any others.

use crate::alarm::AlarmCode;
use crate::endpoint::Endpoints;
use crate::input::PanelAction;
use crate::limits::MAX_SCHEDULED_ACTIONS;
use crate::robot::Robot;
use alloc::string::ToString;
use core::time::Duration;

/// An action of a fault on the machine.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ScheduledAction {
    /// An operation at the panel.
    Panel(PanelAction),
    /// An alarm is raised.
    Alarm(AlarmCode),
}

impl Endpoints {
    /// Performs an action now or after a delay. It is dropped if [`MAX_SCHEDULED_ACTIONS`] are waiting.
    pub(super) fn schedule(&mut self, robot: &mut Robot, delay: Duration, action: ScheduledAction) {
        if delay.is_zero() {
            self.perform_scheduled(robot, action);
        } else if self.faults.scheduled.len() < MAX_SCHEDULED_ACTIONS {
            self.faults.scheduled.push((robot.now + delay, action));
        }
    }

    /// Performs the actions that are due, in the order of their times.
    pub(crate) fn run_scheduled(&mut self, robot: &mut Robot) {
        while let Some(place) = self.next_due_action(robot) {
            let (_, action) = self.faults.scheduled.remove(place);
            self.perform_scheduled(robot, action);
        }
    }

    fn next_due_action(&self, robot: &Robot) -> Option<usize> {
        let due = self.faults.scheduled.iter().enumerate();
        due.filter(|(_, (due, _))| *due <= robot.now)
            .min_by_key(|(_, (due, _))| *due)
            .map(|(place, _)| place)
    }

    fn perform_scheduled(&mut self, robot: &mut Robot, action: ScheduledAction) {
        match action {
            ScheduledAction::Panel(panel) => self.panel(robot, panel),
            // A controller without power raises no alarms.
            ScheduledAction::Alarm(_) if !robot.panel.state().powered => {}
            ScheduledAction::Alarm(code) => robot.raise(code, "a fault on purpose".to_string()),
        }
        // Before the command that meets the fault is served: an extension command ends the SP of its host.
        self.take_notices(robot);
    }
}
