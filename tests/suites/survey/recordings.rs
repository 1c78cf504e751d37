//! What a recording of a host at work shows of the SP that nobody asked for. Its other answers are in `files`.

use super::config;
use Said::{Again, Host, Robot as Controller};
use std::time::Duration;
use ts3100_controller::{PanelAction, Port};
use ts3100_survey::passive::{Observation, Passive};
use ts3100_tests::Robot;

/// A part of a recording.
#[derive(Clone)]
enum Said {
    Host(String),
    Robot(Vec<u8>),
    /// The host has connected again.
    Again,
}

fn host(command: &str) -> Said {
    Host(format!("\x02{command}\r\x03"))
}

fn robot(text: &str) -> Said {
    Controller(format!("\x02{text}\r\x03").into_bytes())
}

/// What a recording with a part every 2 s says about unasked stops.
fn heard(parts: &[Said]) -> Option<String> {
    let mut observation = Observation::default();
    let mut passive = Passive::new(&mut observation);
    for (at, part) in (0..).step_by(2).map(Duration::from_secs).zip(parts) {
        match part {
            Host(text) => passive.host(at, text.as_bytes()),
            Controller(bytes) => passive.robot(at, bytes),
            Again => passive.reconnected(),
        }
    }
    passive.finish();
    let answers = observation.report().answers.into_iter();
    let mut stops = answers.filter(|answer| answer.probe == "unsolicited-stop");
    stops.next().map(|answer| answer.heard)
}

/// SU and its answer, from a controller at rest.
fn status() -> [Said; 2] {
    let mut idle = Robot::with(config(&[]));
    idle.connect(Port::Ip0);
    idle.panel(PanelAction::Servo(true));
    idle.raw(Port::Ip0, b"\x02SU\r\x03");
    idle.advance_ms(500);
    [host("SU"), Controller(idle.received(Port::Ip0))]
}

/// The host starts a program.
fn start() -> [Said; 2] {
    [host("RN"), robot("OK")]
}

#[test]
fn a_stop_that_the_host_has_asked_for_is_no_unasked_one() {
    let after = |command: &str, answer: &str| {
        let stop = [host(command), robot(answer)];
        heard(&[start(), stop, status(), status()].concat())
    };
    for command in ["SP", "BR", "EC,BREAK", "RS,CYC", "SL,A", "DO,R = 1"] {
        assert_eq!(after(command, "OK"), None, "{command}");
        // A refused one has stopped nothing.
        assert_eq!(after(command, "NG").as_deref(), Some("never"), "{command}");
    }
    assert_eq!(after("OV,50", "OK").as_deref(), Some("never"));
}

#[test]
fn a_new_connection_is_judged_afresh() {
    let bare = [Host("VR\r\x03".to_owned()), robot("OK")];
    let told = [start().to_vec(), vec![robot("SP")], status().to_vec()].concat();
    let same = [&bare[..], &told].concat();
    assert_eq!(heard(&same).as_deref(), Some("to every host"));
    // The host of the new connection sends STX: that it is told says nothing about others.
    let other = [&bare[..], &[Again], &told].concat();
    assert_eq!(heard(&other), None);

    let untold = [status(), status()].concat();
    let same = [&start()[..], &untold].concat();
    assert_eq!(heard(&same).as_deref(), Some("never"));
    // While nobody was connected the stop could not be told.
    let other = [&start()[..], &[Again], &untold].concat();
    assert_eq!(heard(&other), None);
}
