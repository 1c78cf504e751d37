//! Fuzzes the ports: arbitrary bytes on each of them, split anywhere, with time in between, connections that open and
//! close, and every panel action.
//!
//! The controller never panics, never hangs, never grows without bound, and afterwards lists its files to a new host as
//! they are. `cell.rs` stresses programs instead.
use super::shared::{Choices, Robot};
use ts3100_controller::{ControlRight, Input, KeySwitch, PanelAction};
use ts3100_proto::parameter::OpenMode;

/// Events of one run.
const EVENTS: u32 = 300;
const PROGRAM: &[u8] =
    b"GLOBAL\rN=0\rEND\rPROGRAM M\rX=0.0\rL:\rINPUT IP1,N,X\rPRINT IP1,N,X,CR\rGOTO L\rEND\rDATA\r\
    POINT P1=400,0,200/\rEND\r";

/// Name and size of a record of CA.
fn entry(record: &str) -> (&str, usize) {
    let (name, size) = record.split_once(' ').expect("a name and a size");
    (name, size.trim().parse().expect("a size"))
}

pub fn check(data: &[u8]) {
    let mut choices = Choices(data);
    let mut robot = Robot::new(choices.byte() & 1 == 0);
    let stored = robot.seat.controller.put_file("TEST", PROGRAM);
    assert!(stored.is_ok());
    for _ in 0..EVENTS {
        if choices.is_empty() {
            break;
        }
        robot.act(&mut choices);
    }
    // Long enough for every time limit of an unfinished text; then a new host is served.
    robot.advance(30_000);
    robot.feed(Input::by_hand(PanelAction::Key(KeySwitch::Ext)));
    robot.feed(Input::by_hand(PanelAction::ControlRight(ControlRight::Ether)));
    robot.feed(Input::by_hand(PanelAction::PowerCycle));
    if robot.seat.controller.network().channels[0].mode == OpenMode::NotUsed {
        return;
    }
    robot.new_host();
    let listed = String::from_utf8(robot.file("CA")).expect("a directory is characters");
    let found: Vec<(&str, usize)> = listed.split_terminator('\r').map(entry).collect();
    let mut stored_files: Vec<(&str, usize)> = robot
        .seat
        .controller
        .files()
        .map(|(name, content)| (name, content.len()))
        .collect();
    stored_files.sort_unstable();
    assert_eq!(found, stored_files, "{listed:?}");
}
