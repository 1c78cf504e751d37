//! Jogging from the host (MD, RT, SC, JG), the watchdog (WD, fed by SM), and the exchange of a host that moves the arm by
//! DO and polls it with SM and PR (hosts.md 2).
//!
//! The manual calls jogging "guide". Byte-exact answers of these commands are in `extensions.rs`.

use crate::extensions::{scara, six_axis, text, values, word};
use ts3100_controller::input::JogMode;
use ts3100_controller::{ControlRight, KeySwitch, PanelAction, Port};
use ts3100_tests::{Robot, notation};

/// Something done to a robot.
type Action = fn(&mut Robot);

fn refused(robot: &mut Robot, command: &str) {
    let answer = robot.ask(Port::Ip0, command);
    assert_eq!(notation::write(&answer), "NG<CR>", "{command}");
}

fn joint(robot: &mut Robot, axis: usize) -> f64 {
    values(robot, "PR,0")[axis - 1]
}

fn world(robot: &mut Robot) -> Vec<f64> {
    values(robot, "PR,1")
}

/// An item of SM without its label.
fn item(robot: &mut Robot, label: &str) -> u32 {
    let status = text(robot, "SM,1");
    let found = status.split(' ').find_map(|item| item.strip_prefix(label));
    found.unwrap().parse().unwrap()
}

fn rests(robot: &mut Robot) {
    let before = robot.file(Port::Ip0, "PR,0");
    robot.advance_ms(500);
    assert_eq!(robot.file(Port::Ip0, "PR,0"), before, "the arm moves");
}

#[test]
fn the_arm_moves_while_the_key_is_held() {
    for (rate, percent) in [(0, 2.0), (1, 10.0), (2, 30.0)] {
        let mut robot = six_axis();
        for command in ["MD,0", &format!("RT,{rate}"), "SC,0", "JG,1 +"] {
            robot.command(Port::Ip0, command);
        }
        robot.advance_ms(500);
        let early = joint(&mut robot, 1);
        robot.advance_ms(500);
        let late = joint(&mut robot, 1);
        assert!(
            (late - early - 240.0 * percent / 100.0 * 0.5).abs() < 0.01,
            "rate {rate}"
        );
        robot.command(Port::Ip0, "JG,1 !");
        robot.advance_ms(500);
        rests(&mut robot);
        let rest = joint(&mut robot, 1);
        robot.command(Port::Ip0, "JG,1 -");
        robot.advance_ms(500);
        assert!(joint(&mut robot, 1) < rest, "and back");
        assert_eq!(robot.total(Port::Ip0)[2], 0, "jogging is no run");
    }
}

/// Found by `ts3100 simulate`: the arm was at once where it would have come to rest.
#[test]
fn a_jog_begun_while_the_arm_still_slows_follows_without_a_jump() {
    // In the second case a jog ends before it has begun, and the next one waits for the same arm.
    let cases = [
        &["JG,1 !", "JG,1 -"][..],
        &["JG,1 !", "JG,1 -", "JG,1 !", "JG,1 -"],
    ];
    for commands in cases {
        let mut robot = six_axis();
        for command in ["MD,0", "RT,2", "SC,0", "JG,1 +"] {
            robot.command(Port::Ip0, command);
        }
        robot.advance_ms(500);
        let mut last = joint(&mut robot, 1);
        for command in commands {
            robot.command(Port::Ip0, command);
        }
        let begun = last;
        let mut most = last;
        for _ in 0..1_000 {
            let now = joint(&mut robot, 1);
            // 240 degrees a second are the most of this axis; PR has three decimals.
            assert!(
                (now - last).abs() <= 0.241,
                "{commands:?}: from {last} to {now} in a millisecond"
            );
            (last, most) = (now, most.max(now));
            robot.advance_ms(1);
        }
        assert!(
            begun < most && last < begun,
            "{commands:?}: it slows, and turns back"
        );
    }
}

#[test]
fn every_axis_of_both_arms_is_jogged_to_its_limit() {
    for (mut robot, limits) in [
        (six_axis(), vec![190.0, 179.0, 165.0, 360.0, 175.0, 360.0]),
        (scara(), vec![180.0, 150.0, 150.0, 360.0, 360.0]),
    ] {
        robot.command(Port::Ip0, "RT,2");
        for (index, limit) in limits.iter().enumerate() {
            for (sign, end) in [("+", *limit), ("-", -limit)] {
                robot.command(Port::Ip0, &format!("JG,{} {sign}", index + 1));
                robot.advance_ms(60_000);
                assert!(
                    (joint(&mut robot, index + 1) - end).abs() < 0.01,
                    "axis {} {sign}",
                    index + 1
                );
                robot.command(Port::Ip0, &format!("JG,{} !", index + 1));
            }
        }
        refused(&mut robot, &format!("JG,{} +", limits.len() + 1));
        assert!(robot.alarms().is_empty());
    }
}

