//! Tests of the UART: what every pair of settings makes of every byte.

use super::*;

fn line(speed: u32, length: u8, parity: Parity, stop: u8) -> SerialSettings {
    SerialSettings {
        speed,
        length,
        parity,
        stop,
    }
}

/// Characters that a receiver reads of bytes sent without a pause, on a line that is idle before and after them.
fn through(sender: SerialSettings, own: SerialSettings, bytes: &[u8]) -> Vec<Character> {
    let mut receiver = Receiver::new(sender, own);
    let mut read = Vec::new();
    for &byte in bytes {
        receiver.receive(byte, &mut read);
    }
    receiver.flush(&mut read);
    read
}

/// The same without the short way for ends that agree.
fn sampled(sender: SerialSettings, bytes: &[u8]) -> Vec<Character> {
    let mut receiver = Receiver::new(sender, sender);
    let mut read = Vec::new();
    for &byte in bytes {
        for level in levels(sender, byte) {
            receiver.advance(level, 2 * u64::from(sender.speed), &mut read);
        }
    }
    receiver.flush(&mut read);
    read
}

fn good(byte: u8) -> Character {
    Character { byte, fault: None }
}

fn every_line() -> Vec<SerialSettings> {
    let mut lines = Vec::new();
    for speed in [1_200, 9_600, 115_200] {
        for length in [7, 8] {
            for parity in [Parity::None, Parity::Odd, Parity::Even] {
                lines.extend([1, 2].map(|stop| line(speed, length, parity, stop)));
            }
        }
    }
    lines
}

// clause: SER-01 SER-02 SER-10
#[test]
fn ends_that_agree_carry_every_byte_that_the_length_lets_through() {
    let bytes: Vec<u8> = (0..=255).collect();
    for settings in every_line() {
        let expected: Vec<Character> = bytes.iter().map(|byte| good(byte & mask(settings))).collect();
        assert_eq!(through(settings, settings, &bytes), expected, "{settings:?}");
        assert_eq!(sampled(settings, &bytes), expected, "{settings:?} at bit level");
    }
}

#[test]
fn a_character_has_the_bits_of_its_settings() {
    assert_eq!(frame_bits(line(9_600, 8, Parity::None, 1)), 10);
    assert_eq!(frame_bits(line(9_600, 8, Parity::Even, 2)), 12);
    assert_eq!(frame_bits(line(9_600, 7, Parity::None, 1)), 9);
    let levels: Vec<bool> = levels(line(9_600, 7, Parity::Odd, 2), b'A').collect();
    let expected = [0, 1, 0, 0, 0, 0, 0, 1, 1, 1, 1].map(|bit| bit == 1);
    assert_eq!(
        levels, expected,
        "start, 41 hex from below, odd parity, two stop bits"
    );
}

#[test]
fn a_wrong_parity_is_an_error_of_every_character() {
    let (even, odd) = (line(9_600, 8, Parity::Even, 1), line(9_600, 8, Parity::Odd, 1));
    let read = through(even, odd, b"\x02SU\r\x03");
    assert_eq!(read.len(), 5);
    for (character, byte) in read.iter().zip(b"\x02SU\r\x03") {
        assert_eq!(
            *character,
            Character {
                byte: *byte,
                fault: Some(CharacterError::Parity)
            }
        );
    }
}

#[test]
fn seven_even_read_as_eight_none_shows_the_parity_as_the_top_bit() {
    let (seven, eight) = (line(9_600, 7, Parity::Even, 1), line(9_600, 8, Parity::None, 1));
    // S has four ones, U four, CR three.
    assert_eq!(
        through(seven, eight, b"SU\r"),
        [good(b'S'), good(b'U'), good(b'\r' | 0x80)]
    );
    // The other way round the top bit, 0 here, is taken for the parity.
    assert_eq!(
        through(eight, seven, b"S\r"),
        [
            good(b'S'),
            Character {
                byte: b'\r',
                fault: Some(CharacterError::Parity)
            }
        ]
    );
}

#[test]
fn eight_bits_without_parity_read_as_eight_with_parity_take_the_stop_bit_for_it() {
    let (none, even) = (line(9_600, 8, Parity::None, 1), line(9_600, 8, Parity::Even, 1));
    // One character alone: its stop bit is read as parity, the idle line as stop bit.
    assert_eq!(
        through(none, even, b"\r"),
        [good(b'\r')],
        "three ones and a one that is the stop bit"
    );
    assert_eq!(through(none, even, b"S")[0].fault, Some(CharacterError::Parity));
    // Without a pause the start bit of the next stands where the stop bit is expected.
    let read = through(none, even, b"SUSU");
    assert_eq!(read[0].fault, Some(CharacterError::Framing));
}

