//! The vocabulary of the code: words that names and comments of `crates/*/src` and `tests` do not use, because they are
//! metaphors of the first build that a reader from the field does not know.
//!
//! Identifiers are split at underscores and capitals. Strings and doc comments are read by `prose.rs`, as the pages are.
//! Other house rules are in `house.rs`.

use super::pieces::{Piece, Pieces, RUST};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Words in no identifier and no comment, and what to write instead.
const WORDS: [(&[&str], &str); 21] = [
    (&["deed", "deeds"], "action"),
    (&["prey", "bite", "bites", "bitten"], "fault site, apply, applied"),
    (&["strike", "strikes"], "scheduled action"),
    (&["dice"], "rng"),
    (&["parcel", "parcels"], "segment"),
    (&["outbox"], "send queue"),
    (&["deaf"], "stalled"),
    (&["habits"], "host history"),
    (&["vary"], "variation"),
    (&["whereabouts"], "arm pose"),
    (&["guidance"], "jog"),
    (&["trio"], "frames"),
    (&["paper", "papers"], "snapshot, JSON"),
    (&["hub"], "driver"),
    (&["desk", "shelf"], "snapshot handle, snapshot store"),
    (&["tape"], "transcript sink"),
    (&["happening", "happenings"], "event"),
    (&["party", "parties"], "side"),
    (&["evidence"], "reports"),
    (&["stir", "attend"], "note activity, update idle"),
    (&["sprint", "swift", "crawl", "stride"], "vm, single step, next"),
];

/// Phrases in no comment, and what to write instead.
const PHRASES: [(&str, &str); 4] = [
    ("the wall", "wall-clock time"),
    ("nobody is there", "nobody is connected"),
    ("in the place of", "instead of"),
    ("if not said", "by default"),
];

/// Where a word is right all the same: a part of the path, the word (all with ""), the reason.
const ALLOWED: &[(&str, &str, &str)] = &[
    ("tests/suites/words.rs", "", "the list itself"),
    ("tests/suites/measured_times.rs", "hub", "GitHub"),
    ("tests/suites/", "vary", "the field of the option `--vary`"),
    ("controller/src/options.rs", "vary", "the same"),
    ("controller/src/endpoint.rs", "vary", "the same"),
    ("controller/src/snapshot", "vary", "the same"),
    ("emulator/src/", "vary", "the option `--vary`"),
    ("simulation/src/plan.rs", "vary", "the same"),
    ("emulator/src/embed.rs", "evidence", "a name of the embedding API"),
    (
        "tests/suites/embedded/api.rs",
        "evidence",
        "calls the embedding API",
    ),
    ("emulator/src/cli/", "evidence", "calls the embedding API"),
    ("tests/src/reference", "evidence", "a column of fidelity.md"),
    (
        "tests/suites/survey/",
        "evidence",
        "calls `ts3100_survey::passive`",
    ),
    (
        "survey/src/",
        "evidence",
        "the column of docs/explanation/fidelity.md",
    ),
    (
        "recording/src/reports/findings.rs",
        "evidence",
        "the column of docs/explanation/fidelity.md",
    ),
    ("control/src/transcript.rs", "evidence", "the page EVIDENCE.md"),
    (
        "control/src/event.rs",
        "happening",
        "published in the OpenAPI document",
    ),
    (
        "control/src/state.rs",
        "guidance",
        "published in the OpenAPI document",
    ),
    ("control/src/", "the wall", "published in the OpenAPI document"),
    ("control/src/", "if not said", "published in the OpenAPI document"),
    ("emulator/src/cli/", "if not said", "printed by --help"),
    ("emulator/src/cli/", "the wall", "printed by --help"),
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The words of an identifier in lower case: `SendQueue`, `send_queue` and `SEND_QUEUE` are `send` and `queue`.
fn words(text: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before = ' ';
    for character in text.chars() {
        if character.is_uppercase() && before.is_lowercase() || !character.is_ascii_alphabetic() {
            words.push(String::new());
        }
        if character.is_ascii_alphabetic() {
            let word = words.last_mut();
            word.expect("never empty").push(character.to_ascii_lowercase());
        }
        before = character;
    }
    words.retain(|word| !word.is_empty());
    words
}

#[test]
fn words_are_found_in_identifiers_and_comments_but_not_in_strings() {
    let source =
        "//! a trio\nfn hub() -> '\\'' { r#\"desk\"#; \"a \\\" tape\" }\nOutboxDice // in \"deaf\"\n";
    let Pieces {
        code,
        comments,
        strings,
    } = RUST.pieces(source);
    let found = |pieces: Vec<Piece>| -> Vec<(usize, &str)> {
        let all = WORDS.iter().flat_map(|(words, _)| *words);
        let in_piece = |piece: &str, word: &&&str| words(piece).iter().any(|found| found == **word);
        let hits = pieces.into_iter().flat_map(|(line, piece)| {
            all.clone()
                .filter(move |word| in_piece(piece, word))
                .map(move |word| (line, *word))
        });
        hits.collect()
    };
    assert_eq!(found(code), [(2, "hub"), (3, "dice"), (3, "outbox")]);
    assert_eq!(found(comments), [(1, "trio"), (3, "deaf")]);
    assert_eq!(strings, [(2, "\"desk\"#"), (2, "\"a \\\" tape\"")]);
}

/// The lines of one source that use a word or phrase they should not.
fn offenders(path: &Path, source: &str, found: &mut String) {
    let name = path.to_string_lossy().replace('\\', "/");
    let allowed = |word: &str| {
        let mut rows = ALLOWED.iter();
        rows.any(|(place, allowed, _)| name.contains(place) && (allowed.is_empty() || *allowed == word))
    };
    let Pieces { code, comments, .. } = RUST.pieces(source);
    for (line, piece) in code.iter().chain(&comments) {
        for word in words(piece) {
            let row = WORDS.iter().find(|(words, _)| words.contains(&word.as_str()));
            if let Some((_, instead)) = row.filter(|_| !allowed(&word)) {
                let _ = writeln!(found, "{name}:{line}: `{word}` (write {instead})");
            }
        }
    }
    for (line, comment) in comments {
        for (phrase, instead) in PHRASES.iter().filter(|(phrase, _)| !allowed(phrase)) {
            let text = comment.to_ascii_lowercase();
            let ends = |at: usize| text[at + phrase.len()..].chars().next();
            let hit = text
                .match_indices(phrase)
                .any(|(at, _)| ends(at).is_none_or(|next| !next.is_alphanumeric() && next != '-'));
            if hit && !text.contains("the wall clock") {
                let _ = writeln!(found, "{name}:{line}: `{phrase}` (write {instead})");
            }
        }
    }
}

#[test]
fn names_and_comments_use_the_words_of_the_field() {
    let mut found = String::new();
    let crates = super::house::files(&root().join("crates"), "rs");
    let in_src = |path: &PathBuf| path.components().any(|part| part.as_os_str() == "src");
    let tests = super::house::files(&root().join("tests"), "rs");
    for path in crates.into_iter().filter(in_src).chain(tests) {
        offenders(&path, &std::fs::read_to_string(&path).unwrap(), &mut found);
    }
    assert!(found.is_empty(), "{} lines:\n{found}", found.lines().count());
}
