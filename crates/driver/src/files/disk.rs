//! The operations whose order decides what a loss of power leaves of files: everything the store and
//! [`replace`](super::replace) write goes through [`Disk`]. Reading does not.
//!
//! [`System`] is the file system. The tests of the store put a model of a disk that loses power in its place.

use std::fmt::Debug;
use std::fs::{self, File, Permissions};
use std::io;
use std::path::Path;

/// Where files are written.
pub(crate) trait Disk: Debug + Send + Sync {
    /// Creates a file that does not exist yet.
    fn create_new(&self, path: &Path) -> io::Result<Box<dyn NewFile>>;
    /// Gives a file another name in the same directory; a file of that name is replaced.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;
    /// Removes a file or link.
    fn remove(&self, path: &Path) -> io::Result<()>;
    /// Creates a directory.
    fn create_directory(&self, path: &Path) -> io::Result<()>;
    /// Puts the entries of a directory on the disk.
    fn sync_directory(&self, path: &Path) -> io::Result<()>;
}

/// A file that is being written.
pub(crate) trait NewFile: io::Write {
    /// Puts the content on the disk.
    fn sync(&mut self) -> io::Result<()>;
    /// Sets who may do what with it.
    fn set_permissions(&self, permissions: Permissions) -> io::Result<()>;
}

/// The file system.
#[derive(Debug, Clone, Copy)]
pub(crate) struct System;

impl Disk for System {
    fn create_new(&self, path: &Path) -> io::Result<Box<dyn NewFile>> {
        let file = File::options().write(true).create_new(true).open(path)?;
        Ok(Box::new(file))
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        fs::remove_file(path)
    }

    fn create_directory(&self, path: &Path) -> io::Result<()> {
        fs::create_dir(path)
    }

    fn sync_directory(&self, path: &Path) -> io::Result<()> {
        // A directory can be opened and synced on Unix only; elsewhere the rename has to suffice.
        if cfg!(unix) {
            File::open(path)?.sync_all()?;
        }
        Ok(())
    }
}

impl NewFile for File {
    fn sync(&mut self) -> io::Result<()> {
        self.sync_all()
    }

    fn set_permissions(&self, permissions: Permissions) -> io::Result<()> {
        File::set_permissions(self, permissions)
    }
}
