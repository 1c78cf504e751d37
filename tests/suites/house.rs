//! The house rules: module heads, dependencies, panics, and the origin of every fixture.
//!
//! These tests read the sources; they run nothing. Rules about `std` in the pure crates are in `purity.rs`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use ts3100_tests::clauses::read_list;

/// The crates of the controller and their only dependencies: no clock, no socket and no file comes in by one of them. And
/// the crate of the host, which knows nothing of the controller.
const DEPENDENCIES: [(&str, &[&str]); 4] = [
    ("proto", &["bytes", "nom", "serde", "thiserror"]),
    ("scol-mini", &["libm", "serde", "thiserror"]),
    (
        "controller",
        &["bytes", "libm", "scol-mini", "serde", "thiserror", "ts3100-proto"],
    ),
    ("host", &["serialport", "thiserror", "ts3100-proto"]),
];

pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..")
}

pub fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        let entries =
            std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
        for path in entries.map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                if path.file_name().is_some_and(|name| name != "target") {
                    folders.push(path);
                }
            } else if path.extension().is_some_and(|found| found == extension) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

fn sources() -> Vec<(PathBuf, String)> {
    let paths = ["crates", "tests"]
        .into_iter()
        .flat_map(|folder| files(&root().join(folder), "rs"));
    paths
        .map(|path| (path.clone(), std::fs::read_to_string(&path).unwrap()))
        .collect()
}

/// A source without its test module.
pub fn product(text: &str) -> &str {
    match text.find("#[cfg(test)]\nmod tests") {
        Some(at) => &text[..at],
        None => text,
    }
}

pub fn is_test(path: &Path) -> bool {
    let whole = path.to_string_lossy();
    let part = whole.strip_prefix(&*root().to_string_lossy()).unwrap_or(&whole);
    part.starts_with("/tests/")
        || part.contains("/tests/")
        || part.ends_with("/tests.rs")
        || part.contains("/testing")
}

fn none(what: &str, offenders: &[String]) {
    assert!(offenders.is_empty(), "{what}:\n{}", offenders.join("\n"));
}

#[test]
fn no_loop_waits_for_a_socket_without_giving_way() {
    let waits = |(path, text): (PathBuf, String)| {
        let raw = [".readable()", ".writable()", ".ready(Interest"];
        let waits = |line: &str| raw.iter().any(|wait| line.contains(wait)) && !line.contains("pin!");
        let waits = product(&text).lines().any(waits);
        (waits && !text.contains("consume_budget().await")).then(|| path.display().to_string())
    };
    let inside = sources().into_iter().filter(|(path, _)| !is_test(path));
    let offenders: Vec<String> = inside.filter_map(waits).collect();
    none(
        "wait by `crate::socket`, or call consume_budget in the loop",
        &offenders,
    );
}

#[test]
fn every_file_says_what_it_is_for() {
    let offenders = sources()
        .into_iter()
        .filter(|(_, text)| !text.starts_with("//! "));
    none(
        "files without an opening `//!`",
        &offenders
            .map(|(path, _)| path.display().to_string())
            .collect::<Vec<_>>(),
    );
}

#[test]
fn crates_use_what_they_may() {
    let mut offenders = Vec::new();
    for (name, allowed) in DEPENDENCIES {
        let manifest = std::fs::read_to_string(root().join("crates").join(name).join("Cargo.toml")).unwrap();
        let found = dependencies(&manifest);
        let foreign = found.iter().filter(|found| !allowed.contains(&found.as_str()));
        offenders.extend(foreign.map(|found| format!("{name}: {found} is not on its list")));
    }
    none("dependencies", &offenders);
}

fn dependencies(manifest: &str) -> Vec<String> {
    let mut section = String::new();
    let mut found = Vec::new();
    for line in manifest.lines().map(str::trim) {
        if let Some(header) = line.strip_prefix('[') {
            section = header.trim_end_matches(']').to_string();
            if let Some(name) = section.strip_prefix("dependencies.") {
                found.push(name.to_string());
            }
        } else if section == "dependencies" && !line.is_empty() && !line.starts_with('#') {
            found.extend(line.split(['.', ' ', '=']).next().map(str::to_string));
        }
    }
    found
}

#[test]
fn the_dependency_reader_sees_every_form() {
    let manifest = "[dependencies]\na.workspace = true\nb = \"1\"\nc = { version = \"1\" }\n\n[dependencies.d]\n\
        version = \"1\"\n[dev-dependencies]\ne = \"1\"\n";
    assert_eq!(dependencies(manifest), ["a", "b", "c", "d"]);
}

