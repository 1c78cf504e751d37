//! Findings: what a host did that the manual advises against, or that was forgiven (decision D1). A finding never
//! changes an answer. The rules are one table, [`RULES`]; each break of one is an
//! [`Event::Finding`], and [`Findings`] counts them and keeps the first of each.
//! Reports in the formats of other tools are the edge's.

mod checks;
pub mod rules;

pub use checks::HostHistory;
pub use rules::RULES;

use crate::output::Event;
use crate::port::Port;
use crate::time::Time;
use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::vec::Vec;

/// Findings of one rule that are kept whole; the others are counted.
pub const FIRST_KEPT: usize = 10;
/// Bytes of the host that a finding keeps.
pub const MAX_BYTES: usize = 64;
/// Characters of the message of a finding.
pub const MAX_MESSAGE: usize = 500;

/// How much a broken rule matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// It worked; another controller, or the letter of the manual, may see it otherwise.
    Note,
    /// The manual advises against it, or the robot said NG to what the host could have known.
    Warning,
    /// Something was lost, refused as no text or command at all, or given up.
    Error,
}

impl Severity {
    /// All, the mildest first.
    pub const ALL: [Severity; 3] = [Severity::Note, Severity::Warning, Severity::Error];

    /// `note`, `warning` or `error`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        }
    }
}

/// A rule a host can break.
#[derive(Debug, PartialEq, Eq)]
pub struct Rule {
    /// Its name, which stays the same from release to release.
    pub id: &'static str,
    /// How much it matters.
    pub severity: Severity,
    /// Section of the manual, and in brackets the clauses (docs/clauses.tsv) and decisions.
    pub source: &'static str,
    /// What is wrong, in one line.
    pub title: &'static str,
    /// What to do.
    pub remedy: &'static str,
    /// It compares the host's pace with virtual time, so it says nothing where the two are not the same.
    pub timed: bool,
}

impl Rule {
    /// The rule of this name.
    #[must_use]
    pub fn by_id(id: &str) -> Option<&'static Rule> {
        RULES.iter().copied().find(|rule| rule.id == id)
    }
}

/// One break of a rule.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// The rule.
    pub rule: &'static Rule,
    /// The port it concerns, if one.
    pub port: Option<Port>,
    /// When, in virtual time.
    pub at: Time,
    /// The bytes concerned, at most [`MAX_BYTES`]; empty where none are.
    pub bytes: Vec<u8>,
    /// What happened.
    pub message: String,
}

/// What became of one rule.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Tally {
    /// How often it was broken.
    pub count: u64,
    /// The first [`FIRST_KEPT`] breaks.
    pub first: Vec<Finding>,
}

/// The findings of a run, in bounded memory.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Findings {
    tallies: BTreeMap<&'static str, Tally>,
}

impl Findings {
    /// Takes note of an event if it is a finding.
    pub fn take(&mut self, event: &Event) {
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
        let Some(rule) = Rule::by_id(rule) else { return };
        let tally = self.tallies.entry(rule.id).or_default();
        tally.count = tally.count.saturating_add(1);
        if tally.first.len() < FIRST_KEPT {
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
    #[must_use]
    pub fn count(&self, rule: &Rule) -> u64 {
        self.tallies.get(rule.id).map_or(0, |tally| tally.count)
    }

    /// The rules that were broken, in the order of [`RULES`].
    pub fn broken(&self) -> impl Iterator<Item = (&'static Rule, &Tally)> {
        RULES
            .iter()
            .filter_map(|rule| Some((*rule, self.tallies.get(rule.id)?)))
    }

    /// Whether no rule was broken.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.tallies.is_empty()
    }

    /// Forgets everything, for between two tests.
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
            findings.take(&Event::Finding {
                rule: rules::NO_CR.id,
                port: Some(Port::Ip0),
                at: Time::from_millis(at),
                bytes: b"SU".to_vec(),
                message: String::new(),
            });
        }
        findings.take(&Event::AlarmsReset);
        assert_eq!(findings.count(&rules::NO_CR), 25);
        let broken: Vec<_> = findings.broken().collect();
        assert_eq!(broken.len(), 1);
        assert_eq!(broken[0].1.first.len(), FIRST_KEPT);
        assert_eq!(broken[0].1.first[9].at, Time::from_millis(9));
        findings.clear();
        assert!(findings.is_empty());
    }
}
