//! Questions that need a file of the survey's own name.

use super::ROW;
use crate::probe::{Ask, Class, Probe};
use crate::session::{FILE, ProbeError, Reply, Session};
use ts3100_proto::status::ca::decode_directory;

const FILES: Probe = Probe {
    class: Class::Files,
    ..ROW
};

/// A small program, whose bytes are compared.
const SOURCE: &str = "PROGRAM SURVEY\r\nEND\r\n";
/// Longest line that a file may have by the manual.
const LONGEST_LINE: usize = 252;

pub(super) const PROBES: &[Probe] = &[
    Probe {
        id: "file-round-trip",
        question: "Does a file come back byte for byte?",
        sends: "DL, FL, UL, ER of TSSURVEY",
        ask: Ask::Word(|session| {
            session.store(SOURCE)?;
            let content = session.content(&format!("UL,{FILE}"))?;
            let content = content.ok_or_else(|| ProbeError::Refused("UL got NG".to_owned()))?;
            Ok(match content == SOURCE.as_bytes() {
                true => "the same bytes",
                false => "other bytes",
            })
        }),
        readings: &["the same bytes", "other bytes"],
        ..FILES
    },
    Probe {
        id: "file-size",
        question: "Which size does CA show?",
        sends: "DL, FL, CA, ER of TSSURVEY",
        ask: Ask::Word(|session| {
            session.store(SOURCE)?;
            let more = size(session)?.map(|size| size.cast_signed() - SOURCE.len().cast_signed());
            Ok(match more {
                Some(0) => "without EOF",
                Some(1) => "with EOF",
                Some(_) => "another size",
                None => "no such file",
            })
        }),
        readings: &["without EOF", "with EOF"],
        is_public: false,
        ..FILES
    },
    Probe {
        id: "file-name-case",
        question: "Is a file found whose name is sent in lower case?",
        sends: "DL of TSSURVEY, UL of tssurvey",
        ask: Ask::Word(|session| {
            session.store(SOURCE)?;
            let found = session.content(&format!("UL,{}", FILE.to_ascii_lowercase()))?;
            Ok(if found.is_some() { "found" } else { "NG" })
        }),
        readings: &["found", "NG"],
        ..FILES
    },
    Probe {
        id: "command-in-download",
        question: "Does a command end a download when it comes instead of a text of the file?",
        sends: "DL of TSSURVEY, half of a program, then EU",
        ask: Ask::Steps(command_in_download),
        readings: &["the command is served", "it is a part of the file"],
        decides: Some(("dl.command_ends", &["true", "false"])),
        is_public: false,
        ..FILES
    },
    Probe {
        id: "file-without-download",
        question: "What is answered to a file without DL?",
        sends: "FL without DL",
        ask: Ask::Bytes("<STX>FL,X<EOF><ETX>"),
        readings: &["NG", "silence", "OK"],
        ..FILES
    },
    Probe {
        id: "file-tab",
        question: "Is a file with a TAB refused?",
        sends: "DL of TSSURVEY with a TAB in it",
        ask: Ask::Word(|session| stored(session, b"PROGRAM SURVEY\r\n\tA = 1\r\nEND\r\n")),
        readings: &["refused", "stored"],
        ..FILES
    },
    Probe {
        id: "file-high-byte",
        question: "Is a file with a byte from 80 hex on refused?",
        sends: "DL of TSSURVEY with a byte B0 hex in a comment",
        ask: Ask::Word(|session| stored(session, b"PROGRAM SURVEY\r\n'90 \xB0\r\nEND\r\n")),
        readings: &["refused", "stored"],
        ..FILES
    },
    Probe {
        id: "file-long-line",
        question: "Is a file with a line of more than 252 characters refused?",
        sends: "DL of TSSURVEY with a comment of 300 characters",
        ask: Ask::Word(|session| {
            let comment = "-".repeat(LONGEST_LINE + 48);
            stored(
                session,
                format!("PROGRAM SURVEY\r\n'{comment}\r\nEND\r\n").as_bytes(),
            )
        }),
        readings: &["refused", "stored"],
        ..FILES
    },
    Probe {
        id: "erase-absent",
        question: "What is answered to ER of a file that is not there?",
        sends: "ER of TSSURVEY when it is erased",
        ask: Ask::Word(|session| {
            session.store(SOURCE)?;
            session.command(&format!("ER,{FILE}"))?;
            session.acknowledgement(&format!("ER,{FILE}"))
        }),
        readings: &["NG", "OK"],
        ..FILES
    },
];

/// The size of the survey's file in the directory.
pub(crate) fn size(session: &mut Session<'_>) -> Result<Option<usize>, ProbeError> {
    let entries = decode_directory(&session.file("CA")?)
        .map_err(|_| ProbeError::Unexpected("the answer to CA has no form that is known".to_owned()))?;
    let mine = entries.iter().find(|entry| entry.name == FILE);
    Ok(mine.and_then(|entry| usize::try_from(entry.size).ok()))
}

fn stored(session: &mut Session<'_>, content: &[u8]) -> Result<&'static str, ProbeError> {
    Ok(match session.try_to_store(content)? {
        true => "stored",
        false => "refused",
    })
}

fn command_in_download(session: &mut Session<'_>) -> Result<Reply, ProbeError> {
    session.command(&format!("DL,{FILE}"))?;
    if session.reply_kind_to("FL,PROGRAM SURVEY\r")? != "OK" {
        return Err(ProbeError::Refused("the file was refused".to_owned()));
    }
    match session.reply_kind_to("EU\r")?.as_str() {
        "answer" => Ok("the command is served".to_owned()),
        "OK" => {
            // The download goes on: its end makes a file of it.
            let heard = session.reply_kind_to("END\r\x1a")?;
            Ok(match heard.as_str() {
                "OK" => "it is a part of the file".to_owned(),
                other => format!("OK, and then {other}"),
            })
        }
        other => Ok(other.to_owned()),
    }
}
