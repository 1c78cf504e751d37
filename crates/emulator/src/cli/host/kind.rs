//! The type of a variable as a person writes it for `mr` and `mw`: the manual's code, or its word.

use std::str::FromStr;
use ts3100_proto::command::VariableKind;

/// Words of the types that have a code of their own; elements of arrays of them have a further one.
const WORDS: [(&str, VariableKind); 5] = [
    ("integer", VariableKind::Integer),
    ("real", VariableKind::Real),
    ("load", VariableKind::Load),
    ("coordinate", VariableKind::Coordinate),
    ("position", VariableKind::Position),
];
/// From the code of a type to that of an element of an array of it (CMD-MR-04).
const ELEMENT: i32 = 5;

/// The type of a variable, as typed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A code, used as it is.
    Code(VariableKind),
    /// A word: what the variable, or its element, is.
    Word(VariableKind),
}

impl Default for Kind {
    /// -1: the controller finds the type (CMD-MR-05).
    fn default() -> Kind {
        Kind::Code(VariableKind::Unclarified)
    }
}

impl Kind {
    /// The code to send for this variable: a word means the array's type when the name has subscripts.
    pub(super) fn code(self, name: &str) -> i32 {
        match self {
            Kind::Code(kind) => kind.code(),
            Kind::Word(kind) if name.contains('(') => kind.code() + ELEMENT,
            Kind::Word(kind) => kind.code(),
        }
    }
}

impl FromStr for Kind {
    type Err = String;

    fn from_str(word: &str) -> Result<Kind, String> {
        if let Some((_, kind)) = WORDS.iter().find(|(known, _)| word.eq_ignore_ascii_case(known)) {
            return Ok(Kind::Word(*kind));
        }
        let code = word.parse().ok().and_then(VariableKind::from_code);
        code.map(Kind::Code).ok_or_else(|| {
            let words = WORDS.map(|(known, _)| known).join(", ");
            format!("expected a type code from -1 to 9, or {words}")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // clause: CMD-MR-04 CMD-MR-05
    #[test]
    fn codes_and_words() {
        let code = |word: &str, name: &str| word.parse::<Kind>().unwrap().code(name);
        for number in -1..=9 {
            assert_eq!(code(&number.to_string(), "T(1)"), number);
        }
        for (expected, word) in (0..).zip(["integer", "Real", "LOAD", "coordinate", "position"]) {
            assert_eq!(code(word, "A"), expected);
            assert_eq!(code(word, "A(1,2)"), expected + 5);
        }
        assert_eq!(Kind::default().code("A(1)"), -1);
        for wrong in ["", "-2", "10", "point", "1.0"] {
            let error = wrong.parse::<Kind>().unwrap_err();
            assert!(error.contains("from -1 to 9, or integer, real"), "{error}");
        }
    }
}
