//! Texts under noise, cuts and truncation. A small generator of our own makes the random streams.

use super::*;
use alloc::vec;

mod ends;

const STX_ONLY: TextOptions = TextOptions {
    stx: StxRule::Required,
    end: EndRule::Etx,
    checksum: Checksum::None,
};
const DETECT: TextOptions = TextOptions {
    stx: StxRule::Detect,
    end: EndRule::Etx,
    checksum: Checksum::None,
};
const SUMMED: TextOptions = TextOptions {
    stx: StxRule::Detect,
    end: EndRule::Etx,
    checksum: Checksum::Sum,
};

fn text(framing: Framing, data: &[u8]) -> Decoded {
    Decoded::Text(Text {
        framing,
        data: Bytes::copy_from_slice(data),
        terminator: Terminator::Etx,
        error: None,
    })
}

fn faulty(framing: Framing, data: &[u8], fault: TextError) -> Decoded {
    Decoded::Text(Text {
        framing,
        data: Bytes::copy_from_slice(data),
        terminator: Terminator::Etx,
        error: Some(fault),
    })
}

#[test]
fn a_decoder_is_valid_in_each_state_that_it_reaches_and_for_its_own_options_alone() {
    for end in [EndRule::Etx, EndRule::Cr, EndRule::Detect] {
        let options = TextOptions { end, ..DETECT };
        let mut decoder = TextDecoder::new(options);
        assert!(decoder.is_valid(options), "{end:?}");
        for byte in *b"\x02SU\r\x03SU\r\x03SU\r\x02SU\r?\x03" {
            decoder.push(&[byte]);
            drain(&mut decoder);
            assert!(decoder.is_valid(options), "{end:?} {decoder:?}");
            assert!(!decoder.is_valid(TextOptions { end, ..SUMMED }), "{end:?}");
        }
    }
}

fn skipped(bytes: usize) -> Decoded {
    Decoded::Skipped { bytes }
}

fn drain(decoder: &mut TextDecoder) -> Vec<Decoded> {
    core::iter::from_fn(|| decoder.next()).collect()
}

fn decode(options: TextOptions, bytes: &[u8]) -> Vec<Decoded> {
    let mut decoder = TextDecoder::new(options);
    decoder.push(bytes);
    drain(&mut decoder)
}

/// Neighbouring gaps as one: where a stream is cut may cut its gaps, nothing else.
fn joined(found: Vec<Decoded>) -> Vec<Decoded> {
    let mut list: Vec<Decoded> = Vec::new();
    for one in found {
        match (list.last_mut(), &one) {
            (Some(Decoded::Skipped { bytes: sum }), Decoded::Skipped { bytes }) => *sum += bytes,
            _ => list.push(one),
        }
    }
    list
}

fn in_pieces<'a>(options: TextOptions, pieces: impl Iterator<Item = &'a [u8]>) -> Vec<Decoded> {
    let mut decoder = TextDecoder::new(options);
    let mut found = Vec::new();
    for piece in pieces {
        decoder.push(piece);
        found.extend(drain(&mut decoder));
    }
    joined(found)
}

/// xorshift64: enough to shuffle bytes, the same on every run.
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 % u64::try_from(limit).unwrap()).unwrap()
    }
}

// clause: FRM-01 FRM-09
#[test]
fn texts_with_stx() {
    assert_eq!(decode(STX_ONLY, b"\x02SU\r\x03"), [text(Framing::Stx, b"SU\r")]);
    assert_eq!(decode(DETECT, b"\x02SU\r\x03"), [text(Framing::Stx, b"SU\r")]);
    assert_eq!(decode(DETECT, b"\x02\x03"), [text(Framing::Stx, b"")]);
    assert_eq!(
        encode_text(b"OK\r", Framing::Stx, Checksum::None),
        b"\x02OK\r\x03"
    );
}

