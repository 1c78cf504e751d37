//! Exchanges in virtual time, against replies written down by hand.

use super::*;

const PAUSE: Duration = HOST_DELAY;

/// A host that has sent this command at 0 ms.
fn asked(command: &Command) -> Conversation {
    let mut host = Conversation::new(Options::with_stx());
    host.request(command);
    assert!(host.poll_transmit(Duration::ZERO).is_some());
    host
}

fn ms(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

/// The bytes that the host sends at its next deadline.
fn sent(host: &mut Conversation) -> String {
    let deadline = host.deadline().unwrap();
    let bytes = host.poll_transmit(deadline).unwrap();
    bytes.escape_ascii().to_string()
}

fn events(host: &mut Conversation) -> Vec<Event> {
    std::iter::from_fn(|| host.poll_event()).collect()
}

fn responses(host: &mut Conversation) -> Vec<Response> {
    let response = |event| match event {
        Event::Response(response) => response,
        other => panic!("{other:?}"),
    };
    events(host).into_iter().map(response).collect()
}

fn content(data: &[u8]) -> Response {
    Response::Content(data.to_vec())
}

#[test]
fn a_command_is_answered_by_ok_or_ng_in_pieces_of_any_size() {
    for (reply, expected) in [
        (b"\x02OK\r\x03".as_slice(), Response::Ok),
        (b"\x02NG\r\x03", Response::Ng),
    ] {
        for size in 1..=reply.len() {
            let mut host = asked(&Command::So);
            for piece in reply.chunks(size) {
                assert_eq!(host.poll_event(), None);
                host.receive(ms(1), piece);
            }
            assert_eq!(responses(&mut host), std::slice::from_ref(&expected));
            assert_eq!(host.deadline(), None);
        }
    }
}

// clause: TRN-04
#[test]
fn each_text_of_a_file_is_acknowledged_after_the_pause() {
    let mut host = asked(&Command::Ca);
    host.receive(ms(7), b"\x02FL,A 1\r\x03");
    assert_eq!(host.deadline(), Some(ms(7) + PAUSE));
    assert_eq!(host.poll_transmit(ms(56)), None);
    assert_eq!(sent(&mut host), "\\x02OK\\r\\x03");
    host.receive(ms(60), b"\x02B 2\r\x1a\x03");
    assert_eq!(events(&mut host), [], "it is complete with the acknowledgement");
    assert_eq!(sent(&mut host), "\\x02OK\\r\\x03");
    assert_eq!(responses(&mut host), [content(b"A 1\rB 2\r")]);
}

#[test]
fn the_first_text_is_sent_at_once_and_the_next_one_after_the_pause() {
    let mut host = asked(&Command::So);
    host.receive(ms(3), b"\x02OK\r\x03");
    host.request(&Command::Br);
    assert_eq!(host.deadline(), Some(ms(3) + PAUSE));
    host.send_at_once(b"\x02SP\r\x03".to_vec(), Expected::Acknowledgement);
    assert!(host.poll_transmit(ms(3)).is_some());
}

#[test]
fn a_file_is_sent_in_texts_that_are_answered_one_by_one() {
    let mut host = Conversation::new(Options::with_stx());
    host.send_file("A".repeat(300));
    assert_eq!(sent(&mut host).len(), "\\x02FL,\\x03".len() + 250);
    host.receive(ms(1), b"\x02OK\r\x03");
    assert_eq!(sent(&mut host), format!("\\x02{}\\x1a\\x03", "A".repeat(50)));
    host.receive(ms(99), b"\x02OK\r\x03");
    assert_eq!(responses(&mut host), [Response::Ok]);

    host.send_file("A".repeat(300));
    sent(&mut host);
    host.receive(ms(200), b"\x02NG\r\x03");
    assert_eq!(responses(&mut host), [Response::Ng]);
}

// clause: SF-02 SF-03
#[test]
fn sf_is_read_by_its_length_in_each_of_its_forms() {
    // ETX, EOF and STX inside of it are data.
    let mut six = vec![0; SfLayout::Six.len()];
    (six[10], six[11], six[12], six[141]) = (ETX, EOF, STX, 1);
    let mut eight = vec![7; SfLayout::Eight.len()];
    (eight[10], eight[11], eight[12]) = (ETX, EOF, STX);
    // In the second of two texts, too.
    eight[260] = ETX;
    let (first, rest) = eight.split_at(250);
    for (texts, expected) in [
        (vec![[FL, &six].concat()], &six),
        (vec![[FL, &eight, b"\x1a"].concat()], &eight),
        (vec![[FL, first].concat(), [rest, b"\x1a"].concat()], &eight),
    ] {
        for size in [1, 100, 1_000] {
            let mut host = asked(&Command::Sf);
            for text in &texts {
                // Noise before the text does not shift its length.
                let bytes = [b"AB\x02", text.as_slice(), b"\x03"].concat();
                for piece in bytes.chunks(size) {
                    host.receive(ms(1), piece);
                }
                assert_eq!(sent(&mut host), "\\x02OK\\r\\x03");
            }
            let mut found = events(&mut host);
            found.retain(|event| !matches!(event, Event::Skipped { .. }));
            assert_eq!(found, [Event::Response(content(expected))]);
        }
    }
}

#[test]
fn io_is_read_with_and_without_its_end() {
    let words = [ETX; io::LENGTH];
    for end in [&b""[..], b"\x1a", b"\x1a\r"] {
        let mut host = asked(&Command::parse(b"IO,1").unwrap());
        host.receive(ms(1), &[b"\x02FL,", words.as_slice(), end, b"\x03"].concat());
        assert_eq!(sent(&mut host), "\\x02OK\\r\\x03");
        assert_eq!(responses(&mut host), [content(&words)]);
    }
}

// clause: CMD-SP-05
#[test]
fn an_sp_is_an_event_of_its_own() {
    for command in [Command::So, Command::Sf, Command::Su] {
        let mut host = asked(&command);
        host.receive(ms(1), b"\x02SP\r\x03\x02NG\r\x03");
        assert_eq!(
            events(&mut host),
            [Event::Stopped, Event::Response(Response::Ng)],
            "{command:?}"
        );
    }
    let mut host = Conversation::new(Options::with_stx());
    host.expect(ms(0), Expected::Stop);
    assert_eq!(host.deadline(), None);
    host.receive(ms(9_000), b"\x02SP\r\x03");
    assert_eq!(
        (host.poll_event(), host.expected()),
        (Some(Event::Stopped), Expected::Nothing)
    );
}

#[test]
fn an_sp_begins_the_pause_again() {
    let mut host = asked(&Command::So);
    host.receive(ms(1), b"\x02OK\r\x03");
    host.request(&Command::Br);
    host.receive(ms(40), b"\x02SP\r\x03");
    assert_eq!(host.deadline(), Some(ms(40) + PAUSE));
}

#[test]
fn another_reply_than_the_expected_one_ends_the_exchange() {
    for (command, reply, expected) in [
        (Command::So, &b"\x02FL,A\x1a\x03"[..], Expected::Acknowledgement),
        (Command::Su, b"\x02OK\r\x03", Expected::Content),
        (Command::Sf, b"\x02OK\r\x03", Expected::SystemStatus),
        (Command::Sf, b"\x02WHAT\r\x03", Expected::SystemStatus),
    ] {
        let mut host = asked(&command);
        host.receive(ms(1), reply);
        let [Event::Failed(ExchangeError::Unexpected { expected: found, .. })] = events(&mut host)[..] else {
            panic!("{command:?}");
        };
        assert_eq!(found, expected, "{command:?}");
        assert_eq!(host.deadline(), None);
    }
}

#[test]
fn a_text_that_nothing_asked_for_is_unexpected() {
    let mut host = asked(&Command::So);
    host.receive(ms(1), b"\x02OK\r\x03\x02OK\r\x03");
    let found = events(&mut host);
    assert_eq!(found[0], Event::Response(Response::Ok));
    assert!(
        matches!(
            found[1],
            Event::Failed(ExchangeError::Unexpected {
                expected: Expected::Nothing,
                ..
            })
        ),
        "{found:?}"
    );
}

#[test]
fn a_late_reply_is_a_timeout() {
    let mut host = asked(&Command::So);
    host.receive(ms(1), b"\x02O");
    let due = host.options().timeout;
    assert_eq!(host.deadline(), Some(due));
    host.handle_timeout(due - ms(1));
    assert_eq!(host.poll_event(), None);
    assert!(host.is_partial());
    host.handle_timeout(due);
    let expected = Expected::Acknowledgement;
    assert_eq!(
        events(&mut host),
        [Event::Failed(ExchangeError::Timeout { expected })]
    );
}

#[test]
fn bytes_outside_a_text_are_skipped_where_stx_is_required() {
    for command in [Command::So, Command::Sf] {
        let mut host = asked(&command);
        host.receive(ms(1), b"AB\x02NG\r\x03");
        let skipped = Event::Skipped { bytes: 2 };
        assert_eq!(events(&mut host), [skipped, Event::Response(Response::Ng)]);
    }
    let mut host = Conversation::new(Options::without_stx());
    host.request(&Command::Su);
    assert_eq!(host.poll_transmit(ms(0)).unwrap(), b"SU\r\x03");
    host.receive(ms(1), b"FL,A\x1a\x03");
    assert_eq!(sent(&mut host), "OK\\r\\x03");
    assert_eq!(responses(&mut host), [content(b"A")]);
}

// clause: FRM-15
#[test]
fn texts_have_their_checksums() {
    let options = Options {
        checksum: Checksum::Sum,
        ..Options::with_stx()
    };
    for (damage, is_read) in [(0, true), (1, false)] {
        let mut host = Conversation::new(options);
        host.request(&Command::Sf);
        assert_eq!(host.poll_transmit(ms(0)).unwrap(), options.text(b"SF\r"));
        host.receive(ms(1), &options.text(b"SP\r"));
        assert_eq!(host.poll_event(), Some(Event::Stopped));
        let status = [[ETX; 150], [b' '; 150]].concat();
        let status = &status[..SfLayout::Eight.len()];
        let mut text = options.text(&[FL, status, b"\x1a"].concat());
        *text.last_mut().unwrap() ^= damage;
        host.receive(ms(2), &text);
        if is_read {
            sent(&mut host);
            assert_eq!(responses(&mut host), [content(status)]);
        } else {
            assert!(matches!(host.poll_event(), Some(Event::Failed(_))));
        }
    }
}

#[test]
fn a_file_goes_on_after_its_first_text_was_looked_at() {
    let mut host = Conversation::new(Options::with_stx());
    host.begin_pause(ms(10));
    host.send(b"CA\r", Expected::Text);
    assert_eq!(host.poll_transmit(ms(59)), None);
    assert_eq!(sent(&mut host), "\\x02CA\\r\\x03");
    assert_eq!(host.sent_at(), Some(ms(10) + PAUSE));
    host.receive(ms(70), b"\x02FL,A 1\r\x03");
    let Some(Event::Text(first)) = host.poll_event() else {
        panic!("no text");
    };
    assert_eq!(host.deadline(), None, "it is not acknowledged yet");
    host.continue_file(first);
    assert_eq!(sent(&mut host), "\\x02OK\\r\\x03");
    host.receive(ms(200), b"\x02B 2\r\x1a\x03");
    assert_eq!(sent(&mut host), "\\x02OK\\r\\x03");
    assert_eq!(responses(&mut host), [content(b"A 1\rB 2\r")]);
}
