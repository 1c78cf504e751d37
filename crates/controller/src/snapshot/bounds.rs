//! Validates the parts of a restored controller: every bound that the rest of the code keeps by construction.
//!
//! Tasks and programs are validated in `executor::relink`, single fields by their types.

use crate::alarm::Alarms;
use crate::arm::Guide;
use crate::controller::Controller;
use crate::drive::Drive;
use crate::endpoint::{Endpoints, fresh_lines};
use crate::io::signals::Signals;
use crate::limits::{
    LINE_QUEUE, MAX_ALARMS, MAX_HISTORY, MAX_QUEUED_BYTES, MAX_QUEUED_SEGMENTS, MAX_SEND, PENDANT_TEXT,
    RING_BUFFER, SERVO_ONS,
};
use crate::network::NetworkConfig;
use crate::options::{Config, FieldBus};
use crate::panel::KeySwitch;
use crate::port::Port;
use crate::prelude::*;
use crate::robot::Robot;
use crate::snapshot_error::{CheckResult, SnapshotError, check};
use crate::variation::Variation;
use alloc::collections::BTreeSet;
use core::fmt::Display;
use core::ops::RangeInclusive;
use core::time::Duration;
use scol_mini::MAX_POINTS;
use ts3100_proto::name::FileName;
use ts3100_proto::parameter::{MAX_STRINGS, StringRow};

/// Longest duration anything is counted with: as long as virtual time can last.
const LONGEST: Duration = Duration::from_micros(u64::MAX);
/// Most bytes of a serial line in one direction: both queues, and a text on its way into them.
const MOST_ON_LINE: usize = 2 * LINE_QUEUE + MAX_SEND;

fn check_range<T: PartialOrd + Display>(place: &str, found: T, range: RangeInclusive<T>) -> CheckResult {
    let expected = format!("{} to {}", range.start(), range.end());
    check(range.contains(&found), place, &expected, found)
}

fn check_at_most(place: &str, found: usize, most: usize) -> CheckResult {
    check_range(place, found, 0..=most)
}

fn check_duration(place: &str, found: Duration) -> CheckResult {
    let expected = "microseconds of 64 bits at most";
    check(found <= LONGEST, place, expected, format!("{found:?}"))
}

fn check_ports<'a>(
    place: &str,
    found: impl Iterator<Item = &'a Port>,
    expected: impl Iterator<Item = Port>,
) -> CheckResult {
    let found = found.map(|port| port.name()).collect::<Vec<_>>().join(", ");
    let expected = expected.map(Port::name).collect::<Vec<_>>().join(", ");
    check(found == expected, place, &expected, &found)
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
    let calendar = config.calendar;
    let found = format!("{calendar:?}");
    check(calendar.is_valid(), "config.calendar", "a date and time", found)?;
    check_key("config.key", config, config.key)?;
    check_points(config)
}

fn check_key(place: &str, config: &Config, key: KeySwitch) -> CheckResult {
    let expected = format!("TEACHING or EXT, which the {} has", config.controller.name());
    let exists = key != KeySwitch::Internal || config.controller.has_internal();
    check(exists, place, &expected, "INTERNAL")
}

fn check_points(config: &Config) -> CheckResult {
    check_at_most("config.points", config.points.len(), MAX_POINTS)?;
    let arm = config.model.language();
    let mut names = BTreeSet::new();
    for point in &config.points {
        let expected = "points as a table has them, each name once";
        let holds = point.is_valid(arm) && names.insert(&point.name);
        check(holds, "config.points", expected, &point.name)?;
    }
    Ok(())
}

pub(super) fn check_controller(controller: &Controller) -> CheckResult {
    let Controller { robot, endpoints, .. } = controller;
    check_state(robot)?;
    check_drive(robot)?;
    check_alarms(&robot.alarms)?;
    check_signals(&robot.signals, robot.context.config.options.field_bus)?;
    check_channels(robot)?;
    let network = *robot.parameters.network();
    let asked = NetworkConfig::new(robot.parameters.ethernet());
    let expected = "the channels of `ethernet`";
    check(network == asked, "network", expected, "others")?;
    let strings = robot.parameters.strings();
    check_at_most("strings", strings.len(), MAX_STRINGS)?;
    let valid = strings.iter().all(StringRow::is_valid);
    check(valid, "strings", "rows of STRING.PAR", "others")?;
    check_endpoints(endpoints, robot)?;
    robot.arm.validate(robot.context.now)?;
    if let Some(Guide::Host(port)) = robot.arm.guide() {
        check(port.protocol().is_some(), "jogging", "HOST or IP0", port)?;
    }
    check_faults(endpoints, &robot.context.config)?;
    robot.context.fault_effects.validate()?;
    check_at_most("pendant", robot.channels.pendant().len(), PENDANT_TEXT)?;
    let due = controller.deadline().unwrap_or(robot.context.now);
    let expected = format!("nothing that was due before {}", robot.context.now);
    check(due >= robot.context.now, "now", &expected, due)
}

