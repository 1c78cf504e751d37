//! The findings of a run, counted by rule, in bounded memory. Reports in the formats of other tools (SARIF, JUnit) are
//! written by the emulator.

pub use crate::finding::{
    FaultCause, Finding, HostHistory, MAX_BYTES, MAX_MESSAGE, Message, RULES, Rule, Severity, rules,
};

use crate::output::Event;
use crate::prelude::*;

/// Findings kept of one rule; further ones are only counted.
pub const MAX_PER_RULE: usize = 10;
/// The violations of one rule.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Tally {
    /// How often it was broken.
    pub count: u64,
    /// The first [`MAX_PER_RULE`] violations.
    pub first: Vec<Finding>,
}

/// The findings of a run, in bounded memory.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Findings {
    /// Few, in the order in which they were broken first.
    tallies: Vec<(&'static Rule, Tally)>,
    /// The same of findings that faults have caused.
    caused: Vec<(&'static Rule, Tally)>,
}

impl Findings {
    /// Counts an event if it is a finding; ignores other events.
    pub fn record(&mut self, event: &Event) {
        let Event::Finding(finding) = event else {
            return;
        };
        let tallies = match finding.caused_by {
            Some(_) => &mut self.caused,
            None => &mut self.tallies,
        };
        let known = tallies.iter().position(|(rule, _)| *rule == finding.rule);
        let index = known.unwrap_or_else(|| {
            tallies.push((finding.rule, Tally::default()));
            tallies.len() - 1
        });
        let Some((_, tally)) = tallies.get_mut(index) else {
            return;
        };
        tally.count = tally.count.saturating_add(1);
        if tally.first.len() < MAX_PER_RULE {
            tally.first.push(finding.clone());
        }
    }

    /// How often a host broke a rule.
    pub fn count(&self, rule: &Rule) -> u64 {
        tally(&self.tallies, rule).map_or(0, |tally| tally.count)
    }

    /// The rules that a host broke, in the order of [`RULES`].
    pub fn broken(&self) -> impl Iterator<Item = (&'static Rule, &Tally)> {
        in_order(&self.tallies)
    }

    /// The findings that faults have caused, in the order of [`RULES`]. They say nothing of the host.
    pub fn caused(&self) -> impl Iterator<Item = (&'static Rule, &Tally)> {
        in_order(&self.caused)
    }

    /// Whether no host broke a rule.
    pub fn is_empty(&self) -> bool {
        self.tallies.is_empty()
    }

    /// Removes all findings, for example between two tests.
    pub fn clear(&mut self) {
        self.tallies.clear();
        self.caused.clear();
    }
}

fn tally<'a>(tallies: &'a [(&'static Rule, Tally)], rule: &Rule) -> Option<&'a Tally> {
    let known = tallies.iter().find(|(known, _)| *known == rule);
    known.map(|(_, tally)| tally)
}

fn in_order<'a>(tallies: &'a [(&'static Rule, Tally)]) -> impl Iterator<Item = (&'static Rule, &'a Tally)> {
    let rules = RULES.iter().copied();
    rules.filter_map(|rule| Some((rule, tally(tallies, rule)?)))
}

#[cfg(test)]
mod tests {
    use super::FaultCause;
    use super::*;
    use crate::port::Port;
    use crate::time::Time;
    use alloc::collections::BTreeSet;
    use bytes::Bytes;

    #[test]
    fn every_rule_has_a_name_of_its_own_and_says_what_to_do() {
        let names: BTreeSet<&str> = RULES.iter().map(|rule| rule.id).collect();
        assert_eq!(names.len(), RULES.len());
        for rule in RULES {
            let formed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
            assert!(rule.id.chars().all(formed), "{}", rule.id);
            for text in [rule.source, rule.title, rule.remedy] {
                assert!(text.len() >= 8 && !text.contains('|'), "{}: {text}", rule.id);
            }
            assert!(rule.source.contains('['), "{}: {}", rule.id, rule.source);
        }
    }

    #[test]
    fn the_first_of_a_rule_are_kept_and_all_are_counted() {
        let mut findings = Findings::default();
        for at in 0..25 {
            findings.record(&Event::Finding(Finding {
                rule: &rules::NO_CR,
                port: Some(Port::Ip0),
                at: Time::from_millis(at),
                bytes: Bytes::from_static(b"SU"),
                message: "".into(),
                caused_by: None,
            }));
        }
        findings.record(&Event::Finding(Finding {
            rule: &rules::BAD_CHECKSUM,
            port: Some(Port::Ip0),
            at: Time::ZERO,
            bytes: Bytes::new(),
            message: "".into(),
            caused_by: Some(FaultCause { id: 1, kind: "ng" }),
        }));
        findings.record(&Event::AlarmsReset);
        assert_eq!(findings.count(&rules::NO_CR), 25);
        let broken: Vec<_> = findings.broken().collect();
        assert_eq!(broken.len(), 1);
        let caused: Vec<_> = findings
            .caused()
            .map(|(rule, tally)| (rule.id, tally.count))
            .collect();
        assert_eq!(caused, [("bad-checksum", 1)]);
        assert_eq!(findings.count(&rules::BAD_CHECKSUM), 0);
        assert_eq!(broken[0].1.first.len(), MAX_PER_RULE);
        assert_eq!(broken[0].1.first[9].at, Time::from_millis(9));
        findings.clear();
        assert_eq!((findings.is_empty(), findings.caused().count()), (true, 0));
    }
}
