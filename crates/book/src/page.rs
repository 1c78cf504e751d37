//! A page with its outline: sections, anchors and table rows, found by lines.
//!
//! Anchors are those that mdBook makes, so a link holds in the published book, in the repository and here.

use crate::Passage;
use std::ops::Range;

/// A line of the summary: a page with its place.
pub(crate) struct Entry<'a> {
    path: &'a str,
    title: &'a str,
    part: &'a str,
    depth: usize,
}

/// The pages of the summary, in its order.
pub(crate) fn entries(summary: &str) -> impl Iterator<Item = Entry<'_>> {
    let mut part = "";
    summary.lines().filter_map(move |line| {
        if let Some(heading) = line.strip_prefix("# ") {
            part = if heading == "Summary" { "" } else { heading };
        } else if line == "---" {
            part = "";
        }
        let (before, rest) = line.split_once('[')?;
        let (title, rest) = rest.split_once("](")?;
        Some(Entry {
            path: rest.strip_suffix(".md)")?,
            title,
            part,
            depth: before.find('-').unwrap_or(0) / 2,
        })
    })
}

/// A page of the book.
#[derive(Debug)]
pub struct Page {
    /// Path without an ending, for example `reference/alarms`.
    pub path: String,
    /// Title in the summary.
    pub title: String,
    /// Part of the summary, for example `Reference`; empty outside of its parts.
    pub part: String,
    /// Pages above it in its part.
    pub depth: usize,
    /// The Markdown.
    pub text: String,
    html: String,
    pub(crate) sections: Vec<Section>,
    pub(crate) rows: Vec<Row>,
}

/// A heading with what follows it.
#[derive(Debug)]
pub(crate) struct Section {
    pub(crate) anchor: String,
    pub(crate) heading: String,
    level: usize,
    /// Anchors that the page gives it in HTML.
    ids: Vec<String>,
    /// The section with its subsections.
    pub(crate) whole: Range<usize>,
    /// Up to the next heading of any level.
    pub(crate) own: Range<usize>,
}

impl Section {
    /// Whether one of its anchors is this.
    pub(crate) fn has_anchor(&self, anchor: &str) -> bool {
        self.names().any(|name| name == anchor)
    }

    /// Its anchors.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        std::iter::once(&self.anchor).chain(&self.ids).map(String::as_str)
    }
}

/// A row of a table.
#[derive(Debug)]
pub(crate) struct Row {
    /// Position of its section among those of the page.
    pub(crate) section: Option<usize>,
    /// Anchors that it has in HTML.
    pub(crate) ids: Vec<String>,
    /// Position among the rows of the page.
    number: usize,
    /// The heading of the table with its ruler.
    head: Range<usize>,
    line: Range<usize>,
}

impl Page {
    pub(crate) fn new(entry: &Entry<'_>, text: &str, html: &str) -> Page {
        let mut page = Page {
            path: entry.path.to_owned(),
            title: entry.title.to_owned(),
            part: entry.part.to_owned(),
            depth: entry.depth,
            text: text.to_owned(),
            html: html.to_owned(),
            sections: Vec::new(),
            rows: Vec::new(),
        };
        page.outline();
        page
    }

