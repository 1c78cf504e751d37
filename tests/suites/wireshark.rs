//! The dissector of `packaging/wireshark`: its tables are those of `ts3100-proto`, and it reads our captures:
//! texts cut anywhere, SF with control codes in it, serial ports, the panel. What needs tshark is ignored by default
//! and run by tests/system/packages/wireshark_dissector.py, where a missing tshark is a failure.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;
use ts3100_controller::{Action, PanelAction, Port, Time};
use ts3100_emulator::transcript::{Format, Header, PeerId, Record, RecordKind, Recorder, TranscriptFile};
use ts3100_proto::command::COMMANDS;
use ts3100_proto::dissect::{Form, forms, is_in_items};
use ts3100_proto::status::sf::table::{SfField, SfFieldKind, sf_fields};
use ts3100_proto::status::sf::{NO_ALARM, SfLayout, SystemStatus, alarm_from_word};

fn script() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../packaging/wireshark/ts3100.lua")
}

/// What is before and after the generated part.
const BEGIN: &str = "bless_wireshark\n";
const END: &str = "-- end of the generated part\n";

/// The script with the tables of `ts3100-proto` as its generated part.
fn generated() -> String {
    let lua = std::fs::read_to_string(script()).unwrap();
    let (before, rest) = lua.split_once(BEGIN).unwrap();
    let (_, after) = rest.split_once(END).unwrap();
    format!("{before}{BEGIN}{}{END}{after}", tables())
}

fn tables() -> String {
    let mut lua = String::from(
        "-- Fields of SF: key, name, size, offset among eight axes and among six, kind or words of the values.\n\
         local SF = {\n",
    );
    let (eight, six) = (sf_fields(SfLayout::Eight), sf_fields(SfLayout::Six));
    let is_shown = |field: &&SfField| field.kind != SfFieldKind::Reserved || field.key == "dummy";
    let offset = |fields: &[SfField], key: &str| {
        let found = fields.iter().filter(is_shown).find(|field| field.key == key);
        found.map_or("false".to_owned(), |field| field.offset.to_string())
    };
    let is_further = |field: &&SfField| eight.iter().all(|other| other.key != field.key);
    let further = six.iter().filter(is_further);
    for field in eight.iter().chain(further).filter(is_shown) {
        let SfField { key, name, size, .. } = field;
        let kind = match field.kind {
            SfFieldKind::Code([first, others @ ..]) => {
                let others: String = others.iter().map(|word| format!(", {word:?}")).collect();
                format!("{{ [0] = {first:?}{others} }}")
            }
            SfFieldKind::Code([]) | SfFieldKind::Minutes | SfFieldKind::Reserved => "\"number\"".to_owned(),
            SfFieldKind::Alarm => "\"alarm\"".to_owned(),
            SfFieldKind::Lines(..) => "\"lines\"".to_owned(),
            SfFieldKind::Float => "\"float\"".to_owned(),
            SfFieldKind::Name => "\"name\"".to_owned(),
        };
        let (eight, six) = (offset(&eight, key), offset(&six, key));
        writeln!(lua, "  {{ {key:?}, {name:?}, {size}, {eight}, {six}, {kind} }},").unwrap();
    }
    writeln!(lua, "}}\nlocal SF_SIX = {}", SfLayout::Six.len()).unwrap();
    lua.push_str(
        "-- Words of alarms: level, first word, how many, code of the first.\nlocal ALARM_RANGES = {\n",
    );
    let mut runs: Vec<(u8, u16, u16, u16)> = Vec::new();
    for word in 0..NO_ALARM {
        let Some((level, code)) = alarm_from_word(word) else {
            continue;
        };
        match runs.last_mut() {
            Some((of, first, count, begin))
                if *of == level.number() && *first + *count == word && *begin + *count == code =>
            {
                *count += 1;
            }
            _ => runs.push((level.number(), word, 1, code)),
        }
    }
    for (level, first, count, code) in runs {
        writeln!(lua, "  {{ {level}, {first}, {count}, {code} }},").unwrap();
    }
    lua.push_str("}\n-- Binary contents: length, and what may follow.\nlocal FORMS = {\n");
    let mut items = String::new();
    for letters in letters() {
        if let Some(forms) = forms(letters) {
            let form = |(length, ending): &Form| {
                let ending: String = ending.iter().map(|byte| format!("\\{byte}")).collect();
                format!("{{ {length}, \"{ending}\" }}")
            };
            let forms: Vec<String> = forms.iter().map(form).collect();
            writeln!(lua, "  {letters} = {{ {} }},", forms.join(", ")).unwrap();
        }
        if is_in_items(letters) {
            write!(items, " {letters} = true,").unwrap();
        }
    }
    writeln!(lua, "}}\n-- Contents that are items.\nlocal ITEMS = {{{items} }}").unwrap();
    lua
}

