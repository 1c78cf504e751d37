//! Names that travel in commands: files of the RAM drive (D13, CMD-DL-08, DIR-04) and global variables
//! (CMD-MR-02, CMD-MR-03).
//!
//! This module checks spelling only. The controller knows which files and variables exist.

use crate::prelude::*;
use core::fmt;

/// Characters a file name may have, dot and extension included.
pub const MAX_FILE_NAME: usize = 12;
/// Characters before the dot that the editor of the robot family gives a file name at most (STE 58761 1-16).
const EDITOR_BASE: usize = 8;
/// Characters of an extension that this editor gives at most.
const EDITOR_EXTENSION: usize = 3;
/// Characters a variable name may have.
pub const MAX_VARIABLE_NAME: usize = 10;
/// Subscripts an array element may have. The manual gives no limit; this one is ours.
pub const MAX_SUBSCRIPTS: usize = 4;

/// Why a name is rejected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    /// The name is empty.
    #[error("the name is empty")]
    Empty,
    /// The name has too many characters.
    #[error("a name has at most {limit} characters, this one has {length}")]
    TooLong {
        /// Characters allowed.
        limit: usize,
        /// Characters found.
        length: usize,
    },
    /// The name, or its extension, does not begin as it must.
    #[error("character {} is {found:?}, not {expected}", at + 1)]
    Character {
        /// The characters allowed at this position.
        expected: &'static str,
        /// The character found.
        found: char,
        /// Its position in the name, in characters from 0.
        at: usize,
    },
    /// A dot without an extension.
    #[error("the extension after the dot is empty")]
    NoExtension,
    /// The subscripts in parentheses are not whole numbers with commas between them.
    #[error("expected at most {MAX_SUBSCRIPTS} subscripts as in (1,2), found {found:?}")]
    Subscripts {
        /// The text from the parenthesis on.
        found: String,
    },
}

/// Name of a file of the RAM drive, in upper case.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct FileName(String);

impl FileName {
    /// Reads a name: one letter, then letters and digits, then perhaps a dot and an extension of letters
    /// and digits; at most [`MAX_FILE_NAME`] characters; case does not matter (D13).
    ///
    /// # Errors
    /// Anything else, with what was expected and where.
    pub fn parse(text: &str) -> Result<FileName, NameError> {
        check_first(text, MAX_FILE_NAME)?;
        let mut extension = None;
        for (at, found) in text.chars().enumerate() {
            if found == '.' && extension.is_none() {
                extension = Some(at);
            } else if !found.is_ascii_alphanumeric() {
                let expected = match extension {
                    None => "a letter, a digit or one dot",
                    Some(_) => "a letter or a digit",
                };
                return Err(NameError::Character { expected, found, at });
            }
        }
        if extension.is_some_and(|at| at + 1 == text.len()) {
            return Err(NameError::NoExtension);
        }
        Ok(FileName(text.to_ascii_uppercase()))
    }

    /// The name in upper case.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether the editor of the robot family can give this name: up to 8 characters and an extension of up to 3.
    /// The protocol allows 12 characters in all, however they are split (D13).
    pub fn fits_editor(&self) -> bool {
        let (base, extension) = self.0.split_once('.').unwrap_or((&self.0, ""));
        base.len() <= EDITOR_BASE && extension.len() <= EDITOR_EXTENSION
    }

    /// Whether it is the name of a parameter file: `USER.PAR`, `ETHERNET.PAR` or `STRING.PAR`.
    pub fn is_parameter(&self) -> bool {
        self.is_permanent() || self.as_str() == "STRING.PAR"
    }

    /// Whether it is the name of a parameter file that the controller makes and keeps.
    pub fn is_permanent(&self) -> bool {
        matches!(self.as_str(), "USER.PAR" | "ETHERNET.PAR")
    }
}

impl TryFrom<String> for FileName {
    type Error = NameError;

    fn try_from(text: String) -> Result<FileName, NameError> {
        FileName::parse(&text)
    }
}

impl From<FileName> for String {
    fn from(name: FileName) -> String {
        name.0
    }
}

impl fmt::Display for FileName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Name of a global variable, or of an element of a global array.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VariableName {
    /// The name in upper case.
    pub name: String,
    /// The subscripts of an element; empty for a variable that is not an array.
    pub subscripts: Vec<i32>,
}

impl VariableName {
    /// Reads `NAME` or `NAME(1,2)`: one letter, then letters, digits and underscores, at most [`MAX_VARIABLE_NAME`]
    /// characters; at most [`MAX_SUBSCRIPTS`] whole numbers; case does not matter. Blanks around the subscripts are
    /// allowed.
    ///
    /// # Errors
    /// Anything else, with what was expected.
    pub fn parse(text: &str) -> Result<VariableName, NameError> {
        let (name, subscripts) = split_subscripts(text)?;
        check_first(name, MAX_VARIABLE_NAME)?;
        for (at, found) in name.chars().enumerate() {
            if !found.is_ascii_alphanumeric() && found != '_' {
                let expected = "a letter, a digit or an underscore";
                return Err(NameError::Character { expected, found, at });
            }
        }
        Ok(VariableName {
            name: name.to_ascii_uppercase(),
            subscripts,
        })
    }
}

