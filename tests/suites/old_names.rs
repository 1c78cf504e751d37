//! Names that were changed before the first release: none is kept, and none comes back. The sources, the pages, the
//! scripts, the help texts and the OpenAPI document are searched for them.

use super::binary::support::{Serve, run, stdout};
use std::fs;
use std::path::PathBuf;

/// The old name, and the name today.
const OLD: &[(&str, &str)] = &[
    // Flags and variables.
    ("--host", "--serial-host"),
    ("--host-rfc2217", "--serial-host-rfc2217"),
    ("--host-tcp", "--serial-host-tcp"),
    ("--com1", "--serial-com1"),
    ("--com1-rfc2217", "--serial-com1-rfc2217"),
    ("--com1-tcp", "--serial-com1-tcp"),
    ("--key", "--key-switch"),
    ("--teach", "position NAME teach"),
    ("TS3100_KEY", "TS3100_KEY_SWITCH"),
    ("TS3100_COM1", "TS3100_SERIAL_COM1"),
    ("TS3100_HOST_RFC2217", "TS3100_SERIAL_HOST_RFC2217"),
    ("TS3100_HOST_TCP", "TS3100_SERIAL_HOST_TCP"),
    ("TS3100_HOST_LINE", "TS3100_SERIAL_HOST_LINE"),
    ("TS3100_COM1_LINE", "TS3100_SERIAL_COM1_LINE"),
    // Words of ctl, scenarios and transcripts.
    ("ctl key", "ctl key-switch"),
    ("ctl right", "ctl control-right"),
    ("battery good", "battery ok"),
    ("battery-low on", "battery low"),
    ("battery-low off", "battery ok"),
    ("emergency-stop on", "emergency-stop press"),
    ("emergency-stop off", "emergency-stop release"),
    ("safety-switch on", "safety-switch open"),
    ("safety-switch off", "safety-switch close"),
    ("file delete", "file erase"),
    ("alarm-reset", "alarms reset"),
    ("set-restore", "variable NAME VALUES restore"),
    ("teach-restore", "position NAME teach restore"),
    ("pulse input", "input LINE pulse"),
    ("pulse output", "output LINE pulse"),
    ("force input", "input LINE force"),
    ("force output", "output LINE force"),
    ("release input", "input LINE release"),
    ("release output", "output LINE release"),
    ("fault arm", "faults arm"),
    ("fault disarm", "faults disarm"),
    ("fault clear", "faults clear"),
    ("what = \"alarms-reset\"", "alarms reset"),
    ("until = \"alarms-reset\"", "alarms reset"),
    ("start.key", "start.key-switch"),
    ("start.servo", "start.servo-on"),
    ("! start", "! program start"),
    ("! stop", "! program stop"),
    ("! key", "! key-switch"),
    ("! keys", "! pendant keys"),
    ("! power-cycle", "! power cycle"),
    ("! feed-hold\n", "! feed-hold press"),
    // Status words.
    ("status reset", "status stop (reset)"),
    ("status retry", "status stop (retry)"),
    ("status continue", "status stop (continue)"),
    ("\"status\":\"reset\"", "stop (reset)"),
    ("\"status\":\"retry\"", "stop (retry)"),
    ("\"status\":\"continue\"", "stop (continue)"),
    // Keys and words of JSON.
    ("\"deed\"", "\"action\""),
    ("\"event\":\"panel\"", "\"event\":\"action\""),
    ("\"event\":\"edge\"", "\"event\":\"link\""),
    ("\"bites\"", "\"applies_to\" or \"applied\""),
    ("\"undone\"", "\"action-refused\""),
    ("servo-held-back", "servo-delayed"),
];

/// Files that name old names: a part of the path, and why.
const ALLOWED: [(&str, &str); 4] = [
    ("tests/suites/old_names.rs", "the list"),
    ("tests/suites/words.rs", "a list of words that code avoids"),
    ("tests/suites/prose.rs", "a list of words that pages avoid"),
    ("crates/controller/src/faults.rs", "field names of snapshots"),
];

