//! Exchanges of many texts and their time limits, as far as a transcript cannot express them because bytes are counted or
//! long files compared.
//!
//! Short conversations are transcripts in `fixtures/transcripts`; the rules are in docs/reference/protocol/exchanges.md.

use ts3100_controller::model::ArmModel;
use ts3100_controller::options::UnsolicitedSp;
use ts3100_controller::{Config, Dialect, PanelAction, Port};
use ts3100_proto::command::RunMode;
use ts3100_tests::{Robot, frame, notation, unframe};

const DATA: usize = 253;

/// A REMARK program of exactly so many bytes, in lines of at most fifty.
fn file_of(length: usize) -> Vec<u8> {
    let mut content = b"PROGRAM BULK\nEND\n".to_vec();
    while content.len() < length {
        let rest = length - content.len();
        match rest {
            1 => content.push(b'\n'),
            _ => {
                let line = rest.min(50);
                content.extend(b"'".iter().chain(std::iter::repeat_n(&b'x', line - 2)));
                content.push(b'\n');
            }
        }
    }
    content
}

fn robot() -> Robot {
    let mut robot = Robot::new(Dialect::Field);
    robot.connect(Port::Ip0);
    robot
}

fn download(robot: &mut Robot, name: &str, content: &[u8], block: usize) -> Vec<u8> {
    robot.command(Port::Ip0, &format!("DL,{name}"));
    let whole = [b"FL,", content, b"\x1A"].concat();
    for text in whole.chunks(block) {
        robot.send(Port::Ip0, text);
        let answer = unframe(&robot.received(Port::Ip0)).expect("one text answers a block");
        if answer != b"OK\r" {
            return answer;
        }
    }
    b"OK\r".to_vec()
}

/// The data sections of an upload.
fn upload(robot: &mut Robot, command: &str) -> Vec<Vec<u8>> {
    let mut texts = vec![robot.ask(Port::Ip0, command)];
    while texts.last().is_some_and(|text| text.last() != Some(&0x1A)) {
        robot.send(Port::Ip0, b"OK\r");
        texts.push(unframe(&robot.received(Port::Ip0)).expect("a further text"));
    }
    robot.send(Port::Ip0, b"OK\r");
    assert_eq!(robot.received(Port::Ip0), b"");
    texts
}

// clause: FL-01 FL-02 FL-05 TRN-06 FRM-02 CMD-UL-01 CMD-UL-02 CMD-DL-02 CMD-DL-03 RAM-06 DIR-03 S1
#[test]
fn files_of_every_awkward_length_travel_both_ways() {
    for length in [
        17, 249, 250, 251, 252, 253, 254, 500, 502, 503, 504, 505, 755, 756, 757, 1_100,
    ] {
        let mut robot = robot();
        let content = file_of(length);
        assert_eq!(content.len(), length);
        assert_eq!(download(&mut robot, "BULK", &content, DATA), b"OK\r", "{length}");
        let texts = upload(&mut robot, "UL,BULK");
        assert_eq!(texts.len(), (length + 3 + 1).div_ceil(DATA), "{length}");
        assert!(
            texts[..texts.len() - 1].iter().all(|text| text.len() == DATA),
            "{length}"
        );
        let joined = texts.concat();
        assert_eq!(joined[..3], *b"FL,");
        assert_eq!(joined[3..joined.len() - 1], content, "{length}");
        let directory = String::from_utf8(robot.file(Port::Ip0, "CA")).unwrap();
        assert!(directory.contains(&format!("BULK {length}\r")), "{directory:?}");
    }
}

// clause: FL-03 CMD-DL-03
#[test]
fn a_download_may_be_cut_anywhere() {
    let content = file_of(600);
    for block in [4, 7, 50, 226, 230, 252, 253] {
        let mut robot = robot();
        assert_eq!(download(&mut robot, "BULK", &content, block), b"OK\r", "{block}");
        assert_eq!(robot.file(Port::Ip0, "UL,BULK"), content, "{block}");
    }
}

