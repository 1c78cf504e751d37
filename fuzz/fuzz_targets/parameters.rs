//! Fuzzes the parameter files: arbitrary contents of ETHERNET.PAR and USER.PAR are read, one value is changed, and a
//! power cycle happens with them on the drive.
//!
//! Nothing panics, a changed value is read back, and broken files keep the last good values.
#![no_main]

use libfuzzer_sys::fuzz_target;
use ts3100_controller::{Input, PanelAction};
use ts3100_fuzz::{Robot, text_and_choices};
use ts3100_proto::parameter::{Edition, EthernetParameters, LineEnd, UserParameters, rewrite};

const SECTIONS: [&str; 8] = ["E00", "E01", "E04", "E05", "E10", "U06", "U07", "U09"];

fuzz_target!(|data: &[u8]| {
    let (text, mut choices) = text_and_choices(data);
    let content = text.as_bytes();
    let (ethernet, _) = EthernetParameters::parse(content, &EthernetParameters::factory());
    let (user, _) = UserParameters::parse(content, &UserParameters::factory(), Edition::SixAxis);
    // An empty file keeps every value, and an encoded one reads the same.
    assert_eq!(EthernetParameters::parse(b"", &ethernet).0, ethernet);
    assert_eq!(UserParameters::parse(b"", &user, Edition::SixAxis).0, user);
    let written = ethernet.encode(LineEnd::Lf);
    assert_eq!(
        EthernetParameters::parse(&written, &EthernetParameters::factory()).0,
        ethernet
    );
    let _ = UserParameters::parse(content, &user, Edition::Scara);
    let section = SECTIONS[usize::from(choices.byte()) % SECTIONS.len()];
    let value = String::from_utf8_lossy(choices.chunk()).into_owned();
    let key = String::from_utf8_lossy(choices.chunk()).into_owned();
    if let Ok(changed) = rewrite(content, section, &key, &value) {
        let twice = rewrite(&changed, section, &key, &value);
        assert_eq!(
            twice.as_deref().ok(),
            Some(changed.as_slice()),
            "a change is done once"
        );
    }
    let mut robot = Robot::new(true);
    for name in ["ETHERNET.PAR", "USER.PAR"] {
        let _ = robot.cell.controller.put_file(name, content);
        if let Ok(changed) = rewrite(content, section, &key, &value) {
            let _ = robot.cell.controller.put_file(name, &changed);
        }
    }
    let stored = |name: &str| {
        let mut files = robot.cell.controller.files();
        files
            .find(|(found, _)| *found == name)
            .map(|(_, content)| content.to_vec())
    };
    let (network, lines) = (stored("ETHERNET.PAR"), stored("USER.PAR"));
    let (before, lines_before) = (
        robot.cell.controller.ethernet().clone(),
        *robot.cell.controller.user(),
    );
    robot.feed(Input::Panel(PanelAction::PowerCycle));
    robot.advance(1_000);
    // The power-on takes what the files say, and for the rest the values of before.
    let expected = EthernetParameters::parse(&network.unwrap_or_default(), &before).0;
    assert_eq!(*robot.cell.controller.ethernet(), expected);
    let expected = UserParameters::parse(&lines.unwrap_or_default(), &lines_before, Edition::SixAxis).0;
    assert_eq!(*robot.cell.controller.user(), expected);
});
