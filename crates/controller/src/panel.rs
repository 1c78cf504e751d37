//! The panel: power, servo power, key switch, modes and holds, as far as they are a state. [`PanelState`] is readable;
//! `Panel` changes it.
//!
//! What a change does to the arm and the program is in `ops::panel`.

use crate::alarm::{self, AlarmCode};
use crate::limits::SERVO_ONS;
use crate::output::Event;
use crate::time::Time;
use core::time::Duration;
use ts3100_proto::command::RunMode;
use ts3100_proto::status::{AlarmLevel, MasterMode};

ts3100_proto::codes! {
    /// Position of the key switch.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
    pub enum KeySwitch {
        /// Teaching (test run).
        Teaching = "teaching",
        /// Internal automatic operation; the TS3100 only (GEN-05).
        Internal = "internal",
        /// External automatic operation.
        #[default]
        Ext = "ext",
    }
    /// Its word.
    fn as_str -> &'static str;
    impl Word;
}

ts3100_proto::codes! {
    /// Who commands the robot in EXT mode.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
    pub enum ControlRight {
        /// The external operation signals.
        Sig = "sig",
        /// The serial port HOST.
        Rs232c = "rs232c",
        /// The Ethernet channel IP0.
        #[default]
        Ether = "ether",
    }
    /// Its word.
    fn as_str -> &'static str;
    impl Word;
}

/// Settings for jogging, as SF shows them (SF-14 to SF-16).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JogMode {
    /// 0 joint, 1 tool, 2 work, 3 world.
    pub coordinate: u16,
    /// 0 slow, 1 mid, 2 fast.
    pub rate: u16,
    /// 0 jog, 1 inching, 2 free.
    pub mode: u16,
}

impl JogMode {
    /// Words for the values of `coordinate`.
    pub const COORDINATES: [&str; 4] = ["joint", "tool", "work", "world"];
    /// Words for the values of `rate`.
    pub const RATES: [&str; 3] = ["slow", "mid", "fast"];
    /// `mode` of motions.
    pub const JOG: u16 = 0;
    /// `mode` of steps.
    pub const INCHING: u16 = 1;
    /// `mode` in which the arm is moved by hand alone.
    pub const FREE: u16 = 2;

    /// Settings by their words; `None` if there are no such words.
    pub fn from_words(coordinates: &str, rate: &str, inching: bool) -> Option<JogMode> {
        let number = |words: &[&str], word| {
            let place = words.iter().position(|known| *known == word)?;
            u16::try_from(place).ok()
        };
        Some(JogMode {
            coordinate: number(&JogMode::COORDINATES, coordinates)?,
            rate: number(&JogMode::RATES, rate)?,
            mode: if inching { JogMode::INCHING } else { JogMode::JOG },
        })
    }

    /// The word of the coordinate system and that of the rate.
    pub fn words(&self) -> [&'static str; 2] {
        let word =
            |words: &[&'static str], number: u16| words.get(usize::from(number)).copied().unwrap_or_default();
        [
            word(&JogMode::COORDINATES, self.coordinate),
            word(&JogMode::RATES, self.rate),
        ]
    }
}

/// The watchdog a host set by WD: it must send a text within the timeout (ste80722 S11).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
    pub fn deadline(&self) -> Time {
        self.fed_at + self.timeout
    }
}

/// How often a stop has been requested since the power came on, by cause. SM shows what a connection has not seen yet (T1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StopRequests {
    /// The emergency stop was pressed.
    pub emergency_stop: u32,
    /// The safety switch was opened.
    pub safety_stop: u32,
    /// SP of a host, STOP of the panel, input STOP.
    pub stop: u32,
    /// EC,BREAK of a host, input BREAK.
    pub break_off: u32,
}

impl StopRequests {
    /// Whether no count is above that of `all`.
    pub(crate) fn is_part_of(&self, all: &StopRequests) -> bool {
        self.emergency_stop <= all.emergency_stop
            && self.safety_stop <= all.safety_stop
            && self.stop <= all.stop
            && self.break_off <= all.break_off
    }

    /// Whether each cause has come again since `seen`: EE, SE, SC and BC of SM.
    pub(crate) fn since(&self, seen: &StopRequests) -> [bool; 4] {
        [
            self.emergency_stop != seen.emergency_stop,
            self.safety_stop != seen.safety_stop,
            self.stop != seen.stop,
            self.break_off != seen.break_off,
        ]
    }
}

