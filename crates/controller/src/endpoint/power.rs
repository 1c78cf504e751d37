//! The panel as far as the ports are concerned: power off and a power cycle drop every peer.
//!
//! Everything else that the panel does is in `panel`.

use super::{Endpoints, fresh_lines};
use crate::action::{ActionError, IoKind, no_line};
use crate::findings::rules;
use crate::input::PanelAction;
use crate::io::signals::Signals;
use crate::port::Port;
use crate::robot::Robot;
use alloc::format;
use alloc::string::String;

impl Endpoints {
    /// What has no effect is a finding.
    pub(crate) fn panel(&mut self, robot: &mut Robot, panel: PanelAction) {
        let what = match &panel {
            PanelAction::Servo(_) => "servo on",
            PanelAction::Start => "start",
            _ => "the deed",
        };
        if let Err(reason) = self.do_at_panel(robot, panel) {
            let message = format!("{what} at the panel had no effect: {reason}");
            robot.report(&rules::PANEL_REFUSED, None, &[], message);
        }
    }

    /// # Errors
    /// Why it had no effect.
    pub(crate) fn try_panel(&mut self, robot: &mut Robot, panel: PanelAction) -> Result<(), ActionError> {
        let place = match &panel {
            PanelAction::Servo(_) => "servo",
            PanelAction::Start => "start",
            PanelAction::Key(_) => "key switch",
            PanelAction::InputLine { line, .. } if !Signals::exists(*line) => {
                return Err(no_line(IoKind::Input, *line));
            }
            _ => "panel",
        };
        self.do_at_panel(robot, panel)
            .map_err(|reason| ActionError::conflict(place, "a state that allows it", reason))
    }

    /// # Errors
    /// Why it had no effect.
    fn do_at_panel(&mut self, robot: &mut Robot, panel: PanelAction) -> Result<(), String> {
        if panel == PanelAction::PowerCycle {
            self.power_off(robot);
            robot.power_on();
            return Ok(());
        }
        robot.press(panel)
    }

    /// Power off: nothing of any conversation remains.
    pub(crate) fn power_off(&mut self, robot: &mut Robot) {
        if !robot.state.powered {
            return;
        }
        robot.power_off();
        self.lines = fresh_lines();
        for port in Port::ALL {
            self.send_queue.clear(port);
            self.faults.forget_peer(port);
        }
        for session in self.sessions.values_mut() {
            session.reset(robot.config.options.text, None);
        }
    }
}
