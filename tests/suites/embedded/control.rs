//! The methods of an embedded emulator that do what the commands of `ts3100 ctl` do.

use std::time::Duration;
use ts3100_emulator::embed::{
    ControlRight, Emulator, Error, ExecutionStatus, KeySwitch, Number, Port, TimeMode, rules,
};
use ts3100_tests::bench::{Bench, builder};

const SECOND: Duration = Duration::from_secs(1);
const COUNT: &str = "GLOBAL\nN = 0\nEND\nPROGRAM COUNT\nINPUT N\nPRINT \"GOT\", CR\nDELAY 2\nDOUT(5)\nWAIT DIN(2)\nEND\n\
    DATA\nPOINT HOME = 400, 0, 200\nEND\n";

fn stepped() -> Emulator {
    let robot = Emulator::builder().file("COUNT", COUNT).select("COUNT");
    robot.servo_on(true).time(TimeMode::Stepped).start().unwrap()
}

#[test]
fn time_moves_only_as_a_test_moves_it() {
    let robot = stepped();
    robot.advance(3 * SECOND).unwrap();
    assert_eq!(robot.now().unwrap(), 3 * SECOND);
    robot.start_program().unwrap();
    assert_eq!(robot.status().unwrap(), ExecutionStatus::Running);
    assert!(
        !robot.advance_until("output 5 on", SECOND).unwrap(),
        "it waits for its number"
    );
    robot.press_keys("7\r").unwrap();
    assert!(robot.advance_until("output 5 on", 10 * SECOND).unwrap());
    assert_eq!(robot.pendant().unwrap().trim(), "GOT");
    assert!(robot.output(5).unwrap() && !robot.output(6).unwrap());
    let value = robot.variable("N").unwrap().unwrap().value;
    assert_eq!(value, Some(vec![Number::Integer(7)]));
    assert!(
        robot.wait_until("output 5 on", SECOND).unwrap(),
        "it holds already"
    );
    let unread = robot.advance_until("outptu 5 on", SECOND).unwrap_err();
    assert!(matches!(unread, Error::Condition(_)));
    assert!(unread.to_string().contains("did you mean `output`?"), "{unread}");
    robot.set_time_mode(TimeMode::Auto).unwrap();
    robot.set_input(2, true).unwrap();
    assert!(robot.wait_until("idle", 10 * SECOND).unwrap());
    robot.reset().unwrap();
    assert!(!robot.output(5).unwrap());
}

#[test]
fn switches_and_buttons_work_and_refuse_with_their_reason() {
    let robot = stepped();
    robot.set_emergency_stop(true).unwrap();
    let refused = robot.set_servo(true).unwrap_err().to_string();
    assert_eq!(refused, "cannot turn the servo on: the emergency stop is pressed");
    robot.set_emergency_stop(false).unwrap();
    robot.set_safety_switch(true).unwrap();
    assert!(robot.set_servo(true).is_err());
    robot.set_safety_switch(false).unwrap();
    robot.reset_alarms().unwrap();
    robot.set_servo(true).unwrap();
    robot.set_key_switch(KeySwitch::Teaching).unwrap();
    robot.set_control_right(ControlRight::Sig).unwrap();
    let state = robot.read(|controller| controller.state().clone()).unwrap();
    assert_eq!(
        (state.key, state.control_right),
        (KeySwitch::Teaching, ControlRight::Sig)
    );
    robot.set_battery(true).unwrap();
    robot.set_machine_lock(true).unwrap();
    robot.set_feed_hold(true).unwrap();
    robot.set_feed_hold(false).unwrap();
    robot.raise_alarm("2-046", "by a test").unwrap();
    assert!(robot.alarms().unwrap().contains(&"2-046".to_owned()));
    robot.set_battery(false).unwrap();
    robot.reset_alarms().unwrap();
    assert!(!robot.alarms().unwrap().contains(&"2-046".to_owned()));
    robot.power_off().unwrap();
    assert!(robot.start_program().is_err());
    robot.power_on().unwrap();
    robot.power_cycle().unwrap();
}

