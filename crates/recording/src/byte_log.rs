//! The last of many small entries, each with some bytes. All bytes are in one piece: memory that is let go entry by entry,
//! long after it was used, costs a request more than everything else that is kept of it.

use std::collections::VecDeque;

/// Entries in order, each with its bytes.
#[derive(Debug)]
pub struct ByteLog<T> {
    /// Each with the number of its bytes.
    entries: VecDeque<(T, usize)>,
    /// Those of removed entries, then those of the first entry, of the second, and so on.
    bytes: Vec<u8>,
    /// Number of bytes of removed entries.
    stale: usize,
}

impl<T> Default for ByteLog<T> {
    fn default() -> ByteLog<T> {
        ByteLog {
            entries: VecDeque::new(),
            bytes: Vec::new(),
            stale: 0,
        }
    }
}

impl<T> ByteLog<T> {
    /// Number of entries.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there is no entry.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Appends an entry.
    pub fn push(&mut self, entry: T, bytes: &[u8]) {
        self.entries.push_back((entry, bytes.len()));
        self.bytes.extend_from_slice(bytes);
    }

    /// The oldest entry with its bytes.
    pub fn first(&self) -> Option<(&T, &[u8])> {
        let (entry, length) = self.entries.front()?;
        let bytes = self.bytes.get(self.stale..self.stale + length)?;
        Some((entry, bytes))
    }

    /// Removes the oldest entry; returns it with the number of its bytes.
    pub fn pop(&mut self) -> Option<(T, usize)> {
        let (entry, length) = self.entries.pop_front()?;
        self.stale += length;
        // In one go for many entries: on average a byte is moved twice at most.
        if self.stale > self.bytes.len() / 3 {
            self.bytes.drain(..self.stale);
            self.stale = 0;
        }
        Some((entry, length))
    }

    /// The entries with their bytes, oldest first, but for the first `skipped`.
    pub fn iter_from(&self, skipped: usize) -> impl Iterator<Item = (&T, &[u8])> {
        let skipped = skipped.min(self.entries.len());
        let entries = self.entries.range(skipped..);
        // From the end: whoever follows the events skips nearly all.
        let left: usize = entries.clone().map(|(_, length)| length).sum();
        let mut rest = self.bytes.get(self.bytes.len() - left..).unwrap_or_default();
        entries.map(move |(entry, length)| {
            let (bytes, after) = rest.split_at_checked(*length).unwrap_or_default();
            rest = after;
            (entry, bytes)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_keeps_its_bytes_while_others_come_and_go() {
        let mut log = ByteLog::default();
        let bytes = |entry: usize| vec![entry.to_le_bytes()[0]; entry % 7];
        for entry in 0..500_usize {
            log.push(entry, &bytes(entry));
            if log.len() > 10 {
                assert_eq!(log.pop(), Some((entry - 10, (entry - 10) % 7)));
            }
            let expected: Vec<usize> = (entry.saturating_sub(9)..=entry).collect();
            assert_eq!(log.first().map(|(entry, _)| entry), expected.first());
            for skipped in [0, 3, 10, 11] {
                let found: Vec<_> = log
                    .iter_from(skipped)
                    .map(|(entry, bytes)| (*entry, bytes.to_vec()))
                    .collect();
                let left = expected.iter().skip(skipped).map(|entry| (*entry, bytes(*entry)));
                assert_eq!(found, left.collect::<Vec<_>>());
            }
        }
        while log.pop().is_some() {}
        assert!(log.is_empty() && log.pop().is_none());
    }
}
