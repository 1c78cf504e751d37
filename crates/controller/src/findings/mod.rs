//! Findings: protocol mistakes of hosts.
//!
//! A finding never changes an answer. The rules are one table, [`RULES`]; `checks` compares what a host does with them.
//! Each violation is an [`Event::Finding`]. [`Findings`] counts them and keeps the first of each rule. Reports in the
//! formats of other tools (SARIF, JUnit) are written by the emulator.

mod checks;
mod history;
pub(crate) mod message;
pub mod rules;

pub use history::HostHistory;
pub use message::{MAX_MESSAGE, Message};
pub use rules::RULES;

use crate::output::Event;
use crate::port::Port;
use crate::time::Time;
use alloc::collections::BTreeMap;
use alloc::vec::Vec;
use bytes::Bytes;

/// Findings kept of one rule; further ones are only counted.
pub const MAX_PER_RULE: usize = 10;
/// Most bytes of the host that a finding keeps.
pub const MAX_BYTES: usize = 64;

/// How serious the violation of a rule is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// It worked here; another controller, or a strict reading of the manual, may reject it.
    Note,
    /// The manual advises against it, or the robot answered NG for a reason the host could have known.
    Warning,
    /// Data was lost, a text or command was invalid, or an exchange was abandoned.
    Error,
}

impl Severity {
    /// All severities, the mildest first.
    pub const ALL: [Severity; 3] = [Severity::Note, Severity::Warning, Severity::Error];

    /// `note`, `warning` or `error`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        }
    }
}

/// A rule that a host can break.
#[derive(Debug, PartialEq, Eq)]
pub struct Rule {
    /// Name; stays the same from release to release.
    pub id: &'static str,
    /// How serious a violation is.
    pub severity: Severity,
    /// Section of the manual, and in brackets the clauses (docs/clauses.tsv) and decisions.
    pub source: &'static str,
    /// The violation, in one line.
    pub title: &'static str,
    /// What to change in the host, in one or two sentences.
    pub remedy: &'static str,
    /// Whether it measures the host's pace in virtual time. Such a rule means nothing if virtual time does not
    /// follow the wall clock.
    pub timed: bool,
}

impl Rule {
    /// The rule of this name.
    pub fn by_id(id: &str) -> Option<&'static Rule> {
        RULES.iter().copied().find(|rule| rule.id == id)
    }
}

/// One violation of a rule.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// The rule that was broken.
    pub rule: &'static Rule,
    /// The port it concerns; `None` for the panel and the digital lines.
    pub port: Option<Port>,
    /// When, in virtual time.
    pub at: Time,
    /// The bytes concerned, at most [`MAX_BYTES`]; may be empty.
    pub bytes: Bytes,
    /// What happened, with values, in one line.
    pub message: Message,
}

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
    tallies: BTreeMap<&'static str, Tally>,
}

impl Findings {
    /// Counts an event if it is a finding; ignores other events.
    pub fn record(&mut self, event: &Event) {
        let Event::Finding {
            rule,
            port,
            at,
            bytes,
            message,
        } = event
        else {
            return;
        };
        let tally = self.tallies.entry(rule).or_default();
        tally.count = tally.count.saturating_add(1);
        if tally.first.len() < MAX_PER_RULE
            && let Some(rule) = Rule::by_id(rule)
        {
            tally.first.push(Finding {
                rule,
                port: *port,
                at: *at,
                bytes: bytes.clone(),
                message: message.clone(),
            });
        }
    }

    /// How often a rule was broken.
    pub fn count(&self, rule: &Rule) -> u64 {
        self.tallies.get(rule.id).map_or(0, |tally| tally.count)
    }

    /// The rules that were broken, in the order of [`RULES`].
    pub fn broken(&self) -> impl Iterator<Item = (&'static Rule, &Tally)> {
        let rules = RULES.iter().copied();
        rules.filter_map(|rule| Some((rule, self.tallies.get(rule.id)?)))
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
    use alloc::collections::BTreeSet;

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
            findings.record(&Event::Finding {
                rule: rules::NO_CR.id,
                port: Some(Port::Ip0),
                at: Time::from_millis(at),
                bytes: Bytes::from_static(b"SU"),
                message: "".into(),
            });
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
