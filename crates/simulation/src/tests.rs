//! No plan breaks a rule, and a defect planted against each rule is found.

use super::*;
use ts3100_recording::transcript::Recording;

const SEEDS: std::ops::Range<u64> = 0..40;

fn of_seeds(seeds: std::ops::Range<u64>, canary: Option<Rule>) -> (Figures, Option<Failure>) {
    let mut figures = Figures::default();
    for seed in seeds {
        if let Err(failure) = simulate(seed, canary, &mut figures) {
            return (figures, Some(*failure));
        }
    }
    (figures, None)
}

#[test]
fn whatever_happens_the_rules_hold() {
    let (figures, failure) = of_seeds(SEEDS, None);
    let failure = failure.map(|failure| shrunk(failure, None));
    if let Some(failure) = failure {
        panic!("{failure}");
    }
    println!("{figures:#?}");
    for (rule, name, ..) in Rule::ALL {
        assert!(
            figures.checks.contains_key(&rule) || rule == Rule::SameBytes,
            "{name}"
        );
    }
}

#[test]
fn a_defect_planted_against_each_rule_is_found() {
    for (rule, name, ..) in Rule::ALL {
        let (_, failure) = of_seeds(0..80, Some(rule));
        let found = failure.map(|failure| failure.violation.rule);
        assert_eq!(found, Some(rule), "{name}");
    }
}

#[test]
fn a_failure_is_shrunk_and_recorded() {
    let rule = Some(Rule::AlarmsLatch);
    let (_, failure) = of_seeds(0..80, rule);
    let failure = shrunk(failure.unwrap(), rule);
    assert!(failure.plan.steps.len() < 20, "{failure}");
    let folder = std::env::temp_dir().join(format!("ts3100-simulation-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("failure.txt");
    recorded(&failure, &path, rule).unwrap();
    let recording = Recording::read(&path).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(!recording.records.is_empty());
    assert!(
        recording
            .header
            .flags
            .iter()
            .any(|flag| flag.starts_with("model="))
    );
}
