//! The operating panel, the teach pendant and the power switch, as far as they act on the robot; the same by command and
//! signal. The state of the panel is in `crate::panel`.
//!
//! `controller::owner` drops the peers when the power goes off; stops are carried out by `robot::run_control`.

use super::refuse_if;
use crate::alarm::{self, AlarmCode};
use crate::executor::{Executor, StopCause};
use crate::finding::rules;
use crate::io::channels::Channels;
use crate::output::{Event, Output};
use crate::panel::{ControlRight, KeySwitch};
use crate::prelude::*;
use crate::refusal::OperateError;
use crate::robot::Robot;
use ts3100_proto::command::RunMode;
use ts3100_proto::name::FileName;

impl Robot {
    /// Turning the key while a program runs stops it after the present step.
    pub(crate) fn set_key_switch(&mut self, key: KeySwitch) -> Result<(), OperateError> {
        let controller = self.context.config.controller;
        if key == KeySwitch::Internal && !controller.has_internal() {
            return Err(OperateError::NoInternal(controller.name()));
        }
        if key != self.panel.state().key {
            self.stop_after_step(StopCause::Other);
            self.panel.set_key(key);
            self.arm.set_speed_limits(self.context.now, self.pace());
        }
        Ok(())
    }

    /// The EXTERNAL mode control right. The host that loses it lets go of the arm that it jogs.
    pub(crate) fn set_control_right(&mut self, right: ControlRight) {
        let state = self.panel.state();
        if state.key == KeySwitch::Ext && state.control_right != right {
            self.arm.stop_jog(self.context.now);
        }
        self.panel.set_control_right(right);
    }

    /// The cause of this alarm lasts from now on, or does not any more.
    pub(crate) fn set_alarm_cause(&mut self, code: AlarmCode, lasts: bool) {
        if self.panel.set_alarm_cause(code, lasts) {
            self.raise(code, String::new());
        }
    }

    /// The emergency stop is pressed, or not any more.
    pub(crate) fn set_emergency_stop(&mut self, pressed: bool) {
        self.set_alarm_cause(alarm::EMERGENCY_STOP, pressed);
    }

    /// The safety switch is open, or not any more.
    pub(crate) fn set_safety_switch(&mut self, open: bool) {
        self.set_alarm_cause(alarm::SAFETY_STOP, open);
    }

    /// The battery of the RAM drive is low, or not any more.
    pub(crate) fn set_battery(&mut self, low: bool) {
        self.set_alarm_cause(alarm::BATTERY, low);
    }

    pub(crate) fn set_machine_lock(&mut self, on: bool) {
        self.panel.set_machine_lock(on);
    }

    /// The key that moves the arm is let go: it slows and rests.
    pub(crate) fn stop_jog(&mut self) {
        self.arm.stop_jog(self.context.now);
    }

    /// The button of servo power; it is refused as SO is.
    pub(crate) fn set_servo(&mut self, on: bool) -> Result<(), OperateError> {
        if on {
            return self.servo_on();
        }
        self.servo_off(StopCause::Other);
        Ok(())
    }

    /// The speed override, from 1 to 100 percent; the current motion takes it.
    pub(crate) fn set_override(&mut self, percent: u8) {
        self.panel.set_override(percent.clamp(1, 100));
        self.arm.set_speed_limits(self.context.now, self.pace());
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
        let interval = self.context.config.options.servo_interval;
        self.context
            .outputs
            .event(self.panel.servo_on(self.context.now, interval));
        Ok(())
    }

    /// Servo power that was held back comes if its time has come.
    pub(crate) fn end_servo_interval(&mut self) {
        self.context
            .outputs
            .event(self.panel.end_servo_interval(self.context.now));
    }

    /// Starts or continues automatic operation (CMD-RN-01, CMD-RN-05).
    pub(crate) fn start(&mut self) -> Result<(), OperateError> {
        if self.executor.program_runs() {
            self.end_pause();
            return Ok(());
        }
        self.may_start()?;
        self.renew_stale()?;
        if self.executor.is_reset() {
            self.executor.rewind(self.context.now);
            self.clear_channels();
        }
        self.run_program();
        Ok(())
    }

    /// START of the panel: a step under way becomes a run.
    pub(crate) fn start_by_hand(&mut self) -> Result<(), OperateError> {
        if self.executor.program_runs() {
            self.executor.drop_target();
        }
        self.start()
    }

    /// Runs one step of the program, whatever the operation mode.
    pub(crate) fn step(&mut self) -> Result<(), OperateError> {
        if self.executor.program_runs() {
            return Err(OperateError::ProgramRuns);
        }
        self.start()?;
        self.executor.stop_after_next_step();
        Ok(())
    }

    /// Drops the bytes that wait for an INPUT (D10).
    fn clear_channels(&mut self) {
        for (port, bytes) in self.channels.clear() {
            let message = format!(
                "{} bytes that waited on {port} are lost by the start",
                bytes.len()
            );
            self.context.report(&rules::DATA_CLEARED, port, &bytes, message);
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
            self.arm.hold(self.context.now);
        } else if !self.is_held() {
            self.arm.resume(self.context.now);
        }
    }

    /// Feed hold is on from now, or off.
    pub(crate) fn set_feed_hold(&mut self, on: bool) {
        if self.panel.state().feed_hold != on {
            self.feed_hold();
        }
    }

    /// Power off. The RAM drive, the error history, the selection, the posture, and what is turned or pressed by
    /// hand stay, and so do breakpoints, which are a tool's and not the robot's.
    pub(crate) fn power_off(&mut self) {
        if !self.panel.state().powered {
            return;
        }
        // No host learns of the stop: the connections end with the power.
        self.servo_off(StopCause::Host);
        self.panel.power_off(self.context.now);
        self.arm.power_off(self.context.now);
        self.signals.clear_outputs();
        if self.alarms.reset(|_| false) {
            self.context.outputs.event(Event::AlarmsReset);
        }
        self.channels = Channels::default();
        self.executor.power_off(self.context.now);
    }

    /// Power on: links are opened again.
    pub(crate) fn power_on(&mut self) {
        if self.panel.state().powered {
            return;
        }
        let file = FileName::parse(self.executor.file());
        let breakpoints = self.executor.breakpoints().set().to_vec();
        self.panel.power_on(self.context.now);
        self.executor = Executor::new(&self.context.config.language(), self.context.now);
        if let Ok(name) = file {
            match self.select_file(&name) {
                Ok(()) => self.executor.set_breakpoints(breakpoints),
                Err(error) => {
                    let message = format!("the selection was dropped at power-on: {error}");
                    self.context.report(&rules::SELECTION_LOST, None, &[], message);
                }
            }
        }
        self.take_parameters();
        let causes = self.panel.alarm_causes().into_iter();
        for (_, alarm) in causes.filter(|(there, _)| *there) {
            self.raise(alarm, String::new());
        }
        self.context.outputs.push(Output::PowerCycled);
    }
}
