//! What is done at the controller itself: panel, teach pendant, terminals, power.

use crate::Controller;
use crate::channel::Channel;
use crate::controller::fresh_lines;
use crate::execution::{By, Course, Execution};
use crate::findings::rules;
use crate::input::{KeySwitch, Panel};
use crate::limits::SERVO_ONS;
use crate::output::{Event, Output};
use crate::port::Port;
use crate::state::State;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use ts3100_proto::name::FileName;

/// Why RN is refused when nothing but servo power is missing.
pub(crate) const SERVO_IS_OFF: &str = "servo power is off";

impl Controller {
    /// What has no effect is a finding.
    pub(crate) fn panel(&mut self, panel: Panel) {
        let what = match &panel {
            Panel::Servo(_) => "servo on",
            Panel::Start => "start",
            _ => "the deed",
        };
        if let Err(reason) = self.do_at_panel(panel) {
            let message = format!("{what} at the panel had no effect: {reason}");
            self.find(&rules::PANEL_REFUSED, None, &[], message);
        }
    }

    /// # Errors
    /// Why it had no effect.
    pub(crate) fn do_at_panel(&mut self, panel: Panel) -> Result<(), String> {
        match panel {
            Panel::Key(key) => return self.turn_key(key),
            Panel::ControlRight(right) => self.state.control_right = right,
            Panel::EmergencyStop(pressed) => self.emergency_stop(pressed),
            Panel::SafetySwitch(open) => self.safety_switch(open),
            Panel::Servo(true) => return self.servo_on(),
            Panel::Servo(false) => self.servo_off(By::Other),
            Panel::Start => return self.start(),
            Panel::Stop => self.stop_after_step(By::Other),
            Panel::FeedHold => self.feed_hold(),
            Panel::AlarmReset => self.reset_alarms(),
            Panel::MachineLock(on) => self.state.machine_lock = on,
            Panel::InputLine { line, on } => self.drive_input(line, on),
            Panel::Battery(low) => {
                if low && !self.state.battery_low && self.state.powered {
                    self.raise(crate::alarm::BATTERY, String::new());
                }
                self.state.battery_low = low;
            }
            Panel::Keys(figures) => {
                self.keys.push(figures.as_bytes());
            }
            Panel::PowerCycle => {
                self.power_off();
                self.power_on();
            }
        }
        Ok(())
    }

    /// Turning the key while a program runs stops it behind the present step.
    fn turn_key(&mut self, key: KeySwitch) -> Result<(), String> {
        let controller = self.config.controller;
        if key == KeySwitch::Internal && !controller.has_internal() {
            return Err(format!(
                "the {} has no INTERNAL position (5.3.2)",
                controller.name()
            ));
        }
        if key != self.state.key {
            self.stop_after_step(By::Other);
            self.state.key = key;
            self.arm.set_pace(self.now, self.pace());
        }
        Ok(())
    }

    /// Servo power on (CMD-SO-02). Every third time it comes by `servo.interval` later, as S41 has it; it is accepted all
    /// the same (assumed).
    pub(crate) fn servo_on(&mut self) -> Result<(), String> {
        if self.state.emergency_stop {
            return Err("the emergency stop is on".to_string());
        }
        if self.state.safety_open {
            return Err("the safety switch is open".to_string());
        }
        if self.alarms.blocks_servo() {
            return Err("an alarm of level 8 is active".to_string());
        }
        if self.state.servo || self.state.servo_due.is_some() {
            return Ok(());
        }
        let interval = self.config.options.servo_interval;
        if interval.is_zero() || self.state.servo_ons + 1 < SERVO_ONS {
            self.servo_comes();
        } else {
            let due = self.now + interval;
            self.state.servo_due = Some(due);
            self.event(Event::ServoHeldBack(due));
        }
        Ok(())
    }

    fn servo_comes(&mut self) {
        self.state.servo = true;
        self.state.servo_ons = (self.state.servo_ons + 1) % SERVO_ONS;
        self.event(Event::Servo(true));
    }

    /// Servo power that was held back comes if its time has come.
    pub(crate) fn end_servo_interval(&mut self) {
        if self.state.servo_due.take_if(|due| *due <= self.now).is_some() {
            self.servo_comes();
        }
    }

