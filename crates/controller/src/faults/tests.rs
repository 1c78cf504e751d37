//! Tests of how faults are written, of whose turn it is, and of what each does to the bytes. What hosts make of
//! them is tested in the suites.

use super::*;
use crate::controls::PanelAction;
use crate::output::{DisconnectMode, Output};
use crate::{Config, Controller, Dialect, HostEnd, Input};
use bytes::Bytes;
use core::time::Duration;

mod occasions;

fn robot() -> Controller {
    let mut robot = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
    for port in [Port::Ip0, Port::Ip1] {
        let peer = "a test".to_string();
        robot.feed(Time::ZERO, Input::Connected { port, peer });
    }
    robot
}

fn arm(robot: &mut Controller, spec: &str) {
    let fault: Fault = spec.parse().unwrap();
    robot.feed(robot.now(), Input::from(FaultAction::Arm(Box::new(fault))));
}

/// What leaves IP0, with its time in ms, and how the connection ends.
fn ask(robot: &mut Controller, command: &[u8], until: u64) -> Vec<(u64, Output)> {
    let bytes = [b"\x02", command, b"\r\x03"].concat();
    let port = Port::Ip0;
    let mut found = Vec::new();
    let end = robot.now() + Duration::from_millis(until);
    let mut now = robot.now();
    let mut outputs = robot.feed(now, Input::received(port, bytes));
    loop {
        let seen = outputs
            .into_iter()
            .filter(|output| !matches!(output, Output::Event(_)));
        found.extend(seen.map(|output| (now.as_micros() / 1_000, output)));
        let Some(due) = robot.poll_deadline().filter(|due| *due <= end) else {
            robot.feed(end, Input::Tick);
            return found;
        };
        now = due;
        outputs = robot.feed(now, Input::Tick);
    }
}

fn sent(at: u64, bytes: &[u8]) -> (u64, Output) {
    let (port, bytes) = (Port::Ip0, Bytes::copy_from_slice(bytes));
    (at, Output::Send { port, bytes })
}

#[test]
fn every_kind_says_what_it_is_and_takes_its_own_defaults() {
    for kind in KINDS {
        let fault = Fault::from_pairs(kind.name, &[]).unwrap();
        assert!(!kind.summary.is_empty() && !kind.remedy.is_empty() && !kind.points.is_empty());
        for parameter in kind.parameters {
            let set = fault.values.iter().any(|(name, _)| name == parameter.name);
            assert_eq!(
                set,
                parameter.default.is_some(),
                "{} {}",
                kind.name,
                parameter.name
            );
        }
        let again: Fault = fault.to_string().parse().unwrap();
        assert_eq!(again, fault, "{fault}");
    }
    let names: BTreeSet<&str> = KINDS.iter().map(|kind| kind.name).collect();
    assert_eq!(names.len(), KINDS.len());
}

#[test]
fn a_fault_is_written_and_read_again() {
    for (spec, again) in [
        ("no-reply", "no-reply:lost=reply"),
        (
            "ng:command=dl,block=2,channel=ip0",
            "ng:command=DL,channel=IP0,block=2",
        ),
        ("late-reply:delay=1.5s", "late-reply:delay=1500"),
        (
            "late-reply: delay = 250ms , times = 0",
            "late-reply:times=0,delay=250",
        ),
        (
            "flipped-bit:probability=0.25,way=in",
            "flipped-bit:probability=0.25,way=in",
        ),
        ("wrong-reply:text=\"FL,<1A>\"", "wrong-reply:text=\"FL,<EOF>\""),
        ("wrong-reply:text=OK<CR>", "wrong-reply:text=\"OK<CR>\""),
        ("power-loss", "power-loss:command=DL,block=1,delay=0"),
        (
            "key-turned:channel=IP1",
            "key-turned:channel=IP1,back=0,delay=500,to=teaching",
        ),
        ("drive-full:command=MW,free=7", "drive-full:command=MW,free=7"),
    ] {
        let fault: Fault = spec.parse().unwrap_or_else(|error| panic!("{spec}: {error}"));
        assert_eq!(fault.to_string(), again);
        assert_eq!(again.parse(), Ok(fault));
    }
}

