//! Snapshots as JSON files, and named snapshots in memory that restore as fast as a copy.
//!
//! The content of a snapshot is defined and validated by `ts3100-controller`. Replacing the running controller is done by
//! the driver (`driver::snapshots`); callers reach it by a [`SnapshotTask`].

use crate::files::{self, PathError, cannot};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use ts3100_controller::{Controller, Snapshot, SnapshotError, SnapshotHeader};
use ts3100_proto::words::plain_message;

/// Largest snapshot file in bytes: several times a full RAM drive.
pub const MAX_BYTES: u64 = 64 * 1024 * 1024;
/// Most named snapshots.
pub const MAX_NAMED: usize = 64;
/// Longest name, in bytes.
pub const MAX_NAME: usize = 64;

/// A text that is not a valid snapshot.
#[derive(Debug, thiserror::Error)]
pub enum ParseError {
    /// Not JSON, or not the JSON of a snapshot; the message names line and column.
    #[error("this is not a snapshot: {}", plain_message(&.0.to_string()))]
    Json(serde_json::Error),
    /// Another version, or a state that cannot occur.
    #[error(transparent)]
    Snapshot(#[from] SnapshotError),
    /// The file lacks a robot.
    #[error("the file has no robot `{0}`")]
    NoRobot(String),
    /// The file has a robot that is not in the cell.
    #[error("the cell has no robot `{0}`")]
    OtherRobot(String),
}

impl From<serde_json::Error> for ParseError {
    fn from(error: serde_json::Error) -> ParseError {
        ParseError::Json(error)
    }
}

/// A snapshot file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// An error of the operating system.
    #[error(transparent)]
    Io(#[from] PathError),
    /// The content is not a valid snapshot.
    #[error("{}: {reason}", path.display())]
    Parse {
        /// Path of the file.
        path: PathBuf,
        /// Reason, with line and column where known.
        reason: ParseError,
    },
}

/// Content of a snapshot file.
#[derive(Debug, Clone, Copy)]
pub enum States<'a> {
    /// The state of a single robot.
    One(&'a Controller),
    /// The states of robots by name: an object with the snapshot of each.
    Named(&'a [(String, Controller)]),
}

/// The file of robots with names.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct NamedFile<T> {
    robots: BTreeMap<String, T>,
}

/// The content of a snapshot file: indented JSON.
pub fn to_pretty_json(states: States<'_>) -> String {
    match states {
        States::One(controller) => pretty(&controller.snapshot()),
        States::Named(states) => {
            let robots = states.iter();
            let robots = robots.map(|(name, controller)| (name.clone(), controller.snapshot()));
            let robots = robots.collect();
            pretty(&NamedFile { robots })
        }
    }
}

fn pretty(content: &impl Serialize) -> String {
    // Serialization fails only for maps whose keys are not strings; a snapshot has none.
    serde_json::to_string_pretty(content).unwrap_or_default() + "\n"
}

/// The snapshot of a controller as JSON on one line.
pub fn to_json_line(controller: &Controller) -> String {
    // As above.
    serde_json::to_string(&controller.snapshot()).unwrap_or_default()
}

/// Restores a controller from JSON.
///
/// # Errors
/// [`ParseError`].
pub fn from_json(text: &str) -> Result<Controller, ParseError> {
    // Check the version first: in another version every other field may differ.
    serde_json::from_str::<SnapshotHeader>(text)?.validate()?;
    let snapshot: Snapshot = serde_json::from_str(text)?;
    Ok(Controller::restore(snapshot)?)
}

/// Restores the controllers of these robots from JSON, in this order.
///
/// # Errors
/// [`ParseError`]; there has to be the state of each robot, and of no other.
pub fn named_from_json(text: &str, names: &[String]) -> Result<Vec<Controller>, ParseError> {
    let mut robots = parse_named(text)?;
    let controllers = names.iter().map(|name| take(&mut robots, name));
    let controllers = controllers.collect::<Result<_, _>>()?;
    match robots.into_keys().next() {
        Some(name) => Err(ParseError::OtherRobot(name)),
        None => Ok(controllers),
    }
}

/// As in [`from_json`], the versions are checked first.
fn parse_named(text: &str) -> Result<BTreeMap<String, Snapshot>, ParseError> {
    let headers: NamedFile<SnapshotHeader> = serde_json::from_str(text)?;
    headers.robots.values().try_for_each(SnapshotHeader::validate)?;
    Ok(serde_json::from_str::<NamedFile<Snapshot>>(text)?.robots)
}

fn take(robots: &mut BTreeMap<String, Snapshot>, name: &str) -> Result<Controller, ParseError> {
    let snapshot = robots.remove(name);
    let snapshot = snapshot.ok_or_else(|| ParseError::NoRobot(name.to_owned()))?;
    Ok(Controller::restore(snapshot)?)
}

/// Reads the state of a robot that is alone from a file, or of the robot of this name.
///
/// # Errors
/// [`FileError`].
pub fn read(path: &Path, name: Option<&str>) -> Result<Controller, FileError> {
    let text = read_text(path)?;
    let state = match name {
        Some(name) => parse_named(&text).and_then(|mut robots| take(&mut robots, name)),
        None => from_json(&text),
    };
    state.map_err(unreadable(path))
}

/// Reads the states of these robots from a file; see [`named_from_json`].
///
/// # Errors
/// [`FileError`].
pub fn read_named(path: &Path, names: &[String]) -> Result<Vec<Controller>, FileError> {
    named_from_json(&read_text(path)?, names).map_err(unreadable(path))
}

/// Writes a snapshot file atomically.
///
/// # Errors
/// [`FileError::Io`].
pub fn write(path: &Path, states: States<'_>) -> Result<(), FileError> {
    let written = files::replace(path, to_pretty_json(states).as_bytes());
    Ok(written.map_err(cannot("write the snapshot", path))?)
}

/// Checks that [`write()`] could write to `path`.
///
/// # Errors
/// [`FileError::Io`].
pub fn check_target(path: &Path) -> Result<(), FileError> {
    Ok(files::check_target(path).map_err(cannot("write the snapshot", path))?)
}

fn read_text(path: &Path) -> Result<String, FileError> {
    Ok(files::read_text(path, MAX_BYTES).map_err(cannot("read the snapshot", path))?)
}

/// Adds the path to an error in the content of a file.
fn unreadable(path: &Path) -> impl Fn(ParseError) -> FileError {
    move |reason| FileError::Parse {
        path: path.to_path_buf(),
        reason,
    }
}

/// Why a named snapshot could not be saved or found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NamedError {
    /// Not a valid name.
    #[error("name of a snapshot: expected 1 to {MAX_NAME} letters, digits, `-`, `_` or `.`, found `{0}`")]
    Name(String),
    /// No snapshot has this name.
    #[error("snapshot: expected {expected}, found `{found}`")]
    Unknown {
        /// The existing names.
        expected: String,
        /// The unknown name.
        found: String,
    },
    /// [`MAX_NAMED`] snapshots exist already.
    #[error("cannot take another snapshot: {MAX_NAMED} exist already; delete one first")]
    Full,
}

