//! Makes text from outside safe to print: file names, program lines, bytes from hosts, HTTP headers, lines of a
//! file that is not TOML. Such text appears in log lines, error messages, HTTP problems and metric labels.
//!
//! A terminal would obey its control characters, a line feed could fake a log line, and a line can be arbitrarily
//! long. So control characters are spelled out (`<1B>`, `<CR>`) and long messages are cut.

use std::fmt::Display;

/// Longest line of a message in characters. The TOML parser shows an error in three lines, which stay below 2 kB.
const MAX_LINE: usize = 480;
/// Most lines of a message.
const MAX_LINES: usize = 1_000;

/// Whether a character does something other than being printed.
fn needs_escape(letter: char) -> bool {
    // Bidirectional controls can reorder what is read; U+2028 and U+2029 break lines.
    letter.is_control() || matches!(letter, '\u{2028}'..='\u{202E}' | '\u{2066}'..='\u{2069}')
}

/// The text with control characters spelled out, but for those that stay.
fn escape(text: &str, stay: &[char]) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        let code = u32::from(letter);
        match letter {
            _ if stay.contains(&letter) || !needs_escape(letter) => escaped.push(letter),
            '\n' => escaped.push_str("<LF>"),
            '\r' => escaped.push_str("<CR>"),
            _ if code > 0xFF => escaped.push_str(&format!("<U+{code:04X}>")),
            _ => escaped.push_str(&format!("<{code:02X}>")),
        }
    }
    escaped
}

/// The text on one line, with control characters as in the log: `<CR>`, `<1B>`.
pub fn escape_line(text: &str) -> String {
    escape(text, &[])
}

/// As [`escape_line`], but line feeds and tabs stay.
pub fn escape_lines(text: &str) -> String {
    escape(text, &['\n', '\t'])
}

/// A message for people: lines stay, control characters are spelled out, long lines and long messages are cut.
pub fn printable(message: impl Display) -> String {
    let text = message.to_string();
    let mut lines: Vec<String> = Vec::new();
    for line in text.split('\n').take(MAX_LINES) {
        let start: String = line.chars().take(MAX_LINE).collect();
        let cut = if start.len() < line.len() { "..." } else { "" };
        lines.push(format!("{}{cut}", escape_lines(&start)));
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_obey_is_spelled_out() {
        assert_eq!(
            escape_line("a\x1b[2Jb\r\n\tc\u{85}\u{202e}d ü\x7f"),
            "a<1B>[2Jb<CR><LF><09>c<85><U+202E>d ü<7F>"
        );
        assert_eq!(escape_lines("a\r\n\tb"), "a<CR>\n\tb");
        assert_eq!(printable("error:\n  \x07"), "error:\n  <07>");
    }

    #[test]
    fn a_giant_line_is_cut_and_the_others_are_whole() {
        let text = format!("first\n{}\nlast\n", "ü".repeat(1 << 20));
        let found = printable(&text);
        assert!(found.len() < 2_000, "{}", found.len());
        assert!(found.starts_with("first\n") && found.ends_with("...\nlast\n"));
        assert!(printable("\n".repeat(1 << 20)).len() <= MAX_LINES);
    }
}