fn check_state(robot: &Robot) -> CheckResult {
    let state = robot.panel.state();
    check_range("panel.override_percent", state.override_percent, 1..=100)?;
    check_range("panel.jog_mode.coordinate", state.jog_mode.coordinate, 0..=3)?;
    check_range("panel.jog_mode.rate", state.jog_mode.rate, 0..=2)?;
    check_range("panel.jog_mode.mode", state.jog_mode.mode, 0..=2)?;
    let now = robot.context.now;
    let run_until = state.running_since.unwrap_or(now);
    let holds = run_until <= now && state.run_total <= run_until.since(state.powered_at);
    let expected = "no more than has passed since the power came on";
    check(
        holds,
        "panel.run_total",
        expected,
        format!("{:?}", state.run_total),
    )?;
    let holds = robot.maintenance.has_valid_durations(now);
    let expected = "durations no longer than the time that has passed";
    check(holds, "maintenance", expected, "longer ones")?;
    let expected = "what items showed when they were reset";
    check(
        robot.maintenance.has_valid_bases(),
        "maintenance.bases",
        expected,
        "others",
    )?;
    if let Some(watchdog) = &state.watchdog {
        check_duration("panel.watchdog.timeout", watchdog.timeout)?;
    }
    check_range("panel.servo_ons", state.servo_ons, 0..=SERVO_ONS - 1)?;
    let due = state.servo_due.is_some();
    let expected = "no servo power that is held back while it is on";
    check(!(state.servo && due), "panel.servo_due", expected, "one")?;
    let stopped = state.emergency_stop || state.safety_open;
    let expected = "no servo power in an emergency stop or with the safety switch open";
    let holds = !(stopped && (state.servo || due));
    check(holds, "panel.servo", expected, "servo power")?;
    check_key("panel.key", &robot.context.config, state.key)
}

fn check_drive(robot: &Robot) -> CheckResult {
    let capacity = robot.context.config.options.drive_capacity;
    let mut fresh = Drive::new(capacity);
    for (name, content) in robot.drive.files() {
        let place = format!("drive.files.{name}");
        let normal = FileName::parse(name).ok();
        let Some(normal) = normal.filter(|normal| normal.as_str() == name) else {
            return Err(SnapshotError::value(&place, "a file name in upper case", name));
        };
        let stored = fresh.store(&normal, content.to_vec());
        stored.map_err(|error| SnapshotError::value(&place, "a file the RAM drive takes", error))?;
    }
    let expected = format!("{capacity}, as config.options.drive_capacity");
    check(fresh == robot.drive, "drive.capacity", &expected, "another")
}

fn check_alarms(alarms: &Alarms) -> CheckResult {
    check_at_most("alarms.active", alarms.active().len(), MAX_ALARMS)?;
    check_at_most("alarms.history", alarms.history().count(), MAX_HISTORY)?;
    for alarm in alarms.active().iter().chain(alarms.history()) {
        let found = format!("{:?}", alarm.at);
        check(alarm.at.is_valid(), "alarms", "dates and times that exist", found)?;
    }
    Ok(())
}

fn check_signals(signals: &Signals, bus: FieldBus) -> CheckResult {
    for (place, line) in signals.snapshot_lines() {
        let expected = "a line that exists; a pulse of an output that is on";
        check(Signals::exists(line), &format!("signals.{place}"), expected, line)?;
        // Pulsed outputs are on, so the outputs stand for the pulses too.
        let is_cut_off = place == "outputs" && bus == FieldBus::Absent && Signals::is_on_field_bus(line);
        let expected = "no output of the field bus that is on, or `io.field_bus = present`";
        check(!is_cut_off, &format!("signals.{place}"), expected, line)?;
    }
    Ok(())
}

fn check_channels(robot: &Robot) -> CheckResult {
    let scol = [Port::Com1, Port::Ip1, Port::Ip2, Port::Ip3];
    let (ports, keys, _) = robot.channels.saved();
    check_ports("channels", ports.keys(), scol.into_iter())?;
    for (port, channel) in ports {
        check_at_most(&format!("channels.{port}.ring"), channel.len(), RING_BUFFER)?;
    }
    check_at_most("keys.ring", keys.len(), RING_BUFFER)
}

fn check_endpoints(endpoints: &Endpoints, robot: &Robot) -> CheckResult {
    let hosts = [Port::Host, Port::Ip0];
    check_ports("sessions", endpoints.sessions.keys(), hosts.into_iter())?;
    for (port, session) in &endpoints.sessions {
        let place = format!("sessions.{port}");
        let own = session.port == *port;
        check(own, &format!("{place}.port"), port.name(), session.port)?;
        let expected = "a text, a message and a file within their bounds";
        check(
            session.is_valid(robot.context.config.options.text),
            &place,
            expected,
            "more",
        )?;
        let (seen, made) = (&session.seen_requests, &robot.panel.state().stop_requests);
        let expected = "as many requests as `panel.stop_requests` counts, or less";
        let holds = seen.is_part_of(made);
        check(holds, &format!("{place}.seen_requests"), expected, "more")?;
    }
    check_ports("lines", endpoints.lines.keys(), fresh_lines().into_keys())?;
    for (port, line) in &endpoints.lines {
        for (direction, name) in [(&line.inbound, "inbound"), (&line.outbound, "outbound")] {
            let place = format!("lines.{port}.{name}");
            check_at_most(&place, direction.queued(), MOST_ON_LINE)?;
            let expected = "as many bytes as are counted, and a character within its bits";
            check(direction.is_valid(), &place, expected, "others")?;
        }
    }
    Ok(())
}

fn check_faults(endpoints: &Endpoints, config: &Config) -> CheckResult {
    endpoints.faults.validate()?;
    let seed = |seed: Option<u64>| seed.map_or("none".to_string(), |seed| seed.to_string());
    let found = endpoints.variation.as_ref().map(Variation::seed);
    let expected = format!("{}, as config.vary", seed(config.vary));
    check(found == config.vary, "variation.seed", &expected, seed(found))?;
    for port in Port::ALL {
        let (bytes, segments) = endpoints.send_queue.waiting(port);
        let place = format!("send_queue.queues.{port}");
        check_at_most(&place, bytes, MAX_QUEUED_BYTES)?;
        check_at_most(&place, segments, MAX_QUEUED_SEGMENTS)?;
    }
    Ok(())
}
