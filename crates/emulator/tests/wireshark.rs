//! The dissector of `packaging/wireshark`: its table of SF is the one of `ts3100-proto`; where tshark is installed,
//! it reads our captures: texts cut anywhere, SF with control codes in it, serial ports, the panel.

#![expect(clippy::unwrap_used, reason = "helpers of tests, which may fail as tests do")]

use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;
use ts3100_controller::{Deed, Panel, Port, Time};
use ts3100_emulator::transcript::{Format, Header, Line, Record, Recorder, TranscriptFile, What};
use ts3100_proto::status::sf::table::{SfKind, sf_fields};
use ts3100_proto::status::sf::{SfLayout, SystemStatus};

fn script() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../packaging/wireshark/ts3100.lua")
}

#[test]
fn the_table_of_sf_is_that_of_the_protocol() {
    let lua = std::fs::read_to_string(script()).unwrap();
    for field in sf_fields(SfLayout::Eight) {
        let (key, name, offset, size) = (&field.key, &field.name, field.offset, field.size);
        let row = match field.kind {
            SfKind::Code(_) | SfKind::Minutes => format!("{{ {offset}, {size}, \"{key}\", \"{name}\""),
            SfKind::Reserved if key == "dummy" => format!("{{ {offset}, {size}, \"{key}\", \"{name}\""),
            SfKind::Lines(_, first) => {
                let key = key.split_once('.').unwrap().1;
                let word = name.split_once(' ').unwrap().0;
                format!("{{ \"{key}\", \"{word}\", {first} }}")
            }
            // By loops, of which the running dissector is the test.
            SfKind::Alarm | SfKind::Float | SfKind::Name | SfKind::Reserved => continue,
        };
        assert!(lua.contains(&row), "{row} is not in the dissector");
        if let SfKind::Code(words) = field.kind {
            let words = words.join("\", \"");
            let values = format!("\"{name}\", {{ [0] = \"{words}\" }}");
            assert!(
                words.is_empty() || lua.contains(&values),
                "{values} is not in the dissector"
            );
        }
    }
}

fn from_host(port: Port, bytes: &[u8]) -> What {
    What::FromHost {
        line: Line::first(port),
        bytes: bytes.to_vec(),
    }
}

fn from_robot(port: Port, bytes: &[u8]) -> What {
    What::FromRobot {
        line: Line::first(port),
        bytes: bytes.to_vec(),
    }
}

/// What tshark prints for these fields of each packet that has one; `None` where it is not installed.
fn tshark(name: &str, whats: Vec<What>, fields: &[&str]) -> Option<Vec<String>> {
    let path = std::env::temp_dir().join(format!("ts3100-wireshark-{}-{name}.pcapng", std::process::id()));
    let target = TranscriptFile {
        path: path.clone(),
        format: Format::Pcapng,
    };
    let mut recorder = Recorder::begin(&[target], &Header::default(), Duration::ZERO).unwrap();
    for (at, what) in (1..).zip(whats) {
        let at = Time::from_millis(at);
        recorder.record(&Record { at, what });
    }
    recorder.flush();
    let mut command = Command::new("tshark");
    command
        .arg("-X")
        .arg(format!("lua_script:{}", script().display()));
    command
        .arg("-r")
        .arg(&path)
        .args(["-T", "fields", "-E", "separator=|"]);
    fields.iter().for_each(|field| {
        command.args(["-e", field]);
    });
    let output = match command.output() {
        Ok(output) => output,
        Err(error) => {
            eprintln!("tshark not run: {error}");
            return None;
        }
    };
    std::fs::remove_file(&path).unwrap();
    let complaints = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && !complaints.contains("Lua"),
        "{complaints}"
    );
    let printed = String::from_utf8_lossy(&output.stdout);
    let lines = printed
        .lines()
        .filter(|line| line.chars().any(|char| char != '|'));
    Some(lines.map(str::to_owned).collect())
}

#[test]
fn texts_are_found_however_they_are_cut() {
    let whats = vec![
        from_host(Port::Ip0, b"\x02S"),
        from_host(Port::Ip0, b"L,TEST\r"),
        from_host(Port::Ip0, b"\x03"),
        from_robot(Port::Ip0, b"\x02NG\r\x03"),
        from_host(Port::Ip0, b"SU\r\x03"),
        from_robot(
            Port::Ip0,
            b"FL,MODE:teaching/cycle FILE:T OVRD:50%\x1A\x03SP\r\x03",
        ),
        from_host(Port::Ip0, b"OK\r\x03"),
        from_robot(Port::Ip1, b"REQ\r"),
        from_host(Port::Host, b"\x02SO"),
        from_host(Port::Host, b"\r\x03"),
        from_robot(Port::Host, b"\x02OK\r\x03"),
        from_host(Port::Com1, b"7\r"),
        What::Deed(Deed::Panel(Panel::EmergencyStop(true))),
    ];
    let fields = [
        "ts3100.sender",
        "ts3100.command",
        "ts3100.operand",
        "ts3100.reply",
        "ts3100.answer_to",
        "ts3100.su",
        "ts3100_channel.text",
        "ts3100_panel.words",
    ];
    let Some(lines) = tshark("texts", whats, &fields) else {
        return;
    };
    assert_eq!(
        lines,
        [
            "host|SL|TEST|||||",
            "controller|||NG|SL|||",
            "host|SU||||||",
            "controller,controller|||FL,SP|SU|MODE:teaching/cycle,FILE:T,OVRD:50%||",
            "host|OK||||||",
            "||||||REQ<CR>|",
            "host|SO||||||",
            "controller|||OK|SO|||",
            "||||||7<CR>|",
            "|||||||emergency-stop on",
        ]
    );
}

#[test]
fn the_fields_of_sf_are_read_by_name_in_both_layouts() {
    let mut status = SystemStatus {
        servo: true,
        power_on_minutes: 0x0303,
        work_name: "JIG".to_owned(),
        alarms: vec![512],
        ..SystemStatus::default()
    };
    status.outputs[0] = 0x1A03;
    status.joint[5] = 12.5;
    let mut whats = Vec::new();
    for (layout, ending) in [
        (SfLayout::Eight, &b"\x1A\x03"[..]),
        (SfLayout::Six, b"\x1A\r\x03"),
    ] {
        let text = [b"\x02FL,", status.encode(layout).as_slice(), ending].concat();
        let (first, rest) = text.split_at(60);
        whats.extend([
            from_host(Port::Ip0, b"\x02SF\r\x03"),
            from_robot(Port::Ip0, first),
            from_robot(Port::Ip0, rest),
        ]);
    }
    let fields = [
        "ts3100.sf.servo",
        "ts3100.sf.alarm.1",
        "ts3100.sf.alarm.2",
        "ts3100.sf.power_on_time",
        "ts3100.sf.output.general.1",
        "ts3100.sf.joint.6",
        "ts3100.sf.name.work",
    ];
    let Some(lines) = tshark("sf", whats, &fields) else {
        return;
    };
    assert_eq!(lines, ["1|512|65535|771|0x1a03|12.5|JIG"; 2]);
}
