//! Arbitrary contents of ETHERNET.PAR and USER.PAR: reading them, changing a value in them, and a power cycle with them
//! on the drive. Nothing panics; a value that was changed is read back; broken files keep the last good values.
#![no_main]

use libfuzzer_sys::fuzz_target;
use ts3100_controller::{Input, Panel};
use ts3100_fuzz::{Cell, text_and_choices};
use ts3100_proto::parameter::{Edition, EthernetParameters, UserParameters, rewrite};

const SECTIONS: [&str; 8] = ["E00", "E01", "E04", "E05", "E10", "U06", "U07", "U09"];

fuzz_target!(|data: &[u8]| {
    let (text, mut choices) = text_and_choices(data);
    let content = text.as_bytes();
    let (ethernet, _) = EthernetParameters::parse(content, &EthernetParameters::factory());
    let (user, _) = UserParameters::parse(content, &UserParameters::factory(), Edition::SixAxis);
    // What was read once is a good previous value.
    let _ = EthernetParameters::parse(content, &ethernet);
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
    let mut cell = Cell::new(true);
    for name in ["ETHERNET.PAR", "USER.PAR"] {
        let _ = cell.controller.put_file(name, content);
        let _ = cell.controller.set_parameter(name, section, &key, &value);
    }
    cell.feed(Input::Panel(Panel::PowerCycle));
    cell.pass(1_000);
});