/// In a coordinate system the arm goes until it is stretched: 750 mm from the shoulder, 73.28 mm above which the wrist
/// hangs, and 100 mm before the foot; 400 mm of the SCARA, 17.55 mm beside its foot.
#[test]
fn a_straight_way_is_jogged_to_the_end_of_the_reach() {
    let wrist: f64 = 293.282 + 80.0 - 300.0;
    let six = 100.0 + (750.0 * 750.0 - wrist * wrist).sqrt();
    let four = (400.0_f64 * 400.0 - 17.55 * 17.55).sqrt();
    for (mut robot, end) in [(six_axis(), six), (scara(), four)] {
        for command in ["RT,2", "SC,3", "JG,1 +"] {
            robot.command(Port::Ip0, command);
        }
        robot.advance_ms(60_000);
        let x = world(&mut robot)[0];
        assert!((end - 0.5..=end).contains(&x), "{x} of {end}");
        assert!(robot.alarms().is_empty());
    }
}

#[test]
fn inching_goes_one_step() {
    for (rate, step) in [(0, 0.1), (1, 1.0), (2, 10.0)] {
        let mut robot = six_axis();
        for command in ["MD,1", &format!("RT,{rate}"), "SC,0"] {
            robot.command(Port::Ip0, command);
        }
        let mut place = joint(&mut robot, 2);
        for (sign, way) in [("+", step), ("+", step), ("-", -step)] {
            robot.command(Port::Ip0, &format!("JG,2 {sign}"));
            robot.advance_ms(5_000);
            place += way;
            assert!((joint(&mut robot, 2) - place).abs() < 0.0011, "rate {rate}");
            robot.command(Port::Ip0, "JG,2 !");
        }
        robot.command(Port::Ip0, "SC,3");
        let before = world(&mut robot);
        robot.command(Port::Ip0, "JG,1 +");
        robot.advance_ms(5_000);
        assert!(
            (world(&mut robot)[0] - before[0] - step).abs() < 0.0021,
            "rate {rate}, in the world"
        );
    }
}

#[test]
fn each_coordinate_system_has_its_own_directions() {
    // The work coordinate is turned by 90 degrees about Z, the tool looks straight down.
    for (system, axis, expected) in [
        (3, 1, [10.0, 0.0, 0.0]),
        (3, 2, [0.0, 10.0, 0.0]),
        (3, 3, [0.0, 0.0, 10.0]),
        (2, 1, [0.0, 10.0, 0.0]),
        (2, 2, [-10.0, 0.0, 0.0]),
        (2, 3, [0.0, 0.0, 10.0]),
    ] {
        let mut robot = six_axis();
        robot.command(Port::Ip0, "ZS,1 W 50.0 0.0 0.0 0.0 0.0 90.0");
        for command in ["MD,1", "RT,2", &format!("SC,{system}")] {
            robot.command(Port::Ip0, command);
        }
        let before = world(&mut robot);
        robot.command(Port::Ip0, &format!("JG,{axis} +"));
        robot.advance_ms(5_000);
        let after = world(&mut robot);
        for (index, way) in expected.into_iter().enumerate() {
            assert!(
                (after[index] - before[index] - way).abs() < 0.01,
                "SC,{system} JG,{axis}: {after:?}"
            );
        }
    }
    let mut robot = six_axis();
    for command in [
        "DO,MOVE POINT(400.0,0.0,300.0,0.0,90.0,0.0,0.0,0.0)",
        "MD,1",
        "RT,2",
        "SC,1",
    ] {
        robot.command(Port::Ip0, command);
        robot.advance_ms(5_000);
    }
    let before = world(&mut robot);
    robot.command(Port::Ip0, "JG,3 +");
    robot.advance_ms(5_000);
    let after = world(&mut robot);
    let way: Vec<f64> = (0..3).map(|index| after[index] - before[index]).collect();
    assert!(
        (way[0].abs() - 10.0).abs() < 0.01 && way[2].abs() < 0.01,
        "tool Z lies along X: {way:?}"
    );
}