// clause: FRM-16
#[test]
fn texts_without_stx_where_they_are_allowed() {
    assert_eq!(
        decode(DETECT, b"SO\r\x03\x02SU\r\x03\x1a\x03"),
        [
            text(Framing::Bare, b"SO\r"),
            text(Framing::Stx, b"SU\r"),
            text(Framing::Bare, b"\x1a")
        ]
    );
    assert_eq!(decode(STX_ONLY, b"SO\r\x03"), [skipped(4)]);
    assert_eq!(encode_text(b"OK\r", Framing::Bare, Checksum::None), b"OK\r\x03");
}

// clause: FRM-04
#[test]
fn noise_and_restarts_are_skipped() {
    for options in [STX_ONLY, DETECT] {
        let found = decode(options, b"\x58\x59\x02SU\r\x03");
        assert_eq!(found, [skipped(2), text(Framing::Stx, b"SU\r")]);
        let found = decode(options, b"\x02S\x02SU\r\x03");
        assert_eq!(found, [skipped(2), text(Framing::Stx, b"SU\r")]);
        let found = decode(options, b"\x03\x03\x02\x02\x02CA\r\x03\x03");
        assert_eq!(
            joined(found),
            [skipped(4), text(Framing::Stx, b"CA\r"), skipped(1)]
        );
    }
}

// clause: FRM-02 FRM-03
#[test]
fn the_longest_text_and_one_byte_more() {
    let data = vec![b'A'; MAX_DATA + 1];
    for framing in [Framing::Stx, Framing::Bare] {
        let longest = encode_text(&data[..MAX_DATA], framing, Checksum::None);
        assert_eq!(
            longest.len(),
            if framing == Framing::Stx {
                MAX_TEXT
            } else {
                MAX_TEXT - 1
            }
        );
        assert_eq!(decode(DETECT, &longest), [text(framing, &data[..MAX_DATA])]);
        let mut wire = encode_text(&data, framing, Checksum::None);
        wire.extend_from_slice(b"\x02SU\r\x03");
        let fault = TextError::OverLong { length: MAX_DATA + 1 };
        let expected = [
            faulty(framing, &data[..MAX_DATA], fault),
            text(Framing::Stx, b"SU\r"),
        ];
        assert_eq!(decode(DETECT, &wire), expected);
    }
}

// clause: FRM-05
#[test]
fn every_cut_of_a_stream_gives_the_same_texts() {
    let stream =
        b"X\x02BR\r\x03\x02SU\r\x03SO\r\x03\x02S\x02MR,A 0\r\x03\x03\x02\x03FL,END\n\x1a\x03\x02rest";
    for options in [STX_ONLY, DETECT, SUMMED] {
        let whole = joined(decode(options, stream));
        assert_eq!(in_pieces(options, stream.chunks(1)), whole);
        for at in 0..=stream.len() {
            let (front, back) = stream.split_at(at);
            assert_eq!(
                in_pieces(options, [front, back].into_iter()),
                whole,
                "{options:?} cut at {at}"
            );
        }
    }
}

// clause: FRM-05 FRM-04
#[test]
fn every_truncation_is_partial_and_the_next_stx_recovers() {
    let wire = encode_text(b"MW,0 N1 0 42\r", Framing::Stx, Checksum::None);
    for length in 1..wire.len() {
        let mut decoder = TextDecoder::new(STX_ONLY);
        decoder.push(&wire[..length]);
        assert!(decoder.is_partial(), "asked before reading, {length}");
        assert_eq!(decoder.next(), None);
        assert!(decoder.is_partial());
        decoder.push(&wire);
        assert_eq!(
            drain(&mut decoder),
            [skipped(length), text(Framing::Stx, b"MW,0 N1 0 42\r")]
        );
        assert!(!decoder.is_partial());
    }
}

