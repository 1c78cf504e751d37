//! Findings: protocol mistakes of hosts. A finding never changes an answer.
//!
//! The rules are one table, [`RULES`]; the files `checks` of context, ports and robot compare the behaviour of a host
//! with them. One that a fault has caused names the fault ([`crate::faults::CAUSES`]); it is a note, and no mistake of
//! the host. `findings` counts them.

mod history;
mod message;
pub mod rules;

pub use history::HostHistory;
pub use message::{MAX_MESSAGE, Message};
pub use rules::{RULES, Rule, Severity};

use crate::event_form;
use crate::port::Port;
use crate::prelude::*;
use crate::time::Time;
use bytes::Bytes;
use core::fmt;
use serde::{Serialize, Serializer};

/// Most bytes of the host that a finding keeps.
pub const MAX_BYTES: usize = 64;

/// The fault that has caused a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaultCause {
    /// Number of the fault.
    pub id: u32,
    /// Name of its kind.
    pub kind: &'static str,
}

impl fmt::Display for FaultCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "fault {} ({})", self.id, self.kind)
    }
}

/// One violation of a rule. Cheap to keep: a host that breaks a rule breaks it with each text.
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
    /// One line, with values.
    pub message: Message,
    /// The fault that has caused it; `None`: the host has.
    pub caused_by: Option<FaultCause>,
}

/// As an event says it, with the words of its rule; the event has its own moment.
impl Serialize for Finding {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        #[serde(rename_all = "kebab-case")]
        struct Keys<'a> {
            #[serde(skip_serializing_if = "Option::is_none")]
            port: Option<Port>,
            #[serde(flatten, serialize_with = "event_form::bytes")]
            bytes: &'a Bytes,
            rule: &'static str,
            #[serde(skip_serializing_if = "Option::is_none")]
            caused_by: Option<String>,
            #[serde(serialize_with = "event_form::word")]
            severity: Severity,
            source: &'static str,
            remedy: &'static str,
            #[serde(serialize_with = "event_form::text")]
            message: &'a Message,
        }
        let keys = Keys {
            port: self.port,
            bytes: &self.bytes,
            rule: self.rule.id,
            caused_by: self.caused_by.map(|cause| cause.to_string()),
            severity: self.severity(),
            source: self.rule.source,
            remedy: self.rule.remedy,
            message: &self.message,
        };
        keys.serialize(serializer)
    }
}

impl Finding {
    /// How serious it is: the rule's word, but a note if a fault has caused it.
    pub fn severity(&self) -> Severity {
        match self.caused_by {
            Some(_) => Severity::Note,
            None => self.rule.severity,
        }
    }
}