#[test]
fn the_tool_system_is_that_of_the_tool_in_effect() {
    let mut robot = six_axis();
    for command in [
        "DO,MOVE POINT(400.0,0.0,300.0,0.0,90.0,0.0,0.0,0.0)",
        "DO,TOOL = TRANS(0,0,20,0,90,0)",
        "MD,1",
        "RT,2",
        "SC,1",
    ] {
        robot.command(Port::Ip0, command);
        robot.advance_ms(5_000);
    }
    assert_eq!(robot.alarms(), [""; 0]);
    let before = world(&mut robot);
    robot.command(Port::Ip0, "JG,3 +");
    robot.advance_ms(5_000);
    let after = world(&mut robot);
    let way: Vec<f64> = (0..3).map(|index| after[index] - before[index]).collect();
    assert!(
        (way[2].abs() - 10.0).abs() < 0.01 && way[0].abs() < 0.01,
        "the flange looks along X, the tool across it: {way:?}"
    );
}

#[test]
fn a_host_that_leaves_stops_the_arm() {
    let mut robot = six_axis();
    robot.command(Port::Ip0, "JG,1 +");
    robot.advance_ms(300);
    robot.disconnect(Port::Ip0);
    robot.advance_ms(1_000);
    robot.connect(Port::Ip0);
    rests(&mut robot);
    assert!(joint(&mut robot, 1) < 10.0);
}

#[test]
fn what_ends_a_jog_and_what_forbids_it() {
    let stops: [(&str, Action); 4] = [
        ("BR", |robot| robot.command(Port::Ip0, "BR")),
        ("EC,BREAK", |robot| robot.command(Port::Ip0, "EC,BREAK")),
        ("emergency stop", |robot| {
            robot.panel(PanelAction::EmergencyStop(true));
        }),
        ("SVOFF", |robot| {
            robot.panel(PanelAction::InputLine { line: 261, on: true });
        }),
    ];
    for (what, stop) in stops {
        let mut robot = six_axis();
        robot.command(Port::Ip0, "JG,1 +");
        robot.advance_ms(300);
        stop(&mut robot);
        robot.advance_ms(1_000);
        let place = joint(&mut robot, 1);
        robot.advance_ms(5_000);
        assert!((joint(&mut robot, 1) - place).abs() < f64::EPSILON, "{what}");
    }
    let mut robot = six_axis();
    robot.command(Port::Ip0, "JG,1 +");
    refused(&mut robot, "JG,2 +");
    refused(&mut robot, "DO,MOVEA 1,0.0");
    robot.command(Port::Ip0, "JG,1 !");
    robot.advance_ms(1_000);
    robot.command(Port::Ip0, "MD,2");
    refused(&mut robot, "JG,1 +");
    robot.command(Port::Ip0, "MD,0");
    robot.command(Port::Ip0, "FD");
    refused(&mut robot, "JG,1 +");
    robot.command(Port::Ip0, "FD");
    robot.command(Port::Ip0, "BR");
    refused(&mut robot, "JG,1 +");
    robot.command(Port::Ip0, "JG,1 !");
    robot.command(Port::Ip0, "SO");
    robot.command(Port::Ip0, "DO,DELAY 5.0");
    refused(&mut robot, "JG,1 +");
}

#[test]
fn a_program_does_not_start_while_the_arm_is_jogged() {
    let mut robot = Robot::ready("PROGRAM T\nPRINT IP1, \"A\", CR\nEND\n");
    robot.command(Port::Ip0, "JG,1 +");
    refused(&mut robot, "RN");
    robot.command(Port::Ip0, "JG,1 !");
    robot.advance_ms(1_000);
    robot.command(Port::Ip0, "RN");
    assert_eq!(robot.received(Port::Ip1), b"A\r");
}