/// The letters of every command.
fn letters() -> BTreeSet<&'static str> {
    COMMANDS.iter().map(|row| row.letters).collect()
}

#[test]
fn the_tables_are_those_of_the_protocol() {
    let lua = std::fs::read_to_string(script()).unwrap();
    assert_eq!(
        lua,
        generated(),
        "run cargo test -p ts3100-tests -- --ignored bless_wireshark"
    );
}

#[test]
#[ignore = "writes packaging/wireshark/ts3100.lua"]
fn bless_wireshark() {
    std::fs::write(script(), generated()).unwrap();
}

#[test]
fn every_command_has_its_meaning() {
    let lua = std::fs::read_to_string(script()).unwrap();
    let (_, rest) = lua.split_once("local COMMANDS = {").unwrap();
    let (meanings, _) = rest.split_once("\n}").unwrap();
    let known: BTreeSet<&str> = meanings
        .split(" = ")
        .filter_map(|part| part.get(part.len().checked_sub(2)?..))
        .filter(|letters| letters.bytes().all(|byte| byte.is_ascii_uppercase()))
        .collect();
    assert_eq!(known, letters());
}

/// The filter that lets every packet through.
const ALL: &str = "frame";

fn from_host(port: Port, bytes: &[u8]) -> RecordKind {
    RecordKind::FromHost {
        line: PeerId::first(port),
        bytes: bytes.to_vec().into(),
    }
}

fn from_robot(port: Port, bytes: &[u8]) -> RecordKind {
    RecordKind::FromRobot {
        line: PeerId::first(port),
        bytes: bytes.to_vec().into(),
    }
}

/// What tshark prints for these fields of each packet that the filter lets through and that has one.
fn tshark(name: &str, whats: Vec<RecordKind>, filter: &str, fields: &[&str]) -> Vec<String> {
    let path = std::env::temp_dir().join(format!("ts3100-wireshark-{}-{name}.pcapng", std::process::id()));
    let target = TranscriptFile {
        path: path.clone(),
        format: Format::Pcapng,
    };
    let mut recorder = Recorder::create(&[target], &Header::default(), Duration::ZERO).unwrap();
    for (at, what) in (1..).zip(whats) {
        let at = Time::from_millis(at);
        recorder.record(&Record { at, kind: what });
    }
    recorder.flush();
    let mut command = Command::new("tshark");
    command
        .arg("-X")
        .arg(format!("lua_script:{}", script().display()));
    command
        .arg("-r")
        .arg(&path)
        .args(["-Y", filter, "-T", "fields", "-E", "separator=|"]);
    fields.iter().for_each(|field| {
        command.args(["-e", field]);
    });
    let output = command.output().expect("tshark runs (apt-get install tshark)");
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
    lines.map(str::to_owned).collect()
}

#[test]
#[ignore = "needs tshark; tests/system/packages/wireshark_dissector.py runs it"]
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
        RecordKind::Action(Action::Panel(PanelAction::EmergencyStop(true))),
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
    let lines = tshark("texts", whats, ALL, &fields);
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
            "|||||||emergency-stop press",
        ]
    );
}

