//! Tests of the access server: what each command of a client comes to, and what is answered.

use super::*;

const ROBOT: SerialSettings = SerialSettings {
    speed: 9_600,
    length: 8,
    parity: Parity::None,
    stop: 1,
};

fn server() -> Server {
    Server::new(ROBOT)
}

fn data(command: u8, value: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    subnegotiate(COM_PORT, &[&[command], value].concat(), &mut bytes);
    bytes
}

/// Events of a command, and its answer.
fn ask(server: &mut Server, command: u8, value: &[u8]) -> (Vec<Event>, Vec<u8>) {
    let events = server.receive(&data(command, value));
    (events, server.take_output())
}

fn settings(change: impl Fn(&mut HostSettings)) -> Vec<Event> {
    let mut settings = HostSettings::default();
    change(&mut settings);
    vec![Event::Settings(settings)]
}

#[test]
fn options_are_agreed_on_once_and_others_refused() {
    let mut server = server();
    let mut bytes = Vec::new();
    for option in [BINARY, SUPPRESS_GO_AHEAD, COM_PORT] {
        negotiate(DO, option, &mut bytes);
    }
    assert!(server.receive(&bytes).is_empty());
    let mut expected = Vec::new();
    for option in [BINARY, SUPPRESS_GO_AHEAD, COM_PORT] {
        negotiate(WILL, option, &mut expected);
    }
    assert_eq!(server.take_output(), expected);
    server.receive(&bytes);
    assert_eq!(server.take_output(), b"", "said already");
    let echo = 1;
    for (verb, answer) in [(DO, WONT), (WILL, DONT)] {
        server.receive(&[255, verb, echo]);
        assert_eq!(server.take_output(), [255, answer, echo]);
    }
    server.receive(&[255, DONT, echo]);
    assert_eq!(server.take_output(), b"");
    server.receive(&[255, DONT, BINARY]);
    assert_eq!(server.take_output(), [255, WONT, BINARY]);
}

#[test]
fn a_client_with_com_port_option_is_told_that_it_may_send() {
    let mut server = server();
    server.receive(&[255, WILL, COM_PORT]);
    let expected = [vec![255, DO, COM_PORT], data(107, &[0xB0])].concat();
    assert_eq!(server.take_output(), expected);
}

#[test]
fn settings_are_taken_answered_and_told() {
    let mut server = server();
    let asked = ask(&mut server, SET_BAUDRATE, &[0, 0, 0, 0]);
    assert_eq!(
        asked,
        (vec![], data(101, &9_600_u32.to_be_bytes())),
        "the robot's"
    );
    assert_eq!(
        ask(&mut server, SET_BAUDRATE, &19_200_u32.to_be_bytes()),
        (
            settings(|s| s.speed = Some(19_200)),
            data(101, &19_200_u32.to_be_bytes())
        )
    );
    let mut server = Server::new(ROBOT);
    assert_eq!(
        ask(&mut server, SET_DATASIZE, &[7]),
        (settings(|s| s.length = Some(7)), data(102, &[7]))
    );
    let mut server = Server::new(ROBOT);
    assert_eq!(
        ask(&mut server, SET_PARITY, &[3]),
        (settings(|s| s.parity = Some(Parity::Even)), data(103, &[3]))
    );
    assert_eq!(ask(&mut server, SET_PARITY, &[0]), (vec![], data(103, &[3])));
    let mut server = Server::new(ROBOT);
    assert_eq!(
        ask(&mut server, SET_STOPSIZE, &[2]),
        (settings(|s| s.stop = Some(2)), data(104, &[2]))
    );
}

