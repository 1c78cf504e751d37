//! The power switch beside buttons, events and faults. Which parts keep what over a power cycle is in `maintenance` and
//! `snapshots`.

use ts3100_controller::faults::{Fault, FaultAction};
use ts3100_controller::{Action, Controller, Event, Input, Output, PanelAction, Port};
use ts3100_proto::status::ExecutionStatus;
use ts3100_tests::Robot;

const FEEDER: &str = "PROGRAM P\nDELAY 60\nEND\n";

fn servo_events(robot: &Robot) -> Vec<bool> {
    let servo = |output: &Output| match output {
        Output::Event(Event::Servo(on)) => Some(*on),
        _ => None,
    };
    robot.outputs.iter().filter_map(servo).collect()
}

fn is_powered(controller: &Controller) -> bool {
    controller.state().powered
}

#[test]
fn without_power_no_button_acts_and_each_is_a_finding() {
    let mut robot = Robot::ready(FEEDER);
    robot.put(Input::by_owner(Action::PowerOff));
    let buttons = [
        PanelAction::Servo(true),
        PanelAction::Start,
        PanelAction::PressFeedHold,
        PanelAction::AlarmReset,
    ];
    for (pressed, button) in (1..).zip(buttons) {
        let words = button.to_string();
        robot.put(Input::by_hand(button));
        let state = robot.seat.controller.state();
        assert!(!state.servo && !state.feed_hold, "{words}");
        assert_ne!(
            robot.seat.controller.status(),
            ExecutionStatus::Running,
            "{words}"
        );
        let found = robot
            .findings
            .count(&ts3100_controller::findings::rules::PANEL_REFUSED);
        assert_eq!(found, pressed, "{words}");
    }
    // What is turned or pressed by hand stays as it is left.
    robot.put(Input::by_hand(PanelAction::EmergencyStop(true)));
    assert!(robot.seat.controller.state().emergency_stop);
}

#[test]
fn servo_power_goes_with_the_power_and_says_so() {
    let mut robot = Robot::ready(FEEDER);
    assert_eq!(servo_events(&robot), [true]);
    robot.put(Input::by_owner(Action::PowerOff));
    assert_eq!(servo_events(&robot), [true, false]);
    robot.put(Input::by_owner(Action::PowerOn));
    assert_eq!(servo_events(&robot), [true, false]);
}

#[test]
fn a_power_loss_that_is_due_while_the_power_is_off_does_not_turn_it_on() {
    let mut robot = Robot::ready(FEEDER);
    let fault: Fault = "power-loss:delay=1000,command=SU".parse().unwrap();
    robot.put(FaultAction::Arm(Box::new(fault)).into());
    robot.ask(Port::Ip0, "SU");
    robot.put(Input::by_owner(Action::PowerOff));
    robot.advance_ms(5_000);
    assert!(!is_powered(&robot.seat.controller));
}
