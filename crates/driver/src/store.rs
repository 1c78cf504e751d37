//! The backing directory of the RAM drive (`--drive DIR`, decision D13): files survive a restart or a kill of the daemon.
//!
//! A file is written under a temporary name, synced and renamed, so that it exists whole or not at all. `history` keeps
//! the error history in the same directory. The store itself writes names in upper case; any other file was put there by
//! hand and becomes a file of the drive as one of `--load` does ([`crate::pc_file`]). What happens when a write fails is
//! decided in [`backing`].

pub mod backing;
mod history;

use crate::files::disk::{Disk, System};
use crate::files::{self, PathError, UNFINISHED_SUFFIX, cannot};
use crate::pc_file::{self, drive_name};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ffi::OsString;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use ts3100_controller::alarm::Alarm;
use ts3100_controller::limits;
use ts3100_proto::file::{FileRule, check_file};
use ts3100_proto::name::FileName;
use ts3100_proto::parameter::LineEnd;

/// Hidden file whose lock says that an emulator keeps its files here. It stays when the emulator ends; the
/// lock does not, whatever the end was.
const LOCK: &str = ".ts3100.lock";

/// An error of the backing directory.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// An error of the operating system.
    #[error(transparent)]
    Io(#[from] PathError),
    /// The directory was removed or replaced after it was opened.
    #[error(
        "the directory {} was removed or replaced while ts3100 ran; restore it, or restart ts3100",
        path.display()
    )]
    DirectoryReplaced {
        /// The directory.
        path: PathBuf,
    },
    /// The write ended before it was done.
    #[error("cannot finish the write: {0}")]
    Unfinished(tokio::task::JoinError),
    /// Another emulator, of this process or another, keeps its files there.
    #[error(
        "the directory {} is the RAM drive of another running ts3100; end it, or give each its own --drive",
        path.display()
    )]
    InUse {
        /// The directory.
        path: PathBuf,
    },
    /// A file that cannot be stored on the RAM drive.
    #[error("cannot use {} as a file of the RAM drive: {reason}", path.display())]
    NotADriveFile {
        /// The file.
        path: PathBuf,
        reason: String,
    },
}

impl StoreError {
    /// The error without the name of the file.
    fn cause(&self) -> String {
        if let StoreError::Io(error) = self {
            return error.reason.to_string();
        }
        self.to_string()
    }
}

/// An open backing directory, locked until it is dropped.
#[derive(Debug)]
pub struct Store {
    disk: Box<dyn Disk>,
    directory: PathBuf,
    /// The directory itself, to notice that its name now refers to another one. Unix only.
    handle: Option<File>,
    /// Holds the lock until it is closed.
    _lock: File,
    /// Name on the drive to name in the directory: that of a file put there by hand may differ.
    files: BTreeMap<String, OsString>,
    /// Names in the directory that the store would write, whose files were skipped.
    skipped: BTreeSet<OsString>,
    /// The error history as it was saved last.
    history: VecDeque<Alarm>,
    /// Warnings about entries that were skipped.
    warnings: Vec<String>,
}

/// The files found in a backing directory: name on the drive (upper case) and content.
pub type StoredFiles = Vec<(String, Vec<u8>)>;

impl Store {
    /// Opens the directory, makes it if it is missing, and reads its files and the error history. Hidden files are left
    /// alone, except unfinished ones of an earlier run, which are removed. A file that cannot be on the RAM drive
    /// because of its name or content is left alone too and named among the [warnings](Store::warnings). A file put
    /// there by hand gets the line ends of the drive in memory only.
    ///
    /// # Errors
    /// The system's, [`StoreError::InUse`], and [`StoreError::NotADriveFile`] for two files with one name on the drive, or
    /// one file too many.
    pub fn open(directory: &Path, line_end: LineEnd) -> Result<(Store, StoredFiles), StoreError> {
        Store::open_on(Box::new(System), directory, line_end)
    }

