//! Questions that change nothing.

use super::ROW;
use crate::forms;
use crate::peer::{Connection, PeerError};
use crate::probe::{Ask, Probe};
use crate::session::{PATIENCE, ProbeError, Reply, Session};
use std::time::Duration;
use ts3100_proto::status::mn::MaintenanceItem;
use ts3100_proto::status::sm::QuickStatus;
use ts3100_proto::text::{Checksum, EOF, Framing, MAX_DATA, STX};

/// How soon a controller that closes a second connection does so.
const SECOND: Duration = Duration::from_secs(1);
/// An answer later than this does not measure a pause of 50 ms.
const PROMPT: Duration = Duration::from_millis(40);
/// A pause inside a text that every controller allows, and one that the manual does not.
const ALLOWED_PAUSE: Duration = Duration::from_secs(6);
const FORBIDDEN_PAUSE: Duration = Duration::from_secs(11);
/// Data bytes of a text that is too long; the manual allows 253.
const TOO_LONG: usize = 300;

/// One whose answers show what is the user's.
const PRIVATE: Probe = Probe {
    is_public: false,
    ..ROW
};

pub(super) const PROBES: &[Probe] = &[
    Probe {
        id: "checksum",
        question: "Does a text end with a checksum?",
        sends: "SU without and with a checksum",
        ask: Ask::Word(|session| {
            Ok(match session.checksum() {
                Checksum::None => "none",
                Checksum::Sum => "sum",
            })
        }),
        readings: &["none", "sum"],
        decides: Some(("text.checksum", &["none", "sum"])),
        ..ROW
    },
    Probe {
        id: "stx",
        question: "Is a text without STX answered?",
        sends: "SU<CR><ETX>",
        ask: Ask::Bytes("SU<CR><ETX>"),
        readings: &["answer without STX", "silence", "answer"],
        decides: Some(("text.stx", &["detect", "required"])),
        ..ROW
    },
    Probe {
        id: "cr",
        question: "Is a command without CR served?",
        sends: "<STX>SU<ETX>",
        ask: Ask::Bytes("<STX>SU<ETX>"),
        readings: &["answer", "NG"],
        decides: Some(("text.require_cr", &["false", "true"])),
        ..ROW
    },
    Probe {
        id: "lower-case",
        question: "Is a command in lower case served?",
        sends: "<STX>su<CR><ETX>",
        ask: Ask::Bytes("<STX>su<CR><ETX>"),
        readings: &["answer", "NG", "silence"],
        ..ROW
    },
    Probe {
        id: "restart",
        question: "Does STX inside an unfinished text begin a new one?",
        sends: "<STX>VR<STX>SU<CR><ETX>",
        ask: Ask::Bytes("<STX>VR<STX>SU<CR><ETX>"),
        readings: &["answer", "NG", "silence"],
        ..ROW
    },
    Probe {
        id: "over-long",
        question: "What is answered to a text of more than 253 data bytes?",
        sends: "<STX>AAA... 300 bytes<CR><ETX>",
        ask: Ask::Steps(over_long),
        readings: &["NG", "silence"],
        ..ROW
    },
    Probe {
        id: "long-message",
        question: "Is a command of more than 253 data bytes taken from two texts?",
        sends: "SU and 300 blanks, in two texts",
        ask: Ask::Steps(long_message),
        readings: &["silence, answer", "NG, NG", "NG, silence"],
        ..ROW
    },
    Probe {
        id: "unknown-command",
        question: "What is answered to a command that does not exist?",
        sends: "QQ",
        ask: Ask::Bytes("<STX>QQ<CR><ETX>"),
        readings: &["NG", "silence"],
        ..ROW
    },
    Probe {
        id: "unasked-ok",
        question: "What is answered to an OK that nobody awaits?",
        sends: "OK",
        ask: Ask::Bytes("<STX>OK<CR><ETX>"),
        readings: &["silence", "NG"],
        ..ROW
    },
    Probe {
        id: "command-in-exchange",
        question: "Is a command served that comes instead of the OK to a status?",
        sends: "SU, then SU again instead of OK",
        ask: Ask::Steps(command_in_exchange),
        readings: &["answer", "NG", "silence"],
        ..ROW
    },
    Probe {
        id: "pause",
        question: "Is a command served that comes within 50 ms after a text of the controller?",
        sends: "QQ, and at once SU",
        ask: Ask::Steps(within_the_pause),
        readings: &["answer", "silence"],
        decides: Some(("strict_50ms", &["false", "true"])),
        ..ROW
    },
    Probe {
        id: "second-connection",
        question: "What happens to a second connection to the same port?",
        sends: "a connection, and SU on it or on the first",
        ask: Ask::Word(second_connection),
        readings: &["the first stays", "the second replaces it", "both are served"],
        decides: Some(("channel.second", &["refuse", "replace"])),
        ..ROW
    },
    Probe {
        id: "status-form",
        question: "Which form has SU?",
        sends: "SU",
        ask: Ask::Form("SU", forms::status),
        readings: &["one record", "six records"],
        decides: Some(("su.layout", &["one-record", "six-records"])),
        ..ROW
    },
    Probe {
        id: "versions-form",
        question: "Which form has VR?",
        sends: "VR",
        ask: Ask::Form("VR", forms::versions),
        readings: &["blanks", "packed"],
        decides: Some(("vr.layout", &["blanks", "packed"])),
        ..ROW
    },
    Probe {
        id: "directory-form",
        question: "Which form has CA?",
        sends: "CA",
        ask: Ask::Form("CA", forms::directory),
        readings: &[
            "one blank, alphabetical",
            "one blank, another order",
            "other blanks, alphabetical",
            "other blanks, another order",
        ],
        ..PRIVATE
    },
    Probe {
        id: "history-form",
        question: "Which form has EU?",
        sends: "EU",
        ask: Ask::Form("EU", forms::history),
        readings: &["a count, and its errors"],
        ..PRIVATE
    },
    Probe {
        id: "total-status-texts",
        question: "In how many texts does SF travel?",
        sends: "SF",
        ask: Ask::Word(|session| Ok(session.total_status()?.0)),
        readings: &["one text, six axes", "several texts, six axes", "one text, SCARA"],
        decides: Some(("sf.split", &["one", "several"])),
        with_other_arm: Some("one text, SCARA"),
        ..PRIVATE
    },
    Probe {
        id: "extensions",
        question: "Are commands served that the six-axis manual does not have?",
        sends: "SM,1 and HI,1 8",
        ask: Ask::Word(extensions),
        readings: &["served", "NG", "served on a SCARA arm"],
        decides: Some(("extensions", &["true", "false"])),
        with_other_arm: Some("served on a SCARA arm"),
        ..PRIVATE
    },
    Probe {
        id: "quick-status-form",
        question: "Which form has SM?",
        sends: "SM,1",
        ask: Ask::Steps(|session| {
            let content = session.file("SM,1")?;
            let items = content.split(|byte| *byte == b' ').count();
            Ok(match QuickStatus::decode(&content) {
                Ok(_) => format!("{items} items"),
                Err(_) => forms::OTHER.to_owned(),
            })
        }),
        readings: &["14 items"],
        ..ROW
    },
    Probe {
        id: "input-word",
        question: "How does HI write the state of eight inputs?",
        sends: "HI,1 8",
        ask: Ask::Form("HI,1 8", |content| {
            let text = String::from_utf8_lossy(content);
            let digits = text.trim_end_matches('\r');
            match digits.parse::<u8>() {
                Ok(_) if !digits.starts_with('+') => "a decimal number",
                Ok(_) | Err(_) => forms::OTHER,
            }
        }),
        readings: &["a decimal number"],
        ..PRIVATE
    },
    Probe {
        id: "line-words",
        question: "How does IO end?",
        sends: "IO,1",
        ask: Ask::Word(|session| {
            let burst = session.raw_reply("IO,1")?;
            let sum = usize::from(session.checksum() == Checksum::Sum);
            let text = burst.get(..burst.len() - sum).unwrap_or_default();
            let data = text.get(1..text.len().saturating_sub(1)).unwrap_or_default();
            let Some(content) = data.strip_prefix(b"FL,".as_slice()) else {
                return Err(ProbeError::Refused("IO,1 got NG".to_owned()));
            };
            session.acknowledge()?;
            Ok(match content.len() {
                80 => "80 bytes without EOF",
                81 if content.last() == Some(&EOF) => "80 bytes and EOF",
                _ => forms::OTHER,
            })
        }),
        readings: &["80 bytes without EOF", "80 bytes and EOF"],
        ..PRIVATE
    },
    Probe {
        id: "maintenance-form",
        question: "Which form has MN?",
        sends: "MN,17",
        ask: Ask::Form("MN,17", |content| match MaintenanceItem::decode(content) {
            Ok(_) if content.ends_with(b"\r") => "a record that ends in CR",
            Ok(_) => "a record without CR",
            Err(_) => forms::OTHER,
        }),
        readings: &["a record that ends in CR", "a record without CR"],
        ..PRIVATE
    },
    Probe {
        id: "parameter-line-end",
        question: "How do the lines of USER.PAR end?",
        sends: "UL,USER.PAR",
        ask: Ask::Form("UL,USER.PAR", forms::line_end),
        readings: &["LF", "CR", "CR LF"],
        decides: Some(("parameter.line_end", &["lf", "cr"])),
        ..PRIVATE
    },
    Probe {
        id: "open-mode",
        question: "How are the channels opened?",
        sends: "UL,ETHERNET.PAR",
        ask: Ask::Steps(|session| {
            let content = session.file("UL,ETHERNET.PAR")?;
            Ok(forms::open_mode(&content).unwrap_or_else(|| forms::OTHER.to_owned()))
        }),
        readings: &["1 1 1 1", "*"],
        decides: Some(("drive.open_mode", &["1 1 1 1", "*"])),
        ..PRIVATE
    },
    Probe {
        id: "while-sending",
        question: "Are characters received on HOST while the controller sends?",
        sends: "SU, and SU again while the answer comes; serial lines only",
        ask: Ask::Word(while_sending),
        readings: &["lost", "received"],
        decides: Some(("serial.while_sending", &["lost", "kept"])),
        ..ROW
    },
    Probe {
        id: "character-limit",
        question: "Is a text dropped after a pause of more than 10 s inside it?",
        sends: "SU with a pause of 6 s, and of 11 s, after STX",
        ask: Ask::Word(character_limit),
        readings: &["served after 6 s, dropped after 11 s", "served after 11 s"],
        is_slow: true,
        ..ROW
    },
];

