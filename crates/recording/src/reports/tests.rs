//! Tests of what all forms of the findings have in common.

use super::*;
use ts3100_controller::findings::{Finding, MAX_PER_RULE, RULES, Rule};

/// A rule that was broken so many times.
fn broken(rule: &'static Rule, count: u64) -> Findings {
    let mut findings = Findings::default();
    for _ in 0..count {
        findings.record(&Event::Finding(Finding {
            rule,
            port: None,
            at: Time::ZERO,
            bytes: Vec::new().into(),
            message: String::from("it did").into(),
            caused_by: None,
        }));
    }
    findings
}

#[test]
fn each_form_says_how_often_a_rule_was_broken_and_how_many_are_not_listed() {
    let most = MAX_PER_RULE as u64;
    for (count, more) in [(1, None), (most, None), (most + 1, Some(1)), (most + 2, Some(2))] {
        let findings = broken(RULES[0], count);
        let shown = usize::try_from(count.min(most)).unwrap();
        let sarif = sarif::document(&findings, Path::new("run"));
        let results = sarif["runs"][0]["results"].as_array().unwrap();
        let counts: Vec<_> = results
            .iter()
            .map(|result| result["properties"]["count"].as_u64())
            .collect();
        assert_eq!(counts, vec![Some(count); shown], "{sarif}");
        for fails in [true, false] {
            let xml = junit::document(&findings, |_| fails);
            assert_eq!(xml.contains(&format!("({count} times)")), fails, "{xml}");
            let rest: Vec<&str> = xml.lines().filter(|line| line.starts_with("and ")).collect();
            let expected = more.map(|more| format!("and {more} more"));
            assert_eq!(rest, expected.as_deref().into_iter().collect::<Vec<_>>(), "{xml}");
        }
    }
}
