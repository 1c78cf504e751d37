//! Replaces one value of a parameter file and leaves everything else as it is: comments, order, line ends.
//!
//! It rejects only values that would change the structure of the file. Whether a value makes sense is checked when the
//! file is read, see `ethernet.rs` and `user.rs`.

use super::reader::{Assignment, ParameterFile};
use crate::error_text;
use crate::prelude::*;

/// Why a value was not replaced.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RewriteError {
    /// The file has bytes that are not ASCII.
    NotText,
    /// The file has no such section.
    NoSection(String),
    /// The section has no value of this key.
    NoValue {
        /// Tag of the section, without brackets.
        section: String,
        /// The key; empty for the value without one.
        key: String,
    },
    /// The new value would end its line, or begin a comment, a section or another value.
    Value(String),
}

error_text! {
    RewriteError;
    Self::NotText => "expected a parameter file of ASCII text, found other bytes";
    Self::NoSection(name) => "there is no section [{name}]";
    Self::NoValue { section, key } => "section [{section}] has no value {{{key}}}";
    Self::Value(value) => "expected one line of ASCII without `{{`, `[`, `=` and quotes, found `{value}`";
}

/// Replaces the value of `key` in `section`. An empty key means the section's first value, whatever its braces say:
/// in sections of one value they hold comments.
///
/// # Errors
/// See [`RewriteError`]; nothing is changed then.
pub fn rewrite(content: &[u8], section: &str, key: &str, value: &str) -> Result<Vec<u8>, RewriteError> {
    if content.iter().any(|byte| !byte.is_ascii()) {
        return Err(RewriteError::NotText);
    }
    let value = value.trim_matches(' ');
    let quoted = value.len() >= 2 && value.starts_with('"') && value.ends_with('"');
    let (inside, special): (&str, &[char]) = if quoted {
        (value.get(1..value.len() - 1).unwrap_or_default(), &['"'])
    } else {
        (value, &['{', '[', '=', '"'])
    };
    let printable = value.bytes().all(|byte| byte == b' ' || byte.is_ascii_graphic());
    if value.is_empty() || !printable || inside.contains(special) {
        return Err(RewriteError::Value(value.into()));
    }
    let file = ParameterFile::parse(content);
    let mut sections = file.sections.iter();
    let found = sections.find(|found| found.tag.eq_ignore_ascii_case(section));
    let found = found.ok_or_else(|| RewriteError::NoSection(section.into()))?;
    let named = |assignment: &&Assignment| key.is_empty() || assignment.key.eq_ignore_ascii_case(key);
    let assignment = found.assignments.iter().find(named);
    let Assignment { span, .. } = assignment.ok_or_else(|| RewriteError::NoValue {
        section: section.into(),
        key: key.into(),
    })?;
    let before = content.get(..span.start).unwrap_or_default();
    let after = content.get(span.end..).unwrap_or_default();
    Ok([before, value.as_bytes(), after].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &[u8] =
        b"[E00] Mode { 0: no }\r= 1 0 0 0 \r[E02] Name\r= \"A\"\r[E05]{ IP0 } = 1000 {IP1} =\r 1001\r[END]\r";

    // clause: PAR-FILE-02 PAR-FILE-04
    #[test]
    fn one_value_changes_and_nothing_else() {
        let text =
            |section, key, value| String::from_utf8(rewrite(FILE, section, key, value).unwrap()).unwrap();
        let original = core::str::from_utf8(FILE).unwrap();
        assert_eq!(text("E00", "", "1 1 1 1"), original.replace("1 0 0 0", "1 1 1 1"));
        assert_eq!(
            text("E00", "", " 1 1 1 1 "),
            original.replace("1 0 0 0", "1 1 1 1")
        );
        assert_eq!(text("e05", "ip1", "2101"), original.replace("1001", "2101"));
        assert_eq!(text("E05", "IP0", "7"), original.replace("1000", "7"));
        assert_eq!(text("E02", "", "\"B=C\""), original.replace("\"A\"", "\"B=C\""));
    }

    #[test]
    fn what_cannot_be_replaced_is_named() {
        assert_eq!(
            rewrite(FILE, "E09", "", "1"),
            Err(RewriteError::NoSection("E09".into()))
        );
        assert!(matches!(
            rewrite(FILE, "E05", "IP9", "1"),
            Err(RewriteError::NoValue { .. })
        ));
        for value in [
            "",
            " ",
            "1\r= 2",
            "{x}",
            "1 [E01]",
            "\u{e9}",
            "\"",
            "1\"",
            "\"a\"b\"",
            "\"\u{e9}\"",
        ] {
            assert!(
                matches!(rewrite(FILE, "E00", "", value), Err(RewriteError::Value(_))),
                "{value:?}"
            );
        }
        assert_eq!(
            rewrite(b"[E00] = \xFF", "E00", "", "1"),
            Err(RewriteError::NotText)
        );
    }
}
