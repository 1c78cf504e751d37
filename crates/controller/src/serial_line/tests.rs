//! Tests of a direction in time, and of the words about settings.

use super::direction::{Arrival, receive_unpaced};
use super::*;
use core::time::Duration;

fn line(speed: u32, length: u8, parity: Parity, stop: u8) -> SerialSettings {
    SerialSettings {
        speed,
        length,
        parity,
        stop,
    }
}

fn plain() -> SerialSettings {
    line(9_600, 8, Parity::None, 1)
}

/// Everything that passes, taken at its deadlines.
fn drain(direction: &mut Direction, own: SerialSettings) -> (Vec<Arrival>, u32) {
    let (mut arrivals, mut wakes) = (Vec::new(), 0);
    while let Some(due) = direction.deadline(own) {
        wakes += 1;
        arrivals.extend(direction.take(due, own));
    }
    (arrivals, wakes)
}

#[test]
fn ten_thousand_characters_take_what_the_line_takes_to_the_microsecond() {
    for (settings, bits) in [
        (plain(), 10),
        (line(9_600, 8, Parity::Even, 2), 12),
        (line(1_200, 7, Parity::None, 1), 9),
        (line(115_200, 8, Parity::None, 1), 10),
    ] {
        let mut direction = Direction::default();
        let start = Time::from_micros(17);
        let (begin, end) = direction.push(start, &[b'x'; 10_000], settings);
        let expected = (10_000 * bits * 1_000_000_u64).div_ceil(u64::from(settings.speed));
        assert_eq!((begin, end), (start, Time::from_micros(17 + expected)));
        let (arrivals, wakes) = drain(&mut direction, settings);
        assert_eq!(arrivals.len(), 10_000);
        assert_eq!(arrivals.last().map(|arrival| arrival.end), Some(end));
        assert_eq!(wakes, 625, "sixteen at once");
        let tenth = &arrivals[9];
        let bit =
            |count: u64| Time::from_micros(17 + (count * 1_000_000).div_ceil(u64::from(settings.speed)));
        assert_eq!((tenth.begin, tenth.end), (bit(9 * bits), bit(10 * bits)));
    }
}

#[test]
fn ends_of_texts_and_values_pass_at_their_own_time() {
    let mut direction = Direction::default();
    direction.push(Time::ZERO, b"\x02SU\r\x03\x07\x02EC,1\r\x03abc", plain());
    let mut parts = Vec::new();
    while let Some(due) = direction.deadline(plain()) {
        let taken = direction.take(due, plain());
        assert_eq!(taken.last().map(|arrival| arrival.end), Some(due));
        parts.push(
            taken
                .iter()
                .map(|arrival| arrival.character.byte)
                .collect::<Vec<u8>>(),
        );
    }
    let expected: [&[u8]; 8] = [
        b"\x02SU\r",
        b"\x03",
        b"\x07",
        b"\x02EC,",
        b"1\r",
        b"\x03",
        b"a",
        b"bc",
    ];
    assert_eq!(parts, expected);
}

#[test]
fn bytes_handed_over_late_start_late_and_early_ones_follow() {
    let mut direction = Direction::default();
    let character = Duration::from_micros(1_042);
    let (_, end) = direction.push(Time::ZERO, b"a", plain());
    assert_eq!(end, Time::ZERO + character);
    let (begin, _) = direction.push(Time::from_micros(500), b"b", plain());
    assert_eq!(begin, end, "behind the one under way");
    assert_eq!(drain(&mut direction, plain()).0.len(), 2);
    let later = Time::from_millis(1_000);
    let (begin, end) = direction.push(later, b"c", plain());
    assert_eq!((begin, end), (later, later + character));
}

#[test]
fn each_byte_has_the_settings_it_was_handed_over_with() {
    let fast = line(19_200, 8, Parity::None, 1);
    let mut direction = Direction::default();
    direction.push(Time::ZERO, &[b'a'; 96], plain());
    let (begin, end) = direction.push(Time::ZERO, &[b'b'; 192], fast);
    assert_eq!(begin, Time::from_millis(100));
    assert_eq!(end, Time::from_millis(200));
    assert_eq!(direction.drained_to_at(192), begin);
    assert_eq!(direction.drained_to_at(96), Time::from_millis(150));
    let (arrivals, _) = drain(&mut direction, plain());
    assert_eq!(
        arrivals.last().map(|arrival| arrival.end),
        Some(Time::from_millis(200))
    );
    let clean = arrivals
        .iter()
        .take_while(|arrival| arrival.character.byte == b'a')
        .count();
    assert_eq!(clean, 96);
    assert!(
        arrivals[clean..]
            .iter()
            .all(|arrival| arrival.character.byte != b'b'),
        "{:?}",
        &arrivals[clean..]
    );
}