#[test]
#[ignore = "needs tshark; tests/system/packages/wireshark_dissector.py runs it"]
fn the_fields_of_sf_are_read_by_name_in_both_layouts() {
    let mut status = SystemStatus {
        servo: true,
        power_on_minutes: 0x0303,
        work_name: "JIG".to_owned(),
        alarms: vec![512],
        ..SystemStatus::default()
    };
    status.outputs[0] = 0x1A03;
    status.inputs[15] = 0x0301;
    status.joint[5] = 12.5;
    let mut whats = Vec::new();
    for (layout, length, ending) in [
        (SfLayout::Eight, 276, &b"\x1A\x03"[..]),
        (SfLayout::Six, 248, b"\x1A\r\x03"),
        // To the letter of the SCARA edition: a full text, which needs no EOF.
        (SfLayout::Six, 250, b"\x03"),
    ] {
        let mut body = status.encode(layout);
        body.resize(length, 0);
        let text = [b"\x02FL,", body.as_slice(), ending].concat();
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
        "ts3100.sf.input.further.4",
        "ts3100.sf.joint.6",
        "ts3100.sf.name.work",
    ];
    // The other texts have no such field; the filter is that of the docs.
    let lines = tshark("sf", whats, "ts3100.sf", &fields);
    assert_eq!(
        lines,
        [
            "1|512|65535|771|0x1a03||12.5|JIG",
            "1|512|65535|771|0x1a03|0x0301|12.5|JIG",
            "1|512|65535|771|0x1a03|0x0301|12.5|JIG",
        ]
    );
}

#[test]
#[ignore = "needs tshark; tests/system/packages/wireshark_dissector.py runs it"]
fn the_words_of_io_are_read_with_and_without_eof() {
    let mut words = [b'A'; 80];
    // Control codes among them.
    words[5] = 0x03;
    words[78..].copy_from_slice(&[0x1A, 0x1A]);
    let mut whats = Vec::new();
    for ending in [&b"\x1A\x03"[..], b"\x03"] {
        whats.extend([
            from_host(Port::Ip0, b"\x02IO,1\r\x03"),
            from_robot(Port::Ip0, &[b"\x02FL,", &words[..], ending].concat()),
            from_host(Port::Ip0, b"\x02OK\r\x03"),
        ]);
    }
    let lines = tshark(
        "io",
        whats,
        "ts3100.data",
        &["ts3100.answer_to", "ts3100.data", "ts3100.eof"],
    );
    let shown: String = words.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(lines.len(), 2, "{lines:?}");
    assert!(
        lines[0].starts_with(&format!("IO|{shown}|")) && !lines[0].ends_with('|'),
        "{lines:?}"
    );
    assert_eq!(lines[1], format!("IO|{shown}|"));
}

#[test]
#[ignore = "needs tshark; tests/system/packages/wireshark_dissector.py runs it"]
fn an_unknown_command_is_one_and_its_ng_belongs_to_it() {
    let host = |data: &[u8]| from_host(Port::Ip0, &[b"\x02", data, b"\x03"].concat());
    let robot = |data: &[u8]| from_robot(Port::Ip0, &[b"\x02", data, b"\x03"].concat());
    let whats = vec![
        host(b"SO\r"),
        robot(b"OK\r"),
        host(b"XX,1\r"),
        robot(b"NG\r"),
        host(b"so\r"),
        robot(b"OK\r"),
        host(b"1Q"),
        robot(b"NG\r"),
        // Texts of a file that begin like commands are none.
        host(b"DL,NEW\r"),
        robot(b"OK\r"),
        host(b"FL,PROGRAM NEW\r"),
        robot(b"OK\r"),
        host(b"SPEED=10\r"),
        robot(b"OK\r"),
        host(b"XX\r"),
        robot(b"OK\r"),
        host(b"END\r\x1A"),
        robot(b"OK\r"),
        // The download is over.
        host(b"XX\r"),
        robot(b"NG\r"),
        // A file without a download: the NG is its own.
        host(b"FL,END\r\x1A"),
        robot(b"NG\r"),
        // A download that the robot does not take is not open.
        host(b"DL,1\r"),
        robot(b"NG\r"),
        host(b"YY\r"),
        robot(b"NG\r"),
    ];
    // Of booleans every version of tshark prints something else.
    let fields = [
        "ts3100.command",
        "ts3100.meaning",
        "ts3100.reply",
        "ts3100.answer_to",
    ];
    let lines = tshark(
        "unknown",
        whats,
        "ts3100.command || ts3100.reply == \"NG\"",
        &fields,
    );
    assert_eq!(
        lines,
        [
            "SO|servo power on||",
            "XX|unknown command||",
            "||NG|XX",
            "SO|servo power on||",
            "1Q|unknown command||",
            "||NG|1Q",
            "DL|RAM file download||",
            "FL|file||",
            "XX|unknown command||",
            "||NG|XX",
            "FL|file||",
            "||NG|FL",
            "DL|RAM file download||",
            "||NG|DL",
            "YY|unknown command||",
            "||NG|YY",
        ]
    );
}
