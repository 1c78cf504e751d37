//! A loss of power at any moment of downloads, erasures, saved parameters, the error history and snapshot files.
//!
//! [`Recorder`] writes down what the store does to the file system. [`Model`] is a disk that has done a part of it and
//! loses its power: it may have forgotten each entry of a directory and each content that was not synced, in any order. POSIX
//! promises no more; most file systems do. The store is opened on every state that the disk may be in: what was
//! acknowledged is there, what was under way is there whole or not at all.

use super::super::*;
use crate::files::disk::{Disk, NewFile, System};
use crate::files::{directory_of, replace_on};
use crate::testing::TempDir;
use std::fs::Permissions;
use std::sync::{Arc, Mutex};
use ts3100_controller::alarm::ALARMS;

/// Seeds of the test.
const SEEDS: u64 = 20;
/// Changes of a run.
const CHANGES: usize = 14;
/// Most entries of directories of which every subset is tried; of more, [`SUBSETS`] of them.
const MAX_PENDING: usize = 6;
/// Subsets that are tried of more.
const SUBSETS: u64 = 64;

/// A sync that a broken store leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Omitted {
    Nothing,
    Content,
    Entries,
}

#[derive(Debug, Clone)]
enum Operation {
    Create(PathBuf, usize),
    Write(usize, Vec<u8>),
    SyncFile(usize),
    Rename(PathBuf, PathBuf),
    Remove(PathBuf),
    CreateDirectory(PathBuf),
    SyncDirectory(PathBuf),
}

/// The file system; it writes down each operation that succeeds.
#[derive(Debug, Clone)]
struct Recorder {
    log: Arc<Mutex<Vec<Operation>>>,
    omitted: Omitted,
}

impl Recorder {
    fn note(&self, operation: Operation) {
        self.log.lock().unwrap().push(operation);
    }

    fn len(&self) -> usize {
        self.log.lock().unwrap().len()
    }
}

impl Disk for Recorder {
    fn create_new(&self, path: &Path) -> io::Result<Box<dyn NewFile>> {
        let file = System.create_new(path)?;
        let number = self.len();
        self.note(Operation::Create(path.to_path_buf(), number));
        let recorder = self.clone();
        Ok(Box::new(RecordedFile {
            file,
            number,
            recorder,
        }))
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        System.rename(from, to)?;
        self.note(Operation::Rename(from.to_path_buf(), to.to_path_buf()));
        Ok(())
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        System.remove(path)?;
        self.note(Operation::Remove(path.to_path_buf()));
        Ok(())
    }

    fn create_directory(&self, path: &Path) -> io::Result<()> {
        System.create_directory(path)?;
        self.note(Operation::CreateDirectory(path.to_path_buf()));
        Ok(())
    }

    fn sync_directory(&self, path: &Path) -> io::Result<()> {
        if self.omitted != Omitted::Entries {
            self.note(Operation::SyncDirectory(path.to_path_buf()));
        }
        Ok(())
    }
}

struct RecordedFile {
    file: Box<dyn NewFile>,
    number: usize,
    recorder: Recorder,
}

