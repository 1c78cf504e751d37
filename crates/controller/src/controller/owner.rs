//! Passes actions at the panel and of the owner to the part that carries them out. Power off and a power cycle drop every
//! peer.
//!
//! The panel is in `panel`, the other actions of an owner are in `ops::actions`.

use crate::action::{Accepted, Action, ActionError};
use crate::action_error::ActionResult;
use crate::controller::Controller;
use crate::controls::PanelAction;
use crate::faults::kind::ScheduledAction;
use crate::finding::rules;
use crate::input::By;
use crate::io::signals::{IoKind, Signals};
use crate::ops::actions::no_line;
use crate::output::{Event, Output};
use crate::persistence::Then;
use crate::prelude::*;
use crate::refusal::OperateError;

/// The reason of every action that needs power.
const POWER_IS_OFF: &str = "the power is off; turn it on first";

impl Controller {
    /// Carries out an action. A change of a file that is stored outside first is made when its answer has come. The
    /// result of an action by hand is not awaited, so its refusal is a finding.
    ///
    /// # Errors
    /// Why an action of the owner had no effect; the event says the same.
    pub(super) fn act(&mut self, action: Action, by: By) -> Result<Accepted, ActionError> {
        let robot = &mut self.robot;
        let at_once = |done: ActionResult| done.map(|()| None);
        let variable = if let Action::SetVariable { name, .. } | Action::Teach { name, .. } = &action {
            Some(name.clone())
        } else {
            None
        };
        let done = match action {
            action if !robot.panel.state().powered && action.needs_power() => {
                Err(ActionError::cannot("power", action.verb(), POWER_IS_OFF))
            }
            // A line that is driven by hand has a finding of its own (`no-such-line`).
            Action::Panel(PanelAction::InputLine { line, .. })
                if by == By::Owner && !Signals::exists(line) =>
            {
                Err(no_line(IoKind::Input, line))
            }
            Action::Panel(panel) => at_once(self.do_at_panel(&panel).map_err(|reason| {
                let (place, verb) = panel.purpose();
                ActionError::cannot(place, verb, reason)
            })),
            Action::PowerOff => {
                self.power_off();
                self.robot.context.outputs.push(Output::PowerOff);
                Ok(None)
            }
            Action::PowerOn => {
                self.power_on();
                Ok(None)
            }
            Action::RaiseAlarm { number, detail } => at_once(robot.raise_by_number(&number, detail)),
            Action::Pulse {
                side,
                line,
                on,
                length,
            } => at_once(robot.pulse_line(side, line, on, length)),
            Action::SetOutput { line, on } => at_once(robot.set_user_output(line, on)),
            Action::Force { side, line, on } => at_once(robot.force_line(side, line, Some(on))),
            Action::Release { side, line } => at_once(robot.force_line(side, line, None)),
            Action::SetVariable {
                name,
                values,
                restore,
            } => robot.set_variable(&name, values, restore),
            Action::Teach { name, restore } => robot.teach(&name, restore),
            Action::PutFile { name, content } => robot.put_file(&name, &content),
            Action::EraseFile { name } => robot.erase_file(&name),
            Action::Select { name } => at_once(robot.select_by_name(&name)),
            Action::Breakpoints(lines) => at_once(robot.set_breakpoints(lines)),
            Action::RunTo(line) => at_once(robot.run_to(line)),
            Action::StepTask { kind, task } => at_once(robot.step_task(kind, task)),
            Action::Assign(assignment) => at_once(robot.assign_while_stopped(&assignment)),
            Action::Fault(order) => at_once(self.endpoints.fault_order(&mut robot.context, order)),
        };
        match done {
            Ok(None) => Ok(Accepted::Done),
            Ok(Some(change)) => {
                let place = variable.unwrap_or_else(|| change.staged.name().to_string());
                self.make(change, Then::Resolve { place })
            }
            Err(error) if by == By::Owner => self.refuse_action(error),
            Err(error) => {
                let context = &mut self.robot.context;
                context.report(&rules::PANEL_REFUSED, None, &[], error.sentence);
                Ok(Accepted::Done)
            }
        }
    }

