//! The snapshot files of `fixtures/snapshots/v1`. Each has to load, to be written again byte for byte, to run on for ten
//! seconds of virtual time, and to show on the wire the state it was taken in.
//!
//! `snapshots.rs` has the snapshots that the present controller writes itself. The origin of the files is in the README
//! beside them.

use std::path::PathBuf;
use ts3100_controller::{Action, Controller, Input, PanelAction, Port, Snapshot};
use ts3100_tests::{Robot, notation};

/// What is checked of a restored controller. It leaves ten seconds of virtual time or more behind.
type Check = fn(&mut Robot);

/// Every file of the folder, without `.json`, and what it has to show.
const FILES: [(&str, Check); 14] = [
    ("scara-alarm", scara_alarm),
    ("scara-do", scara_do),
    ("scara-download", scara_download),
    ("scara-off", scara_off),
    ("scara-step", scara_step),
    ("scara-variation", scara_variation),
    ("scara-watchdog-input", scara_watchdog_input),
    ("six-axis-emergency-stop", six_axis_emergency_stop),
    ("six-axis-fault", six_axis_fault),
    ("six-axis-jog", six_axis_jog),
    ("six-axis-running", six_axis_running),
    ("six-axis-serial", six_axis_serial),
    ("six-axis-tasks", six_axis_tasks),
    ("six-axis-upload-host", six_axis_upload_host),
];

fn folder() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/snapshots/v1"))
}

fn text_of(name: &str) -> String {
    std::fs::read_to_string(folder().join(format!("{name}.json"))).unwrap()
}

fn load(name: &str) -> Controller {
    let snapshot: Snapshot = serde_json::from_str(&text_of(name)).unwrap();
    Controller::restore(snapshot).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The form in which `ctl snapshots show` and `--snapshot-on-exit` write.
fn written_again(controller: &Controller) -> String {
    serde_json::to_string_pretty(&controller.snapshot()).unwrap() + "\n"
}

#[test]
fn every_file_has_a_check_and_an_origin() {
    let readme = std::fs::read_to_string(folder().join("README.md")).unwrap();
    let mut names: Vec<String> = std::fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "json"))
        .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    names.sort();
    assert_eq!(names, FILES.map(|(name, _)| name));
    for name in names {
        assert!(readme.contains(&format!("`{name}.json`")), "{name}");
    }
}

#[test]
fn a_file_is_written_again_as_it_is() {
    for (name, _) in FILES {
        assert_eq!(written_again(&load(name)), text_of(name), "{name}");
    }
}

/// Writes every file again in the present form: after a change of the form, once, and read by hand.
#[test]
#[ignore = "writes the files"]
fn bless_snapshot_files() {
    for (name, _) in FILES {
        std::fs::write(folder().join(format!("{name}.json")), written_again(&load(name))).unwrap();
    }
}

#[test]
fn a_file_goes_on_from_its_state() {
    for (name, check) in FILES {
        let mut robot = Robot::from_controller(load(name));
        let start = robot.now();
        check(&mut robot);
        let passed = robot.now().as_micros() - start.as_micros();
        assert!(passed >= 10_000_000, "{name}: {passed} us");
    }
}

/// What the wire has on this port since the last call, in the notation of transcripts.
fn wire(robot: &mut Robot, port: Port) -> String {
    notation::write(&robot.received(port))
}

/// The same for what PRINT sent, without the blanks that fill a number up to twelve characters.
fn printed(robot: &mut Robot, port: Port) -> String {
    wire(robot, port).replace(' ', "")
}

/// An answer by FL as text.
fn answer(robot: &mut Robot, command: &str) -> String {
    String::from_utf8(robot.file(Port::Ip0, command)).unwrap()
}

/// An item of SM, for example `DS`.
fn item(robot: &mut Robot, name: &str) -> String {
    let body = answer(robot, "SM,1");
    let value = body.split(' ').find_map(|item| item.strip_prefix(name));
    value.unwrap_or_else(|| panic!("{name} in {body}")).to_string()
}

fn six_axis_running(robot: &mut Robot) {
    robot.send(Port::Ip0, b"OK\r");
    for _ in 0..20 {
        robot.advance_ms(500);
        // The warning 1-102: base 736 for level 1, codes count from 1.
        assert_eq!(super::extensions::word(&robot.total(Port::Ip0), 4), 736 + 101);
    }
    assert!(
        robot.file(Port::Ip0, "MR,N1 0") > b"13\r".to_vec(),
        "the program counts on"
    );
}

