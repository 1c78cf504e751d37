//! Tests of the configuration: which layer wins, what is refused, and the messages that say so.

use super::args::PortSource;
use super::flag_group::{self, Flag, FlagGroup as _, Mark, flag_group};
use super::*;
use crate::testing::TempDir;
use clap::Parser;
use clap::error::ErrorKind;
use std::path::Path;
use std::time::Duration;
use ts3100_controller::options::{Dialect, SfTexts, UnsolicitedSp};
use ts3100_proto::text::StxRule;

#[derive(Parser)]
struct Flags {
    #[command(flatten)]
    serve: ServeArgs,
}

fn flags(words: &[&str]) -> ServeArgs {
    Flags::try_parse_from(std::iter::once("serve").chain(words.iter().copied()))
        .unwrap()
        .serve
}

fn environment(pairs: &[(&str, &str)]) -> Environment {
    pairs
        .iter()
        .map(|(name, value)| ((*name).into(), (*value).into()))
        .collect()
}

fn error_of(words: &[&str], pairs: &[(&str, &str)]) -> String {
    match read(flags(words), &environment(pairs)) {
        Ok((args, _)) => Settings::from_args(&args).unwrap_err().to_string(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn flags_win_over_environment_over_file_over_defaults() {
    let directory = TempDir::new("config");
    let file = directory.path().join("ts3100.toml");
    std::fs::write(
        &file,
        "key-switch = \"teaching\"\nport-offset = 1\nservo_on = true\ndrive = \"drive\"\ntime = \"x10\"\n\
         load = [\"a.scol\", \"/b.scol\"]\nverbose = 2\n\
         [options]\n\"text.stx\" = \"required\"\nsf.split = \"several\"\nsp.unsolicited = false\n",
    )
    .unwrap();
    let environment = environment(&[
        ("TS3100_CONFIG", file.to_str().unwrap()),
        ("TS3100_PORT_OFFSET", "2"),
        ("TS3100_KEY_SWITCH", "internal"),
        ("TS3100_SET", "sf.split=one,do.min_run=300ms"),
        ("TS3100_UNHEARD_OF", "1"),
        ("TS3100_BINARY", "/usr/bin/ts3100"),
        ("PATH", "/bin"),
    ]);
    let (args, unknown) = read(
        flags(&[
            "--key-switch",
            "ext",
            "--servo-on=false",
            "--set",
            "do.min_run=100ms",
        ]),
        &environment,
    )
    .unwrap();
    assert_eq!(
        unknown,
        ["ignoring unknown environment variable TS3100_UNHEARD_OF"]
    );
    assert_eq!(
        args.robot.key_switch,
        Some(KeySwitch::Ext),
        "flag over environment and file"
    );
    assert_eq!(args.network.port_offset, Some(2), "environment over file");
    assert_eq!(
        args.robot.servo_on,
        Some(false),
        "a flag can take back what the file says"
    );
    assert_eq!(args.log.verbose, 2);
    assert_eq!(
        args.files.drive,
        Some(directory.path().join("drive")),
        "paths are seen from the file"
    );
    assert_eq!(
        args.files.load,
        [directory.path().join("a.scol"), PathBuf::from("/b.scol")]
    );

    let settings = Settings::from_args(&args).unwrap();
    assert_eq!(settings.ports, Ports::Offset(2));
    assert_eq!(settings.time, TimeMode::Scaled(10.0), "file over default");
    assert_eq!(settings.listen.to_string(), "127.0.0.1", "default");
    let options = &settings.controller.options;
    assert_eq!(options.text.stx, StxRule::Required, "named option of the file");
    assert_eq!(
        options.sf_texts,
        SfTexts::One,
        "named option: environment over file"
    );
    assert_eq!(
        options.do_min_run,
        Duration::from_millis(100),
        "named option: flag over environment"
    );
    assert_eq!(options.unsolicited_sp, UnsolicitedSp::Never);
}

#[test]
fn a_named_option_overrides_the_dialects_preset_alone() {
    let (args, _) = read(
        flags(&["--dialect", "manual", "--set", "text.stx=detect"]),
        &Environment::new(),
    )
    .unwrap();
    let options = Settings::from_args(&args).unwrap().controller.options;
    let manual = ts3100_controller::options::Options::for_dialect(Dialect::Manual);
    assert_eq!(options.text.stx, StxRule::Detect);
    assert_eq!(
        ts3100_controller::options::Options {
            text: manual.text,
            ..options
        },
        manual
    );
}

#[test]
fn every_named_option_is_known_and_refuses_what_it_does_not_take() {
    let mut options = ts3100_controller::options::Options::for_dialect(Dialect::Field);
    let mut links = LinkOptions::default();
    for row in OPTIONS.iter() {
        let (key, values) = (row.key, row.values());
        let error = set_option(&mut options, &mut links, key, "nonsense")
            .unwrap_err()
            .to_string();
        assert_eq!(
            error,
            format!("option {key}: expected {values}, found `nonsense`")
        );
    }
}

#[test]
fn what_is_not_understood_is_refused_with_its_place() {
    let directory = TempDir::new("config-bad");
    let file = directory.path().join("bad.toml");
    let path = file.to_str().unwrap();
    for (text, expected) in [
        (
            "prot-offset = 1",
            ", line 1: unknown key `prot-offset`; did you mean `port-offset`?",
        ),
        ("config = \"x\"", "unknown key `config`"),
        (
            "key-switch = \"extern\"",
            "key-switch: expected teaching, internal, ext, found `extern`",
        ),
        (
            "port-offset = 70000",
            "port-offset: expected a whole number from 0 to 65535, found `70000`",
        ),
        (
            "port-offset = { a = 1 }",
            "port-offset: expected a string, a number or true/false, found table",
        ),
        ("options = 3", "options: expected a table, found integer"),
        ("drive = \"\"", "drive: expected a path, found ``"),
        (
            "transcript = \"a.doc\"",
            "transcript: expected a name that ends in .txt, .jsonl or .pcapng, found `a.doc`",
        ),
        ("verbose = true", "verbose: expected 0, 1 or 2, found `true`"),
        ("a = = 2", "bad.toml, line 1: "),
    ] {
        std::fs::write(&file, text).unwrap();
        let error = error_of(&["--config", path], &[]);
        assert!(
            error.contains(expected) && error.contains(path),
            "{text}: {error}"
        );
    }
    std::fs::write(&file, "[options]\ntext.sxt = \"detect\"").unwrap();
    assert!(
        error_of(&["--config", path], &[])
            .ends_with("bad.toml, line 2: unknown option `text.sxt`; did you mean `text.stx`?")
    );
    assert!(
        error_of(&["--config", "/nowhere/ts3100.toml"], &[]).starts_with("cannot read /nowhere/ts3100.toml")
    );
    let error = error_of(&[], &[("TS3100_TIME", "fast")]);
    assert!(
        error.starts_with("TS3100_TIME: ") && error.contains("expected `real`, `xN`"),
        "{error}"
    );
    assert_eq!(
        error_of(&["--set", "text.stx"], &[]),
        "option: expected KEY=VALUE, found `text.stx`"
    );
}

// clause: GEN-05
#[test]
fn the_tsl3100_has_no_internal() {
    assert!(error_of(&["--controller", "tsl3100", "--key-switch", "internal"], &[]).contains("GEN-05"));
    let (args, _) = read(flags(&["--key-switch", "internal"]), &Environment::new()).unwrap();
    assert!(Settings::from_args(&args).is_ok());
}

// clause: S41
#[test]
fn a_tsl3000e_presets_the_servo_interval_and_a_named_option_wins() {
    let interval = |args: &[&str]| {
        let (args, _) = read(flags(args), &Environment::new()).unwrap();
        let controller = Settings::from_args(&args).unwrap().controller;
        controller.options.servo_interval.as_secs()
    };
    assert_eq!(interval(&["--controller", "tsl3100"]), 0);
    assert_eq!(interval(&["--controller", "tsl3000e"]), 7);
    assert_eq!(interval(&["--controller", "tsl3000e", "--dialect", "manual"]), 7);
    assert_eq!(
        interval(&["--controller", "tsl3000e", "--set", "servo.interval=0s"]),
        0
    );
    assert_eq!(interval(&["--set", "servo.interval=7s"]), 7);
}

#[test]
fn ports_come_from_the_parameters_or_the_system() {
    let (args, _) = read(flags(&["--ports", "auto"]), &Environment::new()).unwrap();
    assert_eq!(args.network.ports, Some(PortSource::Auto));
    assert_eq!(Settings::from_args(&args).unwrap().ports, Ports::Auto);
    assert_eq!(
        Settings::from_args(&ServeArgs::default()).unwrap().ports,
        Ports::Offset(0)
    );
}

#[test]
fn a_model_of_ones_own_is_seen_from_the_file_that_names_it() {
    let directory = TempDir::new("model");
    let shipped = include_str!("../../../../fixtures/models/tsl3000-thl400.toml");
    let own = shipped.replace("second_arm = 175.0", "second_arm = 275.0");
    std::fs::write(
        directory.path().join("own.toml"),
        own.replace("tsl3000-thl400", "own"),
    )
    .unwrap();
    let file = directory.path().join("ts3100.toml");
    std::fs::write(&file, "model = \"own.toml\"\n").unwrap();
    let (args, _) = read(flags(&["--config", file.to_str().unwrap()]), &environment(&[])).unwrap();
    let model = Settings::from_args(&args).unwrap().controller.model;
    assert_eq!(model.name, "own");
    assert!(
        matches!(model.kind, ts3100_controller::model::ArmKind::Scara(arm) if (arm.second_arm - 275.0).abs() < 1e-9)
    );
    std::fs::write(&file, "model = \"tsl3000-thl400\"\n").unwrap();
    let (args, _) = read(flags(&["--config", file.to_str().unwrap()]), &environment(&[])).unwrap();
    assert_eq!(
        Settings::from_args(&args).unwrap().controller.model.name,
        "tsl3000-thl400"
    );
    let unknown = error_of(&[], &[("TS3100_MODEL", "tv1000")]);
    assert!(
        unknown
            .contains("expected ts3100-tv800, tsl3000-thl400, tsl3000-thl400-4, tsl3000-thl300, scara-600 or the path of a .toml file"),
        "{unknown}"
    );
}

#[test]
fn points_are_read_for_the_model_from_every_layer() {
    let directory = TempDir::new("points");
    let table = directory.file("points.csv", "P000,123.000,456.000,10.000,0.000,0.000,RIGHTY\n");
    let file = directory.file(
        "ts3100.toml",
        "points = \"points.csv\"\nmodel = \"tsl3000-thl400\"\n",
    );
    let (by_file, by_variable) = (
        environment(&[("TS3100_CONFIG", file.as_str())]),
        environment(&[
            ("TS3100_POINTS", table.as_str()),
            ("TS3100_MODEL", "tsl3000-thl400"),
        ]),
    );
    for environment in [by_file, by_variable] {
        let (args, _) = read(flags(&[]), &environment).unwrap();
        let settings = Settings::from_args(&args).unwrap();
        let points = &settings.controller.points;
        assert_eq!((points.len(), points[0].name.as_str()), (1, "P000"));
        assert!(settings.flags.iter().any(|flag| flag.starts_with("points=")));
    }
    let words = ["--points", table.as_str()];
    let error = error_of(&words, &[]);
    assert!(error.contains("points.csv:1:41: expected 10 fields"), "{error}");
    let error = error_of(
        &[
            "--restore",
            "x.json",
            words[0],
            words[1],
            "--model",
            "tsl3000-thl400",
        ],
        &[],
    );
    assert!(error.contains("--points"), "{error}");
}

#[test]
fn the_table_of_flags_is_that_of_the_command_line() {
    let kind = |word: &str| ServeArgs::from_words(&[word.into()]).map_err(|error| error.kind());
    let command = super::layers::serve_command();
    let defined = command.get_arguments().filter_map(|flag| flag.get_long());
    let flags: Vec<String> = ServeArgs::flags().map(Flag::key).collect();
    assert_eq!(flags, defined.collect::<Vec<_>>());
    for key in flags {
        let read = kind(&format!("--{key}"));
        assert_ne!(read.err(), Some(ErrorKind::UnknownArgument), "{key}");
        let read = kind(&format!("--{key}=no value of any flag?"));
        assert_ne!(read.err(), Some(ErrorKind::UnknownArgument), "{key}=");
    }
    assert_eq!(kind("-vv").unwrap().log.verbose, 2);
    for wrong in ["--help", "-h", "--portz", "--port", "word"] {
        assert_eq!(kind(wrong).unwrap_err(), ErrorKind::UnknownArgument, "{wrong}");
    }
}

flag_group! {
    /// Flags that do not exist.
    pub struct MadeUpArgs {
        /// A file.
        #[arg(long)]
        pub blueprint: Option<PathBuf>,
        /// Several of them.
        #[arg(long)]
        pub photos: Vec<PathBuf> [Shared],
        /// A name or a file.
        #[arg(long)]
        pub gripper: Option<super::model::ModelChoice>,
        /// A device.
        #[arg(long)]
        pub camera: Option<PathBuf> [Device],
        /// No file.
        #[arg(long)]
        pub colours: Vec<String> [Process],
        /// No file, either.
        #[arg(long)]
        pub recipes: Vec<String> [Semicolons],
    }
}

/// What its definition says of a made-up flag is all there is to say: no other place knows its name.
#[test]
fn a_flag_says_beside_its_definition_what_it_is() {
    let mut args = MadeUpArgs::default();
    let flag = |key: &str| args.flags().iter().find(|flag| flag.key() == key).unwrap();
    let split = |key: &str, value: &str| flag(key).split(value.as_ref());
    let paths = std::env::join_paths(["a,1.png", "/b.png"]).unwrap();
    let photos = split("photos", paths.to_str().unwrap());
    assert_eq!(photos, ["a,1.png", "/b.png"]);
    assert_eq!(split("colours", "red,blue"), ["red", "blue"]);
    assert_eq!(split("recipes", "a,1;b,2"), ["a,1", "b,2"]);
    assert_eq!(split("blueprint", "a,1;b,2"), ["a,1;b,2"]);
    assert!(flag("photos").is(Mark::Shared) && !flag("photos").is(Mark::Process));
    assert!(flag("colours").is(Mark::Process) && !flag("colours").is(Mark::Shared));

    let words = [
        "--blueprint=plan.dxf",
        "--photos=a,1.png",
        "--photos=/b.png",
        "--gripper=own.toml",
        "--camera=COM3",
        "--colours=red",
        "--recipes=a",
    ];
    flag_group::read(&words.map(Into::into), [&mut args]).unwrap();
    args.resolve(Path::new("/cell/ts3100.toml"));
    let found = args
        .paths()
        .into_iter()
        .map(|(flag, path)| format!("{}={}", flag.key(), path.display()));
    let files = [
        "blueprint=/cell/plan.dxf",
        "photos=/cell/a,1.png",
        "photos=/b.png",
        "gripper=/cell/own.toml",
        "camera=COM3",
    ];
    assert_eq!(found.collect::<Vec<_>>(), files);
    assert_eq!(
        (args.colours, args.recipes),
        (vec!["red".to_owned()], vec!["a".to_owned()])
    );
    let below = MadeUpArgs {
        gripper: Some("scara-600".parse().unwrap()),
        camera: Some("COM4".into()),
        ..MadeUpArgs::default()
    };
    let mut merged = MadeUpArgs::default().or_below(below);
    let found = merged.paths();
    assert_eq!(found.len(), 1, "a name of a model is not a file");
    assert_eq!(found[0].1, Path::new("COM4"));
}

#[test]
fn every_file_that_the_configuration_names_is_relative_to_it() {
    let directory = TempDir::new("relative");
    // A value of each kind of file.
    let file = |key: &str| match key {
        "model" => "own.toml",
        "transcript" => "a.txt",
        _ => "a",
    };
    let is_text = |key: &super::schema::Key| {
        use super::schema::Kind;
        matches!(key.kind, Kind::Text | Kind::TextOrNumber)
    };
    let mut resolved = Vec::new();
    for key in super::schema::keys().iter().filter(|key| is_text(key)) {
        let name = key.name.as_str();
        let value = file(name);
        let path = directory.file("ts3100.toml", format!("{name} = \"{value}\"\n"));
        let Ok((mut args, _)) = read(flags(&["--config", &path]), &Environment::new()) else {
            continue;
        };
        for (flag, path) in args.paths().filter(|(flag, _)| flag.key() != "config") {
            assert_eq!(*path, directory.path().join(value), "{name}");
            resolved.push(flag.key());
        }
    }
    for key in [
        "drive",
        "load",
        "model",
        "transcript",
        "control-token-file",
        "lcov",
    ] {
        assert!(resolved.iter().any(|known| known == key), "{key}: {resolved:?}");
    }
}

#[test]
fn a_variable_of_several_paths_is_split_into_them() {
    let paths = std::env::join_paths(["a.txt", "b.txt"]).unwrap();
    let paths = paths.to_str().unwrap();
    // The others of these lists are no paths.
    let others = ["fault", "control-host", "control-frame-ancestor", "deny"];
    for key in super::schema::keys() {
        if !key.is_list || others.contains(&key.name.as_str()) {
            continue;
        }
        let (args, _) = read(flags(&[]), &environment(&[(&key.variable, paths)])).unwrap();
        let args = format!("{args:?}");
        assert!(
            args.contains("\"a.txt\"") && args.contains("\"b.txt\""),
            "{}: {args}",
            key.variable
        );
    }
}

#[test]
fn an_empty_variable_of_a_path_is_told_what_is_expected() {
    for (name, key) in [("TS3100_LOAD", "load"), ("TS3100_DRIVE", "drive")] {
        let error = error_of(&[], &[(name, "")]);
        assert_eq!(error, format!("{name}: {key}: expected a path, found ``"));
    }
}

#[test]
fn a_duration_is_inside_its_bounds_and_has_a_unit_unless_it_is_seconds() {
    let seconds = super::args::seconds("1us", "1440min");
    for (word, millis) in [
        ("0.5", 500),
        ("86400", 86_400_000),
        ("5s", 5_000),
        ("500 ms", 500),
        ("1.5 s", 1_500),
    ] {
        assert_eq!(seconds(word).ok(), Some(Duration::from_millis(millis)), "{word}");
    }
    for word in [
        "0", "1e-12", "-1", "86401", "1e300", "NaN", "inf", "x", "", "s", "5 h",
    ] {
        assert!(seconds(word).is_err(), "{word}");
    }
    let duration = super::args::duration("1us", "1440min");
    assert_eq!(duration("5s").ok(), Some(Duration::from_secs(5)));
    assert!(duration("5").is_err());
    let error = seconds("0").map_err(|error| error.to_string());
    assert_eq!(
        error,
        Err("expected a duration from 1 microsecond to 24 h, found `0`".to_owned())
    );
}

#[test]
fn an_option_of_a_file_is_told_with_its_line() {
    let dir = TempDir::new("option-line");
    let path = dir.path().join("robot.toml");
    for (text, line, reason) in [
        (
            "time = \"auto\"\n[options]\n\n\"text.stx\" = \"maybe\"\n",
            4,
            "option text.stx: expected detect or required, found `maybe`",
        ),
        (
            "[options.text]\nstx = \"maybe\"\n",
            2,
            "option text.stx: expected detect or required, found `maybe`",
        ),
        (
            "[options]\ntext.sxt = \"detect\"\n",
            2,
            "unknown option `text.sxt`; did you mean `text.stx`?",
        ),
    ] {
        std::fs::write(&path, text).unwrap();
        let error = error_of(&["--config", path.to_str().unwrap()], &[]);
        assert_eq!(
            error,
            format!("{}, line {line}: {reason}", path.display()),
            "{text}"
        );
    }
    let error = error_of(&[], &[("TS3100_SET", "reply.delay=x")]);
    assert!(error.starts_with("TS3100_SET: option reply.delay: "), "{error}");
}