// clause: CMD-UL-03 TRN-03 CMD-CA-01 S4
#[test]
fn ng_of_the_host_ends_an_upload_which_may_begin_again() {
    let mut robot = robot();
    let content = file_of(600);
    download(&mut robot, "BULK", &content, DATA);
    robot.ask(Port::Ip0, "UL,BULK");
    robot.send(Port::Ip0, b"OK\r");
    assert_eq!(robot.received(Port::Ip0).len(), DATA + 2);
    robot.send(Port::Ip0, b"NG\r");
    assert_eq!(robot.received(Port::Ip0), b"");
    assert_eq!(robot.file(Port::Ip0, "UL,BULK"), content);
}

// clause: SER-09 CMD-UL-02 TRN-01 CMD-SP-08
#[test]
fn nothing_is_ever_sent_twice_or_unasked() {
    let mut robot = robot();
    download(&mut robot, "BULK", &file_of(600), DATA);
    robot.ask(Port::Ip0, "UL,BULK");
    robot.advance_ms(3_000);
    assert_eq!(robot.received(Port::Ip0), b"");
    robot.send(Port::Ip0, b"OK\r");
    assert_eq!(robot.received(Port::Ip0).len(), DATA + 2);
    robot.advance_ms(60_000);
    assert_eq!(robot.received(Port::Ip0), b"");
}

// clause: SER-08
#[test]
fn an_exchange_the_host_forgets_ends_after_ten_seconds() {
    let mut robot = robot();
    let content = file_of(600);
    download(&mut robot, "BULK", &content, DATA);
    robot.ask(Port::Ip0, "UL,BULK");
    robot.advance_ms(9_900);
    robot.send(Port::Ip0, b"OK\r");
    assert_eq!(robot.received(Port::Ip0).len(), DATA + 2, "just in time");
    robot.advance_ms(10_100);
    robot.send(Port::Ip0, b"OK\r");
    assert_eq!(robot.received(Port::Ip0), b"", "too late");
    robot.command(Port::Ip0, "DL,LATE");
    robot.advance_ms(10_100);
    robot.send(Port::Ip0, b"FL,PROGRAM LATE\nEND\n\x1A");
    let answer = robot.received(Port::Ip0);
    assert_ne!(answer, frame(b"OK\r"), "the download was given up");
    assert_eq!(robot.ask(Port::Ip0, "UL,LATE"), b"NG\r");
}

// clause: SER-06 SER-07
#[test]
fn half_a_text_is_forgotten_after_ten_seconds() {
    for port in [Port::Ip0, Port::Host] {
        let mut robot = Robot::new(Dialect::Field);
        robot.connect(port);
        robot.raw(port, b"\x02S");
        robot.advance_ms(9_000);
        robot.raw(port, b"U\r\x03");
        assert!(
            robot.received(port).starts_with(b"\x02FL,MODE:"),
            "{port}: within 10 s"
        );
        robot.send(port, b"OK\r");
        robot.raw(port, b"\x02S");
        robot.advance_ms(11_000);
        assert_eq!(robot.received(port), b"", "{port}: in silence");
        robot.raw(port, b"U\r\x03");
        let answer = robot.received(port);
        assert!(!answer.starts_with(b"\x02FL"), "{port}: the rest comes too late");
        robot.send(port, b"SU\r");
        assert!(
            robot.received(port).starts_with(b"\x02FL,MODE:"),
            "{port}: one FL"
        );
    }
}

// clause: TRN-09
#[test]
fn a_new_command_takes_the_place_of_an_open_exchange() {
    let mut robot = robot();
    download(&mut robot, "BULK", &file_of(600), DATA);
    robot.ask(Port::Ip0, "UL,BULK");
    assert!(robot.ask(Port::Ip0, "CA").starts_with(b"FL,BULK 600\r"));
    assert!(robot.ask(Port::Ip0, "SU").starts_with(b"FL,MODE:"));
    robot.command(Port::Ip0, "DL,OTHER");
    assert!(robot.ask(Port::Ip0, "SU").starts_with(b"FL,MODE:"));
    robot.send(Port::Ip0, b"OK\r");
    robot.send(Port::Ip0, b"FL,PROGRAM OTHER\nEND\n\x1A");
    assert_ne!(
        robot.received(Port::Ip0),
        frame(b"OK\r"),
        "the download was given up"
    );
}

