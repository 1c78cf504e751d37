//! The documentation in the program: the Markdown of `docs`, by pages, sections and table rows.
//!
//! [`book`] unpacks it at its first use. A *topic* names a page or a section of it: `reference/alarms`, `alarms#levels`. A *code*
//! is what messages name: `E0101`, `left-in-exchange`, `2-046`, `text.end`, `RN`, `MOVEJ`; [`Book::explain`] finds its sections and
//! rows. What they look like on a terminal and in a browser is in `terminal` and `html`. Start with `page`.

mod explain;
mod html;
mod language;
mod page;
mod search;
mod terminal;
mod topic;

pub use html::escaped;
pub use page::Page;
pub use search::Hit;
pub use terminal::{PLAIN, Styles};
pub use topic::UnknownTopic;

use flate2::read::GzDecoder;
use std::io::Read as _;
use std::sync::LazyLock;

/// The pages, compressed by the build script.
const ARCHIVE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/book.gz"));

/// Where the control interface explains codes.
const EXPLAINED: &str = "/book/explain/";

static BOOK: LazyLock<Book> = LazyLock::new(Book::unpacked);

/// The book, unpacked at its first use.
pub fn book() -> &'static Book {
    &BOOK
}

/// The command line that explains a code.
pub fn explain_command(code: &str) -> String {
    format!("ts3100 explain {code}")
}

/// The path that explains a code at the control interface of every emulator.
pub fn explain_path(code: &str) -> String {
    format!("{EXPLAINED}{code}")
}

/// The command line for a path that [`explain_path`] made; `None` for another path.
pub fn command_of_path(path: &str) -> Option<String> {
    let code = path.strip_prefix(EXPLAINED)?;
    Some(explain_command(code))
}

/// The pages in the order of the summary, and the files of JSON that they link.
pub struct Book {
    pages: Vec<Page>,
    /// Paths, as `reference/controls.json`, with their texts.
    documents: Vec<(String, String)>,
}

/// A page, or a part of one.
#[derive(Debug, Clone)]
pub struct Passage<'a> {
    pub page: &'a Page,
    /// Anchor of the section that it is, or is in; `None`: the whole page.
    pub anchor: Option<&'a str>,
    /// Title of the page, or heading of the section.
    pub title: &'a str,
    /// Its Markdown.
    pub text: String,
    /// Its HTML, with the addresses of the build script and without anchors of headings.
    html: String,
    /// Its first section by its position on the page.
    first: usize,
}

impl Passage<'_> {
    /// A table row: each cell below its heading, as Markdown without links. Empty where the passage is a section or a page.
    pub fn cells(&self) -> Vec<(String, String)> {
        let mut lines = self.text.lines().filter(|line| line.starts_with('|'));
        let (Some(head), Some(_), Some(row), None) = (lines.next(), lines.next(), lines.next(), lines.next())
        else {
            return Vec::new();
        };
        let cells = page::cells(row)
            .into_iter()
            .map(|cell| page::without_links(&cell));
        let head = page::cells(head)
            .into_iter()
            .map(|cell| page::without_links(&cell));
        head.zip(cells).collect()
    }

    /// Its Markdown without links, which lead to other pages of the book.
    pub fn without_links(&self) -> String {
        page::without_links(&self.text)
    }

    /// The topic that shows it, or the section that it is in.
    pub fn topic(&self) -> String {
        match self.anchor {
            Some(anchor) => format!("{}#{anchor}", self.page.path),
            None => self.page.path.clone(),
        }
    }
}

impl Book {
    fn unpacked() -> Book {
        let mut archive = String::new();
        // The build script has packed it of strings.
        let _ = GzDecoder::new(ARCHIVE).read_to_string(&mut archive);
        let files = archive.split('\x0c').filter_map(|file| file.split_once('\n'));
        let (documents, files): (Vec<_>, Vec<_>) = files.partition(|(path, _)| path.ends_with(".json"));
        let mut files = files.into_iter();
        let summary = files.next().map_or("", |(_, summary)| summary);
        let entries = page::entries(summary);
        let pages = entries.zip(files).map(|(entry, (_, forms))| {
            let form = |first| forms.split('\x0b').skip(first).step_by(2).collect::<String>();
            Page::new(&entry, &form(0), &form(1))
        });
        Book {
            pages: pages.collect(),
            documents: documents
                .into_iter()
                .map(|(path, text)| (path.to_owned(), text.to_owned()))
                .collect(),
        }
    }

    /// The text of a file of JSON that a page links, for example `reference/controls.json`.
    pub fn document(&self, path: &str) -> Option<&str> {
        let found = self.documents.iter().find(|(known, _)| known == path);
        found.map(|(_, text)| text.as_str())
    }

    /// The pages in the order of the summary.
    pub fn pages(&self) -> &[Page] {
        &self.pages
    }

    /// The page of this path, for example `reference/alarms`.
    pub fn page(&self, path: &str) -> Option<&Page> {
        self.pages.iter().find(|page| page.path == path)
    }
}
