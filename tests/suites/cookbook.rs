//! The programs of `fixtures/scol/cookbook`, which are the cookbook of the book: each has tests that pass, no remark of
//! `ts3100 check`, and the form of `ts3100 fmt`.
//!
//! That the page shows these files is in `docs`.

use crate::binary::support::{run, stdout};
use std::path::Path;

#[test]
fn each_program_passes_its_tests_and_has_no_remark() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/scol/cookbook");
    let mut programs = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|ending| ending == "scol") {
            let tests = path.with_extension("test.toml");
            assert!(tests.is_file(), "{} is missing", tests.display());
            programs += 1;
        }
    }
    assert!(programs >= 8, "{programs}");
    let folder = folder.to_str().unwrap();
    for words in [
        &["test", folder][..],
        &["check", "--deny-warnings", folder],
        &["fmt", "--check", folder],
    ] {
        let output = run(words);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{words:?}\n{}{errors}",
            stdout(&output)
        );
    }
}