/// Named snapshots in memory.
#[derive(Debug, Clone, Default)]
pub struct SnapshotStore(BTreeMap<String, Controller>);

impl SnapshotStore {
    /// Checks that a task about them would not be refused.
    ///
    /// # Errors
    /// Those of [`SnapshotStore::insert`], [`SnapshotStore::get`] and [`SnapshotStore::remove`].
    pub fn check(&self, task: &SnapshotTask) -> Result<(), NamedError> {
        match task {
            SnapshotTask::Save(name) => self.check_new(name),
            SnapshotTask::Restore(name) | SnapshotTask::Remove(name) => self.get(name).map(drop),
            SnapshotTask::Replace(_) | SnapshotTask::Copy(_) => Ok(()),
        }
    }

    fn check_new(&self, name: &str) -> Result<(), NamedError> {
        let letter = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
        if name.is_empty() || name.len() > MAX_NAME || !name.bytes().all(letter) {
            return Err(NamedError::Name(name.chars().take(MAX_NAME).collect()));
        }
        if self.0.len() >= MAX_NAMED && !self.0.contains_key(name) {
            return Err(NamedError::Full);
        }
        Ok(())
    }

    /// Stores a snapshot; replaces one with the same name.
    ///
    /// # Errors
    /// [`NamedError::Name`] or [`NamedError::Full`].
    pub fn insert(&mut self, name: &str, controller: Controller) -> Result<(), NamedError> {
        self.check_new(name)?;
        self.0.insert(name.to_owned(), controller);
        Ok(())
    }

    /// The snapshot with this name.
    ///
    /// # Errors
    /// [`NamedError::Unknown`].
    pub fn get(&self, name: &str) -> Result<&Controller, NamedError> {
        self.0.get(name).ok_or_else(|| self.unknown(name))
    }

    /// Removes the snapshot with this name.
    ///
    /// # Errors
    /// [`NamedError::Unknown`].
    pub fn remove(&mut self, name: &str) -> Result<(), NamedError> {
        self.0.remove(name).map(drop).ok_or_else(|| self.unknown(name))
    }

