//! What a host and those who hold the controller see of a change that is kept, and of one that is not.

use super::*;
use crate::PersistError;
use crate::action::{Action, ActionErrorKind};
use crate::controls::PanelAction;
use crate::drive::STAGED;
use crate::input::Input;
use crate::options::WhileSending;
use crate::output::{Event, Output};
use crate::panel::ControlRight;
use crate::time::Time;
use crate::{Config, Controller, Dialect};
use alloc::collections::VecDeque;
use core::time::Duration;

const PROGRAM: &[u8] = b"GLOBAL\nN = 1\nEND\nPROGRAM V\nN = 7\nRESTORE N\nEND\n";
const FULL: &str = "the disk is full";

/// A controller whose files are kept by this test, and what it has put out.
struct Robot {
    controller: Controller,
    /// The answers to come; then everything is kept.
    answers: VecDeque<Result<(), PersistError>>,
    asked: Vec<(String, Option<usize>)>,
    outputs: Vec<Output>,
}

impl Robot {
    fn new(outside: bool) -> Robot {
        let mut config = Config::new(Dialect::Field);
        config.options.while_sending = WhileSending::Kept;
        let mut controller = Controller::new(config, Vec::new()).unwrap();
        controller.put_file("A", b"OLD\n").unwrap();
        controller.put_file("D", b"OLD\n").unwrap();
        controller.put_file("V", PROGRAM).unwrap();
        controller.select(Time::ZERO, "V").unwrap();
        controller.persist_outside(outside);
        let mut robot = Robot {
            controller,
            answers: VecDeque::new(),
            asked: Vec::new(),
            outputs: Vec::new(),
        };
        for port in [Port::Host, Port::Ip0] {
            let peer = "a test".to_string();
            robot.feed(Input::Connected { port, peer });
        }
        robot.feed(Input::by_hand(PanelAction::Servo(true)));
        robot.outputs.clear();
        robot
    }

    fn full() -> Robot {
        let mut robot = Robot::new(true);
        robot.answers = core::iter::repeat_n(Err(PersistError::Refused(FULL.to_string())), 100).collect();
        robot
    }

    fn feed(&mut self, input: Input) {
        self.feed_at(self.controller.now(), input);
    }

    /// One input, each question answered at once.
    fn feed_at(&mut self, now: Time, input: Input) {
        let mut next = Some(input);
        while let Some(input) = next.take() {
            let _refusal_is_an_event = self.controller.handle(now, input);
            while let Some(output) = self.controller.poll_output() {
                let Output::Persist { name, content } = output else {
                    self.outputs.push(output);
                    continue;
                };
                assert!(next.is_none(), "one question at a time");
                self.asked.push((name, content.map(|content| content.len())));
                next = Some(Input::Persisted(self.answers.pop_front().unwrap_or(Ok(()))));
            }
        }
    }

    fn bytes(&mut self, port: Port, bytes: &[u8]) {
        let bytes = bytes.to_vec();
        self.feed(Input::received(port, bytes));
    }

    fn command(&mut self, command: &str) {
        self.bytes(Port::Ip0, format!("\x02{command}\r\x03").as_bytes());
    }

    /// What a port has been sent since this was asked last.
    fn sent(&mut self, port: Port) -> String {
        let mut sent = String::new();
        self.outputs.retain(|output| match output {
            Output::Send { port: to, bytes } if *to == port => {
                sent.push_str(&String::from_utf8_lossy(bytes).replace(['\x02', '\x03', '\r'], " "));
                false
            }
            _ => true,
        });
        sent
    }

    fn file(&self, name: &str) -> &[u8] {
        self.controller.drive().get(name).unwrap_or(b"none")
    }
}

#[test]
fn a_download_is_answered_when_it_is_kept() {
    let mut robot = Robot::new(true);
    robot.command("DL,A");
    assert_eq!(robot.sent(Port::Ip0), " OK  ");
    let (port, bytes) = (Port::Ip0, b"\x02FL,NEW\n\x1a\x03".to_vec());
    let outputs = robot.controller.feed(Time::ZERO, Input::received(port, bytes));
    let shown = |output: &Output| matches!(output, Output::Send { .. } | Output::Stored { .. });
    assert!(!outputs.iter().any(shown), "{outputs:?}");
    assert!(outputs.contains(&Output::Persist {
        name: "A".to_string(),
        content: Some(b"NEW\n".as_slice().into())
    }));
    assert_eq!(robot.file("A"), b"OLD\n");
    assert!(!robot.controller.is_idle(), "the host is owed an OK");
    robot.feed(Input::Persisted(Ok(())));
    assert!(robot.controller.is_idle());
    assert_eq!(robot.file("A"), b"NEW\n");
    assert_eq!(robot.sent(Port::Ip0), " OK  ");
    // An answer to nothing is none.
    let before = robot.controller.clone();
    robot.feed(Input::Persisted(Err(PersistError::Refused(FULL.to_string()))));
    assert_eq!(robot.controller, before);
}

