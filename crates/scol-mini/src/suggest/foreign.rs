//! Remedies for words and signs of other languages.
//!
//! The parser keeps the lines that close a block of another language quiet (`parser::foreign`). Words of this language that
//! are misspelt are left to the parent module.

use super::{Remedy, Suggester};
use crate::builtin::{self, MOTIONS, is_channel};
use crate::diagnostic::{Diagnostic, Span};
use crate::fix::Edit;
use crate::lexer::{is_letter, leading_word};
use crate::prelude::*;

/// Words by which other languages read an input and switch an output.
const INPUTS: &[&str] = &["IN", "DI", "DIN", "INP", "INPUT", "SIGI"];
const OUTPUTS: &[&str] = &["OUT", "DO", "DOUT", "OUTPUT", "SIGO"];
/// Words that begin a statement after DO or THEN.
const BEGINNINGS: &[&str] = &[
    "DOUT", "PRINT", "MOVE", "MOVES", "DELAY", "BREAK", "RETURN", "PULOUT", "BCDOUT",
];
/// Help for a word between WAIT and its condition.
const WAIT: &str = "write the condition after WAIT, without a word between";
/// Help for a comment of another language.
const COMMENT: &str = "begin a comment with REMARK or '";

/// Remedy for a word of another language, and the word of ours where that alone is another.
fn word(word: &str) -> Option<(&'static str, Option<&'static str>)> {
    Some(match word {
        "ENDFOR" | "END FOR" => ("close a FOR with NEXT", Some("NEXT")),
        "ENDIF" | "ELSEIF" | "ELSIF" | "ELIF" | "WEND" | "ENDWHILE" | "THEN" | "ELSE" | "END IF"
        | "END WHILE" | "END SELECT" | "END LOOP" | "END REPEAT" | "ENDLOOP" | "ENDSELECT" => (
            "there are no blocks: write an IF on one line and close a FOR with NEXT",
            None,
        ),
        "WHILE" | "REPEAT" | "UNTIL" | "LOOP" | "SELECT" | "CASE" | "DO" => {
            ("use FOR and NEXT, or a label with IF ... THEN GOTO", None)
        }
        "MOVEL" | "MOVL" | "LIN" => ("did you mean MOVES, the straight motion?", Some("MOVES")),
        "GO" => ("did you mean GOTO?", Some("GOTO")),
        "PTP" => ("did you mean MOVE?", Some("MOVE")),
        "SLEEP" | "DWELL" => ("did you mean DELAY, which counts in seconds?", Some("DELAY")),
        "CALL" | "GOSUB" => ("call a program by its name alone: NAME or NAME(values)", None),
        "LET" | "VAR" | "LOCAL" => ("assign a value to make a variable: NAME = value", None),
        "CRLF" => ("end the record with CR", Some("CR")),
        "REM" => (COMMENT, Some("'")),
        "EXIT" => ("leave a loop with GOTO, a program with RETURN", None),
        "INTERRUPT" | "TRAP" => ("watch a condition with ON condition DO statement", None),
        "SUB" | "FUNCTION" | "ENDSUB" => ("write the subprogram as a PROGRAM block of its own", None),
        _ => return None,
    })
}

/// The state that a word of another language switches an output to.
fn state(word: &str) -> Option<bool> {
    match word.to_ascii_uppercase().as_str() {
        "TRUE" | "ON" | "1" | "HIGH" => Some(true),
        "FALSE" | "OFF" | "0" | "LOW" => Some(false),
        _ => None,
    }
}

/// Whether nothing is left of a line after the statement, or a comment.
fn ends_line(rest: &str) -> bool {
    let rest = rest.trim_start_matches([' ', ';']);
    rest.is_empty() || rest.starts_with(['\r', '\n', '\'', '\u{1A}'])
}

