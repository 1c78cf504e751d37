//! Passages for a terminal: Markdown with wrapped lines and with tables in columns.
//!
//! A table that does not fit becomes a list, one line a cell. Widths are counted in characters.

use crate::html::{Target, parsed};
use crate::{Book, Passage};
use pulldown_cmark::{Event, HeadingLevel, Tag, TagEnd};

/// Begin and end of emphasis, of code and of their absence, as a terminal takes them.
#[derive(Debug, Clone, Copy)]
pub struct Styles {
    pub bold: [&'static str; 2],
    pub code: [&'static str; 2],
}

/// Without colours: code is between backquotes.
pub const PLAIN: Styles = Styles {
    bold: ["", ""],
    code: ["`", "`"],
};

/// Marks in text that is not laid out yet, which have no width: begin and end of bold, begin and end of code.
const BOLD: [char; 2] = ['\x01', '\x02'];
const CODE: [char; 2] = ['\x03', '\x04'];
/// Narrowest column that a table is wrapped to.
const NARROWEST: usize = 14;
/// Characters between two columns.
const GAP: usize = 2;

/// A list that is open.
struct List {
    /// Number of the next item of an ordered one.
    next: Option<u64>,
}

struct Layout<'a> {
    book: &'a Book,
    passage: &'a Passage<'a>,
    width: usize,
    /// Whether code keeps its backquotes.
    quotes: bool,
    out: String,
    /// The present paragraph, heading or cell.
    text: String,
    lists: Vec<List>,
    /// Mark of the item that begins.
    mark: String,
    /// Address of the open link, shown after its words.
    after_link: String,
    in_code: bool,
    table: Vec<Vec<String>>,
    in_table: bool,
}

impl Passage<'_> {
    /// The passage in lines of at most this width, as far as code allows.
    pub fn terminal(&self, book: &Book, width: usize, styles: &Styles) -> String {
        let mut layout = Layout {
            book,
            passage: self,
            width: width.max(40),
            quotes: styles.code[0] == "`",
            out: String::new(),
            text: String::new(),
            lists: Vec::new(),
            mark: String::new(),
            after_link: String::new(),
            in_code: false,
            table: Vec::new(),
            in_table: false,
        };
        for event in parsed(&self.text) {
            layout.event(event);
        }
        let text = layout.out.trim_end().to_owned() + "\n";
        let marks = BOLD.into_iter().zip(styles.bold);
        let marks = marks.chain(CODE.into_iter().zip(styles.code));
        marks.fold(text, |text, (mark, style)| {
            match layout.quotes && CODE.contains(&mark) {
                true => text.replace(mark, ""),
                false => text.replace(mark, style),
            }
        })
    }
}