#[test]
fn a_change_is_carried_out_once_whoever_stores_it() {
    for outside in [false, true] {
        let mut robot = Robot::new(outside);
        let staged = |robot: &mut Robot, act: &dyn Fn(&mut Robot)| {
            let before = STAGED.get();
            act(robot);
            STAGED.get() - before
        };
        robot.command("DL,A");
        robot.sent(Port::Ip0);
        let download = staged(&mut robot, &|robot| {
            robot.bytes(Port::Ip0, b"\x02FL,NEW\n\x1a\x03");
        });
        assert_eq!(
            (download, robot.sent(Port::Ip0).as_str()),
            (1, " OK  "),
            "{outside}"
        );
        let write = staged(&mut robot, &|robot| robot.command("MW,1 N 0 5"));
        assert_eq!((write, robot.sent(Port::Ip0).as_str()), (1, " OK  "), "{outside}");
        assert_eq!(robot.file("A"), b"NEW\n");
        assert_eq!(robot.asked.len(), if outside { 2 } else { 0 });
    }
}

#[test]
fn what_is_not_kept_is_refused_and_the_drive_is_as_before() {
    let mut robot = Robot::full();
    let drive = robot.controller.drive().clone();
    let memory = |robot: &mut Robot| {
        robot.command("MR,N 0");
        let sent = robot.sent(Port::Ip0);
        robot.command("OK");
        sent
    };
    let before = memory(&mut robot);
    robot.command("DL,A");
    robot.sent(Port::Ip0);
    robot.bytes(Port::Ip0, b"\x02FL,NEW\n\x1a\x03");
    assert_eq!(robot.sent(Port::Ip0), " NG  ");
    for command in ["ER,A", "MW,1 N 0 2"] {
        robot.command(command);
        assert_eq!(robot.sent(Port::Ip0), " NG  ", "{command}");
    }
    assert_eq!(robot.controller.drive(), &drive);
    assert_eq!(memory(&mut robot), before);
    assert_eq!(robot.asked.len(), 3);
    let reasons: Vec<&str> = robot
        .outputs
        .iter()
        .filter_map(|output| match output {
            Output::Event(Event::Refused { reason, .. }) => Some(reason.as_str()),
            _ => None,
        })
        .collect();
    assert_eq!(reasons.len(), 3);
    assert!(reasons.iter().all(|reason| reason.contains(FULL)), "{reasons:?}");
    // It goes on when there is room again.
    robot.answers.clear();
    robot.command("ER,A");
    assert_eq!(
        (robot.sent(Port::Ip0).as_str(), robot.file("A")),
        (" OK  ", b"none".as_slice())
    );
}

/// The download holds the SP back. It has ended when its file is being stored, but OK has not been sent yet.
#[test]
fn no_sp_leaves_while_a_file_is_being_stored() {
    let mut robot = Robot::new(true);
    for command in ["RN", "DL,A"] {
        robot.command(command);
        assert_eq!(robot.sent(Port::Ip0), " OK  ");
    }
    let bytes = b"\x02FL,NEW\n\x1a\x03".to_vec();
    let input = Input::received(Port::Ip0, bytes);
    robot.outputs = robot.controller.feed(Time::from_millis(600), input);
    assert_eq!(robot.sent(Port::Ip0), "");
    robot.feed(Input::Persisted(Ok(())));
    assert_eq!(robot.sent(Port::Ip0), " OK  ");
    robot.feed_at(Time::from_millis(650), Input::Tick);
    assert_eq!(robot.sent(Port::Ip0), " SP  ");
}

#[test]
fn texts_of_one_segment_are_answered_in_their_order() {
    for (full, answers) in [(false, " OK   NG   NG  "), (true, " NG   NG   OK  ")] {
        let mut robot = if full { Robot::full() } else { Robot::new(true) };
        robot.answers.truncate(1);
        robot.bytes(Port::Ip0, b"\x02ER,A\r\x03\x02XX\r\x03\x02ER,A\r\x03");
        assert_eq!(robot.sent(Port::Ip0), answers);
    }
}

