//! Files cut into texts and put together again, in every size around the edges of a text.

use super::*;
use alloc::vec;

const ROOM: usize = 99_999;

fn receiver() -> FlReceiver {
    FlReceiver::new(ROOM, FileRule::User)
}

fn texts(mut sender: FlSender) -> Vec<Vec<u8>> {
    let list = core::iter::from_fn(|| sender.next_text().map(<[u8]>::to_vec)).collect();
    assert!(sender.is_done());
    list
}

fn lines(length: usize) -> Vec<u8> {
    (0..length)
        .map(|at| if at % 40 == 39 { LF } else { b'A' })
        .collect()
}

// clause: FL-01
#[test]
fn a_short_file_is_one_text() {
    assert_eq!(texts(FlSender::new(b"END\n")), [b"FL,END\n\x1a"]);
    assert_eq!(texts(FlSender::new(Vec::new())), [b"FL,\x1a"]);
}

// clause: FL-02 TRN-06
#[test]
fn a_long_file_has_fl_in_the_first_text_and_eof_in_the_last() {
    let sent = texts(FlSender::new(lines(500)));
    assert_eq!(sent.iter().map(Vec::len).collect::<Vec<_>>(), [253, 251]);
    assert!(sent[0].starts_with(b"FL,") && !sent[1].starts_with(b"FL,"));
    assert_eq!(sent[1].iter().position(|&byte| byte == EOF), Some(250));
}

// clause: FL-05
#[test]
fn a_file_that_fills_its_text_is_followed_by_eof_alone() {
    let sent = texts(FlSender::new(lines(250)));
    assert_eq!(sent.iter().map(Vec::len).collect::<Vec<_>>(), [253, 1]);
    assert_eq!(sent[1], [EOF]);
    assert_eq!(texts(FlSender::new(lines(249))).len(), 1);
}

// clause: FL-03 CMD-DL-03 RAM-06
#[test]
fn every_size_and_every_cut_comes_together_again() {
    for length in 0..=1100 {
        let content = lines(length);
        let sent = texts(FlSender::new(content.clone()));
        let mut receiver = receiver();
        let (last, parts) = sent.split_last().unwrap();
        for part in parts {
            assert_eq!(part.len(), MAX_DATA);
            assert_eq!(receiver.push(part), Received::More);
        }
        assert_eq!(receiver.push(last), Received::Complete(content));
    }
    let whole = [b"FL,".as_slice(), &lines(100), &[EOF]].concat();
    for cut in 3..whole.len() {
        let mut receiver = receiver();
        assert_eq!(receiver.push(&whole[..cut]), Received::More);
        assert_eq!(receiver.push(b""), Received::More);
        assert_eq!(receiver.push(&whole[cut..]), Received::Complete(lines(100)));
    }
}

#[test]
fn a_single_text_has_any_length_and_its_own_end() {
    let content = vec![0x03; 276];
    for tail in [b"\x1a".as_slice(), b"\x1a\r"] {
        assert_eq!(
            texts(FlSender::single_text(content.clone(), tail)),
            [[b"FL,", content.as_slice(), tail].concat()]
        );
    }
}

// clause: FL-04
#[test]
fn the_first_text_must_begin_with_fl() {
    for data in [b"".as_slice(), b"FL", b"FLX", b"END\x1a", b"\x1a", b" FL,\x1a"] {
        assert_eq!(
            receiver().push(data),
            Received::Refused(FileError::NoPrefix),
            "{data:02X?}"
        );
    }
    assert_eq!(receiver().push(b"fl,\x1a"), Received::Complete(Vec::new()));
}

#[test]
fn only_a_cr_may_stand_after_eof() {
    assert_eq!(receiver().push(b"FL,A\x1a\r"), Received::Complete(b"A".to_vec()));
    for data in [
        b"FL,A\x1aB".as_slice(),
        b"FL,A\x1a\r\r",
        b"FL,A\x1a\n",
        b"FL,A\x1a\x1a",
    ] {
        assert_eq!(receiver().push(data), Received::Refused(FileError::DataAfterEnd));
    }
    let mut receiver = receiver();
    assert_eq!(receiver.push(b"FL,A\x1a"), Received::Complete(b"A".to_vec()));
    assert_eq!(
        receiver.push(b"B\x1a"),
        Received::Refused(FileError::DataAfterEnd)
    );
}