#[test]
fn what_no_robot_line_has_is_answered_by_what_holds() {
    let mut server = server();
    for (command, value, holds) in [
        (SET_DATASIZE, 9, 8),
        (SET_DATASIZE, 4, 8),
        (SET_PARITY, 4, 1),
        (SET_PARITY, 5, 1),
        (SET_STOPSIZE, 3, 1),
    ] {
        assert_eq!(
            ask(&mut server, command, &[value]),
            (vec![], data(command + ANSWER, &[holds]))
        );
    }
    let speed = ask(&mut server, SET_BAUDRATE, &u32::MAX.to_be_bytes());
    assert_eq!(speed, (vec![], data(101, &9_600_u32.to_be_bytes())));
    // In no form of the RFC: not answered.
    for (command, value) in [
        (SET_BAUDRATE, &[1, 2][..]),
        (SET_PARITY, &[]),
        (99, &[1]),
        (PURGE_DATA, &[4]),
    ] {
        assert_eq!(ask(&mut server, command, value), (vec![], vec![]), "{command}");
    }
    assert!(server.receive(&[255, 250, COM_PORT, 255, 240]).is_empty());
}

#[test]
fn control_purge_masks_and_flow() {
    let mut server = server();
    for (value, answer) in [
        (0, 1), // no flow control
        (3, 3),
        (0, 3),
        (13, 14),
        (16, 16),
        (13, 16),
        (7, 8), // DTR on
        (9, 9),
        (7, 9),
        (8, 8),
        (12, 12),
        (10, 12),
        (4, 6), // no break
    ] {
        assert_eq!(
            ask(&mut server, SET_CONTROL, &[value]),
            (vec![], data(105, &[answer])),
            "{value}"
        );
    }
    assert_eq!(
        ask(&mut server, SET_CONTROL, &[5]),
        (vec![Event::Break], data(105, &[5]))
    );
    assert_eq!(
        ask(&mut server, SET_CONTROL, &[5]),
        (vec![], data(105, &[5])),
        "held already"
    );
    assert_eq!(ask(&mut server, SET_CONTROL, &[6]), (vec![], data(105, &[6])));
    assert_eq!(ask(&mut server, PURGE_DATA, &[1]).0, [Event::PurgeToClient]);
    assert_eq!(
        ask(&mut server, PURGE_DATA, &[3]),
        (vec![Event::PurgeToClient, Event::PurgeToRobot], data(112, &[3]))
    );
    assert_eq!(
        ask(&mut server, FLOWCONTROL_SUSPEND, &[]),
        (vec![Event::Suspended(true)], vec![])
    );
    assert_eq!(
        ask(&mut server, FLOWCONTROL_RESUME, &[]),
        (vec![Event::Suspended(false)], vec![])
    );
    let linestate = [data(110, &[0xFF]), data(106, &[0x60])].concat();
    assert_eq!(ask(&mut server, SET_LINESTATE_MASK, &[0xFF]), (vec![], linestate));
    assert_eq!(ask(&mut server, SET_LINESTATE_MASK, &[0]).1, data(110, &[0]));
    let modem = [data(111, &[0x10]), data(107, &[0x10])].concat();
    assert_eq!(ask(&mut server, SET_MODEMSTATE_MASK, &[0x10]), (vec![], modem));
    assert_eq!(ask(&mut server, SIGNATURE, &[]).1, data(100, b"ts3100"));
    assert_eq!(
        ask(&mut server, SIGNATURE, b"the client").1,
        b"",
        "its own is noted by nobody"
    );
}

#[test]
fn data_keeps_its_place_among_the_settings_and_255_is_a_byte() {
    let mut server = server();
    let bytes = [
        b"a".to_vec(),
        data(SET_BAUDRATE, &1_200_u32.to_be_bytes()),
        vec![255, 255],
    ]
    .concat();
    let events = server.receive(&bytes);
    assert_eq!(events[0], Event::Data(b"a".to_vec()));
    assert!(matches!(events[1], Event::Settings(_)));
    assert_eq!(events[2], Event::Data(vec![255]));
    server.take_output();
    server.send(&[1, 255, 2]);
    assert_eq!(server.take_output(), [1, 255, 255, 2]);
}
