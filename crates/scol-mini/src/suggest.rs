//! Suggestions for errors: the word that was probably meant, the first of two declarations, the missing END.
//!
//! It works on finished diagnostics and on the rows of `outline`; finding errors is left to the compiler.

mod foreign;
mod separators;

use crate::prelude::*;
use alloc::collections::BTreeSet;

use crate::builtin::{self, Builtin, System};
use crate::diagnostic::{Diagnostic, Severity, Span};
use crate::fix::Edit;
use crate::lexer::{Lexeme, Sign, leading_word, lines, tokens};
use crate::options::Arm;
use crate::outline::{Outline, Part, Row, names, word};
use crate::points::TaughtPoint;
use crate::program::Program;
use crate::{MAX_LINE, MAX_SOURCE};

/// Longest word for which a suggestion is sought.
const MAX_WORD: usize = 24;
/// Most words that a misspelt word is compared with.
const MAX_CANDIDATES: usize = 1_000;
/// Words of channels of other generations, or close to one.
pub(crate) const CHANNELS: &[&str] = &["COM0", "COM2", "COM3", "IP0", "IP3", "IP4", "HOST", "TTY"];

/// Adds a remedy to every error that has one. `points` are those of the table of taught points.
pub(crate) fn attach(source: &str, arm: Arm, points: &[TaughtPoint], diagnostics: &mut [Diagnostic]) {
    if source.len() > MAX_SOURCE || !diagnostics.iter().any(|d| d.severity == Severity::Error) {
        return;
    }
    let missing = diagnostics.iter().filter(|d| d.code == "E0201");
    let suggester = Suggester {
        source,
        arm,
        outline: Outline::new(source),
        points,
        missing: missing
            .map(|d| d.span.text(source).to_ascii_uppercase())
            .collect(),
    };
    // The parser knows the remedy of an error to which it has attached a fix.
    let open =
        |diagnostic: &&mut Diagnostic| diagnostic.severity == Severity::Error && diagnostic.fix.is_none();
    for diagnostic in diagnostics.iter_mut().filter(open) {
        if let Some(remedy) = suggester.remedy(diagnostic) {
            let guess = remedy.help.starts_with("did you mean");
            match diagnostic.help.take() {
                Some(help) if guess => {
                    diagnostic.help = Some(format!("{} Otherwise: {help}", remedy.help));
                    diagnostic.fix = remedy.fix.map(Box::new);
                }
                Some(help) if !matches!(diagnostic.code, "E0201" | "E0202") => {
                    diagnostic.fix = remedy.fix.filter(|_| remedy.help == help).map(Box::new);
                    diagnostic.help = Some(help);
                }
                _ => {
                    diagnostic.help = Some(remedy.help);
                    diagnostic.fix = remedy.fix.map(Box::new);
                }
            }
        }
    }
}

/// Adds a remedy to every error of a statement that is executed directly and sees the names of this program.
pub(crate) fn attach_direct(statement: &str, base: &Program, diagnostics: &mut [Diagnostic]) {
    let suggester = Suggester {
        source: statement,
        arm: base.options.arm,
        outline: Outline::default(),
        points: &[],
        missing: BTreeSet::new(),
    };
    for diagnostic in diagnostics.iter_mut() {
        let found = suggester.text(diagnostic.span);
        let remedy = match diagnostic.code {
            "E0101" | "E0206" if suggester.has_decimal_comma(diagnostic) => {
                Some("a comma separates values; write decimals with a point, as in 0.5".into())
            }
            "E0101" | "E0103" | "E0002" => suggester.foreign_sign(diagnostic).or_else(|| {
                let word = suggester.foreign(diagnostic.span);
                word.filter(|_| diagnostic.code == "E0103")
                    .or_else(|| suggester.keyword(diagnostic))
                    .or_else(|| fixed(diagnostic.code))
            }),
            "E0201" if !CHANNELS.contains(&found.as_str()) => {
                let systems = builtin::words().filter(|word| System::from_word(word).is_some());
                let names = base.symbols.shared.keys().map(String::as_str);
                did_you_mean(&found, diagnostic.span, names.chain(systems))
            }
            "E0201" => suggester.name(&found, None, diagnostic),
            // A bare word that is no program of the file was meant to be a statement.
            "E0501" => {
                let known = base.blocks.iter().any(|block| block.name == found);
                let known = known || builtin::words().any(|word| word == found);
                did_you_mean(&found, diagnostic.span, builtin::words()).filter(|_| !known)
            }
            code => fixed(code),
        };
        if let Some(remedy) = remedy {
            diagnostic.help = Some(remedy.help);
            diagnostic.fix = remedy.fix.map(Box::new);
        }
    }
}

