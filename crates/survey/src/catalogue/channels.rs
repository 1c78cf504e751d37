//! Questions to PRINT and INPUT. No axis moves.

use super::program::{PROGRAM, SETTLED, computes, plain};
use crate::peer::Connection;
use crate::probe::{Ask, Probe};
use crate::session::{PATIENCE, ProbeError, QUIET, Reply, Session};
use ts3100_proto::escape::Escaped;
use ts3100_proto::status::ExecutionStatus;

pub(super) const PROBES: &[Probe] = &[
    Probe {
        id: "print-without-peer",
        question: "What does PRINT do on IP1 while nobody is connected?",
        sends: "a program: PRINT IP1, R = 1; nobody connected to IP1",
        ask: Ask::Stops(computes!("PRINT IP1, \"SURVEY\", CR\r\nR = 1\r\n")),
        readings: &["stopped", "1"],
        decides: Some(("channel.no_peer", &["alarm", "silent"])),
        ..PROGRAM
    },
    Probe {
        id: "print-numbers",
        question: "How are numbers printed?",
        sends: "a program: PRINT IP1 of 7 and 0.0625; a connection to IP1",
        ask: Ask::Steps(|session| {
            prints(
                session,
                computes!("N = 7\r\nA = 0.0625\r\nPRINT IP1, N, A, CR\r\n"),
            )
        }),
        readings: &["           7       0.063<CR>", "           7       0.062<CR>"],
        ..PROGRAM
    },
    Probe {
        id: "print-too-wide",
        question: "How is a number printed that needs more than 12 characters?",
        sends: "a program: PRINT IP1 of -1234567936.0; a connection to IP1",
        ask: Ask::Steps(|session| prints(session, computes!("A = -1234567936.0\r\nPRINT IP1, A, CR\r\n"))),
        readings: &["************<CR>", "-1234567936.000<CR>"],
        ..PROGRAM
    },
    Probe {
        id: "input-malformed",
        question: "What does INPUT do with something that is not a number?",
        sends: "a program: INPUT IP1; a connection to IP1 that sends 12mm",
        ask: Ask::Steps(|session| {
            inputs(
                session,
                computes!("N = 5\r\nINPUT IP1, N\r\nR = N\r\n"),
                b"12mm\r",
            )
        }),
        // 0 is 1 as the first number of [U25], which says nothing about the option.
        readings: &["an alarm", "12", "0"],
        decides: Some(("input.malformed", &["alarm", "leading-number"])),
        ..PROGRAM
    },
    Probe {
        id: "input-empty",
        question: "What is an empty field to INPUT?",
        sends: "a program: INPUT IP1 of three numbers; a connection to IP1 that sends 1,,2",
        ask: Ask::Steps(|session| {
            let program =
                computes!("A = 5\r\nB = 5\r\nC = 5\r\nINPUT IP1, A, B, C\r\nR = A*100 + B*10 + C\r\n");
            inputs(session, program, b"1,,2\r")
        }),
        readings: &["102", "an alarm"],
        ..PROGRAM
    },
    Probe {
        id: "input-blanks",
        question: "Do LF and blanks around a number count for INPUT?",
        sends: "a program: INPUT IP1 of two numbers; a connection to IP1 that sends blanks and LF with them",
        ask: Ask::Steps(|session| {
            let program = computes!("A = 5\r\nB = 5\r\nINPUT IP1, A, B\r\nR = A*10 + B\r\n");
            inputs(session, program, b" 1 ,\n 2\r\n")
        }),
        readings: &["12", "an alarm"],
        ..PROGRAM
    },
    Probe {
        id: "print-long",
        question: "How much of a PRINT of 300 bytes is sent?",
        sends: "a program: PRINT IP1 of 25 numbers; a connection to IP1",
        ask: Ask::Steps(|session| {
            let source = format!(
                "PROGRAM SURVEY\r\nN = 1\r\nPRINT IP1, {}CR\r\nEND\r\n",
                "N, ".repeat(25)
            );
            Ok(format!(
                "{} bytes",
                prints(session, &source)?.replace("<CR>", "\r").len()
            ))
        }),
        readings: &["256 bytes", "255 bytes", "301 bytes"],
        is_public: false,
        ..PROGRAM
    },
    Probe {
        id: "input-overflow",
        question: "What is a number of more than 32 bits to INPUT?",
        sends: "a program: INPUT IP1; a connection to IP1 that sends 99999999999",
        ask: Ask::Steps(|session| {
            inputs(
                session,
                computes!("N = 5\r\nINPUT IP1, N\r\nR = N\r\n"),
                b"99999999999\r",
            )
        }),
        readings: &["an alarm", "2147483647", "0"],
        ..PROGRAM
    },
    Probe {
        id: "input-buffer",
        question: "How many bytes wait for INPUT at most?",
        sends: "a program that counts its INPUT; a connection to IP1 that sends 300 bytes before",
        ask: Ask::Steps(input_buffer),
        readings: &["256 bytes", "300 bytes or more"],
        is_public: false,
        ..PROGRAM
    },
    Probe {
        id: "input-lost-peer",
        question: "What happens to an INPUT with half a number when another peer comes?",
        sends: "a program: INPUT IP1; a connection that sends 12 and ends, another one that sends 3",
        ask: Ask::Steps(|session| {
            session.select(computes!("INPUT IP1, R\r\n"))?;
            session.open(Connection::Channel)?;
            session.begin()?;
            session.send_bytes(Connection::Channel, b"12")?;
            session.open(Connection::Channel)?;
            session.wait(QUIET)?;
            session.send_bytes(Connection::Channel, b"3\r")?;
            session.finish()?;
            session.close(Connection::Channel);
            Ok(plain(&session.variable("R", 1)?))
        }),
        // 0: the INPUT ended when the other one came.
        readings: &["3", "123", "0"],
        decides: Some(("channel.reconnect", &["keep", "keep", "release"])),
        ..PROGRAM
    },
    Probe {
        id: "buffer-reset",
        question: "Does PRINT \"BUFFRESET\" clear what INPUT would read?",
        sends: "a program: DELAY 1, PRINT IP1 of BUFFRESET, INPUT IP1; a connection that sends 3 before and 4 after it",
        ask: Ask::Steps(|session| {
            session.select(computes!(
                "DELAY 1\r\nPRINT IP1, \"BUFFRESET\"\r\nINPUT IP1, R\r\n"
            ))?;
            session.open(Connection::Channel)?;
            session.begin()?;
            session.send_bytes(Connection::Channel, b"3\r")?;
            let printed = session.receive_bytes(Connection::Channel, SETTLED + QUIET)?;
            session.send_bytes(Connection::Channel, b"4\r")?;
            session.finish()?;
            session.close(Connection::Channel);
            let value = plain(&session.variable("R", 1)?);
            let sent = if printed.is_empty() {
                ""
            } else {
                ", and sends something"
            };
            Ok(format!("{value}{sent}"))
        }),
        readings: &["4", "3", "3, and sends something"],
        ..PROGRAM
    },
    Probe {
        id: "input-before-start",
        question: "Does INPUT see what came before the start?",
        sends: "a program: INPUT IP1; a connection to IP1 that sends 3 before RN and 4 after it",
        ask: Ask::Steps(input_before_start),
        readings: &["4", "3"],
        ..PROGRAM
    },
];

