//! Why a fault was rejected: its specification is wrong, or it can never fire.

use crate::prelude::*;

/// Why a fault was rejected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FaultError {
    /// The kind does not exist.
    #[error("unknown kind of fault `{found}`{hint}")]
    UnknownKind {
        /// The name found.
        found: String,
        /// A name that may be meant, as the end of the message; may be empty.
        hint: String,
    },
    /// The kind has no such key.
    #[error("{kind}: unknown key `{key}`{hint}")]
    UnknownKey {
        kind: &'static str,
        /// The key found.
        key: String,
        /// A name that may be meant, as the end of the message; may be empty.
        hint: String,
    },
    /// A key appears twice.
    #[error("{kind}: the key `{key}` is given twice")]
    DuplicateKey { kind: &'static str, key: String },
    /// A value has the wrong form or is out of range.
    #[error("{kind}: {key}: expected {expected}, found `{found}`")]
    InvalidValue {
        kind: &'static str,
        key: String,
        /// Accepted values.
        expected: String,
        /// The value found.
        found: String,
    },
    /// No site can match the fault.
    #[error("cannot arm {kind}: {reason}; {advice}")]
    NeverFires {
        kind: &'static str,
        /// Why it never fires.
        reason: String,
        /// Parameters to give or to leave out.
        advice: String,
    },
    /// The specification does not have the form `KIND:key=value`.
    #[error("expected KIND:key=value,key=value, found `{found}`")]
    Syntax {
        /// The part that could not be parsed.
        found: String,
    },
}