#[test]
fn nothing_panics_on_purpose() {
    let mut offenders = Vec::new();
    for (path, text) in sources().into_iter().filter(|(path, _)| !is_test(path)) {
        for (number, line) in (1..).zip(product(&text).lines()) {
            let code = line.trim_start();
            if code.starts_with("//") {
                continue;
            }
            for word in [".unwrap()", "todo!", "unimplemented!", "unsafe "] {
                if code.contains(word) {
                    offenders.push(format!("{}:{number}: {word}", path.display()));
                }
            }
        }
    }
    none("words that do not belong in the product", &offenders);
}

/// Words by which a test waits for the clock instead of for what it is about.
const CLOCKS: [&str; 2] = ["sleep(", "Instant::now("];

/// Where tests may have them all the same: file, word, reason.
const MAY_WATCH_THE_CLOCK: [(&str, &str, &str); 7] = [
    (
        "tests/src/testing.rs",
        "sleep(",
        "the one place that looks again and again, with a bound",
    ),
    ("tests/src/testing.rs", "Instant::now(", "its bound"),
    (
        "crates/driver/src/driver/tests.rs",
        "sleep(",
        "under tokio's clock that the test has paused: it takes no time",
    ),
    (
        "crates/driver/src/driver/tests.rs",
        "Instant::now(",
        "virtual time is compared with wall-clock time, which it must not exceed",
    ),
    (
        "crates/emulator/src/log/fold.rs",
        "Instant::now(",
        "a moment that others are counted from; nothing is waited for",
    ),
    (
        "tests/suites/purity.rs",
        "Instant::now(",
        "a source that the compiler has to refuse",
    ),
    ("tests/suites/house.rs", "", "the words themselves"),
];

/// The part of a source that is tests, with the number of its first line.
fn tests_of<'a>(path: &Path, text: &'a str) -> (usize, &'a str) {
    let tests = if is_test(path) {
        text
    } else {
        &text[product(text).len()..]
    };
    (text[..text.len() - tests.len()].matches('\n').count() + 1, tests)
}

#[test]
fn no_test_waits_by_the_clock() {
    let (mut offenders, mut excused) = (Vec::new(), BTreeMap::new());
    for (path, text) in sources() {
        let whole = path.to_string_lossy().replace('\\', "/");
        // Programs beside the suites measure.
        if whole.contains("/tests/src/bin/") {
            continue;
        }
        let (first, tests) = tests_of(&path, &text);
        for (number, line) in (first..).zip(tests.lines()) {
            let code = line.trim_start();
            let found = CLOCKS.iter().find(|word| code.contains(**word));
            let Some(word) = found.filter(|_| !code.starts_with("//")) else {
                continue;
            };
            let excuse = MAY_WATCH_THE_CLOCK
                .iter()
                .position(|(file, may, _)| whole.ends_with(file) && (may.is_empty() || may == word));
            match excuse {
                Some(index) => *excused.entry(index).or_insert(0) += 1,
                None => offenders.push(format!("{}:{number}: {word}", path.display())),
            }
        }
    }
    none(
        "tests that wait by the clock; wait for an event or for bytes, move virtual time, or use `eventually`",
        &offenders,
    );
    assert_eq!(
        excused.len(),
        MAY_WATCH_THE_CLOCK.len(),
        "an exception that nothing needs: {excused:?}"
    );
}

/// An error whose words contain those of its source, and that hands the source on besides, has it twice in the words
/// of a chain (`{:#}`).
fn repeats_its_source(text: &str) -> Vec<usize> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("#[error(\"") {
        let rest = &text[at..];
        let words = &rest[..rest.find(")]").unwrap_or(rest.len())];
        // Up to the next variant, or the end of a struct.
        let item = &rest[words.len()..];
        let item = &item[..item
            .find("\n    #[error(")
            .or_else(|| item.find("\n}"))
            .unwrap_or(item.len())];
        let handed_on = item.contains("#[from]") || item.contains("#[source]");
        let is_field = item.contains(" source: ");
        if words.contains("{source") && is_field || words.contains("{0") && handed_on {
            found.push(text[..at].matches('\n').count() + 1);
        }
    }
    found
}

