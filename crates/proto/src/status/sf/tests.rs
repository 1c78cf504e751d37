//! SF byte by byte: every offset of the manual's table, both lengths.

use super::super::MasterMode;
use super::*;
use alloc::vec;

fn full() -> SystemStatus {
    SystemStatus {
        servo: true,
        emergency_stop: true,
        execution: ExecutionStatus::Continue,
        su_request: true,
        alarms: vec![557, 0],
        execution_line: 0x0102,
        analysis_line: 0x0304,
        execution_task: 0x0506,
        analysis_task: 0x0708,
        feed_hold: true,
        guide_coordinate: 3,
        guide_rate: 2,
        guide_mode: 1,
        master_mode: 3,
        power_on_minutes: 0x0A0B_0C0D,
        run_minutes: 0x0102_0304,
        inputs: core::array::from_fn(|index| 0x1000 + index as u16),
        outputs: core::array::from_fn(|index| 0x2000 + index as u16),
        joint: core::array::from_fn(|index| 1.0 + index as f32),
        world: core::array::from_fn(|index| 100.0 + index as f32),
        work: core::array::from_fn(|index| -200.5 - index as f32),
        work_name: String::from("W1"),
        tool_name: String::from("T1"),
        base_name: String::from("ABCDEFGHIJKLMNOPQRST"),
    }
}

fn float(bytes: &[u8], at: usize) -> f32 {
    f32::from_be_bytes(bytes[at..at + 4].try_into().unwrap())
}

fn word(bytes: &[u8], at: usize) -> u16 {
    u16::from_be_bytes([bytes[at], bytes[at + 1]])
}

