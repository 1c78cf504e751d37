//! The RAM drive: user files and parameter files in memory.
//!
//! A file is stored whole or not at all, so a failed download leaves the old file in place. The rules for the content
//! are in `ts3100_proto::file`; programs are compiled from it elsewhere. The embedding program persists the drive over a
//! restart (see `persistence`).

use crate::limits::{MAX_FILE, MAX_FILES};
use crate::prelude::*;
use alloc::collections::BTreeMap;
use bytes::Bytes;
use ts3100_proto::file::{FileError, FileRule, check_file};
use ts3100_proto::name::{FileName, NameError};
use ts3100_proto::status::ca::DirectoryEntry;

/// Why the embedding program has not kept a change of a file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PersistError {
    /// Another input came instead of the answer.
    #[error("the store did not answer before the next input")]
    NoAnswer,
    /// Its own reason.
    #[error("{0}")]
    Refused(String),
}

/// Why a file was not stored.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DriveError {
    /// The name is not a valid file name.
    #[error("file name: {0}")]
    Name(NameError),
    /// The content breaks the rules for a user file.
    #[error("file {name}: {fault}")]
    Content {
        /// Name of the file.
        name: String,
        /// The rule that is broken, and where.
        fault: FileError,
    },
    /// The file is larger than the directory can show (RAM-03).
    #[error("file {name} has {size} bytes; at most {MAX_FILE} are allowed")]
    TooLarge {
        /// Name of the file.
        name: String,
        /// Its size in bytes.
        size: usize,
    },
    /// The drive has too little room.
    #[error("file {name}: {size} bytes found, {free} free on the RAM drive")]
    Full {
        /// Name of the file.
        name: String,
        /// Its size in bytes.
        size: usize,
        /// Free bytes.
        free: usize,
    },
    /// The embedding program could not persist the file, so it is not stored here either.
    #[error("file {name}: {reason}")]
    NotPersisted {
        /// Name of the file.
        name: String,
        /// Reason given by the embedding program.
        reason: PersistError,
    },
    /// The drive holds the maximum number of files already.
    #[error("file {name}: the RAM drive holds at most {MAX_FILES} files")]
    TooMany {
        /// Name of the file.
        name: String,
    },
}

impl From<NameError> for DriveError {
    fn from(error: NameError) -> DriveError {
        DriveError::Name(error)
    }
}

/// The content of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Content(#[serde(with = "ts3100_proto::serde_latin1")] Bytes);

#[cfg(test)]
std::thread_local! {
    /// How often a file was checked in this thread: each change has to be carried out once.
    pub(crate) static STAGED: core::cell::Cell<u32> = const { core::cell::Cell::new(0) };
}

/// The files of the RAM drive, by name.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drive {
    files: BTreeMap<String, Content>,
    capacity: usize,
}

/// A change of the drive that has been checked: a file is stored, or with no content erased.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Staged {
    name: FileName,
    content: Option<Content>,
}

impl Staged {
    pub(crate) fn name(&self) -> &FileName {
        &self.name
    }

    /// Its new content; `None`: it is erased.
    pub(crate) fn content(&self) -> Option<&Bytes> {
        self.content.as_ref().map(|content| &content.0)
    }
}

impl Drive {
    /// An empty drive of `capacity` bytes.
    pub fn new(capacity: usize) -> Drive {
        Drive {
            files: BTreeMap::new(),
            capacity,
        }
    }

    /// Content of a file, without EOF.
    pub fn get(&self, name: &str) -> Option<&[u8]> {
        self.files.get(name).map(|content| &*content.0)
    }

    /// Name and content of each file, in alphabetical order.
    pub fn files(&self) -> impl Iterator<Item = (&str, &[u8])> {
        let files = self.files.iter();
        files.map(|(name, content)| (name.as_str(), &*content.0))
    }

    /// Whether a file of this name exists.
    pub fn contains(&self, name: &str) -> bool {
        self.files.contains_key(name)
    }

    /// The rules for the content of a file of this name.
    pub fn file_rule(name: &FileName) -> FileRule {
        if name.is_parameter() {
            FileRule::Parameter
        } else {
            FileRule::User
        }
    }

    /// Most bytes that a file of this name may have now. Parameter files do not count towards the capacity.
    pub fn free_bytes_for(&self, name: &FileName) -> usize {
        if name.is_parameter() {
            return MAX_FILE;
        }
        let is_parameter = |other: &str| FileName::parse(other).is_ok_and(|other| other.is_parameter());
        let counts = |other: &str| other != name.as_str() && !is_parameter(other);
        let others = self.files.iter().filter(|(other, _)| counts(other));
        let taken: usize = others.map(|(_, content)| content.0.len()).sum();
        self.capacity.saturating_sub(taken).min(MAX_FILE)
    }

    /// Stores a file; replaces a file of the same name.
    ///
    /// # Errors
    /// [`DriveError`]; the drive is then unchanged.
    pub fn store(&mut self, name: &FileName, content: impl Into<Bytes>) -> Result<(), DriveError> {
        let staged = self.stage(name, content.into())?;
        self.commit(staged);
        Ok(())
    }

    /// Checks everything that can speak against storing a file.
    ///
    /// # Errors
    /// [`DriveError`]; of everything but the world outside.
    pub(crate) fn stage(&self, name: &FileName, content: Bytes) -> Result<Staged, DriveError> {
        #[cfg(test)]
        STAGED.with(|staged| staged.set(staged.get() + 1));
        self.check(name, &content)?;
        Ok(Staged {
            name: name.clone(),
            content: Some(Content(content)),
        })
    }

    /// The same for erasing one, against which nothing speaks.
    pub(crate) fn stage_erase(name: &FileName) -> Staged {
        Staged {
            name: name.clone(),
            content: None,
        }
    }

    /// Makes a change.
    pub(crate) fn commit(&mut self, Staged { name, content }: Staged) {
        match content {
            Some(content) => self.files.insert(name.to_string(), content),
            None => self.files.remove(name.as_str()),
        };
    }

    fn check(&self, name: &FileName, content: &[u8]) -> Result<(), DriveError> {
        let label = || String::from(name.as_str());
        let size = content.len();
        if size > MAX_FILE {
            return Err(DriveError::TooLarge { name: label(), size });
        }
        let free = self.free_bytes_for(name);
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
        check_file(content, Drive::file_rule(name))
            .map_err(|fault| DriveError::Content { name: label(), fault })
    }

    /// The directory in alphabetical order (DIR-04); size without EOF (DIR-03).
    pub fn directory(&self) -> Vec<DirectoryEntry> {
        let entries = self.files.iter().map(|(name, content)| DirectoryEntry {
            name: name.clone(),
            size: u32::try_from(content.0.len()).unwrap_or(u32::MAX),
            attribute: None,
        });
        entries.collect()
    }
}
