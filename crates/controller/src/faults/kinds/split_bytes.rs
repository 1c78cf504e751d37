//! Fault `split-bytes`: a text is sent in small portions with pauses.
//!
//! Each portion is one write, which is usually one TCP segment.

use super::super::kind::{Applied, Effect, FaultKind, Parameter, ParameterType};
use super::{OUTGOING, millis_parameter};
use crate::endpoint::send_queue::{Departure, Segment};
use crate::limits::MAX_SEND;
use core::time::Duration;

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "split-bytes",
    summary: "What leaves is cut into portions, each in a write of its own behind a pause.",
    remedy: "Read on until ETX (SF: until its length), however many reads that takes.",
    parameters: &[
        Parameter {
            name: "size",
            value_type: ParameterType::Number {
                unit: "bytes",
                min: 1,
                max: MAX_SEND as u64,
            },
            default: Some("1"),
            description: "bytes of a portion",
        },
        millis_parameter("pause", "20", "the pause before each but the first"),
    ],
    points: OUTGOING,
    apply: |_, values, site| {
        let size = values.bytes("size").unwrap_or(1).max(1);
        let pause = values.millis("pause");
        let segments = site.bytes.chunks(size).enumerate().map(|(index, portion)| {
            let after = if index == 0 { Duration::ZERO } else { pause };
            Segment::after(after, Departure::Bytes(site.bytes.slice_ref(portion)))
        });
        let message = alloc::format!("{} leaves in portions of {size} bytes", site.description());
        Applied::new(Effect::ReplaceOutput(segments.collect()), message)
    },
    ..FaultKind::DEFAULT
};