/// Reads the text that a program prints on IP1.
fn prints(session: &mut Session<'_>, source: &str) -> Result<Reply, ProbeError> {
    session.select(source)?;
    session.open(Connection::Channel)?;
    session.wait(QUIET)?;
    session.start()?;
    let heard = session.receive_bytes(Connection::Channel, PATIENCE);
    session.finish()?;
    session.close(Connection::Channel);
    Ok(Escaped::for_reading(&heard?).to_string())
}

/// The value of R after a program has read these bytes on IP1; `an alarm` when the program has stopped at its INPUT.
fn inputs(session: &mut Session<'_>, source: &str, sent: &[u8]) -> Result<Reply, ProbeError> {
    session.select(source)?;
    session.open(Connection::Channel)?;
    session.begin()?;
    session.expect_running()?;
    session.send_bytes(Connection::Channel, sent)?;
    let ended = session.finish()?;
    session.close(Connection::Channel);
    let value = plain(&session.variable("R", 1)?);
    Ok(match (ended, value.as_str()) {
        (Some(ExecutionStatus::Continue), "7") => "an alarm".to_owned(),
        (None, _) => "it waits".to_owned(),
        (Some(_), _) => value,
    })
}

/// Counts the numbers of four bytes that are there after a burst of 300.
fn input_buffer(session: &mut Session<'_>) -> Result<Reply, ProbeError> {
    session.select(computes!(
        "N = 0\r\nR = 0\r\nDELAY 1\r\nNX: INPUT IP1, N\r\nR = R + 1\r\nGOTO NX\r\n"
    ))?;
    session.open(Connection::Channel)?;
    session.begin()?;
    session.send_bytes(Connection::Channel, "100\r".repeat(75).as_bytes())?;
    // DELAY first; then as long as it counts.
    let end = session.now() + PATIENCE * 2;
    let mut count = String::from("0");
    loop {
        let before = count;
        session.wait(QUIET)?;
        count = plain(&session.variable("R", 1)?);
        if session.now() >= end || (count == before && count != "0") {
            break;
        }
    }
    session.command("SP")?;
    session.until_stopped(SETTLED)?;
    session.close(Connection::Channel);
    Ok(match count.parse::<usize>() {
        Ok(75) => "300 bytes or more".to_owned(),
        Ok(count) => format!("{} bytes", count * 4),
        Err(_) => "no count".to_owned(),
    })
}

fn input_before_start(session: &mut Session<'_>) -> Result<Reply, ProbeError> {
    session.select(computes!("INPUT IP1, R\r\n"))?;
    session.open(Connection::Channel)?;
    session.send_bytes(Connection::Channel, b"3\r")?;
    session.wait(QUIET)?;
    session.begin()?;
    session.send_bytes(Connection::Channel, b"4\r")?;
    session.finish()?;
    session.close(Connection::Channel);
    Ok(plain(&session.variable("R", 1)?))
}
