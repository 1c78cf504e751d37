//! The dialogues of the options that are about texts and bytes on the wire.

use super::{received, shown, with_host};
use ts3100_controller::Port;
use ts3100_tests::{Robot, frame};

pub(super) fn command_without_etx(robot: &mut Robot) -> String {
    let at_once = received(robot, Port::Ip0, b"SP\r");
    robot.advance_ms(250);
    format!("{at_once}, after 250 ms {}", shown(&robot.received(Port::Ip0)))
}

pub(super) fn text_and_one_byte(robot: &mut Robot) -> String {
    let text = frame(b"SP\r");
    let first = received(robot, Port::Ip0, &text);
    let sum = text[1..].iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    format!("{first}, then {}", received(robot, Port::Ip0, &[sum]))
}

pub(super) fn second_text_after_10_ms(robot: &mut Robot) -> String {
    robot.command(Port::Ip0, "SP");
    robot.advance_ms(10);
    received(robot, Port::Ip0, &frame(b"SP\r"))
}

pub(super) fn answer_of_host_at_once(robot: &mut Robot) -> String {
    with_host(robot);
    received(robot, Port::Host, &frame(b"SP\r"))
}

pub(super) fn text_while_the_robot_sends(robot: &mut Robot) -> String {
    with_host(robot);
    robot.raw(Port::Host, &[frame(b"SP\r"), frame(b"SP\r")].concat());
    robot.advance_ms(1_000);
    match robot
        .received(Port::Host)
        .iter()
        .filter(|byte| **byte == 3)
        .count()
    {
        1 => "1 answer".to_string(),
        count => format!("{count} answers"),
    }
}

pub(super) fn first_text_of_sf(robot: &mut Robot) -> String {
    robot.send(Port::Ip0, b"SF\r");
    format!("{} bytes", robot.received(Port::Ip0).len())
}