#[test]
fn what_is_no_fault_is_refused_with_what_was_expected_and_found() {
    for (spec, says) in [
        (
            "",
            "unknown kind of fault ``; `ts3100 faults list` shows the kinds",
        ),
        (
            "noreply",
            "unknown kind of fault `noreply`; did you mean `no-reply`?",
        ),
        ("no-reply:", "no-reply"),
        (
            "no-reply:after",
            "expected KIND:key=value,key=value, found `after`",
        ),
        (
            "no-reply:when=1",
            "unknown key `when`; it takes id, command, channel",
        ),
        ("no-reply:after=1,after=2", "the key `after` is given twice"),
        (
            "no-reply:command=XX",
            "expected the letters of a command, for example RN, found `XX`",
        ),
        ("no-reply:command=OK", "the letters of a command"),
        (
            "no-reply:channel=IP9",
            "expected HOST, COM1, IP0, IP1, IP2 or IP3, found `IP9`",
        ),
        ("no-reply:channel=IP1", "expected HOST or IP0, found `IP1`"),
        ("parity-error:channel=IP0", "expected HOST or COM1"),
        ("lost-record:channel=HOST", "expected COM1 or IP1 or IP2"),
        (
            "no-reply:probability=1.5",
            "expected a number from 0 to 1, found `1.5`",
        ),
        ("no-reply:probability=nan", "a number from 0 to 1"),
        ("no-reply:times=-1", "expected a whole number from 0 to 1000000"),
        (
            "late-reply:delay=11m",
            "expected a duration of whole ms from 0 to 600000, for example 500 or 1.5 s, found `11m`",
        ),
        ("late-reply:delay=601s", "from 0 to 600000"),
        ("late-reply:delay=0.0001s", "from 0 to 600000"),
        ("split-bytes:size=0", "a whole number of bytes from 1 to 512"),
        ("flipped-bit:bit=8", "from 0 to 7"),
        ("alarm:number=9-999", "the number of an alarm of the controller"),
        ("wrong-reply:text=\"OK", "KIND:key=value"),
        ("wrong-reply:text=<QQ>", "at most 253 bytes"),
        ("drive-full:command=UL", "expected DL or MW, found `UL`"),
        ("drive-full:block=2", "expected 0, the command itself, found `2`"),
        ("key-turned:to=off", "expected teaching or internal or ext"),
    ] {
        match spec.parse::<Fault>() {
            Ok(fault) => assert_eq!(spec, "no-reply:", "{fault} is taken"),
            Err(error) => assert!(error.to_string().contains(says), "{spec}: {error}"),
        }
    }
    assert!("x".repeat(3_000).parse::<Fault>().is_err());
}

#[test]
fn after_times_and_the_numbers_decide_whose_turn_it_is() {
    let mut robot = robot();
    arm(&mut robot, "no-reply:command=SO,after=1,times=2");
    arm(&mut robot, "late-reply:command=SO,after=2,times=0,delay=10");
    let ok = b"\x02OK\r\x03";
    let mut heard = Vec::new();
    for _ in 0..5 {
        let began = robot.now().as_micros() / 1_000;
        let found = ask(&mut robot, b"SO", 1_000);
        heard.push(found.first().map(|(at, output)| (at - began, output.clone())));
    }
    assert_eq!(heard[0], Some(sent(0, ok)));
    assert_eq!((&heard[1], &heard[2]), (&None, &None));
    assert_eq!((&heard[3], &heard[4]), (&Some(sent(10, ok)), &Some(sent(10, ok))));
    let found: Vec<_> = robot
        .faults()
        .reports()
        .map(|report| (report.seen, report.fired))
        .collect();
    assert_eq!(found, [(3, 2), (5, 2)]);
}

#[test]
fn faults_are_numbered_replaced_disarmed_cleared_and_bounded() {
    let mut robot = robot();
    arm(&mut robot, "no-reply");
    arm(&mut robot, "ng:id=7");
    arm(&mut robot, "ng");
    arm(&mut robot, "lost-etx:id=7");
    let found: Vec<_> = robot
        .faults()
        .reports()
        .map(|report| (report.fault.id, report.fault.kind.name))
        .collect();
    assert_eq!(found, [(1, "no-reply"), (7, "lost-etx"), (8, "ng")]);
    for id in [1, 8] {
        robot.feed(robot.now(), Input::from(FaultAction::Disarm(id)));
    }
    assert_eq!(ask(&mut robot, b"SO", 10), [sent(0, b"\x02OK\r")]);
    let refused = robot.feed(robot.now(), Input::from(FaultAction::Disarm(99)));
    assert!(matches!(&refused[..], [Output::Event(Event::ActionRefused(_))]));
    robot.feed(robot.now(), Input::from(FaultAction::Clear));
    assert!(robot.faults().is_empty());
    for _ in 0..=MAX_FAULTS {
        arm(&mut robot, "ng");
    }
    assert_eq!(robot.faults().reports().count(), MAX_FAULTS);
}

