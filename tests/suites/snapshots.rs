//! Snapshots of the present controller: conversations and programs pass with a round trip through JSON
//! after every input; a tampered snapshot is refused or goes on, but never panics or hangs.
//!
//! Files that earlier emulators wrote are in `snapshot_files.rs`.

use crate::{programs, transcripts};
use serde_json::Value as Json;
use std::time::Duration;
use ts3100_controller::faults::FaultAction;
use ts3100_controller::faults::rng::Rng;
use ts3100_controller::{
    Config, Controller, Dialect, PanelAction, Port, Snapshot, SnapshotError, SnapshotHeader,
};
use ts3100_tests::Robot;
use ts3100_tests::round_trip::{self, with_round_trips};
use ts3100_tests::transcript::Cut;

/// Inputs between two round trips of long runs: programs have many scans.
const EVERY: u32 = 17;

#[test]
fn every_transcript_survives_round_trips_whole_and_byte_by_byte() {
    for (name, transcript) in transcripts::transcripts() {
        for (cut, every) in [(Cut::Whole, 1), (Cut::Bytes, EVERY)] {
            let result = with_round_trips(every, || transcript.run(cut));
            assert!(result.is_ok(), "{name}: {result:?}");
        }
    }
}

#[test]
fn programs_do_the_same_with_round_trips() {
    for (path, source) in programs::programs() {
        let plain = programs::play(&source);
        assert_eq!(
            with_round_trips(EVERY, || programs::play(&source)),
            plain,
            "{}",
            path.display()
        );
    }
}

/// Something of everything: two tasks, a motion that overlaps another, an INPUT that waits, a monitor, an exchange.
const RICH: &str = "GLOBAL\nDIM T(3) AS INTEGER\nA = 1.5\nEND\nPROGRAM M\nON DIN(9) DO PRINT A\nTASK(\"OTHER\")\n\
    PASS = 50\nAGAIN:\nMOVE H\nMOVES F WITH SPEED=30\nMOVEJ H, POINT(30,20,20)\nPULOUT(3, 0.2)\nGOTO AGAIN\nEND\n\
    PROGRAM OTHER\nN = 0\nAGAIN:\nINPUT IP1, N, T(1)\nPRINT IP1, N, CR\nDELAY 0.3\nGOTO AGAIN\nEND\nDATA\n\
    POINT H=400,0,200,0,0,0,0,0/\nPOINT F=400,100,150,0,0,0,0,0/\nEND\n";

/// A controller in the middle of all of it.
fn busy() -> Robot {
    let mut config = Config::new(Dialect::Field);
    config.options.serial_pacing = true;
    config.vary = Some(11);
    let mut robot = Robot::with(config);
    robot.load("RICH", RICH);
    for port in [Port::Ip0, Port::Ip1, Port::Host] {
        robot.connect(port);
    }
    for spec in [
        "emergency-stop:command=SU,delay=30000",
        "late-reply:command=VR",
        "lost-record:times=2,probability=0.5",
    ] {
        let fault = Box::new(spec.parse().unwrap());
        robot.feed(FaultAction::Arm(fault).into());
    }
    robot.panel(PanelAction::Servo(true));
    for command in ["SU", "WD,9000 2", "RN"] {
        robot.send(Port::Ip0, format!("{command}\r").as_bytes());
        robot.advance_ms(200);
    }
    robot.advance_ms(150);
    robot.raw(Port::Ip1, b"4,5");
    robot.send(Port::Ip0, b"CA\r");
    robot.raw(Port::Host, b"\x02SU");
    robot.advance_ms(1);
    robot
}

#[test]
fn the_busy_controller_is_busy() {
    let robot = busy();
    let json: Json = serde_json::from_str(&round_trip::to_json(&robot.seat.controller)).unwrap();
    assert_eq!(json["format"], "ts3100-snapshot");
    assert_eq!(json["version"], 1);
    for place in [
        "/executor/main/handler",
        "/executor/tasks/2/state/Reading/wanted",
        "/arm/active/motion",
        "/sessions/IP0/exchange/Sending/sender/bytes",
        "/lines/HOST/inbound/clock",
        "/panel/watchdog/timeout",
        "/drive/files/RICH",
        "/faults/scheduled/0/0",
        "/variation/segments",
        "/send_queue/queues/IP0/0",
    ] {
        assert!(json.pointer(place).is_some(), "{place} in {json:#}");
    }
    let text = json["drive"]["files"]["RICH"].as_str().unwrap();
    assert!(text.starts_with("GLOBAL\nDIM T(3)"), "files can be read: {text}");
    assert_eq!(json["channels"]["IP1"]["ring"], "5");
}

