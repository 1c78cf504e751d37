//! Legal variation: what the manual leaves open differs from run to run, so that a host that relies on luck is found.
//!
//! Everything follows from one seed: the same seed and the same inputs give the same bytes at the same times. Each
//! variation is a row of [`VARIATIONS`] and a method here.

use crate::faults::rng::Rng;
use crate::limits::{
    MAX_SEND, MAX_VARIED_BLANKS, MAX_VARIED_GAP_MS, MAX_VARIED_PIECES, MAX_VARIED_REPLY_MS, MAX_VARIED_SP_MS,
    MIN_VARIED_TEXT,
};
use crate::prelude::*;
use crate::segment::{Departure, Segment};
use bytes::Bytes;
use core::time::Duration;
use ts3100_proto::status::ca::DirectoryEntry;
use ts3100_proto::text::MAX_DATA;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VariationRule {
    /// Name in reports and documentation.
    pub name: &'static str,
    /// Variation and its range.
    pub summary: &'static str,
    /// Why the manual allows it.
    pub source: &'static str,
}

/// Every variation.
pub const VARIATIONS: &[VariationRule] = &[
    VariationRule {
        name: "segments",
        summary: "The robot sends a text or the output of PRINT in one to four packets, up to 15 ms apart, cut anywhere",
        source: "A text ends at ETX, not with its packet; packets have at most 512 bytes",
    },
    VariationRule {
        name: "reply-delay",
        summary: "The reply to a command leaves up to 100 ms later",
        source: "No time is given for the reply; between characters it is 10 s",
    },
    VariationRule {
        name: "sp-timing",
        summary: "The unsolicited SP comes up to 200 ms after the stop, never inside an open exchange",
        source: "The manual does not give its moment",
    },
    VariationRule {
        name: "text-cuts",
        summary: "A file that needs several texts is cut anywhere: texts of 128 to 253 data bytes; not that of SF, which is read by length",
        source: "Texts have at most 253 data bytes; the manual does not fill them",
    },
    VariationRule {
        name: "directory-order",
        summary: "CA lists the files in a different order each time",
        source: "The order of the records is not given",
    },
    VariationRule {
        name: "directory-blanks",
        summary: "CA has one to three blanks between name and size, the same number in one reply; only with the option \
                  `extensions` off, because the vendor's library reads one blank",
        source: "The blanks between name and size are not given",
    },
    VariationRule {
        name: "history-order",
        summary: "EU lists its entries newest first or oldest first, always the same in one run",
        source: "The order of the entries is not given",
    },
];

/// The random state of the variations in a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variation {
    seed: u64,
    segments: Rng,
    reply: Rng,
    sp: Rng,
    cuts: Rng,
    order: Rng,
    blanks: Rng,
    oldest_first: bool,
}

impl Variation {
    /// The variations of this seed.
    pub fn new(seed: u64) -> Variation {
        let rng = |name| Rng::new(seed, name);
        Variation {
            seed,
            segments: rng("segments"),
            reply: rng("reply-delay"),
            sp: rng("sp-timing"),
            cuts: rng("text-cuts"),
            order: rng("directory-order"),
            blanks: rng("directory-blanks"),
            oldest_first: rng("history-order").happens(500_000),
        }
    }

    /// The seed it was created with.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// `segments`: the writes in which these bytes are sent, the first one after `delay`.
    pub fn segments(&mut self, delay: Duration, bytes: &Bytes) -> Vec<Segment> {
        let pieces = self.segments.between(1, MAX_VARIED_PIECES);
        let mut cuts: Vec<usize> = (1..pieces).map(|_| self.segments.index(bytes.len())).collect();
        cuts.sort_unstable();
        cuts.dedup();
        let mut segments = Vec::new();
        let mut from = 0;
        for cut in cuts.into_iter().chain([bytes.len()]).filter(|cut| *cut > 0) {
            for piece in bytes.get(from..cut).unwrap_or_default().chunks(MAX_SEND) {
                let after = match segments.is_empty() {
                    true => delay,
                    false => Duration::from_millis(self.segments.between(0, MAX_VARIED_GAP_MS)),
                };
                segments.push(Segment::after(after, Departure::Bytes(bytes.slice_ref(piece))));
            }
            from = cut;
        }
        segments
    }

