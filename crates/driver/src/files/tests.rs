//! Tests of [`super`]: which files are read and replaced, which are refused, and that a failed write leaves the old
//! file.

use super::*;
use crate::testing::TempDir;

#[test]
fn only_regular_files_of_their_size_are_read() {
    let directory = TempDir::new("files");
    let path = directory.path().join("file");
    fs::write(&path, "12345").unwrap();
    assert_eq!(read_text(&path, 5).unwrap(), "12345");
    assert_eq!(read(&path, 4).unwrap_err().to_string(), "larger than 4 bytes");
    fs::write(&path, [0xFF]).unwrap();
    assert_eq!(
        read_text(&path, 5).unwrap_err().kind(),
        io::ErrorKind::InvalidData
    );
    for other in [directory.path(), Path::new("/dev/zero")] {
        // Without an end, and without a size.
        assert!(read(other, 5).is_err(), "{}", other.display());
    }
    assert_eq!(
        read(&directory.path().join("none"), 5).unwrap_err().kind(),
        io::ErrorKind::NotFound
    );
}

fn names(directory: &TempDir) -> Vec<String> {
    let entries = fs::read_dir(directory.path()).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_file_is_replaced_whole_and_nothing_else_is_left() {
    let directory = TempDir::new("files-replace");
    let path = directory.path().join("report.xml");
    for content in ["long, the first", "second"] {
        check_target(&path).unwrap();
        replace(&path, content.as_bytes()).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), content);
    }
    assert_eq!(names(&directory), ["report.xml"]);
    let error = replace(&directory.path().join("none/report.xml"), b"").unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::NotFound);
    for path in [directory.path(), Path::new("..")] {
        for refused in [replace(path, b"x"), check_target(path), create(path).map(drop)] {
            let error = refused.unwrap_err().to_string();
            assert_eq!(error, "expected a regular file, found a directory");
        }
    }
    for path in ["/dev/stdout", "/dev/stderr"] {
        check_target(Path::new(path)).unwrap();
        replace(Path::new(path), b"").unwrap();
    }
}

#[cfg(unix)]
mod unix {
    use super::*;
    use rustix::fs::{CWD, FileType, Mode, OFlags, mknodat};
    use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _, symlink};

    #[test]
    fn what_is_no_regular_file_is_neither_read_nor_replaced_nor_waited_for() {
        let directory = TempDir::new("files-kinds");
        let pipe = directory.path().join("pipe");
        mknodat(CWD, &pipe, FileType::Fifo, Mode::RWXU, 0).unwrap();
        for (path, what) in [(pipe.as_path(), "a pipe"), (Path::new("/dev/null"), "a device")] {
            let expected = format!("expected a regular file, found {what}");
            for refused in [read(path, 5).map(drop), replace(path, b"x"), check_target(path)] {
                assert_eq!(refused.unwrap_err().to_string(), expected);
            }
        }
        assert!(create(Path::new("/dev/null")).is_err());
        assert_eq!(
            create(&pipe).unwrap_err().to_string(),
            "this pipe has no reader; start its reader first"
        );
        let flags = i32::try_from(OFlags::NONBLOCK.bits()).unwrap();
        let mut reader = File::options()
            .read(true)
            .custom_flags(flags)
            .open(&pipe)
            .unwrap();
        let mut writer = create(&pipe).unwrap();
        writer.write_all(b"live").unwrap();
        let mut read = [0; 4];
        reader.read_exact(&mut read).unwrap();
        assert_eq!(&read, b"live");
        // One that is full is an error, not a wait.
        assert!(writer.write_all(&vec![0; 1 << 24]).is_err());
        assert_eq!(names(&directory), ["pipe"]);
    }

    #[test]
    fn links_are_followed_within_their_directory_alone() {
        let (directory, other) = (TempDir::new("files-links"), TempDir::new("files-others"));
        let theirs = other.path().join("theirs");
        fs::write(&theirs, "theirs").unwrap();
        let link = |name: &str, to: &Path| {
            let path = directory.path().join(name);
            symlink(to, &path).unwrap();
            path
        };
        let (out, lost) = (link("out", &theirs), link("lost", Path::new("nowhere")));
        for path in [&out, &lost] {
            for refused in [replace(path, b"x"), check_target(path), create(path).map(drop)] {
                let error = refused.unwrap_err().to_string();
                assert!(error.contains("symbolic link"), "{error}");
            }
        }
        fs::write(directory.path().join("real"), "old").unwrap();
        let inside = link("inside", Path::new("real"));
        replace(&inside, b"new").unwrap();
        assert_eq!(fs::read(directory.path().join("real")).unwrap(), b"new");
        assert!(fs::symlink_metadata(&inside).unwrap().is_symlink());
        // Planted where the unfinished file will be.
        let path = directory.path().join("report");
        let planted = unfinished_path(&path, Some(std::process::id())).unwrap();
        symlink(&theirs, &planted).unwrap();
        replace(&path, b"ours").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"ours");
        let sources = link("sources", other.path());
        assert_eq!(
            make_directory(&sources).unwrap_err().to_string(),
            "expected a directory, found a symbolic link"
        );
        make_directory(other.path()).unwrap();
        assert_eq!(fs::read(&theirs).unwrap(), b"theirs");
        assert_eq!(
            names(&directory),
            ["inside", "lost", "out", "real", "report", "sources"]
        );
        assert_eq!(names(&other), ["theirs"]);
    }

    #[test]
    fn who_may_read_it_stays() {
        let directory = TempDir::new("files-mode");
        let path = directory.path().join("secret");
        fs::write(&path, "old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        replace(&path, b"new").unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
    }
}