#[test]
fn what_leaves_is_late_split_doubled_or_another() {
    let answers = |spec: &str| {
        let mut robot = robot();
        arm(&mut robot, spec);
        ask(&mut robot, b"SO", 9_000)
    };
    let ok = b"\x02OK\r\x03";
    assert_eq!(answers("late-reply:delay=6s"), [sent(6_000, ok)]);
    assert_eq!(answers("no-reply"), []);
    assert_eq!(answers("lost-etx"), [sent(0, b"\x02OK\r")]);
    assert_eq!(answers("wrong-reply"), [sent(0, b"\x02FL,\x1a\x03")]);
    assert_eq!(answers("wrong-reply:text=NG<CR>"), [sent(0, b"\x02NG\r\x03")]);
    assert_eq!(answers("flipped-bit:byte=2,bit=1"), [sent(0, b"\x02OI\r\x03")]);
    assert_eq!(answers("flipped-bit:byte=50"), [sent(0, ok)]);
    assert_eq!(
        answers("split-bytes:size=2,pause=30"),
        [sent(0, b"\x02O"), sent(30, b"K\r"), sent(60, b"\x03")]
    );
    assert_eq!(answers("duplicate-text:pause=10"), [sent(0, ok), sent(10, ok)]);
    assert_eq!(answers("merged-texts:hold=400"), [sent(400, ok)]);
    let slow = answers("slow-line:speed=50");
    assert_eq!(
        slow.iter().map(|(at, _)| *at).collect::<Vec<_>>(),
        [200, 400, 600, 800, 1_000]
    );
    assert_eq!(answers("ng"), [sent(0, b"\x02NG\r\x03")]);
    assert_eq!(answers("no-reply:lost=command"), []);
}

#[test]
fn a_command_that_is_lost_or_refused_has_no_effect_and_one_whose_answer_is_lost_has() {
    for (spec, servo) in [
        ("no-reply", true),
        ("no-reply:lost=command", false),
        ("ng", false),
    ] {
        let mut robot = robot();
        arm(&mut robot, spec);
        ask(&mut robot, b"SO", 10);
        assert_eq!(robot.state().servo, servo, "{spec}");
    }
}

#[test]
fn a_held_text_leaves_in_one_write_with_the_next() {
    let mut robot = robot();
    arm(&mut robot, "merged-texts");
    assert_eq!(ask(&mut robot, b"SO", 100), []);
    assert_eq!(
        ask(&mut robot, b"BR", 100),
        [sent(100, b"\x02OK\r\x03\x02OK\r\x03")]
    );
}

#[test]
fn a_reply_waits_for_a_late_one_although_the_fault_is_cleared() {
    let mut robot = robot();
    arm(&mut robot, "late-reply:delay=400");
    assert_eq!(ask(&mut robot, b"SO", 100), []);
    robot.feed(robot.now(), Input::from(FaultAction::Clear));
    assert_eq!(
        ask(&mut robot, b"RN", 1_000),
        [sent(400, b"\x02OK\r\x03"), sent(400, b"\x02NG\r\x03")]
    );
}

#[test]
fn a_connection_that_is_cut_or_half_open_says_nothing_more_until_there_is_another() {
    let mut robot = robot();
    arm(&mut robot, "reset-mid-text:bytes=2");
    let port = Port::Ip0;
    let cut = |at, how| (at, Output::Disconnect { port, how });
    assert_eq!(
        ask(&mut robot, b"SO", 100),
        [sent(0, b"\x02O"), cut(20, DisconnectMode::Reset)]
    );
    assert_eq!(ask(&mut robot, b"BR", 100), []);
    let again = |robot: &mut Controller| {
        robot.feed(robot.now(), Input::Disconnected { port });
        let peer = "again".to_string();
        robot.feed(robot.now(), Input::Connected { port, peer });
    };
    again(&mut robot);
    assert_eq!(ask(&mut robot, b"SO", 100), [sent(200, b"\x02OK\r\x03")]);
    arm(&mut robot, "half-open:lasts=1s");
    assert_eq!(ask(&mut robot, b"SO", 100), [(300, Output::Stall { port })]);
    assert_eq!(ask(&mut robot, b"BR", 2_000), [cut(1_300, DisconnectMode::Reset)]);
    assert!(robot.state().servo, "BR is not heard");
    again(&mut robot);
    assert_eq!(ask(&mut robot, b"BR", 100).len(), 1);
}