// clause: SF-03 SF-04 SF-05 SF-06 SF-07 SF-08 SF-09 SF-10 SF-11 SF-12 SF-13 SF-14 SF-15 SF-16 SF-17 SF-18 SF-19 SF-20
#[test]
fn the_motion_status_stands_at_its_offsets() {
    for layout in [SfLayout::Eight, SfLayout::Six] {
        let bytes = full().encode(layout);
        assert_eq!(bytes[..4], [1, 1, 3, 1]);
        assert_eq!(bytes[4..8], [0x02, 0x2D, 0, 0]);
        assert!(bytes[8..24].iter().all(|byte| *byte == 0xFF));
        assert_eq!(bytes[24..32], [1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(bytes[32..44], [0, 1, 0, 3, 0, 2, 0, 1, 0, 3, 0, 0]);
        assert_eq!(bytes[44..52], [0x0A, 0x0B, 0x0C, 0x0D, 1, 2, 3, 4]);
    }
}

// clause: SF-25 SF-26 SF-27 SF-28 SF-29 SF-30 SF-31 SF-32 SF-33 SF-34 SF-35 SF-36 SF-37 SF-38 SF-40
#[test]
fn io_words_stand_in_their_order() {
    for layout in [SfLayout::Eight, SfLayout::Six] {
        let bytes = full().encode(layout);
        for index in 0..16 {
            assert_eq!(usize::from(word(&bytes, 52 + 2 * index)), 0x1000 + index);
            assert_eq!(usize::from(word(&bytes, 84 + 2 * index)), 0x2000 + index);
        }
    }
}

// clause: SF-01 SF-42 SF-44 SF-45 SF-46
#[test]
fn eight_axes_make_276_bytes() {
    let bytes = full().encode(SfLayout::Eight);
    assert_eq!(bytes.len(), 276);
    assert_eq!(bytes[116..120], [0x3F, 0x80, 0, 0]);
    assert_eq!(
        (float(&bytes, 144), float(&bytes, 148), float(&bytes, 176)),
        (8.0, 100.0, 107.0)
    );
    assert_eq!((float(&bytes, 180), float(&bytes, 208)), (-200.5, -207.5));
    assert_eq!(bytes[212..216], *b"W1\0\0");
    assert!(bytes[214..232].iter().all(|byte| *byte == 0));
    assert_eq!(bytes[232..236], *b"T1\0\0");
    assert_eq!(bytes[252..272], *b"ABCDEFGHIJKLMNOPQRST");
    assert_eq!(bytes[272..], [0; 4]);
}

// clause: S23
#[test]
fn six_axes_make_250_bytes() {
    let bytes = full().encode(SfLayout::Six);
    assert_eq!(bytes.len(), 250);
    assert_eq!((float(&bytes, 116), float(&bytes, 136)), (1.0, 6.0));
    assert_eq!((float(&bytes, 140), float(&bytes, 160)), (100.0, 105.0));
    assert_eq!((float(&bytes, 164), float(&bytes, 184)), (-200.5, -205.5));
    assert_eq!(bytes[188..192], *b"W1\0\0");
    assert_eq!(bytes[208..212], *b"T1\0\0");
    assert_eq!(bytes[228..248], *b"ABCDEFGHIJKLMNOPQRST");
    assert_eq!(bytes[248..], [0; 2]);
}

#[test]
fn an_idle_controller_shows_no_alarm_and_no_names() {
    let bytes = SystemStatus::default().encode(SfLayout::Eight);
    assert!(bytes[4..24].iter().all(|byte| *byte == 0xFF));
    assert!(bytes[212..].iter().all(|byte| *byte == 0));
}

#[test]
fn more_than_ten_alarms_show_the_first_ten() {
    let status = SystemStatus {
        alarms: (1..=12).collect(),
        ..SystemStatus::default()
    };
    let bytes = status.encode(SfLayout::Eight);
    assert_eq!((word(&bytes, 4), word(&bytes, 22), word(&bytes, 24)), (1, 10, 0));
}

#[test]
fn everything_reads_back() {
    let status = full();
    assert_eq!(
        SystemStatus::decode(&status.encode(SfLayout::Eight), SfLayout::Eight),
        Ok(status.clone())
    );
    let six = SystemStatus::decode(&status.encode(SfLayout::Six), SfLayout::Six).unwrap();
    let cut = |mut group: [f32; 8]| {
        group[6..].fill(0.0);
        group
    };
    let expected = SystemStatus {
        joint: cut(status.joint),
        world: cut(status.world),
        work: cut(status.work),
        ..status
    };
    assert_eq!(six, expected);
}

#[test]
fn names_are_cut_and_made_ascii() {
    let status = SystemStatus {
        work_name: String::from("ABCDEFGHIJKLMNOPQRSTUVW"),
        tool_name: String::from("W\u{e9}RK\n"),
        ..SystemStatus::default()
    };
    let read = SystemStatus::decode(&status.encode(SfLayout::Six), SfLayout::Six).unwrap();
    assert_eq!(
        (read.work_name.as_str(), read.tool_name.as_str()),
        ("ABCDEFGHIJKLMNOPQRST", "W?RK?")
    );
}

#[test]
fn wrong_lengths_and_values_are_refused() {
    let bytes = full().encode(SfLayout::Eight);
    for end in 0..bytes.len() {
        assert!(
            SystemStatus::decode(&bytes[..end], SfLayout::Eight).is_err(),
            "{end}"
        );
    }
    assert!(SystemStatus::decode(&full().encode(SfLayout::Six), SfLayout::Eight).is_err());
    for (at, value) in [(0, 2), (1, 0xFF), (2, 4), (3, 2), (32, 1), (33, 2), (212, 0x80)] {
        let mut broken = bytes.clone();
        broken[at] = value;
        let error = SystemStatus::decode(&broken, SfLayout::Eight).unwrap_err();
        assert!((at.saturating_sub(1)..=at).contains(&error.at), "{error}");
    }
}

// clause: SF-22 S25
#[test]
fn alarm_words_lie_in_the_ranges_of_their_level() {
    for (level, code, word) in [
        (AlarmLevel::L8, 1, 0),
        (AlarmLevel::L8, 368, 367),
        (AlarmLevel::L8, 369, 960),
        (AlarmLevel::L8, 880, 1471),
        (AlarmLevel::L4, 1, 368),
        (AlarmLevel::L4, 144, 511),
        (AlarmLevel::L4, 145, 1472),
        (AlarmLevel::L4, 400, 1727),
        (AlarmLevel::L2, 46, 557),
        (AlarmLevel::L2, 224, 735),
        (AlarmLevel::L2, 225, 1728),
        (AlarmLevel::L2, 480, 1983),
        (AlarmLevel::L1, 160, 895),
        // hosts 8.9
        (AlarmLevel::L1, 200, 935),
        (AlarmLevel::L1, 224, 959),
        (AlarmLevel::L1, 225, 1984),
        (AlarmLevel::L1, 480, 2239),
    ] {
        assert_eq!(alarm_word(level, code), Some(word));
        assert_eq!(alarm_from_word(word), Some((level, code)));
    }
    for (level, code) in [
        (AlarmLevel::L8, 0),
        (AlarmLevel::L8, 881),
        (AlarmLevel::L4, 401),
        (AlarmLevel::L2, u16::MAX),
        (AlarmLevel::L1, 481),
    ] {
        assert_eq!(alarm_word(level, code), None);
    }
    for word in 0..2240 {
        let (level, code) = alarm_from_word(word).unwrap();
        assert_eq!(alarm_word(level, code), Some(word));
    }
    assert_eq!(alarm_from_word(2240), None);
    assert_eq!(alarm_from_word(NO_ALARM), None);
}

#[test]
fn the_first_text_tells_its_layout() {
    let scara = SystemStatus {
        joint: [-30.0, 78.0, 0.0, -48.0, 0.0, 0.0, 0.0, 0.0],
        world: [312.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        work: [312.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ..SystemStatus::default()
    };
    let bytes = scara.encode(SfLayout::Six);
    assert_eq!(SfLayout::from_first_text(&bytes), SfLayout::Six);
    for status in [scara, full(), SystemStatus::default()] {
        let bytes = status.encode(SfLayout::Eight);
        assert_eq!(SfLayout::from_first_text(&bytes[..250]), SfLayout::Eight);
    }
    assert_eq!(SfLayout::from_first_text(&[]), SfLayout::Eight);
}

// clause: SF-17 S26
#[test]
fn master_mode_codes() {
    assert_eq!(MasterMode::ALL.map(MasterMode::sf_code), [0, 1, 2, 3, 3]);
}
