//! Tests of the check against the programs of the repository: those written to be warned about, and all others, which are
//! not.

#![expect(clippy::disallowed_methods, reason = "tests read and bless fixtures")]

use crate::model::ArmModel;
use crate::options::{Config, Dialect, FieldBus, UnknownInput};
use scol_mini::{Diagnostic, Position, TaughtPoint};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::string::{String, ToString};
use std::vec::Vec;
use std::{format, fs, vec};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The files of a folder and of those within it that have this extension, in the order of their names.
fn files(folder: &str, extension: &str) -> Vec<PathBuf> {
    let mut folders = vec![root().join(folder)];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|known| known == extension) {
                found.push(path);
            }
        }
    }
    found.sort();
    assert!(!found.is_empty(), "{folder} has no .{extension}");
    found
}

/// The controller that a program asks for in its first lines.
fn config(source: &str) -> Config {
    let word = |key: &str| source.lines().find_map(|line| line.strip_prefix(key));
    let scara = word("' arm: ").map(|arm| match arm {
        "scara-4" => ArmModel::thl400_four_axes(),
        _ => ArmModel::thl400(),
    });
    let named = word("' model: ").map(|name| ArmModel::by_name(name).unwrap());
    let config = Config::new(Dialect::Field);
    let model = named.or(scara).unwrap_or_else(|| config.model.clone());
    Config { model, ..config }
}

fn said(remarks: &[Diagnostic]) -> Vec<String> {
    let mut list: Vec<String> = remarks.iter().map(|d| format!("{}@{}", d.code, d.line)).collect();
    list.sort();
    list
}

/// The programs of `err` whose warnings depend on the robot, each with its golden.
fn robot_programs() -> Vec<(PathBuf, String)> {
    let programs = files("fixtures/scol/err", "scol").into_iter();
    let programs = programs.filter(|path| path.file_name().unwrap().to_str().unwrap().starts_with("robot_"));
    let programs: Vec<(PathBuf, String)> = programs
        .map(|path| {
            let source = fs::read_to_string(&path).unwrap();
            let name = Path::new(path.file_name().unwrap()).with_extension("txt");
            (root().join("fixtures/golden/err").join(name), source)
        })
        .collect();
    assert!(programs.len() >= 3);
    programs
}

fn rendered(source: &str) -> String {
    let remarks = config(source).check(source).diagnostics;
    remarks.iter().map(|d| d.render(source, "TEST")).collect()
}

#[test]
fn what_the_robot_refuses_is_warned_of() {
    for (golden, source) in robot_programs() {
        let found = said(&config(&source).check(&source).diagnostics);
        let expected = source.lines().find_map(|line| line.strip_prefix("' says: "));
        let mut expected: Vec<String> = expected.unwrap().split(", ").map(ToString::to_string).collect();
        expected.sort();
        assert_eq!(found, expected, "{}", rendered(&source));
        assert_eq!(rendered(&source), fs::read_to_string(golden).unwrap());
    }
}

#[test]
#[ignore = "writes fixtures/golden/err anew; review the difference"]
fn bless_robot_err() {
    for (golden, source) in robot_programs() {
        fs::write(golden, rendered(&source)).unwrap();
    }
}

/// A line that an option adds is not warned of, with the option or without.
#[test]
fn what_an_option_allows_is_not_warned_of() {
    let source = "PROGRAM T\nDOUT(301)\nIF DIN(99) == ON THEN DOUT(1)\nEND\n";
    let mut config = Config::new(Dialect::Field);
    assert_eq!(said(&config.check(source).diagnostics), ["W0615@3"]);
    config.options.field_bus = FieldBus::Present;
    config.options.din_unknown = UnknownInput::Zero;
    assert_eq!(said(&config.check(source).diagnostics), [] as [&str; 0]);
}