    /// Automatic operation starts, or goes on (CMD-RN-01, CMD-RN-05).
    pub(crate) fn start(&mut self) -> Result<(), String> {
        if self.execution.program_runs() {
            self.end_pause();
            return Ok(());
        }
        self.may_start()?;
        let stale = self
            .execution
            .selected
            .as_ref()
            .is_some_and(|selected| selected.stale);
        if stale {
            let name = FileName::parse(self.execution.file()).map_err(|error| error.to_string())?;
            self.select_file(&name).map_err(|error| error.to_string())?;
        }
        if self.execution.course == Course::Reset {
            self.execution.rewind(self.now);
            self.clear_channels();
        }
        self.run_program();
        Ok(())
    }

    /// What waits for an INPUT is gone (D10).
    fn clear_channels(&mut self) {
        let held: Vec<(Port, Vec<u8>)> = self
            .channels
            .iter_mut()
            .map(|(port, buffer)| {
                let held = buffer.held();
                buffer.clear();
                (*port, held)
            })
            .collect();
        for (port, bytes) in held.into_iter().filter(|(_, bytes)| !bytes.is_empty()) {
            let message = format!(
                "{} bytes that waited on {port} are lost by the start",
                bytes.len()
            );
            self.find(&rules::DATA_CLEARED, port, &bytes, message);
        }
        self.keys.clear();
    }

    fn may_start(&self) -> Result<(), String> {
        let reason = if self.execution.selected.is_none() {
            "no file is selected"
        } else if self.execution.direct.is_some() {
            "a DO statement is under way"
        } else if self.is_jogging() {
            "the arm is being guided by JG"
        } else if self.state.emergency_stop {
            "the emergency stop is on"
        } else if self.state.safety_open {
            "the safety switch is open"
        } else if self.alarms.blocks_start() {
            "an alarm of level 4 or 8 is active"
        } else if !self.state.servo {
            SERVO_IS_OFF
        } else if self.state.feed_hold {
            "feed hold is on"
        } else {
            return Ok(());
        };
        Err(reason.to_string())
    }

    /// FEED HOLD: alternate action (CMD-FD-02).
    pub(crate) fn feed_hold(&mut self) {
        self.state.feed_hold = !self.state.feed_hold;
        if self.state.feed_hold {
            self.arm.hold(self.now);
        } else if !self.execution.paused {
            self.arm.resume(self.now);
        }
    }

    /// Feed hold ends without the motion going on.
    pub(crate) fn clear_feed_hold(&mut self) {
        if self.state.feed_hold {
            self.feed_hold();
        }
    }

    /// Power off. The RAM drive, the error history, the selection, the posture, and what is turned or pressed by
    /// hand stay.
    pub(crate) fn power_off(&mut self) {
        if !self.state.powered {
            return;
        }
        self.interrupt(By::Host);
        self.jogging = None;
        self.state = State {
            powered: false,
            run_mode: self.state.run_mode,
            ..self.state.as_left_by_hand(self.now)
        };
        self.arm.power_off(self.now);
        self.signals.drop_outputs();
        self.alarms.reset(|_| false);
        self.pendant.clear();
        self.keys = Channel::default();
        for buffer in self.channels.values_mut() {
            *buffer = Channel::default();
        }
        self.lines = fresh_lines();
        for port in crate::port::Port::ALL {
            self.outbox.clear(port);
            self.faults.forget_peer(port);
        }
        for session in self.sessions.values_mut() {
            session.reset(self.config.options.text, None);
        }
        // The source and the file of the selection stay; what ran of it does not.
        self.execution.direct = None;
        self.execution.run_shown_until = None;
        self.execution.rewind(self.now);
    }

    /// Power on: links are made anew.
    pub(crate) fn power_on(&mut self) {
        let file = FileName::parse(self.execution.file());
        let run_mode = self.state.run_mode;
        self.state = self.state.as_left_by_hand(self.now);
        if self.state.key != KeySwitch::Ext {
            self.state.run_mode = run_mode;
        }
        self.execution = Execution::new(&self.config.language());
        self.execution.timer.set_at = self.now;
        if let Ok(name) = file
            && let Err(error) = self.select_file(&name)
        {
            let message = format!("the selection was dropped at power-on: {error}");
            self.find(&rules::SELECTION_LOST, None, &[], message);
        }
        self.take_parameters();
        if self.state.emergency_stop {
            self.raise(crate::alarm::EMERGENCY_STOP, String::new());
        }
        if self.state.safety_open {
            self.raise(crate::alarm::SAFETY_STOP, String::new());
        }
        if self.state.battery_low {
            self.raise(crate::alarm::BATTERY, String::new());
        }
        self.push_output(Output::PowerCycled);
    }
}
