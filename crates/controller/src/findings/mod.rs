//! Findings: protocol mistakes of hosts.
//!
//! A finding never changes an answer. The rules are one table, [`RULES`]; `checks` compares what a host does with them.
//! Each violation is an [`Event::Finding`]. [`Findings`] counts them and keeps the first of each rule. Reports in the
//! formats of other tools (SARIF, JUnit) are written by the emulator.

mod checks;
pub(crate) mod finding;
mod history;
mod message;
pub mod rules;

pub use finding::Finding;
pub use history::HostHistory;
pub use message::{MAX_MESSAGE, Message};
pub use rules::{RULES, Rule, Severity};

use crate::output::Event;
use crate::prelude::*;

/// Findings kept of one rule; further ones are only counted.
pub const MAX_PER_RULE: usize = 10;
/// Most bytes of the host that a finding keeps.
pub const MAX_BYTES: usize = 64;

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
}

impl Findings {
    /// Counts an event if it is a finding; ignores other events.
    pub fn record(&mut self, event: &Event) {
        let Event::Finding(finding) = event else {
            return;
        };
        let known = self.tallies.iter().position(|(rule, _)| *rule == finding.rule);
        let index = known.unwrap_or_else(|| {
            self.tallies.push((finding.rule, Tally::default()));
            self.tallies.len() - 1
        });
        let Some((_, tally)) = self.tallies.get_mut(index) else {
            return;
        };
        tally.count = tally.count.saturating_add(1);
        if tally.first.len() < MAX_PER_RULE {
            tally.first.push(finding.clone());
        }
    }

    fn tally(&self, rule: &Rule) -> Option<&Tally> {
        let known = self.tallies.iter().find(|(known, _)| *known == rule);
        known.map(|(_, tally)| tally)
    }

    /// How often a rule was broken.
    pub fn count(&self, rule: &Rule) -> u64 {
        self.tally(rule).map_or(0, |tally| tally.count)
    }

    /// The rules that were broken, in the order of [`RULES`].
    pub fn broken(&self) -> impl Iterator<Item = (&'static Rule, &Tally)> {
        let rules = RULES.iter().copied();
        rules.filter_map(|rule| Some((rule, self.tally(rule)?)))
    }

    /// Whether no rule was broken.
    pub fn is_empty(&self) -> bool {
        self.tallies.is_empty()
    }

    /// Removes all findings, for example between two tests.
    pub fn clear(&mut self) {
        self.tallies.clear();
    }
}

#[cfg(test)]
mod tests {
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
            }));
        }
        findings.record(&Event::AlarmsReset);
        assert_eq!(findings.count(&rules::NO_CR), 25);
        let broken: Vec<_> = findings.broken().collect();
        assert_eq!(broken.len(), 1);
        assert_eq!(broken[0].1.first.len(), MAX_PER_RULE);
        assert_eq!(broken[0].1.first[9].at, Time::from_millis(9));
        findings.clear();
        assert!(findings.is_empty());
    }
}