/// The old names in a text: `LINE: OLD is NEW`.
fn old_names(text: &str) -> Vec<String> {
    let is_word = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || "_-".contains(c));
    let mut found = Vec::new();
    for (old, new) in OLD {
        let ends_in_word = is_word(old.chars().next_back());
        let starts_in_word = is_word(old.chars().next());
        for (at, _) in text.match_indices(old) {
            let (before, after) = (&text[..at], &text[at + old.len()..]);
            // `//! key` is a comment, `! key` a line of a transcript.
            let is_comment = old.starts_with('!') && before.ends_with('/');
            let inside = is_comment
                || (starts_in_word && is_word(before.chars().next_back()))
                || (ends_in_word && is_word(after.chars().next()));
            if !inside {
                let line = before.matches('\n').count() + 1;
                found.push(format!("{line}: `{}` is now `{new}`", old.trim_end()));
            }
        }
    }
    found
}

#[test]
fn an_old_name_is_found_and_a_longer_name_is_not() {
    let found = old_names("a --host x\nctl key teaching\n! stop\n");
    assert_eq!(found.len(), 3, "{found:?}");
    assert!(found[0].starts_with("1: `--host`") && found[2].starts_with("3: `! stop`"));
    assert_eq!(old_names("//! stop\n"), Vec::<String>::new());
    let names = "--serial-host --host-name --key-switch ctl key-switch start.key-switch default armed";
    assert_eq!(old_names(names), Vec::<String>::new());
}

fn sources() -> Vec<PathBuf> {
    let root = super::house::root();
    let mut all = Vec::new();
    for (folder, extensions) in [
        ("crates", &["rs", "html", "js", "json", "toml"][..]),
        ("tests", &["rs", "py"]),
        ("docs", &["md", "json", "toml"]),
        ("clients", &["md", "py", "cs"]),
        ("fixtures/transcripts", &["txt"]),
        ("benches", &["rs", "md"]),
        ("fuzz/fuzz_targets", &["rs"]),
        ("fuzz/src", &["rs"]),
        ("packaging", &["lua", "Dockerfile"]),
    ] {
        for extension in extensions {
            all.extend(super::house::files(&root.join(folder), extension));
        }
    }
    let single = [
        "CHANGELOG.md",
        "README.md",
        "CONTRIBUTING.md",
        "SECURITY.md",
        ".ci/phases.py",
        "packaging/Dockerfile",
    ];
    all.extend(single.map(|file| root.join(file)));
    all
}

#[test]
fn no_source_and_no_page_has_an_old_name() {
    let root = super::house::root();
    let mut found = Vec::new();
    for path in sources() {
        let name = path
            .strip_prefix(&root)
            .unwrap()
            .to_string_lossy()
            .replace('\\', "/");
        if ALLOWED.iter().any(|(part, _)| name == *part) {
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        found.extend(old_names(&text).into_iter().map(|old| format!("{name}:{old}")));
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn no_help_and_no_document_has_an_old_name() {
    let mut texts = Vec::new();
    let commands: [&[&str]; 8] = [
        &["serve"],
        &["exec"],
        &["diff"],
        &["ctl"],
        &["ctl", "positions"],
        &["ctl", "files"],
        &["ctl", "wait"],
        &["ctl", "inputs", "5"],
    ];
    for command in commands {
        let words = [command, &["--help"]].concat();
        texts.push((words.join(" "), stdout(&run(&words))));
    }
    let serve = Serve::start(&[]);
    let url = serve.control.as_deref().unwrap();
    let document = run(&["ctl", "--url", url, "--json", "call", "GET", "/openapi.json"]);
    texts.push(("/openapi.json".to_owned(), stdout(&document)));
    for (place, text) in texts {
        assert!(text.len() > 100, "{place}: {text}");
        let found = old_names(&text);
        assert!(found.is_empty(), "{place}:\n{}", found.join("\n"));
    }
}
