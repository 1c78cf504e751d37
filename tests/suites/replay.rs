//! A recorded run at any moment: a moment that is sought directly, played forward to, or sought after later ones is the same,
//! in every transcript of `fixtures/transcripts` and in seeded runs. How a recording is compared with what it gives is
//! tested in `ts3100-recording`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use ts3100_driver::snapshot::to_json_line;
use ts3100_emulator::recorded::candidate;
use ts3100_recording::replay::{MAX_KEYFRAMES, Moment, Playback};
use ts3100_recording::transcript::Recording;
use ts3100_simulation::{Plan, STEPS_OF_PLAN, record};
use ts3100_tests::testing::TempDir;
use ts3100_view::key::MomentKey;
use ts3100_view::run::Run;

/// Moments of one run that are compared, spread over it.
const MOMENTS: usize = 12;
const SEEDS: std::ops::Range<u64> = 500..505;

/// The moments of some events of a run, and some between two events.
fn moments(run: &Run) -> Vec<Moment> {
    let events = run.events();
    let step = events.len().div_ceil(MOMENTS).max(1);
    let mut found = vec![Moment {
        records: 0,
        at: ts3100_controller::Time::ZERO,
    }];
    for event in events.iter().step_by(step) {
        for later in [0, 1, 40_000, 1_500_000] {
            let at = ts3100_controller::Time::from_micros(event.t.as_micros() + later);
            let key = MomentKey {
                event: Some(event.seq),
                at: Some(at),
            };
            found.push(run.moment(key).unwrap());
        }
    }
    found.push(run.end());
    found.sort();
    found.dedup();
    found
}

/// Opens a recording and compares the three ways to a moment; returns how many were compared.
fn check(path: &Path) -> usize {
    let name = path.display();
    let recording = Recording::read(path).unwrap();
    let emulator = candidate(&recording.header).unwrap();
    let mut forward = Playback::new(Arc::new(recording.clone()), emulator.clone());
    let (run, opening) = Run::open("", recording, emulator);
    opening.finish();
    if !name.to_string().contains("fixtures") {
        assert_eq!(run.departure(), None, "{name}");
    }
    let moments = moments(&run);
    let played: Vec<String> = moments
        .iter()
        .map(|moment| {
            forward.play_to(*moment);
            to_json_line(forward.controller())
        })
        .collect();
    // Backwards, so that each is before the one that was sought last.
    for (moment, played) in moments.iter().zip(&played).rev() {
        let (sought, _) = run.seek(*moment).unwrap();
        assert_eq!(&to_json_line(sought.controller()), played, "{name}: {moment:?}");
    }
    assert!(run.most_steps() <= run.keyframe_interval(), "{name}");
    moments.len()
}

#[test]
fn a_moment_of_a_transcript_is_the_same_however_it_is_reached() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../fixtures/transcripts");
    let paths = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let paths = paths.filter(|path| path.extension().is_some_and(|ending| ending == "txt"));
    let mut compared = 0;
    for path in paths {
        // Some have notes that only a transcript written by hand has.
        if Recording::read(&path).is_ok() {
            compared += check(&path);
        }
    }
    assert!(compared > 200, "{compared} moments");
}

#[test]
fn a_moment_of_a_seeded_run_is_the_same_however_it_is_reached() {
    let folder = TempDir::new("replay");
    let mut compared = 0;
    for seed in SEEDS {
        let plan = Plan::draw(seed, STEPS_OF_PLAN);
        for robot in 0..plan.robots.len() {
            let path = folder.at(&format!("{seed}-{robot}.txt"));
            record(&plan, robot, &path, None).unwrap();
            compared += check(&path);
        }
    }
    assert!(compared > 200, "{compared} moments");
}

#[test]
fn the_copies_of_a_long_run_stay_bounded_and_near() {
    let mut text = String::from("origin: written by hand, ours\n! connect IP0\n");
    for _ in 0..12_000 {
        text += "@+10ms\n> IP0 SU<CR>\n";
    }
    let recording = ts3100_recording::transcript::text::read(&text).unwrap();
    let emulator = candidate(&recording.header).unwrap();
    let (run, opening) = Run::open("", recording, emulator);
    opening.finish();
    let steps = 24_000;
    assert!(run.keyframe_interval() <= 4 * steps / MAX_KEYFRAMES as u64);
    for at in [1, 7_777_777, 60_000_000, 119_999_999] {
        let key = MomentKey {
            event: None,
            at: Some(ts3100_controller::Time::from_micros(at)),
        };
        run.seek(run.moment(key).unwrap()).unwrap();
    }
    assert!(run.most_steps() <= run.keyframe_interval());
}