// clause: TRN-11
#[test]
fn the_two_ports_have_their_own_exchanges() {
    let mut robot = robot();
    robot.connect(Port::Host);
    let content = file_of(600);
    download(&mut robot, "BULK", &content, DATA);
    let first = robot.ask(Port::Ip0, "UL,BULK");
    assert!(robot.file(Port::Host, "SU").starts_with(b"MODE:"));
    assert_eq!(robot.file(Port::Host, "UL,BULK"), content);
    robot.send(Port::Ip0, b"OK\r");
    let second = unframe(&robot.received(Port::Ip0)).unwrap();
    robot.send(Port::Ip0, b"OK\r");
    let third = unframe(&robot.received(Port::Ip0)).unwrap();
    let joined = [first, second, third].concat();
    assert_eq!(joined[3..joined.len() - 1], content);
    robot.send(Port::Ip0, b"OK\r");
    robot.command(Port::Ip0, "DL,BOTH");
    assert_eq!(robot.ask(Port::Host, "DL,BOTH"), b"NG\r");
    robot.command(Port::Host, "DL,OTHER");
}

// clause: CMD-DL-04 CMD-DL-05 CMD-DL-06 RAM-02 RAM-08 FRM-03
#[test]
fn a_download_is_stored_whole_or_not_at_all() {
    let old = b"PROGRAM KEEP\nEND\n";
    let long = [b"' ".to_vec(), vec![b'x'; 258], b"\n".to_vec()].concat();
    for bad in [b"A\tB\n".to_vec(), b"A\x80B\n".to_vec(), long] {
        let mut robot = robot();
        download(&mut robot, "KEEP", old, DATA);
        assert_eq!(
            download(&mut robot, "KEEP", &bad, DATA),
            b"NG\r",
            "{}",
            notation::write(&bad[..4])
        );
        robot.send(Port::Ip0, b"END\n\x1A");
        assert_ne!(
            robot.received(Port::Ip0),
            frame(b"OK\r"),
            "the download was discontinued"
        );
        assert_eq!(robot.file(Port::Ip0, "UL,KEEP"), old);
    }
    let mut robot = robot();
    download(&mut robot, "KEEP", old, DATA);
    robot.command(Port::Ip0, "DL,KEEP");
    robot.send(Port::Ip0, &[b"FL,".to_vec(), vec![b'\n'; 251]].concat());
    assert_eq!(robot.received(Port::Ip0), frame(b"NG\r"), "254 data bytes");
    assert_eq!(robot.file(Port::Ip0, "UL,KEEP"), old);
}

// clause: RAM-01 S7
#[test]
fn a_line_of_252_characters_is_taken() {
    let mut robot = robot();
    let content = [b"'".to_vec(), vec![b'x'; 251], b"\nPROGRAM L\nEND\n".to_vec()].concat();
    assert_eq!(download(&mut robot, "LONG", &content, DATA), b"OK\r");
    assert_eq!(robot.file(Port::Ip0, "UL,LONG"), content);
}

// clause: RAM-03
#[test]
fn a_file_of_six_digits_is_refused() {
    let mut robot = robot();
    assert_eq!(download(&mut robot, "BIG", &file_of(99_999), DATA), b"OK\r");
    assert_eq!(download(&mut robot, "BIGGER", &file_of(100_000), DATA), b"NG\r");
    assert_eq!(robot.ask(Port::Ip0, "UL,BIGGER"), b"NG\r");
}