/// Help for an error, and the change that carries it out where one is certain.
struct Remedy {
    help: String,
    fix: Option<Edit>,
}

impl Remedy {
    fn fix(self, fix: impl Into<Option<Edit>>) -> Remedy {
        let fix = fix.into();
        Remedy { fix, ..self }
    }
}

impl<T: Into<String>> From<T> for Remedy {
    fn from(help: T) -> Remedy {
        let (help, fix) = (help.into(), None);
        Remedy { help, fix }
    }
}

struct Suggester<'a> {
    source: &'a str,
    arm: Arm,
    outline: Outline,
    points: &'a [TaughtPoint],
    /// Names that nothing gives a value, so none of them is what another name ought to be.
    missing: BTreeSet<String>,
}

impl Suggester<'_> {
    fn remedy(&self, diagnostic: &Diagnostic) -> Option<Remedy> {
        let found = self.text(diagnostic.span);
        let part = self.outline.part_of(diagnostic.line);
        let own = match diagnostic.code {
            "E0101" if diagnostic.message.ends_with("found \":\"") => {
                Some("put one statement on a line; a label begins the line".into())
            }
            "E0002" => self.foreign_sign(diagnostic),
            "E0101" if diagnostic.message == "expected THEN, found the end of the line" => {
                Some("write an IF on one line: IF condition THEN statement".into())
            }
            "E0101" if diagnostic.message == "expected a statement, found the end of the line" => self
                .one_line_if(diagnostic)
                .or_else(|| self.surplus_word(diagnostic)),
            "E0215" => self.closed_loop(diagnostic, part?),
            "E0101" => {
                let sign = self.foreign_sign(diagnostic);
                sign.or_else(|| self.surplus_word(diagnostic))
                    .or_else(|| self.missing(diagnostic))
                    .or_else(|| self.separator(diagnostic))
                    .or_else(|| self.keyword(diagnostic))
            }
            "E0301" => self.keyword(diagnostic),
            "E0208" => self
                .surplus_word(diagnostic)
                .or_else(|| self.foreign_name(diagnostic))
                .or_else(|| self.missing_value(diagnostic)),
            "E0212" => self.foreign_name(diagnostic),
            "E0103" if diagnostic.message.ends_with("is not a statement") => self
                .bare_call(diagnostic)
                .or_else(|| self.foreign(diagnostic.span))
                .or_else(|| self.keyword(diagnostic)),
            "E0103" => self.foreign(diagnostic.span).or_else(|| self.keyword(diagnostic)),
            "E0201" => self
                .name(&found, part, diagnostic)
                .or_else(|| truth(&found, diagnostic.span)),
            "E0210" => truth(&found, diagnostic.span),
            "E0202" => self.label(&found, part?, diagnostic.span),
            "E0206" => self.heading(&found).map(Into::into),
            "E0203" => self.foreign(diagnostic.span).or_else(|| {
                let programs = self.outline.parts.iter().filter_map(|part| part.name.as_ref());
                let words = programs.map(|name| name.text.as_str());
                // A misspelt END is one where a block could end, which the parser decides.
                let words = words.chain(builtin::words()).filter(|word| *word != "END");
                let meant = did_you_mean(&found, diagnostic.span, words);
                let add = || format!("add PROGRAM {} to the file", found.trim_matches('"')).into();
                meant.or_else(|| Some(add()))
            }),
            "E0404" => {
                let frames = self.outline.data.iter().filter(|row| row.head() == "TRANS");
                let names = frames.filter_map(Row::datum).map(|(name, _)| name);
                did_you_mean(&found, diagnostic.span, names)
            }
            "E0205" => self.first(&found, part, diagnostic).map(Into::into),
            "E0302" if diagnostic.message.starts_with("expected") => {
                let end = Edit::line_before(self.source, diagnostic.span.start, "END");
                Some(Remedy::from("close every GLOBAL, PROGRAM and DATA with its own END").fix(end))
            }
            "E0302" => {
                let last = lines(self.source).len();
                let end = Edit::last_line(self.source, "END");
                Some(Remedy::from(format!("add END after line {last}")).fix(end))
            }
            _ => None,
        };
        own.or_else(|| fixed(diagnostic.code))
    }

    /// Whether the error is about a comma between two digits, or about too many values of which some have one.
    fn has_decimal_comma(&self, diagnostic: &Diagnostic) -> bool {
        let digit = |byte: Option<&u8>| byte.is_some_and(u8::is_ascii_digit);
        let source = self.source.as_bytes();
        let is_one = |at: usize| {
            let before = at.checked_sub(1).and_then(|before| source.get(before));
            source.get(at) == Some(&b',') && digit(before) && digit(source.get(at + 1))
        };
        match diagnostic.code {
            // What follows the comma in `WITH SPEED=50,5` ought to be a condition.
            "E0101" => {
                let at = diagnostic.span.start;
                is_one(at) || at.checked_sub(1).is_some_and(is_one)
            }
            _ => (0..source.len()).any(is_one),
        }
    }

    fn text(&self, span: Span) -> String {
        span.text(self.source).to_ascii_uppercase()
    }

    /// The tokens of the statement that the error is in, before its place and from there to the end of the line.
    fn statement_around(&self, diagnostic: &Diagnostic) -> Option<(Vec<Lexeme>, Vec<Lexeme>)> {
        // A line outside all blocks has words as well.
        let at = usize::try_from(diagnostic.line).ok()?.checked_sub(1)?;
        let mut line = tokens(self.source, lines(self.source).get(at)?.span, MAX_LINE).ok()?;
        let split = line.partition_point(|lexeme| lexeme.span.start < diagnostic.span.start);
        let rest = line.split_off(split);
        // It begins after a label, THEN, ELSE or DO, or with the line.
        let joints =
            |lexeme: &Lexeme| matches!(lexeme.word(), "THEN" | "ELSE" | "DO") || lexeme.is(Sign::Colon);
        let begin = line.iter().rposition(joints).map_or(0, |at| at + 1);
        Some((line.split_off(begin), rest))
    }

    /// A word of the language that is misspelt: at the place of the error, or at the beginning of its statement.
    fn keyword(&self, diagnostic: &Diagnostic) -> Option<Remedy> {
        let (before, rest) = self.statement_around(diagnostic)?;
        // A name of the file is spelt as it is meant.
        let shared = self.outline.shared();
        // What the parser waited for comes before any other word.
        let expected = diagnostic.message.split(", found").next().unwrap_or_default();
        let is_reserved = |word: &&str| builtin::is_reserved(word, self.arm);
        let words = [rest.first(), before.first()]
            .into_iter()
            .flatten()
            .map(|lexeme| (lexeme.word(), lexeme.span));
        let unknown =
            |(word, _): &(&str, Span)| !word.is_empty() && !is_reserved(word) && !shared.contains_key(word);
        words.filter(unknown).find_map(|(text, span)| {
            let mut awaited = expected.split([' ', ',', '"']).filter(is_reserved).peekable();
            // Where it waited for certain words, no other is right.
            let any = awaited.peek().is_none();
            let meant = self.foreign(span).filter(|_| any);
            let meant = meant.or_else(|| did_you_mean(text, span, awaited));
            meant.or_else(|| did_you_mean(text, span, builtin::words()).filter(|_| any))
        })
    }

    fn name(&self, found: &str, part: Option<&Part>, diagnostic: &Diagnostic) -> Option<Remedy> {
        if CHANNELS.contains(&found) {
            return Some("use TP, COM1, IP1 or IP2".into());
        }
        if let Some(remedy) = self.foreign_name(diagnostic) {
            return Some(remedy);
        }
        if found == "CRLF" {
            return self.foreign(diagnostic.span);
        }
        let shared = self.outline.shared();
        let call = diagnostic.message.contains("neither an array nor a function");
        let words = builtin::words().filter(|word| match call {
            true => Builtin::from_word(word).is_some(),
            false => System::from_word(word).is_some(),
        });
        let rows = part.into_iter().flat_map(|part| &part.rows);
        let locals = rows
            .flat_map(Row::segments)
            .filter(|segment| gives_value(segment));
        let locals = locals.filter_map(|segment| names(segment, self.arm).next());
        let locals = locals.map(|(name, _)| name).filter(|name| *name != found);
        let parameters = part.into_iter().flat_map(|part| &part.parameters);
        let parameters = parameters.map(|parameter| parameter.text.as_str());
        let variables = shared.keys().copied().chain(parameters).chain(locals);
        let points = self.points.iter().map(|point| point.name.as_str());
        let known = variables
            .chain(points)
            .filter(|name| !self.missing.contains(*name));
        did_you_mean(found, diagnostic.span, words.chain(known))
    }

    fn label(&self, found: &str, part: &Part, span: Span) -> Option<Remedy> {
        let own = part.rows.iter().filter_map(|row| row.label.as_ref());
        did_you_mean(found, span, own.map(|name| name.text.as_str())).or_else(|| {
            let mut parts = self.outline.parts.iter();
            let other = parts.find(|other| other.labelled(found).is_some())?;
            let name = &other.name.as_ref()?.text;
            Some(format!("{found} is a label of PROGRAM {name}").into())
        })
    }

    /// NEXT before the END of a program with one loop that is not closed.
    fn closed_loop(&self, diagnostic: &Diagnostic, part: &Part) -> Option<Remedy> {
        let is_head = |row: &&Row, word: &str| row.head() == word;
        let count = |word: &str| part.rows.iter().filter(|row| is_head(row, word)).count();
        let row = part.rows.iter().find(|row| row.line.number == diagnostic.line)?;
        let last = usize::try_from(part.last).ok()?.checked_sub(1)?;
        let end = lines(self.source).get(last)?.span;
        let margin = |text: &str| text.len() - text.trim_start_matches(' ').len();
        let (outer, inner) = (
            margin(end.text(self.source)),
            margin(row.line.span.text(self.source)),
        );
        let is_end = end.text(self.source).trim().eq_ignore_ascii_case("END");
        if count("FOR") != count("NEXT") + 1 || !is_end {
            return None;
        }
        let next = format!(
            "{}NEXT {}",
            " ".repeat(inner.saturating_sub(outer)),
            word(row.body.get(1))
        );
        // The loop may end earlier.
        let edit = Edit::line_before(self.source, end.start, &next).uncertain();
        Some(Remedy::from("close the loop with NEXT and its variable").fix(edit))
    }

    /// An IF of three lines, of which the second is its only statement, on one line.
    fn one_line_if(&self, diagnostic: &Diagnostic) -> Option<Remedy> {
        let at = usize::try_from(diagnostic.line).ok()?.checked_sub(1)?;
        let lines = lines(self.source);
        let [head, inner, close] = lines.get(at..at + 3)? else {
            return None;
        };
        let texts = [head, inner, close].map(|line| line.span.text(self.source).trim());
        let [head_text, statement, closer] = texts;
        let closer = closer.to_ascii_uppercase();
        let (first, _) = leading_word(statement);
        let is_alone = !["IF", "FOR", "NEXT", "ELSE", "END", "REMARK", ""]
            .iter()
            .any(|word| first.eq_ignore_ascii_case(word));
        let has_more = statement.contains([':', '\'']);
        let is_if = head_text.to_ascii_uppercase().ends_with("THEN") && !head_text.contains('\'');
        if !is_if || !is_alone || has_more || !matches!(closer.as_str(), "ENDIF" | "END IF") {
            return None;
        }
        let end = head.span.start + head.span.text(self.source).trim_end().len();
        let edit = Edit::replace(Span::new(end, close.span.end), format!(" {statement}"));
        Some(Remedy::from("write an IF on one line, with a statement after THEN and ELSE").fix(edit))
    }

    /// Help that names the line of the first of two declarations.
    fn first(&self, found: &str, part: Option<&Part>, diagnostic: &Diagnostic) -> Option<String> {
        let line = if diagnostic.message.starts_with("the label") {
            part?.labelled(found)?.line.number
        } else if diagnostic.message.starts_with("the program") {
            let mut parts = self.outline.parts.iter();
            parts.find(|part| part.name() == found)?.first
        } else {
            let shared = self.outline.shared();
            let first = shared.get(found.trim())?.start;
            let before = Span::new(0, first).text(self.source);
            u32::try_from(lines(before).len()).ok()?.max(1)
        };
        (line < diagnostic.line).then(|| format!("the first one is on line {line}; rename one of them"))
    }

    /// Help that shows the declaration of the called program.
    fn heading(&self, call: &str) -> Option<String> {
        let words = call.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
        let mut parts = self.outline.parts.iter();
        let part = parts.find(|part| words.contains(&part.name()))?;
        Some(format!("line {} declares it as {}", part.first, part.heading()))
    }
}

