//! Files that a command line names, where `-` means standard input.

use std::io;
use std::path::Path;
use ts3100_driver::pc_file::{MAX_PC_FILE, limit_of_the_drive};
use ts3100_driver::{encoding, files};

/// `-` on the command line.
pub(super) fn is_stdin(path: &Path) -> bool {
    path == Path::new("-")
}

/// The path as messages name it.
pub(super) fn shown_name(path: &Path) -> String {
    match is_stdin(path) {
        true => "<stdin>".to_owned(),
        false => path.display().to_string(),
    }
}

/// The bytes of a file, or of standard input, if there are at most that many.
pub(super) fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    if is_stdin(path) {
        files::read_all(io::stdin().lock(), most)
    } else {
        files::read(path, most)
    }
}

/// A program of the PC, as text.
///
/// # Errors
/// As [`read`]; it is in an encoding other than ASCII and UTF-8.
pub(super) fn read_program(path: &Path) -> io::Result<String> {
    encoding::decode(read(path, MAX_PC_FILE).map_err(limit_of_the_drive)?)
        .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
}