    /// As [`Store::open`], writing to this disk.
    fn open_on(
        disk: Box<dyn Disk>,
        directory: &Path,
        line_end: LineEnd,
    ) -> Result<(Store, StoredFiles), StoreError> {
        files::make_directories(disk.as_ref(), directory).map_err(cannot("make the directory", directory))?;
        let lock_file = directory.join(LOCK);
        let Some(lock) = files::lock(&lock_file).map_err(cannot("lock", &lock_file))? else {
            let path = directory.to_path_buf();
            return Err(StoreError::InUse { path });
        };
        let mut store = Store {
            disk,
            directory: directory.to_path_buf(),
            handle: cfg!(unix)
                .then(|| File::open(directory))
                .transpose()
                .map_err(cannot("open", directory))?,
            _lock: lock,
            files: BTreeMap::new(),
            skipped: BTreeSet::new(),
            history: VecDeque::new(),
            warnings: Vec::new(),
        };
        let mut found = Vec::new();
        for entry in fs::read_dir(directory).map_err(cannot("list", directory))? {
            let entry = entry.map_err(cannot("list", directory))?;
            if let Some(file) = store.load_entry(&entry, line_end)? {
                found.push(file);
            }
        }
        found.sort();
        store.warnings.sort();
        store.read_history();
        Ok((store, found))
    }

    /// Warnings about entries that were skipped when the directory was opened.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Warns of an entry that is not loaded.
    fn skip<T>(&mut self, path: &Path, reason: impl std::fmt::Display) -> Option<T> {
        let path = path.display();
        self.warnings.push(format!(
            "skipping {path}: it cannot be a file of the RAM drive: {reason}"
        ));
        None
    }

    fn load_entry(
        &mut self,
        entry: &fs::DirEntry,
        line_end: LineEnd,
    ) -> Result<Option<(String, Vec<u8>)>, StoreError> {
        let (path, file_name) = (entry.path(), entry.file_name());
        let foreign = |reason: String| StoreError::NotADriveFile {
            path: path.clone(),
            reason,
        };
        let Some(text) = file_name.to_str() else {
            return Ok(self.skip(&path, "its name is not UTF-8"));
        };
        if text.starts_with('.') {
            if text.ends_with(UNFINISHED_SUFFIX) {
                // Its write was never confirmed to a host. The lock is held, so nobody else is writing it.
                self.disk
                    .remove(&path)
                    .map_err(cannot("remove the unfinished file", &path))?;
            }
            return Ok(None);
        }
        // The store writes names in upper case; another one is that of a file of the PC.
        let own = FileName::parse(text).is_ok_and(|name| name.as_str() == text);
        let name = match own {
            true => Ok(text.to_owned()),
            false => drive_name(&path).map_err(|error| error.reason().to_owned()),
        };
        let name = match name {
            Ok(name) => name,
            Err(reason) => return Ok(self.skip(&path, reason)),
        };
        let metadata = fs::metadata(&path).map_err(cannot("look at", &path))?;
        if !metadata.is_file() {
            return Ok(self.skip(&path, "it is not a file"));
        }
        let content = match own {
            true => pc_file::read_stored(&path),
            false => pc_file::read_converted(&path, line_end),
        };
        let content = match content {
            Err(error) if error.kind() != io::ErrorKind::FileTooLarge => {
                return Err(cannot("read", &path)(error).into());
            }
            content => content.map_err(|error| error.to_string()),
        };
        let rule = match FileName::parse(&name).is_ok_and(|name| name.is_parameter()) {
            true => FileRule::Parameter,
            false => FileRule::User,
        };
        let checked = content.and_then(|content| {
            check_file(&content, rule)
                .map(|()| content)
                .map_err(|error| error.to_string())
        });
        let content = match checked {
            Ok(content) => content,
            Err(reason) => {
                if own {
                    self.skipped.insert(file_name);
                }
                return Ok(self.skip(&path, reason));
            }
        };
        if self.files.len() >= limits::MAX_FILES {
            return Err(foreign(format!("more than {} files", limits::MAX_FILES)));
        }
        if let Some(other) = self.files.insert(name.clone(), file_name.clone()) {
            return Err(foreign(format!(
                "on the RAM drive it has the same name as {}",
                other.display()
            )));
        }
        Ok(Some((name, content)))
    }

