//! The emulators of this user on this machine. Each `serve` and `exec` keeps a state file while it runs, so that `ctl`
//! finds the control interface without a URL, and tells the ports of a robot from it.
//!
//! `PID.json` has the addresses. `PID.lock` is locked as long as the process lives, however it ends: a file whose lock
//! is free is left over, and whoever looks removes it. Nothing secret is in them.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{self, DirBuilder, File, TryLockError};
use std::io;
use std::net::{SocketAddr, ToSocketAddrs as _};
use std::path::{Path, PathBuf};
use std::process;
use tracing::debug;
use ts3100_control::robots::RobotInfo;
use ts3100_driver::driver::self_check::connectable;
use ts3100_driver::files;

/// Largest state file that is read, in bytes.
const MAX_FILE: u64 = 16 * 1024;

/// Addresses of an emulator of this machine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Instance {
    /// Its process.
    pub pid: u32,
    /// URL of the control interface, unless it is off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub control: Option<String>,
    /// Address of each TCP port by its name: IP0. Of several robots: those of the first, which tell it from others.
    #[serde(default)]
    pub ports: BTreeMap<String, SocketAddr>,
}

/// The state file of this process; removed when it is dropped.
#[derive(Debug)]
pub struct StateFile {
    path: PathBuf,
    /// Locked until the process ends.
    lock: File,
}

impl Instance {
    /// This process, which runs these robots.
    pub fn current(robots: &[RobotInfo], control: Option<SocketAddr>) -> Instance {
        let ports = robots.first().into_iter().flat_map(|robot| &robot.ports);
        let reached = control.map(|address| SocketAddr::new(connectable(address.ip()), address.port()));
        Instance {
            pid: process::id(),
            control: reached.map(|address| format!("http://{address}")),
            ports: ports
                .map(|(name, address)| (name.to_ascii_uppercase(), *address))
                .collect(),
        }
    }

    /// Writes the state file, before the robot is reported as ready: the reader of that report may look for the file.
    /// Without one everything else works, so an error is only logged.
    pub fn announce(&self) -> Option<StateFile> {
        self.write_in(&directories())
            .inspect_err(|error| debug!("cannot write the state file for `ts3100 ctl`: {error}"))
            .ok()
    }

    /// Writes it in the first of these directories that takes it. The error is that of the first.
    fn write_in(&self, directories: &[PathBuf]) -> io::Result<StateFile> {
        let mut refused = None;
        for directory in directories {
            let written = made_private(directory).and_then(|()| self.write(directory));
            match written {
                Ok(file) => return Ok(file),
                Err(error) => refused = refused.or(Some(error)),
            }
        }
        Err(refused.unwrap_or_else(|| io::ErrorKind::NotFound.into()))
    }

    fn write(&self, directory: &Path) -> io::Result<StateFile> {
        let path = directory.join(format!("{}.json", self.pid));
        let lock = File::options()
            .write(true)
            .create(true)
            .truncate(false)
            .open(path.with_extension("lock"))?;
        // A container that shares the directory may have a process of the same number.
        lock.try_lock()?;
        // Whoever reads half of it sees no emulator yet. It need not outlive the machine, so nothing is synced.
        fs::write(&path, serde_json::to_string(self)?)?;
        Ok(StateFile { path, lock })
    }

    /// The port that listens where this URL or address leads.
    pub fn port_at(&self, place: &str) -> Option<&str> {
        let place = place.strip_prefix("http://").unwrap_or(place);
        let addresses: Vec<SocketAddr> = place.trim_end_matches('/').to_socket_addrs().ok()?.collect();
        let mut ports = self.ports.iter();
        ports
            .find(|(_, address)| addresses.contains(address))
            .map(|(name, _)| name.as_str())
    }
}

impl Drop for StateFile {
    fn drop(&mut self) {
        // Who looks meanwhile removes what is left.
        let _ = fs::remove_file(&self.path);
        let _ = fs::remove_file(self.path.with_extension("lock"));
        let _ = self.lock.unlock();
    }
}

/// The emulators of this user that run now, in the order of their processes.
pub fn running() -> Vec<Instance> {
    running_in(&directories())
}

fn running_in(directories: &[PathBuf]) -> Vec<Instance> {
    let private = directories
        .iter()
        .filter(|directory| expect_private(directory).is_ok());
    let entries = private
        .filter_map(|directory| fs::read_dir(directory).ok())
        .flatten()
        .flatten();
    let paths = entries.map(|entry| entry.path());
    let states = paths.filter(|path| path.extension().is_some_and(|ending| ending == "json"));
    let mut found: Vec<Instance> = states.filter_map(|path| read(&path)).collect();
    found.sort_by_key(|instance| instance.pid);
    found
}

/// The emulator of a state file; one that has ended is removed.
fn read(path: &Path) -> Option<Instance> {
    let lock = path.with_extension("lock");
    // Shared with others who look: each would take another one for the emulator.
    let alive = match File::open(&lock).map(|file| file.try_lock_shared()) {
        Ok(Err(TryLockError::WouldBlock)) => true,
        Ok(Ok(())) => false,
        // Whether it lives cannot be told.
        Ok(Err(TryLockError::Error(_))) => return None,
        Err(error) if error.kind() == io::ErrorKind::NotFound => false,
        Err(_) => return None,
    };
    if !alive {
        // Another process may have removed them just now.
        let _ = fs::remove_file(path);
        let _ = fs::remove_file(lock);
        return None;
    }
    serde_json::from_str(&files::read_text(path, MAX_FILE).ok()?).ok()
}

