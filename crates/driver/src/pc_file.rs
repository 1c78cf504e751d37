//! Files of the PC as files of the drive: their names and their line ends.

use crate::encoding;
use crate::files::{self, extension};
use std::io;
use std::path::{Path, PathBuf};
use ts3100_controller::limits;
use ts3100_proto::name::FileName;
use ts3100_proto::parameter::LineEnd;

/// Largest file of the PC that is read, in bytes: CRLF becomes one byte on the drive, and an EOF at the end none.
pub const MAX_PC_FILE: u64 = 2 * limits::MAX_FILE as u64 + 1;

/// The name of a PC file cannot be a name of the drive.
#[derive(Debug, thiserror::Error)]
#[error("cannot put {} on the RAM drive under its name: {reason}", path.display())]
pub struct NameError {
    /// The file on the PC.
    path: PathBuf,
    /// Why the name is not valid on the drive.
    reason: String,
}

impl NameError {
    /// Why the name is not valid on the drive.
    pub fn reason(&self) -> &str {
        &self.reason
    }
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
    let text = text.ok_or_else(|| name_error("it is not UTF-8".to_owned()))?;
    let name = FileName::parse(text).map_err(|error| name_error(error.to_string()))?;
    Ok(name.as_str().to_owned())
}

/// Reads a text file of the PC as the content of a file of the drive, with the drive's line ends.
///
/// # Errors
/// As [`files::read`] and [`encoding::check`]; more bytes than a file of the drive has.
pub fn read_content(path: &Path, line_end: LineEnd) -> io::Result<Vec<u8>> {
    let text = files::read(path, MAX_PC_FILE).map_err(limit_of_the_drive)?;
    encoding::check(&text).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))?;
    converted(&text, line_end)
}

/// The same for a file that may be binary: the rules of the drive decide about it.
pub(crate) fn read_converted(path: &Path, line_end: LineEnd) -> io::Result<Vec<u8>> {
    converted(
        &files::read(path, MAX_PC_FILE).map_err(limit_of_the_drive)?,
        line_end,
    )
}

fn converted(text: &[u8], line_end: LineEnd) -> io::Result<Vec<u8>> {
    let content = drive_content(text, line_end);
    check_size(&content).map(|()| content)
}

/// Reads a file as the drive has written it, byte for byte.
///
/// # Errors
/// As [`read_content`].
pub(crate) fn read_stored(path: &Path) -> io::Result<Vec<u8>> {
    let content = files::read(path, MAX_PC_FILE).map_err(limit_of_the_drive)?;
    check_size(&content).map(|()| content)
}

/// Names the limit of the drive instead of that of the read.
pub fn limit_of_the_drive(error: io::Error) -> io::Error {
    if error.kind() == io::ErrorKind::FileTooLarge {
        return too_large();
    }
    error
}

/// Checks that content is not larger than a file of the drive may be.
///
/// # Errors
/// It is larger.
pub fn check_size(content: &[u8]) -> io::Result<()> {
    match content.len() > limits::MAX_FILE {
        true => Err(too_large()),
        false => Ok(()),
    }
}

/// The message for a file that is too large for the drive, used by all callers.
fn too_large() -> io::Error {
    let reason = format!("a file of the RAM drive has at most {} bytes", limits::MAX_FILE);
    io::Error::new(io::ErrorKind::FileTooLarge, reason)
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

    #[test]
    fn the_limit_counts_the_bytes_on_the_drive() {
        let directory = crate::testing::TempDir::new("pc-file");
        let path = directory.path().join("big.scol");
        let mut text = b"\r\n".repeat(limits::MAX_FILE);
        text.push(ts3100_proto::text::EOF);
        std::fs::write(&path, &text).unwrap();
        assert_eq!(read_content(&path, LineEnd::Lf).unwrap().len(), limits::MAX_FILE);
        for larger in [
            b"\r\n".repeat(limits::MAX_FILE + 1),
            vec![b' '; 5 * limits::MAX_FILE],
        ] {
            std::fs::write(&path, larger).unwrap();
            let error = read_content(&path, LineEnd::Lf).unwrap_err().to_string();
            assert_eq!(error, "a file of the RAM drive has at most 99999 bytes");
        }
    }
}
