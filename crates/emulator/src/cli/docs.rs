//! `ts3100 docs` and `ts3100 explain`: the documentation, which the program carries.
//!
//! Pages, search and layout are in `ts3100-book`. Here words of the command line become passages, and their form is chosen.

use super::exit::NEGATIVE;
use super::output;
use crate::color;
use crate::log::print_error;
use anyhow::bail;
use clap::Args;
use clap::builder::NonEmptyStringValueParser;
use serde_json::{Value, json};
use std::io::{self, IsTerminal as _, Write};
use terminal_size::{Width, terminal_size_of};
use ts3100_book::{Book, Hit, PLAIN, Page, Passage, Styles, book};

/// Widest lines: longer ones are hard to read.
const WIDEST: u16 = 100;
/// Hits that are shown; the search can be narrowed by another word.
const MAX_HITS: usize = 20;
/// Bold and cyan, each with what ends it alone.
const COLORED: Styles = Styles {
    bold: ["\x1b[1m", "\x1b[22m"],
    code: ["\x1b[36m", "\x1b[39m"],
};

/// Read the documentation: list its pages, print one or a section of it, or search.
///
/// The documentation is part of the program and needs no network. A running emulator serves the same pages at /book/.
///
/// Exit codes: 0 success; 1 no section has the words of --search; 2 there is no such page or section.
#[derive(Debug, Args)]
pub(super) struct DocsArgs {
    /// Page, or section of a page, for example alarms or findings#no-stx; without it the pages are listed
    #[arg(value_name = "TOPIC", conflicts_with_all = ["search", "all"])]
    topic: Option<String>,
    /// List the sections that have all of these words
    #[arg(long, value_name = "WORD", num_args = 1.., conflicts_with = "all", value_parser = NonEmptyStringValueParser::new())]
    search: Vec<String>,
    /// Print every page
    #[arg(long)]
    all: bool,
    /// Print one JSON document, with texts in Markdown
    #[arg(long)]
    json: bool,
}

/// Explain a code or a word: a diagnostic, a finding, an alarm, an option, a command, a statement, a fault, a flag.
///
/// Exit codes: 0 success; 2 nothing explains the code.
#[derive(Debug, Args)]
pub(super) struct ExplainArgs {
    /// Code, for example E0101, left-in-exchange, 2-046, text.end, RN, MOVEJ, no-reply or --port-offset
    #[arg(value_name = "CODE", allow_hyphen_values = true, value_parser = NonEmptyStringValueParser::new())]
    code: String,
    /// Print one JSON document, with texts in Markdown
    #[arg(long)]
    json: bool,
}

/// Prints what was asked for; the exit code.
pub(super) fn run(args: &DocsArgs) -> anyhow::Result<u8> {
    let book = book();
    if !args.search.is_empty() {
        return search(book, &args.search.join(" "), args.json);
    }
    let document = args.topic.as_deref().and_then(|topic| book.document(topic));
    if let Some(document) = document {
        return output::print(format!("{document}\n")).map(|()| 0);
    }
    let passages: Vec<Passage<'_>> = match &args.topic {
        Some(topic) => vec![book.find(topic)?],
        None if args.all => book.pages().iter().map(Page::passage).collect(),
        None if args.json => return print_json(&json!({ "version": 1, "pages": pages_json() })),
        None => return output::print(contents(book)).map(|()| 0),
    };
    print_passages(&passages, false, args.json)
}

/// Prints the explanation of a code; the exit code.
pub(super) fn explain(args: &ExplainArgs) -> anyhow::Result<u8> {
    let book = book();
    let passages = book.explain(&args.code);
    if passages.is_empty() {
        let (code, hint) = (&args.code, book.unknown_code_hint(&args.code));
        bail!("cannot explain `{code}`: the documentation has no such code{hint}");
    }
    print_passages(&passages, true, args.json)
}