#[test]
fn an_action_is_refused_as_one_that_cannot_be_kept() {
    let name = || "A".to_string();
    let (values, content) = (vec![ts3100_proto::command::Number::Integer(3)], b"X\n".to_vec());
    let restore = true;
    for action in [
        Action::PutFile {
            name: name(),
            content,
        },
        Action::EraseFile { name: name() },
        Action::SetVariable {
            name: "N".to_string(),
            values,
            restore,
        },
    ] {
        let mut robot = Robot::full();
        let before = robot.controller.drive().clone();
        robot.feed(Input::by_owner(action.clone()));
        let undone = robot.outputs.iter().find_map(|output| match output {
            Output::Event(Event::ActionRefused(refusal)) => Some(refusal),
            _ => None,
        });
        let refusal = undone.unwrap_or_else(|| panic!("{action:?}"));
        assert_eq!(
            (
                refusal.kind,
                refusal.sentence.strip_prefix("cannot keep the change: ")
            ),
            (ActionErrorKind::NotPersisted, Some(FULL))
        );
        assert_eq!(robot.controller.drive(), &before);
    }
}

#[test]
fn restore_of_a_program_that_is_not_kept_raises_its_alarm() {
    for (full, alarms, kept) in [(true, 1, "N = 1"), (false, 0, "N = 7")] {
        let mut robot = if full { Robot::full() } else { Robot::new(true) };
        robot.command("RN");
        assert_eq!(robot.controller.alarms().active().len(), alarms);
        assert!(String::from_utf8_lossy(robot.file("V")).contains(kept));
        assert_eq!(robot.asked.len(), 1);
    }
}

#[test]
fn an_input_that_comes_in_place_of_the_answer_says_no() {
    let mut robot = Robot::new(true);
    let (port, bytes) = (Port::Ip0, b"\x02ER,A\r\x03".to_vec());
    robot.controller.feed(Time::ZERO, Input::received(port, bytes));
    robot.feed(Input::Tick);
    assert_eq!(
        (robot.sent(Port::Ip0).as_str(), robot.file("A")),
        (" NG  ", b"OLD\n".as_slice())
    );
}

/// Everything that changes files, some of it at one instant: by a paced line, in one segment, by a program.
fn day(robot: &mut Robot) -> Vec<Output> {
    let right = PanelAction::ControlRight(ControlRight::Rs232c);
    robot.command("RN");
    robot.command("DL,B");
    robot.bytes(
        Port::Ip0,
        b"\x02FL,B\n\x1a\x03\x02SU\r\x03\x02OK\r\x03\x02ER,A\r\x03",
    );
    robot.feed(Input::by_hand(right));
    robot.feed_at(Time::from_micros(500_000), Input::Tick);
    robot.bytes(Port::Host, b"\x02DL,C\r\x03");
    robot.feed_at(Time::from_micros(1_000_000), Input::Tick);
    robot.bytes(Port::Host, b"\x02FL,C\n\x1a\x03\x02ER,B\r\x03");
    // All of it passes the line before this one input.
    robot.feed_at(
        Time::from_micros(2_000_000),
        Input::by_owner(Action::EraseFile {
            name: "C".to_string(),
        }),
    );
    // The host is gone before its last command has passed the line.
    robot.bytes(Port::Host, b"\x02ER,D\r\x03");
    robot.feed(Input::Disconnected { port: Port::Host });
    // Only what is due is looked at.
    let end = robot.controller.now() + Duration::from_secs(1);
    while let Some(due) = robot.controller.poll_deadline().filter(|due| *due <= end) {
        robot.feed_at(due, Input::Tick);
    }
    core::mem::take(&mut robot.outputs)
}

#[test]
fn a_day_on_which_everything_is_kept_is_the_same_day() {
    let (mut inside, mut outside) = (Robot::new(false), Robot::new(true));
    let (told, seen) = (day(&mut inside), day(&mut outside));
    assert_eq!(seen, told);
    outside.controller.persist_outside(false);
    assert_eq!(outside.controller, inside.controller);
    let names: Vec<&str> = outside.asked.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["V", "B", "A", "C", "B", "C", "D"]);
    assert!(inside.asked.is_empty());
}

#[test]
fn what_came_at_the_same_instant_waits_for_the_answer() {
    let mut robot = Robot::full();
    day(&mut robot);
    assert_eq!(robot.asked.len(), 5, "{:?}", robot.asked);
    assert_eq!(robot.file("A"), b"OLD\n");
    assert!(!robot.controller.drive().contains("B") && !robot.controller.drive().contains("C"));
    assert!(robot.controller.peer(Port::Host).is_none());
}