#[test]
fn another_version_or_form_is_refused_with_words() {
    let robot = Robot::new(Dialect::Field);
    let mut json = serde_json::to_value(robot.seat.controller.snapshot()).unwrap();
    json["version"] = 2.into();
    let head: SnapshotHeader = serde_json::from_value(json.clone()).unwrap();
    assert_eq!(
        head.validate().unwrap_err().to_string(),
        "snapshot, version: expected 1, found 2"
    );
    let snapshot: Snapshot = serde_json::from_value(json.clone()).unwrap();
    assert_eq!(
        Controller::restore(snapshot).unwrap_err(),
        head.validate().unwrap_err()
    );
    json["format"] = "ts3100-recording".into();
    let head: SnapshotHeader = serde_json::from_value(json).unwrap();
    assert!(matches!(head.validate(), Err(SnapshotError::Value { place, .. }) if place == "format"));
}

/// JSON pointers into the snapshot of the busy controller, the value put there, and a part of the error message.
fn impossible() -> Vec<(&'static str, Json, &'static str)> {
    Vec::from([
        (
            "/panel/override_percent",
            0.into(),
            "panel.override_percent: expected 1 to 100, found 0",
        ),
        (
            "/panel/jog_mode/rate",
            7.into(),
            "panel.jog_mode.rate: expected 0 to 2, found 7",
        ),
        (
            "/panel/emergency_stop",
            true.into(),
            "panel.servo: expected no servo power",
        ),
        (
            "/config/model/max_payload",
            0.into(),
            "config.model: expected an arm",
        ),
        ("/config/calendar/month", 13.into(), "config.calendar"),
        ("/config/options/low_speed", 0.into(), "config.options.low_speed"),
        ("/drive/capacity", 7.into(), "drive.capacity"),
        ("/drive/files/RICH", "\u{7}".into(), "drive.files.RICH"),
        ("/drive/files/RICH", "\u{1234}".into(), "U+1234"),
        (
            "/alarms/history",
            serde_json::json!([{"code": "9-999", "detail": "", "at": null}]),
            "9-999",
        ),
        ("/signals/inputs", serde_json::json!([77]), "signals.inputs"),
        (
            "/signals/outputs",
            serde_json::json!([301]),
            "signals.outputs: expected no output of the field bus that is on, or `io.field_bus = present`, found 301",
        ),
        ("/signals/pulses", serde_json::json!({"5": 1}), "signals.pulses"),
        ("/sessions/IP0/port", "HOST".into(), "sessions.IP0.port"),
        (
            "/sessions/IP0/exchange/Sending/sender/per_text",
            0.into(),
            "sessions.IP0",
        ),
        ("/lines/HOST/inbound/queued", 1_000.into(), "lines.HOST.inbound"),
        (
            "/lines/HOST/inbound/bursts/0/sender/speed",
            0.into(),
            "expected 1 to 4294967295, found 0",
        ),
        ("/user/host/length", 255.into(), "expected 5 to 8, found 255"),
        (
            "/network/channels/1/own_port",
            1.into(),
            "network: expected the channels of `ethernet`",
        ),
        ("/arm/rest/0", 1e5.into(), "arm.rest"),
        (
            "/arm/active/motion/path",
            serde_json::json!({"Chain": {"motions": [], "duration": 1.0}}),
            "arm.active",
        ),
        (
            "/arm/active/motion/path/Chain/motions/0/path/Joint/courses/most_accel",
            0.0.into(),
            "arm.active",
        ),
        (
            "/arm/active/motion/path/Chain/motions/0/path/Joint/courses/others/0/axis",
            8.into(),
            "arm.active",
        ),
        (
            "/arm/active/motion/path/Chain/motions/0/path/Joint/courses/lead/end",
            0.5.into(),
            "arm.active",
        ),
        (
            "/arm/active/motion/path/Chain/motions/0/path/Joint/from/0",
            1e5.into(),
            "arm.active",
        ),
        (
            "/arm/active/motion/path/Chain/motions/1/path/Tool/samples/1/2",
            1e9.into(),
            "arm.active",
        ),
        ("/arm/wear/total/way/0", (-1.0).into(), "arm.wear"),
        (
            "/executor/main",
            Json::Null,
            "executor.main: expected a main program",
        ),
        (
            "/executor/selected/source",
            "PROGRAM P\nMOVE\nEND\n".into(),
            "executor.selected.source",
        ),
        (
            "/executor/selected/source",
            "PROGRAM P\nEND\n".into(),
            "executor.selected.memory",
        ),
        (
            "/executor/main/machine/at",
            100_000.into(),
            "executor.main.machine",
        ),
        (
            "/faults/reports/1/fault/spec",
            "late".into(),
            "unknown kind of fault `late`",
        ),
        (
            "/faults/reports/1/fault/id",
            1.into(),
            "faults.reports: expected numbers that rise from 1",
        ),
        (
            "/faults/reports/0/fired",
            2.into(),
            "faults.reports: expected a fault that fired no more often",
        ),
        (
            "/sessions/IP0/asked",
            "XX".into(),
            "the letters of a command, found `XX`",
        ),
        (
            "/variation",
            Json::Null,
            "variation.seed: expected 11, as config.vary, found none",
        ),
        ("/executor/tasks/2/machine/task", 3.into(), "executor.tasks.2"),
        (
            "/panel/run_total/secs",
            1_000_000.into(),
            "panel.run_total: expected no more than has passed since the power came on",
        ),
        (
            "/maintenance/servo/before/secs",
            1_000_000.into(),
            "maintenance: expected durations no longer than the time that has passed",
        ),
        (
            "/arm/active/motion/profile/phases/0/duration",
            (-1).into(),
            "arm.active: expected a posture of the arm, found a motion with finite times and places",
        ),
        (
            "/executor/direct_ended",
            10.into(),
            "executor.direct_ended: expected at most 9",
        ),
    ])
}