    /// Writes a file durably under its upper-case name; replaces the previous content.
    ///
    /// # Errors
    /// The operating system failed, or a file that was skipped has this name; the previous content is unchanged.
    pub fn put(&mut self, name: &str, content: &[u8]) -> Result<(), StoreError> {
        let place = self.path_of(name)?;
        // The drive does not show a skipped file, so the host cannot know that it would destroy one.
        if self.skipped.contains(std::ffi::OsStr::new(name)) && place.exists() {
            let reason = "a file of this name was skipped at the start; move that file away".to_owned();
            return Err(StoreError::NotADriveFile { path: place, reason });
        }
        let unfinished = self.write_temporary(name, content)?;
        // A file put there by hand first takes the name that the store writes, so that no moment and no
        // file system sees two of them or none.
        if let Some(previous) = self.files.get(name)
            && previous != name
        {
            let path = self.directory.join(previous);
            self.disk.rename(&path, &place).map_err(cannot("rename", &path))?;
            // Without it, a loss of power could undo this rename and not the next: both names would be there.
            self.sync()?;
        }
        self.put_in_place(&unfinished, &place)?;
        self.files.insert(name.to_owned(), OsString::from(name));
        Ok(())
    }

    /// Atomically replaces a file of the store itself.
    fn replace(&self, name: &str, content: &[u8]) -> Result<(), StoreError> {
        let unfinished = self.write_temporary(name, content)?;
        self.put_in_place(&unfinished, &self.directory.join(name))
    }

    fn put_in_place(&self, unfinished: &Path, place: &Path) -> Result<(), StoreError> {
        // The content is on the disk before it gets its name (`files::write_new` syncs it): after a loss of power the
        // name has the old content or the new one. The answer to the host waits for the directory too, else the rename
        // could be lost.
        self.disk
            .rename(unfinished, place)
            .map_err(cannot("put in place", place))?;
        self.sync()
    }

    /// Writes the new content under a temporary name and returns its path.
    fn write_temporary(&self, name: &str, content: &[u8]) -> Result<PathBuf, StoreError> {
        self.check_directory()?;
        let place = self.directory.join(name);
        // The lock says that nobody else writes here, so the name may be the same each time.
        let unfinished = files::unfinished_path(&place, None).map_err(cannot("write", &place))?;
        files::write_new(self.disk.as_ref(), &unfinished, |file| file.write_all(content))
            .map_err(cannot("write", &place))?;
        Ok(unfinished)
    }

    /// Removes a file; nothing happens if it is not there.
    ///
    /// # Errors
    /// The system's.
    pub fn remove(&mut self, name: &str) -> Result<(), StoreError> {
        self.check_directory()?;
        let Some(actual) = self.files.get(name) else {
            return Ok(());
        };
        let path = self.directory.join(actual);
        files::remove(self.disk.as_ref(), &path).map_err(cannot("remove", &path))?;
        self.files.remove(name);
        self.sync()
    }

    /// Fails if the directory was replaced: writes would go to a directory that the next start does not read.
    fn check_directory(&self) -> Result<(), StoreError> {
        #[cfg(unix)]
        if let Some(opened) = &self.handle {
            use std::os::unix::fs::MetadataExt as _;
            let identity = |found: fs::Metadata| (found.dev(), found.ino());
            let there = fs::metadata(&self.directory).map(identity).ok();
            if there != opened.metadata().map(identity).ok() {
                return Err(StoreError::DirectoryReplaced {
                    path: self.directory.clone(),
                });
            }
        }
        Ok(())
    }

    /// Path of a file of the RAM drive. Only a normalized name is accepted, so that no name leads out of the
    /// directory.
    fn path_of(&self, name: &str) -> Result<PathBuf, StoreError> {
        let path = self.directory.join(name);
        let reason = match FileName::parse(name) {
            Ok(normal) if normal.as_str() == name => return Ok(path),
            Ok(_) => "its name is not in upper case".to_owned(),
            Err(error) => error.to_string(),
        };
        Err(StoreError::NotADriveFile { path, reason })
    }

    fn sync(&self) -> Result<(), StoreError> {
        let synced = self.disk.sync_directory(&self.directory);
        Ok(synced.map_err(cannot("sync", &self.directory))?)
    }
}

#[cfg(test)]
mod tests;
