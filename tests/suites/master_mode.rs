//! What a change of the master mode leaves as it is.
//!
//! The words of SU for each mode are in `status.rs`, its permissions in `permissions.rs`.

use crate::extensions::{scara, six_axis, text, values};
use ts3100_controller::{ControlRight, KeySwitch, PanelAction, Port};
use ts3100_tests::Robot;

// clause: L63 L76 L77
#[test]
fn override_load_and_frames_stay_when_the_master_mode_changes() {
    for (mut robot, rest) in [(six_axis(), " 0.000 0.000"), (scara(), "")] {
        for command in [
            "EC,OVRD 55".to_string(),
            "DO,PAYLOAD={99,0}".to_string(),
            format!("ZS,1 WK1 10.000 20.000 30.000 0.000{rest}"),
            format!("ZS,2 TL1 0.000 5.000 0.000 0.000{rest}"),
        ] {
            robot.command(Port::Ip0, &command);
        }
        robot.advance_ms(1_000);
        let shown = |robot: &mut Robot| {
            let positions = [values(robot, "PR,1"), values(robot, "PR,2")];
            assert!(text(robot, "SM,1").contains("OV55"));
            positions
        };
        let before = shown(&mut robot);
        assert!((before[0][2] - before[1][2] - 30.0).abs() < 0.002);
        for key in [KeySwitch::Teaching, KeySwitch::Internal, KeySwitch::Ext] {
            robot.panel(PanelAction::Key(key));
            robot.advance_ms(1_000);
            assert_eq!(shown(&mut robot), before, "{key:?}");
        }
        for right in [ControlRight::Sig, ControlRight::Rs232c, ControlRight::Ether] {
            robot.panel(PanelAction::ControlRight(right));
            assert_eq!(shown(&mut robot), before, "{right:?}");
        }
        robot.panel(PanelAction::Servo(true));
        let mut overloads = |load: &str| {
            if !load.is_empty() {
                robot.command(Port::Ip0, &format!("DO,PAYLOAD={load}"));
                robot.advance_ms(1_000);
            }
            robot.command(Port::Ip0, "DO,MOVEI 1, 1");
            robot.advance_ms(1_000);
            let raised = robot.alarms().join(" ");
            robot.panel(PanelAction::AlarmReset);
            raised
        };
        assert_eq!(overloads(""), "4-102");
        assert_eq!(overloads("{0.000,0.000}"), "4-102", "no further alarm");
    }
}