/// Remedies that depend on the code alone.
fn fixed(code: &str) -> Option<Remedy> {
    let remedy = match code {
        "E0002" => "remove it; strings are written between double quotes, comments after '",
        "E0004" => "use ASCII characters only, in comments too",
        "E0006" => "close the string with \" on the same line; a string cannot contain a double quote",
        "E0001" => "divide it into several files; the host selects one at a time",
        "E0005" => "split it into several statements: a statement cannot continue on the next line",
        "E0007" => "use at most 2147483647 for an integer or 3.4E38 for a real",
        "E0009" => "correct the errors above first",
        "E0102" => "put CR last, or begin another PRINT",
        "E0104" => "assign the inner part to a variable first, or move it to a subprogram",
        "E0205" => "remove or rename one of them",
        "E0207" => {
            "use POINT(...), TRANS(...) or PAYLOAD(...) for a position, a coordinate system or a load; P.X is a number"
        }
        "E0208" => "choose another name",
        "E0210" => "give it a constant here, and compute it at the beginning of the main program",
        "E0212" => "declare an array with DIM NAME(n); its elements are NAME(0) to NAME(n)",
        "E0213" => "use as many subscripts as in DIM, each from 0 to the number there",
        "E0214" => "make the arrays smaller",
        "E0215" => "close the loop with NEXT and its variable",
        "E0216" => "remove it, or write the FOR that it closes",
        "E0217" => "close the inner loop first",
        "E0301" => "order the file: GLOBAL (at most once), the PROGRAM blocks, DATA (at most once)",
        "E0303" => "remove it, or write the GLOBAL, PROGRAM or DATA that it closes",
        "E0304" => "begin with PROGRAM NAME and close it with END",
        "E0401" => "remove the surplus numbers at the end; omitted numbers are 0",
        "E0402" => "write the digits of shoulder, elbow, wrist, axis 4 and axis 6; 0 leaves one open",
        "E0403" => "shorten it: hosts reach names of at most 10 characters",
        _ => return None,
    };
    Some(remedy.into())
}

