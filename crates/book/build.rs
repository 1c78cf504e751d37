//! Packs the pages of the book into one compressed file: the summary first, then its pages in their order, as Markdown and as HTML.
//!
//! The Markdown is parsed here, because the tables of a parser would make the program larger by more than the HTML does.
//! Each file begins with a line of a form feed and its path; after each of its sections in Markdown follows the same in HTML, which compresses
//! well so; vertical tabs part them. Comments, which only the tests of the pages read, are left out. In a
//! package of this crate the pages are in `pages`, where `packaging/crates.py` puts them; in the repository they are in `docs`.
//!
//! The files of JSON that a page links follow it: they have the same words, so they compress well there.

use flate2::Compression;
use flate2::write::GzEncoder;
use pulldown_cmark::{CowStr, Event, Options, Parser, Tag, TagEnd, html};
use std::error::Error;
use std::fs::{self, File};
use std::io::Write as _;
use std::path::Path;

const SUMMARY: &str = "SUMMARY.md";
/// Ending of the files beside pages that are packed.
const JSON: &str = ".json";

fn main() -> Result<(), Box<dyn Error>> {
    let crate_root = std::env::var("CARGO_MANIFEST_DIR")?;
    let packaged = Path::new(&crate_root).join("pages");
    let folder = match packaged.exists() {
        true => packaged,
        false => Path::new(&crate_root).join("../../docs"),
    };
    let summary = fs::read_to_string(folder.join(SUMMARY))?;
    let linked = summary.split("](").skip(1);
    let names = linked.filter_map(|rest| rest.split(')').next());
    let mut archive = String::new();
    let mut documents = Vec::new();
    for name in std::iter::once(SUMMARY).chain(names) {
        let path = folder.join(name);
        println!("cargo::rerun-if-changed={}", path.display());
        let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let text = without_comments(&text);
        let html = if name == SUMMARY {
            String::new()
        } else {
            html_of(name, &text)
        };
        archive += &format!("\x0c{name}\n");
        let texts = sections(&text, &text_headings(&text));
        let forms = sections(&html, &html_headings(&html));
        if name != SUMMARY && texts.len() != forms.len() {
            return Err(format!("{name}: {} sections, {} in HTML", texts.len(), forms.len()).into());
        }
        let mut forms = forms.into_iter();
        for text in texts {
            archive += &format!("{text}\x0b{}\x0b", forms.next().unwrap_or_default());
        }
        for document in linked_documents(name, &text) {
            if documents.contains(&document) {
                continue;
            }
            let path = folder.join(&document);
            println!("cargo::rerun-if-changed={}", path.display());
            let json = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
            // A string of JSON has no line end, so the blanks before and after a line are none of its text.
            let json: String = json.lines().map(str::trim).collect();
            archive += &format!("\x0c{document}\n{json}");
            documents.push(document);
        }
    }
    let output = Path::new(&std::env::var("OUT_DIR")?).join("book.gz");
    let mut encoder = GzEncoder::new(File::create(output)?, Compression::best());
    encoder.write_all(archive.as_bytes())?;
    encoder.finish()?;
    Ok(())
}

/// Where headings begin in Markdown.
fn text_headings(text: &str) -> Vec<usize> {
    let (mut in_block, mut at) = (false, 0);
    let mut found = Vec::new();
    for line in text.split_inclusive('\n') {
        in_block ^= line.trim_start().starts_with("```");
        if !in_block && line.starts_with('#') {
            found.push(at);
        }
        at += line.len();
    }
    found
}

/// Where headings begin in HTML.
fn html_headings(html: &str) -> Vec<usize> {
    let is_heading = |at: &usize| html.as_bytes().get(at + 2).is_some_and(u8::is_ascii_digit);
    let found = html.match_indices("<h").map(|(at, _)| at);
    found.filter(is_heading).collect()
}

/// The parts of a string: before the first of these places, and from each to the next.
fn sections<'a>(text: &'a str, places: &[usize]) -> Vec<&'a str> {
    let ends = places.iter().copied().chain([text.len()]);
    let begins = std::iter::once(0).chain(places.iter().copied());
    begins
        .zip(ends)
        .filter_map(|(begin, end)| text.get(begin..end))
        .collect()
}

/// The page as HTML. A link to a page of the book has the address `book:PATH#ANCHOR`; one to another file of the repository is
/// left out, and of a picture its text remains.
fn html_of(name: &str, text: &str) -> String {
    let mut is_link = Vec::new();
    let events = Parser::new_ext(text, Options::ENABLE_TABLES).filter_map(|event| match event {
        Event::Start(Tag::Link {
            link_type,
            dest_url,
            title,
            id,
        }) => {
            let address = address(name, &dest_url);
            is_link.push(address.is_some());
            let dest_url = CowStr::from(address?);
            Some(Event::Start(Tag::Link {
                link_type,
                dest_url,
                title,
                id,
            }))
        }
        // The program carries no pictures: what one shows is said by its text.
        Event::Start(Tag::Image { .. }) | Event::End(TagEnd::Image) => None,
        Event::End(TagEnd::Link) => is_link.pop().unwrap_or(false).then_some(event),
        event => Some(event),
    });
    let mut text = String::new();
    html::push_html(&mut text, events);
    text
}

/// Paths of the files of JSON that a page links.
fn linked_documents(page: &str, text: &str) -> Vec<String> {
    let links = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let links = links.filter(|link| link.ends_with(JSON) && !link.contains("://"));
    links.map(|link| path_of(page, link)).collect()
}

/// Where a link on a page leads.
fn address(page: &str, link: &str) -> Option<String> {
    if link.contains("://") {
        return Some(link.to_owned());
    }
    let (path, anchor) = link.split_at(link.find('#').unwrap_or(link.len()));
    if path.is_empty() {
        return Some(format!("book:{}{anchor}", page.strip_suffix(".md")?));
    }
    let path = path_of(page, path);
    if path.ends_with(JSON) {
        return Some(format!("book:{path}"));
    }
    Some(format!("book:{}{anchor}", path.strip_suffix(".md")?))
}

/// The path below `docs` that a path on a page means.
fn path_of(page: &str, path: &str) -> String {
    let mut parts: Vec<&str> = page.split('/').collect();
    parts.pop();
    for part in path.split('/') {
        match part {
            ".." => drop(parts.pop()),
            "." => {}
            part => parts.push(part),
        }
    }
    parts.join("/")
}

/// The page without the lines outside of code blocks that are comments.
fn without_comments(page: &str) -> String {
    let mut in_block = false;
    let kept = page.lines().filter(|line| {
        in_block ^= line.trim_start().starts_with("```");
        in_block || !(line.starts_with("<!--") && line.ends_with("-->"))
    });
    kept.map(|line| format!("{line}\n")).collect()
}
