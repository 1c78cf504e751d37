//! Replays the corpus of the fuzz targets: what fuzzing has reached so far holds without libFuzzer, too.
//!
//! The bodies of the targets are those of `fuzz/src`, which is no part of this workspace; `fuzz/README.md` lists what must
//! hold. The planted defect of `canary` has to be found here, and by each run of `fuzz/run`.

use super::house::root;
use std::fs;
use std::panic::catch_unwind;
use std::path::PathBuf;

#[allow(
    clippy::wildcard_enum_match_arm,
    clippy::disallowed_methods,
    reason = "sources of another workspace, which has its own rules"
)]
#[path = "../../fuzz/src/lib.rs"]
mod targets;

/// Most bytes of the whole corpus, and most inputs of a target: a sample is committed.
const MAX_CORPUS: u64 = 400_000;
const MAX_INPUTS: usize = 120;

/// A target: what it does with an input.
type Target = fn(&[u8]);

/// Every target but `canary`, whose defect is planted.
const TARGETS: [(&str, Target); 14] = [
    ("cell", targets::cell::check),
    ("control", targets::control::check),
    ("dap", targets::dap::check),
    ("front", targets::front::check),
    ("lsp", targets::lsp::check),
    ("parameters", targets::parameters::check),
    ("program_test", targets::program_test::check),
    ("protocol", targets::protocol::check),
    ("recording", targets::recording::check),
    ("rfc2217", targets::rfc2217::check),
    ("run", targets::run::check),
    ("snapshot", targets::snapshot::check),
    ("survey", targets::survey::check),
    ("trace", targets::trace::check),
];

/// The committed inputs of a target.
fn inputs(target: &str) -> Vec<PathBuf> {
    let folder = root().join("fuzz/corpus").join(target);
    let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut inputs: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    inputs.sort();
    inputs
}

fn replay(target: &str) {
    let (_, check) = TARGETS.iter().find(|(name, _)| *name == target).unwrap();
    for input in inputs(target) {
        let bytes = fs::read(&input).unwrap();
        // The message of the panic is on stderr; this adds the file.
        catch_unwind(|| check(&bytes)).unwrap_or_else(|_| panic!("{}", input.display()));
    }
}

/// A test for each target, so that they run side by side.
macro_rules! replays {
    ($($test:ident: $target:literal;)*) => {
        $(
            #[test]
            fn $test() {
                replay($target);
            }
        )*
    };
}

replays! {
    the_corpus_of_cell_holds: "cell";
    the_corpus_of_control_holds: "control";
    the_corpus_of_dap_holds: "dap";
    the_corpus_of_front_holds: "front";
    the_corpus_of_lsp_holds: "lsp";
    the_corpus_of_parameters_holds: "parameters";
    the_corpus_of_program_test_holds: "program_test";
    the_corpus_of_protocol_holds: "protocol";
    the_corpus_of_recording_holds: "recording";
    the_corpus_of_rfc2217_holds: "rfc2217";
    the_corpus_of_run_holds: "run";
    the_corpus_of_snapshot_holds: "snapshot";
    the_corpus_of_survey_holds: "survey";
    the_corpus_of_trace_holds: "trace";
}

#[test]
fn the_planted_defect_is_one() {
    targets::canary::check(b"WD,9999 8");
    let found = catch_unwind(|| targets::canary::check(b"WD,10000 8"));
    assert!(found.is_err());
}

#[test]
fn the_corpus_is_small_and_every_target_has_one() {
    let mut bytes = 0;
    for (target, _) in TARGETS {
        let inputs = inputs(target);
        assert!(
            (1..=MAX_INPUTS).contains(&inputs.len()),
            "{target}: {}",
            inputs.len()
        );
        bytes += inputs
            .iter()
            .map(|input| input.metadata().unwrap().len())
            .sum::<u64>();
    }
    assert!(bytes <= MAX_CORPUS, "{bytes} bytes");
}

#[test]
fn every_target_is_listed_everywhere() {
    let text = |path: &str| fs::read_to_string(root().join(path)).unwrap();
    let (manifest, readme, run) = (text("fuzz/Cargo.toml"), text("fuzz/README.md"), text("fuzz/run"));
    let targets = TARGETS.iter().map(|(target, _)| *target).chain(["canary"]);
    for target in targets.clone() {
        assert!(manifest.contains(&format!("name = \"{target}\"")), "{target}");
        assert!(readme.contains(&format!("| `{target}` |")), "{target}");
        assert!(
            run.split([' ', '(', ')', '\n']).any(|word| word == target),
            "{target}"
        );
    }
    assert_eq!(manifest.matches("[[bin]]").count(), targets.count());
}
