//! Why a fault was rejected: its specification is wrong, or it can never fire.

use alloc::string::String;
use thiserror::Error;

/// Why a fault was rejected.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum FaultError {
    /// The kind does not exist.
    #[error("kind of fault expected, `{found}` found; known are {known}")]
    UnknownKind {
        /// The name found.
        found: String,
        /// Names of all kinds.
        known: String,
    },
    /// The kind has no such key.
    #[error("{kind}: unknown key `{key}`; known are {known}")]
    UnknownKey {
        /// The kind.
        kind: &'static str,
        /// The key found.
        key: String,
        /// The keys of the kind.
        known: String,
    },
    /// A key appears twice.
    #[error("{kind}: key `{key}` given once expected, twice found")]
    DuplicateKey {
        /// The kind.
        kind: &'static str,
        /// The key.
        key: String,
    },
    /// A value has the wrong form or is out of range.
    #[error("{kind}: {key}: {expected} expected, `{found}` found")]
    InvalidValue {
        /// The kind.
        kind: &'static str,
        /// The key.
        key: String,
        /// Accepted values.
        expected: String,
        /// The value found.
        found: String,
    },
    /// No site can match the fault.
    #[error("cannot arm {kind}: {reason}; {advice}")]
    NeverFires {
        /// The kind.
        kind: &'static str,
        /// Why it never fires.
        reason: String,
        /// What to give or to leave out.
        advice: String,
    },
    /// The specification does not have the form `KIND:key=value`.
    #[error("KIND:key=value,key=value expected, `{found}` found")]
    Syntax {
        /// The part that could not be parsed.
        found: String,
    },
}
