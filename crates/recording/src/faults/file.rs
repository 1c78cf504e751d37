//! Fault files: TOML with one table `[[fault]]` for each fault and the keys of a fault specification.

use crate::table_error::{TableError, line_of};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};
use ts3100_controller::faults::{Fault, FaultError};
use ts3100_driver::files::{self, PathError, cannot};

/// Largest file in bytes.
const MAX_FILE: u64 = 1024 * 1024;

/// Why a file has no faults to arm.
#[derive(Debug, thiserror::Error)]
pub enum FaultFileError {
    /// It cannot be read.
    #[error(transparent)]
    File(#[from] PathError),
    /// The file is not TOML, has something other than tables `[[fault]]`, or a table that is not a fault.
    #[error("{}, line {line}: {reason}", path.display())]
    Content {
        path: PathBuf,
        /// Line of the key that is wrong, or of its table, from 1.
        line: usize,
        reason: String,
    },
}

/// The faults of a file.
///
/// # Errors
/// See [`FaultFileError`].
pub fn read(path: &Path) -> Result<Vec<Fault>, FaultFileError> {
    let text = files::read_text(path, MAX_FILE).map_err(cannot("read", path))?;
    parse(path, &text)
}

/// The faults of a text; `path` is its name in messages.
///
/// # Errors
/// As [`read`].
pub fn parse(path: &Path, text: &str) -> Result<Vec<Fault>, FaultFileError> {
    let table = DeTable::parse(text).map_err(TableError::from);
    let read = table.and_then(|table| faults(table.get_ref()));
    read.map_err(|TableError(place, reason)| FaultFileError::Content {
        path: path.to_path_buf(),
        line: line_of(text, place.start),
        reason,
    })
}

fn faults(table: &DeTable<'_>) -> Result<Vec<Fault>, TableError> {
    let mut faults = Vec::new();
    for (key, value) in table {
        if key.get_ref() != "fault" {
            let found = format!("`{}`", key.get_ref());
            return Err(form(key.span(), "[[fault]]", &found));
        }
        let DeValue::Array(tables) = value.get_ref() else {
            return Err(form(value.span(), "[[fault]]", value.get_ref().type_str()));
        };
        for table in tables {
            faults.push(fault(table)?);
        }
    }
    Ok(faults)
}

fn form(place: Range<usize>, expected: &str, found: &str) -> TableError {
    TableError(place, format!("expected {expected}, found {found}"))
}

#[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
fn fault(table: &Spanned<DeValue<'_>>) -> Result<Fault, TableError> {
    let DeValue::Table(keys) = table.get_ref() else {
        return Err(form(table.span(), "a table", table.get_ref().type_str()));
    };
    let (mut kind, mut pairs, mut places) = (None, Vec::new(), Vec::new());
    for (key, value) in keys {
        let text = match value.get_ref() {
            DeValue::String(text) => text.to_string(),
            DeValue::Integer(number) => number.to_string(),
            DeValue::Float(number) => number.to_string(),
            other => return Err(form(value.span(), "a string or a number", other.type_str())),
        };
        if key.get_ref() == "kind" {
            kind = Some(text);
        } else {
            pairs.push((key.get_ref().to_string(), text));
            places.push(key.span());
        }
    }
    let Some(kind) = kind else {
        return Err(form(table.span(), "kind", "a fault without one"));
    };
    Fault::from_pairs(&kind, &pairs).map_err(|reason| {
        let key = match &reason {
            FaultError::UnknownKey { key, .. }
            | FaultError::InvalidValue { key, .. }
            | FaultError::DuplicateKey { key, .. } => pairs.iter().position(|(name, _)| name == key),
            FaultError::UnknownKind { .. } | FaultError::Syntax { .. } | FaultError::NeverFires { .. } => {
                None
            }
        };
        let place = key.and_then(|key| places.get(key)).cloned();
        TableError(place.unwrap_or(table.span()), reason.to_string())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<Vec<String>, String> {
        parse(Path::new("faults.toml"), text)
            .map(|faults| faults.iter().map(ToString::to_string).collect())
            .map_err(|error| error.to_string())
    }

    #[test]
    fn a_file_has_the_keys_of_a_specification() {
        let text = "# two of them\n[[fault]]\nkind = \"ng\"\ncommand = \"SU\"\nafter = 2\n\n[[fault]]\n\
                    kind = \"late-reply\"\ndelay = \"1.5s\"\nprobability = 0.5\n";
        let expected = ["ng:command=SU,after=2", "late-reply:probability=0.5,delay=1500"];
        assert_eq!(read_text(text), Ok(expected.map(str::to_owned).to_vec()));
        assert_eq!(read_text(""), Ok(Vec::new()));
    }

    #[test]
    fn a_mistake_is_named_with_its_line() {
        for (text, says) in [
            (
                "[[fault]]\nkind = \"ngg\"\n",
                "faults.toml, line 1: unknown kind of fault `ngg`; did you mean `ng`?",
            ),
            (
                "[[fault]]\nkind = \"ng\"\nwhen = 1\n",
                "faults.toml, line 3: ng: unknown key `when`",
            ),
            (
                "\n[[fault]]\nkind = \"ng\"\n\nafter = -1\n",
                "faults.toml, line 5: ng: after: expected a whole number from 0",
            ),
            (
                "[[fault]]\nafter = 1\n",
                "faults.toml, line 1: expected kind, found a fault without one",
            ),
            (
                "[[faults]]\nkind = \"ng\"\n",
                "faults.toml, line 1: expected [[fault]], found `faults`",
            ),
            (
                "fault = 3\n",
                "faults.toml, line 1: expected [[fault]], found integer",
            ),
            (
                "[[fault]]\nkind = \"ng\"\nafter = [1]\n",
                "faults.toml, line 3: expected a string or a number, found array",
            ),
            (
                "[[fault]]\nkind = \"ng\"\ncommand = \"SU\"\nblock = 1\n",
                "faults.toml, line 1: cannot arm ng: no occasion matches command=SU and block=1",
            ),
            ("[[fault]\n", "faults.toml, line 1: "),
        ] {
            let error = read_text(text).unwrap_err();
            assert!(error.starts_with(says), "{text}: {error}");
        }
        assert!(read(Path::new("/nowhere/faults.toml")).is_err());
    }
}
