//! Validates the parts of a restored controller: every bound that the rest of the code keeps by construction.
//!
//! Tasks and programs are validated in `executor::relink`, single fields by their types.

use super::SnapshotError;
use crate::Controller;
use crate::drive::Drive;
use crate::endpoint::fresh_lines;
use crate::input::KeySwitch;
use crate::io::channel::Channel;
use crate::io::signals::Signals;
use crate::limits::{
    LINE_QUEUE, MAX_ALARMS, MAX_HISTORY, MAX_QUEUED_BYTES, MAX_QUEUED_SEGMENTS, MAX_SEND, PENDANT_TEXT,
    RING_BUFFER, SERVO_ONS,
};
use crate::options::Config;
use crate::port::Port;
use crate::variation::Variation;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::format;
use alloc::string::ToString;
use core::fmt::Display;
use core::ops::RangeInclusive;
use core::time::Duration;
use scol_mini::MAX_POINTS;
use ts3100_proto::name::FileName;

/// Longest duration anything is counted with: as long as virtual time can last.
const LONGEST: Duration = Duration::from_micros(u64::MAX);
/// Most bytes of a serial line in one direction: both queues, and a text on its way into them.
const MOST_ON_LINE: usize = 2 * LINE_QUEUE + MAX_SEND;

type CheckResult = Result<(), SnapshotError>;

fn check_range<T: PartialOrd + Display>(place: &str, found: T, range: RangeInclusive<T>) -> CheckResult {
    if range.contains(&found) {
        return Ok(());
    }
    let expected = format!("{} to {}", range.start(), range.end());
    Err(SnapshotError::value(place, &expected, found))
}

fn check_at_most(place: &str, found: usize, most: usize) -> CheckResult {
    check_range(place, found, 0..=most)
}

fn check_duration(place: &str, found: Duration) -> CheckResult {
    if found <= LONGEST {
        return Ok(());
    }
    Err(SnapshotError::value(
        place,
        "microseconds of 64 bits at most",
        format!("{found:?}"),
    ))
}

fn check_ports<T>(place: &str, found: &BTreeMap<Port, T>, expected: &[Port]) -> CheckResult {
    if found.keys().eq(expected) {
        return Ok(());
    }
    let names = |ports: &mut dyn Iterator<Item = &Port>| {
        ports
            .map(|port| port.name())
            .collect::<alloc::vec::Vec<_>>()
            .join(", ")
    };
    let expected = names(&mut expected.iter());
    Err(SnapshotError::value(place, &expected, names(&mut found.keys())))
}

/// The configuration, before anything is made of it.
pub(super) fn check_config(config: &Config) -> CheckResult {
    let model = config.model.validate();
    model.map_err(|error| SnapshotError::value("config.model", "an arm", error))?;
    check_range("config.options.low_speed", config.options.low_speed, 1..=100)?;
    check_duration("config.options.do_min_run", config.options.do_min_run)?;
    check_duration("config.options.servo_interval", config.options.servo_interval)?;
    if let Some(found) = config.options.equal_within {
        check_range("config.options.equal_within", found, 0.0..=f32::MAX)?;
    }
    if !config.calendar.is_valid() {
        let found = format!("{:?}", config.calendar);
        return Err(SnapshotError::value("config.calendar", "a date and time", found));
    }
    check_key("config.key", config, config.key)?;
    check_points(config)
}

fn check_key(place: &str, config: &Config, key: KeySwitch) -> CheckResult {
    if key == KeySwitch::Internal && !config.controller.has_internal() {
        let expected = format!("TEACHING or EXT, which the {} has", config.controller.name());
        return Err(SnapshotError::value(place, &expected, "INTERNAL"));
    }
    Ok(())
}

fn check_points(config: &Config) -> CheckResult {
    check_at_most("config.points", config.points.len(), MAX_POINTS)?;
    let arm = config.model.language();
    let mut names = BTreeSet::new();
    let mut points = config.points.iter();
    match points.find(|point| !point.is_valid(arm) || !names.insert(&point.name)) {
        Some(point) => {
            let expected = "points as a table has them, each name once";
            Err(SnapshotError::value("config.points", expected, &point.name))
        }
        None => Ok(()),
    }
}

pub(super) fn controller(controller: &Controller) -> CheckResult {
    check_state(controller)?;
    check_drive(controller)?;
    check_alarms(controller)?;
    controller.robot.signals.check()?;
    check_endpoints(controller)?;
    check_arm(controller)?;
    check_faults(controller)?;
    check_at_most("pendant", controller.robot.pendant.len(), PENDANT_TEXT)?;
    match controller.poll_deadline() {
        Some(due) if due < controller.robot.now => {
            let expected = format!("nothing that was due before {}", controller.robot.now);
            Err(SnapshotError::value("now", &expected, due))
        }
        _ => Ok(()),
    }
}

fn check_state(controller: &Controller) -> CheckResult {
    let state = controller.robot.panel.state();
    check_range("state.override_percent", state.override_percent, 1..=100)?;
    check_range("state.guide.coordinate", state.jog_mode.coordinate, 0..=3)?;
    check_range("state.guide.rate", state.jog_mode.rate, 0..=2)?;
    check_range("state.guide.mode", state.jog_mode.mode, 0..=2)?;
    check_duration("state.run_total", state.run_total)?;
    check_duration("upkeep", controller.robot.maintenance.longest())?;
    if let Some(watchdog) = &state.watchdog {
        check_duration("state.watchdog.timeout", watchdog.timeout)?;
    }
    check_range("state.servo_ons", state.servo_ons, 0..=SERVO_ONS - 1)?;
    if state.servo && state.servo_due.is_some() {
        let expected = "no servo power that is held back while it is on";
        return Err(SnapshotError::value("state.servo_due", expected, "one"));
    }
    let servo = state.servo || state.servo_due.is_some();
    if servo && (state.emergency_stop || state.safety_open) {
        let expected = "no servo power in an emergency stop or with the safety switch open";
        return Err(SnapshotError::value("state.servo", expected, "servo power"));
    }
    check_key("state.key", &controller.robot.config, state.key)
}

