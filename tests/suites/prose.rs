//! Words that this project does not use where users read: the pages, the help texts, and every string and doc comment of
//! the product and its clients.
//!
//! The list is short and each entry names the usual word. Grammar and spelling are checked by `tests/system/docs/book.py`.

use super::pieces::{LANGUAGES, Language, Pieces};
use clap::Command;
use std::fs;
use std::path::Path;
use ts3100_controller::alarm::ALARMS;
use ts3100_controller::faults::KINDS;
use ts3100_controller::findings::RULES;
use ts3100_controller::variation::VARIATIONS;
use ts3100_emulator::cli;
use ts3100_proto::command::COMMANDS;

/// What is not written, and what is written instead. A word ends where letters end.
const AVOIDED: &[(&str, &str)] = &[
    ("if not said", "by default"),
    ("if nothing is said", "by default"),
    ("in place of", "instead of"),
    ("in the place of", "instead of"),
    ("behind", "after"),
    ("bites", "fires, triggers"),
    ("barks", "raises the alarm"),
    ("deed", "action"),
    ("wish", "request"),
    ("befell", "happened to"),
    ("stand", "is, appears"),
    ("stands", "is, appears"),
    ("nobody", "no client, no one is connected"),
    ("one who", "a host that"),
    ("had better not", "a mistake"),
    ("lives with it", "is robust"),
    ("bring about", "cause, trigger"),
    ("brings about", "causes, triggers"),
    ("brought about", "caused, triggered"),
    ("is no", "is not a"),
    ("are no", "are not"),
    ("was no", "was not a"),
    ("has become of", "the outcome of"),
    ("what becomes of", "what happens to"),
    ("comes of", "follows from"),
    ("come of", "follow from"),
    ("in the hand of", "from"),
    ("so much later", "later, by how much"),
    ("anew", "again"),
    ("aforesaid", "this"),
    ("the wall's", "the system clock's"),
    ("the wall", "wall-clock time"),
    ("means nothing to", "is unknown to"),
    ("is to be looked at", "look at it, have it inspected"),
    ("put back", "restored"),
    ("goes on", "continues"),
    ("go on", "continue"),
    ("going on", "continuing"),
    ("went on", "continued"),
    ("for so many", "a number of"),
    ("after so many", "a number of"),
    ("of so many", "a number of"),
    ("leans on", "relies on"),
    ("rests on", "relies on"),
    ("begins no", "is not a"),
    ("heard", "received"),
];

/// Where an avoided word is the usual one.
const USUAL: &[&str] = &[
    "nobody is connected",
    "stand still",
    "stands still",
    "there is no",
    "there are no",
    "there was no",
    "is no longer",
    "are no longer",
    "was no longer",
    "the wall clock",
    "the wall-clock",
    // Digital lines and power are switched.
    "goes on or off",
    "go on or off",
    // A parameter and a field of `/clock` have these names.
    "`stands_still`",
    "heard = ",
    "{heard}",
    "(`behind` of /clock)",
];

/// Questions and answers of the survey are written into its files, so their words stay.
const FILE_FORMAT: &str = "crates/survey/src/catalogue/";

/// The avoided words of a text, in lower case.
fn avoided(text: &str) -> Vec<String> {
    let text = text.split_whitespace().filter(|word| !DOC_MARKS.contains(word));
    let text = text.collect::<Vec<_>>().join(" ").to_lowercase();
    let text = USUAL.iter().fold(text, |text, usual| text.replace(usual, ""));
    let is_letter = |c: Option<char>| c.is_some_and(char::is_alphanumeric);
    let found = AVOIDED.iter().filter(|(words, _)| {
        text.match_indices(words).any(|(at, _)| {
            let (before, after) = (&text[..at], &text[at + words.len()..]);
            !is_letter(before.chars().next_back()) && !is_letter(after.chars().next())
        })
    });
    found
        .map(|(words, usual)| format!("`{words}`: write {usual}"))
        .collect()
}

fn assert_clean(texts: impl IntoIterator<Item = (String, String)>) {
    let mut wrong = Vec::new();
    let texts = texts.into_iter();
    for (place, text) in texts.filter(|(place, _)| !place.starts_with(FILE_FORMAT)) {
        wrong.extend(
            avoided(&text)
                .iter()
                .map(|why| format!("{place}: {why}\n    {}", text.trim())),
        );
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The lines of a page that are prose: without blocks of code, without code in them, and without generated regions, whose
/// texts are read where they come from.
fn prose(page: &str) -> Vec<(usize, String)> {
    let (mut in_block, mut is_generated) = (false, false);
    let mut lines = Vec::new();
    for (number, line) in page.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            in_block = !in_block;
        } else if line.starts_with("<!-- generated: ") || line == "<!-- end -->" {
            is_generated = line != "<!-- end -->";
        } else if !in_block && !is_generated {
            lines.push((
                number + 1,
                line.split('`').step_by(2).collect::<Vec<_>>().join("`"),
            ));
        }
    }
    lines
}