// clause: TRN-07 TRN-08
#[test]
fn a_message_of_two_texts_is_answered_once() {
    let mut robot = robot();
    robot.command(Port::Ip0, "SO");
    // A statement that cannot be executed is refused as often: once.
    for (statement, answer) in [("SPEED = 01", b"OK\r"), ("XYZZY 01", b"NG\r")] {
        let terms = 80;
        let statement = format!("DO,{statement}{}", " + 0".repeat(terms));
        let message = [statement.as_bytes(), b"\r"].concat();
        assert!(message.len() > DATA, "{}", message.len());
        robot.send(Port::Ip0, &message[..DATA]);
        assert_eq!(robot.received(Port::Ip0), b"");
        robot.send(Port::Ip0, &message[DATA..]);
        assert_eq!(robot.received(Port::Ip0), frame(answer), "{statement}");
    }
}

// clause: FRM-04 FRM-16
#[test]
fn noise_of_any_kind_leaves_the_port_working() {
    let mut seed = 0x2545_F491_4F6C_DD1D_u64;
    let mut next = move || {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        seed
    };
    for dialect in [Dialect::Field, Dialect::Manual] {
        let mut robot = Robot::new(dialect);
        for round in 0..300 {
            robot.connect(Port::Ip0);
            for _ in 0..next() % 8 {
                let noise: Vec<u8> = (0..next() % 600).map(|_| next().to_le_bytes()[0]).collect();
                robot.raw(Port::Ip0, &noise);
                robot.advance_ms(next() % 300);
            }
            robot.disconnect(Port::Ip0);
            robot.received(Port::Ip0);
            robot.connect(Port::Ip0);
            assert!(
                robot.ask(Port::Ip0, "SU").starts_with(b"FL,MODE:"),
                "round {round}"
            );
            robot.disconnect(Port::Ip0);
        }
    }
}

// clause: SF-02 SF-01 FL-02
#[test]
fn in_the_manual_dialect_sf_travels_in_two_texts() {
    let mut robot = Robot::new(Dialect::Manual);
    robot.connect(Port::Ip0);
    robot.send(Port::Ip0, b"SF\r");
    let first = robot.received(Port::Ip0);
    assert_eq!((first.len(), &first[..4]), (255, b"\x02FL,".as_slice()));
    robot.send(Port::Ip0, b"OK\r");
    let second = robot.received(Port::Ip0);
    assert_eq!((second.len(), &second[27..]), (29, b"\x1A\x03".as_slice()));
    robot.send(Port::Ip0, b"OK\r");
    assert_eq!(robot.received(Port::Ip0), b"");
}

// clause: SF-01 SF-46
#[test]
fn in_the_field_dialect_sf_is_one_text() {
    for (request, length) in [(b"\x02SF\r\x03".as_slice(), 282), (b"SF\r\x03".as_slice(), 281)] {
        let mut robot = robot();
        robot.raw(Port::Ip0, request);
        let text = robot.received(Port::Ip0);
        assert_eq!(text.len(), length);
        assert!(text.ends_with(b"\x1A\x03"));
    }
}

// clause: CMD-SP-07 CMD-SP-10 T23 S43
#[test]
fn an_unsolicited_sp_is_never_glued_to_an_ok() {
    let mut robot = Robot::ready("PROGRAM E\nEND\n");
    robot.send(Port::Ip0, b"RN\r");
    assert_eq!(
        robot.received(Port::Ip0),
        frame(b"OK\r"),
        "a host reads five bytes and compares them"
    );
    robot.advance_ms(49);
    assert_eq!(robot.received(Port::Ip0), b"");
    robot.advance_ms(1);
    assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"));
}

/// Advances until the robot sends SP and returns the milliseconds that took.
fn until_stop(robot: &mut Robot, mut each: impl FnMut(&mut Robot)) -> u64 {
    for ms in 1..=1_000 {
        robot.advance_ms(1);
        if robot.received(Port::Ip0) == frame(b"SP\r") {
            return ms;
        }
        each(robot);
    }
    panic!("no SP within a second");
}

