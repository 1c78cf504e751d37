//! Why a fault was rejected: its specification is wrong, or it can never fire.

use crate::prelude::*;
use ts3100_proto::error_text;

/// Why a fault was rejected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FaultError {
    /// The kind does not exist.
    UnknownKind {
        /// The name found.
        found: String,
        /// What may be meant, as the end of the message.
        hint: String,
    },
    /// The kind has no such key.
    UnknownKey {
        /// The kind.
        kind: &'static str,
        /// The key found.
        key: String,
        /// What may be meant, as the end of the message.
        hint: String,
    },
    /// A key appears twice.
    DuplicateKey {
        /// The kind.
        kind: &'static str,
        /// The key.
        key: String,
    },
    /// A value has the wrong form or is out of range.
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
    NeverFires {
        /// The kind.
        kind: &'static str,
        /// Why it never fires.
        reason: String,
        /// What to give or to leave out.
        advice: String,
    },
    /// The specification does not have the form `KIND:key=value`.
    Syntax {
        /// The part that could not be parsed.
        found: String,
    },
}

error_text! {
    FaultError;
    Self::UnknownKind { found, hint } => "unknown kind of fault `{found}`{hint}";
    Self::UnknownKey { kind, key, hint } => "{kind}: unknown key `{key}`{hint}";
    Self::DuplicateKey { kind, key } => "{kind}: the key `{key}` is given twice";
    Self::InvalidValue { kind, key, expected, found } =>
        "{kind}: {key}: expected {expected}, found `{found}`";
    Self::NeverFires { kind, reason, advice } => "cannot arm {kind}: {reason}; {advice}";
    Self::Syntax { found } => "expected KIND:key=value,key=value, found `{found}`";
}
