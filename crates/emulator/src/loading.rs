//! Decides what is on the RAM drive when the power comes on: the files of the backing directory, those of `--load`,
//! or the example programs. It converts the name and the line ends of a PC file to those of the drive.
//!
//! Reading and writing the backing directory is [`ts3100_driver::store`]'s job. Parameter files take effect only at
//! power-on (PAR-FILE-03), so they are separated from the files that are put on the drive afterwards.

use crate::config::Settings;
use std::io;
use std::net::SocketAddr;
use std::path::Path;
use tracing::warn;
use ts3100_controller::{Controller, DriveError, SelectError, Time};
use ts3100_driver::driver::OpenError;
use ts3100_driver::files::{PathError, cannot};
use ts3100_driver::pc_file::{NameError, drive_content, drive_name, read_content};
use ts3100_driver::snapshot;
use ts3100_driver::store::backing::{Backing, WhenFull};
use ts3100_driver::store::{Store, StoreError, StoredFiles};
use ts3100_proto::name::FileName;
use ts3100_recording::diff::Candidate;

/// The example programs by name, on the drive when neither a directory nor a file is given. The first needs no peer.
pub const EXAMPLES: [(&str, &str); 2] = [
    ("DEMO", include_str!("../assets/demo.scol")),
    ("DIALOG", include_str!("../assets/dialog.scol")),
];

