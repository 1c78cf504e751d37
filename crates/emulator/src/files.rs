//! Reading files that a user has named: regular ones, of a bounded size. A device has no size to be looked up and no end,
//! and a pipe has nobody who writes. What the content means is the business of whoever reads it.

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::Path;

/// The content of a regular file of at most `most` bytes.
///
/// # Errors
/// The system's; another kind of file; a larger one.
pub(crate) fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::other("not a regular file"));
    }
    let mut content = Vec::new();
    // The file may grow while it is read.
    File::open(path)?
        .take(most.saturating_add(1))
        .read_to_end(&mut content)?;
    if u64::try_from(content.len()).is_ok_and(|length| length <= most) {
        Ok(content)
    } else {
        Err(io::Error::other(format!("larger than {most} bytes")))
    }
}

/// The same of a file in UTF-8.
///
/// # Errors
/// As [`read`]; and a content that is no UTF-8.
pub(crate) fn read_text(path: &Path, most: u64) -> io::Result<String> {
    String::from_utf8(read(path, most)?)
        .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error.utf8_error()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TempDir;

    #[test]
    fn only_regular_files_of_their_size_are_read() {
        let directory = TempDir::new("files");
        let path = directory.path().join("file");
        fs::write(&path, "12345").unwrap();
        assert_eq!(read_text(&path, 5).unwrap(), "12345");
        assert_eq!(read(&path, 4).unwrap_err().to_string(), "larger than 4 bytes");
        fs::write(&path, [0xFF]).unwrap();
        assert_eq!(
            read_text(&path, 5).unwrap_err().kind(),
            io::ErrorKind::InvalidData
        );
        for other in [directory.path(), Path::new("/dev/zero")] {
            // Without an end, and without a size.
            assert!(read(other, 5).is_err(), "{}", other.display());
        }
        assert_eq!(
            read(&directory.path().join("none"), 5).unwrap_err().kind(),
            io::ErrorKind::NotFound
        );
    }
}