// clause: CMD-SP-07 CMD-SP-10
#[test]
fn a_host_that_never_pauses_is_told_of_a_stop_within_200_ms() {
    // A command every 30 ms, answered OK: there are never 50 ms after one.
    let mut robot = Robot::ready("PROGRAM E\nDELAY 0.1\nEND\n");
    robot.command(Port::Ip0, "RN");
    let mut ms = 0;
    let passed = until_stop(&mut robot, |robot| {
        ms += 1;
        if ms % 30 == 0 {
            assert_eq!(robot.ask(Port::Ip0, "EC,OVRD 50"), b"OK\r");
        }
    });
    assert_eq!(passed, 300);
    // One that does not even wait for its answers gets SP between two of them.
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(50);
    assert!(robot.ask(Port::Ip0, "SU").starts_with(b"FL,MODE"));
    robot.advance_ms(300);
    assert_eq!(robot.received(Port::Ip0), b"", "an exchange is open");
    robot.raw(Port::Ip0, b"\x02OK\r\x03\x02EC,OVRD 60\r\x03\x02EC,OVRD 70\r\x03");
    assert_eq!(
        robot.received(Port::Ip0),
        [frame(b"SP\r"), frame(b"OK\r"), frame(b"OK\r")].concat()
    );
}

// clause: CMD-SP-07 CMD-SP-10
#[test]
fn an_sp_that_a_download_or_a_text_has_held_back_keeps_its_distance_to_the_ok() {
    for (begin, end) in [
        (
            b"\x02DL,LONG\r\x03".as_slice(),
            b"\x02FL,PROGRAM LONG\rEND\r\x1A\x03".as_slice(),
        ),
        (b"\x02EC,OV", b"RD 50\r\x03"),
    ] {
        let mut robot = Robot::ready("PROGRAM E\nDELAY 0.1\nEND\n");
        robot.raw(Port::Ip0, begin);
        robot.panel(PanelAction::Start);
        robot.advance_ms(500);
        robot.received(Port::Ip0);
        robot.raw(Port::Ip0, end);
        assert_eq!(
            robot.received(Port::Ip0),
            frame(b"OK\r"),
            "{}",
            end.escape_ascii()
        );
        // A host that does not pause now postpones it no further.
        robot.advance_ms(30);
        assert_eq!(robot.ask(Port::Ip0, "EC,OVRD 60"), b"OK\r");
        robot.advance_ms(19);
        assert_eq!(robot.received(Port::Ip0), b"");
        robot.advance_ms(1);
        assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"));
    }
}

// clause: CMD-SP-07 SER-02
#[test]
fn a_host_that_sends_whenever_its_line_is_free_is_told_of_a_stop() {
    let mut robot = Robot::with(Config::new(Dialect::Field));
    robot.connect(Port::Host);
    robot.load("E", "PROGRAM E\nDELAY 0.1\nEND\n");
    robot.panel(PanelAction::Servo(true));
    robot.panel(PanelAction::Start);
    robot.raw(Port::Host, b"\x02EC,OVRD 50\r\x03");
    for ms in 0..400 {
        let bytes = robot.received(Port::Host);
        if bytes.windows(2).any(|letters| letters == b"SP") {
            assert!(ms >= 100, "{ms} ms");
            return;
        }
        if bytes.ends_with(b"\x03") {
            robot.raw(Port::Host, b"\x02EC,OVRD 50\r\x03");
        }
        robot.advance_ms(1);
    }
    panic!("no SP within 300 ms of the stop");
}

/// The stop comes while the answer to SU is open, and the SP for it is due when the download begins.
// clause: CMD-SP-07 CMD-SP-10
#[test]
fn an_sp_that_is_overdue_waits_for_the_download_that_begins() {
    let mut robot = Robot::ready("PROGRAM E\nDELAY 0.1\nEND\n");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(60);
    assert!(robot.ask(Port::Ip0, "SU").starts_with(b"FL,MODE"));
    robot.advance_ms(500);
    robot.command(Port::Ip0, "DL,LONG");
    robot.advance_ms(100);
    robot.raw(Port::Ip0, b"\x02FL,PROGRAM LONG\rEND\r\x1A\x03");
    assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"));
    robot.advance_ms(50);
    assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"));
}

