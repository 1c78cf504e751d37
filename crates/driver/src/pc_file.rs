//! Files of the PC as files of the drive: their names and their line ends.

use crate::files::extension;
use std::path::{Path, PathBuf};
use ts3100_controller::limits;
use ts3100_proto::name::FileName;
use ts3100_proto::parameter::LineEnd;

/// Largest file of the PC that is read, in bytes: CRLF becomes one byte on the drive.
pub const MAX_PC_FILE: u64 = 2 * limits::MAX_FILE as u64;

/// The name of a PC file cannot be a name of the drive.
#[derive(Debug, thiserror::Error)]
#[error("cannot put {} on the RAM drive under its name: {reason}", path.display())]
pub struct NameError {
    /// The file on the PC.
    path: PathBuf,
    /// Why the name is not valid on the drive.
    reason: String,
}

/// The drive name of a PC file: its stem in upper case (`pick.scol` is PICK); a parameter
/// file keeps its extension (`user.par` is USER.PAR).
///
/// # Errors
/// The result is not valid on the drive.
pub fn drive_name(path: &Path) -> Result<String, NameError> {
    let name_error = |reason: String| NameError {
        path: path.to_path_buf(),
        reason,
    };
    let part = match extension(path).as_str() {
        "par" => path.file_name(),
        _ => path.file_stem(),
    };
    let text = part.and_then(|part| part.to_str());
    let text = text.ok_or_else(|| name_error("it is no text".to_owned()))?;
    let name = FileName::parse(text).map_err(|error| name_error(error.to_string()))?;
    Ok(name.as_str().to_owned())
}

/// Converts the content of a PC file to the drive's line ends, as the vendor's library does (hosts.md 1.7). An EOF at
/// the end is removed; the library leaves one in the files it uploads.
pub fn drive_content(text: &[u8], line_end: LineEnd) -> Vec<u8> {
    let text = text.strip_suffix(&[ts3100_proto::text::EOF]).unwrap_or(text);
    let end = match line_end {
        LineEnd::Lf => b'\n',
        LineEnd::Cr => b'\r',
    };
    let mut content = Vec::with_capacity(text.len());
    let mut bytes = text.iter().copied().peekable();
    while let Some(byte) = bytes.next() {
        match byte {
            b'\r' if bytes.peek() == Some(&b'\n') => {}
            b'\n' => content.push(end),
            other => content.push(other),
        }
    }
    content
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_the_pc_gets_the_drives_name_and_line_ends() {
        assert_eq!(drive_name(Path::new("a/b/pick.scol")).unwrap(), "PICK");
        assert_eq!(drive_name(Path::new("Pick2")).unwrap(), "PICK2");
        assert_eq!(drive_name(Path::new("user.par")).unwrap(), "USER.PAR");
        let error = drive_name(Path::new("x/2pick.scol")).unwrap_err().to_string();
        assert!(
            error.starts_with("cannot put x/2pick.scol on the RAM drive under its name: "),
            "{error}"
        );
        assert_eq!(
            drive_content(b"A\r\nB\nC\rD\r\n\x1a", LineEnd::Lf),
            b"A\nB\nC\rD\n"
        );
        assert_eq!(drive_content(b"A\r\nB\nC", LineEnd::Cr), b"A\rB\rC");
    }
}
