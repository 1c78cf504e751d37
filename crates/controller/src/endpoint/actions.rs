//! Passes what is done to the controller itself, at the panel or by its owner, to the part that does it. Power off and a
//! power cycle drop every peer.
//!
//! The panel is in `panel`, what else an owner does in `ops::actions`.

use super::{Endpoints, fresh_lines};
use crate::action::{Action, ActionError};
use crate::executor::StopCause;
use crate::findings::rules;
use crate::io::signals::{IoKind, Signals};
use crate::ops::{OperateError, no_line};
use crate::output::Output;
use crate::panel::PanelAction;
use crate::port::Port;
use crate::robot::Robot;
use alloc::format;
use alloc::string::ToString;

impl Endpoints {
    /// What has no effect is a finding.
    pub(crate) fn panel(&mut self, robot: &mut Robot, panel: PanelAction) {
        let what = if let PanelAction::Servo(_) = panel {
            "servo on"
        } else if panel == PanelAction::Start {
            "start"
        } else {
            "the deed"
        };
        if let Err(reason) = self.do_at_panel(robot, panel) {
            let message = format!("{what} at the panel had no effect: {reason}");
            robot.report(&rules::PANEL_REFUSED, None, &[], message);
        }
    }

    /// # Errors
    /// Why it had no effect.
    pub(crate) fn act(&mut self, robot: &mut Robot, action: Action) -> Result<(), ActionError> {
        if !robot.panel.state().powered && action.needs_power() {
            return Err(ActionError::conflict("power", "on", "off"));
        }
        match action {
            Action::Panel(panel) => return self.try_panel(robot, panel),
            Action::FeedHold(on) => robot.set_feed_hold(on),
            Action::PowerOff => {
                self.power_off(robot);
                robot.push_output(Output::PowerOff);
            }
            Action::PowerOn => robot.power_on(),
            Action::RaiseAlarm { number, detail } => return robot.raise_by_number(number, detail),
            Action::Pulse {
                side,
                line,
                on,
                length,
            } => return robot.pulse_line(side, line, on, length),
            Action::SetOutput { line, on } => return robot.set_user_output(line, on),
            Action::Force { side, line, on } => return robot.force_line(side, line, Some(on)),
            Action::Release { side, line } => return robot.force_line(side, line, None),
            Action::SetVariable {
                name,
                values,
                restore,
            } => return robot.set_variable(&name, values, restore),
            Action::Teach { name, restore } => return robot.teach(&name, restore),
            Action::PutFile { name, content } => return robot.put_file(&name, &content),
            Action::EraseFile { name } => return robot.erase_file(&name),
            Action::Select { name } => return robot.select_by_name(&name),
            Action::Fault(order) => return self.fault_order(robot, order),
        }
        Ok(())
    }

    fn try_panel(&mut self, robot: &mut Robot, panel: PanelAction) -> Result<(), ActionError> {
        if let PanelAction::InputLine { line, .. } = panel
            && !Signals::exists(line)
        {
            return Err(no_line(IoKind::Input, line));
        }
        let place = if let PanelAction::Servo(_) = panel {
            "servo"
        } else if let PanelAction::Key(_) = panel {
            "key switch"
        } else if panel == PanelAction::Start {
            "start"
        } else {
            "panel"
        };
        self.do_at_panel(robot, panel)
            .map_err(|reason| ActionError::conflict(place, "a state that allows it", reason.to_string()))
    }

    /// # Errors
    /// Why it had no effect.
    fn do_at_panel(&mut self, robot: &mut Robot, panel: PanelAction) -> Result<(), OperateError> {
        match panel {
            PanelAction::Key(key) => return robot.turn_key(key),
            PanelAction::ControlRight(right) => robot.panel.set_control_right(right),
            PanelAction::EmergencyStop(pressed) => robot.emergency_stop(pressed),
            PanelAction::SafetySwitch(open) => robot.safety_switch(open),
            PanelAction::Servo(true) => return robot.servo_on(),
            PanelAction::Servo(false) => robot.servo_off(StopCause::Other),
            PanelAction::Start => return robot.start(),
            PanelAction::Stop => robot.stop_after_step(StopCause::Other),
            PanelAction::FeedHold => robot.feed_hold(),
            PanelAction::AlarmReset => robot.reset_alarms(),
            PanelAction::MachineLock(on) => robot.panel.set_machine_lock(on),
            PanelAction::InputLine { line, on } => robot.drive_input(line, on),
            PanelAction::Battery(low) => robot.battery(low),
            PanelAction::Keys(figures) => robot.type_keys(&figures),
            PanelAction::PowerCycle => {
                self.power_off(robot);
                robot.power_on();
            }
        }
        Ok(())
    }

    /// Power off: nothing of any conversation remains.
    pub(crate) fn power_off(&mut self, robot: &mut Robot) {
        if !robot.panel.state().powered {
            return;
        }
        robot.power_off();
        self.lines = fresh_lines();
        for port in Port::ALL {
            self.forget_peer(port);
        }
        for session in self.sessions.values_mut() {
            session.reset(robot.config.options.text, None);
        }
    }
}