// clause: RAM-03 RAM-15
#[test]
fn a_file_beyond_the_room_is_refused_at_that_block() {
    let mut receiver = FlReceiver::new(5, FileRule::User);
    assert_eq!(receiver.push(b"FL,ABC"), Received::More);
    assert!(receiver.begun);
    assert_eq!(receiver.push(b"DE"), Received::More);
    assert_eq!(
        receiver.push(b"F"),
        Received::Refused(FileError::TooLarge { limit: 5 })
    );
    assert_eq!(receiver.push(b"\x1a"), Received::Refused(FileError::DataAfterEnd));
    assert_eq!(
        FlReceiver::new(5, FileRule::User).push(b"FL,ABCDE\x1a"),
        Received::Complete(b"ABCDE".to_vec())
    );
}

// clause: RAM-01 RAM-02 S7
#[test]
fn lines_have_at_most_252_characters_whatever_the_line_end() {
    for end in [b"\r".as_slice(), b"\n", b"\r\n"] {
        let longest = [b"END", end, &[b'A'; MAX_LINE], end, b"END", end].concat();
        assert_eq!(check_file(&longest, FileRule::User), Ok(()));
        let longer = [b"END", end, &[b'A'; MAX_LINE + 1], end].concat();
        assert_eq!(
            check_file(&longer, FileRule::User),
            Err(FileError::LongLine { line: 2 })
        );
        assert_eq!(check_file(&longer, FileRule::Parameter), Ok(()));
    }
    let mut receiver = receiver();
    assert_eq!(
        receiver.push(&[b"FL,".as_slice(), &[b'A'; 250]].concat()),
        Received::More
    );
    assert_eq!(receiver.push(b"AA"), Received::More);
    assert_eq!(
        receiver.push(b"A"),
        Received::Refused(FileError::LongLine { line: 1 })
    );
}

// clause: RAM-08 FRM-12
#[test]
fn user_files_hold_printable_ascii_only() {
    for byte in 0..=u8::MAX {
        let content = [b'A', CR, LF, b'B', byte];
        let expected = match byte {
            0x20..=0x7E | CR | LF => Ok(()),
            found => Err(FileError::Character {
                line: 2,
                column: 2,
                found,
            }),
        };
        assert_eq!(check_file(&content, FileRule::User), expected);
        let parameter = check_file(&content, FileRule::Parameter);
        assert_eq!(parameter.is_ok(), byte != EOF);
    }
    assert_eq!(check_file(b"START: A_1 = \"x\";\r", FileRule::User), Ok(()));
    assert_eq!(
        check_file(b"A\n\nB\r\rC\r\n\x09", FileRule::User),
        Err(FileError::Character {
            line: 6,
            column: 1,
            found: 9
        })
    );
}

// clause: FL-02 FL-03
#[test]
fn a_file_can_be_cut_anywhere_and_is_the_same_file() {
    let content: Vec<u8> = b"0123456789\n".repeat(80);
    let mut sender = FlSender::new(content.clone());
    assert_eq!(sender.remaining_to_split(), Some(content.len() + 4));
    sender.set_text_lengths([5, 0, 999, 100]);
    let texts: Vec<Vec<u8>> = core::iter::from_fn(|| sender.next_text().map(<[u8]>::to_vec)).collect();
    let lengths: Vec<usize> = texts.iter().map(Vec::len).collect();
    assert_eq!(lengths, [5, 1, 253, 100, 253, 253, 19]);
    let mut receiver = FlReceiver::new(1_000, FileRule::User);
    let last = texts.iter().map(|text| receiver.push(text)).last();
    assert_eq!(last, Some(Received::Complete(content)));
    assert_eq!(FlSender::single_text(b"SF", b"\x1a").remaining_to_split(), None);
}
