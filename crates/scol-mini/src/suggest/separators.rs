//! Remedies for a comma, an equals sign, a parenthesis or a value that is missing between two words.
//!
//! It looks at the tokens around the place of an error. Words and signs of other languages are in `foreign`.

use super::{Remedy, Suggester, is_nearly};
use crate::builtin::{self, MOTIONS, WordKind, is_channel, word_kind};
use crate::diagnostic::{Diagnostic, Span};
use crate::fix::Edit;
use crate::lexer::{Lexeme, Sign, Token};
use crate::outline::word;
use crate::prelude::*;

/// Words that join two parts of a statement: a value comes before each.
const JOINTS: &[&str] = &["WITH", "THEN", "ELSE", "DO", "TO", "STEP", "AND", "OR", "MOD"];

impl Suggester<'_> {
    /// Remedy for two values side by side, and for a list that is not closed.
    pub(super) fn separator(&self, diagnostic: &Diagnostic) -> Option<Remedy> {
        let (before, rest) = self.statement_around(diagnostic)?;
        let (head, last, next) = (word(before.first()), before.last()?, rest.first());
        let (expected, _) = diagnostic
            .message
            .strip_prefix("expected ")?
            .split_once(", found")?;
        let insert = |text: &str| {
            let end = next.map_or(last.span.end, |next| next.span.start);
            Edit::replace(Span::new(last.span.end, end), text)
        };
        let is_value = next.is_some_and(|next| self.begins_value(next));
        let comma = |help: &str| Some(Remedy::from(help).fix(insert(", ")));
        match expected {
            "the end of the line" if !is_value => None,
            "the end of the line" if before.iter().any(|lexeme| lexeme.word() == "WITH") => {
                builtin::condition(word(next))?;
                comma("separate the conditions after WITH with commas")
            }
            "the end of the line" if last.word() == "CR" => None,
            "the end of the line" if head == "PRINT" => comma("separate the items of a PRINT with commas"),
            "the end of the line" if matches!(head, "INPUT" | "RESTORE") => {
                comma(&format!("separate the names after {head} with commas"))
            }
            "\",\"" if is_value && is_channel(last.word()) => comma("put a comma after the channel"),
            "\",\"" if is_value && matches!(head, "MOVEA" | "MOVEI") => comma(&format!(
                "put a comma between the axis and the value, as in {head} 3, 20"
            )),
            "\",\" or \")\"" | "\",\" or \"}\"" if is_value => {
                // What looks like a sign may have been taken for a minus.
                let computes = |lexeme: &Lexeme| lexeme.is(Sign::Minus) || lexeme.is(Sign::Plus);
                let edit = insert(", ");
                let edit = match before.iter().any(computes) {
                    true => edit.uncertain(),
                    false => edit,
                };
                Some(Remedy::from("separate the values with commas").fix(edit))
            }
            "\",\" or \")\"" | "\")\"" if next.is_none() => {
                // The list may end earlier.
                Some(Remedy::from("close the parenthesis with )").fix(insert(")").uncertain()))
            }
            "\",\" or \")\"" | "\")\"" if JOINTS.contains(&word(next)) => {
                Some("close the parenthesis with )".into())
            }
            "\"=\"" if is_value && builtin::condition(last.word()).is_some() => {
                Some(Remedy::from(format!("write {} = value", last.word())).fix(insert(" = ")))
            }
            "\"=\"" if is_value && head == "FOR" && before.len() == 2 => {
                Some(Remedy::from("count with FOR and TO, as in FOR I = 1 TO 10").fix(insert(" = ")))
            }
            _ => None,
        }
    }

    /// Remedy for a word that joins two values and has none before it.
    pub(super) fn missing_value(&self, diagnostic: &Diagnostic) -> Option<Remedy> {
        let found = self.text(diagnostic.span);
        if !diagnostic.message.starts_with("expected a value") || !JOINTS.contains(&found.as_str()) {
            return None;
        }
        let (before, _) = self.statement_around(diagnostic)?;
        let last = word(before.last());
        Some(match last {
            "MOVEA" | "MOVEI" => {
                format!("write the axis and the value before {found}: {last} 3, 20 {found} ...").into()
            }
            _ if MOTIONS.contains(&last) => {
                format!("the point is missing: write it before {found}, as in {last} P1 {found} ...").into()
            }
            _ => format!("a value is missing before {found}").into(),
        })
    }

    /// Remedy for a call without parentheses: `PLACE N, 20`.
    pub(super) fn bare_call(&self, diagnostic: &Diagnostic) -> Option<Remedy> {
        let name = self.text(diagnostic.span);
        let mut parts = self.outline.parts.iter();
        if !parts.any(|part| part.name() == name) {
            return None;
        }
        let rest = self.source.get(diagnostic.span.end..)?;
        let blanks = rest.len() - rest.trim_start_matches(' ').len();
        Some(self.parenthesised(&name, diagnostic.span.end, diagnostic.span.end + blanks))
    }

    /// Whether a token can be the first of a value. A misspelt operator is none.
    fn begins_value(&self, lexeme: &Lexeme) -> bool {
        match &lexeme.token {
            Token::Integer(_) | Token::Real(_) | Token::Text(_) => true,
            Token::Sign(_) => false,
            Token::Word(word) => match word_kind(word, self.arm) {
                Some(kind) => {
                    matches!(
                        kind,
                        WordKind::Function | WordKind::Variable | WordKind::Condition | WordKind::Constant
                    )
                }
                None => !JOINTS.iter().any(|joint| is_nearly(word, joint)),
            },
        }
    }
}
