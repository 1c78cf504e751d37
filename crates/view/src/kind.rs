//! Moments by what happened in them, as the command line names them: the first NG, the last bytes of a host, the first finding of a
//! rule. Clients print such a moment under a failed test, and need no number of an event for it.

use crate::list;
use crate::run::Run;
use std::fmt;
use std::str::FromStr;
use ts3100_control::event::JournalEvent;
use ts3100_controller::Event;
use ts3100_controller::findings::{RULES, Rule};
use ts3100_proto::words::UnexpectedWord;

/// The text of a refusal, after the framing.
const NG: &[u8] = b"NG\r";

/// What happened in a moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The robot answered NG, or a fault made it.
    Ng,
    /// A finding of any rule.
    Finding,
    /// An alarm was raised or reset.
    Alarm,
    /// A host sent something.
    Received,
    /// A finding of this rule that no fault has caused.
    Rule(&'static Rule),
}

const WORDS: [(&str, Kind); 4] = [
    ("ng", Kind::Ng),
    ("finding", Kind::Finding),
    ("alarm", Kind::Alarm),
    ("received", Kind::Received),
];

impl FromStr for Kind {
    type Err = UnexpectedWord;

    fn from_str(word: &str) -> Result<Kind, UnexpectedWord> {
        let known = WORDS.iter().find(|(known, _)| *known == word);
        let kind = known.map(|(_, kind)| *kind);
        kind.or_else(|| Rule::by_id(word).map(Kind::Rule)).ok_or_else(|| {
            let rules = RULES.iter().map(|rule| rule.id);
            UnexpectedWord::new("ng, finding, alarm, received or the rule of a finding", word)
                .suggesting(WORDS.iter().map(|(known, _)| *known).chain(rules))
        })
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Kind::Rule(rule) = self {
            return f.write_str(rule.id);
        }
        let known = WORDS.iter().find(|(_, kind)| kind == self);
        f.write_str(known.map_or("", |(word, _)| word))
    }
}

impl Kind {
    /// Whether an event is of this kind.
    fn has(self, event: &JournalEvent) -> bool {
        match (self, event) {
            (Kind::Ng, JournalEvent::Sent { data, .. }) => {
                data.strip_prefix(b"\x02").unwrap_or(data).starts_with(NG)
            }
            (Kind::Ng, JournalEvent::Controller(Event::Refused { .. })) => true,
            (Kind::Finding, JournalEvent::Controller(Event::Finding(_))) => true,
            (Kind::Alarm, JournalEvent::Controller(Event::Alarm { .. } | Event::AlarmsReset)) => true,
            (Kind::Received, JournalEvent::Received { .. }) => true,
            (Kind::Rule(rule), JournalEvent::Controller(Event::Finding(finding))) => {
                finding.rule == rule && finding.caused_by.is_none()
            }
            _ => false,
        }
    }

    /// The number of the first event of this kind in a run that is whole.
    pub fn first(self, run: &Run) -> Option<u64> {
        let events = run.events();
        let found = events.iter().find(|found| self.has(&found.event));
        found.map(|found| found.seq)
    }

    /// The number of the last event of this kind in a run that is whole.
    pub fn last(self, run: &Run) -> Option<u64> {
        let events = run.events();
        let found = events.iter().rev().find(|found| self.has(&found.event));
        found.map(|found| found.seq)
    }
}

/// The number of the event at which a run that is whole went wrong: the first NG, finding or alarm, otherwise the last that a host sent.
pub fn went_wrong(run: &Run) -> Option<u64> {
    let wrong = list::lines(run, true);
    let first = wrong.first().map(|line| line.event);
    first.or_else(|| Kind::Received.last(run))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ts3100_controller::{Bytes, Port};

    #[test]
    fn a_kind_is_a_word_or_a_rule() {
        for word in ["ng", "finding", "alarm", "received", "no-cr"] {
            assert_eq!(word.parse::<Kind>().unwrap().to_string(), word);
        }
        assert_eq!(
            "no-cR".parse::<Kind>().unwrap_err().to_string(),
            "expected ng, finding, alarm, received or the rule of a finding, found `no-cR`; did you mean `no-cr`?"
        );
    }

    #[test]
    fn a_refusal_is_an_ng_before_its_text_is_sent_and_a_fault_can_make_one() {
        let port = Port::Ip0;
        let sent = |text: &[u8]| JournalEvent::Sent {
            port,
            data: Bytes::from(text.to_vec()),
        };
        let refused = JournalEvent::Controller(Event::Refused {
            port,
            command: "SL".to_owned(),
            reason: "no such file".to_owned(),
        });
        for event in [refused, sent(b"\x02NG\r\x03"), sent(b"NG\r\n")] {
            assert!(Kind::Ng.has(&event) && !Kind::Received.has(&event), "{event:?}");
        }
        let data = Bytes::from(b"\x02NG\r\x03".to_vec());
        let received = JournalEvent::Received { port, data };
        assert!(Kind::Received.has(&received) && !Kind::Ng.has(&received));
        assert!(!Kind::Ng.has(&sent(b"\x02OK\r\x03")));
    }
}