fn over_long(session: &mut Session<'_>) -> Result<Reply, ProbeError> {
    session.reply_kind_to(&format!("{}\r", "A".repeat(TOO_LONG)))
}

/// The first text is full, the second one has the end.
fn long_message(session: &mut Session<'_>) -> Result<Reply, ProbeError> {
    let message = format!("SU{}\r", " ".repeat(TOO_LONG));
    let (first, second) = message.split_at(MAX_DATA);
    let first = session.reply_kind_to(first)?;
    let second = session.reply_kind_to(second)?;
    Ok(format!("{first}, {second}"))
}

fn command_in_exchange(session: &mut Session<'_>) -> Result<Reply, ProbeError> {
    let first = session.request("SU")?;
    if !first.data.starts_with(b"FL,") {
        return Err(ProbeError::Refused("SU got NG".to_owned()));
    }
    session.reply_kind_to("SU\r")
}

fn within_the_pause(session: &mut Session<'_>) -> Result<Reply, ProbeError> {
    if session.is_accepted("QQ")? {
        return Err(ProbeError::Refused(
            "QQ, which is not a command, got OK".to_owned(),
        ));
    }
    let (asked, answered) = session.request_times();
    let text = session.text("SU\r");
    session.send_at_once(&text)?;
    let is_prompt = session.now().saturating_sub(answered) < PROMPT;
    let heard = session.receive()?;
    let heard = session.kind_of(heard)?;
    // A controller that takes its time may have begun to count before its answer was here.
    let is_exact = answered.saturating_sub(asked) < PROMPT || session.is_serial();
    Ok(match is_prompt && is_exact {
        true => heard,
        false => "too slow to tell".to_owned(),
    })
}

