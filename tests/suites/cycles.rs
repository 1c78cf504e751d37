//! Which file imports which, inside a crate: no files need each other in a circle, other than a module and its children.
//!
//! Read from `use` items and from paths in bodies, whether they begin with `crate`, with `super`, or with the name of a child.
//! The file of the crate itself only hands names on, as the prelude does: it is in no circle. What a crate may import at
//! all is in `house.rs` and `purity.rs`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Crates without cycles: all of them.
const CRATES: [&str; 10] = [
    "proto",
    "scol-mini",
    "controller",
    "host",
    "driver",
    "book",
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
    if from.is_empty() {
        return BTreeSet::new();
    }
    let mut found: Vec<String> = Vec::new();
    for (at, _) in code.match_indices("use ") {
        let item = code[at + 4..].split(';').next().unwrap_or_default();
        found.extend(paths(&item.split_whitespace().collect::<String>()));
    }
    let path = |c: char| !(c.is_alphanumeric() || c == '_' || c == ':');
    found.extend(code.split(path).map(str::to_owned));
    let modules = found.iter().filter_map(|path| resolve(from, path, known));
    let hands_on = |to: &Module| to.is_empty() || to == &["prelude"];
    modules.filter(|to| to != from && !hands_on(to)).collect()
}

/// The file that a path leads to.
fn resolve(from: &[String], path: &str, known: &BTreeMap<Module, String>) -> Option<Module> {
    let mut words = path.split("::").peekable();
    let mut base = from.to_vec();
    match words.next()? {
        "crate" => base.clear(),
        "self" => {}
        "super" => drop(base.pop()),
        // Alone it is the name of something else: a variable, a field.
        child => {
            base.push(child.to_owned());
            if words.peek().is_none() || !known.contains_key(&base) {
                return None;
            }
        }
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

/// The circles: all files that can be reached from one another, without those of a module and its children alone.
fn circles(edges: &BTreeMap<Module, BTreeSet<Module>>) -> BTreeSet<BTreeSet<&Module>> {
    let reached: BTreeMap<&Module, BTreeSet<&Module>> =
        edges.keys().map(|from| (from, reachable(from, edges))).collect();
    let together = |from: &Module| -> BTreeSet<&Module> {
        let mutual = |to: &&Module| reached.get(*to).is_some_and(|back| back.contains(from));
        reached[from].iter().copied().filter(mutual).collect()
    };
    let all = edges.keys().map(together).filter(|circle| circle.len() > 1);
    let is_family = |circle: &BTreeSet<&Module>| {
        circle
            .iter()
            .any(|head| circle.iter().all(|module| module.starts_with(head)))
    };
    all.filter(|circle| !is_family(circle)).collect()
}

/// The imports between the files of a crate.
fn edges(crate_name: &str) -> BTreeMap<Module, BTreeSet<Module>> {
    let known = sources(crate_name);
    assert!(!known.is_empty(), "no crate {crate_name}");
    let edges = known.iter();
    edges
        .map(|(module, code)| (module.clone(), imports(module, code, &known)))
        .collect()
}

/// The same between the rooms: a file at the top of a crate with the folder of its name.
fn rooms(edges: BTreeMap<Module, BTreeSet<Module>>) -> BTreeMap<Module, BTreeSet<Module>> {
    let room = |module: &Module| -> Module { module.iter().take(1).cloned().collect() };
    let mut rooms: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
    for (from, to) in edges {
        let others = to.iter().map(room).filter(|to| *to != room(&from));
        rooms.entry(room(&from)).or_default().extend(others);
    }
    rooms
}

fn names(circles: &BTreeSet<BTreeSet<&Module>>) -> Vec<Vec<String>> {
    let circle = |circle: &BTreeSet<&Module>| circle.iter().map(|module| module.join("::")).collect();
    circles.iter().map(circle).collect()
}

#[test]
fn no_files_need_each_other_in_a_circle() {
    let name = |text: &str| -> Module { text.split("::").map(str::to_owned).collect() };
    let known = ["a", "a::child", "b", "c"].map(|text| (name(text), String::new()));
    let known = BTreeMap::from(known);
    let reads = |code: &str, expected: &[&str]| {
        let expected: BTreeSet<Module> = expected.iter().map(|text| name(text)).collect();
        assert_eq!(imports(&name("a"), code, &known), expected, "{code}");
    };
    reads(
        "use crate::{b::{X, Y}, c};\nfn f() -> crate::b::Z {}",
        &["b", "c"],
    );
    reads("mod child;\nuse child::X;", &["a::child"]);
    reads("fn f() { child::f() }", &["a::child"]);
    reads("let child = 1; g(child)", &[]);
    for crate_name in CRATES {
        let edges = edges(crate_name);
        let circles = names(&circles(&edges));
        assert!(
            circles.is_empty(),
            "{crate_name}: files that need each other in a circle: {circles:#?}"
        );
    }
}

/// Rooms of one table: a row of the commands names status, mode and permission, and a status body has their values.
const ONE_TABLE: [&str; 3] = ["command", "permission", "status"];

/// So rooms stand on floors: each imports only from those below it, and no arrow runs back up.
#[test]
fn no_rooms_need_each_other_in_a_circle() {
    for crate_name in CRATES {
        let rooms = rooms(edges(crate_name));
        let mut circles = names(&circles(&rooms));
        if crate_name == "proto" {
            circles.retain(|circle| circle != &ONE_TABLE);
        }
        assert!(
            circles.is_empty(),
            "{crate_name}: rooms that need each other in a circle: {circles:#?}"
        );
    }
}
