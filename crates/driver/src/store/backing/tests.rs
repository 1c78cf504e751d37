//! Tests of what becomes of changes that the directory does not take.

use super::*;
use crate::testing::TempDir;
use std::fs;
use std::path::Path;
use ts3100_controller::{Config, Dialect};
use ts3100_proto::parameter::LineEnd;

const NOW: Time = Time::ZERO;

/// In the way of a file that is written: the write fails for every user, root included.
fn block(directory: &TempDir, name: &str) -> std::path::PathBuf {
    let path = directory.path().join(format!(".{name}.unfinished"));
    fs::create_dir(&path).unwrap();
    path
}

fn backing(directory: &TempDir, when_full: WhenFull) -> Backing {
    Backing::new(Store::open(directory.path(), LineEnd::Lf).unwrap().0, when_full)
}

/// As the driver does, without a thread.
fn persist(backing: &mut Backing, name: &str, content: Option<&'static [u8]>) -> Result<(), StoreError> {
    let written = backing.change(name.to_owned(), content.map(Bytes::from_static))();
    backing.finish(NOW, name, written)
}

fn controller(files: &[(&str, &[u8])]) -> Controller {
    let files = files
        .iter()
        .map(|(name, content)| ((*name).to_owned(), content.to_vec()));
    Controller::new(Config::new(Dialect::Field), files.collect()).unwrap()
}

fn content(directory: &Path, name: &str) -> Option<Vec<u8>> {
    fs::read(directory.join(name)).ok()
}

#[test]
fn a_change_that_is_not_kept_is_refused_and_told() {
    let directory = TempDir::new("backing-refuse");
    let mut backing = backing(&directory, WhenFull::Refuse);
    let way = block(&directory, "A");
    for failures in 1..=3 {
        let reason = persist(&mut backing, "A", Some(b"A\n")).unwrap_err();
        let condition = backing.status();
        assert_eq!(
            (condition.failures, &condition.error),
            (failures, &Some(reason.to_string()))
        );
        assert!(condition.unsaved.is_empty(), "the drive is as before");
    }
    fs::remove_dir(way).unwrap();
    persist(&mut backing, "A", Some(b"A\n")).unwrap();
    assert_eq!((backing.status().failures, &backing.status().error), (3, &None));
    assert_eq!(content(directory.path(), "A").as_deref(), Some(b"A\n".as_slice()));
    persist(&mut backing, "A", None).unwrap();
    assert_eq!(content(directory.path(), "A"), None);
}

#[test]
fn an_error_history_that_is_not_saved_is_a_failure_and_no_unsaved_file() {
    for when_full in [WhenFull::Refuse, WhenFull::Memory] {
        let directory = TempDir::new("backing-history");
        let mut backing = backing(&directory, when_full);
        let replaced = || StoreError::DirectoryReplaced {
            path: directory.path().to_owned(),
        };
        backing.finish_history(NOW, Ok(()));
        assert_eq!((backing.status().failures, &backing.status().error), (0, &None));
        backing.finish_history(NOW, Err(replaced()));
        let status = backing.status();
        assert_eq!(
            (status.failures, &status.error),
            (1, &Some(replaced().to_string()))
        );
        assert!(status.unsaved.is_empty());
    }
}

#[test]
fn what_is_in_memory_alone_is_made_up_for_with_the_next_file_that_is_kept() {
    let directory = TempDir::new("backing-memory");
    let mut backing = backing(&directory, WhenFull::Memory);
    persist(&mut backing, "GONE", Some(b"G\n")).unwrap();
    let ways = [block(&directory, "A"), block(&directory, "B")];
    persist(&mut backing, "A", Some(b"A\n")).unwrap();
    persist(&mut backing, "B", Some(b"B\n")).unwrap();
    let robot = controller(&[("A", b"A\n"), ("B", b"B\n"), ("C", b"C\n")]);
    backing.retry_unsaved(&robot);
    assert_eq!(backing.status().unsaved, ["A", "B"].map(str::to_owned).into());
    assert_eq!(content(directory.path(), "A"), None);
    // The directory takes some files, but not A: that stays unsaved.
    let [way_of_a, way_of_b] = ways;
    fs::remove_dir(way_of_b).unwrap();
    persist(&mut backing, "C", Some(b"C\n")).unwrap();
    backing.retry_unsaved(&robot);
    assert_eq!(backing.status().unsaved, ["A", "B"].map(str::to_owned).into());
    fs::remove_dir(way_of_a).unwrap();
    backing.retry_unsaved(&robot);
    assert!(
        !backing.status().unsaved.is_empty(),
        "nothing says yet that it takes files again"
    );
    persist(&mut backing, "C", Some(b"C\n")).unwrap();
    backing.retry_unsaved(&robot);
    assert!(backing.status().unsaved.is_empty());
    for name in ["A", "B", "C"] {
        assert_eq!(
            content(directory.path(), name).unwrap(),
            format!("{name}\n").as_bytes()
        );
    }
}

#[test]
fn another_state_is_followed_and_what_was_there_goes_last() {
    let directory = TempDir::new("backing-follow");
    let mut backing = backing(&directory, WhenFull::Refuse);
    let (before, next) = (
        controller(&[("OLD", b"O\n"), ("SAME", b"S\n")]),
        controller(&[("NEW", b"N\n"), ("SAME", b"S\n")]),
    );
    backing.replace_files([].into_iter(), &before).unwrap();
    let way = block(&directory, "NEW");
    backing.replace_files(before.files(), &next).unwrap_err();
    assert_eq!(
        content(directory.path(), "OLD").as_deref(),
        Some(b"O\n".as_slice())
    );
    assert_eq!(backing.status().unsaved, ["NEW", "OLD"].map(str::to_owned).into());
    fs::remove_dir(way).unwrap();
    // The next state makes up for what this one lacks, though the drive does not change.
    backing.replace_files(next.files(), &next).unwrap();
    assert!(backing.status().unsaved.is_empty());
    assert_eq!(content(directory.path(), "OLD"), None);
    assert_eq!(
        content(directory.path(), "NEW").as_deref(),
        Some(b"N\n".as_slice())
    );
}

#[test]
fn each_outage_is_logged_once_although_all_have_the_same_cause() {
    let directory = TempDir::new("backing-outages");
    let mut backing = backing(&directory, WhenFull::Refuse);
    let mut write = |blocked: bool| {
        let way = blocked.then(|| block(&directory, "A"));
        let outcome = persist(&mut backing, "A", Some(b"A\n"));
        way.inspect(|way| fs::remove_dir(way).unwrap());
        (outcome.is_ok(), backing.last_logged.is_some())
    };
    for _ in 0..2 {
        // The second failure has the cause of the first and is not logged; after a success the next one is again.
        assert_eq!(
            [write(true), write(true), write(false)],
            [(false, true), (false, true), (true, false)]
        );
    }
}
