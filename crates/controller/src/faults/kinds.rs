//! The table of all kinds of faults. Each kind is a file of this directory; `faults::kind` says what a kind consists of.
//!
//! To add a kind, write its file after one of the short ones (`ng`, `late_reply`) and add it to [`KINDS`]. What
//! it excuses a host for are its field `reply` and its rows in `faults::causes`.

mod alarm;
mod drive_full;
mod duplicate_text;
mod emergency_stop;
mod flipped_bit;
mod half_open;
pub(super) mod key_turned;
mod late_reply;
mod lost_etx;
mod lost_record;
mod merged_texts;
mod ng;
mod no_reply;
mod parity_error;
mod power_loss;
mod reset_mid_text;
mod servo_failure;
mod slow_line;
mod split_bytes;
mod wrong_reply;

use super::kind::FaultKind;

/// Every kind, in the order in which lists show them.
pub const KINDS: &[&FaultKind] = &[
    &no_reply::KIND,
    &late_reply::KIND,
    &ng::KIND,
    &wrong_reply::KIND,
    &lost_etx::KIND,
    &flipped_bit::KIND,
    &split_bytes::KIND,
    &merged_texts::KIND,
    &duplicate_text::KIND,
    &reset_mid_text::KIND,
    &half_open::KIND,
    &slow_line::KIND,
    &drive_full::KIND,
    &power_loss::KIND,
    &alarm::KIND,
    &emergency_stop::KIND,
    &servo_failure::KIND,
    &key_turned::KIND,
    &parity_error::KIND,
    &lost_record::KIND,
];
