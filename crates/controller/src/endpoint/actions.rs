//! Passes what is done to the controller itself, at the panel or by its owner, to the part that does it. Power off and a
//! power cycle drop every peer.
//!
//! The panel is in `panel`, what else an owner does in `ops::actions`.

use super::{Endpoints, fresh_lines};
use crate::action::{Accepted, Action, ActionError, ActionErrorKind};
use crate::alarm;
use crate::executor::StopCause;
use crate::findings::rules;
use crate::io::signals::{IoKind, Signals};
use crate::ops::{OperateError, no_line};
use crate::output::{Event, Output};
use crate::panel::PanelAction;
use crate::persistence::PendingChange;
use crate::port::Port;
use crate::prelude::*;
use crate::robot::Robot;
use ts3100_proto::words::Word as _;

impl Endpoints {
    /// Does what one who holds the controller wants. A change of a file that is to be kept outside first is done when
    /// the answer has come.
    ///
    /// # Errors
    /// Why it had no effect; the event says the same.
    pub(crate) fn act(&mut self, robot: &mut Robot, action: Action) -> Result<Accepted, ActionError> {
        let not_persisted = robot.persistence.refusal();
        let again = robot.persistence.is_enabled().then(|| action.clone());
        let done = match action {
            action if !robot.panel.state().powered && action.needs_power() => {
                let verb = format!("do `{action}`");
                Err(ActionError::cannot("power", verb, "the power is off"))
            }
            Action::Panel(PanelAction::InputLine { line, .. }) if !Signals::exists(line) => {
                Err(no_line(IoKind::Input, line))
            }
            Action::Panel(panel) => {
                let (place, verb) = purpose(&panel);
                let done = self.do_at_panel(robot, panel);
                done.map_err(|reason| ActionError::cannot(place, verb, reason))
            }
            Action::FeedHold(on) => {
                robot.set_feed_hold(on);
                Ok(())
            }
            Action::PowerOff => {
                self.power_off(robot);
                robot.outputs.push(Output::PowerOff);
                Ok(())
            }
            Action::PowerOn => {
                robot.power_on();
                Ok(())
            }
            Action::RaiseAlarm { number, detail } => robot.raise_by_number(&number, detail),
            Action::Pulse {
                side,
                line,
                on,
                length,
            } => robot.pulse_line(side, line, on, length),
            Action::SetOutput { line, on } => robot.set_user_output(line, on),
            Action::Force { side, line, on } => robot.force_line(side, line, Some(on)),
            Action::Release { side, line } => robot.force_line(side, line, None),
            Action::SetVariable {
                name,
                values,
                restore,
            } => robot.set_variable(&name, values, restore),
            Action::Teach { name, restore } => robot.teach(&name, restore),
            Action::PutFile { name, content } => robot.put_file(&name, &content),
            Action::EraseFile { name } => robot.erase_file(&name),
            Action::Select { name } => robot.select_by_name(&name),
            Action::Breakpoints(lines) => robot.set_breakpoints(&lines),
            Action::Step => robot.step(),
            Action::RunTo(line) => robot.run_to(line),
            Action::Fault(order) => self.fault_order(robot, order),
        };
        let Err(mut error) = done else {
            return Ok(Accepted::Done);
        };
        if let Some(action) = again.filter(|_| robot.persistence.is_pending()) {
            robot.persistence.hold(PendingChange::Action(action));
            return Ok(Accepted::Pending);
        }
        if let Some(reason) = not_persisted {
            error = ActionError {
                kind: ActionErrorKind::NotPersisted,
                ..ActionError::cannot(&error.place, "keep the change", reason)
            };
        }
        robot.outputs.event(Event::ActionRefused(error.clone()));
        Err(error)
    }

    /// Does something at the panel for which nobody waits: what has no effect is a finding.
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
    fn do_at_panel(&mut self, robot: &mut Robot, panel: PanelAction) -> Result<(), OperateError> {
        match panel {
            PanelAction::Key(key) => return robot.turn_key(key),
            PanelAction::ControlRight(right) => robot.set_control_right(right),
            PanelAction::EmergencyStop(pressed) => robot.set_alarm_cause(alarm::EMERGENCY_STOP, pressed),
            PanelAction::SafetySwitch(open) => robot.set_alarm_cause(alarm::SAFETY_STOP, open),
            PanelAction::Servo(true) => return robot.servo_on(),
            PanelAction::Servo(false) => robot.servo_off(StopCause::Other),
            PanelAction::Start => return robot.start(),
            PanelAction::Stop => robot.stop_after_step(StopCause::Other),
            PanelAction::FeedHold => robot.feed_hold(),
            PanelAction::AlarmReset => robot.reset_alarms(),
            PanelAction::MachineLock(on) => robot.panel.set_machine_lock(on),
            PanelAction::InputLine { line, on } => robot.drive_input(line, on),
            PanelAction::Battery(low) => robot.set_alarm_cause(alarm::BATTERY, low),
            PanelAction::Override(percent) => robot.set_override(percent.clamp(1, 100)),
            PanelAction::RunMode(mode) => return robot.set_run_mode(mode),
            PanelAction::Jog { axis, positive, mode } => robot.jog_by_key(axis, positive, mode)?,
            PanelAction::JogStop => robot.arm.stop_jog(robot.now),
            PanelAction::Keys(figures) => robot.channels.type_keys(&figures),
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

/// Where at the panel an action had no effect, and what one who does it wants to do.
fn purpose(panel: &PanelAction) -> (&'static str, String) {
    if let PanelAction::Servo(on) = panel {
        ("servo", format!("turn the servo {}", on.word()))
    } else if let PanelAction::Key(key) = panel {
        ("key switch", format!("turn the key switch to {}", key.word()))
    } else if *panel == PanelAction::Start {
        ("start", "start the program".to_string())
    } else if let PanelAction::Jog { axis, .. } = panel {
        ("jog", format!("jog axis {axis}"))
    } else {
        ("panel", format!("do `{panel}`"))
    }
}