    /// The names, each with the virtual time of its snapshot in microseconds.
    pub fn list(&self) -> Vec<(String, u64)> {
        let moments = self.0.iter();
        moments
            .map(|(name, at)| (name.clone(), at.now().as_micros()))
            .collect()
    }

    fn unknown(&self, name: &str) -> NamedError {
        let names: Vec<&str> = self.0.keys().map(String::as_str).collect();
        NamedError::Unknown {
            expected: if names.is_empty() {
                "the name of a snapshot (none exists)".to_owned()
            } else {
                format!("one of {}", names.join(", "))
            },
            found: name.chars().take(MAX_NAME).collect(),
        }
    }
}

/// Why a snapshot request failed.
#[derive(Debug, thiserror::Error)]
pub enum SnapshotRequestError {
    /// The snapshot is restored, but the backing directory lacks some of its files.
    #[error("the snapshot is restored, but not all of its files are stored: {0}")]
    Drive(String),
    /// The name is invalid, unknown, or one too many.
    #[error(transparent)]
    Named(#[from] NamedError),
    /// The text is not a valid snapshot.
    #[error(transparent)]
    Parse(#[from] ParseError),
    /// The file cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The snapshot is restored, but its ports cannot be opened.
    #[error("the snapshot is restored, but no port is open: {0}")]
    Channels(String),
    /// The queue is full, or the emulator has ended.
    #[error("the emulator accepts no request: too many are waiting, or it has ended")]
    Busy,
}

/// An operation on snapshots.
#[derive(Debug)]
pub enum SnapshotTask {
    /// Save the current state under this name.
    Save(String),
    /// Restore the snapshot with this name.
    Restore(String),
    /// Replace the current state by this one.
    Replace(Box<Controller>),
    /// Remove the snapshot with this name.
    Remove(String),
    /// Hand a copy of the current state to the caller.
    Copy(CopyOfState),
}

/// Takes a copy of a state, in which no change of a file waits.
pub struct CopyOfState(pub Box<dyn FnOnce(Controller) + Send>);

impl fmt::Debug for CopyOfState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("CopyOfState")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TempDir;
    use ts3100_controller::{Config, Dialect};

    /// A controller whose outputs have been fetched: those are not in a snapshot.
    fn fresh() -> Controller {
        let mut controller = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
        while controller.poll_output().is_some() {}
        controller
    }

    #[test]
    fn the_store_is_bounded_and_lists_what_it_has() {
        let mut store = SnapshotStore::default();
        assert!(store.get("a").unwrap_err().to_string().contains("none exists"));
        for number in 0..MAX_NAMED {
            store.insert(&format!("n{number}"), fresh()).unwrap();
        }
        assert_eq!(store.insert("more", fresh()), Err(NamedError::Full));
        store.insert("n3", fresh()).unwrap();
        store.remove("n3").unwrap();
        store.insert("more", fresh()).unwrap();
        assert_eq!(store.list().len(), MAX_NAMED);
        assert!(store.get("n3").unwrap_err().to_string().contains("more, n0, n1"));
        for name in ["", "a b", "../a", &"x".repeat(MAX_NAME + 1)] {
            assert!(
                matches!(store.insert(name, fresh()), Err(NamedError::Name(_))),
                "{name}"
            );
        }
    }

    #[test]
    fn a_file_comes_back_and_what_is_wrong_with_one_is_said_with_its_place() {
        let directory = TempDir::new("snapshot");
        let path = directory.path().join("a.json");
        write(&path, States::One(&fresh())).unwrap();
        assert!(read(&path, None).unwrap() == fresh());
        assert_eq!(
            std::fs::read_dir(directory.path()).unwrap().count(),
            1,
            "no part is left"
        );
        let text = to_pretty_json(States::One(&fresh()));
        for (from, to, expected) in [
            ("\"version\": 1", "\"version\": 9", "version: expected 1, found 9"),
            ("\"servo\": false", "\"servo\": 5", "line "),
            (
                "\"override_percent\": 100",
                "\"override_percent\": 101",
                "panel.override_percent",
            ),
            ("\"arm\"", "\"leg\"", "unknown field `leg`"),
        ] {
            assert!(text.contains(from), "{from}");
            std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
            let error = read(&path, None).unwrap_err().to_string();
            assert!(error.contains("a.json") && error.contains(expected), "{error}");
        }
        assert!(
            read(&directory.path().join("b.json"), None)
                .unwrap_err()
                .to_string()
                .contains("cannot read")
        );
    }
}
