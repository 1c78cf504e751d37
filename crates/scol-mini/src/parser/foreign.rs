//! Blocks of other languages: the line that opens one is an error, and those that divide and close it belong to it.
//!
//! The help for such words is in `suggest`.

use crate::prelude::*;

use super::Cursor;
use crate::lexer::{Token, leading_word};

/// A block of another language.
#[derive(Debug)]
pub(super) struct ForeignBlock {
    /// Words that begin it.
    openers: &'static [&'static str],
    /// Words of the lines that divide it.
    dividers: &'static [&'static str],
    /// Words of the line that closes it.
    closers: &'static [&'static str],
}

const BLOCKS: &[ForeignBlock] = &[
    ForeignBlock {
        openers: &["IF"],
        dividers: &["ELSE", "ELSEIF", "ELSIF", "ELIF"],
        closers: &["ENDIF", "END IF"],
    },
    ForeignBlock {
        openers: &["WHILE"],
        dividers: &[],
        closers: &["WEND", "ENDWHILE", "END WHILE"],
    },
    ForeignBlock {
        openers: &["REPEAT"],
        dividers: &[],
        closers: &["UNTIL", "END REPEAT"],
    },
    ForeignBlock {
        openers: &["LOOP", "DO"],
        dividers: &[],
        closers: &["LOOP", "ENDLOOP", "END LOOP", "UNTIL", "WHILE"],
    },
    ForeignBlock {
        openers: &["SELECT", "SWITCH", "CASE"],
        dividers: &["CASE", "DEFAULT", "OTHERWISE"],
        closers: &["ENDSELECT", "END SELECT", "ENDSWITCH", "ENDCASE"],
    },
];

/// Words that open a block of another language and could be calls of a program here.
const CALLS: &[&str] = &["WHILE", "REPEAT", "LOOP", "SELECT", "CASE"];
/// Words that follow END where it closes no block of ours.
const ENDED: &[&str] = &["IF", "WHILE", "FOR", "SELECT", "LOOP", "REPEAT"];

/// The block that a line with an error opens.
pub(super) fn opened(line: &str) -> Option<&'static ForeignBlock> {
    let (first, rest) = leading_word(line);
    let block = BLOCKS.iter().find(|block| block.openers.contains(&first))?;
    // An IF is one of ours unless its line ends where the statement would begin.
    let rest = rest.split('\'').next().unwrap_or_default().trim_end();
    let open = first != "IF" || rest.ends_with(" THEN") || !rest.contains(" THEN");
    open.then_some(block)
}

/// Effect of a line on the open blocks of other languages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// It divides or closes the block with this index.
    Divides,
    Closes(usize),
}

impl Cursor<'_> {
    /// The next word, or END and the word after it.
    pub(super) fn foreign_word(&self) -> String {
        let word = self.peek_word();
        match self.peek_at(1) {
            Some(Token::Word(next)) if word == "END" && ENDED.contains(&next.as_str()) => {
                format!("{word} {next}")
            }
            _ => word.to_string(),
        }
    }

    /// Whether the line begins with a word of another language that would be taken for a call.
    pub(super) fn is_foreign_call(&self) -> bool {
        CALLS.contains(&self.peek_word()) && !self.is_assignment()
    }

    /// Whether the next word is assigned.
    pub(super) fn is_assignment(&self) -> bool {
        let assigns = |token: Option<&Token>| token == Some(&Token::Sign(crate::lexer::Sign::Assign));
        assigns(self.peek_at(1))
    }
}

/// Effect of a line on the innermost of these blocks that it belongs to.
pub(super) fn part_of(open: &[&ForeignBlock], word: &str) -> Option<Part> {
    let at = open
        .iter()
        .rposition(|block| block.dividers.contains(&word) || block.closers.contains(&word))?;
    let closes = open.get(at)?.closers.contains(&word);
    Some(if closes { Part::Closes(at) } else { Part::Divides })
}