// clause: CMD-SP-07 CMD-SP-10
#[test]
fn a_host_whose_segments_always_end_inside_a_text_gets_its_sp() {
    let mut robot = Robot::ready("PROGRAM E\nDELAY 0.1\nEND\n");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(20);
    robot.raw(Port::Ip0, b"\x02EC,OV");
    let mut told = false;
    for _ in 0..40 {
        robot.advance_ms(20);
        robot.raw(Port::Ip0, b"RD 50\r\x03\x02EC,OVRD 60\r\x03\x02EC,OV");
        let received = robot.received(Port::Ip0);
        told |= received.windows(2).any(|letters| letters == b"SP");
    }
    assert!(told);
}

/// A host that asks by SM looks at its fields: the SP that waits is dropped.
// clause: CMD-SP-07
#[test]
fn an_sp_that_waits_is_dropped_when_the_host_asks_by_sm() {
    let mut robot = crate::extensions::scara();
    robot.load("E", "PROGRAM E\nEND\n");
    robot.command(Port::Ip0, "RN");
    // The program is over, and SP would come 50 ms after the OK.
    robot.advance_ms(20);
    let received = robot.ask(Port::Ip0, "SM,1");
    assert!(received.starts_with(b"FL,"), "{received:?}");
    robot.raw(Port::Ip0, b"\x02OK\r\x03");
    robot.advance_ms(1_000);
    let later = robot.received(Port::Ip0);
    let told = |bytes: &[u8]| bytes.windows(2).any(|letters| letters == b"SP");
    assert!(!told(&received) && !told(&later), "{received:?} {later:?}");
}

/// A step whose motion nobody waits for is over when the arm rests: hosts read the position after SP.
// clause: CMD-SP-05
#[test]
fn in_step_mode_the_sp_of_a_step_comes_when_the_arm_rests() {
    let mut robot = Robot::ready("PROGRAM E\nENABLE NOWAIT\nMOVEA 1, 90\nDELAY 1\nEND\n");
    robot.panel(PanelAction::RunMode(RunMode::Step));
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(50);
    assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"), "after ENABLE");
    robot.command(Port::Ip0, "RN");
    let mut moved = 0;
    for _ in 0..5_000 {
        robot.advance_ms(1);
        let moves = !robot.seat.controller.is_idle();
        moved += u32::from(moves);
        if robot.received(Port::Ip0) == frame(b"SP\r") {
            assert!(!moves && moved > 100, "{moved}");
            return;
        }
    }
    panic!("no SP");
}

// clause: CMD-SP-07 CMD-SP-10
#[test]
fn each_stop_has_its_own_sp_and_none_comes_in_a_later_cycle() {
    let mut robot = Robot::ready("PROGRAM E\nDELAY 0.01\nEND\n");
    // The next start comes before SP may: the SP of the stop before it is dropped.
    for _ in 0..10 {
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(20);
    }
    robot.advance_ms(30);
    assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"));
    robot.advance_ms(500);
    assert_eq!(robot.received(Port::Ip0), b"");
    // Where it comes after it, each cycle has its own.
    for _ in 0..10 {
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(60);
        assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"));
    }
    // A stop whose SP waits for an open exchange, and a start within it: of a cycle that outlasts the pause before an SP.
    let mut robot = Robot::ready("PROGRAM E\nDELAY 0.3\nEND\n");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(5);
    assert!(robot.ask(Port::Ip0, "SU").starts_with(b"FL,MODE"));
    robot.advance_ms(600);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(200);
    assert_eq!(robot.received(Port::Ip0), b"", "SP of the former cycle");
    robot.advance_ms(200);
    assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"));
}

