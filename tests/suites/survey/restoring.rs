//! What a survey changes it puts back: at its end, after a surprise, and when somebody interrupts it.

use super::{ALL, config, peer, plan};
use std::sync::Arc;
use std::time::Duration;
use ts3100_controller::faults::FaultAction;
use ts3100_controller::model::ArmModel;
use ts3100_controller::{Config, PanelAction, Port};
use ts3100_proto::status::sf::{SfLayout, SystemStatus};
use ts3100_survey::{Class, Peer as _, Plan, Verdict, survey};
use ts3100_tests::Robot;
use ts3100_tests::virtual_peer::VirtualPeer;

#[test]
fn turns_of_the_last_axis_are_answered_by_every_arm_that_has_one_and_undone() {
    let turns = [
        "quick-status-motion",
        "status-in-motion",
        "feed-hold-motion",
        "stop-in-motion",
        "break-in-motion",
        "statement-after-motion",
        "lines-in-motion",
        "work-line",
    ];
    for model in [
        ArmModel::tv800(),
        ArmModel::thl400_four_axes(),
        ArmModel::thl400(),
    ] {
        let mut peer = peer(Config { model, ..config(&[]) }, Port::Ip0);
        let before = peer.robot.seat.controller.current_position().joints;
        let plan = Plan {
            only: turns.map(str::to_owned).to_vec(),
            ..plan(&[Class::Motion])
        };
        let report = survey(&mut peer, &plan, &mut |_| {}).unwrap();
        assert_eq!(report.stopped, None);
        let verdicts: Vec<_> = report
            .answers
            .iter()
            .map(|answer| (answer.probe.as_str(), answer.verdict))
            .collect();
        assert_eq!(
            verdicts,
            turns.map(|turn| (turn, Verdict::Manual)),
            "{:?}",
            report.answers
        );
        let after = peer.robot.seat.controller.current_position().joints;
        for (before, after) in before.iter().zip(after) {
            assert!((before - after).abs() <= 1, "{before} {after}");
        }
    }
}

#[test]
fn what_it_changes_is_put_back_whatever_happens() {
    let mut config = config(&[]);
    config.fault_seed = 5;
    for fault in [
        None,
        Some("no-reply:command=RN,after=9"),
        Some("reset-mid-text:command=MR,after=5"),
    ] {
        let mut peer = peer(config.clone(), Port::Ip0);
        peer.robot.load("MINE", "PROGRAM MINE\nEND\n");
        if let Some(fault) = fault {
            peer.robot
                .feed(FaultAction::Arm(Box::new(fault.parse().unwrap())).into());
        }
        let report = survey(&mut peer, &plan(&ALL), &mut |_| {}).unwrap();
        assert_eq!(
            report.stopped.is_some(),
            fault.is_some(),
            "{fault:?}: {:?}",
            report.stopped
        );
        assert_eq!(report.left, [""; 0], "{fault:?}");
        let controller = &peer.robot.seat.controller;
        assert!(
            controller.files().all(|(name, _)| name != "TSSURVEY"),
            "{fault:?}"
        );
        assert_eq!(controller.selected(), "MINE", "{fault:?}");
        assert_eq!(controller.alarms().active(), [], "{fault:?}");
        // And nothing of the user's is written down: no name, and no text with positions or inputs.
        let file = report.write();
        for secret in ["MINE", "SF<CR>", "CA<CR>", "UL,USER"] {
            assert!(!file.contains(secret), "{fault:?}: {secret}");
        }
    }
}

#[test]
fn a_robot_that_works_or_has_such_a_file_is_left_alone() {
    let mut peer = peer(config(&[]), Port::Ip0);
    peer.robot.load("TSSURVEY", "PROGRAM MINE\nEND\n");
    let report = survey(&mut peer, &plan(&ALL), &mut |_| {}).unwrap();
    let refused = report
        .answers
        .iter()
        .filter(|answer| answer.verdict == Verdict::Refused)
        .count();
    assert_eq!(
        refused,
        report.answers.len() - plan(&[Class::Look]).probes().count() + 1,
        "and while-sending"
    );
    let mut files = peer.robot.seat.controller.files();
    assert!(files.any(|file| file == ("TSSURVEY", b"PROGRAM MINE\nEND\n".as_slice())));
}

