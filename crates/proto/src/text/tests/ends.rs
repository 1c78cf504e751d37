//! What ends a text besides ETX, which bytes between texts are skipped, and the rest of a text that was given up.

use super::*;

const DETECT_END: TextOptions = TextOptions {
    end: EndRule::Detect,
    ..DETECT
};
const BY_CR: TextOptions = TextOptions {
    end: EndRule::Cr,
    ..DETECT
};

fn by_cr(data: &[u8]) -> Decoded {
    Decoded::Text(Text {
        framing: Framing::Bare,
        data: Bytes::copy_from_slice(data),
        terminator: Terminator::Cr,
        error: None,
    })
}

fn read(decoder: &mut TextDecoder, bytes: &[u8]) -> Vec<Decoded> {
    decoder.push(bytes);
    core::iter::from_fn(|| decoder.next_as(Reading::Command)).collect()
}

/// The marks of a connection: none, ETX, CR.
fn marked(options: TextOptions, mark: Option<Terminator>) -> TextDecoder {
    TextDecoder::new(options).with_mark(mark)
}

// clause: T6 T27
#[test]
fn the_first_end_of_a_bare_text_marks_the_connection() {
    let mut decoder = TextDecoder::new(DETECT_END);
    assert_eq!(read(&mut decoder, b"SU\r\x03"), [text(Framing::Bare, b"SU\r")]);
    assert_eq!(decoder.mark(), Some(Terminator::Etx));
    for (stream, expected, mark) in [
        (&b"SU\x03"[..], text(Framing::Bare, b"SU"), Terminator::Etx),
        (b"\x02SU\r\x03", text(Framing::Stx, b"SU\r"), Terminator::Etx),
        (b"OK\r\x03", text(Framing::Bare, b"OK\r"), Terminator::Etx),
        (b"SU\rA", by_cr(b"SU\r"), Terminator::Cr),
        (b"SU\r\r", by_cr(b"SU\r"), Terminator::Cr),
        (b"SU\r\x02", by_cr(b"SU\r"), Terminator::Cr),
        (b"OK\rS", by_cr(b"OK\r"), Terminator::Cr),
    ] {
        let mut decoder = TextDecoder::new(DETECT_END);
        assert_eq!(read(&mut decoder, stream), [expected], "{stream:02X?}");
        assert_eq!(decoder.mark(), Some(mark), "{stream:02X?}");
        let mut pieces = TextDecoder::new(DETECT_END);
        let found: Vec<Decoded> = stream
            .iter()
            .flat_map(|byte| read(&mut pieces, &[*byte]))
            .collect();
        assert_eq!(found.len(), 1, "{stream:02X?}");
        assert_eq!(pieces, decoder, "the cuts do not matter: {stream:02X?}");
    }
}

// clause: T6 T27
#[test]
fn a_cr_that_came_last_waits_and_ends_the_text_when_it_is_told_to() {
    let mut decoder = TextDecoder::new(DETECT_END);
    assert_eq!(read(&mut decoder, b"SU\r"), []);
    assert!(decoder.awaits_etx() && decoder.is_partial_as(Reading::Command));
    assert!(
        decoder.is_valid(DETECT_END),
        "a snapshot may be taken while it waits"
    );
    assert_eq!(decoder.end_at_cr(), Some(by_cr(b"SU\r")));
    assert!(!decoder.awaits_etx() && !decoder.is_partial());
    assert_eq!(decoder.mark(), Some(Terminator::Cr));
    // The late ETX is no noise; a second one is.
    assert_eq!(read(&mut decoder, b"\x03"), []);
    assert_eq!(read(&mut decoder, b"\x03"), [skipped(1)]);
    assert_eq!(decoder.end_at_cr(), None);
    assert_eq!(read(&mut decoder, b"S"), []);
    assert_eq!(decoder.end_at_cr(), None);
    assert_eq!(decoder.buffered(), 1);
}

