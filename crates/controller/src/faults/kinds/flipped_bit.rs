//! Fault `flipped-bit`: one bit of the bytes on a line is inverted.
//!
//! It applies to sent or to received bytes. Byte and bit are random by default.

use crate::faults::kind::{Effect, FaultContext, FaultKind, InjectionPoint, ParameterValues, number, word};
use crate::segment::Segment;

/// Value of `way`: bytes sent to the host.
const OUT: &str = "out";
/// Value of `way`: bytes received by the robot.
const IN: &str = "in";
/// Largest value of `byte`.
const FARTHEST: u64 = 511;

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "flipped-bit",
    summary: "Inverts one bit of a text, of the output of PRINT, or of incoming bytes.",
    remedy: "It checks the form of every reply, and sends the command again if the form is wrong. It \
             reads a stored file back. A checksum (text.checksum) finds the other errors.",
    parameters: &[
        word("way", &[OUT, IN]).help("out: towards the host; in: towards the robot"),
        number("byte", "bytes", (0, FARTHEST))
            .help("number of bytes before it, STX included; random by default"),
        number("bit", "bits", (0, 7)).help("0 is the lowest, 7 the highest; random by default"),
    ],
    points: &[
        InjectionPoint::Reply,
        InjectionPoint::Print,
        InjectionPoint::Bytes,
    ],
    applies: |values, point, _| (values.word("way") == IN) == (point == InjectionPoint::Bytes),
    apply: |context, values, site| {
        let mut bytes = site.bytes.to_vec();
        let (byte, bit) = position(context, values, bytes.len());
        let Some(found) = bytes.get_mut(byte) else {
            return (Effect::Unchanged, format!("{site} has no byte {byte}"));
        };
        let before = *found;
        *found ^= 1 << bit;
        let message = format!("byte {byte} of {site} is {:02X}, not {before:02X}", *found);
        let effect = match site.point == InjectionPoint::Bytes {
            true => Effect::ReplaceInput(bytes.into()),
            false => Effect::ReplaceOutput([Segment::bytes(bytes)].into()),
        };
        (effect, message)
    },
    ..FaultKind::DEFAULT
};

/// Index of the byte and number of the bit; random where the fault does not say.
fn position(context: &mut FaultContext<'_>, values: &ParameterValues, length: usize) -> (usize, u32) {
    let rng = &mut *context.rng;
    let byte = values.bytes("byte").unwrap_or_else(|| rng.index(length));
    let bit = values.number("bit").unwrap_or_else(|| rng.between(0, 7));
    (byte, u32::try_from(bit).unwrap_or(0))
}