    fn outline(&mut self) {
        let text = std::mem::take(&mut self.text);
        let mut in_block = false;
        // Anchors that wait for their heading, and where they begin.
        let mut ids: Vec<String> = Vec::new();
        let mut first_id = None;
        let mut head: Option<Range<usize>> = None;
        let mut last_row: Option<Range<usize>> = None;
        let mut at = 0;
        for whole_line in text.split_inclusive('\n') {
            let range = at..at + whole_line.len();
            at = range.end;
            let line = whole_line.trim_end();
            in_block ^= line.trim_start().starts_with("```");
            if in_block {
                continue;
            }
            if !line.starts_with('|') {
                (head, last_row) = (None, None);
            }
            if line.starts_with("<a id=") && line.ends_with("</a>") {
                first_id.get_or_insert(range.start);
                ids.extend(anchors(line));
            } else if let Some((level, heading)) = heading(line) {
                let begin = first_id.take().unwrap_or(range.start);
                self.close(level, begin);
                let anchor = self.free_anchor(&heading);
                self.sections.push(Section {
                    anchor,
                    heading,
                    level,
                    ids: std::mem::take(&mut ids),
                    whole: range.start..text.len(),
                    own: range.start..text.len(),
                });
            } else if line.starts_with('|') {
                match (&head, last_row.take()) {
                    (None, Some(first)) if is_ruler(line) => head = Some(first.start..range.end),
                    (Some(head), _) => self.rows.push(Row {
                        section: self.sections.len().checked_sub(1),
                        ids: anchors(line).collect(),
                        number: self.rows.len(),
                        head: head.clone(),
                        line: range.clone(),
                    }),
                    (None, _) => last_row = Some(range),
                }
            } else if !line.is_empty() {
                (ids, first_id) = (Vec::new(), None);
            }
        }
        self.text = text;
    }

    /// Ends the sections that a heading of this level at this place ends.
    fn close(&mut self, level: usize, at: usize) {
        if let Some(last) = self.sections.last_mut() {
            last.own.end = at;
        }
        // Those that have ended before end before this place.
        for section in self.sections.iter_mut().filter(|section| section.level >= level) {
            section.whole.end = section.whole.end.min(at);
        }
    }

    /// The heading's anchor, with a number if another section has it.
    fn free_anchor(&self, heading: &str) -> String {
        let anchor = anchor_of(heading);
        let taken = |name: &str| self.sections.iter().any(|section| section.anchor == name);
        if !taken(&anchor) {
            return anchor;
        }
        let mut numbered = (1..).map(|number| format!("{anchor}-{number}"));
        numbered.find(|name| !taken(name)).unwrap_or(anchor)
    }

    /// The whole page.
    pub fn passage(&self) -> Passage<'_> {
        Passage {
            page: self,
            anchor: None,
            title: &self.title,
            text: self.text.clone(),
            html: self.html.clone(),
            first: 0,
        }
    }

    /// The section or the table row of this anchor.
    pub fn at(&self, anchor: &str) -> Option<Passage<'_>> {
        let section = self.sections.iter().find(|section| section.has_anchor(anchor));
        let row = || self.rows.iter().find(|row| row.ids.iter().any(|id| id == anchor));
        section
            .map(|section| self.section(section))
            .or_else(|| row().map(|row| self.row(row)))
    }

    /// Every anchor of the page, with those of its table rows.
    pub fn anchors(&self) -> impl Iterator<Item = &str> {
        let rows = self.rows.iter().flat_map(|row| &row.ids);
        self.sections
            .iter()
            .flat_map(Section::names)
            .chain(rows.map(String::as_str))
    }

    pub(crate) fn section<'a>(&'a self, section: &'a Section) -> Passage<'a> {
        Passage {
            page: self,
            anchor: Some(&section.anchor),
            title: &section.heading,
            text: self.slice(&section.whole).trim_end().to_owned() + "\n",
            html: self.html_of(section).to_owned(),
            first: self.place(section),
        }
    }

    /// Position of a section on the page.
    fn place(&self, section: &Section) -> usize {
        let before = |other: &&Section| other.whole.start < section.whole.start;
        self.sections.iter().filter(before).count()
    }

    /// The HTML from the heading of a section to the next heading that ends it.
    fn html_of(&self, section: &Section) -> &str {
        let first = self.place(section);
        let ends = |other: &Section| other.level <= section.level;
        let after = self.sections.iter().skip(first + 1).position(ends);
        let headings: Vec<usize> = headings(&self.html).collect();
        let begin = headings.get(first).copied().unwrap_or(0);
        let end = after.and_then(|after| headings.get(first + 1 + after)).copied();
        self.html
            .get(begin..end.unwrap_or(self.html.len()))
            .unwrap_or_default()
    }

    /// A table of a row alone.
    fn html_of_row(&self, row: &Row) -> String {
        const BODY: &str = "<tbody>";
        let mut tables = self.html.split("<table>").skip(1);
        let mut left = row.number;
        let found = tables.find_map(|table| {
            let (head, body) = table.split_once(BODY)?;
            let rows: Vec<&str> = body.split("</tbody>").next()?.split("<tr>").skip(1).collect();
            let row = rows
                .get(left)
                .map(|row| format!("<table>{head}{BODY}\n<tr>{row}</tbody></table>\n"));
            if row.is_none() {
                left -= rows.len();
            }
            row
        });
        found.unwrap_or_default()
    }

    /// The row as a table of its own.
    pub(crate) fn row(&self, row: &Row) -> Passage<'_> {
        let section = row.section.and_then(|at| self.sections.get(at));
        Passage {
            page: self,
            anchor: section.map(|section| section.anchor.as_str()),
            title: section.map_or(&self.title, |section| &section.heading),
            text: format!("{}{}", self.slice(&row.head), self.slice(&row.line)),
            html: self.html_of_row(row),
            first: self.sections.len(),
        }
    }

    pub(crate) fn line(&self, row: &Row) -> &str {
        self.slice(&row.line).trim_end()
    }

    pub(crate) fn slice(&self, range: &Range<usize>) -> &str {
        self.text.get(range.clone()).unwrap_or_default()
    }
}

