//! A defect planted against each rule is found. That no plan breaks one is tested in `tests/suites/simulation.rs`, with the clauses.

use super::*;
use std::time::Duration;
use ts3100_recording::transcript::Recording;

/// The first failure of some plans with a planted defect.
fn first_failure(canary: Option<Rule>) -> Option<Failure> {
    let mut figures = Figures::default();
    (0..80).find_map(|seed| simulate(seed, canary, &mut figures).err().map(|failure| *failure))
}

#[test]
fn a_snapshot_after_each_step_changes_no_byte() {
    for seed in 100..104 {
        let Plan { robots, mut steps } = Plan::draw(seed, STEPS_OF_PLAN);
        // The state that is kept, and when a slow disk answers, depend on snapshots.
        steps.retain(|step| !matches!(step, Step::Restore { .. } | Step::Disk { .. }));
        // The outputs of a controller at its start are taken before its first snapshot.
        steps.insert(0, Step::Pass(Duration::from_millis(1)));
        let snapshots = || (0..robots.len()).map(|robot| Step::Snapshot { robot });
        let with_snapshots: Vec<Step> = { &steps }
            .iter()
            .flat_map(|step| std::iter::once(step.clone()).chain(snapshots()))
            .collect();
        let digest = |steps: Vec<Step>| {
            let plan = Plan {
                robots: robots.clone(),
                steps,
            };
            let mut cell = Cell::new(&plan, None);
            cell.run(&plan.steps).unwrap();
            cell.digest()
        };
        assert_eq!(digest(with_snapshots), digest(steps.clone()), "seed {seed}");
    }
}

#[test]
fn figures_count_what_was_carried_out() {
    let plan = Plan::draw(100, STEPS_OF_PLAN);
    let mut cell = Cell::new(&plan, None);
    cell.run(&plan.steps).unwrap();
    let is_snapshot = |step: &&Step| matches!(step, Step::Snapshot { .. });
    let snapshots = plan.steps.iter().filter(is_snapshot).count();
    assert!(snapshots > 1, "{snapshots}");
    let figures = cell.figures();
    let counted = [figures.steps, figures.snapshots];
    assert_eq!(counted, [plan.steps.len(), snapshots].map(|count| count as u64));
}

#[test]
fn a_defect_planted_against_each_rule_is_found() {
    for (rule, name, ..) in Rule::ALL {
        let failure = first_failure(Some(rule));
        let found = failure.map(|failure| failure.violation.rule);
        assert_eq!(found, Some(rule), "{name}");
    }
}

#[test]
fn a_failure_is_shrunk_and_recorded() {
    let rule = Some(Rule::AlarmsLatch);
    let failure = shrunk(first_failure(rule).unwrap(), rule);
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