#[test]
fn a_serial_line_goes_on_behind_what_is_lost_of_a_text() {
    let mut robot = robot();
    robot.robot.context.config.options.serial_pacing = false;
    let port = Port::Host;
    robot.feed(
        Time::ZERO,
        Input::Connected {
            port,
            peer: String::new(),
        },
    );
    for (spec, first) in [("reset-mid-text:bytes=1", 1), ("half-open:lasts=1s", 0)] {
        arm(&mut robot, spec);
        let mut told = |wait: u64| {
            let bytes = b"\x02SU\r\x03".to_vec();
            let mut outputs = robot.feed(robot.now(), Input::received(port, bytes));
            outputs.extend(robot.feed(robot.now() + Duration::from_millis(wait), Input::Tick));
            assert!(
                !outputs
                    .iter()
                    .any(|output| matches!(output, Output::Disconnect { .. } | Output::Stall { .. }))
            );
            let bytes = outputs.into_iter().map(|output| match output {
                Output::Send { bytes, .. } => bytes.len(),
                _ => 0,
            });
            bytes.sum::<usize>()
        };
        assert_eq!(told(12_000), first, "{spec}");
        assert!(told(12_000) > 50, "{spec}");
    }
}

#[test]
fn a_full_drive_refuses_at_the_text_that_does_not_fit_and_keeps_the_file() {
    let mut robot = robot();
    robot.put_file("A", b"OLD\n").unwrap();
    arm(&mut robot, "drive-full:free=100");
    assert_eq!(ask(&mut robot, b"DL,A", 1), [sent(0, b"\x02OK\r\x03")]);
    let text = [b"\x02FL,".as_slice(), &b"N\n".repeat(60), b"\x1a\x03"].concat();
    let port = Port::Ip0;
    let bytes = text.clone();
    let answer = robot.feed(robot.now(), Input::received(port, bytes));
    assert!(answer.contains(&Output::Send {
        port,
        bytes: Bytes::from_static(b"\x02NG\r\x03")
    }));
    assert_eq!(robot.drive().get("A"), Some(b"OLD\n".as_slice()));
    ask(&mut robot, b"DL,A", 1);
    let answer = robot.feed(robot.now(), Input::received(port, text));
    assert!(answer.contains(&Output::Send {
        port,
        bytes: Bytes::from_static(b"\x02OK\r\x03")
    }));
    robot
        .put_file("V", b"GLOBAL\nN = 1\nEND\nPROGRAM V\nEND\n")
        .unwrap();
    robot.select(robot.now(), "V").unwrap();
    arm(&mut robot, "drive-full:command=MW");
    for answer in [b"\x02NG\r\x03", b"\x02OK\r\x03"] {
        let found = ask(&mut robot, b"MW,1 N 0 2", 100);
        assert!(
            found.iter().any(
                |(_, output)| matches!(output, Output::Send { bytes, .. } if bytes == answer.as_slice())
            )
        );
    }
}

#[test]
fn the_power_goes_in_the_middle_of_a_download() {
    let mut robot = robot();
    robot.put_file("A", b"OLD\n").unwrap();
    arm(&mut robot, "power-loss");
    ask(&mut robot, b"DL,A", 1);
    let port = Port::Ip0;
    let bytes = b"\x02FL,NEW\n\x1a\x03".to_vec();
    let outputs = robot.feed(robot.now(), Input::received(port, bytes));
    assert!(outputs.contains(&Output::PowerCycled));
    assert!(
        !outputs
            .iter()
            .any(|output| matches!(output, Output::Send { .. } | Output::Stored { .. }))
    );
    assert_eq!(robot.drive().get("A"), Some(b"OLD\n".as_slice()));
}