impl Suggester<'_> {
    /// Remedy for an operator or a sign of another language at the place of the error.
    pub(super) fn foreign_sign(&self, diagnostic: &Diagnostic) -> Option<Remedy> {
        let start = diagnostic.span.start;
        let (before, rest) = self.source.split_at_checked(start)?;
        let line = before.rsplit(['\r', '\n']).next().unwrap_or_default();
        let here = |length: usize| Span::new(start, start + length);
        let begins = |signs: &[&str]| signs.iter().any(|sign| rest.starts_with(sign));
        let signs = ["//", "--", ";", "#", "!", "%"];
        if line.trim().is_empty()
            && let Some(sign) = signs.iter().find(|sign| rest.starts_with(**sign))
        {
            return Some(Remedy::from(COMMENT).fix(Edit::replace(here(sign.len()), "'")));
        }
        // A word alone before an operator is not the operand of an expression.
        let operand = line.trim().contains(|c: char| !is_letter(c));
        let word = |length: usize, word: &str| Some(Edit::word(self.source, here(length), word));
        let operator = |length, text| word(length, text).filter(|_| operand);
        let doubled = |sign: &str| if rest.starts_with(sign) { 2 } else { 1 };
        Some(match rest.trim_start_matches(' ').bytes().next()? {
            b'=' if before.ends_with(':') => {
                let assign = Edit::replace(Span::new(start - 1, start + 1), "=");
                Remedy::from("assign with \"=\": NAME = value").fix(assign)
            }
            _ if begins(&["+=", "-=", "*=", "/=", "++", "--"]) => {
                let edit = self.written_out(start);
                let written = edit.as_ref().map_or("N = N + 1", |edit| &edit.text);
                Remedy::from(format!("write it out: {written}")).fix(edit)
            }
            b'/' if begins(&["/*"]) => COMMENT.into(),
            b'/' if begins(&["//"]) => Remedy::from(COMMENT).fix(Edit::replace(here(2), "'")),
            b'\'' => {
                Remedy::from("put a string between double quotes; ' begins a comment").fix(self.quoted(start))
            }
            b'|' => Remedy::from("use OR").fix(operator(doubled("||"), "OR")),
            b'&' | b'+' if joins_strings(before, rest) => {
                let joint = Span::new(before.trim_end().len(), start + 1);
                Remedy::from("separate the items of a PRINT with commas").fix(Edit::replace(joint, ","))
            }
            b'&' => Remedy::from("use AND").fix(operator(doubled("&&"), "AND")),
            b'!' => {
                let negates = negates(before);
                Remedy::from("put NOT before a condition, or compare with !=")
                    .fix(word(1, "NOT").filter(|_| negates))
            }
            b'%' if ends_value(rest.get(1..)?) => {
                let remedy = "remove it: a percentage is a number, and a name has no %";
                Remedy::from(remedy).fix(Edit::replace(here(1), ""))
            }
            b'%' => Remedy::from("use MOD for a remainder").fix(operator(1, "MOD")),
            b';' => {
                // Before a further statement it is not the end of the line that is missing.
                let remove = ends_line(rest).then(|| Edit::replace(here(1), ""));
                Remedy::from("remove it: a statement ends with its line").fix(remove)
            }
            b'#' => self.numbered_channel(start),
            b'[' => self.brackets(start)?,
            _ => return None,
        })
    }

    /// Remedy for `PRINT #1` and `INPUT #1`.
    fn numbered_channel(&self, start: usize) -> Remedy {
        let rest = self.source.get(start + 1..).unwrap_or_default();
        let (number, _) = rest.split_at(rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len()));
        let span = Span::new(start, start + 1 + number.len());
        if number == "1" {
            let remedy = Remedy::from("use COM1; a channel is TP, COM1, IP1 or IP2");
            return remedy.fix(Edit::replace(span, "COM1"));
        }
        let (word, _) = leading_word(rest);
        if is_channel(&word.to_ascii_uppercase()) {
            let remove = Edit::replace(Span::new(start, start + 1), "");
            return Remedy::from("remove it: the name of a channel has no #").fix(remove);
        }
        "use the name of a channel: TP, COM1, IP1 or IP2; a comment begins with REMARK or '".into()
    }

    /// Remedy for a subscript in brackets, with the opening one at this byte.
    fn brackets(&self, start: usize) -> Option<Remedy> {
        let (before, rest) = self.source.split_at_checked(start)?;
        let line = rest.split(['\r', '\n']).next()?;
        let (number, after) = line.get(1..)?.split_once(']')?;
        let name = before.rsplit(|c: char| !is_letter(c)).next()?;
        let span = Span::new(start - name.len(), start + number.len() + 2);
        if let Some(remedy) = self.line(name, number, span, after) {
            return Some(remedy);
        }
        let written = Edit::replace(span, format!("{name}({number})"));
        let remedy = Remedy::from(format!("write subscripts between parentheses: {}", written.text));
        Some(remedy.fix((!name.is_empty()).then_some(written)))
    }

    /// Remedy for an input or an output of another language: `IN(1)`, `OUT[1] = TRUE`. `after` is the rest of its line.
    fn line(&self, name: &str, number: &str, span: Span, after: &str) -> Option<Remedy> {
        let (name, number) = (name.to_ascii_uppercase(), number.trim());
        // Written in this way already, it is in the wrong place.
        let is_ours = [format!("DIN({number})"), format!("DOUT({number})")].contains(&self.text(span));
        if is_ours && !after.trim_start().starts_with('=') {
            return None;
        }
        if INPUTS.contains(&name.as_str()) {
            let read = Edit::replace(span, format!("DIN({number})"));
            return Some(Remedy::from(format!("read an input with {}", read.text)).fix(read));
        }
        if !OUTPUTS.contains(&name.as_str()) {
            return None;
        }
        let value = after.trim_start().strip_prefix('=');
        let Some(value) = value.filter(|value| !value.starts_with('=')) else {
            let read = Edit::replace(span, format!("DOUT({number})"));
            return Some(Remedy::from(format!("read an output with {}", read.text)).fix(read));
        };
        let (word, rest) = leading_value(value.trim_start());
        let remedy = format!("switch an output on with DOUT({number}), and off with DOUT(-{number})");
        let remedy = Remedy::from(remedy);
        let plain = number.bytes().all(|byte| byte.is_ascii_digit());
        let fix = state(word).filter(|_| plain && ends_line(rest)).map(|on| {
            let sign = if on { "" } else { "-" };
            let end = span.end + after.len() - rest.len();
            Edit::replace(Span::new(span.start, end), format!("DOUT({sign}{number})"))
        });
        Some(remedy.fix(fix))
    }

    /// Remedy for a name that reads an input or switches an output in other languages.
    pub(super) fn foreign_name(&self, diagnostic: &Diagnostic) -> Option<Remedy> {
        let span = diagnostic.span;
        let name = self.text(span);
        let rest = self.source.get(span.end..)?.split(['\r', '\n']).next()?;
        let arguments = rest.trim_start().strip_prefix('(')?;
        let (number, after) = arguments.split_once(')')?;
        let end = span.end + rest.len() - after.len();
        self.line(&name, number, Span::new(span.start, end), after)
    }

    /// `N = N + 1` for `N += 1` and `N++` with the operator at this byte; nothing where a line holds more.
    fn written_out(&self, operator: usize) -> Option<Edit> {
        let (before, rest) = self.source.split_at_checked(operator)?;
        let line = before.rsplit(['\r', '\n']).next()?;
        // After a label, THEN, ELSE or DO the last word is the target.
        let target = line.trim_end().rsplit([' ', ':']).next()?;
        let is_name = |c: char| is_letter(c) || c == '.';
        if target.is_empty() || !target.chars().all(is_name) {
            return None;
        }
        let (sign, second) = (rest.get(..1)?, rest.get(1..2)?);
        let length = rest.find(['\r', '\n', '\'', ';', '\u{1A}']).unwrap_or(rest.len());
        let written = rest.get(2..length)?.trim();
        let value = if second == "=" { written } else { "1" };
        let counts = second != "=" && !written.is_empty();
        if value.is_empty() || counts || value.to_ascii_uppercase().contains(" ELSE ") {
            return None;
        }
        let value = match value.chars().all(is_name) {
            true => value.to_string(),
            false => format!("({value})"),
        };
        let end = operator + rest.get(..length)?.trim_end().len();
        let blanks = line.len() - line.trim_end().len();
        let span = Span::new(operator - blanks - target.len(), end);
        Some(Edit::replace(span, format!("{target} = {target} {sign} {value}")))
    }

    /// Double quotes for the single quotes of a string that begins at or after this byte.
    fn quoted(&self, byte: usize) -> Option<Edit> {
        let rest = self.source.get(byte..)?;
        let line = rest.split(['\r', '\n']).next()?;
        let open = line.find('\'')?;
        let (text, after) = line.get(open + 1..)?.split_once('\'')?;
        // Two quotes, or one in a word, belong to the text.
        if after.starts_with(|c| c == '\'' || is_letter(c)) {
            return None;
        }
        let span = Span::new(byte + open, byte + open + text.len() + 2);
        (!text.contains('"')).then(|| Edit::replace(span, format!("\"{text}\"")))
    }

    /// Remedy for a word of another language at this place.
    pub(super) fn foreign(&self, span: Span) -> Option<Remedy> {
        let found = self.text(span);
        let rest = self.source.get(span.end..).unwrap_or_default();
        let rest = rest.split(['\r', '\n', '\'']).next().unwrap_or_default();
        let (help, ours) = match found.as_str() {
            // The arch motion has two points.
            "MOVJ" if rest.contains(',') => (
                "did you mean MOVEJ, the arch motion? A motion of all joints is MOVE.",
                Some("MOVEJ"),
            ),
            "MOVJ" => (
                "did you mean MOVE, the motion of all joints? MOVEJ is the arch motion, with two points.",
                Some("MOVE"),
            ),
            // The number of the hand is part of the word.
            hand @ ("OPEN" | "CLOSE") => {
                let operand = rest.trim_matches([' ', '(', ')']);
                let end = span.end + rest.trim_end().len();
                let fix = Edit::replace(Span::new(span.start, end), format!("{hand}{operand}"));
                let remedy = Remedy::from(format!("the word names the hand: {hand}1 or {hand}2"));
                return Some(remedy.fix(matches!(operand, "1" | "2").then_some(fix)));
            }
            "GO" if rest.trim().is_empty() => ("did you mean GOTO, with a label?", None),
            other => word(other)?,
        };
        let fix = match found.as_str() {
            "CALL" | "GOSUB" => {
                let (name, _) = leading_word(rest.trim_start());
                let name = name.to_ascii_uppercase();
                let known = self.outline.parts.iter().any(|part| part.name() == name);
                known.then(|| Edit::remove(self.source, span))
            }
            "LET" => Some(Edit::remove(self.source, span)),
            // Others count in milliseconds.
            "SLEEP" | "DWELL" => ours.map(|ours| Edit::replace(span, ours).uncertain()),
            _ => ours.map(|ours| Edit::replace(span, ours)),
        };
        Some(Remedy::from(help).fix(fix))
    }

    /// Remedy for a word or a sign that is missing before the place of the error.
    pub(super) fn missing(&self, diagnostic: &Diagnostic) -> Option<Remedy> {
        let span = diagnostic.span;
        let found = self.text(span);
        let (before, rest) = self.source.split_at_checked(span.start)?;
        let line = before.rsplit(['\r', '\n']).next()?;
        let words: Vec<String> = line
            .split(|c: char| !is_letter(c))
            .map(str::to_ascii_uppercase)
            .filter(|word| !word.is_empty())
            .collect();
        let has = |known: &[&str]| words.iter().any(|word| known.contains(&word.as_str()));
        let insert = |text: &str| Edit::replace(Span::at(span.start), text);
        let (expected, _) = diagnostic
            .message
            .strip_prefix("expected ")?
            .split_once(", found")?;
        let begins = |word: &str| word == "GOTO" || word == "STOP" || BEGINNINGS.contains(&word);
        Some(match (expected, found.as_str()) {
            ("DO", word) if begins(word) => {
                Remedy::from("write ON condition DO statement").fix(insert("DO "))
            }
            ("THEN", word) if begins(word) => {
                Remedy::from("write IF condition THEN statement").fix(insert("THEN "))
            }
            ("TO", ",") if has(&["FOR"]) => {
                let (_, after) = rest.split_at_checked(1)?;
                let blank = if after.starts_with(' ') { "" } else { " " };
                let to = Edit::replace(span, format!(" TO{blank}"));
                Remedy::from("count with FOR and TO, as in FOR I = 1 TO 10").fix(to)
            }
            ("the end of the line", "CRE") if has(&["PRINT"]) => {
                let joint = Span::new(before.trim_end().len(), span.end);
                Remedy::from("end the record with CR").fix(Edit::replace(joint, ", CR"))
            }
            ("the end of the line", sign) if has(MOTIONS) && !has(&["WITH"]) => {
                let comma = sign == ",";
                let next = if comma {
                    rest.get(1..)?.trim_start_matches(' ')
                } else {
                    rest
                };
                let (word, _) = leading_word(next);
                builtin::condition(&word.to_ascii_uppercase())?;
                let place = Span::new(before.trim_end().len(), self.source.len() - next.len());
                Remedy::from("put WITH before the conditions of a motion").fix(Edit::replace(place, " WITH "))
            }
            ("the end of the line", "=") if has(&["DOUT"]) => {
                let call = line.trim_end().strip_suffix(')')?;
                let (name, number) = call.rsplit_once('(')?;
                let name = name.trim_end().get(name.trim_end().len().checked_sub(4)?..)?;
                let start = before.trim_end().len() - number.len() - name.len() - 2;
                let end = before.trim_end().len();
                let after = rest.split(['\r', '\n']).next()?;
                let after = self.source.get(end..span.start + after.len())?;
                self.line(name, number, Span::new(start, end), after)?
            }
            ("\"(\"" | "\"=\" or the end of the line", _) => {
                let word = words.last().filter(|_| line.trim_end().ends_with(is_letter))?;
                if expected != "\"(\"" && !self.outline.parts.iter().any(|part| part.name() == word) {
                    return None;
                }
                self.parenthesised(word, before.trim_end().len(), span.start)
            }
            _ => return None,
        })
    }

    /// Remedy for the operands of a word without parentheses; they begin at `start`, and the word ends at `end`.
    pub(super) fn parenthesised(&self, word: &str, end: usize, start: usize) -> Remedy {
        let rest = self.source.get(start..).unwrap_or_default();
        let is_operand = |c: char| is_letter(c) || matches!(c, ',' | '-' | '.' | ' ');
        let (operands, after) = rest.split_at(rest.find(|c| !is_operand(c)).unwrap_or(rest.len()));
        let operands = operands.trim_end();
        // A word of the language may begin something else.
        let mut words = operands.split(|c: char| !is_letter(c));
        let reserved = words.any(|word| builtin::is_reserved(&word.to_ascii_uppercase(), self.arm));
        if operands.is_empty() || reserved || !ends_line(after) {
            return format!("write the values of {word} between parentheses").into();
        }
        let place = Span::new(end, start + operands.len());
        let written = Edit::replace(place, format!("({operands})"));
        Remedy::from(format!("write {word}({operands})")).fix(written)
    }

    /// Remedy for `WAIT FOR condition` and `WAIT UNTIL condition`, `FOR I IN range`, and `MOVEJ` with one point.
    pub(super) fn surplus_word(&self, diagnostic: &Diagnostic) -> Option<Remedy> {
        let before = self.source.get(..diagnostic.span.start)?.trim_end();
        let line = before.rsplit(['\r', '\n']).next()?.to_ascii_uppercase();
        let last = line.rsplit([' ', ':']).next()?;
        match (last, self.text(diagnostic.span).as_str()) {
            ("WAIT", "FOR" | "UNTIL") => {
                let remove = Edit::remove(self.source, diagnostic.span);
                Some(Remedy::from(WAIT).fix(remove))
            }
            // UNTIL was taken for the condition.
            ("UNTIL", _) if line.trim_end_matches("UNTIL").trim_end().ends_with("WAIT") => {
                let span = Span::new(before.len() - "UNTIL".len(), before.len());
                Some(Remedy::from(WAIT).fix(Edit::remove(self.source, span)))
            }
            // One point, and the end of the line.
            (_, "") if line.trim_start().starts_with("MOVEJ ") && !line.contains(',') => {
                let start = before.len() - line.trim_start().len();
                let word = Span::new(start, start + "MOVEJ".len());
                let remedy = "MOVEJ is the arch motion, with two points; a motion of all joints is MOVE";
                Some(Remedy::from(remedy).fix(Edit::replace(word, "MOVE")))
            }
            (word, _) if diagnostic.message.ends_with("found the end of the line") && word == "DO" => {
                Some("write the statement on the same line: ON condition DO statement".into())
            }
            (_, "IN") if line.contains("FOR ") => Some("count with FOR and TO, as in FOR I = 1 TO 10".into()),
            _ => None,
        }
    }
}