/// State of the controller apart from program and arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PanelState {
    /// The power is on; nothing else happens while it is off.
    pub powered: bool,
    /// Servo power.
    pub servo: bool,
    /// When servo power that was turned on becomes active, if the option `servo.interval` delays it.
    pub servo_due: Option<Time>,
    /// Servo-ons since the power came on or since the last that was held back, as many as [`SERVO_ONS`] less one at most.
    pub servo_ons: u8,
    /// The emergency stop button is pressed.
    pub emergency_stop: bool,
    /// The safety switch is open.
    pub safety_open: bool,
    /// Position of the key switch.
    pub key: KeySwitch,
    /// EXTERNAL mode control right.
    pub control_right: ControlRight,
    /// The control right that counts again after power-off, while EM of a host has changed it (T4).
    pub lasting_right: Option<ControlRight>,
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
    pub jog_mode: JogMode,
    /// The watchdog of a host, while it is armed.
    pub watchdog: Option<Watchdog>,
    /// When the power came on.
    pub powered_at: Time,
    /// How long programs have run since then, up to `running_since`.
    pub run_total: Duration,
    /// Since when the present program runs.
    pub running_since: Option<Time>,
    /// Requests to stop since the power came on.
    pub stop_requests: StopRequests,
}

impl PanelState {
    /// The state when the power comes on at `now` (D8, D9).
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
            lasting_right: None,
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
            stop_requests: StopRequests::default(),
        }
    }

    /// The column of the permission tables that holds now.
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
    fn as_left_by_hand(&self, now: Time) -> PanelState {
        PanelState {
            emergency_stop: self.emergency_stop,
            safety_open: self.safety_open,
            machine_lock: self.machine_lock,
            battery_low: self.battery_low,
            ..PanelState::power_on(now, self.key, self.lasting_right.unwrap_or(self.control_right))
        }
    }

    /// Whole minutes since the power came on (SF-19).
    pub fn power_on_minutes(&self, now: Time) -> u32 {
        minutes(now.since(self.powered_at))
    }

    /// Whole minutes in which a program ran since then (SF-20).
    pub fn run_minutes(&self, now: Time) -> u32 {
        let present = self.running_since.map(|since| now.since(since));
        minutes(self.run_total + present.unwrap_or_default())
    }
}

/// One request more. Only whether a count differs from what a host has seen matters, so it may wrap.
fn count(requests: &mut u32) {
    *requests = requests.wrapping_add(1);
}

/// The panel: its state, and the only ways to change it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct Panel {
    state: PanelState,
}

impl Panel {
    /// The panel when the power comes on.
    pub(crate) fn new(now: Time, key: KeySwitch, control_right: ControlRight) -> Panel {
        let state = PanelState::power_on(now, key, control_right);
        Panel { state }
    }

    pub(crate) fn state(&self) -> &PanelState {
        &self.state
    }

    /// Conditions that raise an alarm when they begin and at power-on: whether each holds, and its alarm.
    pub(crate) fn alarm_causes(&self) -> [(bool, AlarmCode); 3] {
        [
            (self.state.emergency_stop, alarm::EMERGENCY_STOP),
            (self.state.safety_open, alarm::SAFETY_STOP),
            (self.state.battery_low, alarm::BATTERY),
        ]
    }

    /// Power off: what is turned or pressed by hand stays, and the operation mode.
    pub(crate) fn power_off(&mut self, now: Time) {
        self.state = PanelState {
            powered: false,
            run_mode: self.state.run_mode,
            ..self.state.as_left_by_hand(now)
        };
    }

    /// Power on; the operation mode stays but in EXT.
    pub(crate) fn power_on(&mut self, now: Time) {
        let run_mode = self.state.run_mode;
        self.state = self.state.as_left_by_hand(now);
        if self.state.key != KeySwitch::Ext {
            self.state.run_mode = run_mode;
        }
    }