/// A taught point is in no line of the file, so the motion to it is reported, once.
#[test]
fn a_taught_point_out_of_reach_is_reported_where_a_motion_leads_to_it() {
    let source = "PROGRAM T\nMOVE NEAR\nMOVES FAR\nMOVE FAR\nEND\n";
    let point = |name: &str, x: f64| TaughtPoint {
        name: name.into(),
        position: Position {
            coords: [x, 0.0, 200.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            ..Position::default()
        },
    };
    let mut config = Config::new(Dialect::Field);
    config.points = vec![point("NEAR", 400.0), point("FAR", 4000.0)];
    assert_eq!(said(&config.check(source).diagnostics), ["W0624@3"]);
    let shadowed = source.replace("MOVE NEAR", "DIM FAR AS POINT");
    assert_eq!(said(&config.check(&shadowed).diagnostics), [] as [&str; 0]);
}

/// A position whose posture is open is out of reach only when no posture reaches it.
#[test]
fn an_open_posture_is_any_posture() {
    let source = "' arm: scara\nPROGRAM T\nMOVE P\nEND\nDATA\nPOINT P=100,300,50,0\nEND\n";
    let config = config(source);
    assert_eq!(said(&config.check(source).diagnostics), [] as [&str; 0]);
}

/// The programs in a text: of a transcript the files on its drive, of a page its blocks of SCOL.
fn embedded(path: &Path, text: &str) -> Vec<String> {
    let mut programs: Vec<Vec<&str>> = Vec::new();
    let page = path.extension().is_some_and(|extension| extension == "md");
    let mut inside = false;
    for line in text.lines() {
        match (page, inside) {
            (true, false) if line == "```scol" => {
                programs.push(Vec::new());
                inside = true;
            }
            (true, true) if line == "```" => inside = false,
            (true, true) => programs.last_mut().unwrap().push(line),
            (false, _) if line.starts_with("file ") => programs.push(Vec::new()),
            (false, _) => {
                let line = line.strip_prefix("| ");
                if let (Some(line), Some(program)) = (line, programs.last_mut()) {
                    program.push(line);
                }
            }
            (true, false) => {}
        }
    }
    let programs = programs.iter().map(|lines| lines.join("\n") + "\n");
    programs.filter(|program| program.contains("PROGRAM")).collect()
}

/// The remarks that programs of the repository are meant to have: code, reason, files.
const INTENDED: &[(&str, &str, &[&str])] = &[
    (
        "E0202",
        "a file that SL refuses",
        &["fixtures/transcripts/sl.txt"],
    ),
    (
        "W0601",
        "prints while the arm moves",
        &[
            "fixtures/scol/run/accur.scol",
            "fixtures/scol/run/monitor_goto_pass.scol",
            "fixtures/scol/run/motion_state.scol",
            "fixtures/scol/run/nowait.scol",
            "fixtures/scol/run/nowait_pass.scol",
            "fixtures/scol/run/pass.scol",
            "fixtures/scol/run/pass_hold.scol",
            "fixtures/scol/run/with.scol",
            "fixtures/scol/run/with_frames.scol",
        ],
    ),
    (
        "W0602",
        "INPUT gives the variable its type, as in the manual",
        &[
            "fixtures/scol/ok/direct_position.scol",
            "fixtures/scol/run/dialogue.scol",
            "fixtures/transcripts/seq-restart.txt",
        ],
    ),
    (
        "W0603",
        "what is jumped over must not run",
        &[
            "fixtures/scol/run/calls.scol",
            "fixtures/scol/run/comments.scol",
            "fixtures/scol/run/goto.scol",
            "fixtures/scol/run/return_main.scol",
        ],
    ),
    ("W0604", "as in the manual", &["fixtures/scol/ok/select.scol"]),
    (
        "W0605",
        "the assignment is what alarms or is watched",
        &[
            "fixtures/scol/run/domain.scol",
            "fixtures/scol/run/monitor_call.scol",
            "fixtures/scol/run/quarter_turns.scol",
            "fixtures/scol/run/retry_moved.scol",
            "fixtures/scol/run/undefined.scol",
        ],
    ),
    (
        "W0606",
        "the point is for statements of DO and for hosts, or shows a form of DATA",
        &[
            "docs/reference/scol/data.md",
            "fixtures/scol/run/accur.scol",
            "fixtures/scol/run/break.scol",
            "fixtures/scol/run/break_other_task.scol",
            "fixtures/scol/run/conditions.scol",
            "fixtures/scol/run/delay.scol",
            "fixtures/scol/run/monitor_break.scol",
            "fixtures/scol/run/motion_state.scol",
            "fixtures/scol/run/move.scol",
            "fixtures/scol/run/moves.scol",
            "fixtures/scol/run/nowait.scol",
            "fixtures/scol/run/nowait_delay.scol",
            "fixtures/scol/run/override.scol",
            "fixtures/scol/run/pause.scol",
            "fixtures/scol/run/pause_hold.scol",
            "fixtures/scol/run/pause_start.scol",
            "fixtures/scol/run/ready.scol",
            "fixtures/scol/run/segment.scol",
            "fixtures/scol/run/task_dialogue.scol",
            "fixtures/scol/run/task_owner.scol",
            "fixtures/scol/run/timer.scol",
            "fixtures/scol/run/wait.scol",
            "fixtures/scol/run/with.scol",
            "fixtures/transcripts/mr.txt",
        ],
    ),
    (
        "W0607",
        "a host reads or writes the variable",
        &[
            "docs/reference/scol/structure.md",
            "fixtures/scol/ok/workfile.scol",
            "fixtures/transcripts/broken-off.txt",
            "fixtures/transcripts/do.txt",
            "fixtures/transcripts/mr.txt",
            "fixtures/transcripts/mw.txt",
            "fixtures/transcripts/sl.txt",
        ],
    ),
    (
        "W0610",
        "a real that becomes an integer is what it shows",
        &["fixtures/scol/run/arithmetic.scol"],
    ),
    (
        "W0612",
        "a division of integers is what it shows",
        &["fixtures/scol/run/operators.scol"],
    ),
    (
        "W0613",
        "the alarm is what it shows",
        &["fixtures/scol/run/operators.scol"],
    ),
    (
        "W0614",
        "the alarm is what it shows",
        &["fixtures/scol/run/conditions.scol"],
    ),
    (
        "W0615",
        "the alarm is what it shows",
        &[
            "fixtures/scol/run/dout.scol",
            "fixtures/scol/run/monitor_wrong.scol",
            "fixtures/scol/run/pulse.scol",
        ],
    ),
    (
        "W0616",
        "the alarm is what it shows",
        &["fixtures/scol/run/gain.scol"],
    ),
    (
        "W0617",
        "the alarm is what it shows",
        &[
            "fixtures/scol/run/domain.scol",
            "fixtures/scol/run/functions.scol",
            "fixtures/scol/run/quarter_turns.scol",
        ],
    ),
    (
        "W0619",
        "the alarm is what it shows",
        &["fixtures/scol/run/bcd.scol"],
    ),
    (
        "W0621",
        "the alarm is what it shows",
        &["fixtures/scol/run/domain.scol"],
    ),
    (
        "W0622",
        "the alarm is what it shows",
        &["fixtures/scol/run/variables.scol"],
    ),
    (
        "W0624",
        "the alarm is what it shows",
        &[
            "fixtures/scol/run/scara_four_axes.scol",
            "fixtures/scol/run/unreachable.scol",
        ],
    ),
];

/// Programs that are not about warnings get none but the intended ones.
#[test]
fn no_program_of_the_repository_is_warned_of_without_a_reason() {
    let mut programs = Vec::new();
    for folder in ["fixtures/scol/ok", "fixtures/scol/run"] {
        for path in files(folder, "scol") {
            let source = fs::read_to_string(&path).unwrap();
            programs.push((path, source));
        }
    }
    for path in files("fixtures/transcripts", "txt")
        .into_iter()
        .chain(files("docs", "md"))
    {
        let text = fs::read_to_string(&path).unwrap();
        // This page shows what is warned of.
        if path.ends_with("docs/reference/diagnostics.md") {
            continue;
        }
        programs.extend(
            embedded(&path, &text)
                .into_iter()
                .map(|source| (path.clone(), source)),
        );
    }
    assert!(programs.len() > 150, "{} programs", programs.len());
    let (mut unexpected, mut met) = (Vec::new(), BTreeSet::new());
    for (path, source) in programs {
        let name = path.strip_prefix(root()).unwrap().to_str().unwrap().to_string();
        for remark in config(&source).check(&source).diagnostics {
            let mut rows = INTENDED.iter();
            let known = rows.any(|(code, _, files)| *code == remark.code && files.contains(&name.as_str()));
            if known {
                met.insert((remark.code, name.clone()));
            } else {
                unexpected.push(remark.render(&source, &name));
            }
        }
    }
    assert!(
        unexpected.is_empty(),
        "{} remarks:\n{}",
        unexpected.len(),
        unexpected.concat()
    );
    let intended = INTENDED.iter();
    let intended =
        intended.flat_map(|(code, _, files)| files.iter().map(|file| (*code, (*file).to_string())));
    assert_eq!(met, intended.collect(), "not met any more");
}

/// The blocks of the page of diagnostics bring about the code that they name, and no other.
#[test]
fn the_page_of_diagnostics_shows_what_it_says() {
    let page = fs::read_to_string(root().join("docs/reference/diagnostics.md")).unwrap();
    let mut shown = BTreeSet::new();
    for part in page.split("<!-- ci:check ").skip(1) {
        let (code, rest) = part.split_once(" -->\n```scol\n").unwrap();
        let (source, _) = rest.split_once("```").unwrap();
        let remarks = config(source).check(source).diagnostics;
        let found: BTreeSet<&str> = remarks.iter().map(|d| d.code).collect();
        assert_eq!(found, BTreeSet::from([code]), "{source}\n{}", rendered(source));
        shown.insert(code.to_string());
    }
    assert!(shown.len() >= 50, "{} codes", shown.len());
}
