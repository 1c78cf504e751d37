//! What a host that has gone left on the line, and the next host.

use super::{received, usual};
use ts3100_controller::{Event, Output, Port};
use ts3100_tests::frame;

#[test]
fn a_long_rest_of_a_host_that_has_gone_does_not_keep_the_next_one_waiting() {
    // Half a second of characters passes first; more is dropped. The host's last command is at their end.
    for (length, is_served) in [(300, true), (1_000, false), (4_000, false)] {
        let mut robot = usual();
        robot.raw(Port::Host, &[vec![b'x'; length], frame(b"SO\r")].concat());
        robot.advance_ms(3);
        robot.disconnect(Port::Host);
        robot.connect(Port::Host);
        robot.advance_ms(if is_served { 500 } else { 2 });
        let servo = Output::Event(Event::Servo(true));
        assert_eq!(robot.outputs.contains(&servo), is_served, "{length}");
        assert_eq!(robot.seat.controller.peer(Port::Host), Some("suite"), "{length}");
        robot.send(Port::Host, b"SU\r");
        assert!(received(&mut robot).starts_with(b"\x02FL,MODE:"), "{length}");
    }
}

#[test]
fn an_answer_ends_with_its_host_though_bytes_of_that_host_are_still_on_the_line() {
    let mut robot = usual();
    robot.send(Port::Host, b"CA\r");
    robot.advance_ms(20);
    assert!(robot.received(Port::Host).starts_with(b"\x02FL,"));
    robot.raw(Port::Host, &[b'x'; 10]);
    robot.disconnect(Port::Host);
    robot.connect(Port::Host);
    // The answer would take a quarter of a second more. The half-duplex line is free for the next host.
    robot.send(Port::Host, b"SU\r");
    assert!(received(&mut robot).starts_with(b"\x02FL,MODE:"));
}