// clause: TRN-09 FL-03
#[test]
fn a_command_inside_a_download_ends_it_or_is_a_part_of_it() {
    for ends in [true, false] {
        let mut config = Config::new(Dialect::Field);
        config.options.command_ends_download = ends;
        let mut robot = Robot::with(config);
        robot.connect(Port::Ip0);
        robot.command(Port::Ip0, "DL,CALLS");
        robot.send(Port::Ip0, b"FL,PROGRAM CALLS\r");
        assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"));
        // A call of a subprogram named CA, a text of its own.
        robot.send(Port::Ip0, b"CA\r");
        let answer = robot.received(Port::Ip0);
        if ends {
            assert!(
                answer.starts_with(b"\x02FL,ETHERNET.PAR"),
                "the directory is served"
            );
            robot.send(Port::Ip0, b"OK\r");
            assert_eq!(robot.ask(Port::Ip0, "UL,CALLS"), b"NG\r");
        } else {
            assert_eq!(answer, frame(b"OK\r"));
            robot.send(Port::Ip0, b"END\r\x1A");
            assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"));
            assert_eq!(robot.file(Port::Ip0, "UL,CALLS"), b"PROGRAM CALLS\rCA\rEND\r");
        }
    }
}

// clause: CMD-DL-05 FRM-10
#[test]
fn a_command_without_cr_ends_a_download_only_before_its_file_begins() {
    let mut robot = robot();
    robot.command(Port::Ip0, "DL,CALLS");
    robot.send(Port::Ip0, b"SU");
    assert!(robot.received(Port::Ip0).starts_with(b"\x02FL,MODE:"));
    robot.send(Port::Ip0, b"OK\r");
    assert_eq!(robot.ask(Port::Ip0, "UL,CALLS"), b"NG\r");
    // A text of a file may end anywhere, so also after two letters that a command has.
    robot.command(Port::Ip0, "DL,CALLS");
    for part in [&b"FL,PROGRAM CALLS\r"[..], b"SU", b"M\rEND\r\x1A"] {
        robot.send(Port::Ip0, part);
        assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"));
    }
    assert_eq!(robot.file(Port::Ip0, "UL,CALLS"), b"PROGRAM CALLS\rSUM\rEND\r");
}

// clause: CMD-DL-04 FL-04
#[test]
fn after_a_text_that_is_too_long_the_rest_of_the_file_is_refused_text_by_text() {
    let mut robot = robot();
    robot.command(Port::Ip0, "DL,LONG");
    let long = [b"FL,".as_slice(), &[b'A'; 254]].concat();
    assert_eq!(robot.ask(Port::Ip0, str::from_utf8(&long).unwrap()), b"NG\r");
    robot.send(Port::Ip0, &[b'B'; DATA]);
    assert_eq!(unframe(&robot.received(Port::Ip0)).unwrap(), b"NG\r");
    assert!(robot.file(Port::Ip0, "SU").starts_with(b"MODE:"));
}

// clause: S85
#[test]
fn the_controller_sends_fl_ok_and_ng_and_the_sp_that_it_sends_by_itself() {
    for model in [ArmModel::tv800(), ArmModel::thl400()] {
        let mut config = Config::new(Dialect::Field);
        config.model = model;
        config.options.unsolicited_sp = UnsolicitedSp::Always;
        let mut robot = Robot::with(config);
        robot.load("TEST", "PROGRAM TEST\nDELAY 1\nEND\n");
        robot.connect(Port::Ip0);
        // RAM files, the directory, status, history, versions, a variable, the active alarms.
        for command in ["UL,USER.PAR", "UL,TEST", "CA", "SU", "EU", "VR", "AC"] {
            assert!(robot.ask(Port::Ip0, command).starts_with(b"FL,"), "{command}");
            robot.send(Port::Ip0, b"OK\r");
        }
        robot.total(Port::Ip0);
        for (command, answer) in [
            ("SO", b"OK\r"),
            ("XX", b"NG\r"),
            ("SL,NONE", b"NG\r"),
            ("RN", b"OK\r"),
        ] {
            assert_eq!(robot.ask(Port::Ip0, command), answer, "{command}");
        }
        robot.advance_ms(2_000);
        assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"));
    }
}