/// Where headings begin in HTML.
pub(crate) fn headings(html: &str) -> impl Iterator<Item = usize> {
    let is_heading = |at: &usize| html.as_bytes().get(at + 2).is_some_and(u8::is_ascii_digit);
    let found = html.match_indices("<h").map(|(at, _)| at);
    found.filter(is_heading)
}

/// Level and words of a line that is a heading.
fn heading(line: &str) -> Option<(usize, String)> {
    let words = line.trim_start_matches('#');
    let level = line.len() - words.len();
    let words = words.strip_prefix(' ').filter(|_| (1..=6).contains(&level))?;
    Some((level, plain(words.trim())))
}

/// Markdown with the words of its links and without anchors.
pub(crate) fn without_links(markdown: &str) -> String {
    let mut text = String::new();
    let mut rest = markdown;
    while let Some(at) = rest.find(['[', '<']) {
        let (before, marked) = rest.split_at(at);
        text += before;
        let link = marked.strip_prefix('[').and_then(|inner| inner.split_once("]("));
        let link = link.and_then(|(words, target)| Some((words, target.split_once(')')?.1)));
        let anchor = marked
            .strip_prefix("<a id=")
            .and_then(|inner| inner.split_once("</a>"));
        rest = if let Some((words, after)) = link.filter(|(words, _)| is_link(words)) {
            text += words;
            after
        } else if let Some((_, after)) = anchor {
            after
        } else {
            text.extend(marked.chars().next());
            marked.get(1..).unwrap_or_default()
        };
    }
    text + rest
}

/// Whether what is before `](` is the words of a link: each bracket in it opens and closes.
fn is_link(words: &str) -> bool {
    let open = words.chars().try_fold(0_usize, |open, letter| match letter {
        '[' => Some(open + 1),
        ']' => open.checked_sub(1),
        '\n' => None,
        _ => Some(open),
    });
    open == Some(0)
}

/// Markdown without marks: a link is its words, code is what it holds.
pub(crate) fn plain(markdown: &str) -> String {
    let mut text = String::new();
    let mut rest = markdown;
    while let Some(at) = rest.find(['`', '*', '[', '<']) {
        let (before, marked) = rest.split_at(at);
        text += before;
        let link = marked.strip_prefix('[').and_then(|inner| inner.split_once("]("));
        let link = link.and_then(|(words, target)| Some((words, target.split_once(')')?.1)));
        let tag = marked.starts_with("<a ") || marked.starts_with("</a");
        rest = if let Some((words, after)) = link {
            text += &plain(words);
            after
        } else if let Some((_, after)) = marked.split_once('>').filter(|_| tag) {
            after
        } else {
            let mark = marked.chars().next().filter(|mark| ['[', '<'].contains(mark));
            text.extend(mark);
            marked.get(1..).unwrap_or_default()
        };
    }
    (text + rest).replace("\\|", "|")
}