fn check_drive(controller: &Controller) -> CheckResult {
    let mut fresh = Drive::new(controller.robot.config.options.drive_capacity);
    for (name, content) in controller.robot.drive.files() {
        let place = format!("drive.files.{name}");
        let normal = FileName::parse(name)
            .ok()
            .filter(|normal| normal.as_str() == name);
        let Some(normal) = normal else {
            return Err(SnapshotError::value(&place, "a file name in upper case", name));
        };
        let stored = fresh.store(&normal, content);
        stored.map_err(|error| SnapshotError::value(&place, "a file the RAM drive takes", error))?;
    }
    if fresh == controller.robot.drive {
        return Ok(());
    }
    let expected = format!(
        "{}, as config.options.drive_capacity",
        controller.robot.config.options.drive_capacity
    );
    Err(SnapshotError::value("drive.capacity", &expected, "another"))
}

fn check_alarms(controller: &Controller) -> CheckResult {
    check_at_most(
        "alarms.active",
        controller.robot.alarms.active().len(),
        MAX_ALARMS,
    )?;
    check_at_most(
        "alarms.history",
        controller.robot.alarms.history().count(),
        MAX_HISTORY,
    )?;
    let mut all = controller
        .robot
        .alarms
        .active()
        .iter()
        .chain(controller.robot.alarms.history());
    match all.find(|alarm| !alarm.at.is_valid()) {
        Some(alarm) => Err(SnapshotError::value(
            "alarms",
            "dates and times that exist",
            format!("{:?}", alarm.at),
        )),
        None => Ok(()),
    }
}

fn check_endpoints(controller: &Controller) -> CheckResult {
    check_ports(
        "sessions",
        &controller.endpoints.sessions,
        &[Port::Host, Port::Ip0],
    )?;
    for (port, session) in &controller.endpoints.sessions {
        if session.port != *port {
            let place = format!("sessions.{port}.port");
            return Err(SnapshotError::value(&place, port.name(), session.port));
        }
        if !session.is_valid(controller.robot.config.options.text) {
            let expected = "a text, a message and a file within their bounds";
            return Err(SnapshotError::value(
                &format!("sessions.{port}"),
                expected,
                "more",
            ));
        }
    }
    let scol = [Port::Com1, Port::Ip1, Port::Ip2, Port::Ip3];
    check_ports("channels", &controller.robot.channels, &scol)?;
    let ring = |place: &str, channel: &Channel| check_at_most(place, channel.len(), RING_BUFFER);
    for (port, channel) in &controller.robot.channels {
        ring(&format!("channels.{port}.ring"), channel)?;
    }
    ring("keys.ring", &controller.robot.keys)?;
    let serial: alloc::vec::Vec<Port> = fresh_lines().into_keys().collect();
    check_ports("lines", &controller.endpoints.lines, &serial)?;
    for (port, line) in &controller.endpoints.lines {
        for (direction, name) in [(&line.inbound, "inbound"), (&line.outbound, "outbound")] {
            let place = format!("lines.{port}.{name}");
            check_at_most(&place, direction.queued(), MOST_ON_LINE)?;
            if !direction.is_valid() {
                let expected = "as many bytes as are counted, and a character within its bits";
                return Err(SnapshotError::value(&place, expected, "others"));
            }
        }
    }
    Ok(())
}

fn check_faults(controller: &Controller) -> CheckResult {
    controller
        .endpoints
        .faults
        .validate()
        .map_err(|(place, expected, found)| {
            SnapshotError::value(&format!("faults.{place}"), &expected, found)
        })?;
    let (vary, seed) = (
        controller.endpoints.variation.as_ref().map(Variation::seed),
        controller.robot.config.vary,
    );
    if vary != seed {
        let seed = |seed: Option<u64>| seed.map_or("none".to_string(), |seed| seed.to_string());
        let expected = format!("{}, as config.vary", seed(controller.robot.config.vary));
        return Err(SnapshotError::value("vary.seed", &expected, seed(vary)));
    }
    for port in Port::ALL {
        let (bytes, segments) = controller.endpoints.send_queue.waiting(port);
        let place = format!("outbox.queues.{port}");
        check_at_most(&place, bytes, MAX_QUEUED_BYTES)?;
        check_at_most(&place, segments, MAX_QUEUED_SEGMENTS)?;
    }
    Ok(())
}

fn check_arm(controller: &Controller) -> CheckResult {
    controller
        .robot
        .arm
        .validate(controller.robot.now)
        .map_err(|(place, reason)| SnapshotError::value(place, "a posture of the arm", reason))?;
    let text = controller
        .robot
        .jogging
        .map(|port| (port, port.protocol().is_some()));
    match text {
        Some((port, false)) => Err(SnapshotError::value("jogging", "HOST or IP0", port)),
        _ => Ok(()),
    }
}

impl Signals {
    fn check(&self) -> CheckResult {
        for (place, line) in self.snapshot_lines() {
            if !Signals::exists(line) {
                let place = format!("signals.{place}");
                let expected = "lines 1-64, 101-164, 201-264; a pulse of an output that is on";
                return Err(SnapshotError::value(&place, expected, line.to_string()));
            }
        }
        Ok(())
    }
}