/// Directories of the state files, the usual one first: `ts3100` in the runtime directory of the user, or one with the
/// number of the user in memory or in the directory for temporary files. One that others can write to is not used.
fn directories() -> Vec<PathBuf> {
    let runtime = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
    if let Some(runtime) = runtime.filter(|path| path.is_absolute() && path.is_dir()) {
        return vec![runtime.join("ts3100")];
    }
    let own = format!("ts3100{}", user_suffix());
    // Quicker than a disk, and all that a container with a read-only root can write to.
    let memory = cfg!(target_os = "linux").then(|| PathBuf::from("/dev/shm"));
    let places = memory.into_iter().chain([std::env::temp_dir()]);
    places.map(|place| place.join(&own)).collect()
}

/// A directory for files of this user that need not outlive the machine; `None` if there is no place for one.
pub fn private_directory() -> Option<PathBuf> {
    directories()
        .into_iter()
        .find(|directory| made_private(directory).is_ok())
}

/// Makes a directory that no other user can write to, if there is none yet.
fn made_private(path: &Path) -> io::Result<()> {
    create_private(path).and_then(|()| expect_private(path))
}

fn create_private(path: &Path) -> io::Result<()> {
    #[cfg_attr(not(unix), allow(unused_mut))]
    let mut builder = DirBuilder::new();
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    match builder.create(path) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => Err(error),
        _ => Ok(()),
    }
}

#[cfg(unix)]
fn user_suffix() -> String {
    format!("-{}", rustix::process::geteuid().as_raw())
}

/// Elsewhere each user has a directory for temporary files.
#[cfg(not(unix))]
fn user_suffix() -> String {
    String::new()
}

#[cfg(unix)]
fn expect_private(path: &Path) -> io::Result<()> {
    use std::os::unix::fs::MetadataExt as _;
    let found = fs::symlink_metadata(path)?;
    let own = found.is_dir() && found.uid() == rustix::process::geteuid().as_raw();
    if own && found.mode() & 0o077 == 0 {
        return Ok(());
    }
    let reason = format!("other users can write to {}", path.display());
    Err(io::Error::other(reason))
}

#[cfg(not(unix))]
fn expect_private(path: &Path) -> io::Result<()> {
    fs::metadata(path).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TempDir;

    fn instance(pid: u32) -> Instance {
        let address = "127.0.0.1:11000".parse().unwrap();
        Instance {
            pid,
            control: Some("http://127.0.0.1:13100".to_owned()),
            ports: BTreeMap::from([("IP0".to_owned(), address)]),
        }
    }

    #[test]
    fn an_emulator_is_found_until_it_ends_and_what_a_killed_one_left_is_removed() {
        let directory = TempDir::new("instances");
        let place = directory.path();
        create_private(&place.join("ts3100")).unwrap();
        let place = &place.join("ts3100");
        let running_in = |place: &Path| running_in(&[place.to_owned()]);
        let (first, second) = (instance(7), instance(12));
        let kept = (second.write(place).unwrap(), first.write(place).unwrap());
        assert_eq!(running_in(place), [first.clone(), second.clone()]);
        assert!(second.write(place).is_err(), "the file of a living process");
        drop(kept.1);
        assert_eq!(running_in(place), std::slice::from_ref(&second));
        // A killed process leaves its files, without the lock.
        fs::write(
            place.join("99.json"),
            serde_json::to_string(&instance(99)).unwrap(),
        )
        .unwrap();
        fs::write(place.join("99.lock"), "").unwrap();
        let looking = File::open(place.join("99.lock")).unwrap();
        looking.try_lock_shared().unwrap();
        // Another one that looks may have removed the lock already.
        let left = serde_json::to_string(&instance(98)).unwrap();
        fs::write(place.join("98.json"), left).unwrap();
        assert_eq!(running_in(place), [second]);
        assert_eq!(fs::read_dir(place).unwrap().count(), 2);
        drop(kept.0);
        assert_eq!(fs::read_dir(place).unwrap().count(), 0);
    }

    #[test]
    fn a_directory_that_takes_no_file_is_passed_over() {
        let directory = TempDir::new("instances");
        let (nowhere, place) = (
            directory.path().join("missing/ts3100"),
            directory.path().join("ts3100"),
        );
        let found = [nowhere.clone(), place.clone()];
        assert!(instance(7).write_in(&[nowhere]).is_err());
        let kept = instance(7).write_in(&found).unwrap();
        assert_eq!(running_in(&found), [instance(7)]);
        assert!(place.join("7.json").exists());
        drop(kept);
    }

    #[test]
    fn a_port_of_the_robot_is_told_from_the_control_interface() {
        let instance = instance(7);
        for place in [
            "http://127.0.0.1:11000",
            "http://127.0.0.1:11000/",
            "127.0.0.1:11000",
        ] {
            assert_eq!(instance.port_at(place), Some("IP0"), "{place}");
        }
        for place in ["http://127.0.0.1:13100", "127.0.0.1", "nonsense"] {
            assert_eq!(instance.port_at(place), None, "{place}");
        }
    }

    #[test]
    #[cfg(unix)]
    fn a_directory_that_others_can_enter_is_not_used() {
        use std::os::unix::fs::PermissionsExt as _;
        let directory = TempDir::new("instances");
        let place = directory.path().join("ts3100");
        create_private(&place).unwrap();
        expect_private(&place).unwrap();
        create_private(&place).unwrap();
        fs::set_permissions(&place, fs::Permissions::from_mode(0o755)).unwrap();
        assert!(expect_private(&place).is_err());
    }
}
