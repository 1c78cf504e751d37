//! How the text forms of actions (`action_text`) and conditions (`condition_text`) are cut into words.

use crate::prelude::*;
use ts3100_proto::words::UnexpectedWord;

/// The first word, and what follows it.
pub(crate) fn split(words: &str) -> (&str, &str) {
    words.split_once(' ').unwrap_or((words, ""))
}

/// A text that has to be one word and no more.
pub(crate) fn single_word(expected: &'static str, word: &str) -> Result<String, UnexpectedWord> {
    if word.is_empty() || word.contains(' ') {
        return Err(UnexpectedWord::new(expected, word));
    }
    Ok(word.to_string())
}