impl Layout<'_> {
    #[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
    fn event(&mut self, event: Event<'_>) {
        match event {
            Event::Start(tag) => self.start(tag),
            Event::End(tag) => self.end(tag),
            Event::Text(text) if self.in_code => {
                let indent = " ".repeat(self.indent() + 4);
                for line in text.lines() {
                    self.out += &format!("{indent}{line}\n").replace(&format!("{indent}\n"), "\n");
                }
            }
            Event::Text(text) => self.text += &text,
            Event::Code(code) => {
                let quote = if self.quotes { "`" } else { "" };
                self.text += &format!("{}{quote}{code}{quote}{}", CODE[0], CODE[1]);
            }
            Event::SoftBreak => self.text.push(' '),
            Event::HardBreak => self.text.push('\n'),
            Event::Rule => self.out += "---\n\n",
            _ => {}
        }
    }

    #[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
    fn start(&mut self, tag: Tag<'_>) {
        match tag {
            Tag::Heading { level, .. } => self.text = format!("{}{} ", BOLD[0], "#".repeat(rank(level))),
            Tag::Strong => self.text.push(BOLD[0]),
            Tag::CodeBlock(_) => {
                self.flush();
                self.in_code = true;
            }
            Tag::List(next) => {
                self.flush();
                self.lists.push(List { next });
            }
            Tag::Item => {
                self.mark = match self.lists.last_mut() {
                    Some(List { next: Some(number) }) => {
                        *number += 1;
                        format!("{}. ", *number - 1)
                    }
                    _ => "- ".to_owned(),
                }
            }
            Tag::Table(_) => {
                self.flush();
                self.table.clear();
                self.in_table = true;
            }
            Tag::TableHead | Tag::TableRow => self.table.push(Vec::new()),
            Tag::Link { dest_url, .. } => {
                self.after_link = match self.book.target(self.passage.page, &dest_url) {
                    Target::Outside(address) => format!(" <{address}>"),
                    // In a table the words have to do, as they have for a section that has them as its name.
                    Target::Topic(topic) if !self.in_table && !dest_url.contains('#') => {
                        format!(" ({topic})")
                    }
                    Target::Topic(_) | Target::File => String::new(),
                };
            }
            _ => {}
        }
    }

    #[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
    fn end(&mut self, tag: TagEnd) {
        match tag {
            TagEnd::Heading(_) => {
                self.text.push(BOLD[1]);
                self.flush();
                self.out.push('\n');
            }
            TagEnd::Paragraph => {
                self.flush();
                self.out.push('\n');
            }
            TagEnd::Strong => self.text.push(BOLD[1]),
            TagEnd::CodeBlock => {
                self.in_code = false;
                self.out.push('\n');
            }
            TagEnd::Item => self.flush(),
            TagEnd::List(_) => {
                self.lists.pop();
                if !self.out.ends_with("\n\n") {
                    self.out.push('\n');
                }
            }
            TagEnd::Link => {
                let address = std::mem::take(&mut self.after_link);
                if !self.text.ends_with(address.trim_matches([' ', '<', '>'])) || address.is_empty() {
                    self.text += &address;
                }
            }
            TagEnd::TableCell => {
                let cell = std::mem::take(&mut self.text);
                if let Some(row) = self.table.last_mut() {
                    row.push(cell);
                }
            }
            TagEnd::Table => {
                self.in_table = false;
                let rows = std::mem::take(&mut self.table);
                self.out += &table(&rows, self.width, self.indent());
                self.out.push('\n');
            }
            _ => {}
        }
    }

    /// Columns by which lists indent.
    fn indent(&self) -> usize {
        let marks = self.lists.iter();
        marks.map(|list| if list.next.is_some() { 3 } else { 2 }).sum()
    }

    /// Writes the open paragraph.
    fn flush(&mut self) {
        let text = std::mem::take(&mut self.text);
        if text.trim().is_empty() {
            return;
        }
        let mark = std::mem::take(&mut self.mark);
        let indent = self.indent();
        let first = " ".repeat(indent.saturating_sub(mark.len())) + &mark;
        for (at, line) in wrapped(&text, self.width.saturating_sub(indent))
            .iter()
            .enumerate()
        {
            let margin = if at == 0 { &first } else { &" ".repeat(indent) };
            self.out += &format!("{margin}{line}\n");
        }
    }
}

/// The number of a level.
fn rank(level: HeadingLevel) -> usize {
    level as usize
}

/// Characters that a terminal shows of a text.
fn width(text: &str) -> usize {
    let is_mark = |letter: &char| BOLD.contains(letter) || CODE.contains(letter);
    text.chars().filter(|letter| !is_mark(letter)).count()
}

/// Lines of at most this many characters; a longer word is cut.
fn wrapped(text: &str, most: usize) -> Vec<String> {
    let most = most.max(1);
    let mut lines = Vec::new();
    for paragraph in text.split('\n') {
        let mut line = String::new();
        for word in paragraph.split(' ').filter(|word| !word.is_empty()) {
            if !line.is_empty() && width(&line) + 1 + width(word) > most {
                lines.push(std::mem::take(&mut line));
            }
            if !line.is_empty() {
                line.push(' ');
            }
            let mut word = word.to_owned();
            while width(&word) > most {
                let at = word.char_indices().nth(most).map_or(word.len(), |(at, _)| at);
                let rest = word.split_off(at);
                lines.push(std::mem::replace(&mut word, rest));
            }
            line += &word;
        }
        lines.push(line);
    }
    lines
}

/// A table in columns, or as a list if its columns would be too narrow.
fn table(rows: &[Vec<String>], most: usize, indent: usize) -> String {
    let most = most.saturating_sub(indent);
    let margin = " ".repeat(indent);
    let Some(widths) = column_widths(rows, most) else {
        return list(rows, most, &margin);
    };
    let mut out = String::new();
    let mut line = |cells: Vec<String>| {
        let padded = cells.iter().zip(&widths).map(|(cell, wide)| {
            let blanks = wide.saturating_sub(width(cell));
            format!("{cell}{}", " ".repeat(blanks + GAP))
        });
        out += &format!("{margin}{}\n", padded.collect::<String>().trim_end());
    };
    for (at, row) in rows.iter().enumerate() {
        let cells: Vec<Vec<String>> = row
            .iter()
            .zip(&widths)
            .map(|(cell, wide)| wrapped(cell, *wide))
            .collect();
        let height = cells.iter().map(Vec::len).max().unwrap_or(0);
        for number in 0..height {
            let part = |cell: &Vec<String>| cell.get(number).cloned().unwrap_or_default();
            line(cells.iter().map(part).collect());
        }
        if at == 0 {
            line(widths.iter().map(|wide| "-".repeat(*wide)).collect());
        }
    }
    out
}

