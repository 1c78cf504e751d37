//! Tests of the backing directory.

use super::*;
use crate::testing::TempDir;

fn names(directory: &TempDir) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(directory.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != LOCK)
        .collect();
    names.sort();
    names
}

// clause: RAM-14
#[test]
fn what_was_put_is_there_after_a_restart() {
    let directory = TempDir::new("store-restart");
    let (mut store, found) = Store::open(directory.path()).unwrap();
    assert_eq!(found, vec![]);
    store.put("PICK", b"PROGRAM PICK\n").unwrap();
    store.put("USER.PAR", b"[END]\n").unwrap();
    store.put("PICK", b"END\n").unwrap();
    store.put("GONE", b"x").unwrap();
    store.remove("GONE").unwrap();
    store.remove("GONE").unwrap();
    drop(store);
    let (_, found) = Store::open(directory.path()).unwrap();
    assert_eq!(
        found,
        vec![
            ("PICK".to_owned(), b"END\n".to_vec()),
            ("USER.PAR".to_owned(), b"[END]\n".to_vec())
        ]
    );
    assert_eq!(
        names(&directory),
        ["PICK", "USER.PAR"],
        "nothing else is left behind"
    );
}

#[test]
fn a_write_that_was_cut_short_leaves_the_old_file_whole() {
    let directory = TempDir::new("store-cut");
    let (mut store, _) = Store::open(directory.path()).unwrap();
    store.put("PICK", b"old").unwrap();
    drop(store);
    // What a kill between the write and the rename leaves.
    fs::write(directory.path().join(".PICK.unfinished"), b"ne").unwrap();
    let (_, found) = Store::open(directory.path()).unwrap();
    assert_eq!(found, vec![("PICK".to_owned(), b"old".to_vec())]);
    assert_eq!(names(&directory), ["PICK"]);
}

#[test]
fn a_write_that_fails_leaves_the_old_file_whole() {
    let directory = TempDir::new("store-fail");
    let (mut store, _) = Store::open(directory.path()).unwrap();
    store.put("PICK", b"old").unwrap();
    // A directory in the way of the temporary file makes the write fail for every user, root included.
    let in_the_way = directory.path().join(".PICK.unfinished");
    fs::create_dir(&in_the_way).unwrap();
    let error = store.put("PICK", b"new").unwrap_err().to_string();
    assert!(
        error.contains("cannot write") && error.contains(".PICK.unfinished"),
        "{error}"
    );
    fs::remove_dir(&in_the_way).unwrap();
    assert_eq!(fs::read(directory.path().join("PICK")).unwrap(), b"old");
}

#[test]
fn a_file_put_there_by_hand_in_lower_case_is_replaced_not_doubled() {
    let directory = TempDir::new("store-case");
    fs::write(directory.path().join("pick"), b"old").unwrap();
    fs::write(directory.path().join(".gitkeep"), b"").unwrap();
    let (mut store, found) = Store::open(directory.path()).unwrap();
    assert_eq!(found, vec![("PICK".to_owned(), b"old".to_vec())]);
    store.put("PICK", b"new").unwrap();
    assert_eq!(names(&directory), [".gitkeep", "PICK"]);
}

#[test]
fn names_never_lead_out_of_the_directory() {
    let directory = TempDir::new("store-names");
    let (mut store, _) = Store::open(&directory.path().join("drive")).unwrap();
    for name in [
        "../PICK",
        "/tmp/PICK",
        "",
        ".",
        "..",
        "PICK/X",
        "pick",
        "TOOLONGNAME.PAR",
    ] {
        assert!(
            matches!(store.put(name, b"x"), Err(StoreError::Foreign { .. })),
            "{name}"
        );
    }
    assert_eq!(names(&directory), ["drive"]);
}

#[test]
fn a_directory_has_one_owner_at_a_time() {
    let directory = TempDir::new("store-lock");
    let (store, _) = Store::open(directory.path()).unwrap();
    // Half a write of the owner, which must not be swept away.
    let unfinished = directory.path().join(".PICK.unfinished");
    fs::write(&unfinished, b"ne").unwrap();
    let error = Store::open(directory.path()).unwrap_err();
    assert!(matches!(error, StoreError::InUse { .. }), "{error}");
    assert!(
        error.to_string().contains(directory.path().to_str().unwrap()),
        "{error}"
    );
    assert!(unfinished.exists());
    drop(store);
    Store::open(directory.path()).unwrap();
}

#[test]
fn foreign_files_are_refused_by_name() {
    for (name, size, reason) in [
        ("a-b.scol", 1, "cannot be a file of the RAM drive"),
        ("BIG", limits::MAX_FILE + 1, "99999 fit"),
    ] {
        let directory = TempDir::new("store-foreign");
        fs::write(directory.path().join(name), vec![b' '; size]).unwrap();
        let error = Store::open(directory.path()).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains(reason), "{error}");
    }
    let directory = TempDir::new("store-foreign");
    fs::create_dir(directory.path().join("SUB")).unwrap();
    assert!(
        Store::open(directory.path())
            .unwrap_err()
            .to_string()
            .contains("no file")
    );
}