fn second_connection(session: &mut Session<'_>) -> Result<&'static str, ProbeError> {
    session.open(Connection::Second)?;
    let second = session.receive_bytes(Connection::Second, SECOND);
    let heard = match second {
        Err(PeerError::Closed) => {
            session.status()?;
            "the first stays"
        }
        Err(error) => return Err(error.into()),
        Ok(bytes) if !bytes.is_empty() => "a greeting",
        Ok(_) => {
            let text = session.text("SU\r");
            let asked = session.send_bytes(Connection::Second, &text);
            let answered = asked.and_then(|()| session.receive_bytes(Connection::Second, PATIENCE));
            let has_answer = answered.is_ok_and(|bytes| bytes.starts_with(&[STX]));
            match (has_answer, session.is_closed()) {
                (true, true) => "the second replaces it",
                (true, false) => "both are served",
                (false, _) => "the second is silent",
            }
        }
    };
    session.close(Connection::Second);
    if heard != "the first stays" {
        session.reopen()?;
    }
    Ok(heard)
}

fn extensions(session: &mut Session<'_>) -> Result<&'static str, ProbeError> {
    // Two of them: one alone may be refused for another reason.
    let quick_status = session.content("SM,1")?.is_some();
    let inputs = session.content("HI,1 8")?.is_some();
    let is_scara = session.total_status()?.0 == "one text, SCARA";
    Ok(match (quick_status, inputs, is_scara) {
        (true, true, true) => "served on a SCARA arm",
        (true, true, false) => "served",
        (false, false, _) => "NG",
        (true, false, _) | (false, true, _) => "some of them",
    })
}

fn while_sending(session: &mut Session<'_>) -> Result<&'static str, ProbeError> {
    if !session.is_serial() {
        return Err(ProbeError::Refused("only a serial line takes turns".to_owned()));
    }
    let text = session.text("SU\r");
    session.wait(PATIENCE)?;
    session.send_at_once(&text)?;
    session.wait_for_byte()?;
    session.send_at_once(&text)?;
    let first = session.receive()?;
    if first.is_none() {
        return Err(ProbeError::Timeout("no reply to SU".to_owned()));
    }
    // Received: it is a command instead of OK. Lost: the exchange still waits for its OK.
    let second = session.receive()?;
    let heard = if second.is_some() { "received" } else { "lost" };
    session.acknowledge()?;
    Ok(heard)
}

fn character_limit(session: &mut Session<'_>) -> Result<&'static str, ProbeError> {
    let mut heard = Vec::new();
    for pause in [ALLOWED_PAUSE, FORBIDDEN_PAUSE] {
        let text = session.text("SU\r");
        let (begin, end) = text.split_at(1);
        session.wait(PATIENCE / 10)?;
        session.send_at_once(begin)?;
        session.wait(pause)?;
        session.send_at_once(end)?;
        let answer = session.receive()?;
        // The rest of a dropped text is one without STX to a controller that takes such texts.
        let is_whole = answer.as_ref().is_some_and(|text| text.framing == Framing::Stx);
        session.kind_of(answer)?;
        heard.push(is_whole);
    }
    Ok(match heard.as_slice() {
        [true, true] => "served after 11 s",
        [true, false] => "served after 6 s, dropped after 11 s",
        _ => "dropped after 6 s",
    })
}