/// A state that cannot occur is refused, and the message names the field.
#[test]
fn a_state_that_cannot_occur_is_refused_with_its_field() {
    let whole: Json = serde_json::from_str(&round_trip::to_json(&busy().seat.controller)).unwrap();
    for (place, value, expected) in impossible() {
        let mut json = whole.clone();
        let field = json.pointer_mut(place);
        *field.unwrap_or_else(|| panic!("{place} in {whole:#}")) = value;
        let error = round_trip::from_json(&json.to_string()).map(drop).unwrap_err();
        assert!(error.contains(expected), "{place}: {error}");
    }
    let mut json = whole;
    json["surplus"] = 1.into();
    assert!(
        round_trip::from_json(&json.to_string())
            .unwrap_err()
            .contains("unknown field `surplus`")
    );
}

/// A motion that a stop (retry) has cut short is in the snapshot, and is validated like one under way.
#[test]
fn an_interrupted_motion_is_validated_too() {
    let mut robot = busy();
    robot.panel(PanelAction::Servo(false));
    let mut json: Json = serde_json::from_str(&round_trip::to_json(&robot.seat.controller)).unwrap();
    let path = json.pointer_mut("/arm/interrupted/motion/path");
    *path.unwrap() = serde_json::json!({"Chain": {"motions": [], "duration": 1.0}});
    let error = round_trip::from_json(&json.to_string()).map(drop).unwrap_err();
    assert!(error.contains("arm.interrupted"), "{error}");
}

/// A snapshot may begin right at the bound of a counter: what it becomes is still a snapshot.
#[test]
fn counters_of_wear_stay_at_their_bound() {
    let mut json: Json = serde_json::from_str(&round_trip::to_json(&busy().seat.controller)).unwrap();
    for counter in ["way", "torque", "square"] {
        let place = format!("/arm/wear/total/{counter}");
        let axes = json.pointer_mut(&place).unwrap().as_array_mut().unwrap();
        axes.iter_mut().for_each(|axis| *axis = 1e18.into());
    }
    let controller = round_trip::from_json(&json.to_string()).unwrap();
    let mut robot = Robot::from_controller(controller);
    robot.advance_ms(5_000);
    // Counted are motions when they end or change.
    robot.panel(PanelAction::PowerCycle);
    let again = round_trip::from_json(&round_trip::to_json(&robot.seat.controller));
    assert!(again.is_ok(), "{:?}", again.err());
}

