//! One violation of a rule. What counts and keeps them is [`super::Findings`].

use super::message::Message;
use super::rules::{Rule, Severity};
use crate::port::Port;
use crate::time::Time;
use bytes::Bytes;
use core::fmt;

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
    /// The bytes concerned, at most [`super::MAX_BYTES`]; may be empty.
    pub bytes: Bytes,
    /// One line, with values.
    pub message: Message,
    /// The fault that has caused it; `None`: the host has.
    pub caused_by: Option<FaultCause>,
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
