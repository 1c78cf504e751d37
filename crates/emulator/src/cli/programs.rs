//! The SCOL files, or the files of tests, that a command line names: each file as given, and those of a folder.
//!
//! A folder means all `*.scol` or `*.test.toml` files in it and below, in the order of their paths. Hidden files and folders are left out, and
//! symbolic links too: their target is found in its own place, and a link to a folder above cannot cause a loop.

use super::input::is_stdin;
use std::fs::{self, DirEntry};
use std::io;
use std::path::{Path, PathBuf};
use ts3100_recording::program_test::ENDING;
use ts3100_workbench::lsp::project::TABLE;

/// Files that are looked for in a folder.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted {
    /// What they are, for messages.
    what: &'static str,
    /// Ending of their names in lower case; files with it in upper case are found too.
    ending: &'static str,
}

/// Programs.
pub(super) const PROGRAMS: Wanted = Wanted {
    what: "SCOL files",
    ending: ".scol",
};
/// Tests of programs.
pub(super) const TESTS: Wanted = Wanted {
    what: "files of tests",
    ending: ENDING,
};
/// Deepest folder below a given one.
const MAX_DEPTH: usize = 32;
/// Most SCOL files of a folder: those of many cells. More is likely a folder that was not meant.
const MAX_FILES: usize = 10_000;
/// Most entries of a folder that are looked at, of any kind.
const MAX_ENTRIES: usize = 1_000_000;

impl Wanted {
    fn is(self, path: &Path) -> bool {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.to_ascii_lowercase().ends_with(self.ending)
    }
}

/// A folder that cannot be listed, or holds none of the files.
#[derive(Debug)]
pub(super) struct FolderError {
    pub(super) path: PathBuf,
    pub(super) reason: io::Error,
}

/// The files to read, in the order given. A path that is missing is among them: its reader reports it.
pub(super) fn expand(wanted: Wanted, paths: &[PathBuf]) -> Vec<Result<PathBuf, FolderError>> {
    let mut found = Vec::new();
    for path in paths {
        if is_stdin(path) || !path.is_dir() {
            found.push(Ok(path.clone()));
            continue;
        }
        let mut folder = Folder::new(wanted);
        folder.list(path, 0);
        found.append(&mut folder.finish(path));
    }
    found
}

/// The table of points in the folder of a program, if there is one.
pub(super) fn points_beside(program: &Path) -> Option<PathBuf> {
    let table = program.with_file_name(TABLE);
    (!is_stdin(program) && table.is_file()).then_some(table)
}

/// The files in a folder that have no ending, as programs have none on the controller. Hidden ones are left out.
pub(super) fn without_ending(folder: &Path) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let files = entries
        .take(MAX_FILES)
        .filter(|entry| !is_hidden(entry) && entry.file_type().is_ok_and(|kind| kind.is_file()));
    let paths = files.map(|entry| entry.path());
    paths.filter(|path| path.extension().is_none())
}

fn is_hidden(entry: &DirEntry) -> bool {
    entry.file_name().as_encoded_bytes().starts_with(b".")
}

/// The content of a folder, while it is listed.
struct Folder {
    wanted: Wanted,
    files: Vec<PathBuf>,
    errors: Vec<FolderError>,
    entries: usize,
}

impl Folder {
    fn new(wanted: Wanted) -> Folder {
        Folder {
            wanted,
            files: Vec::new(),
            errors: Vec::new(),
            entries: 0,
        }
    }

    fn list(&mut self, folder: &Path, depth: usize) {
        if let Err(reason) = self.list_entries(folder, depth) {
            self.errors.push(FolderError {
                path: folder.to_path_buf(),
                reason,
            });
        }
    }

