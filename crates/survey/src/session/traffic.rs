//! The log of the bytes of a probe, an allow-list: names of the user's files are replaced, and reasons tell the type of a
//! text, not its content.

use super::FILE;
use core::time::Duration;
use ts3100_proto::escape::Escaped;

/// Most lines that are kept of one question.
const MAX_LINES: usize = 60;
/// Longest text that is written down whole.
const MAX_SHOWN: usize = 120;
/// From this length on a name is replaced inside of longer words too; a letter is a part of many.
const LONG_NAME: usize = 3;
/// Files that every controller has or may have.
const PARAMETER_FILES: [&str; 3] = ["USER.PAR", "ETHERNET.PAR", "STRING.PAR"];

/// Bytes on the line.
#[derive(Debug, Default)]
pub(crate) struct Traffic {
    lines: Vec<String>,
    /// Nothing is added.
    is_kept: bool,
    /// Names of files on the controller.
    names: Vec<String>,
}

impl Traffic {
    /// Lines written since the last call, up to [`Traffic::keep`].
    pub(crate) fn take(&mut self) -> Vec<String> {
        self.is_kept = false;
        std::mem::take(&mut self.lines)
    }

    /// Nothing more is written down until [`Traffic::take`].
    pub(crate) fn keep(&mut self) {
        self.is_kept = true;
    }

    /// A name that is not written down.
    pub(crate) fn hide(&mut self, name: &str) {
        if !name.is_empty() && name != FILE && !PARAMETER_FILES.contains(&name) {
            self.names.push(name.to_owned());
        }
    }

    /// The same with an `x` for each character of a hidden name.
    pub(crate) fn redacted(&self, text: &[u8]) -> Vec<u8> {
        let mut out = text.to_vec();
        for name in self.names.iter().map(String::as_bytes) {
            for at in 0..text.len() {
                let (before, rest) = text.split_at(at);
                let Some(after) = rest.strip_prefix(name) else {
                    continue;
                };
                let mut beside = [before.last(), after.first()].into_iter().flatten();
                let is_word = !beside.any(u8::is_ascii_alphanumeric);
                if (is_word || name.len() >= LONG_NAME)
                    && let Some(place) = out.get_mut(at..at + name.len())
                {
                    place.fill(b'x');
                }
            }
        }
        out
    }

    /// Bytes of this direction, `>` to the controller or `<` from it.
    pub(crate) fn note(&mut self, at: Duration, direction: char, bytes: &[u8]) {
        if self.is_kept || self.lines.len() >= MAX_LINES || bytes.is_empty() {
            return;
        }
        let bytes = self.redacted(bytes);
        let shown = bytes.get(..bytes.len().min(MAX_SHOWN)).unwrap_or_default();
        let rest = match bytes.len() - shown.len() {
            0 => String::new(),
            more => format!(" ... {more} bytes more"),
        };
        let (at, text) = (at.as_secs_f64(), Escaped::new(shown));
        self.lines.push(format!("{at:.3} {direction} {text}{rest}"));
    }
}

/// Name of a text, without its content.
pub(crate) fn described(data: &[u8]) -> String {
    match data {
        b"OK\r" => "OK".to_owned(),
        b"NG\r" => "NG".to_owned(),
        _ if data.starts_with(b"FL,") => format!("a file of {} bytes", data.len() - 3),
        _ => format!("a text of {} bytes", data.len()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_are_not_written_down() {
        let mut traffic = Traffic::default();
        for name in ["MINE", "A", "CELL.PAR", "USER.PAR", "TSSURVEY"] {
            traffic.hide(name);
        }
        traffic.note(
            Duration::ZERO,
            '<',
            b"FILE:MINE OVRD A MINE2 AB CELL.PAR USER.PAR TSSURVEY MINEA\r",
        );
        traffic.keep();
        traffic.note(Duration::ZERO, '<', b"more");
        assert_eq!(
            traffic.take(),
            ["0.000 < FILE:xxxx OVRD x xxxx2 AB xxxxxxxx USER.PAR TSSURVEY xxxxA<CR>"]
        );
    }
}
