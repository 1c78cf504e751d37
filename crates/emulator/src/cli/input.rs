//! Files that a command line names, where `-` means standard input.

use std::io;
use std::path::Path;
use ts3100_driver::files;

/// `-` on the command line.
pub(super) fn is_stdin(path: &Path) -> bool {
    path == Path::new("-")
}

/// The bytes of a file, or of standard input, if there are at most so many.
pub(super) fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    if is_stdin(path) {
        files::read_all(io::stdin().lock(), most)
    } else {
        files::read(path, most)
    }
}
