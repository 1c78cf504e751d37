//! Whether a word can be the name of a program, a label, a variable or a datum.

use crate::builtin::is_reserved;
use crate::lexer::leading_word;
use crate::options::Arm;
use crate::prelude::*;

/// Error of a word that cannot be a name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    #[error("{0:?} cannot be a name: a name has letters, digits and _, and begins with a letter")]
    Spelling(String),
    #[error("{0} cannot be a name: it is a word of the language")]
    Reserved(String),
}

/// Checks whether a word, in any case, can be a name.
///
/// # Errors
/// [`NameError`]: the spelling does not fit, or the language has the word.
pub fn check_name(word: &str, arm: Arm) -> Result<(), NameError> {
    let begins = word.starts_with(|letter: char| letter.is_ascii_alphabetic());
    if !begins || !leading_word(word).1.is_empty() {
        return Err(NameError::Spelling(word.into()));
    }
    let word = word.to_ascii_uppercase();
    match is_reserved(&word, arm) {
        true => Err(NameError::Reserved(word)),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_the_language_and_other_spellings_are_no_names() {
        assert_eq!(check_name("pick_2", Arm::Scara), Ok(()));
        assert_eq!(
            check_name("move", Arm::Scara),
            Err(NameError::Reserved("MOVE".into()))
        );
        for word in ["", "2P", "A-B", "P\u{e9}", "A B"] {
            assert_eq!(
                check_name(word, Arm::Scara),
                Err(NameError::Spelling(word.into())),
                "{word}"
            );
        }
    }
}