/// Whether a statement can give a variable its value.
fn gives_value(segment: &[Lexeme]) -> bool {
    matches!(word(segment.first()), "DIM" | "FOR" | "INPUT")
        || segment
            .iter()
            .any(|lexeme| lexeme.is(Sign::Assign) || lexeme.is(Sign::Open))
}

/// TRUE or FALSE, misspelt. The change is certain where letters are swapped alone: another word may be a name.
fn truth(found: &str, span: Span) -> Option<Remedy> {
    let letters = |word: &str| word.bytes().collect::<BTreeSet<_>>();
    let word = nearest(found, ["TRUE", "FALSE"].into_iter())?;
    let is_swapped = word.len() == found.len() && letters(word) == letters(found);
    let edit = Edit::replace(span, word);
    let edit = if is_swapped { edit } else { edit.uncertain() };
    Some(Remedy::from(format!("did you mean {word}?")).fix(edit))
}

/// Whether `found` is the word or a misspelling of it.
pub(crate) fn is_nearly(found: &str, word: &str) -> bool {
    found == word || nearest(found, [word].into_iter()).is_some()
}

/// Whether two names differ in their digits alone, as PICK1 and PICK2 do: they are two names, not a misspelt one.
fn differ_in_digits(a: &str, b: &str) -> bool {
    let letters = |name: &str| {
        name.bytes()
            .filter(|byte| !byte.is_ascii_digit())
            .collect::<Vec<_>>()
    };
    letters(a) == letters(b)
}