fn search(book: &Book, words: &str, json: bool) -> anyhow::Result<u8> {
    let hits = book.search(words);
    if json {
        let hits: Vec<Value> = hits.iter().map(hit_json).collect();
        return print_json(&json!({ "version": 1, "hits": hits }));
    }
    if hits.is_empty() {
        print_error(format_args!("no section has the words `{words}`"));
        return Ok(NEGATIVE);
    }
    let (mut stdout, styles, width) = screen();
    let write = |out: &mut dyn Write| -> io::Result<()> {
        let [bold, plain] = styles.bold;
        for Hit { passage, line } in hits.iter().take(MAX_HITS) {
            let line: String = line.chars().take(width.saturating_sub(4)).collect();
            writeln!(
                out,
                "{bold}{}{plain}  {}\n    {line}",
                passage.topic(),
                passage.title
            )?;
        }
        match hits.len().saturating_sub(MAX_HITS) {
            0 => Ok(()),
            more => writeln!(out, "and {more} more sections"),
        }
    };
    output::written(write(&mut stdout)).map(|()| 0)
}

fn hit_json(hit: &Hit<'_>) -> Value {
    json!({ "topic": hit.passage.topic(), "title": hit.passage.title, "line": hit.line })
}

/// The pages with their topics.
pub(super) fn pages_json() -> Value {
    let pages = book().pages().iter();
    pages
        .map(|page| json!({ "topic": page.path, "title": page.title, "part": page.part }))
        .collect()
}

/// A passage with its Markdown.
pub(super) fn passage_json(passage: &Passage<'_>) -> Value {
    json!({ "topic": passage.topic(), "title": passage.title, "markdown": passage.text })
}

/// The results of a search for a program, the best first.
pub(super) fn search_json(words: &str) -> Value {
    let hits = book().search(words);
    hits.iter().take(MAX_HITS).map(hit_json).collect()
}

fn print_json(document: &Value) -> anyhow::Result<u8> {
    output::print(format!("{document:#}\n")).map(|()| 0)
}

/// Stdout, its styles and its width.
fn screen() -> (anstream::AutoStream<io::StdoutLock<'static>>, Styles, usize) {
    let stdout = io::stdout();
    let wide = terminal_size_of(&stdout).filter(|_| stdout.is_terminal());
    let width = wide.map_or(WIDEST, |(Width(columns), _)| columns.min(WIDEST));
    let (stream, paints) = color::stream(stdout.lock());
    (stream, if paints { COLORED } else { PLAIN }, width.into())
}

/// Prints passages, each after its topic if they come from several places.
fn print_passages(passages: &[Passage<'_>], named: bool, json: bool) -> anyhow::Result<u8> {
    if json {
        let sections: Vec<Value> = passages.iter().map(passage_json).collect();
        return print_json(&json!({ "version": 1, "sections": sections }));
    }
    let (mut stdout, styles, width) = screen();
    let write = |out: &mut dyn Write| -> io::Result<()> {
        for (at, passage) in passages.iter().enumerate() {
            if at > 0 {
                writeln!(out)?;
            }
            if named {
                writeln!(out, "[{}]\n", passage.topic())?;
            }
            out.write_all(passage.terminal(width, &styles).as_bytes())?;
        }
        out.flush()
    };
    output::written(write(&mut stdout)).map(|()| 0)
}

/// The pages by their parts, each with its topic and its title.
fn contents(book: &Book) -> String {
    let mut text = String::new();
    let mut part = "";
    let widest = book.pages().iter().map(|page| page.path.len()).max().unwrap_or(0);
    for page in book.pages() {
        if page.part != part {
            part = &page.part;
            text += &format!("\n{part}\n").replace("\n\n\n", "\n\n");
        }
        let (path, title) = (&page.path, &page.title);
        text += &format!(
            "  {path:widest$}  {:indent$}{title}\n",
            "",
            indent = page.depth * 2
        );
    }
    text + "\nts3100 docs TOPIC prints a page, ts3100 docs --search WORD finds sections, ts3100 explain CODE explains a code.\n"
}

/// The topic about a subcommand: its page, or its section in the reference of the command line.
pub(super) fn topic_of(command: &str) -> String {
    let own = format!("reference/{command}");
    match book().page(&own) {
        Some(page) => page.path.clone(),
        None => format!("reference/command-line#ts3100-{command}"),
    }
}
