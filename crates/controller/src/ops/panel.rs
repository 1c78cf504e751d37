//! The operating panel, the teach pendant and the power switch, as far as they act on the robot; the same by command and
//! signal. The state of the panel is in `crate::panel`.
//!
//! `endpoint::actions` drops the peers when the power goes off; stops are carried out by `executor::run_control`.

use super::refuse_if;
use crate::alarm::AlarmCode;
use crate::executor::selection::SelectError;
use crate::executor::{Executor, StopCause};
use crate::findings::rules;
use crate::io::channels::Channels;
use crate::motion::MotionError;
use crate::output::{Event, Output};
use crate::panel::{ControlRight, KeySwitch};
use crate::prelude::*;
use crate::robot::Robot;
use ts3100_proto::command::RunMode;
use ts3100_proto::error_text;
use ts3100_proto::name::FileName;

/// Why something at the panel had no effect, or the command or signal that does the same.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum OperateError {
    NoInternal(&'static str),
    EmergencyStop,
    SafetyOpen,
    ServoAlarm,
    StartAlarm,
    ServoOff,
    FeedHold,
    Direct,
    Jogging,
    NoFile,
    NoRcycle,
    ServoOn,
    NotStopped,
    Running,
    NotFirst,
    NotTeaching,
    Busy,
    Free,
    Guided,
    Select(SelectError),
    Jog(MotionError),
}

error_text! {
    OperateError: Select from SelectError, Jog from MotionError;
    Self::NoInternal(port) => "the {port} has no INTERNAL position (5.3.2)";
    Self::EmergencyStop => "the emergency stop is pressed";
    Self::SafetyOpen => "the safety switch is open";
    Self::ServoAlarm => "an alarm of level 8 is active";
    Self::StartAlarm => "an alarm of level 4 or 8 is active";
    Self::ServoOff => "servo power is off";
    Self::FeedHold => "feed hold is on";
    Self::Direct => "a DO statement is under way";
    Self::Jogging => "the arm is being jogged";
    Self::NoFile => "no file is selected";
    Self::NoRcycle => "the program has no label RCYCLE";
    Self::ServoOn => "servo power is on already (SV_RDY)";
    Self::NotStopped => "a reset is accepted only in stop mode";
    Self::Running => "the operation mode can be set only while the robot is stopped";
    Self::NotFirst => "of several inputs at once only the first is processed";
    Self::NotTeaching => "the key switch is not in TEACHING";
    Self::Busy => "a program or a DO statement is under way";
    Self::Free => "the guide mode is FREE";
    Self::Guided => "the arm is being guided; JG ! ends that";
    Self::Select(error) => "{error}";
    Self::Jog(error) => "{error}";
}

impl Robot {
    /// Turning the key while a program runs stops it behind the present step.
    pub(crate) fn turn_key(&mut self, key: KeySwitch) -> Result<(), OperateError> {
        let controller = self.config.controller;
        if key == KeySwitch::Internal && !controller.has_internal() {
            return Err(OperateError::NoInternal(controller.name()));
        }
        if key != self.panel.state().key {
            self.stop_after_step(StopCause::Other);
            self.panel.set_key(key);
            self.arm.set_speed_limits(self.now, self.pace());
        }
        Ok(())
    }

    /// The EXTERNAL mode control right. The host that loses it lets go of the arm that it jogs.
    pub(crate) fn set_control_right(&mut self, right: ControlRight) {
        let state = self.panel.state();
        if state.key == KeySwitch::Ext && state.control_right != right {
            self.arm.stop_jog(self.now);
        }
        self.panel.set_control_right(right);
    }

    /// The cause of this alarm lasts from now on, or does not any more.
    pub(crate) fn set_alarm_cause(&mut self, code: AlarmCode, lasts: bool) {
        if self.panel.set_alarm_cause(code, lasts) {
            self.raise(code, String::new());
        }
    }

    /// The speed override, from 1 to 100 percent; the motion under way goes on with it.
    pub(crate) fn set_override(&mut self, percent: u8) {
        self.panel.set_override(percent);
        self.arm.set_speed_limits(self.now, self.pace());
    }