// clause: T6 T27
#[test]
fn a_marked_connection_keeps_its_mark() {
    let mut cr = marked(DETECT_END, Some(Terminator::Cr));
    assert_eq!(read(&mut cr, b"SU\r"), [by_cr(b"SU\r")]);
    assert_eq!(
        read(&mut cr, b"\x03CA\r\x03SF\x03\x02RS\r\x03"),
        [
            by_cr(b"CA\r"),
            text(Framing::Bare, b"SF"),
            text(Framing::Stx, b"RS\r")
        ]
    );
    assert_eq!(cr.mark(), Some(Terminator::Cr));
    let mut etx = marked(DETECT_END, Some(Terminator::Etx));
    assert_eq!(read(&mut etx, b"CA\rSU\r"), []);
    assert!(!etx.awaits_etx() && etx.is_partial());
    assert_eq!(read(&mut etx, b"\x03"), [text(Framing::Bare, b"CA\rSU\r")]);
    assert_eq!(etx.mark(), Some(Terminator::Etx));
}

// clause: T6 T27
#[test]
fn the_other_rules_mark_nothing() {
    let mut etx = TextDecoder::new(DETECT);
    assert_eq!(
        read(&mut etx, b"CA\rSU\r\x03"),
        [text(Framing::Bare, b"CA\rSU\r")]
    );
    let mut cr = TextDecoder::new(BY_CR);
    assert_eq!(
        read(&mut cr, b"CA\rSU\r\x03SF\x03\x02RS\r"),
        [by_cr(b"CA\r"), by_cr(b"SU\r"), text(Framing::Bare, b"SF")]
    );
    assert_eq!(read(&mut cr, b"\x03"), [text(Framing::Stx, b"RS\r")]);
    assert_eq!((etx.mark(), cr.mark()), (None, None));
}

// clause: T6
#[test]
fn files_other_readings_and_texts_with_a_checksum_end_by_etx() {
    for options in [DETECT_END, BY_CR] {
        for start in [&b"FL,"[..], b"fl,"] {
            let file = [start, b"A\rB\r\x1a"].concat();
            let mut decoder = marked(options, Some(Terminator::Cr));
            assert_eq!(read(&mut decoder, &file), []);
            assert!(!decoder.awaits_etx());
            assert_eq!(read(&mut decoder, b"\x03"), [text(Framing::Bare, &file)]);
        }
        for reading in [Reading::Data, Reading::File] {
            let mut decoder = marked(options, Some(Terminator::Cr));
            decoder.push(b"SU\rA");
            assert_eq!(decoder.next_as(reading), None);
            assert!(decoder.is_partial());
        }
        let summed = TextOptions {
            checksum: Checksum::Sum,
            ..options
        };
        let mut decoder = TextDecoder::new(summed);
        assert_eq!(read(&mut decoder, b"SU\rA"), []);
        assert!(!decoder.awaits_etx() && decoder.is_partial());
    }
    // FL without its comma is no file.
    assert_eq!(read(&mut TextDecoder::new(BY_CR), b"FL\r"), [by_cr(b"FL\r")]);
}

// clause: T6
#[test]
fn a_text_that_is_too_long_is_so_with_a_cr_too() {
    let long = [[b'A'; MAX_DATA].as_slice(), b"\r"].concat();
    let found = read(&mut TextDecoder::new(BY_CR), &long);
    let error = TextError::OverLong { length: MAX_DATA + 1 };
    assert!(matches!(&found[..], [Decoded::Text(text)] if text.error == Some(error)));
    let fits = read(&mut TextDecoder::new(BY_CR), &long[1..]);
    assert_eq!(fits, [by_cr(&long[1..])]);
}

// clause: T7
#[test]
fn four_bytes_between_texts_are_skipped_and_no_others() {
    for options in [DETECT, DETECT_END, BY_CR] {
        let mut decoder = TextDecoder::new(options);
        assert_eq!(read(&mut decoder, b"\r\n\0 "), []);
        assert!(!decoder.is_partial_as(Reading::Command));
        let found = read(&mut decoder, b" \x02SU\r\x03\r\nSF\x03\0\x02CA\r\x03\r\n");
        let texts = [
            (Framing::Stx, &b"SU\r"[..]),
            (Framing::Bare, b"SF"),
            (Framing::Stx, b"CA\r"),
        ];
        assert_eq!(found, texts.map(|(framing, data)| text(framing, data)));
        assert!(!decoder.is_partial_as(Reading::Command));
    }
    for byte in 0..=u8::MAX {
        let mut decoder = TextDecoder::new(DETECT);
        read(&mut decoder, &[byte]);
        let begins = !matches!(byte, CR | LF | 0 | b' ' | ETX);
        assert_eq!(decoder.is_partial_as(Reading::Command), begins, "{byte:02X}");
    }
    // Inside a text they are data, and so they are where each byte counts.
    let found = read(&mut TextDecoder::new(DETECT), b"MW,0 A 1 \x03");
    assert_eq!(found, [text(Framing::Bare, b"MW,0 A 1 ")]);
    assert_eq!(decode(DETECT, b" \r\x03"), [text(Framing::Bare, b" \r")]);
    let mut required = TextDecoder::new(STX_ONLY);
    assert_eq!(read(&mut required, b"\r\n\0 "), [skipped(4)]);
}