#[test]
fn servo_power_is_as_it_was() {
    for was_on in [true, false] {
        let mut peer = VirtualPeer::new(Robot::with(config(&[])), Port::Ip0);
        peer.robot.panel(PanelAction::Servo(was_on));
        let report = survey(&mut peer, &plan(&[Class::Motion]), &mut |_| {}).unwrap();
        assert_eq!(report.stopped, None);
        assert_eq!(report.count(Verdict::Refused), 0, "{:?}", report.answers);
        assert_eq!(peer.robot.seat.controller.state().servo, was_on);
        assert_eq!(report.left, [""; 0]);
    }
}

#[test]
fn servo_power_that_came_without_an_answer_is_turned_off() {
    let mut peer = VirtualPeer::new(Robot::with(config(&[])), Port::Ip0);
    let fault = "no-reply:command=SO".parse().unwrap();
    peer.robot.feed(FaultAction::Arm(Box::new(fault)).into());
    let report = survey(&mut peer, &plan(&[Class::Motion]), &mut |_| {}).unwrap();
    assert!(report.stopped.is_some());
    assert!(!peer.robot.seat.controller.state().servo);
    assert_eq!(report.left, [""; 0]);
}

/// The angles of the arm, as SF shows them.
fn joints(peer: &VirtualPeer) -> [f32; 8] {
    let content = peer.robot.seat.controller.status_frame(Port::Ip0);
    SystemStatus::decode(&content, SfLayout::Eight).unwrap().joint
}

/// No divisor of the times that questions take.
const BETWEEN_INTERRUPTIONS: Duration = Duration::from_millis(1_310);

#[test]
fn whenever_it_is_interrupted_it_ends_soon_and_puts_back_what_it_changed() {
    let (mut at, mut interrupted) = (Duration::ZERO, 0);
    loop {
        let mut peer = peer(config(&[]), Port::Ip0);
        peer.robot.load("MINE", "PROGRAM MINE\nEND\n");
        let before = joints(&peer);
        let plan = plan(&ALL);
        at += BETWEEN_INTERRUPTIONS;
        peer.interruption = Some((at, Arc::clone(&plan.stop)));
        let report = survey(&mut peer, &plan, &mut |_| {});
        let took = peer.now();
        let controller = &peer.robot.seat.controller;
        let left = report
            .as_ref()
            .map(|report| report.left.clone())
            .unwrap_or_default();
        let is_left = |word: &str| left.iter().any(|left| left.contains(word));
        assert!(controller.files().all(|(name, _)| name != "TSSURVEY"), "{at:?}");
        assert_eq!(controller.selected(), "MINE", "{at:?}");
        assert_eq!(controller.alarms().active(), [], "{at:?}");
        let state = controller.state();
        assert_ne!(state.servo, is_left("servo power"), "{at:?} {left:?}");
        assert_eq!(state.feed_hold, is_left("feed hold"), "{at:?} {left:?}");
        let is_turned = before
            .iter()
            .zip(joints(&peer))
            .any(|(before, now)| (before - now).abs() > 0.05);
        assert_eq!(is_turned, is_left("axis"), "{at:?} {left:?}");
        match report {
            Ok(report) if report.stopped.is_none() => break,
            Ok(report) => assert!(report.stopped.unwrap().ends_with("it was interrupted")),
            Err(error) => assert_eq!(error.to_string(), "it was interrupted"),
        }
        assert!(took < at + Duration::from_secs(5), "{at:?} {took:?}");
        interrupted += 1;
    }
    assert!(interrupted > 70, "{interrupted}");
}