/// Why the emulator cannot start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// A file of the PC cannot be read, or a transcript cannot be created.
    #[error(transparent)]
    File(#[from] PathError),
    /// The name of a file of the PC cannot be a name of the drive.
    #[error(transparent)]
    Name(#[from] NameError),
    /// The backing directory cannot be opened or read.
    #[error(transparent)]
    Backing(#[from] StoreError),
    /// The controller rejected a file.
    #[error("cannot store {name} on the RAM drive: {reason}")]
    Store {
        /// Its name on the drive.
        name: String,
        /// Why.
        reason: DriveError,
    },
    /// The requested file cannot be selected.
    #[error("cannot select {name}: {reason}{hint}")]
    Select {
        /// Its name on the drive.
        name: String,
        /// Why, with the diagnostics of the compiler.
        reason: SelectError,
        /// How to get an example program, as the end of the message; may be empty.
        hint: String,
    },
    /// A value of the configuration file cannot be used.
    #[error("{place}: {reason}")]
    Configured {
        /// The file and the line.
        place: String,
        /// Why.
        reason: Box<StartError>,
    },
    /// A port or a serial line cannot be opened, or the self-check failed.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The control interface cannot listen.
    #[error("cannot open the control interface at {address}: {}", control_reason(*address, reason))]
    Control {
        /// Address at which it should listen.
        address: SocketAddr,
        /// Error of the operating system.
        reason: io::Error,
    },
    /// The initial snapshot cannot be read.
    #[error(transparent)]
    Snapshot(#[from] snapshot::FileError),
    /// A runtime or thread failed.
    #[error("cannot start {what}: {reason}")]
    System {
        /// Its name, with the article.
        what: &'static str,
        /// Error of the operating system.
        reason: io::Error,
    },
}

/// Why the control interface does not listen, and what to do about it.
fn control_reason(address: SocketAddr, reason: &io::Error) -> String {
    let kind = reason.kind();
    let free = SocketAddr::new(address.ip(), 0);
    if kind == io::ErrorKind::AddrInUse {
        format!(
            "the port is in use.\nUse `--control {free}` (a free port) or `--control off`, \
             or end the program that has the port"
        )
    } else if kind == io::ErrorKind::AddrNotAvailable {
        format!("{} is not an address of this computer", address.ip())
    } else if kind == io::ErrorKind::PermissionDenied {
        format!("permission denied.\nUse `--control {free}` (a free port) or a port from 1024 on")
    } else {
        reason.to_string()
    }
}

/// A controller after power-on, with its files.
pub struct PoweredController {
    /// The controller, with the selected file if one is configured.
    pub controller: Controller,
    /// The backing directory, synchronised with the drive.
    pub backing: Option<Backing>,
    /// All files put on the drive, including those of the directory.
    pub files: StoredFiles,
    /// The example programs are on the drive.
    pub has_examples: bool,
    /// A snapshot or an error history was restored, so the files alone do not reproduce the state.
    pub restored: bool,
}

/// Powers a controller on, puts the files on its drive and selects one, as configured.
///
/// # Errors
/// A file, the backing directory or a snapshot is refused.
pub fn power_on(settings: &Settings) -> Result<PoweredController, StartError> {
    let mut put = pc_files(settings).map_err(|reason| placed(settings, "load", reason))?;
    let line_end = settings.controller.options.line_end;
    let directory = settings.files.drive.as_deref();
    let store = directory.map(|directory| Store::open(directory, line_end));
    let store = store.transpose()?;
    let has_examples = store.is_none() && put.is_empty();
    if has_examples {
        put.extend(EXAMPLES.map(|(name, text)| (name.to_owned(), drive_content(text.as_bytes(), line_end))));
    }
    let mut present = store.as_ref().map(|(_, found)| found.clone()).unwrap_or_default();
    // Parameter files act only at power-on (PAR-FILE-03); one of `--load` wins over that of the directory.
    for (name, content) in put.extract_if(.., |(name, _)| is_parameter(name)) {
        present.retain(|(other, _)| *other != name);
        present.push((name, content));
    }
    let files = present.iter().chain(&put).cloned().collect();
    let controller = Controller::new(settings.controller.clone(), present);
    let mut controller = controller.map_err(cannot_store("a file"))?;
    let mut remembers = false;
    if let Some((store, _)) = &store {
        for warning in store.warnings() {
            warn!(event = "drive", "{warning}");
        }
        remembers = !store.history().is_empty();
        controller = controller.remembering(store.history().iter().cloned());
    }
    for (name, content) in put {
        let stored = controller.put_file(&name, &content).map_err(cannot_store(&name));
        stored.map_err(|reason| placed(settings, "load", reason))?;
    }
    if let Some(name) = &settings.files.select {
        let selected = controller.select(Time::ZERO, name);
        selected.map_err(|reason| placed(settings, "select", cannot_select(name, reason)))?;
    }
    if let Some(path) = &settings.files.restore {
        let restored = snapshot::read(path, settings.restored_as.as_deref())?;
        let fresh = std::mem::replace(&mut controller, restored);
        controller.adopt_peers(&fresh);
    }
    let backing = store.map(|(store, found)| attach_backing(store, &found, &controller, settings));
    let backing = backing.transpose()?;
    controller.persist_outside(backing.is_some());
    Ok(PoweredController {
        controller,
        backing,
        files,
        has_examples: has_examples && settings.files.restore.is_none(),
        restored: remembers || settings.files.restore.is_some(),
    })
}

/// The error with the line of the configuration file that has the value, if it is there.
fn placed(settings: &Settings, key: &str, reason: StartError) -> StartError {
    match settings.places.get(key) {
        Some(place) => StartError::Configured {
            place: place.clone(),
            reason: Box::new(reason),
        },
        None => reason,
    }
}

fn cannot_select(name: &str, reason: SelectError) -> StartError {
    let missing = matches!(reason, SelectError::Missing(_));
    let example = example(Path::new(name)).filter(|_| missing);
    let hint = example.map(|(name, _)| {
        let flag = name.to_ascii_lowercase();
        format!(
            ". It is an example program; with --load or --drive it is there only if you add `--load {flag}`"
        )
    });
    StartError::Select {
        name: name.to_owned(),
        reason,
        hint: hint.unwrap_or_default(),
    }
}

/// The example program that a path names: a file of a configuration has its directory in front.
fn example(path: &Path) -> Option<(&'static str, &'static str)> {
    let name = path.file_name()?.to_str()?;
    EXAMPLES
        .into_iter()
        .find(|(known, _)| known.eq_ignore_ascii_case(name))
}

fn cannot_store(name: &str) -> impl FnOnce(DriveError) -> StartError {
    let name = name.to_owned();
    |reason| StartError::Store { name, reason }
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

/// Brings the backing directory, which has the files `found`, in line with the controller: its files and its error
/// history.
fn attach_backing(
    store: Store,
    found: &StoredFiles,
    controller: &Controller,
    settings: &Settings,
) -> Result<Backing, StoreError> {
    let mut backing = Backing::new(store, settings.links.when_full);
    let found = found
        .iter()
        .map(|(name, content)| (name.as_str(), content.as_slice()));
    match backing.replace_files(found, controller) {
        Err(reason) if settings.links.when_full == WhenFull::Refuse => return Err(reason),
        Ok(()) | Err(_) => {}
    }
    let saved = backing.history(controller)();
    backing.finish_history(controller.now(), saved);
    Ok(backing)
}

/// The files of `--load` with the names and line ends of the drive, followed by those given by content. The name of an example
/// program is that program where no file has the name.
fn pc_files(settings: &Settings) -> Result<StoredFiles, StartError> {
    let mut found = Vec::new();
    for path in &settings.files.load {
        if let Some((name, text)) = example(path).filter(|_| !path.exists()) {
            let text = drive_content(text.as_bytes(), settings.controller.options.line_end);
            found.push((name.to_owned(), text));
            continue;
        }
        let name = drive_name(path)?;
        let content = read_content(path, settings.controller.options.line_end);
        found.push((name, content.map_err(cannot("read", path))?));
    }
    found.extend(settings.contents.iter().cloned());
    Ok(found)
}

fn is_parameter(name: &str) -> bool {
    FileName::parse(name).is_ok_and(|name| name.is_parameter())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ServeArgs;
    use crate::testing::TempDir;
    use ts3100_controller::Input;
    use ts3100_controller::action::Action;

    fn alarms(controller: &Controller) -> Vec<String> {
        let history = controller.alarms().history();
        history.map(|alarm| alarm.code.number()).collect()
    }

    #[test]
    fn the_directory_keeps_the_error_history_of_a_snapshot_for_the_next_start() {
        let directory = TempDir::new("history");
        let file = directory.at("snapshot.json");
        let mut settings = Settings::from_args(&ServeArgs::default()).unwrap();
        let mut controller = power_on(&settings).unwrap().controller;
        let raise = Action::RaiseAlarm {
            number: "1-102".to_owned(),
            detail: String::new(),
        };
        controller.handle(Time::ZERO, Input::by_owner(raise)).unwrap();
        let expected = alarms(&controller);
        assert_eq!(expected, ["1-102"]);
        snapshot::write(&file, snapshot::States::One(&controller)).unwrap();
        settings.files.drive = Some(directory.at("drive"));
        settings.files.restore = Some(file);
        assert_eq!(alarms(&power_on(&settings).unwrap().controller), expected);
        settings.files.restore = None;
        assert_eq!(alarms(&power_on(&settings).unwrap().controller), expected);
    }

    #[test]
    fn an_example_is_loaded_by_its_name_and_a_missing_one_says_how() {
        let directory = TempDir::new("examples");
        let mut settings = Settings::from_args(&ServeArgs::default()).unwrap();
        settings.files.load = vec![directory.file("pick.scol", "PROGRAM PICK\nEND\n").into()];
        settings.files.select = Some("DEMO".to_owned());
        let Err(missing) = power_on(&settings) else {
            panic!("DEMO was selected");
        };
        assert_eq!(
            missing.to_string(),
            "cannot select DEMO: file DEMO is not on the RAM drive. It is an example program; with --load or --drive it is there \
             only if you add `--load demo`"
        );
        settings.files.load.push("demo".into());
        let started = power_on(&settings).unwrap();
        let names: Vec<&str> = started.controller.files().map(|(name, _)| name).collect();
        assert!(names.contains(&"DEMO") && names.contains(&"PICK"), "{names:?}");
        // A file of that name comes first.
        settings.files.load = vec![directory.file("demo", "PROGRAM OWN\nEND\n").into()];
        let started = power_on(&settings).unwrap();
        assert_eq!(
            started.controller.drive().get("DEMO"),
            Some(&b"PROGRAM OWN\nEND\n"[..])
        );
    }

    #[test]
    fn the_example_programs_are_in_good_style() {
        for (name, text) in EXAMPLES {
            let found = scol_mini::check(text, &scol_mini::LanguageOptions::default());
            assert_eq!(found.diagnostics, [], "{name}");
            assert_eq!(scol_mini::format(text), text, "{name}");
        }
    }
}
