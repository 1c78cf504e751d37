//! The state of several robots in one file: an object with the snapshot of each by its name.

use super::{FileError, ParseError, pretty, read_text, unreadable, write_text};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use ts3100_controller::{Controller, Snapshot, SnapshotHeader};

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CellFile<T> {
    robots: BTreeMap<String, T>,
}

/// The snapshots of robots as indented JSON.
pub fn to_pretty_json(states: &[(String, Controller)]) -> String {
    let states = states.iter();
    let robots = states
        .map(|(name, controller)| (name.clone(), controller.snapshot()))
        .collect();
    pretty(&CellFile { robots })
}

/// The controllers of these robots, in this order.
///
/// # Errors
/// [`ParseError`]; the file has to have the state of each robot, and of no other.
pub fn from_json(text: &str, names: &[String]) -> Result<Vec<Controller>, ParseError> {
    // Check the versions first: in another version every other field may differ.
    for header in serde_json::from_str::<CellFile<SnapshotHeader>>(text)?
        .robots
        .values()
    {
        header.validate()?;
    }
    let mut file: CellFile<Snapshot> = serde_json::from_str(text)?;
    let mut controllers = Vec::new();
    for name in names {
        let snapshot = file
            .robots
            .remove(name)
            .ok_or_else(|| ParseError::NoRobot(name.clone()))?;
        controllers.push(Controller::restore(snapshot)?);
    }
    match file.robots.into_keys().next() {
        Some(name) => Err(ParseError::OtherRobot(name)),
        None => Ok(controllers),
    }
}

/// Reads the file of a cell; see [`from_json`].
///
/// # Errors
/// [`FileError`].
pub fn read(path: &Path, names: &[String]) -> Result<Vec<Controller>, FileError> {
    from_json(&read_text(path)?, names).map_err(unreadable(path))
}

/// Reads the state of one robot from the file of a cell.
///
/// # Errors
/// [`FileError`].
pub fn read_one(path: &Path, name: &str) -> Result<Controller, FileError> {
    read_robot(&read_text(path)?, name).map_err(unreadable(path))
}

fn read_robot(text: &str, name: &str) -> Result<Controller, ParseError> {
    let mut file: CellFile<Snapshot> = serde_json::from_str(text)?;
    let snapshot = file.robots.remove(name);
    let snapshot = snapshot.ok_or_else(|| ParseError::NoRobot(name.to_owned()))?;
    Ok(Controller::restore(snapshot)?)
}

/// Writes the file of a cell atomically.
///
/// # Errors
/// [`FileError::Io`].
pub fn write(path: &Path, states: &[(String, Controller)]) -> Result<(), FileError> {
    write_text(path, &to_pretty_json(states))
}