/// Whether a word is one of the language rather than a name of the user.
fn is_word(word: &str) -> bool {
    builtin::words().any(|known| known == word)
}

/// The nearest of the candidates, if one is near enough. Among names of the user that are equally near there is none.
pub(crate) fn nearest<'a>(found: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let most = match found.len() {
        2..=5 => 1,
        6..=MAX_WORD => 2,
        _ => return None,
    };
    // Of words equally near the one that begins with more of the same letters.
    let alike = |word: &str| {
        let letters = word.bytes().zip(found.bytes());
        letters.take_while(|(x, y)| x == y).count()
    };
    let near = |word: &&str| word.len().abs_diff(found.len()) <= most && word.len() > 1 && *word != found;
    let near = candidates.filter(near).take(MAX_CANDIDATES);
    let near = near.filter(|word| is_word(word) || !differ_in_digits(found, word));
    let rated = near.map(|word| (distance(found, word), usize::MAX - alike(word), word));
    let rated: BTreeSet<_> = rated.collect();
    let (letters, _, word) = *rated.first()?;
    let mut rivals = rated.iter().filter(|(other, _, _)| *other == letters);
    let is_tied = rivals.clone().count() > 1 && rivals.any(|(_, _, word)| !is_word(word));
    if is_tied {
        return None;
    }
    // Two letters that differ in one are no misspelling of each other unless they are swapped.
    let swapped = found.bytes().rev().eq(word.bytes());
    let short = found.len() == 2 && word.len() == 2 && !swapped;
    (letters <= most && !short).then_some(word)
}