#[test]
fn no_error_repeats_its_source() {
    assert_eq!(
        repeats_its_source("    #[error(\"a: {source}\")]\n    A {\n        source: io::Error,\n    },\n}\n"),
        [1]
    );
    assert_eq!(
        repeats_its_source("\n    #[error(\"a: {0}\")]\n    A(#[from] B),\n}\n"),
        [2]
    );
    assert!(
        repeats_its_source(
            "    #[error(\"a: {0}\")]\n    A(B),\n    #[error(\"c\")]\n    C(#[from] D),\n}\n"
        )
        .is_empty()
    );
    let mut offenders = Vec::new();
    for (path, text) in sources().into_iter().filter(|(path, _)| !is_test(path)) {
        offenders.extend(
            repeats_its_source(product(&text))
                .into_iter()
                .map(|line| format!("{}:{line}", path.display())),
        );
    }
    none("errors that tell their source twice", &offenders);
}

#[test]
fn every_fixture_states_its_origin() {
    let mut offenders = Vec::new();
    let fixtures = root().join("fixtures");
    for extension in ["txt", "scol", "par", "toml", "expected"] {
        for path in files(&fixtures, extension) {
            let text = std::fs::read_to_string(&path).unwrap();
            // An expectation shares the origin of its program: beside it, or in `scol` if the product wrote it.
            let golden = path.strip_prefix(fixtures.join("golden"));
            let program = golden.map_or(path.clone(), |name| fixtures.join("scol").join(name));
            let shared = extension != "scol" && program.with_extension("scol").exists();
            if !shared
                && !text
                    .lines()
                    .take(5)
                    .any(|line| line.to_ascii_lowercase().contains("origin:"))
            {
                offenders.push(path.display().to_string());
            }
        }
    }
    none("fixtures without an origin", &offenders);
}

#[test]
fn clauses_named_by_transcripts_are_in_the_list() {
    let list = std::fs::read_to_string(root().join("docs/clauses.tsv")).unwrap();
    let list = read_list(&list).unwrap();
    for path in files(&root().join("fixtures/transcripts"), "txt") {
        let text = std::fs::read_to_string(&path).unwrap();
        let clauses = text
            .lines()
            .filter_map(|line| line.strip_prefix("clauses: "))
            .flat_map(str::split_whitespace);
        for clause in clauses {
            assert!(
                list.iter().any(|row| row.id == clause),
                "{}: docs/clauses.tsv has no {clause}",
                path.display()
            );
        }
    }
}

/// Rooms of the controller, and the value that they do not know.
const STRANGERS: [(&str, &str); 10] = [
    ("endpoint", "Robot"),
    ("endpoint", "Executor"),
    ("executor", "Endpoints"),
    ("executor", "Robot"),
    ("robot", "Endpoints"),
    ("arm", "Endpoints"),
    ("arm", "Robot"),
    ("io", "Endpoints"),
    ("io", "Robot"),
    ("motion", "Endpoints"),
];

#[test]
fn robot_and_ports_do_not_know_each_other() {
    let inside = root().join("crates/controller/src");
    let mut offenders = Vec::new();
    for (path, text) in sources().into_iter().filter(|(path, _)| !is_test(path)) {
        let Ok(room) = path.strip_prefix(&inside) else {
            continue;
        };
        for (number, line) in (1..).zip(product(&text).lines()) {
            let code = !line.trim_start().starts_with("//");
            let names = |(home, stranger): &&(&str, &str)| {
                let file = format!("{home}.rs");
                (room.starts_with(home) || room == Path::new(&file)) && line.contains(stranger)
            };
            if code && STRANGERS.iter().any(|row| names(&row)) {
                offenders.push(format!("{}:{number}: {}", path.display(), line.trim()));
            }
        }
    }
    none("rooms that know what they are not to know", &offenders);
}

/// Names of I/O and clocks that the conversation of a host does without.
const IO: [&str; 7] = [
    "std::fs",
    "std::io",
    "std::net",
    "std::thread",
    "std::time",
    "serialport",
    "transport",
];

#[test]
fn the_conversation_of_a_host_has_no_io() {
    let mut offenders = Vec::new();
    for name in ["conversation.rs", "expected.rs"] {
        let path = root().join("crates/host/src").join(name);
        let text = std::fs::read_to_string(&path).unwrap();
        for (number, line) in (1..).zip(product(&text).lines()) {
            let code = !line.trim_start().starts_with("//");
            if code && IO.iter().any(|word| line.contains(word)) {
                offenders.push(format!("{name}:{number}: {}", line.trim()));
            }
        }
    }
    none("I/O in the conversation", &offenders);
}

