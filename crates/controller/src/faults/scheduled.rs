//! What a fault does to the machine, at once or later: the panel is worked, an alarm comes. What that leads to is
//! the controller's ordinary business.

use crate::Controller;
use crate::alarm::AlarmCode;
use crate::input::PanelAction;
use crate::limits::MAX_STRIKES;
use alloc::string::ToString;
use core::time::Duration;

/// One action of a fault.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ScheduledAction {
    /// Something is done at the panel.
    Panel(PanelAction),
    /// An alarm comes.
    Alarm(AlarmCode),
}

impl Controller {
    /// Does it at once, or in a while. More than [`MAX_STRIKES`] that wait are forgotten.
    pub(super) fn schedule(&mut self, delay: Duration, strike: ScheduledAction) {
        if delay.is_zero() {
            self.perform_scheduled(strike);
        } else if self.faults.strikes.len() < MAX_STRIKES {
            self.faults.strikes.push((self.now + delay, strike));
        }
    }

    /// Does what is due.
    pub(crate) fn run_scheduled(&mut self) {
        while let Some(place) = self.due_action() {
            let (_, strike) = self.faults.strikes.remove(place);
            self.perform_scheduled(strike);
        }
    }

    fn due_action(&self) -> Option<usize> {
        let due = self.faults.strikes.iter().enumerate();
        due.filter(|(_, (due, _))| *due <= self.now)
            .min_by_key(|(_, (due, _))| *due)
            .map(|(place, _)| place)
    }

    fn perform_scheduled(&mut self, strike: ScheduledAction) {
        match strike {
            ScheduledAction::Panel(panel) => self.panel(panel),
            // Without power there is nobody to raise it.
            ScheduledAction::Alarm(_) if !self.state.powered => {}
            ScheduledAction::Alarm(code) => self.raise(code, "a fault on purpose".to_string()),
        }
    }
}
