//! ETHERNET.PAR: the factory file, the manual's own listing, and every way a value can be bad.

use super::*;

/// The setting example of manual 3.3, run together as it is printed.
const PRINTED: &str = "[E00] OPEN MODE IP0 IP1 IP2 IP3 {0:NON 1:ROBOT IS TCP SERVER 2:ROBOT IS CLIENT} = 1 0 0 0 \
[E01] ROBOT CONTROLLER IP ADDRESS = 192.168.0.124[E02] ROBOT CONTROLLER NAME = \"NO1-TS3K\" \
[E03] SUBNET MASK = 255.255.255.0[E04] DEFAULT GATEWAY = 192.168.0.1 [E05] OWN PORT NO {IP0} = 1000{IP1} = 1001{IP2} \
= 1002{IP3} = 1003[E06] PORT NUMBER OF DESTINATION {IP0} = 1000 {IP1} = 1001 {IP2} = 1002{IP3} = 1003\
[E07] IP ADDRESS OF DESTINATION {IP0} = 192.168.0.150 {IP1} = 192.168.0.151 {IP2} = 192.168.0.152 {IP3} = 192.168.0.153 \
[E08] ROBOT COMMUNITY NAME = \"NO1-TS3K\" [E09] DHCP = 0 \
[E10] TCP status alarm IP0 IP1 IP2 IP3 {0:NON 1:Lv_1 2:Lv_2 4:Lv_4 8:Lv 8} = 0 0 0 0 [END]";

/// A previous state in which every value differs from the factory's.
fn previous() -> EthernetParameters {
    EthernetParameters {
        open_mode: [
            OpenMode::NotUsed,
            OpenMode::Client,
            OpenMode::Client,
            OpenMode::Client,
        ],
        address: [10, 0, 0, 1],
        name: String::from("OLD"),
        mask: [255, 0, 0, 0],
        gateway: [10, 0, 0, 254],
        own_port: [2000, 2001, 2002, 2003],
        peer_port: [3000, 3001, 3002, 3003],
        peer_address: [[10, 0, 0, 2]; 4],
        community: String::from("OLDER"),
        dhcp: 1,
        alarm_level: [
            Some(AlarmLevel::L8),
            Some(AlarmLevel::L4),
            Some(AlarmLevel::L2),
            Some(AlarmLevel::L1),
        ],
    }
}

/// The printed file with one piece of it changed.
fn changed(from: &str, to: &str) -> (EthernetParameters, Vec<ParameterProblem>) {
    assert!(PRINTED.contains(from), "{from}");
    EthernetParameters::parse(PRINTED.replacen(from, to, 1).as_bytes(), &previous())
}

// clause: PAR-FILE-01 PAR-FILE-02 PAR-E00-01 PAR-E01-01 PAR-E02-01 PAR-E03-01 PAR-E04-01 PAR-E05-01 PAR-E06-01
// clause: PAR-E07-01 PAR-E08-01 PAR-E09-01 PAR-E10-01
#[test]
fn the_printed_listing_is_the_factory_setting() {
    let factory = EthernetParameters::factory();
    assert_eq!(
        EthernetParameters::parse(PRINTED.as_bytes(), &previous()),
        (factory.clone(), Vec::new())
    );
    let lines = PRINTED
        .replace('[', "\n[")
        .replace('{', "\n{")
        .replace("= ", "\n= ");
    for end in ["\n", "\r", "\r\n"] {
        let text = lines.replace('\n', end);
        assert_eq!(
            EthernetParameters::parse(text.as_bytes(), &previous()),
            (factory.clone(), Vec::new())
        );
    }
}