// clause: I17-026
#[test]
fn the_machine_is_struck_in_its_time_and_let_go_again() {
    let mut robot = robot();
    arm(&mut robot, "emergency-stop:command=SO,delay=200,release=300");
    arm(&mut robot, "key-turned:command=BR,delay=100,back=100,to=internal");
    arm(&mut robot, "servo-failure:command=FD");
    arm(&mut robot, "alarm:command=CA,number=4-101");
    let mut at = |command: &[u8], wait: u64| {
        ask(&mut robot, command, wait);
        (
            robot.state().emergency_stop,
            robot.state().key,
            robot.state().servo,
        )
    };
    use crate::KeySwitch::{Ext, Internal};
    assert_eq!(at(b"SO", 199), (false, Ext, true));
    assert_eq!(at(b"SU", 2), (true, Ext, false));
    assert_eq!(at(b"SU", 300), (false, Ext, false));
    assert_eq!(at(b"RS,ERR", 1), (false, Ext, false));
    assert_eq!(at(b"SO", 1), (false, Ext, true));
    assert_eq!(at(b"FD", 1), (false, Ext, false));
    assert_eq!(at(b"BR", 110), (false, Internal, false));
    assert_eq!(at(b"SU", 100), (false, Ext, false));
    ask(&mut robot, b"CA", 1);
    let active: Vec<String> = robot
        .alarms()
        .active()
        .iter()
        .map(|alarm| alarm.code.number())
        .collect();
    assert_eq!(active, ["8-026", "4-101"]);
}

#[test]
fn records_are_lost_whole_however_they_come() {
    let mut robot = robot();
    arm(&mut robot, "lost-record:after=1,times=2");
    for bytes in [b"1,2".as_slice(), b"\r3", b",4\r\n5\r", b"6\r"] {
        let bytes = bytes.to_vec();
        let port = Port::Ip1;
        robot.feed(robot.now(), Input::received(port, bytes));
    }
    let channel = robot.robot.channels.get(Port::Ip1).unwrap();
    assert_eq!(channel.len(), b"1,2\r\n6\r".len());
}

#[test]
fn a_parity_error_takes_one_character_on_a_modelled_line_and_on_a_real_one() {
    for host in [HostEnd::default(), HostEnd::Wire] {
        let mut robot = robot();
        let port = Port::Host;
        robot.feed(
            Time::ZERO,
            Input::Connected {
                port,
                peer: String::new(),
            },
        );
        robot.feed(Time::ZERO, Input::SerialOpened { port, host });
        arm(&mut robot, "parity-error:character=1");
        let bytes = b"\x02SO\r\x03".to_vec();
        let mut outputs = robot.feed(Time::ZERO, Input::received(port, bytes));
        outputs.extend(robot.feed(Time::from_millis(100), Input::Tick));
        let lost = Output::Event(Event::Dropped {
            port,
            bytes: 1,
            reason: "parity error",
        });
        assert!(outputs.contains(&lost), "{outputs:?}");
        assert!(!robot.state().servo, "`O` is no command");
    }
}

#[test]
fn what_comes_in_can_be_flipped() {
    let mut robot = robot();
    arm(&mut robot, "flipped-bit:way=in,byte=1,bit=0");
    assert_eq!(ask(&mut robot, b"SO", 1), [sent(0, b"\x02NG\r\x03")]);
    assert!(!robot.state().servo);
}

#[test]
fn a_random_flip_reaches_every_bit_of_every_byte() {
    let mut robot = robot();
    arm(&mut robot, "flipped-bit:times=0");
    let whole = b"\x02NG\r\x03";
    let mut flipped = [0; 5];
    for _ in 0..1_000 {
        for (_, output) in ask(&mut robot, b"XX", 1) {
            let Output::Send { bytes, .. } = output else {
                panic!("{output:?}");
            };
            for (seen, (byte, right)) in flipped.iter_mut().zip(bytes.iter().zip(whole)) {
                *seen |= byte ^ right;
            }
        }
    }
    assert_eq!(flipped, [0xFF; 5]);
}

#[test]
fn a_power_cycle_takes_what_waits_and_leaves_what_is_armed() {
    let mut robot = robot();
    arm(&mut robot, "late-reply:command=SO,delay=5s");
    arm(&mut robot, "ng");
    ask(&mut robot, b"SO", 0);
    robot.feed(robot.now(), Input::by_hand(PanelAction::PowerCycle));
    let later = robot.feed(Time::from_millis(9_000), Input::Tick);
    assert!(!later.iter().any(|output| matches!(output, Output::Send { .. })));
    assert_eq!(robot.faults().reports().count(), 2);
}