    fn list_entries(&mut self, folder: &Path, depth: usize) -> io::Result<()> {
        if depth > MAX_DEPTH {
            return Err(io::Error::other(format!(
                "expected at most {MAX_DEPTH} folders in each other"
            )));
        }
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            if self.is_full() {
                return Ok(());
            }
            self.entries += 1;
            if is_hidden(&entry) {
                continue;
            }
            let (path, kind) = (entry.path(), entry.file_type()?);
            if kind.is_dir() {
                self.list(&path, depth + 1);
            } else if kind.is_file() && self.wanted.is(&path) {
                // `.` gives names such as `pick.scol` instead of `./pick.scol`.
                self.files
                    .push(path.strip_prefix(".").map(Path::to_path_buf).unwrap_or(path));
            }
        }
        Ok(())
    }

    fn is_full(&self) -> bool {
        self.files.len() > MAX_FILES || self.entries >= MAX_ENTRIES
    }

    fn finish(mut self, folder: &Path) -> Vec<Result<PathBuf, FolderError>> {
        let Wanted { what, ending } = self.wanted;
        let failed = |reason: String| {
            let path = folder.to_path_buf();
            let reason = io::Error::other(reason);
            vec![Err(FolderError { path, reason })]
        };
        if self.is_full() {
            return failed(format!(
                "expected at most {MAX_FILES} {what} among {MAX_ENTRIES} entries, found more; name the folders of your programs"
            ));
        }
        if self.files.is_empty() && self.errors.is_empty() {
            return failed(format!(
                "no {what} (*{ending}) in this folder and the folders below"
            ));
        }
        self.files.sort();
        let files = self.files.into_iter().map(Ok);
        files.chain(self.errors.into_iter().map(Err)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TempDir;

    fn found(directory: &TempDir) -> Vec<String> {
        let found = expand(PROGRAMS, &[directory.path().to_path_buf()]);
        let name = |path: &Path| {
            let inner = path.strip_prefix(directory.path()).unwrap();
            inner.to_str().unwrap().replace('\\', "/")
        };
        let lines = found.into_iter().map(|found| match found {
            Ok(path) => name(&path),
            Err(error) => format!("{}: {}", name(&error.path), error.reason),
        });
        lines.collect()
    }

    #[test]
    fn a_folder_means_the_scol_files_below() {
        let directory = TempDir::new("folder");
        for folder in ["cell/b", "cell/.git", "cell.d"] {
            fs::create_dir_all(directory.at(folder)).unwrap();
        }
        for name in [
            "b.scol",
            "A.SCOL",
            "cell/b/deep.scol",
            "cell.d/x.scol",
            "cell/.git/hidden.scol",
            ".hidden.scol",
            "points.csv",
            "scol",
        ] {
            directory.file(name, "");
        }
        assert_eq!(
            found(&directory),
            ["A.SCOL", "b.scol", "cell/b/deep.scol", "cell.d/x.scol"]
        );
    }

    #[test]
    fn a_folder_without_scol_files_is_an_error_and_a_missing_path_is_left_to_its_reader() {
        let directory = TempDir::new("folder");
        assert_eq!(
            found(&directory),
            [": no SCOL files (*.scol) in this folder and the folders below"]
        );
        let missing = directory.at("missing");
        let found = expand(PROGRAMS, &[missing.clone(), PathBuf::from("-")]);
        let found: Vec<PathBuf> = found.into_iter().map(Result::unwrap).collect();
        assert_eq!(found, [missing, PathBuf::from("-")]);
    }

    #[cfg(unix)]
    #[test]
    fn symbolic_links_cause_no_loop() {
        let directory = TempDir::new("folder");
        fs::create_dir(directory.at("in")).unwrap();
        directory.file("in/a.scol", "");
        std::os::unix::fs::symlink(directory.path(), directory.at("in/up")).unwrap();
        std::os::unix::fs::symlink("a.scol", directory.at("in/b.scol")).unwrap();
        assert_eq!(found(&directory), ["in/a.scol"]);
        // A link that is given is followed.
        let found = expand(PROGRAMS, &[directory.at("in/up")]);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].as_ref().unwrap(), &directory.at("in/up/in/a.scol"));
    }

    #[test]
    fn folders_are_listed_to_a_depth() {
        let directory = TempDir::new("folder");
        let deep = |depth: usize| (0..depth).fold(directory.path().to_path_buf(), |path, _| path.join("d"));
        fs::create_dir_all(deep(MAX_DEPTH + 1)).unwrap();
        fs::write(deep(MAX_DEPTH).join("last.scol"), "").unwrap();
        fs::write(deep(MAX_DEPTH + 1).join("no.scol"), "").unwrap();
        let found = found(&directory);
        assert_eq!(found.len(), 2);
        assert!(found[0].ends_with("d/last.scol"), "{found:?}");
        assert!(found[1].contains("expected at most 32 folders"), "{found:?}");
    }
}
