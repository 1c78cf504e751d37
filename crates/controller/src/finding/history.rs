//! Memory of the checks about a host between texts.

use crate::prelude::*;
use crate::time::Time;
use core::time::Duration;

/// Memory of the checks about a host, from text to text.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HostHistory {
    /// The last request for each status (by its letters) and when it was received.
    polls: Vec<(Vec<u8>, Time)>,
    /// The last message that was refused, and how often in a row.
    pub(crate) last_refused: Option<(Vec<u8>, u32)>,
    /// The controller's last text was an unsolicited SP. A host cannot keep 50 ms after a text it does not expect.
    pub unsolicited_sp_sent: bool,
    /// A text of a file was refused before its end. A host that ignores the answer continues to send the file.
    pub file_refused: bool,
}

impl HostHistory {
    /// Notes a request for a status; returns the time since the same request, if that was the last with its letters.
    pub(crate) fn note_poll(&mut self, message: &[u8], now: Time) -> Option<Duration> {
        let same_letters = |(poll, _): &(Vec<u8>, Time)| match (poll.get(..2), message.get(..2)) {
            (Some(last), Some(letters)) => last.eq_ignore_ascii_case(letters),
            _ => false,
        };
        let poll = self.polls.iter_mut().find(|poll| same_letters(poll));
        let Some((last, at)) = poll else {
            self.polls.push((message.to_vec(), now));
            return None;
        };
        let before = core::mem::replace(at, now);
        if last == message {
            return Some(now.since(before));
        }
        *last = message.to_vec();
        None
    }
}
