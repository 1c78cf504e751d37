//! Queue of outputs until the owner of the controller takes them; all parts put their events here.

use crate::output::{Event, Output};
use crate::watched::Watched;
use alloc::collections::VecDeque;

/// The outputs that were not taken yet.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Outputs {
    queue: VecDeque<Output>,
    /// Every statement of the program is told as an event.
    traced: bool,
    /// What it did is told with it.
    detailed: bool,
    /// Read before each of them.
    watched: Option<Watched>,
}

impl Outputs {
    pub(crate) fn push(&mut self, output: Output) {
        self.queue.push_back(output);
    }

    pub(crate) fn event(&mut self, event: impl Into<Option<Event>>) {
        self.queue.extend(event.into().map(Output::Event));
    }

    pub(crate) fn take_next(&mut self) -> Option<Output> {
        self.queue.pop_front()
    }

    /// From now on every statement is told, or no longer.
    pub(crate) fn trace(&mut self, on: bool) {
        self.traced = on;
    }

    pub(crate) fn is_traced(&self) -> bool {
        self.traced
    }

    /// From now on every statement that is told is told with what it did, or without.
    pub(crate) fn tell_effects(&mut self, on: bool) {
        self.detailed = on;
    }

    pub(crate) fn is_detailed(&self) -> bool {
        self.detailed
    }

    /// From now on this is read before every statement that is told.
    pub(crate) fn watch(&mut self, watched: Option<Watched>) {
        self.watched = watched;
    }

    pub(crate) fn watched(&self) -> Option<&Watched> {
        self.watched.as_ref()
    }

    /// How many are waiting: what comes after them is told apart by it.
    pub(crate) fn count(&self) -> usize {
        self.queue.len()
    }

    /// Whether a finding is among those after the first `count`.
    pub(crate) fn has_finding_after(&self, count: usize) -> bool {
        let finding = |output: &Output| matches!(output, Output::Event(Event::Finding(_)));
        self.queue.iter().skip(count).any(finding)
    }
}