/// Whether `!` after this text is the NOT of a condition. Directly after `=` it may be the `!=` of a slip.
fn negates(before: &str) -> bool {
    let text = before.trim_end();
    let word = text.rsplit(|c: char| !is_letter(c)).next().unwrap_or_default();
    let joints = ["IF", "AND", "OR", "WAIT", "ON"];
    let assigned = text.ends_with('=') && before.ends_with(' ');
    text.ends_with('(') || assigned || joints.iter().any(|joint| joint.eq_ignore_ascii_case(word))
}

/// Whether a value ends before this text: with its line, or at a sign that follows values.
fn ends_value(rest: &str) -> bool {
    ends_line(rest) || rest.trim_start_matches(' ').starts_with([',', ')'])
}

/// Whether an operator joins strings in a PRINT.
fn joins_strings(before: &str, rest: &str) -> bool {
    let line = before.rsplit(['\r', '\n']).next().unwrap_or_default();
    let mut words = line.split(|c: char| !is_letter(c));
    let prints = words.any(|word| word.eq_ignore_ascii_case("PRINT"));
    let after = rest.get(1..).unwrap_or_default().trim_start_matches(' ');
    prints && (line.trim_end().ends_with('"') || after.starts_with('"'))
}

/// The word or the number a text begins with, and what follows it.
fn leading_value(text: &str) -> (&str, &str) {
    let end = text.find(|c: char| !is_letter(c));
    text.split_at(end.unwrap_or(text.len()))
}