/// Widths of the columns: each has its longest word, and those that need more share the rest. `None` if too little is left.
fn column_widths(rows: &[Vec<String>], most: usize) -> Option<Vec<usize>> {
    let columns = rows.first()?.len();
    let widest = |column: usize, measure: fn(&str) -> usize| {
        let cells = rows.iter().filter_map(move |row| row.get(column));
        cells.map(|cell| measure(cell)).max().unwrap_or(0)
    };
    let longest_word = |cell: &str| cell.split([' ', '\n']).map(width).max().unwrap_or(0);
    // A column with its least width, and what it needs besides.
    let mut parts: Vec<(usize, usize, usize)> = (0..columns)
        .map(|column| {
            let least = widest(column, longest_word);
            (column, least, widest(column, width).saturating_sub(least))
        })
        .collect();
    let least: usize = parts.iter().map(|(_, least, _)| least + GAP).sum();
    let mut left = (most + GAP).checked_sub(least)?;
    parts.sort_by_key(|(_, _, more)| *more);
    for (done, (_, wide, more)) in parts.iter_mut().enumerate() {
        let given = (*more).min(left / (columns - done));
        *wide += given;
        left -= given;
        if given < *more && *wide < NARROWEST {
            return None;
        }
    }
    parts.sort_unstable();
    Some(parts.into_iter().map(|(_, wide, _)| wide).collect())
}

/// A table as a list: of each row the heading and the text of each cell.
fn list(rows: &[Vec<String>], most: usize, margin: &str) -> String {
    let Some((head, rows)) = rows.split_first() else {
        return String::new();
    };
    let mut out = String::new();
    for row in rows {
        for (at, (name, cell)) in head.iter().zip(row).enumerate() {
            let begin = if at == 0 { "- " } else { "  " };
            for (number, line) in wrapped(&format!("{name}: {cell}"), most.saturating_sub(4))
                .iter()
                .enumerate()
            {
                let begin = if number == 0 { begin } else { "    " };
                out += &format!("{margin}{begin}{line}\n");
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::book;

    fn shown(markdown: &str, width: usize, styles: &Styles) -> String {
        let page = book().page("reference/alarms").unwrap();
        let text = markdown.to_owned();
        let passage = Passage {
            text,
            ..page.passage()
        };
        passage.terminal(book(), width, styles)
    }

    #[test]
    fn lines_are_wrapped_and_links_name_their_pages() {
        let text = "## Two\n\nSee [Status replies](protocol/status.md) and **`this`**, which is\nlong enough.\n\n- one\n- two\n";
        assert_eq!(
            shown(text, 44, &PLAIN),
            "## Two\n\nSee Status replies\n(reference/protocol/status) and `this`,\nwhich is long enough.\n\n- one\n- two\n"
        );
    }

    #[test]
    fn tables_have_columns_and_a_wide_one_is_a_list() {
        let text = "| A | Meaning |\n|---|---|\n| `x \\| y` | one two three four five six seven |\n";
        assert_eq!(
            shown(text, 40, &PLAIN),
            "A        Meaning\n-------  -------------------------------\n`x | y`  one two three four five six\n         seven\n"
        );
        let text = "| A | B | C | D | E |\n|---|---|---|---|---|\n| first first | second second | third third | fourth fourth | fifth |\n";
        assert!(shown(text, 40, &PLAIN).starts_with("- A: first first\n  B: second second\n"));
    }

    #[test]
    fn styles_replace_marks() {
        let styles = Styles {
            bold: ["<b>", "</b>"],
            code: ["<c>", "</c>"],
        };
        assert_eq!(shown("**a** `b`", 80, &styles), "<b>a</b> <c>b</c>\n");
        assert_eq!(shown("```\nx\n\ny\n```\n", 80, &styles), "    x\n\n    y\n");
    }

    /// No page loses words, and none is wider than asked for, other than in code blocks.
    #[test]
    fn every_page_is_laid_out() {
        for page in book().pages() {
            let text = page.passage().terminal(book(), 80, &PLAIN);
            for line in text.lines().filter(|line| !line.starts_with("    ")) {
                assert!(width(line) <= 80, "{}: {line}", page.path);
            }
            assert!(text.contains(&page.sections[0].heading), "{}", page.path);
        }
    }
}
