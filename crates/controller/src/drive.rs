//! The RAM drive: user files and parameter files, kept whole or not at all. What the files say is
//! scol-mini's and proto's; keeping them over a restart is the edge's.

use crate::limits::{MAX_FILE, MAX_FILES};
use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::vec::Vec;
use thiserror::Error;
use ts3100_proto::file::{FileError, FileRule, check_file};
use ts3100_proto::name::{FileName, NameError};
use ts3100_proto::status::ca::DirectoryEntry;

/// Why a file was not taken.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum DriveError {
    /// Not a file name of the RAM drive.
    #[error("file name: {0}")]
    Name(NameError),
    /// Its text breaks the rules of a user file.
    #[error("file {name}: {fault}")]
    Content {
        /// The file.
        name: String,
        /// What is wrong.
        fault: FileError,
    },
    /// More than the directory can state.
    #[error("file {name}: at most {MAX_FILE} bytes expected, {size} found")]
    TooLarge {
        /// The file.
        name: String,
        /// Its size in bytes.
        size: usize,
    },
    /// The drive is full.
    #[error("file {name}: {size} bytes found, {free} free on the RAM drive")]
    Full {
        /// The file.
        name: String,
        /// Its size in bytes.
        size: usize,
        /// Bytes that are free.
        free: usize,
    },
    /// It is kept outside of the controller too, and cannot be kept there.
    #[error("file {name}: {reason}")]
    Unkept {
        /// The file.
        name: String,
        /// What whoever keeps it says.
        reason: String,
    },
    /// Too many files.
    #[error("file {name}: the RAM drive holds at most {MAX_FILES} files")]
    TooMany {
        /// The file.
        name: String,
    },
}

impl From<NameError> for DriveError {
    fn from(error: NameError) -> DriveError {
        DriveError::Name(error)
    }
}

/// The files.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Drive {
    #[cfg_attr(feature = "serde", serde(with = "crate::snapshot::field::files"))]
    files: BTreeMap<String, Vec<u8>>,
    capacity: usize,
}

impl Drive {
    /// An empty drive of `capacity` bytes.
    #[must_use]
    pub fn new(capacity: usize) -> Drive {
        Drive {
            files: BTreeMap::new(),
            capacity,
        }
    }

    /// Content of a file, without EOF.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&[u8]> {
        self.files.get(name).map(Vec::as_slice)
    }

    /// The files in alphabetical order.
    pub fn files(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.files
            .iter()
            .map(|(name, content)| (name.as_str(), content.as_slice()))
    }

    /// Whether the file is there.
    #[must_use]
    pub fn contains(&self, name: &str) -> bool {
        self.files.contains_key(name)
    }

    /// The rules for what stands in a file of this name.
    #[must_use]
    pub fn rule(name: &FileName) -> FileRule {
        if name.is_parameter() {
            FileRule::Parameter
        } else {
            FileRule::User
        }
    }

    /// Bytes that a file of this name may have. The capacity is that of the user files; the parameter files have
    /// their place besides.
    #[must_use]
    pub fn room_for(&self, name: &FileName) -> usize {
        if name.is_parameter() {
            return MAX_FILE;
        }
        let is_parameter = |other: &str| FileName::parse(other).is_ok_and(|other| other.is_parameter());
        let others = self
            .files
            .iter()
            .filter(|(other, _)| other.as_str() != name.as_str() && !is_parameter(other));
        let taken: usize = others.map(|(_, content)| content.len()).sum();
        self.capacity.saturating_sub(taken).min(MAX_FILE)
    }

    /// Stores a file, in place of one of the same name.
    ///
    /// # Errors
    /// Too large, no room, too many files, or text that breaks the rules; the drive is then as before.
    pub fn store(&mut self, name: &FileName, content: &[u8]) -> Result<(), DriveError> {
        self.check(name, content)?;
        self.put(name, content);
        Ok(())
    }

    /// Whether [`Drive::store`] would take a file.
    ///
    /// # Errors
    /// As of [`Drive::store`].
    pub fn check(&self, name: &FileName, content: &[u8]) -> Result<(), DriveError> {
        let label = || String::from(name.as_str());
        let size = content.len();
        if size > MAX_FILE {
            return Err(DriveError::TooLarge { name: label(), size });
        }
        let free = self.room_for(name);
        if size > free {
            return Err(DriveError::Full {
                name: label(),
                size,
                free,
            });
        }
        if !self.contains(name.as_str()) && self.files.len() >= MAX_FILES {
            return Err(DriveError::TooMany { name: label() });
        }
        check_file(content, Drive::rule(name)).map_err(|fault| DriveError::Content { name: label(), fault })
    }

    /// Stores what was checked.
    pub(crate) fn put(&mut self, name: &FileName, content: &[u8]) {
        self.files.insert(String::from(name.as_str()), content.to_vec());
    }

    /// Erases a file; false if there is none.
    pub fn erase(&mut self, name: &str) -> bool {
        self.files.remove(name).is_some()
    }

    /// The directory in alphabetical order (DIR-04); size without EOF (DIR-03).
    #[must_use]
    pub fn directory(&self) -> Vec<DirectoryEntry> {
        self.files
            .iter()
            .map(|(name, content)| DirectoryEntry {
                name: name.clone(),
                size: u32::try_from(content.len()).unwrap_or(u32::MAX),
                attribute: None,
            })
            .collect()
    }
}