    /// The operation mode (CMD-EC-02).
    pub(crate) fn set_run_mode(&mut self, mode: RunMode) -> Result<(), OperateError> {
        if self.executor.is_running() {
            return Err(OperateError::Running);
        }
        self.panel.set_run_mode(mode);
        Ok(())
    }

    /// Servo power on (CMD-SO-02). Every third time it comes by `servo.interval` later, as S41 has it; it is accepted all
    /// the same (assumed).
    pub(crate) fn servo_on(&mut self) -> Result<(), OperateError> {
        refuse_if([
            (self.panel.state().emergency_stop, OperateError::EmergencyStop),
            (self.panel.state().safety_open, OperateError::SafetyOpen),
            (self.alarms.blocks_servo(), OperateError::ServoAlarm),
        ])?;
        let interval = self.config.options.servo_interval;
        self.outputs.event(self.panel.servo_on(self.now, interval));
        Ok(())
    }

    /// Servo power that was held back comes if its time has come.
    pub(crate) fn end_servo_interval(&mut self) {
        self.outputs.event(self.panel.end_servo_interval(self.now));
    }

    /// Automatic operation starts, or goes on (CMD-RN-01, CMD-RN-05).
    pub(crate) fn start(&mut self) -> Result<(), OperateError> {
        if self.executor.program_runs() {
            self.end_pause();
            return Ok(());
        }
        self.may_start()?;
        self.renew_stale()?;
        if self.executor.is_reset() {
            self.executor.rewind(self.now);
            self.clear_channels();
        }
        self.run_program();
        Ok(())
    }

    /// What waits for an INPUT is gone (D10).
    fn clear_channels(&mut self) {
        for (port, bytes) in self.channels.clear() {
            let message = format!(
                "{} bytes that waited on {port} are lost by the start",
                bytes.len()
            );
            self.report(&rules::DATA_CLEARED, port, &bytes, message);
        }
    }

    fn may_start(&self) -> Result<(), OperateError> {
        refuse_if([
            (self.executor.selected().is_none(), OperateError::NoFile),
            (self.executor.has_direct(), OperateError::Direct),
            (self.arm.is_jogging(), OperateError::Jogging),
            (self.panel.state().emergency_stop, OperateError::EmergencyStop),
            (self.panel.state().safety_open, OperateError::SafetyOpen),
            (self.alarms.blocks_start(), OperateError::StartAlarm),
            (!self.panel.state().servo, OperateError::ServoOff),
            (self.panel.state().feed_hold, OperateError::FeedHold),
        ])
    }

    /// FEED HOLD: alternate action (CMD-FD-02).
    pub(crate) fn feed_hold(&mut self) {
        let on = !self.panel.state().feed_hold;
        self.panel.set_feed_hold(on);
        if on {
            self.arm.hold(self.now);
        } else if !self.is_held() {
            self.arm.resume(self.now);
        }
    }

    /// Feed hold is on from now, or off.
    pub(crate) fn set_feed_hold(&mut self, on: bool) {
        if self.panel.state().feed_hold != on {
            self.feed_hold();
        }
    }

    /// Power off. The RAM drive, the error history, the selection, the posture, and what is turned or pressed by
    /// hand stay.
    pub(crate) fn power_off(&mut self) {
        if !self.panel.state().powered {
            return;
        }
        self.interrupt(StopCause::Host);
        self.panel.power_off(self.now);
        self.arm.power_off(self.now);
        self.signals.clear_outputs();
        if self.alarms.reset(|_| false) {
            self.outputs.event(Event::AlarmsReset);
        }
        self.channels = Channels::default();
        self.executor.power_off(self.now);
    }

    /// Power on: links are made anew.
    pub(crate) fn power_on(&mut self) {
        if self.panel.state().powered {
            return;
        }
        let file = FileName::parse(self.executor.file());
        self.panel.power_on(self.now);
        self.executor = Executor::new(&self.config.language(), self.now);
        if let Ok(name) = file
            && let Err(error) = self.select_file(&name)
        {
            let message = format!("the selection was dropped at power-on: {error}");
            self.report(&rules::SELECTION_LOST, None, &[], message);
        }
        self.take_parameters();
        let causes = self.panel.alarm_causes().into_iter();
        for (_, alarm) in causes.filter(|(there, _)| *there) {
            self.raise(alarm, String::new());
        }
        self.outputs.push(Output::PowerCycled);
    }
}
