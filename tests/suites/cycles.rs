//! Which file imports which, inside a crate: no two files need each other, other than a module and its children.
//!
//! Read from the `use` items and the paths that begin with `crate` or `super`; a child may name its parents. What a crate
//! may import at all is in `house.rs` and `purity.rs`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Crates without cycles: all of them.
const CRATES: [&str; 8] = [
    "proto",
    "scol-mini",
    "controller",
    "driver",
    "survey",
    "recording",
    "control",
    "emulator",
];

/// A module by the words of its path; the crate itself has none.
type Module = Vec<String>;

fn sources(name: &str) -> BTreeMap<Module, String> {
    let source = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../crates")
        .join(name)
        .join("src");
    let files = super::house::files(&source, "rs");
    let inside = files.iter().filter(|path| !super::house::is_test(path));
    inside
        .map(|path| (module(path.strip_prefix(&source).unwrap()), read(path)))
        .collect()
}

fn module(path: &Path) -> Module {
    let path = path.with_extension("");
    let words = path.iter().map(|word| word.to_str().unwrap().to_owned());
    words
        .filter(|word| !["lib", "main", "mod"].contains(&word.as_str()))
        .collect()
}

/// The code of a file without its tests and comments.
fn read(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    let code = super::house::product(&text)
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    code.collect::<Vec<_>>().join("\n")
}

/// The paths of a `use` item, one for each name in its braces.
fn paths(item: &str) -> Vec<String> {
    let Some((before, rest)) = item.split_once('{') else {
        return vec![item.to_owned()];
    };
    let (mut depth, mut names) = (0, vec![String::new()]);
    for letter in rest[..rest.rfind('}').unwrap_or(rest.len())].chars() {
        depth += i32::from(letter == '{') - i32::from(letter == '}');
        if letter == ',' && depth == 0 {
            names.push(String::new());
        } else if let Some(name) = names.last_mut() {
            name.push(letter);
        }
    }
    names
        .iter()
        .flat_map(|name| paths(&format!("{before}{name}")))
        .collect()
}

fn imports(from: &[String], code: &str, known: &BTreeMap<Module, String>) -> BTreeSet<Module> {
    let mut found: Vec<String> = Vec::new();
    for (at, _) in code.match_indices("use ") {
        let item = code[at + 4..].split(';').next().unwrap_or_default();
        found.extend(paths(&item.split_whitespace().collect::<String>()));
    }
    let path = |c: char| !(c.is_alphanumeric() || c == '_' || c == ':');
    found.extend(code.split(path).map(str::to_owned));
    let modules = found.iter().filter_map(|path| resolve(from, path, known));
    // A child may name its parents, and every file names itself.
    modules.filter(|to| !from.starts_with(to)).collect()
}

/// The file that a path leads to.
fn resolve(from: &[String], path: &str, known: &BTreeMap<Module, String>) -> Option<Module> {
    let mut words = path.split("::").peekable();
    let mut base = from.to_vec();
    match words.next()? {
        "crate" => base.clear(),
        "self" => {}
        "super" => drop(base.pop()),
        _ => return None,
    }
    while words.next_if_eq(&"super").is_some() {
        base.pop();
    }
    for word in words {
        base.push(word.to_owned());
        if !known.contains_key(&base) {
            base.pop();
            break;
        }
    }
    Some(base)
}

/// Every file that can be reached from a file.
fn reachable<'a>(from: &'a Module, edges: &'a BTreeMap<Module, BTreeSet<Module>>) -> BTreeSet<&'a Module> {
    let (mut seen, mut next) = (BTreeSet::new(), vec![from]);
    while let Some(module) = next.pop() {
        for to in edges.get(module).into_iter().flatten() {
            if seen.insert(to) {
                next.push(to);
            }
        }
    }
    seen
}

#[test]
fn no_two_files_need_each_other() {
    let known = BTreeMap::from(["a", "b", "c"].map(|name| (vec![name.to_owned()], String::new())));
    let code = "use crate::{b::{X, Y}, c};\nfn f() -> crate::b::Z {}";
    let found = imports(&["a".to_owned()], code, &known);
    assert_eq!(found.len(), 2, "the reader of imports: {found:?}");
    let mut offenders = Vec::new();
    for name in CRATES {
        let known = sources(name);
        assert!(!known.is_empty(), "no crate {name}");
        let edges: BTreeMap<Module, BTreeSet<Module>> = known
            .iter()
            .map(|(module, code)| (module.clone(), imports(module, code, &known)))
            .collect();
        for (from, direct) in &edges {
            let back = direct.iter().filter(|to| reachable(to, &edges).contains(from));
            offenders.extend(back.map(|to| format!("{name}: {} -> {}", from.join("::"), to.join("::"))));
        }
    }
    assert!(
        offenders.is_empty(),
        "imports that lead back to where they come from:\n{}",
        offenders.join("\n")
    );
}
