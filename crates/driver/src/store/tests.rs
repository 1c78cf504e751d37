//! Tests of the backing directory.

mod power_loss;

use super::*;
use crate::testing::TempDir;
use ts3100_controller::alarm::{ALARMS, AlarmCode};
use ts3100_proto::calendar::CalendarTime;

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
    let (mut store, found) = Store::open(directory.path(), LineEnd::Lf).unwrap();
    assert_eq!(found, vec![]);
    store.put("PICK", b"PROGRAM PICK\n").unwrap();
    store.put("USER.PAR", b"[END]\n").unwrap();
    store.put("PICK", b"END\n").unwrap();
    store.put("GONE", b"x").unwrap();
    store.remove("GONE").unwrap();
    store.remove("GONE").unwrap();
    drop(store);
    let (_, found) = Store::open(directory.path(), LineEnd::Lf).unwrap();
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
    let (mut store, _) = Store::open(directory.path(), LineEnd::Lf).unwrap();
    store.put("PICK", b"old").unwrap();
    drop(store);
    // What a kill between the write and the rename leaves.
    fs::write(directory.path().join(".PICK.unfinished"), b"ne").unwrap();
    let (_, found) = Store::open(directory.path(), LineEnd::Lf).unwrap();
    assert_eq!(found, vec![("PICK".to_owned(), b"old".to_vec())]);
    assert_eq!(names(&directory), ["PICK"]);
}

#[test]
fn a_write_that_fails_leaves_the_old_file_whole() {
    let directory = TempDir::new("store-fail");
    let (mut store, _) = Store::open(directory.path(), LineEnd::Lf).unwrap();
    store.put("PICK", b"old").unwrap();
    // A directory in the way of the temporary file makes the write fail for every user, root included.
    let in_the_way = directory.path().join(".PICK.unfinished");
    fs::create_dir(&in_the_way).unwrap();
    let error = store.put("PICK", b"new").unwrap_err().to_string();
    assert!(
        error.contains("cannot write") && error.contains("PICK"),
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
    let (mut store, found) = Store::open(directory.path(), LineEnd::Lf).unwrap();
    assert_eq!(found, vec![("PICK".to_owned(), b"old".to_vec())]);
    store.put("PICK", b"new").unwrap();
    assert_eq!(names(&directory), [".gitkeep", "PICK"]);
}

#[test]
fn names_never_lead_out_of_the_directory() {
    let directory = TempDir::new("store-names");
    let (mut store, _) = Store::open(&directory.path().join("drive"), LineEnd::Lf).unwrap();
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
            matches!(store.put(name, b"x"), Err(StoreError::NotADriveFile { .. })),
            "{name}"
        );
    }
    assert_eq!(names(&directory), ["drive"]);
}

#[test]
fn a_directory_has_one_owner_at_a_time() {
    let directory = TempDir::new("store-lock");
    let (store, _) = Store::open(directory.path(), LineEnd::Lf).unwrap();
    // Half a write of the owner, which must not be swept away.
    let unfinished = directory.path().join(".PICK.unfinished");
    fs::write(&unfinished, b"ne").unwrap();
    let error = Store::open(directory.path(), LineEnd::Lf).unwrap_err();
    assert!(matches!(error, StoreError::InUse { .. }), "{error}");
    assert!(
        error.to_string().contains(directory.path().to_str().unwrap()),
        "{error}"
    );
    assert!(unfinished.exists());
    drop(store);
    Store::open(directory.path(), LineEnd::Lf).unwrap();
}

#[test]
fn a_file_put_there_by_hand_is_that_of_load_and_the_directory_stays_as_it_is() {
    let directory = TempDir::new("store-by-hand");
    let given = [
        ("pick.scol", &b"PROGRAM PICK\r\nEND\r\n\x1a"[..]),
        // What a host has stored keeps its extension and its bytes.
        ("JOB.SCO", b"PROGRAM JOB\r\nEND\r\n"),
        ("user.par", b"[END]\n"),
    ];
    for (name, content) in given {
        fs::write(directory.path().join(name), content).unwrap();
    }
    for (line_end, pick) in [
        (LineEnd::Lf, &b"PROGRAM PICK\nEND\n"[..]),
        (LineEnd::Cr, b"PROGRAM PICK\rEND\r"),
    ] {
        let (store, found) = Store::open(directory.path(), line_end).unwrap();
        let user = if line_end == LineEnd::Lf {
            &b"[END]\n"[..]
        } else {
            b"[END]\r"
        };
        let expected = [
            ("JOB.SCO".to_owned(), given[1].1.to_vec()),
            ("PICK".to_owned(), pick.to_vec()),
            ("USER.PAR".to_owned(), user.to_vec()),
        ];
        assert_eq!(found, expected);
        assert!(store.warnings().is_empty(), "{:?}", store.warnings());
        for (name, content) in given {
            assert_eq!(fs::read(directory.path().join(name)).unwrap(), content, "{name}");
        }
    }
    let (mut store, _) = Store::open(directory.path(), LineEnd::Lf).unwrap();
    store.put("PICK", b"new").unwrap();
    assert_eq!(names(&directory), ["JOB.SCO", "PICK", "user.par"]);
    fs::write(directory.path().join("pick.scol"), b"END\n").unwrap();
    drop(store);
    let error = Store::open(directory.path(), LineEnd::Lf)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("on the RAM drive it has the same name as"),
        "{error}"
    );
}