/// Fields of the ports, which only the ports' own files write.
const PORT_FIELDS: [&str; 3] = [".sessions", ".lines.get", ".send_queue"];

#[test]
fn only_the_ports_write_conversations() {
    let inside = root().join("crates/controller/src");
    let mut offenders = Vec::new();
    for (path, text) in sources() {
        let Ok(room) = path.strip_prefix(&inside) else {
            continue;
        };
        let text = product(&text);
        // The controller alone sees both; a snapshot is the whole value, and queries only read.
        let ports = [
            "endpoint",
            "endpoint.rs",
            "controller",
            "controller.rs",
            "snapshot",
            "snapshot.rs",
            "queries.rs",
        ];
        if ports.iter().any(|port| room.starts_with(port)) || is_test(&path) {
            continue;
        }
        for (number, line) in text.lines().enumerate() {
            if PORT_FIELDS.iter().any(|field| line.contains(field)) {
                offenders.push(format!("{}:{}: {}", path.display(), number + 1, line.trim()));
            }
        }
    }
    none("the robot reaches into the ports", &offenders);
}

/// Parts of the robot, and the folder whose files may write their fields; the compiler holds it for private fields.
const PARTS: [(&str, &str); 9] = [
    ("alarms", "alarm.rs"),
    ("arm", "arm"),
    ("drive", "drive.rs"),
    ("executor", "executor"),
    ("maintenance", "maintenance.rs"),
    ("panel", "panel.rs"),
    ("parameters", "parameters.rs"),
    ("persistence", "persistence.rs"),
    ("signals", "io/signals.rs"),
];

/// The part of the robot whose field a line assigns.
fn written_part(line: &str) -> Option<&str> {
    let assigned = [" = ", " += ", " |= ", " &= "];
    let (target, _) = assigned.iter().find_map(|sign| line.trim().split_once(sign))?;
    let fields = target
        .strip_prefix("self.robot.")
        .or_else(|| target.strip_prefix("robot."));
    let (part, field) = fields.or_else(|| target.strip_prefix("self."))?.split_once('.')?;
    (!field.contains(' ')).then_some(part)
}

#[test]
fn a_part_of_the_robot_is_written_by_its_own_files() {
    assert_eq!(written_part("    self.panel.state = state;"), Some("panel"));
    assert_eq!(written_part("let on = self.panel.state().servo;"), None);
    let inside = root().join("crates/controller/src");
    let mut offenders = Vec::new();
    for (path, text) in sources().into_iter().filter(|(path, _)| !is_test(path)) {
        let Ok(room) = path.strip_prefix(&inside) else {
            continue;
        };
        for (number, line) in (1..).zip(product(&text).lines()) {
            let part = written_part(line).and_then(|found| PARTS.iter().find(|(part, _)| *part == found));
            if part.is_some_and(|(_, home)| !room.starts_with(home)) {
                offenders.push(format!("{}:{number}: {}", path.display(), line.trim()));
            }
        }
    }
    none("fields written from outside of their part", &offenders);
}

#[test]
fn every_error_has_a_type() {
    let untyped = |line: &str| line.contains("Result<") && line.contains(", String>");
    let mut offenders = Vec::new();
    for (path, text) in sources().into_iter().filter(|(path, _)| !is_test(path)) {
        let lines = (1..).zip(product(&text).lines());
        let found = lines.filter(|(_, line)| untyped(line));
        offenders.extend(found.map(|(number, _)| format!("{}:{number}", path.display())));
    }
    none("functions that fail with a text", &offenders);
}

/// A tag can be moved to another commit, a hash cannot. The version is beside it, for people and for Dependabot.
#[test]
fn actions_are_pinned_by_hash() {
    let mut paths = files(&root().join(".github/workflows"), "yml");
    paths.push(root().join("action.yml"));
    let is_pinned = |uses: &str| {
        let version = uses.split_once('@').and_then(|(_, rest)| rest.split_once(" # v"));
        version
            .is_some_and(|(hash, _)| hash.len() == 40 && hash.bytes().all(|digit| digit.is_ascii_hexdigit()))
    };
    let mut offenders = Vec::new();
    for path in paths {
        let text = std::fs::read_to_string(&path).unwrap();
        let used = text.lines().filter_map(|line| line.split("uses: ").nth(1));
        let loose = used.filter(|uses| !is_pinned(uses));
        offenders.extend(loose.map(|uses| format!("{}: {uses}", path.display())));
    }
    none("actions that are not pinned by hash", &offenders);
}