fn scara_do(robot: &mut Robot) {
    assert_eq!(item(robot, "DS"), "1");
    for _ in 0..100 {
        robot.advance_ms(500);
        robot.file(Port::Ip0, "SM,1");
    }
    assert_eq!(item(robot, "DS"), "0");
    assert_eq!(item(robot, "DC"), "1");
    let position = answer(robot, "PR,1");
    assert!(
        position.starts_with("300.000,100.500,-20.123,45.000"),
        "{position}"
    );
}

/// Two tasks run, one of them every 0.7 s; a monitor waits for Din(9); Din(17) is forced.
fn six_axis_tasks(robot: &mut Robot) {
    robot.connect(Port::Com1);
    assert_eq!(answer(robot, "MR,COUNT 0"), "4\r");
    assert_eq!(answer(robot, "HI,17 1"), "1\r");
    robot.panel(PanelAction::InputLine { line: 9, on: true });
    robot.advance_ms(10_000);
    assert_eq!(printed(robot, Port::Com1), "1.500<CR>");
    assert_eq!(item(robot, "RS"), "1");
    assert_eq!(answer(robot, "MR,COUNT 0"), "18\r");
    assert!(printed(robot, Port::Ip1).starts_with("5<CR>6<CR>7<CR>"));
}

/// 400 bytes of LONG have come, 2 s ago; the rest is awaited for 10 s.
fn scara_download(robot: &mut Robot) {
    robot.advance_ms(7_900);
    assert_eq!(wire(robot, Port::Ip0), "", "the download is still open");
    robot.send(Port::Ip0, b"END\n\x1a");
    assert_eq!(wire(robot, Port::Ip0), "<STX>OK<CR><ETX>");
    robot.advance_ms(2_200);
    let file = answer(robot, "UL,LONG");
    assert!(file.starts_with("PROGRAM LONG\nREMARK line 000"), "{file}");
    assert!(file.ends_with("END\n") && file.len() == 404, "{file}");
}

/// Two texts of LONG, 503 bytes of it, are out on HOST at 9600 bit/s; the OK to the second is awaited.
fn six_axis_upload_host(robot: &mut Robot) {
    robot.send(Port::Host, b"OK\r");
    robot.advance_ms(2_000);
    let text = robot.received(Port::Host);
    assert!(
        text.starts_with(b"\x02takes several texts\nREMARK line 010"),
        "{}",
        notation::write(&text)
    );
    robot.send(Port::Host, b"NG\r");
    robot.advance_ms(8_000);
    assert_eq!(wire(robot, Port::Host), "", "the rest is not sent after NG");
}

/// WD,9000 8 was sent at 0 s, RN after it, now it is 1 s; INPUT has the first of two values and half of the second.
fn scara_watchdog_input(robot: &mut Robot) {
    robot.raw(Port::Ip1, b"6\r");
    robot.advance_ms(7_900);
    assert_eq!(printed(robot, Port::Ip1), "60<CR>");
    assert!(robot.alarms().is_empty(), "{:?}", robot.alarms());
    robot.advance_ms(2_100);
    assert_eq!(robot.alarms(), ["8-352"]);
    assert_eq!(item(robot, "SV"), "0");
}

/// Axis 1 is jogged at 2 percent, for 0.3 s so far.
fn six_axis_jog(robot: &mut Robot) {
    let axis_1 = |robot: &mut Robot| -> f64 {
        let position = answer(robot, "PR,0");
        position.split(',').next().unwrap().parse().unwrap()
    };
    let start = axis_1(robot);
    assert_eq!(
        robot.ask(Port::Ip0, "JG,2 +"),
        b"NG\r",
        "the arm is jogged already"
    );
    robot.advance_ms(10_000);
    assert!(axis_1(robot) > start + 20.0);
    robot.command(Port::Ip0, "JG,1 !");
    robot.advance_ms(500);
    robot.command(Port::Ip0, "JG,2 +");
}

/// Alarm 8-026 is active, the servo off, the program at stop (retry); `12` is typed, Din(9) and Dout(7) are forced.
fn scara_alarm(robot: &mut Robot) {
    assert_eq!(item(robot, "AL"), "8");
    assert_eq!(robot.ask(Port::Ip0, "SO"), b"NG\r");
    assert_eq!(answer(robot, "HI,9 1"), "1\r");
    for command in ["RS,ERR", "SO", "RN"] {
        robot.command(Port::Ip0, command);
    }
    robot.advance_ms(6_000);
    robot.panel(PanelAction::Keys("3\r".to_string()));
    robot.advance_ms(4_000);
    assert_eq!(
        answer(robot, "MR,N 0"),
        "123\r",
        "the figures typed before are there"
    );
}