// clause: PAR-FILE-01 PAR-E00-01
#[test]
fn the_file_of_a_fresh_drive() {
    let open = [
        OpenMode::Server,
        OpenMode::Client,
        OpenMode::NotUsed,
        OpenMode::Server,
    ];
    for line_end in [LineEnd::Lf, LineEnd::Cr] {
        let bytes = EthernetParameters::factory_file(open, line_end);
        let expected = EthernetParameters {
            open_mode: open,
            ..EthernetParameters::factory()
        };
        assert_eq!(
            EthernetParameters::parse(&bytes, &previous()),
            (expected, Vec::new())
        );
        let text = String::from_utf8(bytes).unwrap();
        let end = char::from(line_end.byte());
        let lines: Vec<&str> = text.split_terminator(end).collect();
        assert_eq!(lines.last(), Some(&"[END]"));
        assert!(text.ends_with(end) && lines.iter().all(|line| line.len() <= 252));
        let mut at = 0;
        for section in SECTIONS {
            let tag = format!("[{section}]");
            assert_eq!(text.matches(&tag).count(), 1, "{tag}");
            at += text[at..].find(&tag).unwrap();
        }
        assert!(text.contains("= 1 2 0 1") && text.contains("{IP1} = 1001"));
    }
}

#[test]
fn any_values_written_read_back() {
    let values = previous();
    let factory = EthernetParameters::factory();
    assert_eq!(
        EthernetParameters::parse(&values.encode(LineEnd::Lf), &factory),
        (values, Vec::new())
    );
}

/// The factory setting with the value of one section (of [E05] that of IP1) left as it was.
fn keeping(section: &str) -> EthernetParameters {
    let mut new = EthernetParameters::factory();
    let old = previous();
    match section {
        "E01" => new.address = old.address,
        "E02" => new.name = old.name,
        "E03" => new.mask = old.mask,
        "E04" => new.gateway = old.gateway,
        "E05" => new.own_port[1] = old.own_port[1],
        "E06" => new.peer_port[3] = old.peer_port[3],
        "E07" => new.peer_address[0] = old.peer_address[0],
        "E08" => new.community = old.community,
        "E09" => new.dhcp = old.dhcp,
        "E10" => new.alarm_level = old.alarm_level,
        _ => panic!("{section}"),
    }
    new
}

#[test]
fn a_bad_value_keeps_the_previous_one_and_is_told() {
    for (from, to, section) in [
        ("= 192.168.0.124", "= 192.168.0.256", "E01"),
        ("= 192.168.0.124", "= 192.168.0", "E01"),
        ("= 192.168.0.124", "= 192.168.0.1.2", "E01"),
        ("= 192.168.0.124", "", "E01"),
        ("\"NO1-TS3K\" [E03]", "NO1-TS3K [E03]", "E02"),
        ("\"NO1-TS3K\" [E03]", "\"NO1\"x [E03]", "E02"),
        ("= 255.255.255.0", "= 255,255,255,0", "E03"),
        ("[E03] SUBNET MASK = 255.255.255.0", "", "E03"),
        ("= 192.168.0.1 ", "= x ", "E04"),
        ("= 1001{", "= 0{", "E05"),
        ("= 1001{", "= 65536{", "E05"),
        ("= 1001{", "= +1001{", "E05"),
        ("{IP1} = 1001{", "{", "E05"),
        ("= 1003[E07]", "= 1003 1[E07]", "E06"),
        ("= 192.168.0.150", "= 192..0.150", "E07"),
        (
            "COMMUNITY NAME = \"NO1-TS3K\"",
            "COMMUNITY NAME = \"\u{e9}\"",
            "E08",
        ),
        ("DHCP = 0", "DHCP = 2", "E09"),
        ("= 0 0 0 0", "= 0 0 0", "E10"),
    ] {
        let (found, problems) = changed(from, to);
        assert_eq!(found, keeping(section), "{from} -> {to}");
        assert_eq!(problems.len(), 1, "{from} -> {to}: {problems:?}");
        assert_eq!(problems[0].section, section, "{from} -> {to}");
    }
}

// clause: PAR-E00-01 PAR-E10-01
#[test]
fn one_bad_value_of_four_keeps_its_own_channel() {
    let (found, problems) = changed("= 1 0 0 0", "= 1 3 2 1");
    assert_eq!(
        found.open_mode,
        [
            OpenMode::Server,
            OpenMode::Client,
            OpenMode::Client,
            OpenMode::Server
        ]
    );
    assert_eq!(problems.len(), 1);
    assert_eq!(
        problems[0].to_string(),
        "[E00] {IP1} line 1: expected 0, 1 or 2, found `3`"
    );
    let (found, problems) = changed("= 0 0 0 0", "= 8 3 2 1");
    let levels = [AlarmLevel::L8, AlarmLevel::L4, AlarmLevel::L2, AlarmLevel::L1];
    assert_eq!((found.alarm_level, problems.len()), (levels.map(Some), 1));
}

