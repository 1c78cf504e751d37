//! What a host that has gone left on the line, and the next host.

use super::{paced, received, usual};
use ts3100_controller::{Event, KeySwitch, Output, PanelAction, Port};
use ts3100_tests::{Robot, frame};

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

/// A running program, with the rest of a text without STX on the line of a host that has gone.
fn running_while_a_host_leaves(sp: Option<bool>) -> Robot {
    let mut robot = paced("9600 8 0 1", |options| options.unsolicited_sp = sp.into());
    robot.load("P", "PROGRAM P\nAGAIN:\nGOTO AGAIN\nEND\n");
    robot.panel(PanelAction::Servo(true));
    robot.panel(PanelAction::Start);
    // Of the first text the robot knows that this host polls; the second is still on the line.
    robot.raw(Port::Host, b"XX\r\x03");
    robot.advance_ms(100);
    assert_eq!(robot.received(Port::Host), b"NG\r\x03");
    robot.raw(Port::Host, b"RS,STP\r\x03");
    robot.disconnect(Port::Host);
    robot
}

// clause: CMD-SP-05
#[test]
fn a_stop_is_told_to_the_next_host_though_bytes_of_the_one_before_are_still_on_the_line() {
    let stop = || PanelAction::Key(KeySwitch::Teaching);
    for (sp, expected) in [
        (None, frame(b"SP\r")),
        (Some(true), frame(b"SP\r")),
        (Some(false), Vec::new()),
    ] {
        let mut robot = running_while_a_host_leaves(sp);
        robot.connect(Port::Host);
        robot.panel(stop());
        robot.advance_ms(200);
        assert_eq!(robot.received(Port::Host), expected, "{sp:?}");
    }
    // Nobody is connected at the stop.
    let mut robot = running_while_a_host_leaves(Some(true));
    robot.panel(stop());
    robot.connect(Port::Host);
    robot.advance_ms(500);
    assert_eq!(robot.received(Port::Host), b"");
    // Another host takes its place.
    for leaves in [true, false] {
        let mut robot = running_while_a_host_leaves(Some(true));
        robot.connect(Port::Host);
        robot.panel(stop());
        if leaves {
            robot.disconnect(Port::Host);
        }
        robot.connect(Port::Host);
        robot.advance_ms(500);
        assert_eq!(robot.received(Port::Host), b"", "{leaves}");
    }
    // A start comes first: the stop after it has the only SP.
    let mut robot = running_while_a_host_leaves(Some(true));
    robot.connect(Port::Host);
    robot.panel(PanelAction::Stop);
    robot.panel(PanelAction::Start);
    robot.advance_ms(500);
    assert_eq!(robot.received(Port::Host), b"");
    robot.panel(stop());
    robot.advance_ms(200);
    assert_eq!(robot.received(Port::Host), frame(b"SP\r"));
}