/// The anchor that mdBook gives a heading.
fn anchor_of(heading: &str) -> String {
    let letters = heading.trim().chars().filter_map(|letter| match letter {
        letter if letter.is_alphanumeric() || ['_', '-'].contains(&letter) => {
            Some(letter.to_ascii_lowercase())
        }
        letter if letter.is_whitespace() => Some('-'),
        _ => None,
    });
    letters.collect()
}

/// The anchors in a line of HTML or of a table.
fn anchors(line: &str) -> impl Iterator<Item = String> {
    let found = line.split("<a id=\"").skip(1);
    found.filter_map(|rest| Some(rest.split_once('"')?.0.to_owned()))
}

/// Whether a line parts the heading of a table from its rows.
fn is_ruler(line: &str) -> bool {
    line.chars().all(|letter| "|-: ".contains(letter))
}

/// The cells of a table row.
pub(crate) fn cells(line: &str) -> Vec<String> {
    const ESCAPED: &str = "\x01";
    let line = line.replace("\\|", ESCAPED);
    let inner = line.trim().trim_start_matches('|').trim_end_matches('|');
    let cells = inner.split('|');
    cells.map(|cell| cell.trim().replace(ESCAPED, "|")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# Title\n\nText.\n\n<a id=\"x.y\"></a>\n\n## x.y\n\nOne.\n\n```\n# no heading\n```\n\n### Inner `code`\n\n\
        | A | B |\n|---|---|\n| <a id=\"row\"></a>`a \\| b` | 1 |\n| `c` | 2 |\n\n## Inner code\n\nTwo.\n";

    fn page() -> Page {
        let entry = entries("# Summary\n\n# Part\n\n- [P](a/b.md)\n").next().unwrap();
        Page::new(&entry, TEXT, "")
    }

    #[test]
    fn a_section_ends_before_the_next_of_its_level_and_has_its_subsections() {
        let page = page();
        assert_eq!((page.path.as_str(), page.part.as_str()), ("a/b", "Part"));
        let found = page.at("x.y").unwrap();
        assert!(
            found.text.starts_with("## x.y\n") && found.text.ends_with("| `c` | 2 |\n"),
            "{}",
            found.text
        );
        assert_eq!(page.at("xy").unwrap().text, found.text);
        let names: Vec<&str> = page.anchors().collect();
        assert_eq!(names, ["title", "xy", "x.y", "inner-code", "inner-code-1", "row"]);
        assert!(!page.slice(&page.sections[0].own).contains("<a id"));
    }

    #[test]
    fn a_row_is_a_table_of_its_own() {
        let page = page();
        assert_eq!(
            page.at("row").unwrap().text,
            "| A | B |\n|---|---|\n| <a id=\"row\"></a>`a \\| b` | 1 |\n"
        );
        assert_eq!(cells("| `a \\| b` | 1 |"), ["`a | b`", "1"]);
    }

    #[test]
    fn a_link_is_its_words() {
        assert_eq!(
            without_links("<a id=\"x\"></a>[`[U25]`](../p.md#u) of `A[1]`, a < b, see [Motion](m.md)."),
            "`[U25]` of `A[1]`, a < b, see Motion."
        );
    }

    #[test]
    fn marks_are_no_part_of_words() {
        assert_eq!(
            plain("<a id=\"x\"></a>[`no-stx`](#no-stx) and *a < b* [c]"),
            "no-stx and a < b [c]"
        );
    }
}