#[test]
fn asking_whether_a_text_is_under_way_reads_nothing_away() {
    let mut decoder = TextDecoder::new(DETECT);
    assert!(!decoder.is_partial());
    decoder.push(b"\x02SU\r\x03");
    assert!(!decoder.is_partial());
    decoder.push(b"\x02S");
    assert!(decoder.is_partial());
    assert_eq!(decoder.next(), Some(text(Framing::Stx, b"SU\r")));
    assert!(decoder.is_partial());
    assert_eq!(decoder.buffered(), 2);
    assert_eq!(decoder.give_up(), 2);
    assert!(!decoder.is_partial());
    decoder.push(b"\x03");
    assert_eq!(decoder.next(), Some(skipped(1)), "the rest of the text");
    assert_eq!(decoder, TextDecoder::new(DETECT));
}

// clause: FRM-15
#[test]
fn the_checksum_follows_etx() {
    let wire = encode_text(b"SU\r", Framing::Stx, Checksum::Sum);
    assert_eq!(wire, [0x02, 0x53, 0x55, 0x0D, 0x03, 0xB8]);
    assert_eq!(decode(SUMMED, &wire), [text(Framing::Stx, b"SU\r")]);
    let fault = TextError::BadSum {
        expected: 0xB8,
        found: 0xB9,
    };
    let found = decode(SUMMED, &[0x02, 0x53, 0x55, 0x0D, 0x03, 0xB9]);
    assert_eq!(found, [faulty(Framing::Stx, b"SU\r", fault)]);

    let mut decoder = TextDecoder::new(SUMMED);
    decoder.push(&wire[..5]);
    assert_eq!(decoder.next(), None);
    assert!(decoder.is_partial());
    assert_eq!(decoder.give_up(), 5);
}

// clause: FRM-15 FRM-03
#[test]
fn the_checksum_may_look_like_stx_and_covers_dropped_bytes() {
    let data = [0xFF];
    let wire = encode_text(&data, Framing::Bare, Checksum::Sum);
    assert_eq!(wire, [0xFF, ETX, STX]);
    assert_eq!(decode(SUMMED, &wire), [text(Framing::Bare, &data)]);
    let long = vec![0x55; 300];
    let mut wire = encode_text(&long, Framing::Stx, Checksum::Sum);
    wire.extend(encode_text(b"SU\r", Framing::Stx, Checksum::Sum));
    let fault = TextError::OverLong { length: 300 };
    assert_eq!(
        decode(SUMMED, &wire),
        [
            faulty(Framing::Stx, &long[..MAX_DATA], fault),
            text(Framing::Stx, b"SU\r")
        ]
    );
}

// clause: FRM-14
#[test]
fn without_checksum_nothing_follows_etx() {
    assert_eq!(
        encode_text(b"OK\r", Framing::Stx, TextOptions::default().checksum),
        b"\x02OK\r\x03"
    );
}

// clause: FRM-17
#[test]
fn a_binary_text_is_cut_by_length() {
    let data = [b"FL,\x02\x03\x0d\x1a\x03\x03".as_slice(), &[0xFF; 270], b"\x1a"].concat();
    for framing in [Framing::Stx, Framing::Bare] {
        let mut wire = encode_text(&data, framing, Checksum::None);
        wire.extend_from_slice(b"\x02OK\r\x03");
        for at in 0..=wire.len() {
            let mut decoder = TextDecoder::new(DETECT);
            decoder.expect_binary(data.len());
            decoder.push(&wire[..at]);
            let mut found = drain(&mut decoder);
            decoder.push(&wire[at..]);
            found.extend(drain(&mut decoder));
            assert_eq!(found, [text(framing, &data), text(Framing::Stx, b"OK\r")]);
        }
    }
}

// clause: FRM-17
#[test]
fn answers_in_place_of_a_binary_text_are_read_as_ever() {
    let mut decoder = TextDecoder::new(DETECT);
    decoder.expect_binary(9);
    decoder.push(b"\x02SP\r\x03\x02FL,\x03\x03\x03\x03\x03\x1a\x03\x02NG\r\x03");
    let expected = [
        text(Framing::Stx, b"SP\r"),
        text(Framing::Stx, b"FL,\x03\x03\x03\x03\x03\x1a"),
    ];
    assert_eq!(
        drain(&mut decoder),
        [&expected[..], &[text(Framing::Stx, b"NG\r")]].concat()
    );
    decoder.expect_binary(9);
    decoder.push(b"\x02NG\r\x03\x02FL,\x03");
    assert_eq!(
        drain(&mut decoder),
        [text(Framing::Stx, b"NG\r"), text(Framing::Stx, b"FL,")]
    );
}