impl fmt::Display for VariableName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)?;
        if self.subscripts.is_empty() {
            return Ok(());
        }
        let list: Vec<String> = self.subscripts.iter().map(ToString::to_string).collect();
        write!(f, "({})", list.join(","))
    }
}

/// The name and the subscripts of `NAME(1,2)`; none of a plain name.
///
/// # Errors
/// [`NameError::Subscripts`].
pub fn split_subscripts(text: &str) -> Result<(&str, Vec<i32>), NameError> {
    let (name, list) = text.split_at(text.find('(').unwrap_or(text.len()));
    let found = list.to_string();
    let subscripts = subscripts(list).ok_or(NameError::Subscripts { found })?;
    Ok((name, subscripts))
}

/// The numbers of `(1,2)`, none of an empty text.
fn subscripts(text: &str) -> Option<Vec<i32>> {
    if text.is_empty() {
        return Some(Vec::new());
    }
    let inner = text.strip_prefix('(')?.strip_suffix(')')?;
    let numbers = inner.split(',').map(|one| one.trim_matches(' ').parse().ok());
    let numbers: Vec<i32> = numbers.collect::<Option<_>>()?;
    (numbers.len() <= MAX_SUBSCRIPTS).then_some(numbers)
}

/// The rules that all names share: the length, and a letter at the front.
fn check_first(text: &str, limit: usize) -> Result<(), NameError> {
    let found = text.chars().next().ok_or(NameError::Empty)?;
    if !found.is_ascii_alphabetic() {
        let (expected, at) = ("a letter", 0);
        return Err(NameError::Character { expected, found, at });
    }
    let length = text.chars().count();
    if length > limit {
        Err(NameError::TooLong { limit, length })
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString;

    // clause: S8
    #[test]
    fn the_editors_names_have_eight_characters_and_three() {
        for (name, fits) in [
            ("A", true),
            ("ABCDEFGH", true),
            ("ABCDEFGHI", false),
            ("ABCDEFGH.PAR", true),
            ("ABCDEFGHI.PA", false),
            ("TEST.DATA", false),
            ("ABCDEFGHIJKL", false),
        ] {
            assert_eq!(FileName::parse(name).unwrap().fits_editor(), fits, "{name}");
        }
        assert_ne!(FileName::parse("TEST"), FileName::parse("TEST.PAR"));
    }

    // clause: DIR-01 DIR-04 CMD-DL-08
    #[test]
    fn file_names() {
        for (text, name) in [
            ("A", "A"),
            ("abc", "ABC"),
            ("Abc.D", "ABC.D"),
            ("ETHERNET.PAR", "ETHERNET.PAR"),
            ("abcdefghijkl", "ABCDEFGHIJKL"),
            ("A1.2", "A1.2"),
        ] {
            let parsed = FileName::parse(text).unwrap();
            assert_eq!((parsed.as_str(), parsed.to_string().as_str()), (name, name));
        }
        for text in [
            "",
            "1ABC",
            "ABCDEFGHIJKLM",
            "A.B.C",
            "A.",
            ".A",
            "A B",
            "A_B",
            "A/B",
            "..",
            "\u{c4}B",
            "A\u{c4}",
        ] {
            assert!(FileName::parse(text).is_err(), "{text}");
        }
        assert_eq!(
            FileName::parse("A.").map_err(|error| error.to_string()),
            Err(NameError::NoExtension.to_string())
        );
        let error = FileName::parse("AB.C.D").map_err(|error| error.to_string());
        assert_eq!(
            error,
            Err("character 5 is '.', not a letter or a digit".to_string())
        );
        let error = VariableName::parse("5x").map_err(|error| error.to_string());
        assert_eq!(error, Err("character 1 is '5', not a letter".to_string()));
    }

    #[test]
    fn parameter_files_are_known_by_name() {
        for (text, expected) in [
            ("user.par", true),
            ("ETHERNET.PAR", true),
            ("STRING.PAR", true),
            ("OTHER.PAR", false),
            ("USER", false),
        ] {
            assert_eq!(
                FileName::parse(text).map(|name| name.is_parameter()),
                Ok(expected)
            );
        }
    }

    // clause: CMD-MR-02 CMD-MR-03 CMD-MW-03
    #[test]
    fn variable_names() {
        for (text, shown) in [
            ("a", "A"),
            ("ABCDEFGHIJ", "ABCDEFGHIJ"),
            ("Tbl(2)", "TBL(2)"),
            ("TBL(1, 3)", "TBL(1,3)"),
            ("A_1(-1,2,3,4)", "A_1(-1,2,3,4)"),
        ] {
            let parsed = VariableName::parse(text).unwrap();
            assert_eq!(parsed.to_string(), shown);
            assert_eq!(VariableName::parse(shown), Ok(parsed));
        }
        for text in [
            "",
            "1A",
            "ABCDEFGHIJK",
            "A(",
            "A()",
            "A(1",
            "A(1,)",
            "A(x)",
            "A(1)2",
            "A B",
            "(1)",
            "A(1,2,3,4,5)",
            "A(99999999999)",
        ] {
            assert!(VariableName::parse(text).is_err(), "{text}");
        }
    }
}
