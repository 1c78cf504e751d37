//! Tests of the named options: every reading has a key, every key sets its field and no other, and every option
//! that the documents name exists.

use super::*;
use crate::config::{Environment, ServeArgs, Settings, read};
use crate::testing::TempDir;
use ts3100_controller::options::Dialect;

/// Every reading under its key.
fn readings(options: &Options, links: &LinkOptions) -> Vec<(&'static str, String)> {
    // Without `..`: a new field of the links does not compile until somebody sees that it needs a row.
    let LinkOptions {
        second: _,
        redial: _,
        silence: _,
        when_full: _,
    } = links;
    let (mut options, mut links) = (options.clone(), *links);
    let rows = OPTIONS.iter();
    rows.map(|row| (row.key, row.setting.text(&mut options, &mut links)))
        .collect()
}

/// A value of each option that is not the field dialect's.
const OTHERS: [(&str, &str); 40] = [
    ("ac.date", "yy"),
    ("alarm.out_of_reach", "4-101"),
    ("auto.silence", "0.1ms"),
    ("channel.no_peer", "silent"),
    ("channel.reconnect", "release"),
    ("channel.redial", "0.5s"),
    ("channel.second", "replace"),
    ("do.min_run", "300ms"),
    ("drive.capacity", "200000"),
    ("drive.open_mode", "1 0 2 0"),
    ("drive.when_full", "memory"),
    ("extensions", "false"),
    ("input.malformed", "leading-number"),
    ("io.field_bus", "present"),
    ("parameter.line_end", "cr"),
    ("reply.delay", "5"),
    ("rs.cycle_without_label", "ng"),
    ("scol.int_division", "real"),
    ("dl.command_ends", "false"),
    ("scol.data_copy", "true"),
    ("scol.din_unknown", "zero"),
    ("scol.equal_within", "0.5"),
    ("scol.reset_locals", "true"),
    ("scol.sticky_work", "true"),
    ("serial.bad_character", "keep"),
    ("serial.pacing", "false"),
    ("serial.while_sending", "kept"),
    ("servo.interval", "7s"),
    ("sf.split", "several"),
    ("sig.low_speed", "37"),
    ("sig.strobe", "required"),
    ("sp.unsolicited", "false"),
    ("strict_50ms", "true"),
    ("su.layout", "six-records"),
    ("text.checksum", "sum"),
    ("text.end", "cr"),
    ("text.require_cr", "true"),
    ("text.stx", "required"),
    ("vr.layout", "packed"),
    ("wait.after_stop", "again"),
];

fn defaults() -> Vec<(&'static str, String)> {
    readings(&Options::for_dialect(Dialect::Field), &LinkOptions::default())
}

/// Keys of the readings that are not the field dialect's.
fn changed(args: ServeArgs) -> Vec<&'static str> {
    let (args, _) = read(args, &Environment::new()).unwrap();
    let settings = Settings::from_args(&args).unwrap();
    let now = readings(&settings.controller.options, &settings.links);
    let pairs = defaults().into_iter().zip(now);
    pairs
        .filter(|(before, after)| before != after)
        .map(|(before, _)| before.0)
        .collect()
}

#[test]
fn every_reading_has_its_key() {
    let keys: Vec<&str> = OPTIONS.iter().map(|row| row.key).collect();
    assert!(keys.is_sorted());
    let mut others = OTHERS.map(|(key, _)| key);
    others.sort_unstable();
    assert_eq!(keys, others);
}

#[test]
fn a_default_is_written_as_it_is_read() {
    for dialect in [Dialect::Field, Dialect::Manual] {
        let preset = (Options::for_dialect(dialect), LinkOptions::default());
        for row in OPTIONS.iter() {
            let default = row.default_in(dialect);
            if default.is_empty() {
                let by_arm = ["scol.equal_within", "input.malformed"];
                assert!(by_arm.contains(&row.key), "{} depends on the arm", row.key);
                continue;
            }
            let (mut options, mut links) = (Options::for_dialect(dialect), LinkOptions::default());
            set_option(&mut options, &mut links, row.key, &default).unwrap();
            assert_eq!((options, links), preset, "{} = {default}", row.key);
        }
    }
}

#[test]
fn an_option_takes_the_words_of_its_row_and_no_others() {
    let takes = |row: &OptionRow, value: &str| {
        let (mut options, mut links) = (Options::for_dialect(Dialect::Field), LinkOptions::default());
        set_option(&mut options, &mut links, row.key, value).is_ok()
    };
    let words: Vec<&str> = OPTIONS
        .iter()
        .flat_map(|row| row.values().words())
        .copied()
        .collect();
    for row in OPTIONS.iter() {
        let known = row.values().words();
        if let Values::Duration { least, example } = row.values() {
            assert!(takes(row, least) && takes(row, example), "{}", row.key);
        }
        for word in &words {
            assert_eq!(takes(row, word), known.contains(word), "{} = {word}", row.key);
        }
    }
}