#[test]
fn the_pages_use_the_usual_words() {
    let root = super::house::root();
    let mut pages = super::house::files(&root.join("docs"), "md");
    pages.extend(["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"].map(|page| root.join(page)));
    assert_clean(pages.iter().flat_map(|path| {
        let page = fs::read_to_string(path).unwrap();
        let name = path.strip_prefix(&root).unwrap().display().to_string();
        prose(&page)
            .into_iter()
            .map(move |(line, text)| (format!("{name}:{line}"), text))
    }));
}

#[test]
fn the_help_uses_the_usual_words() {
    fn collect(path: &str, command: &Command, texts: &mut Vec<(String, String)>) {
        let path = format!("{path} {}", command.get_name());
        let mut add = |text: Option<String>| texts.extend(text.map(|text| (path.clone(), text)));
        add(command
            .get_long_about()
            .or(command.get_about())
            .map(ToString::to_string));
        add(command.get_after_help().map(ToString::to_string));
        add(command.get_after_long_help().map(ToString::to_string));
        for argument in command.get_arguments() {
            let help = argument.get_long_help().or(argument.get_help());
            add(help.map(ToString::to_string));
        }
        for inner in command.get_subcommands() {
            collect(&path, inner, texts);
        }
    }
    let mut texts = Vec::new();
    collect("", &cli::definition(), &mut texts);
    assert!(texts.len() > 100, "the help was not found");
    assert_clean(texts);
}

#[test]
fn the_tables_of_the_code_use_the_usual_words() {
    let mut texts: Vec<(&str, &str)> = Vec::new();
    for rule in RULES {
        texts.extend([(rule.id, rule.title), (rule.id, rule.remedy)]);
    }
    for alarm in ALARMS {
        texts.extend([(alarm.text, alarm.cause), (alarm.text, alarm.remedy)]);
    }
    for kind in KINDS {
        texts.extend([(kind.name, kind.summary), (kind.name, kind.remedy)]);
        texts.extend(
            kind.parameters
                .iter()
                .map(|parameter| (kind.name, parameter.description)),
        );
        texts.extend(kind.points.iter().map(|point| (kind.name, point.description())));
    }
    for rule in VARIATIONS {
        texts.extend([(rule.name, rule.summary), (rule.name, rule.source)]);
    }
    texts.extend(COMMANDS.iter().map(|row| (row.letters, row.help)));
    texts.extend(scol_mini::DIAGNOSTICS.iter().map(|kind| (kind.code, kind.title)));
    assert_clean(
        texts
            .into_iter()
            .map(|(place, text)| (place.to_owned(), text.to_owned())),
    );
}

/// What a doc comment begins with.
const DOC_MARKS: [&str; 3] = ["///", "//!", "/**"];

/// What users read in a source: its strings and doc comments, or the prose of a page.
///
/// A string with a space is a sentence; one word alone is a name or a code.
fn texts_of(path: &Path, source: &str) -> Vec<(usize, String)> {
    let Some(language) = Language::of(path) else {
        return prose(source);
    };
    let Pieces {
        comments, strings, ..
    } = language.pieces(super::house::product(source));
    let sentences = strings.into_iter().filter(|(_, text)| text.contains(' '));
    let mut texts: Vec<_> = sentences.map(|(line, text)| (line, text.to_owned())).collect();
    // The lines of one comment are one text: a phrase is found across their ends.
    let mut next = 0;
    for (line, text) in comments {
        if !DOC_MARKS.iter().any(|mark| text.starts_with(mark)) {
            continue;
        }
        match texts.last_mut() {
            Some((_, whole)) if line == next => *whole = format!("{whole} {text}"),
            _ => texts.push((line, text.to_owned())),
        }
        next = line + 1;
    }
    texts
}

#[test]
fn the_strings_and_docs_of_the_code_use_the_usual_words() {
    let root = super::house::root();
    let mut texts = Vec::new();
    for extension in LANGUAGES
        .map(|(extension, _)| extension)
        .into_iter()
        .chain(["html"])
    {
        let folders = ["crates", "clients", "packaging"].map(|folder| root.join(folder));
        let sources = folders
            .iter()
            .flat_map(|folder| super::house::files(folder, extension))
            .filter(|path| !super::house::is_test(path));
        let before = texts.len();
        for path in sources {
            let source = fs::read_to_string(&path).unwrap();
            let name = path.strip_prefix(&root).unwrap().display().to_string();
            let found = texts_of(&path, &source).into_iter();
            texts.extend(found.map(|(line, text)| (format!("{name}:{line}"), text)));
        }
        assert!(texts.len() > before, "no text of .{extension} was found");
    }
    assert!(texts.len() > 10_000, "{} texts", texts.len());
    assert_clean(texts);
}

#[test]
fn an_avoided_word_is_found_whole() {
    assert_eq!(avoided("Send it Behind the comma.").len(), 1);
    assert!(avoided("anewton").is_empty());
    assert!(
        prose("a\n```\nbehind\n```\n`behind` b")
            .iter()
            .all(|(_, text)| avoided(text).is_empty())
    );
}
