//! `ts3100 run --trace` and `--profile` over every program of `fixtures/scol/run`: looking changes nothing, and no time is lost.
//!
//! What a statement tells is tested in `scol-mini`, and how it is shown in `binary/headless`. The programs are those of
//! `programs`, without what happens outside.

use crate::programs::programs;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;
use ts3100_controller::model::ArmModel;
use ts3100_controller::{Config, Dialect};
use ts3100_driver::clock::TimeMode;
use ts3100_driver::pc_file::drive_content;
use ts3100_emulator::headless::{self, RunEvent, RunReport, RunRequest};

/// A run with records for every INPUT, or why it did not start; and what it printed.
fn run(source: &str, looks: bool) -> (Result<RunReport, String>, Vec<(Duration, String)>) {
    let mut config = Config::new(Dialect::Field);
    if source.contains("' arm: scara-4") {
        config.model = ArmModel::thl400_four_axes();
    } else if source.contains("' arm: scara") {
        config.model = ArmModel::thl400();
    }
    let records = |channel: &str| {
        let records = (1..9).map(|number| format!("{number},{number}.5").into_bytes());
        (channel.to_owned(), records.collect::<VecDeque<_>>())
    };
    let request = RunRequest {
        source: drive_content(source.as_bytes(), config.options.line_end),
        config,
        name: "P".to_owned(),
        records: BTreeMap::from(["TP", "COM1", "IP1", "IP2"].map(records)),
        lines_on: Vec::new(),
        position: None,
        scenario: None,
        call: None,
        trace: looks,
        profile: looks,
        record_lines: false,
        time: TimeMode::Auto,
        max_time: Duration::from_secs(30),
    };
    let mut printed = Vec::new();
    let report = headless::run(request, &mut |at, event| {
        if let RunEvent::Printed { channel, bytes } = event {
            printed.push((at, format!("{channel} {}", String::from_utf8_lossy(bytes))));
        }
    });
    (report.map_err(|error| error.to_string()), printed)
}

#[test]
fn looking_changes_nothing_and_no_time_is_lost() {
    let mut counted = 0;
    for (path, source) in programs() {
        let (seen, seen_printed) = run(&source, true);
        let (unseen, unseen_printed) = run(&source, false);
        let (seen, unseen) = match (seen, unseen) {
            (Ok(seen), Ok(unseen)) => (seen, unseen),
            (seen, unseen) => {
                assert_eq!(seen.err(), unseen.err(), "{}", path.display());
                continue;
            }
        };
        let facts = |report: &RunReport| {
            let arm = report.arm.joint_values();
            (report.end.clone(), report.duration, report.outputs.clone(), arm)
        };
        assert_eq!(facts(&seen), facts(&unseen), "{}", path.display());
        assert_eq!(seen_printed, unseen_printed, "{}", path.display());
        let profile = seen.profile.unwrap();
        let main = profile.tasks().into_iter().find(|task| task.task == 1).unwrap();
        let sum: Duration = main.statements.iter().map(|(_, spent)| spent.time).sum();
        assert_eq!(sum, main.time, "{}", path.display());
        assert_eq!(sum + profile.stopped, seen.duration, "{}", path.display());
        counted += usize::from(!seen.duration.is_zero());
    }
    assert!(counted > 40, "{counted}");
}
