//! Fuzzes a whole controller that runs a program: after a zero byte the choices for records, signals, keys, stops,
//! starts, feed hold, commands and time.
//!
//! The controller never panics, never hangs, and answers SU of a new host. `protocol.rs` stresses the ports instead.
use super::shared::{Robot, text_and_choices};
use ts3100_controller::{Input, PanelAction, Time};

/// Events of one run.
const EVENTS: u32 = 200;

pub fn check(data: &[u8]) {
    let (source, mut choices) = text_and_choices(data);
    let mut robot = Robot::new(true);
    if robot.seat.controller.put_file("TEST", source.as_bytes()).is_err() {
        return;
    }
    if robot.seat.controller.select(Time::ZERO, "TEST").is_err() {
        return;
    }
    let mode = ["CYC", "CONT", "STEP", "SEG"][usize::from(choices.byte() % 4)];
    let text = format!("\x02EC,MODE {mode}\r\x03").into_bytes();
    let port = ts3100_controller::Port::Ip0;
    let answer = robot.feed_and_collect(Input::received(port, text));
    assert_eq!(answer, b"\x02OK\r\x03", "a mode is set while the robot stands");
    robot.feed(Input::by_hand(PanelAction::Start));
    robot.advance(50);
    for _ in 0..EVENTS {
        if choices.is_empty() {
            break;
        }
        robot.act(&mut choices);
    }
    robot.advance(2_000);
    robot.new_host();
    let status = robot.ask("SU");
    assert!(status.starts_with(b"FL,MODE:"), "{}", status.escape_ascii());
}
