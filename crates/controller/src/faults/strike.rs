//! What a fault does to the machine, at once or later: the panel is worked, an alarm comes. What that leads to is
//! the controller's ordinary business.

use crate::Controller;
use crate::alarm::AlarmCode;
use crate::input::Panel;
use crate::limits::MAX_STRIKES;
use alloc::string::ToString;
use core::time::Duration;

/// One deed of a fault.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Strike {
    /// Something is done at the panel.
    Panel(Panel),
    /// An alarm comes.
    Alarm(AlarmCode),
}

impl Controller {
    /// Does it at once, or in a while. More than [`MAX_STRIKES`] that wait are forgotten.
    pub(super) fn strike(&mut self, delay: Duration, strike: Strike) {
        if delay.is_zero() {
            self.do_strike(strike);
        } else if self.faults.strikes.len() < MAX_STRIKES {
            self.faults.strikes.push((self.now + delay, strike));
        }
    }

    /// Does what is due.
    pub(crate) fn serve_strikes(&mut self) {
        while let Some(place) = self.due_strike() {
            let (_, strike) = self.faults.strikes.remove(place);
            self.do_strike(strike);
        }
    }

    fn due_strike(&self) -> Option<usize> {
        let due = self.faults.strikes.iter().enumerate();
        due.filter(|(_, (due, _))| *due <= self.now)
            .min_by_key(|(_, (due, _))| *due)
            .map(|(place, _)| place)
    }

    fn do_strike(&mut self, strike: Strike) {
        match strike {
            Strike::Panel(panel) => self.panel(panel),
            // Without power there is nobody to raise it.
            Strike::Alarm(_) if !self.state.powered => {}
            Strike::Alarm(code) => self.raise(code, "a fault on purpose".to_string()),
        }
    }
}