/// Changes one place of a value.
fn tamper(json: &mut Json, rng: &mut Rng) {
    let inner = rng.index(8) > 0;
    match json {
        Json::Array(list) if !list.is_empty() => {
            let at = rng.index(list.len());
            match rng.index(10) {
                0 => drop(list.remove(at)),
                1 => list.push(list[at].clone()),
                _ => tamper(&mut list[at], rng),
            }
        }
        Json::Object(fields) if inner && !fields.is_empty() => {
            let at = rng.index(fields.len());
            if let Some((_, field)) = fields.iter_mut().nth(at) {
                tamper(field, rng);
            }
        }
        Json::String(text) if rng.index(4) > 0 => match rng.index(3) {
            0 => text.push('\r'),
            1 => drop(text.pop()),
            _ => *text = text.repeat(1_000),
        },
        Json::Number(number) if rng.index(3) > 0 => {
            let double = number.as_f64().unwrap_or(0.0);
            *json = match rng.index(4) {
                0 => (double * 2.0).into(),
                1 => (double - 1.0).into(),
                2 => number
                    .as_u64()
                    .map_or_else(|| (-double).into(), |whole| whole.saturating_add(1).into()),
                _ => number
                    .as_u64()
                    .map_or_else(|| 0.into(), |whole| (whole / 2).into()),
            };
        }
        other => {
            let wholes = [0, 1, 2, 3, 17, 255, 65_535, i64::from(u32::MAX), i64::MAX, -1];
            *other = match rng.index(10) {
                0 => Json::Null,
                1 => Json::Bool(rng.index(2) == 0),
                2 => u64::MAX.into(),
                3 => ["Ready", "Holding", "Resting", "Reset", "Idle", "Retry", "IP1"][rng.index(7)].into(),
                4 => [0.5, 1e300, -1e300, 1e-300][rng.index(4)].into(),
                5 => serde_json::json!({ "Running": { "stop": null } }),
                _ => wholes[rng.index(wholes.len())].into(),
            };
        }
    }
}

/// A controller restored from a tampered snapshot may do anything but panic or hang.
fn live(controller: Controller) {
    let mut robot = Robot::from_controller(controller);
    for port in [Port::Ip0, Port::Ip1, Port::Host] {
        robot.connect(port);
    }
    robot.raw(Port::Host, b"\x02SO\r\x03");
    robot.raw(Port::Ip1, b"1,2\r");
    for command in [
        "SF",
        "SU",
        "AC",
        "CA",
        "SP",
        "MR,0 A 0",
        "DO,MOVE POINT(400,50,180)",
    ] {
        robot.send(Port::Ip0, format!("{command}\r").as_bytes());
        robot.send(Port::Ip0, b"OK\r");
        robot.advance(Duration::from_millis(300));
    }
    for panel in [
        PanelAction::PressFeedHold,
        PanelAction::PressFeedHold,
        PanelAction::EmergencyStop(true),
        PanelAction::PowerCycle,
    ] {
        robot.panel(panel);
        robot.advance(Duration::from_millis(700));
    }
    robot.send(Port::Ip0, b"RN\r");
    robot.advance(Duration::from_secs(3));
}

#[test]
fn a_tampered_snapshot_is_refused_or_goes_on_but_never_panics_or_hangs() {
    let robot = busy();
    let mut rng = Rng::new(0x7533_1006, "tamper");
    let whole: Json = serde_json::from_str(&round_trip::to_json(&robot.seat.controller)).unwrap();
    let (mut refused, mut lived) = (0, 0);
    for _ in 0..tries() {
        let mut json = whole.clone();
        for _ in 0..=rng.index(2) {
            tamper(&mut json, &mut rng);
        }
        let text = json.to_string();
        match round_trip::from_json(&text) {
            Err(error) => {
                assert!(!error.is_empty());
                refused += 1;
            }
            Ok(controller) => {
                live(controller);
                lived += 1;
            }
        }
    }
    assert!(refused > 500 && lived > 100, "{refused} refused, {lived} lived");
}

/// As many as the environment asks for (`TS3100_TAMPER`), a quick look otherwise.
fn tries() -> u32 {
    let count = std::env::var("TS3100_TAMPER").ok();
    count.and_then(|count| count.parse().ok()).unwrap_or(1_500)
}
