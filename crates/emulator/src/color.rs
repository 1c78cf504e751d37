//! Colours on a terminal: which word of a line is painted, and whether at all.
//!
//! `NO_COLOR`, `CLICOLOR`, `CLICOLOR_FORCE` and `TERM=dumb` are followed by anstream, as for the help. Output that goes to
//! a file or a pipe is the same bytes as without this module.

use anstream::stream::RawStream;
use anstream::{AutoStream, ColorChoice};
use anstyle::{AnsiColor, Style};

const ERROR: Style = AnsiColor::Red.on_default().bold();
const WARNING: Style = AnsiColor::Yellow.on_default().bold();
const NOTE: Style = AnsiColor::Cyan.on_default().bold();
const FAINT: Style = Style::new().dimmed();

/// Words that say how much a line matters, at the place where lines have them.
const WORDS: [(&str, Style); 8] = [
    ("error", ERROR),
    ("warning", WARNING),
    ("note", NOTE),
    ("ERROR", ERROR),
    ("WARN", WARNING),
    ("INFO", NOTE),
    ("DEBUG", FAINT),
    ("TRACE", FAINT),
];

/// A stream, and whether it shows colours.
pub(crate) fn stream<S: RawStream>(raw: S) -> (AutoStream<S>, bool) {
    let choice = AutoStream::choice(&raw);
    if choice == ColorChoice::Never {
        // Nothing is painted, so nothing has to be taken out.
        return (AutoStream::new(raw, ColorChoice::AlwaysAnsi), false);
    }
    (AutoStream::new(raw, choice), true)
}

/// A line of the log or a message, with its level painted: `error: ...` or `TIME LEVEL ...`.
pub(crate) fn log_line(line: &str) -> String {
    let (time, rest) = match line.split_once(' ') {
        Some((time, rest)) if time.ends_with('Z') => (time, rest),
        _ => ("", line),
    };
    let text = rest.trim_start();
    let Some((word, style)) = WORDS.iter().find(|(word, _)| text.starts_with(word)) else {
        return line.to_owned();
    };
    let (blanks, after) = (
        rest.len() - text.len(),
        text.get(word.len()..).unwrap_or_default(),
    );
    match time {
        "" => format!("{style}{word}{style:#}{after}"),
        time => format!(
            "{FAINT}{time}{FAINT:#} {:blanks$}{style}{word}{style:#}{after}",
            ""
        ),
    }
}

/// A diagnostic with the word of its severity and its carets painted.
pub(crate) fn diagnostic(text: &str) -> String {
    let mut lines = text.lines();
    let mut painted = String::new();
    if let Some(first) = lines.next() {
        let found = WORDS.iter().find_map(|(word, style)| {
            let (before, after) = first.split_once(&format!(": {word}["))?;
            Some(format!("{before}: {style}{word}[{}", end_of_code(after, *style)))
        });
        painted.push_str(found.as_deref().unwrap_or(first));
    }
    for line in lines {
        painted.push('\n');
        match line.split_once('|') {
            Some((margin, carets)) if carets.trim().starts_with('^') => {
                painted.push_str(&format!("{margin}|{ERROR}{carets}{ERROR:#}"));
            }
            _ => painted.push_str(line),
        }
    }
    painted
}

/// A line of a unified diff, painted by its first characters.
pub(crate) fn difference(line: &str) -> String {
    let style = match line.as_bytes() {
        [b'-', b'-', b'-', b' ', ..] | [b'+', b'+', b'+', b' ', ..] => Style::new().bold(),
        [b'@', ..] => AnsiColor::Cyan.on_default(),
        [b'-', ..] => AnsiColor::Red.on_default(),
        [b'+', ..] => AnsiColor::Green.on_default(),
        _ => return line.to_owned(),
    };
    format!("{style}{line}{style:#}")
}

/// The verdict of a test.
pub(crate) fn verdict(word: &str, is_good: bool, paints: bool) -> String {
    let style = match (paints, is_good) {
        (false, _) => return word.to_owned(),
        (true, true) => AnsiColor::Green.on_default(),
        (true, false) => ERROR,
    };
    format!("{style}{word}{style:#}")
}

/// `E0101]: text`, where the style ends after the code.
fn end_of_code(after: &str, style: Style) -> String {
    match after.split_once(']') {
        Some((code, rest)) => format!("{code}]{style:#}{rest}"),
        None => format!("{after}{style:#}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_level_of_a_line_and_the_place_of_a_diagnostic_are_painted() {
        for (line, painted) in [
            ("error: no such file", "\x1b[1m\x1b[31merror\x1b[0m: no such file"),
            (
                "2026-01-01T00:00:00Z  WARN IP0: RN refused",
                "\x1b[2m2026-01-01T00:00:00Z\x1b[0m  \x1b[1m\x1b[33mWARN\x1b[0m IP0: RN refused",
            ),
            ("ts3100 is ready.", "ts3100 is ready."),
        ] {
            assert_eq!(log_line(line), painted);
        }
        let text = "T:2:5: error[E0101]: expected a value\n2 | N = = 1\n  |     ^\n  = help: write one =";
        let painted = "T:2:5: \x1b[1m\x1b[31merror[E0101]\x1b[0m: expected a value\n2 | N = = 1\n  \
            |\x1b[1m\x1b[31m     ^\x1b[0m\n  = help: write one =";
        assert_eq!(diagnostic(text), painted);
    }
}