// clause: T7
#[test]
fn the_byte_after_etx_is_the_checksum_whatever_it_is() {
    let data = b"SU\r\x35";
    let wire = encode_text(data, Framing::Bare, Checksum::Sum);
    let sum = *wire.last().unwrap();
    assert_ne!(sum, CR);
    let data = [b"SU\r".as_slice(), &[0x35_u8.wrapping_add(CR).wrapping_sub(sum)]].concat();
    let wire = encode_text(&data, Framing::Bare, Checksum::Sum);
    assert_eq!(wire.last(), Some(&CR));
    let twice = [wire.clone(), wire].concat();
    assert_eq!(
        read(&mut TextDecoder::new(SUMMED), &twice),
        [text(Framing::Bare, &data), text(Framing::Bare, &data)]
    );
}

// clause: T22 T27
#[test]
fn the_rest_of_a_text_that_was_given_up_is_dropped() {
    let after = |options, mark, rest: &[u8]| {
        let mut decoder = marked(options, mark);
        read(&mut decoder, b"SU,A");
        assert_eq!(decoder.give_up(), 4);
        assert!(!decoder.is_partial_as(Reading::Command) && decoder.buffered() == 0);
        read(&mut decoder, rest)
    };
    let su = || text(Framing::Bare, b"SU\r");
    for options in [DETECT, DETECT_END] {
        assert_eq!(after(options, None, b"B\rC\r\x03SU\r\x03"), [skipped(5), su()]);
        let stx = after(options, None, b"B\x02SU\r\x03");
        assert_eq!(stx, [skipped(1), text(Framing::Stx, b"SU\r")]);
    }
    let cr = Some(Terminator::Cr);
    let served = by_cr(b"SU\r");
    assert_eq!(after(DETECT_END, cr, b"B\rSU\r"), [skipped(2), served.clone()]);
    assert_eq!(
        after(DETECT_END, cr, b"B\r\x03SU\r"),
        [skipped(2), served.clone()]
    );
    assert_eq!(after(BY_CR, None, b"B\rSU\r"), [skipped(2), served]);
    let etx = Some(Terminator::Etx);
    assert_eq!(after(DETECT_END, etx, b"B\rSU\r\x03"), [skipped(6)]);
    // Silence in the rest begins no second one, and giving up again changes nothing.
    let mut decoder = TextDecoder::new(DETECT);
    read(&mut decoder, b"SU");
    assert_eq!((decoder.give_up(), decoder.give_up()), (2, 0));
    assert_eq!(read(&mut decoder, b"\rA"), [skipped(2)]);
    assert_eq!(read(&mut decoder, b"\x03"), [skipped(1)]);
    assert_eq!(read(&mut decoder, b"SU\r\x03"), [su()]);
}

// clause: T22
#[test]
fn the_checksum_of_a_text_that_was_given_up_is_dropped_with_it() {
    let wire = encode_text(b"SU\r", Framing::Stx, Checksum::Sum);
    let (etx, sum) = (wire.len() - 1, &wire[wire.len() - 1..]);
    for (come, rest) in [(2, &wire[2..]), (etx, sum)] {
        let mut decoder = TextDecoder::new(SUMMED);
        read(&mut decoder, &wire[..come]);
        assert_eq!(decoder.give_up(), come);
        let found = read(&mut decoder, &[rest, &wire].concat());
        assert_eq!(found, [skipped(rest.len()), text(Framing::Stx, b"SU\r")]);
    }
}