impl io::Write for RecordedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let length = self.file.write(bytes)?;
        self.recorder
            .note(Operation::Write(self.number, bytes[..length].to_vec()));
        Ok(length)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl NewFile for RecordedFile {
    fn sync(&mut self) -> io::Result<()> {
        if self.recorder.omitted != Omitted::Content {
            self.recorder.note(Operation::SyncFile(self.number));
        }
        Ok(())
    }

    fn set_permissions(&self, permissions: Permissions) -> io::Result<()> {
        self.file.set_permissions(permissions)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Node {
    Directory,
    File(usize),
}

/// The entries of all directories.
type Entries = BTreeMap<PathBuf, Node>;

/// A change of entries that is not synced.
#[derive(Debug, Clone)]
enum Pending {
    Add(PathBuf, Node),
    Move(PathBuf, PathBuf, Node),
    Take(PathBuf, Node),
}

impl Pending {
    fn apply(&self, entries: &mut Entries) {
        match self {
            Pending::Add(path, node) => drop(entries.insert(path.clone(), *node)),
            Pending::Move(from, to, node) => {
                if entries.get(from) == Some(node) {
                    entries.remove(from);
                }
                entries.insert(to.clone(), *node);
            }
            Pending::Take(path, node) => {
                if entries.get(path) == Some(node) {
                    entries.remove(path);
                }
            }
        }
    }

    fn directory(&self) -> &Path {
        match self {
            Pending::Add(path, _) | Pending::Move(_, path, _) | Pending::Take(path, _) => directory_of(path),
        }
    }
}

#[derive(Debug, Clone, Default)]
struct Content {
    written: Vec<u8>,
    is_synced: bool,
}

/// A disk, with what is on it for certain and what need not be.
#[derive(Debug, Default)]
struct Model {
    /// The directory that is there in any case.
    root: PathBuf,
    synced: Entries,
    present: Entries,
    pending: Vec<Pending>,
    contents: BTreeMap<usize, Content>,
}

/// The files found after the power has returned: path and content, `None` for a directory.
type Found = BTreeMap<PathBuf, Option<Vec<u8>>>;

impl Model {
    fn change(&mut self, pending: Pending) {
        pending.apply(&mut self.present);
        self.pending.push(pending);
    }

    fn apply(&mut self, operation: &Operation) {
        match operation {
            Operation::Create(path, number) => {
                self.contents.insert(*number, Content::default());
                self.change(Pending::Add(path.clone(), Node::File(*number)));
            }
            Operation::CreateDirectory(path) => self.change(Pending::Add(path.clone(), Node::Directory)),
            Operation::Write(number, bytes) => {
                let content = self.contents.get_mut(number).unwrap();
                content.written.extend_from_slice(bytes);
                content.is_synced = false;
            }
            Operation::SyncFile(number) => self.contents.get_mut(number).unwrap().is_synced = true,
            Operation::Rename(from, to) => {
                let node = self.present[from];
                self.change(Pending::Move(from.clone(), to.clone(), node));
            }
            Operation::Remove(path) => {
                let node = self.present[path];
                self.change(Pending::Take(path.clone(), node));
            }
            Operation::SyncDirectory(path) => {
                let (done, pending) = std::mem::take(&mut self.pending)
                    .into_iter()
                    .partition(|change| change.directory() == path.as_path());
                self.pending = pending;
                let done: Vec<Pending> = done;
                done.iter().for_each(|change| change.apply(&mut self.synced));
            }
        }
    }

    /// The contents that a file may be found with.
    fn contents_of(&self, number: usize) -> Vec<Vec<u8>> {
        let Content { written, is_synced } = &self.contents[&number];
        if *is_synced {
            return vec![written.clone()];
        }
        let half = written.len() / 2;
        let zeros = vec![0; written.len()];
        let torn = [&written[..half], &zeros[half..]].concat();
        vec![Vec::new(), written[..half].to_vec(), torn, zeros, written.clone()]
    }

    /// Everything that may be found if the power fails now.
    fn states(&self, random: &mut u64) -> BTreeSet<Found> {
        let count = self.pending.len();
        let all = 1_u64 << count.min(63);
        let subsets: Vec<u64> = match count {
            0..=MAX_PENDING => (0..all).collect(),
            _ => [0, all - 1]
                .into_iter()
                .chain((0..SUBSETS).map(|_| next(random) % all))
                .collect(),
        };
        let mut found = BTreeSet::new();
        for subset in subsets {
            let mut entries = self.synced.clone();
            for (at, change) in self.pending.iter().enumerate() {
                if subset >> at & 1 == 1 {
                    change.apply(&mut entries);
                }
            }
            let reachable: Vec<(PathBuf, Node)> = entries
                .iter()
                .filter(|(path, _)| {
                    let mut above = path.ancestors().skip(1).take_while(|above| *above != self.root);
                    above.all(|above| entries.get(above) == Some(&Node::Directory))
                })
                .map(|(path, node)| (path.clone(), *node))
                .collect();
            let mut states = vec![Found::new()];
            for (path, node) in reachable {
                let contents = match node {
                    Node::Directory => vec![None],
                    Node::File(number) => self.contents_of(number).into_iter().map(Some).collect(),
                };
                let with = |state: &Found, content: &Option<Vec<u8>>| {
                    let mut state = state.clone();
                    state.insert(path.clone(), content.clone());
                    state
                };
                states = states
                    .iter()
                    .flat_map(|state| contents.iter().map(move |content| with(state, content)))
                    .collect();
            }
            found.extend(states);
        }
        found
    }
}

fn next(random: &mut u64) -> u64 {
    *random ^= *random << 13;
    *random ^= *random >> 7;
    *random ^= *random << 17;
    *random
}

/// The contents that users expect to find.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct Expected {
    files: BTreeMap<String, Vec<u8>>,
    history: VecDeque<Alarm>,
    snapshot: Option<Vec<u8>>,
}

/// A store that works for a while.
struct Run {
    root: TempDir,
    log: Vec<Operation>,
    /// The file that was there before, and its content.
    by_hand: Option<&'static [u8]>,
    /// The number of operations after which each state was acknowledged.
    acknowledged: Vec<(usize, Expected)>,
}

const DRIVE: &str = "drives/one";
const SNAPSHOT: &str = "state.json";
const BY_HAND: &str = "pick.scol";

fn run(seed: u64, omitted: Omitted) -> Run {
    let root = TempDir::new("power-loss");
    let mut random = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut expected = Expected::default();
    let by_hand: Option<&[u8]> = (seed % 2 == 1).then_some(b"PROGRAM PICK\nEND\n");
    let drive = root.at(DRIVE);
    if let Some(content) = by_hand {
        fs::create_dir_all(&drive).unwrap();
        fs::write(drive.join(BY_HAND), content).unwrap();
        expected.files.insert("PICK".to_owned(), content.to_vec());
    }
    let recorder = Recorder {
        log: Arc::default(),
        omitted,
    };
    let mut acknowledged = vec![(0, expected.clone())];
    let (mut store, _) = Store::open_on(Box::new(recorder.clone()), &drive, LineEnd::Lf).unwrap();
    for change in 0..CHANGES {
        let number = next(&mut random);
        let name = ["PICK", "PLACE", "USER.PAR"][usize::try_from(number % 3).unwrap()];
        match number >> 8 & 7 {
            0 | 1 => {
                store.remove(name).unwrap();
                expected.files.remove(name);
            }
            2 => {
                let history: VecDeque<Alarm> = (0..=change).map(alarm).collect();
                store.save_history(history.clone()).unwrap();
                expected.history = history;
            }
            3 => {
                let content = format!("{{\"change\": {change}}}\n").into_bytes();
                let path = root.at(SNAPSHOT);
                replace_on(&recorder, &path, |file| file.write_all(&content)).unwrap();
                expected.snapshot = Some(content);
            }
            _ => {
                let content = format!("REMARK {change}\n").repeat(1 + change % 4);
                store.put(name, content.as_bytes()).unwrap();
                expected.files.insert(name.to_owned(), content.into_bytes());
            }
        }
        acknowledged.push((recorder.len(), expected.clone()));
    }
    let log = recorder.log.lock().unwrap().clone();
    Run {
        root,
        log,
        by_hand,
        acknowledged,
    }
}

fn alarm(number: usize) -> Alarm {
    Alarm {
        code: ALARMS[number],
        detail: String::new(),
        at: ts3100_proto::calendar::CalendarTime::MAX,
    }
}

/// The drive that a store finds in a state of the disk.
fn opened(root: &Path, state: &Found) -> Result<Expected, StoreError> {
    let after = TempDir::new("power-back");
    for (path, content) in state {
        let path = after.at(path.strip_prefix(root).unwrap().to_str().unwrap());
        match content {
            None => fs::create_dir(&path).unwrap(),
            Some(content) => fs::write(&path, content).unwrap(),
        }
    }
    let (store, files) = Store::open(&after.at(DRIVE), LineEnd::Lf)?;
    Ok(Expected {
        files: files.into_iter().collect(),
        history: store.history().clone(),
        snapshot: fs::read(after.at(SNAPSHOT)).ok(),
    })
}

/// Tries a loss of power after each operation; returns how many states of the disk were tried, and the first that is not
/// as it has to be.
fn lose_power(seed: u64, omitted: Omitted) -> (usize, Option<String>) {
    let run = run(seed, omitted);
    let root = run.root.path();
    let mut random = seed + 1;
    let mut model = Model {
        root: root.to_path_buf(),
        ..Model::default()
    };
    if let Some(content) = run.by_hand {
        let drive = root.join(DRIVE);
        let file = Operation::Create(drive.join(BY_HAND), usize::MAX);
        let entries =
            [directory_of(&drive), &drive].map(|path| Operation::CreateDirectory(path.to_path_buf()));
        entries.iter().for_each(|operation| model.apply(operation));
        model.apply(&file);
        model.apply(&Operation::Write(usize::MAX, content.to_vec()));
        model.apply(&Operation::SyncFile(usize::MAX));
        for path in [root, directory_of(&drive), &drive] {
            model.apply(&Operation::SyncDirectory(path.to_path_buf()));
        }
    }
    let mut tried = 0;
    for done in 0..=run.log.len() {
        if let Some(operation) = done.checked_sub(1).map(|last| &run.log[last]) {
            model.apply(operation);
        }
        let now = run.acknowledged.partition_point(|(at, _)| *at <= done);
        let allowed: Vec<&Expected> = run.acknowledged[now - 1..]
            .iter()
            .take(2)
            .map(|(_, expected)| expected)
            .collect();
        for state in model.states(&mut random) {
            tried += 1;
            let found = opened(root, &state);
            if !found.as_ref().is_ok_and(|found| allowed.contains(&found)) {
                let told = format!(
                    "seed {seed}, power lost after operation {done} of {:?}: found {found:?}, expected one of {allowed:?}",
                    &run.log[done.saturating_sub(6)..done]
                );
                return (tried, Some(told));
            }
        }
    }
    (tried, None)
}

#[test]
fn a_loss_of_power_leaves_each_change_whole_and_takes_nothing_that_was_acknowledged() {
    let mut tried = 0;
    for seed in 0..SEEDS {
        let (states, lost) = lose_power(seed, Omitted::Nothing);
        assert_eq!(lost, None);
        tried += states;
    }
    assert!(tried > 1_000, "{tried} states");
}

/// Without a sync the model must find a loss: otherwise the test above proves nothing.
#[test]
fn a_store_that_omits_a_sync_is_caught() {
    for omitted in [Omitted::Content, Omitted::Entries] {
        let lost = (0..SEEDS).find_map(|seed| lose_power(seed, omitted).1);
        assert!(lost.is_some(), "{omitted:?}");
    }
}