// clause: PAR-E00-02 PAR-E00-03
#[test]
fn ip0_is_never_a_client() {
    let (found, problems) = changed("= 1 0 0 0", "= 2 0 0 0");
    assert_eq!((found, problems.len()), (EthernetParameters::factory(), 1));
    assert_eq!((problems[0].section, problems[0].key.as_str()), ("E00", "IP0"));
    let (found, problems) = changed("= 1 0 0 0", "= 0 2 2 2");
    assert_eq!((found.open_mode[0], problems.len()), (OpenMode::NotUsed, 0));
}

// clause: PAR-E05-02
#[test]
fn one_port_for_two_channels_leaves_the_later_unused() {
    let text =
        PRINTED
            .replacen("= 1 0 0 0", "= 1 1 1 1", 1)
            .replacen("= 1002{IP3} = 1003", "= 1001{IP3} = 1001", 1);
    let (found, problems) = EthernetParameters::parse(text.as_bytes(), &previous());
    assert_eq!(
        found.open_mode,
        [
            OpenMode::Server,
            OpenMode::Server,
            OpenMode::NotUsed,
            OpenMode::NotUsed
        ]
    );
    assert_eq!(found.own_port, [1000, 1001, 1001, 1001]);
    let keys: Vec<&str> = problems.iter().map(|problem| problem.key.as_str()).collect();
    assert_eq!(keys, ["IP2", "IP3"]);
    let unused = text.replacen("= 1 1 1 1", "= 1 0 1 0", 1);
    let (found, problems) = EthernetParameters::parse(unused.as_bytes(), &previous());
    assert_eq!(
        found.open_mode[2],
        OpenMode::Server,
        "a channel that is not used holds no port"
    );
    assert_eq!(problems.len(), 2);
}

#[test]
fn unknown_double_and_missing_parts_are_told() {
    for (from, to, expected) in [
        ("[END]", "", "[END] at the end"),
        ("[E09]", "[E11] = 1 [E09]", "a section [E00] to [E10]"),
        ("[E09]", "[E01] = 1.2.3.4 [E09]", "the section once"),
        ("[E09] DHCP = 0", "[E09] DHCP = 0 = 1", "one value"),
        ("[E06]", "{IP4} = 5 [E06]", "a value for IP0, IP1, IP2, IP3"),
        ("[E06]", "{IP3} = 5 [E06]", "one value"),
        ("[E00]", "= 5 [E00]", "a section [E00] to [E10]"),
    ] {
        let (found, problems) = changed(from, to);
        assert_eq!(found, EthernetParameters::factory(), "{to}");
        assert_eq!(problems.len(), 1, "{to}: {problems:?}");
        assert_eq!(problems[0].expected, expected);
    }
}

#[test]
fn nothing_that_a_host_can_send_panics() {
    let (found, problems) = EthernetParameters::parse(b"", &previous());
    assert_eq!(found, previous());
    assert!(!problems.is_empty());
    for end in 0..PRINTED.len() {
        let (_, problems) = EthernetParameters::parse(&PRINTED.as_bytes()[..end], &previous());
        assert!(!problems.is_empty());
    }
    let mut seed = 12_345_u32;
    for _ in 0..3_000 {
        let mut bytes = PRINTED.as_bytes().to_vec();
        for _ in 0..4 {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let at = seed as usize % bytes.len();
            bytes[at] = b"[]{}=\"\r\n 9\xFF."[(seed >> 24) as usize % 12];
        }
        let (found, problems) = EthernetParameters::parse(&bytes, &previous());
        assert!(problems.len() <= super::super::MAX_PROBLEMS && found.open_mode[0] != OpenMode::Client);
    }
    let many = "[X] ".repeat(1_000);
    let (_, problems) = EthernetParameters::parse(many.as_bytes(), &previous());
    assert_eq!(problems.len(), super::super::MAX_PROBLEMS);
    assert!(problems.iter().all(|problem| problem.to_string().len() < 200));
}