    /// `reply-delay`: the delay of an answer.
    pub fn reply_delay(&mut self) -> Duration {
        Duration::from_millis(self.reply.between(0, MAX_VARIED_REPLY_MS))
    }

    /// `sp-timing`: the delay of an unsolicited SP.
    pub fn sp_delay(&mut self) -> Duration {
        Duration::from_millis(self.sp.between(0, MAX_VARIED_SP_MS))
    }

    /// `text-cuts`: the number of data bytes of each text but the last, for a file of `length` data bytes; empty if
    /// it fits into one text.
    pub fn cuts(&mut self, length: usize) -> Vec<usize> {
        let mut lengths = Vec::new();
        let mut rest = length;
        while rest > MAX_DATA {
            let most = u64::try_from(MAX_DATA).unwrap_or(MIN_VARIED_TEXT);
            let text = usize::try_from(self.cuts.between(MIN_VARIED_TEXT, most)).unwrap_or(MAX_DATA);
            lengths.push(text);
            rest -= text;
        }
        lengths
    }

    /// `directory-order`: shuffles the entries.
    pub fn order(&mut self, entries: &mut [DirectoryEntry]) {
        self.order.shuffle(entries);
    }

    /// `directory-blanks`: the blanks between name and size.
    pub fn directory_blanks(&mut self) -> String {
        let blanks = usize::try_from(self.blanks.between(1, MAX_VARIED_BLANKS)).unwrap_or(1);
        " ".repeat(blanks)
    }

    /// `history-order`: whether EU lists the oldest entry first.
    pub fn lists_oldest_first(&self) -> bool {
        self.oldest_first
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joined(segments: &[Segment]) -> Vec<u8> {
        let bytes = segments.iter().map(|segment| match &segment.departure {
            Departure::Bytes(bytes) => bytes.clone(),
            other => panic!("{other:?}"),
        });
        bytes.collect::<Vec<_>>().concat()
    }

    // clause: FRM-05 ETH-02
    #[test]
    fn segments_lose_nothing_keep_to_the_packet_and_differ() {
        let mut variation = Variation::new(3);
        let bytes: Bytes = (0..=255).cycle().take(700).collect();
        let mut counts = alloc::collections::BTreeSet::new();
        for _ in 0..50 {
            let segments = variation.segments(Duration::ZERO, &bytes);
            assert_eq!(joined(&segments), bytes);
            counts.insert(segments.len());
            assert!(segments.iter().all(|segment| match &segment.departure {
                Departure::Bytes(piece) => (1..=MAX_SEND).contains(&piece.len()),
                _ => false,
            }));
        }
        assert!(counts.len() > 2, "{counts:?}");
        assert_eq!(
            joined(&variation.segments(Duration::ZERO, &Bytes::from_static(b"x"))),
            b"x"
        );
        assert_eq!(variation.segments(Duration::ZERO, &Bytes::new()), []);
    }

    // clause: FRM-02 FL-02 FL-03
    #[test]
    fn texts_are_cut_anywhere_but_never_too_long_and_short_files_not_at_all() {
        let mut variation = Variation::new(9);
        assert!(variation.cuts(MAX_DATA).is_empty());
        let cuts = variation.cuts(2_000);
        assert!(cuts.iter().all(|cut| (128..=MAX_DATA).contains(cut)), "{cuts:?}");
        assert!((1..=MAX_DATA).contains(&(2_000 - cuts.iter().sum::<usize>())));
        assert_ne!(cuts, variation.cuts(2_000));
    }
}