/// Suggests the nearest of the candidates for the word at this place. The change is certain for a word of the language
/// alone.
fn did_you_mean<'a>(found: &str, span: Span, candidates: impl Iterator<Item = &'a str>) -> Option<Remedy> {
    // The name after TASK is a string.
    let quote = if found.starts_with('"') { "\"" } else { "" };
    let word = nearest(found.trim_matches('"'), candidates)?;
    let edit = Edit::replace(span, format!("{quote}{word}{quote}"));
    let edit = match is_word(word) && !differ_in_digits(found, word) {
        true => edit,
        false => edit.uncertain(),
    };
    Some(Remedy::from(format!("did you mean {word}?")).fix(edit))
}

/// Fewest letters to insert, remove, replace or swap with their neighbour.
fn distance(a: &str, b: &str) -> usize {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut older: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut row = Vec::from([i + 1]);
        for (j, y) in b.iter().enumerate() {
            let at = |row: &[usize], j: usize| row.get(j).copied().unwrap_or(usize::MAX / 2);
            let replaced = at(&last, j) + usize::from(x != y);
            let mut best = replaced.min(at(&last, j + 1) + 1).min(at(&row, j) + 1);
            if i > 0 && j > 0 && a.get(i - 1) == Some(y) && b.get(j - 1) == Some(x) {
                best = best.min(at(&older, j - 1) + 1);
            }
            row.push(best);
        }
        older = core::mem::replace(&mut last, row);
    }
    last.last().copied().unwrap_or(a.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances() {
        assert_eq!(distance("MOVE", "MOVE"), 0);
        assert_eq!(distance("MOEV", "MOVE"), 1);
        assert_eq!(distance("PRNT", "PRINT"), 1);
        assert_eq!(distance("", "PRINT"), 5);
        assert_eq!(distance("DELLAYY", "DELAY"), 2);
    }

    #[test]
    fn only_near_words_are_suggested() {
        let of = |word: &str| nearest(word, builtin::words());
        assert_eq!(of("PRNT"), Some("PRINT"));
        assert_eq!(of("MOV"), Some("MOVE"));
        assert_eq!(of("FI"), Some("IF"));
        assert_eq!(of("N"), None);
        assert_eq!(of("GRIPPER"), None);
        assert_eq!(of(&"X".repeat(300)), None);
    }

    #[test]
    fn a_name_of_the_user_is_guessed_only_where_one_is_nearest() {
        let of = |word: &str, names: &[&'static str]| nearest(word, names.iter().copied());
        assert_eq!(of("HOEM", &["HOME", "PICK1"]), Some("HOME"));
        assert_eq!(of("HOEM", &["HOME", "HOME"]), Some("HOME"));
        // Two names that differ in digits are two points.
        for (found, known) in [
            ("PICK2", "PICK1"),
            ("P11", "P1"),
            ("PICK", "PICK1"),
            ("P12", "P21"),
        ] {
            assert_eq!(of(found, &[known]), None, "{found} {known}");
        }
        // The robot would go to one of them, and which is not known.
        assert_eq!(of("SIGHT", &["RIGHT", "NIGHT"]), None);
        assert_eq!(of("SPEE", &["SPEED", "SPEC"]), None);
        let found = did_you_mean("HOEM", Span::default(), ["HOME"].into_iter()).unwrap();
        assert!(!found.fix.unwrap().is_certain);
        let found = did_you_mean("MOEV", Span::default(), ["MOVE"].into_iter()).unwrap();
        assert!(found.fix.unwrap().is_certain);
    }

    /// The text of the program after the fix of its first error, and whether the fix is certain.
    fn fixed_line(line: &str) -> Option<(String, bool)> {
        let source = format!("PROGRAM T\nN = 1\n{line}\nEND\nPROGRAM PLACE(A, B)\nEND\n");
        let point = TaughtPoint {
            name: "WAITP".into(),
            position: crate::Position::default(),
        };
        let found = crate::compile_with_points(&source, &crate::LanguageOptions::default(), &[point]);
        let fix = found.diagnostics.first()?.fix.as_ref()?;
        let text = fix.apply(&source).lines().nth(2)?.to_string();
        Some((text, fix.is_certain))
    }

    #[test]
    fn what_is_missing_between_two_values_is_inserted() {
        for (line, fixed, is_certain) in [
            ("MOVE WAITPP", "MOVE WAITP", false),
            ("PRINT IP1, \"N\"   N, CR", "PRINT IP1, \"N\", N, CR", true),
            ("PRINT IP1, TIMER CR", "PRINT IP1, TIMER, CR", true),
            ("INPUT IP1 N", "INPUT IP1, N", true),
            (
                "MOVE WAITP WITH SPEED = 5 ACCEL = 5",
                "MOVE WAITP WITH SPEED = 5, ACCEL = 5",
                true,
            ),
            ("MOVE WAITP WITH SPEED 50", "MOVE WAITP WITH SPEED = 50", true),
            ("MOVE POINT(400 0)", "MOVE POINT(400, 0)", true),
            ("MOVE POINT(400 -5 200)", "MOVE POINT(400 -5, 200)", false),
            ("N = SIN(1", "N = SIN(1)", false),
            ("PLACE N, 20", "PLACE(N, 20)", true),
            ("N = FLASE", "N = FALSE", true),
            ("N = TREE", "N = TRUE", false),
        ] {
            assert_eq!(fixed_line(line), Some((fixed.to_string(), is_certain)), "{line}");
        }
        for line in [
            "MOVE WITH SPEED = 50",
            "PRINT N GOTO L",
            "MOVE POINT(1, 2 WITH SPEED = 5",
        ] {
            assert_eq!(fixed_line(line), None, "{line}");
        }
    }

    #[test]
    fn a_string_between_single_quotes_gets_double_ones() {
        for (line, fixed) in [
            ("PRINT 'N'", "PRINT \"N\""),
            ("PRINT IP1,  'N', CR", "PRINT IP1,  \"N\", CR"),
        ] {
            assert_eq!(fixed_line(line), Some((fixed.to_string(), true)), "{line}");
        }
        assert_eq!(fixed_line("PRINT IP1, 'it''s', CR"), None);
    }

    #[test]
    fn blocks_are_closed_where_one_place_is_left() {
        let fixed = |body: &str| {
            let source = format!("PROGRAM T\n{body}END\n");
            let found = crate::check(&source, &crate::LanguageOptions::default()).diagnostics;
            let fix = found.first()?.fix.as_ref()?;
            Some((fix.apply(&source), fix.is_certain))
        };
        for (body, after, is_certain) in [
            (
                "  FOR I = 1 TO 3\n    PRINT I\n",
                "  FOR I = 1 TO 3\n    PRINT I\n  NEXT I\n",
                false,
            ),
            (
                "  IF DIN(1) THEN\n    STOP\n  ENDIF\n",
                "  IF DIN(1) THEN STOP\n",
                true,
            ),
            (
                "  if din(1) then \n stop\nend if\n",
                "  if din(1) then stop\n",
                true,
            ),
            ("  DELAY 500\n", "  DELAY 0.5\n", false),
            ("L:  DELAY 5\n", "DELAY 5\n", false),
        ] {
            let after = format!("PROGRAM T\n{after}END\n");
            assert_eq!(fixed(body), Some((after, is_certain)), "{body}");
        }
        for body in [
            "  FOR I = 1 TO 3\n  FOR J = 1 TO 3\n    PRINT I, J\n",
            "  IF DIN(1) THEN\n    STOP\n    STOP\n  ENDIF\n",
            "  IF DIN(1) THEN\n    STOP ' now\n  ENDIF\n",
            "  IF DIN(1) THEN\n    IF DIN(2) THEN STOP\n  ENDIF\n",
        ] {
            assert_eq!(fixed(body), None, "{body}");
        }
    }
}
