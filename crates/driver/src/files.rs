//! Reads and replaces files that a user named on the command line or in a configuration.
//!
//! Reading takes only regular files up to a size limit: a device has no end, and a pipe may have no writer. Writing
//! replaces a regular file atomically, through a hidden file beside it, so a reader sees the old or the new content
//! and never a part. What the content means is up to the caller; the RAM drive's directory is in [`crate::store`].

pub(crate) mod disk;

use disk::{Disk, NewFile, System};
use std::ffi::OsString;
use std::fs::{self, File, FileType, Metadata, TryLockError};
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};

/// A file or directory with which something cannot be done.
#[derive(Debug, thiserror::Error)]
#[error("cannot {action} {}: {reason}", path.display())]
pub struct PathError {
    action: &'static str,
    path: PathBuf,
    /// Error of the operating system.
    pub reason: io::Error,
}

/// Adds verb and path to an error: `.map_err(cannot("read", path))`.
pub fn cannot<E: Into<io::Error>>(action: &'static str, path: &Path) -> impl FnOnce(E) -> PathError {
    let path = path.to_path_buf();
    move |reason| PathError {
        action,
        path,
        reason: reason.into(),
    }
}

/// Suffix of a file that is still being written; its name begins with a dot.
pub const UNFINISHED_SUFFIX: &str = ".unfinished";

/// Reads a regular file of at most `most` bytes.
///
/// # Errors
/// The system's; not a regular file; larger than `most`.
pub fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    expect_regular(&fs::metadata(path)?)?;
    read_all(File::open(path)?, most)
}

/// Reads a stream to its end, at most `most` bytes.
///
/// # Errors
/// The system's; more than `most` bytes.
pub fn read_all(source: impl io::Read, most: u64) -> io::Result<Vec<u8>> {
    let mut content = Vec::new();
    // One byte more than allowed tells a full read from a cut one; the size of a file may change while it is read.
    source.take(most.saturating_add(1)).read_to_end(&mut content)?;
    if u64::try_from(content.len()).is_ok_and(|length| length <= most) {
        Ok(content)
    } else {
        let reason = format!("larger than {most} bytes");
        Err(io::Error::new(io::ErrorKind::FileTooLarge, reason))
    }
}

/// Reads a regular file of at most `most` bytes as UTF-8.
///
/// # Errors
/// As [`read`]; not UTF-8.
pub fn read_text(path: &Path, most: u64) -> io::Result<String> {
    String::from_utf8(read(path, most)?)
        .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error.utf8_error()))
}

/// The extension of a file name in lower case; empty without one.
pub fn extension(path: &Path) -> String {
    let ending = path.extension().unwrap_or_default();
    ending.to_string_lossy().to_ascii_lowercase()
}

fn expect_regular(found: &Metadata) -> io::Result<()> {
    if found.is_file() {
        return Ok(());
    }
    let what = kind_name(found.file_type());
    Err(io::Error::other(format!("expected a regular file, found {what}")))
}

fn kind_name(found: FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt as _;
        if found.is_fifo() {
            return "a pipe";
        }
        if found.is_block_device() || found.is_char_device() {
            return "a device";
        }
        if found.is_socket() {
            return "a socket";
        }
    }
    if found.is_dir() {
        "a directory"
    } else if found.is_symlink() {
        "a dangling symbolic link"
    } else {
        "something else"
    }
}

/// Stdout and stderr by the paths that scripts use for them.
fn standard_stream(path: &Path) -> Option<Box<dyn io::Write>> {
    match path.to_str() {
        Some("/dev/stdout") => Some(Box::new(io::stdout())),
        Some("/dev/stderr") => Some(Box::new(io::stderr())),
        _ => None,
    }
}

/// The path to write to and the metadata of the present file. A symbolic link is followed only within its directory.
fn resolve_target(path: &Path) -> io::Result<(PathBuf, Option<Metadata>)> {
    let found = match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok((path.to_path_buf(), None)),
        found => found?,
    };
    if !found.is_symlink() {
        return Ok((path.to_path_buf(), Some(found)));
    }
    let Ok(end) = fs::canonicalize(path) else {
        let what = kind_name(found.file_type());
        return Err(io::Error::other(format!("expected a regular file, found {what}")));
    };
    if end.parent() != Some(&fs::canonicalize(directory_of(path))?) {
        return Err(io::Error::other(format!(
            "it is a symbolic link out of its directory; give the path {} instead",
            end.display()
        )));
    }
    let found = fs::symlink_metadata(&end)?;
    Ok((end, Some(found)))
}

/// The directory of a path; `.` for a bare file name.
pub(crate) fn directory_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Replaces or creates a regular file atomically: readers see the old or the new content, also after a loss of power.
/// `/dev/stdout` and `/dev/stderr` are written to.
///
/// # Errors
/// The system's; a target of another kind, or a symbolic link out of its directory. What was there before is still there.
pub fn replace(path: &Path, content: &[u8]) -> io::Result<()> {
    replace_with(path, |file| file.write_all(content))
}

/// As [`replace`] with the content that `write` produces. If `write` fails, nothing is replaced.
///
/// # Errors
/// As [`replace`], and the error of `write`.
pub fn replace_with(path: &Path, write: impl FnOnce(&mut dyn io::Write) -> io::Result<()>) -> io::Result<()> {
    if let Some(mut stream) = standard_stream(path) {
        return write(&mut stream).and_then(|()| stream.flush());
    }
    replace_on(&System, path, write)
}