    /// An action has no effect: its caller and the events say the same.
    pub(super) fn refuse_action(&mut self, error: ActionError) -> Result<Accepted, ActionError> {
        let event = Event::ActionRefused(error.clone());
        self.robot.context.outputs.event(event);
        Err(error)
    }

    /// Turns the power off, which ends every conversation.
    fn power_off(&mut self) {
        if self.robot.panel.state().powered {
            self.robot.power_off();
            self.endpoints.power_off(&self.robot.context);
        }
    }

    /// Turns the power on. The parameter files act from here, also on the serial lines.
    fn power_on(&mut self) {
        self.robot.power_on();
        self.endpoints.settings = self.robot.parameters.serial_lines();
    }

    /// Carries out the immediate actions of faults that have fired. The event of a fault follows the events of its actions. Such
    /// a fault meets a command, a text of a download or a record, before the robot is asked for anything.
    pub(super) fn perform_fired(&mut self) {
        for (actions, event) in core::mem::take(&mut self.endpoints.fired) {
            for action in actions {
                self.perform(action);
            }
            self.robot.context.outputs.event(event);
        }
    }

    /// Performs the scheduled actions of faults that are due, in the order of their times.
    pub(super) fn perform_scheduled(&mut self) {
        while let Some(action) = self.endpoints.faults.take_due(self.robot.context.now) {
            self.perform(action);
        }
    }

    fn perform(&mut self, action: ScheduledAction) {
        let state = self.robot.machine_state();
        let context = &mut self.robot.context;
        context.fault_effects.begin_action(context.now, state);
        match action {
            // Without power there is no alarm to raise, and no power to lose.
            ScheduledAction::Alarm(_) | ScheduledAction::Panel(PanelAction::PowerCycle)
                if !self.robot.panel.state().powered => {}
            ScheduledAction::Panel(panel) => {
                // By hand there is no error: a refusal is among the findings.
                let _done = self.act(Action::Panel(panel), By::Hand);
            }
            ScheduledAction::Alarm(code) => self.robot.raise(code, "an armed fault".to_string()),
        }
        // Before the command that meets the fault is served: an extension command ends the SP of its host.
        self.take_notices();
    }
}

/// Result of a method of the robot: nothing, or the reason for which it had no effect.
trait Operated {
    fn result(self) -> Result<(), OperateError>;
}

impl Operated for () {
    fn result(self) -> Result<(), OperateError> {
        Ok(())
    }
}

impl Operated for Result<(), OperateError> {
    fn result(self) -> Result<(), OperateError> {
        self
    }
}

/// Makes `do_at_panel` of the rows: the method that each names.
macro_rules! do_at_panel {
    (
        switches { $(
            $(#[$doc:meta])*
            $name:ident: $variant:ident($($type:tt)*) = $path:literal {
                form: $form:literal,
                document: $document:ident $field:tt,
                act: $act:ident,
                $($more:tt)*
            }
        )* }
        buttons { $(
            $(#[$press_doc:meta])*
            $press_name:ident: $press:ident = $press_path:literal {
                form: $press_form:literal,
                group: $group:ident,
                answer: $answer:tt,
                act: $press_act:ident,
                $($press_more:tt)*
            }
        )* }
        queries $queries:tt
    ) => {
        impl Controller {
            /// Does something at the panel; a row of the table of controls names the method for it.
            ///
            /// # Errors
            /// Why it had no effect.
            fn do_at_panel(&mut self, panel: &PanelAction) -> Result<(), OperateError> {
                let robot = &mut self.robot;
                match *panel {
                    $( PanelAction::$variant(value) => return robot.$act(value).result(), )*
                    $( PanelAction::$press => return robot.$press_act().result(), )*
                    PanelAction::InputLine { line, on } => robot.drive_input(line, on),
                    PanelAction::Jog { axis, positive, mode } => {
                        return robot.jog_by_key(axis, positive, mode);
                    }
                    PanelAction::Keys(ref figures) => robot.channels.type_keys(figures),
                    PanelAction::PowerCycle => {
                        self.power_off();
                        self.power_on();
                    }
                }
                Ok(())
            }
        }
    };
}

crate::controls!(do_at_panel);