// clause: FRM-17
#[test]
fn a_binary_text_that_goes_on_is_a_fault() {
    let mut decoder = TextDecoder::new(DETECT);
    decoder.expect_binary(5);
    decoder.push(b"\x02FL,12345\x03\x02OK\r\x03");
    let fault = TextError::NoEtx { found: b'3' };
    let rest = text(Framing::Bare, b"345");
    assert_eq!(
        drain(&mut decoder),
        [
            faulty(Framing::Stx, b"FL,12", fault),
            rest,
            text(Framing::Stx, b"OK\r")
        ]
    );
    decoder.expect_binary(usize::MAX);
    decoder.push(&[b'A'; 5000]);
    decoder.next();
    assert!(decoder.buffered() <= MAX_BUFFERED);
}

#[test]
fn memory_is_bounded_and_what_is_lost_is_counted() {
    let mut decoder = TextDecoder::new(STX_ONLY);
    decoder.push(b"\x02SU\r\x03\x02S");
    for _ in 0..40 {
        decoder.push(&[b'A'; 4096]);
        assert!(decoder.buffered() <= MAX_BUFFERED);
    }
    decoder.push(b"\x03");
    assert_eq!(decoder.next(), Some(text(Framing::Stx, b"SU\r")));
    assert_eq!(decoder.next(), Some(skipped(2 + 40 * 4096 + 1)));
    assert_eq!(decoder.next(), None);
    decoder.push(b"\x02SU\r\x03");
    assert_eq!(decoder.next(), Some(text(Framing::Stx, b"SU\r")));
    decoder.push(b"\x02");
    for _ in 0..100 {
        decoder.push(&[b'A'; 4096]);
        assert_eq!(decoder.next(), None);
        assert!(decoder.buffered() <= MAX_DATA);
    }
    decoder.push(b"\x03");
    assert!(matches!(
        decoder.next(),
        Some(Decoded::Text(Text {
            error: Some(TextError::OverLong { length: 409_600 }),
            ..
        }))
    ));
}

// clause: FRM-01 FRM-04 FRM-05
#[test]
fn random_streams_lose_no_byte_and_do_not_depend_on_cuts() {
    let mut random = Random(0x7535_3331_3030_0001);
    for round in 0..2000 {
        let options = [STX_ONLY, DETECT, SUMMED][round % 3];
        let length = random.below(400);
        let alphabet = [STX, ETX, CR, EOF, b'S', b'U', b'A', 0xFF];
        let stream: Vec<u8> = (0..length)
            .map(|_| alphabet[random.below(alphabet.len())])
            .collect();
        let mut decoder = TextDecoder::new(options);
        decoder.push(&stream);
        let found = drain(&mut decoder);
        let wire: usize = found
            .iter()
            .map(|one| match one {
                Decoded::Skipped { bytes } => *bytes,
                Decoded::Text(text) => {
                    let length = match text.error {
                        Some(TextError::OverLong { length }) => length,
                        _ => text.data.len(),
                    };
                    encode_text(&vec![0; length], text.framing, options.checksum).len()
                }
            })
            .sum();
        assert_eq!(wire + decoder.give_up(), stream.len(), "{stream:02X?}");
        let mut cut = Vec::new();
        let mut rest = stream.as_slice();
        while !rest.is_empty() {
            let (front, back) = rest.split_at(1 + random.below(rest.len()));
            cut.push(front);
            rest = back;
        }
        assert_eq!(in_pieces(options, cut.into_iter()), joined(found));
    }
}