#[test]
fn content_that_the_drive_cannot_have_is_skipped_with_its_place_and_never_overwritten() {
    let directory = TempDir::new("store-content");
    let most = vec![b'\n'; limits::MAX_FILE];
    let more = vec![b'\n'; limits::MAX_FILE + 1];
    let given: [(&str, &[u8], &str); 6] = [
        (
            "TAB",
            b"PROGRAM T\n\tEND\n",
            "line 2, character 1: expected printable ASCII, found the byte 09",
        ),
        (
            "hand.scol",
            b"PROGRAM T\r\nREMARK \xe4\r\n",
            "line 2, character 8: expected printable ASCII, found the byte E4",
        ),
        ("Thumbs.db", b"\xd0\xcf\x11\xe0", "line 1, character 1"),
        ("BIG", &more, "at most 99999 bytes"),
        ("MOST", &most, ""),
        ("PICK", b"END\n", ""),
    ];
    for (name, content, _) in given {
        fs::write(directory.path().join(name), content).unwrap();
    }
    let (mut store, found) = Store::open(directory.path(), LineEnd::Lf).unwrap();
    let found: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(found, ["MOST", "PICK"]);
    let skipped = given.iter().filter(|(.., reason)| !reason.is_empty());
    assert_eq!(store.warnings().len(), skipped.clone().count());
    for (name, _, reason) in skipped {
        let names_both = |warning: &String| warning.contains(name) && warning.contains(reason);
        assert!(
            store.warnings().iter().any(names_both),
            "{name}: {:?}",
            store.warnings()
        );
    }
    for name in ["TAB", "BIG"] {
        let error = store.put(name, b"END\n").unwrap_err().to_string();
        assert!(error.contains("was skipped at the start"), "{error}");
    }
    for (name, content, _) in given {
        assert_eq!(fs::read(directory.path().join(name)).unwrap(), content, "{name}");
    }
    // Moved away, it is in the way no longer.
    fs::remove_file(directory.path().join("TAB")).unwrap();
    store.put("TAB", b"END\n").unwrap();
    store.put("THUMBS", b"END\n").unwrap();
    assert_eq!(
        names(&directory),
        ["BIG", "MOST", "PICK", "TAB", "THUMBS", "Thumbs.db", "hand.scol"]
    );
}

#[test]
fn what_has_no_name_of_the_drive_is_skipped_with_a_warning() {
    let directory = TempDir::new("store-foreign");
    fs::write(directory.path().join("PICK"), b"END\n").unwrap();
    let foreign = ["README (1).md", "SUB", "a-b.scol", "2NAME"];
    for name in foreign {
        match name {
            "SUB" => fs::create_dir(directory.path().join(name)).unwrap(),
            _ => fs::write(directory.path().join(name), b"x").unwrap(),
        }
    }
    fs::write(directory.path().join(".DS_Store"), b"x").unwrap();
    let before = names(&directory);
    let (mut store, found) = Store::open(directory.path(), LineEnd::Lf).unwrap();
    assert_eq!(found, vec![("PICK".to_owned(), b"END\n".to_vec())]);
    let warnings = store.warnings();
    assert_eq!(warnings.len(), foreign.len(), "{warnings:?}");
    for name in foreign {
        assert!(
            warnings.iter().any(|warning| warning.contains(name)),
            "{name}: {warnings:?}"
        );
    }
    store.put("PICK", b"x").unwrap();
    assert_eq!(names(&directory), before);
}