#[test]
fn lines_variables_and_files_are_read_and_changed() {
    let robot = stepped();
    robot.set_output(7, true).unwrap();
    robot.force_input(3, true).unwrap();
    robot.set_input(3, false).unwrap();
    assert!(robot.output(7).unwrap() && robot.input(3).unwrap());
    robot.release_input(3).unwrap();
    assert!(!robot.input(3).unwrap());
    robot.pulse_input(4, true, SECOND).unwrap();
    assert!(robot.input(4).unwrap());
    robot.advance(2 * SECOND).unwrap();
    assert!(!robot.input(4).unwrap());
    robot.set_variable("N", &[Number::Integer(5)], false).unwrap();
    assert_eq!(
        robot.variable("n").unwrap().unwrap().value,
        Some(vec![Number::Integer(5)])
    );
    assert!(robot.set_variable("M", &[Number::Integer(5)], false).is_err());
    assert_eq!(robot.variable("M").unwrap(), None);
    robot.teach_position("HOME", false).unwrap();
    robot.put_file("other", "PROGRAM OTHER\nEND\n").unwrap();
    assert!(robot.files().unwrap().contains(&"OTHER".to_owned()));
    assert!(
        robot
            .file("OTHER")
            .unwrap()
            .unwrap()
            .starts_with(b"PROGRAM OTHER")
    );
    robot.select_file("other").unwrap();
    assert_eq!(
        robot.read(|controller| controller.selected().to_owned()).unwrap(),
        "OTHER"
    );
    robot.select_file("COUNT").unwrap();
    robot.erase_file("other").unwrap();
    assert_eq!(robot.file("OTHER").unwrap(), None);
    assert!(robot.drop_peer(Port::Ip0).is_err(), "nobody is connected");
    robot.arm_fault("no-reply:command=SU,id=9").unwrap();
    robot.disarm_fault(9).unwrap();
    robot.clear_faults().unwrap();
    assert!(robot.faults().unwrap().is_empty());
}

/// A task of tokio has a budget, after which what it polls is never ready before it gives way. A method cannot give way.
#[test]
fn waits_of_one_async_task_are_not_limited_in_number() {
    let robot = stepped();
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    runtime.block_on(async {
        for _ in 0..300 {
            robot.advance(Duration::from_millis(1)).unwrap();
        }
    });
    assert_eq!(robot.now().unwrap(), Duration::from_millis(300));
}

#[test]
fn an_advance_that_a_reset_cuts_short_is_an_error() {
    let program = "PROGRAM LOOP\nAGAIN:\nDELAY 0.001\nGOTO AGAIN\nEND\n";
    let robot = Emulator::builder().file("LOOP", program).select("LOOP");
    let robot = robot.servo_on(true).time(TimeMode::Stepped).start().unwrap();
    robot.start_program().unwrap();
    std::thread::scope(|scope| {
        let advance = scope.spawn(|| robot.advance(Duration::from_secs(2_000_000)));
        let moves = (0..100_000).any(|_| !robot.now().unwrap().is_zero());
        assert!(moves, "time stands");
        robot.reset().unwrap();
        let ended = advance.join().unwrap();
        assert!(matches!(ended, Err(Error::CutShort)), "{ended:?}");
    });
    robot.advance(SECOND).unwrap();
    assert_eq!(robot.now().unwrap(), SECOND);
}

#[test]
fn a_line_that_the_controller_does_not_have_is_refused_as_by_the_control_interface() {
    let bench = Bench::start(builder());
    let robot = &bench.emulator;
    for (path, read) in [
        ("/inputs/300", robot.input(300)),
        ("/outputs/300", robot.output(300)),
    ] {
        let expected = bench.refused(404, "GET", path, "");
        assert_eq!(read.unwrap_err().to_string(), expected);
    }
    assert!(!robot.output(264).unwrap());
}

#[test]
fn what_ctl_shows_has_a_method() {
    let robot = stepped();
    assert_eq!(robot.time_mode().unwrap(), TimeMode::Stepped);
    robot.press_feed_hold().unwrap();
    assert!(robot.read(|controller| controller.state().feed_hold).unwrap());
    robot.press_feed_hold().unwrap();
    assert!(!robot.read(|controller| controller.state().feed_hold).unwrap());
    robot.take_snapshot("a").unwrap();
    robot.take_snapshot("b").unwrap();
    robot.delete_snapshot("a").unwrap();
    assert_eq!(robot.snapshots().unwrap(), ["b"]);
    assert!(robot.restore_snapshot("a").is_err());
    assert_eq!(robot.findings().count(&rules::LOWER_CASE), 0);
}