// clause: S11 S25 L9
#[test]
fn the_watchdog_raises_the_alarm_of_its_level() {
    for (level, servo, status, alarm, word) in [
        (8, 0, 2, "8-352", 351),
        (2, 1, 3, "2-137", 648),
        (1, 1, 1, "1-200", 935),
    ] {
        let mut robot = Robot::ready("PROGRAM T\nDELAY 1.0\nDELAY 100.0\nEND\n");
        robot.command(Port::Ip0, "RN");
        robot.command(Port::Ip0, &format!("WD,700 {level}"));
        robot.advance_ms(699);
        assert!(robot.alarms().is_empty());
        robot.advance_ms(1);
        assert_eq!(robot.alarms(), [alarm]);
        robot.advance_ms(400);
        let sm = text(&mut robot, "SM,1");
        assert!(
            sm.contains(&format!("SV{servo} ")) && sm.contains(&format!("RS{status} ")),
            "level {level}: {sm}"
        );
        assert_eq!(item(&mut robot, "AL"), level);
        let message = "Host Port Time Out: no text of a host within 700 ms";
        let record = format!("1,00{alarm},{message},2014-02-06 00:00:00\r");
        assert_eq!(text(&mut robot, "AC"), record);
        assert_eq!(super::extensions::word(&robot.total(Port::Ip0), 4), word);
        robot.advance_ms(5_000);
        assert_eq!(robot.alarms().len(), 1, "once");
    }
    let mut robot = six_axis();
    robot.command(Port::Ip0, "WD,100 0");
    robot.advance_ms(5_000);
    assert!(robot.alarms().is_empty(), "level 0 is no alarm");
    for refused in ["WD,700 4", "WD,700 3", "WD,100000 2"] {
        assert_eq!(robot.ask(Port::Ip0, refused), b"NG\r", "{refused}");
    }
}

// clause: S11 L8
#[test]
fn every_text_feeds_the_watchdog_and_wd_0_0_ends_it() {
    let mut robot = six_axis();
    robot.command(Port::Ip0, "WD,700 2");
    for command in ["SM,1", "SF", "SU", "PR,0", "AC", "AH"] {
        robot.advance_ms(690);
        robot.file(Port::Ip0, command);
    }
    robot.advance_ms(690);
    robot.command(Port::Ip0, "EC,OVRD 50");
    robot.advance_ms(690);
    assert_eq!(robot.ask(Port::Ip0, "XX"), b"NG\r");
    robot.advance_ms(699);
    assert!(robot.alarms().is_empty(), "fed");
    robot.advance_ms(1);
    assert_eq!(robot.alarms(), ["2-137"], "communication stays away");

    for end in ["WD,0 0", "WD,0 2", "WD,700 0"] {
        let mut robot = six_axis();
        robot.command(Port::Ip0, "WD,700 8");
        robot.command(Port::Ip0, end);
        robot.advance_ms(60_000);
        assert!(robot.alarms().is_empty(), "{end}");
    }
    let mut robot = six_axis();
    robot.command(Port::Ip0, "WD,700 8");
    robot.command(Port::Ip0, "WD,5000 1");
    robot.advance_ms(4_000);
    assert!(robot.alarms().is_empty(), "the later one counts");
    robot.disconnect(Port::Ip0);
    robot.advance_ms(1_001);
    assert_eq!(robot.alarms(), ["1-200"], "a host that crashed is what it is for");
    let mut robot = six_axis();
    robot.command(Port::Ip0, "WD,700 8");
    robot.panel(PanelAction::PowerCycle);
    robot.advance_ms(5_000);
    assert!(robot.alarms().is_empty(), "power off ends it");
}

// clause: L9
#[test]
fn the_watchdog_stops_a_move_of_do() {
    for (level, stopped) in [(8, true), (2, false), (1, false)] {
        let mut robot = six_axis();
        robot.command(Port::Ip0, &format!("WD,300 {level}"));
        robot.command(Port::Ip0, "DO,MOVEA 1,90.0 WITH SPEED=10");
        robot.advance_ms(10_000);
        let place = joint(&mut robot, 1);
        assert_eq!(place < 45.0, stopped, "level {level}: {place}");
    }
}

/// Polls PR every 20 ms and SM every 100 ms until DC changes, as the vendor's library does, or for ten seconds:
/// (DC, DS) as seen, positions as seen.
fn watch(robot: &mut Robot, axis: usize, before: u32) -> (Vec<(u32, u32)>, Vec<f64>) {
    let (mut seen, mut places) = (Vec::new(), Vec::new());
    for tick in 0..500 {
        if tick % 5 == 0 {
            let status = (item(robot, "DC"), item(robot, "DS"));
            if seen.last() != Some(&status) {
                seen.push(status);
            }
            if status.0 != before {
                break;
            }
        }
        places.push(world(robot)[axis]);
        robot.advance_ms(20);
    }
    (seen, places)
}

