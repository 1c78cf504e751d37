//! Recordings of an emulator are transcripts: the text that `--transcript` writes runs in the runner of the hand-written
//! ones, against a new controller.
//!
//! The other forms of a recording are tested in `ts3100-emulator`.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;
use ts3100_controller::{PanelAction, Port};
use ts3100_emulator::clock::TimeMode;
use ts3100_emulator::embed::Emulator;
use ts3100_tests::transcript::{Cut, Transcript};

fn exchange(host: &mut TcpStream, bytes: &[u8], expected: &[u8]) {
    host.write_all(bytes).unwrap();
    let mut found = vec![0; expected.len()];
    host.read_exact(&mut found).unwrap();
    assert_eq!(
        found.escape_ascii().to_string(),
        expected.escape_ascii().to_string()
    );
}

#[test]
fn a_recording_runs_as_a_hand_written_transcript_does() {
    let path = std::env::temp_dir().join(format!("ts3100-recording-{}.txt", std::process::id()));
    let robot = Emulator::builder()
        .time(TimeMode::Auto)
        .file(
            "PICK",
            "PROGRAM PICK\nN = 0\nPRINT IP1, \"REQ\", CR\nINPUT IP1, N\nDELAY 1.5\nPRINT IP1, N, CR\nEND\n",
        )
        .select("PICK")
        .transcript(path.to_str().unwrap())
        .unwrap()
        .start()
        .unwrap();
    let dial = |port| {
        let stream = TcpStream::connect(robot.address(port).unwrap()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
        stream
    };
    let (mut host, mut program) = (dial(Port::Ip0), dial(Port::Ip1));
    robot.panel(PanelAction::Servo(true)).unwrap();
    exchange(&mut host, b"\x02RN\r\x03", b"\x02OK\r\x03");
    exchange(&mut program, b"", b"REQ\r");
    exchange(&mut program, b"7\r", b"           7\r");
    exchange(&mut host, b"", b"\x02SP\r\x03");
    exchange(&mut host, b"SL,ABSENT\r\x03", b"NG\r\x03");
    drop(robot);
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    let transcript = Transcript::read(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    transcript
        .run(Cut::Whole)
        .unwrap_or_else(|error| panic!("{error}\n{text}"));
    let doctored = text.replace("<: IP0 NG<CR><ETX>", "<: IP0 OK<CR><ETX>");
    assert_ne!(doctored, text);
    assert!(Transcript::read(&doctored).unwrap().run(Cut::Whole).is_err());
}
