//! Fuzzes the parameter files: arbitrary contents of ETHERNET.PAR and USER.PAR are read, and a power cycle happens with
//! them on the drive.
//!
//! Nothing panics, and broken files keep the last good values.
use super::shared::Robot;
use ts3100_controller::{Input, PanelAction};
use ts3100_proto::parameter::{Edition, EthernetParameters, LineEnd, StringRule, UserParameters};

pub fn check(content: &[u8]) {
    let (ethernet, _) = EthernetParameters::parse(content, &EthernetParameters::factory());
    // An empty file keeps every value, and the written one reads the same.
    assert_eq!(EthernetParameters::parse(b"", &ethernet).0, ethernet);
    let written = ethernet.encode(LineEnd::Lf);
    assert_eq!(
        EthernetParameters::parse(&written, &EthernetParameters::factory()).0,
        ethernet
    );
    for edition in [Edition::SixAxis, Edition::Scara] {
        let (user, _) = UserParameters::parse(content, &UserParameters::factory(), edition);
        // Where [U25] is missing it means 0.
        let without_functions = UserParameters {
            input_string: StringRule::Alarm,
            ..user
        };
        assert_eq!(UserParameters::parse(b"", &user, edition).0, without_functions);
        let written = user.encode(LineEnd::Lf, edition);
        assert_eq!(
            UserParameters::parse(&written, &UserParameters::factory(), edition).0,
            user
        );
    }
    let mut robot = Robot::new(true);
    for name in ["ETHERNET.PAR", "USER.PAR"] {
        let _ = robot.seat.controller.put_file(name, content);
    }
    let stored = |name: &str| {
        let mut files = robot.seat.controller.files();
        files
            .find(|(found, _)| *found == name)
            .map(|(_, content)| content.to_vec())
    };
    let (network, lines) = (stored("ETHERNET.PAR"), stored("USER.PAR"));
    let (before, lines_before) = (
        robot.seat.controller.ethernet().clone(),
        *robot.seat.controller.user(),
    );
    robot.feed(Input::by_hand(PanelAction::PowerCycle));
    robot.advance(1_000);
    // The power-on takes what the files say, and for the rest the values of before.
    let expected = EthernetParameters::parse(&network.unwrap_or_default(), &before).0;
    assert_eq!(*robot.seat.controller.ethernet(), expected);
    let expected = UserParameters::parse(&lines.unwrap_or_default(), &lines_before, Edition::SixAxis).0;
    assert_eq!(*robot.seat.controller.user(), expected);
}