    /// The cause of an alarm lasts, or does not; true if it does newly and the power is on.
    pub(crate) fn set_alarm_cause(&mut self, code: AlarmCode, lasts: bool) -> bool {
        let causes = [
            (&mut self.state.emergency_stop, alarm::EMERGENCY_STOP),
            (&mut self.state.safety_open, alarm::SAFETY_STOP),
            (&mut self.state.battery_low, alarm::BATTERY),
        ];
        let cause = causes.into_iter().find(|(_, of)| *of == code);
        let lasted = cause.map(|(cause, _)| core::mem::replace(cause, lasts));
        let begins = self.state.powered && lasts && lasted == Some(false);
        // A button held when the power comes on raises its alarm, but is no request.
        if begins {
            let requests = &mut self.state.stop_requests;
            if code == alarm::EMERGENCY_STOP {
                count(&mut requests.emergency_stop);
            } else if code == alarm::SAFETY_STOP {
                count(&mut requests.safety_stop);
            }
        }
        begins
    }

    /// STOP was requested, whether anything ran or not.
    pub(crate) fn note_stop_request(&mut self) {
        count(&mut self.state.stop_requests.stop);
    }

    /// BREAK was requested.
    pub(crate) fn note_break_request(&mut self) {
        count(&mut self.state.stop_requests.break_off);
    }

    pub(crate) fn set_key(&mut self, key: KeySwitch) {
        self.state.key = key;
    }

    pub(crate) fn set_control_right(&mut self, right: ControlRight) {
        (self.state.control_right, self.state.lasting_right) = (right, None);
    }

    /// EM of a host: for as long as the power is on.
    pub(crate) fn give_control_right(&mut self, right: ControlRight) {
        let state = &mut self.state;
        state.lasting_right.get_or_insert(state.control_right);
        state.control_right = right;
    }

    pub(crate) fn set_machine_lock(&mut self, on: bool) {
        self.state.machine_lock = on;
    }

    pub(crate) fn set_override(&mut self, percent: u8) {
        self.state.override_percent = percent;
    }

    pub(crate) fn set_run_mode(&mut self, mode: RunMode) {
        self.state.run_mode = mode;
    }

    pub(crate) fn set_feed_hold(&mut self, on: bool) {
        self.state.feed_hold = on;
    }

    pub(crate) fn change_jog_mode(&mut self, change: impl Fn(&mut JogMode)) {
        change(&mut self.state.jog_mode);
    }

    /// Servo power comes, at once or, every third time, after the interval; nothing if it is on or about to come.
    pub(crate) fn servo_on(&mut self, now: Time, interval: Duration) -> Option<Event> {
        if self.state.servo || self.state.servo_due.is_some() {
            return None;
        }
        if interval.is_zero() || self.state.servo_ons + 1 < SERVO_ONS {
            return Some(self.servo_comes());
        }
        let due = now + interval;
        self.state.servo_due = Some(due);
        Some(Event::ServoDelayed(due))
    }

    fn servo_comes(&mut self) -> Event {
        self.state.servo = true;
        self.state.servo_ons = (self.state.servo_ons + 1) % SERVO_ONS;
        Event::Servo(true)
    }

    /// Servo power that was held back comes if its time has come.
    pub(crate) fn end_servo_interval(&mut self, now: Time) -> Option<Event> {
        self.state.servo_due.take_if(|due| *due <= now)?;
        Some(self.servo_comes())
    }

    /// Servo power goes off, if it is on.
    pub(crate) fn servo_off(&mut self) -> Option<Event> {
        self.state.servo_due = None;
        core::mem::take(&mut self.state.servo).then_some(Event::Servo(false))
    }

    pub(crate) fn set_watchdog(&mut self, watchdog: Option<Watchdog>) {
        self.state.watchdog = watchdog;
    }

    /// A host has sent a text.
    pub(crate) fn feed_watchdog(&mut self, now: Time) {
        if let Some(watchdog) = &mut self.state.watchdog {
            watchdog.fed_at = now;
        }
    }

    /// Takes the watchdog if its time has expired.
    pub(crate) fn take_late_watchdog(&mut self, now: Time) -> Option<Watchdog> {
        self.state.watchdog.take_if(|watchdog| watchdog.deadline() <= now)
    }

    /// A program runs from now on.
    pub(crate) fn run_begins(&mut self, now: Time) {
        self.state.running_since = Some(now);
    }

    /// No program runs any more.
    pub(crate) fn run_ends(&mut self, now: Time) {
        if let Some(since) = self.state.running_since.take() {
            self.state.run_total += now.since(since);
        }
    }
}

fn minutes(duration: Duration) -> u32 {
    u32::try_from(duration.as_secs() / 60).unwrap_or(u32::MAX)
}