#[test]
fn a_key_changes_its_reading_alone_on_the_command_line_and_in_the_file() {
    let directory = TempDir::new("options");
    let file = directory.at("ts3100.toml");
    for (key, value) in OTHERS {
        let flag = ServeArgs::from_words(&[format!("--set={key}={value}").into()]);
        assert_eq!(changed(flag.unwrap()), [key], "--set");
        std::fs::write(&file, format!("[options]\n{key} = \"{value}\"\n")).unwrap();
        let config = ServeArgs::from_words(&["--config".into(), file.clone().into()]).unwrap();
        assert_eq!(changed(config), [key], "TOML");
    }
    std::fs::write(&file, "[options]\nsig.low_speed = 37\nextensions = false\n").unwrap();
    let config = ServeArgs::from_words(&["--config".into(), file.clone().into()]).unwrap();
    assert_eq!(changed(config), ["extensions", "sig.low_speed"], "without quotes");
}

#[test]
fn numbers_keep_to_their_range() {
    let (mut options, mut links) = (Options::for_dialect(Dialect::Field), LinkOptions::default());
    let mut takes = |key: &str, value: &str| set_option(&mut options, &mut links, key, value).is_ok();
    for (key, good, bad) in [
        ("sig.low_speed", &["1", "100"][..], &["0", "101", "-1", "3.5"][..]),
        (
            "drive.capacity",
            &["0", "1000", "99999000"],
            &["-1", "1e6", "99999001", "18446744073709551616"],
        ),
        (
            "do.min_run",
            &["0s", "3600s"],
            &["3601s", "-1s", "200", "nans", "infs", "1e308s"],
        ),
        (
            "servo.interval",
            &["0s", "3600s"],
            &["3601s", "-0.1s", "nanms", "1e400s"],
        ),
        (
            "auto.silence",
            &["0.05ms", "50us", "20ms"],
            &["0.04ms", "3601s", "49us"],
        ),
        (
            "channel.redial",
            &["10ms", "3600s"],
            &["0s", "9ms", "3601s", "inf s"],
        ),
        (
            "scol.equal_within",
            &["0", "0.001", "1000"],
            &["-0.1", "1001", "inf", "nan", "1e308"],
        ),
        (
            "drive.open_mode",
            &["1, 2,0 0"],
            &["1 1 1", "1 1 1 1 1", "1 1 1 3"],
        ),
        (
            "input.malformed",
            &["leading_number", "leading-number"],
            &["leading number"],
        ),
    ] {
        assert!(good.iter().all(|value| takes(key, value)), "{key}");
        assert!(!bad.iter().any(|value| takes(key, value)), "{key}");
    }
}

/// Names and values of the Option column of docs/explanation/fidelity.md, as `name = value \| value` or `name`.
fn documented() -> Vec<(String, Vec<String>)> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/explanation/fidelity.md");
    let text = std::fs::read_to_string(path).unwrap().replace("\\|", "/");
    let mut found = Vec::new();
    let mut in_table = false;
    for line in text.lines() {
        let cells: Vec<&str> = line.trim().trim_matches('|').split('|').map(str::trim).collect();
        if !line.starts_with('|') {
            in_table = false;
        } else if cells.iter().rev().nth(1) == Some(&"Option") {
            in_table = true;
        } else if let Some(cell) = cells.iter().rev().nth(1).filter(|_| in_table) {
            for word in cell.split('`').skip(1).step_by(2) {
                let (name, values) = word.split_once('=').unwrap_or((word, ""));
                let values = values.split('/').map(|value| value.trim().to_owned());
                found.push((
                    name.trim().to_owned(),
                    values.filter(|value| !value.is_empty()).collect(),
                ));
            }
        }
    }
    found
}

#[test]
fn what_the_documents_name_exists() {
    let documented = documented();
    assert!(documented.len() > 10, "the tables were not found");
    let (mut options, mut links) = (Options::for_dialect(Dialect::Field), LinkOptions::default());
    for (name, values) in documented {
        if let Some(flag) = name.strip_prefix("--") {
            assert!(ServeArgs::flags().any(|known| known.key() == flag), "{name}");
            continue;
        }
        assert!(OPTIONS.iter().any(|row| row.key == name), "{name}");
        for value in values {
            set_option(&mut options, &mut links, &name, &value).unwrap();
        }
    }
}

#[test]
fn reply_times_have_units_with_or_without_a_blank() {
    let set = |text: &str| {
        let mut options = Options::for_dialect(Dialect::Field);
        let pair = format!("reply.delay={text}");
        let set = set_pair(&mut options, &mut LinkOptions::default(), &pair);
        set.ok()
            .map(|()| options.reply_delay.map(|time| time.as_millis()))
    };
    assert_eq!(set("500 ms"), Some([500; 5]));
    assert_eq!(set("0.5s"), Some([500; 5]));
    assert_eq!(set("1 2ms, 3 ms 4 1 s"), Some([1, 2, 3, 4, 1_000]));
    assert_eq!(set("500 m"), None);
}
