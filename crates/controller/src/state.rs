//! What the operating panel and the host can set: power, key switch, modes, holds.
//!
//! The running program is in `executor`, the posture in `arm`.

use crate::input::{ControlRight, KeySwitch};
use crate::time::Time;
use core::time::Duration;
use ts3100_proto::command::RunMode;
use ts3100_proto::status::{AlarmLevel, MasterMode};

/// Settings for jogging, as SF shows them (SF-14 to SF-16).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct JogMode {
    /// 0 joint, 1 tool, 2 work, 3 world.
    pub coordinate: u16,
    /// 0 slow, 1 mid, 2 fast.
    pub rate: u16,
    /// 0 jog, 1 inching, 2 free.
    pub mode: u16,
}

/// The watchdog a host set by WD: it must send a text within the timeout (ste80722 S11).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Watchdog {
    /// Longest pause allowed.
    pub timeout: Duration,
    /// Level of the alarm after a longer pause.
    pub level: AlarmLevel,
    /// When the watchdog was last reset.
    pub fed_at: Time,
}

impl Watchdog {
    /// When the alarm is raised.
    #[must_use]
    pub fn deadline(&self) -> Time {
        self.fed_at + self.timeout
    }
}

/// State of the controller apart from program and arm.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct PanelState {
    /// The power is on; nothing else happens while it is off.
    pub powered: bool,
    /// Servo power.
    pub servo: bool,
    /// When servo power that was turned on becomes active, if the option `servo.interval` delays it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub servo_due: Option<Time>,
    /// Servo-ons since the power came on or since the last that was held back, as many as [`SERVO_ONS`](crate::limits::SERVO_ONS) less one at most.
    #[cfg_attr(feature = "serde", serde(default))]
    pub servo_ons: u8,
    /// The emergency stop button is pressed.
    pub emergency_stop: bool,
    /// The safety switch is open.
    pub safety_open: bool,
    /// Position of the key switch.
    pub key: KeySwitch,
    /// EXTERNAL mode control right.
    pub control_right: ControlRight,
    /// Operation mode.
    pub run_mode: RunMode,
    /// Speed override in percent, 1 to 100.
    pub override_percent: u8,
    /// Programs run without the arm moving.
    pub machine_lock: bool,
    /// Feed hold is on.
    pub feed_hold: bool,
    /// The battery of the RAM drive is low.
    pub battery_low: bool,
    /// Settings for jogging.
    #[cfg_attr(feature = "serde", serde(rename = "guide"))]
    pub jog_mode: JogMode,
    /// The watchdog of a host, while it is armed.
    pub watchdog: Option<Watchdog>,
    /// When the power came on.
    pub powered_at: Time,
    /// How long programs have run since then, up to `running_since`.
    pub run_total: Duration,
    /// Since when the present program runs.
    pub running_since: Option<Time>,
}

impl PanelState {
    /// The state when the power comes on at `now` (D8, D9).
    #[must_use]
    pub fn power_on(now: Time, key: KeySwitch, control_right: ControlRight) -> PanelState {
        PanelState {
            powered: true,
            servo: false,
            servo_due: None,
            servo_ons: 0,
            emergency_stop: false,
            safety_open: false,
            key,
            control_right,
            run_mode: RunMode::Cycle,
            override_percent: 100,
            machine_lock: false,
            feed_hold: false,
            battery_low: false,
            jog_mode: JogMode::default(),
            watchdog: None,
            powered_at: now,
            run_total: Duration::ZERO,
            running_since: None,
        }
    }

    /// The column of the permission tables that holds now.
    #[must_use]
    pub fn master_mode(&self) -> MasterMode {
        match (self.key, self.control_right) {
            (KeySwitch::Teaching, _) => MasterMode::Teaching,
            (KeySwitch::Internal, _) => MasterMode::Internal,
            (KeySwitch::Ext, ControlRight::Sig) => MasterMode::ExtSig,
            (KeySwitch::Ext, ControlRight::Rs232c) => MasterMode::ExtRs232c,
            (KeySwitch::Ext, ControlRight::Ether) => MasterMode::ExtEther,
        }
    }

    /// The state of [`PanelState::power_on`] that keeps the positions of the switches and buttons of this one.
    #[must_use]
    pub fn as_left_by_hand(&self, now: Time) -> PanelState {
        PanelState {
            emergency_stop: self.emergency_stop,
            safety_open: self.safety_open,
            machine_lock: self.machine_lock,
            battery_low: self.battery_low,
            ..PanelState::power_on(now, self.key, self.control_right)
        }
    }

    /// Whole minutes since the power came on (SF-19).
    #[must_use]
    pub fn power_on_minutes(&self, now: Time) -> u32 {
        minutes(now.since(self.powered_at))
    }

    /// Whole minutes in which a program ran since then (SF-20).
    #[must_use]
    pub fn run_minutes(&self, now: Time) -> u32 {
        let present = self
            .running_since
            .map_or(Duration::ZERO, |since| now.since(since));
        minutes(self.run_total + present)
    }
}

fn minutes(duration: Duration) -> u32 {
    u32::try_from(duration.as_secs() / 60).unwrap_or(u32::MAX)
}
