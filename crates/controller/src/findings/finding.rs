//! One violation of a rule. What counts and keeps them is [`super::Findings`].

use super::message::Message;
use super::rules::Rule;
use crate::port::Port;
use crate::time::Time;
use bytes::Bytes;

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
    /// What happened, with values, in one line.
    pub message: Message,
}