#[test]
fn a_sender_half_as_fast_makes_two_characters_or_errors_of_one() {
    let (slow, fast) = (line(4_800, 8, Parity::None, 1), line(9_600, 8, Parity::None, 1));
    // 55 hex alternates, start bit included: 0 1 0 1 ... each two bits long for the receiver.
    let read = through(slow, fast, b"U");
    assert_eq!(read.len(), 2, "{read:?}");
    assert_eq!(read[0].byte, 0b0110_0110);
    assert!(read.iter().all(|character| character.byte != b'U'));
    let quick = through(fast, slow, b"UUUU");
    assert!(
        quick.len() < 4 && quick.iter().all(|character| character.byte != b'U'),
        "{quick:?}"
    );
}

#[test]
fn far_too_fast_a_sender_is_next_to_nothing() {
    let (slow, fast) = (line(1_200, 8, Parity::None, 1), line(115_200, 8, Parity::None, 1));
    let read = through(fast, slow, b"\x02SU\r\x03");
    // 435 microseconds, a glitch of half a bit.
    assert!(read.len() <= 1, "{read:?}");
    assert!(read.iter().all(|character| character.byte == 0xFF), "{read:?}");
    // A long text is a few characters that have nothing to do with it.
    let text: Vec<u8> = (0..96).flat_map(|_| *b"PRINT \"X\"\r").collect();
    let read = through(fast, slow, &text);
    assert!((1..=11).contains(&read.len()), "{}", read.len());
}

#[test]
fn a_line_that_stays_low_is_one_error_until_it_rises() {
    let own = line(9_600, 8, Parity::None, 1);
    let mut receiver = Receiver::new(own, own);
    let mut read = Vec::new();
    receiver.advance(false, 2 * 9_600 * 100, &mut read);
    assert_eq!(
        read,
        [Character {
            byte: 0,
            fault: Some(CharacterError::Framing)
        }]
    );
    receiver.advance(true, 2 * 9_600, &mut read);
    receiver.receive(b'A', &mut read);
    assert_eq!(read[1..], [good(b'A')]);
}

#[test]
fn less_than_half_a_bit_is_no_start() {
    let own = line(9_600, 8, Parity::None, 1);
    let mut receiver = Receiver::new(own, own);
    let mut read = Vec::new();
    receiver.advance(false, 9_600 - 1, &mut read);
    receiver.flush(&mut read);
    assert!(read.is_empty() && !receiver.is_busy());
}

#[test]
fn only_the_stop_bits_may_differ() {
    let bytes: Vec<u8> = (0..=255).collect();
    for sender in every_line() {
        for own in every_line() {
            let same = SerialSettings {
                stop: own.stop,
                ..sender
            } == own;
            let expected: Vec<Character> = bytes.iter().map(|byte| good(byte & mask(own))).collect();
            assert_eq!(
                through(sender, own, &bytes) == expected,
                same,
                "{sender:?} {own:?}"
            );
        }
    }
}

#[test]
fn a_receiver_inside_a_character_has_taken_fewer_bits_than_the_character_has() {
    // Start bit, data bits, parity bit, first stop bit.
    for (own, bits) in [
        (line(9_600, 8, Parity::None, 2), 10),
        (line(9_600, 7, Parity::Even, 1), 10),
        (line(9_600, 7, Parity::None, 1), 9),
    ] {
        let is_valid = |taken| {
            let state = ReceiverState::Frame {
                left: 1,
                taken,
                bits: 0,
            };
            Receiver {
                state,
                ..Receiver::new(own, own)
            }
            .is_valid()
        };
        assert!(is_valid(bits - 1), "{own:?}");
        assert!(!is_valid(bits), "{own:?}");
    }
}

#[test]
fn a_slow_receiver_ends_its_character_in_the_pause_of_a_fast_sender() {
    let mut receiver = Receiver::new(line(9_600, 8, Parity::None, 1), line(1_200, 8, Parity::None, 1));
    let mut read = Vec::new();
    // The byte is over after 1.042 ms; the stop bit at 1200 bps is sampled after 9.5 bits, 7.917 ms.
    receiver.receive(0, &mut read);
    receiver.idle_for(6_870, &mut read);
    assert!(receiver.is_busy() && read.is_empty());
    receiver.idle_for(10, &mut read);
    let (byte, fault) = (0xFF, None);
    assert_eq!(read, [Character { byte, fault }]);
}