#[test]
fn a_character_that_has_begun_cannot_be_purged() {
    let mut direction = Direction::default();
    direction.push(Time::ZERO, b"abc", plain());
    direction.purge(Time::from_micros(10));
    assert_eq!(direction.queued(), 1);
    assert_eq!(drain(&mut direction, plain()).0[0].character.byte, b'a');
    let later = Time::from_millis(10);
    direction.push(later, b"abc", plain());
    direction.purge(later);
    assert_eq!((direction.queued(), direction.deadline(plain())), (0, None));
    direction.push(later, b"d", plain());
    assert_eq!(drain(&mut direction, plain()).0[0].character.byte, b'd');
}

#[test]
fn paced_or_at_once_the_same_is_read() {
    let text = b"\x02SU\r\x03\x02EC,OVRD=50\r\x03";
    for sender in [
        plain(),
        line(9_600, 8, Parity::Odd, 1),
        line(4_800, 7, Parity::Even, 2),
    ] {
        let mut direction = Direction::default();
        direction.push(Time::ZERO, text, sender);
        let (arrivals, _) = drain(&mut direction, plain());
        let paced: Vec<_> = arrivals
            .iter()
            .map(|arrival| (arrival.character.byte, arrival.character.fault))
            .collect();
        let at_once: Vec<_> = receive_unpaced(text, sender, plain())
            .iter()
            .map(|character| (character.byte, character.fault))
            .collect();
        assert_eq!(paced, at_once, "{sender:?}");
    }
}

#[test]
fn a_pause_shorter_than_the_receivers_character_ends_it() {
    // The receiver expects a parity: its stop bit is read in the pause, half a bit behind the sender's end.
    let own = line(9_600, 8, Parity::Even, 1);
    let mut direction = Direction::default();
    let (_, end) = direction.push(Time::ZERO, b"\r", plain());
    let mut arrivals = direction.take(end, own);
    direction.push(end + Duration::from_micros(80), b"\r", plain());
    arrivals.extend(drain(&mut direction, own).0);
    let read: Vec<_> = arrivals
        .iter()
        .map(|arrival| (arrival.character.byte, arrival.character.fault))
        .collect();
    assert_eq!(read, [(b'\r', None), (b'\r', None)]);
    // Without the pause the next start bit stands there.
    let run_on = receive_unpaced(b"\r\r", plain(), own);
    assert_eq!(run_on[0].fault, Some(uart::CharacterError::Framing));
}

#[test]
fn what_differs_is_said_with_both_remedies() {
    let host = HostSettings {
        speed: Some(19_200),
        parity: Some(Parity::Odd),
        ..HostSettings::default()
    };
    assert_eq!(
        host.difference("HOST", plain()).unwrap(),
        "speed: [U06] says 9600 bps, the host opened the port with 19200 bps; parity: [U06] says no parity, the host \
         opened the port with odd parity; the bytes arrive garbled. Open the host's port with 9600 bps, 8 bits, no \
         parity, 1 stop bit, or set {HOST} = 19200 8 1 1 in [U06] of USER.PAR and switch the power off and on"
    );
    assert_eq!(HostSettings::default().difference("HOST", plain()), None);
    let same = HostSettings {
        speed: Some(plain().speed),
        length: Some(plain().length),
        parity: Some(plain().parity),
        stop: Some(plain().stop),
    };
    assert_eq!(same.difference("HOST", plain()), None);
    let stop = HostSettings {
        stop: Some(2),
        ..HostSettings::default()
    };
    assert!(
        stop.difference("COM1", plain())
            .unwrap()
            .contains("first stop bit")
    );
}

#[test]
fn settings_no_port_can_have_count_as_unknown() {
    let host = HostSettings {
        speed: Some(0),
        length: Some(9),
        parity: None,
        stop: Some(0),
    };
    assert_eq!(host.or_robot(plain()), plain());
}