/// As [`replace_with`], of a file.
pub(crate) fn replace_on(
    disk: &dyn Disk,
    path: &Path,
    write: impl FnOnce(&mut dyn io::Write) -> io::Result<()>,
) -> io::Result<()> {
    let (place, found) = resolve_target(path)?;
    found.as_ref().map_or(Ok(()), expect_regular)?;
    let beside = unfinished_path(&place, Some(std::process::id()))?;
    let permissions = found.map(|found| found.permissions());
    write_new(disk, &beside, |file| {
        write(file)?;
        permissions.map_or(Ok(()), |permissions| file.set_permissions(permissions))
    })?;
    // `write_new` has synced the content. So the rename, which is atomic, never puts a name on content that is not on
    // the disk yet.
    let placed = disk.rename(&beside, &place);
    if placed.is_err() {
        // The first error is the one to report.
        let _ = disk.remove(&beside);
    }
    placed.and_then(|()| disk.sync_directory(directory_of(&place)))
}

/// Checks whether [`replace`] could write there, by creating and removing the hidden file. Nothing else changes.
///
/// # Errors
/// As [`replace`].
pub fn check_target(path: &Path) -> io::Result<()> {
    if standard_stream(path).is_some() {
        return Ok(());
    }
    let (place, found) = resolve_target(path)?;
    found.as_ref().map_or(Ok(()), expect_regular)?;
    let beside = unfinished_path(&place, Some(std::process::id()))?;
    write_new(&System, &beside, |_| Ok(()))?;
    fs::remove_file(&beside)
}

/// Opens a file that is written during the run, truncated. It is a regular file, a new one, or a pipe that has a
/// reader; writes to a pipe never block.
///
/// # Errors
/// As [`replace`]; a pipe without a reader.
pub fn create(path: &Path) -> io::Result<File> {
    let (place, found) = resolve_target(path)?;
    if let Some(found) = found.filter(|found| kind_name(found.file_type()) != "a pipe") {
        expect_regular(&found)?;
    }
    let mut options = File::options();
    options.write(true).create(true).truncate(true);
    #[cfg(unix)]
    {
        use rustix::fs::OFlags;
        use std::os::unix::fs::OpenOptionsExt as _;
        let flags = OFlags::NONBLOCK | OFlags::NOFOLLOW;
        options.custom_flags(i32::try_from(flags.bits()).map_err(io::Error::other)?);
    }
    options.open(&place).map_err(|error| {
        #[cfg(unix)]
        if error.raw_os_error() == Some(rustix::io::Errno::NXIO.raw_os_error()) {
            return io::Error::other("this pipe has no reader; start its reader first");
        }
        error
    })
}

/// Creates a directory unless it exists. A symbolic link to a directory is refused.
///
/// # Errors
/// The system's, or something else has the name.
pub fn make_directory(path: &Path) -> io::Result<()> {
    match fs::create_dir(path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            let found = fs::symlink_metadata(path)?;
            if found.is_dir() {
                return Ok(());
            }
            let what = if found.is_symlink() {
                "a symbolic link"
            } else {
                kind_name(found.file_type())
            };
            Err(io::Error::other(format!("expected a directory, found {what}")))
        }
        made => made,
    }
}

/// The hidden path of a file that is being written, in the same directory so that the rename is atomic.
pub fn unfinished_path(place: &Path, writer: Option<u32>) -> io::Result<PathBuf> {
    let name = place
        .file_name()
        .ok_or_else(|| io::Error::other("expected the name of a file"))?;
    let mut hidden = OsString::from(".");
    hidden.push(name);
    if let Some(writer) = writer {
        hidden.push(format!(".{writer}"));
    }
    hidden.push(UNFINISHED_SUFFIX);
    Ok(place.with_file_name(hidden))
}

/// Writes a new file and syncs it to disk. An existing file or link of that name is removed, not followed.
pub(crate) fn write_new(
    disk: &dyn Disk,
    path: &Path,
    write: impl FnOnce(&mut dyn NewFile) -> io::Result<()>,
) -> io::Result<()> {
    remove(disk, path)?;
    let mut file = disk.create_new(path)?;
    let written = write(file.as_mut()).and_then(|()| file.sync());
    if written.is_err() {
        // The first error is the one to report.
        let _ = disk.remove(path);
    }
    written
}

/// Removes a file or link, if there is one.
pub(crate) fn remove(disk: &dyn Disk, path: &Path) -> io::Result<()> {
    match disk.remove(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        removed => removed,
    }
}

/// Creates a directory with those above it that are missing, so that it survives a loss of power: the entry of each is
/// synced. An existing directory is left as it is.
pub(crate) fn make_directories(disk: &dyn Disk, path: &Path) -> io::Result<()> {
    if path.is_dir() {
        return Ok(());
    }
    let above = directory_of(path);
    if above != path {
        make_directories(disk, above)?;
    }
    match disk.create_directory(path) {
        // Another process may have made it meanwhile.
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists && path.is_dir() => Ok(()),
        made => made.and_then(|()| disk.sync_directory(above)),
    }
}

/// Opens a file, creating it if it is missing, and locks it until the returned file is closed; `None` if another
/// process has locked it.
///
/// A symbolic link is refused: the lock would be that of a file elsewhere, which could be made or held by others.
pub(crate) fn lock(path: &Path) -> io::Result<Option<File>> {
    let mut options = File::options();
    options.create(true).truncate(false).write(true);
    #[cfg(unix)]
    {
        use rustix::fs::OFlags;
        use std::os::unix::fs::OpenOptionsExt as _;
        // A pipe without a reader must not block the start.
        let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK;
        options.custom_flags(i32::try_from(flags.bits()).map_err(io::Error::other)?);
    }
    let file = options.open(path).map_err(|error| {
        if fs::symlink_metadata(path).is_ok_and(|found| found.is_symlink()) {
            return io::Error::other("it is a symbolic link; remove it");
        }
        error
    })?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

#[cfg(test)]
mod tests;
