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

/// The snapshots in the text of a file. The versions are checked first: in another version every other field may differ.
fn parse(text: &str) -> Result<BTreeMap<String, Snapshot>, ParseError> {
    let headers: CellFile<SnapshotHeader> = serde_json::from_str(text)?;
    headers.robots.values().try_for_each(SnapshotHeader::validate)?;
    Ok(serde_json::from_str::<CellFile<Snapshot>>(text)?.robots)
}

fn take(robots: &mut BTreeMap<String, Snapshot>, name: &str) -> Result<Controller, ParseError> {
    let snapshot = robots.remove(name);
    let snapshot = snapshot.ok_or_else(|| ParseError::NoRobot(name.to_owned()))?;
    Ok(Controller::restore(snapshot)?)
}

/// The controllers of these robots, in this order.
///
/// # Errors
/// [`ParseError`]; the file has to have the state of each robot, and of no other.
pub fn from_json(text: &str, names: &[String]) -> Result<Vec<Controller>, ParseError> {
    let mut robots = parse(text)?;
    let controllers = names.iter().map(|name| take(&mut robots, name));
    let controllers = controllers.collect::<Result<_, _>>()?;
    match robots.into_keys().next() {
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
    let text = read_text(path)?;
    let robot = parse(&text).and_then(|mut robots| take(&mut robots, name));
    robot.map_err(unreadable(path))
}

/// Writes the file of a cell atomically.
///
/// # Errors
/// [`FileError::Io`].
pub fn write(path: &Path, states: &[(String, Controller)]) -> Result<(), FileError> {
    write_text(path, &to_pretty_json(states))
}