#[test]
fn the_error_history_is_kept_and_a_damaged_one_is_named() {
    let directory = TempDir::new("store-history");
    let alarm = |code: AlarmCode| Alarm {
        code,
        detail: "at line 3".to_owned(),
        at: CalendarTime::MAX,
    };
    let history = [alarm(ALARMS[0]), alarm(ALARMS[1])];
    let (mut store, _) = Store::open(directory.path(), LineEnd::Lf).unwrap();
    assert!(store.history().is_empty());
    store.save_history(history.clone().into()).unwrap();
    let kept = directory.path().join(history::FILE);
    assert!(store.path_of(history::FILE).is_err(), "no command reaches it");
    let content = fs::read(&kept).unwrap();
    fs::remove_file(&kept).unwrap();
    store.save_history(history.clone().into()).unwrap();
    assert!(!kept.exists(), "what has not changed is not written");
    drop(store);
    // Whole, and cut off at each byte as a disk may leave it.
    for end in 0..=content.len() {
        fs::write(&kept, &content[..end]).unwrap();
        let (store, found) = Store::open(directory.path(), LineEnd::Lf).unwrap();
        assert!(found.is_empty());
        let whole = end == content.len();
        assert_eq!(store.history().iter().eq(history.iter()), whole, "{end}");
        assert_eq!(store.warnings().len(), usize::from(!whole));
        assert!(whole || store.warnings()[0].contains(history::FILE));
    }
    for damage in [
        String::from_utf8(content.clone())
            .unwrap()
            .replace("\"version\":1", "\"version\":2"),
        String::from_utf8(content.clone())
            .unwrap()
            .replace("65535", "2026")
            .replace("\"month\":12", "\"month\":13"),
        "x".repeat(2 * 1024 * 1024),
    ] {
        fs::write(&kept, damage).unwrap();
        let (store, _) = Store::open(directory.path(), LineEnd::Lf).unwrap();
        assert_eq!((store.history().len(), store.warnings().len()), (0, 1));
    }
}

#[test]
fn a_removal_that_fails_can_be_tried_again() {
    let directory = TempDir::new("store-remove");
    let (mut store, _) = Store::open(directory.path(), LineEnd::Lf).unwrap();
    let path = directory.path().join("PICK");
    store.put("PICK", b"old").unwrap();
    fs::remove_file(&path).unwrap();
    fs::create_dir(&path).unwrap();
    store.remove("PICK").unwrap_err();
    fs::remove_dir(&path).unwrap();
    fs::write(&path, b"old").unwrap();
    store.remove("PICK").unwrap();
    assert!(names(&directory).is_empty());
}

#[cfg(unix)]
#[test]
fn a_link_planted_where_a_file_is_written_is_not_followed() {
    let (directory, other) = (TempDir::new("store-planted"), TempDir::new("store-others"));
    let theirs = other.path().join("theirs");
    fs::write(&theirs, b"theirs").unwrap();
    let (mut store, _) = Store::open(directory.path(), LineEnd::Lf).unwrap();
    for planted in [".PICK.unfinished", "PICK", "..ts3100.history.unfinished"] {
        std::os::unix::fs::symlink(&theirs, directory.path().join(planted)).unwrap();
    }
    store.put("PICK", b"ours").unwrap();
    let alarm = Alarm {
        code: ALARMS[0],
        detail: String::new(),
        at: CalendarTime {
            year: 2026,
            month: 1,
            day: 1,
            hour: 0,
            minute: 0,
            second: 0,
        },
    };
    store.save_history([alarm.clone()].into()).unwrap();
    assert_eq!(fs::read(&theirs).unwrap(), b"theirs");
    assert_eq!(names(&directory), [history::FILE, "PICK"]);
    assert!(
        !fs::symlink_metadata(directory.path().join("PICK"))
            .unwrap()
            .is_symlink()
    );
}

#[cfg(unix)]
#[test]
fn the_lock_does_not_follow_a_link_out_of_the_directory() {
    let (directory, other) = (TempDir::new("store-lock-link"), TempDir::new("store-lock-other"));
    let (present, absent) = (other.path().join("theirs"), other.path().join("new"));
    fs::write(&present, b"theirs").unwrap();
    for target in [&present, &absent] {
        std::os::unix::fs::symlink(target, directory.path().join(LOCK)).unwrap();
        let error = Store::open(directory.path(), LineEnd::Lf)
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("cannot lock") && error.contains("a symbolic link"),
            "{error}"
        );
        fs::remove_file(directory.path().join(LOCK)).unwrap();
    }
    assert!(!absent.exists());
    assert_eq!(fs::read(&present).unwrap(), b"theirs");
    Store::open(directory.path(), LineEnd::Lf).unwrap();
}

#[cfg(unix)]
#[test]
fn a_directory_that_is_another_one_is_not_written() {
    let parent = TempDir::new("store-gone");
    let (here, away) = (parent.path().join("drive"), parent.path().join("away"));
    let (mut store, _) = Store::open(&here, LineEnd::Lf).unwrap();
    store.put("PICK", b"old").unwrap();
    fs::rename(&here, &away).unwrap();
    for replaced in [false, true] {
        if replaced {
            fs::create_dir(&here).unwrap();
        }
        for refused in [
            store.put("PICK", b"new"),
            store.put("NEW", b"x"),
            store.remove("PICK"),
        ] {
            let error = refused.unwrap_err().to_string();
            assert!(error.contains("removed or replaced while ts3100 ran"), "{error}");
        }
    }
    assert_eq!(fs::read_dir(&here).unwrap().count(), 0);
    fs::remove_dir(&here).unwrap();
    fs::rename(&away, &here).unwrap();
    assert_eq!(fs::read(here.join("PICK")).unwrap(), b"old");
    store.put("PICK", b"new").unwrap();
    assert_eq!(fs::read(here.join("PICK")).unwrap(), b"new");
}