/// The emergency stop cut short a motion that overlaps another (PASS).
fn six_axis_emergency_stop(robot: &mut Robot) {
    assert_eq!(item(robot, "ES"), "1");
    assert_eq!(item(robot, "RS"), "2");
    assert_eq!(robot.ask(Port::Ip0, "SO"), b"NG\r");
    robot.panel(PanelAction::EmergencyStop(false));
    for command in ["RS,ERR", "SO", "RN"] {
        robot.command(Port::Ip0, command);
    }
    robot.advance_ms(10_000);
    assert_eq!(item(robot, "RS"), "1");
    assert_eq!(answer(robot, "MR,COUNT 0"), "16\r");
}

/// The power went off while a program ran. Din(12) is on all the same.
fn scara_off(robot: &mut Robot) {
    robot.connect(Port::Ip0);
    robot.send(Port::Ip0, b"CA\r");
    robot.advance_ms(10_000);
    assert_eq!(wire(robot, Port::Ip0), "", "nothing answers");
    robot.feed(Input::by_owner(Action::PowerOn));
    robot.connect(Port::Ip0);
    assert!(answer(robot, "CA").contains("STEPS "));
    assert_eq!(answer(robot, "HI,12 1"), "1\r");
    assert_eq!(item(robot, "RS"), "0");
}

/// At 1 s: the late answer to VR leaves at 4 s, the emergency stop is pressed at 8 s and released at 9 s.
fn six_axis_fault(robot: &mut Robot) {
    robot.advance_ms(2_999);
    assert_eq!(wire(robot, Port::Ip0), "");
    robot.advance_ms(1);
    assert!(wire(robot, Port::Ip0).starts_with("<STX>FL,TS3100"));
    robot.send(Port::Ip0, b"OK\r");
    assert_eq!(item(robot, "ES"), "0");
    robot.advance_ms(4_500);
    assert_eq!(item(robot, "ES"), "1");
    robot.advance_ms(2_500);
    assert_eq!(item(robot, "ES"), "0");
    assert_eq!(robot.alarms(), ["8-014"]);
}

/// With seed 11 the answer to SU leaves 28 ms after the command, of which 2 ms have passed.
fn scara_variation(robot: &mut Robot) {
    robot.advance_ms(25);
    assert_eq!(wire(robot, Port::Ip0), "");
    robot.advance_ms(60);
    let text = wire(robot, Port::Ip0);
    assert!(
        text.starts_with("<STX>FL,MODE:external(ethernet)/cycle FILE:STEPS ")
            && text.ends_with("STATUS:stop(reset)<EOF><ETX>"),
        "{text}"
    );
    robot.advance_ms(10_000);
    assert_eq!(wire(robot, Port::Ip0), "");
}

/// `U` of an SU is on the line of HOST, `5<CR>` on that of COM1, and a record of PRINT on its way out.
fn six_axis_serial(robot: &mut Robot) {
    robot.raw(Port::Host, b"\r\x03");
    robot.advance_ms(500);
    let text = wire(robot, Port::Host);
    assert!(
        text.starts_with("<STX>FL,MODE:external(host)/cycle FILE:CELL ")
            && text.ends_with("STATUS:running<EOF><ETX>"),
        "{text}"
    );
    let first = printed(robot, Port::Com1);
    robot.advance_ms(9_500);
    assert!(
        first.ends_with("takesawhile2<CR>") && !first.starts_with("arecord"),
        "only the rest of the second record was still to come: {first}"
    );
    assert!(printed(robot, Port::Com1).starts_with("arecordthattakesawhile3<CR>arecord"));
}

/// STEP mode: DELAY 3 began at 0.5 s, SP came at 0.8 s. On IP0 there is `<STX>S`, half a text.
fn scara_step(robot: &mut Robot) {
    robot.raw(Port::Ip0, b"U\r\x03");
    let text = wire(robot, Port::Ip0);
    assert!(
        text.contains("/step ") && text.contains("STATUS:running"),
        "{text}"
    );
    robot.send(Port::Ip0, b"OK\r");
    robot.advance_ms(2_600);
    assert_eq!(wire(robot, Port::Ip0), "");
    assert_eq!(item(robot, "RS"), "1");
    robot.advance_ms(7_400);
    assert_eq!(
        wire(robot, Port::Ip0),
        "",
        "no unsolicited SP: a host has asked for the stop"
    );
    assert_eq!(item(robot, "RS"), "3");
    assert_eq!(
        answer(robot, "MR,N 0"),
        "1\r",
        "the statement after DELAY was not begun"
    );
}