// clause: CMD-DO-02
#[test]
fn moves_by_do_begin_and_end_in_order() {
    for mut robot in [six_axis(), scara()] {
        assert_eq!((item(&mut robot, "DC"), item(&mut robot, "DS")), (0, 0));
        robot.command(Port::Ip0, "WD,700 2");
        let mut from = world(&mut robot)[0];
        // Through 9 and 0 of the count.
        let ways = [330.0, 250.0, 251.0, 251.0, 340.0].into_iter().cycle().take(23);
        for (count, to) in ways.enumerate() {
            let ended = u32::try_from(count % 10).unwrap();
            let start = world(&mut robot);
            let rest: Vec<String> = start[1..].iter().map(|value| format!("{value:.3}")).collect();
            let point = format!("{to:.3},{}", rest[..rest.len() - 1].join(","));
            let coordinates: Vec<&str> = point.split(',').collect();
            let width = if start.len() == 7 { 5 } else { 8 };
            let statement = format!(
                "DO,MOVES POINT({}) with SPEED=50.000,ACCEL=100.000,DECEL=100.000",
                coordinates[..width].join(",")
            );
            robot.command(Port::Ip0, &statement);
            assert_eq!((item(&mut robot, "DC"), item(&mut robot, "DS")), (ended, 1));
            let (seen, places) = watch(&mut robot, 0, ended);
            assert_eq!(seen, [(ended, 1), ((ended + 1) % 10, 0)], "to {to}");
            assert!((places[0] - from).abs() < 0.0011);
            let ways = places
                .windows(2)
                .map(|pair| (pair[1] - pair[0]) * (to - from).signum());
            assert!(ways.into_iter().all(|way| way > -0.0011), "to {to}: {places:?}");
            assert!((world(&mut robot)[0] - to).abs() < 0.0011);
            assert!(
                places
                    .iter()
                    .all(|place| (from.min(to) - 0.002..=from.max(to) + 0.002).contains(place))
            );
            from = to;
        }
        assert!(robot.alarms().is_empty(), "the polling has fed the watchdog");
    }
}

#[test]
fn a_move_that_cannot_be_made_leaves_dc_and_ds_alone() {
    let mut robot = six_axis();
    robot.command(Port::Ip0, "DO,MOVEA 1,5.0");
    robot.advance_ms(3_000);
    assert_eq!(item(&mut robot, "DC"), 1, "a good one before it");
    robot.command(Port::Ip0, "DO,MOVE POINT(2000.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0)");
    for _ in 0..30 {
        assert_eq!((item(&mut robot, "DC"), item(&mut robot, "DS")), (1, 0));
        robot.advance_ms(20);
    }
    assert_eq!(item(&mut robot, "AL"), 8);
    assert_eq!(word(&robot.total(Port::Ip0), 4), 34, "8-035");
    robot.command(Port::Ip0, "RS,ERR");
    robot.command(Port::Ip0, "SO");
    robot.command(Port::Ip0, "DO,MOVEA 1,0.0");
    robot.advance_ms(3_000);
    assert_eq!(item(&mut robot, "DC"), 2);
}

#[test]
fn a_move_that_is_cut_short_changes_dc() {
    type Cut = fn(&mut Robot);
    let ways: [(&str, Cut); 6] = [
        ("emergency stop", |robot| {
            robot.panel(PanelAction::EmergencyStop(true));
        }),
        ("safety switch", |robot| {
            robot.panel(PanelAction::SafetySwitch(true));
        }),
        ("servo off", |robot| robot.panel(PanelAction::Servo(false))),
        ("BR", |robot| robot.command(Port::Ip0, "BR")),
        ("EC,BREAK", |robot| robot.command(Port::Ip0, "EC,BREAK")),
        ("alarm", |robot| {
            robot.command(Port::Ip0, "WD,1 8");
            robot.advance_ms(1);
        }),
    ];
    for (what, cut) in ways {
        let mut robot = six_axis();
        robot.command(Port::Ip0, "DO,MOVEA 1,90.0 WITH SPEED=5");
        robot.advance_ms(500);
        assert_eq!((item(&mut robot, "DC"), item(&mut robot, "DS")), (0, 1), "{what}");
        cut(&mut robot);
        robot.advance_ms(1_000);
        assert_eq!((item(&mut robot, "DC"), item(&mut robot, "DS")), (1, 0), "{what}");
    }
}

