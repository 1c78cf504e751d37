//! A target with a planted defect: a WD whose time has five digits makes it panic.
//!
//! Whoever fuzzes has to find it. If that takes longer than the others are given, what they do not find says nothing.

use ts3100_proto::command::Command;

/// Panics for the planted defect, and for nothing else.
///
/// # Panics
/// For a message that [`Command::parse`] reads as WD with a time of ten seconds or more.
pub fn check(data: &[u8]) {
    let Ok(command) = Command::parse(data) else {
        return;
    };
    let encoded = command.encode();
    let time = encoded.strip_prefix(b"WD,").unwrap_or_default();
    let digits = time.iter().take_while(|byte| byte.is_ascii_digit()).count();
    assert!(digits < 5, "planted: {}", encoded.escape_ascii());
}
