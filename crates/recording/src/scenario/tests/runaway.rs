//! Scenarios whose steps trigger each other endlessly, and those that only look like it.

use super::*;

#[test]
fn steps_that_bring_each_other_about_end_the_scenario_not_the_robot() {
    let text = "[[do]]\nwhen = \"servo on\"\ntimes = 0\nactions = [\"servo off\"]\n\
        [[do]]\nwhen = \"servo off\"\ntimes = 0\nactions = [\"servo on\"]\n\
        [[do]]\nwhen = \"input 9 on\"\ntimes = 0\nactions = [\"input 10 on\", \"input 9 off\"]\n";
    let mut step = Stage::new(text);
    let on = || Input::by_hand(ts3100_controller::PanelAction::InputLine { line: 9, on: true });
    step.step(Time::ZERO, on());
    assert!(step.seat.controller.signals().input(10));
    step.host("SO");
    step.until(1_000);
    let outcome = step.play.outcome(step.seat.controller.now());
    let failures: Vec<String> = outcome.failures().collect();
    assert!(
        failures.len() == 1 && failures[0].contains("trigger each other endlessly?"),
        "{failures:?}"
    );
    let progress = step.play.progress(step.seat.controller.now());
    let (state, _, reason) = entry(&progress.entries, "do");
    assert_eq!(
        (progress.state, state),
        (ScenarioState::Failed, EntryState::Failed)
    );
    assert_eq!(failures[0], reason.unwrap(), "the limit has no line");
    // No step is taken any more, not even one that had no part in it.
    step.step(Time::from_millis(1_001), on());
    step.until(2_000);
    assert!(step.seat.controller.signals().input(9));
}

#[test]
fn only_actions_at_one_time_count_as_endless() {
    let blink = "[[do]]\nwhen = \"input 9 on\"\nafter = \"1 ms\"\ntimes = 0\n\
        actions = [\"input 9 off\", \"input 9 on\"]\n";
    let start = "[[do]]\nat = \"0 s\"\nactions = [\"input 9 on\"]\n";
    for (text, commands) in [
        ("[[do]]\nat = \"5 s\"\nactions = [\"input 9 on\"]\n", 600),
        (&[blink, start].concat(), 0),
    ] {
        let mut step = Stage::new(text);
        for _ in 0..commands {
            step.host("VR");
            step.host("OK");
        }
        step.until(4_000);
        let outcome = step.play.outcome(step.seat.controller.now());
        assert!(!outcome.has_failed(), "{text}: {outcome:?}");
        step.until(6_000);
        assert!(step.seat.controller.signals().input(9), "{text}");
    }
}
