//! docs/explanation/architecture.md names files, functions and types that exist.
//!
//! Whether what it says of them is true is for reviewers. Rows of other documents are checked in `docs.rs`.

use std::collections::BTreeSet;
use std::path::PathBuf;

/// Words in backticks that look like types and are none of ours.
const NOT_OURS: [&str; 1] = ["HashMap"];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// What stands between backticks, outside of code blocks.
fn quoted(page: &str) -> Vec<&str> {
    let text = page.split("```").step_by(2);
    text.flat_map(|text| text.split('`').skip(1).step_by(2)).collect()
}

/// All identifiers of the crates and the suites, and those after `fn`.
fn identifiers() -> (BTreeSet<String>, BTreeSet<String>) {
    let (mut all, mut functions) = (BTreeSet::new(), BTreeSet::new());
    for folder in ["crates", "tests/src"] {
        for path in super::house::files(&root().join(folder), "rs") {
            let text = std::fs::read_to_string(path).unwrap();
            let mut before = "";
            for word in text.split(|c: char| !c.is_alphanumeric() && c != '_') {
                if before == "fn" {
                    functions.insert(word.to_string());
                }
                all.insert(word.to_string());
                before = word;
            }
        }
    }
    (all, functions)
}

/// Why a quoted word names nothing, if it looks like a path, a function or a type.
fn fault(word: &str, all: &BTreeSet<String>, functions: &BTreeSet<String>) -> Option<&'static str> {
    let last = word.rsplit("::").next().unwrap_or(word);
    if word.contains('/') && !word.contains(' ') && !word.contains('<') && !word.starts_with('/') {
        let known = ["crates", "."]
            .iter()
            .any(|base| root().join(base).join(word).exists());
        return (!known).then_some("no such file");
    }
    if let Some(name) = last.strip_suffix("()") {
        return (!functions.contains(name)).then_some("no such function");
    }
    let is_name = last.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    let is_type = last.starts_with(|c: char| c.is_ascii_uppercase())
        && (last.contains('_') || last.contains(|c: char| c.is_ascii_lowercase()));
    let unknown = is_name && is_type && !all.contains(last) && !NOT_OURS.contains(&last);
    unknown.then_some("no such type or constant")
}

#[test]
fn the_architecture_names_what_exists() {
    let page = std::fs::read_to_string(root().join("docs/explanation/architecture.md")).unwrap();
    let (all, functions) = identifiers();
    let mut faults = Vec::new();
    for word in quoted(&page) {
        if let Some(fault) = fault(word, &all, &functions) {
            faults.push(format!("`{word}`: {fault}"));
        }
    }
    assert!(
        faults.is_empty(),
        "docs/explanation/architecture.md:\n{}",
        faults.join("\n")
    );
    assert_eq!(
        fault("controller/src/nothing.rs", &all, &functions),
        Some("no such file")
    );
    assert_eq!(
        fault("Queue::no_such_function()", &all, &functions),
        Some("no such function")
    );
    assert_eq!(fault("Machine::run()", &all, &functions), None);
}
