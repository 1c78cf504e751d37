//! The variable type as typed for `mr` and `mw`: a code of the manual, or its name.
//!
//! The codes are `ts3100-proto`'s [`VariableKind`]; here a name is turned into the code of a plain variable or of
//! an array element.

use std::str::FromStr;
use ts3100_proto::command::VariableKind;
use ts3100_proto::words::did_you_mean;

/// Words of the types that have a code of their own; elements of arrays of them have a further one.
const TYPE_NAMES: [(&str, VariableKind); 5] = [
    ("integer", VariableKind::Integer),
    ("real", VariableKind::Real),
    ("load", VariableKind::Load),
    ("coordinate", VariableKind::Coordinate),
    ("position", VariableKind::Position),
];
/// Distance from the code of a type to that of an element of its arrays (CMD-MR-04).
const ELEMENT_OFFSET: i32 = 5;

/// The type of a variable, as typed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum VariableType {
    /// A code, used as it is.
    Code(VariableKind),
    /// A word: what the variable, or its element, is.
    Name(VariableKind),
}

impl Default for VariableType {
    /// -1: the controller finds the type (CMD-MR-05).
    fn default() -> VariableType {
        VariableType::Code(VariableKind::Unclarified)
    }
}

impl VariableType {
    /// The code to send for this variable: a word means the array's type when the name has subscripts.
    pub(super) fn code(self, name: &str) -> i32 {
        match self {
            VariableType::Code(kind) => kind.code(),
            VariableType::Name(kind) if name.contains('(') => kind.code() + ELEMENT_OFFSET,
            VariableType::Name(kind) => kind.code(),
        }
    }
}

/// A word that is not a type, with a suggestion.
#[derive(Debug, thiserror::Error)]
#[error(
    "expected a type code from -1 to 9, or {}{}",
    TYPE_NAMES.map(|(known, _)| known).join(", "),
    did_you_mean(.0, TYPE_NAMES.map(|(known, _)| known))
)]
pub(super) struct VariableTypeError(String);

impl FromStr for VariableType {
    type Err = VariableTypeError;

    fn from_str(word: &str) -> Result<VariableType, VariableTypeError> {
        if let Some((_, kind)) = TYPE_NAMES
            .iter()
            .find(|(known, _)| word.eq_ignore_ascii_case(known))
        {
            return Ok(VariableType::Name(*kind));
        }
        let code = word.parse().ok().and_then(VariableKind::from_code);
        code.map(VariableType::Code)
            .ok_or_else(|| VariableTypeError(word.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // clause: CMD-MR-04 CMD-MR-05
    #[test]
    fn codes_and_words() {
        let code = |word: &str, name: &str| word.parse::<VariableType>().unwrap().code(name);
        for number in -1..=9 {
            assert_eq!(code(&number.to_string(), "T(1)"), number);
        }
        for (expected, word) in (0..).zip(["integer", "Real", "LOAD", "coordinate", "position"]) {
            assert_eq!(code(word, "A"), expected);
            assert_eq!(code(word, "A(1,2)"), expected + 5);
        }
        assert_eq!(VariableType::default().code("A(1)"), -1);
        for wrong in ["", "-2", "10", "point", "1.0"] {
            let error = wrong.parse::<VariableType>().unwrap_err().to_string();
            assert!(error.contains("from -1 to 9, or integer, real"), "{error}");
        }
        let error = "coordinat".parse::<VariableType>().unwrap_err().to_string();
        assert!(error.ends_with("; did you mean `coordinate`?"), "{error}");
    }
}
