//! Decides what is on the RAM drive when the power comes on: the files of the backing directory, those of `--load`,
//! or the example program. It converts the name and the line ends of a PC file to those of the drive.
//!
//! Reading and writing the backing directory is [`ts3100_driver::store`]'s job. Parameter files take effect only at
//! power-on (PAR-FILE-03), so they are separated from the files that are put on the drive afterwards.

use crate::config::Settings;
use crate::launch::StartError;
use std::io;
use std::path::{Path, PathBuf};
use tracing::warn;
use ts3100_controller::{Controller, Time};
use ts3100_driver::files;
use ts3100_driver::pc_file::{MAX_PC_FILE, NameError, drive_content, drive_name};
use ts3100_driver::snapshot;
use ts3100_driver::store::backing::{Backing, WhenFull};
use ts3100_driver::store::{Store, StoreError, StoredFiles};
use ts3100_proto::name::FileName;
use ts3100_recording::diff::Candidate;

/// Name of the example program.
pub const DEMO_NAME: &str = "DEMO";
/// The example program, on the drive when neither a directory nor a file is given.
pub const DEMO: &str = include_str!("../assets/demo.scol");

/// Why a file of the PC cannot become a file of the drive.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file cannot be read.
    #[error("cannot read {}: {reason}", path.display())]
    Read {
        /// The file on the PC.
        path: PathBuf,
        /// The error of the operating system.
        reason: io::Error,
    },
    /// Its name cannot be a name of the drive.
    #[error(transparent)]
    Name(#[from] NameError),
    /// The backing directory cannot be opened or read.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// The files for the RAM drive, by when they get there.
pub struct DriveFiles {
    /// The open backing directory, and the files in it.
    pub store: Option<(Store, StoredFiles)>,
    /// Files present at power-on: those of the directory, and the parameter files of `--load`,
    /// since those act only then (PAR-FILE-03).
    pub at_power_on: StoredFiles,
    /// Files to put on the drive after power-on.
    pub after_power_on: StoredFiles,
    /// The example program is on the drive.
    pub demo: bool,
}

/// A controller after power-on, with its files.
pub struct PoweredController {
    /// The controller, with the selected file if one is configured.
    pub controller: Controller,
    /// The backing directory, synchronised with the drive.
    pub backing: Option<Backing>,
    /// All files put on the drive, including those of the directory.
    pub files: StoredFiles,
    /// The example program is on the drive.
    pub demo: bool,
    /// A snapshot or an error history was restored, so the files alone do not reproduce the state.
    pub restored: bool,
}

/// Powers a controller on, puts the files on its drive and selects one, as configured.
///
/// # Errors
/// [`StartError::Load`], [`StartError::Store`] or [`StartError::Select`].
pub fn power_on(settings: &Settings) -> Result<PoweredController, StartError> {
    let DriveFiles {
        store,
        at_power_on: present,
        after_power_on: put,
        demo,
    } = load(settings)?;
    let files = present.iter().chain(&put).cloned().collect();
    let mut controller =
        Controller::new(settings.controller.clone(), present).map_err(|error| StartError::Store {
            name: "a file".to_owned(),
            reason: error.to_string(),
        })?;
    if let Some((store, _)) = &store {
        for warning in store.warnings() {
            warn!(event = "drive", "{warning}");
        }
        controller = controller.remembering(store.history().iter().cloned());
    }
    let remembers = store
        .as_ref()
        .is_some_and(|(store, _)| !store.history().is_empty());
    for (name, content) in put {
        let stored = controller.put_file(&name, &content);
        stored.map_err(|error| StartError::Store {
            name,
            reason: error.to_string(),
        })?;
    }
    if let Some(name) = &settings.select {
        let selected = controller.select(Time::ZERO, name);
        selected.map_err(|error| StartError::Select {
            name: name.clone(),
            reason: error.to_string(),
        })?;
    }
    if let Some(path) = &settings.restore {
        let fresh = std::mem::replace(&mut controller, snapshot::read(path)?);
        controller.adopt_peers(&fresh);
    }
    let when_full = settings.links.when_full;
    let backing = store
        .map(|(store, found)| attach_backing(Backing::new(store, when_full), &found, &controller, when_full));
    let backing = backing.transpose()?;
    controller.persist_outside(backing.is_some());
    Ok(PoweredController {
        controller,
        backing,
        files,
        demo: demo && settings.restore.is_none(),
        restored: remembers || settings.restore.is_some(),
    })
}

/// The emulator of these settings, to play a recording to.
///
/// # Errors
/// As [`power_on`].
pub fn candidate(settings: &Settings) -> Result<Candidate, StartError> {
    Ok(Candidate {
        controller: power_on(settings)?.controller,
        second: settings.links.second,
        servo_on: settings.servo_on,
    })
}

/// Brings the backing directory, which has the files `found`, in line with the drive.
fn attach_backing(
    mut backing: Backing,
    found: &StoredFiles,
    controller: &Controller,
    when_full: WhenFull,
) -> Result<Backing, LoadError> {
    let found = found
        .iter()
        .map(|(name, content)| (name.as_str(), content.as_slice()));
    match backing.replace_files(found, controller) {
        Err(reason) if when_full == WhenFull::Refuse => Err(reason.into()),
        _ => Ok(backing),
    }
}

/// Collects the files for the drive. `--load` wins over the directory for parameter files.
///
/// # Errors
/// See [`LoadError`].
pub fn load(settings: &Settings) -> Result<DriveFiles, LoadError> {
    let line_end = settings.controller.options.line_end;
    let mut files = Vec::new();
    for path in &settings.load {
        files.push((drive_name(path)?, drive_content(&read(path)?, line_end)));
    }
    files.extend(settings.files.iter().cloned());
    let store = settings.drive.as_deref().map(Store::open).transpose()?;
    let mut present = store.as_ref().map(|(_, found)| found.clone()).unwrap_or_default();
    let demo = settings.drive.is_none() && files.is_empty();
    if demo {
        files.push((DEMO_NAME.to_owned(), drive_content(DEMO.as_bytes(), line_end)));
    }
    let (parameters, put): (StoredFiles, StoredFiles) = files
        .into_iter()
        .partition(|(name, _)| FileName::parse(name).is_ok_and(|name| name.is_parameter()));
    for (name, content) in parameters {
        present.retain(|(other, _)| *other != name);
        present.push((name, content));
    }
    Ok(DriveFiles {
        store,
        at_power_on: present,
        after_power_on: put,
        demo,
    })
}

fn read(path: &Path) -> Result<Vec<u8>, LoadError> {
    files::read(path, MAX_PC_FILE).map_err(|reason| LoadError::Read {
        path: path.to_path_buf(),
        reason,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_program_is_in_good_style() {
        let found = scol_mini::check(DEMO, &scol_mini::LanguageOptions::default());
        assert_eq!(found.diagnostics, []);
        assert_eq!(scol_mini::format(DEMO), DEMO);
    }
}