// clause: PRM-LEG-03
#[test]
fn in_teaching_the_host_on_ip0_does_not_jog() {
    let mut robot = six_axis();
    robot.panel(PanelAction::Key(KeySwitch::Teaching));
    refused(&mut robot, "JG,1 +");
    robot.panel(PanelAction::Key(KeySwitch::Ext));
    robot.panel(PanelAction::ControlRight(ControlRight::Sig));
    refused(&mut robot, "JG,1 +");
    rests(&mut robot);
}

#[test]
fn at_its_limit_an_axis_is_not_jogged_further() {
    let mut robot = six_axis();
    robot.command(Port::Ip0, "RT,2");
    robot.command(Port::Ip0, "JG,1 -");
    robot.advance_ms(60_000);
    robot.command(Port::Ip0, "JG,1 !");
    assert_eq!(robot.ask(Port::Ip0, "JG,1 -"), b"NG\r");
}

#[test]
fn a_host_that_has_jogged_the_arm_may_leave_while_a_program_moves_it() {
    let mut robot = Robot::ready("PROGRAM T\nMOVEA 1,90.0 WITH SPEED=20\nPRINT IP1, \"DONE\", CR\nEND\n");
    robot.command(Port::Ip0, "MD,1");
    robot.command(Port::Ip0, "JG,2 +");
    robot.advance_ms(2_000);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(300);
    robot.disconnect(Port::Ip0);
    robot.advance_ms(10_000);
    robot.connect(Port::Ip0);
    let turned = values(&mut robot, "PR,0")[0];
    assert!((turned - 90.0).abs() < 0.01, "{turned}");
}

#[test]
fn jg_stop_does_not_stop_a_program() {
    let mut robot = Robot::ready("PROGRAM T\nMOVEA 1,90.0 WITH SPEED=20\nPRINT IP1, \"DONE\", CR\nEND\n");
    robot.command(Port::Ip0, "MD,1");
    robot.command(Port::Ip0, "JG,2 +");
    robot.advance_ms(2_000);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(300);
    robot.ask(Port::Ip0, "JG,2 !");
    robot.advance_ms(10_000);
    let turned = values(&mut robot, "PR,0")[0];
    assert!((turned - 90.0).abs() < 0.01, "{turned}");
}

#[test]
fn a_watchdog_of_level_2_ends_the_jog() {
    let mut robot = six_axis();
    robot.command(Port::Ip0, "WD,700 2");
    robot.command(Port::Ip0, "JG,1 +");
    robot.advance_ms(60_000);
    let turned = values(&mut robot, "PR,0")[0];
    assert!(turned < 10.0, "{turned}");
}

#[test]
fn turning_the_key_ends_the_jog() {
    let mut robot = six_axis();
    robot.command(Port::Ip0, "JG,1 +");
    robot.panel(PanelAction::Key(ts3100_controller::KeySwitch::Teaching));
    robot.advance_ms(60_000);
    let turned = values(&mut robot, "PR,0")[0];
    assert!(turned < 10.0, "{turned}");
}

#[test]
fn a_jog_ends_with_the_control_right_of_its_host_and_only_with_that() {
    let stays = |robot: &mut Robot| {
        let early = robot.seat.controller.arm_pose().joints;
        robot.advance_ms(500);
        robot.seat.controller.arm_pose().joints == early
    };
    for right in [ControlRight::Sig, ControlRight::Rs232c, ControlRight::Ether] {
        let mut robot = six_axis();
        robot.command(Port::Ip0, "JG,1 +");
        robot.advance_ms(500);
        robot.panel(PanelAction::ControlRight(right));
        robot.advance_ms(500);
        assert_eq!(stays(&mut robot), right != ControlRight::Ether, "{right:?}");
        robot.panel(PanelAction::ControlRight(ControlRight::Ether));
        robot.command(Port::Ip0, "JG,1 !");
        robot.advance_ms(500);
        robot.command(Port::Ip0, "JG,1 -");
        robot.advance_ms(500);
        assert!(!stays(&mut robot), "{right:?}");
    }
    let mut robot = six_axis();
    robot.panel(PanelAction::Key(KeySwitch::Teaching));
    let mode = JogMode::default();
    robot.panel(PanelAction::Jog {
        axis: 1,
        positive: true,
        mode,
    });
    robot.panel(PanelAction::ControlRight(ControlRight::Sig));
    robot.advance_ms(500);
    assert!(!stays(&mut robot), "the key of the pendant is held");
}
