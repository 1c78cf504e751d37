//! Differences of two texts in the unified format that `patch` and `git apply` read.
//!
//! Lines end in LF here, as they do for those programs: a file of the drive whose lines end in CR is one line. Which lines
//! differ is found by `similar`.

use crate::color;
use similar::{Algorithm, ChangeTag, DiffOp, capture_diff_slices, group_diff_ops};
use std::io::{self, Write};
use std::ops::Range;
use ts3100_control::printable::printable;

/// Lines around a change.
const CONTEXT: usize = 3;

/// Writes what changes `old` to `new`, in colours and without control characters for a terminal.
///
/// # Errors
/// `out` takes no more.
pub(super) fn write(name: &str, old: &str, new: &str, paints: bool, out: &mut impl Write) -> io::Result<()> {
    // The name ends at a tab, which it needs if it contains blanks.
    let end = if name.contains(' ') { "\t" } else { "" };
    let name = if cfg!(windows) {
        name.replace('\\', "/")
    } else {
        name.to_owned()
    };
    let name = printable(&name);
    let old: Vec<&str> = old.split_inclusive('\n').collect();
    let new: Vec<&str> = new.split_inclusive('\n').collect();
    let line = |out: &mut dyn Write, text: &str| match paints {
        true => writeln!(out, "{}", color::difference(&printable(text).to_string())),
        false => writeln!(out, "{text}"),
    };
    line(out, &format!("--- {name}{end}"))?;
    line(out, &format!("+++ {name}{end}"))?;
    for hunk in group_diff_ops(capture_diff_slices(Algorithm::Myers, &old, &new), CONTEXT) {
        let (from, to) = (range(&hunk, DiffOp::old_range), range(&hunk, DiffOp::new_range));
        line(out, &format!("@@ -{from} +{to} @@"))?;
        let changes = hunk.iter().flat_map(|op| op.iter_changes(&old, &new));
        for change in changes {
            let sign = match change.tag() {
                ChangeTag::Delete => '-',
                ChangeTag::Insert => '+',
                ChangeTag::Equal => ' ',
            };
            let value = change.value();
            let content = value.strip_suffix('\n').unwrap_or(value);
            let content = match paints {
                true => content.strip_suffix('\r').unwrap_or(content),
                false => content,
            };
            line(out, &format!("{sign}{content}"))?;
            if !value.ends_with('\n') {
                line(out, "\\ No newline at end of file")?;
            }
        }
    }
    Ok(())
}

/// The lines of a hunk: `FIRST,COUNT`, `FIRST` for one line, and the line before for none.
fn range(hunk: &[DiffOp], side: impl Fn(&DiffOp) -> Range<usize>) -> String {
    let start = hunk.first().map_or(0, |op| side(op).start);
    let end = hunk.last().map_or(start, |op| side(op).end);
    match end - start {
        0 => format!("{start},0"),
        1 => format!("{}", start + 1),
        count => format!("{},{count}", start + 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unified(name: &str, old: &str, new: &str, paints: bool) -> String {
        let mut out = Vec::new();
        write(name, old, new, paints, &mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn hunks_have_three_lines_of_context() {
        let old = "1\n2\n3\n4\n5\n6\n7\n8\n9\n10\n11\n12\n13\n14\n";
        let new = "1\n2\n3\n4\nfive\n6\n7\n8\n9\n10\n11\n12\n14\nend";
        assert_eq!(
            unified("a b.scol", old, new, false),
            "--- a b.scol\t\n+++ a b.scol\t\n@@ -2,7 +2,7 @@\n 2\n 3\n 4\n-5\n+five\n 6\n 7\n 8\n\
             @@ -10,5 +10,5 @@\n 10\n 11\n 12\n-13\n 14\n+end\n\\ No newline at end of file\n"
        );
        assert_eq!(
            unified("a", "", "x\n", false),
            "--- a\n+++ a\n@@ -0,0 +1 @@\n+x\n"
        );
    }

    #[test]
    fn a_terminal_gets_colours_and_no_control_characters() {
        assert_eq!(
            unified("a", "x\x1b\n", "X\r\n", true),
            "\x1b[1m--- a\x1b[0m\n\x1b[1m+++ a\x1b[0m\n\x1b[36m@@ -1 +1 @@\x1b[0m\n\x1b[31m-x<1B>\x1b[0m\n\x1b[32m+X\x1b[0m\n"
        );
    }
}
