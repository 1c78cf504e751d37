//! Names of pseudo terminals: symbolic links that are replaced atomically, in a directory that is locked by one daemon at
//! a time.

use super::super::{SerialError, io_error};
use crate::files::disk::System;
use crate::files::{self, directory_of};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use ts3100_controller::Port;

/// Hidden file whose lock says that a daemon has its serial lines here. It stays when the daemon ends; the lock does
/// not, whatever the end was.
const LOCK: &str = ".ts3100-serial.lock";

/// The directories of one process, locked until this is dropped.
#[derive(Debug, Default)]
pub(in super::super) struct DirectoryLocks(BTreeMap<PathBuf, File>);

impl DirectoryLocks {
    /// Locks the directory of `link`, and creates it if it is missing.
    pub(in super::super) fn take(&mut self, port: Port, link: &Path) -> Result<(), SerialError> {
        let directory = directory_of(link);
        fs::create_dir_all(directory).map_err(io_error(port, "make the directory", directory.display()))?;
        let directory = directory
            .canonicalize()
            .map_err(io_error(port, "find", directory.display()))?;
        if self.0.contains_key(&directory) {
            return Ok(());
        }
        let path = directory.join(LOCK);
        let Some(file) = files::lock(&path).map_err(io_error(port, "lock", path.display()))? else {
            return Err(SerialError::InUse { path: directory });
        };
        self.0.insert(directory, file);
        Ok(())
    }
}

/// A symbolic link to a terminal, removed on drop unless another process has replaced it.
#[derive(Debug)]
pub(super) struct Link {
    path: PathBuf,
    target: PathBuf,
}

impl Link {
    /// Creates a link, replacing one that an ended process left there.
    pub(super) fn create(port: Port, path: &Path, target: &Path) -> Result<Link, SerialError> {
        if fs::symlink_metadata(path).is_ok_and(|found| !found.is_symlink()) {
            let path = path.to_path_buf();
            return Err(SerialError::Occupied { port, path });
        }
        let mut link = Link {
            path: path.to_path_buf(),
            target: PathBuf::new(),
        };
        link.point_to(target)
            .map_err(io_error(port, "make the link", path.display()))?;
        Ok(link)
    }

    /// Path of the link.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Points the link elsewhere, with no moment at which there is no link.
    pub(super) fn point_to(&mut self, target: &Path) -> io::Result<()> {
        let unfinished = files::unfinished_path(&self.path, None)?;
        files::remove(&System, &unfinished)?;
        symlink(target, &unfinished)?;
        fs::rename(&unfinished, &self.path)?;
        self.target = target.to_path_buf();
        Ok(())
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        if fs::read_link(&self.path).is_ok_and(|target| target == self.target) {
            // Fails when somebody was faster, which comes to the same.
            let _ = fs::remove_file(&self.path);
        }
    }
}
